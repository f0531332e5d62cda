//! What a mission is expected to take before it is flown, told the same way for each
//! planner of an area (D2.7 §3.6.1 exact, §3.6.2 approximate): time, what is seen, energy.
//!
//! Leaves to others: laying the loop, and what is worth a warning (`feasibility`).

use crate::feasibility::Summary;
use crate::flight_model::loop_energy_s;
use crate::request::AreaPlanner;
use skein_flight::airframe::Airframe;
use skein_geometry::Polygon;
use skein_geometry::frame::Point;
use skein_netsim::spec::Spec;
use skein_peer::offload::MissionGeometry;

/// Samples along one lane: a point in 36 of a cell decides a tenth of a percent of a
/// field of 28 cells.
const SAMPLES_A_LANE: f64 = 6.0;

/// Most samples along one side of the area, against missions of absurd proportions.
const MAX_SAMPLES: f64 = 4000.0;

/// What a planner is expected to make of an area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// The planner.
    pub planner: AreaPlanner,
    /// Time to cover without any failure, by the swarm's own division, seconds.
    pub makespan_s: f64,
    /// Share of the area that is seen, 0 to 1, by points a sixth of a lane apart.
    pub seen_share: f64,
    /// Length of the loop, metres.
    pub loop_m: f64,
    /// Energy to fly the loop once, in seconds of level cruise, averaged over the fleet;
    /// `None` where the wind forbids a part of it.
    pub energy_s: Option<f64>,
}

/// The forecast of a mission over an area; `None` for points and lines.
pub(crate) fn forecast(
    spec: &Spec,
    geometry: &MissionGeometry,
    total: &Summary,
) -> Option<Forecast> {
    let planner = AreaPlanner::of(&spec.mission.task)?;
    let airframes: Vec<Airframe> = spec.uavs.iter().map(|u| u.airframe).collect();
    let radius_m = spec.mission.turn_radius_m();
    let the_loop = &geometry.coverage_loop;
    Some(Forecast {
        planner,
        makespan_s: total.makespan_s,
        seen_share: seen_share(spec, geometry),
        loop_m: total.loop_m,
        energy_s: loop_energy_s(the_loop, &airframes, spec.wind.first, radius_m),
    })
}

/// Share of the area's points that lie in a piece of the loop which the mission sees.
fn seen_share(spec: &Spec, geometry: &MissionGeometry) -> f64 {
    let the_loop = &geometry.coverage_loop;
    let Ok(area) = Polygon::new(spec.mission.area_m()) else {
        return 0.0;
    };
    let (low, high) = area.bounds();
    let longest_m = (high.x - low.x).max(high.y - low.y);
    let lane_m = spec.mission.lane_m();
    let step_m = (lane_m / SAMPLES_A_LANE).max(longest_m / MAX_SAMPLES);
    let seen = the_loop.cells().iter().filter(|c| c.needed);
    let patches: Vec<[Point; 4]> = seen
        .filter_map(|c| the_loop.patches().corners(c.id))
        .collect();
    let samples = Samples::new(low, high, step_m);
    let mut hit = vec![false; samples.rows * samples.cols];
    for patch in &patches {
        samples.within(patch, |i| hit[i] = true);
    }
    let (mut inside, mut of_it) = (0.0, 0.0);
    for (i, hit) in hit.iter().enumerate() {
        if area.contains(samples.at(i)) {
            inside += 1.0;
            of_it += if *hit { 1.0 } else { 0.0 };
        }
    }
    if inside > 0.0 { of_it / inside } else { 0.0 }
}

/// Points in rows and columns, in the middles of squares.
struct Samples {
    low: Point,
    step_m: f64,
    rows: usize,
    cols: usize,
}

impl Samples {
    fn new(low: Point, high: Point, step_m: f64) -> Self {
        let n = |length_m: f64| count((length_m / step_m).ceil()).max(1);
        Self {
            low,
            step_m,
            rows: n(high.y - low.y),
            cols: n(high.x - low.x),
        }
    }

    fn at(&self, i: usize) -> Point {
        let place = |n: usize| (n as f64 + 0.5) * self.step_m;
        Point::new(
            self.low.x + place(i % self.cols),
            self.low.y + place(i / self.cols),
        )
    }

    /// The samples within a convex patch, its corners counter-clockwise.
    fn within(&self, patch: &[Point; 4], mut visit: impl FnMut(usize)) {
        let span = |axis: usize, n: usize| {
            let all = patch
                .iter()
                .map(|p| (p[axis] - self.low[axis]) / self.step_m);
            let (from, to) = all.fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
            count(from.floor())..count(to.ceil()).min(n)
        };
        for row in span(1, self.rows) {
            for col in span(0, self.cols) {
                let i = row * self.cols + col;
                let p = self.at(i);
                let left = |k: usize| {
                    let (a, b) = (patch[k], patch[(k + 1) % 4]);
                    (b - a).perp(&(p - a)) >= 0.0
                };
                if (0..4).all(left) {
                    visit(i);
                }
            }
        }
    }
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a cast of a float saturates"
)]
fn count(x: f64) -> usize {
    x.max(0.0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_patch_holds_the_samples_within() {
        let samples = Samples::new(Point::new(0.0, 0.0), Point::new(10.0, 10.0), 1.0);
        let patch = [(2.0, 2.0), (5.0, 2.0), (5.0, 4.0), (2.0, 4.0)].map(|(x, y)| Point::new(x, y));
        let mut n = 0;
        samples.within(&patch, |_| n += 1);
        assert_eq!(n, 6);
        let beyond = patch.map(|p| Point::new(p.x - 4.0, p.y + 7.0));
        n = 0;
        samples.within(&beyond, |_| n += 1);
        assert_eq!(n, 1);
    }
}
