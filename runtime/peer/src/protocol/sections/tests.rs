//! The rules on sections, without time.

use super::*;
use crate::wire::message::ListedRun;

impl Sections {
    /// Rules *adopt* and install in one step.
    pub(crate) fn adopt_at_once(
        &mut self,
        epoch: Epoch,
        commits: &[(u16, Direction)],
        section: &[(u16, Direction)],
    ) -> bool {
        let plan = self.adopted(epoch, commits, section);
        self.install(epoch, &plan)
    }

    /// Rules *take* and append in one step. Returns how many cells were taken.
    pub(crate) fn take_at_once(&mut self, cells: &[(u16, Direction)]) -> usize {
        let before = self.plan.len();
        self.append(&self.taken(cells));
        self.plan.len() - before
    }
}

fn epoch(counter: u32) -> Epoch {
    Epoch { counter, hash: 0 }
}

fn stamp(counter: u32, take: u16, id: u16) -> Stamp {
    Stamp {
        epoch: epoch(counter),
        take,
        id,
    }
}

fn claim(plan: &[(u16, u16, Stamp)]) -> Claim {
    Claim {
        plan: plan
            .iter()
            .map(|(first, count, stamp)| ListedRun {
                run: CellRun {
                    first: *first,
                    count: *count,
                },
                backward: false,
                stamp: *stamp,
            })
            .collect(),
        ..Claim::default()
    }
}

fn sections(me: u16) -> Sections {
    Sections::new(me, 10, CellSet::new(10))
}

fn forward(cells: &[u16]) -> Vec<(u16, Direction)> {
    cells.iter().map(|c| (*c, Direction::Forward)).collect()
}

#[test]
fn a_planned_cell_yields_to_a_higher_stamp_of_a_live_peer_only() {
    let mut s = sections(1);
    s.adopt_at_once(epoch(1), &[], &forward(&[2, 3, 4]));
    s.hear(2, 1, 1, claim(&[(4, 2, stamp(2, 0, 2))]));
    assert!(!s.settle(&LivePeers::new()), "a dead claim takes nothing");
    assert!(s.settle(&LivePeers::from([(2, 1)])));
    assert_eq!(s.plan().iter().map(|p| p.cell).collect::<Vec<_>>(), [2, 3]);
    assert!(!s.settle(&LivePeers::from([(2, 1)])));
}

#[test]
fn what_is_covered_is_beyond_nobodys_endurance() {
    let mut s = sections(1);
    s.set_unassigned(&[2, 3, 4]);
    s.cover(&CellSet::of(10, [3]));
    assert_eq!(s.unassigned().iter().collect::<Vec<_>>(), [2, 4]);
    s.set_unassigned(&[3, 4]);
    assert_eq!(s.unassigned().iter().collect::<Vec<_>>(), [4]);
}

#[test]
fn of_two_equal_listings_exactly_one_yields() {
    let e = epoch(3);
    let (mut a, mut b) = (sections(1), sections(2));
    a.adopt_at_once(e, &[], &forward(&[5]));
    b.adopt_at_once(e, &[], &forward(&[5]));
    let (ra, rb) = (a.claim(1, 1, 0), b.claim(1, 1, 0));
    a.hear(2, 1, 1, rb);
    b.hear(1, 1, 1, ra);
    let live = LivePeers::from([(1, 1), (2, 1)]);
    a.settle(&live);
    b.settle(&live);
    assert_eq!(a.plan().len() + b.plan().len(), 1);
}

#[test]
fn what_is_given_away_is_held_until_somebody_lists_it() {
    let mut s = sections(1);
    s.adopt_at_once(epoch(1), &[], &forward(&[0, 1, 2, 3]));
    s.adopt_at_once(epoch(2), &forward(&[0]), &forward(&[1]));
    assert_eq!(s.held().keys().copied().collect::<Vec<_>>(), [2, 3]);
    let live = LivePeers::from([(2, 1)]);
    assert!(!s.orphans(&live).contains(2));
    s.hear(2, 1, 1, claim(&[(2, 1, stamp(2, 0, 2))]));
    assert!(s.settle(&live));
    assert_eq!(s.held().keys().copied().collect::<Vec<_>>(), [3]);
    s.expire_held();
    assert!(s.orphans(&live).contains(3) && !s.orphans(&live).contains(2));
}

#[test]
fn an_adoption_below_a_take_does_not_lower_its_stamp() {
    let mut s = sections(1);
    s.hear(2, 1, 1, claim(&[(7, 1, stamp(2, 0, 2))]));
    s.take_at_once(&[(7, Direction::Forward)]);
    // Peer 2 yields to this take; then a division that was decided before ends.
    s.adopt_at_once(epoch(1), &[], &forward(&[6, 7]));
    assert_eq!(
        s.plan().iter().map(|p| p.stamp).collect::<Vec<_>>(),
        [stamp(1, 0, 1), stamp(2, 1, 1)]
    );
    assert!(
        !s.settle(&LivePeers::from([(2, 1)])),
        "what peer 2 said before it yielded takes nothing back"
    );
}

#[test]
fn a_take_beats_every_stamp_heard() {
    let mut s = sections(1);
    s.hear(2, 1, 1, claim(&[(7, 1, stamp(5, 3, 2))]));
    assert_eq!(
        s.take_at_once(&[(7, Direction::Backward), (7, Direction::Backward)]),
        1
    );
    assert_eq!(s.plan()[0].stamp, stamp(5, 4, 1));
}

#[test]
fn covered_cells_leave_plan_and_held() {
    let mut s = sections(1);
    s.adopt_at_once(epoch(1), &[], &forward(&[0, 1, 2]));
    s.adopt_at_once(epoch(2), &[], &forward(&[0]));
    let c = CellSet::of(10, [0, 1]);
    assert!(s.cover(&c));
    assert!(!s.cover(&c));
    assert!(s.plan().is_empty());
    assert_eq!(s.held().keys().copied().collect::<Vec<_>>(), [2]);
}

#[test]
fn what_does_not_fit_into_a_register_is_not_planned() {
    let n = 200;
    let mut s = Sections::new(1, n, CellSet::new(n));
    let scattered: Vec<(u16, Direction)> =
        (0..n).step_by(2).map(|c| (c, Direction::Forward)).collect();
    s.adopt_at_once(epoch(1), &[], &scattered);
    assert_eq!(s.plan().len(), PLAN_MAX);
    let listed: Vec<u16> = unpack(&s.claim(1, 1, 0).plan, n)
        .iter()
        .map(|p| p.cell)
        .collect();
    assert_eq!(listed, s.plan().iter().map(|p| p.cell).collect::<Vec<_>>());
}

/// Of sixteen runs one is cut in two: the last one would be planned, and no claim would say so.
#[test]
fn what_no_longer_fits_after_a_cell_was_lost_or_given_up_is_not_planned() {
    let n = 100;
    let runs: Vec<(u16, Direction)> = (0..n)
        .filter(|c| c % 6 < 3)
        .take(3 * PLAN_MAX)
        .map(|c| (c, Direction::Forward))
        .collect();
    let cut: [fn(&mut Sections); 2] = [
        |s| assert!(s.hear(2, 1, 1, claim(&[(13, 1, stamp(5, 3, 2))]))),
        |s| s.give_up(&[13]),
    ];
    for cut in cut {
        let mut s = Sections::new(1, n, CellSet::new(n));
        s.adopt_at_once(epoch(1), &[], &runs);
        assert_eq!(s.plan().len(), 3 * PLAN_MAX);
        cut(&mut s);
        s.settle(&[(2, 1)].into_iter().collect());
        assert_eq!(s.plan().len(), 3 * PLAN_MAX - 4);
        assert_eq!(unpack(&s.claim(1, 1, 0).plan, n), s.plan());
    }
}

#[test]
fn what_another_has_left_are_the_open_cells_of_its_newest_plan() {
    let mut sections = Sections::new(1, 10, CellSet::of(10, [4]));
    assert_eq!((sections.n_left(2), sections.plan_of(2)), (0, Vec::new()));
    let listed = |first, count| ListedRun {
        run: CellRun { first, count },
        backward: true,
        stamp: stamp(1, 0, 2),
    };
    let claim = Claim {
        plan: vec![listed(8, 4), listed(3, 3)],
        held: vec![listed(6, 1)],
        ..Claim::default()
    };
    assert!(sections.hear(2, 1, 1, claim));
    let cells: Vec<u16> = sections.plan_of(2).iter().map(|p| p.cell).collect();
    assert_eq!(cells, [1, 0, 9, 8, 5, 3]);
    assert_eq!(sections.n_left(2), 6);
}

#[test]
fn of_what_several_list_the_highest_live_stamp_counts_and_claims_of_past_lives_are_among_them() {
    let mut s = sections(1);
    s.adopt_at_once(epoch(3), &[], &forward(&[2, 3]));
    s.hear(2, 1, 1, claim(&[(3, 2, stamp(2, 0, 2))]));
    s.hear(3, 1, 1, claim(&[(4, 3, stamp(4, 0, 3))]));
    s.hear(4, 1, 1, claim(&[(6, 3, stamp(9, 0, 4))]));
    // The UAV 4 is in its second life, of which nothing is heard yet.
    let contested = s.contested(&LivePeers::from([(2, 1), (3, 1), (4, 2)]));
    let own = s.plan().iter().find(|p| p.cell == 3).map(|p| p.stamp);
    let wanted = [(3, own.unwrap()), (4, stamp(4, 0, 3)), (6, stamp(4, 0, 3))];
    assert_eq!(contested, wanted.into());
}

#[test]
fn what_is_covered_planned_or_beyond_the_loop_is_not_taken() {
    let mut s = Sections::new(1, 10, CellSet::of(10, [4]));
    assert_eq!(s.take_at_once(&forward(&[2])), 1);
    let taken = s.taken(&forward(&[2, 4, 10, 3, 3]));
    assert_eq!(taken.iter().map(|p| p.cell).collect::<Vec<_>>(), [3]);
    // Between the promise and the answer of the disk a cell may be covered or planned.
    let both = s.taken(&forward(&[5, 6, 7]));
    s.cover(&CellSet::of(10, [5]));
    assert_eq!(s.take_at_once(&forward(&[6])), 1);
    s.append(&both);
    let plan: Vec<u16> = s.plan().iter().map(|p| p.cell).collect();
    assert_eq!(plan, [2, 6, 7]);
}

#[test]
fn what_is_made_durable_of_a_plan_is_the_claim_that_tells_it() {
    let mut s = sections(1);
    let epoch = epoch(3);
    assert!(s.adopt_at_once(epoch, &[], &forward(&[1, 2, 3])));
    let written = s.claim_with(epoch, s.plan(), 7, 11);
    assert_eq!(written, s.claim(7, 11, 0));
    assert_eq!(s.fitting(s.plan()), 3);
}

#[test]
fn takes_of_a_new_life_outrank_what_the_one_before_adopted() {
    let mut s = sections(1);
    s.restore_epoch(epoch(4));
    s.restore_epoch(epoch(2));
    assert_eq!(s.epoch(), epoch(4));
    assert_eq!(s.taken(&forward(&[2]))[0].stamp, stamp(4, 1, 1));
    assert!(!s.adopt_at_once(epoch(4), &[], &forward(&[2])));
    assert!(s.adopt_at_once(epoch(5), &[], &forward(&[2])));
}
