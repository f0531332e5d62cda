//! What is told of streets beside the truth, and hinted ways beside the best ones.

use super::truth::Driven;
use crate::account::secs;
use serde::{Deserialize, Serialize};
use skein_flight::streets::Network;
use skein_flight::streets::network::JOINED_M;
use skein_flight::streets::quickest::Leg;
use skein_geometry::frame::Point;
use skein_peer::hint::Hint;
use skein_peer::mission::point_m;
use skein_peer::streets::{AskedWay, Streets};
use skein_peer::usage::Usages;
use std::collections::BTreeMap;

/// What is told of a stretch in an interval is compared where all of it was watched for so long,
/// seconds.
const TOLD_FROM_S: f64 = 8.0;

/// The true speed of a stretch is known where vehicles were there for so long, seconds; elsewhere
/// it is the usual one.
const TRUTH_FROM_S: f64 = 30.0;

/// Nobody drives slower for the judge, m/s.
const LEAST_MPS: f64 = 0.2;

/// A hint takes no more than this share of the best way's time, and this, seconds.
const HINT_OFF_SHARE: f64 = 1.3;
const HINT_OFF_S: f64 = 20.0;

/// That is asked for where each stretch of both ways was watched for so long, seconds.
const WATCHED_FROM_S: f64 = 15.0;

/// What truly drove, by interval and stretch.
pub(super) type ByInterval = BTreeMap<(u16, u16), Driven>;

/// A hinted way beside the best one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HintReport {
    /// Its name.
    pub name: String,
    /// What was hinted, in a sentence.
    pub told: String,
    /// The time that was told, and its range, seconds.
    pub told_s: (f64, f64, f64),
    /// What it truly takes, seconds.
    pub true_s: f64,
    /// What the best way truly takes, seconds.
    pub best_s: f64,
    /// What the shortest way truly takes, seconds.
    pub shortest_s: f64,
    /// Whether its parts hang together, from place to place.
    pub is_way: bool,
    /// Whether enough was watched to ask for more than that.
    pub is_known: bool,
}

impl HintReport {
    /// Why it breaks the rule, if it does.
    pub(super) fn wrong(&self) -> Option<String> {
        if !self.is_way {
            return Some(format!("the way {} is none: {}", self.name, self.told));
        }
        let bound_s = HINT_OFF_S + HINT_OFF_SHARE * self.best_s;
        (self.is_known && self.true_s > bound_s).then(|| {
            format!(
                "the way {} truly takes {:.0} s, and the best one {:.0} s",
                self.name, self.true_s, self.best_s
            )
        })
    }

    /// For a person.
    #[must_use]
    pub fn line(&self) -> String {
        let (_, low, high) = self.told_s;
        let holds = if (low..=high).contains(&self.true_s) {
            "in"
        } else {
            "not in"
        };
        format!(
            "{}; truly {:.0} s ({holds} the range), the best way {:.0} s, the shortest {:.0} s",
            self.told, self.true_s, self.best_s, self.shortest_s
        )
    }
}

/// How the streets of a mission were measured, beside the truth.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StreetsReport {
    /// How many stretches there are.
    pub stretches: u16,
    /// How long they are, metres.
    pub length_m: f64,
    /// How many were watched by anybody, in the mean for how long, seconds.
    pub watched: (u16, f64),
    /// Densities of stretches in intervals whose range holds the true one, of how many.
    pub density_holds: (u32, u32),
    /// And mean speeds.
    pub speed_holds: (u32, u32),
    /// How far densities of whole streets are off, root mean square, vehicles a kilometre; and
    /// what they truly are in the mean.
    pub density_off: (f64, f64),
    /// How far mean speeds are off, root mean square, m/s.
    pub speed_off_mps: f64,
    /// Turns that are told, those of them that nobody took, and all that were taken.
    pub turns: u32,
    /// Told turns that nobody took.
    pub turns_wrong: u32,
    /// All turns that were truly taken.
    pub turned: u32,
    /// Ways that were asked for.
    pub hints: Vec<HintReport>,
}

impl StreetsReport {
    /// Compares what is told of each stretch in each interval.
    pub(super) fn compare(
        &mut self,
        known: &Usages,
        (all, lasted_ms): (&ByInterval, &BTreeMap<u16, u64>),
        (network, usual_mps): (&Network, f64),
    ) {
        let (mut squares, mut truly, mut n) = (0.0, 0.0, 0.0);
        let (mut speed_squares, mut speeds) = (0.0, 0.0);
        for (n, edge) in (0_u16..).zip(network.edges()) {
            let watched_s = known.of_stretch(n).watched_s(edge.length_m);
            self.watched.0 += u16::from(watched_s > 0.0);
            self.watched.1 += watched_s / f64::from(self.stretches.max(1));
        }
        for ((interval, stretch), sum) in known.stretches() {
            let length_m = network.edges()[usize::from(stretch)].length_m;
            let lasted_s = secs(lasted_ms.get(&interval).copied().unwrap_or(0));
            if sum.watched_s(length_m) < TOLD_FROM_S || lasted_s <= 0.0 {
                continue;
            }
            let is = all.get(&(interval, stretch)).copied().unwrap_or_default();
            let density = 1_000.0 * is.spent_s() / (lasted_s * length_m);
            if let (Some(says), Some((low, high))) = (
                sum.density_per_km(),
                sum.density_range_per_km(length_m, usual_mps),
            ) {
                self.density_holds.1 += 1;
                self.density_holds.0 += u32::from((low..=high).contains(&density));
                squares += (says - density) * (says - density);
                truly += density;
                n += 1.0;
            }
            if let (Some(says), Some((low, high)), Some(v)) =
                (sum.speed_mps(), sum.speed_range_mps(), is.speed_mps())
                && sum.vehicles >= 3
            {
                self.speed_holds.1 += 1;
                self.speed_holds.0 += u32::from((low..=high).contains(&v));
                speed_squares += (says - v) * (says - v);
                speeds += 1.0;
            }
        }
        let root = |sum: f64, n: f64| if n > 0.0 { (sum / n).sqrt() } else { 0.0 };
        self.density_off = (root(squares, n), truly / n.max(1.0));
        self.speed_off_mps = root(speed_squares, speeds);
    }

    /// For a person, a line each.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let (stretches, length_m) = (self.stretches, self.length_m);
        let (watched, watched_s) = self.watched;
        let (off, mean) = self.density_off;
        let ((holds, of), (speed_holds, speed_of)) = (self.density_holds, self.speed_holds);
        let mut lines = vec![format!(
            "{watched} of {stretches} stretches, {length_m:.0} m, watched for {watched_s:.0} s each; density in its range {holds} of {of} times, off {off:.1} of {mean:.1} vehicles a km; speed {speed_holds} of {speed_of} times, off {:.1} m/s; {} turns told, {} of them taken by nobody, {} taken in all",
            self.speed_off_mps, self.turns, self.turns_wrong, self.turned
        )];
        lines.extend(self.hints.iter().map(HintReport::line));
        lines
    }
}

/// A hinted way beside the best one and the shortest one, by what truly drives.
pub(super) fn judge(
    (asked, hint): (&AskedWay, Option<&Hint>),
    (network, streets): (&Network, &Streets),
    truth: &[Driven],
    known: &Usages,
) -> HintReport {
    let s_per_m = |stretch: u16| {
        let driven = truth.get(usize::from(stretch)).copied().unwrap_or_default();
        let known = driven
            .speed_mps()
            .filter(|_| driven.spent_s() >= TRUTH_FROM_S);
        1.0 / known.unwrap_or(streets.usual_mps()).max(LEAST_MPS)
    };
    let time_s = |legs: &[Leg]| -> f64 {
        let each = legs.iter().map(|l| l.length_m() * s_per_m(l.edge));
        each.sum()
    };
    let (from, to) = (point_m(asked.from), point_m(asked.to));
    let Some(hint) = hint else {
        // Where the streets do not lead there, no hint is right.
        return HintReport {
            name: asked.name.clone(),
            told: "none".to_owned(),
            is_way: network.quickest(from, to, &|_| 1.0).is_none(),
            ..HintReport::default()
        };
    };
    let leg = |(edge, from_m, to_m): &(u16, f64, f64)| Leg {
        edge: *edge,
        from_m: *from_m,
        to_m: *to_m,
    };
    let legs: Vec<Leg> = hint.legs.iter().map(leg).collect();
    let best = network.quickest(from, to, &s_per_m).unwrap_or_default();
    let shortest = network.quickest(from, to, &|_| 1.0).unwrap_or_default();
    let watched = |l: &Leg| {
        let length_m = network.edges()[usize::from(l.edge)].length_m;
        known.of_stretch(l.edge).watched_s(length_m) >= WATCHED_FROM_S
    };
    let is_way = hangs_together(network, &legs, (from, to));
    HintReport {
        name: asked.name.clone(),
        told: hint.sentence(),
        told_s: (hint.time_s, hint.range_s.0, hint.range_s.1),
        true_s: time_s(&legs),
        best_s: time_s(&best),
        shortest_s: time_s(&shortest),
        is_way,
        is_known: is_way && legs.iter().chain(&best).all(watched),
    }
}

/// Whether legs lead from the street that is nearest to one place to that nearest to another.
fn hangs_together(network: &Network, legs: &[Leg], (from, to): (Point, Point)) -> bool {
    /// An end of a leg: a crossing, or somewhere on a stretch.
    fn end(network: &Network, leg: &Leg, m: f64) -> Option<u16> {
        let edge = network.edges().get(usize::from(leg.edge))?;
        let is = |at_m: f64| (m - at_m).abs() < 1e-6;
        (is(0.0) || is(edge.length_m)).then(|| edge.ends[usize::from(!is(0.0))])
    }
    let (Some(first), Some(last)) = (legs.first(), legs.last()) else {
        return false;
    };
    let near = |at: Point, leg: &Leg, m: f64| {
        let way = network.edges().get(usize::from(leg.edge)).map(|e| &e.way);
        let place = way.and_then(|way| skein_flight::streets::network::along(way, m));
        let least = network.nearest(at).map_or(0.0, |n| n.aside_m);
        place.is_some_and(|p| (p - at).norm() <= least + JOINED_M)
    };
    legs.windows(2).all(|w| {
        let meets = end(network, &w[0], w[0].to_m);
        meets.is_some() && meets == end(network, &w[1], w[1].from_m)
    }) && near(from, first, first.from_m)
        && near(to, last, last.to_m)
}
