//! One peer as another knows it: its freshest heartbeat, how old that is, by how many
//! hops it came.

use super::extent::{HOP_INTERVALS, Patience};
use super::questions::urgency;
use super::{Change, Info};
use crate::Incarnation;
use crate::input::Time;
use crate::output::Status;
use crate::protocol::airtime::ms_of;
use crate::wire::message::{Fresh, Gossip};

/// Of those who come back together the first and the last are heard of so many intervals after
/// one another at most, as a rule: news of them goes first, some in each beacon.
const TOGETHER_INTERVALS: u64 = 5;

/// An age that grows: so much when it was heard, and the time since.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Age {
    pub(super) told_ms: u64,
    pub(super) at: Time,
}

impl Age {
    pub(super) fn ms(self, now: Time) -> u64 {
        self.told_ms.saturating_add(now.since_ms(self.at))
    }

    /// Older than anybody waits for, of who was never heard: how old what it said was when it came
    /// nobody knows, and who waits for longer than whoever tells of it would take it for alive.
    pub(super) fn beyond_all(at: Time) -> Self {
        let told_ms = u64::from(u16::MAX) * 100;
        Self { told_ms, at }
    }

    /// As much older.
    pub(super) fn and_ms(self, more_ms: u64) -> Self {
        let told_ms = self.told_ms.saturating_add(more_ms);
        Self { told_ms, ..self }
    }

    /// When what is so old began.
    fn since(self) -> Time {
        Time(self.at.0.saturating_sub(self.told_ms))
    }

    /// As that of a heartbeat is told: 100 ms units, rounded up. Who is dead is no younger for it.
    fn ds(self, now: Time) -> u16 {
        u16::try_from(self.ms(now).div_ceil(100)).unwrap_or(u16::MAX)
    }

    /// As that of a suspicion is told: 100 ms units, rounded down. Of several the oldest counts:
    /// rounded up it would grow whenever somebody passes it on.
    fn full_ds(self, now: Time) -> u16 {
        u16::try_from(self.ms(now) / 100).unwrap_or(u16::MAX)
    }
}

/// One heartbeat as it was heard.
#[derive(Clone, Copy, Debug)]
pub(super) struct HeardHeartbeat {
    pub(super) id: u16,
    pub(super) incarnation: Incarnation,
    pub(super) count: u32,
    pub(super) age: Age,
    pub(super) hops: u8,
    /// What its author announced with it, quarters of T.
    pub(super) interval: u8,
    pub(super) suspected: Option<Age>,
}

#[derive(Clone, Debug)]
pub(super) struct Known {
    pub(super) freshest: HeardHeartbeat,
    /// Of the time since the freshest heartbeat so much was no silence: nobody listened.
    pub(super) excused_ms: u64,
    pub(super) status: Status,
    pub(super) info: Info,
    /// Fewest hops by interval, for the last ten: since when, how many.
    hops: [(Time, u8); 10],
    /// Which of them is the latest.
    latest: usize,
    pub(super) eccentricity: u8,
    pub(super) urgent_until: Time,
    /// How often others were told of it since it is news.
    pub(super) news_told: u8,
    /// This peer suspects it, and nobody was told so yet.
    pub(super) is_untold_suspicion: bool,
    /// A neighbour that depends on what this peer tells of it.
    lag: Option<Lag>,
    /// That it was held for down, and is there again.
    absence: Option<Absence>,
    /// When this peer last told of it.
    told_at: Time,
    /// When the heartbeat was sent that neighbours were last told of.
    told_sent: Told,
    /// How urgently a later heartbeat was asked for.
    pub(super) asked: u8,
    /// When this peer last answered for it at once.
    pub(super) answered_at: Time,
    /// That it is asked for although it is down.
    sought: Option<Sought>,
    /// It lost its disk and uses an incarnation twice. It is told, so that it takes a new one.
    reuse: Option<Reuse>,
}

/// What the patience of others owes to a peer; nothing of who is down or was not heard.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Weight {
    /// The interval that it announced.
    pub(super) interval: u8,
    /// The fewest hops to it of late.
    pub(super) hops: u8,
    /// The hops to whoever is farthest from it, as it said of late.
    pub(super) eccentricity: u8,
}

/// When the heartbeat was sent that somebody knows, as far as this peer can guess.
#[derive(Clone, Copy, Debug, Default)]
struct Told {
    /// If whoever depends on this peer hears nobody else.
    by_me: Time,
    /// If it hears all.
    by_any: Time,
}

impl Told {
    fn of(sent: Time) -> Self {
        Self {
            by_me: sent,
            by_any: sent,
        }
    }

    /// A neighbour tells of a later one. One in two does not hear it.
    fn by_others(&mut self, sent: Time) {
        self.by_any = half_way(self.by_any, sent);
    }

    /// This peer does.
    fn by_me(&mut self, sent: Time) {
        self.by_others(sent);
        self.by_me = half_way(self.by_me, sent);
    }

    /// What is gained by telling of one that was sent then.
    fn gain_ms(self, sent: Time) -> u64 {
        let alone_ms = sent.since_ms(self.by_me) / ALONE;
        sent.since_ms(self.by_any).max(alone_ms)
    }
}

/// Half way from what was known to what is told, if that is later.
fn half_way(known: Time, told: Time) -> Time {
    Time(u64::midpoint(known.0, told.0)).max(known)
}

/// In one of so many cases whoever depends on a peer hears nobody else.
const ALONE: u64 = 4;

/// A neighbour that hears somebody by more hops than this peer, or less: of several the one
/// that knows least.
#[derive(Clone, Copy, Debug)]
struct Lag {
    teller: u16,
    /// When its freshest heartbeat was sent.
    since: Told,
    /// When it told so.
    at: Time,
    until: Time,
}

impl Lag {
    fn new(now: Time, teller: u16, sent: Time, interval_ms: u64) -> Self {
        Self {
            teller,
            since: Told::of(sent),
            at: now,
            until: now.plus_ms(HOP_INTERVALS * interval_ms),
        }
    }
}

/// Somebody was held for down, and is there again.
#[derive(Clone, Copy, Debug)]
pub(super) struct Absence {
    /// When the heartbeat was sent that was known of it meanwhile.
    pub(super) since: Time,
    /// When it was heard of again.
    pub(super) until: Time,
    /// Whether it was heard itself since.
    is_met: bool,
}

/// Somebody who is down may have come back with another.
#[derive(Clone, Copy, Debug)]
struct Sought {
    until: Time,
    /// When it is next asked for.
    at: Time,
}

/// One life was begun twice.
#[derive(Clone, Copy, Debug)]
struct Reuse {
    /// An old heartbeat of it with a higher count than is sent now.
    heartbeat: HeardHeartbeat,
    /// When a lower count was last heard.
    heard_at: Time,
    /// When it was last told.
    told_at: Option<Time>,
}

/// Of a peer the fewest hops are told by which it was heard of in so many of the longest
/// intervals: each neighbour has told of it by then, and it has not flown far.
const NEAR_INTERVALS: u64 = 4;

/// Hops of somebody who is not heard itself, and of whom nothing more is known.
const FAR_HOPS: u8 = 2;

/// News is told so often: one beacon may be lost, two hardly are.
const NEWS_TOLD: u8 = 2;

/// A heartbeat that is so many behind is two intervals older.
const BEHIND: u32 = 4;

/// What a neighbour told of what it knows is outdated after so many intervals, whoever knew
/// more meanwhile.
const LAG_INTERVALS: u64 = 4;

/// Of so many further lives the bits that are told are taken for a later one.
const LIVES_AHEAD: u8 = 3;

/// Who began a life anew without knowing is told so again after so many intervals.
const REMINDER_INTERVALS: u64 = 2;

/// What was sent so many intervals later was sent later, whatever delays it.
const LATER_INTERVALS: u64 = 2;

/// Hops of somebody who was not heard in the last ten intervals.
const NO_HOPS: [(Time, u8); 10] = [(Time(0), u8::MAX); 10];

impl Known {
    pub(super) fn new(heard: HeardHeartbeat, urgent_until: Time) -> Self {
        let status = if heard.suspected.is_some() {
            Status::Suspect
        } else {
            Status::Alive
        };
        Self {
            freshest: heard,
            excused_ms: 0,
            status,
            info: Info::default(),
            hops: NO_HOPS,
            latest: 0,
            eccentricity: 0,
            urgent_until,
            news_told: 0,
            is_untold_suspicion: false,
            lag: None,
            absence: None,
            told_at: Time(0),
            told_sent: Told::default(),
            asked: 0,
            answered_at: Time(0),
            sought: None,
            reuse: None,
        }
    }

    /// How long the peer was silent while this one listened.
    pub(super) fn silent_ms(&self, now: Time) -> u64 {
        self.freshest.age.ms(now).saturating_sub(self.excused_ms)
    }

    /// For so long nobody listened here: a refutation may have been missed.
    pub(super) fn excuse(&mut self, now: Time, late_ms: u64) {
        self.excused_ms = self.excused_ms.saturating_add(late_ms);
        if let Some(suspected) = &mut self.freshest.suspected {
            suspected.at = suspected.at.plus_ms(late_ms).min(now);
        }
    }

    /// Which life the last bits of it mean, told with a heartbeat of that age: this one, or one of
    /// the next if that was sent later than the freshest heartbeat that is known.
    pub(super) fn life_told(&self, now: Time, bits: u8, age: Age) -> Option<Incarnation> {
        let mine = &self.freshest;
        let ahead = bits.wrapping_sub(Fresh::life_of(mine.incarnation)) & Fresh::LIFE_BITS;
        let is_later = age.ms(now) < mine.age.ms(now);
        let is_meant = ahead == 0 || (ahead <= LIVES_AHEAD && is_later);
        is_meant.then(|| mine.incarnation.saturating_add(Incarnation::from(ahead)))
    }

    /// Whether a heartbeat of this life says nothing that is not known: it is no later than the
    /// freshest, and if it is the same it came by no shorter way and is not suspected.
    pub(super) fn has_heard(&self, heard: &HeardHeartbeat) -> bool {
        let mine = &self.freshest;
        let again =
            heard.count == mine.count && heard.hops >= mine.hops && heard.suspected.is_none();
        heard.incarnation == mine.incarnation && (heard.count < mine.count || again)
    }

    /// The heartbeat known, heard once more. Its age stays as first heard: taking the
    /// younger would let echoes keep the dead alive, taking the older would age the
    /// living by the rounding of every echo.
    pub(super) fn merge_same(
        &mut self,
        now: Time,
        heard: HeardHeartbeat,
        interval_ms: u64,
        urgent_until: Time,
        changes: &mut Vec<Change>,
    ) {
        self.note_as_near(now, &heard, interval_ms);
        self.freshest.hops = self.freshest.hops.min(heard.hops);
        let Some(told) = heard.suspected else {
            return;
        };
        self.is_untold_suspicion = false;
        if self
            .freshest
            .suspected
            .is_none_or(|mine| mine.ms(now) < told.ms(now))
        {
            self.freshest.suspected = Some(told);
        }
        if self.status == Status::Alive {
            self.status = Status::Suspect;
            self.is_news_until(urgent_until);
            changes.push(self.change());
        }
    }

    /// Whether what is believed of it changed lately, so that others are to hear of it first.
    pub(super) fn is_news(&self, now: Time) -> bool {
        (self.urgent_until > now && self.news_told < NEWS_TOLD) || self.is_untold_suspicion
    }

    /// What is believed of it changed: others are to hear of it first.
    pub(super) fn is_news_until(&mut self, until: Time) {
        (self.urgent_until, self.news_told) = (until, 0);
    }

    /// Whether it is news that nobody was told yet.
    pub(super) fn is_untold_news(&self, now: Time) -> bool {
        self.is_news(now) && self.news_told == 0
    }

    /// Whether nobody refuted a suspicion for so long, which could have been refuted.
    pub(super) fn is_condemned(&self, now: Time, verdict_ms: u64) -> bool {
        let suspected = self
            .freshest
            .suspected
            .filter(|_| !self.is_untold_suspicion);
        suspected.is_some_and(|age| age.ms(now) >= verdict_ms)
    }

    /// A suspicion that this peer raised is told the first time: whoever knows better has as
    /// long to say so as if it had been told within an interval.
    pub(super) fn tell_news(&mut self, now: Time, interval_ms: u64) {
        self.news_told = self.news_told.saturating_add(1);
        if std::mem::take(&mut self.is_untold_suspicion)
            && let Some(age) = &mut self.freshest.suspected
            && age.ms(now) > interval_ms
        {
            *age = Age {
                told_ms: interval_ms,
                at: now,
            };
        }
    }

    /// A neighbour tells of it: if it hears of it by more hops than this peer, or not any
    /// more, it depends on whoever is nearer.
    pub(super) fn note_told(
        &mut self,
        now: Time,
        teller: u16,
        told: &HeardHeartbeat,
        interval_ms: u64,
    ) {
        let mine = &self.freshest;
        if told.incarnation != mine.incarnation {
            return;
        }
        // One hop is that from the neighbour.
        let farther = told.hops > self.distance(now, interval_ms).saturating_add(1);
        let behind = told.count.saturating_add(BEHIND) <= mine.count;
        let sent = told.age.since();
        let told = Lag::new(now, teller, sent, interval_ms);
        if !farther && !behind {
            self.lag = self.lag.filter(|lag| lag.teller != teller);
            return self.others_told(sent);
        }
        let outdated =
            |lag: Lag| lag.teller == teller || now.since_ms(lag.at) > LAG_INTERVALS * interval_ms;
        if self
            .lag
            .is_none_or(|lag| outdated(lag) || told.since.by_any < lag.since.by_any)
        {
            self.lag = Some(told);
        } else if let Some(lag) = &mut self.lag {
            lag.until = lag.until.max(told.until);
        }
    }

    /// It was held for down, and is heard of again.
    pub(super) fn is_back(&mut self, now: Time) {
        self.absence = Some(Absence {
            since: self.freshest.age.since(),
            until: now,
            is_met: false,
        });
        (self.hops, self.sought) = (NO_HOPS, None);
    }

    /// Whether it was there well before somebody else came back at that time: who came back little
    /// before that one, or after it, may have come with it.
    pub(super) fn was_there(&self, before: Time, interval_ms: u64) -> bool {
        self.absence
            .is_none_or(|a| before.since_ms(a.until) > TOGETHER_INTERVALS * interval_ms)
    }

    /// It is heard itself. Its absence, if it is over of late and this is the first time since.
    pub(super) fn meet(&mut self, now: Time, interval_ms: u64) -> Option<Absence> {
        let absence = self.absence.as_mut()?;
        let is_met = std::mem::replace(&mut absence.is_met, true);
        let is_late = now.since_ms(absence.until) > HOP_INTERVALS * interval_ms;
        (!is_met && !is_late).then_some(*absence)
    }

    /// A neighbour was away since then, and this one was there: nobody told that one of it.
    pub(super) fn note_unknown_to(
        &mut self,
        now: Time,
        neighbour: u16,
        since: Time,
        interval_ms: u64,
    ) {
        let lag = Lag::new(now, neighbour, since, interval_ms);
        let knows_more = |l: Lag| l.until <= now || lag.since.by_any < l.since.by_any;
        if self.lag.is_none_or(knows_more) {
            self.lag = Some(lag);
        }
    }

    /// A neighbour tells of a heartbeat that was sent then.
    fn others_told(&mut self, sent: Time) {
        self.told_sent.by_others(sent);
        if let Some(lag) = &mut self.lag {
            lag.since.by_others(sent);
        }
    }

    /// This peer tells of it.
    pub(super) fn tell(&mut self, now: Time) {
        let sent = self.freshest.age.since();
        self.told_at = now;
        self.told_sent = Told::of(sent);
        if let Some(lag) = &mut self.lag {
            lag.since.by_me(sent);
        }
    }

    /// Whether a neighbour depends on what this peer tells of it.
    pub(super) fn is_wanted(&self, now: Time) -> bool {
        self.lag.is_some_and(|lag| lag.until > now)
    }

    /// Whether its heartbeat is to be told because it is so old: who knows a later one tells it.
    pub(super) fn asks(&self, now: Time, old_ms: u64, again_ms: u64) -> bool {
        self.freshest.age.ms(now) > old_ms && now.since_ms(self.told_at) > again_ms
    }

    /// How much is gained by telling of it: by so much the heartbeat known here is later than
    /// what the neighbour knows that knows least, or half of what it is later than the last
    /// one told. Of equals goes first who was told of longest ago.
    pub(super) fn want(&self, now: Time) -> (u64, u64) {
        let sent = self.freshest.age.since();
        let lag = self.lag.filter(|lag| lag.until > now);
        let there_ms = lag.map_or(0, |lag| lag.since.gain_ms(sent));
        let untold_ms = self.told_sent.gain_ms(sent) / 2;
        (there_ms.max(untold_ms), now.since_ms(self.told_at))
    }

    /// Whether somebody is told to be suspected who was heard since.
    pub(super) fn disputes(&self, told: &HeardHeartbeat) -> bool {
        self.status == Status::Alive
            && told.suspected.is_some()
            && told.incarnation == self.freshest.incarnation
            && told.count < self.freshest.count
    }

    /// Whether another knows a later heartbeat of this one, which is suspected here.
    pub(super) fn is_refuted_by(&self, told: &HeardHeartbeat) -> bool {
        self.status == Status::Suspect
            && told.hops > 1
            && told.incarnation == self.freshest.incarnation
            && told.count > self.freshest.count
    }

    /// Whether a later heartbeat is to be asked for at once, more urgently than before.
    pub(super) fn asks_at_once(&mut self, now: Time, patience: &Patience, period_ms: u64) -> bool {
        let urgency = self.urgency(now, patience, period_ms);
        let asks = urgency > self.asked;
        self.asked = self.asked.max(urgency);
        asks
    }

    /// If it is down it is asked for until then.
    pub(super) fn seek(&mut self, now: Time, until: Time) {
        if self.status == Status::Down && !self.is_sought(now) {
            self.sought = Some(Sought { until, at: now });
        }
    }

    /// Whether it is down and asked for.
    pub(super) fn is_sought(&self, now: Time) -> bool {
        self.status == Status::Down && self.sought.is_some_and(|sought| now < sought.until)
    }

    /// Whether it is to be asked for now, who is down.
    pub(super) fn seeks_at_once(&mut self, now: Time, again_ms: u64) -> bool {
        let is_sought = self.is_sought(now);
        let due = self.sought.as_mut().filter(|s| is_sought && s.at <= now);
        let Some(sought) = due else {
            return false;
        };
        sought.at = now.plus_ms(again_ms);
        true
    }

    /// How urgent it is to hear of it: 0 while gossip has time, and of who is down.
    pub(super) fn urgency(&self, now: Time, patience: &Patience, period_ms: u64) -> u8 {
        if self.status == Status::Down {
            return 0;
        }
        let verdict_ms = patience.verdict_ms(ms_of(self.freshest.interval, period_ms));
        urgency(&self.freshest, patience, verdict_ms, now)
    }

    /// Whether somebody asks for a later heartbeat than this, and one is known here.
    pub(super) fn answers(&self, now: Time, asked: &HeardHeartbeat, again_ms: u64) -> bool {
        self.status == Status::Alive
            && asked.incarnation == self.freshest.incarnation
            && asked.count < self.freshest.count
            && (self.answered_at == Time(0) || now.since_ms(self.answered_at) >= again_ms)
    }

    pub(super) fn note_hops(&mut self, now: Time, hops: u8, interval_ms: u64) {
        let (since, fewest) = self.hops[self.latest];
        if fewest != u8::MAX && now.since_ms(since) < interval_ms {
            self.hops[self.latest].1 = fewest.min(hops);
        } else {
            self.latest = (self.latest + 1) % self.hops.len();
            self.hops[self.latest] = (now, hops);
        }
    }

    /// The heartbeat known came once more, by no more hops than those of late. By more only
    /// what is fresher counts: who is gone would be farther with each echo.
    fn note_as_near(&mut self, now: Time, heard: &HeardHeartbeat, interval_ms: u64) {
        if heard.hops > self.distance(now, interval_ms) {
            return;
        }
        if self.is_heard_once() {
            let (_, fewest) = self.hops[self.latest];
            self.hops[self.latest] = (now, heard.hops.min(fewest));
        } else {
            self.note_hops(now, heard.hops, interval_ms);
        }
    }

    /// Whether one heartbeat of it was heard of since it is known, or there again.
    fn is_heard_once(&self) -> bool {
        self.nth_hops(1).1 == u8::MAX
    }

    /// The fewest hops in an interval, so many of those that are noted ago.
    fn nth_hops(&self, ago: usize) -> (Time, u8) {
        let all = self.hops.len();
        self.hops[(self.latest + all - ago) % all]
    }

    /// The fewest hops by which it was heard of lately: the freshest heartbeat may have come
    /// by a longer way.
    pub(super) fn distance(&self, now: Time, interval_ms: u64) -> u8 {
        let lately_ms = NEAR_INTERVALS * interval_ms;
        let lately = self
            .hops
            .iter()
            .filter(|(since, _)| now.since_ms(*since) < lately_ms);
        let fewest = lately.map(|(_, hops)| *hops).min();
        fewest.unwrap_or(u8::MAX).min(self.freshest.hops)
    }

    /// What counts of it at a moment.
    pub(super) fn weight(&self, now: Time, window_ms: u64) -> Weight {
        if self.status == Status::Down {
            return Weight::default();
        }
        let of_late = self.hearings();
        let of_late = of_late.filter(|(until, _)| now.since_ms(*until) < window_ms);
        let fewest = of_late.map(|(_, hops)| hops).min();
        let said = self.info.heard.is_some_and(|t| now.since_ms(t) < window_ms);
        Weight {
            interval: self.freshest.interval,
            hops: fewest.unwrap_or(0),
            eccentricity: if said { self.eccentricity } else { 0 },
        }
    }

    /// By how many hops it was heard of, and since when each counts. Each counts as long as the
    /// one after it: the freshest may have come by a long way, and of somebody far it is often
    /// the only one of late. What came alone says that it is farther than one hop at most.
    fn hearings(&self) -> impl Iterator<Item = (Time, u8)> + '_ {
        let most = if self.is_heard_once() {
            FAR_HOPS
        } else {
            u8::MAX
        };
        let each = (0..self.hops.len()).map(|ago| {
            let (since, _) = self.nth_hops(ago.saturating_sub(1));
            (since, self.nth_hops(ago).1)
        });
        let each = each.filter(|(_, hops)| *hops < u8::MAX);
        each.map(move |(since, hops)| (since, hops.min(most)))
    }

    /// Since when it was last heard by so many hops at most.
    pub(super) fn last_within(&self, hops: u8) -> Time {
        let within = self.hearings().filter(|(_, by)| *by <= hops);
        within.map(|(since, _)| since).max().unwrap_or_default()
    }

    pub(super) fn change(&self) -> Change {
        let HeardHeartbeat {
            id, incarnation, ..
        } = self.freshest;
        Change {
            peer: id,
            incarnation,
            status: self.status,
        }
    }

    pub(super) fn gossip(&self, now: Time, interval_ms: u64) -> Gossip {
        self.gossip_of(&self.freshest, now, interval_ms)
    }

    /// Whether its heartbeat alone tells what is believed of it.
    pub(super) fn is_believed(&self) -> bool {
        self.status == Status::Alive && self.freshest.suspected.is_none()
    }

    pub(super) fn fresh(&self, now: Time, interval_ms: u64) -> Fresh {
        let HeardHeartbeat {
            id,
            incarnation,
            count,
            age,
            interval,
            ..
        } = self.freshest;
        // Who is down is asked for by the age of its heartbeat: the verdict is not for others.
        let suspected = self.freshest.suspected;
        let suspected = suspected.filter(|_| self.status != Status::Down);
        Fresh {
            id,
            life: Fresh::life_of(incarnation),
            heartbeat: count,
            age_ds: age.ds(now),
            hops: self.distance(now, interval_ms),
            interval,
            able: self.info.able,
            suspected_ds: suspected.map(|age| age.full_ds(now)),
        }
    }

    /// What the peer itself has to hear, if it began a life anew without knowing and may hear it.
    pub(super) fn reminder(&self, now: Time, moment: (u64, u64)) -> Option<Gossip> {
        let (interval_ms, own_interval_ms) = moment;
        let reuse = self.reuse.as_ref()?;
        let waits_ms = REMINDER_INTERVALS * own_interval_ms;
        let is_due = reuse.told_at.is_none_or(|t| now.since_ms(t) >= waits_ms);
        let is_there = now.since_ms(reuse.heard_at) < HOP_INTERVALS * interval_ms;
        (is_due && is_there).then(|| self.gossip_of(&reuse.heartbeat, now, interval_ms))
    }

    /// The peer itself was told so.
    pub(super) fn remind(&mut self, now: Time) {
        if let Some(reuse) = &mut self.reuse {
            reuse.told_at = Some(now);
        }
    }

    fn gossip_of(&self, heard: &HeardHeartbeat, now: Time, interval_ms: u64) -> Gossip {
        Gossip {
            id: heard.id,
            incarnation: heard.incarnation,
            heartbeat: heard.count,
            age_ds: heard.age.ds(now),
            hops: self.distance(now, interval_ms),
            interval: heard.interval,
            suspected_ds: heard.suspected.map(|age| age.full_ds(now)),
            able: self.info.able,
            max_seq: 0,
            digest: 0,
        }
    }

    /// An old heartbeat of this life with a higher count than a fresh one: nobody counts
    /// backwards, so the incarnation is used twice.
    pub(super) fn note_higher_count(&mut self, now: Time, heard: HeardHeartbeat) {
        // What was noted before goes beyond the fresh one itself.
        let most = self
            .reuse
            .map_or(self.freshest.count, |r| r.heartbeat.count);
        if heard.count > most {
            self.reuse = Some(Reuse {
                heartbeat: heard,
                heard_at: now,
                told_at: None,
            });
        }
    }

    /// It says itself a lower count of this life than the one that it was known by for long.
    pub(super) fn note_lower_count(&mut self, now: Time, heard: &HeardHeartbeat, interval_ms: u64) {
        let mine = self.freshest;
        let is_later = mine.age.ms(now) > heard.age.ms(now) + LATER_INTERVALS * interval_ms;
        if heard.hops == 1 && heard.incarnation == mine.incarnation && is_later {
            let told_at = self.reuse.and_then(|r| r.told_at);
            self.reuse = Some(Reuse {
                heartbeat: mine,
                heard_at: now,
                told_at,
            });
        }
    }

    /// It says a count of its life that nobody knew, or it has a life of its own.
    pub(super) fn note_fresh_count(&mut self, now: Time, heard: &HeardHeartbeat) {
        let life = self.freshest.incarnation;
        let is_lower = |r: &Reuse| heard.incarnation == life && heard.count < r.heartbeat.count;
        self.reuse = self.reuse.filter(is_lower);
        if let Some(reuse) = &mut self.reuse {
            reuse.heard_at = now;
        }
    }
}
