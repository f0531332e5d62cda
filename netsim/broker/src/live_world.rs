//! The simulated world around live peers: airframes, radio links, the judge.

use skein_behaviors::{Percept, Setpoint};
use skein_link::medium::Links as _;
use skein_link::{Hearing, LinkState};
use skein_netsim::fault::Fault;
use skein_netsim::radio::{LinkTable, Overlay};
use skein_netsim::spec::Spec;
use skein_netsim::witnessed::AskedLook;
use skein_netsim::world::intruders::Intruders;
use skein_netsim::world::unmapped::Unmapped;
use skein_netsim::world::{Fact, Judge, Site, Survey, World};
use skein_peer::Call;
use skein_peer::offload::MissionGeometry;
use std::sync::Arc;

/// A task is heard of so late at most, milliseconds: a ground station tells what it knows every
/// two seconds, and a busy machine passes that on when it can.
const TOLD_LATE_MS: u64 = 10_000;

/// The world of one trial.
#[derive(Debug)]
pub struct LiveWorld {
    world: World,
    links: LinkTable,
    faults: Overlay,
}

impl LiveWorld {
    /// The world of a scenario, before anybody moved.
    #[must_use]
    pub fn new(spec: &Spec, geometry: &MissionGeometry, seed: u64) -> Self {
        let site = Arc::new(Site::new(spec, Some(geometry)));
        let mut world = World::on(site, spec, seed);
        world.keep_looks(TOLD_LATE_MS);
        let mut links = LinkTable::new(world.nodes(), spec.radio);
        let faults = Overlay::default();
        links.compute(&world, &faults);
        Self {
            world,
            links,
            faults,
        }
    }

    /// Gives an airframe a setpoint.
    pub fn apply(&mut self, uav: u16, setpoint: Setpoint) {
        if !self.world.apply(uav, setpoint) {
            tracing::debug!(uav, "a setpoint was not taken");
        }
    }

    /// Moves everything on; gives what happened.
    pub fn advance(&mut self, to_ms: u64) -> Vec<Fact> {
        self.world.advance(to_ms);
        self.links.refresh(&self.world, &self.faults);
        self.world.take_facts()
    }

    /// What a UAV senses; nothing once it is lost.
    #[must_use]
    pub fn percept(&self, uav: u16) -> Option<Percept> {
        self.world.percept(uav)
    }

    /// The true link from `tx` to `rx`, faults included.
    #[must_use]
    pub fn link(&self, tx: u16, rx: u16) -> LinkState {
        self.links.state(tx, rx)
    }

    /// Who of these stations hears whom; ascending.
    #[must_use]
    pub fn hearing(&self, stations: Vec<u16>) -> Hearing {
        Hearing::of(stations, |tx, rx| self.links.state(tx, rx).is_up())
    }

    /// The components of the true link graph of the peers that `counts` accepts.
    #[must_use]
    pub fn components(&self, counts: impl Fn(u16) -> bool) -> Vec<Vec<u16>> {
        self.links.components(counts)
    }

    /// The hop diameter of the same graph, at least 1.
    #[must_use]
    pub fn diameter(&self, counts: impl Fn(u16) -> bool) -> u16 {
        self.links.diameter(counts).max(1)
    }

    /// How often links that were up went down: by range, by sight, by fault.
    #[must_use]
    pub fn link_cuts(&self) -> (u64, u64, u64) {
        self.links.cuts()
    }

    /// Takes a fault of links.
    pub fn fault(&mut self, fault: &Fault) {
        self.faults.apply(fault);
        self.links.compute(&self.world, &self.faults);
    }

    /// An airframe is gone.
    pub fn remove(&mut self, uav: u16) {
        self.world.kill(uav);
        self.links.compute(&self.world, &self.faults);
    }

    /// A computer stops working, or works again.
    pub fn set_computer(&mut self, uav: u16, works: bool) {
        self.world.set_computer(uav, works);
        self.links.compute(&self.world, &self.faults);
    }

    /// A new airframe at the launch point, where the old one is gone.
    pub fn relaunch(&mut self, uav: u16) {
        self.world.respawn(uav);
        self.links.compute(&self.world, &self.faults);
    }

    /// A mission ended by its time; see [`World::end_laps`].
    pub fn end_laps(&mut self) -> bool {
        self.world.end_laps()
    }

    /// Somebody asked for a look then, milliseconds, of which the trial hears now.
    pub fn ask(&mut self, look: AskedLook, since_ms: u64) {
        self.world
            .ask(look.task, look.pieces, look.carriers, since_ms);
    }

    /// The ground station calls services on the ground; gives those calls that are served.
    pub fn dispatch(&mut self, calls: &[Call]) -> Vec<Call> {
        self.world.dispatch(calls)
    }

    /// A revision of the mission is judged by from now on.
    pub fn revise(&mut self, survey: Arc<Survey>, geometry: &MissionGeometry) {
        self.world.revise(survey, geometry);
    }

    /// The computer of a UAV follows this revision of the mission.
    pub fn follows(&mut self, uav: u16, revision: u32) {
        self.world.follows(uav, revision);
    }

    /// The world itself.
    #[must_use]
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Who hears whom.
    #[must_use]
    pub fn links(&self) -> &LinkTable {
        &self.links
    }

    /// Aircraft that are no members.
    #[must_use]
    pub fn intruders(&self) -> &Intruders {
        self.world.intruders()
    }

    /// Obstacles that are on no map.
    #[must_use]
    pub fn unmapped(&self) -> &Unmapped {
        self.world.unmapped()
    }

    /// What was seen and what went wrong.
    #[must_use]
    pub fn judge(&self) -> &Judge {
        self.world.judge()
    }
}
