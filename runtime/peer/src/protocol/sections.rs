//! A peer's own section of the loop, and the rules by which cells change hands
//! (D2.7 §3.6.5, made safe for lost and late messages).
//!
//! The owner of a cell is whoever's own newest claim lists it. Nobody owns
//! anything by somebody else's computation, so the rules below read only claims:
//!
//! | rule | when | what |
//! |---|---|---|
//! | yield | a live claim *plans* one of my planned cells at a higher stamp | I drop it |
//! | release | a live claim *plans* one of my held cells at a higher stamp | I drop it |
//! | orphan | an uncovered cell that no live claim lists | anybody may take it |
//! | adopt | a round is decided | new cells at `(epoch, 0, id)`; what I give away is held |
//! | take | without a round | at `(epoch, 1 + highest take heard, id)` |
//! | expire | held too long | dropped; it is an orphan from then on |
//!
//! Stamps of one cell only grow, so of two listings exactly one yields. A late or
//! lost adoption is duplicate work, never a gap.
//!
//! There is no time in here: *when* a rule may be used is the business of
//! `negotiation`; that it is safe whenever it is used is checked
//! exhaustively on small swarms in `tests/model.rs`. How cells are written into a
//! claim is left to [`super::runs`].

use super::runs::{Packer, PlannedCell, cells_of, unpack};
use crate::Incarnation;
use crate::cells::CellSet;
use crate::wire::limits::{HELD_MAX, PLAN_MAX};
use crate::wire::message::{CellRun, Claim, Epoch, ListedRun, Stamp};
use skein_flight::coverage::ring::Direction;
use std::collections::{BTreeMap, BTreeSet};
use std::hash::{Hash, Hasher};

/// The life in which a UAV is launched, if its disk knows of none.
pub const FIRST_LIFE: Incarnation = 1;

/// No record has this number: what a peer writes is counted from 1.
const PRESUMED_SEQ: u32 = 0;

/// How often the cells of a first section were taken without a round: nobody took them before.
const FIRST_TAKE: u16 = 1;

/// The peers whose claims count, with the life in which they are alive: not believed down, and
/// hearing somebody (whose claim says `alone` is out of reach); or on the roster, and not heard
/// of yet.
pub type LivePeers = BTreeMap<u16, Incarnation>;

/// The newest claim heard from another peer.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct HeardClaim {
    /// In which life it was written.
    pub incarnation: Incarnation,
    /// Its version within that life.
    pub seq: u32,
    /// What it says.
    pub claim: Claim,
    listed: CellSet,
    /// How many of the cells that it plans are not covered.
    left: usize,
}

/// What changed since it was last looked at. It follows from what happened and not from what
/// is, so it makes no two sections different.
#[derive(Clone, Debug, Default)]
struct News {
    /// Whose claim is new, or who has less left than before.
    owners: BTreeSet<u16>,
    /// Whether this peer lists more than before.
    gained: bool,
    /// Whether any cell may be listed by fewer than before, or beyond all or not any more.
    listing: bool,
    /// What others ceased to list in the life in which they listed it.
    let_go: Option<CellSet>,
}

impl PartialEq for News {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Eq for News {}

impl Hash for News {
    fn hash<H: Hasher>(&self, _: &mut H) {}
}

/// The state that the rules work on.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Sections {
    me: u16,
    cells: u16,
    epoch: Epoch,
    plan: Vec<PlannedCell>,
    held: BTreeMap<u16, Stamp>,
    covered: CellSet,
    unassigned: CellSet,
    heard: BTreeMap<u16, HeardClaim>,
    /// The lives in which peers said with their newest claims that they are alone.
    alone: BTreeMap<u16, Incarnation>,
    news: News,
}

impl Sections {
    /// An empty section on a loop of `cells` cells, of which `covered` need no service.
    #[must_use]
    pub fn new(me: u16, cells: u16, covered: CellSet) -> Self {
        Self {
            me,
            cells,
            epoch: Epoch::default(),
            plan: Vec::new(),
            held: BTreeMap::new(),
            covered,
            unassigned: CellSet::new(cells),
            heard: BTreeMap::new(),
            alone: BTreeMap::new(),
            news: News {
                listing: true,
                ..News::default()
            },
        }
    }

    /// Those whose claim is new since this was last asked, or who have less left.
    pub(crate) fn take_owners(&mut self) -> BTreeSet<u16> {
        core::mem::take(&mut self.news.owners)
    }

    /// Whether this peer listed more cells since this was last asked.
    pub(crate) fn take_gained(&mut self) -> bool {
        core::mem::take(&mut self.news.gained)
    }

    /// Whether there may be orphans since this was last asked that were none, if the same peers
    /// are alive.
    pub(crate) fn take_listing(&mut self) -> bool {
        core::mem::take(&mut self.news.listing)
    }

    /// What others let go since this was last asked, in the life in which they listed it: they
    /// covered it, or somebody else lists it.
    pub(crate) fn take_let_go(&mut self) -> Option<CellSet> {
        self.news.let_go.take()
    }

    /// The lives in which peers said with their newest claims that they are alone.
    #[must_use]
    pub fn alone(&self) -> &BTreeMap<u16, Incarnation> {
        &self.alone
    }

    /// Number of cells of the loop.
    #[must_use]
    pub fn cells(&self) -> u16 {
        self.cells
    }

    /// Covered cells known of.
    #[must_use]
    pub fn covered(&self) -> &CellSet {
        &self.covered
    }

    /// What will be flown, in order.
    #[must_use]
    pub fn plan(&self) -> &[PlannedCell] {
        &self.plan
    }

    /// What was given away and is still answered for.
    #[must_use]
    pub fn held(&self) -> &BTreeMap<u16, Stamp> {
        &self.held
    }

    /// Cells known to be beyond anybody's endurance.
    #[must_use]
    pub fn unassigned(&self) -> &CellSet {
        &self.unassigned
    }

    /// The latest division adopted.
    #[must_use]
    pub fn epoch(&self) -> Epoch {
        self.epoch
    }

    /// The newest claim heard of each other peer.
    #[must_use]
    pub fn heard(&self) -> &BTreeMap<u16, HeardClaim> {
        &self.heard
    }

    /// Whether everything is covered.
    #[must_use]
    pub fn complete(&self) -> bool {
        self.covered.is_full()
    }

    /// Adds covered cells; they leave the plan, and are beyond nobody's endurance. Returns
    /// whether any was new.
    pub fn cover(&mut self, covered: &CellSet) -> bool {
        // Most that is heard is known.
        if covered.is_subset(&self.covered) {
            return false;
        }
        let mut fresh = covered.clone();
        fresh.subtract(&self.covered);
        if !self.covered.union_with(covered) {
            return false;
        }
        let covered = &self.covered;
        // News is of a few cells mostly.
        let fresh: Vec<u16> = fresh.iter().collect();
        for (author, h) in &mut self.heard {
            if fresh.iter().any(|c| h.listed.contains(*c)) {
                h.left = n_open(&h.claim, covered);
                self.news.owners.insert(*author);
            }
        }
        self.plan.retain(|p| !covered.contains(p.cell));
        self.held.retain(|c, _| !covered.contains(*c));
        self.unassigned.subtract(covered);
        true
    }

    /// Notes a claim of another peer, unless an equally new one is known.
    /// Returns whether it was newer.
    pub fn hear(&mut self, author: u16, incarnation: Incarnation, seq: u32, claim: Claim) -> bool {
        if author == self.me {
            return false;
        }
        if let Some(known) = self.heard.get(&author)
            && (known.incarnation, known.seq) >= (incarnation, seq)
        {
            return false;
        }
        let runs = claim.plan.iter().chain(&claim.held);
        let listed = CellSet::of_runs(self.cells, runs.map(|l| l.run));
        if claim.alone {
            self.alone.insert(author, incarnation);
        } else {
            self.alone.remove(&author);
        }
        self.news.owners.insert(author);
        let heard = HeardClaim {
            incarnation,
            seq,
            left: n_open(&claim, &self.covered),
            claim,
            listed,
        };
        let before = self.heard.insert(author, heard);
        if let Some(before) = before {
            self.note_freed(author, before);
        }
        true
    }

    /// Notes what an author listed before and that is not covered and not listed by it any more.
    fn note_freed(&mut self, author: u16, before: HeardClaim) {
        let mut freed = before.listed;
        freed.subtract(&self.covered);
        let now = self.heard.get(&author);
        let Some(now) = now.filter(|h| h.incarnation == before.incarnation) else {
            self.news.listing = true;
            return;
        };
        freed.subtract(&now.listed);
        if !freed.is_empty() {
            self.news.listing = true;
            let none = || CellSet::new(self.cells);
            let let_go = self.news.let_go.get_or_insert_with(none);
            let_go.union_with(&freed);
        }
    }

    /// What everybody computed alike from the roster, that a peer of which no claim was heard
    /// begins with. Its first claim, which says what it lists, takes the place of this.
    pub fn presume(&mut self, of: u16, run: CellRun, direction: Direction, eta_ms: u32) {
        let stamp = Stamp {
            epoch: Epoch::default(),
            take: FIRST_TAKE,
            id: of,
        };
        let listed = ListedRun {
            run,
            backward: direction == Direction::Backward,
            stamp,
        };
        let claim = Claim {
            plan: vec![listed],
            eta_ms,
            ..Claim::default()
        };
        self.hear(of, FIRST_LIFE, PRESUMED_SEQ, claim);
    }

    /// Nothing is presumed any more.
    pub fn forget_presumed(&mut self) {
        self.heard.retain(|_, h| h.seq != PRESUMED_SEQ);
        self.news.listing = true;
    }

    /// Rules *yield* and *release*, against every live claim. Returns whether
    /// this peer's own claim changed.
    pub fn settle(&mut self, live: &LivePeers) -> bool {
        let mine = self.listed();
        let theirs = self.planned_by(self.heard.iter(), live, &mine);
        self.yield_to(&theirs)
    }

    /// The same against the live claims of some.
    pub(crate) fn settle_with(&mut self, authors: &BTreeSet<u16>, live: &LivePeers) -> bool {
        let mine = self.listed();
        let heard = authors.iter().filter_map(|id| self.heard.get_key_value(id));
        let theirs = self.planned_by(heard, live, &mine);
        self.yield_to(&theirs)
    }

    /// The cells that this peer lists.
    fn listed(&self) -> CellSet {
        let planned = self.plan.iter().map(|p| p.cell);
        CellSet::of(self.cells, planned.chain(self.held.keys().copied()))
    }

    fn yield_to(&mut self, theirs: &BTreeMap<u16, Stamp>) -> bool {
        let before = (self.plan.len(), self.held.len());
        let outbid = |cell: u16, mine: Stamp| theirs.get(&cell).is_some_and(|s| *s > mine);
        self.plan.retain(|p| !outbid(p.cell, p.stamp));
        self.held.retain(|c, s| !outbid(*c, *s));
        let changed = before != (self.plan.len(), self.held.len());
        self.news.listing |= changed;
        if changed {
            // A run of which others took the middle is two.
            self.trim();
        }
        changed
    }

    /// Of some cells those that live claims of some others plan, each with the highest stamp.
    fn planned_by<'a>(
        &self,
        heard: impl Iterator<Item = (&'a u16, &'a HeardClaim)>,
        live: &LivePeers,
        cells: &CellSet,
    ) -> BTreeMap<u16, Stamp> {
        let mut theirs: BTreeMap<u16, Stamp> = BTreeMap::new();
        for (author, h) in heard {
            // Most claims list none of a few cells.
            if live.get(author) != Some(&h.incarnation) || !h.listed.intersects(cells) {
                continue;
            }
            for l in &h.claim.plan {
                for c in cells_of(l.run, self.cells).filter(|c| cells.contains(*c)) {
                    let s = theirs.entry(c).or_default();
                    *s = (*s).max(l.stamp);
                }
            }
        }
        theirs
    }

    /// Uncovered cells that no live claim lists, this peer's own included, and
    /// that are not known to be beyond anybody's endurance.
    #[must_use]
    pub fn orphans(&self, live: &LivePeers) -> CellSet {
        let mut wanted = CellSet::full(self.cells);
        wanted.subtract(&self.unassigned);
        self.unlisted(wanted, live)
    }

    /// The same where none may have become one since these were found: without those that are
    /// covered by now, or listed by those whose claims are new.
    pub(crate) fn still_orphans(
        &self,
        orphans: &mut CellSet,
        new: &BTreeSet<u16>,
        live: &LivePeers,
    ) {
        orphans.subtract(&self.covered);
        for author in new {
            let heard = self.heard.get(author);
            let heard = heard.filter(|h| live.get(author) == Some(&h.incarnation));
            if let Some(h) = heard {
                orphans.subtract(&h.listed);
            }
        }
    }

    /// Cells that were beyond everybody's endurance when they were last divided, and that
    /// no live claim lists.
    #[must_use]
    pub fn left_over(&self, live: &LivePeers) -> CellSet {
        self.unlisted(self.unassigned.clone(), live)
    }

    /// Those of some cells that are not covered and that no live claim lists.
    fn unlisted(&self, mut free: CellSet, live: &LivePeers) -> CellSet {
        free.subtract(&self.covered);
        for p in &self.plan {
            free.remove(p.cell);
        }
        for c in self.held.keys() {
            free.remove(*c);
        }
        for (author, h) in &self.heard {
            if live.get(author) == Some(&h.incarnation) {
                free.subtract(&h.listed);
            }
        }
        free
    }

    /// Of the cells that several claims list those that a live one plans, this peer's own
    /// included, each with the highest stamp. A claim of a life that is over counts among the
    /// several: [`Self::plan_of`] tells its plan until a later one is heard.
    #[must_use]
    pub fn contested(&self, live: &LivePeers) -> BTreeMap<u16, Stamp> {
        let mut listed = self.listed();
        let mut by_several = CellSet::new(self.cells);
        for h in self.heard.values().filter(|h| !h.listed.is_empty()) {
            let mut again = h.listed.clone();
            again.intersect_with(&listed);
            by_several.union_with(&again);
            listed.union_with(&h.listed);
        }
        let mut highest = self.planned_by(self.heard.iter(), live, &by_several);
        for p in self.plan.iter().filter(|p| by_several.contains(p.cell)) {
            let known = highest.entry(p.cell).or_default();
            *known = (*known).max(p.stamp);
        }
        highest
    }

    /// Uncovered cells of another peer's newest plan, in its order of flight.
    #[must_use]
    pub fn plan_of(&self, author: u16) -> Vec<PlannedCell> {
        let Some(h) = self.heard.get(&author) else {
            return Vec::new();
        };
        let mut plan = unpack(&h.claim.plan, self.cells);
        plan.retain(|p| !self.covered.contains(p.cell));
        plan
    }

    /// How many cells [`Sections::plan_of`] has.
    #[must_use]
    pub fn n_left(&self, author: u16) -> usize {
        self.heard.get(&author).map_or(0, |h| h.left)
    }

    /// Rule *adopt*: what the plan becomes with `commits`, then `section`, in order of
    /// flight. Covered cells and repetitions are left out. A cell this peer lists
    /// already at a higher stamp keeps it: another may have yielded to it, and a lower
    /// one would yield in turn to what that other said before. Nothing changes yet:
    /// the plan must be durable before it is flown, see [`Sections::install`].
    #[must_use]
    pub fn adopted(
        &self,
        epoch: Epoch,
        commits: &[(u16, Direction)],
        section: &[(u16, Direction)],
    ) -> Vec<PlannedCell> {
        let stamp = Stamp {
            epoch,
            take: 0,
            id: self.me,
        };
        let planned = self.plan.iter().map(|p| (p.cell, p.stamp));
        let listed: BTreeMap<u16, Stamp> = self
            .held
            .iter()
            .map(|(c, s)| (*c, *s))
            .chain(planned)
            .collect();
        let mut seen = self.covered.clone();
        let mut plan = Vec::new();
        for &(cell, direction) in commits.iter().chain(section) {
            if cell < self.cells && !seen.contains(cell) {
                seen.insert(cell);
                let stamp = listed.get(&cell).map_or(stamp, |s| stamp.max(*s));
                plan.push(PlannedCell {
                    cell,
                    direction,
                    stamp,
                });
            }
        }
        let fits = self.packer().pack(&plan, PLAN_MAX).1;
        plan.truncate(fits);
        plan
    }

    /// Makes a durable plan of [`Sections::adopted`] the plan. What was planned and is
    /// no longer, is held. An epoch that is not above the present one is refused.
    pub fn install(&mut self, epoch: Epoch, plan: &[PlannedCell]) -> bool {
        if epoch <= self.epoch {
            return false;
        }
        let kept = CellSet::of(self.cells, plan.iter().map(|p| p.cell));
        for p in &self.plan {
            if !kept.contains(p.cell) {
                let s = self.held.entry(p.cell).or_insert(p.stamp);
                *s = (*s).max(p.stamp);
            }
        }
        self.held.retain(|c, _| !kept.contains(*c));
        self.plan = plan
            .iter()
            .filter(|p| !self.covered.contains(p.cell))
            .copied()
            .collect();
        self.epoch = epoch;
        (self.news.gained, self.news.listing) = (true, true);
        self.trim();
        self.check();
        true
    }

    /// Rule *take*: the cells with stamps above all that was heard for them. Covered
    /// cells and cells already planned are left out. Nothing changes yet: a take must
    /// be durable before it is flown, see [`Sections::append`].
    #[must_use]
    pub fn taken(&self, cells: &[(u16, Direction)]) -> Vec<PlannedCell> {
        let mut out: Vec<PlannedCell> = Vec::new();
        for &(cell, direction) in cells {
            let planned = self.plan.iter().chain(&out).any(|p| p.cell == cell);
            if cell >= self.cells || self.covered.contains(cell) || planned {
                continue;
            }
            let mut top = Stamp {
                epoch: self.epoch,
                take: 0,
                id: self.me,
            };
            for h in self.heard.values().filter(|h| h.listed.contains(cell)) {
                for l in h.claim.plan.iter().chain(&h.claim.held) {
                    if cells_of(l.run, self.cells).any(|c| c == cell) {
                        top = top.max(l.stamp);
                    }
                }
            }
            if let Some(s) = self.held.get(&cell) {
                top = top.max(*s);
            }
            let stamp = Stamp {
                epoch: top.epoch,
                take: top.take.saturating_add(1),
                id: self.me,
            };
            out.push(PlannedCell {
                cell,
                direction,
                stamp,
            });
        }
        out
    }

    /// Adds durable takes of [`Sections::taken`] to the end of the plan, but for cells
    /// covered or planned meanwhile.
    pub fn append(&mut self, taken: &[PlannedCell]) {
        for p in taken {
            if !self.covered.contains(p.cell) && !self.plan.iter().any(|q| q.cell == p.cell) {
                self.plan.push(*p);
                self.held.remove(&p.cell);
                self.unassigned.remove(p.cell);
            }
        }
        (self.news.gained, self.news.listing) = (true, true);
        self.trim();
        self.check();
    }

    /// How many cells of a plan fit into one claim, from the first on.
    #[must_use]
    pub fn fitting(&self, plan: &[PlannedCell]) -> usize {
        self.packer().pack(plan, PLAN_MAX).1
    }

    /// The claim as it would be with another plan: what is made durable first.
    #[must_use]
    pub fn claim_with(
        &self,
        epoch: Epoch,
        plan: &[PlannedCell],
        revision: u32,
        loop_hash: u64,
    ) -> Claim {
        let plan = self.packer().pack(plan, PLAN_MAX).0;
        Claim {
            revision,
            loop_hash,
            epoch,
            plan,
            ..Claim::default()
        }
    }

    /// Rule *expire*: nobody took over what was given away; it becomes orphaned.
    pub fn expire_held(&mut self) {
        self.held.clear();
        self.news.listing = true;
    }

    /// Gives up planned cells that cannot be flown; they become orphans.
    pub fn give_up(&mut self, cells: &[u16]) {
        self.plan.retain(|p| !cells.contains(&p.cell));
        self.news.listing = true;
        self.trim();
    }

    /// Keeps only the first `count` planned cells; the others become orphans.
    pub fn keep(&mut self, count: usize) {
        self.plan.truncate(count);
        self.news.listing = true;
    }

    /// Notes which cells are beyond anybody's endurance.
    pub fn set_unassigned(&mut self, cells: &[u16]) {
        self.unassigned = CellSet::of(self.cells, cells.iter().copied());
        self.unassigned.subtract(&self.covered);
        self.news.listing = true;
    }

    /// The division that an earlier life adopted: what is taken from now on counts as
    /// later, so that an epoch never goes back.
    pub fn restore_epoch(&mut self, epoch: Epoch) {
        self.epoch = self.epoch.max(epoch);
    }

    /// Forgets all ownership, as after a restart; coverage stays.
    pub fn reset_ownership(&mut self) {
        self.plan.clear();
        self.held.clear();
        self.news.listing = true;
    }

    /// The claim to be published.
    #[must_use]
    pub fn claim(&self, revision: u32, loop_hash: u64, eta_ms: u32) -> Claim {
        let held = self.held_cells();
        Claim {
            revision,
            loop_hash,
            epoch: self.epoch,
            plan: self.packer().pack(&self.plan, PLAN_MAX).0,
            held: self.packer().pack(&held, HELD_MAX).0,
            eta_ms,
            alone: false,
        }
    }

    fn packer(&self) -> Packer<'_> {
        Packer {
            cells: self.cells,
            covered: &self.covered,
        }
    }

    /// Held cells, ascending, in the form in which runs are packed.
    fn held_cells(&self) -> Vec<PlannedCell> {
        self.held
            .iter()
            .map(|(c, s)| PlannedCell {
                cell: *c,
                direction: Direction::Forward,
                stamp: *s,
            })
            .collect()
    }

    /// What holds whatever is heard: planned and held cells are open cells of the loop,
    /// listed once.
    fn check(&self) {
        let planned = CellSet::of(self.cells, self.plan.iter().map(|p| p.cell));
        let count = usize::from(planned.count());
        assert_eq!(
            count,
            self.plan.len(),
            "a cell is planned once, on the loop"
        );
        assert!(
            !planned.intersects(&self.covered),
            "what is planned is open"
        );
        let held = CellSet::of(self.cells, self.held.keys().copied());
        assert!(!planned.intersects(&held), "what is planned is not held");
    }

    /// What does not fit into a claim is not flown: it would be a secret.
    fn trim(&mut self) {
        let fits = self.packer().pack(&self.plan, PLAN_MAX).1;
        self.plan.truncate(fits);
        let held = self.held_cells();
        let fits = self.packer().pack(&held, HELD_MAX).1;
        for p in held.iter().skip(fits) {
            self.held.remove(&p.cell);
        }
    }
}

/// How many cells of a claim's plan are not covered.
fn n_open(claim: &Claim, covered: &CellSet) -> usize {
    let cells = claim.plan.iter();
    let cells = cells.flat_map(|l| cells_of(l.run, covered.capacity()));
    cells.filter(|c| !covered.contains(*c)).count()
}

#[cfg(test)]
mod tests;
