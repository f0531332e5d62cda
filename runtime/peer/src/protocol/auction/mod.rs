//! The task auction: who does which task other than coverage, and how that changes
//! (D2.7 §1.2.3, §1.3, §3.2).
//!
//! Every peer has one register, its [`Bundle`]: the offer on which it was last settled (its
//! pose at that time, speed, sensors, endurance), the tasks that it holds with its bids, and
//! how far it is with each. All who know the same tasks and offers hold the same sequential
//! auction by themselves ([`settlement`]) and each lists its own part; nobody owns anything
//! by somebody else's computation. A hash of what was known, the basis, says who knew the
//! same.
//!
//! One task, as one peer has it:
//!
//! | state | event | next state | what follows |
//! |---|---|---|---|
//! | open | the settlement gives it to this peer | tentative | said |
//! | tentative | the settlement gives it to another; revised, cancelled, done by another | open | said |
//! | tentative | the UAV is free, it is first in the order, nobody claims it, and all who live have the same basis, or the basis is as old as two ways through the component, or none became as old in twice that time | committed | said, flown |
//! | committed | begun | begun | said |
//! | committed, begun | revised, cancelled; done by another; claimed by one who goes before | open | dropped at the next waypoint |
//! | committed | all who live have the same basis, by which everybody together gains a tenth if it is another's | open | dropped |
//! | committed, begun | finished | done | said |
//! | committed, begun | the UAV asks to be relieved | leaving; open for others | said |
//! | leaving | another has begun it | open | dropped: made before broken |
//!
//! A peer:
//!
//! | event | what follows |
//! |---|---|
//! | tasks change, somebody is down or back, it dropped a claim | a new offer from where it is; what it holds it keeps |
//! | another's offer changes, after it committed to something | likewise |
//! | another's offer changes else | it is settled anew on its old offer |
//!
//! A task that is held until somebody ends it (a relay position) ties who holds it; `held` says
//! how many may be, while cells are to be covered.
//!
//! Of two claims of living peers on one task done goes before begun, begun before
//! committed, that before leaving; of equal ones the higher bid, then the lower id. What the
//! dead claimed is open; what they did is done.
//!
//! # Guarantees
//! - Once nothing changes and everything has arrived, all bases are equal, so that no two
//!   living peers list one task, every task that somebody can do is listed, and the value is
//!   at least that of sequential greedy. `tests/auction.rs` searches for ways out of that.
//! - Committing, beginning and finishing do not change the settlement: it rests on offers,
//!   which stay as they are. So an owner changes only after a failure or another task.
//!
//! # Complexity
//! An event costs one look at each claim. A settlement is computed where the basis changed,
//! once its outcome is said or committed to: all who live have the same basis, or a period has
//! passed without news. While the offers of thirty come in, that is once instead of thirty
//! times.

mod basis;
pub mod flown;
mod held;
pub mod improvement;
pub mod settlement;

use crate::wire::limits::PEERS_MAX;
use crate::wire::tasks::{Bundle, BundleTask, DoneTask, Offer, Progress, Task, TaskId, TaskState};
use crate::{Incarnation, PeerId};
use settlement::{Settlement, Settler, Tasks};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

/// Tasks that a peer holds in mind, of all authors: those of four hundred would not go round
/// within a minute. What comes beyond is refused.
pub const KNOWN_MAX: usize = 256;

/// A committed task moves if all together gain so many hundredths.
const WORTH_MOVING_PERCENT: u64 = 110;

/// So many times as long as a basis is to stand is waited for one that does.
const RESTLESS_PATIENCES: u32 = 2;

/// Version of a bundle: life, then number within it.
pub type Version = (Incarnation, u32);

/// How far a claim goes before others.
type Rank = (Progress, u32, Reverse<PeerId>);

/// What can happen to an auction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// A task, a change of one, or its end.
    Task(TaskId, Task),
    /// A task that followed from what all know follows from it no more: nobody asks for it.
    Withdrawn(TaskId),
    /// Another peer's bundle.
    Heard(PeerId, Version, Bundle),
    /// Which other UAVs live and are not suspected.
    Live(BTreeSet<PeerId>),
    /// What this peer can offer now.
    Present(Offer),
    /// The UAV can be given its next task.
    Free,
    /// It is at a task.
    Begun(TaskId),
    /// A task is done.
    Finished(TaskId),
    /// It wants to be relieved of a task.
    Relieve(TaskId),
    /// It can do no task any more: what it claims is open again.
    GiveUp,
    /// Its mission does not lead it to this task any more: it is open again.
    LetGo(TaskId),
    /// What was unassigned may be in its reach by now.
    OfferAnew,
    /// Whether cells are to be covered, for which somebody has to be left.
    Cells(bool),
    /// Identifies the map that ways follow from: whoever has another has another basis.
    Map(u32),
    /// A beacon period has passed, in a component of this diameter.
    Period(u8),
}

/// What follows from an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// [`Auction::bundle`] is new and to be said.
    Publish,
    /// The task is to be flown next.
    Fly(TaskId),
    /// The task is no longer this peer's: it is left at the next waypoint.
    Drop(TaskId),
}

/// The auction as one peer holds it.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Auction {
    me: PeerId,
    version: Version,
    present: Offer,
    tasks: Tasks,
    others: BTreeMap<PeerId, (Version, Bundle)>,
    live: BTreeSet<PeerId>,
    own: Bundle,
    /// What was said of it last.
    said: Bundle,
    settled: Settlement,
    /// What is known has changed since it was settled.
    is_due: bool,
    /// Tasks this peer committed to that all would gain by giving to others.
    moving: BTreeSet<TaskId>,
    /// Tasks or the living changed since the last offer.
    stale: bool,
    free: bool,
    /// Periods for which the basis has stood.
    quiet: u32,
    /// So many are enough to commit without having heard from everybody.
    patience: u32,
    /// Periods since tasks changed, or since it could last commit, in which the basis never
    /// stood for as long as that.
    restless: u32,
    /// What somebody said to have done, in which revision: a later life forgets it, this does
    /// not.
    known_done: BTreeSet<DoneTask>,
    map: u32,
    /// Whether cells are to be covered.
    cells_open: bool,
    /// Periods for which too many have held something for anybody to be left to cover.
    too_many: u32,
}

impl Auction {
    /// A peer that holds nothing and knows nobody.
    #[must_use]
    pub fn new(me: PeerId, life: Incarnation, offer: Offer) -> Self {
        Self {
            me,
            version: (life, 0),
            present: offer,
            tasks: BTreeMap::new(),
            others: BTreeMap::new(),
            live: BTreeSet::new(),
            own: Bundle {
                offer,
                ..Bundle::default()
            },
            said: Bundle::default(),
            settled: Settlement::default(),
            is_due: false,
            moving: BTreeSet::new(),
            stale: true,
            free: false,
            quiet: 0,
            patience: u32::MAX,
            restless: 0,
            known_done: BTreeSet::new(),
            map: 0,
            cells_open: false,
            too_many: 0,
        }
    }

    /// Another life of this peer begins: what it held and did in the last one is void. What
    /// was done stays done.
    pub fn begin_life(&mut self, life: Incarnation) {
        let (me, present) = (self.me, self.present);
        let old = core::mem::replace(self, Self::new(me, life, present));
        let own = (me, (old.version, old.own));
        self.others = old.others;
        self.tasks = old.tasks;
        self.live = old.live;
        self.patience = old.patience;
        self.map = old.map;
        self.cells_open = old.cells_open;
        self.known_done = old.known_done;
        self.remember_done(&own.1.1);
    }

    /// What this peer says: the newest version counts.
    #[must_use]
    pub fn bundle(&self) -> (Version, &Bundle) {
        (self.version, &self.said)
    }

    /// What this peer holds, whether it is said yet or not.
    #[must_use]
    pub fn held(&self) -> &[BundleTask] {
        &self.own.tasks
    }

    /// Whether there is more to say once a period has passed without news.
    #[must_use]
    pub fn has_more_to_say(&self) -> bool {
        self.said != self.own
    }

    /// The version of another's bundle that is known.
    #[must_use]
    pub fn known(&self, peer: PeerId) -> Option<Version> {
        self.others.get(&peer).map(|(version, _)| *version)
    }

    /// All tasks, as they were heard last.
    #[must_use]
    pub fn tasks(&self) -> &Tasks {
        &self.tasks
    }

    /// What this peer and those who live offer.
    pub fn offers(&self) -> impl Iterator<Item = &Offer> {
        let others = self.living().map(|(_, b)| &b.offer);
        others.chain([&self.own.offer])
    }

    /// Whether cells are to be covered, as far as it was told.
    #[must_use]
    pub fn cells_open(&self) -> bool {
        self.cells_open
    }

    /// Tasks that nobody who lives can do.
    #[must_use]
    pub fn unassigned(&self) -> &[TaskId] {
        &self.settled.unassigned
    }

    /// Whether all who live have settled on the same basis.
    #[must_use]
    pub fn is_agreed(&self) -> bool {
        let same = |id| {
            let heard: Option<&(Version, Bundle)> = self.others.get(id);
            heard.is_some_and(|(_, b)| b.basis == self.own.basis)
        };
        self.live.iter().all(same)
    }

    /// Takes note of what happened, all at once, and says what follows. What bids are worth
    /// comes from `settler`.
    pub fn handle<S: Settler>(
        &mut self,
        events: impl IntoIterator<Item = Event>,
        settler: &S,
    ) -> Vec<Effect> {
        let mut can_follow = false;
        for event in events {
            if matches!(event, Event::Begun(_)) {
                // It follows from what would move whether others are to be told.
                self.settle(settler);
            }
            can_follow |= self.note(event);
        }
        if !can_follow {
            return Vec::new();
        }
        let mut effects = self.drop_lost();
        effects.extend(self.drop_to_cover());
        self.settle_anew(settler);
        effects.extend(self.give_up_moving(settler));
        let is_restless = self.restless >= self.restless_most();
        if is_restless {
            self.restless = 0;
            self.settle(settler);
        }
        effects.extend(self.commit(is_restless));
        let to_say = self.to_say();
        if self.said != to_say {
            self.said = to_say;
            self.version.1 += 1;
            effects.push(Effect::Publish);
        }
        effects
    }

    /// Offers and claims are said at once; what was won, once a period has passed without
    /// news: while offers come in, every one of them changes it.
    fn to_say(&self) -> Bundle {
        if self.quiet > 0 || self.is_agreed() {
            return self.own.clone();
        }
        let bare = |b: &Bundle| {
            let claims = b.tasks.iter().filter(|t| t.progress > Progress::Tentative);
            Bundle {
                tasks: claims.copied().collect(),
                done: b.done.clone(),
                basis: 0,
                ..*b
            }
        };
        let own = bare(&self.own);
        if own == bare(&self.said) {
            self.said.clone()
        } else {
            own
        }
    }

    /// Takes note alone; says whether anything can follow.
    fn note(&mut self, event: Event) -> bool {
        match event {
            Event::Task(id, task) => return self.note_task(id, task),
            Event::Withdrawn(id) => {
                let was = self.tasks.remove(&id).is_some();
                self.stale |= was;
                return was;
            }
            Event::Heard(author, version, bundle) => {
                let room = self.others.len() < PEERS_MAX;
                let newer = self.known(author).map_or(room, |known| version > known);
                if author == self.me || !newer {
                    return false;
                }
                self.remember_done(&bundle);
                self.others.insert(author, (version, bundle));
            }
            Event::Live(live) => {
                let others: BTreeSet<PeerId> =
                    live.into_iter().filter(|id| *id != self.me).collect();
                if others == self.live {
                    return false;
                }
                self.live = others;
                self.stale = true;
            }
            Event::Present(offer) => {
                // Only what it can do at all is news; where it is will be asked for when there
                // is a reason.
                let can = |o: &Offer| (o.speed_mmps > 0, o.takes);
                self.stale |= can(&self.present) != can(&offer);
                self.present = offer;
            }
            Event::Free => self.free = true,
            Event::Begun(id) => {
                // What is begun moves no more: others are told by a new offer.
                self.stale |= self.moving.contains(&id);
                self.progress(id, Progress::Begun);
            }
            Event::Finished(id) => self.progress(id, Progress::Done),
            Event::Relieve(id) => {
                self.progress(id, Progress::Leaving);
                self.stale = true;
            }
            Event::GiveUp => {
                let claims = self.own.tasks.iter();
                let claims = claims.filter(|t| t.progress != Progress::Done);
                let all: Vec<TaskId> = claims.map(|t| t.task).collect();
                self.let_go(&all);
            }
            Event::LetGo(id) => {
                self.let_go(&[id]);
            }
            Event::OfferAnew => self.stale = true,
            Event::Cells(open) => {
                if self.cells_open == open {
                    return false;
                }
                self.cells_open = open;
                self.stale |= self.tasks.values().any(|t| t.is_open() && t.is_held());
            }
            Event::Map(map) => {
                if self.map == map {
                    return false;
                }
                self.map = map;
                self.stale = true;
            }
            Event::Period(diameter) => {
                self.patience = 2 * u32::from(diameter) + 3;
                self.quiet = (self.quiet + 1).min(self.patience);
                self.restless = if self.quiet == self.patience || self.is_agreed() {
                    0
                } else {
                    self.restless.saturating_add(1)
                };
                self.too_many = if self.is_one_too_many() {
                    self.too_many.saturating_add(1)
                } else {
                    0
                };
                // Nothing else changes with time.
                return self.quiet == self.patience
                    || self.restless >= self.restless_most()
                    || self.is_due
                    || self.has_more_to_say()
                    || self.too_many >= self.patience;
            }
        }
        true
    }

    fn note_task(&mut self, id: TaskId, task: Task) -> bool {
        let room = self.tasks.len() < KNOWN_MAX;
        let newer = self.tasks.get(&id).map_or(room, |known| task > *known);
        if newer {
            // That a task was done changes nothing for who knows it already.
            self.stale |= task.state != TaskState::Done || !self.is_done(id);
            self.tasks.insert(id, task);
            self.restless = 0;
        }
        newer
    }

    fn remember_done(&mut self, bundle: &Bundle) {
        let since = bundle.tasks.iter();
        let since = since.filter(|t| t.progress == Progress::Done);
        let since = since.map(|t| DoneTask {
            task: t.task,
            revision: t.revision,
        });
        let tasks = &self.tasks;
        let wanted = |d: &DoneTask| {
            let known = tasks.get(&d.task);
            known.is_none_or(|t| t.revision_as_asked() <= d.revision)
        };
        self.known_done
            .extend(bundle.done.iter().copied().chain(since));
        self.known_done.retain(wanted);
        while self.known_done.len() > KNOWN_MAX {
            self.known_done.pop_first();
        }
    }

    fn progress(&mut self, id: TaskId, progress: Progress) {
        let held = self.own.tasks.iter_mut().find(|t| t.task == id);
        if let Some(held) = held.filter(|t| t.progress != Progress::Tentative) {
            held.progress = progress;
        }
    }

    fn is_current(&self, held: &BundleTask) -> bool {
        let task = self.tasks.get(&held.task);
        task.is_some_and(|t| t.is_open() && t.revision == held.revision)
    }

    /// Bundles of others that live.
    fn living(&self) -> impl Iterator<Item = (PeerId, &Bundle)> {
        let lives = |id: &PeerId| self.live.contains(id);
        let all = self.others.iter().filter(move |(id, _)| lives(id));
        all.map(|(id, (_, bundle))| (*id, bundle))
    }

    /// Who has done a task in its present revision, living or not.
    #[must_use]
    pub fn is_done(&self, id: TaskId) -> bool {
        let revision = self.tasks.get(&id).map(Task::revision_as_asked);
        let remembered = revision.map(|revision| DoneTask { task: id, revision });
        if remembered.is_some_and(|d| self.known_done.contains(&d)) {
            return true;
        }
        let all = self.others.values().map(|(_, b)| b).chain([&self.own]);
        all.into_iter().any(|b| {
            let before = b.done.iter();
            let before = before.map(|d| (d.task, d.revision, Progress::Done));
            let since = b.tasks.iter().map(|t| (t.task, t.revision, t.progress));
            before
                .chain(since)
                .any(|(t, r, p)| t == id && Some(r) == revision && p == Progress::Done)
        })
    }

    /// The claim of another living peer that goes before all others on a task.
    fn claim_of_another(&self, id: TaskId) -> Option<Rank> {
        let claims = self.living().flat_map(|(peer, b)| {
            let claimed = b.tasks.iter().filter(move |t| t.task == id);
            claimed.map(move |t| (peer, t))
        });
        claims
            .filter(|(_, t)| t.progress > Progress::Tentative && self.is_current(t))
            .map(|(peer, t)| rank(peer, t))
            .max()
    }

    /// Lets go of whatever is no longer this peer's to do.
    fn drop_lost(&mut self) -> Vec<Effect> {
        let is_lost = |held: &BundleTask| {
            let is_claim = !matches!(held.progress, Progress::Tentative | Progress::Done);
            let rank = rank(self.me, held);
            let behind = |other: (Progress, u32, _)| {
                // Who is leaving stays until somebody else has begun.
                let met = held.progress != Progress::Leaving || other.0 >= Progress::Begun;
                met && other > rank
            };
            is_claim
                && (!self.is_current(held)
                    || self.is_done(held.task)
                    || self.claim_of_another(held.task).is_some_and(behind))
        };
        let held = self.own.tasks.iter().filter(|t| is_lost(t));
        let lost: Vec<TaskId> = held.map(|t| t.task).collect();
        self.let_go(&lost)
    }

    fn let_go(&mut self, lost: &[TaskId]) -> Vec<Effect> {
        self.stale |= !lost.is_empty();
        let gone = |first: u16| {
            let first = self.own.tasks.iter().take(usize::from(first));
            let gone = first.filter(|t| lost.contains(&t.task)).count();
            u16::try_from(gone).unwrap_or(0)
        };
        let (of_kept, of_begun) = (gone(self.own.kept), gone(self.own.begun));
        self.own.kept -= of_kept;
        self.own.begun -= of_begun;
        self.own.tasks.retain(|t| !lost.contains(&t.task));
        lost.iter().map(|id| Effect::Drop(*id)).collect()
    }

    /// Offers anew where there is a reason for it, and takes note of whether what is known is
    /// what was settled on.
    fn offer_where_due(&mut self) {
        let has_acted = |own: &Bundle| {
            let since = own.tasks.iter().skip(usize::from(own.kept));
            since.into_iter().any(|t| t.progress > Progress::Tentative)
        };
        let mut basis = self.basis();
        let changed = basis != self.own.basis;
        // Who has done all that it had room for offers anew for the rest.
        let mut held = self.own.tasks.iter();
        let spent = self.free
            && !self.is_due
            && !self.own.tasks.is_empty()
            && !self.settled.unassigned.is_empty()
            && held.all(|t| t.progress > Progress::Tentative);
        let anew = self.stale || ((changed || spent) && has_acted(&self.own));
        if anew {
            self.offer_anew();
            basis = self.basis();
        }
        if basis != self.own.basis {
            self.own.basis = basis;
            self.is_due = true;
            self.quiet = 0;
        } else if anew && !self.is_due {
            // The offer may be new and the same as before: what was won stays won.
            self.list_won();
        }
    }

    /// Takes up what is known; settles once that is said or committed to: not while offers come
    /// in, of which every one changes it.
    fn settle_anew<S: Settler>(&mut self, settler: &S) {
        self.offer_where_due();
        if self.quiet > 0 || self.is_agreed() {
            self.settle(settler);
        }
    }

    /// Settles on what is known, unless it has.
    fn settle<S: Settler>(&mut self, settler: &S) {
        if core::mem::take(&mut self.is_due) {
            (self.settled, self.moving) = self.settlement(settler);
            self.list_won();
        }
    }

    /// Offers what the UAV can do from where it is. What it claims it keeps.
    fn offer_anew(&mut self) {
        self.stale = false;
        self.own.offer = self.present;
        let known = |d: &DoneTask| {
            let task = self.tasks.get(&d.task);
            task.is_some_and(|t| t.is_open() && t.revision == d.revision)
        };
        let done = self.own.tasks.iter();
        let done = done.filter(|t| t.progress == Progress::Done);
        let done = done.map(|t| DoneTask {
            task: t.task,
            revision: t.revision,
        });
        let all: BTreeSet<DoneTask> = self.own.done.iter().copied().chain(done).collect();
        // Of tasks that were changed since, nobody asks any more.
        self.own.done = all.into_iter().filter(known).collect();
        let claimed = |t: &BundleTask| !matches!(t.progress, Progress::Tentative | Progress::Done);
        self.own.tasks.retain(claimed);
        let under_way = |t: &BundleTask| t.progress == Progress::Committed;
        self.own.tasks.sort_by_key(under_way);
        let begun = self.own.tasks.iter().filter(|t| !under_way(t)).count();
        let count = |n: usize| u16::try_from(n).unwrap_or(u16::MAX);
        (self.own.kept, self.own.begun) = (count(self.own.tasks.len()), count(begun));
    }

    /// Writes down what the settlement gives to this peer, behind what it keeps.
    fn list_won(&mut self) {
        self.own.tasks.truncate(usize::from(self.own.kept));
        let mine = self.bidders().iter().position(|b| b.0 == self.me);
        let won = mine.and_then(|k| self.settled.orders.get(k));
        for (task, bid) in won.into_iter().flatten() {
            let held = self.own.tasks.iter().any(|t| t.task == *task);
            if let Some(revision) = self.tasks.get(task).map(|t| t.revision)
                && !held
            {
                self.own.tasks.push(BundleTask {
                    task: *task,
                    revision,
                    bid: *bid,
                    progress: Progress::Tentative,
                });
            }
        }
    }

    /// The settlement, and which of its claims this peer would do better to hand over.
    fn settlement<S: Settler>(&self, settler: &S) -> (Settlement, BTreeSet<TaskId>) {
        let (stays, moves) = self.problems();
        let settled = settler.settle(&stays, &self.tasks);
        if stays == moves {
            return (settled, BTreeSet::new());
        }
        let moved = settler.settle(&moves, &self.tasks);
        let gain = moved.value * 100 >= settled.value * WORTH_MOVING_PERCENT;
        if !gain || moved.unassigned.len() > settled.unassigned.len() {
            return (settled, BTreeSet::new());
        }
        let mine = moves.bidders.iter().position(|b| b.id == self.me);
        let won = mine.and_then(|k| moved.orders.get(k));
        let keeps: BTreeSet<TaskId> = won.into_iter().flatten().map(|(t, _)| *t).collect();
        let held = kept(&self.own).filter(|t| t.progress == Progress::Committed);
        let moving = held.map(|t| t.task).filter(|t| !keeps.contains(t));
        let moving = moving.collect();
        (moved, moving)
    }

    /// Hands over what all would gain by, once all know the same.
    fn give_up_moving<S: Settler>(&mut self, settler: &S) -> Vec<Effect> {
        if self.moving.is_empty() || !self.is_agreed() {
            return Vec::new();
        }
        let moving = std::mem::take(&mut self.moving);
        let held = self.own.tasks.iter();
        let held = held.filter(|t| t.progress == Progress::Committed && moving.contains(&t.task));
        let lost: Vec<TaskId> = held.map(|t| t.task).collect();
        let effects = self.let_go(&lost);
        self.settle_anew(settler);
        effects
    }

    /// After so many restless periods offers of when the tasks changed have crossed the component
    /// twice, both ways. Where some come and go all the time nothing would ever be flown.
    fn restless_most(&self) -> u32 {
        self.patience.saturating_mul(RESTLESS_PATIENCES)
    }

    /// Commits to the next task, where the UAV waits for one and nobody else may have it.
    fn commit(&mut self, is_restless: bool) -> Vec<Effect> {
        let may = is_restless || self.is_agreed() || self.quiet >= self.patience;
        let is_free = |t: &BundleTask| {
            let won = t.progress == Progress::Tentative;
            let claim = self.claim_of_another(t.task);
            // Who wants to leave waits for somebody to come.
            let open = claim.is_none_or(|(progress, ..)| progress == Progress::Leaving);
            won && open && !self.is_done(t.task)
        };
        let next = self.own.tasks.iter().position(is_free);
        let Some(next) = next.filter(|_| self.free && may) else {
            return Vec::new();
        };
        let id = self.own.tasks[next].task;
        self.own.tasks[next].progress = Progress::Committed;
        self.free = false;
        vec![Effect::Fly(id)]
    }
}

/// Who goes before whom, of two claims on one task: the greater.
fn rank(peer: PeerId, held: &BundleTask) -> Rank {
    (held.progress, held.bid, Reverse(peer))
}

/// What a bundle held when its offer was made.
fn kept(bundle: &Bundle) -> impl Iterator<Item = &BundleTask> {
    bundle.tasks.iter().take(usize::from(bundle.kept))
}

#[cfg(test)]
mod tests;
