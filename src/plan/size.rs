//! How much work an area is, told before it is begun.

use anyhow::{Result, bail, ensure};
use skein_geometry::Polygon;
use skein_survey::area::{Lanes, Planner, Planners};
use skein_survey::team::Uav;

/// The most lane cells that are planned: some seconds of work, and
/// far more waypoints than an autopilot holds.
const MOST_CELLS: f64 = 250_000.0;

/// The most lanes that the exact planner lays across an area's box; its own limit.
const MOST_LANES: f64 = 1_500.0;

/// An area is at least so wide on average, metres: less is a line, or a slip of the pen.
const LEAST_WIDTH_M: f64 = 0.1;

/// What is to be seen, and how.
#[derive(Clone, Copy, Debug)]
pub struct Work<'a> {
    /// The area.
    pub area: &'a Polygon,
    /// The UAVs.
    pub team: &'a [Uav],
    /// The sensor that is asked for.
    pub sensor: Option<&'a str>,
    /// Which lanes are planned.
    pub lanes: Lanes,
    /// Height of the lowest flight, metres.
    pub altitude_m: f64,
}

impl Work<'_> {
    /// Those of the planners for whom this is not too much, and what is worth saying.
    ///
    /// # Errors
    /// When it is too much for all of them; tells the numbers and what helps.
    pub fn planners(&self, asked: Planners) -> Result<(Planners, Option<String>)> {
        let Some(lane_m) = self.lane_m() else {
            // Nobody sees anything: the planner says why.
            return Ok((asked, None));
        };
        let (low, high) = self.area.bounds();
        let across_m = (high - low).norm();
        ensure!(
            self.area.area_m2() >= LEAST_WIDTH_M * across_m.max(1.0),
            "the area has {:.4} m² over {across_m:.1} m: that is no area to be covered (see `skein plan line`, `skein plan visit`)",
            self.area.area_m2()
        );
        let (lanes, cells) = (across_m / lane_m, self.area.area_m2() / (lane_m * lane_m));
        let too_many_passes = lanes > MOST_LANES;
        let too_many_cells = cells > MOST_CELLS;
        let passes_said = format!(
            "some {:.0} lanes across its box, of {MOST_LANES} at most",
            lanes.ceil()
        );
        let cells_said = format!(
            "some {:.0} lane cells, of {MOST_CELLS} at most",
            cells.ceil()
        );
        let least_passes_m = across_m / MOST_LANES;
        let least_cells_m = (self.area.area_m2() / MOST_CELLS).sqrt();
        let refuse = |said: &str, least_m: f64| -> Result<_> {
            bail!(
                "lanes of {lane_m:.2} m over {:.3} km² are {said}: a swath of {:.1} m or more (--swath-m), or a smaller area",
                self.area.area_m2() / 1e6,
                (least_m * 10.0).ceil() / 10.0
            )
        };
        match asked {
            Planners::Only(Planner::Exact) if too_many_passes => {
                refuse(&passes_said, least_passes_m)
            }
            Planners::Only(Planner::Approximate) if too_many_cells => {
                refuse(&cells_said, least_cells_m)
            }
            Planners::Both if too_many_passes && too_many_cells => refuse(
                &format!("{passes_said}, or {cells_said}"),
                least_passes_m.min(least_cells_m),
            ),
            Planners::Both if too_many_passes => Ok((
                Planners::Only(Planner::Approximate),
                Some(format!("straight passes are not planned: {passes_said}")),
            )),
            Planners::Both if too_many_cells => Ok((
                Planners::Only(Planner::Exact),
                Some(format!("lane cells are not planned: {cells_said}")),
            )),
            asked => Ok((asked, None)),
        }
    }

    /// The width of the lanes that make the least work, metres.
    fn lane_m(&self) -> Option<f64> {
        let swaths = self.team.iter();
        let swaths = swaths.filter_map(|uav| uav.swath_m(self.sensor, self.altitude_m));
        let swaths = swaths.filter(|m| m.is_finite() && *m > 0.0);
        match self.lanes {
            Lanes::Common => swaths.min_by(f64::total_cmp),
            Lanes::Sections | Lanes::Best => swaths.max_by(f64::total_cmp),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_geometry::frame::Point;
    use skein_survey::team::Sensor;

    fn planners(side_m: f64, swaths_m: &[f64], asked: Planners, lanes: Lanes) -> Result<Planners> {
        let corners = [(0.0, 0.0), (side_m, 0.0), (side_m, side_m), (0.0, side_m)];
        let area = Polygon::new(corners.map(|(x, y)| Point::new(x, y)).to_vec()).unwrap();
        let team: Vec<Uav> = swaths_m
            .iter()
            .map(|&width_m| Uav::new("a", Point::origin(), 15.0, 30.0, Sensor::Swath { width_m }))
            .collect();
        let work = Work {
            area: &area,
            team: &team,
            sensor: None,
            lanes,
            altitude_m: 60.0,
        };
        work.planners(asked).map(|(planners, _)| planners)
    }

    #[test]
    fn too_much_is_refused_with_the_numbers_and_what_helps() {
        let error = planners(3_000.0, &[0.2], Planners::Both, Lanes::Best).unwrap_err();
        let error = error.to_string();
        for part in [
            "lanes of 0.20 m over 9.000 km²",
            "some 21214 lanes across its box, of 1500 at most",
            "some 225000000 lane cells, of 250000 at most",
            "a swath of 2.9 m or more (--swath-m)",
        ] {
            assert!(error.contains(part), "{error}");
        }
        for planner in [Planner::Exact, Planner::Approximate] {
            let only = Planners::Only(planner);
            assert!(planners(3_000.0, &[0.2], only, Lanes::Best).is_err());
            assert_eq!(planners(3_000.0, &[60.0], only, Lanes::Best).unwrap(), only);
        }
    }

    #[test]
    fn one_planner_is_left_where_the_other_has_too_much() {
        let both =
            |side_m, swath_m: &[f64], lanes| planners(side_m, swath_m, Planners::Both, lanes);
        let exact = Planners::Only(Planner::Exact);
        assert_eq!(both(3_000.0, &[5.0], Lanes::Best).unwrap(), exact);
        let cells = Planners::Only(Planner::Approximate);
        // Narrow and long: many lanes across the box, few cells.
        assert_eq!(both(300.0, &[0.6001], Lanes::Best).unwrap(), Planners::Both);
        assert_eq!(both(300.0, &[0.28], Lanes::Best).ok(), None);
        assert_ne!(both(3_000.0, &[60.0], Lanes::Best).unwrap(), cells);
        // The narrowest counts where lanes are common.
        assert!(both(3_000.0, &[0.2, 60.0], Lanes::Common).is_err());
        assert_eq!(
            both(3_000.0, &[0.2, 60.0], Lanes::Best).unwrap(),
            Planners::Both
        );
    }
}
