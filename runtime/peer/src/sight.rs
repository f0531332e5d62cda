//! What a camera truly shows of the ground, as far as its UAV knows: its picture, less what
//! buildings that the mission tells stand before.

use skein_behaviors::Percept;
use skein_behaviors::view::View;
use skein_flight::airframe::Airframe;
use skein_flight::tracking::buildings::Town;
use skein_geometry::frame::{Point, Pose};

/// A picture over a town.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight<'a> {
    /// The picture.
    pub view: View,
    airframe: &'a Airframe,
    height_m: f64,
    town: Option<&'a Town>,
}

impl<'a> Sight<'a> {
    /// Of a percept.
    pub fn of(percept: &Percept, airframe: &'a Airframe, town: Option<&'a Town>) -> Self {
        Self {
            view: View::of(percept, airframe),
            airframe,
            height_m: percept.height_m,
            town,
        }
    }

    /// Of somebody else, who is taken to have the same airframe, to fly level and as high.
    pub fn of_other(self, pose: Pose) -> Self {
        Self {
            view: View::level(pose, self.airframe),
            ..self
        }
    }

    /// Whether a place is in so much of half of the picture, each way, and no building before it.
    pub fn shows(&self, at: Point, share: f64) -> bool {
        let hides = |t: &Town| t.buildings.hide(self.view.from(), self.height_m, at);
        self.view.shows(at, share) && !self.town.is_some_and(hides)
    }
}
