//! Tours of a team whose UAVs differ in sensors: who flies which targets (D2.7 §3.1, §3.4,
//! §3.5).
//!
//! Targets that ask for different sensors are planned apart: each UAV flies those of some
//! sensors that it carries, and every way to group the sensors is tried. Leaves to others:
//! which ways there are, and the planners of lines and points.

use super::flown_tours::Pilot;
use super::tour_problem::{Cost, Question, TourProblem, Way};
use super::{MOST_SENSORS, Targets, TourPlan, TourRequest, ToursError, UavTour, Visit};
use crate::fleet::team_selection::{kinds, search};
use crate::flight::{Flight, Stays, UavFlight};
use crate::objective::{Objective, Worth, in_watt_hours};
use crate::team::Uav;
use crate::visits::visit;
use skein_flight::coverage::lines::{self, Line, LineError, LinePlan, Traversal};
use std::collections::BTreeMap;

/// Teams and groups are compared with this part of the steps.
const SEARCH_PART: usize = 8;

/// Times that targets are shared out again where turns take what endurance was left.
const ENDURANCE_ROUNDS: usize = 3;

/// Times that a UAV is moved to the group that takes longest.
const MOST_MOVES: usize = 12;

/// A planner of lines or points; the last is the steps of improvement.
pub(super) type Solver =
    fn(&[Line], &[lines::Uav], &Cost<'_>, usize) -> Result<LinePlan, LineError>;

/// Plans the tours of a problem.
pub(super) fn plan(
    mut problem: TourProblem,
    request: &TourRequest,
) -> Result<TourPlan, ToursError> {
    request.separation.check()?;
    let in_watt_hours = in_watt_hours(&problem.team, request.objective)?;
    let solver: Solver = match request.targets {
        Targets::Points(_) => |lines, team, metric, steps| visit(lines, team, metric, steps),
        Targets::Lines(_) => |lines, team, metric, steps| lines::plan(lines, team, metric, steps),
    };
    let (tours, _) = problem.solve(|question| {
        let pilot = Pilot::new(question.problem, request)?;
        let mut team = question.team.to_vec();
        let mut rounds = ENDURANCE_ROUNDS;
        loop {
            let desk = Desk {
                question: &Question {
                    team: &team,
                    ..*question
                },
                solver,
                objective: request.objective,
                in_watt_hours,
            };
            let tours = desk.best(request.steps)?;
            let mut late = false;
            for (flight, passes) in &tours.flights {
                let longest_s = question.problem.team[flight.uav].endurance_s;
                if let Some(longest_s) = longest_s.filter(|_| rounds > 0) {
                    // What turns take is planned for as a shorter endurance.
                    let over = pilot.flown(flight, passes).flight.time_s() / longest_s;
                    late |= over > 1.0;
                    team[flight.uav].endurance /= over.max(1.0) * 1.01;
                }
            }
            if !late {
                return Ok(tours.flown(&pilot));
            }
            rounds -= 1;
        }
    })?;
    Ok(tours.told(problem, request))
}

/// What tours are planned from.
struct Desk<'a> {
    question: &'a Question<'a>,
    solver: Solver,
    objective: Objective,
    in_watt_hours: bool,
}

/// Tours of some UAVs.
#[derive(Clone, Debug, Default)]
struct Tours {
    /// Who was planned for, with the length through the air, and by whom which passes.
    flights: Vec<(Flight, Vec<Traversal>)>,
    /// Lines that nobody has the endurance for.
    unserved: Vec<usize>,
    /// Lines that no curve leads to.
    left: Vec<usize>,
    /// No plan is faster, seconds, where that is known.
    lower_bound_s: Option<f64>,
}

impl Tours {
    /// What they are compared by; the share is a count of lines.
    fn worth(&self, in_watt_hours: bool) -> Worth {
        let flights = self.flights.iter().map(|(f, _)| f);
        let share = -(self.unserved.len() as f64);
        Worth {
            total_m: flights.clone().map(|f| f.length_m).sum(),
            ..Worth::of(flights, share, in_watt_hours)
        }
    }

    fn and(mut self, other: Self) -> Self {
        self.flights.extend(other.flights);
        self.unserved.extend(other.unserved);
        self.left.extend(other.left);
        self.lower_bound_s = None;
        self
    }
}

/// Lines that the same UAVs may fly, and who of them does.
#[derive(Clone)]
struct Group {
    lines: Vec<usize>,
    able: Vec<usize>,
    uavs: Vec<usize>,
}

impl Desk<'_> {
    fn beats(&self, a: &Tours, b: &Tours) -> bool {
        let worth = |e: &Tours| e.worth(self.in_watt_hours);
        worth(a).beats(&worth(b), self.objective)
    }

    /// The best tours found.
    fn best(&self, steps: usize) -> Result<Tours, ToursError> {
        let mut sensors: BTreeMap<Option<&str>, Vec<usize>> = BTreeMap::new();
        for (line, way) in self.question.problem.ways.iter().enumerate() {
            sensors.entry(way.sensor.as_deref()).or_default().push(line);
        }
        if sensors.len() > MOST_SENSORS {
            return Err(ToursError::TooManySensors(sensors.len()));
        }
        let sensors: Vec<(Option<&str>, Vec<usize>)> = sensors.into_iter().collect();
        if sensors.is_empty() {
            let all: Vec<usize> = (0..self.question.team.len()).collect();
            return self.fly(&[], &all, steps);
        }
        let mut best: Option<(Tours, Vec<Group>)> = None;
        for parts in partitions(sensors.len()) {
            let Some(groups) = self.groups(&sensors, &parts) else {
                continue;
            };
            let found = if parts.iter().all(|p| *p == 0) {
                (self.all(&groups, steps / SEARCH_PART)?, groups)
            } else {
                self.moved(groups, steps / SEARCH_PART)?
            };
            if best.as_ref().is_none_or(|b| self.beats(&found.0, &b.0)) {
                best = Some(found);
            }
        }
        // One carrier for each sensor makes groups that can be flown, so there are some.
        let groups = best.map(|b| b.1).unwrap_or_default();
        let mut all = Tours::default();
        for (i, group) in groups.iter().enumerate() {
            let flown = self.group(group, steps)?;
            all = if i == 0 { flown } else { all.and(flown) };
        }
        Ok(all)
    }

    fn all(&self, groups: &[Group], steps: usize) -> Result<Tours, ToursError> {
        let mut all = Tours::default();
        for group in groups {
            all = all.and(self.fly(&group.lines, &group.uavs, steps)?);
        }
        Ok(all)
    }

    /// Groups of sensors with everybody in one of them; `None` when a group has nobody.
    fn groups(
        &self,
        sensors: &[(Option<&str>, Vec<usize>)],
        parts: &[usize],
    ) -> Option<Vec<Group>> {
        let team = &self.question.problem.team;
        let n = parts.iter().max().map_or(0, |p| p + 1);
        let mut groups: Vec<Group> = (0..n)
            .map(|part| {
                let mine = || sensors.iter().zip(parts).filter(move |(_, p)| **p == part);
                let able = |uav: &usize| {
                    mine().all(|((s, _), _)| s.is_none_or(|s| team[*uav].sensors.contains_key(s)))
                };
                let mut lines: Vec<usize> = mine().flat_map(|((_, l), _)| l.clone()).collect();
                lines.sort_unstable();
                Group {
                    lines,
                    able: (0..team.len()).filter(able).collect(),
                    uavs: Vec::new(),
                }
            })
            .collect();
        // Who can do least is given work first, where there is most of it for each UAV.
        let can = |uav: &usize| groups.iter().filter(|g| g.able.contains(uav)).count();
        let mut order: Vec<usize> = (0..team.len()).collect();
        order.sort_by_key(|uav| (can(uav), *uav));
        for uav in order {
            let work = |g: &Group| g.lines.len() as f64 / (g.uavs.len() as f64 + 1e-3);
            let most = (0..groups.len())
                .filter(|i| groups[*i].able.contains(&uav))
                .max_by(|a, b| {
                    work(&groups[*a])
                        .total_cmp(&work(&groups[*b]))
                        .then(b.cmp(a))
                });
            if let Some(i) = most {
                groups[i].uavs.push(uav);
            }
        }
        for group in &mut groups {
            group.uavs.sort_unstable();
        }
        groups.iter().all(|g| !g.uavs.is_empty()).then_some(groups)
    }

    /// Moves UAVs to the group that takes longest while that helps.
    fn moved(
        &self,
        mut groups: Vec<Group>,
        steps: usize,
    ) -> Result<(Tours, Vec<Group>), ToursError> {
        let mut best = self.all(&groups, steps)?;
        for _ in 0..MOST_MOVES {
            let mut times = Vec::new();
            for group in &groups {
                let flown = self.fly(&group.lines, &group.uavs, steps)?;
                let short = !flown.unserved.is_empty();
                times.push((short, flown.worth(self.in_watt_hours).makespan_s));
            }
            let longest = (0..groups.len()).max_by(|a, b| {
                times[*a]
                    .0
                    .cmp(&times[*b].0)
                    .then(times[*a].1.total_cmp(&times[*b].1))
            });
            let Some(to) = longest else {
                break;
            };
            let mut next: Option<(Tours, Vec<Group>)> = None;
            for from in (0..groups.len()).filter(|i| *i != to && groups[*i].uavs.len() > 1) {
                let Some(uav) = groups[from]
                    .uavs
                    .iter()
                    .copied()
                    .find(|u| groups[to].able.contains(u))
                else {
                    continue;
                };
                let mut moved = groups.clone();
                moved[from].uavs.retain(|u| *u != uav);
                moved[to].uavs.push(uav);
                moved[to].uavs.sort_unstable();
                let found = self.all(&moved, steps)?;
                if self.beats(&found, next.as_ref().map_or(&best, |n| &n.0)) {
                    next = Some((found, moved));
                }
            }
            match next {
                Some(found) => (best, groups) = found,
                None => break,
            }
        }
        Ok((best, groups))
    }

    /// The tours of a group, of those of its UAVs that are best.
    fn group(&self, group: &Group, steps: usize) -> Result<Tours, ToursError> {
        let whole = self.fly(&group.lines, &group.uavs, steps)?;
        if self.objective == Objective::Time || group.uavs.len() < 2 {
            return Ok(whole);
        }
        let of = |uav: usize| (&self.question.team[uav], &self.question.problem.team[uav]);
        let same = |a: &usize, b: &usize| {
            let ((s, m), (t, n)) = (of(*a), of(*b));
            s == t
                && m.turn_radius_m.total_cmp(&n.turn_radius_m).is_eq()
                && m.cruise_power_w == n.cruise_power_w
        };
        let found = search(
            &kinds(&group.uavs, same),
            |team| {
                let uavs: Vec<usize> = team.iter().map(|i| group.uavs[*i]).collect();
                self.fly(&group.lines, &uavs, steps / SEARCH_PART).ok()
            },
            |a, b| self.beats(a, b),
        );
        let Some((team, _)) = found else {
            return Ok(whole);
        };
        let uavs: Vec<usize> = team.iter().map(|i| group.uavs[*i]).collect();
        let few = self.fly(&group.lines, &uavs, steps)?;
        Ok(if self.beats(&few, &whole) { few } else { whole })
    }

    /// The tours of some UAVs along some lines.
    fn fly(&self, lines: &[usize], uavs: &[usize], steps: usize) -> Result<Tours, ToursError> {
        let question = self.question;
        let some: Vec<Line> = lines.iter().map(|i| question.lines[*i]).collect();
        let team: Vec<lines::Uav> = uavs.iter().map(|i| question.team[*i]).collect();
        let plan = (self.solver)(&some, &team, question.metric, steps)?;
        let base_mps = question.problem.team[0].speed_mps;
        let flights = plan.tours.into_iter().zip(uavs).map(|(tour, i)| {
            let uav = &question.problem.team[*i];
            let whole = |p: &Traversal| Traversal {
                line: lines[p.line],
                ..*p
            };
            let passes: Vec<Traversal> = tour.passes.iter().map(whole).collect();
            let mut track = question.problem.track(question.detours, &passes, uav.start);
            if passes.is_empty() {
                track.truncate(1);
            }
            let flight = Flight {
                uav: *i,
                name: uav.name.clone(),
                track,
                length_m: tour.cost * base_mps,
                speed_mps: uav.speed_mps,
                turn_radius_m: uav.turn_radius_m,
                cruise_power_w: uav.cruise_power_w,
                ..Flight::default()
            };
            (flight, passes)
        });
        Ok(Tours {
            flights: flights.collect(),
            unserved: plan.unserved.iter().map(|i| lines[*i]).collect(),
            left: Vec::new(),
            // Of the team that flies: without a meaning where that is a choice.
            lower_bound_s: (self.objective == Objective::Time).then_some(plan.lower_bound),
        })
    }
}

/// All ways to group `n` things: by thing, its group; the first is all in one.
fn partitions(n: usize) -> Vec<Vec<usize>> {
    let mut all = vec![Vec::new()];
    for _ in 0..n {
        all = all
            .into_iter()
            .flat_map(|parts: Vec<usize>| {
                let next = parts.iter().max().map_or(0, |p| p + 1);
                (0..=next).map(move |p| [&parts[..], &[p]].concat())
            })
            .collect();
    }
    all
}

impl Tours {
    /// The same as they are flown; what then is beyond an endurance is not.
    fn flown(self, pilot: &Pilot<'_>) -> Self {
        let mut all = Self {
            flights: Vec::new(),
            ..self
        };
        for (flight, passes) in self.flights {
            let (flown, beyond) = pilot.flown_within(&flight, &passes);
            all.unserved.extend(beyond.iter().map(|p| p.line));
            all.left.extend(flown.left.iter().map(|p| p.line));
            all.flights.push((flown.flight, flown.passes));
        }
        all
    }

    /// The same for the caller.
    fn told(&self, problem: TourProblem, request: &TourRequest) -> TourPlan {
        let of = |uav: usize| self.flights.iter().find(|(f, _)| f.uav == uav);
        let team = &problem.team;
        let track = |(i, uav): (usize, &Uav)| match of(i) {
            Some((flight, _)) => flight.track.clone(),
            None => vec![uav.start],
        };
        let tracks: Vec<_> = team.iter().enumerate().map(track).collect();
        let (separation, clearance_m) = (&request.separation, request.clearance_m);
        let heights_m = separation.heights_m(team, clearance_m, &tracks, request.altitude_m);
        let tours = team.iter().zip(heights_m).enumerate();
        let uavs = tours.map(|(i, (uav, altitude_m))| {
            let visit = |p: &Traversal| Visit {
                target: problem.ways[p.line].name.clone(),
                backward: p.backward,
            };
            let sees = |way: &Way| {
                let own = way.sensor.as_ref();
                own.is_none_or(|s| uav.sensors.contains_key(s))
            };
            let (mut flight, visits) = match of(i) {
                Some((flight, passes)) => {
                    (flight.told(altitude_m), passes.iter().map(visit).collect())
                }
                None => (
                    UavFlight::stays(uav, altitude_m, Stays::NotNeeded),
                    Vec::new(),
                ),
            };
            flight.lane_m = None;
            if !flight.flies() && !problem.ways.iter().any(sees) {
                flight.stays = Some(Stays::NoSensor);
            }
            UavTour { flight, visits }
        });
        let mut unserved = [&self.unserved[..], &self.left].concat();
        unserved.sort_unstable();
        let mut notices = problem.notices.clone();
        let mut left = self.left.clone();
        left.sort_unstable();
        notices.extend(left.iter().map(|i| {
            let name = &problem.ways[*i].name;
            format!("{name}: left out, no flight with its turns keeps clear of zones and fences")
        }));
        let flights = || self.flights.iter().map(|(f, _)| f).filter(|f| f.flies());
        let worth = self.worth(false);
        TourPlan {
            uavs: uavs.collect(),
            makespan_s: worth.makespan_s,
            lower_bound_s: self.lower_bound_s,
            total_s: flights().map(Flight::time_s).sum(),
            total_m: flights().map(Flight::ground_m).sum(),
            energy_s: worth.energy,
            energy_wh: flights().map(Flight::energy_wh).sum(),
            targets: problem.ways.len(),
            unserved: unserved
                .iter()
                .map(|i| problem.ways[*i].name.clone())
                .collect(),
            notices,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::partitions;

    #[test]
    fn things_are_grouped_in_all_ways() {
        assert_eq!(partitions(1), [[0]]);
        assert_eq!(partitions(3).len(), 5);
        assert_eq!(partitions(5).len(), 52);
        assert_eq!(partitions(3)[0], [0, 0, 0]);
    }
}
