//! The division that is flown: the best of backtracking MSTC and free entry, by the
//! makespan that they predict (D2.7 §3.6.5).
//!
//! Leaves the first to [`super::backtracking`], the second to `free_entry`.

use super::backtracking::{self, Division, Leg, RingCell, Section, Uav};
use super::coverage_loop::CoverageLoop;
use super::free_entry::{Search, Tours};
use super::transfers::Transfers;
use crate::route::Router;
use serde::{Deserialize, Serialize};

/// By what rule the open cells of a loop are divided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Rule {
    /// The better of backtracking MSTC and free entry.
    #[default]
    Best,
    /// Backtracking MSTC: one stretch of the loop around each UAV.
    Backtracking,
}

impl Rule {
    /// Whether it is the rule without which missions are written.
    #[must_use]
    #[allow(
        clippy::trivially_copy_pass_by_ref,
        reason = "the signature that serde asks for"
    )]
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// What a division is flown on: the loop, and the ways off it.
#[derive(Clone, Copy, Debug)]
pub struct RouteNetwork<'a> {
    /// The loop that is divided.
    pub coverage_loop: &'a CoverageLoop,
    /// Ways that keep clear of the zones.
    pub router: &'a Router,
}

/// Steps of the search for each UAV and each open cell: measured, what four times as many
/// gain is below one percent.
const STEPS_PER_UAV: u64 = 1500;
/// See [`STEPS_PER_UAV`].
const STEPS_PER_CELL: u64 = 10;

/// How often at most ways round zones are asked for and the plan is improved with what they
/// are: measured, three times suffice where zones are few.
const PROOFS: u64 = 24;

/// Divides the open cells of a loop among UAVs by a rule.
///
/// # Guarantees
/// Each open cell is in exactly one section or in `unassigned`. By the ways that the
/// router finds the makespan is never above that of [`backtracking::divide`], nor are
/// more cells unassigned; where both are alike it is that division. Equal inputs have
/// equal answers on every machine. A section has at most six legs.
///
/// # Complexity
/// A fixed number of steps for each UAV and each open cell, and the ways of at most 27 plans
/// asked of the router.
#[must_use]
pub fn divide(ring: &[RingCell], uavs: &[Uav], network: RouteNetwork<'_>, rule: Rule) -> Division {
    let plain = backtracking::divide(ring, uavs);
    let open = ring.iter().filter(|c| c.open).count();
    let is_of_loop =
        ring.len() == network.coverage_loop.len() && ring.len() < usize::from(u16::MAX);
    if rule == Rule::Backtracking || uavs.is_empty() || open == 0 || !is_of_loop {
        return plain;
    }
    let mut uavs = uavs.to_vec();
    uavs.sort_by_key(|u| u.id);
    let transfers = Transfers::new(network, ring, &uavs);
    let mut search = Search::new(transfers, ring, &uavs);
    let legs: Vec<Vec<Leg>> = plain.sections.iter().map(|s| s.legs.clone()).collect();
    let around = search.tours_of(&legs);
    let steps = STEPS_PER_UAV * uavs.len() as u64 + STEPS_PER_CELL * open as u64;
    let free = best(&mut search, &around, steps);
    search.prove(&around);
    let around = search.reckoned(&around);
    let sooner = free.cost() < around.cost() || !search.is_flyable(&around);
    let chosen = if sooner && search.is_flyable(&free) {
        free
    } else {
        around
    };
    let chosen = search.handed_over(chosen);
    division_of(&search, &uavs, &chosen)
}

/// The best plan found from both first ones, its ways round zones proved.
fn best(search: &mut Search<'_>, around: &Tours, steps: u64) -> Tours {
    let mut best = search.improved_within(steps, around.clone());
    let packed = search.packed_within(steps);
    let packed = search.improved_within(steps, packed);
    if packed.cost() < best.cost() {
        best = packed;
    }
    search.prove(&best);
    let mut proved = search.within_endurance(&search.reckoned(&best));
    for _ in 0..PROOFS {
        let next = search.improved_within(steps / 4, proved.clone());
        let was_longer = search.prove(&next);
        let next = search.within_endurance(&search.reckoned(&next));
        if next.cost() < proved.cost() {
            proved = next;
        } else if !was_longer {
            break;
        }
    }
    proved
}

fn division_of(search: &Search<'_>, uavs: &[Uav], tours: &Tours) -> Division {
    let (legs, unassigned) = search.legs_of(tours);
    let each = uavs.iter().zip(legs).zip(tours.done_ms());
    let sections: Vec<Section> = each
        .map(|((uav, legs), done_ms)| Section {
            id: uav.id,
            legs,
            finish_ms: u32::try_from(done_ms).unwrap_or(u32::MAX),
        })
        .collect();
    let makespan_ms = sections.iter().map(|s| s.finish_ms).max().unwrap_or(0);
    Division {
        sections,
        makespan_ms,
        unassigned,
    }
}

#[cfg(test)]
mod tests {
    use super::super::backtracking::OffLoop;
    use super::super::coverage_loop::Direction;
    use super::super::problem::LoopProblem;
    use super::super::shares::overburdened;
    use super::super::tree::Tree;
    use super::*;
    use crate::coverage::lanes;
    use crate::route::RouteLimits;
    use proptest::prelude::*;
    use skein_geometry::frame::{Point, Pose};
    use skein_geometry::random::SplitMix64;
    use skein_geometry::{NoFlyZones, Polygon};
    use std::sync::Arc;

    const LANE_M: f64 = 48.0;
    const CLEARANCE_M: f64 = 8.0;

    struct Site {
        coverage_loop: CoverageLoop,
        router: Router,
    }

    impl Site {
        fn new(columns: u16, rows: u16, zones: Vec<Polygon>) -> Self {
            let (east, north) = (LANE_M * f64::from(columns), LANE_M * f64::from(rows));
            let corners = [(0.0, 0.0), (east, 0.0), (east, north), (0.0, north)];
            let zones = Arc::new(NoFlyZones::new(zones));
            let problem = LoopProblem {
                area: Polygon::new(corners.map(|(x, y)| Point::new(x, y)).to_vec()).unwrap(),
                zones: Arc::clone(&zones),
                lane_spacing_m: LANE_M,
                turn_radius_m: 21.4,
                clearance_m: CLEARANCE_M,
                footprint_across_m: 59.0,
                footprint_along_m: 45.0,
                tracking_error_m: 2.0,
                launch: Point::new(-40.0, -40.0),
                tree: Tree::default(),
            };
            let limits = RouteLimits {
                turn_radius_m: problem.turn_radius_m,
                clearance_m: problem.clearance_m,
            };
            Self {
                coverage_loop: lanes::build(&problem).unwrap(),
                router: Router::new(zones, limits),
            }
        }

        /// A block in the middle, wide enough that ways lead round it.
        fn with_a_block(columns: u16, rows: u16) -> Self {
            let (x, y) = (24.0 * f64::from(columns), 24.0 * f64::from(rows));
            let corners = [(-60.0, -40.0), (60.0, -40.0), (60.0, 40.0), (-60.0, 40.0)];
            let block = corners.map(|(e, n)| Point::new(x + e, y + n)).to_vec();
            Self::new(columns, rows, vec![Polygon::new(block).unwrap()])
        }

        /// Two to four pockets, behind walls with a gate of two lanes each.
        fn with_pockets(draw: &mut SplitMix64) -> Self {
            let (columns, rows) = (16, 12);
            let (east, north) = (LANE_M * f64::from(columns), LANE_M * f64::from(rows));
            let wall = |(west, south): (f64, f64), (east, north): (f64, f64)| {
                let corners = [(west, south), (east, south), (east, north), (west, north)];
                Polygon::new(corners.map(|(x, y)| Point::new(x, y)).to_vec()).unwrap()
            };
            let lanes = |n: usize| LANE_M * f64::from(u16::try_from(n).unwrap());
            let (past, half) = (90.0, 3.0);
            let across = lanes(4 + 2 * draw.below(2));
            let gate = lanes(1 + draw.below(14));
            let (below, above) = (across - half, across + half);
            let mut walls = vec![
                wall((-past, below), (gate - half, above)),
                wall((gate + 2.0 * LANE_M + half, below), (east + past, above)),
            ];
            for (from, to) in [(-past, below), (above, north + past)] {
                let upright = lanes(4 + 2 * draw.below(5));
                let is_in_gate = (upright - gate - LANE_M).abs() <= 2.5 * LANE_M;
                if draw.below(4) == 0 || is_in_gate {
                    continue;
                }
                let (from, to) = if draw.below(2) == 0 {
                    (from.max(2.0 * LANE_M), to)
                } else {
                    (from, to.min(north - 2.0 * LANE_M))
                };
                walls.push(wall((upright - half, from), (upright + half, to)));
            }
            Self::new(columns, rows, walls)
        }

        fn network(&self) -> RouteNetwork<'_> {
            RouteNetwork {
                coverage_loop: &self.coverage_loop,
                router: &self.router,
            }
        }

        fn ring(&self, is_open: impl Fn(usize) -> bool) -> Vec<RingCell> {
            self.coverage_loop.ring(|i, _| is_open(usize::from(i)))
        }

        fn uav(&self, id: u16, anchor: u16) -> Uav {
            Uav {
                anchor,
                id,
                heading: Direction::Forward,
                release_ms: 0,
                speed_mmps: 13_000,
                turn_ms: 13_000,
                endurance_ms: 5_000_000,
                off_loop: None,
            }
        }

        /// A swarm some way into a mission: parts of the loop are covered, some UAVs are
        /// anywhere, some have little endurance.
        fn drawn(&self, draw: &mut SplitMix64) -> (Vec<RingCell>, Vec<Uav>) {
            let n = self.coverage_loop.len();
            let small = |draw: &mut SplitMix64, n: usize| u16::try_from(draw.below(n)).unwrap();
            let mut open = vec![true; n];
            for _ in 0..draw.below(7) {
                let (from, count) = (draw.below(n), draw.below(n / 3));
                (from..from + count).for_each(|i| open[i % n] = false);
            }
            let short = draw.below(8) == 0;
            let uavs = (0..1 + draw.below(7)).map(|i| {
                let speed_mmps = 10_000 + 100 * u32::from(small(draw, 60));
                let endurance_s = if short { 20 + draw.below(300) } else { 5000 };
                let heading = match draw.below(2) {
                    0 => Direction::Forward,
                    _ => Direction::Backward,
                };
                let uav = Uav {
                    heading,
                    release_ms: 1000 * u32::from(small(draw, 30)),
                    speed_mmps,
                    // As an executive tells it: 7π/3 radii, and a second.
                    turn_ms: 157_000_000 / speed_mmps + 1000,
                    endurance_ms: 1000 * u32::try_from(endurance_s).unwrap(),
                    ..self.uav(u16::try_from(i).unwrap(), small(draw, n))
                };
                if draw.below(3) == 0 {
                    self.strayed(uav, draw)
                } else {
                    uav
                }
            });
            let uavs = uavs.collect();
            (self.ring(|i| open[i]), uavs)
        }

        /// The same UAV with nothing to fly: anywhere, a way from its anchor.
        fn strayed(&self, uav: Uav, draw: &mut SplitMix64) -> Uav {
            let at = Point::new(draw.unit() * 800.0 - 100.0, draw.unit() * 600.0 - 100.0);
            let ready_ms = 500 * u32::try_from(draw.below(20)).unwrap();
            let off = OffLoop::of(Pose::new(at, draw.unit() * 6.0 - 3.0), ready_ms);
            let to = self
                .coverage_loop
                .boundary_towards(usize::from(uav.anchor), uav.heading);
            match self.router.route(off.pose(), to) {
                Ok(way) => Uav {
                    release_ms: (way.length_m() * 1e6 / f64::from(uav.speed_mmps)) as u32
                        + 1
                        + ready_ms,
                    off_loop: Some(off),
                    ..uav
                },
                Err(_) => uav,
            }
        }

        /// When a section is done by ways that the router or the loop gives, flying cell by
        /// cell, milliseconds; `None` where there is no way.
        fn flown_ms(&self, ring: &[RingCell], uav: &Uav, legs: &[Leg]) -> Option<f64> {
            let n = ring.len();
            let entry =
                |c: u16, d: Direction| usize::from(c) + usize::from(d == Direction::Backward);
            let pose = |b: usize, d: Direction| self.coverage_loop.boundary_towards(b, d);
            let mut at = match uav.off_loop {
                Some(off) => (off.pose(), None),
                None => {
                    let (b, d) = (usize::from(uav.anchor), uav.heading);
                    (pose(b, d), Some((b, d)))
                }
            };
            let mut flown_m = 0.0;
            let visits = legs
                .iter()
                .flat_map(|l| l.cells(n).map(|c| (c, l.direction)));
            for (c, d) in visits.filter(|(c, _)| ring[usize::from(*c)].open) {
                let to = entry(c, d) % n;
                let along = at.1.filter(|(_, looks)| *looks == d).map(|(mut b, _)| {
                    let mut mm = 0;
                    while b != to {
                        let next = if d == Direction::Forward {
                            (b + 1) % n
                        } else {
                            (b + n - 1) % n
                        };
                        mm += ring[if d == Direction::Forward { b } else { next }].travel_mm;
                        b = next;
                    }
                    f64::from(mm) / 1000.0
                });
                let direct = self
                    .router
                    .route(at.0, pose(to, d))
                    .ok()
                    .map(|c| c.length_m());
                let way_m = [along, direct].into_iter().flatten().reduce(f64::min)?;
                flown_m += way_m + f64::from(ring[usize::from(c)].service_mm) / 1000.0;
                let out = entry(c, d.opposite()) % n;
                at = (pose(out, d), Some((out, d)));
            }
            let ready_ms = f64::from(uav.off_loop.map_or(uav.release_ms, |off| off.ready_ms));
            Some(ready_ms + flown_m * 1e6 / f64::from(uav.speed_mmps))
        }
    }

    /// Each open cell is in one section or unassigned, and no section takes longer than
    /// its UAV may fly.
    fn assert_sound(ring: &[RingCell], uavs: &[Uav], d: &Division) {
        let mut owners = vec![0; ring.len()];
        for s in &d.sections {
            for leg in &s.legs {
                let ends = [leg.cells(ring.len()).next(), leg.cells(ring.len()).last()];
                assert!(
                    ends.iter().flatten().all(|c| ring[usize::from(*c)].open),
                    "{d:?}"
                );
                for c in leg.cells(ring.len()) {
                    owners[usize::from(c)] += u32::from(ring[usize::from(c)].open);
                }
            }
            let uav = uavs.iter().find(|u| u.id == s.id).unwrap();
            assert!(
                s.legs.is_empty() || s.finish_ms <= uav.release_ms + uav.endurance_ms,
                "{s:?}"
            );
        }
        for c in &d.unassigned {
            owners[usize::from(*c)] += 1;
        }
        for (o, c) in owners.iter().zip(ring) {
            assert_eq!(*o, u32::from(c.open), "{d:?}");
        }
    }

    fn makespan_ms(site: &Site, ring: &[RingCell], uavs: &[Uav], d: &Division) -> Option<f64> {
        let mut each = d.sections.iter().filter(|s| !s.legs.is_empty()).map(|s| {
            let uav = uavs.iter().find(|u| u.id == s.id).unwrap();
            site.flown_ms(ring, uav, &s.legs)
        });
        each.try_fold(0.0, |most: f64, ms| Some(most.max(ms?)))
    }

    #[test]
    fn sections_are_near_the_work_bound_from_wherever_uavs_start() {
        let site = Site::new(22, 20, Vec::new());
        let n = site.coverage_loop.len();
        let (corner, middle) = (Some((0.0, 0.0)), Some((528.0, 480.0)));
        for (at, three_are_gone, most) in [
            (None, false, 1.12),
            (corner, false, 1.25),
            (middle, false, 1.16),
            (None, true, 1.40),
            (corner, true, 1.50),
        ] {
            let uav = |i: u16| Uav {
                speed_mmps: if i.is_multiple_of(2) { 14_500 } else { 12_000 },
                off_loop: at.map(|(east, north)| {
                    OffLoop::of(Pose::new(Point::new(east, north + f64::from(i)), 1.0), 0)
                }),
                ..site.uav(i, u16::try_from(usize::from(i) * n / 8).unwrap())
            };
            // Five go on after half of each section was flown.
            let (k, half) = if three_are_gone { (5, n / 16) } else { (8, 0) };
            let ring = site.ring(|i| i % (n / 8) >= half);
            let uavs: Vec<Uav> = (0..k).map(uav).collect();
            let d = divide(&ring, &uavs, site.network(), Rule::Best);
            assert_sound(&ring, &uavs, &d);
            let speed_mmps: u32 = uavs.iter().map(|u| u.speed_mmps).sum();
            let open = ring.iter().filter(|c| c.open);
            let work_mm: f64 = open.map(|c| f64::from(c.service_mm)).sum();
            let bound_ms = work_mm * 1000.0 / f64::from(speed_mmps);
            let ratio = f64::from(d.makespan_ms) / bound_ms;
            assert!(
                ratio <= most,
                "{ratio} from {at:?}, three gone: {three_are_gone}"
            );
        }
    }

    #[test]
    fn what_short_batteries_cannot_fly_falls_to_who_has_fuel() {
        let site = Site::with_a_block(22, 20);
        let n = site.coverage_loop.len();
        let draw = &mut SplitMix64::new(3);
        for _ in 0..8 {
            let ring = site.ring(|_| true);
            let uav = |i: u16| Uav {
                endurance_ms: if i < 3 {
                    130_000 + 20_000 * u32::from(i)
                } else {
                    5_000_000
                },
                ..site.uav(i, 0)
            };
            let mut uavs: Vec<Uav> = (0..6).map(uav).collect();
            for uav in &mut uavs {
                uav.anchor = u16::try_from(draw.below(n)).unwrap();
                *uav = site.strayed(*uav, draw);
            }
            let d = divide(&ring, &uavs, site.network(), Rule::Best);
            assert_sound(&ring, &uavs, &d);
            assert!(d.unassigned.is_empty(), "{} cells", d.unassigned.len());
            let work_mm: f64 = ring.iter().map(|c| f64::from(c.service_mm)).sum();
            let flown_mm: u64 = 150_000 * 3 * 13;
            let least_ms = (work_mm - flown_mm as f64) / (3.0 * 13.0);
            let ratio = f64::from(d.makespan_ms) / least_ms;
            assert!(ratio < 1.5, "{ratio}");
        }
    }

    #[test]
    fn a_uav_from_which_no_way_is_known_begins_where_it_told_that_it_will_be() {
        let site = Site::with_a_block(22, 20);
        let n = site.coverage_loop.len();
        let anchor = n / 3;
        let ring = site.ring(|i| (anchor + 5..anchor + 35).contains(&i));
        // Right before the block, flying at it.
        let off = OffLoop::of(Pose::new(Point::new(455.0, 480.0), 0.0), 0);
        let entry = site
            .coverage_loop
            .boundary_towards(anchor + 5, Direction::Forward);
        assert!(site.router.route(off.pose(), entry).is_err());
        let uav = Uav {
            release_ms: 20_000,
            off_loop: Some(off),
            ..site.uav(1, u16::try_from(anchor).unwrap())
        };
        let d = divide(&ring, &[uav], site.network(), Rule::Best);
        assert_sound(&ring, &[uav], &d);
        let least_ms = u64::from(backtracking::divide(&ring, &[uav]).makespan_ms);
        let most_ms = least_ms + 1;
        assert!(
            (20_000..=most_ms).contains(&u64::from(d.makespan_ms)),
            "{d:?} {least_ms}"
        );
    }

    /// Eight swarms between walls drawn from a seed, and nobody of them has too much.
    fn assert_shared_behind_walls(seed: u64) {
        let draw = &mut SplitMix64::new(seed);
        let site = Site::with_pockets(draw);
        for _ in 0..8 {
            let (ring, uavs) = site.drawn(draw);
            let d = divide(&ring, &uavs, site.network(), Rule::Best);
            assert_sound(&ring, &uavs, &d);
            let who = overburdened(&ring, &uavs, site.network(), &d);
            assert_eq!(who, None, "seed {seed}: {d:?}");
        }
    }

    /// The search alone leaves somebody with too much in each of these.
    #[test]
    fn what_the_search_leaves_to_the_last_behind_walls_goes_to_who_is_sooner() {
        for seed in [38, 120, 245, 538, 609, 627] {
            assert_shared_behind_walls(seed);
        }
    }

    #[test]
    fn a_mission_may_ask_for_backtracking_alone() {
        let site = Site::new(10, 8, Vec::new());
        let (ring, uavs) = site.drawn(&mut SplitMix64::new(7));
        let asked = divide(&ring, &uavs, site.network(), Rule::Backtracking);
        assert_eq!(asked, backtracking::divide(&ring, &uavs));
        assert_ne!(asked, divide(&ring, &uavs, site.network(), Rule::Best));
    }

    proptest! {
        #![proptest_config(ProptestConfig { max_shrink_iters: 64, ..ProptestConfig::default() })]

        #[test]
        fn nobody_has_too_much_behind_walls(seed in any::<u64>()) {
            assert_shared_behind_walls(seed);
        }

        #[test]
        fn never_worse_than_backtracking(seed in any::<u64>(), block in any::<bool>()) {
            let site = if block { Site::with_a_block(14, 10) } else { Site::new(10, 8, Vec::new()) };
            let draw = &mut SplitMix64::new(seed);
            for _ in 0..4 {
                let (ring, uavs) = site.drawn(draw);
                let d = divide(&ring, &uavs, site.network(), Rule::Best);
                assert_sound(&ring, &uavs, &d);
                let oracle = backtracking::divide(&ring, &uavs);
                prop_assert!(d.unassigned.len() <= oracle.unassigned.len());
                prop_assert!(d.sections.iter().all(|s| s.legs.len() <= 6));
                let ms = makespan_ms(&site, &ring, &uavs, &d);
                let oracle_ms = makespan_ms(&site, &ring, &uavs, &oracle);
                if let (Some(ms), Some(oracle_ms)) = (ms, oracle_ms) {
                    // Lengths are rounded to millimetres and milliseconds.
                    let more = d.unassigned.len() < oracle.unassigned.len();
                    prop_assert!(more || ms <= oracle_ms + 20.0, "{ms} after {oracle_ms}");
                    prop_assert!((ms - f64::from(d.makespan_ms)).abs() <= 20.0, "{ms} told as {}", d.makespan_ms);
                }
                let mut shuffled = uavs.clone();
                draw.shuffle(&mut shuffled);
                prop_assert_eq!(&d, &divide(&ring, &shuffled, site.network(), Rule::Best));
            }
        }
    }
}
