//! Bytes of an [`Intent`]: what a UAV flies, would rather fly, and has accepted; and of the
//! same in brief, by versions (docs/protocol.md §11).
//!
//! A promise is `[version, start_ms, east_mm, north_mm, heading_e7, stretches, radius_mm,
//! airspeed_mmps]`, its last two the circle at its end, zeros where it leaves the airspace;
//! a stretch is `[radius_mm, length_mm, airspeed_mmps]`.

use super::cbor::{In, Listed, Out, Wire, array_of, in_field};
use super::codec::WireError;
use super::limits::{ACCEPTS_MAX, DURATION_MAX_MS, SPEED_MAX_MMPS, at_most, in_range, is_near};
use crate::PeerId;
use crate::protocol::conflict::{Intent, PromisedPlan};
use crate::protocol::promises::Brief;
use skein_flight::separation::motion::{HEADING_MOST_E7, STRETCHES_MAX};
use skein_flight::separation::{End, Motion, MotionPlan, Stretch};

/// What was accepted of whom.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Accepted {
    id: u16,
    version: u32,
}

array_of!(Accepted { id, version });
array_of!(Stretch {
    radius_mm,
    length_mm,
    airspeed_mmps
});

impl Listed for Accepted {
    const MAX: usize = ACCEPTS_MAX;
}
impl Listed for Stretch {
    const MAX: usize = STRETCHES_MAX;
}
impl Listed for PromisedPlan {
    const MAX: usize = 1;
}

impl Wire for PromisedPlan {
    fn put(&self, out: &mut Out) {
        let (radius_mm, airspeed_mmps) = match self.plan.end {
            End::Loiter {
                radius_mm,
                airspeed_mmps,
            } => (radius_mm, airspeed_mmps),
            End::Leaves => (0, 0),
        };
        out.array(8);
        self.version.put(out);
        self.plan.start_ms.put(out);
        self.plan.east_mm.put(out);
        self.plan.north_mm.put(out);
        self.plan.heading_e7.put(out);
        self.plan.stretches.put(out);
        radius_mm.put(out);
        airspeed_mmps.put(out);
    }

    fn get(input: &mut In<'_>) -> Result<Self, WireError> {
        input.array("promise", 8)?;
        let version = named(input, "version")?;
        let start_ms = named(input, "start_ms")?;
        let east_mm = named(input, "east_mm")?;
        let north_mm = named(input, "north_mm")?;
        let heading_e7 = named(input, "heading_e7")?;
        let stretches = named(input, "stretches")?;
        let (radius_mm, airspeed_mmps) =
            (named(input, "radius_mm")?, named(input, "airspeed_mmps")?);
        let end = match (radius_mm, airspeed_mmps) {
            (0, 0) => End::Leaves,
            _ => End::Loiter {
                radius_mm,
                airspeed_mmps,
            },
        };
        let plan = MotionPlan {
            start_ms,
            east_mm,
            north_mm,
            heading_e7,
            stretches,
            end,
        };
        Ok(Self { version, plan })
    }
}

fn named<T: Wire>(input: &mut In<'_>, field: &'static str) -> Result<T, WireError> {
    T::get(input).map_err(|e| in_field(e, field))
}

fn put_accepts(accepts: &[(PeerId, u32)], out: &mut Out) {
    let each = accepts.iter().map(|(id, version)| Accepted {
        id: id.0,
        version: *version,
    });
    each.collect::<Vec<_>>().put(out);
}

fn get_accepts(input: &mut In<'_>) -> Result<Vec<(PeerId, u32)>, WireError> {
    let accepts: Vec<Accepted> = named(input, "accepts")?;
    Ok(accepts.iter().map(|a| (PeerId(a.id), a.version)).collect())
}

/// A version that stands for none.
const NONE: u32 = 0;

impl Wire for Brief {
    fn put(&self, out: &mut Out) {
        out.array(4);
        self.number.put(out);
        self.in_force.put(out);
        self.proposal.unwrap_or(NONE).put(out);
        put_accepts(&self.accepts, out);
    }

    fn get(input: &mut In<'_>) -> Result<Self, WireError> {
        input.array("conflict", 4)?;
        let number = named(input, "number")?;
        let in_force = named(input, "in_force")?;
        let proposal: u32 = named(input, "proposal")?;
        Ok(Self {
            number,
            in_force,
            proposal: Some(proposal).filter(|version| *version != NONE),
            accepts: get_accepts(input)?,
        })
    }
}

impl Wire for Intent {
    fn put(&self, out: &mut Out) {
        out.array(5);
        self.number.put(out);
        self.endurance_s.put(out);
        self.in_force.put(out);
        self.proposal.iter().cloned().collect::<Vec<_>>().put(out);
        put_accepts(&self.accepts, out);
    }

    fn get(input: &mut In<'_>) -> Result<Self, WireError> {
        input.array("intent", 5)?;
        let number = named(input, "number")?;
        let endurance_s = named(input, "endurance_s")?;
        let in_force = Wire::get(input)?;
        let proposal: Vec<PromisedPlan> = named(input, "proposal")?;
        let accepts = get_accepts(input)?;
        Ok(Self {
            number,
            endurance_s,
            in_force,
            proposal: proposal.into_iter().next(),
            accepts,
        })
    }
}

/// The first field that is out of range, or what no fixed wing flies.
pub(super) fn check(intent: &Intent) -> Result<(), WireError> {
    in_range("endurance_s", intent.endurance_s <= DURATION_MAX_MS / 1000)?;
    check_promise(&intent.in_force)?;
    intent.proposal.iter().try_for_each(check_promise)?;
    check_accepts(&intent.accepts)
}

/// The same of a statement in brief.
pub(super) fn check_brief(brief: &Brief) -> Result<(), WireError> {
    in_range("in_force", brief.in_force != NONE)?;
    check_accepts(&brief.accepts)
}

fn check_accepts(accepts: &[(PeerId, u32)]) -> Result<(), WireError> {
    at_most("accepts", accepts.len(), ACCEPTS_MAX)?;
    in_range("accepts", accepts.is_sorted_by(|a, b| a.0 < b.0))
}

fn check_promise(promise: &PromisedPlan) -> Result<(), WireError> {
    let plan = &promise.plan;
    in_range("east_mm", is_near(plan.east_mm))?;
    in_range("north_mm", is_near(plan.north_mm))?;
    in_range(
        "heading_e7",
        plan.heading_e7.unsigned_abs() <= HEADING_MOST_E7,
    )?;
    let slow = |s: &Stretch| s.airspeed_mmps <= SPEED_MAX_MMPS;
    in_range("airspeed_mmps", plan.stretches.iter().all(slow))?;
    in_range("stretches", Motion::new(plan.clone()).is_ok())
}
