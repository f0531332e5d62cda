//! Routes for a UAV that cannot turn where it is, or not where it shall arrive: a
//! straight piece first, last or both (D2.7 §2.4.1 where a word alone is blocked).
//!
//! Comes last: lengths of the straights are sampled, so the routes are flyable and
//! clear but need not be the shortest.

use super::{Goal, Router};
use skein_geometry::frame::Pose;
use skein_geometry::{Curve, Segment};

/// Lengths of the straight pieces, in turn radii. Four radii lead out of whatever
/// one turning circle can be caught in.
const STRAIGHTS: [f64; 4] = [0.5, 1.0, 2.0, 4.0];

impl Router {
    /// A route with a straight piece at its start, its goal or both: the shortest of
    /// those whose rest is a Dubins word, else one whose rest bends round corners.
    pub(super) fn with_loose_ends(&self, from: Pose, goal: Goal) -> Option<Curve> {
        let first = self.straights(from, 0.0);
        let last = match goal {
            Goal::Pose(to) => self.straights(to, -1.0),
            Goal::Point(_) => vec![None],
        };
        let start_of = |s: &Option<Segment>| s.map_or(from, |s| s.end());
        let goal_of = |s: &Option<Segment>| s.map_or(goal, |s| Goal::Pose(s.start));
        let mut best: Option<(f64, Curve)> = None;
        let pairs = first.iter().flat_map(|a| last.iter().map(move |b| (a, b)));
        // The pair without straights has been tried.
        for (a, b) in pairs.skip(1) {
            if let (Some(middle), _) = self.direct(start_of(a), goal_of(b)) {
                let whole = joined(a, &middle, b);
                let length_m = whole.length_m();
                if best.as_ref().is_none_or(|(m, _)| length_m < *m) {
                    best = Some((length_m, whole));
                }
            }
        }
        if let Some((_, curve)) = best {
            return Some(curve);
        }
        let (longest_a, longest_b) = (first.last()?, last.last()?);
        [
            (longest_a, &None),
            (&None, longest_b),
            (longest_a, longest_b),
        ]
        .into_iter()
        .filter(|(a, b)| a.is_some() || b.is_some())
        .find_map(|(a, b)| {
            let middle = self.search().run(start_of(a), goal_of(b), f64::INFINITY)?;
            Some(joined(a, &middle, b))
        })
    }

    /// No piece, and then the clear ones through `pose`, shortest first: beginning
    /// there, or `shift` times their length along from there.
    fn straights(&self, pose: Pose, shift: f64) -> Vec<Option<Segment>> {
        let piece = |radii: f64| {
            let length_m = radii * self.limits.turn_radius_m;
            let start = pose.position() + pose.direction() * (shift * length_m);
            Segment {
                start: Pose::new(start, pose.heading_rad),
                curvature_per_m: 0.0,
                length_m,
            }
        };
        let clear = STRAIGHTS
            .map(piece)
            .into_iter()
            .take_while(|s| self.zones.is_segment_clear(s, self.limits.clearance_m));
        std::iter::once(None).chain(clear.map(Some)).collect()
    }
}

fn joined(first: &Option<Segment>, middle: &Curve, last: &Option<Segment>) -> Curve {
    let mut whole = Curve::empty();
    if let Some(s) = first {
        whole.push(*s);
    }
    whole.extend(middle);
    if let Some(s) = last {
        whole.push(*s);
    }
    whole
}
