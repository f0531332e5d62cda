//! The built-in trial that is flown in height layers, with one UAV and with many, to its verdict.

#![allow(clippy::float_cmp, reason = "heights are told as they were stated")]

use crate::{Overrides, load_builtin};
use skein_netsim::Prepared;
use skein_netsim::runs::{Wanted, run};
use skein_netsim::swarm::Swarm;
use skein_peer::diagram::StateGoal;

fn prepared(uavs: u16) -> Prepared {
    let over = Overrides {
        peers: Some(uavs),
        ..Overrides::default()
    };
    Prepared::new(load_builtin("volume", &over).unwrap().spec)
}

#[test]
fn a_volume_is_seen_from_each_layer_by_one_uav_and_by_many() {
    for uavs in [1, 2, 3, 8, 20] {
        let prepared = prepared(uavs);
        let faults = prepared.spec.faults.clone();
        let outcome = run(&prepared, 4, faults, Wanted::default());
        let report = &outcome.report;
        assert!(
            report.passed,
            "{uavs}: {:?} {:?}",
            report.reasons,
            outcome.violations()
        );
        let layers = &report.layers;
        let heights: Vec<f64> = layers.iter().map(|l| l.height_m).collect();
        assert_eq!(heights, [60.0, 160.0, 260.0]);
        // Between two layers lie 100 m, which the fastest climbs in 28 s less its own layer.
        let seen: Vec<u64> = layers.iter().filter_map(|l| l.seen_ms).collect();
        assert!(
            seen.len() == 3 && seen.windows(2).all(|s| s[0] + 20_000 < s[1]),
            "{seen:?}"
        );
        assert!(report.revisit_ms.is_none());
        // Whom one passes it passes by half a slot or more.
        assert!(
            report.nearest_approach_m.is_none_or(|m| m >= 2.2),
            "{report:?}"
        );
        let told = report.to_string();
        assert!(
            told.contains("layer      160 m (lap 2): all seen at"),
            "{told}"
        );
    }
}

#[test]
fn a_person_is_told_which_layer_is_flown_and_who_is_on_the_way() {
    let mut swarm = Swarm::new(&prepared(3), 4, Vec::new(), false);
    let (mut on_the_way, mut highest_m) = (0, 0.0_f64);
    while swarm.run_until(swarm.now_ms() + 1_000) {
        let Some(why) = swarm.why(3) else { continue };
        let (Some(flight), Some(work)) = (why.flight, &why.work) else {
            continue;
        };
        let layer = work.layer.unwrap();
        highest_m = highest_m.max(flight.height_m);
        let low_m = f64::from(layer.layer.height_mm) / 1e3;
        match layer.next_mm {
            None => assert!(
                (low_m - 1.0..low_m + 12.0).contains(&flight.height_m),
                "{why}"
            ),
            Some(_) => on_the_way += 1,
        }
        let says = format!(
            "layer     {} of 3, from {low_m:.0} m up",
            layer.layer.nth + 1
        );
        assert!(why.to_string().contains(&says), "{why}");
    }
    assert!(
        on_the_way > 40 && highest_m > 269.0,
        "{on_the_way} {highest_m}"
    );
}

/// The diagram says that it is a volume, and flies nothing else.
#[test]
fn a_volume_has_a_diagram_of_its_own() {
    let diagram = crate::diagram::builtin("volume").unwrap();
    let layer = diagram.states.iter().find(|s| s.goal == StateGoal::Section);
    assert_eq!(layer.unwrap().behaviour.dimension, Some(3));
    assert_eq!(crate::diagram::open("volume").unwrap(), diagram);
    let volume = load_builtin("volume", &Overrides::default())
        .unwrap()
        .spec
        .mission;
    assert_eq!((volume.dimension(), volume.further_laps), (3, 2));
    let text = crate::builtin_text("patrol").unwrap();
    let flat = text.replace("laps: 5,", "mission: { diagram: \"volume\" },");
    let files = crate::builtin::files();
    let why = crate::parse_with("p.json5", &flat, &files, &Overrides::default());
    let why = why.unwrap_err().to_string();
    assert!(
        why.contains(
            "flies what has dimension 3, and the mission asks to see what has dimension 2"
        ),
        "{why}"
    );
}
