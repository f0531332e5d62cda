//! Paths over points in a given order (D2.7 §2.3.2 with via points).
//!
//! The order is given and a path of a point may bend at a via point, so the shortest
//! whole is made of shortest legs.

use crate::visibility::VisibilityGraph;
use skein_flight::route::two_point::Search;
use skein_geometry::frame::Point;
use thiserror::Error;

/// Between two places of a list there is no path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("no path leads from place {} to place {} of the list", leg, leg + 1)]
pub struct NoLeg {
    /// Counts legs from 0: leg `i` leads from place `i` to place `i + 1`.
    pub leg: usize,
}

/// The shortest path over all places in their order, first and last included.
///
/// # Errors
/// [`NoLeg`] names the first leg without a path.
pub fn shortest_through(search: &mut Search<'_>, places: &[Point]) -> Result<Vec<Point>, NoLeg> {
    join(places, |a, b| search.shortest(a, b))
}

impl VisibilityGraph {
    /// The shortest path over all places in their order, first and last included.
    ///
    /// # Errors
    /// [`NoLeg`] names the first leg without a path.
    pub fn shortest_through(&self, places: &[Point]) -> Result<Vec<Point>, NoLeg> {
        join(places, |a, b| self.shortest(a, b).map(|p| p.points))
    }
}

fn join(
    places: &[Point],
    mut leg: impl FnMut(Point, Point) -> Option<Vec<Point>>,
) -> Result<Vec<Point>, NoLeg> {
    let mut path = Vec::from_iter(places.first().copied());
    for (i, w) in places.windows(2).enumerate() {
        let points = leg(w[0], w[1]).ok_or(NoLeg { leg: i })?;
        path.extend(points.into_iter().skip(1));
    }
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_flight::route::mesh::Mesh;

    fn square(x: f64, y: f64, side: f64) -> Vec<Point> {
        [(x, y), (x + side, y), (x + side, y + side), (x, y + side)]
            .map(|(x, y)| Point::new(x, y))
            .to_vec()
    }

    #[test]
    fn legs_are_joined_and_the_one_without_a_path_is_named() {
        let rings = [square(0.0, 0.0, 30.0), square(10.0, 10.0, 10.0)];
        let mesh = Mesh::from_rings(&[&rings[0], &rings[1]]).unwrap();
        let graph = VisibilityGraph::of_rings(std::iter::once((0, rings[1].as_slice())));
        let p = |x, y| Point::new(x, y);
        let places = [p(5.0, 15.0), p(25.0, 16.0), p(25.0, 25.0), p(5.0, 15.0)];
        let path = shortest_through(&mut Search::new(&mesh), &places).unwrap();
        assert_eq!(path, graph.shortest_through(&places).unwrap());
        assert_eq!(path.len(), 7, "{path:?}");
        let blocked = [places[0], places[1], p(15.0, 15.0)];
        let error = shortest_through(&mut Search::new(&mesh), &blocked).unwrap_err();
        assert_eq!(error, NoLeg { leg: 1 });
        assert_eq!(graph.shortest_through(&blocked).unwrap_err(), error);
        assert!(
            shortest_through(&mut Search::new(&mesh), &[])
                .unwrap()
                .is_empty()
        );
    }
}
