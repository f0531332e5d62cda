//! What flights over passes come to at best: no order of the passes and no sharing out sees
//! more or takes less.
//!
//! A flight over a pass has to come to it and to leave it. Half of what the cheapest way from
//! each end to any other pass or to a start takes, as if nothing was in the way, is therefore
//! that pass's own, and the other half of what leads from and to a start is the start's.
//! Flights may leave out passes to which no curve leads, but no more than what they are to
//! see allows.

use super::flights::Samples;
use super::sight::Footprint;
use crate::objective::{Objective, SAME_SHARE, Worth, lacks};
use skein_flight::coverage::lines::{Uav, shared_time};
use skein_flight::coverage::passes::Pass;
use skein_flight::trajectory::dubins;
use skein_geometry::frame::{Point, Pose};

/// Times that are nearer than this share count as the same: rounding.
const ROUNDING: f64 = 1e-9;

/// What flights of a team over some passes come to at best.
#[derive(Clone, Debug)]
pub(super) struct Promise {
    /// The share of the area that all passes see.
    share: f64,
    /// By pass: the share of the area that no other pass sees, its length, and what it takes
    /// with its ways, metres.
    passes: Vec<(f64, f64, f64)>,
    /// What all of them take, metres.
    work_m: f64,
    /// The way from a start to the nearest pass, metres.
    way_m: f64,
    /// By UAV: how fast it is over the ground at most, m/s.
    speeds_mps: Vec<f64>,
}

/// The UAVs that fly over passes.
pub(super) struct Flyers {
    /// Where they start and end.
    pub starts: Vec<Point>,
    /// By UAV: how fast it is over the ground at most, m/s.
    pub speeds_mps: Vec<f64>,
    /// The turn radius that no curve of theirs is below, metres.
    pub turn_radius_m: f64,
}

impl Promise {
    pub(super) fn of(
        passes: &[Pass],
        flyers: &Flyers,
        samples: &Samples,
        footprint: Footprint,
    ) -> Self {
        let (share, alone) = samples.alone(passes, footprint);
        let ends = Ends::new(passes, flyers);
        let takes_m = |i: usize| {
            let out_m = ends.least_m(2 * i) + ends.least_m(2 * i + 1);
            passes[i].length_m() + out_m / 2.0
        };
        let each = alone.into_iter().enumerate();
        let each = each.map(|(i, alone)| (alone, passes[i].length_m(), takes_m(i)));
        let passes: Vec<(f64, f64, f64)> = each.collect();
        Self {
            share,
            work_m: passes.iter().map(|p| p.2).sum(),
            way_m: ends.way_m(),
            passes,
            speeds_mps: flyers.speeds_mps.clone(),
        }
    }

    /// The share of the area that is seen at most.
    pub(super) fn share(&self) -> f64 {
        self.share
    }

    /// What is to be least is no less than this; 0 where nothing is known of it.
    pub(super) fn figure(&self, objective: Objective) -> f64 {
        self.figure_of(objective, self.work_m)
    }

    fn figure_of(&self, objective: Objective, work_m: f64) -> f64 {
        match objective {
            Objective::Time if work_m > 0.0 => self.least_s(work_m),
            Objective::Time | Objective::Distance => work_m,
            Objective::Energy => 0.0,
        }
    }

    /// The time in which the team can fly so far beside the ways from and to their starts.
    fn least_s(&self, work_m: f64) -> f64 {
        let uav = |speed: &f64| Uav {
            speed: *speed,
            ..Uav::at(0)
        };
        let team: Vec<Uav> = self.speeds_mps.iter().map(uav).collect();
        // Of either way a half is the pass's already.
        shared_time(&team, self.way_m / 2.0, work_m)
    }

    /// Whether flights over these passes may see more than a plan, or as much for less.
    pub(super) fn may_be_better(&self, than: &Worth, objective: Objective) -> bool {
        self.may_be(than, |unseen| {
            let each = self.passes.iter().map(|p| (p.0, p.2));
            let work_m = (self.work_m - saved_m(each.collect(), unseen)).max(0.0);
            self.figure_of(objective, work_m) < than.figure(objective) * (1.0 - ROUNDING)
        })
    }

    /// Whether so many of the first UAVs of the team may be sooner than a plan, or see more,
    /// on lanes of this course, however these are cut for them.
    ///
    /// Fewer UAVs never may where more may not: only the lengths of passes count.
    pub(super) fn may_be_sooner_with(&self, uavs: usize, than: &Worth) -> bool {
        let speed_mps: f64 = self.speeds_mps.iter().take(uavs).sum();
        self.may_be(than, |unseen| {
            let each: Vec<(f64, f64)> = self.passes.iter().map(|p| (p.0, p.1)).collect();
            let all_m: f64 = each.iter().map(|p| p.1).sum();
            let least_s = (all_m - saved_m(each, unseen)) / speed_mps;
            least_s < than.makespan_s * (1.0 - ROUNDING)
        })
    }

    /// Whether more is seen, or as much and `is_less` of the share that may be left out then.
    fn may_be(&self, than: &Worth, is_less: impl Fn(f64) -> bool) -> bool {
        let (own, others) = (lacks(self.share), lacks(than.share));
        let least_share = 1.0 - SAME_SHARE * f64::from(others + 1);
        own < others || (own == others && is_less((self.share - least_share).max(0.0)))
    }
}

/// What is saved at most by leaving out passes that alone see no more than so much of the
/// area, parts of passes too; by pass, what it alone sees and what it takes, metres.
fn saved_m(mut passes: Vec<(f64, f64)>, mut unseen: f64) -> f64 {
    // What nobody else sees for what it takes; what takes nothing saves nothing.
    let dear = |p: &(f64, f64)| p.0 / p.1.max(f64::MIN_POSITIVE);
    passes.sort_by(|a, b| dear(a).total_cmp(&dear(b)));
    let mut saved_m = 0.0;
    for (alone, takes_m) in passes {
        if alone > unseen {
            return saved_m + takes_m * (unseen / alone);
        }
        unseen -= alone;
        saved_m += takes_m;
    }
    saved_m
}

/// The ends of passes as poses in which these are left over them.
struct Ends<'a> {
    out: Vec<Pose>,
    flyers: &'a Flyers,
}

impl<'a> Ends<'a> {
    fn new(passes: &[Pass], flyers: &'a Flyers) -> Self {
        let both = passes.iter().flat_map(|p| [p.start().reversed(), p.end()]);
        Self {
            out: both.collect(),
            flyers,
        }
    }

    /// The shortest way from an end to an end of another pass or to a start, metres.
    fn least_m(&self, end: usize) -> f64 {
        let from = self.out[end];
        let mut least_m = self.to_start_m(end);
        for (other, to) in self.out.iter().enumerate() {
            // A way is no shorter than a straight line: most need not be measured.
            if other / 2 != end / 2 && (to.position() - from.position()).norm() < least_m {
                let way_m = dubins::length_m(from, to.reversed(), self.flyers.turn_radius_m);
                least_m = least_m.min(way_m);
            }
        }
        least_m
    }

    fn to_start_m(&self, end: usize) -> f64 {
        let at = self.out[end].position();
        let each = self.flyers.starts.iter().map(|s| (at - s).norm());
        each.fold(f64::INFINITY, f64::min)
    }

    fn way_m(&self) -> f64 {
        let each = (0..self.out.len()).map(|end| self.to_start_m(end));
        let least_m = each.fold(f64::INFINITY, f64::min);
        if least_m.is_finite() { least_m } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::super::flights::MOST_SAMPLES;
    use super::*;
    use proptest::prelude::*;
    use skein_geometry::Polygon;

    const RADIUS_M: f64 = 25.0;

    fn flyers(uavs: usize, start: Point) -> Flyers {
        Flyers {
            starts: vec![start],
            speeds_mps: vec![10.0; uavs],
            turn_radius_m: RADIUS_M,
        }
    }

    /// The shortest flight over some passes in any order and any directions, metres: ways from
    /// and to the start are straight.
    fn shortest_m(passes: &[Pass], left: usize, at: Option<Pose>, start: Point) -> f64 {
        if left == 0 {
            return at.map_or(0.0, |pose| (pose.position() - start).norm());
        }
        let mut least_m = f64::INFINITY;
        for (i, pass) in passes
            .iter()
            .enumerate()
            .filter(|(i, _)| left >> i & 1 == 1)
        {
            for pass in [*pass, pass.reversed()] {
                let way_m = at.map_or((pass.from - start).norm(), |pose| {
                    dubins::length_m(pose, pass.start(), RADIUS_M)
                });
                let rest_m = shortest_m(passes, left & !(1 << i), Some(pass.end()), start);
                least_m = least_m.min(way_m + pass.length_m() + rest_m);
            }
        }
        least_m
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]

        #[test]
        fn no_flights_over_the_passes_take_less(
            passes in prop::collection::vec(
                (0.0..300.0f64, 0.0..200.0f64, -3.0..3.0f64, 5.0..150.0f64), 1..5),
            start in (-200.0..0.0f64, -200.0..200.0f64),
        ) {
            let pass = |p: &(f64, f64, f64, f64)| {
                let from = Point::new(p.0, p.1);
                Pass { from, to: from + Pose::new(from, p.2).direction() * p.3 }
            };
            let passes: Vec<Pass> = passes.iter().map(pass).collect();
            let start = Point::new(start.0, start.1);
            let corners = [(0.0, 0.0), (300.0, 0.0), (300.0, 200.0), (0.0, 200.0)];
            let corners = corners.map(|(x, y)| Point::new(x, y)).to_vec();
            let area = Polygon::new(corners).unwrap();
            let samples = Samples::new(&area, |_| true, 40.0, MOST_SAMPLES);
            let footprint = Footprint { across_m: 20.0, along_m: 20.0 };
            let promise = |uavs| Promise::of(&passes, &flyers(uavs, start), &samples, footprint);
            let seen = samples.share([(&passes[..], footprint)].into_iter());
            prop_assert!((promise(1).share() - seen).abs() < 1e-12);
            let all = (1 << passes.len()) - 1;
            let alone_m = shortest_m(&passes, all, None, start);
            prop_assert!(promise(1).figure(Objective::Distance) <= alone_m + 1e-6);
            prop_assert!(promise(1).figure(Objective::Time) <= alone_m / 10.0 + 1e-6);
            let longer_m = |mine: usize| {
                let one_m = shortest_m(&passes, mine, None, start);
                one_m.max(shortest_m(&passes, all & !mine, None, start))
            };
            let both_m = (0..=all).map(longer_m).fold(f64::INFINITY, f64::min);
            prop_assert!(promise(2).figure(Objective::Time) <= both_m / 10.0 + 1e-6);
            let worth = |makespan_s: f64| Worth {
                share: seen,
                makespan_s,
                total_m: alone_m,
                energy: 0.0,
            };
            prop_assert!(promise(2).may_be_better(&worth(both_m / 10.0 * 1.01), Objective::Time));
            prop_assert!(promise(2).may_be_sooner_with(1, &worth(alone_m / 10.0 * 1.01)));
            prop_assert!(!promise(2).may_be_better(&worth(0.0), Objective::Time));
        }
    }

    #[test]
    fn passes_that_alone_see_little_may_be_left_out() {
        // The second takes most for what it alone sees.
        let passes = vec![(0.5, 100.0), (0.001, 50.0), (0.0, 7.0)];
        assert!((saved_m(passes.clone(), 0.0) - 7.0).abs() < 1e-9);
        assert!((saved_m(passes.clone(), 0.0005) - 32.0).abs() < 1e-9);
        assert!((saved_m(passes.clone(), 0.251) - 107.0).abs() < 1e-9);
        assert!((saved_m(passes, 1.0) - 157.0).abs() < 1e-9);
    }
}
