//! The world and the radio as the driver of a swarm uses them: airframes, links,
//! channel, judge, in milliseconds of scenario time.

use super::stream::{Concern, Stream};
use crate::check::Graph;
use crate::fault::Fault;
use crate::prepared::Prepared;
use crate::radio::{Channel, Delivery, Frame, LinkTable, Medium, Overlay, Tally};
use crate::spec::RadioSpec;
use crate::world::vehicles::Vehicles;
use crate::world::{Fact, Judge, Survey, World};
use skein_behaviors::{Percept, Setpoint};
use skein_flight::coverage::ring::CellId;
use skein_flight::coverage::ring::patch::Corners;
use skein_link::medium::Links;
use skein_peer::Call;
use skein_peer::offload::MissionGeometry;
use skein_peer::protocol::airtime::{FRAME_BYTES, OVERHEAD_BYTES, PART_BYTES};
use std::collections::BTreeSet;
use std::sync::Arc;

/// World, links and channel of one run.
#[derive(Debug)]
pub struct Air {
    world: World,
    links: LinkTable,
    overlay: Overlay,
    medium: Medium,
    radio: RadioSpec,
    /// A fault or a loss made the links stale.
    stale: bool,
}

impl Air {
    /// Everything at time 0.
    #[must_use]
    pub fn new(prepared: &Prepared, seed: u64) -> Self {
        let radio_seed = Stream::new(seed, Concern::Radio).any();
        let world = World::on(Arc::clone(&prepared.site), &prepared.spec, seed);
        let radio = prepared.spec.radio;
        Self {
            links: LinkTable::new(world.nodes(), radio),
            medium: Medium::new(
                world.nodes(),
                Channel {
                    rate_bps: radio.rate_bps,
                    overhead_bytes: OVERHEAD_BYTES,
                    part_bytes: PART_BYTES,
                    frame_bytes: FRAME_BYTES,
                    queue_age_ms: radio.queue_age_ms,
                },
                radio_seed,
            ),
            overlay: Overlay::default(),
            world,
            radio,
            stale: true,
        }
    }

    /// Moves everything on to a time.
    pub fn advance(&mut self, to_ms: u64) {
        self.world.advance(to_ms);
        self.refresh();
    }

    fn refresh(&mut self) {
        if std::mem::take(&mut self.stale) {
            self.links.compute(&self.world, &self.overlay);
        } else {
            self.links.refresh(&self.world, &self.overlay);
        }
    }

    /// What the world recorded since the last call.
    pub fn facts(&mut self) -> Vec<Fact> {
        self.world.take_facts()
    }

    /// What a UAV senses; nothing once its airframe is gone.
    #[must_use]
    pub fn percept(&self, id: u16) -> Option<Percept> {
        self.world.percept(id)
    }

    /// What a UAV knows of itself, without what it senses of others.
    #[must_use]
    pub fn own(&self, id: u16) -> Option<Percept> {
        self.world.own(id)
    }

    /// The vehicles on the ground, as they are.
    #[must_use]
    pub fn vehicles(&self) -> &Vehicles {
        self.world.vehicles()
    }

    /// Which of them are in the picture of a UAV.
    #[must_use]
    pub fn pictured(&self, id: u16) -> Vec<usize> {
        self.world.pictured(id).collect()
    }

    /// Hands a setpoint to an airframe; says whether it was taken.
    pub fn apply(&mut self, id: u16, setpoint: Setpoint) -> bool {
        self.world.apply(id, setpoint)
    }

    /// A computer starts, in a new airframe where the old one is gone.
    pub fn start(&mut self, id: u16) {
        self.world.respawn(id);
        self.stale = true;
    }

    /// A computer ends, and its airframe with it or not.
    pub fn stop(&mut self, id: u16, airframe: bool) {
        if airframe {
            self.world.kill(id);
        }
        self.world.set_computer(id, false);
        self.medium.silence(id);
        self.stale = true;
    }

    /// The fuel of a UAV lasts no longer than this from now on, milliseconds.
    pub fn limit_fuel(&mut self, id: u16, lasts_ms: u64) {
        self.world.limit_fuel(id, lasts_ms);
    }

    /// Some follow a mission with this geometry, and the newest is another one.
    pub fn follow_beside(&mut self, survey: Arc<Survey>, geometry: &MissionGeometry) {
        self.world.follow_beside(survey, geometry);
    }

    /// A revision of the mission is judged by from now on.
    pub fn revise(&mut self, survey: Arc<Survey>, geometry: &MissionGeometry) {
        self.world.revise(survey, geometry);
    }

    /// A task is to be seen since then, milliseconds, by one of these; asked twice it is asked once.
    pub fn ask(
        &mut self,
        task: (u16, u32),
        pieces: Vec<Corners>,
        carriers: BTreeSet<u16>,
        since_ms: u64,
    ) {
        self.world.ask(task, pieces, carriers, since_ms);
    }

    /// A UAV follows this revision of the mission.
    pub fn follows(&mut self, id: u16, revision: u32) {
        self.world.follows(id, revision);
    }

    /// Takes a fault that concerns the radio.
    pub fn strike(&mut self, fault: &Fault) {
        if self.overlay.apply(fault) {
            self.stale = true;
        }
    }

    /// The share of transmissions lost in force, thousandths.
    #[must_use]
    pub fn loss_permille(&self) -> u16 {
        self.overlay.loss_permille(&self.radio)
    }

    /// Puts a frame into a transmitter's queue.
    pub fn transmit(&mut self, now_ms: u64, id: u16, frame: Frame) {
        self.medium.submit(now_ms * 1000, id, frame);
    }

    /// When the channel wants [`Air::carry`] next: the first whole millisecond after it.
    #[must_use]
    pub fn next_ms(&self) -> Option<u64> {
        self.medium.next_event().map(|us| us.div_ceil(1000))
    }

    /// Lets the channel do what is due, and returns what got through.
    pub fn carry(&mut self, now_ms: u64) -> Vec<Delivery> {
        if self.stale {
            self.refresh();
        }
        self.medium.advance(now_ms * 1000, &self.links)
    }

    /// The true graph among some radios.
    pub fn graph(&mut self, ids: Vec<u16>) -> Graph {
        self.refresh();
        Graph::new(ids, |rx, tx| self.links.state(tx, rx).is_up())
    }

    /// Whether the judge saw a camera cover this cell of the mission with this revision, in
    /// that many laps.
    #[must_use]
    pub fn is_covered(&self, revision: u32, cell: CellId, laps: u16) -> bool {
        self.world.judge().saw(revision, cell, laps)
    }

    /// A mission ended by its time: nothing is to be seen after the last lap that is complete.
    /// Returns whether there is one.
    pub fn end_laps(&mut self) -> bool {
        self.world.end_laps()
    }

    /// The world, as far as it has moved.
    #[must_use]
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Who heard whom when that was computed last.
    #[must_use]
    pub fn links(&self) -> &LinkTable {
        &self.links
    }

    /// The ground station calls services on the ground; gives those calls that are served.
    pub fn dispatch(&mut self, calls: &[Call]) -> Vec<Call> {
        self.world.dispatch(calls)
    }

    /// The judge and its score.
    #[must_use]
    pub fn judge(&self) -> &Judge {
        self.world.judge()
    }

    /// How often links that were up went down: by range, by sight, by fault.
    #[must_use]
    pub fn link_cuts(&self) -> (u64, u64, u64) {
        self.links.cuts()
    }

    /// What all stations did to the channel, and what became of it.
    #[must_use]
    pub fn tally(&self) -> Tally {
        self.medium.total()
    }
}
