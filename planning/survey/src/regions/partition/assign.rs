//! Who takes which share, so that all costs together are least (D2.7 §3.6.3: regions to
//! UAVs).
//!
//! Left to others: what a share costs.

/// The column of each row, so that the sum of `cost(row, column)` is least; ties by the
/// lower number.
///
/// # Guarantees
/// Exact: shortest augmenting ways with prices (after Kuhn, Munkres and Jonker).
///
/// # Complexity
/// O(n³).
pub(in crate::regions) fn assign(n: usize, cost: impl Fn(usize, usize) -> i64) -> Vec<usize> {
    // Row and column n stand for "none" at the beginning of a way.
    let mut row_price = vec![0i64; n + 1];
    let mut col_price = vec![0i64; n + 1];
    let mut row_of = vec![n; n + 1];
    for row in 0..n {
        row_of[n] = row;
        let mut col = n;
        let mut least = vec![i64::MAX; n + 1];
        let mut link = vec![n; n + 1];
        let mut done = vec![false; n + 1];
        while row_of[col] != n {
            done[col] = true;
            let here = row_of[col];
            let mut step = (i64::MAX, n);
            for next in 0..n {
                if done[next] {
                    continue;
                }
                let reduced = cost(here, next) - row_price[here] - col_price[next];
                if reduced < least[next] {
                    least[next] = reduced;
                    link[next] = col;
                }
                step = step.min((least[next], next));
            }
            for each in 0..=n {
                if done[each] {
                    row_price[row_of[each]] += step.0;
                    col_price[each] -= step.0;
                } else if least[each] < i64::MAX {
                    least[each] -= step.0;
                }
            }
            col = step.1;
        }
        while col != n {
            row_of[col] = row_of[link[col]];
            col = link[col];
        }
    }
    let mut col_of = vec![n; n];
    for (col, row) in row_of[..n].iter().enumerate() {
        col_of[*row] = col;
    }
    col_of
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn least(costs: &[Vec<i64>], row: usize, taken: &mut Vec<bool>) -> i64 {
        if row == costs.len() {
            return 0;
        }
        let mut best = i64::MAX;
        for col in 0..costs.len() {
            if !taken[col] {
                taken[col] = true;
                best = best.min(costs[row][col] + least(costs, row + 1, taken));
                taken[col] = false;
            }
        }
        best
    }

    proptest! {
        #[test]
        fn no_other_assignment_costs_less(
            n in 1usize..7,
            all in prop::collection::vec(0i64..20, 36),
        ) {
            let costs: Vec<Vec<i64>> = (0..n).map(|i| all[i * 6..i * 6 + n].to_vec()).collect();
            let cols = assign(n, |i, j| costs[i][j]);
            let mut seen = vec![false; n];
            for col in &cols {
                prop_assert!(!core::mem::replace(&mut seen[*col], true));
            }
            let sum: i64 = cols.iter().enumerate().map(|(i, j)| costs[i][*j]).sum();
            prop_assert_eq!(sum, least(&costs, 0, &mut vec![false; n]));
        }
    }
}
