//! Missions that count vehicles, run by run: what was counted at each site, beside what truly
//! drove and stood there.
//!
//! `cargo run --release -p skein-scenario --example counts -- crossings,parking 1,2,3,8 0..10 storm`
//!
//! Faults are those of the scenario, `none`, or what the `storm` of the seed draws, each with what
//! the operator of the scenario asks for. At the end of
//! each number of UAVs how often the true volume was in the range that is told with the estimate.

#[path = "shared/campaign.rs"]
mod campaign;
mod shared;

use campaign::{Campaign, Flown, Teller};
use skein_netsim::CountReport;
use skein_netsim::account::secs;
use skein_netsim::account::tasks::TaskReport;
use skein_netsim::fault::{Fault, TimedFault};
use skein_netsim::prepared::Prepared;
use std::process::ExitCode;

/// What the operator of the scenario asks for is asked for in its storms, too.
fn is_request(f: &TimedFault) -> bool {
    matches!(f.fault, Fault::AddTask { .. })
}

fn requests(prepared: &Prepared) -> Vec<TimedFault> {
    let all = prepared.spec.faults.iter();
    all.filter(|f| is_request(f)).cloned().collect()
}

/// All sites of all runs together.
#[derive(Debug, Default)]
struct Totals {
    runs: u32,
    sites: u32,
    holds: u32,
    known: u32,
    counted: u32,
    truly: u32,
    watched_ms: u64,
    pictured_ms: u64,
    all_watched_ms: u64,
    speed_off_mps: Vec<f64>,
    lots: u32,
    lots_exact: u32,
    lots_off: u32,
    lots_known: u32,
    visits_s: Vec<f64>,
    unseen: u32,
}

impl Totals {
    fn add(&mut self, c: &CountReport) {
        if c.is_lot {
            self.lots += 1;
            if let (Some(seen), Some(truly)) = (c.known.standing, c.stood_then) {
                self.lots_known += 1;
                self.lots_exact += u32::from(seen.vehicles == truly);
                self.lots_off = self.lots_off.max(u32::from(seen.vehicles.abs_diff(truly)));
            }
            return;
        }
        if let Some(holds) = c.holds() {
            self.sites += 1;
            self.holds += u32::from(holds);
        }
        self.known += c.known.passed;
        self.counted += c.counted.0;
        self.truly += c.passed_in_pictures;
        self.watched_ms += c.known.watched_ms;
        self.all_watched_ms += c.counted.1;
        self.pictured_ms += c.pictured_ms;
        if let (Some(says), Some(is)) = (c.known.speed_mps(), c.speed_in_pictures_mps) {
            self.speed_off_mps.push(says - is);
        }
    }

    fn visited(&mut self, task: &TaskReport) {
        let Some(ms) = task.seen_ms else {
            self.unseen += u32::from(task.is_look);
            return;
        };
        self.visits_s.push(secs(ms.saturating_sub(task.asked_ms)));
        self.visits_s.sort_by(f64::total_cmp);
    }

    fn line(&self) -> String {
        let visit = |share: usize| self.visits_s.get((self.visits_s.len() * share) / 100);
        let visits = visit(50).zip(visit(95)).zip(self.visits_s.last());
        let visits = visits.map_or_else(String::new, |((p50, p95), most)| {
            let n = self.visits_s.len();
            let unseen = self.unseen;
            format!("; {n} visits after {p50:.1} s, {p95:.1} s (p95), {most:.1} s at most, {unseen} not made")
        });
        let n = f64::from(u32::try_from(self.speed_off_mps.len()).unwrap_or(u32::MAX)).max(1.0);
        let mean = self.speed_off_mps.iter().sum::<f64>() / n;
        let worst = self
            .speed_off_mps
            .iter()
            .fold(0.0_f64, |w, o| w.max(o.abs()));
        format!(
            "{} runs; known {} of {} counted, truly {}; watched {} of {} ms counted, {} ms well in pictures; range holds {} of {}; speed off {mean:.2} m/s, {worst:.2} at most; lots {} of {} known, {} exact, {} off at most{visits}",
            self.runs,
            self.known,
            self.counted,
            self.truly,
            self.watched_ms,
            self.all_watched_ms,
            self.pictured_ms,
            self.holds,
            self.sites,
            self.lots_known,
            self.lots,
            self.lots_exact,
            self.lots_off
        )
    }
}

impl Teller for Totals {
    fn besides(&self, prepared: &Prepared) -> Vec<TimedFault> {
        requests(prepared)
    }

    fn tell(&mut self, flown: &Flown<'_>) {
        let r = &flown.outcome.report;
        self.runs += 1;
        println!("{flown}, {} {:?}", flown.times(), r.reasons);
        for task in &r.tasks {
            println!("  {}", task.line());
            self.visited(task);
        }
        for told in &r.detections {
            println!("  {}", told.line());
        }
        for count in &r.counts {
            println!("  {}", count.line());
            self.add(count);
        }
    }

    fn conclude(&mut self, name: &str, uavs: u16) {
        println!("{name} {uavs} uavs: {}", core::mem::take(self).line());
    }
}

fn main() -> ExitCode {
    match Campaign::of_arguments("crossings,parking", "1,2,3,8") {
        Ok(campaign) => campaign.fly(&mut Totals::default()),
        Err(code) => code,
    }
}
