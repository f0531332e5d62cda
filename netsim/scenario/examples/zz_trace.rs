//! temp
use skein_netsim::prepared::Prepared;
use skein_netsim::runs::{Wanted, Watch, failure_free_makespan_ms, faults_of, watched};
use skein_netsim::swarm::Swarm;
use skein_scenario::{Overrides, open};
fn main() {
    let a: Vec<String> = std::env::args().skip(1).collect();
    let n: u16 = a[0].parse().unwrap();
    let seed: u64 = a[1].parse().unwrap();
    let (from, to): (u64, u64) = (a[2].parse().unwrap(), a[3].parse().unwrap());
    let ids: Vec<u16> = a[4].split(',').map(|s| s.parse().unwrap()).collect();
    let every: u64 = a.get(5).map_or(1000, |s| s.parse().unwrap());
    let over = Overrides {
        peers: Some(n),
        ..Overrides::default()
    };
    let prepared = Prepared::new(open(Some("volume"), &over).unwrap().spec);
    let free = failure_free_makespan_ms(&prepared);
    let (prepared, faults) = faults_of(&prepared, seed, Some(free));
    for f in &faults {
        println!("{f:?}");
    }
    let mut look = |s: &Swarm| {
        let t = s.now_ms();
        if t < from || t > to {
            return;
        }
        let mut line = format!("{t} ");
        for id in &ids {
            if let Some(w) = s.why(*id) {
                if let Some(f) = w.flight {
                    let work = w.work.as_ref();
                    line += &format!(
                        "| {id}: {:.0},{:.0} h{:.1} rev {} {} open {} ",
                        f.east_m,
                        f.north_m,
                        f.height_m,
                        work.map_or(0, |w| w.revision),
                        work.map_or("", |w| w.state.as_str()),
                        work.map_or(0, |w| w.open_cells)
                    );
                }
            } else {
                line += &format!("| {id} -- ");
            }
        }
        println!("{line}");
    };
    let mut w = Watch {
        every_ms: every,
        look: &mut look,
    };
    let o = watched(&prepared, seed, faults, Wanted::default(), Some(&mut w));
    for v in o.violations() {
        println!("{} {} {:?} {}", v.check, v.time_ms, v.peer, v.text);
    }
}
