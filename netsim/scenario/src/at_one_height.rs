//! The default mission with all UAVs at one height, against the same with heights of their own.

use skein_netsim::Prepared;
use skein_netsim::runs::{Wanted, run};

/// The default mission without faults, of eight spread round the loop, on a radio that carries
/// statements too; seconds until all is seen.
fn seen_s(fleet: &str, seed: u64) -> f64 {
    let text = crate::builtin::text("helsinki").unwrap();
    let begins = text.find("\n  faults: [").unwrap();
    let ends = begins + text[begins..].find("\n  ],").unwrap();
    let text = format!("{}\n  faults: [{}", &text[..begins], &text[ends..])
        .replace("slot_step_m: 5,", fleet)
        .replace("launch: \"base\"", "launch: \"spread\"")
        .replace("rate_bps: 64000", "rate_bps: 250000")
        .replace("min_separation_m: 10", "min_separation_m: 0");
    let spec = crate::parse("helsinki.json5", &text, &crate::builtin::files()).unwrap();
    let prepared = Prepared::new(spec);
    let faults = prepared.spec.faults.clone();
    assert!(faults.is_empty());
    let outcome = run(&prepared, seed, faults, Wanted::default());
    let broken = outcome.violations();
    let reasons = &outcome.report.reasons;
    assert!(outcome.report.passed, "{seed}: {reasons:?} {broken:?}");
    let seen_ms = outcome.report.makespan_ms.unwrap();
    #[allow(clippy::cast_precision_loss, reason = "some minutes")]
    let seen_s = seen_ms as f64 / 1e3;
    seen_s
}

#[test]
fn who_fly_at_one_height_keep_apart_and_take_hardly_longer() {
    let mean = |fleet: &str| (41..46).map(|seed| seen_s(fleet, seed)).sum::<f64>() / 5.0;
    let (slots_s, agreed_s) = (mean("slot_step_m: 5,"), mean("separation_m: 30,"));
    assert!(
        agreed_s < 1.12 * slots_s,
        "{agreed_s} s instead of {slots_s} s"
    );
}
