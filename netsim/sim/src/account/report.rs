//! The report of one run: one JSON schema for a live trial and for a simulated run, so
//! that the same scenario can be compared figure by figure.
//!
//! Times of a run are milliseconds of scenario time since it began, durations
//! milliseconds of scenario time. What one driver cannot tell is `null`.

use super::lifetimes::Cause;
use super::tasks::TaskReport;
use crate::check::contours::ContourReport;
use crate::check::counts::CountReport;
use crate::check::crowds::CrowdReport;
use crate::check::detections::DetectionReport;
use crate::check::footprint::FootprintErrors;
use crate::check::streets::StreetsReport;
use crate::check::wind::WindErrors;
use crate::check::{Findings, Violation};
use crate::world::{GroundSeen, Judge, LayerSeen};
use serde::{Deserialize, Serialize};
use skein_link::{RadioCounters, Reason};
use std::collections::{BTreeMap, BTreeSet};

/// Counted up when a field changes its meaning or goes; new fields leave it as it is.
pub const SCHEMA_VERSION: u32 = 1;

/// What a run came to.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RunReport {
    /// [`SCHEMA_VERSION`] of the program that wrote it.
    pub schema_version: u32,
    /// Name of the scenario.
    pub scenario: String,
    /// Seed of the run.
    pub seed: u64,
    /// The UAVs; any other peer is the ground station.
    pub uavs: Vec<u16>,
    /// `sim` or `live`.
    pub driver: Driver,
    /// Whether the run is as it must be: completed, and nothing in `reasons`.
    pub passed: bool,
    /// Why not, if not, one sentence each.
    pub reasons: Vec<String>,
    /// Whether every coverable cell was seen and every live UAV, one at least, believes the
    /// mission finished.
    pub completed: bool,
    /// When the run ended, ms.
    pub end_ms: u64,
    /// How long all processes ran, together, ms.
    pub peer_ms: u64,
    /// When the last coverable cell was seen, ms.
    pub makespan_ms: Option<u64>,
    /// When it would have been, had everybody known everything at once, ms: same seed,
    /// world and faults, divided by the same rule at each loss and return, or as the swarm
    /// itself did where that was sooner, for a coordinator could have flown so too.
    /// Simulated runs with few deaths only.
    pub baseline_ms: Option<u64>,
    /// `makespan_ms` over `baseline_ms`.
    pub makespan_over_baseline: Option<f64>,
    /// The least time by which all UAVs alive have flown the length of all cells at their
    /// mean speed over the ground, ms.
    pub work_bound_ms: Option<u64>,
    /// `makespan_ms` over `work_bound_ms`.
    pub makespan_over_work_bound: Option<f64>,
    /// The work bound where each UAV flies from its take-off on, ms.
    pub launch_bound_ms: Option<u64>,
    /// `makespan_ms` over `launch_bound_ms`.
    pub makespan_over_launch_bound: Option<f64>,
    /// When its time was over, of a mission whose own tasks go before what is to be seen, and which
    /// is over by that, whatever is left to be seen, ms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub over_ms: Option<u64>,
    /// When something was found that ends the mission, whatever is left to be seen, ms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub found_ms: Option<u64>,
    /// What was seen of the area, lines or points.
    pub coverage: Coverage,
    /// Flown segments that entered a no-fly zone.
    pub zone_entries: usize,
    /// Smallest distance of two airborne UAVs, m (recorded, S1).
    pub nearest_approach_m: Option<f64>,
    /// How near an aircraft that is no member came at most to a UAV at its height, metres; none
    /// where none did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nearest_intruder_m: Option<f64>,
    /// How near a UAV came at most to the edge of an obstacle that is on no map, metres; none where
    /// there are none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nearest_obstacle_m: Option<f64>,
    /// How many of such obstacles UAVs found and told each other of.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub obstacles_found: Option<usize>,
    /// The longest time in which a cell was not seen again, ms, where everything is to be
    /// seen several times.
    pub revisit_ms: Option<u64>,
    /// The same of visits in the second half of the mission, where it goes on once everything is
    /// seen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub revisit_late_ms: Option<u64>,
    /// Each process that ended before the run did, in the order of the times.
    pub kills: Vec<KillReport>,
    /// Each restart, in the order of the times.
    pub restarts: Vec<RestartReport>,
    /// Each task other than coverage that was asked for in flight.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tasks: Vec<TaskReport>,
    /// Each object that the mission looks for and a UAV told of.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub detections: Vec<DetectionReport>,
    /// The contour that was flown along.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contour: Option<ContourReport>,
    /// Each site at which vehicles are counted: what is known, beside what is true.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub counts: Vec<CountReport>,
    /// How the streets of the mission are used, and hinted ways: what is known, beside what is
    /// true.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub streets: Option<StreetsReport>,
    /// Each lap of a mission that is flown in layers: when all of it was seen from there.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub layers: Vec<LayerReport>,
    /// Who was told to be where at the event that the mission watches, beside what is true.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crowd: Option<CrowdReport>,
    /// Live UAVs at the end that believe the mission finished.
    pub finished: Vec<u16>,
    /// Live UAVs at the end that hold a relay position, with everything covered.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub relaying: Vec<u16>,
    /// Live UAVs at the end that do neither.
    pub unfinished: Vec<u16>,
    /// How the swarm held together.
    pub swarm: Swarm,
    /// What the radios did.
    pub radio: Radio,
    /// What people should look at: the first alarms and refusals of peers.
    pub alarms: Vec<String>,
    /// Rules of the protocol that were broken; `null` where nobody looked into the peers.
    pub violations: Option<Violations>,
    /// What only a simulated run can tell.
    pub simulated: Option<Simulated>,
    /// What only a live trial can tell.
    pub live: Option<Live>,
}

/// What came of one lap of a mission that is flown in layers, by the true heights of who looked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LayerReport {
    /// Which lap, from 1.
    pub lap: u16,
    /// The lowest slot of its layer above the origin, m.
    pub height_m: f64,
    /// When the last of its cells was seen, ms.
    pub seen_ms: Option<u64>,
    /// Cells that were not seen from there.
    pub lacking: usize,
}

impl LayerReport {
    /// The same in a line.
    #[must_use]
    pub fn line(&self) -> String {
        let (lap, height_m) = (self.lap, self.height_m);
        match self.seen_ms {
            Some(ms) => format!(
                "{height_m} m (lap {lap}): all seen at {:.1} s",
                super::secs(ms)
            ),
            None => format!("{height_m} m (lap {lap}): {} cells not seen", self.lacking),
        }
    }
}

impl From<LayerSeen> for LayerReport {
    fn from(seen: LayerSeen) -> Self {
        Self {
            lap: seen.lap,
            height_m: seen.height_m,
            seen_ms: seen.seen_ms,
            lacking: seen.lacking,
        }
    }
}

/// What moved the run on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Driver {
    /// Virtual time, in one process.
    #[default]
    Sim,
    /// Real processes, in real time times a factor.
    Live,
}

/// What only a simulated run can tell.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Simulated {
    /// Hash of the history, hexadecimal: the same seed gives the same on every machine.
    pub history_hash: String,
    /// Events in the history.
    pub events: u64,
    /// Whether cells were beyond anybody's endurance when it ended.
    pub infeasible: bool,
    /// Living peers in reach that were declared down.
    pub false_downs: Vec<FalseDown>,
    /// Bytes handed to the radios with their headers, by kind of record.
    pub bytes_by_kind: BTreeMap<String, u64>,
    /// How wrong the winds were by which UAVs flew, where they estimate it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wind_errors: Option<WindErrors>,
    /// How far pictures were from where they were planned, where cameras may tilt.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub footprint_errors: Option<FootprintErrors>,
}

/// What only a live trial can tell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Live {
    /// Wall time of the flight, s.
    pub wall_s: f64,
    /// Scenario seconds per second of wall time: asked for.
    pub time_scale: f64,
    /// What was reached: scenario time over wall time of the whole flight.
    pub mean_time_scale: f64,
    /// The lowest to which it had to be lowered, because the machine was too slow.
    pub lowest_time_scale: f64,
    /// How long time stood still for UAVs that owed the answer to a percept, s.
    pub held_s: f64,
    /// Largest delay of a setpoint behind its percept, ms.
    pub setpoint_delay_ms: u64,
    /// Setpoints that arrived, of all UAVs.
    pub setpoints: u64,
    /// How often an airframe loitered by itself although its computer ran.
    pub starved: u64,
    /// What the peers' processes used that were there at the end.
    pub processes: Processes,
}

/// What the processes of a trial used; zeros where the system does not tell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Processes {
    /// Of how many it is told.
    pub counted: usize,
    /// Time of processors of one of them, s: the mean.
    pub cpu_s_mean: f64,
    /// And the largest.
    pub cpu_s_max: f64,
    /// The most memory that one of them held at once, MB: the mean.
    pub peak_mb_mean: f64,
    /// And the largest.
    pub peak_mb_max: f64,
    /// Time of processors of the trial itself, s.
    pub trial_cpu_s: f64,
}

/// Which driver ran it, and what only that one can tell.
#[derive(Clone, Debug, PartialEq)]
pub enum Details {
    /// Virtual time.
    Simulated(Simulated),
    /// Real processes.
    Live(Live),
}

/// A living peer in reach that was declared down.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FalseDown {
    /// When, ms.
    pub at_ms: u64,
    /// By whom.
    pub by: u16,
    /// Whom.
    pub of: u16,
}

/// Rules of the protocol that were broken.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Violations {
    /// How often each rule was broken; empty when all held.
    pub counts: BTreeMap<String, u64>,
    /// The first violations of each rule.
    pub first: Vec<Violation>,
}

/// What was seen.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Coverage {
    /// Coverable cells that were seen whole.
    pub covered_cells: usize,
    /// Cells that some UAV can see whole on a straight pass.
    pub coverable_cells: usize,
    /// All cells of the mission.
    pub cells: usize,
    /// `covered_cells` over `coverable_cells`, 0 to 1.
    pub covered_share: f64,
    /// Share of the area that is coverable, 0 to 1.
    pub coverable_share: f64,
    /// The share of the area that the scenario asks for, 0 to 1.
    pub needed_share: f64,
    /// Whether the mission was changed in flight: the share that is asked for is that of the one
    /// that the scenario began with.
    #[serde(default)]
    pub revised: bool,
    /// How many cells cannot be seen, by reason.
    pub uncoverable: BTreeMap<String, usize>,
    /// Which cells those are, by column and row of the lane grid.
    pub uncoverable_cells: Vec<Uncovered>,
    /// Coverable cells that were not seen, by column and row.
    pub missed: Vec<(i16, i16)>,
    /// How much of the open ground in coverable cells was in sight, past all buildings; none
    /// where none stand, or no area is to be seen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ground: Option<GroundSeen>,
}

/// A cell that cannot be seen.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Uncovered {
    /// Column of the lane grid.
    pub col: i16,
    /// Row of the lane grid.
    pub row: i16,
    /// Why.
    pub reason: String,
}

/// What became of a peer that ended, and of its work.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct KillReport {
    /// Who.
    pub peer: u16,
    /// When, ms.
    pub at_ms: u64,
    /// Why.
    pub cause: Cause,
    /// Cells that it listed and nobody had seen.
    pub cells_held: usize,
    /// The same over an even share of the whole loop.
    pub share_held: f64,
    /// Who found out first.
    pub detected_by: Option<u16>,
    /// How long after the end, ms.
    pub detection_ms: Option<u64>,
    /// How long after the end each live peer found out, ms.
    pub detections_ms: BTreeMap<u16, u64>,
    /// Cells that somebody else listed already when it ended.
    pub listed_already: usize,
    /// Who listed its other cells.
    pub taken_over_by: Vec<Taker>,
    /// Cells that it listed again itself, after a restart.
    pub taken_back: usize,
    /// Cells that somebody saw without having listed them.
    pub seen_in_passing: usize,
    /// When the last of its cells was listed or seen, ms after the end.
    pub takeover_ms: Option<u64>,
    /// Cells of a loop that a newer mission replaced before anybody took them.
    pub superseded: usize,
    /// Cells that nobody listed or saw.
    pub left: usize,
    /// Who flew its cells in the end, and how many.
    pub flown_by: BTreeMap<u16, usize>,
}

/// A peer that took over cells of another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Taker {
    /// Who.
    pub peer: u16,
    /// How many cells.
    pub cells: usize,
    /// When the first of them, ms after the end.
    pub first_ms: u64,
}

/// What became of a peer that was started again.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RestartReport {
    /// Who.
    pub peer: u16,
    /// When, ms.
    pub at_ms: u64,
    /// Whether its journal was taken away.
    pub fresh_disk: bool,
    /// Its life before.
    pub incarnation_before: Option<u32>,
    /// Its life after.
    pub incarnation_after: Option<u32>,
    /// When it listed or saw a cell or believed the mission finished, ms after the restart.
    pub productive_ms: Option<u64>,
}

/// How the swarm held together, by the true link graph.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Swarm {
    /// How often one component became more.
    pub splits: usize,
    /// How often more became fewer.
    pub merges: usize,
    /// The largest number of components at once.
    pub most_components: usize,
}

/// What the radios did.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Radio {
    /// Transmissions of all peers.
    pub sent: u64,
    /// Their bytes.
    pub bytes_sent: u64,
    /// Bytes transmitted per second that a peer ran, ground station included.
    pub bytes_per_peer_s: f64,
    /// Receptions.
    pub received: u64,
    /// Receptions of records that had been passed on at least once.
    pub multi_hop: u64,
    /// Who passed those on, and how many.
    pub relayed_by: BTreeMap<u16, u64>,
    /// Bytes of records that arrived: by who transmitted them, then by who received them.
    #[serde(default)]
    pub bytes_by_link: BTreeMap<u16, BTreeMap<u16, u64>>,
    /// Receptions that failed and transmissions never begun, by reason.
    pub lost: BTreeMap<String, u64>,
    /// Links that were up and went down, by reason: `range`, `sight`, `fault`.
    pub link_cuts: BTreeMap<String, u64>,
    /// Messages dropped because a process was too slow to take them.
    pub overrun: u64,
    /// From when a record was handed to a radio until another peer was given it, ms of
    /// scenario time: half of them took no longer. Trials only.
    pub age_ms_p50: Option<u64>,
    /// And 99 of 100.
    pub age_ms_p99: Option<u64>,
    /// Share of what the transport brought half a second late or later, 0 to 1. Trials only.
    pub late_share: Option<f64>,
}

impl Radio {
    /// Of what all radios did in `ran_ms` of all processes together.
    #[must_use]
    pub fn of(all: &RadioCounters, ran_ms: u64, cuts: (u64, u64, u64)) -> Self {
        let cuts = [("range", cuts.0), ("sight", cuts.1), ("fault", cuts.2)];
        let lost = all.lost.iter().map(|(r, n)| (reason(*r).to_owned(), *n));
        #[allow(clippy::cast_precision_loss, reason = "far below 2^52 bytes")]
        let bytes = all.sent_bytes as f64;
        Self {
            sent: all.sent,
            bytes_sent: all.sent_bytes,
            bytes_per_peer_s: if ran_ms > 0 {
                bytes / super::secs(ran_ms)
            } else {
                0.0
            },
            received: all.received,
            multi_hop: all.multi_hop,
            relayed_by: all.relayed_by.iter().copied().collect(),
            bytes_by_link: by_link(&all.bytes_by_link),
            lost: lost.collect(),
            link_cuts: cuts.map(|(r, n)| (r.to_owned(), n)).into(),
            overrun: all.overrun,
            age_ms_p50: all.ages.quantile_ms(0.5),
            age_ms_p99: all.ages.quantile_ms(0.99),
            #[allow(clippy::cast_precision_loss, reason = "far below 2^52 records")]
            late_share: (all.arrived > 0).then(|| all.late as f64 / all.arrived as f64),
        }
    }
}

fn by_link(flat: &[((u16, u16), u64)]) -> BTreeMap<u16, BTreeMap<u16, u64>> {
    let mut links: BTreeMap<u16, BTreeMap<u16, u64>> = BTreeMap::new();
    for ((from, to), bytes) in flat {
        links.entry(*from).or_default().insert(*to, *bytes);
    }
    links
}

fn reason(reason: Reason) -> &'static str {
    match reason {
        Reason::Range => "range",
        Reason::Sight => "sight",
        Reason::Cut => "fault",
        Reason::Loss => "loss",
        Reason::QueueAge => "queue age",
        Reason::Collision => "collision",
    }
}

impl Coverage {
    /// What the world saw.
    #[must_use]
    pub fn of(judge: &Judge, needed_share: f64) -> Self {
        let survey = judge.survey();
        let mut uncoverable: BTreeMap<String, usize> = BTreeMap::new();
        let mut uncoverable_cells = Vec::new();
        for cell in survey.cells() {
            if let Some(reason) = &cell.uncoverable {
                let reason = reason.to_string();
                *uncoverable.entry(reason.clone()).or_default() += 1;
                uncoverable_cells.push(Uncovered {
                    col: cell.id.col,
                    row: cell.id.row,
                    reason,
                });
            }
        }
        let missed = survey
            .cells()
            .iter()
            .filter(|cell| cell.uncoverable.is_none() && judge.sighting(cell.id).is_none())
            .map(|cell| (cell.id.col, cell.id.row))
            .collect();
        Self {
            covered_cells: judge.n_covered(),
            coverable_cells: survey.n_coverable(),
            cells: survey.cells().len(),
            covered_share: judge.covered_share(),
            coverable_share: survey.coverable_share(),
            needed_share,
            revised: judge.is_revised(),
            uncoverable,
            uncoverable_cells,
            missed,
            ground: judge.ground_seen(),
        }
    }

    /// Whether as much of the area can be covered as the scenario asks for. What its operator
    /// takes away in flight is no failure of those who fly.
    #[must_use]
    pub fn is_enough(&self) -> bool {
        self.revised || self.coverable_share >= self.needed_share
    }
}

impl RunReport {
    /// A run that a panic ended.
    #[must_use]
    pub fn of_a_panic(scenario: String, seed: u64, violation: Violation) -> Self {
        let mut report = Self {
            schema_version: SCHEMA_VERSION,
            scenario,
            seed,
            violations: Some(Violations {
                counts: BTreeMap::from([(violation.check.to_string(), 1)]),
                first: vec![violation],
            }),
            ..Self::default()
        };
        report.judge(&[]);
        report
    }

    /// Whether losses left one UAV of several: alone it may search a town for as long as a mission
    /// takes, and never come upon what drives there.
    fn is_one_left(&self) -> bool {
        let is_back = |k: &KillReport| {
            let mut again = self.restarts.iter();
            again.any(|r| r.peer == k.peer && r.at_ms > k.at_ms)
        };
        let lost = self.kills.iter().filter(|k| !is_back(k));
        let lost: BTreeSet<u16> = lost.map(|k| k.peer).collect();
        !lost.is_empty() && self.uavs.len() <= lost.len() + 1
    }

    /// The verdict: every reason for which the run has failed. `failures` are those that
    /// the driver names.
    pub(super) fn judge(&mut self, failures: &[String]) {
        let mut reasons = failures.to_vec();
        let c = &self.coverage;
        if self.over_ms.is_some() {
            let mut brought = self.tasks.iter().filter_map(|t| t.tracked.as_ref());
            if brought.any(|t| t.first_ms.is_none()) && !self.is_one_left() {
                reasons.push("nobody ever saw what the mission was to follow".to_owned());
            }
        } else if self.found_ms.is_some() {
            let mut asked = self
                .detections
                .iter()
                .filter(|d| d.to_follow && !d.withdrawn);
            if asked.all(|d| d.followed_ms.is_none()) && !self.finished.is_empty() {
                reasons.push("nobody watched what was found".to_owned());
            }
        } else if c.covered_cells < c.coverable_cells {
            let n = c.coverable_cells - c.covered_cells;
            reasons.push(format!("{n} coverable cells were not seen"));
        } else if self.makespan_ms.is_none() {
            reasons.push("not everything was seen as often as it is to be".to_owned());
        }
        if !c.is_enough() {
            reasons.push(format!(
                "only {:.1} % of the area is coverable, {:.1} % are asked for",
                c.coverable_share * 100.0,
                c.needed_share * 100.0
            ));
        }
        if self.zone_entries > 0 {
            let n = self.zone_entries;
            reasons.push(format!("no-fly zones were entered {n} times"));
        }
        if [&self.finished, &self.relaying, &self.unfinished]
            .iter()
            .all(|ids| ids.is_empty())
        {
            reasons.push("no UAV is left".to_owned());
        }
        if !self.unfinished.is_empty() {
            let n = self.unfinished.len();
            reasons.push(format!("{n} live UAVs do not believe the mission finished"));
        }
        if self.simulated.as_ref().is_some_and(|s| s.infeasible) {
            reasons.push("some cells are beyond anybody's endurance".to_owned());
        }
        if let Some(v) = &self.violations {
            for (check, n) in &v.counts {
                reasons.push(format!("rule {check} was broken {n} times"));
            }
        }
        self.passed = reasons.is_empty();
        self.reasons = reasons;
    }

    /// Rules broken after all else was over.
    pub(crate) fn add_violations(&mut self, found: &Findings) {
        let violations = self.violations.get_or_insert_default();
        for (check, n) in &found.counts {
            *violations.counts.entry((*check).to_owned()).or_default() += n;
            self.reasons
                .push(format!("rule {check} was broken {n} times on the way home"));
        }
        violations.first.extend(found.violations.iter().cloned());
        self.passed &= found.counts.is_empty();
    }

    /// Sets the makespan against that of the omniscient baseline, where both have one.
    pub fn compare(&mut self, baseline_ms: Option<u64>) {
        self.baseline_ms = baseline_ms.map(|ms| ms.min(self.makespan_ms.unwrap_or(ms)));
        self.makespan_over_baseline = ratio(self.makespan_ms, self.baseline_ms);
    }
}

/// The ratio of two times, where both are known.
pub(super) fn ratio(a_ms: Option<u64>, b_ms: Option<u64>) -> Option<f64> {
    #[allow(clippy::cast_precision_loss, reason = "runs last less than 2^52 ms")]
    let ratio = |(a, b): (u64, u64)| a as f64 / b.max(1) as f64;
    a_ms.zip(b_ms).map(ratio)
}
