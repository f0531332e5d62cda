//! From what a driver hears of peers and knows of its world to the words of the model: the same
//! for simulated runs and live trials.

use crate::cells::Cells;
use crate::model::event::{Belief, Bid, Event, Origin, What};
use crate::model::frame::{Frame, Pose, State, UavState};
use crate::model::scene::Driver;
use crate::model::{End, Place, Record, Scene, rounded};
use crate::stage;
use skein_geometry::frame::Point;
use skein_netsim::account::{RunReport, text::name};
use skein_netsim::fault::Fault;
use skein_netsim::radio::LinkTable;
use skein_netsim::spec::Spec;
use skein_netsim::world::World;
use skein_peer::criteria::looks_name;
use skein_peer::offload::MissionGeometry;
use skein_peer::output::{Status, TaskNews};
use skein_peer::wire::detection::Stands;
use skein_peer::{PeerId, Report};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// A UAV that holds that the mission is finished is at home within so many turn radii of the
/// base: it loiters there on one, others beside it.
const HOME_TURN_RADII: f64 = 4.0;

/// Rounds of which bids are kept: a new one makes the older ones history.
const MAX_ROUNDS: usize = 16;

/// What became of one peer's process, as far as was told.
#[derive(Clone, Debug, Default)]
struct Process {
    /// It ran, and is no more.
    ended: bool,
    /// It stands still.
    paused: bool,
    /// Another one speaks under its id.
    silent: bool,
    /// On which loop it works.
    loop_hash: Option<u64>,
    /// It holds that the mission is finished.
    finished: bool,
}

/// Tells of one run in the words of the model. Give it everything in the order of its times,
/// and [take](Observer::take) what it says.
#[derive(Debug)]
pub struct Observer {
    scene: Scene,
    origin: skein_geometry::frame::Origin,
    base: Point,
    home_m: f64,
    /// The newest mission and its loop that a peer has begun.
    newest: (u32, u64),
    /// What was derived from missions that were given.
    geometries: Vec<Arc<MissionGeometry>>,
    processes: BTreeMap<u16, Process>,
    /// Who holds whom for down.
    down: BTreeMap<u16, BTreeSet<u16>>,
    cells: Cells,
    /// The bids of the newest rounds, by counter and members: a swarm that is divided has two
    /// rounds of one counter.
    rounds: BTreeMap<(u32, Vec<u16>), Vec<Bid>>,
    /// When each peer ended last, milliseconds.
    ended_ms: BTreeMap<u16, u64>,
    components: Vec<Vec<u16>>,
    all_covered: bool,
    said: Vec<Record>,
}

impl Observer {
    /// Of a run that has not begun: says its scene.
    #[must_use]
    pub fn new(
        spec: &Spec,
        geometry: Option<&Arc<MissionGeometry>>,
        seed: u64,
        driver: Driver,
    ) -> Self {
        let scene = stage::scene(spec, geometry, seed, driver);
        let mission = &spec.mission;
        let hash = geometry.map_or(0, |g| g.coverage_loop.hash());
        Self {
            origin: stage::origin(mission),
            base: mission.base_m(),
            home_m: HOME_TURN_RADII * mission.turn_radius_m(),
            // Revision 0 is none: the first peer that begins one begins this scene.
            newest: (0, hash),
            geometries: geometry.cloned().into_iter().collect(),
            processes: BTreeMap::new(),
            down: BTreeMap::new(),
            cells: Cells::of(&scene),
            rounds: BTreeMap::new(),
            ended_ms: BTreeMap::new(),
            components: Vec::new(),
            all_covered: false,
            said: vec![Record::Scene(Box::new(scene.clone()))],
            scene,
        }
    }

    /// What it has to say since the last call, in order.
    pub fn take(&mut self) -> Vec<Record> {
        std::mem::take(&mut self.said)
    }

    /// The scene in force.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Who has which cell.
    #[must_use]
    pub fn cells(&self) -> &Cells {
        &self.cells
    }

    /// A mission was given, and this follows from it. Its scene begins when the first peer
    /// begins it.
    pub fn given(&mut self, geometry: &Arc<MissionGeometry>) {
        let known = |g: &Arc<MissionGeometry>| Arc::ptr_eq(g, geometry);
        if !self.geometries.iter().any(known) {
            self.geometries.push(Arc::clone(geometry));
        }
    }

    /// A fault was injected.
    pub fn fault(&mut self, time_ms: u64, fault: &Fault) {
        let value = serde_json::to_value(fault).unwrap_or_default();
        let what = What::Fault {
            fault: value.as_object().cloned().unwrap_or_default(),
        };
        let uav = fault.peers().first().copied();
        self.say(time_ms, Origin::Run, uav, fault.to_string(), what);
        match fault {
            Fault::Kill { peer } => self.ended(time_ms, *peer, true),
            Fault::KillComputer { peer } | Fault::Terminate { peer } => {
                self.ended(time_ms, *peer, false);
            }
            Fault::Pause { peer } => self.process(*peer).paused = true,
            Fault::Resume { peer } => self.process(*peer).paused = false,
            _ => {}
        }
    }

    /// A peer's computer is no more, with or without its airframe.
    pub fn ended(&mut self, time_ms: u64, peer: u16, airframe: bool) {
        if std::mem::replace(&mut self.process(peer).ended, true) {
            return;
        }
        for believers in self.down.values_mut() {
            believers.remove(&peer);
        }
        self.ended_ms.insert(peer, time_ms);
        let (cells, orphans) = self.cells.end(peer);
        let of = self.name(peer);
        let body = if airframe { "" } else { "the computer of " };
        let text = format!(
            "{body}{of} is no more; {} open cells of it, {} nobody else lists",
            cells.len(),
            orphans.len()
        );
        let what = What::Ended {
            airframe,
            cells,
            orphans,
        };
        self.say(time_ms, Origin::World, Some(peer), text, what);
    }

    /// An airframe is gone, by no fault that took it.
    pub fn lost(&mut self, time_ms: u64, peer: u16) {
        let text = format!("the airframe of {} is lost", self.name(peer));
        self.say(time_ms, Origin::World, Some(peer), text, What::Lost);
        self.ended(time_ms, peer, true);
    }

    /// A UAV flew into a no-fly zone.
    pub fn zone_entered(&mut self, time_ms: u64, peer: u16, zone: usize) {
        let of = self.scene.zones.get(zone).map_or("a zone", |z| &z.name);
        let text = format!("{} flies into {of}", self.name(peer));
        let what = What::ZoneEntry { zone };
        self.say(time_ms, Origin::World, Some(peer), text, what);
    }

    /// A UAV left its launcher.
    pub fn took_off(&mut self, time_ms: u64, peer: u16) {
        let text = format!("{} takes off", self.name(peer));
        self.say(time_ms, Origin::World, Some(peer), text, What::TookOff);
    }

    /// An airframe began or ceased to loiter by itself.
    pub fn failsafe(&mut self, time_ms: u64, peer: u16, on: bool) {
        let does = if on {
            "loiters by itself"
        } else {
            "obeys again"
        };
        let text = format!("the airframe of {} {does}", self.name(peer));
        let what = What::Failsafe { on };
        self.say(time_ms, Origin::World, Some(peer), text, what);
    }

    /// The last coverable cell was seen.
    pub fn all_covered(&mut self, time_ms: u64) {
        if !std::mem::replace(&mut self.all_covered, true) {
            let text = "every coverable cell is covered".to_owned();
            self.say(time_ms, Origin::World, None, text, What::AllCovered);
        }
    }

    /// Which peers can reach each other, at present.
    pub fn connected(&mut self, time_ms: u64, components: &[Vec<u16>]) {
        if self.components == components {
            return;
        }
        self.components = components.to_vec();
        let parts: Vec<String> = components.iter().map(|p| format!("{p:?}")).collect();
        let text = format!("radio components {}", parts.join(" "));
        let what = What::Components {
            components: components.to_vec(),
        };
        self.say(time_ms, Origin::World, None, text, what);
    }

    /// A rule of the protocol was broken.
    pub fn violated(&mut self, time_ms: u64, rule: &str, peer: Option<u16>, text: &str) {
        let rule = rule.to_owned();
        let text = format!("rule {rule} is broken: {text}");
        self.say(time_ms, Origin::Run, peer, text, What::Violation { rule });
    }

    /// Something else worth a line.
    pub fn note(&mut self, time_ms: u64, text: String) {
        self.say(time_ms, Origin::Run, None, text, What::Note);
    }

    /// Something that a driver puts into words itself.
    pub fn add(&mut self, event: Event) {
        self.said.push(Record::Event(event));
    }

    /// A peer reported something.
    pub fn reported(&mut self, time_ms: u64, peer: u16, report: &Report) {
        let who = self.name(peer);
        let (what, text) = match report {
            Report::Booted { incarnation } => {
                *self.process(peer) = Process::default();
                let what = What::Booted {
                    incarnation: *incarnation,
                };
                (what, format!("{who} runs, life {incarnation}"))
            }
            Report::Ready {
                revision,
                loop_hash,
                cells,
            } => {
                self.begins(time_ms, peer, *revision, *loop_hash);
                let what = What::Ready {
                    revision: *revision,
                    n_cells: *cells,
                };
                (what, format!("{who} has derived a loop of {cells} cells"))
            }
            Report::Membership {
                peer: of,
                incarnation,
                status,
            } => {
                let belief = self.believes(peer, of.0, *status);
                let word = match belief {
                    Belief::Alive => "alive",
                    Belief::Suspect => "suspect",
                    Belief::Down => "down",
                };
                let what = What::Membership {
                    of: of.0,
                    incarnation: *incarnation,
                    belief,
                };
                let text = format!("{who} holds {} for {word}", self.name(of.0));
                (what, text)
            }
            Report::Round { .. } => return self.bid(time_ms, peer, report),
            Report::Claim { .. } => return self.claimed(time_ms, peer, report),
            Report::Covered { cells } => return self.saw(time_ms, peer, cells),
            Report::Finished { revision } => {
                self.process(peer).finished = true;
                let what = What::Finished {
                    revision: *revision,
                };
                (what, format!("{who} holds that the mission is finished"))
            }
            Report::Revised { mission } => {
                let revision = mission.revision;
                let text = format!("the operator gives revision {revision}");
                (What::Revised { revision }, text)
            }
            Report::Found { mission } => {
                let revision = mission.revision;
                let text = format!("{who} {}", skein_peer::found_obstacles::sentence(mission));
                (What::Revised { revision }, text)
            }
            Report::Task { name, news, .. } => {
                let text = format!("{who}: {}", news.sentence(name));
                (task_news(report), text)
            }
            Report::Detected { id, told } => {
                let what = What::Detected {
                    by: id.author,
                    looks: looks_name(told.looks),
                    east_m: f64::from(told.east_mm) / 1000.0,
                    north_m: f64::from(told.north_mm) / 1000.0,
                    error_m: f64::from(told.error_mm) / 1000.0,
                    stands: told.stands == Stands::Told,
                };
                let text = format!("{who}: {}", told.sentence(id.author));
                (what, text)
            }
            Report::Crowd { told } => {
                let (per_m2, low_per_m2, high_per_m2) = told.per_m2();
                let what = What::Crowd {
                    by: told.by,
                    east_m: f64::from(told.east_mm) / 1000.0,
                    north_m: f64::from(told.north_mm) / 1000.0,
                    error_m: f64::from(told.error_mm) / 1000.0,
                    per_m2,
                    low_per_m2,
                    high_per_m2,
                    dense: told.is_dense,
                };
                (what, format!("{who}: {}", told.sentence()))
            }
            Report::Traced {
                length_m, area_m2, ..
            } => {
                let what = What::Traced {
                    length_m: *length_m,
                    area_m2: *area_m2,
                };
                let text = match area_m2 {
                    Some(m2) => format!("{who} knows a contour of {length_m} m around {m2} m²"),
                    None => format!("{who} knows {length_m} m of a contour"),
                };
                (what, text)
            }
            Report::Silenced => {
                self.process(peer).silent = true;
                let text = format!("{who} is silent: another process speaks under its id");
                (What::Silenced, text)
            }
            Report::Alarm { text } => (What::Alarm, format!("{who}: {text}")),
            Report::Refused { reason } => (What::Refused, format!("{who} refused bytes: {reason}")),
        };
        self.say(time_ms, Origin::Peer, Some(peer), text, what);
    }

    /// How everything stands in the world by now.
    #[must_use]
    pub fn frame(&self, world: &World, links: &LinkTable, runs: &dyn Fn(u16) -> bool) -> Frame {
        let heard = |id: u16| runs(id) && world.antenna(id).is_some();
        let nodes: Vec<u16> = links
            .nodes()
            .iter()
            .copied()
            .filter(|n| heard(*n))
            .collect();
        let pair = |(i, a): (usize, &u16)| {
            let others = nodes[i + 1..].iter().filter(|b| links.joined(*a, **b));
            others.map(|b| [*a, *b]).collect::<Vec<_>>()
        };
        let links_up = nodes.iter().enumerate().flat_map(pair).collect();
        let judge = world.judge();
        let ids: Vec<u16> = self.scene.uavs.iter().map(|u| u.id).collect();
        let places = stage::places(world, &ids);
        Frame {
            time_ms: world.now_ms(),
            uavs: ids.iter().map(|id| self.uav(world, *id, &places)).collect(),
            links: links_up,
            components: links.components(heard),
            covered_cells: judge.n_covered(),
            coverable_cells: judge.survey().n_coverable(),
            covered_share: rounded(judge.covered_share(), 1e6),
        }
    }

    /// The run is over.
    pub fn end(&mut self, report: &RunReport) {
        self.said.push(Record::End(End {
            time_ms: report.end_ms,
            report: Box::new(report.clone()),
        }));
    }

    fn uav(&self, world: &World, id: u16, places: &[(u16, [f64; 3])]) -> UavState {
        let percept = world.percept(id);
        let pose = percept.map(|p| Pose {
            place: Place::of(&self.origin, p.pose.position()),
            heading_deg: rounded(stage::compass_deg(p.pose.heading_rad), 1e2),
            height_m: rounded(p.height_m, 1e3),
            airspeed_mps: rounded(p.airspeed_mps, 1e3),
        });
        let process = self.processes.get(&id);
        let cells_left = self.cells.n_left(id);
        let on_ground = percept.is_some_and(|p| p.takes_off_in_ms > 0);
        let state = match (percept, process) {
            (None, _) => State::Lost,
            (_, Some(p)) if p.ended => State::ComputerDead,
            (_, Some(p)) if p.paused || p.silent => State::Silent,
            _ if on_ground => State::Standing,
            (Some(at), Some(p)) if p.finished => {
                let off_m = (at.pose.position() - self.base).norm();
                if off_m <= self.home_m {
                    State::Home
                } else {
                    State::Finished
                }
            }
            (_, Some(p)) if p.loop_hash.is_some() && cells_left > 0 => State::Working,
            (_, Some(p)) if p.loop_hash.is_some() => State::Idle,
            _ => State::Starting,
        };
        let down = self.down.get(&id).into_iter().flatten().copied();
        UavState {
            id,
            state,
            pose,
            fuel_left_s: percept.map(|p| rounded(p.endurance_s, 1e1)),
            cells_left,
            nearest_other_m: stage::nearest_m(id, places).map(|m| rounded(m, 1e3)),
            failsafe: percept.is_some_and(|p| p.failsafe),
            held_down_by: down.collect(),
        }
    }

    fn process(&mut self, peer: u16) -> &mut Process {
        self.processes.entry(peer).or_default()
    }

    fn name(&self, peer: u16) -> String {
        name(peer, self.scene.uavs.iter().any(|u| u.id == peer))
    }

    fn say(&mut self, time_ms: u64, origin: Origin, uav: Option<u16>, text: String, what: What) {
        self.add(Event {
            time_ms,
            origin,
            uav,
            text,
            what,
        });
    }

    fn believes(&mut self, by: u16, of: u16, status: Status) -> Belief {
        let down = self.down.entry(of).or_default();
        match status {
            Status::Down => {
                down.insert(by);
                Belief::Down
            }
            Status::Suspect => Belief::Suspect,
            Status::Alive => {
                down.remove(&by);
                Belief::Alive
            }
        }
    }

    /// A peer works on a mission from now on: where it is the first to, another scene begins.
    fn begins(&mut self, time_ms: u64, peer: u16, revision: u32, loop_hash: u64) {
        let process = self.process(peer);
        process.loop_hash = Some(loop_hash);
        process.finished = false;
        if revision <= self.newest.0 {
            return;
        }
        let first = self.newest.0 == 0 && self.newest.1 == loop_hash;
        let another = self.newest.1 != loop_hash;
        self.newest = (revision, loop_hash);
        if first {
            return;
        }
        // A lap has the cells of the lap before, under another name.
        let of = |g: &&Arc<MissionGeometry>| g.coverage_loop.hash() == loop_hash;
        let mut newest_first = self.geometries.iter().rev();
        let geometry = newest_first.find(|g| g.mission.revision == revision);
        let geometry = geometry.or_else(|| self.geometries.iter().rev().find(of));
        if let Some(geometry) = geometry.or(self.geometries.last()).cloned() {
            self.base = geometry.mission.base_m();
            stage::revise(&mut self.scene, &geometry);
        }
        self.scene.time_ms = time_ms;
        self.scene.loop_hash = format!("{loop_hash:016x}");
        let given = self.geometries.last().map_or(0, |g| g.mission.revision);
        self.scene.lap = u16::try_from(revision.saturating_sub(given)).unwrap_or(0);
        self.scene.revision = revision;
        if another {
            self.cells = Cells::of(&self.scene);
            self.all_covered = false;
        }
        self.said.push(Record::Scene(Box::new(self.scene.clone())));
    }

    /// A peer bids in a round, which it has opened if nobody bid in it before.
    fn bid(&mut self, time_ms: u64, peer: u16, report: &Report) {
        let Report::Round {
            counter,
            members,
            repair,
            bid,
        } = report
        else {
            return;
        };
        let (counter, who) = (*counter, self.name(peer));
        let members: Vec<u16> = members.iter().map(|m| m.0).collect();
        let text = format!("{who} is in round {counter} among {members:?}");
        let bids = self.rounds.entry((counter, members.clone())).or_default();
        bids.retain(|b| b.by != peer);
        bids.push(bid.into());
        let bids = bids.clone();
        while self.rounds.len() > MAX_ROUNDS {
            self.rounds.pop_first();
        }
        let repair = Some(*repair);
        let what = What::Round {
            counter,
            members,
            repair,
        };
        self.say(time_ms, Origin::Peer, Some(peer), text, what);
        let text = format!("round {counter} has {} bids", bids.len());
        let what = What::Bids { counter, bids };
        self.say(time_ms, Origin::Peer, Some(peer), text, what);
    }

    fn on_newest(&self, peer: u16) -> bool {
        let on = self.processes.get(&peer).and_then(|p| p.loop_hash);
        on == Some(self.newest.1)
    }

    fn claimed(&mut self, time_ms: u64, peer: u16, report: &Report) {
        let Report::Claim {
            counter,
            take,
            legs,
            held,
            eta_ms,
            ..
        } = report
        else {
            return;
        };
        if !self.on_newest(peer) {
            return;
        }
        let n = self.scene.cells.len().max(1);
        let cells: Vec<u16> = legs.iter().flat_map(|leg| leg.cells(n)).collect();
        if !self.cells.is_news(peer, &cells, held) {
            return;
        }
        let taken = self.cells.claim(peer, &cells, held);
        let left = self.cells.n_left(peer);
        let text = format!("{} lists {left} open cells", self.name(peer));
        let what = What::Claim {
            counter: *counter,
            take: *take,
            cells,
            held: held.clone(),
            eta_ms: *eta_ms,
        };
        self.say(time_ms, Origin::Peer, Some(peer), text, what);
        for (from, cells) in taken {
            let ended_ms = self.ended_ms.get(&from).copied().unwrap_or(time_ms);
            let text = format!(
                "{} takes over {} cells of {}",
                self.name(peer),
                cells.len(),
                self.name(from)
            );
            let what = What::Takeover {
                from,
                cells,
                after_ms: time_ms.saturating_sub(ended_ms),
            };
            self.say(time_ms, Origin::Run, Some(peer), text, what);
        }
    }

    fn saw(&mut self, time_ms: u64, peer: u16, cells: &[u16]) {
        if !self.on_newest(peer) {
            return;
        }
        let new = self.cells.cover(peer, cells);
        let text = format!("{} saw {} cells", self.name(peer), cells.len());
        let what = What::Covered {
            cells: cells.to_vec(),
            new,
        };
        self.say(time_ms, Origin::Peer, Some(peer), text, what);
    }
}

/// What a peer says of a task.
fn task_news(report: &Report) -> What {
    let Report::Task {
        id,
        revision,
        name,
        news,
        held_by,
    } = report
    else {
        return What::Note;
    };
    What::Task {
        name: name.clone(),
        news: news.word().to_owned(),
        author: Some(id.author),
        number: Some(id.number),
        revision: Some(*revision),
        by: match news {
            TaskNews::DoneBy(PeerId(by)) => Some(*by),
            _ => None,
        },
        held_by: held_by.iter().map(Into::into).collect(),
    }
}
