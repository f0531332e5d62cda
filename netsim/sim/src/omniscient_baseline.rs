//! The makespan a swarm is measured against: same seed, world, faults, solver and
//! dynamics, but membership and coverage known at once and for free to all.
//!
//! At every true loss and every true return the remainder is divided anew among the
//! UAVs that are there; each flies its section with the same executive and airframe.
//! A UAV whose computer stands still or is down flies nothing, as in the swarm.

use crate::fault::{Fault, TimedFault};
use crate::prepared::Prepared;
use crate::world::World;
use skein_behaviors::{Event, Executive, Goal};
use skein_flight::coverage::ring::backtracking::{Leg, Uav};
use skein_peer::offload::MissionGeometry;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Where everybody is idle and cells remain, the rest is divided again this often,
/// milliseconds: a route refused from one side may exist from another.
const RETRY_MS: u64 = 5_000;

/// When all coverable cells are covered, milliseconds; `None` when they never are.
#[must_use]
pub fn makespan_ms(prepared: &Prepared, seed: u64, faults: &[TimedFault]) -> Option<u64> {
    let ground = prepared
        .geometry_cache
        .clone()
        .of(&prepared.spec.mission)
        .ok()?;
    let mut r = Baseline::new(prepared, seed, ground);
    let end_ms = u64::from(prepared.spec.max_time_s) * 1000;
    let period_ms = u64::from(prepared.spec.percept_period_ms.max(1));
    let mut faults = faults.iter().peekable();
    let mut now_ms = 0;
    while now_ms < end_ms {
        while let Some(f) = faults.next_if(|f| f.at_ms <= now_ms) {
            r.strike(&f.fault);
        }
        r.step(now_ms);
        now_ms += period_ms;
        r.world.advance(now_ms);
        if r.world.judge().complete() {
            return Some(now_ms);
        }
    }
    None
}

#[derive(Debug)]
struct Baseline<'a> {
    prepared: &'a Prepared,
    world: World,
    ground: Arc<MissionGeometry>,
    minds: BTreeMap<u16, Executive>,
    busy: BTreeMap<u16, bool>,
    covered: Vec<bool>,
    stale: bool,
    solved_ms: u64,
    /// Times round still to come.
    further_laps: u16,
}

impl<'a> Baseline<'a> {
    fn new(prepared: &'a Prepared, seed: u64, ground: Arc<MissionGeometry>) -> Self {
        let mut r = Self {
            prepared,
            world: World::on(Arc::clone(&prepared.site), &prepared.spec, seed),
            covered: vec![false; ground.coverage_loop.len()],
            ground,
            minds: BTreeMap::new(),
            busy: BTreeMap::new(),
            stale: true,
            solved_ms: 0,
            further_laps: prepared.spec.mission.further_laps,
        };
        for u in &prepared.spec.uavs {
            r.start(u.id);
        }
        r
    }

    fn start(&mut self, id: u16) {
        let Some(u) = self.prepared.spec.uavs.iter().find(|u| u.id == id) else {
            return;
        };
        let (ring, router) = (&self.ground.coverage_loop, &self.ground.router);
        let mind = Executive::new(u.airframe, u.height_m, Arc::clone(ring), Arc::clone(router));
        self.minds.insert(id, mind);
        self.stale = true;
    }

    fn stop(&mut self, id: u16) {
        self.stale |= self.minds.remove(&id).is_some();
        self.busy.remove(&id);
    }

    fn strike(&mut self, fault: &Fault) {
        match fault {
            Fault::Kill { peer } => {
                self.world.kill(*peer);
                self.stop(*peer);
            }
            Fault::KillComputer { peer } | Fault::Terminate { peer } => {
                self.world.set_computer(*peer, false);
                self.stop(*peer);
            }
            Fault::Pause { peer } => self.stop(*peer),
            Fault::Resume { peer } => {
                if !self.minds.contains_key(peer) && self.world.percept(*peer).is_some() {
                    self.start(*peer);
                }
            }
            Fault::Restart { peer, .. } => {
                if !self.minds.contains_key(peer) {
                    self.world.respawn(*peer);
                    self.start(*peer);
                }
            }
            Fault::ShortFuel { peer, lasts_ms } => {
                self.world.limit_fuel(*peer, u64::from(*lasts_ms));
            }
            Fault::Cut { .. }
            | Fault::Partition { .. }
            | Fault::Heal
            | Fault::Loss { .. }
            | Fault::Rebase { .. }
            | Fault::Revise { .. }
            | Fault::AddZone { .. }
            | Fault::RemoveZone { .. }
            | Fault::AddTask { .. }
            | Fault::CancelTask { .. }
            | Fault::DoneTask { .. }
            | Fault::Order { .. }
            | Fault::FailStores { .. }
            | Fault::SlowStores { .. }
            | Fault::HealStores { .. }
            | Fault::SlowComputer { .. }
            | Fault::ClockDrift { .. }
            | Fault::ClockJump { .. }
            | Fault::SpoiltRecord { .. }
            | Fault::Twin { .. } => {}
        }
    }

    fn step(&mut self, now_ms: u64) {
        let ids: Vec<u16> = self.minds.keys().copied().collect();
        for id in ids {
            if !self.fly(id) {
                self.stop(id);
            }
        }
        self.next_lap();
        let idle = self.busy.values().all(|b| !b) && now_ms >= self.solved_ms + RETRY_MS;
        if (self.stale || idle) && !self.minds.is_empty() {
            self.stale = false;
            self.solved_ms = now_ms;
            self.divide();
            // The new sections are flown from this very percept on.
            let ids: Vec<u16> = self.minds.keys().copied().collect();
            for id in ids {
                self.fly(id);
            }
        }
    }

    /// All is covered and is to be covered again: everything is open once more.
    fn next_lap(&mut self) {
        let cells = self.ground.coverage_loop.cells();
        let over = || {
            cells
                .iter()
                .zip(&self.covered)
                .all(|(c, done)| *done || !c.needed)
        };
        if self.further_laps > 0 && over() {
            self.further_laps -= 1;
            self.covered.fill(false);
            self.stale = true;
        }
    }

    /// One percept of one UAV; false when its airframe is gone.
    fn fly(&mut self, id: u16) -> bool {
        let (Some(mind), Some(percept)) = (self.minds.get_mut(&id), self.world.percept(id)) else {
            return false;
        };
        let covered = &self.covered;
        let (setpoint, events) = mind.step(&percept, &|c| is_open(covered, c));
        self.world.apply(id, setpoint);
        for event in events {
            match event {
                Event::Seen(cells) => {
                    for c in cells {
                        self.covered[usize::from(c)] = true;
                    }
                }
                Event::PlanDone => {
                    self.busy.insert(id, false);
                }
                Event::Refused { .. }
                | Event::CutShort { .. }
                | Event::Sighted { .. }
                | Event::DetourFlown => {}
            }
        }
        true
    }

    fn divide(&mut self) {
        let covered = &self.covered;
        let mut promised = covered.clone();
        let mut uavs = Vec::with_capacity(self.minds.len());
        let mut first: BTreeMap<u16, Vec<Leg>> = BTreeMap::new();
        for u in self
            .prepared
            .spec
            .uavs
            .iter()
            .filter(|u| self.minds.contains_key(&u.id))
        {
            let (Some(mind), Some(percept)) = (self.minds.get(&u.id), self.world.percept(u.id))
            else {
                continue;
            };
            // What is under way is finished, as in the swarm.
            let forecast = mind.forecast(0, &|c| is_open(covered, c));
            let mut legs = Vec::new();
            for &c in forecast.cells.iter().filter(|c| is_open(covered, **c)) {
                promised[usize::from(c)] = true;
                legs.push(Leg {
                    first: c,
                    count: 1,
                    direction: forecast.heading,
                });
            }
            first.insert(u.id, legs);
            uavs.push(Uav {
                anchor: forecast.anchor,
                id: u.id,
                heading: forecast.heading,
                release_ms: forecast.release_ms,
                speed_mmps: rounded(mind.loop_speed_mps() * 1000.0).max(1),
                turn_ms: mind.turn_ms(),
                endurance_ms: rounded((percept.endurance_s - u.airframe.reserve_s) * 1000.0)
                    .saturating_sub(forecast.release_ms),
                off_loop: forecast.off_loop,
            });
        }
        let coverage_loop = &self.ground.coverage_loop;
        let ring = coverage_loop.ring(|c, _| is_open(&promised, c));
        for section in self.ground.divide(&ring, &uavs).sections {
            let mut legs = first.remove(&section.id).unwrap_or_default();
            legs.extend(section.legs);
            self.busy.insert(section.id, !legs.is_empty());
            if let Some(mind) = self.minds.get_mut(&section.id) {
                mind.set_goal(Goal::Legs(legs), &|c| is_open(covered, c));
            }
        }
    }
}

fn is_open(covered: &[bool], cell: u16) -> bool {
    !covered.get(usize::from(cell)).copied().unwrap_or(true)
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "casts from floats saturate"
)]
fn rounded(v: f64) -> u32 {
    v.round() as u32
}
