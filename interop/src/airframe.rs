//! Airframes as people write them, in a scenario and in the configuration of a peer: one
//! reader, one set of limits, and the writer whose text the reader gives back unchanged.
//!
//! Files state bank in degrees and the footprint as whole sides; inside it is radians and
//! half sides ([`Airframe`]).

use crate::json::{Error, Fields, Node};
use crate::mount;
use skein_flight::airframe::{Airframe, CLIMB_MPS};
use skein_flight::mount::Mount;
use skein_flight::trajectory::timed::Objective;
use skein_geometry::math::tan;

/// Airspeeds that are accepted, m/s: from a kite to the fastest small jet.
pub const SPEED_MPS: (f64, f64) = (1.0, 150.0);

/// Rates of climb that are accepted, m/s.
pub const CLIMBS_MPS: (f64, f64) = (0.2, 50.0);

/// Largest bank angles that are accepted, degrees.
pub const BANK_DEG: (f64, f64) = (1.0, 80.0);

/// Endurances that are accepted, seconds: up to a week.
pub const ENDURANCE_S: (f64, f64) = (1.0, 604_800.0);

/// Sides of a footprint that are accepted, whole, metres.
pub const FOOTPRINT_M: (f64, f64) = (1.0, 10_000.0);

/// Fields of view that are accepted, whole, degrees: beyond, the edge of the picture
/// nears the horizon.
pub const FIELD_OF_VIEW_DEG: (f64, f64) = (1.0, 160.0);

/// The fields of an airframe.
const FIELDS: &[&str] = &[
    "stall_mps",
    "cruise_mps",
    "max_mps",
    "bank_deg",
    "climb_mps",
    "endurance_s",
    "reserve_s",
    "camera",
    "footprint",
];

/// The fields of a camera: angles of view, and how it is held.
const CAMERA: &[&str] = &["fov_across_deg", "fov_along_deg", "mount"];

/// Reads an airframe. Its camera is stated by its footprint, or by its angles where the
/// height is known from which it looks.
///
/// # Errors
/// [`Error`] names the value that is out of its limits, or does not fit the others.
pub fn read(node: &Node<'_>, level_m: Option<f64>) -> Result<Airframe, Error> {
    let f = node.fields(FIELDS)?;
    let speed = |name, example| {
        f.need(name, example)?
            .number(SPEED_MPS.0, SPEED_MPS.1, "m/s")
    };
    let (stall_mps, cruise_mps, max_mps) = (
        speed("stall_mps", "9")?,
        speed("cruise_mps", "14")?,
        speed("max_mps", "18")?,
    );
    if stall_mps >= cruise_mps {
        return Err(f.need("cruise_mps", "14")?.wrong(format!(
            "{cruise_mps} m/s is not above the stall speed of {stall_mps} m/s: it would fall"
        )));
    }
    if cruise_mps > max_mps {
        return Err(f.need("max_mps", "18")?.wrong(format!(
            "{max_mps} m/s is below the cruise speed of {cruise_mps} m/s"
        )));
    }
    let endurance_s =
        f.need("endurance_s", "5400")?
            .number(ENDURANCE_S.0, ENDURANCE_S.1, "seconds")?;
    let reserve_s = f.number_or("reserve_s", 0.0, 0.0, ENDURANCE_S.1, "seconds")?;
    if reserve_s >= endurance_s {
        let at = f.get("reserve_s").unwrap_or(node);
        return Err(at.wrong(format!(
            "a reserve of {reserve_s} s leaves nothing of an endurance of {endurance_s} s"
        )));
    }
    let (across_m, along_m) = footprint(&f, level_m)?;
    let camera = f.get("camera").map(|c| c.fields(CAMERA)).transpose()?;
    let mount = camera.as_ref().and_then(|c| c.get("mount"));
    Ok(Airframe {
        stall_mps,
        cruise_mps,
        max_mps,
        max_bank_rad: f
            .need("bank_deg", "45")?
            .number(BANK_DEG.0, BANK_DEG.1, "degrees")?
            .to_radians(),
        endurance_s,
        reserve_s,
        footprint_across_m: across_m,
        footprint_along_m: along_m,
        mount: mount.map_or(Ok(Mount::Level), mount::read)?,
        climb_mps: f.number_or("climb_mps", CLIMB_MPS, CLIMBS_MPS.0, CLIMBS_MPS.1, "m/s")?,
    })
}

/// Half the footprint, across and along the track.
fn footprint(f: &Fields<'_>, level_m: Option<f64>) -> Result<(f64, f64), Error> {
    let example = "{ across_m: 60, along_m: 50 }";
    let views = |camera: &&Node<'_>| -> Result<bool, Error> {
        let g = camera.fields(CAMERA)?;
        Ok(CAMERA[..2].iter().any(|name| g.get(name).is_some()))
    };
    if let Some(camera) = f.get("camera")
        && views(&camera)?
    {
        if let Some(node) = f.get("footprint") {
            return Err(node.wrong("give either the camera or its footprint, not both"));
        }
        if level_m.is_none() {
            return Err(camera.wrong(format!(
                "how high it looks from is not stated here; give its footprint instead: {example}"
            )));
        }
    }
    match (f.get("footprint"), level_m) {
        (None, Some(level_m)) => {
            let example = "{ fov_across_deg: 100, fov_along_deg: 80 }";
            seen_from(level_m, f.need("camera", example)?)
        }
        _ => {
            let g = f
                .need("footprint", example)?
                .fields(&["across_m", "along_m"])?;
            let (low_m, high_m) = FOOTPRINT_M;
            let side = |name| {
                g.need(name, "100")?
                    .number(low_m, high_m, "metres, the whole side")
            };
            Ok((side("across_m")? / 2.0, side("along_m")? / 2.0))
        }
    }
}

/// Half the footprint of a camera that looks down from a height.
fn seen_from(level_m: f64, camera: &Node<'_>) -> Result<(f64, f64), Error> {
    let g = camera.fields(CAMERA)?;
    let half = |name| -> Result<f64, Error> {
        let at = g.need(name, "90")?;
        let (low_deg, high_deg) = FIELD_OF_VIEW_DEG;
        let fov_deg = at.number(low_deg, high_deg, "degrees, the whole angle")?;
        let half_m = level_m * tan(fov_deg.to_radians() / 2.0);
        let (low_m, high_m) = FOOTPRINT_M;
        if !(low_m..=high_m).contains(&(2.0 * half_m)) {
            return Err(at.wrong(format!(
                "{fov_deg}° see {:.1} m of the ground from {level_m} m; expected between {low_m} and {high_m} m",
                2.0 * half_m
            )));
        }
        Ok(half_m)
    };
    Ok((half("fov_across_deg")?, half("fov_along_deg")?))
}

/// The airframe as [`read`] takes it; what is read back is the same to the last bit.
#[must_use]
pub fn to_json(a: &Airframe) -> serde_json::Value {
    let mut json = serde_json::json!({
        "stall_mps": a.stall_mps,
        "cruise_mps": a.cruise_mps,
        "max_mps": a.max_mps,
        "bank_deg": degrees(a.max_bank_rad),
        "endurance_s": a.endurance_s,
        "reserve_s": a.reserve_s,
        "footprint": {
            "across_m": 2.0 * a.footprint_across_m,
            "along_m": 2.0 * a.footprint_along_m,
        },
    });
    if a.climb_mps.to_bits() != CLIMB_MPS.to_bits() {
        json["climb_mps"] = a.climb_mps.into();
    }
    if !a.mount.is_level() {
        json["camera"] = serde_json::json!({ "mount": mount::to_json(&a.mount) });
    }
    json
}

/// The degrees that become exactly these radians again, where there are any: whoever
/// wrote 80 gets 80 back, and not the next number above it.
pub(crate) fn degrees(rad: f64) -> f64 {
    let deg = rad.to_degrees();
    let rounded = format!("{deg:.9}").parse().unwrap_or(deg);
    let same = |d: f64| d.to_radians().to_bits() == rad.to_bits();
    [rounded, deg, deg.next_down(), deg.next_up()]
        .into_iter()
        .find(|d| same(*d))
        .unwrap_or(deg)
}

/// Reads what flights off the loop should spend little of.
///
/// # Errors
/// [`Error`] when it is none of them.
pub fn objective(node: &Node<'_>) -> Result<Objective, Error> {
    node.one_of(&[
        ("time", Objective::Time),
        ("distance", Objective::Distance),
        ("energy", Objective::Energy),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::json::Document;
    use skein_flight::mount::Gimbal;

    fn parse(text: &str, level_m: Option<f64>) -> Result<Airframe, Error> {
        read(&Document::parse("airframe", "a", text)?.root(), level_m)
    }

    #[test]
    fn what_is_written_is_read_back_to_the_last_bit_at_all_limits() {
        for bank_deg in [BANK_DEG.0, 33.3, 45.0, 78.0, BANK_DEG.1] {
            for (slow_mps, fast_mps) in [(1.0, 1.0 + 1e-9), (9.1, 14.3), (149.9, 150.0)] {
                for side_m in [FOOTPRINT_M.0, 87.7, FOOTPRINT_M.1] {
                    for endurance_s in [ENDURANCE_S.0, 5400.0, ENDURANCE_S.1] {
                        let text = format!(
                            "{{ stall_mps: {slow_mps}, cruise_mps: {fast_mps}, max_mps: {fast_mps}, bank_deg: {bank_deg},
                                endurance_s: {endurance_s}, reserve_s: {}, footprint: {{ across_m: {side_m}, along_m: {side_m} }} }}",
                            endurance_s / 3.0
                        );
                        let airframe = parse(&text, None).unwrap();
                        let again = parse(&to_json(&airframe).to_string(), None);
                        assert_eq!(again.unwrap(), airframe, "{text}");
                    }
                }
            }
        }
        for i in 0..=7900 {
            let rad = (1.0 + f64::from(i) * 0.01).to_radians();
            assert_eq!(degrees(rad).to_radians().to_bits(), rad.to_bits());
        }
    }

    #[test]
    fn a_camera_is_a_footprint_from_a_height() {
        let text = "{ stall_mps: 9, cruise_mps: 14, max_mps: 18, bank_deg: 45, endurance_s: 900,
            camera: { fov_across_deg: 90, fov_along_deg: 60 } }";
        let from = |level_m| parse(text, level_m).map_err(|e| e.to_string());
        let a = from(Some(45.0)).unwrap();
        assert!((a.footprint_across_m - 45.0).abs() < 1e-9 && a.footprint_along_m < 26.0);
        assert_eq!(parse(&to_json(&a).to_string(), None).unwrap(), a);
        for (level_m, want) in [
            (None, "a:2:21: camera: how high it looks from"),
            (Some(0.1), "camera.fov_across_deg: 90° see 0.2 m"),
            (Some(5001.0), "camera.fov_across_deg: 90° see 10002.0 m"),
        ] {
            let said = from(level_m).unwrap_err();
            assert!(said.contains(want), "{said}");
        }
        for (mount, want) in [
            ("\"level\"", Mount::Level),
            ("\"fixed\"", Mount::Fixed),
            (
                "{ gimbal: { roll_deg: 55, pitch_deg: 40.1, rate_dps: 120 } }",
                Mount::Gimbal(Gimbal {
                    roll_rad: 55.0_f64.to_radians(),
                    pitch_rad: 40.1_f64.to_radians(),
                    rate_radps: 120.0_f64.to_radians(),
                }),
            ),
        ] {
            let held = text.replace("60 }", &format!("60, mount: {mount} }}"));
            let a = parse(&held, Some(45.0)).unwrap();
            assert_eq!(a.mount, want);
            // A peer's own file states the footprint beside the mount.
            assert_eq!(parse(&to_json(&a).to_string(), None).unwrap(), a);
        }
        for (mount, want) in [
            ("\"fixd\"", "camera.mount"),
            (
                "{ gimbal: { roll_deg: 95, pitch_deg: 4, rate_dps: 9 } }",
                "roll_deg: 95",
            ),
            (
                "{ gimbal: { roll_deg: 5, rate_dps: 9 } }",
                "pitch_deg is missing",
            ),
        ] {
            let held = text.replace("60 }", &format!("60, mount: {mount} }}"));
            let said = parse(&held, Some(45.0)).unwrap_err().to_string();
            assert!(said.contains(want), "{said}");
        }
        let nothing = "{ stall_mps: 9, cruise_mps: 14, max_mps: 18, endurance_s: 900 }";
        let said = parse(nothing, None).unwrap_err().to_string();
        assert!(said.contains("the field footprint is missing"), "{said}");
        let said = parse(nothing, Some(45.0)).unwrap_err().to_string();
        assert!(said.contains("the field camera is missing"), "{said}");
    }
}
