//! The world and its radio links, as a trial uses them.

use crate::verdict::{CoverageVerdict, Uncovered};
use skein_behaviors::{Percept, Setpoint};
use skein_link::LinkState;
use skein_netsim::fault::Fault;
use skein_netsim::radio::{LinkTable, Overlay};
use skein_netsim::spec::Spec;
use skein_netsim::world::{Fact, World};
use std::collections::BTreeMap;

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
    pub fn new(spec: &Spec, seed: u64) -> Self {
        let world = World::new(spec, seed);
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

    /// How often links went down, by reason.
    #[must_use]
    pub fn link_cuts(&self) -> BTreeMap<String, u64> {
        let (range, sight, fault) = self.links.cuts();
        let all = [("range", range), ("sight", sight), ("fault", fault)];
        all.into_iter()
            .map(|(reason, n)| (reason.to_owned(), n))
            .collect()
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

    /// Share of the coverable cells that were seen.
    #[must_use]
    pub fn covered_share(&self) -> f64 {
        self.world.judge().covered_share()
    }

    /// Whether all of them were.
    #[must_use]
    pub fn is_covered(&self) -> bool {
        self.world.judge().complete()
    }

    /// How often a UAV entered a no-fly zone.
    #[must_use]
    pub fn zone_entries(&self) -> usize {
        self.world.judge().entries()
    }

    /// The closest approach of two airborne UAVs, metres.
    #[must_use]
    pub fn separation_m(&self) -> Option<f64> {
        self.world.judge().closest().map(|a| a.distance_m)
    }

    /// What was seen and what cannot be, for the verdict.
    #[must_use]
    pub fn coverage(&self, needed_share: f64) -> CoverageVerdict {
        let judge = self.world.judge();
        let survey = judge.survey();
        let mut uncoverable: BTreeMap<String, usize> = BTreeMap::new();
        let mut uncoverable_cells = Vec::new();
        for cell in survey.cells() {
            if let Some(reason) = &cell.uncoverable {
                let reason = reason.to_string();
                *uncoverable.entry(reason.clone()).or_default() += 1;
                uncoverable_cells.push(Uncovered {
                    col: cell.id.col,
                    row: cell.id.row,
                    reason,
                });
            }
        }
        let missed = judge
            .sightings()
            .zip(survey.cells())
            .filter(|((_, seen), cell)| seen.is_none() && cell.uncoverable.is_none())
            .map(|((id, _), _)| (id.col, id.row))
            .collect();
        CoverageVerdict {
            covered: judge.n_covered(),
            coverable: survey.n_coverable(),
            cells: survey.cells().len(),
            coverable_share: survey.coverable_share(),
            needed_share,
            uncoverable,
            uncoverable_cells,
            missed,
        }
    }
}
