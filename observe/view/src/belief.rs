//! A run in the words of the model, from nothing but what a swarm says on the air: what is told
//! here is believed, and as old as the radio makes it.
//!
//! Who listens beside one peer hears what that peer hears: beacons of its neighbours, and what is
//! passed on. So a UAV is drawn where it was heard last; who is gone is known from the suspicions
//! that others gossip, and from silence; who covered a cell is taken to be whoever listed it when
//! it was told. Times are those of the listener's clock, from when it began.

use crate::believed::{Now, Peer};
use crate::believed_tasks::Tasks;
use skein_geometry::frame::Origin as Plane;
use skein_peer::Mission;
use skein_peer::cells::CellSet;
use skein_peer::library::Library;
use skein_peer::offload::MissionGeometry;
use skein_peer::wire::codec::{Body, open};
use skein_peer::wire::key;
use skein_peer::wire::message::{Bid, CellRun, Claim, Cover, ListedRun, MissionChunk};
use skein_peer::wire::obstacle::{FOUND_MAX, Found};
use skein_peer::wire::signature::Off;
use skein_recording::cells::{Cell, Cells};
use skein_recording::model::event::{Bid as ToldBid, Event, Origin, What};
use skein_recording::model::scene::{Station, Uav};
use skein_recording::model::{Frame, Place, Record, Scene};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Peers that are kept in mind: as many as a swarm has at most.
const MAX_PEERS: usize = 257;

/// What lies between two words of a swarm counts as silence of one peer up to this,
/// milliseconds: two peers alone say several things a second.
const LONGEST_PAUSE_MS: u64 = 300;

/// Rounds of which bids are kept: a new one makes the older ones history.
const MAX_ROUNDS: usize = 16;

/// What a listener believes of a swarm.
#[derive(Debug)]
pub struct Belief {
    /// None until somebody was heard, where it is not known from elsewhere.
    fleet: Option<String>,
    library: Library,
    /// Obstacles on no map that peers tell of.
    found: BTreeSet<Found>,
    geometry: Option<Arc<MissionGeometry>>,
    scene: Scene,
    peers: BTreeMap<u16, Peer>,
    cells: Cells,
    covered: CellSet,
    rounds: BTreeMap<(u32, Vec<u16>), BTreeMap<u16, ToldBid>>,
    tasks: Tasks,
    components: Vec<Vec<u16>>,
    /// When anything was heard last.
    last: Now,
    said: Vec<Record>,
}

impl Belief {
    /// Nothing was heard yet of the fleet of that name, or of the first one that is heard.
    #[must_use]
    pub fn new(fleet: Option<&str>) -> Self {
        Self {
            fleet: fleet.map(str::to_owned),
            library: Library::default(),
            found: BTreeSet::new(),
            geometry: None,
            scene: Scene::default(),
            peers: BTreeMap::new(),
            cells: Cells::default(),
            covered: CellSet::new(0),
            rounds: BTreeMap::new(),
            tasks: Tasks::default(),
            components: Vec::new(),
            last: Now::default(),
            said: Vec::new(),
        }
    }

    /// What there is to say since the last call, in order.
    pub fn take(&mut self) -> Vec<Record> {
        std::mem::take(&mut self.said)
    }

    /// Whether anybody was heard.
    #[must_use]
    pub fn has_heard(&self) -> bool {
        !self.peers.is_empty()
    }

    /// A mission that is known from elsewhere. Deriving its loop takes up to some seconds.
    pub fn mission(&mut self, now_ms: u64, mission: &Arc<Mission>) {
        self.library.offer(Arc::clone(mission));
        self.follow(now_ms);
    }

    /// Something was heard under a key; what is no record of this swarm changes nothing.
    pub fn heard(&mut self, now_ms: u64, key: &str, bytes: &[u8]) {
        let (Ok(key), Ok((record, body))) = (key::parse(key), open(bytes, &Off)) else {
            return;
        };
        if *self.fleet.get_or_insert(key.fleet.clone()) != key.fleet {
            return;
        }
        let pause_ms = now_ms.saturating_sub(self.last.ms).min(LONGEST_PAUSE_MS);
        let now = Now {
            ms: now_ms,
            air_ms: self.last.air_ms + pause_ms,
        };
        self.last = now;
        let id = record.author;
        if !self.peers.contains_key(&id) && self.peers.len() >= MAX_PEERS {
            return;
        }
        let version = (record.incarnation, record.seq);
        let peer = self.peers.entry(id).or_default();
        let before = peer.incarnation;
        if !peer.is_news(version, record.kind, record.subject) {
            return;
        }
        if before != 0 && record.incarnation > before {
            let text = format!("uav{id} runs, life {}", record.incarnation);
            let incarnation = record.incarnation;
            self.say(now_ms, id, text, What::Booted { incarnation });
        }
        match &body {
            Body::Beacon(beacon) => {
                peer_of(&mut self.peers, id).beacon(now, beacon);
                for gossip in &beacon.gossip {
                    self.gossip(now, gossip.id, gossip.incarnation, gossip.heartbeat);
                }
                self.later_lap(now_ms, beacon.revision);
            }
            Body::Heartbeat(beat) => peer_of(&mut self.peers, id).heartbeat(now, beat),
            Body::State(state) => peer_of(&mut self.peers, id).state(now, state),
            other => self.work(now_ms, (id, record.subject), other),
        }
    }

    /// Something was said of the mission.
    fn work(&mut self, now_ms: u64, (id, subject): (u16, u16), body: &Body) {
        match body {
            Body::Claim(claim) => self.claim(now_ms, id, claim),
            Body::Bid(bid) => self.bid(now_ms, id, bid),
            Body::Cover(cover) => self.cover(now_ms, id, cover),
            Body::Obstacles(told) => {
                self.found.extend(&told.found);
                while self.found.len() > FOUND_MAX {
                    self.found.pop_last();
                }
                self.follow(now_ms);
            }
            Body::Mission(chunk) => self.piece(now_ms, subject, chunk),
            Body::Finished(finished) => {
                let revision = finished.revision;
                let text = format!("uav{id} holds that the mission is finished");
                self.say(now_ms, id, text, What::Finished { revision });
            }
            Body::Operator(orders) => {
                let text = format!("the operator orders {orders}");
                self.say(now_ms, id, text, What::Note);
            }
            Body::Task(task) => {
                let told = self.tasks.asked(id, subject, task);
                self.tell_all(now_ms, id, told);
            }
            Body::Bundle(bundle) => {
                let told = self.tasks.bundle(id, bundle);
                self.tell_all(now_ms, id, told);
            }
            // Who is where was taken before; promises are not drawn.
            _ => {}
        }
    }

    /// Looks at who is silent, and tells how all stands by now.
    pub fn look(&mut self, now_ms: u64) {
        self.notice_new_ones();
        self.notice_silence(now_ms);
        let links = self.links(now_ms);
        let components = self.parts(&links);
        if components != self.components {
            let parts: Vec<String> = components.iter().map(|p| format!("{p:?}")).collect();
            let text = format!("radio components, as beacons tell: {}", parts.join(" "));
            let what = What::Components {
                components: components.clone(),
            };
            self.components.clone_from(&components);
            self.tell(now_ms, None, text, what);
        }
        let coverable = self.scene.cells.iter().filter(|c| c.needed).count();
        let all = self.cells.all();
        let needed = self.scene.cells.iter().zip(&all).filter(|(c, _)| c.needed);
        let covered = needed
            .filter(|(_, is)| matches!(is, Cell::Covered(_)))
            .count();
        let plane = self.plane();
        let uavs: Vec<u16> = self.uavs();
        let states = uavs.iter().map(|id| {
            let peer = &self.peers[id];
            let mut state = peer.uav(*id, self.cells.n_left(*id), plane.as_ref());
            state.held_down_by = self.suspected_by(*id);
            state.nearest_other_m = self.nearest_m(*id);
            state
        });
        let frame = Frame {
            time_ms: now_ms,
            uavs: states.collect(),
            links,
            components,
            covered_cells: covered,
            coverable_cells: coverable,
            covered_share: covered as f64 / coverable.max(1) as f64,
        };
        self.said.push(Record::Frame(frame));
    }

    /// A piece of a mission was heard; one that does not fit changes nothing.
    fn piece(&mut self, now_ms: u64, subject: u16, chunk: &MissionChunk) {
        if self.library.chunk(subject, chunk) == Ok(true) {
            self.follow(now_ms);
        }
    }

    /// The newest mission is the one that is shown.
    fn follow(&mut self, now_ms: u64) {
        let Some(given) = self.library.newest() else {
            return;
        };
        let mission = given.with_found(&self.found).map_or(given, Arc::new);
        let shown = self.geometry.as_ref().map_or(0, |g| g.mission.revision);
        if self.geometry.is_some() && mission.revision <= shown {
            return;
        }
        let Ok(geometry) = mission.geometry() else {
            return;
        };
        let before = self.scene.loop_hash.clone();
        let (uavs, ground) = (self.scene.uavs.clone(), self.scene.ground.take());
        self.scene =
            skein_recording::of_mission(&geometry, self.fleet.as_deref().unwrap_or_default());
        (self.scene.time_ms, self.scene.uavs, self.scene.ground) = (now_ms, uavs, ground);
        if before != self.scene.loop_hash {
            self.cells = Cells::of(&self.scene);
            self.covered = CellSet::new(u16::try_from(self.scene.cells.len()).unwrap_or(u16::MAX));
        }
        self.geometry = Some(geometry);
        self.said.push(Record::Scene(Box::new(self.scene.clone())));
        // What was heard before the mission was known.
        let claims: Vec<(u16, Claim)> = (self.peers.iter())
            .filter_map(|(id, p)| Some((*id, p.claim.clone()?)))
            .collect();
        for (id, claim) in claims {
            self.claim(now_ms, id, &claim);
        }
        let covers: Vec<(u16, Cover)> = (self.peers.iter())
            .filter_map(|(id, p)| Some((*id, p.cover.clone()?)))
            .collect();
        for (id, cover) in covers {
            self.cover(now_ms, id, &cover);
        }
    }

    /// Laps are begun without anybody's saying so but beacons.
    fn later_lap(&mut self, now_ms: u64, revision: u32) {
        let lap = self
            .geometry
            .as_ref()
            .and_then(|g| g.mission.later_lap(revision));
        if let Some(lap) = lap {
            self.mission(now_ms, &Arc::new(lap));
        }
    }

    fn gossip(&mut self, now: Now, id: u16, incarnation: u32, heartbeat: u32) {
        if let Some(peer) = self.peers.get_mut(&id) {
            peer.gossiped(now, incarnation, heartbeat);
        }
    }

    /// Whether something is told of the loop that is shown.
    fn is_shown(&self, loop_hash: u64) -> bool {
        let shown = self.geometry.as_ref();
        shown.is_some_and(|g| g.coverage_loop.hash() == loop_hash)
    }

    fn claim(&mut self, now_ms: u64, id: u16, claim: &Claim) {
        if let Some(peer) = self.peers.get_mut(&id) {
            peer.claim = Some(claim.clone());
        }
        if !self.is_shown(claim.loop_hash) {
            return;
        }
        let n = self.scene.cells.len();
        let cells = listed(&claim.plan, n);
        let held = listed(&claim.held, n);
        if !self.cells.is_news(id, &cells, &held) {
            return;
        }
        let taken = self.cells.claim(id, &cells, &held);
        let text = format!("uav{id} lists {} open cells", self.cells.n_left(id));
        let what = What::Claim {
            counter: claim.epoch.counter,
            take: claim.plan.iter().map(|l| l.stamp.take).max().unwrap_or(0),
            cells,
            held,
            eta_ms: claim.eta_ms,
        };
        self.say(now_ms, id, text, what);
        for (from, cells) in taken {
            let text = format!("uav{id} takes over {} cells of uav{from}", cells.len());
            let since_ms = self.peers.get(&from).map_or(now_ms, |p| p.heard_ms());
            let after_ms = now_ms.saturating_sub(since_ms);
            let what = What::Takeover {
                from,
                cells,
                after_ms,
            };
            self.say(now_ms, id, text, what);
        }
    }

    fn bid(&mut self, now_ms: u64, id: u16, bid: &Bid) {
        let counter = bid.round.counter;
        let members: Vec<u16> = bid.round.members.iter().map(|m| m.id).collect();
        let key = (counter, members.clone());
        let is_new = !self.rounds.contains_key(&key);
        if is_new {
            let text = format!("uav{id} is in round {counter} among {members:?}");
            let repair = Some(bid.round.repair);
            let what = What::Round {
                counter,
                members,
                repair,
            };
            self.say(now_ms, id, text, what);
        }
        let bids = self.rounds.entry(key).or_default();
        let told = ToldBid {
            by: id,
            anchor: bid.anchor,
            release_ms: bid.release_ms,
            endurance_ms: bid.endurance_ms,
            eta_ms: bid.eta_ms,
        };
        bids.insert(id, told);
        let bids: Vec<ToldBid> = bids.values().copied().collect();
        while self.rounds.len() > MAX_ROUNDS {
            self.rounds.pop_first();
        }
        let text = format!("round {counter} has {} bids", bids.len());
        self.say(now_ms, id, text, What::Bids { counter, bids });
    }

    fn cover(&mut self, now_ms: u64, id: u16, cover: &Cover) {
        if let Some(peer) = self.peers.get_mut(&id) {
            peer.cover = Some(cover.clone());
        }
        if !self.is_shown(cover.loop_hash) {
            return;
        }
        let Ok(told) = CellSet::decode_rle(self.covered.capacity(), &cover.covered) else {
            return;
        };
        let owners = self.cells.all();
        let mut by: BTreeMap<u16, Vec<u16>> = BTreeMap::new();
        for cell in told.iter().filter(|c| !self.covered.contains(*c)) {
            let who = match owners.get(usize::from(cell)) {
                Some(Cell::Planned(who) | Cell::Orphaned(who)) => *who,
                _ => id,
            };
            by.entry(who).or_default().push(cell);
        }
        self.covered.union_with(&told);
        for (who, cells) in by {
            let new = self.cells.cover(who, &cells);
            let text = format!("uav{who} saw {} cells", cells.len());
            self.say(now_ms, who, text, What::Covered { cells, new });
        }
    }

    /// Peers that were not in the scene join it.
    fn notice_new_ones(&mut self) {
        let Some(plane) = self.plane() else { return };
        let known: BTreeSet<u16> = self.scene.uavs.iter().map(|u| u.id).collect();
        let station = self.scene.ground.as_ref().map(|g| g.id);
        let mut changed = false;
        for (id, peer) in &self.peers {
            let Some(at) = peer.place() else { continue };
            let place = Place::of(&plane, at);
            if peer.is_ground_station() {
                // It does not say where it stands: people put it where UAVs come home to.
                let place = self.scene.base;
                if station != Some(*id) {
                    let (id, height_m) = (*id, 0.0);
                    self.scene.ground = Some(Station {
                        id,
                        place,
                        height_m,
                    });
                    changed = true;
                }
            } else if !known.contains(id) {
                self.scene.uavs.push(Uav {
                    id: *id,
                    name: format!("uav{id}"),
                    launch: place,
                    height_m: peer.height_m(),
                    ..Uav::default()
                });
                changed = true;
            }
        }
        if changed {
            self.scene.uavs.sort_by_key(|u| u.id);
            self.said.push(Record::Scene(Box::new(self.scene.clone())));
        }
    }

    /// Who is held to be gone, and who is heard again.
    fn notice_silence(&mut self, now_ms: u64) {
        let suspected: Vec<u16> = self.peers.keys().copied().collect();
        let suspected = suspected
            .into_iter()
            .filter(|id| !self.suspected_by(*id).is_empty());
        let suspected: BTreeSet<u16> = suspected.collect();
        let ids: Vec<u16> = self.peers.keys().copied().collect();
        for id in ids {
            let Some(peer) = self.peers.get_mut(&id) else {
                continue;
            };
            let is_gone = peer.is_gone(self.last, suspected.contains(&id));
            let was = std::mem::replace(&mut peer.gone, is_gone);
            let claim = peer.claim.clone();
            if is_gone && !was {
                let (cells, orphans) = self.cells.end(id);
                let text = format!(
                    "uav{id} is held to be gone: nobody hears it; {} open cells of it, {} nobody else lists",
                    cells.len(),
                    orphans.len()
                );
                let airframe = true;
                let what = What::Ended {
                    airframe,
                    cells,
                    orphans,
                };
                self.say(now_ms, id, text, what);
            } else if was && !is_gone {
                self.say(now_ms, id, format!("uav{id} is heard again"), What::Note);
                if let Some(claim) = claim {
                    self.claim(now_ms, id, &claim);
                }
            }
        }
    }

    /// Peers, not gone themselves, whose gossip suspects this one.
    fn suspected_by(&self, id: u16) -> Vec<u16> {
        let others = self
            .peers
            .iter()
            .filter(|(other, p)| **other != id && !p.gone);
        let suspects = others.filter(|(_, p)| p.suspects(id));
        suspects.map(|(other, _)| *other).collect()
    }

    fn uavs(&self) -> Vec<u16> {
        let uavs = self
            .peers
            .iter()
            .filter(|(_, p)| !p.is_ground_station() && p.place().is_some());
        uavs.map(|(id, _)| *id).collect()
    }

    fn nearest_m(&self, id: u16) -> Option<f64> {
        let own = self.peers.get(&id).filter(|p| !p.gone)?;
        let (at, height_m) = (own.place()?, own.height_m());
        let others = self
            .peers
            .iter()
            .filter(|(other, p)| **other != id && !p.gone && !p.is_ground_station());
        let off_m = others.filter_map(|(_, p)| {
            let flat_m = (p.place()? - at).norm();
            Some(flat_m.hypot(p.height_m() - height_m))
        });
        off_m.min_by(f64::total_cmp)
    }

    /// Pairs that hear each other, as far as their own beacons say.
    fn links(&self, now_ms: u64) -> Vec<[u16; 2]> {
        let hears = |a: u16, b: u16| self.peers[&a].hears(now_ms, b);
        let here: Vec<u16> = (self.peers.iter())
            .filter(|(_, p)| !p.gone && p.place().is_some())
            .map(|(id, _)| *id)
            .collect();
        let mut links = Vec::new();
        for (i, a) in here.iter().enumerate() {
            let others = here[i + 1..].iter();
            links.extend(
                others
                    .filter(|b| hears(*a, **b) && hears(**b, *a))
                    .map(|b| [*a, *b]),
            );
        }
        links
    }

    /// Peers that such links join.
    fn parts(&self, links: &[[u16; 2]]) -> Vec<Vec<u16>> {
        let here = self
            .peers
            .iter()
            .filter(|(_, p)| !p.gone && p.place().is_some());
        let mut part: BTreeMap<u16, u16> = here.map(|(id, _)| (*id, *id)).collect();
        for [a, b] in links {
            let (Some(from), Some(to)) = (part.get(b).copied(), part.get(a).copied()) else {
                continue;
            };
            part.values_mut()
                .filter(|p| **p == from)
                .for_each(|p| *p = to);
        }
        let mut parts: BTreeMap<u16, Vec<u16>> = BTreeMap::new();
        for (id, of) in part {
            parts.entry(of).or_default().push(id);
        }
        let mut parts: Vec<Vec<u16>> = parts.into_values().collect();
        parts.sort();
        parts
    }

    fn plane(&self) -> Option<Plane> {
        let mission = &self.geometry.as_ref()?.mission;
        Some(Plane {
            lat_deg: f64::from(mission.origin_lat_e7) / 1e7,
            lon_deg: f64::from(mission.origin_lon_e7) / 1e7,
        })
    }

    fn tell_all(&mut self, now_ms: u64, peer: u16, told: Vec<(String, What)>) {
        for (text, what) in told {
            self.say(now_ms, peer, text, what);
        }
    }

    fn say(&mut self, time_ms: u64, peer: u16, text: String, what: What) {
        self.tell(time_ms, Some(peer), text, what);
    }

    fn tell(&mut self, time_ms: u64, uav: Option<u16>, text: String, what: What) {
        self.said.push(Record::Event(Event {
            time_ms,
            origin: Origin::Peer,
            uav,
            text,
            what,
        }));
    }
}

fn peer_of(peers: &mut BTreeMap<u16, Peer>, id: u16) -> &mut Peer {
    peers.entry(id).or_default()
}

/// The cells of listed runs in the order in which they are flown.
fn listed(runs: &[ListedRun], n: usize) -> Vec<u16> {
    let n = n.max(1);
    let cells = |run: CellRun| {
        (0..usize::from(run.count))
            .filter_map(move |k| u16::try_from((usize::from(run.first) + k) % n).ok())
    };
    let mut all = Vec::new();
    for listed in runs {
        let forward = cells(listed.run);
        if listed.backward {
            let mut backward: Vec<u16> = forward.collect();
            backward.reverse();
            all.extend(backward);
        } else {
            all.extend(forward);
        }
    }
    all
}

#[cfg(test)]
mod tests;
