//! Which UAVs of a team fly over an area, and the plan of those (D2.7 §3.1).
//!
//! Leaves to [`super::lanes`] the plans of a team.

use super::PlannerError;
use super::flights::Flights;
use super::lanes::{Care, Desk};
use crate::fleet::sections::alike;
use crate::fleet::team_selection::{kinds, search};
use crate::objective::Objective;
use crate::team::PlannedUav;

/// Teams are compared with this part of the steps.
const SEARCH_PART: usize = 8;

/// Times that each UAV's share of the work is halved: an eighth is next to nothing.
const PACES: usize = 3;

/// Shares of the work are searched for teams of at most so many.
const MOST_PACED: usize = 6;

/// The best plan for each kind of lanes that was found, the best of all first.
///
/// # Errors
/// When there is no plan for any team.
pub(crate) fn choose(
    desk: &Desk<'_>,
    uavs: &[PlannedUav],
    steps: usize,
) -> Result<Vec<Flights>, PlannerError> {
    let care = Care {
        steps,
        rough: false,
    };
    let whole = desk.plans(uavs, care);
    let mut found: Vec<Flights> = Vec::new();
    // Apart for each kind, so that asking for both is never worse than asking for one.
    for desk in desk.kinds() {
        if let Some(team) = who(&desk, uavs, steps / SEARCH_PART)
            && team.len() < uavs.len()
        {
            found.extend(desk.plans(&members(uavs, &team), care)?);
        }
    }
    match whole {
        Ok(plans) => found.extend(plans),
        // Fewer may do what all cannot: lanes for the narrowest swath can be too many.
        Err(error) if found.is_empty() => return Err(error),
        Err(_) => {}
    }
    if desk.objective != Objective::Time
        && let Some(first) = found
            .iter()
            .reduce(|a, b| if desk.beats(b, a) { b } else { a })
        && let Some(paced) = paced(desk, uavs, first, steps / SEARCH_PART)
    {
        found.extend(desk.plans(&paced, care).unwrap_or_default());
    }
    let mut best: Vec<Flights> = Vec::new();
    for plan in found {
        match best.iter_mut().find(|b| b.laid == plan.laid) {
            Some(known) if desk.beats(&plan, known) => *known = plan,
            Some(_) => {}
            None => best.push(plan),
        }
    }
    if let [first, second] = best.as_slice()
        && desk.beats(second, first)
    {
        best.reverse();
    }
    Ok(best)
}

fn members(uavs: &[PlannedUav], team: &[usize]) -> Vec<PlannedUav> {
    team.iter().map(|i| uavs[*i].clone()).collect()
}

/// Those who fly in a plan, with less work for whom others do it better, if that helps:
/// a UAV that costs less flies as long as it can.
fn paced(
    desk: &Desk<'_>,
    uavs: &[PlannedUav],
    plan: &Flights,
    steps: usize,
) -> Option<Vec<PlannedUav>> {
    let flies = |f: &&PlannedUav| {
        plan.flights
            .iter()
            .any(|own| own.uav == f.uav && own.flies())
    };
    let mut team: Vec<PlannedUav> = uavs.iter().filter(flies).cloned().collect();
    if !(2..=MOST_PACED).contains(&team.len()) {
        return None;
    }
    let rough = Care { steps, rough: true };
    let mut best = best_of(desk, &team, rough)?;
    let mut changed = false;
    for _ in 0..PACES {
        for i in 0..team.len() {
            let mut less = team.clone();
            less[i].pace /= 2.0;
            if let Some(found) = best_of(desk, &less, rough)
                && desk.beats(&found, &best)
            {
                (best, team, changed) = (found, less, true);
            }
        }
    }
    changed.then_some(team)
}

fn best_of(desk: &Desk<'_>, team: &[PlannedUav], care: Care) -> Option<Flights> {
    let plans = desk.plans(team, care).ok()?.into_iter();
    plans.reduce(|a, b| if desk.beats(&b, &a) { b } else { a })
}

/// The team that promises the best plan.
fn who(desk: &Desk<'_>, uavs: &[PlannedUav], steps: usize) -> Option<Vec<usize>> {
    let evaluate = |team: &[usize]| -> Option<Flights> {
        let rough = Care { steps, rough: true };
        best_of(desk, &members(uavs, team), rough)
    };
    let better = |a: &Flights, b: &Flights| desk.beats(a, b);
    if desk.objective != Objective::Time {
        let found = search(&kinds(uavs, PlannedUav::is_like), evaluate, better);
        return found.map(|(team, _)| team);
    }
    // More UAVs are sooner, but for those with so narrow a swath that all get their lanes.
    let swaths: Vec<f64> = uavs.iter().map(|f| f.swath_m).collect();
    let groups = alike(&swaths);
    if groups.len() < 2 {
        return None;
    }
    let mut best: Option<(Vec<usize>, Flights)> = None;
    for narrowest in 0..groups.len() {
        let mut team: Vec<usize> = groups[narrowest..].concat();
        team.sort_unstable();
        if let Some(found) = evaluate(&team)
            && best.as_ref().is_none_or(|(_, b)| better(&found, b))
        {
            best = Some((team, found));
        }
    }
    best.map(|(team, _)| team)
}
