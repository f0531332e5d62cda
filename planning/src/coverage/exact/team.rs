//! Exact coverage by a team: the passes of all cells shared out (D2.7 §3.6.3).
//!
//! D2.7 gives each UAV a tree of whole cells. Here the unit is the pass, so that a large
//! cell is split by its swaths and more UAVs than cells still help; passes longer than a
//! UAV's fair share are cut. Each tour begins and ends at its UAV's launch point, and the
//! longest time counts, at each UAV's own speed.

use super::layout::Layout;
use super::ways::Places;
use super::{CellPlan, ExactError, ExactProblem, NEAR_TURNS, Pass, in_order, lines};
use crate::coverage::line::{self, LineError, LineTour, Surveyor, tour_cost};
use crate::coverage::metric::{Matrix, Metric};
use crate::frame::Point;

/// A pass is cut when it is longer than this share of what each UAV has to fly.
const LONGEST_SHARE: f64 = 0.5;

/// Passes are cut for a team of this size at most: each UAV makes two pieces more.
const MOST_CUT: usize = 200;

/// The most UAVs: the same as a swarm's.
const MOST_UAVS: usize = 1_000;

/// One UAV of the team.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Member {
    /// Where it begins and ends.
    pub launch: Point,
    /// Its speed, metres a unit of time; above zero.
    pub speed: f64,
    /// How long it may fly, in the same unit of time.
    pub endurance: f64,
}

impl Member {
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
/// As [`super::plan`]; every pass is in one tour or in `unserved`, and no tour is longer
/// than its UAV's endurance.
///
/// # Complexity
/// As [`super::plan`], with O(k) for each pass that is moved in a step of improvement.
///
/// # Errors
/// [`ExactError`]; nothing is planned then.
pub fn plan_team(problem: &ExactProblem, team: &[Member]) -> Result<TeamPlan, ExactError> {
    if team.is_empty() {
        return Err(ExactError::Team(LineError::NoTeam));
    }
    if team.len() > MOST_UAVS {
        return Err(ExactError::Number("number of UAVs"));
    }
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
        return Err(ExactError::Number("launch point"));
    }
    let mut layout = Layout::new(problem)?;
    cut(&mut layout.passes, team.len(), problem.shortest_pass_m);
    let ways = layout.ways(&launches)?;
    let places = Places::new(&ways, &layout.passes, &launches, problem.turn_radius_m);
    let first = 2 * layout.passes.len();
    let near_m = NEAR_TURNS * problem.measures().turn_m();
    let guessed = Matrix::of(first + launches.len(), &|a, b| places.guess_m(a, b, near_m));
    let lines = lines(&layout.passes);
    let uavs: Vec<Surveyor> = team
        .iter()
        .zip(&from)
        .map(|(m, launch)| Surveyor {
            speed: m.speed,
            endurance: m.endurance,
            ..Surveyor::at(first + launch)
        })
        .collect();
    let mut found = line::plan(&lines, &uavs, &guessed, problem.steps)?;
    let time =
        |(t, u): (&LineTour, &Surveyor)| tour_cost(&t.passes, &lines, u.depot, &places) / u.speed;
    let too_long = |(t, u): (&LineTour, &Surveyor)| time((t, u)) > u.endurance;
    if found.tours.iter().zip(&uavs).any(too_long) {
        // A guess was too short where endurance is: here every way counts as it is.
        let costs = Matrix::of(first + launches.len(), &places);
        found = line::plan(&lines, &uavs, &costs, problem.steps)?;
    }
    let reach = |i: usize, uav: &Surveyor| {
        let (a, b) = (2 * i, 2 * i + 1);
        // Ways from and to launch points are never guessed.
        let way = guessed.cost(uav.depot, a) + lines[i].cost[0] + guessed.cost(b, uav.depot);
        way / uav.speed
    };
    let soonest = |i: usize| {
        let times = uavs.iter().map(|u| reach(i, u));
        times.fold(f64::INFINITY, f64::min)
    };
    let length_m = |(t, u): (&LineTour, &Surveyor)| tour_cost(&t.passes, &lines, u.depot, &places);
    let passes = |t: &LineTour| in_order(&layout.passes, &t.passes);
    let tours: Vec<Vec<Pass>> = found.tours.iter().map(passes).collect();
    let flights = tours.iter().zip(team);
    Ok(TeamPlan {
        lengths_m: found.tours.iter().zip(&uavs).map(length_m).collect(),
        tracks: flights
            .map(|(t, m)| super::track(&ways, m.launch, t))
            .collect(),
        tours,
        makespan: found.tours.iter().zip(&uavs).map(time).fold(0.0, f64::max),
        lower_bound: found.lower_bound,
        farthest: (0..lines.len()).map(soonest).fold(0.0, f64::max),
        unserved: found.unserved.iter().map(|&i| layout.passes[i]).collect(),
        cells: layout.cells,
    })
}

/// Cuts passes into equal pieces, so that none is longer than a fair share for `k` UAVs.
fn cut(passes: &mut Vec<Pass>, k: usize, shortest_m: f64) {
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
