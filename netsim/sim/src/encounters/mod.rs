//! Encounters: fixed wings at one height that would meet, and what their promises to each
//! other come to (D2.7 §1.3).
//!
//! The same machine that a peer has ([`skein_peer::protocol::conflict`]) negotiates over a
//! channel that loses and delays; the same reactive layer flies what was agreed; kinematic
//! airframes move; a judge who knows nothing of promises measures how near they come.
//!
//! | module | what it holds |
//! |---|---|
//! | [`scene`] | who begins where and wants to go where |
//! | `alone` | those who hear nothing |
//! | `channel` | statements on their way |
//! | `judge` | the nearest approach, in continuous time |
//! | [`totals`] | what many runs come to |

mod alone;
mod channel;
mod judge;
pub mod scene;
#[cfg(test)]
mod tests;
pub mod totals;

use crate::world::motion::Kinematic;
use channel::Channel;
use judge::Judge;
use scene::{Begin, Scene};
use serde::{Deserialize, Serialize};
use skein_behaviors::reactive::promise;
use skein_flight::separation::{Detours, End, Motion};
use skein_geometry::frame::Point;
use skein_geometry::math::seconds;
use skein_peer::PeerId;
use skein_peer::protocol::conflict::{Apart, Conflicts, Intent, Wish};

/// The separation that has to be kept, metres.
pub const SEPARATION_M: f64 = 50.0;

/// How far two UAVs together may stray from their promises, metres: twice the tracking
/// error of a mission.
pub const TUBES_M: f64 = 4.0;

/// The world moves in steps of this, milliseconds.
const STEP_MS: u64 = 50;

/// A percept each so many milliseconds.
const PERCEPT_MS: u64 = 200;

/// What was said is said again this often, milliseconds.
const AGAIN_MS: u64 = 500;

/// News wait at least this long after the last statement, milliseconds.
const APART_MS: u64 = 100;

/// Nearer to its goal than this a UAV has arrived, metres: once the nose passes it, a fixed
/// wing would need a circle for the rest.
const ARRIVED_M: f64 = 15.0;

/// After so long nobody is waited for any more, milliseconds: ten times a flight.
const GIVE_UP_MS: u64 = 600_000;

/// What the channel does to each statement, for each listener by itself.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Air {
    /// The share that is lost.
    pub loss: f64,
    /// How late the others are, milliseconds; up to a fifth more, drawn for each.
    pub delay_ms: u32,
}

/// Whether anything is heard at all.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Radio {
    /// Statements travel.
    Works(Air),
    /// Nothing is heard: each UAV has its traffic sensor alone.
    Jammed {
        /// Within which it senses others, metres.
        range_m: f64,
    },
}

/// What a run came to.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Encounter {
    /// Moments at which two UAVs came within the separation, each pair once until it parts.
    pub losses_of_separation: u32,
    /// The nearest approach, metres.
    pub min_separation_m: f64,
    /// UAVs that fly.
    pub uavs: u32,
    /// Those that arrived.
    pub arrived: u32,
    /// Flying time of each that arrived, over that of its direct way.
    pub time_ratios: Vec<f64>,
    /// Different statements of all UAVs, repetitions not counted.
    pub messages: u32,
    /// All transmissions.
    pub transmissions: u32,
    /// How far a UAV strayed from its promise at most once it had caught up, metres.
    pub strayed_m: f64,
    /// Begun without room for everybody's loiter: it was not flown.
    pub no_escape: bool,
}

/// One UAV of a run.
struct Flyer {
    begin: Begin,
    body: Kinematic,
    mind: Conflicts,
    said: Option<Intent>,
    said_ms: u64,
    news: bool,
    arrived_ms: Option<u64>,
}

/// Flies a scene to its end.
#[must_use]
pub fn run(scene: Scene, radio: Radio, seed: u64) -> Encounter {
    let begun = scene.begin(seed).map(|begins| {
        let flyers: Vec<Flyer> = begins.into_iter().map(Flyer::new).collect();
        flyers
    });
    let none = Encounter {
        no_escape: true,
        ..Encounter::default()
    };
    let Some(mut flyers) = begun else {
        return none;
    };
    let mut channel = match radio {
        Radio::Works(air) => {
            introduce(&mut flyers);
            Some(Channel::new(air, seed))
        }
        Radio::Jammed { range_m } => {
            if !alone::all_have_room(&flyers, range_m) {
                return none;
            }
            None
        }
    };
    let mut out = Encounter {
        uavs: u32::try_from(flyers.len()).unwrap_or(u32::MAX),
        ..Encounter::default()
    };
    let mut judge = Judge::new(SEPARATION_M);
    let mut now_ms = 0;
    while now_ms < GIVE_UP_MS && flyers.iter().any(|f| f.arrived_ms.is_none()) {
        match (&mut channel, radio) {
            (Some(channel), _) => talk(&mut flyers, channel, now_ms, &mut out),
            (None, Radio::Jammed { range_m }) => alone::decide(&mut flyers, range_m, now_ms),
            (None, Radio::Works(_)) => {}
        }
        now_ms += STEP_MS;
        let mut flown = Vec::new();
        for f in flyers.iter_mut().filter(|f| f.arrived_ms.is_none()) {
            f.body.advance(now_ms, &mut flown);
            if f.is_there(now_ms, channel.is_some()) {
                f.arrived_ms = Some(now_ms);
            }
        }
        let flying = flyers.iter().filter(|f| f.arrived_ms.is_none());
        judge.observe(flying.map(|f| (f.id(), f.body.position())));
    }
    for f in &flyers {
        if let Some(at_ms) = f.arrived_ms {
            out.arrived += 1;
            out.time_ratios.push(seconds(at_ms) / f.begin.direct_s);
        }
    }
    out.losses_of_separation = judge.losses();
    out.min_separation_m = judge.nearest_m();
    out
}

/// What arrives is heard, each decides when it is its turn, and says what is new.
fn talk(flyers: &mut [Flyer], channel: &mut Channel, now_ms: u64, out: &mut Encounter) {
    for (to, from, intent) in channel.due(now_ms) {
        if let Some(f) = flyers.get_mut(to).filter(|f| f.arrived_ms.is_none()) {
            f.news |= f.mind.hear(from, &intent, now_ms);
        }
    }
    let count = flyers.len();
    for (nth, f) in flyers.iter_mut().enumerate() {
        if f.arrived_ms.is_some() {
            continue;
        }
        if is_turn(nth, count, now_ms) {
            f.decide(now_ms, out);
        }
        if f.speaks(now_ms) {
            let intent = f.mind.intent();
            out.messages += u32::from(f.said.as_ref() != Some(&intent));
            out.transmissions += 1;
            channel.send(nth, f.id(), &intent, now_ms, count);
            f.said = Some(intent);
            f.said_ms = now_ms;
            f.news = false;
        }
    }
}

/// Whether one of so many has a percept now: theirs are spread over the period.
fn is_turn(nth: usize, of: usize, now_ms: u64) -> bool {
    let phase_ms = nth as u64 * PERCEPT_MS / of.max(1) as u64;
    now_ms == 0 || now_ms % PERCEPT_MS == phase_ms - phase_ms % STEP_MS
}

/// The range that the sensors of a scene need for the rule to promise anything, metres.
#[must_use]
pub fn least_range_m(scene: Scene) -> f64 {
    alone::least_range_m(&scene.fastest())
}

/// They begin with what they know of each other: those who fly together have agreed on what
/// is in force before.
fn introduce(flyers: &mut [Flyer]) {
    let intents: Vec<(PeerId, Intent)> = flyers.iter().map(|f| (f.id(), f.mind.intent())).collect();
    for f in flyers {
        for (id, intent) in &intents {
            let _ = f.mind.hear(*id, intent, 0);
        }
        let wish = Wish {
            goal: f.begin.goal,
            then: End::Leaves,
        };
        f.mind.wish(Some(wish));
    }
}

impl Flyer {
    fn new(begin: Begin) -> Self {
        let apart = Apart {
            detours: Detours {
                airframe: begin.airframe,
                separation_m: SEPARATION_M,
            },
            tubes_m: TUBES_M,
            circle_radius_m: 0.0,
            reach: None,
        };
        let mind = Conflicts::new(begin.id, 0, apart, begin.motion.clone());
        Self {
            body: Kinematic::new(begin.airframe, begin.pose, 0.0, 0),
            begin,
            mind,
            said: None,
            said_ms: 0,
            news: true,
            arrived_ms: None,
        }
    }

    fn id(&self) -> PeerId {
        self.begin.id
    }

    fn decide(&mut self, now_ms: u64, out: &mut Encounter) {
        self.news |= self.mind.tick(now_ms);
        let Some(percept) = self.body.percept() else {
            return;
        };
        let motion = self.mind.in_force();
        if now_ms > scene::SETTLED_MS {
            let off = percept.pose.position() - motion.pose_at(now_ms).position();
            out.strayed_m = out.strayed_m.max(off.norm());
        }
        let setpoint = promise::fly(motion, &percept, &self.begin.airframe, 0.0);
        let _ = self.body.apply(setpoint, now_ms);
    }

    fn speaks(&self, now_ms: u64) -> bool {
        let since_ms = now_ms - self.said_ms;
        self.said.is_none() || since_ms >= AGAIN_MS || self.news && since_ms >= APART_MS
    }

    fn is_there(&self, now_ms: u64, promised: bool) -> bool {
        let off_m = (self.body.position() - self.begin.goal).norm();
        off_m < ARRIVED_M || promised && self.mind.in_force().has_left(now_ms)
    }
}

/// The distance of a place from the straight way is what decides whether two meet.
#[must_use]
pub(crate) fn beside(from: Point, course_rad: f64, ahead_m: f64, left_m: f64) -> Point {
    let (s, c) = skein_geometry::math::sin_cos(course_rad);
    Point::new(
        from.x + ahead_m * c - left_m * s,
        from.y + ahead_m * s + left_m * c,
    )
}

/// Whether all motions keep apart from now on.
pub(crate) fn all_apart(motions: &[Motion]) -> bool {
    motions.iter().enumerate().all(|(i, a)| {
        let later = motions.iter().skip(i + 1);
        let least_m = SEPARATION_M + TUBES_M;
        later
            .into_iter()
            .all(|b| skein_flight::separation::first_loss_s(a, b, 0, least_m).is_none())
    })
}
