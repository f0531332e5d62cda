//! Which UAVs of a team fly over an area, and the plan of those (D2.7 §3.1).
//!
//! Leaves to [`super::lanes`] the plans of a team.

use super::at_once::{BATCH, at_once};
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

/// Up to so many UAVs all smaller teams are looked at.
const MOST_LADDER: usize = 32;

/// Of larger teams, smaller ones that are tried: so many less by one each, and these parts of
/// all.
const FEWER: usize = 8;
const FEWER_PARTS: [f64; 3] = [0.75, 0.5, 0.25];

/// Of these, one is planned in full where more UAVs bring less than this part of what they
/// would if all work could be shared.
const LEAST_GAIN: f64 = 0.5;

/// The best plan for each kind of lanes that was found, the best of all first.
///
/// # Guarantees
/// Where time is to be least, up to [`MOST_LADDER`] UAVs and unless a quick plan is asked for,
/// no plan of the first ones of the team sees as much sooner: they are among those that this
/// is chosen from, but for such as are proved to be no better.
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
        better_than: None,
    };
    let mut found: Vec<Flights> = Vec::new();
    let mut refused = None;
    // Apart for each kind, so that asking for both is never worse than asking for one.
    for desk in kinds_of(desk, uavs) {
        match of_team(&desk, uavs, care) {
            Ok(plans) => {
                let first = found.len();
                found.extend(plans);
                if desk.objective == Objective::Time {
                    let fewer = of_fewer(&desk, uavs, care, &found[first..]);
                    found.extend(fewer);
                }
            }
            Err(error) => refused = refused.or(Some(error)),
        }
    }
    if let (true, Some(error)) = (found.is_empty(), refused) {
        return Err(error);
    }
    if desk.objective != Objective::Time
        && let Some(first) = best_of(desk, found.iter())
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

/// The kinds of lanes that are worth planning apart.
fn kinds_of<'a>(desk: &Desk<'a>, uavs: &[PlannedUav]) -> Vec<Desk<'a>> {
    let swaths: Vec<f64> = uavs.iter().map(|f| f.swath_m).collect();
    if alike(&swaths).len() < 2 {
        return vec![*desk];
    }
    desk.kinds()
}

/// Plans of a team, and of those of it who promise the best plan.
fn of_team(desk: &Desk<'_>, uavs: &[PlannedUav], care: Care) -> Result<Vec<Flights>, PlannerError> {
    let mut found = Vec::new();
    if let Some(team) = who(desk, uavs, care.steps / SEARCH_PART)
        && team.len() < uavs.len()
    {
        found.extend(desk.plans(&members(uavs, &team), care)?);
    }
    match desk.plans(uavs, care) {
        Ok(plans) => found.extend(plans),
        // Fewer may do what all cannot: lanes for the narrowest swath can be too many.
        Err(error) if found.is_empty() => return Err(error),
        Err(_) => {}
    }
    Ok(found)
}

/// Plans of the first ones of a team that may be better than those of all: many that share a
/// few lanes may hinder each other.
fn of_fewer(desk: &Desk<'_>, uavs: &[PlannedUav], care: Care, all: &[Flights]) -> Vec<Flights> {
    let n = uavs.len();
    if n > MOST_LADDER || desk.ground.request.quick {
        return of_some(desk, uavs, care, all);
    }
    if desk.planner == Planner::Approximate {
        let sizes: Vec<usize> = (1..n).rev().collect();
        let plan = |k: usize| of_team(desk, &uavs[..k], care).unwrap_or_default();
        let batches = sizes.chunks(BATCH);
        return batches
            .flat_map(|sizes| at_once(sizes.to_vec(), plan))
            .flatten()
            .collect();
    }
    let mut found: Vec<Flights> = Vec::new();
    for k in (1..n).rev() {
        let known = best_of(desk, all.iter().chain(&found));
        let better_than = known.map(|plan| plan.worth(desk.in_watt_hours));
        // Of unlike starts fewer may be led to fewer passes, so that what all promise says
        // nothing of them.
        let promises = all.first().map_or(&[][..], |plan| &plan.promises);
        let same_start = uavs.iter().all(|u| u.start == uavs[0].start);
        if let Some(than) = &better_than
            && same_start
            && !promises.is_empty()
            && !promises.iter().any(|p| p.may_be_sooner_with(k, than))
        {
            break;
        }
        let care = Care {
            better_than,
            ..care
        };
        found.extend(of_team(desk, &uavs[..k], care).unwrap_or_default());
    }
    found
}

/// Of a large team, plans of that smaller one that promises most when it is planned roughly.
fn of_some(desk: &Desk<'_>, uavs: &[PlannedUav], care: Care, all: &[Flights]) -> Vec<Flights> {
    let Some(all_s) = best_of(desk, all.iter()).map(makespan_s) else {
        return Vec::new();
    };
    if desk.planner == Planner::Approximate {
        // A rough plan of cells sees too little to be compared.
        return Vec::new();
    }
    let n = uavs.len();
    let by_one = (1..=FEWER).filter_map(|less| n.checked_sub(less));
    let parts = FEWER_PARTS.map(|part| (n as f64 * part) as usize);
    let mut sizes: Vec<usize> = by_one.chain(parts).filter(|k| *k > 0).collect();
    sizes.sort_unstable();
    sizes.dedup();
    let mut best: Option<(usize, Flights)> = None;
    for k in sizes {
        let Some(found) = roughly(desk, &uavs[..k], care.steps / SEARCH_PART) else {
            continue;
        };
        let most = 1.0 + LEAST_GAIN * (n as f64 / k as f64 - 1.0);
        let soon = makespan_s(&found) <= all_s * most;
        if soon && best.as_ref().is_none_or(|(_, b)| desk.beats(&found, b)) {
            best = Some((k, found));
        }
    }
    let plans = best.and_then(|(k, _)| desk.plans(&uavs[..k], care).ok());
    plans.unwrap_or_default()
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
    let mut best = roughly(desk, &team, steps)?;
    let mut changed = false;
    for _ in 0..PACES {
        for i in 0..team.len() {
            let mut less = team.clone();
            less[i].pace /= 2.0;
            if let Some(found) = roughly(desk, &less, steps)
                && desk.beats(&found, &best)
            {
                (best, team, changed) = (found, less, true);
            }
        }
    }
    changed.then_some(team)
}

/// The best of some plans.
fn best_of<'a>(desk: &Desk<'_>, plans: impl Iterator<Item = &'a Flights>) -> Option<&'a Flights> {
    plans.reduce(|a, b| if desk.beats(b, a) { b } else { a })
}

/// The best plan of a team that is only compared with others.
fn roughly(desk: &Desk<'_>, team: &[PlannedUav], steps: usize) -> Option<Flights> {
    let care = Care {
        steps,
        rough: true,
        better_than: None,
    };
    let plans = desk.plans(team, care).ok()?.into_iter();
    plans.reduce(|a, b| if desk.beats(&b, &a) { b } else { a })
}

/// The team that promises the best plan.
fn who(desk: &Desk<'_>, uavs: &[PlannedUav], steps: usize) -> Option<Vec<usize>> {
    let evaluate =
        |team: &[usize]| -> Option<Flights> { roughly(desk, &members(uavs, team), steps) };
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
