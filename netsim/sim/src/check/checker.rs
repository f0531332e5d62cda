//! All checks of one run behind one door: the driver tells what happened, the checks
//! decide what it means.

use super::contours::Tracer;
use super::cover::CoverCheck;
use super::detections::{Around, Truth};
use super::footprint::FootprintErrors;
use super::graph::{Graph, Stability};
use super::listing::ListingCheck;
use super::membership::Membership;
use super::progress::ProgressCheck;
use super::record::{RecordCheck, Said};
use super::rules::Rules;
use super::tracks::Look;
use super::twins::TwinCheck;
use super::{Bounds, Findings, Handicaps, PeerSnapshot, Snapshot};
use crate::fault::Fault;
use crate::spec::Spec;
use crate::world::Approach;
use crate::world::contour::Contour;
use crate::world::fact::{Collision, Intrusion};
use skein_flight::coverage::ring::backtracking::{Division, RingCell, Uav};
use skein_geometry::frame::Point;
use skein_peer::cells::CellSet;
use skein_peer::config::Launch;
use skein_peer::journal::Durable;
use skein_peer::offload::MissionGeometry;
use skein_peer::output::Status;
use skein_peer::wire::limits::MEMBERS_MAX;
use skein_peer::wire::message::{Bid, Heartbeat};
use skein_peer::{Beliefs, Incarnation, Report};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Hard places that a batch of seeds must have reached to mean anything.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reached {
    /// A peer died that held cells it had taken over from the dead.
    pub takeover_of_takeover: u32,
    /// Both sides of a partition adopted a division while it lasted.
    pub both_halves_planned: u32,
    /// A peer was restarted while a round was undecided.
    pub restart_in_round: u32,
    /// A peer died that joined two parts of its component.
    pub articulation_lost: u32,
    /// A mission revision arrived at peers more than a beacon period apart.
    pub staggered_revision: u32,
}

/// The checks of one run.
#[derive(Clone, Debug)]
pub struct Checker {
    period_ms: u64,
    /// What was found.
    pub found: Findings,
    /// Who knows of whose death.
    pub members: Membership,
    /// Who lists what.
    pub listing: ListingCheck,
    /// The hard places reached.
    pub reached: Reached,
    record: RecordCheck,
    /// Rules of single peers: what they say and fly, and when.
    pub rules: Rules,
    cover: CoverCheck,
    progress: ProgressCheck,
    twins: TwinCheck,
    graph: Graph,
    stability: Stability,
    handicaps: Handicaps,
    bounds: Bounds,
    /// When which interval was the longest announced.
    intervals: Vec<(u64, u64)>,
    open_round: BTreeMap<u16, u32>,
    adopted: BTreeMap<u16, u32>,
    split_at: Option<BTreeMap<u16, u32>>,
    ready_ms: BTreeMap<u32, u64>,
    /// The loop on which cells are judged.
    loop_hash: u64,
    /// Who is launched where, as all of a large fleet are told, until there is a loop.
    roster: Option<Arc<[Launch]>>,
}

impl Checker {
    /// The checks of the run of a scenario with this seed.
    #[must_use]
    pub fn new(seed: u64, spec: &Spec) -> Self {
        let period_ms = u64::from(spec.beacon_period_ms.max(1));
        Self {
            period_ms,
            found: Findings::new(seed),
            members: Membership::default(),
            listing: ListingCheck::default(),
            reached: Reached::default(),
            record: RecordCheck::default(),
            rules: Rules::new(spec),
            cover: CoverCheck::default(),
            progress: ProgressCheck::default(),
            twins: TwinCheck::new(spec.twins()),
            graph: Graph::default(),
            stability: Stability::default(),
            handicaps: Handicaps::default(),
            bounds: Bounds {
                period_ms,
                interval_ms: period_ms,
                diameter: 1,
            },
            intervals: Vec::new(),
            open_round: BTreeMap::new(),
            adopted: BTreeMap::new(),
            split_at: None,
            ready_ms: BTreeMap::new(),
            loop_hash: 0,
            roster: Some(spec.launches()).filter(|l| l.len() > MEMBERS_MAX),
        }
    }

    /// How far pictures were from where they were planned so far.
    #[must_use]
    pub fn footprint_errors(&self) -> FootprintErrors {
        self.rules.footprint.errors()
    }

    /// A loop was derived.
    pub fn on_loop(&mut self, geometry: &Arc<MissionGeometry>) {
        self.rules.on_loop(geometry);
        if let Some(roster) = self.roster.take() {
            let planned = geometry.first_division(&roster);
            self.listing = ListingCheck::with_roster(planned.into_owned());
        }
    }

    /// A process starts. `again` unless it is the first time; `fresh` without its disk.
    pub fn on_boot(&mut self, now_ms: u64, id: u16, again: bool, fresh: bool) {
        self.members.on_running(id, true);
        self.twins.on_voice(id);
        self.cover.on_boot(id);
        self.record.on_boot(id);
        self.rules.on_boot(now_ms, id);
        if fresh {
            self.record.on_erased(id);
        }
        if again {
            self.progress.on_restart(now_ms, id);
            if !self.open_round.is_empty() {
                self.reached.restart_in_round += 1;
            }
        }
    }

    /// Cells are counted on another loop from now on: another lap begins, or another mission.
    pub fn on_new_loop(&mut self, loop_hash: u64) {
        self.loop_hash = loop_hash;
        self.listing.on_new_loop();
        self.cover = CoverCheck::default();
        self.progress = ProgressCheck::default();
    }

    /// A process falls silent since another one speaks under its id: for all others it is
    /// gone, as one that stands still. In lives that it shared its heirs are meant.
    pub fn on_silenced(&mut self, now_ms: u64, id: u16, heirs: &[(Incarnation, u16)]) {
        for (life, heir) in heirs {
            self.members.on_heir(id, *heir, *life);
        }
        self.on_silent(now_ms, id, false, false);
        self.twins.on_silenced(id);
    }

    /// A process begins a life after it was silent.
    pub fn on_voice(&mut self, id: u16) {
        self.on_resume(id);
        self.rules.on_silent(id, false);
        self.twins.on_voice(id);
    }

    /// A process goes on after standing still.
    pub fn on_resume(&mut self, id: u16) {
        self.members.on_running(id, false);
    }

    /// A process ends (`death`) or stands still. `second_hand` says that it held cells
    /// which it had itself taken over from the dead.
    pub fn on_silent(&mut self, now_ms: u64, id: u16, death: bool, second_hand: bool) {
        if death && self.graph.is_articulation(id) {
            self.reached.articulation_lost += 1;
        }
        self.members.on_silent(now_ms, id, death, &self.bounds);
        if death {
            self.listing.on_death(id);
            self.twins.on_voice(id);
        }
        if death && second_hand {
            self.reached.takeover_of_takeover += 1;
        }
        self.progress.on_silent(id);
        self.progress.on_loss();
        self.rules.on_silent(id, death);
        self.open_round.remove(&id);
        self.stability.forget(id);
    }

    /// A process ends: what it believes durable, what its disk holds, and of how many of the
    /// last writes it had not been told yet.
    pub fn on_crash(
        &mut self,
        now_ms: u64,
        id: u16,
        (believed, journal, untold): (&Durable, &[Vec<u8>], usize),
    ) {
        let kept = (believed, journal, untold);
        self.record
            .on_crash(now_ms, id, kept, &self.handicaps, &mut self.found);
    }

    /// The links were cut into groups, or healed.
    pub fn on_partition(&mut self, begins: bool, side: impl Fn(u16) -> usize) {
        if begins {
            self.split_at = Some(self.adopted.clone());
            return;
        }
        let Some(before) = self.split_at.take() else {
            return;
        };
        let mut sides: Vec<usize> = self
            .adopted
            .iter()
            .filter(|(id, counter)| before.get(id) != Some(counter))
            .map(|(id, _)| side(*id))
            .collect();
        sides.sort_unstable();
        sides.dedup();
        if sides.len() > 1 {
            self.reached.both_halves_planned += 1;
        }
    }

    /// A peer reports something, having adopted so many divisions in its present life.
    pub fn on_report(&mut self, now_ms: u64, id: u16, report: &Report, adoptions: u32) {
        if !self.twins.is_shared(report) {
            self.rules.on_report(
                now_ms,
                id,
                report,
                (adoptions, self.bounds.diameter, &self.listing),
                &self.handicaps,
                &mut self.found,
            );
        }
        match report {
            Report::Booted { incarnation } => {
                self.members.on_life(now_ms, id, *incarnation);
                self.progress.on_loss();
            }
            Report::Membership {
                peer,
                incarnation,
                status,
            } => {
                for other in self.twins.others(peer.0) {
                    self.members.on_another_meant(now_ms, id, other);
                }
                let joined_ms = self.stability.joined_since_ms(id, peer.0);
                self.members.on_belief(
                    now_ms,
                    (id, peer.0),
                    (*incarnation, *status),
                    (&self.bounds, &self.handicaps),
                    joined_ms,
                );
                if *status != Status::Suspect {
                    self.progress.on_loss();
                }
            }
            Report::Round { counter, .. } => {
                self.open_round.insert(id, *counter);
            }
            Report::Claim { counter, .. } => {
                if self.open_round.get(&id).is_some_and(|c| c <= counter) {
                    self.open_round.remove(&id);
                }
                self.adopted.insert(id, *counter);
            }
            Report::Covered { cells } => {
                self.progress.on_covered(id);
                self.record.on_covered(now_ms, id, cells);
            }
            Report::Ready {
                revision,
                loop_hash,
                ..
            } => {
                self.record.on_loop(id, *loop_hash);
                let first_ms = *self.ready_ms.entry(*revision).or_insert(now_ms);
                if *revision > 1 && now_ms > first_ms + self.period_ms {
                    self.reached.staggered_revision += 1;
                }
            }
            _ => {}
        }
    }

    /// A peer publishes bytes it wrote itself; `durable` is its disk, and of each cell
    /// whether a camera has seen it.
    pub fn on_said(
        &mut self,
        now_ms: u64,
        id: u16,
        said: &Said,
        bytes_hash: u64,
        durable: (&[Vec<u8>], &CellSet),
    ) {
        self.twins.on_said(id, said.record.incarnation);
        self.record
            .on_said(now_ms, id, said, bytes_hash, durable, &mut self.found);
        let seen = (self.loop_hash, durable.1);
        self.rules.on_said(now_ms, id, said, seen, &mut self.found);
    }

    /// A fault strikes: whoever is slow, or has a wrong clock or a broken disk, is late by
    /// no doing of its own.
    pub fn on_fault(&mut self, now_ms: u64, fault: &Fault) {
        self.handicaps.on_fault(now_ms, fault);
    }

    /// A peer puts bytes on the air, its own or another's.
    pub fn on_transmission(&mut self, now_ms: u64, id: u16, bytes: usize) {
        self.twins.on_transmission(now_ms, id, &mut self.found);
        self.rules
            .on_transmission(now_ms, id, bytes, &self.handicaps, &mut self.found);
    }

    /// A peer hands its airframe a setpoint, which that takes or not.
    pub fn on_setpoint(&mut self, now_ms: u64, id: u16, taken: bool) {
        self.twins.on_setpoint(now_ms, id, taken);
    }

    /// A peer publishes its own heartbeat.
    pub fn on_heartbeat(&mut self, now_ms: u64, id: u16, heartbeat: &Heartbeat) {
        self.rules.on_heartbeat(now_ms, id, heartbeat);
    }

    /// A peer publishes its own beacon while it believes this.
    pub fn on_beacon(&mut self, now_ms: u64, id: u16, said: &Said, view: &Beliefs) {
        self.rules
            .on_beacon(now_ms, id, said, view, &mut self.found);
    }

    /// A peer makes a bid durable while it believes this, at this place; it was told of so
    /// much fuel, seconds.
    pub fn on_bid(
        &mut self,
        now_ms: u64,
        id: u16,
        bid: &Bid,
        of: (&Beliefs, Option<(Point, f64)>),
    ) {
        self.rules
            .on_bid(now_ms, id, bid, of, &self.handicaps, &mut self.found);
    }

    /// A peer asks for a division, and gets it.
    pub fn on_divide(&mut self, now_ms: u64, id: u16, divided: (&[RingCell], &[Uav], &Division)) {
        self.rules.on_divide(now_ms, id, divided, &mut self.found);
    }

    /// A running peer receives a record: when it is handled, and when it arrived.
    pub fn on_received(&mut self, at_ms: (u64, u64), id: u16, said: &Said) {
        let life = self.members.life(id);
        if let Some(claim) = &said.claim {
            let r = &said.record;
            self.listing
                .on_heard((id, r.author), (r.incarnation, r.seq), claim);
        }
        if self.twins.is_silent(id) {
            self.rules.on_held(id, said);
        } else {
            self.rules.on_received(at_ms, (id, life), said);
        }
    }

    /// Two UAVs that keep apart by agreement came too close (S1).
    pub fn on_too_close(&mut self, approach: &Approach) {
        ProgressCheck::on_too_close(approach, &mut self.found);
    }

    /// An aircraft that is no member came too near, though there was time to make way (S13).
    pub fn on_intrusion(&mut self, intrusion: &Intrusion) {
        ProgressCheck::on_intrusion(intrusion, &mut self.found);
    }

    /// A UAV flew into an obstacle that is on no map, though it could turn away (S14).
    pub fn on_collision(&mut self, collision: &Collision) {
        ProgressCheck::on_collision(collision, &mut self.found);
    }

    /// A UAV flew into a zone.
    pub fn on_zone_entry(&mut self, time_ms: u64, id: u16, zone: usize) {
        ProgressCheck::on_zone_entry(time_ms, id, zone, &mut self.found);
    }

    /// The true graph at this moment. Returns whether a component changed.
    pub fn on_graph(&mut self, now_ms: u64, graph: Graph) -> bool {
        let window_ms = 10 * self.bounds.interval_ms;
        let members = &self.members;
        let changed = self
            .stability
            .observe(now_ms, &graph, |id| members.life(id), window_ms);
        self.graph = graph;
        changed
    }

    /// What was in the pictures of those who fly a mission that looks for something.
    pub fn on_detections(&mut self, now_ms: u64, truth: &[Truth], looks: &[Look]) {
        let around = Around {
            graph: &self.graph,
            stability: &self.stability,
            handicaps: &self.handicaps,
        };
        let detections = &mut self.rules.detections;
        detections.on_looks(now_ms, (truth, looks), around, &mut self.found);
    }

    /// Who flies along a contour, beside where it is.
    pub fn on_tracers(&mut self, now_ms: u64, contour: &Contour, all: &[Tracer]) {
        let (rules, found) = (&mut self.rules, &mut self.found);
        rules.on_tracers(now_ms, contour, all, &self.handicaps, found);
    }

    /// The true graph in the last snapshot.
    #[must_use]
    pub fn graph(&self) -> &Graph {
        &self.graph
    }

    /// Judges everybody's beliefs, once a beacon period: of those who may speak, and of those
    /// who are silent since a twin speaks.
    pub fn on_snapshot(
        &mut self,
        now_ms: u64,
        loss_permille: u16,
        (peers, silent): (&[PeerSnapshot], &[PeerSnapshot]),
        covered: &CellSet,
        loop_hash: u64,
    ) {
        self.note_interval(now_ms, peers);
        let held = peers.iter().map(|m| m.view.diameter).max().unwrap_or(1);
        self.bounds.diameter = u64::from(held.max(self.stability.diameter()));
        self.loop_hash = loop_hash;
        let snapshot = Snapshot {
            now_ms,
            loss_permille,
            bounds: self.bounds,
            graph: &self.graph,
            stability: &self.stability,
            handicaps: &self.handicaps,
            peers,
            covered,
            loop_hash,
        };
        let orphans = self.listing.orphans();
        self.members.on_snapshot(&snapshot, &mut self.found);
        self.listing
            .on_snapshot(&snapshot, &self.members, &mut self.found);
        if self.listing.orphans() > orphans {
            self.progress.on_loss();
        }
        self.record.on_snapshot(&snapshot, &mut self.found);
        self.rules.on_snapshot(&snapshot, &mut self.found);
        self.cover.on_snapshot(&snapshot, &mut self.found);
        let activity = &self.rules.activity;
        let stands_by = |m: &PeerSnapshot| activity.stands_by(m);
        self.progress
            .on_snapshot(&snapshot, &self.members, stands_by, &mut self.found);
        self.twins.on_snapshot(&snapshot, silent, &mut self.found);
        let steered = self.twins.steered(peers, silent);
        let (silent, steered) = (silent.iter().map(|m| m.id), &steered);
        self.rules
            .on_silent_home(&snapshot, (silent, steered), &mut self.found);
    }

    /// An interval counts for twenty of its own: what was announced is told for a while, and
    /// whoever fell silent is waited for in it.
    fn note_interval(&mut self, now_ms: u64, peers: &[PeerSnapshot]) {
        let speaking = peers.iter().filter(|m| m.view.speaks);
        let longest_ms = speaking.map(|m| m.view.interval_ms).max().unwrap_or(0);
        self.intervals.retain(|(t, ms)| t + 20 * ms >= now_ms);
        self.intervals
            .push((now_ms, longest_ms.max(self.period_ms)));
        let longest_ms = self.intervals.iter().map(|(_, ms)| *ms).max();
        self.bounds.interval_ms = longest_ms.unwrap_or(self.period_ms);
    }

    /// Judges how those who are finished get home, after all else is over.
    pub fn on_way_home(&mut self, now_ms: u64, peers: &[PeerSnapshot], covered: &CellSet) -> bool {
        let snapshot = Snapshot {
            now_ms,
            loss_permille: 0,
            bounds: self.bounds,
            graph: &self.graph,
            stability: &self.stability,
            handicaps: &self.handicaps,
            peers,
            covered,
            loop_hash: self.loop_hash,
        };
        self.rules.on_way_home(&snapshot, &mut self.found);
        self.rules.all_home(peers)
    }
}
