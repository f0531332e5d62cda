//! Launch places of UAVs that take off at the word of their computers: one after the other,
//! in the order in which they were to.
//!
//! | who is first in line | what follows |
//! |---|---|
//! | has said when it takes off | it does, whatever becomes of its computer; the next one is ready, to go when the place is clear again |
//! | wants to, and not yet | it stays first |
//! | has nothing to fly for, or says nothing | after half a second it goes behind the others |
//! | is lost | it is taken away |

use super::{Fact, Uav};
use crate::spec::Spec;
use skein_behaviors::{Launch, Setpoint};
use skein_geometry::frame::Pose;

/// Who has not said when is shown a take-off so long ahead at least, milliseconds: it never
/// comes nearer.
const SOONEST_MS: u64 = 1_000;

/// Who wants nothing stays first in line for so long, milliseconds.
const PATIENCE_MS: u64 = 500;

/// A take-off is said at most so long before, milliseconds.
const AHEAD_MOST_MS: u64 = 20_000;

/// The least time between two take-offs at one place where the scenario has none,
/// milliseconds.
const CLEAR_MS: u64 = 2_000;

/// All launch places.
#[derive(Clone, Debug)]
pub(super) struct Launchers {
    places: Vec<Place>,
    /// Who takes off when: milliseconds.
    rolling: Vec<(u16, u64)>,
}

#[derive(Clone, Debug)]
struct Place {
    at: Pose,
    line: Vec<Waiting>,
    /// When it is clear again, milliseconds.
    clear_ms: u64,
    /// How long it is not after a take-off, milliseconds.
    busy_ms: u64,
    /// Since when the first in line has wanted nothing, milliseconds.
    idle_since_ms: u64,
    is_ready: bool,
}

#[derive(Clone, Copy, Debug)]
struct Waiting {
    uav: u16,
    from_ms: u64,
}

impl Launchers {
    /// Those of a scenario whose UAVs keep apart at one height; none where each has a height
    /// of its own.
    pub fn of(spec: &Spec) -> Option<Self> {
        if spec.mission.separation_mm == 0 {
            return None;
        }
        let mut all = Self {
            places: Vec::new(),
            rolling: Vec::new(),
        };
        let mut waiting: Vec<_> = spec
            .uavs
            .iter()
            .filter(|u| !u.in_air && !u.aboard)
            .collect();
        waiting.sort_by_key(|u| (u.takeoff_ms, u.id));
        for u in waiting {
            all.join(u.id, u.launch, u64::from(u.takeoff_ms));
        }
        for place in &mut all.places {
            let gaps = place.line.windows(2).map(|w| w[1].from_ms - w[0].from_ms);
            place.busy_ms = gaps.filter(|gap| *gap > 0).min().unwrap_or(CLEAR_MS);
        }
        Some(all)
    }

    /// A UAV stands at a place from a time on, behind all others.
    pub fn join(&mut self, uav: u16, at: Pose, from_ms: u64) {
        self.rolling.retain(|(id, _)| *id != uav);
        let i = self.places.iter().position(|p| p.at == at);
        let i = i.unwrap_or_else(|| {
            self.places.push(Place {
                at,
                line: Vec::new(),
                clear_ms: 0,
                busy_ms: CLEAR_MS,
                idle_since_ms: from_ms,
                is_ready: false,
            });
            self.places.len() - 1
        });
        let line = &mut self.places[i].line;
        line.retain(|w| w.uav != uav);
        line.push(Waiting { uav, from_ms });
    }

    /// Keeps on the ground who has not said when it takes off; the lines move on.
    pub fn hold(&mut self, now_ms: u64, uavs: &mut [Uav], facts: &mut Vec<Fact>) {
        let stands = |id: u16| uavs.iter().any(|u| u.id == id && u.body.airborne());
        self.rolling.retain(|(uav, _)| stands(*uav));
        self.rolling.retain(|(uav, at_ms)| {
            let rolls = *at_ms > now_ms;
            let at_ms = *at_ms;
            if !rolls {
                facts.push(Fact::TookOff { at_ms, uav: *uav });
            }
            rolls
        });
        for place in &mut self.places {
            place.hold(now_ms, uavs);
        }
    }

    /// Whether a UAV is first in line, and may go.
    pub fn is_ready(&self, uav: u16) -> bool {
        let first = |p: &Place| p.is_ready && p.line.first().is_some_and(|w| w.uav == uav);
        self.places.iter().any(first)
    }

    /// Whether it takes off whatever happens.
    pub fn rolls(&self, uav: u16) -> bool {
        self.rolling.iter().any(|(id, _)| *id == uav)
    }

    /// The computer of a UAV on the ground says when it is to take off.
    pub fn tell(&mut self, now_ms: u64, u: &mut Uav, said: &Setpoint) {
        if said.launch == Launch::Stay || !self.is_ready(u.id) {
            return;
        }
        let first = |p: &&mut Place| p.line.first().is_some_and(|w| w.uav == u.id);
        let Some(place) = self.places.iter_mut().find(first) else {
            return;
        };
        place.idle_since_ms = now_ms;
        if let Launch::At(at_ms) = said.launch
            && (now_ms.max(place.clear_ms)..=now_ms + AHEAD_MOST_MS).contains(&at_ms)
        {
            place.line.remove(0);
            place.clear_ms = at_ms + place.busy_ms;
            place.is_ready = false;
            self.rolling.push((u.id, at_ms));
            u.body.stand_until(at_ms);
            u.body.promise(said);
        }
    }
}

impl Place {
    fn hold(&mut self, now_ms: u64, uavs: &mut [Uav]) {
        let stands = |w: &Waiting| uavs.iter().any(|u| u.id == w.uav && u.body.airborne());
        self.line.retain(stands);
        let was_ready = self.is_ready;
        self.is_ready = self.line.first().is_some_and(|w| w.from_ms <= now_ms);
        if !was_ready {
            self.idle_since_ms = now_ms;
        }
        if self.is_ready && now_ms - self.idle_since_ms >= PATIENCE_MS {
            self.idle_since_ms = now_ms;
            // It goes behind all who may fly already.
            let due = self.line.iter().take_while(|w| w.from_ms <= now_ms);
            let due = due.count();
            self.line[..due].rotate_left(1);
        }
        let mut after_ms = self.clear_ms.max(now_ms + SOONEST_MS);
        for w in &self.line {
            let takeoff_ms = after_ms.max(w.from_ms);
            after_ms = takeoff_ms + self.busy_ms;
            if let Some(u) = uavs.iter_mut().find(|u| u.id == w.uav) {
                u.body.stand_until(takeoff_ms);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::spec::Spec;
    use crate::world::{Fact, World, fixture};
    use skein_behaviors::{Launch, Setpoint, Side};
    use std::sync::Arc;

    /// Four at one place, two seconds apart.
    fn line() -> Spec {
        let mut spec = fixture::square(4);
        Arc::make_mut(&mut spec.mission).separation_mm = 30_000;
        spec.traffic_range_m = 500.0;
        let at = spec.uavs[0].launch;
        for (u, takeoff_ms) in spec.uavs.iter_mut().zip([0, 2_000, 4_000, 6_000]) {
            (u.launch, u.takeoff_ms, u.in_air) = (at, takeoff_ms, false);
        }
        spec
    }

    fn told(w: &mut World, uav: u16, launch: Launch) {
        let setpoint = Setpoint {
            from_ms: w.now_ms(),
            airspeed_mps: 13.0,
            height_m: 45.0,
            steps: Vec::new(),
            loiter: Side::Left,
            gimbal: Vec::new(),
            launch,
            promised: None,
        };
        let _ = w.apply(uav, setpoint);
    }

    fn ready(w: &World) -> Vec<u16> {
        let is_ready = |id: &u16| w.percept(*id).is_some_and(|p| p.launch_ready);
        (1..=4).filter(is_ready).collect()
    }

    fn took_off(w: &mut World) -> Vec<(u64, u16)> {
        let facts = w.take_facts().into_iter();
        let took_off = |f| match f {
            Fact::TookOff { at_ms, uav } => Some((at_ms, uav)),
            _ => None,
        };
        facts.filter_map(took_off).collect()
    }

    #[test]
    fn they_take_off_at_the_word_of_their_computers_one_after_the_other() {
        let mut w = World::new(&line(), 1);
        assert_eq!(ready(&w), [1]);
        told(&mut w, 1, Launch::At(2_400));
        // Who rolls is sensed as if it flew, and the next one is ready.
        w.advance(200);
        assert_eq!(ready(&w), [0; 0], "the second is not due yet");
        assert_eq!(w.percept(2).unwrap().traffic.seen().count(), 1);
        w.advance(2_000);
        assert_eq!(ready(&w), [2]);
        assert_eq!(w.percept(1).unwrap().takes_off_in_ms, 400);
        // Sooner than the place is clear it is not launched, and not after the time is past.
        told(&mut w, 2, Launch::At(4_300));
        assert_eq!(ready(&w), [2]);
        told(&mut w, 2, Launch::At(1_900));
        assert_eq!(ready(&w), [2]);
        told(&mut w, 2, Launch::At(4_400));
        w.advance(4_400);
        assert_eq!(took_off(&mut w), [(2_400, 1), (4_400, 2)]);
        assert_eq!(w.percept(2).unwrap().takes_off_in_ms, 0);
        // Nobody else does, however long it waits.
        for ms in (4_600..60_000).step_by(200) {
            let first = ready(&w).first().copied();
            first
                .into_iter()
                .for_each(|id| told(&mut w, id, Launch::Wish));
            w.advance(ms);
        }
        assert_eq!((ready(&w), took_off(&mut w)), (vec![3], Vec::new()));
    }

    #[test]
    fn who_wants_nothing_goes_behind_and_who_is_lost_is_taken_away() {
        let mut w = World::new(&line(), 1);
        let mut first = Vec::new();
        for ms in (200..20_000).step_by(200) {
            w.advance(ms);
            let ready = ready(&w);
            assert_eq!(ready.len(), 1, "at {ms} ms");
            if first.last() != ready.first() {
                first.extend(ready);
            }
        }
        assert!(first.len() > 12);
        assert!((1..=4).all(|id| first[8..].contains(&id)), "{first:?}");
        for id in 1..=3 {
            w.kill(id);
        }
        w.advance(20_200);
        assert_eq!(ready(&w), [4]);
        // A new airframe stands at the end of the line.
        w.respawn(2);
        w.advance(20_400);
        assert_eq!(ready(&w), [4]);
        told(&mut w, 4, Launch::At(21_000));
        w.advance(20_600);
        assert_eq!(ready(&w), [2]);
        // Lost before it is off, it never took off.
        w.kill(4);
        w.advance(22_000);
        assert_eq!(took_off(&mut w), []);
    }
}
