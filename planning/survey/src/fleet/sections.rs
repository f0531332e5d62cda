//! An area divided into one connected section for each crew, the UAVs of like swath, so
//! that each flies lanes of its own width (D2.7 §3.6 with §3.1: unlike sensors).
//!
//! Straight cuts, all in one heading, part the area into bands; a cut goes from border to
//! border, so that both sides stay whole. Their sizes follow from what each crew sees in a
//! time, the ways out included, and are then evened by what the plans of the sections
//! take. Leaves to the caller how a section is planned.

use skein_flight::coverage::passes::sweep_directions;
use skein_geometry::Polygon;
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::{PI, sin_cos};

/// Rounds of evening that a plan is worth: each about halves what the sections differ by.
pub const ROUNDS: usize = 4;

/// The most crews: with more, sections are hardly wider than their lanes.
pub const MOST_CREWS: usize = 6;

/// Swaths that differ by less than this share are alike: turns cost more than that.
const ALIKE: f64 = 0.05;

/// A crew whose share of the area is less than this gets none of it.
const LEAST_SHARE: f64 = 0.01;

/// Sides of the lattice by which blocked ground is measured.
const LATTICE: usize = 30;

/// Headings of cuts that are compared: along and across the best lanes.
const HEADINGS: usize = 2;

/// Orders of so many crews are all compared.
const ALL_ORDERS: usize = 3;

/// Strips between corners in which a cut is looked for, at most.
const MOST_STRIPS: usize = 64;

/// Halvings of a strip: a millionth of it.
const HALVINGS: usize = 24;

/// A cut may miss its share of the area by so much for being shorter.
const SHARE_SLACK: f64 = 0.002;

/// In a round a section grows or shrinks by this factor at most.
const MOST_CHANGE: f64 = 2.0;

/// A UAV of a crew.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uav {
    /// Where it starts and ends.
    pub start: Point,
    /// Its speed, m/s.
    pub speed_mps: f64,
    /// How long it flies at most, seconds.
    pub endurance_s: f64,
}

/// UAVs of like swath.
#[derive(Clone, Debug, PartialEq)]
pub struct Crew {
    /// The narrowest swath, metres: the width of its lanes.
    pub swath_m: f64,
    /// The widest turn, metres.
    pub turn_radius_m: f64,
    /// Its UAVs.
    pub uavs: Vec<Uav>,
}

impl Crew {
    /// When each UAV of the crew is at the area and has to be home again, seconds.
    fn ways_s(&self, area: &Polygon) -> Vec<f64> {
        let way = |m: &Uav| 2.0 * area.distance_m(m.start) / m.speed_mps;
        self.uavs.iter().map(way).collect()
    }

    /// What it sees in a time, square metres.
    fn sees_m2(&self, ways_s: &[f64], time_s: f64) -> f64 {
        let each = self.uavs.iter().zip(ways_s).map(|(m, way)| {
            let work_s = time_s.min(m.endurance_s) - way;
            self.swath_m * m.speed_mps * work_s.max(0.0)
        });
        each.sum()
    }

    /// About how long it takes for a section, seconds.
    fn guess_s(&self, section: &Polygon, open_m2: f64) -> f64 {
        let speed: f64 = self.uavs.iter().map(|m| m.speed_mps).sum();
        let ways = self.ways_s(section);
        let way_s = ways.iter().sum::<f64>() / ways.len().max(1) as f64;
        let ring = section.vertices();
        let across_m = sweep_directions(&[ring]).first().map_or(0.0, |d| d.1);
        let turns = (across_m / self.swath_m).ceil();
        let turn_m = (PI * self.turn_radius_m).max(self.swath_m);
        (open_m2 / self.swath_m + turns * turn_m) / speed.max(f64::MIN_POSITIVE) + way_s
    }
}

/// UAVs by index, those of like swath together, the narrowest first; at most
/// [`MOST_CREWS`] groups, the nearest ones joined.
#[must_use]
pub fn alike(swaths_m: &[f64]) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..swaths_m.len()).collect();
    order.sort_by(|a, b| swaths_m[*a].total_cmp(&swaths_m[*b]).then(a.cmp(b)));
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for uav in order {
        match groups.last_mut() {
            Some(g) if swaths_m[uav] <= swaths_m[g[0]] * (1.0 + ALIKE) => g.push(uav),
            _ => groups.push(vec![uav]),
        }
    }
    while groups.len() > MOST_CREWS {
        let ratio = |i: &usize| swaths_m[groups[i + 1][0]] / swaths_m[groups[*i][0]];
        let nearest = (0..groups.len() - 1).min_by(|a, b| ratio(a).total_cmp(&ratio(b)));
        let joined = groups.remove(nearest.unwrap_or(0) + 1);
        groups[nearest.unwrap_or(0)].extend(joined);
    }
    for group in &mut groups {
        group.sort_unstable();
    }
    groups
}

/// An area of which parts need not, or cannot, be seen.
#[derive(Clone, Debug)]
pub struct OpenArea<'a> {
    area: &'a Polygon,
    /// Points of a lattice in holes and zones.
    blocked: Vec<Point>,
    /// What one of these points stands for, square metres.
    blocked_m2: f64,
}

impl<'a> OpenArea<'a> {
    /// The area without `blocked`: holes and zones, which may overlap.
    #[must_use]
    pub fn new(area: &'a Polygon, blocked: &[&Polygon]) -> Self {
        let (low, high) = area.bounds();
        let step = (high - low) / LATTICE as f64;
        let mut points = Vec::new();
        if !blocked.is_empty() {
            for i in 0..LATTICE * LATTICE {
                let (row, col) = ((i / LATTICE) as f64, (i % LATTICE) as f64);
                let p = low + Vector::new(step.x * (col + 0.5), step.y * (row + 0.5));
                if area.contains(p) && blocked.iter().any(|b| b.contains(p)) {
                    points.push(p);
                }
            }
        }
        Self {
            area,
            blocked: points,
            blocked_m2: step.x * step.y,
        }
    }

    /// What is to be seen inside a ring, square metres.
    fn open_m2(&self, ring: &[Point]) -> f64 {
        let blocked = self.blocked.iter().filter(|p| holds(ring, **p)).count();
        (area_m2(ring) - self.blocked_m2 * blocked as f64).max(0.0)
    }

    /// By crew: its share of the area, so that all are done at one time as far as
    /// endurance lets them; none for a crew that can do next to nothing.
    #[must_use]
    pub fn shares(&self, crews: &[Crew]) -> Vec<f64> {
        let open_m2 = self.open_m2(self.area.vertices());
        let ways: Vec<Vec<f64>> = crews.iter().map(|c| c.ways_s(self.area)).collect();
        let seen = |time_s: f64| -> Vec<f64> {
            let each = crews.iter().zip(&ways);
            each.map(|(c, w)| c.sees_m2(w, time_s)).collect()
        };
        let enough = |time_s: f64| seen(time_s).iter().sum::<f64>() >= open_m2;
        let (mut low, mut high) = (0.0, 1.0);
        // Up to three hundred years; a team that needs longer has not the endurance.
        while !enough(high) && high < 1e10 {
            (low, high) = (high, high * 2.0);
        }
        for _ in 0..HALVINGS {
            let middle = f64::midpoint(low, high);
            if enough(middle) {
                high = middle;
            } else {
                low = middle;
            }
        }
        normal(&seen(high))
    }
}

/// Shares of one, without those that are next to nothing.
fn normal(shares: &[f64]) -> Vec<f64> {
    let sum: f64 = shares.iter().sum();
    let kept = |s: &f64| if *s < LEAST_SHARE * sum { 0.0 } else { *s };
    let kept: Vec<f64> = shares.iter().map(kept).collect();
    let sum: f64 = kept.iter().sum();
    kept.into_iter()
        .map(|s| s / sum.max(f64::MIN_POSITIVE))
        .collect()
}

/// How an area is cut into bands.
#[derive(Clone, Debug, PartialEq)]
pub struct Style {
    /// The heading of all cuts, radians counter-clockwise from east.
    pub heading_rad: f64,
    /// The crews from left to right of that heading.
    pub order: Vec<usize>,
}

/// Ways to cut the area for crews with these shares, the most promising first.
#[must_use]
pub fn styles(open_area: &OpenArea<'_>, crews: &[Crew], shares: &[f64]) -> Vec<Style> {
    let ring = open_area.area.vertices();
    let lanes = sweep_directions(&[ring]);
    let mut headings: Vec<f64> = Vec::new();
    for (heading, _) in lanes.into_iter().take(HEADINGS) {
        headings.extend([heading, heading + PI / 2.0]);
    }
    let mut all: Vec<(f64, Style)> = Vec::new();
    for heading_rad in headings {
        for order in orders(crews, shares, heading_rad) {
            let style = Style { heading_rad, order };
            let Some(sections) = bands(open_area, &style, shares) else {
                continue;
            };
            let guess = |(section, crew): (&Option<Polygon>, &Crew)| match section {
                Some(s) => crew.guess_s(s, open_area.open_m2(s.vertices())),
                None => 0.0,
            };
            let longest = sections.iter().zip(crews).map(guess).fold(0.0, f64::max);
            all.push((longest, style));
        }
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all.into_iter().map(|(_, style)| style).collect()
}

/// Orders of the crews that have a share: all of few, else by where they start.
fn orders(crews: &[Crew], shares: &[f64], heading_rad: f64) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..crews.len()).filter(|i| shares[*i] > 0.0).collect();
    if order.len() <= ALL_ORDERS {
        return permutations(&order);
    }
    let (s, c) = sin_cos(heading_rad);
    let across = |i: &usize| {
        let uavs = &crews[*i].uavs;
        let sum: f64 = uavs.iter().map(|m| m.start.x * s - m.start.y * c).sum();
        sum / uavs.len().max(1) as f64
    };
    order.sort_by(|a, b| across(a).total_cmp(&across(b)).then(a.cmp(b)));
    let back = order.iter().rev().copied().collect();
    vec![order, back]
}

fn permutations(items: &[usize]) -> Vec<Vec<usize>> {
    if items.len() < 2 {
        return vec![items.to_vec()];
    }
    let mut all = Vec::new();
    for (i, first) in items.iter().enumerate() {
        let mut rest = items.to_vec();
        rest.remove(i);
        for tail in permutations(&rest) {
            all.push(std::iter::once(*first).chain(tail).collect());
        }
    }
    all
}

/// By crew: its section; `None` for one without a share. Nothing when the area cannot be
/// cut like that.
///
/// # Guarantees
/// Sections are connected and share their borders exactly: together they are the area.
#[must_use]
pub fn bands(
    open_area: &OpenArea<'_>,
    style: &Style,
    shares: &[f64],
) -> Option<Vec<Option<Polygon>>> {
    let mut sections = vec![None; shares.len()];
    let mut rest = open_area.area.clone();
    let (last, first) = style.order.split_last()?;
    let total_m2 = open_area.open_m2(rest.vertices());
    for crew in first {
        let want_m2 = shares[*crew] * total_m2;
        let (left, right) = cut(open_area, &rest, style.heading_rad, want_m2)?;
        sections[*crew] = Some(left);
        rest = right;
    }
    sections[*last] = Some(rest);
    Some(sections)
}

/// A polygon as points of the turned frame: cuts run along `y`, the sections lie along
/// `x`.
struct Turned<'a> {
    ring: &'a [Point],
    xs: Vec<f64>,
    along: Vector,
}

/// A cut: where it crosses the border, from below to above, behind which corner.
#[derive(Clone, Copy)]
struct Chord {
    low: (usize, Point),
    high: (usize, Point),
}

impl<'a> Turned<'a> {
    fn new(ring: &'a [Point], heading_rad: f64) -> Self {
        let (s, c) = sin_cos(heading_rad);
        let along = Vector::new(c, s);
        let across = |p: &Point| p.x * along.y - p.y * along.x;
        Self {
            ring,
            xs: ring.iter().map(across).collect(),
            along,
        }
    }

    /// The cuts at `x` that lie inside, from below to above.
    fn chords(&self, x: f64) -> Vec<Chord> {
        let n = self.ring.len();
        let mut crossings = Vec::new();
        for i in 0..n {
            let j = (i + 1) % n;
            if (self.xs[i] < x) != (self.xs[j] < x) {
                let t = (x - self.xs[i]) / (self.xs[j] - self.xs[i]);
                let p = self.ring[i] + (self.ring[j] - self.ring[i]) * t;
                crossings.push((i, p));
            }
        }
        let height = |p: &Point| p.coords.dot(&self.along);
        crossings.sort_by(|a, b| height(&a.1).total_cmp(&height(&b.1)));
        crossings
            .chunks_exact(2)
            .map(|c| Chord {
                low: c[0],
                high: c[1],
            })
            .collect()
    }

    /// The two sides of a cut.
    fn sides(&self, chord: &Chord) -> (Vec<Point>, Vec<Point>) {
        // Counter-clockwise with the inside to the left: a ring that goes up along the
        // cut lies on its left.
        let walk = |from: (usize, Point), to: (usize, Point)| {
            let n = self.ring.len();
            let mut ring = vec![from.1];
            let mut i = from.0;
            while i != to.0 {
                i = (i + 1) % n;
                ring.push(self.ring[i]);
            }
            ring.push(to.1);
            ring
        };
        (walk(chord.high, chord.low), walk(chord.low, chord.high))
    }
}

/// Cuts off a left part with `want_m2` to be seen, or what comes nearest to that; of cuts
/// that do, the shortest.
fn cut(
    open_area: &OpenArea<'_>,
    polygon: &Polygon,
    heading_rad: f64,
    want_m2: f64,
) -> Option<(Polygon, Polygon)> {
    let turned = Turned::new(polygon.vertices(), heading_rad);
    let slack_m2 = SHARE_SLACK * open_area.open_m2(polygon.vertices());
    let mut best: Option<(f64, f64, Chord)> = None;
    let mut look = |x: f64, nth: usize| -> Option<f64> {
        let chord = *turned.chords(x).get(nth)?;
        let left_m2 = open_area.open_m2(&turned.sides(&chord).0);
        let miss = ((left_m2 - want_m2).abs() - slack_m2).max(0.0);
        let length = (chord.high.1 - chord.low.1).norm();
        let first = best
            .as_ref()
            .is_none_or(|(m, l, _)| miss.total_cmp(m).then(length.total_cmp(l)).is_lt());
        if first {
            best = Some((miss, length, chord));
        }
        Some(left_m2)
    };
    for (from, to) in strips(&turned.xs) {
        let margin = 1e-6 * (to - from);
        let n = turned.chords(f64::midpoint(from, to)).len();
        for nth in 0..n {
            let (mut low, mut high) = (from + margin, to - margin);
            let ends = look(low, nth).zip(look(high, nth));
            if ends.is_none_or(|(a, b)| a.min(b) > want_m2 || a.max(b) < want_m2) {
                continue;
            }
            for _ in 0..HALVINGS {
                let middle = f64::midpoint(low, high);
                match look(middle, nth) {
                    Some(left_m2) if left_m2 < want_m2 => low = middle,
                    _ => high = middle,
                }
            }
        }
    }
    let (left, right) = turned.sides(&best?.2);
    // A cut through a corner or along an edge leaves no two polygons.
    Polygon::new(left).ok().zip(Polygon::new(right).ok())
}

/// Intervals between the corners, not more than can be looked through.
fn strips(xs: &[f64]) -> Vec<(f64, f64)> {
    let mut sorted = xs.to_vec();
    sorted.sort_by(f64::total_cmp);
    let most = sorted
        .last()
        .zip(sorted.first())
        .map_or(0.0, |(b, a)| b - a);
    sorted.dedup_by(|b, a| *b - *a <= 1e-9 * most);
    let every = sorted.len().div_ceil(MOST_STRIPS).max(1);
    let last = sorted.last().copied();
    let mut kept: Vec<f64> = sorted.into_iter().step_by(every).collect();
    if let Some(last) = last
        && kept.last().is_some_and(|k| *k < last)
    {
        kept.push(last);
    }
    kept.windows(2).map(|w| (w[0], w[1])).collect()
}

/// What planning the sections came to.
#[derive(Clone, Debug)]
pub struct Outcome<T> {
    /// By crew: how long its section takes, seconds; longer where it cannot do all of it.
    pub times_s: Vec<f64>,
    /// What the caller made of it.
    pub plan: T,
}

/// Plans sections and moves their borders `rounds` times so that all take about as long;
/// the best plan of all rounds.
///
/// `plan` may have nothing for some sections; `better(a, b)` tells whether `a` is strictly
/// better.
pub fn evened<T>(
    open_area: &OpenArea<'_>,
    crews: &[Crew],
    style: &Style,
    first: &[f64],
    rounds: usize,
    mut plan: impl FnMut(&[Option<Polygon>]) -> Option<Outcome<T>>,
    better: impl Fn(&T, &T) -> bool,
) -> Option<T> {
    let mut shares = first.to_vec();
    let mut best: Option<T> = None;
    for _ in 0..=rounds {
        let Some(sections) = bands(open_area, style, &shares) else {
            break;
        };
        let Some(outcome) = plan(&sections) else {
            break;
        };
        shares = moved(&shares, crews, &sections, &outcome.times_s);
        if best.as_ref().is_none_or(|b| better(&outcome.plan, b)) {
            best = Some(outcome.plan);
        }
    }
    best
}

/// The shares with which all would be done at one time, if work takes as long as it did.
fn moved(
    shares: &[f64],
    crews: &[Crew],
    sections: &[Option<Polygon>],
    times_s: &[f64],
) -> Vec<f64> {
    let aim_s: f64 = shares.iter().zip(times_s).map(|(s, t)| s * t).sum();
    let next = sections.iter().enumerate().map(|(i, section)| {
        let Some(section) = section else {
            return 0.0;
        };
        let ways = crews[i].ways_s(section);
        let way_s = ways.iter().sum::<f64>() / ways.len().max(1) as f64;
        let (now, then) = (times_s[i] - way_s, aim_s - way_s);
        let factor = if now > 0.0 { then / now } else { MOST_CHANGE };
        shares[i] * factor.clamp(1.0 / MOST_CHANGE, MOST_CHANGE)
    });
    let next: Vec<f64> = next.collect();
    normal(&next)
}

/// Area of a ring that runs counter-clockwise, square metres.
fn area_m2(ring: &[Point]) -> f64 {
    let Some(o) = ring.first() else {
        return 0.0;
    };
    let n = ring.len();
    let twice: f64 = (0..n)
        .map(|i| (ring[i] - o).perp(&(ring[(i + 1) % n] - o)))
        .sum();
    twice / 2.0
}

/// Whether a point lies in a ring; on its border either may be said.
fn holds(ring: &[Point], p: Point) -> bool {
    let n = ring.len();
    (0..n).fold(false, |inside, i| {
        let (a, b) = (ring[i], ring[(i + 1) % n]);
        let spans = (a.y <= p.y) != (b.y <= p.y);
        inside ^ (spans && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn polygon(points: &[(f64, f64)]) -> Polygon {
        Polygon::new(points.iter().map(|&(x, y)| Point::new(x, y)).collect()).unwrap()
    }

    fn rectangle(x: f64, y: f64, w: f64, h: f64) -> Polygon {
        polygon(&[(x, y), (x + w, y), (x + w, y + h), (x, y + h)])
    }

    fn crew(swath_m: f64, start: (f64, f64), n: usize) -> Crew {
        let mate = Uav {
            start: Point::new(start.0, start.1),
            speed_mps: 15.0,
            endurance_s: f64::INFINITY,
        };
        Crew {
            swath_m,
            turn_radius_m: 20.0,
            uavs: vec![mate; n],
        }
    }

    #[test]
    fn like_swaths_are_together_and_many_are_joined() {
        assert_eq!(alike(&[60.0, 30.0, 61.0]), [vec![1], vec![0, 2]]);
        let many: Vec<f64> = (1..=12).map(|i| 10.0 * f64::from(i)).collect();
        let groups = alike(&many);
        assert_eq!(groups.len(), MOST_CREWS);
        assert_eq!(groups.iter().map(Vec::len).sum::<usize>(), 12);
        assert!(alike(&[]).is_empty());
    }

    #[test]
    fn shares_follow_swath_way_and_endurance() {
        let area = rectangle(0.0, 0.0, 1000.0, 1000.0);
        let open_area = OpenArea::new(&area, &[]);
        let near = |crews: &[Crew], shares: [f64; 2]| {
            let found = open_area.shares(crews);
            let close = found.iter().zip(shares).all(|(a, b)| (a - b).abs() < 1e-3);
            assert!(close, "{found:?}");
        };
        near(
            &[crew(30.0, (0.0, 0.0), 1), crew(60.0, (0.0, 0.0), 1)],
            [1.0 / 3.0, 2.0 / 3.0],
        );
        near(
            &[crew(60.0, (0.0, 0.0), 3), crew(60.0, (0.0, 0.0), 1)],
            [0.75, 0.25],
        );
        // 1,000,000 square metres at 900 a second each; one flies 100 s there and back.
        let far = crew(60.0, (-750.0, 500.0), 1);
        near(&[far, crew(60.0, (0.0, 0.0), 1)], [0.455, 0.545]);
        let mut tired = crew(60.0, (0.0, 0.0), 1);
        tired.uavs[0].endurance_s = 100.0;
        near(&[tired.clone(), crew(60.0, (0.0, 0.0), 1)], [0.09, 0.91]);
        tired.uavs[0].endurance_s = 1.0;
        near(&[tired, crew(60.0, (0.0, 0.0), 1)], [0.0, 1.0]);
    }

    #[test]
    fn blocked_ground_is_no_work() {
        let area = rectangle(0.0, 0.0, 1000.0, 300.0);
        let hole = rectangle(0.0, -50.0, 500.0, 400.0);
        let open_area = OpenArea::new(&area, &[&hole]);
        let style = Style {
            heading_rad: PI / 2.0,
            order: vec![1, 0],
        };
        let sections = bands(&open_area, &style, &[0.5, 0.5]).unwrap();
        let (low, high) = sections[1].as_ref().unwrap().bounds();
        assert!(low.x < 1.0 && (high.x - 750.0).abs() < 20.0, "{high}");
    }

    #[test]
    fn sections_are_evened_by_what_they_take() {
        let area = rectangle(0.0, 0.0, 900.0, 300.0);
        let open_area = OpenArea::new(&area, &[]);
        let crews = [crew(60.0, (0.0, 0.0), 1), crew(60.0, (0.0, 0.0), 1)];
        let style = &styles(&open_area, &crews, &[0.5, 0.5])[0];
        // The second crew takes four times as long as was thought.
        let plan = |sections: &[Option<Polygon>]| {
            let area = |i: usize| sections[i].as_ref().unwrap().area_m2();
            let times_s = vec![area(0), 4.0 * area(1)];
            let longest = times_s.iter().copied().fold(0.0, f64::max);
            Some(Outcome {
                times_s,
                plan: longest,
            })
        };
        let best = evened(
            &open_area,
            &crews,
            style,
            &[0.5, 0.5],
            ROUNDS,
            plan,
            |a, b| a < b,
        )
        .unwrap();
        let even = 0.8 * 270_000.0;
        assert!((best - even).abs() < 0.02 * even, "{best}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]

        #[test]
        fn sections_are_the_area_in_the_shares_that_were_asked_for(
            radii in prop::collection::vec(80.0..400.0f64, 3..12),
            parts in prop::collection::vec(1.0..4.0f64, 2..5),
            heading_rad in -3.0..3.0f64,
        ) {
            let n = radii.len() as f64;
            let corner = |(i, r): (usize, &f64)| {
                let (s, c) = sin_cos(2.0 * PI * i as f64 / n);
                Point::new(r * c, r * s)
            };
            let ring: Vec<Point> = radii.iter().enumerate().map(corner).collect();
            let Ok(area) = Polygon::new(ring) else { return Ok(()) };
            let open_area = OpenArea::new(&area, &[]);
            let shares = normal(&parts);
            let style = Style { heading_rad, order: (0..parts.len()).collect() };
            let Some(sections) = bands(&open_area, &style, &shares) else { return Ok(()) };
            let all: f64 = sections.iter().flatten().map(Polygon::area_m2).sum();
            prop_assert!((all - area.area_m2()).abs() < 1e-6 * all);
            let (low, high) = area.bounds();
            for i in 0..400u32 {
                let at = Vector::new(f64::from(i % 20) + 0.5, f64::from(i / 20) + 0.5) / 20.0;
                let p = low + (high - low).component_mul(&at);
                let of = sections.iter().flatten().filter(|s| s.contains(p)).count();
                // On a common border a point is in two.
                prop_assert!(area.contains(p) == (of > 0) && of < 3, "{p} is in {of}");
            }
        }

        #[test]
        fn a_convex_area_is_cut_to_size(
            w in 100.0..2000.0f64, h in 100.0..2000.0f64, share in 0.05..0.95f64, heading_rad in -3.0..3.0f64,
        ) {
            let area = rectangle(-50.0, 20.0, w, h);
            let open_area = OpenArea::new(&area, &[]);
            let style = Style { heading_rad, order: vec![0, 1] };
            let sections = bands(&open_area, &style, &[share, 1.0 - share]).unwrap();
            let first = sections[0].as_ref().unwrap().area_m2() / area.area_m2();
            prop_assert!((first - share).abs() < 2.0 * SHARE_SLACK, "{first}");
        }
    }
}
