//! Pieces pass across the borders of regions (D2.7 §3.6.3: an even share each): from those
//! with more to fly to those with less, and now and then against the grain, so that work
//! finds its way through several regions.
//!
//! A piece takes along what only it connects with its region, so that a region stays in
//! one piece even in corridors.
//!
//! Left to others: what a way out costs, and which UAV flies which region.

use super::{NOBODY, PACE, Partition};
use core::ops::Range;
use skein_geometry::random::SplitMix64;

/// Sweeps over all pieces at most: a piece passes one border a sweep, and a region is
/// reached over fewer borders than this on all maps tried.
const SWEEPS: usize = 400;

/// Sweeps between two looks at whether they help.
const LOOK: usize = 40;

/// Pieces looked at to show that two neighbours of a piece are connected without it:
/// mostly the ring round it does that.
const RING: usize = 16;

/// Pieces looked at on each side of a piece that may divide its region; if there are more
/// on two sides, the piece stays.
const WAY_ROUND: usize = 64;

/// Sweeps end when fewer than one piece in this many has passed.
const FEW: usize = 5000;

/// Tries to pass against the grain: so many a piece, and so many at most.
const TRIES: usize = 300;
const MOST_TRIES: usize = 600_000;

/// Highest loss accepted at the beginning, in squares of moves: passing a block between
/// two equal regions loses 32.
const HOT: i64 = 256;

/// What each pair of neighbouring pieces on two sides of a border costs, in the same
/// unit: regions without tails can pass more.
const WALL: i64 = 8;

/// What a search from a piece found.
enum Spread {
    /// All that can be reached.
    Whole,
    /// What an earlier search had seen.
    Joined,
    /// Too much to go on.
    Large,
}

/// How a UAV's way changes: moves, and the piece where it begins.
type Entry = (i64, u32);

impl Partition<'_> {
    /// Passes pieces from regions with more to fly to neighbours with less.
    pub(super) fn balance(&mut self) {
        let n = self.pieces.len();
        if n == 0 {
            return;
        }
        let mut random = SplitMix64::new(n as u64);
        // A stride that is coprime to most n spreads the order over the map.
        let stride = (7919 % n).max(1);
        for sweep in 1..=SWEEPS {
            if sweep % LOOK == 0 && self.hopeless() {
                break;
            }
            let mut passed = 0;
            let mut at = random.below(n);
            for _ in 0..n {
                passed += usize::from(self.pass(u32::try_from(at).unwrap_or(0)));
                at = (at + stride) % n;
            }
            if passed * FEW <= n {
                break;
            }
        }
    }

    /// Passes a piece to the neighbouring region with the least to fly, if that is then
    /// still less than what the giver had.
    fn pass(&mut self, piece: u32) -> bool {
        let from = self.owner[piece as usize];
        let mut best: Option<(i64, u32)> = None;
        for i in self.near(piece) {
            let to = self.owner[self.links[i] as usize];
            if to != from && to != NOBODY {
                let offer = (self.load(to as usize), to);
                best = Some(best.map_or(offer, |b| b.min(offer)));
            }
        }
        let Some((load, to)) = best else {
            return false;
        };
        if from == NOBODY {
            return false;
        }
        let (uav, heir) = (from as usize, to as usize);
        let room = self.load(uav) - load;
        if room <= self.cells(piece) * self.pace[heir] {
            return false;
        }
        let Some(kept) = self.cut_off(piece) else {
            return false;
        };
        let cells: i64 = self.part.iter().map(|p| self.cells(*p)).sum();
        if room <= cells * self.pace[heir] {
            return false;
        }
        let (entry, entry_there) = self.entries(uav, heir, kept);
        if entry.0 - self.entry[uav] >= cells {
            return false;
        }
        self.hand_over(cells, (uav, entry), (heir, entry_there));
        true
    }

    /// Passes pieces across borders as chance has it, less and less against the grain.
    pub(super) fn anneal(&mut self) {
        let n = self.pieces.len();
        let mut random = SplitMix64::new(n as u64);
        let tries = (n * TRIES).min(MOST_TRIES);
        for left in (0..tries).rev() {
            let piece = u32::try_from(random.below(n)).unwrap_or(0);
            let links = self.near(piece);
            let link = links.start + random.below(links.len());
            let Some(near) = self.links[links].first().map(|_| self.links[link]) else {
                continue;
            };
            let (from, to) = (self.owner[piece as usize], self.owner[near as usize]);
            if from == to || from == NOBODY || to == NOBODY {
                continue;
            }
            // A geometric draw: each further unit is half as likely.
            let bits = random.bits();
            let draw = i64::from(bits.trailing_zeros().min(12)) * 256 + ((bits >> 40) & 255) as i64;
            let heat = HOT * left as i64 / tries as i64;
            self.try_pass(piece, (from as usize, to as usize), heat * draw / 512);
        }
    }

    /// Passes a piece if the sum of squared times and borders grows by no more than is
    /// allowed.
    fn try_pass(&mut self, piece: u32, (uav, heir): (usize, usize), allowed: i64) {
        let (mine, theirs) = (self.load(uav) / PACE, self.load(heir) / PACE);
        let cells = self.cells(piece);
        let most_walls = self.near(piece).len() as i64;
        // What it would come to alone: most tries end here.
        if 2 * cells * (theirs - mine + cells) - most_walls * WALL > allowed {
            return;
        }
        let Some(kept) = self.cut_off(piece) else {
            return;
        };
        let cells: i64 = self.part.iter().map(|p| self.cells(*p)).sum();
        let (entry, entry_there) = self.entries(uav, heir, kept);
        let less = cells + self.entry[uav] - entry.0;
        let more = cells + entry_there.0 - self.entry[heir];
        let after = mine - less * self.pace[uav] / PACE;
        let after_there = theirs + more * self.pace[heir] / PACE;
        let loss = after.pow(2) + after_there.pow(2) - mine.pow(2) - theirs.pow(2);
        if loss + self.walls(uav, heir) * WALL <= allowed {
            self.hand_over(cells, (uav, entry), (heir, entry_there));
        }
    }

    /// By how many pairs the border between two UAVs grows when the part passes.
    fn walls(&self, uav: usize, heir: usize) -> i64 {
        let mut walls = 0;
        for piece in &self.part {
            for link in self.near(*piece) {
                let near = self.links[link];
                let owner = self.owner[near as usize] as usize;
                walls += i64::from(owner == uav && !self.part.contains(&near));
                walls -= i64::from(owner == heir);
            }
        }
        walls
    }

    /// Where two UAVs begin when the part passes from one to the other, and the rest of
    /// the giver's region begins at `kept`.
    fn entries(&mut self, uav: usize, heir: usize, kept: u32) -> (Entry, Entry) {
        let mine = if self.part.contains(&self.seed[uav]) {
            self.nearest(uav, kept)
        } else {
            (self.entry[uav], self.seed[uav])
        };
        let there = (self.entry[heir], self.seed[heir]);
        let nearer = self.part.iter().map(|p| (self.way(heir, *p), *p)).min();
        let there = nearer.filter(|n| n.0 < there.0).unwrap_or(there);
        (mine, there)
    }

    /// Passes the part of so many cells.
    fn hand_over(
        &mut self,
        cells: i64,
        (uav, mine): (usize, Entry),
        (heir, there): (usize, Entry),
    ) {
        let to = u32::try_from(heir).unwrap_or(NOBODY);
        for piece in &self.part {
            self.owner[*piece as usize] = to;
        }
        (self.entry[uav], self.seed[uav]) = mine;
        (self.entry[heir], self.seed[heir]) = there;
        self.size[uav] -= cells;
        self.size[heir] += cells;
    }

    /// The piece of a region nearest to its UAV, among those close to `from` and not
    /// about to leave.
    fn nearest(&mut self, uav: usize, from: u32) -> Entry {
        let region = self.owner[from as usize];
        self.search += 1;
        for leaving in &self.part {
            self.seen[*leaving as usize] = self.search;
        }
        self.seen[from as usize] = self.search;
        self.found.clear();
        self.found.push(from);
        let mut best = (i64::MAX, from);
        let mut done = 0;
        while let Some(&at) = self.found.get(done).filter(|_| done < WAY_ROUND) {
            done += 1;
            best = best.min((self.way(uav, at), at));
            for link in self.near(at) {
                let to = self.links[link];
                if self.owner[to as usize] == region && self.seen[to as usize] != self.search {
                    self.seen[to as usize] = self.search;
                    self.found.push(to);
                }
            }
        }
        best
    }

    /// Finds what leaves a region with a piece: the piece, and what only it connects with
    /// the rest. The piece beside it at which the rest begins; none if there is no rest,
    /// or if it is too large to tell.
    fn cut_off(&mut self, piece: u32) -> Option<u32> {
        let region = self.owner[piece as usize];
        self.part.clear();
        self.part.push(piece);
        if let Some(first) = self.ring_round(piece)? {
            return Some(first);
        }
        self.search += 1;
        self.seen[piece as usize] = self.search;
        let first = self.search + 1;
        // The rest: where it begins, and which of the part so far it is, if that is known.
        let mut rest: Option<(u32, Range<usize>)> = None;
        for link in self.near(piece) {
            let next = self.links[link];
            if self.owner[next as usize] != region || self.seen[next as usize] >= first {
                continue;
            }
            let begin = self.part.len();
            match self.spread(next, first) {
                Spread::Whole => {
                    let found = begin..self.part.len();
                    let larger =
                        |r: &(u32, Range<usize>)| r.1.is_empty() || r.1.len() >= found.len();
                    if !rest.as_ref().is_some_and(larger) {
                        rest = Some((next, found));
                    }
                }
                Spread::Joined => self.part.truncate(begin),
                Spread::Large => {
                    if rest.as_ref().is_some_and(|r| r.1.is_empty()) {
                        return None;
                    }
                    self.part.truncate(begin);
                    rest = Some((next, begin..begin));
                }
            }
        }
        let (kept, range) = rest?;
        self.part.drain(range);
        Some(kept)
    }

    /// Adds the pieces of a region that are reached from `start` to the part, as long as
    /// they are few and no search from `first` on has seen them.
    fn spread(&mut self, start: u32, first: u32) -> Spread {
        let region = self.owner[start as usize];
        self.search += 1;
        let mut done = self.part.len();
        let most = done + WAY_ROUND;
        self.seen[start as usize] = self.search;
        self.part.push(start);
        while let Some(&at) = self.part.get(done) {
            done += 1;
            for link in self.near(at) {
                let to = self.links[link];
                if self.owner[to as usize] != region || self.seen[to as usize] == self.search {
                    continue;
                }
                if self.seen[to as usize] >= first {
                    return Spread::Joined;
                }
                // The piece that is to leave was seen just before.
                if self.seen[to as usize] != first - 1 {
                    self.seen[to as usize] = self.search;
                    self.part.push(to);
                }
            }
            if done > most {
                return Spread::Large;
            }
        }
        Spread::Whole
    }

    /// A neighbour of a piece in its region, if all of them are seen to reach each other
    /// without it within a short way round; an outer `None` if there is no neighbour.
    fn ring_round(&mut self, piece: u32) -> Option<Option<u32>> {
        let region = self.owner[piece as usize];
        self.search += 1;
        let goal = self.search;
        let mut missing = 0;
        let mut first = None;
        for link in self.near(piece) {
            let near = self.links[link];
            if self.owner[near as usize] == region {
                self.seen[near as usize] = goal;
                missing += 1;
                first = first.or(Some(near));
            }
        }
        let first = first?;
        self.search += 1;
        self.seen[piece as usize] = self.search;
        self.seen[first as usize] = self.search;
        missing -= 1;
        self.found.clear();
        self.found.push(first);
        let mut done = 0;
        while missing > 0 && done < RING.min(self.found.len()) {
            let at = self.found[done];
            done += 1;
            for link in self.near(at) {
                let to = self.links[link];
                let seen = self.seen[to as usize];
                if self.owner[to as usize] == region && seen != self.search {
                    missing -= usize::from(seen == goal);
                    self.seen[to as usize] = self.search;
                    self.found.push(to);
                }
            }
        }
        Some((missing == 0).then_some(first))
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::map::{Cell, LaneMap};
    use super::super::super::plan::Task;
    use super::super::super::root_distances::Home;
    use super::*;
    use proptest::prelude::*;

    /// Each region in one piece, with the sizes and ways that it is said to have.
    fn assert_sound(p: &mut Partition) {
        let mut size = vec![0; p.seed.len()];
        for piece in 0..u32::try_from(p.pieces.len()).unwrap() {
            size[p.owner[piece as usize] as usize] += p.cells(piece);
        }
        assert_eq!(size, p.size);
        for uav in 0..p.seed.len() {
            let seed = p.seed[uav];
            if seed == NOBODY {
                assert_eq!(p.size[uav], 0);
                continue;
            }
            assert_eq!(p.owner[seed as usize] as usize, uav);
            assert_eq!(p.way(uav, seed), p.entry[uav]);
            let mut open = vec![seed];
            let mut seen = vec![false; p.pieces.len()];
            seen[seed as usize] = true;
            let mut reached = 0;
            while let Some(at) = open.pop() {
                reached += p.cells(at);
                for link in p.near(at) {
                    let to = p.links[link] as usize;
                    if p.owner[to] as usize == uav && !core::mem::replace(&mut seen[to], true) {
                        open.push(p.links[link]);
                    }
                }
            }
            assert_eq!(reached, p.size[uav], "in one piece");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(100))]

        #[test]
        fn regions_stay_in_one_piece(
            free in prop::collection::vec(prop::bool::weighted(0.75), 16 * 17),
            picks in prop::collection::vec(any::<prop::sample::Index>(), 1..7),
            closed in any::<bool>(),
        ) {
            let map = LaneMap::new(16, 17, |r, c| free[(r * 17 + c) as usize]).unwrap();
            let cells: Vec<Cell> = map.cells().collect();
            prop_assume!(!cells.is_empty());
            let roots: Vec<Cell> = picks.iter().map(|p| cells[p.index(cells.len())]).collect();
            let task = Task::new(&map, &roots, closed).unwrap();
            let home = Home::new(&task);
            let mut p = Partition::grown(&task, &home, (0, 1));
            prop_assume!(!p.owner.contains(&NOBODY));
            assert_sound(&mut p);
            p.shake();
            assert_sound(&mut p);
            let moves = vec![30; task.n_uavs()];
            p.even(&moves);
            assert_sound(&mut p);
        }
    }
}
