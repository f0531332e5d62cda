//! Flights of a team over an area, whoever planned them: what they are predicted to take,
//! and how much they see (D2.7 §3.6).

use super::objective::Worth;
use super::output::Printed;
use serde_json::{Map, Value, json};
use skein_flight::airframe::{Airframe, GRAVITY_MPS2, PowerModel};
use skein_geometry::Polygon;
use skein_geometry::frame::Point;
use skein_geometry::math::{PI, atan2};

/// Points of the area that are looked at to tell the share that is seen: a tenth of a
/// percent is one in a thousand.
pub const MOST_SAMPLES: f64 = 40_000.0;

/// Samples along a swath at least.
const SAMPLES_A_SWATH: f64 = 8.0;

/// Stall speed of a typical survey UAV, as a share of the speed that it flies.
const TYPICAL_STALL: f64 = 0.6;

/// One UAV's flight.
#[derive(Clone, Debug, Default)]
pub struct Flight {
    /// Which of the team, from 0.
    pub uav: usize,
    /// What it is called.
    pub name: String,
    /// Its corners, from its start and back to it.
    pub track: Vec<Point>,
    /// Its corners without the ways from its start and back: what closes to be flown again
    /// and again.
    pub lap: Vec<Point>,
    /// Length, metres.
    pub length_m: f64,
    /// Speed, m/s.
    pub speed_mps: f64,
    /// Turn radius, metres.
    pub turn_radius_m: f64,
    /// Distance of the lanes it flies, metres.
    pub lane_m: f64,
    /// Power in level cruise, watts.
    pub cruise_power_w: Option<f64>,
    /// What else is worth telling.
    pub more: Map<String, Value>,
}

impl Flight {
    /// Whether it leaves its start at all.
    #[must_use]
    pub fn flies(&self) -> bool {
        self.track.len() > 1
    }

    /// How long it takes, seconds.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.length_m / self.speed_mps
    }

    /// Energy, watt-hours, if the power of cruise is known.
    #[must_use]
    pub fn energy_wh(&self) -> Option<f64> {
        let power_w = self.cruise_power_w?;
        Some(self.energy_s() * power_w / 3600.0)
    }

    /// Energy as seconds of level cruise: turns take more than level flight.
    #[must_use]
    pub fn energy_s(&self) -> f64 {
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

    /// What is told about it.
    #[must_use]
    pub fn printed(&self, altitude_m: f64) -> Printed {
        let mut told = self.more.clone();
        told.insert("time_s".to_owned(), json!(self.time_s()));
        told.insert("length_m".to_owned(), json!(self.length_m));
        told.insert("energy_s".to_owned(), json!(self.energy_s()));
        if let Some(energy_wh) = self.energy_wh() {
            told.insert("energy_wh".to_owned(), json!(energy_wh));
        }
        if self.flies() {
            told.insert("lane_m".to_owned(), json!(self.lane_m));
        }
        Printed {
            name: self.name.clone(),
            track: self.track.clone(),
            altitude_m,
            speed_mps: self.speed_mps,
            told,
            details: Map::new(),
        }
    }
}

/// How far a corner turns, radians, either way.
fn turn_rad(a: Point, b: Point, c: Point) -> f64 {
    let (u, v) = (b - a, c - b);
    atan2(u.perp(&v).abs(), u.dot(&v)).min(PI)
}

/// How the lanes of a team are laid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Laid {
    /// One width for all: that of the narrowest swath, with the widest turn.
    Common,
    /// A section for each crew of like swath, with lanes of its own.
    Sections,
}

impl Laid {
    fn name(self) -> &'static str {
        match self {
            Self::Common => "common",
            Self::Sections => "sections",
        }
    }
}

/// What a planner made.
#[derive(Clone, Debug)]
pub struct Flights {
    /// Which planner.
    pub planner: &'static str,
    /// How the lanes are laid.
    pub laid: Laid,
    /// Of the UAVs that were planned for; some may stay at their start.
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

    fn energy_wh(&self) -> Option<f64> {
        self.flights
            .iter()
            .filter(|f| f.flies())
            .map(Flight::energy_wh)
            .sum()
    }

    /// What it is compared by; energies in watt-hours or in seconds of cruise.
    #[must_use]
    pub fn worth(&self, in_watt_hours: bool) -> Worth {
        let cruise_s = || self.flights.iter().map(Flight::energy_s).sum();
        Worth {
            share: self.covered_share,
            makespan_s: self.makespan_s(),
            total_m: self.flights.iter().map(|f| f.length_m).sum(),
            energy: match self.energy_wh() {
                Some(energy_wh) if in_watt_hours => energy_wh,
                _ => cruise_s(),
            },
        }
    }

    /// What a person compares.
    #[must_use]
    pub fn compared(&self) -> Value {
        let worth = self.worth(false);
        let mut out = json!({
            "planner": self.planner,
            "lanes": self.laid.name(),
            "makespan_s": worth.makespan_s,
            "covered_share": worth.share,
            "total_m": worth.total_m,
            "energy_s": worth.energy,
            "uavs_flying": self.flights.iter().filter(|f| f.flies()).count(),
        });
        if let Some(energy_wh) = self.energy_wh() {
            out["energy_wh"] = json!(energy_wh);
        }
        out
    }
}

/// The share of the wanted ground of an area that is seen, by samples.
pub fn covered_share(
    area: &Polygon,
    wanted: impl Fn(Point) -> bool,
    swath_m: f64,
    most_samples: f64,
    sees: impl Fn(Point) -> bool,
) -> f64 {
    let (low, high) = area.bounds();
    let size = high - low;
    let pitch_m = (swath_m / SAMPLES_A_SWATH).max((size.x * size.y / most_samples).sqrt());
    let (mut all, mut seen) = (0u32, 0u32);
    let mut y = low.y + pitch_m / 2.0;
    while y < high.y {
        let mut x = low.x + pitch_m / 2.0;
        while x < high.x {
            let p = Point::new(x, y);
            if area.contains(p) && wanted(p) {
                all += 1;
                seen += u32::from(sees(p));
            }
            x += pitch_m;
        }
        y += pitch_m;
    }
    f64::from(seen) / f64::from(all.max(1))
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
        let half = covered_share(&area, |_| true, 40.0, MOST_SAMPLES, |p| p.x > 0.0);
        assert!((half - 0.5).abs() < 0.01);
        let rest = covered_share(
            &area,
            |p| !hole.contains(p),
            40.0,
            MOST_SAMPLES,
            |p| p.x.abs() > 50.0,
        );
        // 2 × 50 × 200 of 30,000 square metres.
        assert!((rest - 2.0 / 3.0).abs() < 0.01, "{rest}");
    }
}
