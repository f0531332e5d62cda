//! QGroundControl `.plan` files, written: what one UAV uploads. Leaves to the caller what is
//! flown and where the camera works.
//!
//! Commands are those of MAVLink's common set, which PX4 and ArduPilot both read.

use crate::place::{LatLon, Shape};
use crate::plan::NAV_WAYPOINT;
use serde_json::{Value, json};

/// MAVLink frame of an altitude above home.
const FRAME_RELATIVE_ALT: i64 = 3;

/// MAVLink frame of a command that has no place.
const FRAME_MISSION: i64 = 2;

/// QGroundControl's mode of an altitude above home.
const ALTITUDE_RELATIVE: i64 = 1;

const NAV_LOITER_UNLIM: i64 = 17;
const NAV_RETURN_TO_LAUNCH: i64 = 20;
const NAV_LAND: i64 = 21;
const NAV_TAKEOFF: i64 = 22;
const NAV_LOITER_TO_ALT: i64 = 31;
const NAV_VTOL_TAKEOFF: i64 = 84;
const NAV_VTOL_LAND: i64 = 85;
const DO_CHANGE_SPEED: i64 = 178;
const DO_LAND_START: i64 = 189;
const DO_SET_CAM_TRIGG_DIST: i64 = 206;

/// The least pitch of a fixed wing that takes off, degrees.
const TAKEOFF_PITCH_DEG: f64 = 15.0;

/// `MAV_TYPE_FIXED_WING`.
const FIXED_WING: u32 = 1;

/// `MAV_AUTOPILOT_PX4`.
const PX4: u32 = 12;

/// Speed of a multicopter where no file says so, m/s: QGroundControl's own.
const HOVER_MPS: f64 = 5.0;

/// The vehicle that a plan is for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vehicle {
    /// MAVLink number of the autopilot (`MAV_AUTOPILOT`).
    pub firmware_type: u32,
    /// MAVLink number of the vehicle's kind (`MAV_TYPE`).
    pub vehicle_type: u32,
    /// Speed as a multicopter, m/s.
    pub hover_mps: f64,
}

impl Default for Vehicle {
    /// A fixed wing with PX4.
    fn default() -> Self {
        Self {
            firmware_type: PX4,
            vehicle_type: FIXED_WING,
            hover_mps: HOVER_MPS,
        }
    }
}

impl Vehicle {
    /// Whether it is a fixed wing that cannot hover.
    #[must_use]
    pub fn is_fixed_wing(self) -> bool {
        self.vehicle_type == FIXED_WING
    }

    /// Whether it takes off upright and cruises on wings.
    #[must_use]
    pub fn is_vtol(self) -> bool {
        (19..=25).contains(&self.vehicle_type)
    }
}

/// What an item of a mission does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Item {
    /// Takes off towards a place, up to a height.
    Takeoff {
        /// The place: a fixed wing needs one away from home.
        at: LatLon,
        /// Height above home, metres.
        height_m: f64,
    },
    /// Flies at this airspeed from now on.
    Airspeed {
        /// The airspeed, m/s.
        mps: f64,
    },
    /// Flies to a place.
    Waypoint {
        /// Where.
        at: LatLon,
        /// Height above home, metres.
        height_m: f64,
        /// From how near the place counts as reached, metres.
        acceptance_m: f64,
    },
    /// Takes a picture now, and from now on one each so many metres; with 0 no more after
    /// this one.
    Trigger {
        /// Distance between two pictures, metres.
        distance_m: f64,
    },
    /// Flies home and does there what the autopilot is set to.
    ReturnToLaunch,
    /// Lands at a place.
    Land {
        /// Where.
        at: LatLon,
    },
    /// From here on it lands: an autopilot that is told to land goes on here.
    LandStart,
    /// Circles until it is at a height, and leaves the circle towards the next place.
    LoiterTo {
        /// Middle of the circle.
        at: LatLon,
        /// Height above home, metres.
        height_m: f64,
        /// Radius of the circle, metres; negative to the left.
        radius_m: f64,
    },
    /// Touches down at the end of a glide.
    Touchdown {
        /// Where.
        at: LatLon,
        /// Height above home, metres.
        height_m: f64,
    },
    /// Circles over a place until told otherwise.
    Loiter {
        /// Where.
        at: LatLon,
        /// Height above home, metres.
        height_m: f64,
        /// Radius of the circle, metres; to the right.
        radius_m: f64,
    },
}

/// A mission of one UAV.
#[derive(Clone, Debug, PartialEq)]
pub struct Mission {
    /// Where it starts.
    pub home: LatLon,
    /// Altitude of that place above the sea, metres.
    pub home_altitude_m: f64,
    /// Airspeed, m/s.
    pub cruise_mps: f64,
    /// What flies.
    pub vehicle: Vehicle,
    /// What it does, one after the other.
    pub items: Vec<Item>,
    /// The fence.
    pub fence: Value,
    /// The rally points.
    pub rally: Value,
}

/// An empty fence.
#[must_use]
pub fn no_fence() -> Value {
    json!({"circles": [], "polygons": [], "version": 2})
}

/// No rally points.
#[must_use]
pub fn no_rally() -> Value {
    json!({"points": [], "version": 2})
}

fn pair(p: LatLon) -> Value {
    json!([p.lat_deg, p.lon_deg])
}

/// Adds a shape to a fence: one to stay within (`inclusion`), or one to keep out of.
pub fn add_to_fence(fence: &mut Value, inclusion: bool, shape: &Shape) {
    let (list, member) = match shape {
        Shape::Ring(ring) => {
            let ring: Vec<Value> = ring.iter().copied().map(pair).collect();
            let polygon = json!({"inclusion": inclusion, "polygon": ring, "version": 1});
            ("polygons", polygon)
        }
        Shape::Circle { centre, radius_m } => {
            let circle = json!({"center": pair(*centre), "radius": radius_m});
            let circle = json!({"circle": circle, "inclusion": inclusion, "version": 1});
            ("circles", circle)
        }
    };
    match fence.get_mut(list).and_then(Value::as_array_mut) {
        Some(all) => all.push(member),
        None => fence[list] = json!([member]),
    }
}

/// Writes a mission as a plan that QGroundControl opens.
#[must_use]
pub fn write(mission: &Mission) -> String {
    let items = mission.items.iter().enumerate();
    let items: Vec<Value> = items
        .map(|(i, item)| item_json(item, mission.vehicle, i + 1))
        .collect();
    let LatLon { lat_deg, lon_deg } = mission.home;
    let plan = json!({
        "fileType": "Plan", "version": 1, "groundStation": "skein",
        "geoFence": mission.fence,
        "mission": {
            "version": 2, "cruiseSpeed": mission.cruise_mps,
            "hoverSpeed": mission.vehicle.hover_mps,
            "firmwareType": mission.vehicle.firmware_type,
            "vehicleType": mission.vehicle.vehicle_type,
            "globalPlanAltitudeMode": ALTITUDE_RELATIVE,
            "plannedHomePosition": [lat_deg + 0.0, lon_deg + 0.0, mission.home_altitude_m + 0.0],
            "items": items,
        },
        "rallyPoints": mission.rally,
    });
    plan.to_string()
}

/// An item; the seven parameters are MAVLink's, `null` leaves the yaw to the autopilot.
fn item_json(item: &Item, vehicle: Vehicle, id: usize) -> Value {
    let with_four =
        |command: i64, [p1, p2, p3]: [f64; 3], p4: Option<f64>, at: LatLon, height_m: f64| {
            json!({
                "AMSLAltAboveTerrain": null, "Altitude": height_m + 0.0,
                "AltitudeMode": ALTITUDE_RELATIVE, "autoContinue": true, "command": command,
                "doJumpId": id, "frame": FRAME_RELATIVE_ALT, "type": "SimpleItem",
                // Adding 0 leaves no zero its sign.
                "params": [p1, p2, p3, p4, at.lat_deg + 0.0, at.lon_deg + 0.0, height_m + 0.0],
            })
        };
    let placed = |command: i64, params: [f64; 3], at: LatLon, height_m: f64| {
        with_four(command, params, None, at, height_m)
    };
    let unplaced = |command: i64, [p1, p2, p3]: [f64; 3]| {
        json!({
            "autoContinue": true, "command": command, "doJumpId": id,
            "frame": FRAME_MISSION, "type": "SimpleItem", "params": [p1, p2, p3, 0, 0, 0, 0],
        })
    };
    match *item {
        Item::Takeoff { at, height_m } if vehicle.is_vtol() => {
            placed(NAV_VTOL_TAKEOFF, [0.0; 3], at, height_m)
        }
        Item::Takeoff { at, height_m } => {
            let pitch_deg = if vehicle.is_fixed_wing() {
                TAKEOFF_PITCH_DEG
            } else {
                0.0
            };
            placed(NAV_TAKEOFF, [pitch_deg, 0.0, 0.0], at, height_m)
        }
        // Airspeed (0), with the throttle as it is (-1).
        Item::Airspeed { mps } => unplaced(DO_CHANGE_SPEED, [0.0, mps, -1.0]),
        // No hold, and no place passed at a distance.
        Item::Waypoint {
            at,
            height_m,
            acceptance_m,
        } => placed(NAV_WAYPOINT, [0.0, acceptance_m, 0.0], at, height_m),
        // The shutter as it is set (0), and one picture at once (1).
        Item::Trigger { distance_m } => unplaced(DO_SET_CAM_TRIGG_DIST, [distance_m, 0.0, 1.0]),
        Item::ReturnToLaunch => unplaced(NAV_RETURN_TO_LAUNCH, [0.0; 3]),
        // The autopilot's own height of the approach: a number that is none is written null.
        Item::Land { at } if vehicle.is_vtol() => {
            placed(NAV_VTOL_LAND, [0.0, 0.0, f64::NAN], at, 0.0)
        }
        Item::Land { at } => placed(NAV_LAND, [0.0; 3], at, 0.0),
        Item::LandStart => unplaced(DO_LAND_START, [0.0; 3]),
        // Leaves the circle on the course to the next place (1), on its tangent (1).
        Item::LoiterTo {
            at,
            height_m,
            radius_m,
        } => with_four(
            NAV_LOITER_TO_ALT,
            [1.0, radius_m, 0.0],
            Some(1.0),
            at,
            height_m,
        ),
        // QGroundControl knows its landing pattern again by these zeros.
        Item::Touchdown { at, height_m } => with_four(NAV_LAND, [0.0; 3], Some(0.0), at, height_m),
        Item::Loiter {
            at,
            height_m,
            radius_m,
        } => placed(NAV_LOITER_UNLIM, [0.0, 0.0, radius_m], at, height_m),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::read;

    const HERE: LatLon = LatLon {
        lat_deg: 47.0,
        lon_deg: 8.0,
    };

    fn mission(vehicle: Vehicle) -> Mission {
        let height_m = 60.0;
        Mission {
            home: HERE,
            home_altitude_m: 431.5,
            cruise_mps: 17.0,
            vehicle,
            items: vec![
                Item::Takeoff { at: HERE, height_m },
                Item::Airspeed { mps: 17.0 },
                Item::Waypoint {
                    at: HERE,
                    height_m,
                    acceptance_m: 7.5,
                },
                Item::Trigger { distance_m: 20.0 },
                Item::Trigger { distance_m: 0.0 },
                Item::Loiter {
                    at: HERE,
                    height_m,
                    radius_m: 30.0,
                },
                Item::Land { at: HERE },
                Item::ReturnToLaunch,
            ],
            fence: no_fence(),
            rally: no_rally(),
        }
    }

    #[test]
    fn what_is_written_can_be_read() {
        let mut mission = mission(Vehicle::default());
        let ring = [(47.0, 8.0), (47.0, 8.1), (47.1, 8.1)];
        let ring = ring.map(|(lat_deg, lon_deg)| LatLon { lat_deg, lon_deg });
        let ring = Shape::Ring(ring.to_vec());
        let circle = Shape::Circle {
            centre: HERE,
            radius_m: 90.0,
        };
        add_to_fence(&mut mission.fence, true, &circle);
        add_to_fence(&mut mission.fence, false, &ring);
        let read = read(&write(&mission)).unwrap();
        assert_eq!(read.home, Some(HERE));
        assert_eq!(read.home_altitude_m, Some(431.5));
        assert_eq!((read.cruise_mps, read.hover_mps), (Some(17.0), Some(5.0)));
        assert_eq!((read.firmware_type, read.vehicle_type), (Some(12), Some(1)));
        assert_eq!((read.keep_in, read.keep_out), (vec![circle], vec![ring]));
        assert_eq!(read.fence, Some(mission.fence));
        assert_eq!(read.rally, Some(mission.rally));
        let commands: Vec<i64> = read.waypoints.iter().map(|w| w.command).collect();
        assert_eq!(commands, [22, 16, 17, 21]);
    }

    #[test]
    fn parameters_are_those_of_the_commands() {
        let json = |vehicle| -> Value {
            let text = write(&mission(vehicle));
            serde_json::from_str(&text).unwrap()
        };
        let plan = json(Vehicle::default());
        let items = plan["mission"]["items"].as_array().unwrap();
        for (i, item) in items.iter().enumerate() {
            assert_eq!(item["doJumpId"], i + 1);
            assert_eq!(item["params"].as_array().unwrap().len(), 7);
        }
        assert_eq!(items[0]["params"][0], 15.0);
        assert_eq!(items[1]["params"], json!([0.0, 17.0, -1.0, 0, 0, 0, 0]));
        assert_eq!(items[2]["params"][1], 7.5);
        assert_eq!(items[3]["params"], json!([20.0, 0.0, 1.0, 0, 0, 0, 0]));
        assert_eq!(items[4]["params"], json!([0.0, 0.0, 1.0, 0, 0, 0, 0]));
        let mut lands = mission(Vehicle::default());
        lands.items = vec![
            Item::LandStart,
            Item::LoiterTo {
                at: HERE,
                height_m: 40.0,
                radius_m: -75.0,
            },
            Item::Touchdown {
                at: HERE,
                height_m: 0.0,
            },
        ];
        let plan: Value = serde_json::from_str(&write(&lands)).unwrap();
        let items = &plan["mission"]["items"];
        assert_eq!(
            (&items[0]["command"], &items[0]["frame"]),
            (&json!(189), &json!(2))
        );
        assert_eq!(
            items[1]["params"],
            json!([1.0, -75.0, 0.0, 1.0, 47.0, 8.0, 40.0])
        );
        assert_eq!(
            items[2]["params"],
            json!([0.0, 0.0, 0.0, 0.0, 47.0, 8.0, 0.0])
        );
        let vtol = Vehicle {
            vehicle_type: 22,
            ..Vehicle::default()
        };
        let items = json(vtol)["mission"]["items"].clone();
        assert_eq!(
            (&items[0]["command"], &items[6]["command"]),
            (&json!(84), &json!(85))
        );
        assert!(items[6]["params"][2].is_null());
        let copter = Vehicle {
            vehicle_type: 2,
            ..Vehicle::default()
        };
        assert_eq!(json(copter)["mission"]["items"][0]["params"][0], 0.0);
    }

    #[test]
    fn zeros_have_no_sign() {
        let mut mission = mission(Vehicle::default());
        let (lat_deg, lon_deg) = (-0.0, -0.0);
        mission.home = LatLon { lat_deg, lon_deg };
        mission.home_altitude_m = -0.0;
        mission.items = vec![Item::Land { at: mission.home }];
        let text = write(&mission);
        assert!(!text.contains("-0"), "{text}");
    }

    #[test]
    fn a_fence_without_lists_gets_them() {
        let mut fence = json!({"version": 2});
        let circle = Shape::Circle {
            centre: HERE,
            radius_m: 9.0,
        };
        add_to_fence(&mut fence, false, &circle);
        assert_eq!(fence["circles"][0]["circle"]["radius"], 9.0);
    }
}
