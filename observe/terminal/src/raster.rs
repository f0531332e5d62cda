//! Which cell, zone or building lies at which character.

use crate::view::View;
use ratatui::layout::Rect;
use skein_geometry::frame::Point;
use skein_recording::Scene;
use skein_recording::model::Ring;

/// What stands at one character.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Ground {
    /// Nothing that is drawn.
    #[default]
    Bare,
    /// A building.
    Building,
    /// A cell that is to be seen.
    Cell(u16),
    /// A no-fly zone.
    Zone,
}

/// What stands at each character of an area, row by row.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Raster {
    grounds: Vec<Ground>,
    width: u16,
    /// For what it was made.
    made_for: Option<(View, Rect, String, u32, usize)>,
}

impl Raster {
    /// Makes it anew if anything changed.
    pub(crate) fn update(&mut self, scene: &Scene, view: View, area: Rect) {
        let hash = scene.loop_hash.clone();
        let key = (view, area, hash, scene.revision, scene.zones.len());
        if self.made_for.as_ref() == Some(&key) {
            return;
        }
        self.width = area.width;
        let n = usize::from(area.width) * usize::from(area.height);
        self.grounds = vec![Ground::Bare; n];
        for building in &scene.buildings {
            self.fill(&building.ring, view, area, Ground::Building, false);
        }
        for (id, cell) in scene.cells.iter().enumerate().filter(|(_, c)| c.needed) {
            let Ok(id) = u16::try_from(id) else { break };
            self.fill(&cell.ring, view, area, Ground::Cell(id), true);
        }
        for zone in &scene.zones {
            self.fill(&zone.ring, view, area, Ground::Zone, true);
        }
        self.made_for = Some(key);
    }

    /// What stands at a column and row of the area.
    pub(crate) fn at(&self, column: u16, row: u16) -> Ground {
        let at = usize::from(row) * usize::from(self.width) + usize::from(column);
        self.grounds.get(at).copied().unwrap_or_default()
    }

    /// Marks all characters whose middle a ring holds; where it holds none, and is worth a
    /// mark, the one in which it lies, if nothing stands there.
    fn fill(&mut self, ring: &Ring, view: View, area: Rect, mark: Ground, worth: bool) {
        let corners: Vec<Point> = ring
            .east_north_m
            .iter()
            .map(|p| Point::new(p[0], p[1]))
            .collect();
        if corners.len() < 3 {
            return;
        }
        let places: Vec<(f64, f64)> = corners.iter().map(|p| view.place(*p, area)).collect();
        let columns = span(places.iter().map(|p| p.0), area.width);
        let rows = span(places.iter().map(|p| p.1), area.height);
        let mut marked = false;
        for row in rows {
            for column in columns.clone() {
                if holds(&corners, view.middle(column, row, area)) {
                    self.mark(column, row, mark);
                    marked = true;
                }
            }
        }
        let n = corners.len() as f64;
        let sum = corners
            .iter()
            .fold((0.0, 0.0), |s, p| (s.0 + p.x, s.1 + p.y));
        let middle = Point::new(sum.0 / n, sum.1 / n);
        if let Some(at) = view.at(middle, area).filter(|_| !marked && worth) {
            let (column, row) = (at.x - area.x, at.y - area.y);
            if self.at(column, row) == Ground::Bare {
                self.mark(column, row, mark);
            }
        }
    }

    fn mark(&mut self, column: u16, row: u16, mark: Ground) {
        let at = usize::from(row) * usize::from(self.width) + usize::from(column);
        if let Some(ground) = self.grounds.get_mut(at) {
            *ground = mark;
        }
    }
}

/// The characters between the least and the greatest of some places, within so many.
fn span(places: impl Iterator<Item = f64>, n: u16) -> std::ops::Range<u16> {
    let (low, high) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
        (low.min(x), high.max(x))
    });
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to 0 and n; what is no number becomes 0"
    )]
    let bound = |x: f64| x.clamp(0.0, f64::from(n)) as u16;
    bound(low.floor())..bound(high.ceil())
}

/// Whether a ring holds a point: a ray towards the east crosses its border an odd number of
/// times.
fn holds(corners: &[Point], p: Point) -> bool {
    let next = corners.iter().cycle().skip(1);
    let crossed = corners.iter().zip(next).filter(|(a, b)| {
        (a.y > p.y) != (b.y > p.y) && p.x < (b.x - a.x) * (p.y - a.y) / (b.y - a.y) + a.x
    });
    crossed.count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::tests::square;
    use skein_recording::model::scene::{Cell, Zone};

    #[test]
    fn cells_and_zones_stand_where_they_lie_however_small() {
        let cell = |ring| Cell {
            ring,
            needed: true,
            ..Cell::default()
        };
        let scene = Scene {
            cells: vec![
                cell(square(0.0, 0.0, 40.0)),
                cell(square(100.0, 100.0, 1.0)),
            ],
            zones: vec![Zone {
                ring: square(-100.0, 0.0, 40.0),
                ..Zone::default()
            }],
            ..Scene::default()
        };
        let area = Rect::new(0, 0, 40, 20);
        let view = View {
            east_m: 0.0,
            north_m: 0.0,
            char_m: 10.0,
        };
        let mut raster = Raster::default();
        raster.update(&scene, view, area);
        let at = |e: f64, n: f64| {
            let at = view.at(Point::new(e, n), area).unwrap();
            raster.at(at.x, at.y)
        };
        assert_eq!(at(20.0, 20.0), Ground::Cell(0));
        assert_eq!(at(100.5, 100.5), Ground::Cell(1));
        assert_eq!(at(-80.0, 20.0), Ground::Zone);
        assert_eq!(at(20.0, -30.0), Ground::Bare);
    }
}
