//! On which stretch of a street a vehicle is: by its place, and where it drives by its heading
//! (map matching of one place).

use super::network::Network;
use skein_geometry::frame::{Point, Vector};

/// Farther from a middle line nobody is on its street, metres: a lane or two, and the error of a
/// place.
pub const ASIDE_M: f64 = 14.0;

/// A heading across a street counts as so many metres more.
const ACROSS_M: f64 = 12.0;

/// Who was on a stretch is still there, unless another one is nearer by so much, metres: what
/// errors of places change from look to look.
const STAYS_M: f64 = 2.0;

/// Where a vehicle is on a network.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Matched {
    /// On which stretch.
    pub edge: u16,
    /// How far along it, metres.
    pub along_m: f64,
    /// How far from its middle line, metres.
    pub aside_m: f64,
}

impl Network {
    /// Where a vehicle is that was on the stretch `was`, if that is known; `heading` is where it
    /// drives, of any length, and zero where it stands. None far from all streets.
    #[must_use]
    pub fn matched(&self, at: Point, heading: Vector, was: Option<u16>) -> Option<Matched> {
        let heading = heading.try_normalize(1e-9);
        let mut best: Option<(f64, Matched)> = None;
        for (m, along) in self.on_each_piece(at) {
            if m.aside_m > ASIDE_M {
                continue;
            }
            let across = heading.map_or(0.0, |h| along.perp(&h).abs() / along.norm());
            let stays_m = if was == Some(m.edge) { STAYS_M } else { 0.0 };
            let cost_m = m.aside_m + ACROSS_M * across - stays_m;
            if best.is_none_or(|(least_m, _)| cost_m < least_m) {
                best = Some((cost_m, m));
            }
        }
        best.map(|(_, matched)| matched)
    }

    /// The place of each straight piece of a street that is nearest, with that piece.
    pub(super) fn on_each_piece(&self, at: Point) -> impl Iterator<Item = (Matched, Vector)> + '_ {
        (0_u16..).zip(self.edges()).flat_map(move |(edge, e)| {
            let mut before_m = 0.0;
            e.way.windows(2).filter_map(move |w| {
                let (along, length_m) = (w[1] - w[0], (w[1] - w[0]).norm());
                if length_m <= 0.0 {
                    return None;
                }
                let share = (along.dot(&(at - w[0])) / (length_m * length_m)).clamp(0.0, 1.0);
                let matched = Matched {
                    edge,
                    along_m: before_m + share * length_m,
                    aside_m: (w[0] + along * share - at).norm(),
                };
                before_m += length_m;
                Some((matched, along))
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::network::tests::grid;
    use super::*;

    #[test]
    fn a_vehicle_is_on_the_nearest_street_that_leads_where_it_drives() {
        let net = Network::of(&grid(2, 100.0));
        let east = Vector::new(8.0, 0.0);
        let m = net.matched(Point::new(150.0, 103.0), east, None).unwrap();
        assert!((m.aside_m - 3.0).abs() < 1e-9);
        let e = &net.edges()[usize::from(m.edge)];
        assert!(e.way.iter().all(|p| (p.y - 100.0).abs() < 1e-9));
        // Four metres from both: by its heading.
        let at = Point::new(104.0, 104.0);
        for (heading, is_across) in [(east, true), (Vector::new(0.0, 8.0), false)] {
            let m = net.matched(at, heading, None).unwrap();
            let way = &net.edges()[usize::from(m.edge)].way;
            assert_eq!((way[0].y - way[1].y).abs() < 1e-9, is_across);
        }
        assert_eq!(net.matched(Point::new(150.0, 130.0), east, None), None);
        // Who was on one of two that are about as near is there still.
        let before = net.matched(Point::new(90.0, 100.0), east, None).unwrap();
        let at = Point::new(101.0, 100.0);
        assert_ne!(net.matched(at, east, None).unwrap().edge, before.edge);
        let stays = net.matched(at, east, Some(before.edge)).unwrap();
        assert_eq!(stays.edge, before.edge);
    }
}
