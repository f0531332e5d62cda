//! How more UAVs begin than whole missions are flown of in a test.

use skein_netsim::Prepared;
use skein_netsim::swarm::Swarm;
use skein_scenario::{Overrides, open};

/// Flies the first seconds of so many: after 15 s the plans of all together list each open cell
/// once, but for a few of which somebody idle has just relieved their owner, and no rule is broken.
fn begins_well(scenario: &str, peers: u16, seconds: u64) {
    let over = Overrides {
        peers: Some(peers),
        ..Overrides::default()
    };
    let scenario = open(Some(scenario), &over).unwrap();
    let cells = scenario.geometry.coverage_loop.cells().to_vec();
    let prepared = Prepared::with_geometry(scenario.spec, scenario.geometry);
    let mut swarm = Swarm::new(&prepared, 1, Vec::new(), false);
    assert!(swarm.run_until(15_000), "it has not ended");
    let ids = prepared.spec.uavs.iter().map(|u| u.id);
    let views: Vec<_> = ids.filter_map(|id| swarm.view(id)).collect();
    assert_eq!(views.len(), usize::from(peers));
    let mut relieved = 0;
    for (c, cell) in (0..).zip(&cells) {
        let covered = views.iter().any(|v| v.covered.contains(c));
        let planned = views.iter().flat_map(|v| v.plan.iter().zip(&v.stamps));
        let listed = planned.filter(|(p, _)| **p == c);
        let takes: Vec<u16> = listed.map(|(_, stamp)| stamp.take).collect();
        assert!(
            !cell.needed || covered || !takes.is_empty(),
            "cell {c} of {peers} UAVs is listed by nobody"
        );
        let begun = takes.iter().filter(|take| **take == 1).count();
        assert!(begun <= 1, "{begun} of {peers} UAVs begin with cell {c}");
        relieved += takes.len().saturating_sub(1);
    }
    assert!(
        relieved * 100 <= cells.len(),
        "{relieved} of {} cells are listed twice",
        cells.len()
    );
    assert!(swarm.run_until(seconds * 1000), "it has not ended");
    let broken = &swarm.checker().found.counts;
    assert!(broken.is_empty(), "{peers} UAVs: {broken:?}");
}

#[test]
fn a_hundred_and_twenty_eight_from_four_places_begin_at_once_within_the_share() {
    begins_well("swarm_100", 128, 40);
}

#[test]
fn as_many_in_one_earshot_begin_at_once_within_the_share() {
    begins_well("helsinki", 128, 40);
}

#[test]
fn the_most_that_there_may_be_begin_at_once_within_the_share() {
    begins_well("helsinki", 255, 16);
}
