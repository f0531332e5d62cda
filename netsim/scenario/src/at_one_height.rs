//! The default mission with all UAVs at one height, against the same with heights of their own.

use skein_netsim::Prepared;
use skein_netsim::fault::{Fault, TimedFault};
use skein_netsim::runs::{Wanted, failure_free_makespan_ms, faults_of, run};

/// One after the other, as far apart as they need.
const FROM_ONE_PLACE: &str = "launch: \"base\", takeoff_interval_s: 5";

/// The default mission without faults of its own, of eight that begin like this, on a radio of
/// so many bits a second.
fn mission(begin: &str, fleet: &str, rate_bps: u32) -> Prepared {
    let text = crate::builtin::text("helsinki").unwrap();
    let begins = text.find("\n  faults: [").unwrap();
    let ends = begins + text[begins..].find("\n  ],").unwrap();
    let text = format!("{}\n  faults: [{}", &text[..begins], &text[ends..])
        .replace("slot_step_m: 5,", fleet)
        .replace("launch: \"base\"", begin)
        .replace("rate_bps: 64000", &format!("rate_bps: {rate_bps}"))
        .replace("max_uavs: 12", "max_uavs: 8")
        .replace("min_separation_m: 10", "min_separation_m: 0");
    let spec = crate::parse("helsinki.json5", &text, &crate::builtin::files()).unwrap();
    let prepared = Prepared::new(spec);
    assert!(prepared.spec.faults.is_empty());
    prepared
}

/// Seconds until all is seen, on a radio that carries statements too.
fn seen_s(begin: &str, fleet: &str, seed: u64) -> f64 {
    let prepared = mission(begin, fleet, 250_000);
    let outcome = run(&prepared, seed, Vec::new(), Wanted::default());
    let broken = outcome.violations();
    let reasons = &outcome.report.reasons;
    assert!(outcome.report.passed, "{seed}: {reasons:?} {broken:?}");
    let seen_ms = outcome.report.makespan_ms.unwrap();
    #[allow(clippy::cast_precision_loss, reason = "some minutes")]
    let seen_s = seen_ms as f64 / 1e3;
    seen_s
}

/// In storms that once brought two of them nearer than they are to keep.
fn keeps_apart_in_storms(begin: &str, seeds: &[u64]) {
    let prepared = mission(begin, "separation_m: 30,", 1_000_000);
    let free_ms = failure_free_makespan_ms(&prepared);
    for seed in seeds {
        let (struck, faults) = faults_of(&prepared, *seed, Some(free_ms));
        let outcome = run(&struck, *seed, faults, Wanted::default());
        let broken = outcome.violations();
        assert!(broken.iter().all(|v| v.check != "S1"), "{seed}: {broken:?}");
    }
}

/// A computer dies (9000), one stands still (9007), a partition (9003, 9047).
#[test]
fn who_took_off_at_one_place_keep_apart_in_storms() {
    keeps_apart_in_storms("launch: \"base\"", &[9000, 9003, 9007, 9047]);
}

/// Partitions.
#[test]
fn who_began_in_the_air_keep_apart_in_storms() {
    keeps_apart_in_storms("launch: \"spread\"", &[7011, 7031, 7039, 7042]);
}

/// Each loses its computer on the way between two circles, and has it back three seconds later,
/// with an empty disk: what others were promised is flown all the same.
#[test]
fn whose_computer_begins_anew_on_its_way_keep_apart() {
    let prepared = mission("launch: \"base\"", "separation_m: 30,", 1_000_000);
    for seed in 1..6 {
        let restarts = (1..=8u16).flat_map(|peer| {
            let at_ms = 8_000 + 9_000 * u64::from(peer) + 1_300 * seed;
            let restart = Fault::Restart {
                peer,
                fresh_disk: true,
            };
            [
                (at_ms, Fault::KillComputer { peer }),
                (at_ms + 3_000, restart),
            ]
        });
        let faults = restarts.map(|(at_ms, fault)| TimedFault { at_ms, fault });
        let outcome = run(&prepared, seed, faults.collect(), Wanted::default());
        let broken = outcome.violations();
        assert!(outcome.report.passed, "{seed}: {broken:?}");
    }
}

/// By agreement, and by heights of their own: the mean of some seeds, seconds.
fn both_s(begin: &str, seeds: std::ops::Range<u64>) -> (f64, f64) {
    #[allow(clippy::cast_precision_loss, reason = "some seeds")]
    let n = seeds.clone().count() as f64;
    let mean = |fleet: &str| seeds.clone().map(|s| seen_s(begin, fleet, s)).sum::<f64>() / n;
    (mean("separation_m: 30,"), mean("slot_step_m: 5,"))
}

#[test]
fn who_fly_at_one_height_keep_apart_and_take_hardly_longer() {
    let (agreed_s, slots_s) = both_s("launch: \"spread\"", 41..46);
    assert!(
        agreed_s < 1.10 * slots_s,
        "{agreed_s} s instead of {slots_s} s"
    );
}

#[test]
fn who_take_off_at_one_place_by_agreement_take_hardly_longer() {
    let (agreed_s, slots_s) = both_s(FROM_ONE_PLACE, 41..46);
    assert!(
        agreed_s < 1.06 * slots_s,
        "{agreed_s} s instead of {slots_s} s"
    );
}

/// Two with nothing to do circled beside each other, and the last cell behind them took six
/// minutes.
#[test]
fn who_has_nothing_to_do_makes_room_for_who_flies_the_last_cell() {
    let seen_s = seen_s(FROM_ONE_PLACE, "separation_m: 30,", 48);
    assert!(seen_s < 330.0, "{seen_s} s");
}
