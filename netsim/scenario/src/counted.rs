//! Built-in trials whose missions count vehicles, or look at accidents: what comes of that.

use crate::{Overrides, load_builtin};
use skein_netsim::Prepared;
use skein_netsim::runs::{Wanted, run};
use skein_netsim::swarm::Outcome;

fn flown(name: &str, uavs: u16, seed: u64) -> Outcome {
    let over = Overrides {
        peers: Some(uavs),
        ..Overrides::default()
    };
    let prepared = Prepared::new(load_builtin(name, &over).unwrap().spec);
    let mut faults = prepared.spec.faults.clone();
    // Who is lost by plan is one of those who are there.
    faults.retain(|f| {
        use skein_netsim::fault::Fault;
        !matches!(f.fault, Fault::Kill { peer } if peer > uavs || uavs == 1)
    });
    let outcome = run(&prepared, seed, faults, Wanted::default());
    let broken = outcome.violations();
    assert!(
        outcome.report.passed,
        "{name} {uavs}: {:?} {broken:?}",
        outcome.report.reasons
    );
    outcome
}

#[test]
fn crossings_are_counted_as_the_judge_counts_them_by_one_uav_and_by_many() {
    for uavs in [1, 3, 8] {
        let outcome = flown("crossings", uavs, 11);
        let sites = &outcome.report.counts;
        assert_eq!(sites.len(), 4);
        let known: u32 = sites.iter().map(|s| s.known.passed).sum();
        let truly: u32 = sites.iter().map(|s| s.passed_in_pictures).sum();
        // The ground station knows what was counted, but for what a UAV took with it.
        let counted: u32 = sites.iter().map(|s| s.counted.0).sum();
        assert!(known <= counted && known + 4 >= counted, "{sites:?}");
        assert!(truly > 10 && f64::from(known.abs_diff(truly)) < 6.0 + 0.1 * f64::from(truly));
        let holds = sites.iter().filter(|s| s.holds() == Some(true)).count();
        assert!(holds >= 3, "{sites:?}");
        for s in sites {
            let (says, is) = (s.known.speed_mps().unwrap(), s.speed_mps.unwrap());
            assert!((says - is).abs() < 1.5, "{}", s.line());
        }
    }
}

#[test]
fn car_parks_are_told_as_full_as_they_are() {
    for uavs in [1, 3, 8] {
        let outcome = flown("parking", uavs, 12);
        for lot in &outcome.report.counts {
            let (seen, truly) = (lot.known.standing.unwrap(), lot.stood_then.unwrap());
            assert!(seen.vehicles.abs_diff(truly) <= 1, "{}", lot.line());
            assert!(lot.capacity > truly && truly > 5, "{}", lot.line());
        }
    }
}

#[test]
fn an_accident_is_looked_at_in_time_and_the_others_go_on() {
    for uavs in [1, 3, 8] {
        let outcome = flown("accident", uavs, 13);
        let report = &outcome.report;
        let asked = report.tasks.iter().filter(|t| t.is_look);
        for task in asked {
            assert!(task.seen_ms.is_some(), "{}", task.line());
            assert!(task.flown_by.len() == 1 || uavs == 1, "{task:?}");
        }
        let [lorry] = &report.detections[..] else {
            panic!("{:?}", report.detections);
        };
        assert!(lorry.looks == "lorry" && !lorry.to_follow, "{lorry:?}");
        assert!(report.counts.iter().all(|s| s.known.passed > 0));
    }
}

#[test]
fn streets_are_measured_and_hinted_by_one_uav_and_by_many() {
    for uavs in [1, 3, 8] {
        let outcome = flown("streets", uavs, 11);
        let told = outcome.report.streets.as_ref().unwrap();
        // The ground station knows of each street.
        assert_eq!(told.watched.0, told.stretches, "{:?}", told.lines());
        let (hold, of) = told.density_holds;
        assert!(
            of >= 60 && f64::from(hold) >= 0.8 * f64::from(of),
            "{told:?}"
        );
        let (hold, of) = told.speed_holds;
        assert!(
            of >= 20 && f64::from(hold) >= 0.8 * f64::from(of),
            "{told:?}"
        );
        assert!(
            told.turns > 20 && told.turns_wrong * 5 < told.turns,
            "{told:?}"
        );
        // Round the jam, through which the shortest way leads.
        let hint = &told.hints[0];
        assert!(
            hint.told.contains("Pohjoisesplanadi is blocked"),
            "{hint:?}"
        );
        assert!(hint.true_s * 2.0 < hint.shortest_s, "{}", hint.line());
        assert!(told.hints.iter().all(|h| h.true_s < 1.3 * h.best_s + 20.0));
    }
}
