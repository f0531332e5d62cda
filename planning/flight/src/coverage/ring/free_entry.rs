//! Division by free entry: a section is any runs of the loop in any order, each entered
//! at its better end, wherever its UAV comes from (D2.7 §3.6.5, after Hazon and Kaminka,
//! without their restriction to what lies around the UAV).
//!
//! First plans are packed greedily into one limit: round the loop, UAV after UAV takes
//! the longest run that it can end in time, and the limit is made as small as packs. From
//! there, and from backtracking MSTC's, pieces move from late UAVs to early ones while
//! that helps (min-max arc routing by local search, with ruin and recreate).
//!
//! # Guarantees
//! Whole numbers decide, and a number of steps ends the search, never a clock: equal
//! problems have equal answers on every machine.
//!
//! # Complexity
//! The number of steps that it is given; each asks for the length of one curve.

mod handover;

use super::backtracking::{Leg, RingCell, Uav};
use super::coverage_loop::Direction;
use super::transfers::{Place, Transfers};
use core::cmp::Reverse;
use skein_geometry::random::SplitMix64;

/// Most runs in the section of one UAV, so that a claim can list them with what was
/// committed.
const RUNS_MAX: usize = 6;

/// Weights of durations double with each of so many parts of a makespan. At first
/// what is not the longest still counts; then only what is near the longest does, so that
/// whoever can shorten it does, however long that takes itself.
const SOFT: u64 = 12;
/// See [`SOFT`].
const SHARP: u64 = 64;

/// And with each of so many parts of that, by this table: 128 times the powers of the 16th
/// root of two.
const ROOTS: [u128; 16] = [
    128, 134, 140, 146, 152, 159, 166, 173, 181, 189, 197, 206, 215, 225, 235, 245,
];

/// No duration weighs more than if it were so many doublings long, so that sums fit.
const DOUBLINGS_MAX: u64 = 110;

/// Open cells, by their place among the open ones, flown one after the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Run {
    first: usize,
    count: usize,
    forward: bool,
}

/// What one UAV flies.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Tour {
    runs: Vec<Run>,
    /// How far that is, millimetres.
    flown_mm: u64,
    /// When it is done; 0 for who flies nothing.
    done_ms: u64,
}

/// A plan: what each UAV flies, by index.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Tours {
    tours: Vec<Tour>,
    /// What nobody flies.
    left: Vec<Run>,
}

impl Tours {
    /// When each UAV is done, milliseconds from now.
    pub fn done_ms(&self) -> impl Iterator<Item = u64> + '_ {
        self.tours.iter().map(|t| t.done_ms)
    }

    /// What decides between plans: cells left, then the durations, the longest first. So of
    /// two plans with one makespan, which a far cell may set, the fairer one is taken.
    pub fn cost(&self) -> (usize, Vec<u64>) {
        let mut done_ms: Vec<u64> = self.done_ms().collect();
        done_ms.sort_unstable_by_key(|ms| Reverse(*ms));
        (self.left.iter().map(|r| r.count).sum(), done_ms)
    }

    /// When the last is done, milliseconds from now.
    pub fn makespan_ms(&self) -> u64 {
        self.done_ms().max().unwrap_or(0)
    }
}

/// The problem, with prefix sums of what is flown.
pub(super) struct Search<'a> {
    transfers: Transfers<'a>,
    uavs: &'a [Uav],
    /// The open cells in the order of the loop.
    open: Vec<u16>,
    cells: usize,
    /// Millimetres served before each open cell, and of ways between them; twice round.
    served_mm: Vec<u64>,
    hops_mm: Vec<u64>,
    /// Lengths that may have been asked for when the search ends.
    last_step: u64,
}

impl<'a> Search<'a> {
    /// A search over the open cells, of which there is at least one.
    pub fn new(transfers: Transfers<'a>, ring: &[RingCell], uavs: &'a [Uav]) -> Self {
        let numbered = (0u16..).zip(ring);
        let open = numbered.filter(|(_, c)| c.open).map(|(i, _)| i);
        let mut search = Self {
            transfers,
            uavs,
            open: open.collect(),
            cells: ring.len(),
            served_mm: vec![0],
            hops_mm: Vec::new(),
            last_step: 0,
        };
        for i in 0..2 * search.open.len() {
            let service_mm = u64::from(ring[search.cell(i)].service_mm);
            search.served_mm.push(search.served_mm[i] + service_mm);
        }
        search.reckon_hops();
        search
    }

    /// The ways between one open cell and the next.
    fn reckon_hops(&mut self) {
        let m = self.open.len();
        let mut hops_mm = Vec::with_capacity(2 * m + 1);
        hops_mm.push(0);
        for i in 0..2 * m {
            let hop_mm = if i < m {
                let (from, to) = self.hop(i);
                if from == to {
                    0
                } else {
                    self.transfers.mm(from, to)
                }
            } else {
                hops_mm[i - m + 1] - hops_mm[i - m]
            };
            hops_mm.push(hops_mm[i] + hop_mm);
        }
        self.hops_mm = hops_mm;
    }

    /// From behind an open cell to the next one.
    fn hop(&self, i: usize) -> (Place, Place) {
        let at = |boundary| self.transfers.boundary(boundary, Direction::Forward);
        (at(self.cell(i) + 1), at(self.cell(i + 1)))
    }

    fn cell(&self, i: usize) -> usize {
        usize::from(self.open[i % self.open.len()])
    }

    fn work_mm(&self, run: &Run) -> u64 {
        let (from, to) = (run.first, run.first + run.count);
        if run.count == 0 {
            return 0;
        }
        self.served_mm[to] - self.served_mm[from] + self.hops_mm[to - 1] - self.hops_mm[from]
    }

    /// The cells at both ends of a run, in the order of the loop.
    fn ends(&self, run: &Run) -> (usize, usize) {
        (self.cell(run.first), self.cell(run.first + run.count - 1))
    }

    fn entry(&self, run: &Run) -> Place {
        let (first, last) = self.ends(run);
        if run.forward {
            self.transfers.boundary(first, Direction::Forward)
        } else {
            self.transfers.boundary(last + 1, Direction::Backward)
        }
    }

    fn exit(&self, run: &Run) -> Place {
        let (first, last) = self.ends(run);
        if run.forward {
            self.transfers.boundary(last + 1, Direction::Forward)
        } else {
            self.transfers.boundary(first, Direction::Backward)
        }
    }

    fn ready_ms(&self, uav: usize) -> u64 {
        let u = &self.uavs[uav];
        u64::from(u.off_loop.map_or(u.release_ms, |off| off.ready_ms))
    }

    fn until_ms(&self, uav: usize) -> u64 {
        let u = &self.uavs[uav];
        u64::from(u.release_ms) + u64::from(u.endurance_ms)
    }

    /// When a UAV has flown so far.
    fn flown_ms(&self, uav: usize, mm: u64) -> u64 {
        let speed_mmps = u64::from(self.uavs[uav].speed_mmps.max(1));
        self.ready_ms(uav) + (mm * 1000).div_ceil(speed_mmps)
    }

    /// The same; `None` beyond its endurance.
    fn done_ms(&self, uav: usize, mm: u64) -> Option<u64> {
        let ms = self.flown_ms(uav, mm);
        (ms <= self.until_ms(uav)).then_some(ms)
    }

    /// A tour of some runs, within the endurance or not.
    fn tour(&self, uav: usize, runs: Vec<Run>) -> Tour {
        let mut at = self.transfers.start(uav);
        let mut flown_mm = 0;
        for run in &runs {
            flown_mm += self.transfers.mm(at, self.entry(run)) + self.work_mm(run);
            at = self.exit(run);
        }
        let done_ms = if runs.is_empty() {
            0
        } else {
            self.flown_ms(uav, flown_mm)
        };
        Tour {
            runs,
            flown_mm,
            done_ms,
        }
    }

    fn is_within(&self, uav: usize, tour: &Tour) -> bool {
        tour.runs.is_empty() || tour.done_ms <= self.until_ms(uav)
    }

    fn is_over(&self) -> bool {
        self.transfers.asked() >= self.last_step
    }

    /// Plans reckoned anew, after ways were proved.
    pub fn reckoned(&self, tours: &Tours) -> Tours {
        let each = tours.tours.iter().enumerate();
        Tours {
            tours: each
                .map(|(uav, t)| self.tour(uav, t.runs.clone()))
                .collect(),
            left: tours.left.clone(),
        }
    }

    /// The plan that is left when every UAV turns back before its endurance is over: once
    /// ways were proved, what was thought to be within it may be beyond.
    pub fn within_endurance(&self, tours: &Tours) -> Tours {
        let cut = |(uav, tour): (usize, &Tour)| {
            let mut tour = tour.clone();
            while !self.is_within(uav, &tour) {
                tour = self.tour(uav, self.without_last(tour.runs));
            }
            tour.runs
        };
        let runs = tours.tours.iter().enumerate().map(cut).collect();
        self.plan(runs)
    }

    /// These runs without the open cell that is flown last.
    fn without_last(&self, mut runs: Vec<Run>) -> Vec<Run> {
        if let Some(mut last) = runs.pop()
            && last.count > 1
        {
            last.count -= 1;
            if !last.forward {
                last.first = (last.first + 1) % self.open.len();
            }
            runs.push(last);
        }
        runs
    }

    /// Whether every section is within its UAV's endurance.
    pub fn is_flyable(&self, tours: &Tours) -> bool {
        let mut each = tours.tours.iter().enumerate();
        each.all(|(uav, tour)| self.is_within(uav, tour))
    }

    /// Proves the ways that a plan flies; returns whether one is longer than was thought.
    pub fn prove(&mut self, tours: &Tours) -> bool {
        let mut longer = false;
        for (uav, tour) in tours.tours.iter().enumerate() {
            let mut at = self.transfers.start(uav);
            for run in &tour.runs {
                let mut ways = vec![(at, self.entry(run))];
                ways.extend((run.first..run.first + run.count - 1).map(|i| self.hop(i)));
                for (from, to) in ways.into_iter().filter(|(from, to)| from != to) {
                    longer |= self.transfers.prove(from, to);
                }
                at = self.exit(run);
            }
        }
        self.reckon_hops();
        longer
    }

    /// The plan that these legs are, by index of UAV.
    pub fn tours_of(&self, legs: &[Vec<Leg>]) -> Tours {
        let place_of = |cell: u16| self.open.binary_search(&cell).ok();
        let run_of = |leg: &Leg| {
            let places: Vec<usize> = leg.cells(self.cells).filter_map(place_of).collect();
            let forward = leg.direction == Direction::Forward;
            let first = if forward {
                places.first()
            } else {
                places.last()
            };
            Some(Run {
                first: *first?,
                count: places.len(),
                forward,
            })
        };
        self.plan(
            legs.iter()
                .map(|legs| legs.iter().filter_map(run_of).collect())
                .collect(),
        )
    }

    /// A plan of these runs, with what they leave.
    fn plan(&self, runs: Vec<Vec<Run>>) -> Tours {
        let m = self.open.len();
        let mut flown = vec![false; m];
        for run in runs.iter().flatten() {
            (run.first..run.first + run.count).for_each(|i| flown[i % m] = true);
        }
        let mut left: Vec<Run> = Vec::new();
        for i in (0..m).filter(|i| !flown[*i]) {
            match left.last_mut() {
                Some(run) if run.first + run.count == i => run.count += 1,
                _ => left.push(Run {
                    first: i,
                    count: 1,
                    forward: true,
                }),
            }
        }
        let each = runs.into_iter().enumerate();
        Tours {
            tours: each.map(|(uav, runs)| self.tour(uav, runs)).collect(),
            left,
        }
    }

    /// The legs of a plan, by index of UAV, with what they leave.
    pub fn legs_of(&self, tours: &Tours) -> (Vec<Vec<Leg>>, Vec<u16>) {
        let n = self.cells;
        let leg = |run: &Run| {
            let (first, last) = self.ends(run);
            let (first_flown, direction) = if run.forward {
                (first, Direction::Forward)
            } else {
                (last, Direction::Backward)
            };
            Leg {
                first: u16::try_from(first_flown).unwrap_or(0),
                count: u16::try_from((last + n - first) % n + 1).unwrap_or(u16::MAX),
                direction,
            }
        };
        let legs = tours.tours.iter().map(|t| t.runs.iter().map(leg).collect());
        let places = |run: &Run| run.first..run.first + run.count;
        let left = tours.left.iter().flat_map(places);
        let mut left: Vec<u16> = left.map(|i| self.open[i % self.open.len()]).collect();
        left.sort_unstable();
        (legs.collect(), left)
    }

    /// The longest run from an open cell on that a UAV ends within the limit.
    fn longest(&self, uav: usize, first: usize, most: usize, limit_ms: u64) -> Option<Run> {
        let until_ms = limit_ms.min(self.until_ms(uav));
        let speed_mmps = u64::from(self.uavs[uav].speed_mmps);
        let budget_mm = until_ms.checked_sub(self.ready_ms(uav))? * speed_mmps / 1000;
        let start = self.transfers.start(uav);
        let ahead = |count: usize| Run {
            first,
            count,
            forward: true,
        };
        let within = |budget_mm: u64| {
            let (mut good, mut bad) = (0, most + 1);
            while bad - good > 1 {
                let count = good.midpoint(bad);
                if self.work_mm(&ahead(count)) <= budget_mm {
                    good = count;
                } else {
                    bad = count;
                }
            }
            good
        };
        let way_mm = self.transfers.mm(start, self.entry(&ahead(1)));
        let mut best = ahead(budget_mm.checked_sub(way_mm).map_or(0, within));
        let mut count = within(budget_mm);
        while count > best.count {
            let back = Run {
                first,
                count,
                forward: false,
            };
            let need_mm = self.transfers.mm(start, self.entry(&back)) + self.work_mm(&back);
            if need_mm <= budget_mm {
                best = back;
                break;
            }
            // A cell less saves itself and brings the end nearer by about as much.
            let over_cells = (need_mm - budget_mm) / (2 * self.mean_cell_mm()).max(1);
            count = count.saturating_sub(usize::try_from(over_cells).unwrap_or(count).max(1));
        }
        (best.count > 0).then_some(best)
    }

    fn mean_cell_mm(&self) -> u64 {
        let m = self.open.len();
        (self.served_mm[m] + self.hops_mm[m]) / (m as u64).max(1)
    }

    /// Packs the open cells into a limit, UAV after UAV, from an open cell on round the loop.
    fn pack(&self, seating: &Seating, limit_ms: u64) -> Packed {
        let m = self.open.len();
        let mut packed = Packed {
            served: 0,
            runs: Vec::with_capacity(seating.order.len()),
        };
        for &uav in &seating.order {
            if packed.served == m {
                break;
            }
            let (first, most) = ((seating.offset + packed.served) % m, m - packed.served);
            if let Some(run) = self.longest(uav, first, most, limit_ms) {
                packed.served += run.count;
                packed.runs.push((uav, run));
            }
        }
        packed
    }

    /// The orders and offsets in which UAVs are packed at first: as their anchors lie, from
    /// each of some; and from some places of the loop.
    fn seatings(&self) -> Vec<Seating> {
        let m = self.open.len();
        let place = |u: &Uav| self.open.partition_point(|c| *c < u.anchor) % m;
        let mut by_anchor: Vec<(usize, usize)> = self
            .uavs
            .iter()
            .enumerate()
            .map(|(i, u)| (place(u), i))
            .collect();
        by_anchor.sort_unstable();
        let k = by_anchor.len();
        let order: Vec<usize> = by_anchor.iter().map(|(_, i)| *i).collect();
        let turned = (0..k).step_by(k.div_ceil(SEATINGS).max(1)).map(|turn| {
            let mut order = order.clone();
            order.rotate_left(turn);
            Seating {
                order,
                offset: by_anchor[turn].0,
            }
        });
        let places = SEATINGS.min(m);
        let anywhere = (0..places).map(|i| Seating {
            order: order.clone(),
            offset: i * m / places,
        });
        turned.chain(anywhere).collect()
    }

    /// The plan that packs into the least limit found within so many steps.
    pub fn packed_within(&mut self, steps: u64) -> Tours {
        self.last_step = self.transfers.asked() + steps;
        let m = self.open.len();
        let seatings = self.seatings();
        let speed: u64 = self.uavs.iter().map(|u| u64::from(u.speed_mmps)).sum();
        let longest_ms = (0..self.uavs.len())
            .map(|u| self.until_ms(u))
            .max()
            .unwrap_or(0);
        let least_ms = self.served_mm[m] * 1000 / speed.max(1);
        let any = |limit_ms: u64| {
            let packs = seatings.iter().map(|s| (s, self.pack(s, limit_ms)));
            let mut most: Option<(&Seating, Packed)> = None;
            for (seating, packed) in packs {
                let is_all = packed.served == m;
                if most.as_ref().is_none_or(|(_, p)| packed.served > p.served) {
                    most = Some((seating, packed));
                }
                if is_all {
                    break;
                }
            }
            most
        };
        let (mut bad_ms, mut limit_ms) = (least_ms, least_ms.max(1000) * 5 / 4);
        let mut best = any(limit_ms);
        while bad_ms < longest_ms && best.as_ref().is_none_or(|(_, p)| p.served < m) {
            bad_ms = limit_ms;
            limit_ms *= 2;
            best = any(limit_ms);
        }
        let Some((seating, mut packed)) = best else {
            return self.plan(vec![Vec::new(); self.uavs.len()]);
        };
        let mut seating = seating.clone();
        if packed.served == m {
            while limit_ms - bad_ms > limit_ms / 128 + 100 && !self.is_over() {
                let middle_ms = limit_ms.midpoint(bad_ms);
                match any(middle_ms).filter(|(_, p)| p.served == m) {
                    Some((better, less)) => {
                        limit_ms = middle_ms;
                        seating = better.clone();
                        packed = less;
                    }
                    None => bad_ms = middle_ms,
                }
            }
            packed = self.reseated(seating, limit_ms, packed);
        }
        let mut runs = vec![Vec::new(); self.uavs.len()];
        for (uav, run) in packed.runs {
            runs[uav].push(run);
        }
        self.plan(runs)
    }

    /// Changes the places of two UAVs, or where the first begins, while that packs into less.
    fn reseated(&self, mut seating: Seating, mut limit_ms: u64, mut packed: Packed) -> Packed {
        let (k, m) = (seating.order.len(), self.open.len());
        let mut again = true;
        while again {
            again = false;
            for i in 0..k {
                for j in i + 1..=k {
                    if self.is_over() {
                        return packed;
                    }
                    let mut other = seating.clone();
                    if j < k {
                        other.order.swap(i, j);
                    } else {
                        other.offset = (other.offset + (i + 1) * m / (4 * k) + 1) % m;
                    }
                    let less_ms = limit_ms - limit_ms / 128 - 1;
                    let better = self.pack(&other, less_ms);
                    if better.served == m {
                        (seating, limit_ms, packed, again) = (other, less_ms, better, true);
                    }
                }
            }
        }
        packed
    }

    /// The plan after pieces moved from late UAVs to early ones while that helped, and
    /// after parts of it were made anew, within so many steps.
    pub fn improved_within(&mut self, steps: u64, tours: Tours) -> Tours {
        self.last_step = self.transfers.asked() + steps;
        let scale = |plan: &Tours, doublings| Scale {
            makespan_ms: plan.makespan_ms().max(1),
            doublings,
        };
        // A makespan that became much shorter is no longer the measure of what is late.
        let soft = scale(&tours, SOFT);
        let coarse = self.descended(tours, soft);
        let soft = scale(&coarse, SOFT);
        let coarse = self.descended(coarse, soft);
        let sharp = scale(&coarse, SHARP);
        let settled = |plan| self.descended(self.descended(plan, soft), sharp);
        let mut best = self.descended(coarse, sharp);
        let mut random = SplitMix64::new(best.makespan_ms());
        let mut fruitless = 0;
        while !self.is_over() && fruitless < FRUITLESS_MAX {
            fruitless += 1;
            let ruined = self.ruined(&best, &mut random);
            let Some(made) = self.recreated(ruined, soft, &mut random) else {
                continue;
            };
            let next = settled(made);
            let rank = |t: &Tours| (t.cost().0, sharp.potential(t));
            if rank(&next) < rank(&best) {
                best = next;
                fruitless = 0;
            }
        }
        best
    }

    /// Moves pieces while that lowers the potential.
    fn descended(&self, mut tours: Tours, scale: Scale) -> Tours {
        self.place_leftovers(&mut tours, scale);
        while !self.is_over() {
            let busy = (0..tours.tours.len()).filter(|u| !tours.tours[*u].runs.is_empty());
            let mut late: Vec<usize> = busy.collect();
            late.sort_by_key(|u| (Reverse(tours.tours[*u].done_ms), *u));
            let change = late
                .into_iter()
                .find_map(|u| self.best_change(&tours, u, scale));
            let Some(change) = change else {
                break;
            };
            for (uav, tour) in change {
                tours.tours[uav] = tour;
            }
        }
        tours
    }

    /// The tours of the best plan that differs in where one piece of this UAV is flown, or
    /// in whom it has changed places with.
    fn best_change(&self, plan: &Tours, from: usize, scale: Scale) -> Option<Vec<(usize, Tour)>> {
        let own = &plan.tours[from];
        let own_weight = scale.weight(own.done_ms);
        let mut most = 0;
        let mut best = None;
        for (i, piece) in own.runs.iter().enumerate().flat_map(|(i, run)| {
            pieces(run, self.open.len())
                .into_iter()
                .map(move |piece| (i, piece))
        }) {
            let mut rest = own.runs.clone();
            match piece.rest {
                Some(run) => rest[i] = run,
                None => {
                    rest.remove(i);
                }
            }
            let rest = self.tour(from, rest);
            let rest_weight = scale.weight(rest.done_ms);
            if !self.is_within(from, &rest) || rest_weight >= own_weight && piece.rest.is_some() {
                continue;
            }
            for to in 0..plan.tours.len() {
                // The sum of both weights before, and what stays of it in any case.
                let (base, before, stays) = if to == from {
                    (&rest, own_weight, 0)
                } else {
                    let tour = &plan.tours[to];
                    (tour, own_weight + scale.weight(tour.done_ms), rest_weight)
                };
                let room = before.saturating_sub(stays).saturating_sub(most);
                if let Some(longer) = self.insertion(to, base, &piece.taken, (scale, room)) {
                    most = before - stays - scale.weight(longer.done_ms);
                    best = Some(if to == from {
                        vec![(from, longer)]
                    } else {
                        vec![(from, rest.clone()), (to, longer)]
                    });
                }
            }
        }
        for to in (0..plan.tours.len()).filter(|to| *to != from) {
            let theirs = &plan.tours[to];
            let swapped = self
                .best_way(from, &theirs.runs)
                .zip(self.best_way(to, &own.runs));
            if let Some((mine, other)) = swapped {
                let before = own_weight + scale.weight(theirs.done_ms);
                let after = scale.weight(mine.done_ms) + scale.weight(other.done_ms);
                if before.saturating_sub(after) > most {
                    most = before - after;
                    best = Some(vec![(from, mine), (to, other)]);
                }
            }
        }
        best
    }

    /// These runs as they are or the other way round, whichever is sooner done.
    fn best_way(&self, uav: usize, runs: &[Run]) -> Option<Tour> {
        let back = runs.iter().rev().map(|r| Run {
            forward: !r.forward,
            ..*r
        });
        let ways = [runs.to_vec(), back.collect()];
        let tours = ways.into_iter().map(|way| self.tour(uav, way));
        tours
            .filter(|t| self.is_within(uav, t))
            .min_by_key(|t| t.done_ms)
    }

    /// A tour with one more piece where it costs least and flown the better way; nothing
    /// where its weight would not be below `room`.
    fn insertion(
        &self,
        uav: usize,
        tour: &Tour,
        piece: &Run,
        (scale, room): (Scale, u128),
    ) -> Option<Tour> {
        let base_mm = tour.flown_mm + self.work_mm(piece);
        let is_light = |mm: u64| {
            let ms = self.done_ms(uav, mm);
            ms.is_some_and(|ms| scale.weight(ms) < room)
        };
        if tour.runs.len() >= RUNS_MAX || !is_light(base_mm) {
            return None;
        }
        let ways = [true, false].map(|forward| {
            let run = Run { forward, ..*piece };
            (run, self.entry(&run), self.exit(&run))
        });
        let mut best: Option<(u64, usize, Run)> = None;
        let mut before = self.transfers.start(uav);
        for slot in 0..=tour.runs.len() {
            let after = tour.runs.get(slot).map(|r| self.entry(r));
            let direct_mm = after.map_or(0, |to| self.transfers.mm(before, to));
            for (run, entry, exit) in ways {
                let in_mm = self.transfers.mm(before, entry);
                let out_mm = after.map_or(0, |to| self.transfers.mm(exit, to));
                let mm = (base_mm + in_mm + out_mm).saturating_sub(direct_mm);
                if best.as_ref().is_none_or(|(least, _, _)| mm < *least) {
                    best = Some((mm, slot, run));
                }
            }
            if let Some(run) = tour.runs.get(slot) {
                before = self.exit(run);
            }
        }
        let (mm, slot, run) = best.filter(|(mm, _, _)| is_light(*mm))?;
        let mut runs = tour.runs.clone();
        runs.insert(slot, run);
        self.merge(&mut runs);
        let done_ms = self.flown_ms(uav, mm);
        Some(Tour {
            runs,
            flown_mm: mm,
            done_ms,
        })
    }

    /// Runs that follow each other on the loop become one.
    fn merge(&self, runs: &mut Vec<Run>) {
        let m = self.open.len();
        let mut i = 1;
        while i < runs.len() {
            let (a, b) = (runs[i - 1], runs[i]);
            let meets = |a: Run, b: Run| (a.first + a.count) % m == b.first % m;
            let first = if a.forward { a.first } else { b.first };
            let follow = if a.forward { meets(a, b) } else { meets(b, a) };
            if follow && a.forward == b.forward && a.count + b.count <= m {
                runs[i - 1] = Run {
                    first,
                    count: a.count + b.count,
                    forward: a.forward,
                };
                runs.remove(i);
            } else {
                i += 1;
            }
        }
    }

    /// What nobody flies goes where the potential grows least, as far as anybody can fly it.
    fn place_leftovers(&self, plan: &mut Tours, scale: Scale) {
        let m = self.open.len();
        let mut pool = core::mem::take(&mut plan.left);
        pool.reverse();
        while let Some(run) = pool.pop() {
            if self.place(plan, run, scale) {
                continue;
            }
            if run.count > 1 && !self.is_over() {
                let half = run.count / 2;
                let first = (run.first + half) % m;
                pool.push(Run {
                    first,
                    count: run.count - half,
                    ..run
                });
                pool.push(Run { count: half, ..run });
            } else {
                plan.left.push(run);
            }
        }
    }

    /// Gives a run to the UAV for which the potential grows least; false if nobody can.
    fn place(&self, plan: &mut Tours, run: Run, scale: Scale) -> bool {
        let mut best: Option<(u128, usize, Tour)> = None;
        for (to, tour) in plan.tours.iter().enumerate() {
            let present = scale.weight(tour.done_ms);
            let least = best.as_ref().map_or(u128::MAX, |(cost, ..)| *cost);
            let room = least.saturating_add(present);
            if let Some(longer) = self.insertion(to, tour, &run, (scale, room)) {
                let cost = scale.weight(longer.done_ms).saturating_sub(present);
                best = Some((cost, to, longer));
            }
        }
        match best {
            Some((_, to, tour)) => {
                plan.tours[to] = tour;
                true
            }
            None => false,
        }
    }

    /// A plan without what the latest UAV flies and some others do.
    fn ruined(&self, plan: &Tours, random: &mut SplitMix64) -> Tours {
        let mut ruined = plan.clone();
        let k = ruined.tours.len();
        let late = (0..k).max_by_key(|u| (plan.tours[*u].done_ms, Reverse(*u)));
        let others = 1 + random.below(3);
        let mut chosen: Vec<usize> = late.into_iter().collect();
        chosen.extend((0..others).map(|_| random.below(k)));
        for uav in chosen {
            let mut runs = core::mem::take(&mut ruined.tours[uav].runs);
            // Half of the time only what comes after the first run.
            let keep = random.below(2).min(runs.len().saturating_sub(1));
            ruined.left.extend(runs.drain(keep..));
            ruined.tours[uav] = self.tour(uav, runs);
        }
        ruined
    }

    /// What a ruined plan lacks is given out again in parts, in some order.
    fn recreated(&self, mut plan: Tours, scale: Scale, random: &mut SplitMix64) -> Option<Tours> {
        let m = self.open.len();
        let most = (m / (3 * self.uavs.len()).max(1)).max(1) + random.below(4);
        let mut parts = Vec::new();
        for run in core::mem::take(&mut plan.left) {
            let mut done = 0;
            while done < run.count {
                let count = most.min(run.count - done);
                let first = (run.first + done) % m;
                parts.push(Run {
                    first,
                    count,
                    forward: true,
                });
                done += count;
            }
        }
        random.shuffle(&mut parts);
        for part in parts {
            if self.is_over() || !self.place(&mut plan, part, scale) {
                return None;
            }
        }
        Some(plan)
    }
}

/// In which order UAVs are packed, and from which open cell on.
#[derive(Clone, Debug)]
struct Seating {
    order: Vec<usize>,
    offset: usize,
}

/// What came out of packing: how many open cells are served, and by whom.
#[derive(Clone, Debug)]
struct Packed {
    served: usize,
    runs: Vec<(usize, Run)>,
}

/// First plans tried.
const SEATINGS: usize = 12;

/// Ruins in a row that bring nothing end the search.
const FRUITLESS_MAX: u32 = 60;

/// How durations are weighed.
#[derive(Clone, Copy, Debug)]
struct Scale {
    makespan_ms: u64,
    doublings: u64,
}

impl Scale {
    fn weight(self, ms: u64) -> u128 {
        if ms == 0 {
            return 0;
        }
        let roots = ROOTS.len() as u64;
        let parts = ms.saturating_mul(self.doublings * roots) / self.makespan_ms;
        let parts = parts.min(DOUBLINGS_MAX * roots);
        let root = usize::try_from(parts % roots).unwrap_or(0);
        ROOTS[root] << (parts / roots)
    }

    fn potential(self, tours: &Tours) -> u128 {
        tours.done_ms().map(|ms| self.weight(ms)).sum()
    }
}

/// A piece off one end of a run, and what stays.
#[derive(Clone, Copy, Debug)]
struct Piece {
    taken: Run,
    rest: Option<Run>,
}

/// Pieces off both ends of a run among `m` open cells, of lengths that grow by about a third.
fn pieces(run: &Run, m: usize) -> Vec<Piece> {
    let mut all = vec![Piece {
        taken: *run,
        rest: None,
    }];
    let mut count = 1;
    while count < run.count {
        let stays = run.count - count;
        all.push(Piece {
            taken: Run { count, ..*run },
            rest: Some(Run {
                first: (run.first + count) % m,
                count: stays,
                ..*run
            }),
        });
        all.push(Piece {
            taken: Run {
                first: (run.first + stays) % m,
                count,
                ..*run
            },
            rest: Some(Run {
                count: stays,
                ..*run
            }),
        });
        count += 1 + count / 3;
    }
    all
}
