//! Flights of a team over an area, whoever planned them: what they are predicted to take,
//! how much they see, and how they are printed (D2.7 §3.6).

use super::tours::Format;
use anyhow::{Context, Result, bail};
use serde_json::{Map, Value, json};
use skein_interop::place::from_plane;
use skein_interop::plan::{PlanFile, Waypoint, write};
use skein_planning::airframe::{Airframe, GRAVITY_MPS2, PowerModel};
use skein_planning::frame::{Origin, Point};
use skein_planning::geometry::Polygon;
use skein_planning::math::{PI, atan2};
use std::path::Path;

/// Points nearer to each other than this are one in the track, metres.
const COINCIDENT_M: f64 = 1e-3;

/// Points of the area that are looked at to tell the share that is seen: a tenth of a
/// percent is one in a thousand.
const MOST_SAMPLES: f64 = 40_000.0;

/// Samples along a swath at least.
const SAMPLES_A_SWATH: f64 = 8.0;

/// Stall speed of a typical survey UAV, as a share of the speed that it flies.
const TYPICAL_STALL: f64 = 0.6;

/// One UAV's flight.
#[derive(Clone, Debug, Default)]
pub struct Flight {
    /// What it is called.
    pub name: String,
    /// Its corners, from its start and back to it.
    pub track: Vec<Point>,
    /// Length, metres.
    pub length_m: f64,
    /// Speed, m/s.
    pub speed_mps: f64,
    /// Turn radius, metres.
    pub turn_radius_m: f64,
    /// What else is worth telling.
    pub more: Map<String, Value>,
}

impl Flight {
    fn time_s(&self) -> f64 {
        self.length_m / self.speed_mps
    }

    /// Energy as seconds of level cruise: turns take more than level flight.
    fn energy_s(&self) -> f64 {
        let v = self.speed_mps;
        let bank_rad = atan2(v * v, GRAVITY_MPS2 * self.turn_radius_m);
        let power = PowerModel::of(&Airframe {
            stall_mps: TYPICAL_STALL * v,
            cruise_mps: v,
            max_mps: v,
            max_bank_rad: bank_rad,
            endurance_s: f64::INFINITY,
            reserve_s: 0.0,
            footprint_across_m: 0.0,
            footprint_along_m: 0.0,
        });
        let turned_rad: f64 = self
            .track
            .windows(3)
            .map(|w| turn_rad(w[0], w[1], w[2]))
            .sum();
        let more = power.share(v, bank_rad) - 1.0;
        self.time_s() + more * turned_rad * self.turn_radius_m / v
    }

    fn told(&self, uav: usize) -> Value {
        let mut out = self.more.clone();
        out.insert("uav".to_owned(), json!(uav + 1));
        out.insert("name".to_owned(), json!(self.name));
        out.insert("time_s".to_owned(), json!(self.time_s()));
        out.insert("length_m".to_owned(), json!(self.length_m));
        out.insert("energy_s".to_owned(), json!(self.energy_s()));
        Value::Object(out)
    }

    fn points(&self) -> Vec<Point> {
        let mut track = self.track.clone();
        track.dedup_by(|p, q| (*p - *q).norm() < COINCIDENT_M);
        track
    }
}

/// How far a corner turns, radians, either way.
fn turn_rad(a: Point, b: Point, c: Point) -> f64 {
    let (u, v) = (b - a, c - b);
    atan2(u.perp(&v).abs(), u.dot(&v)).min(PI)
}

/// What a planner made.
#[derive(Clone, Debug)]
pub struct Flights {
    /// Which planner.
    pub planner: &'static str,
    /// By UAV.
    pub flights: Vec<Flight>,
    /// The share of the area that is seen.
    pub covered_share: f64,
    /// What else is worth telling.
    pub more: Map<String, Value>,
    /// Rings with properties for a map.
    pub shapes: Vec<(Vec<Point>, Value)>,
}

impl Flights {
    /// When the last UAV is back, seconds.
    #[must_use]
    pub fn makespan_s(&self) -> f64 {
        self.flights.iter().map(Flight::time_s).fold(0.0, f64::max)
    }

    /// What a person compares.
    #[must_use]
    pub fn compared(&self) -> Value {
        json!({
            "planner": self.planner,
            "makespan_s": self.makespan_s(),
            "covered_share": self.covered_share,
            "total_m": self.flights.iter().map(|f| f.length_m).sum::<f64>(),
            "energy_s": self.flights.iter().map(Flight::energy_s).sum::<f64>(),
        })
    }
}

/// The share of an area without holes that is seen, by samples.
pub fn covered_share(
    area: &Polygon,
    holes: &[Polygon],
    swath_m: f64,
    sees: impl Fn(Point) -> bool,
) -> f64 {
    let (low, high) = area.bounds();
    let size = high - low;
    let pitch_m = (swath_m / SAMPLES_A_SWATH).max((size.x * size.y / MOST_SAMPLES).sqrt());
    let (mut all, mut seen) = (0u32, 0u32);
    let mut y = low.y + pitch_m / 2.0;
    while y < high.y {
        let mut x = low.x + pitch_m / 2.0;
        while x < high.x {
            let p = Point::new(x, y);
            if area.contains(p) && !holes.iter().any(|h| h.contains(p)) {
                all += 1;
                seen += u32::from(sees(p));
            }
            x += pitch_m;
        }
        y += pitch_m;
    }
    f64::from(seen) / f64::from(all.max(1))
}

/// Flights to be printed.
pub struct Sheet<'a> {
    /// Where the plane lies.
    pub origin: Origin,
    /// What is printed.
    pub flights: &'a Flights,
    /// What all planners that were asked came to.
    pub compared: Vec<Value>,
    /// What was left out of the file.
    pub notices: &'a [String],
    /// Height of waypoints above home, metres.
    pub altitude_m: f64,
}

impl Sheet<'_> {
    /// The text to print.
    ///
    /// # Errors
    /// When a file cannot be written, or several plans have no folder.
    pub fn print(&self, format: Format, out: Option<&Path>) -> Result<String> {
        format.check_out(out)?;
        match format {
            Format::Json => Ok(self.json().to_string()),
            Format::Geojson => Ok(self.geojson().to_string()),
            Format::Plan => self.plans(out),
        }
    }

    fn summary(&self) -> Value {
        let mut out = self.flights.compared();
        for (key, value) in &self.flights.more {
            out[key] = value.clone();
        }
        if self.compared.len() > 1 {
            out["compared"] = json!(self.compared);
        }
        out["notices"] = json!(self.notices);
        out
    }

    fn json(&self) -> Value {
        let tours = self
            .flights
            .flights
            .iter()
            .enumerate()
            .map(|(uav, flight)| {
                let points = flight.points().into_iter().map(|p| {
                    let at = from_plane(self.origin, p);
                    json!({"lat_deg": at.lat_deg, "lon_deg": at.lon_deg})
                });
                let mut tour = flight.told(uav);
                tour["points"] = points.collect();
                tour
            });
        let mut out = self.summary();
        out["tours"] = tours.collect();
        out
    }

    fn geojson(&self) -> Value {
        let place = |p: &Point| {
            let at = from_plane(self.origin, *p);
            json!([at.lon_deg, at.lat_deg])
        };
        let flights = self
            .flights
            .flights
            .iter()
            .enumerate()
            .map(|(uav, flight)| {
                let line: Vec<Value> = flight.points().iter().map(place).collect();
                // A line has two points at least; a UAV that stays has one.
                let geometry = if line.len() < 2 {
                    json!({"type": "Point", "coordinates": line.first()})
                } else {
                    json!({"type": "LineString", "coordinates": line})
                };
                json!({"type": "Feature", "properties": flight.told(uav), "geometry": geometry})
            });
        let shapes = self.flights.shapes.iter().map(|(ring, properties)| {
            let ring: Vec<Value> = ring.iter().chain(ring.first()).map(place).collect();
            json!({
                "type": "Feature", "properties": properties,
                "geometry": {"type": "Polygon", "coordinates": [ring]},
            })
        });
        let mut out = self.summary();
        out["type"] = json!("FeatureCollection");
        out["features"] = flights.chain(shapes).collect();
        out
    }

    /// One QGroundControl plan a UAV.
    fn plans(&self, out: Option<&Path>) -> Result<String> {
        let text = |flight: &Flight| {
            let at = |p: &Point| from_plane(self.origin, *p);
            let track = flight.points();
            let waypoints = track.iter().skip(1);
            write(&PlanFile {
                waypoints: waypoints
                    .map(|p| Waypoint::new(at(p), self.altitude_m))
                    .collect(),
                home: track.first().map(at),
                cruise_mps: Some(flight.speed_mps),
                ..PlanFile::default()
            })
        };
        let flights = &self.flights.flights;
        let Some(dir) = out else {
            if let [flight] = flights.as_slice() {
                return Ok(text(flight));
            }
            bail!("--format plan for several UAVs needs --out DIR: one file a UAV");
        };
        std::fs::create_dir_all(dir).with_context(|| format!("cannot make {}", dir.display()))?;
        let mut written = Vec::new();
        for flight in flights {
            let path = dir.join(format!("{}.plan", flight.name));
            std::fs::write(&path, text(flight) + "\n")
                .with_context(|| format!("cannot write {}", path.display()))?;
            written.push(path.display().to_string());
        }
        let mut out = self.summary();
        out["files"] = json!(written);
        Ok(out.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_cost_energy_and_shares_are_measured() {
        let at = |x: f64, y: f64| Point::new(x, y);
        let straight = Flight {
            track: vec![at(0.0, 0.0), at(500.0, 0.0), at(1000.0, 0.0)],
            length_m: 1000.0,
            speed_mps: 15.0,
            turn_radius_m: 30.0,
            ..Flight::default()
        };
        assert!((straight.energy_s() - straight.time_s()).abs() < 1e-9);
        let bent = Flight {
            track: vec![at(0.0, 0.0), at(500.0, 0.0), at(500.0, 500.0)],
            ..straight.clone()
        };
        assert!(bent.energy_s() > straight.energy_s() + 0.5);
        let square = |half: f64| {
            Polygon::new(vec![
                at(-half, -half),
                at(half, -half),
                at(half, half),
                at(-half, half),
            ])
            .unwrap()
        };
        let (area, hole) = (square(100.0), square(50.0));
        let half = covered_share(&area, &[], 40.0, |p| p.x > 0.0);
        assert!((half - 0.5).abs() < 0.01);
        let rest = covered_share(&area, &[hole], 40.0, |p| p.x.abs() > 50.0);
        // 2 × 50 × 200 of 30,000 square metres.
        assert!((rest - 2.0 / 3.0).abs() < 0.01, "{rest}");
    }
}
