//! The rules of a plan, and what it comes to by them.

use crate::VerifyError;
use crate::air::Air;
use crate::boxes::{Bounds, Tree};
use crate::ground::{Ground, Named};
use crate::outline::Side;
use crate::path::{Path, Piece};
use crate::plan::{Flight, Plan, Wind};
use crate::plane::{Plane, Point};
use crate::seen::{Look, seen};
use core::f64::consts::{PI, TAU};
use libm::tan;
use skein_interop::place::LatLon;
use std::collections::BTreeMap;

/// The widest gap between two pieces, metres.
pub const GAP_M: f64 = 0.01;

/// The widest bend between two pieces, degrees.
pub const BEND_DEG: f64 = 0.01;

/// Gaps and bends of one flight add up to no more than so many of the widest.
const IN_ALL: f64 = 10.0;

/// How far a claimed length or time may be off, as a share.
pub const CLAIM_SHARE: f64 = 0.01;

/// Below this a length or time is not compared, metres or seconds.
const CLAIM_LEAST: f64 = 0.1;

/// How far a claimed share of the area may be off.
pub const COVERED_SHARE: f64 = 0.005;

/// Violations that are told one by one; the others are counted.
pub const MOST_TOLD: usize = 1000;

/// What is asked for beside what the plan says, which it replaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Distance from zones and holes, metres.
    pub clearance_m: Option<f64>,
    /// Distance from inclusion fences, metres; the clearance by default.
    pub fence_clearance_m: Option<f64>,
    /// Turn radius, metres.
    pub turn_radius_m: Option<f64>,
    /// Width of the ground that is seen, metres.
    pub swath_m: Option<f64>,
    /// How far a camera sees before and behind, metres; half the swath by default.
    pub look_ahead_m: Option<f64>,
    /// Airspeed, m/s.
    pub speed_mps: Option<f64>,
    /// Whether holes of the area may be flown over.
    pub cross_holes: bool,
    /// The least share of the area to be seen.
    pub min_share: Option<f64>,
    /// How much nearer and tighter than asked for is no violation, metres.
    pub tolerance_m: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            clearance_m: None,
            fence_clearance_m: None,
            turn_radius_m: None,
            swath_m: None,
            look_ahead_m: None,
            speed_mps: None,
            cross_holes: false,
            min_share: None,
            tolerance_m: 0.001,
        }
    }
}

impl Settings {
    fn check(&self) -> Result<(), VerifyError> {
        let each = [
            ("clearance-m", self.clearance_m, 0.0),
            ("fence-clearance-m", self.fence_clearance_m, 0.0),
            ("turn-radius-m", self.turn_radius_m, 1e-3),
            ("swath-m", self.swath_m, 1e-3),
            ("look-ahead-m", self.look_ahead_m, 0.0),
            ("speed-mps", self.speed_mps, 1e-3),
            ("min-share", self.min_share, 0.0),
            ("tolerance-m", Some(self.tolerance_m), 0.0),
        ];
        for (flag, value, least) in each {
            let most = if flag == "min-share" { 1.0 } else { 1e6 };
            match value {
                Some(v) if !(least..=most).contains(&v) => {
                    return Err(VerifyError::Setting {
                        flag,
                        problem: format!("must be between {least} and {most}, found {v}"),
                    });
                }
                _ => {}
            }
        }
        Ok(())
    }
}

/// A rule of a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Rule {
    /// Pieces are lines and arcs that can be measured.
    Piece,
    /// Pieces follow on each other without a gap.
    Gap,
    /// Pieces follow on each other without a bend.
    Bend,
    /// A flight begins and ends where the plan says.
    Ends,
    /// No arc is tighter than the turn radius.
    Radius,
    /// Zones are kept clear of.
    Zone,
    /// Holes of the area are kept clear of.
    Hole,
    /// Inclusion fences are stayed within.
    Fence,
    /// Lengths are what the plan says.
    Length,
    /// Times are what the plan says.
    Time,
    /// The makespan is what the plan says.
    Makespan,
    /// The share seen is what the plan says.
    Share,
    /// The share seen is what was asked for.
    LeastShare,
}

impl Rule {
    /// Its name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Piece => "piece",
            Self::Gap => "gap",
            Self::Bend => "bend",
            Self::Ends => "ends",
            Self::Radius => "radius",
            Self::Zone => "zone",
            Self::Hole => "hole",
            Self::Fence => "fence",
            Self::Length => "length",
            Self::Time => "time",
            Self::Makespan => "makespan",
            Self::Share => "share",
            Self::LeastShare => "least_share",
        }
    }
}

/// A place on a flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// How far along, metres.
    pub along_m: f64,
    /// When, seconds, if the speed is known.
    pub time_s: Option<f64>,
    /// Where.
    pub at: LatLon,
}

impl core::fmt::Display for Spot {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{:.1} m", self.along_m)?;
        if let Some(t) = self.time_s {
            write!(f, " ({t:.1} s)")?;
        }
        write!(f, ", {:.7},{:.7}", self.at.lat_deg, self.at.lon_deg)
    }
}

/// A rule that is broken.
#[derive(Clone, Debug, PartialEq)]
pub struct Violation {
    /// Which flight; none where it is all of them.
    pub flight: Option<String>,
    /// Which rule.
    pub rule: Rule,
    /// Where it is broken first, or most.
    pub spot: Option<Spot>,
    /// What was found.
    pub found: f64,
    /// What was asked for.
    pub asked: f64,
    /// The same for a person, without the name of the flight.
    pub text: String,
}

/// What a flight comes to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FlightRecount {
    /// What the UAV is called.
    pub name: String,
    /// Its pieces.
    pub pieces: usize,
    /// Its length, metres.
    pub length_m: f64,
    /// Distance flown with the camera on, metres.
    pub seeing_m: f64,
    /// How long it takes, seconds, if its speed is known.
    pub time_s: Option<f64>,
    /// The least distance from a zone or hole, metres, negative inside; none where there is
    /// no zone.
    pub to_zone: Option<f64>,
    /// The least distance inside fences, metres, negative outside.
    pub inside_fences: Option<f64>,
    /// The least radius of its arcs, metres.
    pub tightest_m: Option<f64>,
    /// What the plan says: length and time.
    pub claimed: (Option<f64>, Option<f64>),
    /// The turn radius that was asked for, metres.
    pub asked_radius_m: Option<f64>,
}

/// What a plan comes to, and which rules it breaks.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Rules that are broken, at most [`MOST_TOLD`].
    pub violations: Vec<Violation>,
    /// How many are broken in all.
    pub broken: usize,
    /// By flight.
    pub flights: Vec<FlightRecount>,
    /// When the last UAV is back, seconds, if all speeds are known.
    pub makespan_s: Option<f64>,
    /// The length of all flights, metres.
    pub total_m: f64,
    /// The area without zones and holes, square metres, if there is one.
    pub area_m2: Option<f64>,
    /// The share of it that is seen, if the camera is known.
    pub covered_share: Option<f64>,
    /// What the plan says: makespan, length of all, share seen.
    pub claimed: (Option<f64>, Option<f64>, Option<f64>),
    /// The clearance that was asked for, metres.
    pub clearance_m: f64,
    /// The same from fences.
    pub fence_clearance_m: f64,
    /// What is no violation and worth saying.
    pub notices: Vec<String>,
}

impl Report {
    /// Whether no rule is broken.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.broken == 0
    }
}

/// Recounts a plan over its ground.
///
/// # Errors
/// When a setting means nothing, or a share is asked for and cannot be counted.
pub fn recount(plan: &Plan, ground: &Ground, settings: &Settings) -> Result<Report, VerifyError> {
    settings.check()?;
    let clearance_m = settings.clearance_m.or(plan.clearance_m).unwrap_or(0.0);
    let mut desk = Desk {
        plane: plan.plane,
        settings,
        clearance_m,
        fence_clearance_m: settings.fence_clearance_m.unwrap_or(clearance_m),
        obstacles: Obstacles::new(ground, settings.cross_holes),
        fences: &ground.fences,
        unmeasured: false,
        report: Report {
            violations: Vec::new(),
            broken: 0,
            flights: Vec::new(),
            makespan_s: None,
            total_m: 0.0,
            area_m2: None,
            covered_share: None,
            claimed: (
                plan.claims.makespan_s,
                plan.claims.total_m,
                plan.claims.covered_share,
            ),
            clearance_m,
            fence_clearance_m: 0.0,
            notices: [&ground.notices[..], &plan.notices].concat(),
        },
    };
    desk.report.fence_clearance_m = desk.fence_clearance_m;
    let keeps = [&ground.zones, &ground.holes, &ground.fences];
    let told = settings.clearance_m.or(plan.clearance_m).is_some();
    if !told && keeps.iter().any(|list| !list.is_empty()) {
        desk.say("no clearance is told: nobody may be inside of a zone, and may touch it");
    }
    for flight in &plan.flights {
        desk.flight(flight);
    }
    if plan.flights.iter().all(|f| f.pieces.is_empty()) {
        desk.say("nobody flies");
    }
    if !desk.unmeasured {
        desk.all(plan);
        desk.share(plan, ground)?;
    }
    Ok(desk.report)
}

/// Zones and holes, and a tree over them.
struct Obstacles<'a> {
    all: Vec<(Rule, &'a Named)>,
    tree: Tree,
}

impl<'a> Obstacles<'a> {
    fn new(ground: &'a Ground, cross_holes: bool) -> Self {
        let zones = ground.zones.iter().map(|z| (Rule::Zone, z));
        let holes = ground.holes.iter().filter(|_| !cross_holes);
        let holes = holes.map(|h| (Rule::Hole, h));
        let all: Vec<(Rule, &Named)> = zones.chain(holes).collect();
        let boxes: Vec<Bounds> = all.iter().map(|(_, n)| n.outline.bounds()).collect();
        Self {
            tree: Tree::new(&boxes),
            all,
        }
    }
}

/// How a flight lies to one outline.
#[derive(Clone, Copy, Debug)]
struct Entry {
    /// Least distance, negative by how deep it is in, and where.
    clear_m: f64,
    worst_m: f64,
    /// How much of the flight is in, and from where.
    there_m: f64,
    first_m: f64,
}

struct Desk<'a> {
    plane: Plane,
    settings: &'a Settings,
    clearance_m: f64,
    fence_clearance_m: f64,
    obstacles: Obstacles<'a>,
    fences: &'a [Named],
    report: Report,
    /// Whether a flight was left out, so that nothing is told of all together.
    unmeasured: bool,
}

/// A flight, and the air that it flies through where it is known.
struct Track<'a> {
    flight: &'a Flight,
    air: Option<Air>,
}

impl Track<'_> {
    fn spot(&self, plane: Plane, along_m: f64, at: Point) -> Spot {
        Spot {
            along_m,
            time_s: self.time_s(along_m),
            at: plane.place(at),
        }
    }

    /// How long the first metres take, seconds.
    fn time_s(&self, length_m: f64) -> Option<f64> {
        let air = self.air?;
        let (mut left_m, mut time_s) = (length_m, 0.0);
        for piece in &self.flight.pieces {
            time_s += air.time_s(piece, piece.length_m.min(left_m))?;
            left_m = (left_m - piece.length_m).max(0.0);
        }
        Some(time_s)
    }

    /// The tightest radius of an arc, metres; in a wind through the air.
    fn radius_m(&self, piece: &Piece) -> Option<f64> {
        let bent = piece.radius_m.filter(|_| piece.length_m > 0.0)?.abs();
        self.air.map_or(Some(bent), |air| air.radius_m(piece))
    }

    /// The place so far along, found from the beginning.
    fn at(&self, along_m: f64) -> Point {
        let mut left_m = along_m;
        for piece in &self.flight.pieces {
            if left_m <= piece.length_m {
                return piece.at(left_m.max(0.0));
            }
            left_m -= piece.length_m;
        }
        self.flight
            .pieces
            .last()
            .map_or(Point::default(), Piece::end)
    }
}

impl Desk<'_> {
    fn say(&mut self, text: impl Into<String>) {
        if self.report.notices.len() < MOST_TOLD {
            self.report.notices.push(text.into());
        }
    }

    fn broken(
        &mut self,
        flight: Option<&str>,
        rule: Rule,
        spot: Option<Spot>,
        (found, asked): (f64, f64),
        text: String,
    ) {
        self.report.broken += 1;
        if self.report.violations.len() < MOST_TOLD {
            self.report.violations.push(Violation {
                flight: flight.map(str::to_owned),
                rule,
                spot,
                found,
                asked,
                text,
            });
        }
    }

    fn flight(&mut self, flight: &Flight) {
        let speed_mps = self.settings.speed_mps.or(flight.speed_mps);
        let wind_mps = match flight.wind {
            Wind::Calm => Some((0.0, 0.0)),
            Wind::To(east_mps, north_mps) => Some((east_mps, north_mps)),
            Wind::Unknown => None,
        };
        let air = speed_mps.zip(wind_mps);
        let air = air.map(|(airspeed_mps, wind_mps)| Air {
            airspeed_mps,
            wind_mps,
        });
        let track = Track {
            flight,
            air: air.filter(Air::flyable),
        };
        let bad = flight.pieces.iter().enumerate();
        if let Some((i, problem)) = bad.filter_map(|(i, p)| Some((i, p.problem()?))).next() {
            let text = format!("piece {}: {problem}: nothing else of it is judged", i + 1);
            self.broken(Some(&flight.name), Rule::Piece, None, (0.0, 0.0), text);
            self.unmeasured = true;
            return;
        }
        let length_m = flight.length_m();
        let seeing = flight.pieces.iter().filter(|p| p.sees);
        let mut told = FlightRecount {
            name: flight.name.clone(),
            pieces: flight.pieces.len(),
            length_m,
            seeing_m: seeing.fold(0.0, |sum, p| sum + p.length_m),
            time_s: track.time_s(length_m).or((length_m <= 0.0).then_some(0.0)),
            asked_radius_m: self.settings.turn_radius_m.or(flight.turn_radius_m),
            claimed: (flight.claims.length_m, flight.claims.time_s),
            ..FlightRecount::default()
        };
        if flight.exact {
            self.joints(&track);
            self.ends(&track);
            told.tightest_m = self.radii(&track, told.asked_radius_m);
            self.claims(&track, &told);
        } else if let Some(radius_m) = told.asked_radius_m {
            self.corners(flight, radius_m);
        }
        self.clearances(&track, &mut told);
        self.report.flights.push(told);
    }

    /// Gaps and bends from piece to piece.
    fn joints(&mut self, track: &Track<'_>) {
        let (mut gaps, mut bends) = (Worst::default(), Worst::default());
        let mut along_m = 0.0;
        for pair in track.flight.pieces.windows(2) {
            let (here, next) = (&pair[0], &pair[1]);
            along_m += here.length_m;
            gaps.add(here.end().distance(next.start), GAP_M, along_m, next.start);
            let turn = (next.heading_rad - here.end_heading_rad() + PI).rem_euclid(TAU) - PI;
            let bend_deg = turn.abs().to_degrees();
            bends.add(bend_deg, BEND_DEG, along_m, next.start);
        }
        for (rule, worst, limit, unit) in [
            (Rule::Gap, gaps, GAP_M, " m"),
            (Rule::Bend, bends, BEND_DEG, "°"),
        ] {
            let name = rule.name();
            let Some((most, along_m, at)) = worst.most else {
                continue;
            };
            let spot = track.spot(self.plane, along_m, at);
            let text = if worst.beyond > 0 {
                format!(
                    "{} {name}(s) between pieces above {limit}{unit}, the widest {most:.3}{unit} at {spot}",
                    worst.beyond
                )
            } else if worst.sum > IN_ALL * limit {
                format!(
                    "the {name}s between pieces add up to {:.3}{unit}, more than {:.1}{unit}, the widest at {spot}",
                    worst.sum,
                    IN_ALL * limit
                )
            } else {
                continue;
            };
            let name = Some(track.flight.name.as_str());
            self.broken(name, rule, Some(spot), (most, limit), text);
        }
    }

    /// The first and the last place, against the corners that the plan tells.
    fn ends(&mut self, track: &Track<'_>) {
        let flight = track.flight;
        let (Some(first), Some(last)) = (flight.pieces.first(), flight.pieces.last()) else {
            return;
        };
        let both = [
            ("begins", 0.0, first.start, flight.claims.from),
            ("ends", flight.length_m(), last.end(), flight.claims.to),
        ];
        for (what, along_m, at, claimed) in both {
            let Some(claimed) = claimed else { continue };
            let off_m = at.distance(claimed);
            if off_m > GAP_M {
                let spot = track.spot(self.plane, along_m, at);
                let text = format!(
                    "the trajectory {what} {off_m:.3} m from where the flight {what}, at {spot}"
                );
                let name = Some(flight.name.as_str());
                self.broken(name, Rule::Ends, Some(spot), (off_m, GAP_M), text);
            }
        }
    }

    fn radii(&mut self, track: &Track<'_>, asked_m: Option<f64>) -> Option<f64> {
        let arcs = track.flight.pieces.iter();
        let tightest_m = arcs
            .filter_map(|p| track.radius_m(p))
            .min_by(f64::total_cmp);
        let (Some(asked_m), Some(tightest)) = (asked_m, tightest_m) else {
            if tightest_m.is_some() {
                let name = &track.flight.name;
                let text = format!("{name}: no turn radius is told: arcs are not judged");
                self.say(text);
            }
            return tightest_m;
        };
        let least_m = asked_m - self.settings.tolerance_m;
        let mut along_m = 0.0;
        let mut first = None;
        let mut tight = 0;
        for piece in &track.flight.pieces {
            if track.radius_m(piece).is_some_and(|r| r < least_m) {
                tight += 1;
                first = first.or(Some((along_m, piece.start)));
            }
            along_m += piece.length_m;
        }
        if let Some((along_m, at)) = first {
            let spot = track.spot(self.plane, along_m, at);
            let text = format!(
                "{tight} arc(s) tighter than {asked_m} m, the tightest {tightest:.3} m, first at {spot}"
            );
            let name = Some(track.flight.name.as_str());
            self.broken(name, Rule::Radius, Some(spot), (tightest, asked_m), text);
        }
        tightest_m
    }

    /// Corners of straight legs that are too near to each other to be rounded.
    fn corners(&mut self, flight: &Flight, radius_m: f64) {
        let pieces = &flight.pieces;
        let tangents = pieces.windows(2).map(|w| {
            let turn = (w[1].heading_rad - w[0].heading_rad + PI).rem_euclid(TAU) - PI;
            if turn.abs() > PI - 1e-6 {
                f64::INFINITY
            } else {
                radius_m * tan(turn.abs() / 2.0)
            }
        });
        let tangents: Vec<f64> = [0.0].into_iter().chain(tangents).chain([0.0]).collect();
        let tight = |i: &usize| tangents[*i] + tangents[i + 1] > pieces[*i].length_m + 1e-6;
        let mut legs = (0..pieces.len()).filter(tight);
        if let Some(first) = legs.next() {
            let n = 1 + legs.count();
            let at = self.plane.place(pieces[first].start);
            let text = format!(
                "{}: {n} of {} straight legs are too short to round their corners with {radius_m} m, the first from {:.7},{:.7}",
                flight.name,
                pieces.len(),
                at.lat_deg,
                at.lon_deg
            );
            self.say(text);
        }
    }

    fn claims(&mut self, track: &Track<'_>, told: &FlightRecount) {
        let name = Some(track.flight.name.as_str());
        self.compare(name, Rule::Length, "m", Some(told.length_m), told.claimed.0);
        self.compare(name, Rule::Time, "s", told.time_s, told.claimed.1);
    }

    fn compare(
        &mut self,
        flight: Option<&str>,
        rule: Rule,
        unit: &str,
        found: Option<f64>,
        claimed: Option<f64>,
    ) {
        let (Some(found), Some(claimed)) = (found, claimed) else {
            return;
        };
        if (found - claimed).abs() > CLAIM_SHARE * found.max(claimed) + CLAIM_LEAST {
            let text = format!(
                "the {} is {found:.1} {unit}, the plan says {claimed:.1} {unit}",
                if flight.is_none() && rule == Rule::Length {
                    "length of all flights"
                } else {
                    rule.name()
                }
            );
            self.broken(flight, rule, None, (found, claimed), text);
        }
    }

    fn clearances(&mut self, track: &Track<'_>, told: &mut FlightRecount) {
        let tolerance_m = self.settings.tolerance_m;
        let mut entries: BTreeMap<usize, Entry> = BTreeMap::new();
        let mut left: BTreeMap<usize, Entry> = BTreeMap::new();
        let (mut to_zone, mut inside) = (f64::INFINITY, f64::INFINITY);
        let mut along_m = 0.0;
        for piece in &track.flight.pieces {
            for (from_m, path) in piece.paths() {
                let begins_m = along_m + from_m;
                self.near_obstacles(&path, begins_m, &mut to_zone, &mut entries);
                let own = path.bounds();
                for (i, fence) in self.fences.iter().enumerate() {
                    let limit_m = self.fence_clearance_m.max(inside);
                    let found = fence.outline.trespass(&path, &own, Side::Outside, limit_m);
                    let Some(t) = found else { continue };
                    inside = inside.min(t.clear_m);
                    if t.clear_m < self.fence_clearance_m - tolerance_m {
                        note(&mut left, i, begins_m, t);
                    }
                }
            }
            along_m += piece.length_m;
        }
        told.to_zone = Some(to_zone).filter(|d| d.is_finite());
        told.inside_fences = Some(inside).filter(|d| d.is_finite());
        let all: Vec<(Rule, &Named)> = entries.keys().map(|i| self.obstacles.all[*i]).collect();
        for ((rule, named), entry) in all.into_iter().zip(entries.values()) {
            let name = format!("{} {}", rule.name(), named.name);
            self.entered(track, rule, &name, entry, self.clearance_m);
        }
        for (i, entry) in &left {
            let name = self.fences[*i].name.clone();
            self.entered(track, Rule::Fence, &name, entry, self.fence_clearance_m);
        }
    }

    fn near_obstacles(
        &self,
        path: &Path,
        begins_m: f64,
        to_zone: &mut f64,
        entries: &mut BTreeMap<usize, Entry>,
    ) {
        let own = path.bounds();
        let asked_m = self.clearance_m;
        self.obstacles.tree.nearest(
            asked_m.max(*to_zone),
            |bounds| path.at_least(&own, bounds),
            |i, limit_m| {
                let outline = &self.obstacles.all[i].1.outline;
                if let Some(t) = outline.trespass(path, &own, Side::Inside, limit_m) {
                    *to_zone = to_zone.min(t.clear_m);
                    if t.clear_m < asked_m - self.settings.tolerance_m {
                        note(entries, i, begins_m, t);
                    }
                }
                asked_m.max(*to_zone)
            },
        );
    }

    fn entered(&mut self, track: &Track<'_>, rule: Rule, name: &str, e: &Entry, asked_m: f64) {
        let spot_at = |along_m: f64| track.spot(self.plane, along_m, track.at(along_m));
        let (spot, text) = if e.clear_m < -self.settings.tolerance_m {
            let spot = spot_at(e.first_m);
            let (where_, how) = if rule == Rule::Fence {
                ("outside", "farthest")
            } else {
                ("inside", "deepest")
            };
            let text = format!(
                "{:.1} m of the flight {where_} {name}, first at {spot}, {how} {:.1} m",
                e.there_m, -e.clear_m
            );
            (spot, text)
        } else {
            let spot = spot_at(e.worst_m);
            let text = format!(
                "{:.3} m from {name} instead of {asked_m} m, at {spot}",
                e.clear_m.max(0.0)
            );
            (spot, text)
        };
        let flight = Some(track.flight.name.as_str());
        self.broken(flight, rule, Some(spot), (e.clear_m, asked_m), text);
    }

    /// What the plan says of all flights together.
    fn all(&mut self, plan: &Plan) {
        let times = self.report.flights.iter().map(|f| f.time_s);
        let times: Option<Vec<f64>> = times.collect();
        self.report.makespan_s = times.map(|t| t.into_iter().fold(0.0, f64::max));
        self.report.total_m = self.report.flights.iter().map(|f| f.length_m).sum();
        if self.report.makespan_s.is_none() {
            let winds: Vec<Wind> = plan.flights.iter().map(|f| f.wind).collect();
            self.say(if winds.contains(&Wind::Unknown) {
                "it is not told where the wind comes from: times are not recounted"
            } else if winds.iter().any(|w| matches!(w, Wind::To(..))) {
                "no speed is told, or the wind is as fast as a UAV: times are not recounted"
            } else {
                "no speed is told: times are not recounted"
            });
        }
        if plan.flights.iter().all(|f| f.exact || f.pieces.is_empty()) {
            let (found, claimed) = (self.report.makespan_s, plan.claims.makespan_s);
            self.compare(None, Rule::Makespan, "s", found, claimed);
            let (found, claimed) = (Some(self.report.total_m), plan.claims.total_m);
            self.compare(None, Rule::Length, "m", found, claimed);
        }
    }

    fn share(&mut self, plan: &Plan, ground: &Ground) -> Result<(), VerifyError> {
        let asked = self.settings.min_share;
        let cannot = |problem: &str| VerifyError::Setting {
            flag: "min-share",
            problem: problem.to_owned(),
        };
        if ground.areas.is_empty() {
            return match asked {
                Some(_) => Err(cannot("there is no area to be seen")),
                None => Ok(()),
            };
        }
        let mut looks = Vec::new();
        for flight in &plan.flights {
            let swath_m = self.settings.swath_m.or(flight.swath_m).or(plan.swath_m);
            for piece in flight.pieces.iter().filter(|p| p.sees) {
                let Some(swath_m) = swath_m else {
                    if asked.is_some() {
                        return Err(cannot("the plan tells no swath: add --swath-m"));
                    }
                    self.say("no swath is told: the share seen is not recounted");
                    return Ok(());
                };
                let own = self.settings.look_ahead_m.or(flight.look_ahead_m);
                looks.push(Look {
                    piece: *piece,
                    swath_m,
                    look_ahead_m: own.or(plan.look_ahead_m).unwrap_or(swath_m / 2.0),
                });
            }
        }
        let seen = seen(ground, &looks);
        let share = seen.share();
        self.report.area_m2 = Some(seen.area_m2);
        self.report.covered_share = Some(share);
        let exact = plan.flights.iter().all(|f| f.exact || f.pieces.is_empty());
        if let Some(claimed) = plan.claims.covered_share.filter(|_| exact)
            && (share - claimed).abs() > COVERED_SHARE
        {
            let text = format!(
                "{:.2} % of the area are seen, the plan says {:.2} %",
                100.0 * share,
                100.0 * claimed
            );
            self.broken(None, Rule::Share, None, (share, claimed), text);
        }
        if let Some(least) = asked.filter(|least| share < *least) {
            let text = format!(
                "{:.2} % of the area are seen, asked for are {:.2} %",
                100.0 * share,
                100.0 * least
            );
            self.broken(None, Rule::LeastShare, None, (share, least), text);
        }
        Ok(())
    }
}

/// The widest of some gaps, how many are too wide, and what all add up to.
#[derive(Clone, Copy, Debug, Default)]
struct Worst {
    most: Option<(f64, f64, Point)>,
    beyond: usize,
    sum: f64,
}

impl Worst {
    fn add(&mut self, width: f64, limit: f64, along_m: f64, at: Point) {
        self.sum += width;
        if width > limit {
            self.beyond += 1;
        }
        if self.most.is_none_or(|(most, ..)| width > most) {
            self.most = Some((width, along_m, at));
        }
    }
}

fn note(
    entries: &mut BTreeMap<usize, Entry>,
    i: usize,
    begins_m: f64,
    t: crate::outline::Trespass,
) {
    let found = Entry {
        clear_m: t.clear_m,
        worst_m: begins_m + t.along_m,
        there_m: t.there_m,
        first_m: begins_m + t.first_m,
    };
    let entry = entries.entry(i).or_insert(found);
    if entry.first_m < found.first_m {
        // Nearness comes before entry: where it is in first is what counts.
        if entry.there_m <= 0.0 {
            entry.first_m = found.first_m;
        }
        entry.there_m += found.there_m;
    }
    if found.clear_m < entry.clear_m {
        entry.clear_m = found.clear_m;
        entry.worst_m = found.worst_m;
    }
}
