//! A plan to be recounted, in its plane.

use crate::VerifyError;
use crate::path::Piece;
use crate::plane::{Plane, Point};

/// What a plan says of a flight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FlightClaims {
    /// Its length, metres.
    pub length_m: Option<f64>,
    /// How long it takes, seconds.
    pub time_s: Option<f64>,
    /// Where it begins.
    pub from: Option<Point>,
    /// Where it ends.
    pub to: Option<Point>,
}

/// What a plan says of the wind.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Wind {
    /// None.
    #[default]
    Calm,
    /// Where it blows to, m/s east and north.
    To(f64, f64),
    /// There is one, but not from where: times cannot be recounted.
    Unknown,
}

/// What one UAV flies.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Flight {
    /// What the UAV is called.
    pub name: String,
    /// What it flies, in order; empty if it stays.
    pub pieces: Vec<Piece>,
    /// Whether the pieces are what is flown, turns and all; corners with straight legs
    /// between them are not.
    pub exact: bool,
    /// Airspeed, m/s.
    pub speed_mps: Option<f64>,
    /// The wind.
    pub wind: Wind,
    /// Its turn radius, metres.
    pub turn_radius_m: Option<f64>,
    /// Width of the ground that it sees, metres.
    pub swath_m: Option<f64>,
    /// How far it sees before and behind, metres.
    pub look_ahead_m: Option<f64>,
    /// What the plan says of it.
    pub claims: FlightClaims,
}

impl Flight {
    /// A flight of pieces, of which nothing else is known.
    #[must_use]
    pub fn new(name: impl Into<String>, pieces: Vec<Piece>) -> Self {
        Self {
            name: name.into(),
            pieces,
            exact: true,
            ..Self::default()
        }
    }

    /// Straight legs between corners, with the camera on all the way.
    #[must_use]
    pub fn straight(name: impl Into<String>, corners: &[Point]) -> Self {
        let legs = corners.windows(2).filter(|w| w[0].distance(w[1]) > 1e-6);
        let pieces = legs.map(|w| Piece::between(w[0], w[1], true)).collect();
        Self {
            exact: false,
            ..Self::new(name, pieces)
        }
    }

    /// Its length, metres.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.pieces.iter().map(|p| p.length_m).sum()
    }
}

/// What a plan says of all flights together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlanClaims {
    /// When the last UAV is back, seconds.
    pub makespan_s: Option<f64>,
    /// The length of all flights together, metres.
    pub total_m: Option<f64>,
    /// The share of the area that is seen.
    pub covered_share: Option<f64>,
}

/// Flights of a team.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The plane of the flights.
    pub plane: Plane,
    /// What each UAV flies.
    pub flights: Vec<Flight>,
    /// Distance that was to be kept from zones, metres.
    pub clearance_m: Option<f64>,
    /// Width of the ground that all see, metres.
    pub swath_m: Option<f64>,
    /// How far all see before and behind, metres.
    pub look_ahead_m: Option<f64>,
    /// What the plan says of itself.
    pub claims: PlanClaims,
    /// What of the files was left out.
    pub notices: Vec<String>,
}

impl Plan {
    /// A plan without flights.
    #[must_use]
    pub fn new(plane: Plane) -> Self {
        Self {
            plane,
            flights: Vec::new(),
            clearance_m: None,
            swath_m: None,
            look_ahead_m: None,
            claims: PlanClaims::default(),
            notices: Vec::new(),
        }
    }

    /// This plan and another one in the same plane, flown together. What each says of all its
    /// flights is then said of nothing.
    ///
    /// # Errors
    /// When a clearance or a camera of the two is not the same.
    pub fn and(mut self, other: Self) -> Result<Self, VerifyError> {
        let same = |a: Option<f64>, b: Option<f64>, what: &str| match (a, b) {
            (Some(a), Some(b)) if (a - b).abs() > 1e-9 => Err(VerifyError::Together(format!(
                "the plans have {what} of {a} and {b} m: recount them one by one"
            ))),
            _ => Ok(a.or(b)),
        };
        self.clearance_m = same(self.clearance_m, other.clearance_m, "clearances")?;
        self.swath_m = same(self.swath_m, other.swath_m, "swaths")?;
        self.look_ahead_m = same(self.look_ahead_m, other.look_ahead_m, "look-aheads")?;
        let claimed = self.claims != PlanClaims::default() || other.claims != PlanClaims::default();
        if claimed {
            let text = "several plans are recounted as one: what each says of all its flights together is not compared";
            self.notices.push(text.to_owned());
        }
        self.claims = PlanClaims::default();
        self.flights.extend(other.flights);
        self.notices.extend(other.notices);
        Ok(self)
    }
}
