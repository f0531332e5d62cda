//! Buildings as prisms, and whether two antennas see each other (D2.7 §2.2).
//!
//! A box tree (parry) over the prisms finds the few that a segment may touch; for
//! those the part of the segment below the roof is tested against the footprint,
//! exactly. The earth is flat here: over one kilometre its bulge between two
//! antennas is 2 cm (d² / 8R, R = 8,500 km effective), less than any roof is known.

use super::flat::{in_ring, segments_meet};
use crate::spec::Building;
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vec3;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy, TraversalAction};
use parry3d_f64::query::{Ray, RayCast};
use skein_geometry::frame::Point;

/// A place in the air or on the ground, metres east, north and above the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Metres east and north of the origin.
    pub at: Point,
    /// Metres above the origin.
    pub height_m: f64,
}

/// What is on the ground is seen by so much of it, metres: the middle of a person or a car.
const STANDS_M: f64 = 1.0;

/// Above all buildings, metres.
const SKY_M: f64 = 10_000.0;

impl Place {
    /// Of what is on the ground.
    #[must_use]
    pub fn on_ground(at: Point) -> Self {
        let height_m = STANDS_M;
        Self { at, height_m }
    }

    /// Above all buildings.
    #[must_use]
    pub fn in_the_sky(at: Point) -> Self {
        let height_m = SKY_M;
        Self { at, height_m }
    }

    /// Distance in space, metres.
    #[must_use]
    pub fn distance_m(&self, other: &Self) -> f64 {
        let h = self.height_m - other.height_m;
        ((self.at - other.at).norm_squared() + h * h).sqrt()
    }
}

/// A footprint with a roof.
#[derive(Clone, Debug)]
struct Prism {
    ring: Vec<Point>,
    roof_m: f64,
}

/// All buildings of a world, ready for many questions.
#[derive(Debug)]
pub struct Obstacles {
    /// The highest first.
    prisms: Vec<Prism>,
    tree: Bvh,
}

/// So few buildings are looked at one by one, without the tree.
const FEW: usize = 4;

/// Prisms reach this far below the origin, so that a street lower than the origin
/// does not look through under a house; deeper than any relief within a mission.
const GROUND_M: f64 = -1000.0;

impl Obstacles {
    /// Prepares the buildings.
    #[must_use]
    pub fn new(buildings: &[Building]) -> Self {
        let mut prisms: Vec<Prism> = buildings
            .iter()
            .map(|b| Prism {
                ring: b.footprint.vertices().to_vec(),
                roof_m: b.height_m,
            })
            .collect();
        prisms.sort_by(|a, b| b.roof_m.total_cmp(&a.roof_m));
        let boxes: Vec<Aabb> = prisms.iter().map(Prism::bounds).collect();
        Self {
            tree: Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes),
            prisms,
        }
    }

    /// Number of buildings.
    #[must_use]
    pub fn len(&self) -> usize {
        self.prisms.len()
    }

    /// Whether there is no building at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.prisms.is_empty()
    }

    /// Whether no building stands between two places.
    #[must_use]
    pub fn sees(&self, a: Place, b: Place) -> bool {
        // Flights are above most roofs.
        let lower_m = a.height_m.min(b.height_m);
        let high = self.prisms.iter().take(FEW + 1);
        let high = high.take_while(|p| p.roof_m > lower_m).count();
        if high <= FEW {
            return !self.prisms.iter().take(high).any(|p| p.blocks(a, b));
        }
        let from = Vec3::new(a.at.x, a.at.y, a.height_m);
        let ray = Ray::new(from, Vec3::new(b.at.x, b.at.y, b.height_m) - from);
        let mut blocked = false;
        self.tree.traverse(|node| {
            if !node.aabb().intersects_local_ray(&ray, 1.0) {
                return TraversalAction::Prune;
            }
            let Some(prism) = node.leaf_data().and_then(|i| self.prisms.get(i as usize)) else {
                return TraversalAction::Continue;
            };
            if prism.blocks(a, b) {
                blocked = true;
                return TraversalAction::EarlyExit;
            }
            TraversalAction::Continue
        });
        !blocked
    }
}

impl Prism {
    fn bounds(&self) -> Aabb {
        let b = super::flat::Bounds::around(&self.ring);
        Aabb::new(
            Vec3::new(b.min.x, b.min.y, GROUND_M),
            Vec3::new(b.max.x, b.max.y, self.roof_m.max(GROUND_M)),
        )
    }

    /// Whether the segment passes through the prism: the stretch of it below the roof
    /// meets the footprint.
    fn blocks(&self, a: Place, b: Place) -> bool {
        let Some((from, to)) = stretch_below(a, b, self.roof_m) else {
            return false;
        };
        in_ring(from, &self.ring)
            || super::flat::edges(&self.ring).any(|(c, d)| segments_meet(from, to, c, d))
    }
}

/// The ground track of the part of a segment strictly below a height.
fn stretch_below(a: Place, b: Place, roof_m: f64) -> Option<(Point, Point)> {
    match (a.height_m < roof_m, b.height_m < roof_m) {
        (false, false) => None,
        (true, true) => Some((a.at, b.at)),
        (a_low, _) => {
            let t = (roof_m - a.height_m) / (b.height_m - a.height_m);
            let through = a.at + (b.at - a.at) * t;
            Some(if a_low {
                (a.at, through)
            } else {
                (through, b.at)
            })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::fixture::polygon;
    use skein_link::fate::mix;

    fn place(x: f64, y: f64, height_m: f64) -> Place {
        Place {
            at: Point::new(x, y),
            height_m,
        }
    }

    fn tower() -> Obstacles {
        let footprint = polygon(&[(0, 0), (10_000, 0), (10_000, 10_000), (0, 10_000)]);
        Obstacles::new(&[Building {
            footprint,
            height_m: 20.0,
        }])
    }

    #[test]
    fn a_tower_hides_what_is_behind_and_not_what_is_above() {
        let o = tower();
        assert!(!o.sees(place(-10.0, 5.0, 2.0), place(20.0, 5.0, 2.0)));
        assert!(!o.sees(place(-10.0, 5.0, 19.9), place(20.0, 5.0, 19.9)));
        assert!(o.sees(place(-10.0, 5.0, 20.1), place(20.0, 5.0, 20.1)));
        assert!(o.sees(place(-10.0, 11.0, 2.0), place(20.0, 11.0, 2.0)));
        // From the street over the roof edge: blocked when too flat.
        assert!(!o.sees(place(-10.0, 5.0, 0.0), place(20.0, 5.0, 50.0)));
        assert!(o.sees(place(-10.0, 5.0, 0.0), place(20.0, 5.0, 80.0)));
        // Straight down onto the roof, and straight up beside the wall.
        assert!(o.sees(place(5.0, 5.0, 40.0), place(5.0, 5.0, 20.0)));
        assert!(o.sees(place(-1.0, 5.0, 0.0), place(-1.0, 5.0, 50.0)));
    }

    #[test]
    fn agrees_with_marching_along_the_segment() {
        let mut n = 0u64;
        let mut draw = |span: f64| {
            n += 1;
            #[allow(clippy::cast_precision_loss, reason = "the draw has 53 bits")]
            let unit = (mix(n) >> 11) as f64 / 9_007_199_254_740_992.0;
            unit * span
        };
        let buildings: Vec<Building> = (0..60)
            .map(|_| {
                let (x, y) = (draw(900.0), draw(900.0));
                let (w, h) = (8.0 + draw(40.0), 8.0 + draw(40.0));
                #[allow(clippy::cast_possible_truncation, reason = "below a kilometre")]
                let mm = |v: f64| (v * 1000.0) as i32;
                // An L, so that footprints are not convex.
                let footprint = polygon(&[
                    (mm(x), mm(y)),
                    (mm(x + w), mm(y)),
                    (mm(x + w), mm(y + h)),
                    (mm(x + w / 2.0), mm(y + h)),
                    (mm(x + w / 2.0), mm(y + h / 2.0)),
                    (mm(x), mm(y + h / 2.0)),
                ]);
                Building {
                    footprint,
                    height_m: 5.0 + draw(40.0),
                }
            })
            .collect();
        let o = Obstacles::new(&buildings);
        let (mut blocked, mut unsure) = (0, 0);
        for _ in 0..150 {
            let a = place(draw(900.0), draw(900.0), 30.0 + draw(30.0));
            let b = place(draw(900.0), draw(900.0), draw(30.0));
            let steps = 2000;
            let hit = (0..=steps).any(|i| {
                let t = f64::from(i) / f64::from(steps);
                let q = a.at + (b.at - a.at) * t;
                let z = a.height_m + (b.height_m - a.height_m) * t;
                buildings
                    .iter()
                    .any(|c| z < c.height_m && in_ring(q, c.footprint.vertices()))
            });
            let sees = o.sees(a, b);
            assert!(!(hit && sees), "{a:?} {b:?}");
            assert_eq!(sees, o.sees(b, a));
            blocked += i32::from(hit);
            // Marching in steps of about 40 cm can miss a corner that is cut shorter.
            unsure += i32::from(!hit && !sees);
        }
        assert!(
            (15..135).contains(&blocked) && unsure <= 2,
            "{blocked} {unsure}"
        );
    }
}
