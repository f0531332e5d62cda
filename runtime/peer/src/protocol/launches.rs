//! What a peer knows before it has heard anybody: who is launched where and when, and the
//! division of the whole loop that follows from it (D2.7 §3.6.5).
//!
//! Among many the claims of all need minutes to cross a component, and where UAVs take off at
//! several places, their parts do not hear each other at first. A roster says the same to
//! everybody, so everybody computes the same division from it, begins with its own section and
//! takes the others for owners of theirs until it hears better
//! ([`super::sections::Sections::presume`]).

use crate::config::Launch;
use crate::wire::message::CellRun;
use skein_flight::coverage::ring::{CoverageLoop, Direction, LoopCell};

/// How often sections are dealt and their lengths made even: the deal follows the lengths and
/// these the ways to the sections; the third time nothing changes any more where it was tried.
const DEALS: usize = 4;

/// How often all pairs are looked at for an exchange at most.
const SWEEPS: usize = 8;

/// The section that a roster gives to one UAV.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Planned {
    /// Whose.
    pub id: u16,
    /// Which cells.
    pub run: CellRun,
    /// Flown which way.
    pub direction: Direction,
    /// When it will be done, milliseconds from the launch of the fleet.
    pub end_ms: u64,
}

/// A stretch of the loop, and who flies it.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    first: usize,
    count: usize,
    by: usize,
}

/// The whole loop divided among those of a roster, so that all are done at about the same time:
/// each has one stretch, those that take off late or have a long way a shorter one, and whoever
/// would come too late for any none. Ways are straight, and none of it is optimal: exchanges of
/// two end where none makes the ways together shorter. `turn_mm` is the way of turning round.
#[must_use]
pub fn first_division(
    roster: &[Launch],
    coverage_loop: &CoverageLoop,
    turn_mm: u32,
) -> Vec<Planned> {
    let mut begins: Vec<u64> = vec![0];
    for cell in coverage_loop.cells() {
        let last = begins.last().copied().unwrap_or(0);
        begins.push(last + u64::from(LoopCell::flown_mm(cell)));
    }
    let table = Table {
        roster,
        coverage_loop,
        turn_mm,
        begins,
    };
    let mut best: Option<(u64, Vec<Stretch>)> = None;
    let mut stretches = table.even();
    for _ in 0..DEALS {
        table.deal(&mut stretches);
        stretches = table.levelled(&stretches);
        let ends = stretches.iter().map(|s| table.end_ms(s));
        let end_ms = ends.max().unwrap_or(u64::MAX);
        if best.as_ref().is_none_or(|(ms, _)| end_ms < *ms) {
            best = Some((end_ms, stretches.clone()));
        }
    }
    let stretches = best.map(|(_, stretches)| stretches).unwrap_or_default();
    let planned = stretches.iter().filter(|s| s.count > 0);
    planned.filter_map(|s| table.planned(s)).collect()
}

struct Table<'a> {
    roster: &'a [Launch],
    coverage_loop: &'a CoverageLoop,
    turn_mm: u32,
    /// Where each cell begins along the loop, and the end, millimetres.
    begins: Vec<u64>,
}

impl Table<'_> {
    fn length_mm(&self) -> u64 {
        self.begins.last().copied().unwrap_or(0)
    }

    fn n(&self) -> usize {
        self.begins.len() - 1
    }

    /// The boundary that is nearest to a place along the loop.
    fn cell_at(&self, mm: u64) -> usize {
        let next = self.begins.partition_point(|b| *b < mm).min(self.n());
        let before = next.saturating_sub(1);
        let nearer = |i: usize| self.begins.get(i).map_or(u64::MAX, |b| b.abs_diff(mm));
        if nearer(before) <= nearer(next) {
            before
        } else {
            next
        }
    }

    /// As many stretches of one length as there are UAVs.
    fn even(&self) -> Vec<Stretch> {
        let share = self.length_mm() / (self.roster.len() as u64).max(1);
        self.cut((0..self.roster.len()).map(|by| (by, share)))
    }

    fn cut(&self, lengths: impl Iterator<Item = (usize, u64)>) -> Vec<Stretch> {
        let lengths: Vec<(usize, u64)> = lengths.collect();
        let (mut at, mut first) = (0, 0);
        let mut out = Vec::with_capacity(lengths.len());
        for (i, (by, mm)) in lengths.iter().enumerate() {
            at += mm;
            let is_last = i + 1 == lengths.len();
            let end = if is_last { self.n() } else { self.cell_at(at) };
            let end = end.max(first);
            out.push(Stretch {
                first,
                count: end - first,
                by: *by,
            });
            first = end;
        }
        out
    }

    fn speed_mmps(&self, uav: usize) -> u64 {
        let speed = self.roster.get(uav).map_or(1, |l| l.speed_mmps);
        u64::from(speed.max(1))
    }

    /// The straight way of a UAV to the nearer end of a stretch, millimetres, and which way it
    /// is flown from there.
    fn way(&self, uav: usize, s: &Stretch) -> (u64, Direction) {
        let Some(launch) = self.roster.get(uav) else {
            return (0, Direction::Forward);
        };
        let to = |boundary: usize| {
            let at = self.coverage_loop.boundary(boundary).position();
            let east_mm = at.x * 1000.0 - f64::from(launch.east_mm);
            let north_mm = at.y * 1000.0 - f64::from(launch.north_mm);
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a distance on the plane is small and positive"
            )]
            let mm = (east_mm * east_mm + north_mm * north_mm).sqrt() as u64;
            mm
        };
        let (ahead, back) = (to(s.first), to((s.first + s.count) % self.n().max(1)));
        if ahead <= back {
            (ahead, Direction::Forward)
        } else {
            (back, Direction::Backward)
        }
    }

    /// When a UAV is at its stretch, milliseconds.
    fn begin_ms(&self, uav: usize, s: &Stretch) -> u64 {
        let takeoff_ms = self.roster.get(uav).map_or(0, |l| u64::from(l.takeoff_ms));
        let way_mm = self.way(uav, s).0 + u64::from(self.turn_mm);
        takeoff_ms + way_mm * 1000 / self.speed_mmps(uav)
    }

    fn end_ms(&self, s: &Stretch) -> u64 {
        if s.count == 0 {
            return 0;
        }
        let mm = self.begins[s.first + s.count] - self.begins[s.first];
        self.begin_ms(s.by, s) + mm * 1000 / self.speed_mmps(s.by)
    }

    /// Gives the stretches to those whose ways are shorter together; where two ways are as
    /// long, to who takes off first the one that is farther.
    fn deal(&self, stretches: &mut [Stretch]) {
        let n = stretches.len();
        let uavs: Vec<usize> = stretches.iter().map(|s| s.by).collect();
        let ways: Vec<Vec<u64>> = stretches
            .iter()
            .map(|s| uavs.iter().map(|u| self.way(*u, s).0).collect())
            .collect();
        let takeoffs = uavs.iter().map(|u| self.roster.get(*u));
        let takeoffs: Vec<u64> = takeoffs
            .map(|l| l.map_or(0, |l| u64::from(l.takeoff_ms)))
            .collect();
        // The nearest pairs first: way, stretch and UAV in one number, which sorts faster.
        let mut pairs: Vec<u128> = Vec::with_capacity(n * n);
        for (s, row) in (0_u128..).zip(&ways) {
            let way = |(u, mm): (u128, &u64)| (u128::from(*mm) << 64) | (s << 32) | u;
            pairs.extend((0_u128..).zip(row).map(way));
        }
        pairs.sort_unstable();
        let mut of: Vec<usize> = vec![usize::MAX; n];
        let mut dealt = vec![false; n];
        for pair in pairs {
            let part = |shift: u32| usize::try_from((pair >> shift) & 0xffff_ffff);
            let (Ok(s), Ok(u)) = (part(32), part(0)) else {
                continue;
            };
            if of[s] == usize::MAX && !dealt[u] {
                of[s] = u;
                dealt[u] = true;
            }
        }
        for _ in 0..SWEEPS {
            let mut changed = false;
            for a in 0..n {
                for b in a + 1..n {
                    let (u, v) = (of[a], of[b]);
                    let now = (ways[a][u] + ways[b][v], {
                        takeoffs[u] * ways[a][u] + takeoffs[v] * ways[b][v]
                    });
                    let then = (ways[a][v] + ways[b][u], {
                        takeoffs[v] * ways[a][v] + takeoffs[u] * ways[b][u]
                    });
                    if then < now {
                        of.swap(a, b);
                        changed = true;
                    }
                }
            }
            if !changed {
                break;
            }
        }
        for (s, u) in stretches.iter_mut().zip(of) {
            s.by = uavs[u];
        }
    }

    /// The same order of UAVs along the loop with lengths at which all are done at once, given
    /// their ways. Whoever would have nothing to do by then is left out.
    fn levelled(&self, stretches: &[Stretch]) -> Vec<Stretch> {
        let mut kept: Vec<(usize, u64, u64)> = stretches
            .iter()
            .map(|s| (s.by, self.begin_ms(s.by, s), self.speed_mmps(s.by)))
            .collect();
        loop {
            let speeds: u64 = kept.iter().map(|(_, _, v)| v).sum();
            let behind: u64 = kept
                .iter()
                .map(|(_, begin_ms, v)| begin_ms * v / 1000)
                .sum();
            let all_ms = (self.length_mm() + behind) * 1000 / speeds.max(1);
            let many = kept.len();
            kept.retain(|(_, begin_ms, _)| *begin_ms < all_ms);
            if kept.len() == many {
                let mm =
                    |(by, begin_ms, v): (usize, u64, u64)| (by, (all_ms - begin_ms) * v / 1000);
                return self.cut(kept.into_iter().map(mm));
            }
        }
    }

    fn planned(&self, s: &Stretch) -> Option<Planned> {
        Some(Planned {
            id: self.roster.get(s.by)?.id,
            run: CellRun {
                first: u16::try_from(s.first).ok()?,
                count: u16::try_from(s.count).ok()?,
            },
            direction: self.way(s.by, s).1,
            end_ms: self.end_ms(s),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::mission;
    use std::sync::Arc;

    fn launch(id: u16, east_m: i32, north_m: i32, takeoff_s: u32) -> Launch {
        Launch {
            id,
            east_mm: east_m * 1000,
            north_mm: north_m * 1000,
            takeoff_ms: takeoff_s * 1000,
            speed_mmps: 12_000,
        }
    }

    /// The division of a loop of 16 x 12 cells of 48 m, each cell by exactly one of the roster.
    fn divided(roster: &[Launch]) -> Vec<Planned> {
        let geometry = Arc::new(mission(1, 16, 12)).geometry().unwrap();
        let cells = u16::try_from(geometry.coverage_loop.len()).unwrap();
        let planned = first_division(roster, &geometry.coverage_loop, 200_000);
        let mut times = vec![0; usize::from(cells)];
        for p in &planned {
            (0..p.run.count).for_each(|k| times[usize::from((p.run.first + k) % cells)] += 1);
        }
        assert!(times.iter().all(|t| *t == 1), "{times:?}");
        planned
    }

    #[test]
    fn the_last_stretch_takes_what_the_lengths_leave_over() {
        let geometry = Arc::new(mission(1, 16, 12)).geometry().unwrap();
        let n = geometry.coverage_loop.len();
        let table = Table {
            roster: &[launch(1, 0, 0, 0), launch(2, 0, 0, 0)],
            coverage_loop: &geometry.coverage_loop,
            turn_mm: 0,
            begins: (0..=n as u64).map(|i| i * 48_000).collect(),
        };
        let cut = table.cut([(0, 480_000), (1, 48_000)].into_iter());
        let counts: Vec<usize> = cut.iter().map(|s| s.count).collect();
        assert_eq!(counts, [10, n - 10]);
    }

    fn count_of(planned: &[Planned], id: u16) -> u16 {
        planned
            .iter()
            .find(|p| p.id == id)
            .map_or(0, |p| p.run.count)
    }

    #[test]
    fn all_are_done_at_about_the_same_time_and_who_takes_off_late_has_less() {
        let roster: Vec<Launch> = (0..10)
            .map(|i| launch(i + 1, 380, 290, 5 * u32::from(i)))
            .collect();
        let planned = divided(&roster);
        let ends = planned.iter().map(|p| p.end_ms);
        let (first, last) = (ends.clone().min().unwrap(), ends.max().unwrap());
        // Whole cells of 4 s, and the ways of the last deal.
        assert!(last - first < 30_000, "{planned:?}");
        assert!(count_of(&planned, 1) > count_of(&planned, 10));
    }

    #[test]
    fn rosters_of_up_to_256_divide_the_loop() {
        for n in [65, 128, 256] {
            let roster: Vec<Launch> = (1..=n).map(|id| launch(id, 380, 290, 0)).collect();
            assert!(divided(&roster).len() <= usize::from(n));
        }
    }

    #[test]
    fn who_would_come_too_late_gets_nothing() {
        let mut roster: Vec<Launch> = (1..10).map(|id| launch(id, 380, 290, 0)).collect();
        roster.push(launch(10, 380, 290, 600));
        let planned = divided(&roster);
        assert_eq!(planned.len(), 9);
        assert_eq!(count_of(&planned, 10), 0);
    }

    #[test]
    fn each_place_gets_what_is_around_it() {
        let corners = [(0, 0), (768, 0), (768, 576), (0, 576)];
        let roster: Vec<Launch> = (0..12)
            .map(|i| {
                let (east_m, north_m) = corners[usize::from(i % 4)];
                launch(i + 1, east_m, north_m, 0)
            })
            .collect();
        let geometry = Arc::new(mission(1, 16, 12)).geometry().unwrap();
        let lp = &geometry.coverage_loop;
        for p in divided(&roster) {
            let (east_m, north_m) = corners[usize::from((p.id - 1) % 4)];
            let ends = [p.run.first, p.run.first + p.run.count];
            let away = |c: u16| {
                let at = lp.boundary(usize::from(c) % lp.len()).position();
                (at.x - f64::from(east_m)).hypot(at.y - f64::from(north_m))
            };
            // Half of the area is within so many metres of the nearest corner.
            let nearer = away(ends[0]).min(away(ends[1]));
            assert!(nearer < 400.0, "{p:?} begins {nearer:.0} m away");
        }
    }

    #[test]
    fn a_roster_of_one_place_or_of_nobody_is_no_trouble() {
        assert_eq!(divided(&[launch(1, 0, 0, 0)]).len(), 1);
        let geometry = Arc::new(mission(1, 6, 4)).geometry().unwrap();
        assert!(first_division(&[], &geometry.coverage_loop, 0).is_empty());
    }
}
