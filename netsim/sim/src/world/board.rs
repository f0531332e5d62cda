//! What one mission asks to be seen, and what cameras saw of it (D2.7 §3.6).

use super::camera::{Eye, Picture};
use super::fact::Fact;
use super::layers::{LayerBook, LayerSeen};
use super::motion::Piece;
use super::pieces::Pieces;
use super::survey::{Cell, Survey};
use super::watch::Watch;
use skein_flight::coverage::ring::CellId;
use skein_geometry::frame::{Point, Pose, Vector};
use skein_peer::mission::{PointMm, ring_mm};
use std::collections::BTreeSet;
use std::sync::Arc;

/// The camera looks at least once per this length of flight, metres.
pub(super) const LOOK_M: f64 = 0.25;

/// Who saw a cell first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sighting {
    /// When, milliseconds.
    pub at_ms: u64,
    /// Who.
    pub uav: u16,
}

/// What one mission asks for, and what of it was seen.
#[derive(Clone, Debug)]
pub(super) struct Board {
    /// From which revision on it is asked for.
    revision: u32,
    survey: Arc<Survey>,
    seen: Vec<Option<Sighting>>,
    n_covered: usize,
    n_coverable: usize,
    /// What peers name cells, where the survey knows other ones; and which were seen.
    claims: Option<(Arc<Pieces>, Vec<bool>)>,
    /// How often everything is to be seen, and which time it is.
    laps: u16,
    lap: u16,
    /// In how many of the laps a cell was seen, and when it was seen first in the last.
    times: Vec<(u16, u64)>,
    /// Longest time from one first sighting of a cell to that of the next lap.
    longest_gap_ms: u64,
    /// How often a camera saw something for the first time in a lap.
    marks: u64,
    /// How often it is seen again, where the mission goes on once everything is seen.
    watch: Option<Watch>,
    /// At which heights what is seen counts, lap by lap.
    layers: LayerBook,
}

fn is_coverable(cell: &Cell) -> bool {
    cell.uncoverable.is_none()
}

impl Board {
    pub(super) fn new(revision: u32, survey: Arc<Survey>) -> Self {
        Self {
            revision,
            seen: vec![None; survey.cells().len()],
            n_covered: 0,
            n_coverable: survey.n_coverable(),
            claims: None,
            laps: 1,
            lap: 1,
            times: vec![(0, 0); survey.cells().len()],
            longest_gap_ms: 0,
            marks: 0,
            watch: None,
            layers: LayerBook::of(survey.layers()),
            survey,
        }
    }

    /// What came of each lap that is flown in a layer.
    pub(super) fn layers(&self) -> Vec<LayerSeen> {
        let so_far = (self.lap, self.n_covered, self.n_coverable);
        self.layers.seen(so_far, self.laps)
    }

    /// From now on what was seen is looked at again.
    pub(super) fn watch_again(&mut self) {
        self.watch = Some(Watch::new(self.survey.cells().len()));
    }

    pub(super) fn watch_claims(&mut self, pieces: Option<Arc<Pieces>>) {
        self.claims = pieces.map(|p| {
            let seen = vec![false; p.rings().len()];
            (p, seen)
        });
    }

    /// What is asked for is seen for this lap, from 0; the ones before are over.
    pub(super) fn begin_at(&mut self, lap: u16, further_laps: u16) {
        self.lap = lap.saturating_add(1);
        self.laps = self.lap.saturating_add(further_laps);
        self.times.fill((lap, 0));
    }

    /// Takes over what another board saw of the same places in this lap or in a later one:
    /// squares of one grid, or pieces with the same corners; nothing where the mission was
    /// begun anew.
    pub(super) fn remember(&mut self, other: &Self) {
        if self.survey.sortie() != other.survey.sortie() || !self.layers.goes_on(&other.layers) {
            return;
        }
        for i in 0..self.seen.len() {
            let Some(j) = self.same_place(other, i) else {
                continue;
            };
            if let (Some(watch), Some(watched)) = (&mut self.watch, &other.watch) {
                watch.remember(i, watched, j);
            }
            let (times, at_ms) = other.times[j];
            if times < self.lap {
                self.times[i].1 = self.times[i].1.max(at_ms);
            } else if let (None, Some(sighting)) = (self.seen[i], other.last_sighting(j)) {
                self.seen[i] = Some(sighting);
                self.times[i] = (self.lap, at_ms);
                let cell = self.survey.cells()[i];
                self.n_covered += usize::from(is_coverable(&cell));
            }
        }
        self.note_done();
        let (Some((mine, seen)), Some((theirs, saw))) = (&mut self.claims, &other.claims) else {
            return;
        };
        let places = theirs.rings().iter().map(|r| ring_mm(r)).zip(saw);
        let known: BTreeSet<Vec<PointMm>> = places.filter(|(_, s)| **s).map(|(p, _)| p).collect();
        for (ring, seen) in mine.rings().iter().zip(seen) {
            *seen = *seen || known.contains(&ring_mm(ring));
        }
    }

    /// What was seen of another mission may be all that is to be seen of this one in this lap.
    fn note_done(&mut self) {
        let last_ms = self.seen.iter().flatten().map(|s| s.at_ms).max();
        if let Some(at_ms) = last_ms.filter(|_| self.n_covered == self.n_coverable) {
            self.layers.done(self.lap, at_ms);
        }
    }

    pub(super) fn revision(&self) -> u32 {
        self.revision
    }

    pub(super) fn marks(&self) -> u64 {
        self.marks
    }

    pub(super) fn survey(&self) -> &Arc<Survey> {
        &self.survey
    }

    /// The longest time between two visits that began at a time or later, milliseconds; none
    /// where nothing is watched.
    pub(super) fn watched_gap_ms(&self, from_ms: u64) -> Option<u64> {
        self.watch.as_ref().map(|w| w.longest_gap_ms(from_ms))
    }

    pub(super) fn longest_gap_ms(&self) -> Option<u64> {
        let again = self.watched_gap_ms(0);
        // From another layer nothing is seen again.
        let laps = self.laps > 1 && self.layers.is_flat();
        again.or(laps.then_some(self.longest_gap_ms))
    }

    pub(super) fn sighting(&self, cell: CellId) -> Option<Sighting> {
        self.seen[self.survey.index_of(cell)?]
    }

    pub(super) fn sightings(&self) -> impl Iterator<Item = (CellId, Option<Sighting>)> + '_ {
        let cells = self.survey.cells().iter();
        cells.zip(&self.seen).map(|(c, s)| (c.id, *s))
    }

    pub(super) fn n_covered(&self) -> usize {
        self.n_covered
    }

    pub(super) fn covered_share(&self) -> f64 {
        if self.n_coverable == 0 {
            return 1.0;
        }
        #[allow(clippy::cast_precision_loss, reason = "cells are counted in thousands")]
        let share = self.n_covered as f64 / self.n_coverable as f64;
        share
    }

    /// Who saw a cell last, in whichever lap.
    fn last_sighting(&self, i: usize) -> Option<Sighting> {
        let (times, at_ms) = self.times[i];
        let earlier = Sighting { at_ms, uav: 0 };
        self.seen[i].or((times > 0).then_some(earlier))
    }

    /// Which cell of another board is where this one is.
    fn same_place(&self, other: &Self, i: usize) -> Option<usize> {
        let (mine, theirs) = (&self.survey, &other.survey);
        match (mine.pieces(), theirs.pieces()) {
            (Some(a), Some(b)) => {
                let place = ring_mm(&a.rings()[i]);
                b.rings().iter().position(|ring| ring_mm(ring) == place)
            }
            (None, None) if mine.has_grid_of(theirs) => theirs.index_of(mine.cells()[i].id),
            _ => None,
        }
    }

    pub(super) fn saw(&self, cell: CellId, laps: u16) -> bool {
        match &self.claims {
            Some((_, seen)) => cell
                .number()
                .and_then(|n| seen.get(usize::from(n)))
                .is_some_and(|s| *s),
            None => self
                .survey
                .index_of(cell)
                .is_some_and(|i| self.times[i].0 >= laps),
        }
    }

    pub(super) fn complete(&self) -> bool {
        self.n_covered == self.n_coverable && self.lap == self.laps
    }

    /// Everything is to be seen once more.
    pub(super) fn next_lap(&mut self) {
        if self.n_covered == self.n_coverable && self.lap < self.laps {
            self.lap += 1;
            self.n_covered = 0;
            self.seen.fill(None);
        }
    }

    /// What was seen so far is all that is to be seen: the last lap that is complete was the
    /// last. Returns whether there is one.
    pub(super) fn end_laps(&mut self) -> bool {
        if self.lap > 1 && self.n_covered < self.n_coverable {
            self.lap -= 1;
            self.n_covered = self.n_coverable;
            self.seen = (0..self.seen.len())
                .map(|i| self.last_sighting(i))
                .collect();
        }
        self.laps = self.lap;
        self.complete()
    }

    pub(super) fn look(&mut self, uav: u16, eye: &Eye<'_>, piece: &Piece, facts: &mut Vec<Fact>) {
        self.layers.looks_from(eye.height_m);
        if !self.layers.counts_until(self.lap) {
            return;
        }
        let length_m = piece.length_m();
        let reach_m = self.reach_m(eye) + length_m;
        let new = match self.survey.pieces() {
            Some(pieces) => pieces
                .near(piece.start.position(), reach_m)
                .any(|i| self.seen[i].is_none()),
            None => self.anything_new(piece.start.position(), reach_m),
        };
        if !new && self.claims.is_none() && self.watch.is_none() {
            return;
        }
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a piece is as long as one step of the world"
        )]
        let n = (length_m / LOOK_M).ceil().clamp(1.0, 1e6) as u32;
        let span_ms = piece.to_ms - piece.from_ms;
        for k in 0..=n {
            #[allow(clippy::cast_precision_loss, reason = "milliseconds of one step")]
            let dt_s = span_ms as f64 / 1000.0 * f64::from(k) / f64::from(n);
            let at_ms = piece.from_ms + span_ms * u64::from(k) / u64::from(n);
            let pose = piece.pose_after(dt_s);
            let (picture, sighting) = (eye.picture(pose, at_ms), Sighting { at_ms, uav });
            if self.survey.pieces().is_some() {
                self.snap_pieces(eye, &picture, sighting, facts);
            } else if eye.is_level() {
                self.snap(eye, pose, sighting, facts);
            } else {
                self.snap_turned(eye, &picture, sighting, facts);
            }
            self.snap_claims(eye, &picture);
        }
    }

    fn snap_claims(&mut self, eye: &Eye<'_>, picture: &Picture) {
        let Some((pieces, seen)) = &mut self.claims else {
            return;
        };
        for i in pieces.near(picture.from(), eye.reach_m()) {
            if !seen[i] && pieces.held(i, picture) {
                seen[i] = true;
                self.marks += 1;
            }
        }
    }

    /// One picture of a mission for targets: marks the pieces that lie in it whole.
    fn snap_pieces(
        &mut self,
        eye: &Eye<'_>,
        picture: &Picture,
        sighting: Sighting,
        facts: &mut Vec<Fact>,
    ) {
        let survey = Arc::clone(&self.survey);
        let Some(pieces) = survey.pieces() else {
            return;
        };
        for i in pieces.near(picture.from(), self.reach_m(eye)) {
            if self.looks_for(i) && pieces.held(i, picture) {
                self.see(i, sighting, facts);
            }
        }
    }

    /// One picture of a camera that tilts: marks the cells that lie in it whole, corner by corner.
    fn snap_turned(
        &mut self,
        eye: &Eye<'_>,
        picture: &Picture,
        sighting: Sighting,
        facts: &mut Vec<Fact>,
    ) {
        let from = picture.from();
        let (c0, c1, r0, r1) = self.near(from, self.reach_m(eye));
        let (d, half_m) = (self.survey.lane_m(), self.survey.extent_m() / 2.0);
        for row in r0..=r1 {
            for col in c0..=c1 {
                let Some(i) = self.survey.at(col, row).filter(|i| self.looks_for(*i)) else {
                    continue;
                };
                let middle = Point::new((f64::from(col) + 0.5) * d, (f64::from(row) + 0.5) * d);
                let corner = |x: f64, y: f64| middle + Vector::new(x, y) * half_m;
                let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
                if picture.holds(&corners.map(|(x, y)| corner(x, y))) {
                    self.see(i, sighting, facts);
                }
            }
        }
    }

    /// Whether it matters that a cell is in a picture.
    fn looks_for(&self, i: usize) -> bool {
        self.seen[i].is_none() || self.watch.is_some()
    }

    pub(super) fn see(&mut self, i: usize, sighting: Sighting, facts: &mut Vec<Fact>) {
        if let Some(watch) = &mut self.watch {
            watch.see(i, sighting.at_ms);
        }
        // Each cell counts for its own next lap, from within the layer of that: the last one of a
        // lap may have been seen in the middle of a picture, and one that need not be seen may be
        // behind.
        let lap = self.times[i].0.saturating_add(1);
        if self.seen[i].is_some() || !self.layers.counts(lap) {
            return;
        }
        if lap < self.lap {
            self.times[i] = (lap, sighting.at_ms);
            self.marks += 1;
            return;
        }
        self.seen[i] = Some(sighting);
        self.marks += 1;
        let cell = self.survey.cells()[i];
        self.n_covered += usize::from(is_coverable(&cell));
        facts.push(Fact::Seen {
            at_ms: sighting.at_ms,
            uav: sighting.uav,
            cell: cell.id,
        });
        let (times, before_ms) = self.times[i];
        // A cell that was not asked for in earlier laps was not seen in them either.
        if before_ms > 0 {
            let gap_ms = sighting.at_ms.saturating_sub(before_ms);
            self.longest_gap_ms = self.longest_gap_ms.max(gap_ms);
        }
        self.times[i] = (times + 1, sighting.at_ms);
        if self.n_covered == self.n_coverable {
            self.layers.done(self.lap, sighting.at_ms);
        }
        self.next_lap();
    }

    /// How far from the camera the centre of a cell in its picture can be.
    fn reach_m(&self, eye: &Eye<'_>) -> f64 {
        if self.survey.pieces().is_some() || !eye.is_level() {
            // A corner of a piece may lie in a corner of the picture.
            return eye.reach_m();
        }
        let half = self.survey.extent_m() / 2.0;
        let (a, b) = (eye.across_m - half, eye.along_m - half);
        if a < 0.0 || b < 0.0 {
            0.0
        } else {
            (a * a + b * b).sqrt()
        }
    }

    fn near(&self, at: Point, reach_m: f64) -> (i32, i32, i32, i32) {
        let d = self.survey.lane_m();
        #[allow(
            clippy::cast_possible_truncation,
            reason = "a cast of a float saturates"
        )]
        let (lo, hi) = (
            |v: f64| ((v - reach_m) / d - 0.5).ceil() as i32,
            |v: f64| ((v + reach_m) / d - 0.5).floor() as i32,
        );
        (lo(at.x), hi(at.x), lo(at.y), hi(at.y))
    }

    fn anything_new(&self, at: Point, reach_m: f64) -> bool {
        let (c0, c1, r0, r1) = self.near(at, reach_m);
        (r0..=r1).any(|r| {
            (c0..=c1).any(|c| self.survey.at(c, r).is_some_and(|i| self.seen[i].is_none()))
        })
    }

    /// One level picture: marks the cells that lie in it whole.
    ///
    /// A square turned by the heading sticks out from its centre by half a side times
    /// |cos| + |sin|, across as well as along.
    fn snap(&mut self, eye: &Eye<'_>, pose: Pose, sighting: Sighting, facts: &mut Vec<Fact>) {
        let (c0, c1, r0, r1) = self.near(pose.position(), self.reach_m(eye));
        let d = self.survey.lane_m();
        let forward = pose.direction();
        let out_m = self.survey.extent_m() / 2.0 * (forward.x.abs() + forward.y.abs());
        let (across, along) = (eye.across_m - out_m, eye.along_m - out_m);
        for row in r0..=r1 {
            for col in c0..=c1 {
                let Some(i) = self.survey.at(col, row) else {
                    continue;
                };
                if !self.looks_for(i) {
                    continue;
                }
                let (x, y) = (
                    (f64::from(col) + 0.5) * d - pose.east_m,
                    (f64::from(row) + 0.5) * d - pose.north_m,
                );
                let inside = (x * forward.x + y * forward.y).abs() <= along
                    && (y * forward.x - x * forward.y).abs() <= across;
                if inside {
                    self.see(i, sighting, facts);
                }
            }
        }
    }
}
