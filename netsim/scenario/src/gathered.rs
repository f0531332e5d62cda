//! The built-in trial that watches a mass event: what comes of that with one UAV and with many.

use crate::{Overrides, load_builtin};
use skein_netsim::Prepared;
use skein_netsim::runs::{Wanted, run};

#[test]
fn an_event_is_watched_by_one_uav_and_by_many() {
    for uavs in [1, 3] {
        let over = Overrides {
            peers: Some(uavs),
            ..Overrides::default()
        };
        let prepared = Prepared::new(load_builtin("event", &over).unwrap().spec);
        let mut faults = prepared.spec.faults.clone();
        if uavs == 1 {
            faults.clear();
        }
        let outcome = run(&prepared, 11, faults, Wanted::default());
        let (report, broken) = (&outcome.report, outcome.violations());
        assert!(report.passed, "{uavs}: {:?} {broken:?}", report.reasons);
        let told = report.crowd.as_ref().unwrap();
        let lines = told.lines();
        assert_eq!(told.people.looked, told.sectors, "{lines:?}");
        let (hold, of) = told.ranges;
        assert!(of > 1_000 && hold * 20 > of * 19, "{lines:?}");
        let (low, high) = (told.people.low, told.people.high);
        assert!((low..=high).contains(&told.truly_then), "{lines:?}");
        // The jam before the gate is told, after it began, and that it is over.
        let jam = told.alerts.iter().find(|a| a.told.sector_m == 20);
        let jam = jam.unwrap_or_else(|| panic!("{lines:?}"));
        let began_ms = jam.truly_since_ms.unwrap();
        assert!((100_000..500_000).contains(&began_ms), "{lines:?}");
        assert!(jam.told.since_ms >= began_ms && jam.ground_ms.is_some());
        assert!(jam.eased_ms.is_some(), "{lines:?}");
        let off = |mm: i32, m: i32| (mm - 1_000 * m).abs() < 40_000;
        assert!(off(jam.told.east_mm, 133) && off(jam.told.north_mm, 233));
    }
}

#[test]
fn what_becomes_too_dense_has_a_uav_above_it_until_it_has_eased() {
    let prepared = Prepared::new(load_builtin("stage", &Overrides::default()).unwrap().spec);
    let outcome = run(&prepared, 11, Vec::new(), Wanted::default());
    let (report, broken) = (&outcome.report, outcome.violations());
    assert!(report.passed, "{:?} {broken:?}", report.reasons);
    let told = report.crowd.as_ref().unwrap();
    let (watched, lines) = (&told.watched, told.lines());
    assert_eq!(told.people.looked, told.sectors, "{lines:?}");
    let first_ms = *watched.after_ms.first().unwrap();
    assert!(first_ms < 90_000, "{lines:?}");
    // Whoever circles has what is too dense in its picture for most of the time.
    assert!(watched.pictured_ms * 2 > watched.dense_ms, "{lines:?}");
    assert!(
        told.alerts.iter().all(|a| a.eased_ms.is_some()),
        "{lines:?}"
    );
}
