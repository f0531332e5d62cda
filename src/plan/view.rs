//! How an area is seen: what flags say, else what the file's survey says, else what is
//! usual; and which of them it was.

use super::args::{DISTANCE_M, LENGTH_M, course, within};
use anyhow::{Result, ensure};
use skein_geometry::math::atan2;
use skein_interop::fleet::SWATH_M;
use skein_interop::plan::SurveyGrid;
use skein_survey::team::Sensor;

/// Height of the lowest flight where nobody says so, metres.
pub const ALTITUDE_M: f64 = 60.0;

/// Width that a UAV sees where nobody says so, metres.
pub const USUAL_SWATH_M: f64 = 60.0;

/// What flags say.
#[derive(Clone, Copy, Debug, Default)]
pub struct Flags {
    /// `--altitude-m`.
    pub altitude_m: Option<f64>,
    /// `--swath-m`.
    pub swath_m: Option<f64>,
    /// `--look-ahead-m`.
    pub look_ahead_m: Option<f64>,
    /// `--course-deg`.
    pub course_deg: Option<f64>,
    /// `--trigger-m`.
    pub trigger_m: Option<f64>,
    /// `--run-out-m`.
    pub run_out_m: Option<f64>,
    /// What is told where the survey's course is not used.
    pub no_course: Option<&'static str>,
}

/// How an area is seen.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Height of the lowest flight above home, metres.
    pub altitude_m: f64,
    /// What a UAV sees with that has no camera of its own.
    pub camera: Sensor,
    /// How far it sees before and behind, metres; `None` for half a lane.
    pub look_ahead_m: Option<f64>,
    /// Course of all lanes, degrees clockwise from north.
    pub course_deg: Option<f64>,
    /// Distance between two pictures, metres; `None` for half of what one sees along.
    pub trigger_m: Option<f64>,
    /// How far lanes run out straight before a turn, metres.
    pub run_out_m: f64,
    /// Whether pictures are taken in turns too.
    pub pictures_in_turns: bool,
    /// Where each of these comes from, if there is a survey.
    pub notices: Vec<String>,
}

impl View {
    /// How an area is seen by flags and a survey.
    ///
    /// # Errors
    /// When a flag, or what the survey says instead, is out of range; names it.
    pub fn of(flags: Flags, survey: Option<&SurveyGrid>) -> Result<Self> {
        let nothing = SurveyGrid::default();
        let grid = survey.unwrap_or(&nothing);
        let mut notices = Vec::new();
        let mut choose =
            |flag: Option<f64>, own: Option<f64>, name: &str, field: &str, unit: &str| {
                match (flag, own) {
                    (Some(flag), Some(own)) => notices.push(format!(
                        "{name} {flag}{unit} instead of the survey's {own}{unit} ({field})"
                    )),
                    (None, Some(own)) => notices.push(format!(
                        "of the survey: {field} {own}{unit}; {name} overrides it"
                    )),
                    _ => {}
                }
                flag.or(own)
            };
        let altitude = choose(
            flags.altitude_m,
            grid.height_m,
            "--altitude-m",
            "DistanceToSurface",
            " m",
        );
        let swath = choose(
            flags.swath_m,
            grid.lane_m,
            "--swath-m",
            "AdjustedFootprintSide",
            " m",
        );
        let survey_deg = grid.course_deg.filter(|_| flags.no_course.is_none());
        let course_deg = choose(flags.course_deg, survey_deg, "--course-deg", "angle", "°");
        let trigger_m = choose(
            flags.trigger_m,
            grid.trigger_m,
            "--trigger-m",
            "AdjustedFootprintFrontal",
            " m",
        );
        let run_out_m = choose(
            flags.run_out_m,
            grid.turn_around_m,
            "--run-out-m",
            "TurnAroundDistance",
            " m",
        );
        let run_out_m = within("--run-out-m", run_out_m.unwrap_or(0.0), DISTANCE_M, "m")?;
        if let Some(course_deg) = flags.course_deg.or(grid.course_deg) {
            course("--course-deg", course_deg)?;
        }
        let altitude_m = altitude.unwrap_or(ALTITUDE_M);
        let swath_m = within("--swath-m", swath.unwrap_or(USUAL_SWATH_M), SWATH_M, "m")?;
        // A picture stands for what lies nearer to it than to the next one.
        let look_ahead_m = flags
            .look_ahead_m
            .or(grid.trigger_m.map(|trigger_m| trigger_m / 2.0));
        if let Some(look_ahead_m) = look_ahead_m {
            within("--look-ahead-m", look_ahead_m, DISTANCE_M, "m")?;
        }
        if let Some(trigger_m) = trigger_m {
            within("--trigger-m", trigger_m, LENGTH_M, "m")?;
        }
        // A lens sees as wide as it is high above the ground, so the lane grows with the
        // height; of a footprint that was typed in nobody knows.
        let lens = (flags.swath_m, grid.lane_m, grid.height_m);
        let camera = match lens {
            (None, Some(lane_m), Some(height_m)) if grid.lens_known => {
                ensure!(
                    altitude_m > 0.0,
                    "--altitude-m must be above 0 for the survey's camera, found {altitude_m}"
                );
                let across_deg = 2.0 * atan2(lane_m / 2.0, height_m).to_degrees();
                Sensor::FieldOfView { across_deg }
            }
            _ => Sensor::Swath { width_m: swath_m },
        };
        if grid.pictures_in_turns {
            let text = "of the survey: pictures are taken in turns too (CameraTriggerInTurnAround); what they see does not count";
            notices.push(text.to_owned());
        }
        if survey.is_some() {
            notices.extend(told(grid));
        }
        if grid.course_deg.is_some() {
            notices.extend(flags.no_course.map(str::to_owned));
        }
        Ok(Self {
            altitude_m,
            camera,
            look_ahead_m,
            course_deg,
            trigger_m,
            run_out_m,
            pictures_in_turns: grid.pictures_in_turns,
            notices,
        })
    }
}

/// What of the camera decides nothing of its own.
fn told(grid: &SurveyGrid) -> Option<String> {
    let camera = grid.camera.as_ref()?;
    let mut text = format!("of the survey: camera {camera:?}");
    for (name, percent) in [
        ("SideOverlap", grid.side_overlap_percent),
        ("FrontalOverlap", grid.frontal_overlap_percent),
    ] {
        if let Some(percent) = percent {
            text += &format!(", {name} {percent} %");
        }
    }
    if grid.lens_known {
        text += ": lanes are as wide as it sees from the height that is flown";
    }
    Some(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn survey() -> SurveyGrid {
        SurveyGrid {
            course_deg: Some(30.0),
            height_m: Some(80.0),
            lane_m: Some(40.0),
            trigger_m: Some(20.0),
            side_overlap_percent: Some(70.0),
            frontal_overlap_percent: Some(75.0),
            turn_around_m: Some(25.0),
            pictures_in_turns: true,
            refly: false,
            camera: Some("Sony".to_owned()),
            lens_known: false,
        }
    }

    #[test]
    fn a_survey_is_honoured_unless_flags_say_otherwise() {
        let view = View::of(Flags::default(), Some(&survey())).unwrap();
        assert_eq!(view.camera, Sensor::Swath { width_m: 40.0 });
        assert_eq!((view.altitude_m, view.course_deg), (80.0, Some(30.0)));
        assert!((view.run_out_m - 25.0).abs() < 1e-9 && view.pictures_in_turns);
        assert_eq!(
            (view.look_ahead_m, view.trigger_m),
            (Some(10.0), Some(20.0))
        );
        let told = view.notices.join("\n");
        for part in [
            "DistanceToSurface 80 m; --altitude-m overrides it",
            "AdjustedFootprintSide 40 m",
            "AdjustedFootprintFrontal 20 m",
            "angle 30°",
            "TurnAroundDistance 25 m; --run-out-m overrides it",
            "pictures are taken in turns too",
            "camera \"Sony\", SideOverlap 70 %, FrontalOverlap 75 %",
        ] {
            assert!(told.contains(part), "{told}");
        }
        let flags = Flags {
            altitude_m: Some(100.0),
            swath_m: Some(55.0),
            look_ahead_m: Some(5.0),
            course_deg: Some(-90.0),
            trigger_m: Some(8.0),
            run_out_m: Some(0.0),
            no_course: None,
        };
        let view = View::of(flags, Some(&survey())).unwrap();
        assert_eq!(view.camera, Sensor::Swath { width_m: 55.0 });
        assert_eq!((view.altitude_m, view.course_deg), (100.0, Some(-90.0)));
        assert!(view.run_out_m.abs() < 1e-9);
        assert_eq!((view.look_ahead_m, view.trigger_m), (Some(5.0), Some(8.0)));
        let told = view.notices.join("\n");
        assert!(
            told.contains("--altitude-m 100 m instead of the survey's 80 m (DistanceToSurface)")
        );
        assert!(told.contains("--swath-m 55 m instead of the survey's 40 m"));
    }

    #[test]
    fn a_lens_sees_wider_from_higher() {
        let grid = SurveyGrid {
            lens_known: true,
            ..survey()
        };
        let flags = Flags {
            altitude_m: Some(100.0),
            ..Flags::default()
        };
        let view = View::of(flags, Some(&grid)).unwrap();
        assert!((view.camera.across_m(80.0) - 40.0).abs() < 1e-9);
        assert!((view.camera.across_m(100.0) - 50.0).abs() < 1e-9);
        let flags = Flags {
            altitude_m: Some(-1.0),
            ..Flags::default()
        };
        assert!(View::of(flags, Some(&grid)).is_err());
    }

    #[test]
    fn without_a_survey_the_usual_is_flown_and_nothing_told() {
        let view = View::of(Flags::default(), None).unwrap();
        assert_eq!(view.camera, Sensor::Swath { width_m: 60.0 });
        assert!((view.altitude_m - 60.0).abs() < 1e-9);
        assert_eq!((view.look_ahead_m, view.trigger_m), (None, None));
        assert!(view.notices.is_empty());
        for (flags, says) in [
            (
                Flags {
                    course_deg: Some(400.0),
                    ..Flags::default()
                },
                "--course-deg must be from -180 up to 360 degrees, found 400",
            ),
            (
                Flags {
                    course_deg: Some(f64::NAN),
                    ..Flags::default()
                },
                "--course-deg",
            ),
            (
                Flags {
                    swath_m: Some(0.0),
                    ..Flags::default()
                },
                "--swath-m must be between 0.1 and 10000 m, found 0",
            ),
            (
                Flags {
                    look_ahead_m: Some(-1.0),
                    ..Flags::default()
                },
                "--look-ahead-m must be",
            ),
            (
                Flags {
                    trigger_m: Some(f64::INFINITY),
                    ..Flags::default()
                },
                "--trigger-m must be",
            ),
        ] {
            let error = View::of(flags, None).unwrap_err().to_string();
            assert!(error.contains(says), "{error}");
        }
    }
}
