//! How far a straight pass may reach so that a UAV can come to it and leave it: before a
//! wall there must be room for a turn.

use skein_flight::coverage::passes::Pass;
use skein_flight::route::Router;
use skein_geometry::Segment;
use skein_geometry::frame::Pose;
use skein_geometry::math::FRAC_PI_2;

/// How finely ends are moved.
#[derive(Clone, Copy, Debug)]
pub struct Fineness {
    /// To this, metres.
    resolution_m: f64,
    /// In so many steps along a pass.
    steps: f64,
}

impl Fineness {
    /// For passes that are flown.
    pub const FULL: Self = Self {
        resolution_m: 0.05,
        steps: 64.0,
    };
    /// For passes that are only compared.
    pub const COARSE: Self = Self {
        resolution_m: 1.0,
        steps: 16.0,
    };
}

/// A pass that is shorter than this is none, metres.
const SHORTEST_M: f64 = 1.0;

/// The longest part of a pass at both ends of which a quarter turn to one side keeps
/// clear; `None` where there is none of a metre.
///
/// Either end is moved as little as brings a turn: what is nearer to a wall than the turn
/// needs is to be seen by passes along that wall.
pub fn turnable(router: &Router, pass: Pass) -> Option<Pass> {
    turnable_by(router, pass, Fineness::FULL)
}

/// As [`turnable`], as finely as is asked.
pub fn turnable_by(router: &Router, pass: Pass, fineness: Fineness) -> Option<Pass> {
    let whole_m = pass.length_m();
    let ahead = |from_m: f64| {
        let d = (pass.to - pass.from) / whole_m;
        Pose::new(pass.from + d * from_m, pass.heading_rad())
    };
    // From the end backwards, and from the beginning as if it were flown the other way.
    let to_m = first_clear(whole_m, fineness, |cut_m| {
        turns(router, ahead(whole_m - cut_m))
    })?;
    let from_m = first_clear(whole_m, fineness, |cut_m| {
        turns(router, ahead(cut_m).reversed())
    })?;
    let (from, to) = (ahead(from_m).position(), ahead(whole_m - to_m).position());
    let left_m = whole_m - to_m - from_m;
    (left_m >= SHORTEST_M).then_some(Pass {
        from: if from_m > 0.0 { from } else { pass.from },
        to: if to_m > 0.0 { to } else { pass.to },
    })
}

/// Straight run-outs after which a turn is tried, in turn radii.
const RUN_OUTS: [f64; 5] = [0.0, 0.5, 1.0, 2.0, 4.0];

/// Whether a quarter turn to either side keeps clear, at once or after a run-out.
pub fn turns(router: &Router, pose: Pose) -> bool {
    let limits = router.limits();
    let is_clear = |s: &Segment| router.zones().is_segment_clear(s, limits.clearance_m);
    RUN_OUTS.into_iter().any(|radii| {
        let out = Segment {
            start: pose,
            curvature_per_m: 0.0,
            length_m: radii * limits.turn_radius_m,
        };
        is_clear(&out) && turns_at_once(router, out.end())
    })
}

/// Parts of a run-out that are tried where it is not clear.
const RUN_OUT_PARTS: [f64; 4] = [1.0, 0.75, 0.5, 0.25];

/// How far a UAV may fly straight on, up to `most_m`, and then turn at once, metres; 0 where
/// it cannot.
pub fn clear_ahead_m(router: &Router, pose: Pose, most_m: f64) -> f64 {
    let is_clear = |length_m: &f64| {
        let out = Segment {
            start: pose,
            curvature_per_m: 0.0,
            length_m: *length_m,
        };
        let keep_m = router.limits().clearance_m;
        router.zones().is_segment_clear(&out, keep_m) && turns_at_once(router, out.end())
    };
    let mut lengths = RUN_OUT_PARTS.into_iter().map(|part| part * most_m);
    lengths.find(is_clear).unwrap_or(0.0)
}

fn turns_at_once(router: &Router, pose: Pose) -> bool {
    let limits = router.limits();
    [1.0, -1.0].into_iter().any(|side| {
        let arc = Segment {
            start: pose,
            curvature_per_m: side / limits.turn_radius_m,
            length_m: limits.turn_radius_m * FRAC_PI_2,
        };
        router.zones().is_segment_clear(&arc, limits.clearance_m)
    })
}

/// The least length up to `most_m` that is clear, as far as steps and halving find it.
fn first_clear(most_m: f64, fineness: Fineness, is_clear: impl Fn(f64) -> bool) -> Option<f64> {
    if is_clear(0.0) {
        return Some(0.0);
    }
    let Fineness {
        resolution_m,
        steps,
    } = fineness;
    let step_m = (most_m / steps).clamp(resolution_m, 100.0 * resolution_m);
    let (mut low_m, mut high_m) = (0.0, step_m);
    while !is_clear(high_m) {
        low_m = high_m;
        high_m += step_m;
        if high_m >= most_m {
            return None;
        }
    }
    while high_m - low_m > resolution_m {
        let middle_m = f64::midpoint(low_m, high_m);
        if is_clear(middle_m) {
            high_m = middle_m;
        } else {
            low_m = middle_m;
        }
    }
    Some(high_m)
}
