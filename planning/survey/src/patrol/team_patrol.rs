//! Points, lines or an area seen again and again by a team: one closed tour planned as if
//! for one UAV, and the team spaced on it (D2.7 §3.6.6).
//!
//! Leaves the tour to `team_tour`, who flies where on it to `watch`, and what spacing is best
//! to [`crate::patrol`].

use super::team_tour::{over_area, over_targets};
use super::watch::Watch;
use super::{Pattern, TourError};
use crate::area::{AreaError, Planner, Planners};
use crate::detours::DetourError;
use crate::flight::Leg;
use crate::flown::{Air, AirspaceError};
use crate::team::{self, TeamError, Uav};
use crate::tours::{Targets, ToursError};
use skein_flight::coverage::metric::TooWindy;
use skein_geometry::frame::{Point, Vector};
use skein_geometry::offset::Zone;
use skein_geometry::{NoFlyZones, Polygon};
use std::sync::Arc;
use thiserror::Error;

/// What is patrolled.
#[derive(Clone, Debug)]
pub enum Over {
    /// Points or lines.
    Targets {
        /// What is to be seen.
        targets: Targets,
        /// Where nobody may fly.
        zones: Vec<Zone>,
    },
    /// An area.
    Area {
        /// The area.
        area: Polygon,
        /// Parts of it that need not be seen; they may be flown over.
        holes: Vec<Polygon>,
        /// Where nobody may fly.
        zones: Arc<NoFlyZones>,
        /// What must be stayed within, with the clearance: inside each of them.
        fences: Vec<Polygon>,
        /// Which planners are asked.
        planners: Planners,
    },
}

/// What is to be seen again and again, and by whom.
#[derive(Clone, Debug)]
pub struct PatrolRequest {
    /// What is patrolled.
    pub over: Over,
    /// The UAVs. All fly one tour, with lanes for the narrowest swath and the widest turn.
    pub team: Vec<Uav>,
    /// Distance kept from every zone, metres.
    pub clearance_m: f64,
    /// The wind, where it blows to, m/s. In a wind all UAVs fly at one airspeed.
    pub wind_mps: Vector,
    /// Height of all flights above home, metres.
    pub altitude_m: f64,
    /// Steps of improvement; the same steps give the same plan everywhere.
    pub steps: usize,
    /// Who fails, if that is asked.
    pub losses: Option<Losses>,
}

impl PatrolRequest {
    pub(super) fn air(&self, airspeed_mps: f64) -> Air {
        Air {
            airspeed_mps,
            wind_mps: self.wind_mps,
        }
    }
}

/// UAVs that fail.
#[derive(Clone, Debug, PartialEq)]
pub struct Losses {
    /// What they are called.
    pub names: Vec<String>,
    /// When they fail, seconds after a moment in which all are at their stations.
    pub after_s: f64,
}

/// What the tour of a patrol leads over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TourKind {
    /// Points.
    Points,
    /// Lines.
    Lines,
    /// An area, as this planner has it.
    Area(Planner),
}

/// A patrol of a team.
#[derive(Clone, Debug, PartialEq)]
pub struct PatrolPlan {
    /// What the tour leads over.
    pub over: TourKind,
    /// Length of the tour as it is flown, metres; in a wind through the air.
    pub tour_m: f64,
    /// Who flies where on the tour.
    pub pattern: Pattern,
    /// The longest time between two visits of a place, seconds.
    pub revisit_s: f64,
    /// No patrol of this team revisits sooner, seconds.
    pub revisit_bound_s: f64,
    /// When all are at their stations, seconds.
    pub steady_s: f64,
    /// By UAV of the request.
    pub uavs: Vec<PatrolFlight>,
    /// How the others go on, where losses are asked.
    pub after_losses: Option<AfterLosses>,
    /// What is worth saying: who rests, what was left out.
    pub notices: Vec<String>,
}

impl PatrolPlan {
    /// How many UAVs fly.
    #[must_use]
    pub fn uavs_flying(&self) -> usize {
        self.uavs.iter().filter(|u| u.station.is_some()).count()
    }
}

/// One UAV of a patrol: its first period.
#[derive(Clone, Debug, PartialEq)]
pub struct PatrolFlight {
    /// What the UAV is called.
    pub name: String,
    /// What it flies: the way to its station, once round or to and fro, and home; empty if
    /// it rests.
    pub legs: Vec<Leg>,
    /// Points along that; its start alone if it rests.
    pub path: Vec<Point>,
    /// Height above home, metres.
    pub altitude_m: f64,
    /// Airspeed, m/s: round the tour the common one of all.
    pub speed_mps: f64,
    /// The tightest turn of the tour, metres.
    pub turn_radius_m: f64,
    /// Length over the ground, metres.
    pub length_m: f64,
    /// Its station; none if it rests.
    pub station: Option<PatrolStation>,
}

/// Where a UAV takes part in a patrol.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatrolStation {
    /// Its place on the tour, metres from the first corner.
    pub place_m: f64,
    /// The same as a share of the tour.
    pub phase: f64,
    /// What the way there takes, seconds.
    pub way_s: f64,
    /// How long it waits there for the last one, seconds.
    pub wait_s: f64,
    /// Once round, or to and fro on its arc, seconds.
    pub period_s: f64,
    /// What is flown at first takes so long: one period with the ways there and back,
    /// seconds.
    pub time_s: f64,
    /// Length of its arc, metres, if it flies to and fro.
    pub arc_m: Option<f64>,
}

/// How a patrol goes on without some of its UAVs.
#[derive(Clone, Debug, PartialEq)]
pub struct AfterLosses {
    /// What the lost ones are called.
    pub lost: Vec<String>,
    /// Who flies where on the tour from then on.
    pub pattern: Pattern,
    /// The longest time between two visits of a place from then on, seconds.
    pub revisit_s: f64,
    /// No patrol of those who are left revisits sooner, seconds.
    pub revisit_bound_s: f64,
    /// When all are where they are to be, seconds after the failure.
    pub steady_s: f64,
    /// The longest time that a place waits meanwhile, seconds.
    pub gap_s: f64,
    /// What those who are left and fly do.
    pub uavs: Vec<GoesOn>,
}

/// What a UAV does after a loss.
#[derive(Clone, Debug, PartialEq)]
pub struct GoesOn {
    /// What it is called.
    pub name: String,
    /// Where it takes part from then on, metres from the tour's first corner.
    pub place_m: f64,
    /// The same in the plane.
    pub at: Point,
    /// Whether it rested before.
    pub joins: bool,
    /// What it flies there: onto the tour if it rested, back where it is if it must, and
    /// along the tour to its arc; empty where it has only to wait.
    pub legs: Vec<Leg>,
    /// How long it flies there, seconds.
    pub way_s: f64,
    /// How long it loiters, seconds.
    pub loiter_s: f64,
    /// Once round, or to and fro on its arc, seconds.
    pub period_s: f64,
    /// Where its arc begins on the tour and how long it is, metres, if it flies to and fro.
    pub arc_m: Option<(f64, f64)>,
}

/// Why there is no patrol. Nothing was planned.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PatrolError {
    /// The team cannot be planned for.
    #[error(transparent)]
    Team(#[from] TeamError),
    /// There is no tour over the area.
    #[error(transparent)]
    Area(#[from] AreaError),
    /// There is no tour over the targets.
    #[error(transparent)]
    Targets(#[from] ToursError),
    /// There are no ways round the zones.
    #[error(transparent)]
    Zones(#[from] DetourError),
    /// A zone is no polygon, or a fence cannot be stayed within.
    #[error(transparent)]
    Fences(#[from] AirspaceError),
    /// No curve joins what is to be seen.
    #[error("nothing of it can be flown round and round with a turn radius of {radius_m} m")]
    NoRound {
        /// The widest turn of the team, metres.
        radius_m: f64,
    },
    /// Round the tour nobody has the endurance, and on arcs there is no room to turn.
    #[error(
        "nobody has the endurance for once round, and to and fro there is no room to turn at the ends of all arcs"
    )]
    NoTurn,
    /// Nothing is to be seen.
    #[error("there is nothing to patrol")]
    Nothing,
    /// The tour is too short or too long.
    #[error(transparent)]
    Tour(#[from] TourError),
    /// A UAV starts in a zone; it is named.
    #[error("the launch point of {0} lies in a zone or nearer to one than the clearance")]
    LaunchInZone(String),
    /// UAVs of unlike speeds in a wind.
    #[error("in a wind, UAVs of unlike speeds cannot be planned together")]
    UnlikeInWind,
    /// The wind is as fast as the UAVs.
    #[error(transparent)]
    TooWindy(#[from] TooWindy),
    /// Zones lie all round a UAV, which is named.
    #[error("{0} has no way from its start to the tour")]
    NoWay(String),
    /// No UAV has the endurance for one period.
    #[error(
        "nobody can fly this patrol: once round takes {round_s:.0} s, to and fro on an arc {arc_s:.0} s, and the longest endurance leaves {longest_s:.0} s besides the ways there and back"
    )]
    Nobody {
        /// The fastest UAV once round, seconds.
        round_s: f64,
        /// To and fro on an arc of all, seconds.
        arc_s: f64,
        /// What the longest endurance leaves, seconds.
        longest_s: f64,
    },
    /// A UAV that is to fail is none of the team.
    #[error("no UAV is called {0:?}")]
    Unknown(String),
    /// The time of the losses is no time.
    #[error("the losses come after a time from 0, found {0} s")]
    LossTime(f64),
    /// The losses leave nobody.
    #[error("nobody is left who can fly one period")]
    NobodyLeft,
}

/// Plans.
///
/// One closed tour is planned as if for one UAV. Equal UAVs fly round, evenly spaced. Of
/// unequal ones either each flies to and fro on an arc, all in the same time, or the
/// fastest few fly round at the speed of the slowest of them, whichever revisits sooner.
///
/// # Guarantees
/// As [`crate::patrol::patrol_within`], for the tour that was found. What is flown at first, the tour and
/// the ways there and back, are lines and arcs of the widest turn of the team that join
/// without a bend and keep the clearance. After losses the turns at the ends of new arcs are
/// flown ones too, and so is the way there: who joins flies onto the tour, and who must turns
/// back where it is. Loitering takes any time. The same request gives the same plan everywhere.
///
/// # Errors
/// [`PatrolError`] when a figure has no meaning, there is no tour, or nobody can fly one
/// period.
pub fn plan(request: &PatrolRequest) -> Result<PatrolPlan, PatrolError> {
    team::check_places(&request.team)?;
    if let Some(losses) = &request.losses
        && !(losses.after_s.is_finite() && losses.after_s >= 0.0)
    {
        return Err(PatrolError::LossTime(losses.after_s));
    }
    let course = match &request.over {
        Over::Targets { targets, zones } => over_targets(request, targets, zones)?,
        Over::Area { .. } => over_area(request)?,
    };
    let watch = Watch::new(request, course)?;
    watch.plan()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::team::Sensor;
    use crate::tours::{LineTarget, PointTarget};

    const SQUARE: [(f64, f64); 4] = [(0.0, 0.0), (1500.0, 0.0), (1500.0, 1100.0), (0.0, 1100.0)];

    fn points() -> Over {
        let point = |(i, (x, y)): (usize, (f64, f64))| PointTarget {
            name: i.to_string(),
            at: Point::new(x, y),
            radius_m: 0.0,
            sensor: None,
        };
        Over::Targets {
            targets: Targets::Points(SQUARE.into_iter().enumerate().map(point).collect()),
            zones: Vec::new(),
        }
    }

    fn lines() -> Over {
        let way = SQUARE[..3].iter().map(|&(x, y)| Point::new(x, y));
        let line = LineTarget {
            name: "road".to_owned(),
            way: way.collect(),
            width_m: 0.0,
            sensor: Some("rgb".to_owned()),
        };
        Over::Targets {
            targets: Targets::Lines(vec![line]),
            zones: Vec::new(),
        }
    }

    fn area(planner: Planner) -> Over {
        let polygon = |corners: &[(f64, f64)]| {
            let points = corners.iter().map(|&(x, y)| Point::new(x / 2.0, y / 2.0));
            Polygon::new(points.collect()).unwrap()
        };
        let zone = polygon(&[(700.0, 500.0), (900.0, 500.0), (800.0, 700.0)]);
        Over::Area {
            area: polygon(&SQUARE),
            holes: Vec::new(),
            zones: Arc::new(NoFlyZones::new(vec![zone])),
            fences: Vec::new(),
            planners: Planners::Only(planner),
        }
    }

    fn team(speeds_mps: &[f64]) -> Vec<Uav> {
        let camera = Sensor::Swath { width_m: 60.0 };
        let uav = |(i, v): (usize, &f64)| {
            let mut uav = Uav::new(format!("uav-{}", i + 1), Point::origin(), *v, 20.0, camera);
            uav.sensors.insert("rgb".to_owned(), camera);
            uav
        };
        speeds_mps.iter().enumerate().map(uav).collect()
    }

    fn request(over: Over, speeds_mps: &[f64]) -> PatrolRequest {
        PatrolRequest {
            over,
            team: team(speeds_mps),
            clearance_m: 10.0,
            wind_mps: Vector::zeros(),
            altitude_m: 60.0,
            steps: 2_000,
            losses: None,
        }
    }

    fn losses(names: &[&str], after_s: f64) -> Option<Losses> {
        Some(Losses {
            names: names.iter().map(|n| (*n).to_owned()).collect(),
            after_s,
        })
    }

    #[test]
    fn equal_uavs_are_spaced_evenly_over_any_tour() {
        let windy = PatrolRequest {
            wind_mps: Vector::new(-3.0, -5.0),
            ..request(points(), &[15.0; 3])
        };
        let calm = [
            points(),
            lines(),
            area(Planner::Exact),
            area(Planner::Approximate),
        ];
        let calm = calm.map(|over| request(over, &[15.0; 3]));
        for asked in calm.into_iter().chain([windy]) {
            let found = plan(&asked).unwrap();
            assert!(matches!(found.pattern, Pattern::Round { .. }));
            let ratio = found.revisit_s / found.revisit_bound_s;
            assert!((ratio - 1.0).abs() < 1e-4, "{:?}: {ratio}", found.over);
            let stations: Vec<PatrolStation> =
                found.uavs.iter().map(|u| u.station.unwrap()).collect();
            let third_m = found.tour_m / 3.0;
            let apart_m = (stations[1].place_m - stations[0].place_m).rem_euclid(third_m);
            assert!(apart_m.min(third_m - apart_m) < 0.01, "{:?}", found.over);
            let waits = stations.iter().map(|s| s.wait_s);
            assert!(waits.fold(f64::INFINITY, f64::min).abs() < 1e-9);
            // A station is a place to be: the flight ends where it began.
            let path = &found.uavs[0].path;
            assert!((path[0] - path[path.len() - 1]).norm() < 1e-6);
        }
        let road = plan(&request(lines(), &[15.0])).unwrap();
        assert!(road.notices[0].contains("sensors of the targets ignored"));
    }

    #[test]
    fn a_failure_is_told_with_who_waits_how_long() {
        let mut asked = request(points(), &[15.0; 4]);
        asked.losses = losses(&["uav-2"], 0.0);
        let found = plan(&asked).unwrap();
        let after = found.after_losses.unwrap();
        assert!((after.revisit_s / found.revisit_s - 4.0 / 3.0).abs() < 1e-4);
        assert!(after.steady_s <= found.revisit_s + 1e-3);
        assert!((after.gap_s / found.revisit_s - 2.0).abs() < 1e-3);
        assert_eq!(after.uavs.len(), 3);
        assert!(after.uavs.iter().any(|u| u.loiter_s < 1e-3));
        asked.losses = losses(&["uav-2", "uav-1"], 33.0);
        let two = plan(&asked).unwrap().after_losses.unwrap();
        assert_eq!((two.uavs.len(), two.lost.len()), (2, 2));
    }

    #[test]
    fn after_a_loss_the_ways_to_new_arcs_are_flown_ones() {
        let mut asked = request(points(), &[15.0; 8]);
        for uav in &mut asked.team {
            // Not once round, but to and fro on a quarter of it.
            uav.start = Point::new(750.0, 550.0);
            uav.endurance_s = Some(390.0);
        }
        let (mut turned, mut moved) = (0, 0);
        for after_s in [0.0, 31.0, 60.0, 95.0] {
            // Four side by side are left: on quarters of the tour they lie apart.
            asked.losses = losses(&["uav-5", "uav-6", "uav-7", "uav-8"], after_s);
            let after = plan(&asked).unwrap().after_losses.unwrap();
            assert!(matches!(after.pattern, Pattern::Arcs { .. }));
            for uav in &after.uavs {
                let flown = crate::flown::time_s(&uav.legs, &asked.air(15.0));
                assert!((flown - uav.way_s).abs() < 0.01, "{flown} {}", uav.way_s);
                let curves: Vec<_> = uav.legs.iter().map(|leg| &leg.curve).collect();
                for pair in curves.windows(2) {
                    let (end, start) = (pair[0].end().unwrap(), pair[1].start().unwrap());
                    assert!((end.position() - start.position()).norm() < 2e-3);
                    let bend = skein_geometry::math::wrap_pi(end.heading_rad - start.heading_rad);
                    assert!(bend.abs() < 1e-3, "{bend}");
                }
                let bends = curves.iter().map(|c| c.max_curvature_per_m());
                assert!(bends.fold(0.0, f64::max) <= 1.0 / 20.0 + 1e-9);
                let Some(first) = curves.first() else {
                    continue;
                };
                let (start, end) = (first.start().unwrap(), first.end().unwrap());
                assert!((start.position() - uav.at).norm() < 2e-3);
                moved += 1;
                // Who turns back does so where it is.
                let back = (end.position() - start.position()).norm() < 2e-3;
                turned += usize::from(back);
            }
        }
        assert!(moved > 3 && turned > 0, "{moved} {turned}");
    }

    #[test]
    fn mixed_fleets_and_short_endurance_are_told() {
        let mut asked = request(points(), &[28.0, 10.0, 9.0]);
        asked.losses = losses(&["uav-1"], 0.0);
        // 28 alone is 28; two at 10 and 9 are less; to and fro is 23.5.
        let found = plan(&asked).unwrap();
        assert_eq!(found.uavs_flying(), 1);
        assert!(found.uavs[1].station.is_none() && found.uavs[1].path.len() == 1);
        let after = found.after_losses.unwrap();
        assert!(after.uavs.len() == 2 && after.uavs[0].joins);
        let mut tired = request(points(), &[15.0; 3]);
        for uav in &mut tired.team {
            uav.start = Point::new(750.0, 550.0);
            uav.endurance_s = Some(390.0);
        }
        let arcs = plan(&tired).unwrap();
        assert!(matches!(arcs.pattern, Pattern::Arcs { .. }));
        assert!(arcs.uavs.iter().all(|u| {
            let station = u.station.unwrap();
            let joined = u.legs.windows(2).all(|pair| {
                let (end, start) = (pair[0].curve.end(), pair[1].curve.start());
                (end.unwrap().position() - start.unwrap().position()).norm() < 1e-3
            });
            joined && station.arc_m.is_some() && station.time_s <= 390.0
        }));
        for uav in &mut tired.team {
            uav.start = Point::origin();
        }
        // From a corner the ways to two of the arcs are too long, and alone an arc is all.
        assert!(matches!(plan(&tired), Err(PatrolError::Nobody { .. })));
        let refused = |change: fn(&mut PatrolRequest)| {
            let mut asked = request(points(), &[15.0, 12.0]);
            change(&mut asked);
            plan(&asked).unwrap_err()
        };
        let short = refused(|r| r.team.iter_mut().for_each(|u| u.endurance_s = Some(60.0)));
        assert!(matches!(short, PatrolError::Nobody { .. }), "{short}");
        let unknown = refused(|r| r.losses = losses(&["x"], 0.0));
        assert_eq!(unknown, PatrolError::Unknown("x".to_owned()));
        let all = refused(|r| r.losses = losses(&["uav-1", "uav-2"], 0.0));
        assert_eq!(all, PatrolError::NobodyLeft);
        let never = refused(|r| r.losses = losses(&["uav-1"], f64::NAN));
        assert!(matches!(never, PatrolError::LossTime(_)));
        let windy = refused(|r| r.wind_mps.x = 3.0);
        assert_eq!(windy, PatrolError::Targets(ToursError::UnlikeInWind));
        let empty = refused(|r| {
            r.over = Over::Targets {
                targets: Targets::Points(Vec::new()),
                zones: Vec::new(),
            };
        });
        assert_eq!(empty, PatrolError::Nothing);
        let inside = plan(&PatrolRequest {
            team: vec![Uav {
                start: Point::new(400.0, 290.0),
                ..team(&[15.0]).remove(0)
            }],
            ..request(area(Planner::Exact), &[])
        });
        let name = "uav-1".to_owned();
        assert_eq!(inside.unwrap_err(), PatrolError::LaunchInZone(name));
    }
}
