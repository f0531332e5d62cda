//! Tours of a team whose UAVs differ in sensors, for `plan line` and `plan visit`: who
//! flies which targets, and what is told about it (D2.7 §3.1, §3.4, §3.5).
//!
//! Targets that ask for different sensors are planned apart: each UAV flies those of some
//! sensors that it carries, and every way to group the sensors is tried. Leaves to others:
//! which ways there are, and the planners of lines and points.

use super::fleet::Member;
use super::flights::Flight;
use super::heights::LayerArgs;
use super::objective::{Objective, Worth, in_watt_hours};
use super::output::{Printed, Sheet};
use super::tours::{Cost, Question, TURN_RADIUS_M, TourArgs, Way, Ways};
use anyhow::{Result, ensure};
use clap::Args;
use serde_json::{Map, Value, json};
use skein_flight::coverage::lines::{self, Line, LineError, LinePlan, Traversal};
use skein_survey::fleet::team_selection::{kinds, search};
use std::collections::BTreeMap;

/// Teams and groups are compared with this part of the steps.
const SEARCH_PART: usize = 8;

/// Sensors that one file may ask for: five can be grouped in 52 ways.
const MOST_SENSORS: usize = 5;

/// Times that a UAV is moved to the group that takes longest.
const MOST_MOVES: usize = 12;

/// What is asked beside the team.
#[derive(Clone, Debug, Default, Args)]
pub struct Wishes {
    /// The sensor for targets that do not ask for one themselves: UAVs without it fly
    /// none of these, and its swath counts.
    #[arg(long, value_name = "NAME")]
    pub sensor: Option<String>,
    /// What is to be least. Distance and energy choose which UAVs fly at all.
    #[arg(long, value_enum, default_value_t = Objective::Time)]
    pub objective: Objective,
    /// How flights are kept apart.
    #[command(flatten)]
    pub layers: LayerArgs,
}

impl Wishes {
    /// The sensor for a target that asks for `own`.
    #[must_use]
    pub fn sensor_for<'a>(&'a self, own: Option<&'a String>) -> Option<&'a str> {
        own.or(self.sensor.as_ref()).map(String::as_str)
    }
}

/// A planner of lines or points; the last is the steps of improvement.
pub type Solver =
    fn(&[Line], &[lines::Uav], &Cost<'_>, usize) -> std::result::Result<LinePlan, LineError>;

/// Plans and returns the text to print.
///
/// # Errors
/// When a flag is wrong, or a file cannot be written.
pub fn run(mut ways: Ways, args: &TourArgs, wishes: &Wishes, solver: Solver) -> Result<String> {
    wishes.layers.check()?;
    let in_watt_hours = in_watt_hours(&ways.team, wishes.objective)?;
    let (errands, _) = ways.solve(args, |question| {
        Desk {
            question,
            solver,
            objective: wishes.objective,
            in_watt_hours,
        }
        .best(args.steps)
    })?;
    args.output.print(&errands.sheet(&ways, args, wishes))
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
struct Errands {
    /// Who was planned for, with the length through the air, and by whom which passes.
    flights: Vec<(Flight, Vec<Traversal>)>,
    /// Lines that nobody has the endurance for.
    unserved: Vec<usize>,
    /// No plan is faster, seconds, where that is known.
    lower_bound_s: Option<f64>,
}

impl Errands {
    /// What they are compared by; the share is a count of lines.
    fn worth(&self, in_watt_hours: bool) -> Worth {
        let flights = || self.flights.iter().map(|(f, _)| f);
        let energy_wh: Option<f64> = flights().filter(|f| f.flies()).map(Flight::energy_wh).sum();
        Worth {
            share: -(self.unserved.len() as f64),
            makespan_s: flights().map(Flight::time_s).fold(0.0, f64::max),
            total_m: flights().map(|f| f.length_m).sum(),
            energy: match energy_wh {
                Some(energy_wh) if in_watt_hours => energy_wh,
                _ => flights().map(Flight::energy_s).sum(),
            },
        }
    }

    fn and(mut self, other: Self) -> Self {
        self.flights.extend(other.flights);
        self.unserved.extend(other.unserved);
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
    fn beats(&self, a: &Errands, b: &Errands) -> bool {
        let worth = |e: &Errands| e.worth(self.in_watt_hours);
        worth(a).beats(&worth(b), self.objective)
    }

    /// The best tours found.
    fn best(&self, steps: usize) -> Result<Errands> {
        let mut sensors: BTreeMap<Option<&str>, Vec<usize>> = BTreeMap::new();
        for (line, way) in self.question.ways.ways.iter().enumerate() {
            sensors.entry(way.sensor.as_deref()).or_default().push(line);
        }
        ensure!(
            sensors.len() <= MOST_SENSORS,
            "the targets ask for {} kinds of sensors, {MOST_SENSORS} are possible",
            sensors.len()
        );
        let sensors: Vec<(Option<&str>, Vec<usize>)> = sensors.into_iter().collect();
        if sensors.is_empty() {
            let all: Vec<usize> = (0..self.question.team.len()).collect();
            return self.fly(&[], &all, steps);
        }
        let mut best: Option<(Errands, Vec<Group>)> = None;
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
        let mut all = Errands::default();
        for (i, group) in groups.iter().enumerate() {
            let flown = self.group(group, steps)?;
            all = if i == 0 { flown } else { all.and(flown) };
        }
        Ok(all)
    }

    fn all(&self, groups: &[Group], steps: usize) -> Result<Errands> {
        let mut all = Errands::default();
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
        let team = &self.question.ways.team;
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
    fn moved(&self, mut groups: Vec<Group>, steps: usize) -> Result<(Errands, Vec<Group>)> {
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
            let mut next: Option<(Errands, Vec<Group>)> = None;
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
    fn group(&self, group: &Group, steps: usize) -> Result<Errands> {
        let whole = self.fly(&group.lines, &group.uavs, steps)?;
        if self.objective == Objective::Time || group.uavs.len() < 2 {
            return Ok(whole);
        }
        let of = |uav: usize| (&self.question.team[uav], &self.question.ways.team[uav]);
        let same = |a: &usize, b: &usize| {
            let ((s, m), (t, n)) = (of(*a), of(*b));
            s == t && m.turn_radius_m == n.turn_radius_m && m.cruise_power_w == n.cruise_power_w
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
    fn fly(&self, lines: &[usize], uavs: &[usize], steps: usize) -> Result<Errands> {
        let question = self.question;
        let some: Vec<Line> = lines.iter().map(|i| question.lines[*i]).collect();
        let team: Vec<lines::Uav> = uavs.iter().map(|i| question.team[*i]).collect();
        let plan = (self.solver)(&some, &team, question.metric, steps)?;
        let base_mps = question.ways.team[0].speed_mps;
        let flights = plan.tours.into_iter().zip(uavs).map(|(tour, uav)| {
            let member = &question.ways.team[*uav];
            let depot = question.ways.at[question.ways.depots[*uav]];
            let whole = |p: &Traversal| Traversal {
                line: lines[p.line],
                ..*p
            };
            let passes: Vec<Traversal> = tour.passes.iter().map(whole).collect();
            let mut track = question.ways.track(question.around, &passes, depot);
            if passes.is_empty() {
                track.truncate(1);
            }
            let flight = Flight {
                uav: *uav,
                name: member.name.clone(),
                track,
                length_m: tour.cost * base_mps,
                speed_mps: member.speed_mps,
                turn_radius_m: member.turn_radius_m.unwrap_or(TURN_RADIUS_M),
                cruise_power_w: member.cruise_power_w,
                ..Flight::default()
            };
            (flight, passes)
        });
        Ok(Errands {
            flights: flights.collect(),
            unserved: plan.unserved.iter().map(|i| lines[*i]).collect(),
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

impl Errands {
    fn sheet(&self, ways: &Ways, args: &TourArgs, wishes: &Wishes) -> Sheet {
        let of = |uav: usize| self.flights.iter().find(|(f, _)| f.uav == uav);
        let uavs = 0..ways.team.len();
        let home = |uav: usize| vec![ways.at[ways.depots[uav]]];
        let tracks = uavs
            .clone()
            .map(|uav| of(uav).map_or_else(|| home(uav), |f| f.0.track.clone()));
        let tracks: Vec<_> = tracks.collect();
        let layers = &wishes.layers;
        let separation_m = layers.separation_m(&ways.team, TURN_RADIUS_M, args.clearance_m);
        let heights_m = layers.heights_m(&tracks, separation_m, args.output.altitude_m);
        let printed = uavs.zip(tracks).map(|(uav, track)| {
            let member = &ways.team[uav];
            let (mut told, mut passes) = (Map::new(), Vec::new());
            for key in ["time_s", "energy_s"] {
                told.insert(key.to_owned(), json!(0.0));
            }
            if let Some((flight, own)) = of(uav) {
                told = flight.printed(0.0).told;
                passes.clone_from(own);
            }
            // Over the ground: through the air it differs in a wind.
            let length_m: f64 = track.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
            told.remove("lane_m");
            told.insert("length_m".to_owned(), json!(length_m));
            told.insert("targets".to_owned(), json!(passes.len()));
            let pass =
                |p: &Traversal| json!({"target": ways.ways[p.line].name, "backward": p.backward});
            let details = ("passes".to_owned(), passes.iter().map(pass).collect());
            Printed {
                name: member.name.clone(),
                track,
                altitude_m: heights_m[uav],
                speed_mps: member.speed_mps,
                told,
                details: Map::from_iter([details]),
            }
        });
        Sheet {
            origin: ways.origin,
            summary: self.summary(ways, wishes),
            flights: printed.collect(),
            shapes: Vec::new(),
        }
    }

    fn summary(&self, ways: &Ways, wishes: &Wishes) -> Value {
        let mut unserved = self.unserved.clone();
        unserved.sort_unstable();
        let unserved: Vec<&str> = unserved
            .iter()
            .map(|i| ways.ways[*i].name.as_str())
            .collect();
        let flights = || self.flights.iter().map(|(f, _)| f).filter(|f| f.flies());
        let sees = |member: &Member, way: &Way| {
            let own = way.sensor.as_ref();
            own.is_none_or(|s| member.sensors.contains_key(s))
        };
        let rests = |uav: &usize| !flights().any(|f| f.uav == *uav);
        let at_home = (0..ways.team.len()).filter(rests).map(|uav| {
            let member = &ways.team[uav];
            let why = if ways.ways.iter().any(|w| sees(member, w)) {
                super::NOT_NEEDED
            } else {
                "has none of the sensors that are asked for"
            };
            json!({"name": member.name, "why": why})
        });
        let at_home: Vec<Value> = at_home.collect();
        let worth = self.worth(false);
        let energy_wh: Option<f64> = flights().map(Flight::energy_wh).sum();
        json!({
            "makespan_s": worth.makespan_s, "lower_bound_s": self.lower_bound_s,
            "total_s": flights().map(Flight::time_s).sum::<f64>(),
            "total_m": worth.total_m, "energy_s": worth.energy, "energy_wh": energy_wh,
            "objective": wishes.objective, "sensor": wishes.sensor,
            "uavs_flying": flights().count(), "at_home": at_home,
            "targets": ways.ways.len(), "unserved": unserved, "notices": ways.notices,
        })
    }
}

#[cfg(test)]
mod tests;
