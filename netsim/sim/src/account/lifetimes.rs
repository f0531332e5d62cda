//! Which process ran when and which UAV flew: who is alive, and how long the work takes
//! at the very least.

use crate::fault::{Fault, TimedFault};
use crate::spec::Spec;
use serde::{Deserialize, Serialize};
use skein_behaviors::Executive;
use skein_peer::offload::MissionGeometry;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// What an account must know of a scenario.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Setting {
    /// Its name.
    pub scenario: String,
    /// The seed of the run.
    pub seed: u64,
    /// Mean speed over the ground along the whole loop, by UAV, m/s.
    pub uavs: BTreeMap<u16, f64>,
    /// When each takes off, milliseconds; whoever is not named, at once.
    pub takeoffs_ms: BTreeMap<u16, u64>,
    /// Length of all cells that are needed, over all laps, metres.
    pub work_m: f64,
    /// Share of the area that must be coverable, 0 to 1.
    pub needed_share: f64,
    /// How soon what the operator asks to be looked at is to be seen, ms.
    pub max_visit_ms: Option<u64>,
    /// What that is: the tasks of the scenario itself.
    pub visits: BTreeSet<String>,
}

impl Setting {
    /// Of a scenario and what was derived from its mission; without a loop there is no
    /// work to bound.
    #[must_use]
    pub fn new(spec: &Spec, geometry: Option<&Arc<MissionGeometry>>, seed: u64) -> Self {
        let speed_mps = |u: &crate::spec::UavSpec| {
            geometry.map_or(u.airframe.cruise_mps, |g| {
                let (ring, router) = (Arc::clone(&g.coverage_loop), Arc::clone(&g.router));
                Executive::new(u.airframe, u.height_m, ring, router).loop_speed_mps()
            })
        };
        let once_m: f64 = geometry.map_or(0.0, |g| {
            let cells = g.coverage_loop.cells().iter().filter(|c| c.needed);
            cells.map(|c| f64::from(c.service_mm) / 1000.0).sum()
        });
        Self {
            scenario: spec.name.clone(),
            seed,
            uavs: spec.uavs.iter().map(|u| (u.id, speed_mps(u))).collect(),
            takeoffs_ms: (spec.uavs.iter())
                .map(|u| (u.id, u64::from(u.takeoff_ms)))
                .collect(),
            // Of what ends by its time nobody knows how much it is.
            work_m: match spec.mission.ends_after_s() {
                Some(_) => 0.0,
                None => once_m * (f64::from(spec.mission.further_laps) + 1.0),
            },
            needed_share: spec.min_coverable,
            max_visit_ms: spec.max_visit_s.map(|s| 1_000 * u64::from(s)),
            visits: asked_by(spec),
        }
    }
}

/// Tasks that the scenario's operator asks for, by name.
fn asked_by(spec: &Spec) -> BTreeSet<String> {
    let name = |f: &TimedFault| match &f.fault {
        Fault::AddTask { task } => task.name.clone(),
        _ => None,
    };
    spec.faults.iter().filter_map(name).collect()
}

/// Why a process ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Cause {
    /// A fault took process and airframe.
    #[default]
    Killed,
    /// A fault took the process; the airframe stayed in the air.
    ComputerKilled,
    /// It was asked to end; the airframe stayed in the air.
    Terminated,
    /// It ended by itself; the airframe stayed in the air.
    Crashed,
    /// The world took the airframe, and the process with it.
    Lost,
    /// It had come home when its fuel ended.
    Landed,
}

impl Cause {
    /// Whether the airframe is gone too.
    #[must_use]
    pub fn takes_airframe(self) -> bool {
        matches!(self, Self::Killed | Self::Lost | Self::Landed)
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Process {
    #[default]
    Stopped,
    Runs,
    Paused,
}

#[derive(Clone, Debug, Default)]
struct Lifetime {
    process: Process,
    /// Since when it runs, milliseconds.
    since_ms: u64,
    /// Times before in which it ran, milliseconds.
    ran: Vec<(u64, u64)>,
}

impl Lifetime {
    fn stop(&mut self, now_ms: u64, to: Process) {
        if self.process == Process::Runs {
            self.ran.push((self.since_ms, now_ms));
        }
        self.process = to;
    }

    fn go(&mut self, now_ms: u64) {
        self.stop(now_ms, Process::Runs);
        self.since_ms = now_ms;
    }
}

/// The processes of one run.
#[derive(Clone, Debug)]
pub struct Lifetimes {
    speeds_mps: BTreeMap<u16, f64>,
    takeoffs_ms: BTreeMap<u16, u64>,
    /// From when until when those have nothing left to spend whose batteries last for less.
    spent_ms: BTreeMap<u16, Vec<(u64, u64)>>,
    work_m: f64,
    by_peer: BTreeMap<u16, Lifetime>,
}

impl Lifetimes {
    /// Nobody runs yet.
    #[must_use]
    pub fn new(setting: &Setting) -> Self {
        Self {
            speeds_mps: setting.uavs.clone(),
            takeoffs_ms: setting.takeoffs_ms.clone(),
            spent_ms: BTreeMap::new(),
            work_m: setting.work_m,
            by_peer: BTreeMap::new(),
        }
    }

    /// The mission became another one: the work has no bound.
    pub fn revised(&mut self) {
        self.work_m = 0.0;
    }

    /// A process starts.
    pub fn started(&mut self, now_ms: u64, peer: u16) {
        self.by_peer.entry(peer).or_default().go(now_ms);
    }

    /// The battery of a UAV lasts for less: from then on it has nothing left to spend.
    pub fn limited(&mut self, peer: u16, until_ms: u64) {
        let spent = self.spent_ms.entry(peer).or_default();
        match spent.last_mut().filter(|(_, to)| *to == u64::MAX) {
            Some((from, _)) => *from = until_ms.min(*from),
            None => spent.push((until_ms, u64::MAX)),
        }
    }

    /// The airframe of a UAV is gone: the next one has full tanks.
    pub fn airframe_gone(&mut self, now_ms: u64, peer: u16) {
        let last = self.spent_ms.get_mut(&peer).and_then(|s| s.last_mut());
        if let Some((_, to)) = last {
            *to = now_ms.min(*to);
        }
    }

    /// A process ends; false when there was none.
    pub fn ended(&mut self, now_ms: u64, peer: u16) -> bool {
        let Some(l) = self.by_peer.get_mut(&peer) else {
            return false;
        };
        let was = l.process != Process::Stopped;
        l.stop(now_ms, Process::Stopped);
        was
    }

    /// A process stands still.
    pub fn paused(&mut self, now_ms: u64, peer: u16) {
        if let Some(l) = self.by_peer.get_mut(&peer)
            && l.process == Process::Runs
        {
            l.stop(now_ms, Process::Paused);
        }
    }

    /// A process goes on.
    pub fn resumed(&mut self, now_ms: u64, peer: u16) {
        if let Some(l) = self.by_peer.get_mut(&peer)
            && l.process == Process::Paused
        {
            l.go(now_ms);
        }
    }

    /// When the last process of a peer ended, milliseconds; `None` while one runs.
    #[must_use]
    pub fn ended_ms(&self, peer: u16) -> Option<u64> {
        let lifetime = self.by_peer.get(&peer)?;
        let ended = lifetime.process == Process::Stopped;
        lifetime.ran.last().filter(|_| ended).map(|(_, to)| *to)
    }

    /// UAVs whose computers run, ascending.
    #[must_use]
    pub fn live_uavs(&self) -> Vec<u16> {
        let running = self
            .by_peer
            .iter()
            .filter(|(id, l)| l.process == Process::Runs && self.speeds_mps.contains_key(id));
        running.map(|(id, _)| *id).collect()
    }

    /// Milliseconds that all processes ran, together.
    #[must_use]
    pub fn ran_ms(&self, now_ms: u64) -> u64 {
        let of = |l: &Lifetime| {
            let before: u64 = l.ran.iter().map(|(from, to)| to - from).sum();
            let open = l.process == Process::Runs;
            before
                + if open {
                    now_ms.saturating_sub(l.since_ms)
                } else {
                    0
                }
        };
        self.by_peer.values().map(of).sum()
    }

    /// The work bound, milliseconds: the least time by which all UAVs alive have flown the
    /// length of all cells, each at its mean speed over the ground along the loop, with no
    /// way to the first cell, none between sections and none flown twice. Whose battery lasts
    /// for less works until its reserve. UAVs that run at the end are taken to run on; `None` when those that there are never get so far.
    #[must_use]
    pub fn work_bound_ms(&self) -> Option<u64> {
        self.bound_ms(|_| 0)
    }

    /// The same where nobody flies before it takes off.
    #[must_use]
    pub fn launch_bound_ms(&self) -> Option<u64> {
        self.bound_ms(|id| self.takeoffs_ms.get(&id).copied().unwrap_or(0))
    }

    #[allow(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "times of a run stay below 2^52 ms, and casts from floats saturate"
    )]
    fn bound_ms(&self, flies_ms: impl Fn(u16) -> u64) -> Option<u64> {
        if self.work_m <= 0.0 {
            return None;
        }
        // Changes of the speed at which the whole fleet works, m/s, by time.
        let mut changes: BTreeMap<u64, f64> = BTreeMap::new();
        for (id, l) in &self.by_peer {
            let Some(v) = self.speeds_mps.get(id) else {
                continue;
            };
            let flies_ms = flies_ms(*id);
            let runs = (l.process == Process::Runs).then_some((l.since_ms, u64::MAX));
            let spent = self.spent_ms.get(id).map_or(&[][..], Vec::as_slice);
            for (from, to) in l.ran.iter().copied().chain(runs) {
                let mut works = |from: u64, to: u64, v: f64| {
                    if from < to {
                        *changes.entry(from).or_default() += v;
                        *changes.entry(to).or_default() -= v;
                    }
                };
                let from = from.max(flies_ms);
                works(from, to, *v);
                // Its last reserve is for the way home, and no work.
                for (begin, end) in spent {
                    works(from.max(*begin), to.min(*end), -*v);
                }
            }
        }
        let (mut left_m, mut speed_mps, mut since_ms) = (self.work_m, 0.0, 0);
        for (at_ms, change) in changes {
            let done_m = speed_mps * (at_ms - since_ms) as f64 / 1000.0;
            if done_m >= left_m {
                break;
            }
            left_m -= done_m;
            speed_mps += change;
            since_ms = at_ms;
        }
        // A sum of speeds that came and went may miss zero by a rounding.
        (speed_mps > 1e-6).then(|| since_ms + (left_m / speed_mps * 1000.0).ceil() as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_at_ten_mps(work_m: f64) -> Lifetimes {
        let mut l = Lifetimes::new(&Setting {
            uavs: BTreeMap::from([(1, 10.0), (2, 10.0)]),
            work_m,
            ..Setting::default()
        });
        for peer in [1, 2, 100] {
            l.started(0, peer);
        }
        l
    }

    #[test]
    fn the_work_bound_counts_uavs_while_their_computers_run() {
        let calm = two_at_ten_mps(2_000.0);
        assert_eq!(calm.work_bound_ms(), Some(100_000));

        let mut one_dies = two_at_ten_mps(2_000.0);
        assert!(one_dies.ended(40_000, 2));
        assert!(!one_dies.ended(41_000, 2), "it ends only once");
        // 800 m together until 40 s, 1,200 m alone.
        assert_eq!(one_dies.work_bound_ms(), Some(160_000));
        one_dies.started(100_000, 2);
        // 800 m, then 600 m alone until 100 s, 600 m together.
        assert_eq!(one_dies.work_bound_ms(), Some(130_000));

        let mut paused = two_at_ten_mps(2_000.0);
        paused.paused(0, 1);
        paused.resumed(100_000, 1);
        assert_eq!(paused.work_bound_ms(), Some(150_000));

        let mut all_die = two_at_ten_mps(2_000.0);
        all_die.ended(10_000, 1);
        all_die.ended(10_000, 2);
        assert_eq!(all_die.work_bound_ms(), None);
        assert_eq!(two_at_ten_mps(0.0).work_bound_ms(), None);
    }

    #[test]
    fn whose_battery_lasts_for_less_works_until_its_reserve() {
        let mut short = two_at_ten_mps(2_000.0);
        short.limited(2, 60_000);
        short.limited(2, 40_000);
        short.limited(2, 50_000);
        assert_eq!(short.work_bound_ms(), Some(160_000));
        // Another airframe has full tanks.
        short.airframe_gone(90_000, 2);
        assert!(short.ended(90_000, 2));
        short.started(100_000, 2);
        assert_eq!(short.work_bound_ms(), Some(130_000));
        // Who is gone before its reserve is due is gone once.
        let mut dies = two_at_ten_mps(2_000.0);
        dies.limited(2, 60_000);
        dies.airframe_gone(40_000, 2);
        dies.ended(40_000, 2);
        assert_eq!(dies.work_bound_ms(), Some(160_000));
        let mut all = two_at_ten_mps(2_000.0);
        all.limited(1, 10_000);
        all.limited(2, 10_000);
        assert_eq!(all.work_bound_ms(), None, "they never get so far");
    }

    #[test]
    fn the_bound_from_the_take_offs_on_counts_uavs_from_then_on() {
        let launched = |takeoffs_ms: [u64; 2]| {
            let mut l = two_at_ten_mps(2_000.0);
            l.takeoffs_ms = (1..).zip(takeoffs_ms).collect();
            l
        };
        assert_eq!(launched([0, 0]).launch_bound_ms(), Some(100_000));
        let calm = launched([10_000, 50_000]);
        assert_eq!(calm.launch_bound_ms(), Some(130_000));
        assert_eq!(calm.work_bound_ms(), Some(100_000));
        // Who dies before it takes off has done nothing.
        let mut one_dies = launched([10_000, 50_000]);
        one_dies.ended(40_000, 2);
        assert_eq!(one_dies.launch_bound_ms(), Some(210_000));
        let mut later = launched([10_000, 50_000]);
        later.ended(60_000, 2);
        assert_eq!(later.launch_bound_ms(), Some(200_000));
    }

    #[test]
    fn the_time_that_processes_ran_counts_ground_stations_and_no_pauses() {
        let mut l = two_at_ten_mps(1.0);
        l.paused(10_000, 1);
        l.ended(20_000, 2);
        assert_eq!(l.live_uavs(), Vec::<u16>::new());
        assert_eq!(l.ran_ms(30_000), 10_000 + 20_000 + 30_000);
        l.resumed(30_000, 1);
        l.resumed(30_000, 2);
        assert_eq!(l.live_uavs(), [1], "a process that ended does not go on");
    }
}
