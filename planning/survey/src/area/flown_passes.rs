//! Straight passes of an area shared out among a team and flown: what every UAV flies from
//! its start and back is lines and arcs that keep clear all along (D2.7 §3.6.1, 3.6.3).
//!
//! Passes are ordered by guesses of the ways between them, flown, and ordered again by
//! what these ways then took. Leaves to [`crate::flown`] which curves there are.

use super::gaps;
use crate::flown::{Air, Fineness, Flown, Stop, clear_ahead_m, fly, turnable, turnable_by};
use crate::passes::{Uav, cut, launches};
use skein_flight::coverage::lines::{self, LineError};
use skein_flight::coverage::metric::Matrix;
use skein_flight::coverage::passes::{
    CellPlan, Layout, NEAR_TURNS, Pass, PassesError, PassesProblem, Places, lines,
};
use skein_flight::route::{RouteLimits, Router};
use skein_geometry::frame::{Point, Pose};
use std::collections::BTreeMap;

/// What a way costs that is not there, in turns: others are preferred, and what can be
/// reached by no other is still planned for.
const NO_WAY_TURNS: f64 = 20.0;

/// What a search takes where there are no zones, as if there were so many edges.
const FREE_EDGES: usize = 20;

/// What is looked at of each edge for a way that nothing is in the way of.
const WAY_WORK: u64 = 12;

/// What is looked at of each edge for the ends of a pass, and where plans are only compared.
const PASS_WORK: (usize, usize) = (60, 20);

/// What is looked at of each edge for the share that is seen.
const SAMPLES_WORK: u64 = 5_000;

/// What is looked at for the order of each pair of passes.
const PAIR_WORK: usize = 10;

/// What is looked at in a step of improvement for each pass.
const STEP_WORK: usize = 5;

/// Times that a shorter endurance is planned for where turns take what was left.
const ENDURANCE_ROUNDS: usize = 3;

/// The flights over an area.
#[derive(Clone, Debug, Default)]
pub(super) struct FlownPasses {
    /// By UAV.
    pub flights: Vec<Flown>,
    /// By UAV: its passes in the order of flight.
    pub tours: Vec<Vec<Pass>>,
    /// Passes beyond the endurance of the team.
    pub unserved: Vec<Pass>,
    /// Passes to which no curve leads that keeps clear.
    pub unreached: Vec<Pass>,
    /// The cells.
    pub cells: Vec<CellPlan>,
    /// What it took to plan, about, in edges that were looked at.
    pub work: u64,
}

/// Plans flights for a team so that every pass that can be is flown once, and the longest
/// time is short; `problem.launch` is not used. `airs` is what each flies through. Passes are
/// ordered `rounds` times, after the first by what the ways took, and run out straight so far
/// where that is clear.
///
/// # Errors
/// [`PassesError`]; nothing is planned then.
pub(super) fn fly_team(
    problem: &PassesProblem,
    team: &[Uav],
    airs: &[Air],
    rounds: usize,
    run_out_m: f64,
) -> Result<FlownPasses, PassesError> {
    fly_layout(
        problem,
        Layout::new(problem)?,
        team,
        airs,
        rounds,
        run_out_m,
    )
}

/// The same with passes that were laid already, and such that see what these do not.
///
/// # Errors
/// [`PassesError`]; nothing is planned then.
pub(super) fn fly_layout(
    problem: &PassesProblem,
    layout: Layout,
    team: &[Uav],
    airs: &[Air],
    rounds: usize,
    run_out_m: f64,
) -> Result<FlownPasses, PassesError> {
    if team.is_empty() {
        return Err(PassesError::Team(LineError::NoTeam));
    }
    let (starts, from) = launches(team)?;
    let router = Router::new(
        problem.zones.clone(),
        RouteLimits {
            turn_radius_m: problem.turn_radius_m,
            clearance_m: problem.clearance_m,
        },
    );
    let ways = layout.ways(&starts)?;
    let is_open = |p: Point| starts.iter().any(|s| ways.joins(*s, p));
    // Where orders are only compared, one is enough, and so are coarse ends.
    let thorough = rounds > 1;
    let (fineness, pass_work) = if thorough {
        (Fineness::FULL, PASS_WORK.0)
    } else {
        (Fineness::COARSE, PASS_WORK.1)
    };
    let (mut passes, mut unreached) = (Vec::new(), Vec::new());
    for pass in &layout.passes {
        match turnable_by(&router, *pass, fineness).filter(|_| is_open(pass.from)) {
            Some(part) => passes.push(part),
            None => unreached.push(*pass),
        }
    }
    let (more, tried) = gaps::fill(problem, &router, &passes, is_open, thorough);
    let tried = tried + layout.passes.len();
    passes.extend(more);
    cut(&mut passes, team.len(), problem.shortest_pass_m);
    if passes.is_empty() {
        return Ok(FlownPasses {
            flights: vec![Flown::default(); team.len()],
            tours: vec![Vec::new(); team.len()],
            unreached,
            cells: layout.cells,
            ..FlownPasses::default()
        });
    }
    let desk = Desk {
        problem,
        router: &router,
        team,
        airs,
        thorough,
        run_out_m,
        from: &from,
        passes: &passes,
        places: Places::new(&ways, &passes, &starts, problem.turn_radius_m),
        starts: starts.len(),
        lines: lines(&passes),
    };
    let mut found = desk.best(rounds)?;
    let edges = problem.zones.zones().iter().map(|z| z.vertices().len());
    let edges = edges.sum::<usize>() + FREE_EDGES;
    let pairs = passes.len() * passes.len();
    found.work = (WAY_WORK * found.work + (pass_work * tried) as u64 + SAMPLES_WORK)
        .saturating_mul(edges as u64)
        .saturating_add((PAIR_WORK * pairs) as u64)
        .saturating_add((STEP_WORK * passes.len()) as u64 * (problem.steps * rounds) as u64);
    found.unreached.extend(unreached);
    found.cells = layout.cells;
    Ok(found)
}

/// What one UAV flies over passes in this order, as many from the first on as it may fly so
/// far through the air; and the passes that it flies.
pub(super) fn fly_within(
    router: &Router,
    start: Point,
    passes: &[Pass],
    longest_m: f64,
    air: &Air,
    run_out_m: f64,
) -> (Flown, Vec<Pass>) {
    let passes: Vec<Pass> = passes.iter().filter_map(|p| turnable(router, *p)).collect();
    let fly_first = |n: usize| {
        let stops = passes.iter().take(n);
        let stops: Vec<Stop> = stops.filter_map(|p| stop(router, *p, run_out_m)).collect();
        fly(router, start, &stops)
    };
    let mut best = fly_first(passes.len());
    if best.air_m(air) > longest_m {
        best = Flown::default();
        let (mut low, mut high) = (0, passes.len());
        while high - low > 1 {
            let n = usize::midpoint(low, high);
            let flown = fly_first(n);
            if flown.air_m(air) <= longest_m {
                (best, low) = (flown, n);
            } else {
                high = n;
            }
        }
    }
    let pass = |(stop, stand): &(usize, usize)| {
        let pass = passes[*stop];
        if is_forward(*stand) {
            pass
        } else {
            pass.reversed()
        }
    };
    let flown = best.order.iter().map(pass).collect();
    (best, flown)
}

/// A pass to be flown in its direction rather than the other, which runs out so far where
/// that is clear.
fn stop(router: &Router, pass: Pass, run_out_m: f64) -> Option<Stop> {
    let end = Pose::new(pass.to, pass.heading_rad());
    let begin = Pose::new(pass.from, pass.heading_rad()).reversed();
    let out_m = |pose: Pose| clear_ahead_m(router, pose, run_out_m);
    let unseen_m = if run_out_m > 0.0 {
        (out_m(begin), out_m(end))
    } else {
        (0.0, 0.0)
    };
    Stop::run_out((pass.from, pass.to), unseen_m)
}

/// Whether a stand of [`stop`] is flown in the pass's direction: each other one is.
fn is_forward(stand: usize) -> bool {
    stand.is_multiple_of(2)
}

/// What flights are planned from.
struct Desk<'a> {
    problem: &'a PassesProblem,
    router: &'a Router,
    team: &'a [Uav],
    /// By UAV: what it flies through.
    airs: &'a [Air],
    /// Whether the order is searched for at length; else passes are joined in the cheapest
    /// way at hand.
    thorough: bool,
    /// How far passes run out, metres.
    run_out_m: f64,
    /// By UAV: which of the starts is its own.
    from: &'a [usize],
    passes: &'a [Pass],
    places: Places<'a>,
    starts: usize,
    lines: Vec<lines::Line>,
}

/// What ways took that were flown, by the places where they begin and end.
type Known = BTreeMap<(usize, usize), f64>;

impl Desk<'_> {
    fn best(&self, mut rounds: usize) -> Result<FlownPasses, PassesError> {
        let mut known = Known::new();
        let mut best: Option<FlownPasses> = None;
        let mut endurances: Vec<f64> = self.team.iter().map(|u| u.endurance).collect();
        let (mut shorter, mut work) = (ENDURANCE_ROUNDS, 0);
        while rounds > 0 {
            let found = self.ordered(&endurances, &mut known)?;
            work += found.flights.iter().map(|f| f.work).sum::<u64>();
            let late = self.too_long(&found);
            if late.is_empty() || shorter == 0 {
                rounds -= 1;
                let found = self.within_endurance(found);
                if best.as_ref().is_none_or(|b| self.beats(&found, b)) {
                    best = Some(found);
                }
            } else {
                shorter -= 1;
                for (uav, over) in late {
                    endurances[uav] /= over * 1.01;
                }
            }
        }
        let mut best = best.unwrap_or_default();
        best.work = work;
        Ok(best)
    }

    /// Shared out, ordered and flown; what the ways took is noted.
    fn ordered(&self, endurances: &[f64], known: &mut Known) -> Result<FlownPasses, PassesError> {
        let first = 2 * self.passes.len();
        let near_m = NEAR_TURNS * self.problem.turn_m();
        let cost = |a: usize, b: usize| {
            let flown = known.get(&(a.min(b), a.max(b))).copied();
            flown.unwrap_or_else(|| self.places.guess_m(a, b, near_m))
        };
        let costs = Matrix::of(first + self.starts, &cost);
        let uav = |((u, start), endurance): ((&Uav, &usize), &f64)| lines::Uav {
            speed: u.speed,
            endurance: *endurance,
            ..lines::Uav::at(first + start)
        };
        let uavs = self.team.iter().zip(self.from).zip(endurances);
        let uavs: Vec<lines::Uav> = uavs.map(uav).collect();
        let found = if self.thorough {
            lines::plan(&self.lines, &uavs, &costs, self.problem.steps)?
        } else {
            lines::plan_passes(&self.lines, &uavs, &costs, self.problem.steps)?
        };
        let mut flown = FlownPasses {
            unserved: found.unserved.iter().map(|i| self.passes[*i]).collect(),
            ..FlownPasses::default()
        };
        for (i, tour) in found.tours.iter().enumerate() {
            let order: Vec<usize> = tour.passes.iter().map(|t| t.line).collect();
            let stops = tour.passes.iter().filter_map(|t| {
                let pass = self.passes[t.line];
                let wanted = if t.backward { pass.reversed() } else { pass };
                stop(self.router, wanted, self.run_out_m)
            });
            let stops: Vec<Stop> = stops.collect();
            let flight = fly(self.router, self.team[i].launch, &stops);
            // By stand the end of a pass where a way comes in, and where one goes out.
            let ends = |(stop, stand): (usize, usize)| {
                let line = 2 * order[stop];
                if tour.passes[stop].backward == is_forward(stand) {
                    (line + 1, line)
                } else {
                    (line, line + 1)
                }
            };
            let start = first + self.from[i];
            for (a, b, length_m) in &flight.ways {
                let out = a.map_or(start, |a| ends(a).1);
                let into = b.map_or(start, |b| ends(b).0);
                let none_m = NO_WAY_TURNS * self.problem.turn_m();
                known.insert((out.min(into), out.max(into)), length_m.unwrap_or(none_m));
            }
            let pass = |(stop, stand): &(usize, usize)| {
                let pass = self.passes[order[*stop]];
                let backward = tour.passes[*stop].backward == is_forward(*stand);
                if backward { pass.reversed() } else { pass }
            };
            flown.tours.push(flight.order.iter().map(pass).collect());
            let left = flight.left.iter().map(|stop| self.passes[order[*stop]]);
            flown.unreached.extend(left);
            flown.flights.push(flight);
        }
        Ok(flown)
    }

    fn times(&self, flown: &FlownPasses) -> Vec<f64> {
        let flights = flown.flights.iter().zip(self.team).zip(self.airs);
        flights
            .map(|((f, u), air)| f.air_m(air) / u.speed)
            .collect()
    }

    /// Who flies longer than it may, and how many times as long.
    fn too_long(&self, flown: &FlownPasses) -> Vec<(usize, f64)> {
        let times = self.times(flown).into_iter().zip(self.team).enumerate();
        let over = times.map(|(i, (time, u))| (i, time / u.endurance));
        over.filter(|(_, over)| *over > 1.0).collect()
    }

    /// Passes are left off the ends of flights until all are within their endurance.
    fn within_endurance(&self, mut flown: FlownPasses) -> FlownPasses {
        for (i, uav) in self.team.iter().enumerate() {
            while flown.flights[i].air_m(&self.airs[i]) / uav.speed > uav.endurance {
                let Some(last) = flown.tours[i].pop() else {
                    flown.flights[i] = Flown::default();
                    break;
                };
                flown.unserved.push(last);
                let stops = flown.tours[i].iter();
                let stops: Vec<Stop> = stops
                    .filter_map(|p| stop(self.router, *p, self.run_out_m))
                    .collect();
                flown.flights[i] = fly(self.router, uav.launch, &stops);
                let ordered = flown.flights[i].order.iter().map(|(stop, stand)| {
                    let pass = flown.tours[i][*stop];
                    if is_forward(*stand) {
                        pass
                    } else {
                        pass.reversed()
                    }
                });
                let ordered: Vec<Pass> = ordered.collect();
                let left = flown.flights[i].left.iter().map(|s| flown.tours[i][*s]);
                flown.unreached.extend(left);
                flown.tours[i] = ordered;
            }
        }
        flown
    }

    /// Whether more is seen, or as much sooner, or all together shorter.
    fn beats(&self, a: &FlownPasses, b: &FlownPasses) -> bool {
        let seen_m = |f: &FlownPasses| f.tours.iter().flatten().map(Pass::length_m).sum::<f64>();
        let more_m = seen_m(a) - seen_m(b);
        if more_m.abs() > 1e-6 * (1.0 + seen_m(b)) {
            return more_m > 0.0;
        }
        let latest = |f: &FlownPasses| self.times(f).into_iter().fold(0.0, f64::max);
        let sum = |f: &FlownPasses| self.times(f).iter().sum::<f64>();
        let by_time = latest(a).total_cmp(&latest(b));
        by_time.then(sum(a).total_cmp(&sum(b))).is_lt()
    }
}
