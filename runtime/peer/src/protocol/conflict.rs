//! Approach conflicts: which motion a UAV asks for, and until when (D2.7 §1.3).
//!
//! A UAV that wants to go somewhere looks for the cheapest way that keeps apart from all
//! that stands, and proposes to turn off onto it a little ahead of where it is. What then
//! happens to the proposal is [`promises`](super::promises)'s, whose rules keep UAVs apart
//! whatever this part does; this one sees to it that they get anywhere.
//!
//! | state | event | next state | what follows |
//! |---|---|---|---|
//! | idle | a wish, and a way that is clear | proposing | the proposal is said |
//! | idle | a wish, and no such way | idle | the search is repeated after a second |
//! | proposing | agreed before the branch | on its way | the way is flown |
//! | proposing | the branch is passed | idle | the next branch is put off half as far again |
//! | proposing | gave way | idle | another way is looked for at once |
//! | on its way | every 5 s: a way that costs a second less | proposing | the proposal is said |
//!
//! # Complexity
//! A proposal costs the candidates of [`Detours`] until one is clear, each held against
//! all others.

use super::promises::{Promise, Promises, Settled, Statement};
use crate::PeerId;
use serde::{Deserialize, Serialize};
use skein_flight::separation::{Detour, Detours, End, Motion, MotionPlan, first_loss_s};
use skein_geometry::frame::{Point, Pose};

/// How far ahead of now a proposal turns off at first, milliseconds: what one exchange takes
/// when each of its messages is half a second late and one of them has to be repeated.
const LEAD_FIRST_MS: u64 = 2_000;

/// The farthest it is put off when answers do not come, milliseconds: with a third of all
/// messages lost, thirty others have answered within that time nearly always.
const LEAD_MOST_MS: u64 = 9_000;

/// After a search without a way the next one waits for so long, milliseconds: by then
/// others have moved by half their separation.
const SEARCH_AGAIN_MS: u64 = 1_000;

/// A shorter way is looked for this often, milliseconds: evasions free what they went round
/// in some seconds.
const IMPROVE_MS: u64 = 5_000;

/// And proposed if it costs this much less than the flying time that is left, seconds: less
/// is not worth the messages.
const WORTH_S: f64 = 1.0;

/// A promise as it is sent.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct PromisedPlan {
    /// Its number among the promises of its author.
    pub version: u32,
    /// What is promised.
    pub plan: MotionPlan,
}

/// A [`Statement`] as it is sent: motions as their plans.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Intent {
    /// Number of the statement: the newest counts.
    pub number: u32,
    /// Endurance when the mission began, seconds: who has less goes before.
    pub endurance_s: u32,
    /// What is flown.
    pub in_force: PromisedPlan,
    /// What would rather be flown.
    pub proposal: Option<PromisedPlan>,
    /// Which version of whom was accepted last, ascending by peer.
    pub accepts: Vec<(PeerId, u32)>,
}

/// Where a UAV wants to go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wish {
    /// The place.
    pub goal: Point,
    /// What it does there.
    pub then: End,
}

/// How this UAV is kept apart from others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Apart {
    /// Ways that its airframe can fly; and the separation.
    pub detours: Detours,
    /// How far any two may stray from their promises together, metres: kept on top.
    pub tubes_m: f64,
}

impl Apart {
    /// A test whether two motions keep apart from a moment on.
    fn since(self, now_ms: u64) -> impl Fn(&Motion, &Motion) -> bool {
        let least_m = self.detours.separation_m + self.tubes_m;
        move |a, b| first_loss_s(a, b, now_ms, least_m).is_none()
    }
}

/// Approach conflicts of one UAV.
#[derive(Clone, Debug)]
pub struct Conflicts {
    promises: Promises<Motion>,
    apart: Apart,
    wish: Option<Wish>,
    /// Whether the motion in force leads to the wish.
    on_way: bool,
    /// When the proposal leaves the motion in force; of no meaning without one.
    branch_ms: u64,
    lead_ms: u64,
    search_from_ms: u64,
}

impl Conflicts {
    /// A UAV that flies `in_force` and wants nothing else.
    #[must_use]
    pub fn new(id: PeerId, endurance_s: u32, apart: Apart, in_force: Motion) -> Self {
        Self {
            promises: Promises::new((endurance_s, id), in_force),
            apart,
            wish: None,
            on_way: false,
            branch_ms: 0,
            lead_ms: LEAD_FIRST_MS,
            search_from_ms: 0,
        }
    }

    /// What is to be flown.
    #[must_use]
    pub fn in_force(&self) -> &Motion {
        self.promises.in_force()
    }

    /// All that is to be said now; said again until something newer is.
    #[must_use]
    pub fn intent(&self) -> Intent {
        let s = self.promises.statement();
        Intent {
            number: s.number,
            endurance_s: s.endurance_s,
            in_force: sent(&s.in_force),
            proposal: s.proposal.as_ref().map(sent),
            accepts: s.accepts,
        }
    }

    /// From now on it wants to go there.
    pub fn wish(&mut self, wish: Option<Wish>) {
        self.wish = wish;
        self.on_way = false;
        self.search_from_ms = 0;
    }

    /// A statement of another UAV. Returns whether there is something new to say. One that
    /// promises what no fixed wing flies, or begins later than now, changes nothing.
    pub fn hear(&mut self, author: PeerId, said: &Intent, now_ms: u64) -> bool {
        let Some(statement) = received(said, now_ms) else {
            return false;
        };
        self.promises.hear(author, &statement) && self.settle(now_ms).news
    }

    /// Time goes on. Returns whether there is something new to say.
    pub fn tick(&mut self, now_ms: u64) -> bool {
        self.promises.forget(|m| m.has_left(now_ms));
        let mut news = self.settle(now_ms).news;
        if now_ms > self.branch_ms && self.promises.withdraw() {
            self.lead_ms = (self.lead_ms * 3 / 2).min(LEAD_MOST_MS);
            self.search_from_ms = now_ms;
            news = true;
        }
        if self.promises.proposal().is_none() && now_ms >= self.search_from_ms {
            news |= self.propose(now_ms);
        }
        news
    }

    fn settle(&mut self, now_ms: u64) -> Settled {
        let may_adopt = now_ms <= self.branch_ms;
        let settled = self.promises.settle(may_adopt, &self.apart.since(now_ms));
        if settled.gave_way {
            self.search_from_ms = now_ms;
        }
        if settled.adopted {
            self.on_way = true;
            self.lead_ms = LEAD_FIRST_MS;
            self.search_from_ms = now_ms + IMPROVE_MS;
        }
        settled
    }

    /// Looks for a way to what is wanted, and proposes it.
    fn propose(&mut self, now_ms: u64) -> bool {
        let Some(wish) = self.wish else {
            return false;
        };
        let again_ms = if self.on_way {
            IMPROVE_MS
        } else {
            SEARCH_AGAIN_MS
        };
        self.search_from_ms = now_ms + again_ms;
        let branch_ms = now_ms + self.lead_ms;
        if self.in_force().has_left(branch_ms) {
            return false;
        }
        let Some(motion) = self.search(wish, now_ms, branch_ms) else {
            return false;
        };
        self.branch_ms = branch_ms;
        self.promises.propose(motion);
        // Where nobody has to be asked it is agreed already.
        let _ = self.settle(now_ms);
        true
    }

    /// The cheapest way that is clear; for who is on its way, only one that is worth it.
    fn search(&self, wish: Wish, now_ms: u64, branch_ms: u64) -> Option<Motion> {
        let flown = self.in_force();
        let from = flown.pose_at(branch_ms);
        let left_s = flown.ends_at_s() - seconds(branch_ms);
        let most_s = if self.on_way {
            left_s - WORTH_S
        } else {
            f64::INFINITY
        };
        let apart = self.apart.since(now_ms);
        let clear = |way: &Detour| {
            let plan = flown.branched(now_ms, branch_ms, &way.stretches, wish.then);
            let motion = Motion::new(plan).ok()?;
            self.promises.is_clear(&motion, &apart).then_some(motion)
        };
        let ways = self.ways(from, wish.goal, most_s);
        ways.iter().find_map(clear)
    }

    /// Ways that cost at most so much, seconds, cheapest first.
    fn ways(&self, from: Pose, goal: Point, most_s: f64) -> Vec<Detour> {
        let detours = self.apart.detours;
        if detours.least_cost_s(from, goal) > most_s {
            return Vec::new();
        }
        let mut ways = detours.all(from, goal);
        ways.retain(|way| way.cost_s <= most_s);
        ways
    }
}

fn sent(promise: &Promise<Motion>) -> PromisedPlan {
    PromisedPlan {
        version: promise.version,
        plan: promise.motion.plan().clone(),
    }
}

fn received(said: &Intent, now_ms: u64) -> Option<Statement<Motion>> {
    let promise = |p: &PromisedPlan| {
        let begun = p.plan.start_ms <= now_ms;
        let motion = Motion::new(p.plan.clone()).ok().filter(|_| begun)?;
        Some(Promise {
            version: p.version,
            motion,
        })
    };
    let proposal = match &said.proposal {
        None => None,
        Some(p) => Some(promise(p)?),
    };
    Some(Statement {
        number: said.number,
        endurance_s: said.endurance_s,
        in_force: promise(&said.in_force)?,
        proposal,
        accepts: said.accepts.clone(),
    })
}

#[allow(
    clippy::cast_precision_loss,
    reason = "clocks stay far below 2^53 milliseconds"
)]
fn seconds(ms: u64) -> f64 {
    ms as f64 / 1e3
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_flight::airframe::Airframe;
    use skein_flight::separation::Stretch;

    const LOITER: End = End::Loiter {
        radius_mm: -75_000,
        airspeed_mmps: 20_000,
    };

    /// A UAV that flies straight for ten seconds, then loiters, and wants on to a goal.
    fn uav(id: u16, east_m: i32, heading_e7: i32, goal: Point) -> Conflicts {
        let apart = Apart {
            detours: Detours {
                airframe: Airframe {
                    stall_mps: 13.0,
                    cruise_mps: 20.0,
                    max_mps: 26.0,
                    max_bank_rad: 0.52,
                    endurance_s: 3600.0,
                    reserve_s: 300.0,
                    footprint_across_m: 40.0,
                    footprint_along_m: 30.0,
                },
                separation_m: 50.0,
            },
            tubes_m: 4.0,
        };
        let motion = Motion::new(MotionPlan {
            start_ms: 0,
            east_mm: east_m * 1_000,
            north_mm: 0,
            heading_e7,
            stretches: vec![Stretch {
                radius_mm: 0,
                length_mm: 200_000,
                airspeed_mmps: 20_000,
            }],
            end: LOITER,
        });
        let mut uav = Conflicts::new(PeerId(id), 0, apart, motion.unwrap());
        uav.wish(Some(Wish { goal, then: LOITER }));
        uav
    }

    fn head_on() -> (Conflicts, Conflicts) {
        let mut a = uav(1, -600, 0, Point::new(600.0, 0.0));
        let mut b = uav(2, 600, 31_415_926, Point::new(-600.0, 0.0));
        let _ = a.hear(PeerId(2), &b.intent(), 0);
        let _ = b.hear(PeerId(1), &a.intent(), 0);
        (a, b)
    }

    #[test]
    fn who_is_alone_needs_nobody() {
        let mut a = uav(1, -600, 0, Point::new(600.0, 0.0));
        assert!(a.tick(0));
        assert!(a.in_force().ends_at_s() > 50.0, "on its way at once");
        assert_eq!(a.intent().proposal, None);
    }

    #[test]
    fn two_agree_with_four_statements() {
        let (mut a, mut b) = head_on();
        assert!(a.tick(0) && b.tick(0), "both propose to fly straight on");
        // The second hears the first and gives way, looks anew and accepts.
        assert!(b.hear(PeerId(1), &a.intent(), 100));
        let _ = b.tick(100);
        // The first hears both at once, and flies; then the second does.
        assert!(a.hear(PeerId(2), &b.intent(), 200));
        assert!(a.in_force().ends_at_s() > 50.0);
        assert!(b.hear(PeerId(1), &a.intent(), 300));
        assert!(b.in_force().ends_at_s() > 50.0);
        let nearest = first_loss_s(a.in_force(), b.in_force(), 300, 54.0);
        assert_eq!(nearest, None);
    }

    #[test]
    fn without_an_answer_the_promise_stands() {
        let (mut a, b) = head_on();
        let before = a.in_force().clone();
        for now_ms in (0..60_000).step_by(200) {
            let _ = a.tick(now_ms);
        }
        assert_eq!(a.in_force(), &before);
        // An answer to what was withdrawn long ago changes nothing either.
        let mut late = b.intent();
        late.number = 9;
        late.accepts = vec![(PeerId(1), 2)];
        let _ = a.hear(PeerId(2), &late, 60_000);
        assert_eq!(a.in_force(), &before);
    }

    #[test]
    fn what_cannot_be_flown_or_has_not_begun_changes_nothing() {
        let (mut a, b) = head_on();
        let before = a.intent();
        let mut said = b.intent();
        said.number = 7;
        said.in_force.plan.stretches[0].airspeed_mmps = 0;
        assert!(!a.hear(PeerId(2), &said, 100));
        let mut said = b.intent();
        said.number = 7;
        said.in_force.plan.start_ms = 5_000;
        assert!(!a.hear(PeerId(2), &said, 100));
        assert_eq!(a.intent(), before);
    }
}
