//! Matchings against all pairings of small graphs, and their own proof on large ones.

use super::*;

use skein_geometry::random::SplitMix64;

fn below(random: &mut SplitMix64, n: u64) -> u64 {
    random.bits() % n
}

/// Least cost over all perfect matchings, by subsets.
fn oracle(n: usize, edges: &[(u32, u32, i64)]) -> Option<i64> {
    let mut least = vec![None; 1 << n];
    least[0] = Some(0i64);
    for set in 0..1usize << n {
        let Some(so_far) = least[set] else { continue };
        let Some(v) = (0..n).find(|&v| set & (1 << v) == 0) else {
            continue;
        };
        for &(a, b, c) in edges {
            let (a, b) = (a as usize, b as usize);
            let other = if a == v {
                b
            } else if b == v {
                a
            } else {
                continue;
            };
            if set & (1 << other) == 0 {
                let next = set | (1 << v) | (1 << other);
                let cost = so_far + c;
                if least[next].is_none_or(|x| cost < x) {
                    least[next] = Some(cost);
                }
            }
        }
    }
    least[(1 << n) - 1]
}

fn total(m: &Matching, edges: &[(u32, u32, i64)]) -> i64 {
    let mut sum = 0;
    for (v, &w) in m.mate.iter().enumerate() {
        assert_eq!(m.mate[w as usize] as usize, v);
        if v < w as usize {
            sum += edges
                .iter()
                .filter(|e| (e.0 as usize, e.1) == (v, w) || (e.1 as usize, e.0) == (v, w))
                .map(|e| e.2)
                .min()
                .expect("matched along an edge");
        }
    }
    sum
}

#[test]
fn as_cheap_as_every_other_perfect_matching_of_small_graphs() {
    let mut random = SplitMix64::new(7);
    let (mut solved, mut refused) = (0, 0);
    for _ in 0..20_000 {
        let n = 2 * (1 + below(&mut random, 6) as usize);
        let dense = 1 + below(&mut random, 4);
        let range = 1 + below(&mut random, 30);
        let mut edges = Vec::new();
        for a in 0..n as u32 {
            for b in a + 1..n as u32 {
                if below(&mut random, 4) < dense {
                    edges.push((a, b, 2 * below(&mut random, range) as i64));
                }
            }
        }
        let best = oracle(n, &edges);
        let found = min_cost_perfect(n, &edges);
        assert_eq!(found.as_ref().map(|m| total(m, &edges)), best, "{edges:?}");
        if let Some(m) = found {
            solved += 1;
            for &(a, b, c) in &edges {
                assert!(m.reduced(a as usize, b as usize, c) >= 0);
            }
        } else {
            refused += 1;
        }
    }
    assert!(solved > 10_000 && refused > 500, "{solved} {refused}");
}

#[test]
fn the_dual_solution_proves_large_matchings() {
    let mut random = SplitMix64::new(3);
    for n in [40u32, 120, 300] {
        let at: Vec<(i64, i64)> = (0..n)
            .map(|_| {
                (
                    below(&mut random, 1000) as i64,
                    below(&mut random, 1000) as i64,
                )
            })
            .collect();
        let mut edges = Vec::new();
        for a in 0..n {
            for b in a + 1..n {
                let (p, q) = (at[a as usize], at[b as usize]);
                let d2 = (p.0 - q.0).pow(2) + (p.1 - q.1).pow(2);
                edges.push((a, b, 2 * (d2 as f64).sqrt().round() as i64));
            }
        }
        let m = min_cost_perfect(n as usize, &edges).unwrap();
        let mut dual = 0;
        // Each blossom's variable counts once in the bound, but sits in every potential.
        for v in 0..n as usize {
            dual += m.potential[v];
        }
        for node in &m.nodes[n as usize..] {
            if !node.children.is_empty() {
                assert!(node.dual >= 0);
                dual -= node.dual * (node.vertices.len() as i64 - 1);
            }
        }
        assert_eq!(dual, total(&m, &edges));
        for &(a, b, c) in &edges {
            assert!(m.reduced(a as usize, b as usize, c) >= 0);
        }
    }
}
