//! Which part of the plane is shown.

use ratatui::layout::{Position, Rect};
use skein_geometry::frame::Point;
use skein_recording::Scene;

/// How much higher than wide a character is.
const ASPECT: f64 = 2.0;

/// A character is at least and at most so many metres wide.
const WIDTHS_M: (f64, f64) = (0.5, 2000.0);

/// Part of the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct View {
    /// What lies in the middle, metres.
    pub(crate) east_m: f64,
    pub(crate) north_m: f64,
    /// What a character is wide, metres.
    pub(crate) char_m: f64,
}

impl View {
    /// All of a scene in so many characters.
    pub(crate) fn of(scene: &Scene, area: Rect) -> Self {
        let corners = scene.area.east_north_m.iter();
        let cells = scene.cells.iter().flat_map(|c| &c.ring.east_north_m);
        let launches = scene
            .uavs
            .iter()
            .map(|u| [u.launch.east_m, u.launch.north_m]);
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for place in corners.chain(cells).copied().chain(launches) {
            for axis in 0..2 {
                low[axis] = low[axis].min(place[axis]);
                high[axis] = high[axis].max(place[axis]);
            }
        }
        if !low.iter().chain(&high).all(|x| x.is_finite()) {
            (low, high) = ([-500.0; 2], [500.0; 2]);
        }
        let wide_m = (high[0] - low[0]) / f64::from(area.width.max(3) - 2);
        let high_m = (high[1] - low[1]) / f64::from(area.height.max(3) - 1) / ASPECT;
        Self {
            east_m: f64::midpoint(low[0], high[0]),
            north_m: f64::midpoint(low[1], high[1]),
            char_m: wide_m.max(high_m).clamp(WIDTHS_M.0, WIDTHS_M.1),
        }
    }

    /// The character at which a point lies; none beyond the area.
    pub(crate) fn at(&self, p: Point, area: Rect) -> Option<Position> {
        let (column, row) = self.place(p, area);
        let inside = (0.0..f64::from(area.width)).contains(&column)
            && (0.0..f64::from(area.height)).contains(&row);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "within the area, by the line above"
        )]
        inside.then(|| Position::new(area.x + column as u16, area.y + row as u16))
    }

    /// Columns from the left edge and rows from the upper one.
    pub(crate) fn place(&self, p: Point, area: Rect) -> (f64, f64) {
        (
            (p.x - self.east_m) / self.char_m + f64::from(area.width) / 2.0,
            (self.north_m - p.y) / (self.char_m * ASPECT) + f64::from(area.height) / 2.0,
        )
    }

    /// The middle of a character.
    pub(crate) fn middle(&self, column: u16, row: u16, area: Rect) -> Point {
        let right = f64::from(column) + 0.5 - f64::from(area.width) / 2.0;
        let down = f64::from(row) + 0.5 - f64::from(area.height) / 2.0;
        Point::new(
            self.east_m + right * self.char_m,
            self.north_m - down * self.char_m * ASPECT,
        )
    }

    /// Moved by so many characters.
    pub(crate) fn pan(&mut self, columns: f64, rows: f64) {
        self.east_m += columns * self.char_m;
        self.north_m -= rows * self.char_m * ASPECT;
    }

    /// Nearer by a factor.
    pub(crate) fn zoom(&mut self, by: f64) {
        self.char_m = (self.char_m / by).clamp(WIDTHS_M.0, WIDTHS_M.1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_lies_at_the_character_whose_middle_is_nearest() {
        let area = Rect::new(3, 1, 40, 12);
        let view = View {
            east_m: 100.0,
            north_m: -50.0,
            char_m: 7.0,
        };
        for (column, row) in [(0, 0), (39, 11), (20, 6), (7, 3)] {
            let middle = view.middle(column, row, area);
            let at = view.at(middle, area);
            assert_eq!(at, Some(Position::new(3 + column, 1 + row)));
        }
        assert_eq!(view.at(Point::new(1e6, 0.0), area), None);
        assert_eq!(view.at(Point::new(f64::NAN, 0.0), area), None);
    }

    #[test]
    fn a_scene_without_places_is_shown_all_the_same() {
        let view = View::of(&Scene::default(), Rect::new(0, 0, 40, 12));
        assert!(view.char_m > 10.0 && view.east_m.abs() < 1e-9);
    }
}
