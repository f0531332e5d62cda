//! Exact coverage by a team: the passes of all cells shared out (D2.7 §3.6.3).
//!
//! D2.7 gives each UAV a tree of whole cells. Here the unit is the pass, so that a large
//! cell is split by its swaths and more UAVs than cells still help; passes longer than a
//! UAV's fair share are cut. Each tour begins and ends at its UAV's launch point, and the
//! longest time counts, at each UAV's own speed.

use skein_flight::coverage::lines::{self, LineError, LineTour, tour_cost};
use skein_flight::coverage::metric::{Matrix, Metric};
use skein_flight::coverage::passes::{
    CellPlan, Layout, NEAR_TURNS, Pass, PassesError, PassesProblem, Places, in_order, lines, track,
};
use skein_geometry::frame::Point;

/// A pass is cut when it is longer than this share of what each UAV has to fly.
const LONGEST_SHARE: f64 = 0.5;

/// Passes are cut for a team of this size at most: each UAV makes two pieces more.
const MOST_CUT: usize = 200;

/// The most UAVs: the same as a swarm's.
const MOST_UAVS: usize = 1_000;

/// One UAV of the team.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uav {
    /// Where it begins and ends.
    pub launch: Point,
    /// Its speed, metres a unit of time; above zero.
    pub speed: f64,
    /// How long it may fly, in the same unit of time.
    pub endurance: f64,
}

impl Uav {
    /// A UAV of unit speed, so that times are lengths, without a limit.
    #[must_use]
    pub fn at(launch: Point) -> Self {
        Self {
            launch,
            speed: 1.0,
            endurance: f64::INFINITY,
        }
    }
}

/// One closed tour for each UAV.
#[derive(Clone, Debug, PartialEq)]
pub struct TeamPlan {
    /// By UAV: its passes in the order of flight.
    pub tours: Vec<Vec<Pass>>,
    /// By UAV: its whole flight with the bends round zones, from its launch point back.
    pub tracks: Vec<Vec<Point>>,
    /// By UAV: the length of its tour with turns and the ways from and to its launch
    /// point, metres.
    pub lengths_m: Vec<f64>,
    /// The longest time of a tour.
    pub makespan: f64,
    /// No tours along these passes have a smaller longest time: the passes, the cheapest
    /// turns between them, and the ways out and back of as many UAVs as must come so far.
    /// Where ways round zones are guessed it is a bound if no guess is too long.
    pub lower_bound: f64,
    /// The time to the farthest pass, along it and back, of the UAV that is there first:
    /// no team is faster.
    pub farthest: f64,
    /// Passes beyond the endurance of the team.
    pub unserved: Vec<Pass>,
    /// The cells.
    pub cells: Vec<CellPlan>,
}

/// Plans closed tours for a team so that every pass is flown once and the longest time is
/// short; `problem.launch` is not used.
///
/// # Guarantees
/// As [`skein_flight::coverage::passes::plan`]; every pass is in one tour or in `unserved`, and no tour is longer
/// than its UAV's endurance.
///
/// # Complexity
/// As [`skein_flight::coverage::passes::plan`], with O(k) for each pass that is moved in a step of improvement.
///
/// # Errors
/// [`PassesError`]; nothing is planned then.
pub fn plan_team(problem: &PassesProblem, team: &[Uav]) -> Result<TeamPlan, PassesError> {
    if team.is_empty() {
        return Err(PassesError::Team(LineError::NoTeam));
    }
    if team.len() > MOST_UAVS {
        return Err(PassesError::Number("number of UAVs"));
    }
    let (launches, from) = launches(team)?;
    let mut layout = Layout::new(problem)?;
    cut(&mut layout.passes, team.len(), problem.shortest_pass_m);
    let ways = layout.ways(&launches)?;
    let places = Places::new(&ways, &layout.passes, &launches, problem.turn_radius_m);
    let first = 2 * layout.passes.len();
    let near_m = NEAR_TURNS * problem.turn_m();
    let guessed = Matrix::of(first + launches.len(), &|a, b| places.guess_m(a, b, near_m));
    let lines = lines(&layout.passes);
    let uavs: Vec<lines::Uav> = team
        .iter()
        .zip(&from)
        .map(|(m, launch)| lines::Uav {
            speed: m.speed,
            endurance: m.endurance,
            ..lines::Uav::at(first + launch)
        })
        .collect();
    let mut found = lines::plan(&lines, &uavs, &guessed, problem.steps)?;
    let time =
        |(t, u): (&LineTour, &lines::Uav)| tour_cost(&t.passes, &lines, u.depot, &places) / u.speed;
    let too_long = |(t, u): (&LineTour, &lines::Uav)| time((t, u)) > u.endurance;
    if found.tours.iter().zip(&uavs).any(too_long) {
        // A guess was too short where endurance is: here every way counts as it is.
        let costs = Matrix::of(first + launches.len(), &places);
        found = lines::plan(&lines, &uavs, &costs, problem.steps)?;
    }
    let reach = |i: usize, uav: &lines::Uav| {
        let (a, b) = (2 * i, 2 * i + 1);
        // Ways from and to launch points are never guessed.
        let way = guessed.cost(uav.depot, a) + lines[i].cost[0] + guessed.cost(b, uav.depot);
        way / uav.speed
    };
    let soonest = |i: usize| {
        let times = uavs.iter().map(|u| reach(i, u));
        times.fold(f64::INFINITY, f64::min)
    };
    let length_m =
        |(t, u): (&LineTour, &lines::Uav)| tour_cost(&t.passes, &lines, u.depot, &places);
    let passes = |t: &LineTour| in_order(&layout.passes, &t.passes);
    let tours: Vec<Vec<Pass>> = found.tours.iter().map(passes).collect();
    let flights = tours.iter().zip(team);
    Ok(TeamPlan {
        lengths_m: found.tours.iter().zip(&uavs).map(length_m).collect(),
        tracks: flights.map(|(t, m)| track(&ways, m.launch, t)).collect(),
        tours,
        makespan: found.tours.iter().zip(&uavs).map(time).fold(0.0, f64::max),
        lower_bound: found.lower_bound,
        farthest: (0..lines.len()).map(soonest).fold(0.0, f64::max),
        unserved: found.unserved.iter().map(|&i| layout.passes[i]).collect(),
        cells: layout.cells,
    })
}

/// The launch points of a team, none twice, and by UAV which is its own.
///
/// # Errors
/// When one is nowhere.
pub(crate) fn launches(team: &[Uav]) -> Result<(Vec<Point>, Vec<usize>), PassesError> {
    let mut launches: Vec<Point> = Vec::new();
    let mut from = Vec::with_capacity(team.len());
    for member in team {
        let known = launches
            .iter()
            .position(|p| (p - member.launch).norm() <= 0.0);
        from.push(known.unwrap_or(launches.len()));
        if known.is_none() {
            launches.push(member.launch);
        }
    }
    let finite = |p: &Point| p.x.is_finite() && p.y.is_finite();
    if !launches.iter().all(finite) {
        return Err(PassesError::Number("launch point"));
    }
    Ok((launches, from))
}

/// Cuts passes into equal pieces, so that none is longer than a fair share for `k` UAVs.
pub(crate) fn cut(passes: &mut Vec<Pass>, k: usize, shortest_m: f64) {
    let total_m: f64 = passes.iter().map(Pass::length_m).sum();
    let most_m = (LONGEST_SHARE * total_m / k.min(MOST_CUT) as f64).max(shortest_m);
    let mut pieces = Vec::with_capacity(passes.len());
    for pass in passes.iter() {
        let n = (pass.length_m() / most_m).ceil().max(1.0);
        let at = |i: f64| pass.from + (pass.to - pass.from) * (i / n);
        let mut i = 0.0;
        while i < n {
            pieces.push(Pass {
                from: at(i),
                to: at(i + 1.0),
            });
            i += 1.0;
        }
    }
    *passes = pieces;
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_flight::coverage::passes::plan;
    use skein_geometry::polygon::point_to_line_m;
    use skein_geometry::{NoFlyZones, Polygon};
    use std::sync::Arc;

    fn polygon(points: &[(f64, f64)]) -> Polygon {
        Polygon::new(points.iter().map(|&(x, y)| Point::new(x, y)).collect()).unwrap()
    }

    fn square(x: f64, y: f64, half: f64) -> Polygon {
        polygon(&[
            (x - half, y - half),
            (x + half, y - half),
            (x + half, y + half),
            (x - half, y + half),
        ])
    }

    fn problem(area: Polygon, zones: Vec<Polygon>) -> PassesProblem {
        PassesProblem {
            zones: Arc::new(NoFlyZones::new(zones)),
            clearance_m: 5.0,
            steps: 200,
            ..PassesProblem::new(area, 20.0, 10.0, Point::new(-400.0, -400.0))
        }
    }

    /// The share of a grid of points, of those to be seen, that no pass sees.
    fn unseen(problem: &PassesProblem, passes: &[Pass]) -> f64 {
        let (low, high) = problem.area.bounds();
        let (mut unseen, mut all) = (0u32, 0u32);
        for i in 0..150 {
            for j in 0..150 {
                let at = |l: f64, h: f64, k: i32| l + (h - l) * (f64::from(k) + 0.5) / 150.0;
                let p = Point::new(at(low.x, high.x, i), at(low.y, high.y, j));
                if !problem.area.contains(p)
                    || problem.holes.iter().any(|h| h.contains(p))
                    || problem.zones.distance_m(p) < problem.clearance_m * 1.1
                {
                    continue;
                }
                all += 1;
                let seen = passes.iter().any(|pass| {
                    // A square footprint, written differently from `Pass::sees`.
                    let d = (pass.to - pass.from).normalize() * problem.look_ahead_m;
                    point_to_line_m(p, pass.from - d, pass.to + d)
                        <= problem.lane_spacing_m / 2.0 + 1e-6
                        || pass.sees(p, problem.lane_spacing_m / 2.0, problem.look_ahead_m)
                });
                unseen += u32::from(!seen);
            }
        }
        f64::from(unseen) / f64::from(all.max(1))
    }

    #[test]
    fn more_uavs_are_never_slower_and_share_every_pass() {
        let zones = vec![
            square(-60.0, 20.0, 25.0),
            square(70.0, -50.0, 30.0),
            square(40.0, 90.0, 15.0),
        ];
        let mut p = problem(square(0.0, 0.0, 160.0), zones);
        p.steps = 4_000;
        let alone = plan(&p).unwrap();
        let (mut before, mut farthest) = (f64::INFINITY, 0.0);
        for k in [1, 2, 3, 5, 8, 16, 40] {
            let team = vec![Uav::at(p.launch); k];
            let found = plan_team(&p, &team).unwrap();
            assert!(found.unserved.is_empty() && found.tours.len() == k);
            let flown: f64 = found.tours.iter().flatten().map(Pass::length_m).sum();
            assert!((flown - alone.passes_m).abs() < 1e-6, "{k}");
            assert!(unseen(&p, &found.tours.concat()) <= 1e-4, "{k}");
            assert!(found.makespan <= before * (1.0 + 1e-9), "{k}");
            assert!(found.makespan >= found.farthest - 1e-9);
            (before, farthest) = (found.makespan, found.farthest);
        }
        // Forty UAVs for some thirty passes: each cut until the way there is all that counts.
        assert!(before <= 1.08 * farthest, "{before} {farthest}");
    }

    #[test]
    fn a_faster_uav_gets_more_and_endurance_is_kept() {
        let mut p = problem(square(0.0, 0.0, 160.0), vec![square(0.0, 0.0, 25.0)]);
        p.steps = 2_000;
        let slow = Uav::at(p.launch);
        let fast = Uav { speed: 3.0, ..slow };
        let found = plan_team(&p, &[slow, fast]).unwrap();
        assert!(found.lengths_m[1] > 2.0 * found.lengths_m[0]);
        let tired = Uav {
            endurance: 2_500.0,
            ..slow
        };
        let found = plan_team(&p, &[tired; 2]).unwrap();
        assert!(!found.unserved.is_empty() && found.makespan <= 2_500.0 + 1e-9);
        assert!(plan_team(&p, &[]).is_err());
        let nowhere = Uav::at(Point::new(f64::NAN, 0.0));
        assert!(plan_team(&p, &[nowhere]).is_err());
        assert!(plan_team(&p, &[Uav { speed: 0.0, ..slow }]).is_err());
    }
}
