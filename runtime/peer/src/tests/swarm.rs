//! How a few peers share, lose and take over.

use super::{add, covered, point, with_operator};
use crate::output::{Report, Status};
use crate::protocol::runs::unpack;
use crate::testing::{GROUND_STATION, Harness, mission};
use crate::why::Reason;
use crate::wire::codec::Body;
use crate::wire::kinds::Kind;
use crate::wire::message::{Activity, MissionStatus};
use crate::{Input, PeerId};
use skein_behaviors::Order;
use skein_geometry::frame::{Point, Pose};
use std::collections::{BTreeMap, BTreeSet};

/// Whether each open cell is in the plan of exactly one of these peers.
fn divided(h: &Harness, ids: &[u16]) -> bool {
    let plans = ids.iter().map(|id| h.beliefs(*id));
    let plans: Vec<_> = plans.collect();
    let open = plans[0].covered.complement();
    let lists = |c: u16| plans.iter().filter(move |b| b.plan.contains(&c));
    !open.is_empty() && open.iter().all(|c| lists(c).count() == 1)
}

#[test]
fn two_share_an_area_in_one_round_and_finish_it() {
    let mut h = Harness::started(2, mission(1, 6, 4));
    assert!(h.run_until(20, |h| divided(h, &[1, 2])));
    assert_eq!(h.beliefs(1).epoch, h.beliefs(2).epoch);
    assert_eq!(h.beliefs(1).epoch.counter, 1);
    assert!(h.run_until(200, |h| h.beliefs(1).finished && h.beliefs(2).finished));
}

#[test]
fn everybody_flies_a_section_within_five_seconds_before_any_round() {
    let mut h = Harness::started(5, mission(1, 10, 8));
    assert!(h.run_until(5, |h| (1..=5).all(|id| !h.beliefs(id).plan.is_empty())));
    let bids: usize = (1..=5).map(|id| h.count_said(id, Kind::Bid)).sum();
    assert_eq!(bids, 0);
    // A round divides anew what everybody took.
    assert!(h.run_until(15, |h| h.beliefs(1).epoch.counter == 1));
}

/// Where they are close together each leaves to the others what is nearer to them.
#[test]
fn first_sections_of_those_who_know_where_all_are_lie_side_by_side() {
    let mut h = Harness::new(5, mission(1, 10, 8));
    for id in 1..=5 {
        h.seat(id).pose = Pose {
            east_m: 24.0 + 48.0 * f64::from(id),
            north_m: 24.0,
            heading_rad: 0.0,
        };
        h.start(id);
    }
    assert!(h.run_until(5, |h| (1..=5).all(|id| !h.beliefs(id).plan.is_empty())));
    let plans: Vec<u16> = (1..=5).flat_map(|id| h.beliefs(id).plan).collect();
    let distinct: BTreeSet<u16> = plans.iter().copied().collect();
    assert!(distinct.len() > 70, "{} of {}", distinct.len(), plans.len());
}

#[test]
fn twelve_share_an_area_and_take_over_without_a_round() {
    let mut h = Harness::started(12, mission(1, 16, 12));
    let all: Vec<u16> = (1..=12).collect();
    assert!(h.run_until(15, |h| divided(h, &all)));
    h.stop(5);
    let left: Vec<u16> = all.into_iter().filter(|id| *id != 5).collect();
    assert!(h.run_until(40, |h| divided(h, &left)));
    assert!(h.run_until(300, |h| left.iter().all(|id| h.beliefs(*id).finished)));
    let bids: usize = left.iter().map(|id| h.count_said(*id, Kind::Bid)).sum();
    assert_eq!(bids, 0);
}

/// Of ten, seven have fuel for hardly a cell: they may plan, and take nothing. The others do not
/// wait for them longer than it takes for the turn of each to come.
#[test]
fn what_the_idle_cannot_fly_is_taken_by_who_has_something_to_fly() {
    let mut h = Harness::started(10, mission(1, 16, 12));
    let all: Vec<u16> = (1..=10).collect();
    let open = |h: &Harness| {
        let beliefs: Vec<_> = all.iter().map(|id| h.beliefs(*id)).collect();
        let listed: BTreeSet<u16> = beliefs.iter().flat_map(|b| b.plan.clone()).collect();
        let covered = |c: u16| beliefs.iter().any(|b| b.covered.contains(c));
        let cells = (0..16 * 12).filter(|c| !covered(*c) && !listed.contains(c));
        cells.count()
    };
    let (mut orphaned, mut idle) = (Vec::new(), Vec::new());
    // 3 T of listening, 1.5 T before a first section.
    for _ in 0..20 {
        h.run_s(1);
        // A few seconds to spend, all the time.
        for id in 4..=10 {
            let spendable_s = f64::from(h.beliefs(id).spendable_ms) / 1000.0;
            h.seat(id).fuel_s += 5.0 - spendable_s;
        }
        orphaned.push(open(&h));
        let plans = all.iter().filter(|id| h.beliefs(**id).plan.is_empty());
        idle.push(plans.count());
    }
    assert!(all.iter().all(|id| h.beliefs(*id).able));
    // Nearly all of it waits for somebody, and they have nothing to fly.
    assert!(orphaned[10] > 100 && idle[10] >= 4, "{orphaned:?} {idle:?}");
    // From 5 s on 2 T' and W0, which is 5 T', until all idle ones had their turn; half of W0
    // for those who are there sooner, and what it takes to write it, several times.
    assert!(orphaned[6] > 60, "{orphaned:?}");
    assert_eq!(orphaned[17], 0, "{orphaned:?}");
}

#[test]
fn who_hears_only_a_part_of_a_roster_takes_only_its_own_part_of_the_loop() {
    let mut h = Harness::with_roster(12, mission(1, 16, 12));
    // Two halves that do not hear each other.
    for a in 1..=6 {
        for b in 7..=12 {
            h.link(a, b).cut = true;
            h.link(b, a).cut = true;
        }
    }
    let all: Vec<u16> = (1..=12).collect();
    all.iter().for_each(|id| h.start(*id));
    assert!(h.run_until(6, |h| divided(h, &all)));
    h.run_s(15);
    let plans: Vec<u16> = all.iter().flat_map(|id| h.beliefs(*id).plan).collect();
    let distinct: BTreeSet<u16> = plans.iter().copied().collect();
    // Nobody takes what others fly out of earshot.
    assert_eq!(plans.len(), distinct.len());
    // Whom nobody hears until its part would be flown is not there.
    assert!(h.run_until(600, |h| (1..=6).all(|id| h.beliefs(id).finished)));
}

#[test]
fn of_a_roster_who_never_came_is_replaced() {
    let mut h = Harness::with_roster(12, mission(1, 16, 12));
    let there: Vec<u16> = (1..=11).collect();
    there.iter().for_each(|id| h.start(*id));
    assert!(h.run_until(600, |h| there.iter().all(|id| h.beliefs(*id).finished)));
}

#[test]
fn who_hears_nobody_of_many_and_has_nothing_to_fly_goes_home() {
    // Far more UAVs than there is work for; and as few as are many.
    for many in [14, 9] {
        let mut h = Harness::with_roster(many, mission(1, 6, 4));
        (1..=many).for_each(|id| h.start(id));
        let idle = |h: &Harness| h.beliefs(many).plan.is_empty() && !h.beliefs(many).finished;
        let others = usize::from(many - 1);
        assert!(h.run_until(12, |h| h.beliefs(many).peers.len() == others && idle(h)));
        h.isolate(many, true);
        h.run_s(4);
        let base = Point::new(-60.0, -60.0);
        let before_m = (h.pose(many).position() - base).norm();
        h.run_s(7);
        assert!(idle(&h));
        let after_m = (h.pose(many).position() - base).norm();
        assert!(
            after_m < before_m - 50.0,
            "{many}: {before_m:.0} m, then {after_m:.0} m"
        );
    }
}

/// One is on its way to a place far away and out of reach; nobody else has anything to fly, and
/// whether it was there those will hear where it comes home to.
#[test]
fn of_many_who_wait_for_nobody_who_has_cells_wait_at_the_base() {
    let mut h = Harness::with_roster(12, mission(1, 16, 12));
    h.add_ground_station(Some(mission(1, 16, 12)));
    (1..=12).for_each(|id| h.start(id));
    h.start(GROUND_STATION);
    h.run_s(20);
    add(&mut h, point("far", 5_000.0, 4_000.0));
    let flies = |h: &Harness, id: u16| h.why(id).work.is_some_and(|w| w.reason == Reason::Task);
    assert!(h.run_until(60, |h| (1..=12).any(|id| flies(h, id))));
    let doer = (1..=12).find(|id| flies(&h, *id)).unwrap();
    h.isolate(doer, true);
    let others = (1..=12).filter(|id| *id != doer);
    let others: Vec<u16> = others.collect();
    let idle = |h: &Harness| others.iter().all(|id| h.beliefs(*id).plan.is_empty());
    let seen = |h: &Harness| h.beliefs(GROUND_STATION).covered.is_full();
    assert!(h.run_until(200, |h| seen(h) && idle(h)));
    let base = Point::new(-60.0, -60.0);
    let away_m = |h: &Harness, id: u16| (h.pose(id).position() - base).norm();
    let waits = |h: &Harness, id: u16| flies(h, id) || away_m(h, id) < 100.0;
    let all_wait = |h: &Harness| others.iter().all(|id| waits(h, *id));
    assert!(!all_wait(&h));
    assert!(h.run_until(150, all_wait));
    assert!(others.iter().all(|id| !h.beliefs(*id).finished));
}

#[test]
fn sixty_five_finish_a_small_mission_without_a_round() {
    let mut h = Harness::with_roster(65, mission(1, 12, 8));
    (1..=65).for_each(|id| h.start(id));
    assert!(h.run_until(120, |h| (1..=65).all(|id| h.beliefs(id).finished)));
    let bids: usize = (1..=65).map(|id| h.count_said(id, Kind::Bid)).sum();
    assert_eq!(bids, 0);
}

#[test]
fn who_comes_late_to_many_relieves_somebody() {
    let mut h = Harness::new(12, mission(1, 16, 12));
    let first: Vec<u16> = (1..=11).collect();
    first.iter().for_each(|id| h.start(*id));
    assert!(h.run_until(20, |h| divided(h, &first)));
    h.run_s(10);
    h.start(12);
    assert!(h.run_until(12, |h| h.beliefs(12).plan.len() > 2));
    let all: Vec<u16> = (1..=12).collect();
    assert!(h.run_until(10, |h| divided(h, &all)), "the owner yields");
}

#[test]
fn the_dead_are_found_and_their_cells_taken_over() {
    let mut h = Harness::started(3, mission(1, 8, 6));
    assert!(h.run_until(30, |h| divided(h, &[1, 2, 3])));
    h.stop(3);
    let down = |h: &Harness, id| h.beliefs(id).peers[&PeerId(3)].1 == Status::Down;
    assert!(h.run_until(13, |h| down(h, 1) && down(h, 2)));
    assert!(h.run_until(20, |h| divided(h, &[1, 2])));
    assert!(h.run_until(300, |h| h.beliefs(1).finished && h.beliefs(2).finished));
}

#[test]
fn the_last_of_three_finishes_alone() {
    let mut h = Harness::started(3, mission(1, 6, 4));
    h.run_s(25);
    h.stop(2);
    h.run_s(15);
    h.stop(3);
    assert!(h.run_until(300, |h| h.beliefs(1).finished));
}

#[test]
fn a_partition_works_in_both_halves_and_knows_all_after_it() {
    let mut h = Harness::started(2, mission(1, 6, 4));
    assert!(h.run_until(20, |h| divided(h, &[1, 2])));
    h.isolate(2, true);
    assert!(h.run_until(300, |h| h.beliefs(1).finished && h.beliefs(2).finished));
    h.isolate(2, false);
    let alive =
        |h: &Harness, of: u16, who: u16| h.beliefs(of).peers[&PeerId(who)].1 == Status::Alive;
    assert!(h.run_until(15, |h| alive(h, 1, 2) && alive(h, 2, 1)));
}

#[test]
fn a_returning_peer_gets_a_share_again() {
    let mut h = Harness::started(2, mission(1, 10, 8));
    assert!(h.run_until(20, |h| divided(h, &[1, 2])));
    h.stop(2);
    h.run_s(20);
    h.start(2);
    assert!(h.run_until(60, |h| !h.beliefs(2).plan.is_empty()));
}

#[test]
fn at_thirty_percent_of_loss_all_is_covered() {
    let mut h = Harness::new(3, mission(1, 6, 4));
    for from in 1..=3 {
        for to in 1..=3 {
            h.link(from, to).loss_percent = 30;
            h.link(from, to).delay_ms = 40;
        }
    }
    for id in 1..=3 {
        h.start(id);
    }
    assert!(h.run_until(400, |h| (1..=3).all(|id| h.beliefs(id).finished)));
}

#[test]
fn a_planner_that_never_answers_costs_its_uav_and_not_the_mission() {
    let mut h = Harness::started(2, mission(1, 6, 4));
    h.run_s(4);
    h.seat(1).planner_withholds = true;
    assert!(h.run_until(400, |h| h.beliefs(2).finished));
}

#[test]
fn a_division_that_never_comes_back_is_asked_for_again() {
    let mut h = Harness::started(2, mission(1, 8, 6));
    h.run_s(4);
    h.seat(1).planner_withholds = true;
    h.run_s(20);
    assert!(h.beliefs(1).adoptions == 0 && h.beliefs(2).adoptions > 0);
    h.seat(1).planner_withholds = false;
    assert!(h.run_until(90, |h| h.beliefs(1).adoptions > 0));
}

#[test]
fn a_gone_link_halves_the_silence_before_a_suspicion() {
    let detected_ms = |hint: bool| {
        let mut h = Harness::started(2, mission(1, 6, 4));
        h.run_s(12);
        h.isolate(2, true);
        let neighbour = 2;
        if hint {
            h.feed(
                1,
                Input::LinkHint {
                    neighbour,
                    up: false,
                },
            );
        }
        let from = h.now_ms();
        h.run_s(15);
        let suspect = |(at, r): &(u64, Report)| match r {
            Report::Membership {
                status: Status::Suspect,
                ..
            } => Some(*at - from),
            _ => None,
        };
        h.seat(1).reports.iter().find_map(suspect).unwrap()
    };
    let (without, with) = (detected_ms(false), detected_ms(true));
    assert!((3000..5500).contains(&without), "{without}");
    assert!((1000..3200).contains(&with), "{with}");
}

#[test]
fn a_hint_alone_is_no_verdict() {
    let mut h = Harness::started(2, mission(1, 6, 4));
    h.run_s(12);
    h.feed(
        1,
        Input::LinkHint {
            neighbour: 2,
            up: false,
        },
    );
    h.run_s(20);
    assert_eq!(h.beliefs(1).peers[&PeerId(2)].1, Status::Alive);
}

/// §7: a claim follows within an interval of what was taken, a quarter of one more at most.
#[test]
fn what_is_published_is_what_is_planned() {
    let mut h = Harness::started(3, mission(1, 8, 6));
    let mut before: BTreeMap<u16, [BTreeSet<u16>; 2]> = BTreeMap::new();
    for _ in 0..100 {
        h.run_s(1);
        for id in 1..=3 {
            let plan: BTreeSet<u16> = h.beliefs(id).plan.into_iter().collect();
            let [first, second] = before.entry(id).or_default();
            let of_two_seconds_ago = core::mem::replace(first, second.clone());
            second.clone_from(&plan);
            let plan: BTreeSet<u16> = plan.intersection(&of_two_seconds_ago).copied().collect();
            let cells = h.beliefs(id).covered.capacity();
            let claim = h.seat(id).said.iter().rev().find_map(|(_, _, b)| match b {
                Body::Claim(c) => Some(c.clone()),
                _ => None,
            });
            let Some(claim) = claim else { continue };
            let told: BTreeSet<u16> = unpack(&claim.plan, cells)
                .into_iter()
                .map(|p| p.cell)
                .collect();
            assert!(
                plan.is_subset(&told),
                "{id} flies {plan:?} and says {told:?}"
            );
        }
    }
    assert!(covered(&h, 1) > 12);
}

#[test]
fn the_same_story_gives_the_same_bytes() {
    let story = || {
        let mut h = Harness::started(3, mission(1, 6, 4));
        h.link(1, 2).loss_percent = 20;
        h.run_s(40);
        let said: Vec<_> = (1..=3).flat_map(|id| h.seat(id).said.clone()).collect();
        said
    };
    assert_eq!(story(), story());
}

#[test]
fn a_clock_that_jumps_takes_nobody_for_dead_and_takes_over_nothing() {
    let mut h = Harness::started(3, mission(1, 8, 6));
    assert!(h.run_until(30, |h| divided(h, &[1, 2, 3])));
    h.run_s(5);
    h.isolate(3, true);
    h.run_s(3);
    h.seat(1).clock_ms += 3_600_000;
    h.isolate(3, false);
    let epoch = h.beliefs(1).epoch;
    h.run_s(15);
    assert_eq!(h.beliefs(1).epoch, epoch);
    for id in 1..=3 {
        let down = |(_, r): &(u64, Report)| {
            matches!(
                r,
                Report::Membership {
                    status: Status::Down,
                    ..
                }
            )
        };
        assert!(!h.seat(id).reports.iter().any(down), "of {id}");
    }
}

/// Who stood still does not bid by where it was before: it waits for a percept, for a quarter of
/// a period at most.
#[test]
fn who_stood_still_bids_once_it_knows_where_it_is() {
    let bids = |h: &Harness, id| h.count_said(id, Kind::Bid);
    // Asleep from each of these moments after the loss of another on.
    let mut after_ms = [(); 2].map(|()| BTreeSet::new());
    for (quarters, is_told) in (0..60).flat_map(|q| [(q, false), (q, true)]) {
        let mut h = Harness::started(3, mission(1, 10, 8));
        assert!(h.run_until(30, |h| divided(h, &[1, 2, 3])));
        h.run_s(10);
        h.stop(3);
        let asleep_ms = h.now_ms() + 250 * quarters;
        h.run_until(60, |h| h.now_ms() >= asleep_ms);
        let mine = bids(&h, 1);
        h.seat(1).senses = false;
        h.seat(1).clock_ms += 42_000;
        h.feed(1, Input::Timer);
        let woke_ms = h.now_ms();
        if is_told {
            let percept = h.seat(1).percept_now();
            h.feed(1, Input::Percept(percept));
        }
        h.run_until(1, |h| bids(h, 1) > mine);
        let said = &h.seat(1).said;
        let bid = said
            .iter()
            .find(|(at, _, b)| *at >= woke_ms && b.kind() == Kind::Bid);
        after_ms[usize::from(is_told)].extend(bid.map(|(at, ..)| at - woke_ms));
    }
    let [lost_ms, told_ms] = after_ms.map(|ms| ms.first().copied().unwrap());
    assert!(told_ms < 250 && lost_ms >= 250, "{told_ms} {lost_ms}");
}

/// UAV 3 hears nobody from now on, and is heard.
fn deafen(h: &mut Harness, cut: bool) {
    for from in [1, 2] {
        h.link(from, 3).cut = cut;
    }
}

#[test]
fn who_hears_nobody_flies_for_itself_and_takes_nothing_from_those_who_hear_it() {
    let mut h = Harness::started(3, mission(1, 10, 8));
    assert!(h.run_until(30, |h| divided(h, &[1, 2, 3])));
    deafen(&mut h, true);
    // It suspects itself before it gives up anybody.
    assert!(h.run_until(6, |h| !h.beliefs(3).able));
    let believed = |h: &Harness| h.beliefs(3).peers.values().all(|(_, s)| *s != Status::Down);
    assert!(believed(&h) && h.beliefs(3).adoptions == 1);
    // Then it works alone, on everything, and says so; the others do likewise without it.
    let all_open = |h: &Harness, id: u16| {
        let open = usize::from(h.beliefs(id).covered.complement().count());
        h.beliefs(id).plan.len() >= open
    };
    assert!(h.run_until(20, |h| all_open(h, 3)));
    assert!(h.run_until(20, |h| divided(h, &[1, 2])));
    for _ in 0..40 {
        h.run_s(1);
        let done = h.beliefs(1).finished;
        assert!(done || !h.beliefs(1).plan.is_empty() || !h.beliefs(2).plan.is_empty());
    }
    // Once it hears again it is one of them.
    deafen(&mut h, false);
    assert!(h.run_until(10, |h| h.beliefs(3).able));
    assert!(h.run_until(300, |h| (1..=3).all(|id| h.beliefs(id).finished)));
}

/// A UAV whose sensors stand still, so that all it says is of one place.
#[test]
fn what_is_said_of_a_uav_is_what_it_senses() {
    let mut h = with_operator(2, mission(1, 8, 6));
    h.run_s(30);
    let mut percept = h.seat(1).percept_now();
    h.seat(1).senses = false;
    percept.pose.east_m = 123.456;
    percept.pose.north_m = -78.9;
    percept.pose.heading_rad = 1.2345;
    percept.height_m = 65.4;
    percept.airspeed_mps = 13.2;
    percept.endurance_s = 2222.0;
    h.feed(1, Input::Percept(percept));
    let from_ms = h.now_ms();
    h.run_s(25);
    let last = |h: &mut Harness, id: u16, kind: Kind| {
        let said = h.seat(id).said.iter().rev();
        let mut bodies = said.filter(|(at, _, b)| *at > from_ms && b.kind() == kind);
        bodies.next().map(|(_, _, b)| b.clone()).unwrap()
    };
    let Body::Beacon(beacon) = last(&mut h, 1, Kind::Beacon) else {
        unreachable!()
    };
    assert_eq!((beacon.east_mm, beacon.north_mm), (123_456, -78_900));
    assert_eq!(beacon.heading_e4, 12_345);
    assert!(beacon.able && !beacon.finished && !beacon.ground_station);
    assert_eq!((beacon.eccentricity, beacon.sharers), (1, 3));
    let Body::Heartbeat(heartbeat) = last(&mut h, 1, Kind::Heartbeat) else {
        unreachable!()
    };
    assert_eq!((heartbeat.east_dm, heartbeat.north_dm), (1_234, -789));
    assert_eq!((heartbeat.interval, heartbeat.sharers), (4, 3));
    let state = |h: &mut Harness, id| match last(h, id, Kind::State) {
        Body::State(state) => state,
        other => unreachable!("{other:?}"),
    };
    let (said, b) = (state(&mut h, 1), h.beliefs(1));
    assert_eq!((said.east_mm, said.north_mm), (123_456, -78_900));
    assert_eq!((said.height_mm, said.heading_e4), (65_400, 12_345));
    assert_eq!((said.airspeed_mmps, said.endurance_s), (13_200, 2_222));
    assert_eq!(said.mission, MissionStatus::Active);
    let of_station = state(&mut h, GROUND_STATION);
    assert_eq!(of_station.mission, MissionStatus::Active);
    assert_eq!(said.cells, b.covered.capacity());
    assert!(said.covered > 0 && usize::from(said.covered) <= covered(&h, 1));
    let activity = |h: &mut Harness| {
        h.run_s(12);
        [1, 2, GROUND_STATION].map(|id| state(h, id).activity)
    };
    let all = |flying| [flying, flying, Activity::GroundStation];
    assert_eq!(activity(&mut h), all(Activity::Covering));
    h.order(GROUND_STATION, Order::Hold);
    assert_eq!(activity(&mut h), all(Activity::Holding));
    h.order(GROUND_STATION, Order::ReturnToBase);
    assert_eq!(activity(&mut h), all(Activity::Returning));
    assert!(
        matches!(last(&mut h, GROUND_STATION, Kind::Beacon), Body::Beacon(b) if b.ground_station && !b.able)
    );
}

/// Of fifty in a row, each in earshot of three on either side, a beacon has no room for all: the
/// heartbeats between two beacons tell of others, too.
#[test]
fn a_heartbeat_of_one_of_many_tells_of_others() {
    const N: u16 = 50;
    let mut h = Harness::new(N, mission(1, 16, 12));
    for (a, b) in (1..=N).flat_map(|a| (1..=N).map(move |b| (a, b))) {
        h.link(a, b).cut = a.abs_diff(b) > 3;
    }
    for id in 1..=N {
        h.start(id);
    }
    h.run_s(40);
    let said = &h.seat(1).said;
    let told = said.iter().filter_map(|(_, _, body)| match body {
        Body::Heartbeat(heartbeat) => Some(heartbeat.fresh.iter()),
        _ => None,
    });
    let told: BTreeSet<u16> = told.flatten().map(|fresh| fresh.id).collect();
    assert!(told.len() > 8, "{told:?}");
}

/// §7: claims and states are said again every ten intervals, and up to a quarter of one more.
#[test]
fn claims_and_states_are_said_again_every_ten_intervals() {
    let mut h = Harness::started(2, mission(1, 12, 10));
    h.run_s(30);
    let from_ms = h.now_ms();
    h.run_s(120);
    for kind in [Kind::Claim, Kind::State] {
        let said = h.seat(1).said.iter();
        let said = said.filter(|(at, _, b)| *at > from_ms && b.kind() == kind);
        let at: Vec<u64> = said.map(|(at, ..)| *at).collect();
        assert!(at.len() >= 11, "{kind:?} {at:?}");
        let apart = at.windows(2).map(|w| w[1] - w[0]);
        // What is due is looked at four times a period.
        assert!(apart.clone().all(|ms| ms <= 10_750), "{kind:?} {at:?}");
        if kind == Kind::State {
            assert!(apart.clone().all(|ms| ms >= 9_750), "{at:?}");
        }
    }
}

/// A bid says where its author will be, and which way it flies: who has to turn round needs
/// longer.
#[test]
fn a_bid_says_where_its_author_will_be_and_which_way_it_flies() {
    let mut ways = BTreeSet::new();
    for stopped in 1..=3 {
        let mut h = Harness::started(4, mission(1, 10, 8));
        assert!(h.run_until(30, |h| divided(h, &[1, 2, 3, 4])));
        h.run_s(10);
        h.stop(stopped);
        h.run_s(40);
        let n = h
            .beliefs(4)
            .covered
            .capacity()
            .max(h.beliefs(1).covered.capacity());
        for id in (1..=4).filter(|id| *id != stopped) {
            let mut plan = Vec::new();
            for (_, _, body) in &h.seat(id).said {
                match body {
                    Body::Claim(claim) => plan.clone_from(&claim.plan),
                    Body::Bid(bid) if bid.off_loop.is_empty() && bid.eta_ms > 0 => {
                        let backward = plan.first().is_some_and(|l| l.backward);
                        if plan.iter().all(|l| l.backward == backward) {
                            assert_eq!(bid.backward, backward, "{id}: {bid:?}");
                            // It begins at a boundary of a cell that it told to fly.
                            let beside = [bid.anchor, (bid.anchor + n - 1) % n];
                            let mut told = unpack(&plan, n).into_iter();
                            assert!(told.any(|p| beside.contains(&p.cell)), "{id}: {bid:?}");
                            ways.insert(backward);
                        }
                    }
                    _ => {}
                }
            }
        }
    }
    assert_eq!(ways.len(), 2, "both ways are met");
}
