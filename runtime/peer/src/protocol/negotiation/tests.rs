//! The negotiation against claims, bids and clocks set by hand.

use super::*;
use crate::protocol::membership::Membership;
use crate::testing::mission;
use crate::wire::message::{Beacon, CellRun, Claim, ListedRun, Round, Stamp};
use crate::wire::samples;
use skein_flight::coverage::ring::Direction;
use std::sync::Arc;

const T: u64 = 1000;

/// One peer's negotiation over 24 cells, with what it is told of the others.
struct Desk {
    negotiation: Negotiation,
    coverage_loop: Arc<CoverageLoop>,
    now: Time,
    live: LivePeers,
    able_since: Option<Time>,
    held_expired: bool,
    gain_in_sight: bool,
    diameter: u32,
    elsewhere: BTreeMap<u16, Time>,
}

fn member(id: u16) -> Member {
    Member { id, incarnation: 1 }
}

impl Desk {
    /// Peer 1 among `others`, able and steady since long ago.
    fn new(others: &[u16]) -> Self {
        let geometry = Arc::new(mission(1, 6, 4)).geometry().unwrap();
        let cells = u16::try_from(geometry.coverage_loop.len()).unwrap();
        let mut desk = Self {
            negotiation: Negotiation::new(member(1), CellSet::new(cells), 0),
            coverage_loop: Arc::clone(&geometry.coverage_loop),
            now: Time(100 * T),
            live: others.iter().map(|id| (*id, 1)).collect(),
            able_since: Some(Time(0)),
            held_expired: false,
            gain_in_sight: true,
            diameter: 1,
            elsewhere: BTreeMap::new(),
        };
        assert_eq!(desk.cells(), 24);
        assert!(desk.tick().is_empty());
        desk
    }

    fn cells(&self) -> u16 {
        self.negotiation.sections.cells()
    }

    fn tick(&mut self) -> Vec<Action> {
        let coverage_loop = Arc::clone(&self.coverage_loop);
        self.ask(|negotiation, ctx| negotiation.tick(ctx, &coverage_loop))
    }

    /// Asks the negotiation something, now.
    fn ask<R>(&mut self, what: impl FnOnce(&mut Negotiation, &Context<'_>) -> R) -> R {
        let here = self
            .live
            .keys()
            .filter(|id| !self.elsewhere.contains_key(id));
        let mut members: Vec<Member> = here.map(|id| member(*id)).collect();
        members.extend(self.able_since.map(|_| member(1)));
        members.sort_unstable();
        let ctx = Context {
            now: self.now,
            interval_ms: T,
            live: &self.live,
            live_changed: true,
            members: &members,
            unheard: 0,
            elsewhere: &self.elsewhere,
            diameter: self.diameter,
            able_since: self.able_since,
            revision: 1,
            loop_hash: 7,
            held_expired: core::mem::take(&mut self.held_expired),
            gain_in_sight: self.gain_in_sight,
        };
        what(&mut self.negotiation, &ctx)
    }

    /// After how long, in steps of a quarter period with a tick each, something holds.
    fn until(
        &mut self,
        most_ms: u64,
        holds: impl Fn(&mut Negotiation, &Context<'_>) -> bool,
    ) -> Option<u64> {
        let from = self.now;
        while self.now.since_ms(from) <= most_ms {
            self.tick();
            if self.ask(&holds) {
                return Some(self.now.since_ms(from));
            }
            self.now = self.now.plus_ms(T / 4);
        }
        None
    }

    /// After how long cells are to be taken, and which.
    fn take(&mut self, most_ms: u64) -> Option<(u64, Vec<(u16, Direction)>)> {
        let from = self.now;
        while self.now.since_ms(from) <= most_ms {
            let taken = self.tick().into_iter().find_map(|a| match a {
                Action::Take(cells) => Some(cells),
                _ => None,
            });
            if let Some(taken) = taken {
                let cells = taken.iter().map(|p| (p.cell, p.direction));
                return Some((self.now.since_ms(from), cells.collect()));
            }
            self.now = self.now.plus_ms(T / 4);
        }
        None
    }

    /// Ticks every quarter period; returns after how long an action came, and it.
    fn wait(&mut self, most_ms: u64) -> Option<(u64, Action)> {
        let from = self.now;
        while self.now.since_ms(from) <= most_ms {
            if let Some(action) = self.tick().into_iter().next() {
                return Some((self.now.since_ms(from), action));
            }
            self.now = self.now.plus_ms(T / 4);
        }
        None
    }

    /// This peer's bid is durable, and that of 2 is heard.
    fn both_bid(&mut self) {
        let (own, other) = (self.bid_from(0), self.bid_from(12));
        assert!(self.negotiation.on_bid_durable(own));
        let heard = self.negotiation.hear_bid(self.now, member(2), &other);
        heard.unwrap();
    }

    fn bid_from(&self, anchor: u16) -> Bid {
        Bid {
            anchor,
            ..samples::bid(self.round().clone())
        }
    }

    /// Another peer's claim of some cells.
    fn claim(&mut self, id: u16, seq: u32, first: u16, count: u16, eta_ms: u32) {
        let epoch = Epoch {
            counter: 1,
            hash: 0,
        };
        let listed = ListedRun {
            run: CellRun { first, count },
            backward: false,
            stamp: Stamp { epoch, take: 0, id },
        };
        let claim = Claim {
            epoch,
            plan: vec![listed],
            eta_ms,
            ..Claim::default()
        };
        assert!(self.negotiation.sections.hear(id, 1, seq, claim));
    }

    /// Everything but some cells is covered.
    fn leave_open(&mut self, open: core::ops::Range<u16>) {
        let cells = self.cells();
        let done = (0..cells).filter(|c| !open.contains(c));
        self.negotiation.sections.cover(&CellSet::of(cells, done));
    }

    fn round(&self) -> &Round {
        &self.negotiation.rounds.open().unwrap().round
    }

    /// A division was adopted just now: this peer has cells `0..count`.
    fn adopt(&mut self, count: u16) {
        let epoch = Epoch {
            counter: 1,
            hash: 1,
        };
        let section: Vec<_> = (0..count).map(|c| (c, Direction::Forward)).collect();
        let plan = self.negotiation.sections.adopted(epoch, &[], &section);
        let adoption = Adoption {
            epoch,
            plan,
            unassigned: Vec::new(),
            wait_ms: 5000,
        };
        assert!(self.negotiation.adopt(self.now, &adoption, &self.live));
    }
}

#[test]
fn orphans_of_two_periods_open_a_repair() {
    let mut desk = Desk::new(&[2]);
    let (after_ms, action) = desk.wait(10 * T).unwrap();
    assert_eq!((after_ms, action), (2 * T, Action::Bid));
    assert!(desk.round().repair && desk.round().counter == 1);
    assert_eq!(desk.round().members, [member(1), member(2)]);
    assert_eq!(desk.round().wait_ms, 5 * 1000);
}

#[test]
fn a_peer_of_higher_rank_begins_later() {
    let mut desk = Desk::new(&[]);
    desk.live = LivePeers::from([(0, 1)]);
    desk.now = desk.now.plus_ms(T);
    let (after_ms, _) = desk.wait(10 * T).unwrap();
    assert!((2 * T..3 * T).contains(&after_ms), "{after_ms}");
    assert_eq!(desk.round().members, [member(0), member(1)]);
}

#[test]
fn who_cannot_plan_opens_nothing_and_takes_nothing() {
    let mut desk = Desk::new(&[2]);
    desk.able_since = None;
    assert_eq!(desk.wait(60 * T), None);
}

#[test]
fn after_a_decision_orphans_are_believed_later() {
    let mut desk = Desk::new(&[2]);
    desk.adopt(4);
    let (after_ms, action) = desk.wait(20 * T).unwrap();
    assert_eq!((after_ms, action), (5 * T, Action::Bid));
}

#[test]
fn a_lost_member_opens_a_round_at_once() {
    let mut desk = Desk::new(&[2]);
    desk.adopt(4);
    desk.claim(2, 1, 4, 20, 60_000);
    assert_eq!(desk.wait(8 * T), None, "nothing is orphaned");
    desk.live.clear();
    desk.negotiation.note_gone();
    assert_eq!(desk.wait(T), Some((0, Action::Bid)));
    assert!(desk.round().repair);
    assert_eq!(desk.round().members, [member(1)]);
}

#[test]
fn a_round_whose_member_is_gone_is_followed_by_the_next_at_once() {
    let mut desk = Desk::new(&[2, 3]);
    desk.wait(5 * T).unwrap();
    desk.live.remove(&3);
    assert_eq!(desk.wait(T), Some((0, Action::Bid)));
    assert_eq!(desk.round().counter, 2);
    assert_eq!(desk.round().members, [member(1), member(2)]);
}

#[test]
fn a_round_whose_member_left_for_another_loop_is_followed_by_the_next_at_once() {
    let mut desk = Desk::new(&[2, 3]);
    desk.wait(5 * T).unwrap();
    let opened = desk.now;
    // What was known before is what whoever opened it knew better.
    desk.elsewhere.insert(3, opened);
    assert_eq!(desk.wait(T), None);
    desk.elsewhere.insert(3, opened.plus_ms(1));
    assert_eq!(desk.wait(T), Some((0, Action::Bid)));
    assert_eq!(desk.round().counter, 2);
    assert_eq!(desk.round().members, [member(1), member(2)]);
}

#[test]
fn a_round_without_all_bids_waits_longer_each_time_and_leaves_out_the_silent() {
    let mut desk = Desk::new(&[2]);
    desk.wait(5 * T).unwrap();
    let own = desk.bid_from(0);
    assert!(desk.negotiation.on_bid_durable(own));
    let mut waits = Vec::new();
    for _ in 0..2 {
        // Takes are made meanwhile; they are none of this test's business.
        let counter = desk.round().counter;
        let from = desk.now;
        while desk.round().counter == counter {
            desk.now = desk.now.plus_ms(T / 4);
            desk.tick();
        }
        waits.push((desk.now.since_ms(from), desk.round().wait_ms));
    }
    assert!((5 * T..6 * T).contains(&waits[0].0) && waits[0].1 == 10_000);
    assert!((10 * T..11 * T).contains(&waits[1].0) && waits[1].1 == 20_000);
    assert_eq!(desk.round().members, [member(1)], "2 was silent twice");
}

#[test]
fn a_complete_round_is_divided_once_and_given_up_without_an_answer() {
    let mut desk = Desk::new(&[2]);
    desk.wait(5 * T).unwrap();
    desk.both_bid();
    let divides = desk.tick();
    assert!(
        matches!(&divides[..], [Action::Divide { uavs, .. }] if uavs.len() == 2),
        "{divides:?}"
    );
    assert!(desk.tick().is_empty());
    let counter = desk.round().counter;
    let from = desk.now;
    while desk.round().counter == counter {
        desk.now = desk.now.plus_ms(T / 4);
        desk.tick();
    }
    let waited_ms = desk.now.since_ms(from);
    assert!((10 * T..11 * T).contains(&waited_ms), "{waited_ms}");
}

#[test]
fn a_division_gives_each_member_its_part_and_all_compute_the_same() {
    let mut desk = Desk::new(&[2]);
    desk.wait(5 * T).unwrap();
    desk.both_bid();
    let divides = desk.tick();
    let [Action::Divide { epoch, ring, uavs }] = &divides[..] else {
        panic!("{divides:?}")
    };
    let division = skein_flight::coverage::ring::backtracking::divide(ring, uavs);
    let adoption = desk
        .negotiation
        .divided(desk.now, *epoch, &division)
        .unwrap();
    let mine = adoption.plan.len();
    assert!((10..=14).contains(&mine), "{mine} of 24");
    let (now, live) = (desk.now, &desk.live);
    assert!(desk.negotiation.adopt(now, &adoption, live));
    assert!(!desk.negotiation.adopt(now, &adoption, live), "once");
    assert_eq!(desk.negotiation.adoptions, 1);
}

/// Where parts met while the adoption was written, another may have claimed some of it.
#[test]
fn what_a_live_peer_lists_at_a_higher_stamp_by_then_is_not_adopted() {
    for (live, planned) in [
        (LivePeers::from([(2, 1)]), vec![0, 1, 5]),
        (LivePeers::new(), vec![0, 1, 2, 3, 4, 5]),
    ] {
        let mut desk = Desk::new(&[2]);
        desk.live = live;
        desk.claim(2, 1, 2, 3, 600_000);
        let epoch = desk.negotiation.sections.heard()[&2].claim.epoch;
        let section: Vec<_> = (0..6).map(|c| (c, Direction::Forward)).collect();
        let adoption = Adoption {
            epoch,
            plan: desk.negotiation.sections.adopted(epoch, &[], &section),
            unassigned: Vec::new(),
            wait_ms: 5000,
        };
        assert_eq!(adoption.plan.len(), 6);
        assert!(desk.negotiation.adopt(desk.now, &adoption, &desk.live));
        let plan = desk.negotiation.sections.plan();
        assert_eq!(plan.iter().map(|p| p.cell).collect::<Vec<_>>(), planned);
    }
}

#[test]
fn orphans_that_no_round_helps_are_taken_the_nearest_run_first() {
    let mut desk = Desk::new(&[2]);
    desk.adopt(4);
    desk.claim(2, 1, 10, 10, 600_000);
    let from = desk.now;
    let mut taken = None;
    while taken.is_none() && desk.now.since_ms(from) < 60 * T {
        desk.now = desk.now.plus_ms(T / 4);
        taken = desk.tick().into_iter().find_map(|a| match a {
            Action::Take(cells) => Some(cells),
            _ => None,
        });
    }
    let cells: Vec<u16> = taken.unwrap().iter().map(|p| p.cell).collect();
    assert_eq!(cells, [4, 5, 6, 7, 8, 9], "beside its own plan, in order");
    // 2 T and W0 after the decision.
    let after_ms = desk.now.since_ms(from);
    assert!((7 * T..=8 * T).contains(&after_ms), "{after_ms}");
    // Until that is durable or broken nothing more is taken.
    desk.now = desk.now.plus_ms(20 * T);
    let more = |actions: Vec<Action>| actions.iter().any(|a| matches!(a, Action::Take(_)));
    assert!(!more(desk.tick()));
    desk.negotiation.cancel_take();
    assert!(more(desk.tick()));
}

#[test]
fn an_idle_peer_asks_for_a_share_of_what_others_have_left() {
    let mut desk = Desk::new(&[2]);
    desk.claim(2, 1, 0, 24, 600_000);
    let (after_ms, action) = desk.wait(60 * T).unwrap();
    assert_eq!(action, Action::Bid);
    assert!(!desk.round().repair);
    assert!(after_ms >= 2 * T, "{after_ms}");
    // But not where nothing would be gained.
    let mut desk = Desk::new(&[2]);
    desk.gain_in_sight = false;
    desk.claim(2, 1, 0, 24, 600_000);
    assert_eq!(desk.wait(20 * T), None);
}

#[test]
fn where_links_come_and_go_for_ever_something_is_begun_all_the_same() {
    let mut desk = Desk::new(&[2, 3]);
    let began = desk.now;
    let mut first_ms = None;
    while desk.now.since_ms(began) < 120 * T && first_ms.is_none() {
        let round_ms = desk.now.since_ms(began) % (8 * T);
        // Of two others one comes and one goes in each eight periods, and for two of them this
        // peer suspects itself of being deaf.
        let others: &[u16] = match round_ms / (2 * T) {
            0 => &[2, 3],
            1 => &[2],
            2 => &[],
            _ => &[3],
        };
        desk.live = others.iter().map(|id| (*id, 1)).collect();
        desk.able_since = (round_ms >= 2 * T).then(|| Time(desk.now.0 - round_ms + 2 * T));
        let actions = desk.tick();
        let begins = |a: &Action| matches!(a, Action::Bid | Action::Take(_));
        if actions.iter().any(begins) {
            first_ms = Some(desk.now.since_ms(began));
        }
        desk.now = desk.now.plus_ms(T / 4);
    }
    let first_ms = first_ms.expect("nothing was begun");
    let bounds_ms = UNDIVIDED_INTERVALS * T..(UNDIVIDED_INTERVALS + 10) * T;
    assert!(bounds_ms.contains(&first_ms), "{first_ms}");
}

#[test]
fn a_return_waits_until_it_is_steady() {
    let mut desk = Desk::new(&[2]);
    desk.claim(2, 1, 0, 24, 600_000);
    desk.able_since = Some(desk.now);
    let (after_ms, action) = desk.wait(60 * T).unwrap();
    assert_eq!(action, Action::Bid);
    assert!((10 * T..11 * T).contains(&after_ms), "{after_ms}");
}

#[test]
fn a_rebalancing_that_ran_out_while_a_peer_was_away_is_not_tried_again() {
    for (repair, again) in [(false, false), (true, true)] {
        let mut desk = Desk::new(&[2]);
        desk.claim(2, 1, 0, 24, 600_000);
        desk.ask(|n, ctx| n.start(ctx, repair, 0));
        assert!(desk.tick().contains(&Action::Bid));
        desk.able_since = None;
        assert_eq!(desk.wait(60 * T), None);
        desk.able_since = Some(desk.now);
        let tried = desk.tick().contains(&Action::Bid);
        assert_eq!(tried, again, "repair {repair}");
        if !again {
            let (after_ms, _) = desk.wait(60 * T).unwrap();
            assert!((10 * T..11 * T).contains(&after_ms), "{after_ms}");
        }
    }
}

#[test]
fn the_far_half_of_a_stalled_owner_is_taken_from_its_end() {
    let mut desk = Desk::new(&[2]);
    // So few cells that no round is worth it.
    desk.gain_in_sight = false;
    desk.leave_open(4..6);
    desk.claim(2, 1, 4, 2, 10_000);
    let (after_ms, action) = desk.wait(400 * T).unwrap();
    let Action::Take(cells) = action else {
        panic!("{action:?}")
    };
    let taken: Vec<_> = cells.iter().map(|p| (p.cell, p.direction)).collect();
    assert_eq!(taken, [(5, Direction::Backward)]);
    // Its ETA, a quarter more, ten periods, and two cells with 2 D T.
    let bound_ms = 10_000 + 2_500 + 10 * T + TWO_CELLS_MS + 2 * T;
    assert!((bound_ms..bound_ms + T).contains(&after_ms), "{after_ms}");
}

#[test]
fn who_stood_still_waits_as_long_again_as_if_it_had_not() {
    let mut desk = Desk::new(&[2]);
    desk.wait(5 * T).unwrap();
    let counter = desk.round().counter;
    desk.now = desk.now.plus_ms(T + 600 * T);
    desk.negotiation.was_late(600 * T);
    assert_eq!(desk.wait(3 * T), None, "neither a round nor a take");
    assert_eq!(desk.round().counter, counter);
    assert!(desk.wait(10 * T).is_some());
}

#[test]
fn cells_that_nobody_took_over_in_time_are_orphans() {
    let mut desk = Desk::new(&[2]);
    desk.adopt(4);
    desk.claim(2, 1, 4, 20, 600_000);
    let epoch = Epoch {
        counter: 2,
        hash: 0,
    };
    assert!(desk.negotiation.sections.adopt_at_once(epoch, &[], &[]));
    assert_eq!(desk.negotiation.sections.held().len(), 4);
    desk.held_expired = true;
    assert_eq!(desk.tick(), [Action::Changed]);
    assert!(desk.negotiation.sections.held().is_empty());
    let live = desk.live.clone();
    assert_eq!(desk.negotiation.sections.orphans(&live).count(), 4);
}

#[test]
fn a_new_life_owns_nothing_and_keeps_what_is_covered() {
    let mut desk = Desk::new(&[2]);
    desk.adopt(4);
    desk.leave_open(2..24);
    desk.negotiation.void_ownership(Member {
        id: 1,
        incarnation: 2,
    });
    assert!(desk.negotiation.sections.plan().is_empty());
    assert_eq!(desk.negotiation.sections.covered().count(), 2);
}

#[test]
fn a_round_is_waited_for_at_most_four_times_as_long_as_the_largest_diameter_needs() {
    let waits = |wait_ms| {
        let mut desk = Desk::new(&[2]);
        let round = Round {
            counter: 1,
            members: vec![member(1), member(2)],
            revision: 1,
            loop_hash: 7,
            repair: true,
            wait_ms,
        };
        let heard = desk
            .negotiation
            .hear_bid(desk.now, member(2), &samples::bid(round));
        heard.unwrap();
        desk.round().wait_ms
    };
    // (2 · 16 + 3) T, doubled twice.
    assert_eq!(waits(140_000), 140_000);
    assert_eq!(waits(140_001), 140_000);
}

#[test]
fn in_each_period_what_is_heard_raises_the_counter_anew() {
    let mut desk = Desk::new(&[2]);
    for after_periods in 0..3 {
        desk.negotiation.rounds.hear_counter(u32::MAX);
        assert_eq!(
            desk.negotiation.rounds.counter(),
            1000 * (after_periods + 1)
        );
        desk.now = desk.now.plus_ms(T - 1);
        desk.ask(|n, ctx| n.watch_period(ctx));
        assert!(!desk.negotiation.rounds.hear_counter(u32::MAX));
        desk.now = desk.now.plus_ms(1);
        desk.ask(|n, ctx| n.watch_period(ctx));
    }
}

#[test]
fn before_its_first_division_a_peer_waits_until_the_members_stay_the_same() {
    let opened = |n: &mut Negotiation, _: &Context<'_>| n.rounds.open().is_some();
    let mut desk = Desk::new(&[2]);
    for others in [[3], [4], [5]] {
        assert_eq!(desk.until(3 * T / 2, opened), None);
        desk.live = others.iter().map(|id| (*id, 1)).collect();
    }
    assert_eq!(desk.until(20 * T, opened), Some(2 * T));
    // One that knows only itself waits for ten.
    let mut alone = Desk::new(&[]);
    assert_eq!(alone.until(20 * T, opened), Some(10 * T));
    // As does one whose company never stays the same.
    let mut desk = Desk::new(&[2]);
    let from = desk.now;
    while desk.until(T, opened).is_none() {
        let other = if desk.live.contains_key(&2) { 3 } else { 2 };
        desk.live = LivePeers::from([(other, 1)]);
    }
    assert_eq!(desk.now.since_ms(from), 10 * T);
}

#[test]
fn after_a_division_a_loss_waits_until_the_new_claims_have_come() {
    for (waited, answered) in [(4 * T, false), (5 * T, true)] {
        let mut desk = Desk::new(&[2, 3]);
        desk.adopt(4);
        desk.claim(2, 1, 4, 20, 600_000);
        desk.now = desk.now.plus_ms(waited - T / 4);
        assert!(desk.tick().is_empty());
        desk.now = desk.now.plus_ms(T / 4);
        desk.live.remove(&2);
        desk.negotiation.note_gone();
        assert_eq!(desk.tick() == [Action::Bid], answered, "{waited} ms");
    }
}

#[test]
fn whether_a_round_would_gain_is_computed_once_in_ten_periods() {
    let mut desk = Desk::new(&[2]);
    desk.gain_in_sight = false;
    desk.claim(2, 1, 0, 24, 600_000);
    let wants = |n: &mut Negotiation, ctx: &Context<'_>| n.take_foresight(ctx);
    assert_eq!(
        desk.until(9 * T, wants),
        Some(2 * T),
        "idle for two periods"
    );
    for _ in 0..3 {
        desk.now = desk.now.plus_ms(T / 4);
        assert_eq!(desk.until(20 * T, wants), Some(10 * T - T / 4));
    }
    // Not while a round is open, nor among many, nor with nothing left to share.
    desk.now = desk.now.plus_ms(20 * T);
    desk.ask(|n, ctx| n.start(ctx, false, 0));
    assert!(!desk.ask(wants));
    desk.negotiation.rounds.give_up();
    assert!(desk.ask(wants));
    desk.now = desk.now.plus_ms(20 * T);
    desk.live.extend((3..=9).map(|id| (id, 1)));
    assert!(!desk.ask(wants), "nine are many");
    desk.live = LivePeers::from([(2, 1)]);
    desk.leave_open(0..0);
    assert!(!desk.ask(wants));
}

#[test]
fn calm_begins_twenty_periods_after_an_adoption_and_progress_with_the_first_cell_seen_since() {
    let mut desk = Desk::new(&[2]);
    let adopted = desk.now;
    let said = |desk: &Desk, ms| {
        let (n, now) = (&desk.negotiation, adopted.plus_ms(ms));
        (n.is_calm(now, T), n.progressed())
    };
    assert_eq!(said(&desk, 0), (true, false), "nothing was adopted yet");
    desk.negotiation.note_covered();
    assert_eq!(said(&desk, 0), (true, true));
    desk.adopt(4);
    assert_eq!(said(&desk, 20 * T - 1), (false, false));
    assert_eq!(said(&desk, 20 * T), (true, false));
}

#[test]
fn a_rebalancing_comes_twenty_periods_after_the_last_division() {
    for (others, rank) in [([2], 0), ([0], 1)] {
        let mut desk = Desk::new(&[]);
        desk.live = others.iter().map(|id| (*id, 1)).collect();
        desk.adopt(0);
        desk.claim(others[0], 1, 0, 24, 600_000);
        let (after_ms, action) = desk.wait(60 * T).unwrap();
        assert_eq!(action, Action::Bid);
        // An eighth of a period a rank, looked at four times a period.
        assert_eq!(after_ms, 20 * T + rank * T / 4, "rank {rank}");
    }
}

#[test]
fn orphans_are_left_to_those_who_would_be_there_sooner_each_for_two_periods() {
    let mut desk = Desk::new(&[2, 3, 4, 5, 6, 7, 8, 9]);
    desk.claim(2, 1, 0, 20, 600_000);
    desk.tick();
    // Two more are orphaned later: each cell has its own time.
    let turn =
        |desk: &mut Desk, cell, sooner| desk.ask(|n, ctx| n.is_my_turn(ctx, cell, (sooner, 0)));
    let ripe = |desk: &mut Desk| desk.ask(|n, ctx| n.ripe_orphans(ctx).iter().collect::<Vec<_>>());
    let from = desk.now;
    desk.now = from.plus_ms(T);
    desk.claim(2, 2, 2, 18, 600_000);
    desk.tick();
    for (after, ripe_now, of_22, of_0) in [
        (2 * T - 1, vec![], [false; 3], [false; 3]),
        (
            2 * T,
            vec![20, 21, 22, 23],
            [true, false, false],
            [false; 3],
        ),
        (
            3 * T,
            vec![0, 1, 20, 21, 22, 23],
            [true, false, false],
            [true, false, false],
        ),
        (
            4 * T,
            vec![0, 1, 20, 21, 22, 23],
            [true, true, false],
            [true, false, false],
        ),
        // W0 at most, which is 5 T here.
        (
            7 * T,
            vec![0, 1, 20, 21, 22, 23],
            [true; 3],
            [true, true, false],
        ),
    ] {
        desk.now = from.plus_ms(after);
        assert_eq!(ripe(&mut desk), ripe_now, "after {after} ms");
        assert_eq!(
            [0, 1, 40].map(|n| turn(&mut desk, 22, n)),
            of_22,
            "after {after} ms"
        );
        assert_eq!(
            [0, 1, 40].map(|n| turn(&mut desk, 0, n)),
            of_0,
            "after {after} ms"
        );
    }
}

#[test]
fn what_a_living_owner_lets_go_is_an_orphan_once_another_claim_could_have_come() {
    // Over five hops a claim may be on the way for two periods.
    for (diameter, later_ms) in [(1, 0), (5, 2 * T)] {
        let mut desk = Desk::new(&[2, 3, 4, 5, 6, 7, 8, 9, 10, 11]);
        desk.diameter = diameter;
        desk.claim(2, 1, 0, 12, 600_000);
        desk.claim(3, 1, 12, 12, 600_000);
        desk.claim(4, 2, 22, 2, 600_000);
        desk.tick();
        // Peer 3 lets go what peer 4 lists.
        desk.claim(3, 2, 12, 10, 600_000);
        desk.tick();
        let from = desk.now;
        // Peer 2 lists its first two cells no more, and peers 3 and 4 are lost with all of theirs.
        desk.claim(2, 2, 2, 10, 600_000);
        desk.live.remove(&3);
        desk.live.remove(&4);
        desk.tick();
        let mut ripe_at = |cell: u16, ms: u64| {
            desk.now = from.plus_ms(ms);
            desk.ask(|n, ctx| n.ripe_orphans(ctx).contains(cell))
        };
        for of_the_dead in [12, 22] {
            assert!(!ripe_at(of_the_dead, 2 * T - 1) && ripe_at(of_the_dead, 2 * T));
        }
        assert!(!ripe_at(0, 2 * T + later_ms - 1) && ripe_at(0, 2 * T + later_ms));
    }
}

#[test]
fn an_orphan_whose_turn_passed_for_all_the_idle_goes_to_who_has_something_to_fly() {
    let mut desk = Desk::new(&[2, 3, 4, 5, 6, 7, 8, 9]);
    desk.claim(2, 1, 0, 20, 600_000);
    desk.tick();
    let from = desk.now;
    // 2 T and W0, which is 5 T; 2 T for each who would be there sooner, half of W0 at most.
    for (after, overdue, turns) in [
        (7 * T - 1, 0, [false, false, false]),
        (7 * T, 4, [true, false, false]),
        (9 * T, 4, [true, true, false]),
        (9 * T + T / 2, 4, [true, true, true]),
    ] {
        desk.now = from.plus_ms(after);
        let cells = desk.ask(|n, ctx| n.overdue_orphans(ctx).count());
        assert_eq!(cells, overdue, "after {after} ms");
        let turn = |sooner| desk.ask(|n, ctx| n.is_my_turn_at_last(ctx, 22, sooner));
        assert_eq!([0, 1, 9].map(turn), turns, "after {after} ms");
    }
}

#[test]
fn an_orphan_is_left_to_who_is_near_for_as_long_as_the_way_takes_longer() {
    let mut desk = Desk::new(&[2, 3, 4, 5, 6, 7, 8, 9]);
    desk.claim(2, 1, 0, 20, 600_000);
    desk.tick();
    let from = desk.now;
    for (after, turns) in [
        (2 * T, [true, false, false]),
        (7 * T, [true, false, false]),
        (11 * T - 1, [true, false, false]),
        (11 * T, [true, true, false]),
        (92 * T, [true, true, true]),
    ] {
        desk.now = from.plus_ms(after);
        let turn = |later_ms| desk.ask(|n, ctx| n.is_my_turn(ctx, 22, (0, later_ms)));
        assert_eq!([0, 9 * T, 90 * T].map(turn), turns, "after {after} ms");
    }
}

#[test]
fn among_many_who_flies_for_two_more_periods_relieves_nobody() {
    let mut desk = Desk::new(&[2]);
    let mut may = |free_ms| desk.ask(|n, ctx| n.may_relieve(ctx, free_ms));
    assert!(may(0) && may(2 * T) && !may(2 * T + 1));
}

#[test]
fn what_an_owner_has_left_is_less_what_others_took_and_the_time_in_proportion() {
    let mut desk = Desk::new(&[2, 3, 4]);
    desk.claim(2, 1, 0, 20, 100_000);
    // Peer 3 took a quarter of it, at a higher stamp; peer 4 lists nothing.
    desk.claim(3, 1, 15, 5, 40_000);
    desk.claim(4, 1, 0, 0, 40_000);
    desk.tick();
    desk.now = desk.now.plus_ms(20_000);
    let owners = desk.ask(|n, ctx| n.owners(ctx));
    let seen: Vec<_> = owners
        .iter()
        .map(|o| (o.id, o.plan.len(), o.left_ms))
        .collect();
    assert_eq!(seen, [(2, 15, 60_000), (3, 5, 20_000)]);
    assert_eq!(desk.ask(|n, ctx| n.present_end_ms(ctx)), 80_000);
    // Of the dead nothing is known.
    desk.live.remove(&2);
    let owners = desk.ask(|n, ctx| n.owners(ctx));
    assert_eq!(owners.iter().map(|o| o.id).collect::<Vec<_>>(), [3]);
    assert_eq!(desk.ask(|n, ctx| n.present_end_ms(ctx)), 20_000);
}

#[test]
fn who_has_nothing_left_to_fly_is_where_its_last_plan_ended() {
    let mut desk = Desk::new(&[2, 3]);
    for (seq, first, count, end) in [(1, 0, 15, 14), (2, 0, 0, 14), (3, 16, 5, 20)] {
        desk.claim(2, seq, first, count, 40_000);
        desk.tick();
        assert_eq!(desk.ask(|n, _| n.end_of(2)), Some(end), "claim {seq}");
    }
    assert_eq!(desk.ask(|n, _| n.end_of(3)), None, "it listed nothing yet");
}

#[test]
fn an_owner_that_comes_nearer_to_a_far_cell_has_not_stalled() {
    let stalled_ms = 3 * (12_000 + 12 * T + T / 2);
    // It says every ten periods how long its one cell will take yet; for the second time
    // it flies in circles.
    for (falls, its_time_ms) in [(10 * T, 1_000_000 + stalled_ms), (0, stalled_ms)] {
        let mut desk = Desk::new(&[]);
        desk.live = LivePeers::from([(0, 1)]);
        desk.gain_in_sight = false;
        desk.leave_open(7..8);
        let (mut eta_ms, mut waited_ms) = (1_000_000u64, 0);
        let taken_ms = (1..).find_map(|seq| {
            desk.claim(0, seq, 7, 1, u32::try_from(eta_ms).unwrap());
            eta_ms = eta_ms.saturating_sub(falls);
            let taken = desk.wait(10 * T);
            waited_ms += taken.as_ref().map_or(10 * T, |(ms, _)| *ms);
            taken.map(|_| waited_ms)
        });
        let in_time = its_time_ms - 10 * T..=its_time_ms + 20 * T;
        assert!(
            in_time.contains(&taken_ms.unwrap()),
            "{falls}: {taken_ms:?}"
        );
    }
}

#[test]
fn an_owner_that_covers_nothing_has_stalled_after_thrice_its_time() {
    // Of rank 1: the two cells' 12 s, (10 + 2D) T, and half a period for the rank.
    let stalled_ms = 3 * (12_000 + 12 * T + T / 2);
    let mut desk = Desk::new(&[]);
    desk.live = LivePeers::from([(0, 1)]);
    desk.gain_in_sight = false;
    // It expects to be done long after that.
    desk.claim(0, 1, 0, 24, 3_000_000);
    desk.now = desk.now.plus_ms(20_000);
    desk.tick();
    // A cell is covered now: its time begins anew.
    desk.leave_open(1..24);
    desk.tick();
    let (after_ms, cells) = desk.take(200 * T).unwrap();
    assert!(
        (stalled_ms..stalled_ms + T).contains(&after_ms),
        "{after_ms}"
    );
    let far_half: Vec<_> = (12..24).rev().map(|c| (c, Direction::Backward)).collect();
    assert_eq!(cells, far_half);
}

#[test]
fn the_nearest_orphans_are_those_along_the_loop_whichever_way() {
    let nearest = |planned: &[u16], open: &[u16]| -> Vec<(u16, Direction)> {
        let mut desk = Desk::new(&[2]);
        let section: Vec<_> = planned.iter().map(|c| (*c, Direction::Forward)).collect();
        let epoch = Epoch {
            counter: 1,
            hash: 1,
        };
        desk.negotiation
            .sections
            .adopt_at_once(epoch, &[], &section);
        let orphans = CellSet::of(24, open.iter().copied());
        let coverage_loop = Arc::clone(&desk.coverage_loop);
        desk.ask(|n, _| n.nearest_run(&orphans, &coverage_loop))
            .unwrap()
    };
    let forward =
        |cells: &[u16]| -> Vec<_> { cells.iter().map(|c| (*c, Direction::Forward)).collect() };
    let backward =
        |cells: &[u16]| -> Vec<_> { cells.iter().map(|c| (*c, Direction::Backward)).collect() };
    // Its plan ends at cell 8; of a run the nearer end comes first.
    assert_eq!(nearest(&[7, 8], &[3, 4, 5, 20, 21]), backward(&[5, 4, 3]));
    assert_eq!(nearest(&[7, 8], &[1, 2, 11, 12]), forward(&[11, 12]));
    // Across the seam.
    assert_eq!(nearest(&[1], &[6, 7, 20, 21, 22]), backward(&[22, 21, 20]));
    assert_eq!(nearest(&[22], &[0, 1, 2, 15, 16]), forward(&[0, 1, 2]));
    // A long run whose far end is beside it.
    assert_eq!(
        nearest(&[12], &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 15, 16])[0],
        (10, Direction::Backward)
    );
    // As far both ways: the lower number, flown forward.
    assert_eq!(nearest(&[8], &[4, 12]), forward(&[4]));
}

#[test]
fn who_has_no_plan_looks_for_orphans_from_a_place_of_its_own() {
    // 7919 times its number, on 24 cells: 23 for peer 1, 15 for peer 9.
    for (me, taken) in [(1, 23), (9, 15)] {
        let desk = Desk::new(&[]);
        let alone = Negotiation::new(member(me), CellSet::new(24), 0);
        let orphans = CellSet::of(24, [7, 15, 23]);
        let run = alone.nearest_run(&orphans, &desk.coverage_loop);
        assert_eq!(run, Some(vec![(taken, Direction::Forward)]));
    }
}

#[test]
fn cells_beyond_everybody_are_looked_at_by_the_idle_once_in_ten_periods() {
    for (others, rank) in [([2], 0), ([0], 1)] {
        let mut desk = Desk::new(&[]);
        desk.live = others.iter().map(|id| (*id, 1)).collect();
        desk.gain_in_sight = false;
        desk.negotiation.sections.set_unassigned(&[5, 6, 7]);
        desk.claim(others[0], 1, 8, 20, 3_000_000);
        desk.negotiation.sections.cover(&CellSet::of(24, 0..5));
        let cells = |n: &mut Negotiation, ctx: &Context<'_>| n.take_left_over(ctx).is_some();
        assert_eq!(desk.until(30 * T, cells), Some(10 * T + rank * T / 2));
        for _ in 0..2 {
            desk.now = desk.now.plus_ms(T / 4);
            assert_eq!(desk.until(30 * T, cells), Some(10 * T - T / 4));
        }
        // Not while a take is under way, with orphans, in a round, or when not able.
        desk.now = desk.now.plus_ms(20 * T);
        assert!(
            desk.negotiation
                .begin_take(&[(5, Direction::Forward)])
                .is_some()
        );
        assert!(!desk.ask(cells));
        desk.negotiation.cancel_take();
        desk.ask(|n, ctx| n.start(ctx, false, 0));
        assert!(!desk.ask(cells));
        desk.negotiation.rounds.give_up();
        desk.negotiation.orphan_since = Some(desk.now);
        assert!(!desk.ask(cells));
        desk.negotiation.orphan_since = None;
        let able_since = desk.able_since.take();
        assert!(!desk.ask(cells));
        desk.able_since = able_since;
        assert!(desk.ask(cells));
    }
}

#[test]
fn orphans_are_taken_one_rank_after_the_other() {
    let mut after = Vec::new();
    for others in [[2, 3], [0, 3]] {
        let mut desk = Desk::new(&[]);
        desk.live = others.iter().map(|id| (*id, 1)).collect();
        desk.adopt(4);
        desk.claim(others[0], 1, 10, 10, 600_000);
        after.push(desk.take(60 * T).unwrap().0);
    }
    assert_eq!(after, [7 * T, 7 * T + T / 2]);
}

#[test]
fn a_first_section_is_looked_for_once_and_only_where_nothing_was_divided() {
    let begins = |n: &mut Negotiation, ctx: &Context<'_>| n.take_begin(ctx, false);
    let mut told = Desk::new(&[2]);
    told.able_since = Some(told.now);
    assert!(told.ask(|n, ctx| n.take_begin(ctx, true)), "at once");
    let mut desk = Desk::new(&[2]);
    desk.able_since = Some(desk.now);
    assert_eq!(desk.until(10 * T, begins), Some(3 * T / 2));
    assert!(!desk.ask(begins), "once");
    let mut alone = Desk::new(&[]);
    assert!(!alone.ask(begins), "who is alone opens a round with itself");
    let mut heard = Desk::new(&[2]);
    heard.negotiation.rounds.hear_counter(1);
    assert!(!heard.ask(begins), "others have had a round");
    let mut divided = Desk::new(&[2]);
    divided.adopt(0);
    assert!(!divided.ask(begins), "this peer has had one");
    let mut took = Desk::new(&[2]);
    took.negotiation
        .sections
        .take_at_once(&[(3, Direction::Forward)]);
    assert!(!took.ask(begins), "it has something to fly");
}

#[test]
fn of_two_who_take_what_nobody_lists_the_one_that_is_nearer_outranks_the_other() {
    let takes = |way_ms| {
        let mut desk = Desk::new(&[2]);
        let taken = desk
            .negotiation
            .begin_nearest(&[(3, Direction::Forward)], way_ms);
        taken.unwrap()[0].stamp.take
    };
    assert_eq!([0, 3_999, 4_000, 40_000].map(takes), [61, 61, 60, 51]);
    assert_eq!([240_000, 3_000_000].map(takes), [1, 1]);
}

#[test]
fn among_many_a_peer_looks_twice_a_period_for_what_it_could_take() {
    let looks = |n: &mut Negotiation, ctx: &Context<'_>| n.take_look(ctx);
    let mut desk = Desk::new(&[2, 3, 4, 5, 6, 7, 8]);
    assert!(!desk.ask(looks), "eight are few");
    desk.live.insert(9, 1);
    assert!(desk.ask(looks));
    desk.now = desk.now.plus_ms(T / 2 - 1);
    assert!(!desk.ask(looks));
    desk.now = desk.now.plus_ms(1);
    assert!(desk.ask(looks));
    desk.now = desk.now.plus_ms(T);
    assert!(
        desk.negotiation
            .begin_take(&[(5, Direction::Forward)])
            .is_some()
    );
    assert!(!desk.ask(looks), "while a take is being written");
    desk.negotiation.cancel_take();
    assert!(desk.ask(looks));
    desk.now = desk.now.plus_ms(T);
    desk.leave_open(0..0);
    assert!(!desk.ask(looks), "with nothing left");
}

#[test]
fn what_is_divided_are_the_bids_whatever_a_member_knows_besides() {
    let mut desk = Desk::new(&[2]);
    desk.wait(5 * T).unwrap();
    desk.both_bid();
    // It hears of covered cells after it bid, and others may not have heard of them.
    desk.leave_open(6..24);
    let divides = desk.tick();
    let ring = divides.iter().find_map(|a| match a {
        Action::Divide { ring, .. } => Some(ring),
        _ => None,
    });
    assert!(ring.unwrap().iter().all(|c| c.open));
}

#[test]
fn nine_uavs_are_many_and_a_ground_station_is_none_of_them() {
    for (uavs, many) in [(1, false), (2, false), (8, false), (9, true)] {
        for ground_station in [false, true] {
            let others: Vec<u16> = (2..=uavs).collect();
            let mut known = Membership::new(1, 1000);
            for id in others.iter().copied().chain(ground_station.then_some(99)) {
                let beacon = Beacon {
                    ground_station: id == 99,
                    ..samples::beacon(1)
                };
                known.on_beacon(Time(0), id, 1, &beacon);
            }
            let mut desk = Desk::new(&others);
            let sharing = desk.ask(|_, ctx| (ctx.uavs(), ctx.is_many()));
            assert_eq!(sharing, (usize::from(uavs), many));
            assert_eq!((known.uavs(), are_many(known.uavs())), sharing);
        }
    }
}
