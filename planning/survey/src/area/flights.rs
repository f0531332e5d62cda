//! Flights of a team over an area while plans are compared, and the share that they see.

use super::promise::Promise;
use super::sight::{Footprint, Points};
use super::{Facts, Figures, Laid, Planner, Shape};
use crate::flight::Flight;
use crate::objective::Worth;
use skein_flight::coverage::passes::Pass;
use skein_geometry::Polygon;
use skein_geometry::frame::{Point, Vector};

/// Points of the area that are looked at to tell the share that is seen: a tenth of a
/// percent is one in a thousand.
pub(crate) const MOST_SAMPLES: f64 = 40_000.0;

/// Of the samples, how many are looked at where a swath is wide, as a share.
const LEAST_SAMPLES: f64 = 1.0;

/// Steps from sample to sample along both sides of a box, as shares of them: powers of the
/// plastic number, which spread evenly and not in rows, that might all lie beside a border.
const STEPS: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053];

/// So many times the samples of an area are looked at where most of its box lies beside it.
const MOST_BESIDE: f64 = 64.0;

/// Samples along a swath at least.
const SAMPLES_A_SWATH: f64 = 8.0;

/// What a planner made.
#[derive(Clone, Debug)]
pub(crate) struct Flights {
    /// Which planner.
    pub planner: Planner,
    /// How the lanes are laid.
    pub laid: Laid,
    /// Of the UAVs that were planned for; some may stay at their start.
    pub flights: Vec<Flight>,
    /// The share of the area that is seen.
    pub covered_share: f64,
    /// The share of the area that is not seen and nearer to a zone or a fence than the
    /// clearance.
    pub too_near_share: f64,
    /// What the planner tells of its own; none where nothing was to be planned.
    pub facts: Option<Facts>,
    /// Rings for a map.
    pub shapes: Vec<Shape>,
    /// Courses that would have taken too long to plan in full.
    pub courses_left: usize,
    /// What all courses promise that were looked at; none where that is not known.
    pub promises: Vec<Promise>,
}

impl Flights {
    fn energy_wh(&self) -> Option<f64> {
        self.flights
            .iter()
            .filter(|f| f.flies())
            .map(Flight::energy_wh)
            .sum()
    }

    /// What it is compared by; energies in watt-hours or in seconds of cruise.
    pub(crate) fn worth(&self, in_watt_hours: bool) -> Worth {
        Worth::of(self.flights.iter(), self.covered_share, in_watt_hours)
    }

    /// What a person compares.
    pub(crate) fn figures(&self) -> Figures {
        let worth = self.worth(false);
        Figures {
            planner: self.planner,
            laid: self.laid,
            makespan_s: worth.makespan_s,
            covered_share: worth.share,
            total_m: worth.total_m,
            energy_s: worth.energy,
            energy_wh: self.energy_wh(),
            uavs_flying: self.flights.iter().filter(|f| f.flies()).count(),
        }
    }
}

/// From where to where points lie along an axis.
pub(super) fn span(points: &[Point], axis: Vector) -> (f64, f64) {
    let each = points.iter().map(|p| p.coords.dot(&axis));
    each.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| {
        (l.min(x), h.max(x))
    })
}

/// The wanted ground of an area, as points that are spread evenly over it.
pub(crate) struct Samples(Points);

/// Passes that are flown, and how far they see.
pub(crate) type Seen<'a> = (&'a [Pass], Footprint);

impl Samples {
    /// About so many at most, an eighth of a swath apart at least.
    pub(crate) fn new(
        area: &Polygon,
        wanted: impl Fn(Point) -> bool,
        swath_m: f64,
        most: f64,
    ) -> Self {
        // In a box along the longest edge: a needle across its box would be missed.
        let along = area.edges().map(|(a, b)| b - a);
        let along = along.max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()));
        let along = along.map_or(Vector::x(), |d| d.normalize());
        let across = Vector::new(-along.y, along.x);
        let ((u0, u1), (v0, v1)) = (span(area.vertices(), along), span(area.vertices(), across));
        let most_m = (area.area_m2() / (most * LEAST_SAMPLES)).sqrt();
        let least_m = (area.area_m2() / most).sqrt();
        let pitch_m = (swath_m / SAMPLES_A_SWATH).min(most_m).max(least_m);
        let n = (u1 - u0) * (v1 - v0) / (pitch_m * pitch_m);
        let n = n.min(most * MOST_BESIDE).ceil();
        let mut points = Vec::new();
        let mut i = 0.0;
        while i < n {
            let at = |step: f64, low: f64, high: f64| low + (0.5 + i * step).fract() * (high - low);
            let p = Point::from(along * at(STEPS[0], u0, u1) + across * at(STEPS[1], v0, v1));
            if area.contains(p) && wanted(p) {
                points.push(p);
            }
            i += 1.0;
        }
        Self(Points::new(points))
    }

    /// The share of them that is seen.
    pub(crate) fn share<'a>(&self, seen: impl Iterator<Item = Seen<'a>>) -> f64 {
        self.part(&self.seen(seen), |_, seen| seen)
    }

    /// The share of them that is seen, and the share that is not and for which `holds`.
    pub(crate) fn shares<'a>(
        &self,
        seen: impl Iterator<Item = Seen<'a>>,
        holds: impl Fn(Point) -> bool,
    ) -> (f64, f64) {
        let seen = self.seen(seen);
        let unseen = self.part(&seen, |p, seen| !seen && holds(p));
        (self.part(&seen, |_, seen| seen), unseen)
    }

    /// The share of them that passes see, and by pass the share that no other one sees.
    pub(super) fn alone(&self, passes: &[Pass], footprint: Footprint) -> (f64, Vec<f64>) {
        let n = self.0.all().len().max(1) as f64;
        // By sample: how many see it, and the last that does.
        let mut seen = vec![(0u32, 0); self.0.all().len()];
        for (i, pass) in passes.iter().enumerate() {
            let see = |p: usize| seen[p] = (seen[p].0 + 1, i);
            self.0.each_seen(pass, footprint, see);
        }
        let mut alone = vec![0.0; passes.len()];
        for (_, pass) in seen.iter().filter(|s| s.0 == 1) {
            alone[*pass] += 1.0 / n;
        }
        let share = seen.iter().filter(|s| s.0 > 0).count() as f64 / n;
        (share, alone)
    }

    /// By sample: whether it is seen.
    fn seen<'a>(&self, seen: impl Iterator<Item = Seen<'a>>) -> Vec<bool> {
        let mut all = vec![false; self.0.all().len()];
        for (passes, footprint) in seen {
            for pass in passes {
                self.0.each_seen(pass, footprint, |i| all[i] = true);
            }
        }
        all
    }

    fn part(&self, seen: &[bool], holds: impl Fn(Point, bool) -> bool) -> f64 {
        let all = self.0.all();
        let n = all.iter().zip(seen).filter(|(p, seen)| holds(**p, **seen));
        n.count() as f64 / all.len().max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_measured() {
        let at = |x: f64, y: f64| Point::new(x, y);
        let square = |half: f64| {
            Polygon::new(vec![
                at(-half, -half),
                at(half, -half),
                at(half, half),
                at(-half, half),
            ])
            .unwrap()
        };
        let (area, hole) = (square(100.0), square(50.0));
        // One pass that sees all to the east of a place.
        let east_of = |x: f64| Pass {
            from: at(x, 0.0),
            to: at(x + 1000.0, 0.0),
        };
        let footprint = Footprint {
            across_m: 1000.0,
            along_m: 0.0,
        };
        let share = |area, wanted: &dyn Fn(Point) -> bool, x: f64| {
            let samples = Samples::new(area, wanted, 40.0, MOST_SAMPLES);
            let pass = [east_of(x)];
            samples.shares([(&pass[..], footprint)].into_iter(), |p| p.y > 0.0)
        };
        let (half, unseen) = share(&area, &|_| true, 0.0);
        assert!((half - 0.5).abs() < 0.01 && (unseen - 0.25).abs() < 0.01);
        let (rest, _) = share(&area, &|p| !hole.contains(p), 50.0);
        // 50 × 200 of 30,000 square metres.
        assert!((rest - 1.0 / 3.0).abs() < 0.01, "{rest}");
        let needle = Polygon::new(vec![at(0.0, 0.0), at(700.0, 697.0), at(703.0, 700.0)]).unwrap();
        let (half, _) = share(&needle, &|_| true, 497.0);
        assert!((half - 0.5).abs() < 0.005, "{half}");
    }
}
