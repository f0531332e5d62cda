//! Which UAVs of a team fly at all, when distance or energy counts (D2.7 §3.1).
//!
//! UAVs of one kind are the same to every plan, so that only their number matters. Small
//! teams are searched wholly; from larger ones UAVs are taken away as long as that helps.
//! Leaves to the caller what a plan of a team is worth.

/// Teams with at most this many choices are searched wholly: a plan of a search takes
/// some hundredths of a second.
pub const MOST_CHOICES: usize = 48;

/// Plans that are made at most when UAVs are taken away one after the other.
const MOST_TRIED: usize = 96;

/// By UAV: the index of the first UAV that is the same.
#[must_use]
pub fn kinds<T>(team: &[T], same: impl Fn(&T, &T) -> bool) -> Vec<usize> {
    let first = |i: usize| (0..i).find(|&j| same(&team[j], &team[i])).unwrap_or(i);
    (0..team.len()).map(first).collect()
}

/// The best team found with what `evaluate` made of it, UAVs ascending; `None` when
/// `evaluate` has nothing for any team.
///
/// `kinds` as [`kinds`] makes them; `better(a, b)` tells whether `a` is strictly better.
/// Of a kind the first UAVs fly.
///
/// # Guarantees
/// Never worse than the whole team. The best of all teams when there are at most
/// [`MOST_CHOICES`] of them.
pub fn search<T>(
    kinds: &[usize],
    mut evaluate: impl FnMut(&[usize]) -> Option<T>,
    better: impl Fn(&T, &T) -> bool,
) -> Option<(Vec<usize>, T)> {
    let counts = counts(kinds);
    let choices = counts
        .iter()
        .try_fold(1usize, |n, (_, count)| n.checked_mul(count + 1));
    let mut best: Option<(Vec<usize>, T)> = None;
    let mut offer = |chosen: &[usize]| -> bool {
        let team = team(kinds, &counts, chosen);
        let Some(found) = evaluate(&team) else {
            return false;
        };
        let first = best.as_ref().is_none_or(|(_, b)| better(&found, b));
        if first {
            best = Some((team, found));
        }
        first
    };
    let all: Vec<usize> = counts.iter().map(|c| c.1).collect();
    if choices.is_some_and(|n| n <= MOST_CHOICES + 1) {
        // The whole team comes first: with equal worth it flies.
        let mut chosen = all.clone();
        loop {
            offer(&chosen);
            if !less(&mut chosen, &all) {
                break;
            }
        }
    } else {
        take_away(&all, offer);
    }
    best
}

/// The kinds in order, and how many UAVs each has.
fn counts(kinds: &[usize]) -> Vec<(usize, usize)> {
    let count = |kind: usize| kinds.iter().filter(|k| **k == kind).count();
    let firsts = (0..kinds.len()).filter(|&i| kinds[i] == i);
    firsts.map(|kind| (kind, count(kind))).collect()
}

/// The UAVs of a choice: so many of each kind.
fn team(kinds: &[usize], counts: &[(usize, usize)], chosen: &[usize]) -> Vec<usize> {
    let mut team: Vec<usize> = counts
        .iter()
        .zip(chosen)
        .flat_map(|((kind, _), n)| {
            let alike = (0..kinds.len()).filter(|&i| kinds[i] == *kind);
            alike.take(*n).collect::<Vec<_>>()
        })
        .collect();
    team.sort_unstable();
    team
}

/// The next choice in order; false after the last but the empty one.
fn less(chosen: &mut [usize], all: &[usize]) -> bool {
    for (n, most) in chosen.iter_mut().zip(all) {
        if *n > 0 {
            *n -= 1;
            return chosen.iter().any(|n| *n > 0);
        }
        *n = *most;
    }
    false
}

/// Takes UAVs away while that helps: halves of a kind first, then fewer.
fn take_away(all: &[usize], mut offer: impl FnMut(&[usize]) -> bool) {
    let mut kept = all.to_vec();
    offer(&kept);
    let mut tried = 1;
    loop {
        let mut next: Option<Vec<usize>> = None;
        for kind in 0..kept.len() {
            let mut away = kept[kind].div_ceil(2);
            while away > 0 && tried < MOST_TRIED {
                let mut fewer = kept.clone();
                fewer[kind] -= away;
                if fewer.iter().any(|n| *n > 0) {
                    tried += 1;
                    // An offer that is taken is better than all before it.
                    if offer(&fewer) {
                        next = Some(fewer);
                    }
                }
                away /= 2;
            }
        }
        match next {
            Some(fewer) => kept = fewer,
            None => return,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// What a team sees, and what it costs: all is to be seen, then the cheapest.
    fn worth(team: &[usize], sees: &[f64], costs: &[f64]) -> (f64, f64) {
        let sum = |of: &[f64]| team.iter().map(|i| of[*i]).sum::<f64>();
        (sum(sees).min(1.0), sum(costs))
    }

    fn better(a: &(f64, f64), b: &(f64, f64)) -> bool {
        a.0 > b.0 + 1e-9 || (a.0 > b.0 - 1e-9 && a.1 < b.1 - 1e-9)
    }

    proptest! {
        #[test]
        fn small_teams_are_searched_wholly(
            uavs in prop::collection::vec((0.0..1.0f64, 0.1..5.0f64), 1..6),
        ) {
            let (sees, costs): (Vec<f64>, Vec<f64>) = uavs.into_iter().unzip();
            let n = sees.len();
            let kinds: Vec<usize> = (0..n).collect();
            let found = search(&kinds, |team| Some(worth(team, &sees, &costs)), better);
            let (_, best) = found.unwrap();
            for mask in 1..1u32 << n {
                let team: Vec<usize> = (0..n).filter(|i| mask >> i & 1 == 1).collect();
                prop_assert!(!better(&worth(&team, &sees, &costs), &best), "{team:?}");
            }
        }

        #[test]
        fn large_teams_end_no_worse_than_whole(
            uavs in prop::collection::vec((0.0..0.3f64, 0.1..5.0f64), 6..40),
            twins in 1..4usize,
        ) {
            let all: Vec<(f64, f64)> = uavs.iter().flat_map(|u| vec![*u; twins]).collect();
            let (sees, costs): (Vec<f64>, Vec<f64>) = all.iter().copied().unzip();
            let kinds = kinds(&all, |a, b| a.0.total_cmp(&b.0).is_eq() && a.1.total_cmp(&b.1).is_eq());
            let mut tried = 0;
            let found = search(&kinds, |team| {
                tried += 1;
                Some(worth(team, &sees, &costs))
            }, better);
            let (team, best) = found.unwrap();
            let whole: Vec<usize> = (0..all.len()).collect();
            prop_assert!(!better(&worth(&whole, &sees, &costs), &best));
            prop_assert!(!team.is_empty() && tried <= MOST_TRIED);
        }
    }

    #[test]
    fn equal_uavs_are_counted_not_told_apart() {
        let mut teams = Vec::new();
        let found = search(
            &kinds(&[1, 2, 1, 1], |a, b| a == b),
            |team| {
                teams.push(team.to_vec());
                (team.len() == 2).then_some(team.to_vec())
            },
            |a, b| a < b,
        );
        // 4 × 2 choices without the empty one.
        assert_eq!(teams.len(), 7);
        assert_eq!(found.unwrap().0, vec![0, 1]);
        assert!(search(&[0, 0], |_| None::<f64>, |a, b| a < b).is_none());
    }
}
