//! The rules of single peers behind one door: what they say and fly, and when.

use super::activity::ActivityCheck;
use super::airtime::AirtimeCheck;
use super::cadence::CadenceCheck;
use super::contours::{ContourCheck, Tracer};
use super::counts::CountCheck;
use super::crowds::CrowdCheck;
use super::decision::{DecisionCheck, Mover};
use super::detections::DetectionCheck;
use super::flight::{FlightCheck, Flyer, HOLD_RADII, at_base};
use super::footprint::FootprintCheck;
use super::fuel::FuelCheck;
use super::layers::LayerCheck;
use super::listing::ListingCheck;
use super::patience::PatienceCheck;
use super::record::Said;
use super::relays::RelayCheck;
use super::spoken::SpokenCheck;
use super::spread::SpreadCheck;
use super::streets::StreetCheck;
use super::tasks::TaskCheck;
use super::tracks::TrackCheck;
use super::watch::WatchCheck;
use super::wind::WindCheck;
use super::{Findings, Handicaps, PeerSnapshot, Snapshot};
use crate::spec::{Spec, UavSpec};
use crate::twins::Twins;
use crate::world::contour::Contour;
use skein_flight::coverage::ring::backtracking::{Division, RingCell, Uav};
use skein_geometry::frame::Point;
use skein_peer::cells::CellSet;
use skein_peer::diagram::StateGoal;
use skein_peer::library::chunks;
use skein_peer::mission::{Mission, point_m};
use skein_peer::offload::MissionGeometry;
use skein_peer::output::Status;
use skein_peer::wire::codec::Body;
use skein_peer::wire::message::{Bid, Heartbeat, Order};
use skein_peer::{Beliefs, Incarnation, Report};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A circle in which others are waited for has so many times the least radius, and as many times
/// the separation is kept between two.
const WAITING_RADII: f64 = 1.25;

/// The rules of single peers in one run.
#[derive(Clone, Debug)]
pub struct Rules {
    /// What is flown.
    pub flight: FlightCheck,
    fuel: FuelCheck,
    pub(crate) activity: ActivityCheck,
    flyers: BTreeMap<u16, Flyer>,
    airtime: AirtimeCheck,
    cadence: CadenceCheck,
    decision: DecisionCheck,
    patience: PatienceCheck,
    spoken: SpokenCheck,
    spread: SpreadCheck,
    tasks: TaskCheck,
    /// Who holds relay positions.
    pub relays: RelayCheck,
    /// Who follows targets.
    pub tracks: TrackCheck,
    watch: WatchCheck,
    pub(crate) wind: WindCheck,
    pub(crate) footprint: FootprintCheck,
    /// What the mission looks for.
    pub detections: DetectionCheck,
    /// Contours that are flown along.
    pub contours: ContourCheck,
    /// What is counted at its sites.
    pub counts: CountCheck,
    /// How its streets are used.
    pub streets: StreetCheck,
    /// Whether each of its layers was seen.
    pub layers: LayerCheck,
    /// Who is where at the event that it watches.
    pub crowds: CrowdCheck,
    loops: BTreeMap<u16, u64>,
    twins: Twins,
    /// Where missions end, by the first revision that says so.
    bases: BTreeMap<u32, Point>,
}

impl Rules {
    /// The rules of a scenario.
    #[must_use]
    pub fn new(spec: &Spec) -> Self {
        let period_ms = u64::from(spec.beacon_period_ms.max(1));
        let flyers: BTreeMap<u16, Flyer> =
            spec.uavs.iter().map(|u| (u.id, flyer(u, spec))).collect();
        let mut rules = Self {
            flight: FlightCheck::new(
                flyers.clone(),
                spec.zones.clone(),
                spec.mission.clearance_m(),
            ),
            fuel: FuelCheck::new(spec),
            activity: ActivityCheck::default(),
            flyers,
            airtime: AirtimeCheck::new(spec.radio.rate_bps, period_ms),
            cadence: CadenceCheck::new(period_ms),
            decision: DecisionCheck::new(period_ms, spec.twins()),
            patience: PatienceCheck::new(period_ms),
            spoken: SpokenCheck::default(),
            spread: SpreadCheck::new(spec.twins()),
            tasks: TaskCheck::default(),
            relays: RelayCheck::default(),
            tracks: TrackCheck::default(),
            watch: WatchCheck::default(),
            wind: WindCheck::new(&spec.wind),
            footprint: FootprintCheck::default(),
            detections: DetectionCheck::default(),
            contours: ContourCheck::default(),
            counts: CountCheck::default(),
            streets: StreetCheck::default(),
            layers: LayerCheck::default(),
            crowds: CrowdCheck::default(),
            loops: BTreeMap::new(),
            twins: spec.twins(),
            bases: BTreeMap::new(),
        };
        rules.on_mission(&spec.mission);
        rules
    }

    /// The operator has a mission.
    pub fn on_mission(&mut self, mission: &Mission) {
        self.bases.insert(mission.revision, point_m(mission.base));
        self.flight.on_zones(mission.zones_m());
        self.activity.on_mission(mission);
        self.detections.on_mission(mission);
        self.counts.on_mission(mission);
        self.streets.on_mission(mission);
        self.crowds.on_mission(mission);
        self.spread
            .on_mission(chunks(mission).map_or(0, |pieces| pieces.len()));
    }

    /// The operator gives an order, to all or to one.
    pub fn on_order(&mut self, order: Order) {
        self.activity.on_order(order);
    }

    /// A loop was derived.
    pub fn on_loop(&mut self, geometry: &Arc<MissionGeometry>) {
        self.decision.on_loop(geometry);
        self.fuel.on_loop(geometry);
        self.watch.on_loop(geometry);
    }

    /// A process starts.
    pub fn on_boot(&mut self, now_ms: u64, id: u16) {
        self.on_silent(id, true);
        self.decision.on_anew(id);
        self.streets.on_boot(id);
        self.loops.remove(&id);
        self.cadence.on_boot(now_ms, id);
        self.activity.on_boot(now_ms, id);
    }

    /// A process ends, with all that it knew, or stands still (`death` is false).
    pub fn on_silent(&mut self, id: u16, death: bool) {
        self.cadence.on_silent(id);
        self.patience.on_silent(id);
        self.flight.on_silent(id);
        self.activity.on_silent(id, death);
        self.fuel.on_silent(id);
        self.wind.on_silent(id);
        self.spread.on_silent(id);
        self.spoken.on_silent(id, death);
        if death {
            self.patience.on_anew(id);
            self.spread.on_death(id);
        }
    }

    /// A peer reports something; beside it the divisions it adopted in this life, the
    /// diameter that bounds reckon with, and who heard which claims.
    pub fn on_report(
        &mut self,
        now_ms: u64,
        id: u16,
        report: &Report,
        (adoptions, diameter, listing): (u32, u64, &ListingCheck),
        handicaps: &Handicaps,
        found: &mut Findings,
    ) {
        match report {
            Report::Membership {
                peer,
                incarnation,
                status,
            } => {
                let about = (id, peer.0);
                let belief = (*incarnation, *status);
                self.cadence
                    .on_belief(now_ms, about, belief, (diameter, handicaps), found);
                if *status == Status::Down {
                    let heard = |author, on| listing.heard_on(id, author, on);
                    self.patience
                        .on_down(now_ms, about, *incarnation, heard, handicaps);
                } else {
                    self.patience.on_believed(now_ms, about, *incarnation);
                }
            }
            Report::Claim { counter, .. } => {
                self.cadence.on_claim(now_ms, id);
                self.decision.on_told(now_ms, id, adoptions);
                self.patience.on_told(now_ms, id, (adoptions, *counter));
            }
            Report::Covered { cells } => self.decision.on_covered(id, cells.len()),
            Report::Task {
                id: task,
                revision,
                news,
                ..
            } => self.tasks.on_report(id, (*task, *revision), news),
            Report::Detected { told, .. } => self.activity.on_detected(id, told),
            Report::Ready { loop_hash, .. } => {
                let before = self.loops.insert(id, *loop_hash);
                self.on_loop_of(id, before, *loop_hash);
            }
            _ => {}
        }
    }

    fn on_loop_of(&mut self, id: u16, before: Option<u64>, now: u64) {
        if before != Some(now) {
            self.decision.on_anew(id);
            self.patience.on_anew(id);
        }
    }

    /// A peer puts bytes on the air, its own or another's.
    pub fn on_transmission(
        &mut self,
        now_ms: u64,
        id: u16,
        bytes: usize,
        handicaps: &Handicaps,
        found: &mut Findings,
    ) {
        self.airtime.on_transmission(now_ms, id, bytes);
        self.cadence.on_transmission(now_ms, id, handicaps, found);
    }

    /// A peer puts its own beacon on the air while it believes this.
    pub fn on_beacon(
        &mut self,
        now_ms: u64,
        id: u16,
        said: &Said,
        view: &Beliefs,
        found: &mut Findings,
    ) {
        if let Body::Beacon(beacon) = &said.body {
            let author = (id, said.record.incarnation);
            self.spoken.on_beacon(now_ms, author, beacon, view, found);
            self.cadence.on_beacon_spoken(id, beacon.interval);
            self.decision.on_interval(beacon.interval);
            self.airtime.on_beat(now_ms, id, beacon.interval, false);
        }
    }

    /// A peer puts its own heartbeat on the air.
    pub fn on_heartbeat(&mut self, now_ms: u64, id: u16, heartbeat: &Heartbeat) {
        self.cadence.on_beacon_spoken(id, heartbeat.interval);
        self.decision.on_interval(heartbeat.interval);
        self.airtime.on_beat(now_ms, id, heartbeat.interval, true);
    }

    /// A peer publishes a record of its own; `seen` tells what cameras saw of which loop.
    pub fn on_said(
        &mut self,
        now_ms: u64,
        id: u16,
        said: &Said,
        seen: (u64, &CellSet),
        found: &mut Findings,
    ) {
        let author = (id, said.record.incarnation);
        self.spread.on_held(id, &said.record);
        self.spoken.on_said(now_ms, author, &said.body, seen, found);
        if let Some(claim) = &said.claim {
            self.spoken.on_claim(id, author.1, Arc::clone(claim));
            let covered = (claim.loop_hash == seen.0).then_some(seen.1);
            self.decision.on_claim(now_ms, id, claim, covered, found);
        }
    }

    /// A peer hears a record.
    pub fn on_held(&mut self, id: u16, said: &Said) {
        self.spread.on_held(id, &said.record);
    }

    /// A running peer of this life receives a record: now, of one that arrived then.
    pub fn on_received(
        &mut self,
        (now_ms, arrived_ms): (u64, u64),
        (id, life): (u16, Incarnation),
        said: &Said,
    ) {
        self.on_held(id, said);
        let speaks_as = self.twins.id_of(id);
        if let Body::Beacon(beacon) = &said.body {
            let author = (said.record.author, said.record.incarnation);
            let by = (id, speaks_as, life);
            self.cadence
                .on_beacon_heard((now_ms, arrived_ms), by, author, beacon);
        }
        if let Body::Heartbeat(heartbeat) = &said.body {
            let author = (said.record.author, said.record.incarnation);
            self.cadence
                .on_heartbeat_heard(arrived_ms, id, author, heartbeat.interval);
        }
        if let Body::Bid(bid) = &said.body {
            self.patience.on_bid_heard(now_ms, (id, speaks_as), bid);
        }
    }

    /// A peer makes a bid durable while it believes this, at this place; it was told of so
    /// much fuel, seconds.
    pub fn on_bid(
        &mut self,
        now_ms: u64,
        id: u16,
        bid: &Bid,
        (view, at): (&Beliefs, Option<(Point, f64)>),
        handicaps: &Handicaps,
        found: &mut Findings,
    ) {
        let base = self.base_of(view.revision);
        let mover = at.zip(self.flyers.get(&id));
        let mover = mover.map(|((at, fuel_s), flyer)| Mover {
            at,
            fastest_mps: flyer.fastest_mps,
            may_offer_ms: base.and_then(|base| self.fuel.may_offer_ms(id, view, fuel_s, base)),
        });
        self.decision
            .on_bid(now_ms, id, bid, (view, mover), handicaps, found);
        self.patience
            .on_bid(now_ms, id, (bid, view.diameter), handicaps, found);
    }

    /// A peer asks for a division, and gets it.
    pub fn on_divide(
        &mut self,
        now_ms: u64,
        id: u16,
        divided: (&[RingCell], &[Uav], &Division),
        found: &mut Findings,
    ) {
        self.decision.on_divide(now_ms, id, divided, found);
    }

    /// Judges everybody, once a beacon period.
    pub fn on_snapshot(&mut self, snapshot: &Snapshot<'_>, found: &mut Findings) {
        self.cadence.on_snapshot(snapshot, found);
        self.decision.on_snapshot(snapshot);
        self.patience.on_snapshot(snapshot, found);
        self.spoken.on_snapshot(snapshot, found);
        self.spread.on_snapshot(snapshot, found);
        self.tasks.on_snapshot(snapshot, found);
        let flyers = (&self.flyers, &self.flight);
        self.crowds.on_snapshot(snapshot, flyers, found);
        self.relays.on_snapshot(snapshot, flyers, found);
        self.airtime.on_snapshot(snapshot, found);
        self.on_way_home(snapshot, found);
        let is_round = |m: &PeerSnapshot| self.activity.goal(m) == Some(StateGoal::Round);
        self.watch
            .on_snapshot(snapshot, is_round, &self.flyers, found);
    }

    /// Judges only what is flown: all else is over.
    pub fn on_way_home(&mut self, snapshot: &Snapshot<'_>, found: &mut Findings) {
        let bases = &self.bases;
        let base = |revision| base_of(bases, revision);
        self.activity.on_snapshot(snapshot, found);
        let wanted = |id| self.activity.wanted(id);
        self.flight.on_snapshot(snapshot, base, wanted, found);
        let flyers = (&self.flyers, &self.flight);
        self.fuel.on_snapshot(snapshot, base, flyers, found);
        self.wind.on_snapshot(snapshot, found);
    }

    /// Whether a UAV is to fly along a contour, by its state.
    #[must_use]
    pub fn traces(&self, m: &PeerSnapshot) -> bool {
        self.activity.goal(m) == Some(StateGoal::Trace)
    }

    /// Who flies along a contour, beside where it is.
    pub fn on_tracers(
        &mut self,
        now_ms: u64,
        contour: &Contour,
        all: &[Tracer],
        handicaps: &Handicaps,
        found: &mut Findings,
    ) {
        let around = (&self.flyers, handicaps);
        self.contours.on_looks(now_ms, contour, all, around, found);
    }

    /// Where the mission of a revision ends.
    fn base_of(&self, revision: u32) -> Option<Point> {
        base_of(&self.bases, revision)
    }

    /// Judges how those who are silent fly home, of whom these can; whoever could not is on
    /// its way from when it can.
    pub fn on_silent_home(
        &mut self,
        snapshot: &Snapshot<'_>,
        (silent, steered): (impl Iterator<Item = u16>, &[PeerSnapshot]),
        found: &mut Findings,
    ) {
        for id in silent.filter(|id| steered.iter().all(|m| m.id != *id)) {
            self.flight.on_silent(id);
            self.fuel.on_silent(id);
        }
        let of_silent = Snapshot {
            peers: steered,
            ..*snapshot
        };
        self.on_way_home(&of_silent, found);
    }

    /// Whether a UAV at this place is at a base that some revision gave.
    #[must_use]
    pub fn is_home(&self, id: u16, at: Point) -> bool {
        let flyer = self.flyers.get(&id);
        flyer.is_some_and(|f| self.bases.values().any(|base| at_base(at, *base, *f)))
    }

    /// Whether everybody who is to be home is.
    #[must_use]
    pub fn all_home(&self, peers: &[PeerSnapshot]) -> bool {
        self.flight.all_home(peers)
    }
}

fn base_of(bases: &BTreeMap<u32, Point>, revision: u32) -> Option<Point> {
    bases.range(..=revision).next_back().map(|(_, b)| *b)
}

pub(crate) fn flyer(uav: &UavSpec, spec: &Spec) -> Flyer {
    let wind_mps = spec.wind.strongest().speed_mps();
    let airframe = &uav.airframe;
    let turn_radius_m = airframe.ground_turn_radius_m(airframe.cruise_mps, wind_mps);
    let circle_m = turn_radius_m.max(f64::from(spec.mission.turn_radius_mm) / 1e3);
    Flyer {
        turn_radius_m,
        slowest_mps: airframe.cruise_mps - wind_mps,
        fastest_mps: airframe.max_mps + wind_mps,
        waits_within_m: HOLD_RADII * circle_m + waits_beside_m(spec),
    }
}

/// How far from where all are to be the last of them waits who fly at one height, metres: their
/// circles, and what they keep between them, lie in rings of six, twelve and so on round the first.
fn waits_beside_m(spec: &Spec) -> f64 {
    let separation_m = f64::from(spec.mission.separation_mm) / 1e3;
    if separation_m <= 0.0 {
        return 0.0;
    }
    let radius_m = f64::from(spec.mission.turn_radius_mm) / 1e3;
    let apart_m = 2.0 * WAITING_RADII * radius_m + WAITING_RADII * separation_m;
    let within = |rings: &u32| (1 + 3 * rings * (rings + 1)) as usize >= spec.uavs.len();
    f64::from((0..).find(within).unwrap_or(0)) * apart_m
}
