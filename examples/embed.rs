//! The peers of Skein in a simulator of your own, without Zenoh and without ours:
//! `cargo run --example embed`.
//!
//! Three UAVs cover a field; one is lost after a minute, and the others see what it leaves. The
//! world is made of what a peer needs and nothing else: a clock, a disk that always works, a
//! planner, wings that fly setpoints exactly, and a radio that reaches so far. Put your own in
//! their places; [`Peer`] tells nothing of its neighbours but through [`Output::Publish`], and
//! learns nothing but through [`Input`].

use skein_behaviors::obstacle::Obstacles;
use skein_behaviors::reactive::follow::fly;
use skein_behaviors::sightings::Sightings;
use skein_behaviors::traffic::Traffic;
use skein_behaviors::{Percept, Setpoint};
use skein_flight::airframe::{Airframe, CLIMB_MPS};
use skein_flight::coverage::ring::Tree;
use skein_flight::coverage::ring::division::Rule;
use skein_flight::mount::Mount;
use skein_geometry::frame::Pose;
use skein_geometry::math::PI;
use skein_peer::config::Objective;
use skein_peer::{CoverageTask, Input, Mission, Output, Peer, PeerConfig, PeerId, Report};
use skein_peer::{Role, Time, Transmission, offload};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

/// A step of the world, milliseconds.
const STEP_MS: u64 = 100;
/// UAVs sense so often, milliseconds.
const PERCEPT_MS: u64 = 200;
/// Who is nearer than this hears, metres.
const RADIO_M: f64 = 900.0;
/// When the second UAV is lost, milliseconds.
const LOST_MS: u64 = 60_000;
/// Nothing takes longer than this, milliseconds.
const PATIENCE_MS: u64 = 1_200_000;

/// A small fixed wing with an hour of fuel.
fn airframe() -> Airframe {
    Airframe {
        stall_mps: 9.0,
        cruise_mps: 13.0,
        max_mps: 18.0,
        max_bank_rad: PI / 5.0,
        endurance_s: 3600.0,
        reserve_s: 60.0,
        footprint_across_m: 46.0,
        footprint_along_m: 36.0,
        mount: Mount::Level,
        climb_mps: CLIMB_MPS,
    }
}

/// A field of 480 by 384 m, in lanes of 48 m. Lengths are whole millimetres east and north of the
/// origin: peers agree on integers.
fn mission() -> Mission {
    let (width_mm, height_mm) = (480_000, 384_000);
    Mission {
        revision: 1,
        origin_lat_e7: 601_655_000,
        origin_lon_e7: 249_355_000,
        area: vec![(0, 0), (width_mm, 0), (width_mm, height_mm), (0, height_mm)],
        zones: Vec::new(),
        lane_spacing_mm: 48_000,
        turn_radius_mm: 23_500,
        clearance_mm: 8_000,
        footprint_across_mm: 46_000,
        footprint_along_mm: 36_000,
        tracking_error_mm: 2_000,
        launch: (24_000, 24_000),
        base: (-60_000, -60_000),
        task: CoverageTask::Area,
        lap: 0,
        further_laps: 0,
        added_zones: BTreeMap::new(),
        dismissed: Default::default(),
        finds_obstacles: false,
        sortie: 0,
        cancelled: false,
        diagram: None,
        detections: Vec::new(),
        tasks: Vec::new(),
        counts: Vec::new(),
        streets: None,
        layers: None,
        crowd: None,
        buildings: None,
        tree: Tree::default(),
        division: Rule::default(),
        separation_mm: 0,
        fastest_mmps: 0,
    }
}

/// A UAV: a peer and its body.
struct Uav {
    peer: Peer,
    pose: Pose,
    height_m: f64,
    setpoint: Option<Setpoint>,
    /// What is to be told to the peer, in order.
    inbox: VecDeque<Input>,
    /// Cells of the loop that it saw.
    seen: usize,
    finished: bool,
}

impl Uav {
    fn new(id: u16, mission: &Arc<Mission>) -> Self {
        let height_m = 60.0 + 10.0 * f64::from(id);
        let peer = Peer::new(PeerConfig {
            id: PeerId(id),
            role: Role::Uav,
            fleet: "embedded".into(),
            beacon_period_ms: 1000,
            rate_bps: 64_000,
            airframe: Some(airframe()),
            objective: Objective::Time,
            height_m,
            mission: Some(Arc::clone(mission)),
            launches: [].into(),
            seed: 1,
            sensors: 0,
        });
        // What its disk held when it was started, and a number that no earlier start had.
        let start = Input::Start {
            persisted: Vec::new(),
            nonce: id.into(),
        };
        Self {
            peer,
            pose: Pose {
                east_m: 120.0 * f64::from(id),
                north_m: -30.0,
                heading_rad: PI / 2.0,
            },
            height_m,
            setpoint: None,
            inbox: [start].into(),
            seen: 0,
            finished: false,
        }
    }

    fn percept(&self, now_ms: u64) -> Percept {
        let cruise_mps = airframe().cruise_mps;
        let flown_s = now_ms / 1000;
        Percept {
            time_ms: now_ms,
            pose: self.pose,
            height_m: self.height_m,
            airspeed_mps: self
                .setpoint
                .as_ref()
                .map_or(cruise_mps, |s| s.airspeed_mps),
            wind_east_mps: 0.0,
            wind_north_mps: 0.0,
            wind_unknown: false,
            endurance_s: (airframe().endurance_s - flown_s as f64).max(0.0),
            takes_off_in_ms: 0,
            launch_ready: false,
            failsafe: false,
            circles_per_m: None,
            circles_in_ms: 0,
            traffic: Traffic::default(),
            obstacles: Obstacles::default(),
            sightings: Sightings::default(),
            contour: skein_behaviors::contour::ContourLook::default(),
            crowd: skein_behaviors::crowd::CrowdLook::default(),
            attitude: None,
        }
    }

    /// Tells the peer all that happened, and does what it wants; what it transmits is returned.
    fn think(&mut self, now_ms: u64) -> Vec<Vec<u8>> {
        let now = Time(now_ms);
        if self.peer.next_timeout().is_some_and(|due| due <= now) {
            self.inbox.push_back(Input::Timer);
        }
        let mut transmitted = Vec::new();
        while let Some(input) = self.inbox.pop_front() {
            self.peer.handle(now, input);
            while let Some(output) = self.peer.poll() {
                match output {
                    Output::Publish { bytes, .. } => transmitted.push(bytes),
                    // Nobody is started anew here, so nothing need be kept.
                    Output::Store { token, .. } => {
                        self.inbox.push_back(Input::Stored { token, ok: true });
                    }
                    Output::Compute { token, job } => {
                        let result = offload::run(&job);
                        self.inbox.push_back(Input::Computed { token, result });
                    }
                    Output::Setpoint(setpoint) => self.setpoint = Some(setpoint),
                    Output::Report(Report::Covered { cells }) => self.seen += cells.len(),
                    Output::Report(Report::Finished { .. }) => self.finished = true,
                    Output::Report(_) => {}
                }
            }
        }
        transmitted
    }

    /// Flies the last setpoint for a step.
    fn fly(&mut self) {
        if let Some(setpoint) = &self.setpoint {
            let step_ms = u32::try_from(STEP_MS).unwrap_or(u32::MAX);
            self.pose = fly(self.pose, setpoint.airspeed_mps, &setpoint.steps, step_ms);
        }
    }
}

/// What came of it.
struct Flown {
    /// When all who live knew that everything was seen, milliseconds; `None` if never.
    finished_ms: Option<u64>,
    /// Cells that each UAV saw.
    seen: BTreeMap<u16, usize>,
    /// Cells of the mission.
    cells: usize,
}

fn run() -> Flown {
    let mission = Arc::new(mission());
    let cells = mission.geometry().map_or(0, |g| g.coverage_loop.len());
    let mut uavs: BTreeMap<u16, Uav> = (1..=3).map(|id| (id, Uav::new(id, &mission))).collect();
    let mut gone = BTreeSet::new();
    let mut now_ms = 0;
    let mut finished_ms = None;
    while now_ms < PATIENCE_MS && finished_ms.is_none() {
        if now_ms == LOST_MS {
            gone.insert(2);
        }
        let ids: Vec<u16> = uavs
            .keys()
            .copied()
            .filter(|id| !gone.contains(id))
            .collect();
        for id in &ids {
            let Some(uav) = uavs.get_mut(id) else {
                continue;
            };
            uav.fly();
            if now_ms % PERCEPT_MS == 0 {
                let percept = uav.percept(now_ms);
                uav.inbox.push_back(Input::Percept(percept));
            }
            let here = uav.pose.position();
            for bytes in uav.think(now_ms) {
                for other in ids.iter().filter(|other| *other != id) {
                    let Some(hears) = uavs.get_mut(other) else {
                        continue;
                    };
                    if (hears.pose.position() - here).norm() < RADIO_M {
                        hears.inbox.push_back(Input::Received {
                            transmitter: *id,
                            hops: 0,
                            heard: Transmission::read(bytes.clone()).into(),
                        });
                    }
                }
            }
        }
        now_ms += STEP_MS;
        finished_ms = ids.iter().all(|id| uavs[id].finished).then_some(now_ms);
    }
    Flown {
        finished_ms,
        seen: uavs.iter().map(|(id, uav)| (*id, uav.seen)).collect(),
        cells,
    }
}

fn main() {
    let flown = run();
    println!(
        "{} cells; UAV 2 was lost after {} s",
        flown.cells,
        LOST_MS / 1000
    );
    for (id, seen) in &flown.seen {
        println!("UAV {id} saw {seen} cells");
    }
    match flown.finished_ms {
        Some(ms) => println!("the others knew after {} s that all is seen", ms / 1000),
        None => println!("not all was seen within {} s", PATIENCE_MS / 1000),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_lost_uav_leaves_is_seen_by_the_others() {
        let flown = run();
        assert!(flown.finished_ms.is_some());
        assert!(flown.seen[&2] < flown.cells / 3);
        // One may see a cell again before it hears that it was seen.
        assert!(flown.seen.values().sum::<usize>() >= flown.cells);
    }
}
