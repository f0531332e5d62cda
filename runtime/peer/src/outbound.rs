//! What a peer says, and when.
//!
//! | record | when |
//! |---|---|
//! | beacon | every I, ±10 %; within I/8 when somebody is heard who was suspected, or is suspected by a neighbour and was heard since, at most every I/2, if nothing is owed and no own bid or claim has waited for I |
//! | heartbeat | half-way between two beacons; at once, and four times in I, when this peer hears that it is suspected; with heartbeats of others that are asked for at once or answer that |
//! | claim | at once when a section was adopted, within I when cells were taken or it shrank by a rule; every 10 I for its ETA, for each eight that are known to live |
//! | cover | own or heard coverage is news, at most every 2 I; at most every I when a neighbour's beacon shows other coverage. What is news is said twice; all of it every 4 I where a neighbour still knows other cells, at the end, and to who was not there lately |
//! | state | every 10 I |
//! | bid | once it is durable |
//! | finished | once a mission revision |
//! | mission | all pieces, by a ground station and to whom its neighbours' beacons show that they follow an older revision |
//! | lacking | with a beacon, in a crowd with every second, while a newer mission than the one followed is collected or followed by a neighbour |
//! | operator | when the operator gives an order, by a ground station |
//! | task | when it is asked for, cancelled, expired, or somebody did it, and once in each life, by a ground station |
//! | bundle | while a task is open: when the offer or a claim is new; what was won once an interval has passed without news |
//! | target | while somebody is to be followed: what was seen since it was told last, two at most every I |
//! | trail | while its UAV flies along a contour: a stretch when it is full; every 8 I the one that grows, and the next of the older ones |
//! | count | once its site is out of the picture, and every 10 I while it is in it: two at most at a look |
//! | usage | what grew of streets, once its interval of the day is over, and every 40 I before that, of turns every 80 I: one at most every I; each of these for each eight UAVs that are believed alive, begun ones too |
//! | crowd | when a sector became too dense or eased, within I, and twice more, 2 I apart; what else its looks say that nobody told for as long as the mission says, four times that where nobody is, half of it where that changed for certain, and what nobody told as fully for four times that: every 2 I for each UAV that is believed alive |
//! | obstacle | when something is known that nobody who is believed alive says: at once by who found it, else two intervals later and one more for each with a lower number |
//! | aircraft | while its UAV senses aircraft that are no members: every 4 I, the four nearest |
//!
//! I is the interval that this peer's beacons announce, a period T where there is room.

use crate::cells::CellSet;
use crate::config::Role;
use crate::coverage_told::CoverageTold;
use crate::effect::{Effect, Effects};
use crate::input::Time;
use crate::library::{chunks, pieces_from_end};
use crate::mission::{Mission, mm};
use crate::mission_state::MissionState;
use crate::output::Report;
use crate::timers::{Timer, Timers};
use crate::wire::codec::{self, Body};
use crate::wire::kinds::Kind;
use crate::wire::limits::COVERED_MAX_BYTES;
use crate::wire::message::{Activity, Beacon, Cover, Finished, Heartbeat, Record, State};
use crate::{Incarnation, PeerConfig};
use rand_chacha::ChaCha8Rng;
use rand_core::Rng;
use skein_behaviors::Percept;
use std::sync::Arc;

/// A claim is spoken again after this many intervals, for its ETA, and among many after as many
/// more: each is passed on by everybody, and those of a hundred would take all of the air.
pub const CLAIM_INTERVALS: u64 = 10;

/// Coverage is spoken at most every so many intervals: a cell takes three to
/// four seconds to fly, so more would repeat what is known.
pub const COVER_INTERVALS: u64 = 2;

/// State is for people: they read no faster.
pub const STATE_INTERVALS: u64 = 10;

/// What the peer knows that its records tell.
#[derive(Debug)]
pub(crate) struct Sources<'a> {
    /// The peer's time.
    pub now: Time,
    /// How it was configured.
    pub config: &'a PeerConfig,
    /// What it has of its mission.
    pub mission_state: Option<&'a MissionState>,
    /// The newest whole mission.
    pub mission: Option<Arc<Mission>>,
    /// What it last sensed.
    pub percept: Option<&'a Percept>,
    /// What it said last of coverage is not on the air yet: a later part would replace it.
    pub cover_waits: bool,
}

/// What was said, and counted.
#[derive(Clone, Debug)]
pub(crate) struct Outbound {
    /// Until the next beacon, as announced.
    interval_ms: u64,
    heartbeat: u32,
    seq: u32,
    last_beacon: Time,
    /// The last beacon with gossip.
    last_full: Time,
    last_claim: Time,
    last_cover: Time,
    coverage_told: CoverageTold,
    mission_said: Option<Arc<Mission>>,
}

impl Outbound {
    /// Nothing was said yet.
    pub fn new(period_ms: u64, timers: &mut Timers) -> Self {
        timers.set(Timer::Claim, Time(CLAIM_INTERVALS * period_ms));
        timers.set(Timer::State, Time(STATE_INTERVALS * period_ms));
        Self {
            interval_ms: period_ms,
            heartbeat: 0,
            seq: 0,
            last_beacon: Time(0),
            last_full: Time(0),
            last_claim: Time(0),
            last_cover: Time(0),
            coverage_told: CoverageTold::default(),
            mission_said: None,
        }
    }

    /// The last heartbeat sent in this life.
    pub fn heartbeat(&self) -> u32 {
        self.heartbeat
    }

    /// The number of the last record written in this life.
    pub fn seq(&self) -> u32 {
        self.seq
    }

    /// The first beacon is due when the probation ends.
    pub fn start(timers: &mut Timers) {
        if let Some(at) = timers.at(Timer::Probation) {
            timers.set(Timer::Beacon, at);
            timers.set(Timer::FullBeacon, at);
        }
    }

    /// A life begins: what was said in an earlier one is void.
    pub fn new_life(&mut self, timers: &mut Timers) {
        self.seq = 0;
        self.heartbeat = 0;
        self.mission_said = None;
        self.coverage_told = CoverageTold::default();
        self.claim_changed(timers);
        self.coverage_changed(timers);
    }

    /// The own claim changed by a rule.
    pub fn claim_changed(&self, timers: &mut Timers) {
        timers.set_earlier(Timer::Claim, self.last_claim.plus_ms(self.interval_ms));
    }

    /// Own or heard coverage is news.
    pub fn coverage_changed(&self, timers: &mut Timers) {
        let soonest = self.last_cover.plus_ms(COVER_INTERVALS * self.interval_ms);
        timers.set_earlier(Timer::Cover, soonest);
    }

    /// Somebody is heard who was not there lately.
    pub fn meet(&mut self) {
        self.coverage_told.meet();
    }

    /// A neighbour in a crowded earshot said that these cells are covered.
    pub fn coverage_heard(&mut self, loop_hash: u64, cells: &CellSet) {
        self.coverage_told.heard(loop_hash, cells);
    }

    /// A neighbour's beacon shows other coverage.
    pub fn coverage_wanted(&self, timers: &mut Timers) {
        timers.set_earlier(Timer::Cover, self.last_cover.plus_ms(self.interval_ms));
    }

    /// Says whatever is due, of a peer that may speak.
    pub fn tick(&mut self, s: &Sources<'_>, timers: &mut Timers, rng: &mut ChaCha8Rng) -> Effects {
        let mut effects = Effects::new();
        if s.config.role == Role::GroundStation {
            effects.extend(self.speak_mission(s));
        }
        let Some(state) = s.mission_state else {
            return effects;
        };
        if timers.is_due(Timer::Claim, s.now) {
            effects.extend(self.speak_claim(s, timers, rng));
        }
        if timers.is_due(Timer::Cover, s.now) && !s.cover_waits {
            effects.extend(self.speak_cover(s.now, state, timers, rng));
        }
        if timers.is_due(Timer::State, s.now) {
            let last = self.jittered(s.now, rng);
            timers.set(
                Timer::State,
                last.plus_ms(STATE_INTERVALS * self.interval_ms),
            );
            effects.push(Effect::Speak(0, Body::State(state_of(s, state))));
        }
        if timers.take_due(Timer::Finished, s.now) {
            let revision = state.revision();
            effects.push(Effect::Speak(0, Body::Finished(Finished { revision })));
        }
        effects
    }

    /// The own claim, and what people are told of it.
    pub fn speak_claim(
        &mut self,
        s: &Sources<'_>,
        timers: &mut Timers,
        rng: &mut ChaCha8Rng,
    ) -> Effects {
        let Some(state) = s.mission_state.filter(|_| s.config.role == Role::Uav) else {
            return Effects::new();
        };
        let claim = state.claim();
        let sections = &state.negotiation.sections;
        let takes = sections.plan().iter().map(|p| p.stamp.take);
        let report = Report::Claim {
            counter: claim.epoch.counter,
            epoch: claim.epoch.hash,
            take: takes.max().unwrap_or(0),
            legs: crate::protocol::runs::legs_of(sections.plan(), sections.cells()),
            held: sections.held().keys().copied().collect(),
            eta_ms: claim.eta_ms,
        };
        self.last_claim = self.jittered(s.now, rng);
        let again_ms = CLAIM_INTERVALS * state.company.eights() * self.interval_ms;
        timers.set(Timer::Claim, self.last_claim.plus_ms(again_ms));
        vec![Effect::Speak(0, Body::Claim(claim)), Effect::Report(report)]
    }

    fn speak_cover(
        &mut self,
        now: Time,
        state: &MissionState,
        timers: &mut Timers,
        rng: &mut ChaCha8Rng,
    ) -> Option<Effect> {
        timers.stop(Timer::Cover);
        let loop_hash = state.loop_hash();
        let told = &mut self.coverage_told;
        let said = match told.next(now, loop_hash, state.covered(), self.interval_ms) {
            Ok(said) => said,
            Err(again) => {
                timers.set(Timer::Cover, again);
                return None;
            }
        };
        self.last_cover = self.jittered(now, rng);
        let cover = Cover {
            revision: state.revision(),
            loop_hash,
            covered: said.encode_rle(Some(COVERED_MAX_BYTES)),
        };
        Some(Effect::Speak(0, Body::Cover(cover)))
    }

    /// The mission's body in pieces, once a revision and life: the relay brings them to who
    /// lacks them.
    pub fn speak_mission(&mut self, s: &Sources<'_>) -> Effects {
        let Some(mission) = &s.mission else {
            return Effects::new();
        };
        let is_same = |said: Arc<Mission>| {
            Arc::ptr_eq(&said, mission) || said.content_hash() == mission.content_hash()
        };
        let said = self.mission_said.replace(Arc::clone(mission));
        if said.is_some_and(is_same) {
            return Effects::new();
        }
        match chunks(mission) {
            Ok(pieces) => {
                let mut pieces: Vec<_> = (0u16..).zip(pieces).collect();
                pieces.sort_by_key(|(subject, chunk)| pieces_from_end(*subject, chunk.chunks));
                let speak = |(subject, chunk)| Effect::Speak(subject, Body::Mission(chunk));
                pieces.into_iter().map(speak).collect()
            }
            Err(too_large) => vec![Effect::Alarm(too_large.to_string())],
        }
    }

    /// Now, and up to a quarter of an interval: what recurs must not recur in step with
    /// others, or it collides for ever.
    fn jittered(&self, now: Time, rng: &mut ChaCha8Rng) -> Time {
        let spread = self.interval_ms / 4 + 1;
        now.plus_ms(u64::from(rng.next_u32()) % spread)
    }

    /// Writes a record of this peer's own.
    pub fn record(
        &mut self,
        author: u16,
        incarnation: Incarnation,
        subject: u16,
        body: &Body,
    ) -> Record {
        let beats = matches!(body.kind(), Kind::Beacon | Kind::Heartbeat);
        assert!(!beats, "beacons and heartbeats count for themselves");
        assert!(incarnation > 0, "nothing is spoken before the first life");
        self.seq = self.seq.saturating_add(1);
        Record {
            author,
            incarnation,
            seq: self.seq,
            kind: body.kind().number(),
            subject,
            body: codec::encode_body(body),
            signature: Vec::new(),
        }
    }

    /// The interval that is announced from now on.
    pub fn announce(&mut self, interval_ms: u64) {
        self.interval_ms = interval_ms;
    }

    /// Somebody who was suspected is heard: the next beacon comes soon, half an interval
    /// after the last one at the earliest, and brings the news one hop on.
    pub fn hasten(&self, now: Time, timers: &mut Timers, rng: &mut ChaCha8Rng) {
        let t = self.interval_ms;
        let spread = u64::from(rng.next_u32()) % (t / 8 + 1);
        let soonest = self.last_full.plus_ms(t / 2);
        let at = now.plus_ms(spread).max(soonest);
        timers.set_earlier(Timer::FullBeacon, at);
        timers.set_earlier(Timer::Beacon, at);
    }

    /// Somebody suspects this peer: it says that it lives, four times an interval, until it
    /// is believed or the verdict is passed at `until`. The suspicion tells that its
    /// beacons collide, so these are heartbeats: what is short collides rarely.
    pub fn refute(&self, now: Time, until: Time, timers: &mut Timers, rng: &mut ChaCha8Rng) {
        let t = self.interval_ms;
        timers.set(Timer::Refutation, until);
        let spread = u64::from(rng.next_u32()) % (t / 8 + 1);
        let soonest = self.last_beacon.plus_ms(t / 4);
        timers.set_earlier(Timer::Beacon, now.plus_ms(spread).max(soonest));
    }

    /// A neighbour believes again that this peer lives.
    pub fn believed(&self, now: Time, timers: &mut Timers) {
        if timers.is_running(Timer::Refutation, now) {
            timers.stop(Timer::Refutation);
            if let Some(full) = timers.at(Timer::FullBeacon) {
                timers.set(Timer::Beacon, full);
            }
        }
    }

    /// A beacon is due, or a heartbeat: sets the time of the next. Between two beacons
    /// there is one heartbeat, and those that answer a suspicion.
    pub fn beacon_due(&self, now: Time, full: bool, timers: &mut Timers, rng: &mut ChaCha8Rng) {
        let t = self.interval_ms;
        let jitter = u64::from(rng.next_u32()) % (t / 5 + 1);
        if full {
            let next_ms = t - t / 10 + jitter;
            timers.set(Timer::FullBeacon, now.plus_ms(next_ms));
            timers.set(Timer::Beacon, now.plus_ms(next_ms / 2));
        } else if let Some(next) = timers.at(Timer::FullBeacon) {
            timers.set(Timer::Beacon, next);
        }
        if timers.is_running(Timer::Refutation, now) {
            timers.set_earlier(Timer::Beacon, now.plus_ms(t / 4 + jitter / 2));
        }
    }

    /// The record of a beacon or a heartbeat, which counts one heartbeat more.
    pub fn beat(
        &mut self,
        now: Time,
        author: u16,
        incarnation: Incarnation,
        body: &Body,
    ) -> Record {
        assert!(incarnation > 0, "nothing is spoken before the first life");
        self.heartbeat = self.heartbeat.saturating_add(1);
        self.last_beacon = now;
        if body.kind() == Kind::Beacon {
            self.last_full = now;
        }
        Record {
            author,
            incarnation,
            seq: self.heartbeat,
            kind: body.kind().number(),
            subject: 0,
            body: codec::encode_body(body),
            signature: Vec::new(),
        }
    }
}

/// "I am here", without what the relay knows.
pub(crate) fn heartbeat_of(s: &Sources<'_>) -> Heartbeat {
    let pose = s.percept.map(|p| p.pose);
    Heartbeat {
        interval: 0,
        sharers: 0,
        east_dm: pose.map_or(0, |p| mm(p.east_m) / 100),
        north_dm: pose.map_or(0, |p| mm(p.north_m) / 100),
        fresh: Vec::new(),
    }
}

/// "I am here", without heartbeat, nonce and what membership and relay know.
pub(crate) fn beacon_of(s: &Sources<'_>) -> Beacon {
    let pose = s.percept.map(|p| p.pose);
    let state = s.mission_state;
    Beacon {
        heartbeat: 0,
        east_mm: pose.map_or(0, |p| mm(p.east_m)),
        north_mm: pose.map_or(0, |p| mm(p.north_m)),
        heading_e4: pose.map_or(0, |p| e4(p.heading_rad)),
        able: state.is_some_and(MissionState::able),
        ground_station: s.config.role == Role::GroundStation,
        finished: state.is_some_and(MissionState::finished),
        nonce: 0,
        counter: state.map_or(0, |m| m.negotiation.rounds.counter()),
        eccentricity: 0,
        interval: 0,
        sharers: 0,
        revision: state.map_or(0, MissionState::revision),
        loop_hash: state.map_or(0, MissionState::loop_hash),
        cover_digest: state.map_or(0, |m| m.covered().digest()),
        gossip: Vec::new(),
        fresh: Vec::new(),
    }
}

fn state_of(s: &Sources<'_>, state: &MissionState) -> State {
    let p = s.percept;
    let activity = match s.config.role {
        Role::GroundStation => Activity::GroundStation,
        Role::Uav => state.activity(),
    };
    State {
        east_mm: p.map_or(0, |p| mm(p.pose.east_m)),
        north_mm: p.map_or(0, |p| mm(p.pose.north_m)),
        height_mm: p.map_or(0, |p| mm(p.height_m)),
        heading_e4: p.map_or(0, |p| e4(p.pose.heading_rad)),
        airspeed_mmps: p.map_or(0, |p| mm(p.airspeed_mps).unsigned_abs()),
        endurance_s: p.map_or(0, |p| mm(p.endurance_s / 1000.0).unsigned_abs()),
        activity,
        mission: state.status(),
        covered: state.covered().count(),
        cells: state.covered().capacity(),
    }
}

#[allow(clippy::cast_possible_truncation, reason = "a heading is at most 2 pi")]
fn e4(rad: f64) -> i32 {
    (rad * 10_000.0).round() as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_core::SeedableRng;

    /// The interval that is announced.
    const I: u64 = 2_000;

    fn outbound() -> (Outbound, Timers, ChaCha8Rng) {
        let mut timers = Timers::default();
        let mut outbound = Outbound::new(1_000, &mut timers);
        outbound.announce(I);
        (outbound, timers, ChaCha8Rng::seed_from_u64(1))
    }

    /// The least and the most of what is drawn many times.
    fn extremes(mut draw: impl FnMut() -> u64) -> (u64, u64) {
        let drawn: Vec<u64> = (0..2_000).map(|_| draw()).collect();
        let least = drawn.iter().copied().min();
        (least.unwrap(), drawn.into_iter().max().unwrap())
    }

    #[test]
    fn beacons_are_an_interval_apart_and_a_heartbeat_is_half_way() {
        let (o, mut timers, mut rng) = outbound();
        let mut now = Time(10_000);
        let next_ms = extremes(|| {
            o.beacon_due(now, true, &mut timers, &mut rng);
            let full = timers.at(Timer::FullBeacon).unwrap();
            let beat = timers.at(Timer::Beacon).unwrap();
            let next_ms = full.since_ms(now);
            assert_eq!(beat.since_ms(now), next_ms / 2);
            o.beacon_due(beat, false, &mut timers, &mut rng);
            assert_eq!(timers.at(Timer::Beacon), Some(full));
            now = full;
            next_ms
        });
        assert_eq!(next_ms, (1_800, 2_200), "10 % more or less");
    }

    #[test]
    fn a_suspicion_is_answered_at_once_and_about_four_times_an_interval_until_the_verdict() {
        let (mut o, mut timers, mut rng) = outbound();
        o.last_beacon = Time(10_000);
        let until = Time(30_000);
        let mut answer_ms = |now: Time| {
            extremes(|| {
                timers.stop(Timer::Beacon);
                o.refute(now, until, &mut timers, &mut rng);
                timers.at(Timer::Beacon).unwrap().since_ms(now)
            })
        };
        assert_eq!(
            answer_ms(Time(12_000)),
            (0, 250),
            "an eighth of an interval"
        );
        assert_eq!(
            answer_ms(Time(10_000)),
            (500, 500),
            "a quarter after the last"
        );
        // A beacon that was to come sooner stays.
        timers.set(Timer::Beacon, Time(12_001));
        o.refute(Time(12_001), until, &mut timers, &mut rng);
        assert_eq!(timers.at(Timer::Beacon), Some(Time(12_001)));
        let mut next_ms = |now: Time| {
            extremes(|| {
                timers.set(Timer::FullBeacon, Time(90_000));
                o.beacon_due(now, false, &mut timers, &mut rng);
                timers.at(Timer::Beacon).unwrap().since_ms(now)
            })
        };
        assert_eq!(next_ms(Time(20_000)), (500, 700));
        assert_eq!(next_ms(until), (60_000, 60_000), "the verdict is passed");
        o.refute(Time(40_000), Time(50_000), &mut timers, &mut rng);
        o.believed(Time(41_000), &mut timers);
        assert!(!timers.is_running(Timer::Refutation, Time(41_000)));
        assert_eq!(timers.at(Timer::Beacon), timers.at(Timer::FullBeacon));
    }

    #[test]
    fn news_of_who_was_suspected_come_with_a_beacon_soon_but_half_an_interval_apart() {
        let (mut o, mut timers, mut rng) = outbound();
        o.last_full = Time(10_000);
        let mut after_ms = |now: Time| {
            extremes(|| {
                timers.stop(Timer::Beacon);
                timers.stop(Timer::FullBeacon);
                o.hasten(now, &mut timers, &mut rng);
                assert_eq!(timers.at(Timer::Beacon), timers.at(Timer::FullBeacon));
                timers.at(Timer::FullBeacon).unwrap().since_ms(now)
            })
        };
        assert_eq!(after_ms(Time(11_500)), (0, 250), "an eighth of an interval");
        assert_eq!(after_ms(Time(10_100)), (900, 900));
    }

    #[test]
    fn a_claim_that_changed_waits_an_interval_and_coverage_two_or_one_if_it_is_wanted() {
        let (mut o, mut timers, _) = outbound();
        (o.last_claim, o.last_cover) = (Time(40_000), Time(50_000));
        timers.set(Timer::Claim, Time(60_000));
        o.claim_changed(&mut timers);
        assert_eq!(timers.at(Timer::Claim), Some(Time(42_000)));
        o.coverage_changed(&mut timers);
        assert_eq!(timers.at(Timer::Cover), Some(Time(54_000)));
        o.coverage_wanted(&mut timers);
        assert_eq!(timers.at(Timer::Cover), Some(Time(52_000)));
        o.coverage_changed(&mut timers);
        assert_eq!(
            timers.at(Timer::Cover),
            Some(Time(52_000)),
            "not later again"
        );
    }

    #[test]
    fn what_recurs_is_up_to_a_quarter_of_an_interval_late() {
        let (o, _, mut rng) = outbound();
        let late_ms = extremes(|| o.jittered(Time(5_000), &mut rng).since_ms(Time(5_000)));
        assert_eq!(late_ms, (0, 500));
    }

    #[test]
    fn a_new_life_counts_from_one_and_says_all_again() {
        let (mut o, mut timers, _) = outbound();
        let beat = |o: &mut Outbound, body: &Body| o.beat(Time(7_000), 3, 2, body);
        let heartbeat = Body::Heartbeat(Heartbeat {
            interval: 4,
            sharers: 2,
            east_dm: 0,
            north_dm: 0,
            fresh: Vec::new(),
        });
        let beacon = Body::Beacon(crate::wire::samples::beacon(1));
        assert_eq!(beat(&mut o, &beacon).seq, 1);
        assert_eq!((o.last_beacon, o.last_full), (Time(7_000), Time(7_000)));
        let second = o.beat(Time(8_000), 3, 2, &heartbeat);
        assert_eq!((second.seq, second.incarnation, o.heartbeat()), (2, 2, 2));
        assert_eq!((o.last_beacon, o.last_full), (Time(8_000), Time(7_000)));
        let finished = Body::Finished(Finished { revision: 1 });
        assert_eq!(o.record(3, 2, 0, &finished).seq, 1);
        assert_eq!(o.record(3, 2, 0, &finished).seq, 2);
        timers.stop(Timer::Claim);
        o.new_life(&mut timers);
        assert_eq!((o.seq(), o.heartbeat()), (0, 0));
        assert_eq!(timers.at(Timer::Claim), Some(Time(I)));
        assert_eq!(timers.at(Timer::Cover), Some(Time(2 * I)));
    }
}
