//! The account of one run, live or simulated: who died, who found out and when, who took
//! over the work, what was covered, and the verdict.
//!
//! A driver tells an [`Account`] what happens: processes that start and end, what peers
//! report, what the world recorded, who can reach whom. At the end the account is
//! [concluded](Account::conclude) and gives one [`RunReport`], with the same figures by
//! the same rules for live processes and for virtual time. Facts about the world come
//! from the world, facts about beliefs from the peers' reports; nothing here looks into a
//! peer or listens to the radio. What only a simulator can see, the
//! checks over beliefs, joins the report as its violations.
//!
//! | module | what it accounts for |
//! |---|---|
//! | [`lifetimes`] | which process ran when, which UAV flew; the work bound |
//! | [`detection`] | from a death to its detection by each live peer |
//! | [`work`] | whose cells were open when a peer died, and who took them over |
//! | [`tasks`] | what became of the tasks that were asked for in flight |
//! | [`restarts`] | when a restarted peer was of use again |
//! | [`connectivity`] | how often the swarm fell apart and met again |
//! | [`report`] | the report and its verdict, one JSON schema |
//! | [`text`] | the same for a person |

pub mod connectivity;
pub mod detection;
pub mod lifetimes;
pub mod report;
pub mod restarts;
pub mod tasks;
pub mod text;
pub mod work;

#[cfg(test)]
mod tests;

pub use lifetimes::{Cause, Setting};
pub use report::{Details, Driver, FalseDown, Live, Processes, RunReport, Simulated, Violations};
pub use work::Held;

use crate::check::contours::ContourReport;
use crate::check::counts::CountReport;
use crate::check::crowds::CrowdReport;
use crate::check::detections::DetectionReport;
use crate::check::streets::StreetsReport;
pub use crate::check::tracks::Tracked;
use crate::world::{Fact, Judge, Loss};
use connectivity::Connectivity;
use detection::Detection;
use lifetimes::Lifetimes;
use report::{Coverage, Radio, Swarm};
use restarts::Restarts;
use skein_link::RadioCounters;
use skein_peer::Report;
use skein_peer::input::AskedTask;
use skein_peer::output::{Status, TaskNews};
use std::collections::{BTreeMap, BTreeSet};
use tasks::{TaskReport, Tasks};
use work::Work;

/// Alarms and refusals that are kept; a peer that repeats itself must not fill the
/// report.
const MAX_ALARMS: usize = 50;

/// What a driver adds when a run is over.
#[derive(Clone, Debug)]
pub struct Ending<'a> {
    /// When, milliseconds of scenario time.
    pub now_ms: u64,
    /// What the world saw.
    pub judge: &'a Judge,
    /// How near an aircraft that is no member came at most to a UAV at its height, metres.
    pub nearest_intruder_m: Option<f64>,
    /// How near a UAV came at most to the edge of an obstacle that is on no map, metres.
    pub nearest_obstacle_m: Option<f64>,
    /// How often links that were up went down: by range, by sight, by fault.
    pub link_cuts: (u64, u64, u64),
    /// Rules that the run broke, where somebody checked them.
    pub violations: Option<Violations>,
    /// What only one of the drivers can tell.
    pub details: Details,
}

/// The account of one run.
#[derive(Clone, Debug)]
pub struct Account {
    setting: Setting,
    lifetimes: Lifetimes,
    detection: Detection,
    work: Work,
    restarts: Restarts,
    connectivity: Connectivity,
    radio: RadioCounters,
    /// Obstacles on no map that zones stand round, by the peer that knows most.
    obstacles_found: usize,
    covered_ms: Option<u64>,
    ready: BTreeMap<u16, u32>,
    finished: BTreeSet<u16>,
    /// Who holds a relay position or flies to it, which is over for nobody else.
    relaying: BTreeSet<u16>,
    alarms: Vec<String>,
    failures: Vec<String>,
    tasks: Tasks,
    detections: Vec<DetectionReport>,
    contour: Option<ContourReport>,
    counts: Vec<CountReport>,
    streets: Option<StreetsReport>,
    crowd: Option<CrowdReport>,
    found_ms: Option<u64>,
    over_ms: Option<u64>,
}

impl Account {
    /// The account of a run that has not begun.
    #[must_use]
    pub fn new(setting: Setting) -> Self {
        Self {
            lifetimes: Lifetimes::new(&setting),
            detection: Detection::default(),
            work: Work::new(setting.uavs.len()),
            restarts: Restarts::default(),
            connectivity: Connectivity::default(),
            radio: RadioCounters::default(),
            obstacles_found: 0,
            covered_ms: None,
            ready: BTreeMap::new(),
            finished: BTreeSet::new(),
            relaying: BTreeSet::new(),
            alarms: Vec::new(),
            failures: Vec::new(),
            tasks: Tasks::default(),
            detections: Vec::new(),
            contour: None,
            counts: Vec::new(),
            streets: None,
            crowd: None,
            found_ms: None,
            over_ms: None,
            setting,
        }
    }

    /// A process starts for the first time.
    pub fn started(&mut self, now_ms: u64, peer: u16) {
        self.lifetimes.started(now_ms, peer);
        self.detection.started(peer);
    }

    /// The ground station of its operator holds this task.
    pub fn asked(&mut self, now_ms: u64, task: &AskedTask) {
        self.tasks.asked(now_ms, task);
    }

    /// The time of a mission is over whose own tasks go before what is to be seen, and all who live
    /// know it.
    pub fn over(&mut self, now_ms: u64) {
        self.covered(now_ms);
        self.over_ms.get_or_insert(now_ms);
    }

    /// What ends the mission was found, and all who live know it.
    pub fn found(&mut self, now_ms: u64) {
        self.covered(now_ms);
        self.found_ms.get_or_insert(now_ms);
    }

    /// What is known so far of the sites at which the mission counts, beside what is true.
    pub fn counted(&mut self, reports: Vec<CountReport>) {
        self.counts = reports;
    }

    /// Who was told to be where at the event that the mission watches, beside what is true.
    pub fn gathered(&mut self, report: Option<CrowdReport>) {
        self.crowd = report;
    }

    /// How the streets of the mission are used, beside what is true.
    pub fn used(&mut self, report: Option<StreetsReport>) {
        self.streets = report;
    }

    /// What came so far of the objects that the mission looks for, as the world knows.
    pub fn detected(&mut self, reports: Vec<DetectionReport>) {
        self.detections = reports;
    }

    /// What came so far of the contour that is flown along, as the world knows.
    pub fn traced(&mut self, report: Option<ContourReport>) {
        self.contour = report;
    }

    /// What the world knows of a target that is to be followed.
    pub fn tracked(&mut self, task: (u16, u32), tracked: &Tracked) {
        self.tasks.tracked(task, tracked);
    }

    /// A process starts again, with its journal or with a fresh disk.
    pub fn restarted(&mut self, now_ms: u64, peer: u16, fresh_disk: bool) {
        let before = self.detection.life(peer);
        self.started(now_ms, peer);
        self.work.restarted(peer);
        self.restarts.restarted(now_ms, peer, fresh_disk, before);
        self.finished.remove(&peer);
        self.relaying.remove(&peer);
    }

    /// A process ends. Gives what the peer held; one that has ended before ends no more.
    pub fn ended(&mut self, now_ms: u64, peer: u16, cause: Cause) -> Held {
        if !self.lifetimes.ended(now_ms, peer) {
            return Held::default();
        }
        self.detection.ended(now_ms, peer);
        if cause.takes_airframe() {
            self.lifetimes.airframe_gone(now_ms, peer);
        }
        self.work.ended(now_ms, peer, cause)
    }

    /// When the last process of a peer ended, milliseconds; `None` while one runs, and of those
    /// that never did.
    #[must_use]
    pub fn ended_ms(&self, peer: u16) -> Option<u64> {
        self.lifetimes.ended_ms(peer)
    }

    /// The battery of a UAV lasts for less: it has something to spend until then.
    pub fn limited(&mut self, peer: u16, until_ms: u64) {
        self.lifetimes.limited(peer, until_ms);
    }

    /// A process stands still.
    pub fn paused(&mut self, now_ms: u64, peer: u16) {
        self.lifetimes.paused(now_ms, peer);
    }

    /// A process goes on after standing still.
    pub fn resumed(&mut self, now_ms: u64, peer: u16) {
        self.lifetimes.resumed(now_ms, peer);
    }

    /// A peer reports something; gives a line worth showing, if it is one.
    pub fn reported(&mut self, now_ms: u64, peer: u16, report: &Report) -> Option<String> {
        match report {
            Report::Booted { incarnation } => {
                self.detection.lives(peer, *incarnation);
                self.restarts.booted(peer, *incarnation);
                // Whoever was silent speaks again.
                self.lifetimes.resumed(now_ms, peer);
                None
            }
            Report::Ready {
                revision,
                loop_hash,
                cells,
            } => {
                // Whoever believed an older revision finished is to finish this one again.
                if self.ready.insert(peer, *revision) < Some(*revision) {
                    self.finished.remove(&peer);
                }
                self.work.ready(peer, *revision, *loop_hash, *cells);
                None
            }
            Report::Membership {
                peer: of,
                incarnation,
                status,
            } => {
                self.detection
                    .believed(now_ms, peer, of.0, (*incarnation, *status));
                None
            }
            Report::Claim { legs, held, .. } => {
                let flown = self.work.cells_of(legs);
                if !flown.is_empty() {
                    self.restarts.productive(now_ms, peer);
                }
                self.work.listed(now_ms, peer, &flown, held)
            }
            Report::Covered { cells } => {
                self.restarts.productive(now_ms, peer);
                self.work.saw(now_ms, peer, cells);
                None
            }
            Report::Finished { .. } => {
                self.restarts.productive(now_ms, peer);
                self.finished
                    .insert(peer)
                    .then(|| format!("{} believes the mission finished", self.name(peer)))
            }
            Report::Alarm { text } => self.alarm(format!(
                "{:.1} s, {}: {text}",
                secs(now_ms),
                self.name(peer)
            )),
            Report::Refused { reason } => self.alarm(format!(
                "{:.1} s, {} refused bytes: {reason}",
                secs(now_ms),
                self.name(peer)
            )),
            // It is of no use while its twin speaks.
            Report::Silenced => {
                self.lifetimes.paused(now_ms, peer);
                None
            }
            Report::Task { id, news, .. } => {
                match news {
                    TaskNews::Relays | TaskNews::Tracks => {
                        self.relaying.insert(peer);
                    }
                    TaskNews::Left => {
                        self.relaying.remove(&peer);
                    }
                    _ => {}
                }
                // What UAVs ask for has registers of its own.
                if !self.setting.uavs.contains_key(&id.author) {
                    self.tasks.reported(peer, report);
                }
                None
            }
            Report::Detected { id, told } => (id.author == peer).then(|| told.sentence(id.author)),
            Report::Crowd { told } => (told.look.by == peer).then(|| told.sentence()),
            Report::Found { mission } => {
                let found = mission.zones_round_found();
                let is_more = found > self.obstacles_found;
                self.obstacles_found = self.obstacles_found.max(found);
                is_more.then(|| skein_peer::found_obstacles::sentence(mission))
            }
            Report::Round { .. } | Report::Revised { .. } | Report::Traced { .. } => None,
        }
    }

    /// What people call a peer.
    fn name(&self, peer: u16) -> String {
        text::name(peer, self.setting.uavs.contains_key(&peer))
    }

    fn alarm(&mut self, text: String) -> Option<String> {
        if self.alarms.len() < MAX_ALARMS {
            self.alarms.push(text.clone());
            return Some(text);
        }
        None
    }

    /// The world recorded something; gives a line worth showing, if it is one.
    pub fn happened(&mut self, now_ms: u64, fact: &Fact) -> Option<String> {
        match fact {
            Fact::ZoneEntry { uav, zone, .. } => {
                Some(format!("uav{uav} entered no-fly zone {zone}"))
            }
            Fact::Lost { uav, cause, .. } if *cause != Loss::Killed => {
                self.ended(now_ms, *uav, Cause::Lost);
                let text = format!("uav{uav} is lost: {cause:?}");
                self.failures.push(text.clone());
                Some(text)
            }
            Fact::Intruded(i) if i.is_warned => {
                let text = format!(
                    "uav{} kept {:.1} m from intruder {}",
                    i.uav, i.across_m, i.intruder
                );
                self.failures.push(text.clone());
                Some(text)
            }
            Fact::Collided(c) if c.is_free => {
                let text = format!("uav{} flew into obstacle {}", c.uav, c.obstacle);
                self.failures.push(text.clone());
                Some(text)
            }
            Fact::Seen { .. }
            | Fact::TooClose(_)
            | Fact::Intruded(_)
            | Fact::Collided(_)
            | Fact::TookOff { .. }
            | Fact::Lost { .. }
            | Fact::Failsafe { .. } => None,
        }
    }

    /// Every coverable cell has been seen, as often as the mission asks for.
    pub fn covered(&mut self, now_ms: u64) {
        self.covered_ms.get_or_insert(now_ms);
    }

    /// The operator gave another mission: what was covered of the one before says nothing,
    /// and there is no bound on the work of two.
    pub fn revised(&mut self) {
        self.covered_ms = None;
        self.found_ms = None;
        self.over_ms = None;
        self.lifetimes.revised();
    }

    /// The components of the true link graph at present; gives a line when one fell
    /// apart or some met. Peers that come and go do neither.
    pub fn connected(&mut self, components: &[Vec<u16>]) -> Option<String> {
        self.connectivity.observe(components)
    }

    /// Adds what the radio of one life of a peer did.
    pub fn radio(&mut self, of: &RadioCounters) {
        let sum = &mut self.radio;
        sum.sent += of.sent;
        sum.sent_bytes += of.sent_bytes;
        sum.received += of.received;
        sum.multi_hop += of.multi_hop;
        sum.refused += of.refused;
        sum.overrun += of.overrun;
        sum.arrived += of.arrived;
        sum.late += of.late;
        sum.ages.add(&of.ages);
        merge(&mut sum.relayed_by, &of.relayed_by);
        merge(&mut sum.bytes_by_link, &of.bytes_by_link);
        merge(&mut sum.lost, &of.lost);
    }

    /// Something happened for which the run has failed, whatever else it shows.
    pub fn failed(&mut self, why: String) {
        self.failures.push(why);
    }

    /// Whether that peer has ever held a mission and derived its loop.
    #[must_use]
    pub fn is_ready(&self, peer: u16) -> bool {
        self.ready.contains_key(&peer)
    }

    /// Whether that peer believes its newest mission finished.
    #[must_use]
    pub fn is_finished(&self, peer: u16) -> bool {
        self.finished.contains(&peer)
    }

    /// Whether that peer has nothing to cover any more, as it believes: its newest mission is
    /// finished, but for a relay position that it holds.
    #[must_use]
    pub fn is_through(&self, peer: u16) -> bool {
        self.is_finished(peer) || self.covered_ms.is_some() && self.relaying.contains(&peer)
    }

    /// When every coverable cell had been seen, milliseconds.
    #[must_use]
    pub fn covered_ms(&self) -> Option<u64> {
        self.covered_ms
    }

    /// UAVs in the air whose computers run, ascending.
    #[must_use]
    pub fn live_uavs(&self) -> Vec<u16> {
        self.lifetimes.live_uavs()
    }

    /// Parts of the swarm that cannot talk to each other, at present.
    #[must_use]
    pub fn n_components(&self) -> usize {
        self.connectivity.n_components()
    }

    /// Cells of dead peers taken over so far.
    #[must_use]
    pub fn taken_over(&self) -> usize {
        self.work.taken_over()
    }

    /// Draws up the report; call it when everybody is gone.
    #[must_use]
    pub fn conclude(&self, ending: Ending<'_>) -> RunReport {
        let now_ms = ending.now_ms;
        let coverage = Coverage::of(ending.judge, self.setting.needed_share);
        let (through, unfinished): (Vec<u16>, Vec<u16>) = self
            .live_uavs()
            .into_iter()
            .partition(|id| self.is_through(*id));
        let completed = self.covered_ms.is_some() && unfinished.is_empty() && !through.is_empty();
        let (finished, relaying) = through.into_iter().partition(|id| self.is_finished(*id));
        let work_bound_ms = self.lifetimes.work_bound_ms();
        let launch_bound_ms = self.lifetimes.launch_bound_ms();
        let (driver, simulated, live) = match ending.details {
            Details::Simulated(s) => (Driver::Sim, Some(s), None),
            Details::Live(l) => (Driver::Live, None, Some(l)),
        };
        let mut report = RunReport {
            schema_version: report::SCHEMA_VERSION,
            scenario: self.setting.scenario.clone(),
            seed: self.setting.seed,
            uavs: self.setting.uavs.keys().copied().collect(),
            driver,
            completed,
            end_ms: now_ms,
            peer_ms: self.lifetimes.ran_ms(now_ms),
            makespan_ms: self.covered_ms,
            work_bound_ms,
            makespan_over_work_bound: report::ratio(self.covered_ms, work_bound_ms),
            launch_bound_ms,
            makespan_over_launch_bound: report::ratio(self.covered_ms, launch_bound_ms),
            coverage,
            zone_entries: ending.judge.entries(),
            nearest_approach_m: ending.judge.closest().map(|a| a.distance_m),
            nearest_intruder_m: ending.nearest_intruder_m,
            nearest_obstacle_m: ending.nearest_obstacle_m,
            obstacles_found: ending.nearest_obstacle_m.map(|_| self.obstacles_found),
            revisit_ms: ending.judge.longest_gap_ms(),
            revisit_late_ms: ending.judge.watched_gap_ms(now_ms / 2),
            kills: self.work.kills(&self.detection),
            restarts: self.restarts.reports(),
            tasks: self.tasks.reports(ending.judge),
            detections: self.detections.clone(),
            contour: self.contour.clone(),
            counts: self.counts.clone(),
            streets: self.streets.clone(),
            layers: ending.judge.layers().into_iter().map(Into::into).collect(),
            crowd: self.crowd.clone(),
            found_ms: self.found_ms,
            over_ms: self.over_ms,
            finished,
            relaying,
            unfinished,
            swarm: Swarm {
                splits: self.connectivity.splits,
                merges: self.connectivity.merges,
                most_components: self.connectivity.most,
            },
            radio: Radio::of(&self.radio, self.lifetimes.ran_ms(now_ms), ending.link_cuts),
            alarms: self.alarms.clone(),
            violations: ending.violations,
            simulated,
            live,
            ..RunReport::default()
        };
        let late = |t: &TaskReport| {
            let is_visit = self.setting.visits.contains(&t.name);
            t.late(self.setting.max_visit_ms.filter(|_| is_visit)?, now_ms)
        };
        let late = report.tasks.iter().filter_map(late);
        let failures: Vec<String> = self.failures.iter().cloned().chain(late).collect();
        report.judge(&failures);
        report
    }
}

fn merge<K: Ord + Copy>(sum: &mut Vec<(K, u64)>, more: &[(K, u64)]) {
    let mut all: BTreeMap<K, u64> = sum.iter().copied().collect();
    for (k, v) in more {
        *all.entry(*k).or_default() += v;
    }
    *sum = all.into_iter().collect();
}

/// Whether a status ends a life, in somebody's belief.
fn is_down(status: Status) -> bool {
    status == Status::Down
}

/// Seconds of milliseconds.
#[must_use]
#[allow(clippy::cast_precision_loss, reason = "a time to be shown")]
pub fn secs(ms: u64) -> f64 {
    ms as f64 / 1000.0
}
