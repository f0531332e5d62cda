//! UAVs that hear nothing: each has its traffic sensor alone.

use super::{Flyer, PERCEPT_MS, SEPARATION_M, TUBES_M, is_turn};
use skein_behaviors::reactive::sensed_traffic::{Contact, Rule};
use skein_behaviors::setpoint::{Setpoint, Side, Steer};
use skein_flight::airframe::Airframe;
use skein_geometry::math::seconds;

/// Turns of a setpoint last until the airframe's failsafe would act, milliseconds.
const STEER_MS: u32 = 1_000;

/// Whether everybody's circle leaves room for those whom it senses.
pub(super) fn all_have_room(flyers: &[Flyer], range_m: f64) -> bool {
    (0..flyers.len()).all(|nth| {
        let (rule, contacts) = sensed(flyers, nth, range_m);
        rule.has_escape(&flyers[nth].body.pose(), &contacts)
    })
}

/// Whose turn it is decides for the time until its next one.
pub(super) fn decide(flyers: &mut [Flyer], range_m: f64, now_ms: u64) {
    for nth in 0..flyers.len() {
        if flyers[nth].arrived_ms.is_some() || !is_turn(nth, flyers.len(), now_ms) {
            continue;
        }
        let (rule, contacts) = sensed(flyers, nth, range_m);
        let f = &mut flyers[nth];
        let turn_rate_radps = rule.turn_rate_radps(&f.body.pose(), f.begin.goal, &contacts);
        let steer = Steer {
            turn_rate_radps,
            duration_ms: STEER_MS,
        };
        let setpoint = Setpoint {
            from_ms: now_ms,
            airspeed_mps: rule.airspeed_mps,
            height_m: 0.0,
            steps: vec![steer],
            loiter: Side::Right,
            gimbal: Vec::new(),
            launch: skein_behaviors::setpoint::Launch::Stay,
            promised: None,
        };
        let _ = f.body.apply(setpoint, now_ms);
    }
}

/// The range that sensors need if all fly such airframes, metres.
pub(super) fn least_range_m(airframe: &Airframe) -> f64 {
    let circle_m = circle_m(airframe);
    rule(airframe).least_range_m(airframe.cruise_mps, circle_m)
}

fn rule(airframe: &Airframe) -> Rule {
    Rule {
        airspeed_mps: airframe.cruise_mps,
        circle_m: circle_m(airframe),
        separation_m: SEPARATION_M,
        errors_m: TUBES_M,
        step_s: seconds(PERCEPT_MS),
    }
}

fn sensed(flyers: &[Flyer], nth: usize, range_m: f64) -> (Rule, Vec<Contact>) {
    let own = &flyers[nth];
    let others = flyers.iter().enumerate();
    let others = others.filter(|(i, f)| *i != nth && f.arrived_ms.is_none());
    let at = own.body.position();
    let near = others.filter(|(_, f)| (f.body.position() - at).norm() <= range_m);
    let contacts = near
        .map(|(_, f)| Contact {
            pose: f.body.pose(),
            airspeed_mps: f.begin.airframe.cruise_mps,
            circle_m: Some(circle_m(&f.begin.airframe)),
        })
        .collect();
    (rule(&own.begin.airframe), contacts)
}

fn circle_m(airframe: &Airframe) -> f64 {
    airframe.ground_turn_radius_m(airframe.cruise_mps, 0.0)
}
