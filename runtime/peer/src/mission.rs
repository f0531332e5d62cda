//! What a mission is: area, zones, lanes, level, origin, revision.

use crate::buildings::Buildings;
use crate::count_site::{CountSite, SITES_MAX};
use crate::criteria::{CRITERIA_MAX, Criterion};
use crate::crowd::{CrowdWatch, ThenWatch};
use crate::diagram::{Diagram, DiagramError, Machine, check};
use crate::input::NewTask;
use crate::layers::Layers;
use crate::offload::MissionGeometry;
use crate::revision::FOUND_LAPS_MAX;
use crate::streets::Streets;
use crate::task::CoverageTask;
use crate::tasking::BROUGHT_MAX;
use serde::{Deserialize, Serialize};
use skein_behaviors::executive::promised::reach_m;
use skein_flight::coverage::lanes;
use skein_flight::coverage::passes::{self, PassesProblem};
use skein_flight::coverage::ring::division::Rule;
use skein_flight::coverage::ring::patch::Corners;
use skein_flight::coverage::ring::{CoverageLoop, LoopError, LoopProblem, Tree};
use skein_flight::coverage::stations::{self, StationsProblem};
use skein_flight::route::{RouteLimits, Router};
use skein_geometry::frame::Point;
use skein_geometry::{Polygon, PolygonError};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// A point in millimetres east and north of the mission's origin.
pub type PointMm = (i32, i32);

/// A coverage mission. Integers only, so that its bytes and its hash are the
/// same everywhere.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Mission {
    /// Latitude of the origin, 1e-7 degrees.
    pub origin_lat_e7: i32,
    /// Longitude of the origin, 1e-7 degrees.
    pub origin_lon_e7: i32,
    /// The area to be seen, a simple ring.
    pub area: Vec<PointMm>,
    /// No-fly zones at the lowest flight level, simple rings.
    pub zones: Vec<Vec<PointMm>>,
    /// Lane spacing, mm.
    pub lane_spacing_mm: u32,
    /// Smallest turn radius that every UAV of the mission can fly at its cruise airspeed, mm.
    pub turn_radius_mm: u32,
    /// Distance every curve keeps from the zones, mm.
    pub clearance_mm: u32,
    /// Half the camera footprint across the track at the lowest level, mm.
    pub footprint_across_mm: u32,
    /// Half the camera footprint along the track at the lowest level, mm.
    pub footprint_along_mm: u32,
    /// How far a UAV may stray from its curve, mm.
    pub tracking_error_mm: u32,
    /// A launch point, which must reach the loop.
    pub launch: PointMm,
    /// What is to be seen.
    #[serde(default, skip_serializing_if = "CoverageTask::is_area")]
    pub task: CoverageTask,
    /// Which spanning tree the lanes of an area follow: whoever makes the mission knows
    /// the wind and chooses.
    #[serde(default, skip_serializing_if = "Tree::is_default")]
    pub tree: Tree,
    /// By what rule the loop is divided.
    #[serde(default, skip_serializing_if = "Rule::is_default")]
    pub division: Rule,
    /// What any two UAVs keep between them by agreement, all at one height, mm; 0 where each
    /// has a height of its own.
    #[serde(default, skip_serializing_if = "is_default")]
    pub separation_mm: u32,
    /// The fastest cruise of the fleet, mm/s; of use with a separation alone.
    #[serde(default, skip_serializing_if = "is_default")]
    pub fastest_mmps: u32,
    /// What a UAV does in it when; [`Diagram::coverage`] where none is said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub diagram: Option<Arc<Diagram>>,
    /// What is looked for besides, and what follows when it is seen; at most [`CRITERIA_MAX`].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub detections: Vec<Criterion>,
    /// Tasks that begin with it, besides what is to be seen; at most [`BROUGHT_MAX`].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tasks: Vec<NewTask>,
    /// Where vehicles are counted; at most [`SITES_MAX`].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub counts: Vec<CountSite>,
    /// The streets whose use is measured, and by which ways are asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub streets: Option<Arc<Streets>>,
    /// At which heights its laps are flown; all at one where none are said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub layers: Option<Arc<Layers>>,
    /// The mass event that is watched.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crowd: Option<Arc<CrowdWatch>>,
    /// What may hide whom somebody follows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub buildings: Option<Arc<Buildings>>,
    /// Whether what UAVs find on no map becomes a zone of it ([`crate::found_obstacles`]): then the
    /// number of its revision has room for that.
    #[serde(default, skip_serializing_if = "core::ops::Not::not")]
    pub finds_obstacles: bool,
    // What an operator changes in flight stands last, so that most pieces of the next revision are
    // as they were (decision 139).
    /// Where UAVs loiter when all is done.
    pub base: PointMm,
    /// Which lap it is, from 0 (D2.7 §3.6.6: continuous coverage).
    #[serde(default, skip_serializing_if = "is_default")]
    pub lap: u16,
    /// How many more times everything is to be seen after this one.
    #[serde(default, skip_serializing_if = "is_default")]
    pub further_laps: u16,
    /// No-fly zones that the operator added in flight, by name, and those round what was found;
    /// besides `zones`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub added_zones: BTreeMap<String, Vec<PointMm>>,
    /// Counts the missions that the operator began anew: nothing that was covered in an
    /// earlier one counts.
    #[serde(default, skip_serializing_if = "is_default")]
    pub sortie: u16,
    /// Zones round what was found that the operator took out, by name.
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    pub dismissed: BTreeSet<String>,
    /// Whether the operator ended it: nothing is to be seen, and all fly home.
    #[serde(default, skip_serializing_if = "core::ops::Not::not")]
    pub cancelled: bool,
    /// Counts the operator's changes, the laps of a patrol and what was found; a later one
    /// replaces an earlier one.
    pub revision: u32,
}

/// Whether a field need not be said.
pub(crate) fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

fn metres(mm: u32) -> f64 {
    f64::from(mm) / 1000.0
}

/// Whole millimetres, the nearest; missions end at 20 km, and beyond what fits it
/// saturates.
#[must_use]
#[allow(
    clippy::cast_possible_truncation,
    reason = "casts from floats saturate; missions end at 20 km"
)]
pub fn mm(m: f64) -> i32 {
    (m * 1000.0).round() as i32
}

/// A point of the plane, in metres.
#[must_use]
pub fn point_m(p: PointMm) -> Point {
    Point::new(f64::from(p.0) / 1000.0, f64::from(p.1) / 1000.0)
}

/// A ring of the plane in whole millimetres.
#[must_use]
pub fn ring_mm(ring: &[Point]) -> Vec<PointMm> {
    ring.iter().map(|p| (mm(p.x), mm(p.y))).collect()
}

fn ring_m(ring: &[PointMm]) -> Vec<Point> {
    ring.iter().copied().map(point_m).collect()
}

/// Why a mission has no geometry. Nothing of it is flown.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GeometryError {
    /// The area is no simple polygon.
    #[error("area: {0}")]
    Area(PolygonError),
    /// A no-fly zone, by its index, is no simple polygon.
    #[error("zone {0}: {1}")]
    Zone(usize, PolygonError),
    /// A no-fly zone that the operator added, by its name, is no simple polygon.
    #[error("zone {0:?}: {1}")]
    AddedZone(String, PolygonError),
    /// A no-fly zone that somebody added has a name that no operator can give.
    #[error("a zone has a name that is none")]
    ZoneName,
    /// Its diagram cannot be flown, or does not fit what is to be seen.
    #[error("diagram: {0}")]
    Diagram(#[from] DiagramError),
    /// What it looks for is beyond what may be asked.
    #[error("detections: {0}")]
    Detections(String),
    /// Tasks that it brings cannot be asked for.
    #[error("tasks: {0}")]
    Tasks(String),
    /// A site at which it counts cannot be counted at.
    #[error("counts: {0}")]
    Counts(String),
    /// Its streets make no network, or a way that is asked for is not on them.
    #[error("streets.{0}: {1}")]
    Streets(String, String),
    /// Its layers cannot be flown.
    #[error("layers: {0}")]
    Layers(String),
    /// The event that it watches has no sectors that can be seen, or no norm.
    #[error("crowd.{0}: {1}")]
    Crowd(&'static str, String),
    /// It has more laps than its revisions can count.
    #[error("at most {FOUND_LAPS_MAX} laps are flown where obstacles are found")]
    Laps,
    /// Its buildings are too many, or one of them is none.
    #[error("buildings: {0}")]
    Buildings(String),
    /// There is no loop over what is to be seen.
    #[error(transparent)]
    Loop(#[from] LoopError),
}

/// The mission's lengths and places, in metres.
impl Mission {
    /// The area to be seen.
    #[must_use]
    pub fn area_m(&self) -> Vec<Point> {
        ring_m(&self.area)
    }

    /// The no-fly zones, those that the operator added last, by name.
    pub fn zones_m(&self) -> impl Iterator<Item = Vec<Point>> + '_ {
        let all = self.zones.iter().chain(self.added_zones.values());
        all.map(|zone| ring_m(zone))
    }

    /// Lane spacing.
    #[must_use]
    pub fn lane_m(&self) -> f64 {
        metres(self.lane_spacing_mm)
    }

    /// Smallest turn radius that every UAV of the mission can fly at its cruise airspeed.
    #[must_use]
    pub fn turn_radius_m(&self) -> f64 {
        metres(self.turn_radius_mm)
    }

    /// Distance every curve keeps from the zones.
    #[must_use]
    pub fn clearance_m(&self) -> f64 {
        metres(self.clearance_mm)
    }

    /// Half the camera footprint across the track at the lowest level.
    #[must_use]
    pub fn footprint_across_m(&self) -> f64 {
        metres(self.footprint_across_mm)
    }

    /// Half the camera footprint along the track at the lowest level.
    #[must_use]
    pub fn footprint_along_m(&self) -> f64 {
        metres(self.footprint_along_mm)
    }

    /// How far a UAV may stray from its curve.
    #[must_use]
    pub fn tracking_error_m(&self) -> f64 {
        metres(self.tracking_error_mm)
    }

    /// What any two UAVs keep between them by agreement; 0 where heights keep them apart.
    #[must_use]
    pub fn separation_m(&self) -> f64 {
        metres(self.separation_mm)
    }

    /// The fastest cruise of the fleet, m/s.
    #[must_use]
    pub fn fastest_mps(&self) -> f64 {
        metres(self.fastest_mmps)
    }

    /// How far UAVs have to sense each other to keep apart by agreement: two that are farther
    /// apart do not meet on what either may have promised.
    #[must_use]
    pub fn least_traffic_range_m(&self) -> f64 {
        let reach_m = reach_m(self.fastest_mps(), self.turn_radius_m());
        2.0 * reach_m + self.separation_m() + 2.0 * self.tracking_error_m()
    }

    /// A launch point, which must reach the loop.
    #[must_use]
    pub fn launch_m(&self) -> Point {
        point_m(self.launch)
    }

    /// Where UAVs loiter when all is done.
    #[must_use]
    pub fn base_m(&self) -> Point {
        point_m(self.base)
    }
}

impl Mission {
    /// Identifies the content: FNV-1a over all fields in order.
    #[must_use]
    pub fn content_hash(&self) -> u64 {
        let mut h = skein_geometry::hash::Fnv::new();
        for v in [self.origin_lat_e7, self.origin_lon_e7] {
            h.write_i64(i64::from(v));
        }
        h.write_i64(i64::from(self.revision));
        let ring = |h: &mut skein_geometry::hash::Fnv, r: &[PointMm]| {
            h.write_i64(i64::try_from(r.len()).unwrap_or(i64::MAX));
            for p in r {
                h.write_i64(i64::from(p.0));
                h.write_i64(i64::from(p.1));
            }
        };
        ring(&mut h, &self.area);
        h.write_i64(i64::try_from(self.zones.len()).unwrap_or(i64::MAX));
        for z in &self.zones {
            ring(&mut h, z);
        }
        for v in [
            self.lane_spacing_mm,
            self.turn_radius_mm,
            self.clearance_mm,
            self.footprint_across_mm,
            self.footprint_along_mm,
            self.tracking_error_mm,
        ] {
            h.write_i64(i64::from(v));
        }
        ring(&mut h, &[self.launch, self.base]);
        self.task.hash(&mut h);
        if !self.tree.is_default() {
            for letter in self.tree.name().bytes() {
                h.write_i64(i64::from(letter));
            }
        }
        if !self.division.is_default() {
            h.write_i64(1);
        }
        if self.separation_mm > 0 {
            h.write_i64(i64::from(self.separation_mm));
            h.write_i64(i64::from(self.fastest_mmps));
        }
        if self.is_patrol() {
            h.write_i64(i64::from(self.lap));
            h.write_i64(i64::from(self.further_laps));
        }
        self.hash_operated(&mut h);
        if let Some(diagram) = &self.diagram {
            diagram.hash(&mut h);
        }
        if !self.detections.is_empty() {
            h.write_i64(-5);
            self.detections.iter().for_each(|c| c.hash(&mut h));
        }
        self.hash_brought(&mut h);
        if !self.counts.is_empty() {
            h.write_i64(-7);
            self.counts.iter().for_each(|s| s.hash(&mut h));
        }
        if let Some(streets) = &self.streets {
            h.write_i64(-8);
            streets.hash(&mut h);
        }
        if let Some(layers) = &self.layers {
            h.write_i64(-9);
            layers.hash(&mut h);
        }
        if let Some(crowd) = &self.crowd {
            h.write_i64(-10);
            crowd.hash(&mut h);
        }
        if let Some(buildings) = &self.buildings {
            h.write_i64(-12);
            buildings.hash(&mut h);
        }
        if self.finds_obstacles {
            h.write_i64(-14);
        }
        h.finish()
    }

    /// Whether everything is to be seen more than once.
    #[must_use]
    pub fn is_patrol(&self) -> bool {
        self.lap > 0 || self.further_laps > 0
    }

    /// The pieces that have to be seen, each by one frame; none where the mission asks
    /// for the cells of its area. Lines are cut to the lane spacing at most.
    #[must_use]
    pub fn pieces(&self) -> Option<Vec<Corners>> {
        let targets = self.task.targets()?;
        Some(targets.pieces(self.lane_m()))
    }

    /// The diagram that is obeyed.
    #[must_use]
    pub fn flown_by(&self) -> Cow<'_, Diagram> {
        match &self.diagram {
            Some(diagram) => Cow::Borrowed(diagram.as_ref()),
            None => Cow::Owned(Diagram::coverage()),
        }
    }

    /// The same, checked and ready.
    ///
    /// # Errors
    /// [`DiagramError`] where it cannot be flown, or asks for something else than the mission.
    pub fn machine(&self) -> Result<Machine, DiagramError> {
        let diagram = self.flown_by();
        if self.diagram.is_some() {
            let (again, apart) = (self.sees_again(), self.separation_mm > 0);
            check::fits(&diagram, self.dimension(), again, apart)?;
        }
        Machine::new(&diagram)
    }

    /// After how many seconds it ends, whatever was seen; none where it ends by what was seen
    /// alone.
    #[must_use]
    pub fn ends_after_s(&self) -> Option<u32> {
        self.machine().ok().and_then(|m| m.ends_after_s())
    }

    /// Whether a contour is flown along once everything is seen.
    #[must_use]
    pub fn traces(&self) -> bool {
        self.machine().is_ok_and(|m| m.traces())
    }

    /// Whether the loop is flown round and round once everything is seen.
    #[must_use]
    pub fn goes_round(&self) -> bool {
        self.machine().is_ok_and(|m| m.goes_round())
    }

    /// Whether it ends when something that it looks for was told, whatever is left to be seen.
    #[must_use]
    pub fn ends_when_found(&self) -> bool {
        self.machine().is_ok_and(|m| m.ends_when_found())
    }

    /// Whether what it looks for may be asked.
    ///
    /// # Errors
    /// [`GeometryError::Detections`] names the criterion and what is wrong.
    pub fn check_detections(&self) -> Result<(), GeometryError> {
        if self.detections.len() > CRITERIA_MAX {
            let text = format!("at most {CRITERIA_MAX} criteria fit");
            return Err(GeometryError::Detections(text));
        }
        let wrong = self.detections.iter().enumerate();
        let wrong = wrong.filter_map(|(i, c)| Some((i, c.check().err()?)));
        match wrong.into_iter().next() {
            Some((i, (field, text))) => {
                Err(GeometryError::Detections(format!("[{i}].{field}: {text}")))
            }
            None => Ok(()),
        }
    }

    /// Whether vehicles can be counted at its sites.
    ///
    /// # Errors
    /// [`GeometryError::Counts`] names the site and what is wrong.
    pub fn check_counts(&self) -> Result<(), GeometryError> {
        if self.counts.len() > SITES_MAX {
            let text = format!("at most {SITES_MAX} sites fit");
            return Err(GeometryError::Counts(text));
        }
        let half_mm = self.footprint_across_mm.min(self.footprint_along_mm);
        let reach_m = crate::counting::INNER * metres(half_mm);
        for (i, site) in self.counts.iter().enumerate() {
            if let Err((field, text)) = site.check(reach_m) {
                return Err(GeometryError::Counts(format!("[{i}].{field}: {text}")));
            }
        }
        Ok(())
    }

    /// Whether its streets make a network.
    ///
    /// # Errors
    /// [`GeometryError::Streets`] names the place in them and what is wrong.
    pub fn check_streets(&self) -> Result<(), GeometryError> {
        let checked = self.streets.as_ref().map_or(Ok(()), |s| s.check());
        checked.map_err(|(place, text)| GeometryError::Streets(place, text))
    }

    /// Whether its buildings fit.
    ///
    /// # Errors
    /// [`GeometryError::Buildings`] names the building and what is wrong.
    pub fn check_buildings(&self) -> Result<(), GeometryError> {
        let checked = self.buildings.as_ref().map_or(Ok(()), |b| b.check());
        checked.map_err(GeometryError::Buildings)
    }

    /// Whether the event that it watches can be seen, sector by sector.
    ///
    /// # Errors
    /// [`GeometryError::Crowd`] names the field and what is wrong.
    pub fn check_crowd(&self) -> Result<(), GeometryError> {
        let Some(crowd) = &self.crowd else {
            return Ok(());
        };
        let wrong = |(field, text)| GeometryError::Crowd(field, text);
        crowd.check().map_err(wrong)?;
        if crowd.then == ThenWatch::Circle {
            let refused = |text: &str| Err(GeometryError::Crowd("then", text.to_owned()));
            if self.separation_mm > 0 {
                return refused(
                    "is \"circle\", and no tasks are flown where UAVs are kept apart by agreement: expected \"notify\", or heights of their own",
                );
            }
            if !self.machine()?.relays() {
                return refused(
                    "is \"circle\", and no state of the diagram has the goal \"relay\": expected one, or \"notify\"",
                );
            }
        }
        let area = Polygon::new(self.area_m()).map_err(GeometryError::Area)?;
        let half_mm = self.footprint_across_mm.min(self.footprint_along_mm);
        let overlap_m = if self.task.is_area() {
            2.0 * metres(self.footprint_across_mm) - self.lane_m()
        } else {
            let text =
                "is watched by missions that cover an area: nobody flies past all of it else";
            return Err(GeometryError::Crowd("area", text.to_owned()));
        };
        let checked = crowd.check_seen(&area, metres(half_mm), overlap_m);
        checked.map_err(wrong)
    }

    /// Derives the loop and the router.
    ///
    /// # Errors
    /// [`GeometryError`] names what is wrong with the mission.
    pub fn geometry(self: &Arc<Self>) -> Result<Arc<MissionGeometry>, GeometryError> {
        self.machine()?;
        self.check_detections()?;
        self.check_counts()?;
        self.check_streets()?;
        self.check_layers().map_err(GeometryError::Layers)?;
        self.check_crowd()?;
        self.check_buildings()?;
        if self.finds_obstacles && self.lap.saturating_add(self.further_laps) >= FOUND_LAPS_MAX {
            return Err(GeometryError::Laps);
        }
        if self.tasks.len() > BROUGHT_MAX || self.brought(false).len() < self.tasks.len() {
            let text = format!("at most {BROUGHT_MAX} fit, each as an operator may ask for it");
            return Err(GeometryError::Tasks(text));
        }
        let zones = self.no_fly_zones()?;
        let problem = self.loop_problem(&zones)?;
        let coverage_loop = self.the_loop(&problem)?;
        let limits = RouteLimits {
            turn_radius_m: problem.turn_radius_m,
            clearance_m: problem.clearance_m,
        };
        let router = Router::new(zones, limits);
        let coverage_loop = coverage_loop.of_lap(self.lap).of_sortie(self.sortie);
        let coverage_loop = coverage_loop.of_edit(self.edit());
        let heights = self.layers.as_ref().map_or(0, |l| l.bits());
        let coverage_loop = coverage_loop.of_heights(heights);
        let geometry = MissionGeometry::new(Arc::clone(self), coverage_loop, router);
        Ok(Arc::new(geometry))
    }

    /// Zones, lengths and launch point by which ways of this mission are planned.
    ///
    /// # Errors
    /// Where its area is no simple polygon.
    pub fn loop_problem(
        &self,
        zones: &Arc<skein_geometry::NoFlyZones>,
    ) -> Result<LoopProblem, GeometryError> {
        Ok(LoopProblem {
            area: Polygon::new(self.area_m()).map_err(GeometryError::Area)?,
            zones: Arc::clone(zones),
            lane_spacing_m: self.lane_m(),
            turn_radius_m: self.turn_radius_m(),
            clearance_m: self.clearance_m(),
            footprint_across_m: self.footprint_across_m(),
            footprint_along_m: self.footprint_along_m(),
            tracking_error_m: self.tracking_error_m(),
            launch: self.launch_m(),
            tree: self.tree,
        })
    }

    fn the_loop(&self, problem: &LoopProblem) -> Result<CoverageLoop, LoopError> {
        if self.task.is_area() {
            return lanes::build(problem);
        }
        let stations = if let Some(targets) = self.task.targets() {
            StationsProblem::of_targets(problem, &targets)
        } else {
            let passes = passes::plan(&PassesProblem {
                zones: Arc::clone(&problem.zones),
                clearance_m: problem.clearance_m,
                // What the camera sees beyond the ends of a pass is left for the turns.
                look_ahead_m: 0.0,
                ..PassesProblem::new(
                    problem.area.clone(),
                    problem.lane_spacing_m,
                    problem.turn_radius_m,
                    problem.launch,
                )
            })?
            .passes;
            StationsProblem::of_passes(problem, &passes)
        };
        stations::build(&stations)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::library::{Library, chunks};
    use crate::task::PointTask;

    fn mission(revision: u32, vertices: i32) -> Mission {
        Mission {
            revision,
            origin_lat_e7: 601_655_000,
            origin_lon_e7: 249_355_000,
            area: (0..vertices).map(|i| (i * 1000, i * i)).collect(),
            zones: vec![vec![(1, 2), (3, 4), (5, 9)]],
            lane_spacing_mm: 48_000,
            turn_radius_mm: 23_000,
            clearance_mm: 8_000,
            footprint_across_mm: 46_000,
            footprint_along_mm: 36_000,
            tracking_error_mm: 2_000,
            launch: (0, 0),
            base: (0, 0),
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

    #[test]
    fn laps_follow_each_other_and_end() {
        let mut m = mission(1, 4);
        m.further_laps = 2;
        let second = m.next_lap().unwrap();
        assert_eq!(
            (second.revision, second.lap, second.further_laps),
            (2, 1, 1)
        );
        assert_ne!(second.content_hash(), m.content_hash());
        assert_ne!(m.content_hash(), mission(1, 4).content_hash());
        assert_eq!(second.next_lap().unwrap().next_lap(), None);
        let third = second.next_lap();
        assert_eq!(m.later_lap(m.revision + 2), third);
        for none in [0, m.revision, m.revision + 3, u32::MAX] {
            assert_eq!(m.later_lap(none), None);
        }
        let pieces = chunks(&second).unwrap();
        let mut library = Library::new(Some(Arc::new(m)));
        for (i, piece) in (0u16..).zip(&pieces) {
            library.chunk(i, piece).unwrap();
        }
        assert_eq!(*library.newest().unwrap(), second);
    }

    /// What is said of a lap stays on the air; when an operator closes a zone and opens it
    /// again, laps that were flown before may be flown once more.
    #[test]
    fn a_lap_that_is_begun_again_after_changes_has_another_loop() {
        let mut m = crate::testing::mission(1, 6, 4);
        m.further_laps = 4;
        let hash = |m: &Mission| Arc::new(m.clone()).geometry().unwrap().coverage_loop.hash();
        let again = Mission {
            revision: m.revision_after(m.revision + 2),
            ..m.clone()
        };
        let flown = |m: &Mission| -> Vec<u64> {
            let later = (0..4).map(|n| m.later_lap(m.revision + 1 + n).unwrap());
            later.chain([m.clone()]).map(|m| hash(&m)).collect()
        };
        let (before, after) = (flown(&m), flown(&again));
        assert!(after.iter().all(|h| !before.contains(h)));
        // The other laps of one mission are told apart by what each derives of the other.
        let geometry = Arc::new(again.clone()).geometry().unwrap();
        assert_eq!(geometry.coverage_loop.hash_in_lap(0, 1), after[0]);
    }

    #[test]
    fn the_last_lap_is_another_mission_than_one_flown_once() {
        let once = mission(1, 4);
        let last = Mission {
            lap: 2,
            ..once.clone()
        };
        assert_ne!(last.content_hash(), once.content_hash());
    }

    #[test]
    fn exact_passes_keep_clear_of_the_zones() {
        let square = |low: i32, high: i32| vec![(low, low), (high, low), (high, high), (low, high)];
        let cells = |zones: Vec<Vec<PointMm>>, clearance_mm: u32| {
            let of = Mission {
                area: square(0, 600_000),
                zones,
                clearance_mm,
                task: CoverageTask::Exact,
                launch: (-30_000, -30_000),
                ..mission(1, 4)
            };
            let geometry = Arc::new(of).geometry().unwrap();
            let coverage_loop = &geometry.coverage_loop;
            let needed = coverage_loop.cells().iter().filter(|c| c.needed);
            needed
                .map(|c| coverage_loop.patches().corners(c.id).unwrap())
                .collect::<Vec<_>>()
        };
        let middle = |corners: &[Point; 4]| {
            corners
                .iter()
                .fold((0.0, 0.0), |(x, y), p| (x + p.x / 4.0, y + p.y / 4.0))
        };
        let deep = |corners: &&[Point; 4]| {
            let (x, y) = middle(corners);
            (230.0..370.0).contains(&x) && (230.0..370.0).contains(&y)
        };
        assert!(cells(Vec::new(), 8_000).iter().filter(deep).count() > 0);
        let around = cells(vec![square(200_000, 400_000)], 8_000);
        assert_eq!(around.iter().filter(deep).count(), 0);
        let farther = cells(vec![square(200_000, 400_000)], 60_000);
        assert!(!farther.is_empty() && farther.len() < around.len());
    }

    fn points(n: i32) -> CoverageTask {
        let point = |i| PointTask {
            at: (i * 1000, i),
            radius_mm: 20_000,
        };
        CoverageTask::Points((0..n).map(point).collect())
    }

    /// A site at which vehicles are counted.
    fn crossing(east_mm: i32) -> CountSite {
        CountSite {
            name: "crossing".to_owned(),
            what: crate::count_site::Counted::Passing,
            ring: vec![(east_mm, 0), (20_000, 0), (0, 20_000)],
            capacity: 0,
        }
    }

    /// A vehicle near a place that the mission asks to be followed.
    fn escort(east_mm: i32) -> NewTask {
        NewTask {
            name: Some("escort".into()),
            kind: crate::wire::tasks::TaskKind::Track,
            places: vec![(east_mm, 0)],
            radius_mm: 0,
            worth: 100,
            within_ms: None,
            sensor: 0,
        }
    }

    #[test]
    fn missions_that_differ_in_anything_differ_in_their_hash() {
        let changes: [fn(&mut Mission); 54] = [
            |_| {},
            |m| m.revision = 2,
            |m| m.origin_lat_e7 += 1,
            |m| m.origin_lon_e7 += 1,
            |m| m.area[0].0 += 1,
            |m| m.area[3].1 += 1,
            |m| m.zones.clear(),
            |m| m.zones[0][2].0 += 1,
            |m| m.lane_spacing_mm += 1,
            |m| m.turn_radius_mm += 1,
            |m| m.clearance_mm += 1,
            |m| m.footprint_across_mm += 1,
            |m| m.footprint_along_mm += 1,
            |m| m.tracking_error_mm += 1,
            |m| m.launch.1 += 1,
            |m| m.base.0 += 1,
            |m| m.task = CoverageTask::Exact,
            |m| m.task = points(3),
            |m| m.task = points(4),
            |m| m.tree = Tree::East,
            |m| m.tree = Tree::North,
            |m| m.tree = Tree::DepthFirst,
            |m| m.division = Rule::Backtracking,
            |m| m.lap = 1,
            |m| m.further_laps = 1,
            |m| (m.lap, m.further_laps) = (1, 1),
            |m| m.sortie = 1,
            |m| m.cancelled = true,
            |m| (m.sortie, m.cancelled) = (1, true),
            |m| m.detections.push(Criterion::default()),
            |m| {
                let looks = Some(1);
                let car = Criterion {
                    looks,
                    ..Criterion::default()
                };
                m.detections.push(car);
            },
            |m| {
                let red = Criterion {
                    looks: Some(1),
                    colour: Some(4),
                    ..Criterion::default()
                };
                m.detections.push(red);
            },
            |m| m.tasks.push(escort(0)),
            |m| m.tasks.push(escort(1)),
            |m| m.streets = Some(Arc::new(crate::streets::tests::block())),
            |m| {
                let mut streets = crate::streets::tests::block();
                streets.asked.clear();
                m.streets = Some(Arc::new(streets));
            },
            |m| {
                let mut streets = crate::streets::tests::block();
                streets.ways[0].places[1].0 += 1;
                m.streets = Some(Arc::new(streets));
            },
            |m| {
                let mut streets = crate::streets::tests::block();
                streets.unmeasured = true;
                m.streets = Some(Arc::new(streets));
            },
            |m| m.layers = Some(Arc::new(crate::layers::tests::three())),
            |m| {
                let mut layers = crate::layers::tests::three();
                layers.heights_mm[2] += 1;
                m.layers = Some(Arc::new(layers));
            },
            |m| {
                let mut layers = crate::layers::tests::three();
                layers.slots += 1;
                m.layers = Some(Arc::new(layers));
            },
            |m| m.crowd = Some(Arc::new(crate::crowd::tests::event())),
            |m| {
                let mut crowd = crate::crowd::tests::event();
                crowd.dense_e2 += 1;
                m.crowd = Some(Arc::new(crowd));
            },
            |m| {
                let mut crowd = crate::crowd::tests::event();
                crowd.then = crate::crowd::ThenWatch::Circle;
                m.crowd = Some(Arc::new(crowd));
            },
            |m| {
                let mut crowd = crate::crowd::tests::event();
                (crowd.then, crowd.circles_max) = (crate::crowd::ThenWatch::Circle, 2);
                m.crowd = Some(Arc::new(crowd));
            },
            |m| m.buildings = Some(Arc::new(crate::buildings::tests::houses(1))),
            |m| {
                let mut houses = crate::buildings::tests::houses(1);
                houses.all[0].roof_dm += 1;
                m.buildings = Some(Arc::new(houses));
            },
            |m| {
                let mut houses = crate::buildings::tests::houses(1);
                houses.all[0].ring[2].1 += 1;
                m.buildings = Some(Arc::new(houses));
            },
            |m| m.counts.push(crossing(0)),
            |m| m.counts.push(crossing(1)),
            |m| {
                m.counts.push(CountSite {
                    what: crate::count_site::Counted::Standing,
                    ..crossing(0)
                });
            },
            |m| {
                drop(
                    m.added_zones
                        .insert("a".into(), vec![(1, 2), (3, 4), (5, 9)]),
                )
            },
            |m| {
                drop(
                    m.added_zones
                        .insert("b".into(), vec![(1, 2), (3, 4), (5, 9)]),
                )
            },
            |m| {
                drop(
                    m.added_zones
                        .insert("a".into(), vec![(1, 2), (3, 4), (5, 8)]),
                )
            },
        ];
        let hashes = changes.map(|change| {
            let mut m = mission(1, 4);
            change(&mut m);
            m.content_hash()
        });
        let distinct: std::collections::BTreeSet<u64> = hashes.into();
        assert_eq!(distinct.len(), hashes.len());
        // They are on the wire: other numbers are another version of the format.
        let told = [0, 16, 17, 19, 22, 23].map(|i: usize| hashes[i]);
        let wanted = [
            0x3118_f901_789b_4735,
            0xe3d4_aab3_0603_c9f6,
            0xd0f1_aeca_70e1_2c6e,
            0x36c3_1d75_0f36_17d6,
            0xa5df_1ca0_f025_35b4,
            0xcb80_ac53_e15d_f434,
        ];
        assert_eq!(told, wanted);
    }

    #[test]
    fn a_mission_without_laps_says_nothing_of_them_and_one_of_points_has_a_piece_each() {
        let bytes = |m: &Mission| -> Vec<u8> {
            let pieces = chunks(m).unwrap();
            pieces.into_iter().flat_map(|p| p.bytes).collect()
        };
        let tells = |m: &Mission| bytes(m).windows(3).any(|w| w == b"lap");
        let once = mission(1, 4);
        let patrol = Mission {
            further_laps: 2,
            ..once.clone()
        };
        assert!(!tells(&once) && tells(&patrol));
        assert_eq!(once.pieces(), None);
        let of_points = Mission {
            task: points(5),
            ..once
        };
        assert_eq!(of_points.pieces().map(|p| p.len()), Some(5));
    }
}
