//! What the fuel of a peer's UAV allows, by place: when it must turn home, and how much of a
//! plan it can fly and still come home (D2.7 §2.3.1, §3.6.5).
//!
//! | fuel | event | fuel after it, and what follows |
//! |---|---|---|
//! | enough | what is left is no more than reserve and way home | due: the plan is given up, an alarm |
//! | due | some was added, and enough may be spent from here | enough |
//! | due | enough may be spent, and from the farthest open cell too (the reading was wrong, the wind dropped); with nothing open from anywhere on the loop | enough |
//! | any | a plan that cannot be flown and returned from | it is cut, its end is orphaned |
//!
//! How long the way home takes is the executive's: [`skein_behaviors::executive::endurance`].

use crate::effect::{Effect, Effects};
use crate::input::Time;
use crate::mission_state::MissionState;
use crate::protocol::runs::legs_of;
use skein_behaviors::Percept;
use skein_behaviors::executive::endurance::Within;
use skein_geometry::Curve;

/// A UAV whose fuel was due works again when it may spend this much, milliseconds: less
/// would be due again before the next round is decided.
const FUEL_BACK_MS: u32 = 30_000;

/// What is known of the fuel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Fuel {
    /// Since it has been due: the least that was left, seconds.
    due_s: Option<f64>,
    /// When the plan was last compared with what the fuel allows.
    looked_at: Option<Time>,
    /// Whether it was said that there are cells without a way home.
    no_way_told: bool,
}

impl Fuel {
    /// Whether it is due: the UAV flies home until some is back.
    pub fn is_due(&self) -> bool {
        self.due_s.is_some()
    }

    /// What stays of it in another mission.
    pub fn kept(self) -> Self {
        Self {
            due_s: self.due_s,
            ..Self::default()
        }
    }
}

impl MissionState {
    /// What may be flown before the UAV must turn home from where it is, milliseconds.
    pub fn spendable_ms(&self, percept: Option<&Percept>) -> u32 {
        let both = self.executive.as_ref().zip(percept);
        both.map_or(0, |(executive, percept)| executive.spendable_ms(percept))
    }

    /// What a bid offers from now on, milliseconds: whatever of the open cells a division gives,
    /// there is enough left to come home from it.
    pub fn offered_ms(&self, percept: Option<&Percept>) -> u32 {
        let both = self.executive.as_ref().zip(percept);
        both.map_or(0, |(e, p)| {
            e.offered_ms(p, &|c| !self.covered().contains(c))
        })
    }

    /// How much of the plan can be flown and returned from.
    pub fn plan_within_endurance(&self, percept: Option<&Percept>) -> Option<Within> {
        let (executive, percept) = self.executive.as_ref().zip(percept)?;
        let sections = &self.negotiation.sections;
        let legs = legs_of(sections.plan(), sections.cells());
        let is_open = |c: u16| !sections.covered().contains(c);
        Some(executive.within_endurance(&legs, &is_open, percept))
    }

    /// Whether there is enough left to fly this and to come home from its end; taken to be so
    /// where nothing is known of it.
    pub fn returns_from(&self, flown: &Curve, percept: Option<&Percept>) -> bool {
        let both = self.executive.as_ref().zip(percept);
        both.is_none_or(|(executive, percept)| executive.returns_from(flown, percept))
    }

    /// Gives up the plan when the fuel is due, and takes part again when some is back.
    pub fn watch_fuel(&mut self, percept: Option<&Percept>) -> Effects {
        let Some(percept) = percept else {
            return Effects::new();
        };
        let Some(least_s) = self.fuel.due_s else {
            let executive = self.executive.as_ref();
            let is_due = executive.is_none_or(|e| e.fuel_is_due(percept));
            return if is_due {
                self.give_up_for_fuel(percept)
            } else {
                Effects::new()
            };
        };
        // Nearer to the base more may be spent than where it came due: that is for the way.
        let least_s = least_s.min(percept.endurance_s);
        let added_s = percept.endurance_s - least_s;
        let is_refuelled = added_s * 1000.0 >= f64::from(FUEL_BACK_MS);
        let is_back = self.spendable_ms(Some(percept)) >= FUEL_BACK_MS
            && (is_refuelled || self.farthest_ms(percept) >= FUEL_BACK_MS);
        self.fuel.due_s = (!is_back).then_some(least_s);
        Effects::new()
    }

    /// What may be flown wherever among the open cells it ends; with nothing open wherever on the
    /// loop, milliseconds: on the way home that looks shorter than it did there.
    fn farthest_ms(&self, percept: &Percept) -> u32 {
        if !self.negotiation.sections.complete() {
            return self.offered_ms(Some(percept));
        }
        let executive = self.executive.as_ref();
        executive.map_or(0, |e| e.left_ms(percept).saturating_sub(e.home_ms()))
    }

    /// The fuel is due: the plan is given up.
    fn give_up_for_fuel(&mut self, percept: &Percept) -> Effects {
        self.fuel.due_s = Some(percept.endurance_s);
        self.negotiation.sections.keep(0);
        let mut effects = vec![self.claim_changed()];
        if self.executive.is_some() {
            let text = "the fuel is due: returning to base";
            effects.push(Effect::Alarm(text.into()));
        }
        effects
    }

    /// Lists only what can be flown and returned from (S10): the rest is orphaned, and that is
    /// a loss. Returns whether anything was given up.
    pub fn keep_within_endurance(&mut self, percept: Option<&Percept>) -> bool {
        let within = self.plan_within_endurance(percept);
        let Some((cut, _)) = within.and_then(|within| within.cut) else {
            return false;
        };
        let sections = &mut self.negotiation.sections;
        let good = sections.plan().iter().position(|p| p.cell == cut);
        sections.keep(good.unwrap_or(0));
        self.replan = true;
        true
    }

    /// A plan takes longer than when it was adopted if its first turn is begun from another
    /// pose, or if the UAV waited elsewhere meanwhile: what the fuel allows is looked at
    /// once a period.
    pub fn check_endurance(
        &mut self,
        now: Time,
        percept: Option<&Percept>,
        period_ms: u64,
    ) -> Effects {
        let looked_ago_ms = self.fuel.looked_at.map(|t| now.since_ms(t));
        if looked_ago_ms.is_some_and(|ms| ms < period_ms) {
            return Effects::new();
        }
        self.fuel.looked_at = Some(now);
        let mut effects: Effects = self.tell_of_no_way().into_iter().collect();
        let planned = !self.negotiation.sections.plan().is_empty();
        if planned && self.keep_within_endurance(percept) {
            effects.push(self.claim_changed());
        }
        effects
    }

    /// People hear once that nobody could come home from some cells.
    fn tell_of_no_way(&mut self) -> Option<Effect> {
        let covered = self.negotiation.sections.covered();
        let executive = self.executive.as_ref()?;
        let count = executive.n_without_way_home(&|c| !covered.contains(c));
        let is_told = core::mem::replace(&mut self.fuel.no_way_told, count > 0);
        (count > 0 && !is_told).then(|| {
            Effect::Alarm(format!(
                "no way home is known from {count} cells round the no-fly zones and in this wind: nothing is planned there"
            ))
        })
    }
}
