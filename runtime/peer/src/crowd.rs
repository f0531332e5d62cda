//! The people of a mass event that a mission watches (D2.7 §3.1): a part of its record, so that all
//! have the same sectors and the same norm. Who sees how many is [`crate::gathering`]'s.
//!
//! | a sector | what follows |
//! |---|---|
//! | is certainly denser than the norm | told, once: where, how dense, when, by whom |
//! | and the mission says look | a look at it is asked for again and again, which the auction gives out |
//! | and it says circle | one UAV stays above it until it has eased, which the auction gives out; what no circle holds is looked at |
//! | is certainly less dense than where it counts as eased | that is told, and nothing more follows |
//! | may be either | it is what it was |

use crate::mission::{Mission, PointMm};
use crate::wire::crowd::{SECTORS_EACH, TILES_MAX};
use crate::wire::limits::POSITION_MAX_MM;
use crate::wire::tasks::WORTH_MAX;
use serde::{Deserialize, Serialize};
use skein_behaviors::crowd::{SQUARE_M, Square};
use skein_geometry::Polygon;
use skein_geometry::frame::{Point, Vector};
use skein_geometry::hash::{Fnv, folded};

/// Sectors are made of whole squares, metres.
const SQUARE: u16 = 10;

/// The smallest and the largest side of a sector, metres: of more than that no number of people
/// fits into a register.
pub const SECTOR_M: (u16, u16) = (10, 80);

/// How often what is seen is told at least and at most, seconds.
pub const TOLD_S: (u16, u16) = (5, 600);

/// The smallest and the largest norm, people to 100 m²: nobody stands closer than ten.
pub const DENSE_E2: (u16, u16) = (1, 1_000);

/// How often a sector that is too dense is looked at, at least and at most, seconds.
pub const LOOK_S: (u16, u16) = (10, 3_600);

/// Most circles that a mission has flown at once.
pub const CIRCLES_MAX: (u16, u16) = (1, 8);

/// Sectors of a tile, each way.
const TILE: u16 = 4;

/// What follows where a sector is too dense.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ThenWatch {
    /// It is told, and all go on.
    #[default]
    Notify,
    /// It is told, and somebody looks at it again and again until it has eased.
    Look,
    /// It is told, and somebody stays above it until it has eased.
    Circle,
}

impl ThenWatch {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Notify, Self::Look, Self::Circle];

    /// Its name in a file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Notify => "notify",
            Self::Look => "look",
            Self::Circle => "circle",
        }
    }
}

/// The event that a mission watches. Whole numbers alone, as all of a mission.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct CrowdWatch {
    /// Its south-west corner, metres east of the mission's origin.
    pub west_m: i32,
    /// And north of it.
    pub south_m: i32,
    /// The side of a sector, metres.
    pub sector_m: u16,
    /// Sectors from west to east.
    pub cols: u16,
    /// Sectors from south to north.
    pub rows: u16,
    /// So often what is seen is told, seconds; what is urgent at once.
    pub interval_s: u16,
    /// Denser than this is too dense, people to 100 m².
    pub dense_e2: u16,
    /// Less dense than this has eased, people to 100 m².
    pub eased_e2: u16,
    /// What follows.
    pub then: ThenWatch,
    /// So often a sector that is too dense is looked at, seconds.
    pub look_every_s: u16,
    /// What such a look is worth, or such a circle.
    pub worth: u16,
    /// So many circles are flown at once at most.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub circles_max: u16,
}

fn one() -> u16 {
    1
}

#[allow(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde hands over a reference"
)]
fn is_one(n: &u16) -> bool {
    *n == 1
}

impl CrowdWatch {
    /// Tiles from west to east, and from south to north.
    fn tiles(&self) -> (u16, u16) {
        (self.cols.div_ceil(TILE), self.rows.div_ceil(TILE))
    }

    /// How many sectors there are.
    #[must_use]
    pub fn len(&self) -> usize {
        usize::from(self.cols) * usize::from(self.rows)
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All sectors, by number, ascending: sixteen of a number divided by that are a tile.
    pub fn sectors(&self) -> impl Iterator<Item = u16> + '_ {
        let (east, north) = self.tiles();
        let all = 0..SECTORS_EACH.saturating_mul(east).saturating_mul(north);
        all.filter(|n| self.place(*n).is_some())
    }

    /// Column and row of a sector; none where there is none of this number.
    #[must_use]
    pub fn place(&self, sector: u16) -> Option<(u16, u16)> {
        let (east, _) = self.tiles();
        let (tile, within) = (sector / SECTORS_EACH, sector % SECTORS_EACH);
        let col = TILE * (tile % east.max(1)) + within % TILE;
        let row = TILE * (tile / east.max(1)) + within / TILE;
        (col < self.cols && row < self.rows).then_some((col, row))
    }

    /// The sector in a column and a row.
    #[must_use]
    pub fn sector(&self, col: u16, row: u16) -> u16 {
        let (east, _) = self.tiles();
        let tile = (row / TILE) * east + col / TILE;
        SECTORS_EACH * tile + (row % TILE) * TILE + col % TILE
    }

    /// The south-west corner of a sector.
    #[must_use]
    pub fn low(&self, sector: u16) -> Option<Point> {
        let (col, row) = self.place(sector)?;
        let side_m = f64::from(self.sector_m);
        let (east, north) = (f64::from(self.west_m), f64::from(self.south_m));
        Some(Point::new(
            east + side_m * f64::from(col),
            north + side_m * f64::from(row),
        ))
    }

    /// The middle of a sector.
    #[must_use]
    pub fn middle(&self, sector: u16) -> Option<Point> {
        let half_m = f64::from(self.sector_m) / 2.0;
        self.low(sector).map(|p| p + Vector::new(half_m, half_m))
    }

    /// The sectors that lie in a box of squares, from the south-west one to the north-east one.
    pub(crate) fn within(&self, low: Square, high: Square) -> impl Iterator<Item = u16> + '_ {
        let side = i32::from(self.sector_m / SQUARE).max(1);
        let range = move |low: i16, high: i16, from_m: i32, n: u16| {
            let first = from_m / i32::from(SQUARE);
            let of = |square: i16| (i32::from(square) - first).div_euclid(side);
            let (low, high) = (of(low).max(0), of(high).min(i32::from(n) - 1));
            (low..=high).filter_map(|n| u16::try_from(n).ok())
        };
        let rows = range(low.row, high.row, self.south_m, self.rows);
        rows.flat_map(move |row| {
            let cols = range(low.col, high.col, self.west_m, self.cols);
            cols.map(move |col| self.sector(col, row))
        })
    }

    /// The south-west square of a sector, and how many squares its side is long.
    pub(crate) fn squares(&self, sector: u16) -> Option<(Square, i16)> {
        let low = self.low(sector)? + Vector::new(0.5, 0.5) * SQUARE_M;
        let side = i16::try_from(self.sector_m / SQUARE).ok()?;
        Some((Square::at(low), side))
    }

    /// The area of a sector, m².
    #[must_use]
    pub fn sector_m2(&self) -> f64 {
        f64::from(self.sector_m) * f64::from(self.sector_m)
    }

    /// More people than this are too many for a sector.
    #[must_use]
    pub fn dense_people(&self) -> f64 {
        self.sector_m2() * f64::from(self.dense_e2) / 100.0
    }

    /// With fewer people than this a sector has eased.
    #[must_use]
    pub fn eased_people(&self) -> f64 {
        self.sector_m2() * f64::from(self.eased_e2) / 100.0
    }

    /// What is wrong with it, if anything, whatever the area and the cameras are.
    ///
    /// # Errors
    /// The field, and what was expected there.
    pub fn check(&self) -> Result<(), (&'static str, String)> {
        let within = |field, v: u16, (least, most): (u16, u16), unit: &str| {
            if (least..=most).contains(&v) {
                Ok(())
            } else {
                Err((field, format!("is {v}; expected {least} to {most} {unit}")))
            }
        };
        let side = self.sector_m;
        within("sector_m", side, SECTOR_M, "m")?;
        if !side.is_multiple_of(SQUARE) {
            return Err((
                "sector_m",
                format!("is {side}; expected a multiple of 10 m, of which cameras tell"),
            ));
        }
        let is_square = |m: i32| m % i32::from(SQUARE) == 0;
        let is_near = |m: i32| i64::from(m).abs() * 1_000 <= i64::from(POSITION_MAX_MM);
        let far = |m: i32, n: u16| {
            let long_m = i32::from(n).saturating_mul(i32::from(side));
            m.saturating_add(long_m)
        };
        let corners = [
            self.west_m,
            self.south_m,
            far(self.west_m, self.cols),
            far(self.south_m, self.rows),
        ];
        if self.is_empty() || !corners.into_iter().all(|m| is_square(m) && is_near(m)) {
            let text =
                "expected sides at multiples of 10 m, one sector apart at least, within 20 km";
            return Err(("area", text.to_owned()));
        }
        let (east, north) = self.tiles();
        if u32::from(east) * u32::from(north) > u32::from(TILES_MAX) {
            let (cols, rows) = (self.cols, self.rows);
            return Err((
                "sector_m",
                format!(
                    "makes {cols} by {rows} sectors; expected {TILES_MAX} tiles of {TILE} by {TILE} at most: widen the sectors, or shrink the area"
                ),
            ));
        }
        within("interval_s", self.interval_s, TOLD_S, "s")?;
        within("dense_per_m2", self.dense_e2, DENSE_E2, "people to 100 m²")?;
        if self.eased_e2 >= self.dense_e2 {
            return Err((
                "eased_per_m2",
                "is no less than dense_per_m2: what is too dense would be told again and again"
                    .to_owned(),
            ));
        }
        within("look_every_s", self.look_every_s, LOOK_S, "s")?;
        within("worth", self.worth, (1, WORTH_MAX), "")?;
        if self.then != ThenWatch::Circle && self.circles_max != 1 {
            let text = "is of use with `then: \"circle\"` alone".to_owned();
            return Err(("circles_max", text));
        }
        within("circles_max", self.circles_max, CIRCLES_MAX, "circles")
    }

    /// Whether it lies in an area, and each sector whole in the inner part of a picture that
    /// reaches so far to every side, metres, of which neighbouring ones overlap by so much.
    ///
    /// # Errors
    /// The field, and what was expected there.
    pub fn check_seen(
        &self,
        area: &Polygon,
        reach_m: f64,
        overlap_m: f64,
    ) -> Result<(), (&'static str, String)> {
        let mut outside = self.sectors().filter_map(|n| self.middle(n));
        if let Some(p) = outside.find(|p| !area.contains(*p)) {
            return Err((
                "area",
                format!(
                    "has a sector about ({:.0}, {:.0}) m, outside of the mission's area; shrink it, or widen that",
                    p.x, p.y
                ),
            ));
        }
        let across_m = f64::from(self.sector_m) * core::f64::consts::SQRT_2;
        let fits_m = (2.0 * reach_m).min(overlap_m);
        if across_m > fits_m {
            return Err((
                "sector_m",
                format!(
                    "sectors are {across_m:.0} m from corner to corner, of which a picture shows {fits_m:.0} m whatever lane it is of; take smaller ones, narrower lanes, or fly higher"
                ),
            ));
        }
        Ok(())
    }

    /// Folds it into a hash.
    pub(crate) fn hash(&self, h: &mut Fnv) {
        for v in [self.west_m, self.south_m] {
            h.write_i64(i64::from(v));
        }
        for v in [
            self.sector_m,
            self.cols,
            self.rows,
            self.interval_s,
            self.dense_e2,
            self.eased_e2,
            self.look_every_s,
            self.worth,
        ] {
            h.write_i64(i64::from(v));
        }
        h.write_i64(self.then as i64);
        if self.then == ThenWatch::Circle {
            h.write_i64(-13);
            h.write_i64(i64::from(self.circles_max));
        }
    }

    /// Where a sector is, for a task.
    pub(crate) fn middle_mm(&self, sector: u16) -> Option<PointMm> {
        let p = self.middle(sector)?;
        Some((crate::mission::mm(p.x), crate::mission::mm(p.y)))
    }
}

impl Mission {
    /// Which event of which sortie: what is told of others is none of this.
    #[must_use]
    pub fn crowd_hash(&self) -> u32 {
        let mut h = Fnv::new();
        h.write_i64(i64::from(self.sortie));
        if let Some(crowd) = &self.crowd {
            crowd.hash(&mut h);
        }
        folded(h.finish())
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// An event of 100 m by 60 m: five by three sectors.
    pub(crate) fn event() -> CrowdWatch {
        CrowdWatch {
            west_m: -20,
            south_m: 40,
            sector_m: 20,
            cols: 5,
            rows: 3,
            interval_s: 20,
            dense_e2: 350,
            eased_e2: 280,
            then: ThenWatch::Look,
            look_every_s: 40,
            worth: 100,
            circles_max: 1,
        }
    }

    #[test]
    fn sectors_are_numbered_tile_by_tile() {
        let event = event();
        let all: Vec<u16> = event.sectors().collect();
        assert_eq!(all.len(), event.len());
        for n in &all {
            let (col, row) = event.place(*n).unwrap();
            assert_eq!(event.sector(col, row), *n);
        }
        assert_eq!(event.place(4), Some((0, 1)));
        assert_eq!(event.place(16), Some((4, 0)));
        assert_eq!((event.place(17), event.place(12)), (None, None));
        assert_eq!(event.low(16), Some(Point::new(60.0, 40.0)));
        assert_eq!(event.middle(0), Some(Point::new(-10.0, 50.0)));
        let (square, side) = event.squares(16).unwrap();
        assert_eq!((square.col, square.row, side), (6, 4, 2));
        let square = |col, row| Square {
            col,
            row,
            people: 0,
        };
        let within: Vec<u16> = event.within(square(-9, 0), square(1, 6)).collect();
        assert_eq!(within, [0, 1, 4, 5]);
    }

    #[test]
    fn what_is_wrong_is_named_with_its_field() {
        assert_eq!(event().check(), Ok(()));
        type Change = fn(&mut CrowdWatch);
        let cases: [(Change, &str); 15] = [
            (|c| c.sector_m = 0, "sector_m"),
            (|c| c.sector_m = 25, "sector_m"),
            (|c| c.sector_m = 90, "sector_m"),
            (|c| c.west_m = 5, "area"),
            (|c| c.west_m = 30_000, "area"),
            (|c| c.cols = 0, "area"),
            (|c| (c.cols, c.rows) = (40, 28), "sector_m"),
            (|c| c.interval_s = 1, "interval_s"),
            (|c| c.dense_e2 = 0, "dense_per_m2"),
            (|c| c.eased_e2 = 350, "eased_per_m2"),
            (|c| c.look_every_s = 0, "look_every_s"),
            (|c| c.worth = 0, "worth"),
            (|c| c.circles_max = 2, "circles_max"),
            (
                |c| (c.then, c.circles_max) = (ThenWatch::Circle, 0),
                "circles_max",
            ),
            (
                |c| (c.then, c.circles_max) = (ThenWatch::Circle, 9),
                "circles_max",
            ),
        ];
        for (change, field) in cases {
            let mut event = event();
            change(&mut event);
            assert_eq!(event.check().unwrap_err().0, field);
        }
    }

    #[test]
    fn sectors_lie_in_the_area_and_fit_into_pictures() {
        let square = |half: f64| {
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            Polygon::new(
                corners
                    .map(|(x, y)| Point::new(x * half, y * half))
                    .to_vec(),
            )
            .unwrap()
        };
        let event = event();
        assert_eq!(event.check_seen(&square(200.0), 40.0, 60.0), Ok(()));
        let field = |e: Result<(), (&'static str, String)>| e.unwrap_err().0;
        assert_eq!(field(event.check_seen(&square(80.0), 40.0, 60.0)), "area");
        assert_eq!(
            field(event.check_seen(&square(200.0), 12.0, 60.0)),
            "sector_m"
        );
        assert_eq!(
            field(event.check_seen(&square(200.0), 40.0, 20.0)),
            "sector_m"
        );
    }
}
