//! Lanes for a team of unlike swaths: one width for all, or a section of the area for each
//! crew of like swath (D2.7 §3.1, §3.6).
//!
//! Leaves to [`super::planners`] the flights over a part, and to the caller which UAVs
//! there are.

use super::flights::{Flights, MOST_SAMPLES, Samples};
use super::planners::{Job, OpenArea, Part};
use super::{Facts, Laid, Lanes, Planner, PlannerError, Shape, ShapeKind};
use crate::fleet::sections::{self, Crew, Outcome, Uav, alike, evened, styles};
use crate::flight::Flight;
use crate::objective::{Objective, Worth};
use crate::team::PlannedUav;
use skein_geometry::Polygon;

/// Ways to cut an area that are planned; they are sorted by how much they promise.
const STYLES: usize = 3;

/// Sections are evened with this part of the steps.
const EVENING_PART: usize = 8;

/// Samples of the area while plans are only compared.
pub(crate) const FEW_SAMPLES: f64 = 4_000.0;

/// A section of which next to nothing can be flown counts as if this were done of it.
const LEAST_DONE: f64 = 0.05;

/// How thoroughly a plan is made.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Care {
    /// Steps of improvement.
    pub steps: usize,
    /// Whether it is only compared with others.
    pub rough: bool,
    /// A plan is wanted only if it may be better than this.
    pub better_than: Option<Worth>,
}

/// What plans of a team are asked.
#[derive(Clone, Copy)]
pub(crate) struct Desk<'a> {
    /// The area.
    pub ground: &'a OpenArea<'a>,
    /// The planner.
    pub planner: Planner,
    /// Which lanes.
    pub lanes: Lanes,
    /// What is to be least.
    pub objective: Objective,
    /// Whether energies are watt-hours.
    pub in_watt_hours: bool,
}

impl Desk<'_> {
    /// The same question for each kind of lanes alone.
    pub(crate) fn kinds(&self) -> Vec<Self> {
        match self.lanes {
            Lanes::Best => [Lanes::Common, Lanes::Sections]
                .map(|lanes| Self { lanes, ..*self })
                .to_vec(),
            Lanes::Common | Lanes::Sections => vec![*self],
        }
    }

    /// Whether one plan is better than another.
    pub(crate) fn beats(&self, a: &Flights, b: &Flights) -> bool {
        let worth = |f: &Flights| f.worth(self.in_watt_hours);
        worth(a).beats(&worth(b), self.objective)
    }

    /// Plans a team, with all lanes that were asked for; some of the plans may be left out that
    /// are proved to be no better than what is to be beaten.
    ///
    /// # Errors
    /// When there is no plan.
    pub(crate) fn plans(
        &self,
        team: &[PlannedUav],
        care: Care,
    ) -> Result<Vec<Flights>, PlannerError> {
        let swaths: Vec<f64> = team.iter().map(|f| f.swath_m).collect();
        let groups = alike(&swaths);
        let mut plans = Vec::new();
        if groups.len() < 2 || self.lanes != Lanes::Sections {
            plans.extend(self.common(team, care).transpose());
        }
        if groups.len() > 1 && self.lanes != Lanes::Common {
            plans.extend(self.sections(team, &groups, care).map(Ok));
        }
        if plans.iter().any(Result::is_ok) {
            plans.retain(Result::is_ok);
        }
        plans.into_iter().collect()
    }

    /// One width for all.
    fn common(&self, team: &[PlannedUav], care: Care) -> Result<Option<Flights>, PlannerError> {
        let part = self.part(&self.ground.request.area, team, care)?;
        Ok(part.map(|part| self.joined(Laid::Common, vec![part], care)))
    }

    fn part(
        &self,
        area: &Polygon,
        crew: &[PlannedUav],
        care: Care,
    ) -> Result<Option<Part>, PlannerError> {
        let lane_m = crew.iter().map(|f| f.swath_m).fold(f64::INFINITY, f64::min);
        let turn_radius_m = crew.iter().map(|f| f.turn_radius_m).fold(0.0, f64::max);
        let job = Job {
            area,
            crew,
            lane_m,
            turn_radius_m,
            steps: care.steps,
            in_watt_hours: self.in_watt_hours,
            rough: care.rough,
            better_than: care.better_than,
        };
        self.ground.plan(self.planner, job)
    }

    /// A section for each group; nothing when the area cannot be cut for them.
    fn sections(&self, team: &[PlannedUav], groups: &[Vec<usize>], care: Care) -> Option<Flights> {
        let request = self.ground.request;
        let blocked: Vec<&Polygon> = request.holes.iter().chain(request.zones.zones()).collect();
        let ground = sections::OpenArea::new(&request.area, &blocked);
        let members: Vec<Vec<PlannedUav>> = groups
            .iter()
            .map(|g| g.iter().map(|i| team[*i].clone()).collect())
            .collect();
        let crews: Vec<Crew> = members.iter().map(|m| crew(m)).collect();
        let shares = ground.shares(&crews);
        let rough = Care {
            steps: care.steps / EVENING_PART,
            rough: true,
            better_than: None,
        };
        let (n, rounds) = if care.rough {
            (1, 1)
        } else {
            (STYLES, sections::ROUNDS)
        };
        let better = |a: &Cut, b: &Cut| self.beats(&a.flights, &b.flights);
        let mut best: Option<Cut> = None;
        for style in styles(&ground, &crews, &shares).iter().take(n) {
            let plan = |parts: &[Option<Polygon>]| self.outcome(parts, &members, rough);
            let cut = evened(&ground, &crews, style, &shares, rounds, plan, better);
            if let Some(cut) = cut
                && best.as_ref().is_none_or(|b| better(&cut, b))
            {
                best = Some(cut);
            }
        }
        let best = best?;
        if care.rough {
            return Some(best.flights);
        }
        let cut = self.outcome(&best.sections, &members, care)?.plan;
        Some(cut.flights)
    }

    /// Plans all sections, each for its crew.
    fn outcome(
        &self,
        sections: &[Option<Polygon>],
        members: &[Vec<PlannedUav>],
        care: Care,
    ) -> Option<Outcome<Cut>> {
        let mut parts = Vec::new();
        let mut times_s = Vec::new();
        for (section, crew) in sections.iter().zip(members) {
            let Some(section) = section else {
                times_s.push(0.0);
                continue;
            };
            // A section by itself may be worse than what is to be beaten.
            let care = Care {
                better_than: None,
                ..care
            };
            let mut part = self.part(section, crew, care).ok()??;
            times_s.push(part.makespan_s() / part.done_share.max(LEAST_DONE));
            let kind = ShapeKind::Section {
                number: parts.len() + 1,
                uavs: crew.iter().map(|f| f.name.clone()).collect(),
                lane_m: part.flights.first().map_or(0.0, |f| f.lane_m),
            };
            let ring = section.vertices().to_vec();
            part.shapes.push(Shape { ring, kind });
            parts.push(part);
        }
        Some(Outcome {
            times_s,
            plan: Cut {
                sections: sections.to_vec(),
                flights: self.joined(Laid::Sections, parts, care),
            },
        })
    }

    /// Parts as one plan.
    fn joined(&self, laid: Laid, parts: Vec<Part>, care: Care) -> Flights {
        let lanes = parts.iter().flat_map(|p| &p.flights).map(|f| f.lane_m);
        let lane_m = lanes.fold(f64::INFINITY, f64::min);
        let most = if care.rough {
            FEW_SAMPLES
        } else {
            MOST_SAMPLES
        };
        let wanted = |p| self.ground.wants(p);
        let samples = Samples::new(&self.ground.request.area, wanted, lane_m, most);
        let seen = parts.iter().filter_map(Part::seen);
        let (share, near) = samples.shares(seen, |p| self.ground.is_too_near(p));
        let courses_left = parts.iter().map(|p| p.courses_left).max().unwrap_or(0);
        let mut facts: Option<Facts> = None;
        let mut promises = Vec::new();
        let (mut flights, mut shapes): (Vec<Flight>, Vec<_>) = (Vec::new(), Vec::new());
        for part in parts {
            flights.extend(part.flights);
            promises.extend(part.promises);
            shapes.extend(part.shapes);
            facts = match (facts, part.facts) {
                (Some(all), Some(own)) => Some(all.and(own)),
                (all, own) => all.or(own),
            };
        }
        flights.sort_by_key(|f| f.uav);
        if let (Laid::Sections, Some(Facts::Cells { lower_bound_s, .. })) = (laid, &mut facts) {
            // What bounds one section says nothing about all.
            *lower_bound_s = None;
        }
        Flights {
            planner: self.planner,
            laid,
            flights,
            covered_share: share,
            too_near_share: near,
            facts,
            shapes,
            courses_left,
            // Those of sections say nothing of all.
            promises: match laid {
                Laid::Common => promises,
                Laid::Sections => Vec::new(),
            },
        }
    }
}

/// An area cut into sections, and the flights over them.
struct Cut {
    sections: Vec<Option<Polygon>>,
    flights: Flights,
}

fn crew(members: &[PlannedUav]) -> Crew {
    let uav = |f: &PlannedUav| Uav {
        start: f.start,
        speed_mps: f.speed_mps,
        endurance_s: f.endurance_s,
    };
    Crew {
        swath_m: members
            .iter()
            .map(|f| f.swath_m)
            .fold(f64::INFINITY, f64::min),
        turn_radius_m: members.iter().map(|f| f.turn_radius_m).fold(0.0, f64::max),
        uavs: members.iter().map(uav).collect(),
    }
}
