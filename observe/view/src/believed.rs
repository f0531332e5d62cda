//! One peer, as whoever listens believes it.

use skein_geometry::frame::{Origin as Plane, Point};
use skein_peer::wire::message::{Activity, Beacon, Claim, Cover, Heartbeat, MissionStatus, State};
use skein_recording::compass_deg;
use skein_recording::model::Place;
use skein_recording::model::frame::{Pose, State as Told, UavState};
use std::collections::{BTreeMap, BTreeSet};

/// A peer that somebody suspects is held to be gone after so many of its usual intervals without
/// a heartbeat: the swarm's own patience is 4 and more.
const SUSPECTED_INTERVALS: f64 = 5.0;

/// One that nobody suspects, as where nobody else is heard.
const SILENT_INTERVALS: f64 = 12.0;

/// Before two heartbeats were heard of a peer its interval is taken to be this, milliseconds.
const FIRST_INTERVAL_MS: f64 = 2_000.0;

/// Nobody is held to be gone sooner than this, milliseconds: trials run up to ten times faster
/// than their clocks, and a busy machine stutters.
const LEAST_PATIENCE_MS: f64 = 1_000.0;

/// The interval follows what is heard by this share: some ten heartbeats.
const SHARE: f64 = 0.15;

/// When something is heard.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Now {
    /// On the listener's clock.
    pub(crate) ms: u64,
    /// On one that stands still while nobody at all is heard: a trial that stops for a slow
    /// machine kills nobody.
    pub(crate) air_ms: u64,
}

/// What is known of one peer.
#[derive(Debug, Default)]
pub(crate) struct Peer {
    pub(crate) incarnation: u32,
    /// The newest number of each register.
    newest: BTreeMap<(u8, u16), (u32, u32)>,
    heartbeat: u32,
    heard_ms: u64,
    /// The same on the clock that stands still while nobody is heard.
    heard_air_ms: u64,
    interval_ms: Option<f64>,
    place: Option<Point>,
    heading_rad: f64,
    state: Option<State>,
    ground_station: bool,
    finished: bool,
    /// Whom it hears itself.
    neighbours: BTreeSet<u16>,
    suspects: BTreeSet<u16>,
    beacon_ms: u64,
    pub(crate) claim: Option<Claim>,
    pub(crate) cover: Option<Cover>,
    /// Held to be gone.
    pub(crate) gone: bool,
}

impl Peer {
    /// Whether a record is newer than what was heard of its register: several pass it on.
    pub(crate) fn is_news(&mut self, version: (u32, u32), kind: u8, subject: u16) -> bool {
        let newest = self.newest.entry((kind, subject)).or_default();
        if *newest >= version || version.0 < self.incarnation {
            return false;
        }
        *newest = version;
        self.incarnation = version.0;
        true
    }

    pub(crate) fn beacon(&mut self, now: Now, beacon: &Beacon) {
        let (east_mm, north_mm) = (f64::from(beacon.east_mm), f64::from(beacon.north_mm));
        self.place = Some(Point::new(east_mm / 1e3, north_mm / 1e3));
        self.heading_rad = f64::from(beacon.heading_e4) / 1e4;
        self.ground_station = beacon.ground_station;
        self.finished = beacon.finished;
        self.beacon_ms = now.ms;
        let one_hop = beacon.gossip.iter().filter(|g| g.hops == 1);
        self.neighbours = one_hop.map(|g| g.id).collect();
        let fresh = beacon.fresh.iter().filter(|f| f.hops == 1);
        self.neighbours.extend(fresh.map(|f| f.id));
        let suspected = beacon.gossip.iter().filter(|g| g.suspected_ds.is_some());
        self.suspects = suspected.map(|g| g.id).collect();
        let fresh = beacon.fresh.iter().filter(|f| f.suspected_ds.is_some());
        self.suspects.extend(fresh.map(|f| f.id));
        self.lives(now, beacon.heartbeat);
    }

    pub(crate) fn heartbeat(&mut self, now: Now, heard: &Heartbeat) {
        let (east_dm, north_dm) = (f64::from(heard.east_dm), f64::from(heard.north_dm));
        self.place = Some(Point::new(east_dm / 10.0, north_dm / 10.0));
        self.is_heard(now);
    }

    pub(crate) fn state(&mut self, now: Now, state: &State) {
        // A state that was passed on may be older than the last beacon.
        if self.place.is_none() || now.ms.saturating_sub(self.beacon_ms) > 3_000 {
            let (east_mm, north_mm) = (f64::from(state.east_mm), f64::from(state.north_mm));
            self.place = Some(Point::new(east_mm / 1e3, north_mm / 1e3));
            self.heading_rad = f64::from(state.heading_e4) / 1e4;
        }
        self.ground_station |= state.activity == Activity::GroundStation;
        if self.state.is_none() {
            self.is_heard(now);
        }
        self.state = Some(state.clone());
    }

    /// Another peer knows a heartbeat of it.
    pub(crate) fn gossiped(&mut self, now: Now, incarnation: u32, heartbeat: u32) {
        if incarnation > self.incarnation {
            self.incarnation = incarnation;
            self.heartbeat = 0;
        }
        if incarnation == self.incarnation {
            self.lives(now, heartbeat);
        }
    }

    /// A heartbeat of it is known.
    fn lives(&mut self, now: Now, heartbeat: u32) {
        if heartbeat <= self.heartbeat {
            return;
        }
        let n = f64::from(heartbeat - self.heartbeat);
        if self.heartbeat > 0 && n < 100.0 && !self.gone {
            let gap_ms = now.air_ms.saturating_sub(self.heard_air_ms) as f64 / n;
            let before_ms = self.interval_ms.unwrap_or(gap_ms);
            self.interval_ms = Some(before_ms + (gap_ms - before_ms) * SHARE);
        }
        self.heartbeat = heartbeat;
        self.is_heard(now);
    }

    fn is_heard(&mut self, now: Now) {
        self.heard_ms = now.ms;
        self.heard_air_ms = now.air_ms;
    }

    /// When a sign of its life was heard last.
    pub(crate) fn heard_ms(&self) -> u64 {
        self.heard_ms
    }

    /// Whether it is to be held to be gone.
    pub(crate) fn is_gone(&self, now: Now, suspected: bool) -> bool {
        let patience = if suspected {
            SUSPECTED_INTERVALS
        } else {
            SILENT_INTERVALS
        };
        let interval_ms = self.interval_ms.unwrap_or(FIRST_INTERVAL_MS);
        let silent_ms = now.air_ms.saturating_sub(self.heard_air_ms) as f64;
        silent_ms > (patience * interval_ms).max(LEAST_PATIENCE_MS)
    }

    /// Whether its last beacon, if that is no older than its usual silence, names another one as
    /// heard by itself.
    pub(crate) fn hears(&self, now_ms: u64, other: u16) -> bool {
        let interval_ms = self.interval_ms.unwrap_or(FIRST_INTERVAL_MS);
        let age_ms = now_ms.saturating_sub(self.beacon_ms) as f64;
        age_ms <= (SILENT_INTERVALS * interval_ms).max(3.0 * LEAST_PATIENCE_MS)
            && self.neighbours.contains(&other)
    }

    pub(crate) fn suspects(&self, other: u16) -> bool {
        self.suspects.contains(&other)
    }

    pub(crate) fn is_ground_station(&self) -> bool {
        self.ground_station
    }

    /// Where it was heard last.
    pub(crate) fn place(&self) -> Option<Point> {
        self.place
    }

    pub(crate) fn height_m(&self) -> f64 {
        let state = self.state.as_ref();
        state.map_or(0.0, |s| f64::from(s.height_mm) / 1e3)
    }

    /// The same as a row of a frame.
    pub(crate) fn uav(&self, id: u16, cells_left: usize, plane: Option<&Plane>) -> UavState {
        let said = self.state.as_ref();
        let state = match said.map(|s| (s.activity, s.mission)) {
            _ if self.gone => Told::Lost,
            None => Told::Starting,
            Some((Activity::Waiting, _)) => Told::Starting,
            Some((Activity::Covering, _)) => Told::Working,
            Some((_, MissionStatus::Accomplished)) => Told::Finished,
            Some((Activity::Returning, _)) => Told::Finished,
            Some((Activity::Holding | Activity::GroundStation, _)) if self.finished => Told::Home,
            Some((Activity::Holding | Activity::GroundStation, _)) => Told::Idle,
        };
        let place = self.place.filter(|_| !self.gone).zip(plane);
        UavState {
            id,
            state,
            pose: place.map(|(at, plane)| Pose {
                place: Place::of(plane, at),
                heading_deg: compass_deg(self.heading_rad),
                height_m: self.height_m(),
                airspeed_mps: said.map_or(0.0, |s| f64::from(s.airspeed_mmps) / 1e3),
            }),
            fuel_left_s: said
                .filter(|_| !self.gone)
                .map(|s| f64::from(s.endurance_s)),
            cells_left,
            ..UavState::default()
        }
    }
}
