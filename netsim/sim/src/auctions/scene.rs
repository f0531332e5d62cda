//! Who is where and what is to be done, drawn from a seed.

use skein_geometry::math::TAU;
use skein_geometry::random::SplitMix64;
use skein_peer::PeerId;
use skein_peer::protocol::auction::flown::FlownTime;
use skein_peer::protocol::auction::settlement::{Bidder, Flying, Problem, Tasks};
use skein_peer::wire::tasks::{EVERY_KIND, Offer, Task, TaskId, TaskKind, TaskPlace};
use std::collections::BTreeSet;

/// Side of the square in which everything lies, mm.
const SIDE_MM: i32 = 4_000_000;

/// Sensors that tasks name.
const SENSORS: u32 = 3;

/// An instance.
#[derive(Clone, Debug)]
pub struct Instance {
    /// UAVs from west to east: hearing is by neighbourhood.
    pub uavs: Vec<(PeerId, Offer)>,
    /// What is to be done.
    pub tasks: Tasks,
}

/// Draws of one instance.
struct Draw(SplitMix64);

impl Draw {
    /// A number from `low` to `high`.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        reason = "spans are some millions"
    )]
    fn within(&mut self, low: i32, high: i32) -> i32 {
        let span = usize::try_from(high - low + 1).unwrap_or(1);
        low + self.0.below(span) as i32
    }

    fn count(&mut self, low: i32, high: i32) -> u32 {
        self.within(low, high).unsigned_abs()
    }

    fn place(&mut self) -> TaskPlace {
        TaskPlace {
            east_mm: self.within(0, SIDE_MM),
            north_mm: self.within(0, SIDE_MM),
        }
    }

    /// A UAV of a mixed fleet: each has one sensor by its turn, and each other by chance.
    fn offer(&mut self, nth: u32) -> Offer {
        let at = self.place();
        let speed_mmps = self.count(14_000, 24_000);
        let by_turn = 1 << (nth % SENSORS);
        let by_chance = self.count(0, (1 << SENSORS) - 1);
        // Thirty degrees of bank: v² / (g tan 30°), in millimetres.
        let radius_mm = u64::from(speed_mmps) * u64::from(speed_mmps) / 5_662;
        Offer {
            east_mm: at.east_mm,
            north_mm: at.north_mm,
            course_e4: self.within(0, 62_831),
            speed_mmps,
            radius_mm: u32::try_from(radius_mm).unwrap_or(u32::MAX),
            endurance_ms: 14_400_000,
            sensors: by_turn | by_chance,
            section_ms: 0,
            takes: EVERY_KIND,
        }
    }

    fn line(&mut self, from: TaskPlace) -> Vec<TaskPlace> {
        let mut places = vec![from];
        for _ in 0..self.within(1, 4) {
            let last = places[places.len() - 1];
            let angle = self.0.unit() * TAU;
            let (sin, cos) = skein_geometry::math::sin_cos(angle);
            let long_mm = f64::from(self.within(50_000, 200_000));
            #[allow(
                clippy::cast_possible_truncation,
                reason = "a few hundred metres in millimetres"
            )]
            places.push(TaskPlace {
                east_mm: last.east_mm + (long_mm * cos) as i32,
                north_mm: last.north_mm + (long_mm * sin) as i32,
            });
        }
        places
    }

    /// Six of ten are pinpoint tasks, two lines, one an area, one goes on; half need a sensor.
    fn task(&mut self) -> Task {
        let at = self.place();
        let (kind, stay_ms) = match self.within(0, 9) {
            0..=5 => (TaskKind::Pinpoint, 0),
            6..=7 => (TaskKind::Line, 0),
            8 => (TaskKind::Area, self.count(20_000, 60_000)),
            _ if self.within(0, 1) == 0 => (TaskKind::Track, 60_000),
            _ => (TaskKind::Relay, 60_000),
        };
        let places = if kind == TaskKind::Line {
            self.line(at)
        } else {
            vec![at]
        };
        let any = self.within(0, 1) == 0;
        let sensor = if any { 0 } else { self.within(1, 3) };
        Task {
            revision: 1,
            kind,
            places,
            sensor: u8::try_from(sensor).unwrap_or(0),
            worth: u16::try_from(self.within(100, 300)).unwrap_or(100),
            stay_ms,
            ..Task::default()
        }
    }
}

impl Instance {
    /// The instance of a seed.
    #[must_use]
    pub fn draw(n: u16, tasks: u16, seed: u64) -> Self {
        let mut draw = Draw(SplitMix64::new(seed ^ 0x00AC_7104));
        let mut offers: Vec<Offer> = (0..n).map(|k| draw.offer(u32::from(k))).collect();
        offers.sort_by_key(|offer| offer.east_mm);
        let name = |number| TaskId { author: 0, number };
        // Ids are drawn too: who goes before by its id lies anywhere.
        let mut ids: Vec<u16> = (1..=n).collect();
        draw.0.shuffle(&mut ids);
        Self {
            uavs: ids.into_iter().map(PeerId).zip(offers).collect(),
            tasks: (0..tasks).map(|k| (name(k), draw.task())).collect(),
        }
    }

    /// Tasks that some UAV can do.
    #[must_use]
    pub fn doable(&self) -> usize {
        let can = |id: &TaskId, task: &Task| {
            self.uavs.iter().any(|(who, offer)| {
                let from = FlownTime.begin(*who, offer);
                FlownTime.then(&from, *id, task).is_some()
            })
        };
        self.tasks.iter().filter(|(id, task)| can(id, task)).count()
    }

    /// What one who knows everything would settle.
    #[must_use]
    pub fn problem(&self) -> Problem {
        let bidder = |(id, offer): &(PeerId, Offer)| Bidder {
            id: *id,
            offer: *offer,
            first: Vec::new(),
            barred: BTreeSet::new(),
            room: usize::MAX,
        };
        let mut bidders: Vec<Bidder> = self.uavs.iter().map(bidder).collect();
        bidders.sort_by_key(|b| b.id);
        Problem {
            bidders,
            open: self.tasks.keys().copied().collect(),
        }
    }
}
