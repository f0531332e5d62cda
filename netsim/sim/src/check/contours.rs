//! What is told of a contour beside where it is, and who flies along it (`contour`, `trace`): by
//! truth and pictures, and by geometry of its own (D2.7 §3.1).
//!
//! | what | bound |
//! |---|---|
//! | a place that is told, beside where the contour was when it was seen | [`OFF_MOST_M`] |
//! | who says that it flies along it and has none of it in its picture | [`LOST_MS`] |
//! | a place of the contour, while somebody flies along it | two times what the slowest takes from end to end and back, or round, slowed down, and [`JOIN_MS`] |
//!
//! What stands in no picture since nobody may fly there is not asked for.

use super::flight::{Flyer, milliseconds};
use super::{Findings, Handicaps};
use crate::world::contour::Contour;
use crate::world::flat::{area_m2, point_segment_m};
use serde::{Deserialize, Serialize};
use skein_flight::tracing::outline::{Outline, Stretch, outline};
use skein_geometry::frame::Point;
use skein_geometry::math::seconds;
use skein_geometry::polyline::length_m;
use std::collections::{BTreeMap, BTreeSet};

/// What is told is no farther from the contour than this, metres: four standard deviations of a
/// UAV's own place and of a look, and what simplifying leaves out.
pub const OFF_MOST_M: f64 = 22.0;

/// Who flies along a contour has it in its picture again within so long, milliseconds: a circle
/// flown to let another get away, or a turn at the end of a road.
pub const LOST_MS: u64 = 40_000;

/// The way onto it, a search, and what a fire grows meanwhile, milliseconds.
pub const JOIN_MS: u64 = 180_000;

/// Who spaces itself flies at least at this share of its cruise.
const SLOWED: f64 = 0.75;

/// A part of the contour is known where what is told is no farther from it, metres.
const KNOWN_M: f64 = 30.0;

/// What is told is compared with truth each so often, milliseconds.
const COMPARED_MS: u64 = 10_000;

/// What a run came to.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ContourReport {
    /// Whether it encloses something.
    pub closed: bool,
    /// Its length at the end, m.
    pub length_m: f64,
    /// The share of it that was in the picture of somebody who flew along it.
    pub seen_share: f64,
    /// The share of it at the end that is known, to within 30 m.
    pub known_share: f64,
    /// Errors of what was told beside where the contour was when that was seen, m: mean, largest.
    pub told_error_m: (f64, f64),
    /// From where the contour is to what is told, m: mean over it, farthest; at the end.
    pub apart_m: (f64, f64),
    /// The same mean, over the time since half of it was known first, m.
    pub apart_over_time_m: f64,
    /// The share by which the area that is told is wrong, at the end and over time; of one that
    /// closes.
    pub area_error: Option<(f64, f64)>,
    /// The share of the time in which who flies along it has it in its picture.
    pub pictured_share: f64,
    /// The longest time in which a place of it was in no picture, in the second half of the time
    /// in which it was flown along, s.
    pub longest_wait_s: f64,
    /// The least that could be, flown evenly at cruise by all who fly along it: s.
    pub least_wait_s: f64,
    /// When it was flown along first, ms.
    pub since_ms: Option<u64>,
    /// When all of it that is known at the end was seen first, ms.
    pub all_seen_ms: Option<u64>,
}

/// One who flies a mission that traces.
#[derive(Clone, Debug)]
pub struct Tracer {
    /// Which UAV.
    pub uav: u16,
    /// Whether it is to fly along the contour, by its state.
    pub is_to: bool,
    /// Whether it says that it does.
    pub says: bool,
    /// Which places of the contour are in its picture.
    pub pictured: Vec<bool>,
}

/// What the contour of one run came to so far.
#[derive(Clone, Debug, Default)]
pub struct ContourCheck {
    /// When each place was in a picture last, and first.
    seen: Vec<Option<(u64, u64)>>,
    tracers: BTreeSet<u16>,
    since_ms: u64,
    first_ms: Option<u64>,
    lost_ms: BTreeMap<u16, u64>,
    told_lost: BTreeSet<u16>,
    told_waits: bool,
    told_off: bool,
    /// Time of tracers, and that with the contour in the picture, milliseconds.
    traced_ms: u64,
    pictured_ms: u64,
    last_ms: u64,
    compared_ms: u64,
    /// Longest waits, each with when it ended.
    waits: Vec<(u64, u64)>,
    apart: (f64, u32),
    area: (f64, u32),
    least_wait_s: f64,
    report: ContourReport,
}

impl ContourCheck {
    /// Looks at who flies along it.
    pub fn on_looks(
        &mut self,
        now_ms: u64,
        contour: &Contour,
        all: &[Tracer],
        (flyers, handicaps): (&BTreeMap<u16, Flyer>, &Handicaps),
        found: &mut Findings,
    ) {
        let passed_ms = now_ms.saturating_sub(self.last_ms);
        self.last_ms = now_ms;
        let places = contour.places(now_ms);
        self.seen.resize(places.len(), None);
        let flying: Vec<&Tracer> = all.iter().filter(|t| t.is_to).collect();
        for t in &flying {
            let shown = t.pictured.iter().any(|p| *p);
            if t.says {
                self.traced_ms += passed_ms;
                self.pictured_ms += if shown { passed_ms } else { 0 };
            }
            self.note_lost(now_ms, t, shown, handicaps, found);
            for (seen, shown) in self.seen.iter_mut().zip(&t.pictured) {
                if *shown {
                    let first_ms = seen.map_or(now_ms, |(_, first)| first);
                    if let Some((last_ms, _)) = seen {
                        let waited_ms = now_ms.saturating_sub(*last_ms);
                        if waited_ms > 10_000 {
                            self.waits.push((now_ms, waited_ms));
                        }
                    }
                    *seen = Some((now_ms, first_ms));
                }
            }
        }
        self.lost_ms
            .retain(|uav, _| flying.iter().any(|t| t.uav == *uav && t.says));
        let tracers: BTreeSet<u16> = flying.iter().map(|t| t.uav).collect();
        if tracers.is_disjoint(&self.tracers) {
            self.since_ms = now_ms;
        }
        // Who goes on alone has no farther to fly than all before it, so the others' ends count
        // from when they left.
        if !self.tracers.is_subset(&tracers) {
            self.since_ms = now_ms;
        }
        self.tracers = tracers;
        if flying.iter().any(|t| t.says) {
            self.first_ms.get_or_insert(now_ms);
        }
        self.judge_waits(now_ms, contour, (flyers, handicaps), found);
    }

    fn note_lost(
        &mut self,
        now_ms: u64,
        t: &Tracer,
        shown: bool,
        handicaps: &Handicaps,
        found: &mut Findings,
    ) {
        if shown || !t.says {
            self.lost_ms.remove(&t.uav);
            return;
        }
        let from_ms = *self.lost_ms.entry(t.uav).or_insert(now_ms);
        let bound_ms = handicaps.grown_ms(LOST_MS, from_ms, now_ms);
        let lost_ms = now_ms.saturating_sub(from_ms);
        if lost_ms > bound_ms && self.told_lost.insert(t.uav) {
            found.broken("trace", now_ms, Some(t.uav), || {
                format!("says that it flies along a contour, and had none of it in its picture for {lost_ms} ms")
            });
        }
    }

    fn judge_waits(
        &mut self,
        now_ms: u64,
        contour: &Contour,
        (flyers, handicaps): (&BTreeMap<u16, Flyer>, &Handicaps),
        found: &mut Findings,
    ) {
        let speeds = self.tracers.iter().filter_map(|id| flyers.get(id));
        let speeds: Vec<f64> = speeds.map(|f| f.slowest_mps).collect();
        let slowest_mps = speeds.iter().copied().fold(f64::INFINITY, f64::min);
        if !slowest_mps.is_finite() || slowest_mps <= 0.0 {
            return;
        }
        let length_m = length_m(&contour.line(now_ms));
        self.least_wait_s = length_m / speeds.iter().sum::<f64>();
        let whole_m = if contour.is_closed() {
            length_m
        } else {
            2.0 * length_m
        };
        let round_ms = milliseconds(whole_m / (SLOWED * slowest_mps));
        let late = |id: &u16| handicaps.late_ms(*id, self.since_ms, now_ms);
        let late_ms = self.tracers.iter().map(late).max().unwrap_or(0);
        let bound_ms = handicaps.grown_ms(2 * round_ms + JOIN_MS, self.since_ms, now_ms) + late_ms;
        let since_ms = self.since_ms;
        let waits = |seen: &Option<(u64, u64)>| {
            let from_ms = seen.map_or(since_ms, |(last, _)| last.max(since_ms));
            now_ms.saturating_sub(from_ms)
        };
        let longest_ms = self.seen.iter().map(waits).max().unwrap_or(0);
        if longest_ms > bound_ms && !core::mem::replace(&mut self.told_waits, true) {
            let n = self.tracers.len();
            found.broken("trace", now_ms, None, || {
                format!("{n} UAVs fly along a contour, and a place of it was in no picture for {longest_ms} ms (bound {bound_ms} ms)")
            });
        }
    }

    /// Whether what is told is to be compared with truth now.
    #[must_use]
    pub fn is_due(&self, now_ms: u64) -> bool {
        now_ms >= self.compared_ms + COMPARED_MS
    }

    /// What one peer knows, by all that was told, beside truth.
    pub fn on_told(
        &mut self,
        now_ms: u64,
        contour: &Contour,
        (peer, stretches): (u16, &[Stretch]),
        found: &mut Findings,
    ) {
        self.compared_ms = now_ms;
        let (mut sum_m, mut count, mut worst_m) = (0.0, 0_u32, 0.0_f64);
        for mark in stretches.iter().flat_map(|s| &s.marks) {
            let off_m = off_line_m(&contour.line(mark.seen_ms), mark.at);
            sum_m += off_m;
            count += 1;
            worst_m = worst_m.max(off_m);
            if off_m > OFF_MOST_M && !core::mem::replace(&mut self.told_off, true) {
                found.broken("contour", now_ms, Some(peer), || {
                    format!(
                        "was told of a place of the contour at ({:.1}, {:.1}) m, {off_m:.1} m from where it was then",
                        mark.at.x, mark.at.y
                    )
                });
            }
        }
        if count == 0 {
            return;
        }
        let told = outline(stretches);
        let places = contour.places(now_ms);
        let away: Vec<f64> = places.iter().map(|p| off_outline_m(&told, *p)).collect();
        let known = away.iter().filter(|m| **m <= KNOWN_M).count();
        let r = &mut self.report;
        r.closed = contour.is_closed();
        r.length_m = length_m(&contour.line(now_ms));
        r.known_share = share(known, places.len());
        r.told_error_m = (sum_m / f64::from(count), worst_m);
        let mean_m = away.iter().sum::<f64>() / f64::from(u32::try_from(away.len()).unwrap_or(1));
        r.apart_m = (mean_m, away.iter().copied().fold(0.0, f64::max));
        if r.known_share > 0.5 {
            self.apart = (self.apart.0 + mean_m, self.apart.1 + 1);
        }
        let truth_m2 = area_m2(&places).abs();
        let error = told.area_m2().map(|m2| (m2 - truth_m2).abs() / truth_m2);
        if let Some(error) = error.filter(|_| r.closed) {
            self.area = (self.area.0 + error, self.area.1 + 1);
            r.area_error = Some((error, self.area.0 / f64::from(self.area.1)));
        }
    }

    /// What it came to; none where nobody flew along it.
    #[must_use]
    pub fn report(&self) -> Option<ContourReport> {
        let since_ms = self.first_ms?;
        let seen = self.seen.iter().flatten().count();
        let middle_ms = since_ms + self.last_ms.saturating_sub(since_ms) / 2;
        let late = self.waits.iter().filter(|(at, _)| *at >= middle_ms);
        let still = self.seen.iter().flatten();
        let still = still.map(|(last, _)| self.last_ms.saturating_sub(*last));
        let longest_ms = late.map(|(_, ms)| *ms).chain(still).max().unwrap_or(0);
        let all_seen_ms = (seen == self.seen.len())
            .then(|| self.seen.iter().flatten().map(|(_, first)| *first).max())
            .flatten();
        Some(ContourReport {
            seen_share: share(seen, self.seen.len()),
            apart_over_time_m: self.apart.0 / f64::from(self.apart.1.max(1)),
            pictured_share: seconds(self.pictured_ms) / seconds(self.traced_ms).max(1e-3),
            longest_wait_s: seconds(longest_ms),
            least_wait_s: self.least_wait_s,
            since_ms: Some(since_ms),
            all_seen_ms,
            ..self.report.clone()
        })
    }
}

impl ContourReport {
    /// It in a line, for people.
    #[must_use]
    pub fn line(&self) -> String {
        let what = if self.closed { "edge" } else { "road" };
        let area = self.area_error.map_or_else(String::new, |(end, mean)| {
            format!(
                ", area off by {:.1} % ({:.1} % over time)",
                100.0 * end,
                100.0 * mean
            )
        });
        let at_s =
            |ms: Option<u64>| ms.map_or_else(|| "-".to_owned(), |ms| format!("{:.0}", seconds(ms)));
        format!(
            "{what} of {:.0} m, flown along from {} s on, all seen by {} s, {:.1} % seen, {:.1} % known at the end; told within {:.1} m ({:.1} m at most), apart by {:.1} m ({:.1} m at most, {:.1} m over time){area}; in the picture {:.1} % of the time, a place waits {:.0} s at most (least {:.0} s)",
            self.length_m,
            at_s(self.since_ms),
            at_s(self.all_seen_ms),
            100.0 * self.seen_share,
            100.0 * self.known_share,
            self.told_error_m.0,
            self.told_error_m.1,
            self.apart_m.0,
            self.apart_m.1,
            self.apart_over_time_m,
            100.0 * self.pictured_share,
            self.longest_wait_s,
            self.least_wait_s
        )
    }
}

#[allow(clippy::cast_precision_loss, reason = "some hundred places")]
fn share(of: usize, all: usize) -> f64 {
    of as f64 / all.max(1) as f64
}

fn off_line_m(line: &[Point], p: Point) -> f64 {
    let each = line.windows(2).map(|b| point_segment_m(p, b[0], b[1]));
    each.fold(f64::INFINITY, f64::min)
}

/// How far a place is from what is told; the end of a closed one goes on to its begin.
fn off_outline_m(told: &Outline, p: Point) -> f64 {
    let mut off_m = f64::INFINITY;
    for (i, piece) in told.pieces.iter().enumerate() {
        let mut line: Vec<Point> = piece.iter().map(|m| m.at).collect();
        if i == 0 && told.closed {
            line.extend(line.first().copied());
        }
        off_m = off_m.min(off_line_m(&line, p));
        off_m = line.iter().map(|q| (p - q).norm()).fold(off_m, f64::min);
    }
    off_m.min(10_000.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::{ContourSpec, RoadSpec};
    use skein_flight::tracing::thread::Mark;

    fn road() -> Contour {
        let way = vec![Point::new(0.0, 0.0), Point::new(900.0, 0.0)];
        Contour::new(&ContourSpec::Road(RoadSpec { way, sway_m: 0.0 }), 1)
    }

    /// Flies along the road to and fro at a speed, m/s, telling places so far beside it, metres;
    /// the rules that are broken.
    fn broken(mps: f64, off_m: f64, sees: bool) -> Vec<String> {
        let contour = road();
        let (mut check, mut found) = (ContourCheck::default(), Findings::new(1));
        let flyer = Flyer {
            turn_radius_m: 20.0,
            slowest_mps: 12.0,
            fastest_mps: 12.0,
            waits_within_m: 100.0,
        };
        let flyers = BTreeMap::from([(1, flyer)]);
        let handicaps = Handicaps::default();
        for t in 0..1_200_u32 {
            let m = (mps * f64::from(t)).rem_euclid(1_800.0);
            let at = if m > 900.0 { 1_800.0 - m } else { m };
            let shows = |p: &Point| sees && (p.x - at).abs() < 40.0;
            let tracer = Tracer {
                uav: 1,
                is_to: true,
                says: true,
                pictured: contour.places(0).iter().map(shows).collect(),
            };
            let now_ms = 1_000 * u64::from(t);
            check.on_looks(
                now_ms,
                &contour,
                &[tracer],
                (&flyers, &handicaps),
                &mut found,
            );
            if check.is_due(now_ms) {
                let mark = |k: u32| Mark {
                    at: Point::new(30.0 * f64::from(k), off_m),
                    seen_ms: 0,
                    begins: k == 0,
                };
                let stretch = Stretch {
                    marks: (0..31).map(mark).collect(),
                    sided: false,
                };
                check.on_told(now_ms, &contour, (100, &[stretch]), &mut found);
            }
        }
        let report = check.report().unwrap();
        if mps > 0.0 && sees {
            assert!((report.seen_share - 1.0).abs() < 1e-9, "{report:?}");
            assert!((report.told_error_m.0 - off_m.abs()).abs() < 1e-6);
        }
        found.counts.keys().map(|k| k.to_string()).collect()
    }

    #[test]
    fn who_flies_along_tells_where_it_is() {
        assert!(broken(12.0, 5.0, true).is_empty());
    }

    #[test]
    fn what_is_told_elsewhere_breaks_a_rule() {
        assert_eq!(broken(12.0, 40.0, true), ["contour"]);
    }

    #[test]
    fn who_hangs_or_has_lost_it_breaks_a_rule() {
        assert_eq!(broken(0.0, 5.0, true), ["trace"]);
        assert_eq!(broken(12.0, 5.0, false), ["trace"]);
    }
}
