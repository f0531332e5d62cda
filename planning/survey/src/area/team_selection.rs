//! Which UAVs of a team fly over an area, and the plan of those (D2.7 §3.1).
//!
//! Leaves to [`super::lanes`] the plans of a team.

use super::flights::Flights;
use super::lanes::{Care, Desk};
use super::{Planner, PlannerError};
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

/// Smaller teams that are tried: so many less by one each, and these parts of all.
const FEWER: usize = 8;
const FEWER_PARTS: [f64; 3] = [0.75, 0.5, 0.25];

/// Up to so many UAVs, lanes of cells are planned in full for each smaller team.
const MOST_IN_FULL: usize = 12;

/// A smaller team is planned in full where more UAVs bring less than this part of what they
/// would if all work could be shared.
const LEAST_GAIN: f64 = 0.5;

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
        Ok(plans) => {
            if desk.objective == Objective::Time
                && let Some(first) = plans.first()
            {
                // Seeing a little more is no reason to leave UAVs at home.
                let all_s = makespan_s(first);
                for k in fewer(desk, uavs, all_s, steps / SEARCH_PART) {
                    let plans = desk.plans(&uavs[..k], care).unwrap_or_default();
                    found.extend(plans.into_iter().filter(|p| makespan_s(p) < all_s));
                }
            }
            found.extend(plans);
        }
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

/// How many of the first ones of the team promise to be about as soon as all of them are, who
/// take `all_s` seconds: many that share a few lanes may hinder each other.
fn fewer(desk: &Desk<'_>, uavs: &[PlannedUav], all_s: f64, steps: usize) -> Vec<usize> {
    let n = uavs.len();
    let by_one = (1..=FEWER).filter_map(|less| n.checked_sub(less));
    let parts = FEWER_PARTS.map(|part| (n as f64 * part) as usize);
    let mut sizes: Vec<usize> = by_one.chain(parts).filter(|k| *k > 0).collect();
    sizes.sort_unstable();
    sizes.dedup();
    if desk.planner == Planner::Approximate {
        // A rough plan of cells sees too little to be compared.
        sizes.retain(|_| n <= MOST_IN_FULL);
        return sizes;
    }
    let rough = Care { steps, rough: true };
    let mut best: Option<(usize, Flights)> = None;
    for k in sizes {
        let Some(found) = best_of(desk, &uavs[..k], rough) else {
            continue;
        };
        let most = 1.0 + LEAST_GAIN * (n as f64 / k as f64 - 1.0);
        let soon = makespan_s(&found) <= all_s * most;
        if soon && best.as_ref().is_none_or(|(_, b)| desk.beats(&found, b)) {
            best = Some((k, found));
        }
    }
    best.map(|(k, _)| k).into_iter().collect()
}

/// When the last one is back, seconds.
fn makespan_s(plan: &Flights) -> f64 {
    plan.worth(false).makespan_s
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
