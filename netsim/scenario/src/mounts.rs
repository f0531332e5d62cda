//! What a mission may ask of cameras that tilt (D2.7 §1.2.1): which planner, and how much of a
//! picture is sure.

use crate::flight_model::footprint_m;
use crate::read::Stated;
use crate::read::targets::Asked;
use crate::request::AreaPlanner;
use skein_flight::airframe::{Airframe, ROLL_RATE_RADPS};
use skein_flight::mount::{DIRECTION_OFF_RAD, Mount, ROLL_SPARE_RAD};
use skein_flight::trajectory::wind::Wind;
use skein_interop::json::Error;

/// On a straight pass wings and nose are within so much of level, radians: 3° of bank take half a
/// metre beside the pass away within a second, and the nose is up by less.
const LEVEL_RAD: f64 = 0.05;

/// Half the footprint across and along the course that a camera `height_m` above the ground sees
/// for certain, metres, also where it may tilt: what is left when its
/// direction is off by what nobody knows, and if it is fixed to the airframe, by what wings do on
/// a straight pass; there the picture lies ahead by the pitch, and the first of a pass is not seen
/// before the wings are level.
pub(crate) fn held_footprint_m(
    airframe: &Airframe,
    wind: Wind,
    radius_m: f64,
    height_m: f64,
) -> (f64, f64) {
    let (across_m, along_m) = footprint_m(airframe, wind, radius_m);
    let (a, b) = (airframe.footprint_across_m, airframe.footprint_along_m);
    // By so much a corner of the picture moves for each radian, metres.
    let corner_m = height_m + (a * a + b * b) / height_m.max(1.0);
    let told_m = DIRECTION_OFF_RAD * corner_m;
    let (off_m, late_m) = match airframe.mount {
        Mount::Level => return (across_m, along_m),
        Mount::Gimbal(_) => (told_m, 0.0),
        Mount::Fixed => {
            let mps = airframe.cruise_mps + wind.speed_mps();
            let rolls_m = airframe.max_bank_rad / ROLL_RATE_RADPS * mps;
            (told_m + LEVEL_RAD * corner_m, rolls_m)
        }
    };
    (
        (across_m - off_m).max(0.0),
        (along_m - off_m - late_m).max(0.0),
    )
}

/// Lanes are seen in turns, too: a picture that tilts with them is not where the lane is.
pub(crate) fn check_mounts(s: &Stated) -> Result<(), Error> {
    if s.asked != Asked::Area(AreaPlanner::Lanes) {
        return Ok(());
    }
    for m in &s.fleet.members {
        let bank_deg = m.airframe.max_bank_rad.to_degrees();
        let why = match m.airframe.mount {
            Mount::Level => continue,
            Mount::Gimbal(_) if m.airframe.mount.holds_in_turns(m.airframe.max_bank_rad) => {
                continue;
            }
            Mount::Gimbal(g) => format!(
                "a gimbal that rolls {:.0}° cannot hold a picture in turns of {bank_deg:.0}°, for which it takes {:.0}°",
                g.roll_rad.to_degrees(),
                (m.airframe.max_bank_rad + ROLL_SPARE_RAD)
                    .to_degrees()
                    .ceil()
            ),
            Mount::Fixed => "a fixed camera tilts with the turns of lanes".to_owned(),
        };
        return Err(s.places.wrong(
            "fleet",
            format!(
                "UAV {}: {why}; expected planner: \"exact\", whose turns end before what is seen, or another mount",
                m.id
            ),
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Overrides;

    const TRIAL: &str = include_str!("../../../configs/trials/gimbal.json5");
    const GIMBAL: &str = "{ gimbal: { roll_deg: 55, pitch_deg: 35, rate_dps: 120 } }";

    /// Half the footprint of the mission across and along, millimetres.
    fn footprint(mount: &str, planner: AreaPlanner) -> Result<(u32, u32), String> {
        assert!(TRIAL.contains(GIMBAL));
        // Exact passes see what is clear of the zones; views are wide enough for a fixed camera.
        let text = TRIAL
            .replace(GIMBAL, mount)
            .replace("min_coverable: 0.95", "min_coverable: 0.85")
            .replace("spacing_m: 84", "spacing_m: 72")
            .replace("fov_across_deg: 99.2", "fov_across_deg: 104")
            .replace("fov_along_deg: 88.4", "fov_along_deg: 98");
        let over = Overrides {
            planner: Some(planner),
            ..Overrides::default()
        };
        let read = crate::parse_with("gimbal.json5", &text, &crate::builtin::files(), &over);
        let mission = read.map_err(|e| e.to_string())?.spec.mission.clone();
        Ok((mission.footprint_across_mm, mission.footprint_along_mm))
    }

    #[test]
    fn what_tilts_is_sure_of_less_and_lanes_want_it_held() {
        let level = footprint("\"level\"", AreaPlanner::Lanes).unwrap();
        let held = footprint(GIMBAL, AreaPlanner::Lanes).unwrap();
        let fixed = footprint("\"fixed\"", AreaPlanner::Exact).unwrap();
        assert!(held.0 < level.0 && held.1 < level.1 && held.0 + 10_000 > level.0);
        assert!(
            fixed.0 < held.0 && fixed.1 + 5_000 < held.1,
            "{held:?} {fixed:?}"
        );
        let low = GIMBAL.replace("55", "40");
        assert!(footprint(&low, AreaPlanner::Exact).is_ok());
        for (mount, want) in [
            ("\"fixed\"", "a fixed camera tilts with the turns of lanes"),
            (
                low.as_str(),
                "a gimbal that rolls 40° cannot hold a picture in turns of 45°",
            ),
        ] {
            let said = footprint(mount, AreaPlanner::Lanes).unwrap_err();
            assert!(said.contains(want), "{said}");
        }
    }
}
