//! Straight passes of an area shared out among a team and flown: what every UAV flies from
//! its start and back is lines and arcs that keep clear all along (D2.7 §3.6.1, 3.6.3).
//!
//! Passes are ordered by guesses of the ways between them, flown, and ordered again by
//! what these ways then took. Leaves to [`crate::flown`] which curves there are.

use super::gaps;
use super::promise::Flyers;
use crate::flown::{Air, Fineness, Flown, Stop, clear_ahead_m, fly, turnable, turnable_by};
use crate::passes::{Uav, cut, launches};
use skein_flight::coverage::lines::{self, LineError};
use skein_flight::coverage::metric::{Matrix, Metric};
use skein_flight::coverage::passes::{
    CellPlan, GrownZones, Layout, NEAR_TURNS, Pass, PassesError, PassesProblem, Places, Ways, lines,
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

/// Steps of improvement for each pass at most: the order of few is as good as it gets after
/// that.
const MOST_STEPS_A_PASS: usize = 1_000;

/// Orders after the first are improved in this part of the steps: few ways take what was not
/// thought.
const AGAIN_PART: usize = 4;

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

/// What plans over one part of an area share, however its passes are laid: who flies, and what
/// is known of the zones.
pub(super) struct Ground<'a> {
    team: &'a [Uav],
    /// By UAV: what it flies through.
    airs: &'a [Air],
    /// How far passes run out straight where that is clear, metres.
    run_out_m: f64,
    router: Router,
    zones: GrownZones,
    ways: Ways,
    /// The places where UAVs start, and by UAV which is its own.
    starts: Vec<Point>,
    from: Vec<usize>,
    lattice: gaps::Lattice,
    /// Edges of zones, of which ways are searched for among.
    edges: usize,
}

/// Passes to be flown.
pub(super) struct Laid {
    passes: Vec<Pass>,
    /// Passes to which no curve leads that keeps clear.
    unreached: Vec<Pass>,
    cells: Vec<CellPlan>,
    /// Whether their ends are as far out as can be.
    thorough: bool,
    /// What it took to lay them, in edges that were looked at.
    work: u64,
}

impl Laid {
    /// The passes, cut for the team.
    pub(super) fn passes(&self) -> &[Pass] {
        &self.passes
    }
}

impl<'a> Ground<'a> {
    /// Looks at the zones of a problem; its directions and steps do not matter, nor does its
    /// launch point.
    ///
    /// # Errors
    /// [`PassesError`]; nothing can be planned then.
    pub(super) fn new(
        problem: &PassesProblem,
        team: &'a [Uav],
        airs: &'a [Air],
        run_out_m: f64,
    ) -> Result<Self, PassesError> {
        if team.is_empty() {
            return Err(PassesError::Team(LineError::NoTeam));
        }
        let zones = GrownZones::new(problem)?;
        let (starts, from) = launches(team)?;
        let (low, high) = problem.area.bounds();
        let reach_m = low.coords.amax().max(high.coords.amax()) + problem.lane_spacing_m;
        let edges = problem.zones.zones().iter().map(|z| z.vertices().len());
        Ok(Self {
            team,
            airs,
            run_out_m,
            router: Router::new(
                problem.zones.clone(),
                RouteLimits {
                    turn_radius_m: problem.turn_radius_m,
                    clearance_m: problem.clearance_m,
                },
            ),
            ways: zones.ways(&starts, reach_m)?,
            zones,
            starts,
            from,
            lattice: gaps::Lattice::new(problem),
            edges: edges.sum::<usize>() + FREE_EDGES,
        })
    }

    /// By UAV: what it flies through.
    pub(super) fn airs(&self) -> &[Air] {
        self.airs
    }

    /// Who flies, as far as it matters to what that takes at least.
    pub(super) fn flyers(&self) -> Flyers {
        let fastest = |air: &Air| air.airspeed_mps + air.wind_mps.norm();
        Flyers {
            starts: self.starts.clone(),
            speeds_mps: self.airs.iter().map(fastest).collect(),
            turn_radius_m: self.router.limits().turn_radius_m,
        }
    }

    /// Lays passes in the directions of a problem, and such that see what these do not.
    ///
    /// # Errors
    /// [`PassesError`]; nothing is laid then.
    pub(super) fn laid(
        &self,
        problem: &PassesProblem,
        thorough: bool,
    ) -> Result<Laid, PassesError> {
        Ok(self.finished(problem, Layout::among(problem, &self.zones)?, thorough))
    }

    /// The same with passes that were laid already.
    ///
    /// # Errors
    /// [`PassesError`]; nothing is laid then.
    pub(super) fn laid_before(
        &self,
        problem: &PassesProblem,
        passes: Vec<Pass>,
    ) -> Result<Laid, PassesError> {
        let layout = Layout::of_passes(&self.zones, passes)?;
        Ok(self.finished(problem, layout, true))
    }

    fn finished(&self, problem: &PassesProblem, layout: Layout, thorough: bool) -> Laid {
        let is_open = |p: Point| self.starts.iter().any(|s| self.ways.joins(*s, p));
        let (fineness, pass_work) = if thorough {
            (Fineness::FULL, PASS_WORK.0)
        } else {
            (Fineness::COARSE, PASS_WORK.1)
        };
        let (mut passes, mut unreached) = (Vec::new(), Vec::new());
        for pass in &layout.passes {
            match turnable_by(&self.router, *pass, fineness).filter(|_| is_open(pass.from)) {
                Some(part) => passes.push(part),
                None => unreached.push(*pass),
            }
        }
        let (lattice, router) = (&self.lattice, &self.router);
        let (more, tried) = gaps::fill(problem, router, lattice, &passes, is_open, thorough);
        let tried = tried + layout.passes.len();
        passes.extend(more);
        cut(&mut passes, self.team.len(), problem.shortest_pass_m);
        Laid {
            passes,
            unreached,
            cells: layout.cells,
            thorough,
            work: (pass_work * tried * self.edges) as u64,
        }
    }

    /// Plans flights for the team so that every pass that can be is flown once, and the
    /// longest time is short. Passes are ordered `rounds` times, after the first by what the
    /// ways took.
    ///
    /// # Errors
    /// [`PassesError`]; nothing is planned then.
    pub(super) fn flown(
        &self,
        problem: &PassesProblem,
        laid: Laid,
        rounds: usize,
    ) -> Result<FlownPasses, PassesError> {
        let passes = &laid.passes;
        if passes.is_empty() {
            return Ok(FlownPasses {
                flights: vec![Flown::default(); self.team.len()],
                tours: vec![Vec::new(); self.team.len()],
                unreached: laid.unreached,
                cells: laid.cells,
                work: laid.work,
                ..FlownPasses::default()
            });
        }
        let desk = Desk {
            ground: self,
            problem,
            thorough: laid.thorough,
            passes,
            places: Places::new(&self.ways, passes, &self.starts, problem.turn_radius_m),
            lines: lines(passes),
        };
        let mut found = desk.best(rounds)?;
        let pairs = passes.len() * passes.len();
        found.work = (WAY_WORK * found.work + SAMPLES_WORK)
            .saturating_mul(self.edges as u64)
            .saturating_add(laid.work)
            .saturating_add((PAIR_WORK * pairs) as u64)
            .saturating_add((STEP_WORK * passes.len()) as u64 * (problem.steps * rounds) as u64);
        found.unreached.extend(laid.unreached);
        found.cells = laid.cells;
        Ok(found)
    }
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

/// What flights over passes are planned from.
struct Desk<'a> {
    ground: &'a Ground<'a>,
    problem: &'a PassesProblem,
    /// Whether the order is searched for at length; else passes are joined in the cheapest
    /// way at hand.
    thorough: bool,
    passes: &'a [Pass],
    places: Places<'a>,
    lines: Vec<lines::Line>,
}

/// What ways took that were flown, by the places where they begin and end.
type Known = BTreeMap<(usize, usize), f64>;

impl Desk<'_> {
    fn best(&self, mut rounds: usize) -> Result<FlownPasses, PassesError> {
        let mut known = Known::new();
        let mut best: Option<FlownPasses> = None;
        let mut endurances: Vec<f64> = self.ground.team.iter().map(|u| u.endurance).collect();
        let (mut shorter, mut work) = (ENDURANCE_ROUNDS, 0);
        let most = MOST_STEPS_A_PASS * self.passes.len();
        let steps = self.problem.steps.min(most);
        let near_m = NEAR_TURNS * self.problem.turn_m();
        let guess = |a, b| self.places.guess_m(a, b, near_m);
        let guessed = Matrix::of(2 * self.passes.len() + self.ground.starts.len(), &guess);
        while rounds > 0 {
            let steps = if best.is_none() {
                steps
            } else {
                steps / AGAIN_PART
            };
            let found = self.ordered(&endurances, &guessed, &mut known, steps.max(1))?;
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
    fn ordered(
        &self,
        endurances: &[f64],
        guessed: &Matrix,
        known: &mut Known,
        steps: usize,
    ) -> Result<FlownPasses, PassesError> {
        let first = 2 * self.passes.len();
        let cost = |a: usize, b: usize| {
            let flown = known.get(&(a.min(b), a.max(b))).copied();
            flown.unwrap_or_else(|| guessed.cost(a, b))
        };
        let costs = Matrix::of(guessed.len(), &cost);
        let uav = |((u, start), endurance): ((&Uav, &usize), &f64)| lines::Uav {
            speed: u.speed,
            endurance: *endurance,
            ..lines::Uav::at(first + start)
        };
        let uavs = self
            .ground
            .team
            .iter()
            .zip(&self.ground.from)
            .zip(endurances);
        let uavs: Vec<lines::Uav> = uavs.map(uav).collect();
        let found = if self.thorough {
            lines::plan(&self.lines, &uavs, &costs, steps)?
        } else {
            lines::plan_passes(&self.lines, &uavs, &costs, steps)?
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
                stop(&self.ground.router, wanted, self.ground.run_out_m)
            });
            let stops: Vec<Stop> = stops.collect();
            let flight = fly(&self.ground.router, self.ground.team[i].launch, &stops);
            // By stand the end of a pass where a way comes in, and where one goes out.
            let ends = |(stop, stand): (usize, usize)| {
                let line = 2 * order[stop];
                if tour.passes[stop].backward == is_forward(stand) {
                    (line + 1, line)
                } else {
                    (line, line + 1)
                }
            };
            let start = first + self.ground.from[i];
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
        let flights = flown
            .flights
            .iter()
            .zip(self.ground.team)
            .zip(self.ground.airs);
        flights
            .map(|((f, u), air)| f.air_m(air) / u.speed)
            .collect()
    }

    /// Who flies longer than it may, and how many times as long.
    fn too_long(&self, flown: &FlownPasses) -> Vec<(usize, f64)> {
        let times = self
            .times(flown)
            .into_iter()
            .zip(self.ground.team)
            .enumerate();
        let over = times.map(|(i, (time, u))| (i, time / u.endurance));
        over.filter(|(_, over)| *over > 1.0).collect()
    }

    /// Passes are left off the ends of flights until all are within their endurance.
    fn within_endurance(&self, mut flown: FlownPasses) -> FlownPasses {
        for (i, uav) in self.ground.team.iter().enumerate() {
            while flown.flights[i].air_m(&self.ground.airs[i]) / uav.speed > uav.endurance {
                let Some(last) = flown.tours[i].pop() else {
                    flown.flights[i] = Flown::default();
                    break;
                };
                flown.unserved.push(last);
                let stops = flown.tours[i].iter();
                let stops: Vec<Stop> = stops
                    .filter_map(|p| stop(&self.ground.router, *p, self.ground.run_out_m))
                    .collect();
                flown.flights[i] = fly(&self.ground.router, uav.launch, &stops);
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
