//! Promises: what a UAV flies, what it would rather fly, and who has accepted that (D2.7
//! §1.3).
//!
//! Each UAV has one promised motion in force, which ends in a loiter for ever. It flies
//! another one only when everybody whom it may meet has accepted that; until then, and if
//! nobody ever answers, the old promise stands. So separation depends on no message.
//! Which motion is wanted, and when it is too late for an answer, is
//! [`conflict`](super::conflict)'s; whether two keep apart is told by the caller.
//!
//! | state | event | next state | what is said |
//! |---|---|---|---|
//! | flying | a wish ([`Promises::propose`]) | proposing | the proposal |
//! | proposing | all others accept | flying the proposal | the new motion in force |
//! | proposing | withdrawn by the caller, for time | flying | that it is withdrawn |
//! | proposing, not pleading | it conflicts with what stands, or with a proposal that goes before | flying | that it is withdrawn |
//! | flying | a wish that conflicts with what others fly ([`Promises::plead`]) | proposing | the proposal, which they may make room for |
//! | any | a proposal that keeps apart from the motion in force and from the own proposal, unless that pleads | same | that it is accepted |
//! | proposing | a proposal that goes before the own and conflicts with it alone | flying | the own is withdrawn, the other accepted |
//! | any | a proposal that conflicts with the motion in force, or goes behind | same | nothing |
//! | any | another motion in force, a withdrawal | same | nothing: what was accepted of it is free again |
//!
//! Everything is said in one [`Statement`], of which the newest counts; so losing, repeating
//! and reordering do no harm. A version is proposed once and never again.
//!
//! # Guarantees
//! **Any two motions in force keep apart, whatever is lost, late, doubled or out of order,
//! and whoever falls silent.** Let A adopt a. B had accepted it, and from then on held every
//! own proposal against a, until it heard that a is withdrawn (then A never adopts it) or in
//! force (then it is held against as such). And what B had in force or on offer when it
//! accepted was held against a then. So there is no moment at which B may adopt what
//! conflicts with a, and none at which A may. `tests/promises.rs` searches this exhaustively.
//! What pleads is not held against what is accepted; so it is adopted only if it is clear then of
//! all that was accepted and stands.
//!
//! Of two proposals that conflict, that of the UAV with less endurance goes before, of equal
//! ones that with the lower number: the order is total, so somebody always gets through.
//!
//! # Complexity
//! A statement heard costs as many tests of separation as there are open proposals.

use crate::PeerId;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Who goes before: the lower. Endurance in seconds, then the number of the peer.
pub type Rank = (u32, PeerId);

/// A motion and its number among the promises of its author.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Promise<M> {
    /// Versions of a life only grow.
    pub version: u32,
    /// What is promised.
    pub motion: M,
}

/// All that a UAV says about its flight to those whom it may meet.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Statement<M> {
    /// Number of the statement: the newest counts.
    pub number: u32,
    /// Its endurance when the mission began, seconds: who has less goes before.
    pub endurance_s: u32,
    /// What it flies.
    pub in_force: Promise<M>,
    /// What it would rather fly.
    pub proposal: Option<Promise<M>>,
    /// Which version it has accepted of whom, while that is on offer, ascending by peer.
    pub accepts: Vec<(PeerId, u32)>,
}

/// A statement without its motions, for those who know them.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Brief {
    /// Number of the statement: the newest counts.
    pub number: u32,
    /// The version of what is flown.
    pub in_force: u32,
    /// The version of what would rather be flown.
    pub proposal: Option<u32>,
    /// Which version is accepted of whom, while that is on offer, ascending by peer.
    pub accepts: Vec<(PeerId, u32)>,
}

/// What is known of another UAV.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct Other<M> {
    number: u32,
    rank: Rank,
    in_force: Promise<M>,
    /// Its proposal, as heard last.
    proposal: Option<Promise<M>>,
    /// The version of it that was accepted: held against until it is withdrawn or in force.
    accepted: Option<u32>,
    /// What was accepted last, to be said.
    told: u32,
    /// Which version of ours it accepted last.
    accepts: u32,
}

impl<M> Other<M> {
    /// Whatever it may fly without asking again.
    fn standing(&self) -> impl Iterator<Item = &M> {
        let accepted = self.proposal.as_ref();
        let accepted = accepted.filter(|p| self.accepted == Some(p.version));
        std::iter::once(&self.in_force.motion).chain(accepted.map(|p| &p.motion))
    }

    /// Its proposal, unless it was accepted.
    fn open(&self) -> Option<&Promise<M>> {
        let open = self.proposal.as_ref()?;
        (self.accepted != Some(open.version)).then_some(open)
    }
}

/// The promises of one UAV, and what it knows of those of others.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Promises<M> {
    rank: Rank,
    number: u32,
    last_version: u32,
    in_force: Promise<M>,
    proposal: Option<Promise<M>>,
    /// What is on offer is known to conflict with what another flies, who is to make room.
    pleads: bool,
    others: BTreeMap<PeerId, Other<M>>,
}

/// What became of the own proposal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Settled {
    /// There is something new to say.
    pub news: bool,
    /// The proposal is in force now.
    pub adopted: bool,
    /// The proposal was withdrawn for another's sake.
    pub gave_way: bool,
}

impl<M: Clone> Promises<M> {
    /// A UAV that flies a motion and wants nothing else.
    #[must_use]
    pub fn new(rank: Rank, in_force: M) -> Self {
        Self::after(0, rank, in_force)
    }

    /// The same, counting on: no version up to `before` was this life's.
    #[must_use]
    pub fn after(before: u32, rank: Rank, in_force: M) -> Self {
        let version = before.saturating_add(1);
        Self {
            rank,
            number: 1,
            last_version: version,
            in_force: Promise {
                version,
                motion: in_force,
            },
            proposal: None,
            pleads: false,
            others: BTreeMap::new(),
        }
    }

    /// What is to be flown.
    #[must_use]
    pub fn in_force(&self) -> &M {
        &self.in_force.motion
    }

    /// What is on offer.
    #[must_use]
    pub fn proposal(&self) -> Option<&M> {
        self.proposal.as_ref().map(|p| &p.motion)
    }

    /// All that is to be said now; said again until something newer is.
    #[must_use]
    pub fn statement(&self) -> Statement<M> {
        Statement {
            number: self.number,
            endurance_s: self.rank.0,
            in_force: self.in_force.clone(),
            proposal: self.proposal.clone(),
            accepts: self.others.iter().filter_map(answer).collect(),
        }
    }

    /// The same without motions.
    #[must_use]
    pub fn brief(&self) -> Brief {
        Brief {
            number: self.number,
            in_force: self.in_force.version,
            proposal: self.proposal.as_ref().map(|p| p.version),
            accepts: self.others.iter().filter_map(answer).collect(),
        }
    }

    /// Takes note of a statement; says whether it was newer than what was known. Nothing
    /// follows from it before [`Promises::settle`].
    pub fn hear(&mut self, author: PeerId, said: &Statement<M>) -> bool {
        let me = self.rank.1;
        if author == me {
            return false;
        }
        let rank = (said.endurance_s, author);
        let other = self.others.entry(author).or_insert_with(|| Other {
            number: 0,
            rank,
            in_force: said.in_force.clone(),
            proposal: None,
            accepted: None,
            told: 0,
            accepts: 0,
        });
        if let Some((_, version)) = said.accepts.iter().find(|(id, _)| *id == me) {
            other.accepts = other.accepts.max(*version);
        }
        if said.number <= other.number {
            return false;
        }
        other.number = said.number;
        other.rank = rank;
        other.in_force = said.in_force.clone();
        // What is no longer proposed is in force, or withdrawn for ever.
        let proposed = said.proposal.as_ref().map(|p| p.version);
        other.accepted = other.accepted.filter(|a| Some(*a) == proposed);
        other.proposal = said.proposal.clone();
        true
    }

    /// Takes note of a statement that names motions by their versions; says whether it was
    /// newer than what was known. Where one of them is not known it changes nothing: the
    /// motions are said again.
    pub fn hear_brief(&mut self, author: PeerId, said: &Brief) -> bool {
        let me = self.rank.1;
        let Some(other) = self.others.get_mut(&author) else {
            return false;
        };
        if let Some((_, version)) = said.accepts.iter().find(|(id, _)| *id == me) {
            other.accepts = other.accepts.max(*version);
        }
        let proposed = other.proposal.as_ref();
        let adopted = proposed.filter(|p| p.version == said.in_force).cloned();
        let known = adopted.is_some() || other.in_force.version == said.in_force;
        let same = proposed.is_some_and(|p| Some(p.version) == said.proposal);
        if said.number <= other.number || !known || !(same || said.proposal.is_none()) {
            return false;
        }
        other.number = said.number;
        if let Some(adopted) = adopted {
            other.in_force = adopted;
        }
        if said.proposal.is_none() {
            other.proposal = None;
            other.accepted = None;
        }
        true
    }

    /// Whether this UAV has accepted what another proposes, as far as is known.
    #[must_use]
    pub fn has_accepted(&self, author: PeerId) -> bool {
        self.others
            .get(&author)
            .is_some_and(|o| o.accepted.is_some())
    }

    /// Puts another motion in force without asking: the UAV is not where it was to be.
    pub fn impose(&mut self, motion: M) {
        self.last_version = self.last_version.saturating_add(1);
        self.number = self.number.saturating_add(1);
        self.proposal = None;
        self.in_force = Promise {
            version: self.last_version,
            motion,
        };
    }

    /// Forgets what another UAV said: it begins anew, or is not there any more.
    pub fn forget_one(&mut self, id: PeerId) {
        self.others.remove(&id);
    }

    /// Whether anything was heard of another UAV.
    #[must_use]
    pub fn knows(&self, id: PeerId) -> bool {
        self.others.contains_key(&id)
    }

    /// What another UAV flies, as far as is known.
    #[must_use]
    pub fn flown_by(&self, id: PeerId) -> Option<&M> {
        self.others.get(&id).map(|o| &o.in_force.motion)
    }

    /// All that another UAV may fly: what is in force as far as was heard, and what was accepted
    /// here.
    pub fn may_fly(&self, id: PeerId) -> impl Iterator<Item = &M> {
        self.others.get(&id).into_iter().flat_map(Other::standing)
    }

    /// Those of whom it is known.
    pub fn speakers(&self) -> impl Iterator<Item = PeerId> {
        self.others.keys().copied()
    }

    /// Proposals of others that this UAV's motion in force alone keeps from being accepted.
    pub fn held_up<'a>(
        &'a self,
        apart: &'a dyn Fn(&M, &M) -> bool,
    ) -> impl Iterator<Item = (Rank, &'a M)> {
        let open = self
            .others
            .values()
            .filter_map(|o| Some((o.rank, o.open()?)));
        let mine = &self.in_force.motion;
        open.filter(move |(_, p)| !apart(mine, &p.motion))
            .map(|(rank, p)| (rank, &p.motion))
    }

    /// Who goes before: the lower.
    #[must_use]
    pub fn rank(&self) -> Rank {
        self.rank
    }

    /// The version of what is in force.
    #[must_use]
    pub fn version(&self) -> u32 {
        self.in_force.version
    }

    /// Forgets those who can meet nobody any more, and do not ask to.
    pub fn forget(&mut self, is_gone: impl Fn(&M) -> bool) {
        let stays = |o: &Other<M>| o.proposal.is_some() || !is_gone(&o.in_force.motion);
        self.others.retain(|_, o| stays(o));
    }

    /// Offers a motion in place of that in force.
    pub fn propose(&mut self, motion: M) {
        self.last_version += 1;
        self.number += 1;
        self.pleads = false;
        self.proposal = Some(Promise {
            version: self.last_version,
            motion,
        });
    }

    /// The same of one that conflicts with what others fly: it shows them what they hold up,
    /// and is adopted if they make room for it.
    pub fn plead(&mut self, motion: M) {
        self.propose(motion);
        self.pleads = true;
    }

    /// Whether what is proposed shows others what they hold up.
    #[must_use]
    pub fn pleads(&self) -> bool {
        self.pleads && self.proposal.is_some()
    }

    /// Withdraws the own proposal, if there is one; says whether.
    pub fn withdraw(&mut self) -> bool {
        let had = self.proposal.take().is_some();
        self.number += u32::from(had);
        had
    }

    /// Gives way, accepts and adopts whatever can be. `may_adopt` is false once the place
    /// is passed at which the proposal leaves what is in force; `is_asked` tells who has to
    /// accept it: all who may meet the UAV before they are heard again.
    pub fn settle(
        &mut self,
        may_adopt: bool,
        is_asked: &dyn Fn(PeerId) -> bool,
        apart: &dyn Fn(&M, &M) -> bool,
    ) -> Settled {
        let mut settled = Settled::default();
        if !self.pleads && !self.offers_what_is_clear(apart) {
            self.proposal = None;
            settled.gave_way = true;
        }
        let accepted = self.accept(apart);
        // Who is not asked accepts nothing, and need not have made room for what pleads.
        let made_room = || !self.pleads || self.offers_what_is_clear(apart);
        if may_adopt && self.is_agreed(is_asked) && made_room() {
            if let Some(own) = self.proposal.take() {
                self.in_force = own;
            }
            settled.adopted = true;
        }
        settled.news = settled.gave_way || accepted || settled.adopted;
        self.number += u32::from(settled.news);
        settled
    }

    /// Whether a motion keeps apart from whatever others may fly, and from the proposals
    /// that go before this UAV's.
    #[must_use]
    pub fn is_clear(&self, motion: &M, apart: &dyn Fn(&M, &M) -> bool) -> bool {
        self.others.values().all(|o| {
            let before = o.open().filter(|_| o.rank < self.rank);
            // A proposal that this UAV must refuse gets nowhere, so it need not be avoided.
            let before = before.filter(|p| apart(&self.in_force.motion, &p.motion));
            o.standing().all(|m| apart(motion, m))
                && before.is_none_or(|p| apart(motion, &p.motion))
        })
    }

    /// The same of the own proposal, if there is one.
    fn offers_what_is_clear(&self, apart: &dyn Fn(&M, &M) -> bool) -> bool {
        let own = self.proposal.as_ref();
        own.is_none_or(|own| self.is_clear(&own.motion, apart))
    }

    /// Accepts the proposals of others that keep apart from all that this UAV may fly.
    fn accept(&mut self, apart: &dyn Fn(&M, &M) -> bool) -> bool {
        // What pleads is in nobody's way: it is flown only once it is clear of what was accepted.
        let own = self.proposal.as_ref().filter(|_| !self.pleads);
        let own = own.map(|p| &p.motion);
        let mut news = false;
        for other in self.others.values_mut() {
            let clear = |theirs: &&Promise<M>| {
                apart(&self.in_force.motion, &theirs.motion)
                    && own.is_none_or(|m| apart(m, &theirs.motion))
            };
            if let Some(version) = other.open().filter(clear).map(|p| p.version) {
                other.told = version;
                other.accepted = Some(version);
                news = true;
            }
        }
        news
    }

    /// Whether another UAV has not accepted the own proposal; of nobody where there is none.
    #[must_use]
    pub fn lacks(&self, id: PeerId) -> bool {
        self.proposal.as_ref().is_some_and(|own| {
            let other = self.others.get(&id);
            other.is_none_or(|o| o.accepts != own.version)
        })
    }

    /// Whether everybody who is asked has accepted the own proposal.
    fn is_agreed(&self, is_asked: &dyn Fn(PeerId) -> bool) -> bool {
        self.proposal.as_ref().is_some_and(|own| {
            let mut asked = self.others.iter().filter(|(id, _)| is_asked(**id));
            asked.all(|(_, o)| o.accepts == own.version)
        })
    }
}

/// Which proposal of another was accepted, as long as it is on offer.
fn answer<M>((id, other): (&PeerId, &Other<M>)) -> Option<(PeerId, u32)> {
    let proposed = other.proposal.as_ref()?.version;
    (other.told == proposed).then_some((*id, proposed))
}
