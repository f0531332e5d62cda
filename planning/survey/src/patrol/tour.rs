//! A closed way over points, by length.

use skein_geometry::frame::Point;
use thiserror::Error;

/// A closed tour over points of the plane; places on it are millimetres from its first
/// corner (or what the costs of its legs are thousandths of).
#[derive(Clone, Debug, PartialEq)]
pub struct Tour {
    corners: Vec<Point>,
    /// Where each corner is; the last one is the first again.
    at: Vec<u32>,
}

/// Why points make no tour.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum TourError {
    /// No way to go.
    #[error("there is nothing to go round: the tour has no length")]
    Empty,
    /// Beyond what is counted.
    #[error("a tour of {0:.0} m is too long to patrol, 4,294 km are possible")]
    TooLong(f64),
}

impl Tour {
    /// The tour over corners in order and back to the first; `leg` gives the length of
    /// each straight leg, metres (above what it is, where turns add to it).
    ///
    /// # Errors
    /// [`TourError`].
    pub fn new(
        mut corners: Vec<Point>,
        leg: impl Fn(Point, Point) -> f64,
    ) -> Result<Self, TourError> {
        let Some(first) = corners.first().copied() else {
            return Err(TourError::Empty);
        };
        corners.push(first);
        let mut at = vec![0];
        let mut flown_m = 0.0;
        for pair in corners.windows(2) {
            flown_m += leg(pair[0], pair[1]);
            let mm = (flown_m * 1000.0).round();
            if !(0.0..=f64::from(u32::MAX)).contains(&mm) {
                return Err(TourError::TooLong(flown_m));
            }
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "within the range just checked"
            )]
            at.push(mm as u32);
        }
        match at.last() {
            Some(0) | None => Err(TourError::Empty),
            _ => Ok(Self { corners, at }),
        }
    }

    /// Its length, millimetres.
    #[must_use]
    pub fn len_mm(&self) -> u32 {
        self.at.last().copied().unwrap_or(0)
    }

    /// The point at a place.
    #[must_use]
    pub fn point(&self, place: u32) -> Point {
        let place = place % self.len_mm().max(1);
        let leg = self.at.partition_point(|a| *a <= place).max(1);
        self.between(leg, place)
    }

    /// The point at a place on the leg that ends at a corner.
    fn between(&self, leg: usize, place: u32) -> Point {
        let (a, b) = (self.corners[leg - 1], self.corners[leg]);
        let (from, to) = (self.at[leg - 1], self.at[leg]);
        let share = f64::from(place.saturating_sub(from)) / f64::from((to - from).max(1));
        a + (b - a) * share
    }

    /// The place that is nearest to a point; the first of several.
    #[must_use]
    pub fn nearest(&self, p: Point) -> u32 {
        let mut best = (f64::INFINITY, 0);
        for leg in 1..self.corners.len() {
            let (a, b) = (self.corners[leg - 1], self.corners[leg]);
            let along = b - a;
            let share = (p - a).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE);
            let share = share.clamp(0.0, 1.0);
            let distance = (a + along * share - p).norm();
            if distance < best.0 {
                let (from, to) = (self.at[leg - 1], self.at[leg]);
                #[allow(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "a share of a length that fits"
                )]
                let place = from + (f64::from(to - from) * share) as u32;
                best = (distance, place);
            }
        }
        best.1
    }

    /// The corners from a place on over a length, both ends included: once round at most.
    #[must_use]
    pub fn stretch(&self, from: u32, len: u32) -> Vec<Point> {
        let n = self.len_mm();
        let from = from % n.max(1);
        let mut points = vec![self.point(from)];
        let end = u64::from(from) + u64::from(len.min(n));
        for lap in [0, u64::from(n)] {
            for (corner, at) in self.corners.iter().zip(&self.at).skip(1) {
                let at = u64::from(*at) + lap;
                if at > u64::from(from) && at < end {
                    points.push(*corner);
                }
            }
        }
        points.push(self.point(u32::try_from(end % u64::from(n.max(1))).unwrap_or(0)));
        points
    }
}
