//! How the streets of a mission are used as UAVs tell it, beside what truly drives there, and the
//! ways that are hinted beside the best ones (`usage`, `usage-sight`, `usage-idle`, `usage-turns`,
//! `usage-range`, `hint`; D2.7 §3.1): by where vehicles and UAVs are. Of a UAV two things alone
//! are believed: which places of streets it says that it watches, and what it counted there.
//!
//! | what | beside |
//! |---|---|
//! | that it watches a place | whether that is in its picture, and mostly not behind buildings that the mission tells |
//! | time that vehicles spent, and their speed | those of who truly was at the watched places |
//! | turns | those that anybody truly took |
//! | density that all together tell with a range | that of all the interval |
//! | a way that is hinted | its time by the true speeds, beside the best way's |

use super::Findings;
use crate::account::secs;
use crate::world::camera::Picture;
use skein_flight::streets::{Network, Turn};
use skein_geometry::frame::Point;
use skein_peer::Mission;
use skein_peer::hint::Hint;
use skein_peer::streets::Streets;
use skein_peer::usage::Usages;
use skein_peer::witness::StreetsSeen;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

mod truth;
mod ways;
use truth::{Driven, Located, Reaches, Seen};
pub use ways::{HintReport, StreetsReport};

/// The time that a UAV counted in one life is off by no more than this, seconds, and this share;
/// and at one stretch by so much from those who may be taken to be there.
const SPENT_OFF_S: f64 = 10.0;
const SPENT_OFF_SHARE: f64 = 0.15;
const STRETCH_OFF_S: f64 = 6.0;
const STRETCH_OFF_SHARE: f64 = 0.25;

/// The speed on a stretch by no more than this, m/s, and this share, where vehicles were there for
/// so long together, seconds, and so many of those who may be taken to be there were nowhere else:
/// filters lag behind who brakes at each end of a stretch.
const SPEED_OFF_MPS: f64 = 1.5;
const SPEED_OFF_SHARE: f64 = 0.2;
const SPEED_FROM_S: f64 = 30.0;
const SPEED_SURE_SHARE: f64 = 0.5;

/// What was watched by no more than this share, and so many metres times seconds: a picture holds
/// up to 300 m of streets, and who is late says for some seconds what it watched before.
const WATCHED_OFF_SHARE: f64 = 0.03;
const WATCHED_OFF_M_S: f64 = 1_500.0;

/// And no more of it than this share, and so much, is behind buildings that the mission tells: these
/// are told to the decimetre, and a place is in the middle of ten metres.
const HIDDEN_SHARE: f64 = 0.05;

/// Well in the picture is what is in so much of half of it, each way; for so much of the time that
/// places are well in a picture somebody watches, less some.
const WELL: f64 = 0.8;
const WATCHED_SHARE: f64 = 0.7;
const WATCHED_LESS_M_S: f64 = 20_000.0;

/// Of the turns that are told so many more than were taken in pictures may be, and so many of
/// those that nobody took all the time, each with a share.
const TURNS_OFF: f64 = 4.0;
const TURNS_OFF_SHARE: f64 = 0.15;

/// Of the densities that all together tell so many are in their range at least, where there are so
/// many.
const HOLD_SHARE: f64 = 0.75;
const HOLD_FROM: u32 = 20;

/// Looks that are farther apart are none of one watch, milliseconds.
const GAP_MS: u64 = 1_000;

/// One UAV in one life.
#[derive(Clone, Debug, Default)]
struct Watcher {
    last_ms: u64,
    watched: BTreeSet<usize>,
    truth: Seen,
    /// What it told of itself last, with the truth of then.
    told: Option<(Usages, Seen)>,
    turned_from: usize,
    /// How much of what it watched was hidden from its camera meanwhile, metres times seconds.
    hidden_m_s: f64,
    /// Turns that were taken while their crossing was in its picture.
    may_turn: u32,
    sight_told: bool,
}

/// One look of a UAV.
#[derive(Clone, Copy)]
pub struct StreetLook<'a> {
    /// Whose, and in which life.
    pub uav: (u16, u32),
    /// Its picture, as it is.
    pub picture: Picture,
    /// How far off its place it takes itself to be, and all that it sees, metres.
    pub displaced_m: f64,
    /// Whether its computer is late: what it says is of where it was.
    pub is_late: bool,
    /// Whether nothing stands between its camera and a place.
    pub sees: &'a dyn Fn(Point) -> bool,
    /// The places that it says it watches.
    pub watched: &'a BTreeSet<usize>,
}

/// The streets of one run.
#[derive(Clone, Debug, Default)]
pub struct StreetCheck {
    of: u32,
    streets: Option<(Arc<Streets>, Arc<Network>)>,
    reaches: Reaches,
    /// Whether the mission tells what hides streets.
    has_buildings: bool,
    now_ms: u64,
    places: Vec<Point>,
    located: Vec<Located>,
    /// What truly drove, by interval and stretch.
    all: ways::ByInterval,
    /// For how long each interval was looked at, milliseconds.
    lasted_ms: BTreeMap<u16, u64>,
    /// All turns that were taken, in their order, and how often each.
    turned: Vec<Turn>,
    taken: BTreeMap<Turn, u32>,
    /// When each place was well in somebody's picture last; and how much that came to.
    pictured_at: Vec<u64>,
    pictured_m_s: f64,
    watchers: BTreeMap<(u16, u32), Watcher>,
    /// Those whose process is no more.
    ended: Vec<(u16, Watcher)>,
    able: BTreeSet<u16>,
    hints: Vec<HintReport>,
    known: Option<Usages>,
}

impl StreetCheck {
    /// The operator has a mission.
    pub fn on_mission(&mut self, mission: &Mission) {
        let Some(streets) = mission.measured_streets() else {
            *self = Self::default();
            return;
        };
        let of = mission.streets_hash();
        let network = match &self.streets {
            Some((_, network)) if of == self.of => Arc::clone(network),
            _ => {
                let network = Arc::new(streets.network());
                *self = Self {
                    pictured_at: vec![0; network.places().len()],
                    reaches: Reaches::of(&network),
                    of,
                    ..Self::default()
                };
                network
            }
        };
        self.streets = Some((Arc::clone(streets), network));
        self.has_buildings = mission.buildings.is_some();
    }

    /// Whether the mission has no streets to measure.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.streets.is_none()
    }

    /// Who flies the newest mission and is not through with it.
    pub fn on_able(&mut self, able: BTreeSet<u16>) {
        self.able = able;
    }

    /// One look of a UAV, beside where vehicles are.
    pub fn on_look(
        &mut self,
        now_ms: u64,
        truth: &[Point],
        look: StreetLook<'_>,
        found: &mut Findings,
    ) {
        let Some((streets, network)) = self.streets.clone() else {
            return;
        };
        self.note_all(now_ms, truth, (&streets, &network));
        let in_picture = |at: Point, share: f64| look.picture.shows(at, share);
        let has_buildings = self.has_buildings;
        let is_open = |at: Point| !has_buildings || (look.sees)(at);
        if self.able.contains(&look.uav.0) {
            for (place, last_ms) in network.places().iter().zip(&mut self.pictured_at) {
                if in_picture(place.at, WELL) && is_open(place.at) {
                    let apart_ms = now_ms.saturating_sub(*last_ms);
                    let apart_ms = if apart_ms <= 250 { apart_ms } else { 0 };
                    self.pictured_m_s += place.length_m * secs(apart_ms);
                    *last_ms = now_ms;
                }
            }
        }
        let turned = self.turned.len();
        let watcher = self.watchers.entry(look.uav).or_insert_with(|| Watcher {
            turned_from: turned,
            ..Watcher::default()
        });
        let apart_ms = now_ms.saturating_sub(watcher.last_ms);
        let apart_ms = if apart_ms <= GAP_MS { apart_ms } else { 0 };
        watcher.last_ms = now_ms;
        watcher.watched.clone_from(look.watched);
        for place in look.watched.iter().filter_map(|i| network.places().get(*i)) {
            watcher.truth.watched_m_s += place.length_m * secs(apart_ms);
            if !look.is_late && !is_open(place.at) {
                watcher.hidden_m_s += place.length_m * secs(apart_ms);
            }
        }
        for at in &self.located {
            if let Some((stretch, place)) = at.on
                && look.watched.contains(&place)
            {
                let driven = watcher.truth.stretches.entry(stretch).or_default();
                driven.add(apart_ms, at.speed_mps);
            }
            let is_sure = at.is_sure(look.displaced_m);
            for (stretch, place) in at.may_be(look.displaced_m) {
                if look.watched.contains(&place) {
                    let driven = watcher.truth.stretches.entry(stretch).or_default();
                    driven.may_ms += apart_ms;
                    driven.sure_ms += if is_sure { apart_ms } else { 0 };
                }
            }
        }
        for turn in &self.turned[watcher.turned_from.min(turned)..] {
            let crossing = network.crossings()[usize::from(turn.over)];
            watcher.may_turn += u32::from(in_picture(crossing, 1.0));
        }
        watcher.turned_from = turned;
        let mut seen = look.watched.iter().filter_map(|i| network.places().get(*i));
        let unseen = seen.any(|p| !in_picture(p.at, 1.0));
        if unseen && !look.is_late && !core::mem::replace(&mut watcher.sight_told, true) {
            found.broken("usage-sight", now_ms, Some(look.uav.0), || {
                "says that it watches a street, and that is not in its picture".to_owned()
            });
        }
    }

    /// What all vehicles do, whoever looks.
    fn note_all(&mut self, now_ms: u64, truth: &[Point], (streets, network): (&Streets, &Network)) {
        let apart_ms = now_ms.saturating_sub(self.now_ms);
        let is_first = self.places.len() != truth.len();
        if is_first {
            self.located = vec![Located::default(); truth.len()];
            self.places = truth.to_vec();
            self.now_ms = now_ms;
            return;
        }
        if apart_ms == 0 {
            return;
        }
        let interval = streets.interval_at(now_ms);
        *self.lasted_ms.entry(interval).or_default() += apart_ms;
        let vehicles = truth.iter().zip(&mut self.places).zip(&mut self.located);
        for ((at, before), located) in vehicles {
            let turn = located.step((network, &self.reaches), (*before, *at), (now_ms, apart_ms));
            *before = *at;
            if let Some((stretch, _)) = located.on {
                let driven = self.all.entry((interval, stretch)).or_default();
                driven.add(apart_ms, located.speed_mps);
            }
            if let Some(turn) = turn {
                self.turned.push(turn);
                *self.taken.entry(turn).or_default() += 1;
            }
        }
        self.now_ms = now_ms;
    }

    /// What was carried here of how streets are used; none without streets.
    #[must_use]
    pub fn usages_of(&self, seen: &StreetsSeen) -> Option<Usages> {
        let (streets, network) = self.streets.clone()?;
        Some(Usages::of(streets, network, seen))
    }

    /// A process begins. One that begins without its disk may take itself to be in the life of the
    /// one before, and knows nothing of what that one counted.
    pub fn on_boot(&mut self, uav: u16) {
        let of_it = (uav, u32::MIN)..=(uav, u32::MAX);
        let lives: Vec<(u16, u32)> = self.watchers.range(of_it).map(|(of, _)| *of).collect();
        let ended = lives.iter().filter_map(|of| self.watchers.remove(of));
        self.ended.extend(ended.map(|w| (uav, w)));
    }

    /// What a UAV says that it counted itself in its life.
    pub fn on_own(&mut self, uav: (u16, u32), own: Usages) {
        if let Some(watcher) = self.watchers.get_mut(&uav) {
            watcher.told = Some((own, watcher.truth.clone()));
        }
    }

    /// What the ground station knows, or who knows most, and the ways that it hints.
    pub fn on_known(&mut self, now_ms: u64, known: Usages, hints: &[Hint], found: &mut Findings) {
        let Some((streets, network)) = self.streets.clone() else {
            return;
        };
        let truth = |stretch: u16| {
            let of = self.all.iter().filter(|((_, s), _)| *s == stretch);
            let mut sum = Driven::default();
            of.for_each(|(_, d)| sum.merge(d));
            sum
        };
        let truth: Vec<Driven> = (0_u16..)
            .zip(network.edges())
            .map(|(n, _)| truth(n))
            .collect();
        self.hints.clear();
        for asked in &streets.asked {
            let hint = hints.iter().find(|h| h.name == asked.name);
            let judged = ways::judge((asked, hint), (&network, &streets), &truth, &known);
            if let Some(why) = judged.wrong() {
                found.broken("hint", now_ms, None, || why);
            }
            self.hints.push(judged);
        }
        self.known = Some(known);
    }

    /// The run is over.
    pub fn on_end(&mut self, now_ms: u64, found: &mut Findings) {
        let (mut watched, mut turns) = (0.0, (0, 0));
        let of = self.watchers.iter().map(|((uav, _), w)| (uav, w));
        for (uav, w) in of.chain(self.ended.iter().map(|(uav, w)| (uav, w))) {
            watched += w.truth.watched_m_s;
            let most_m_s = HIDDEN_SHARE * w.truth.watched_m_s + WATCHED_OFF_M_S;
            if w.hidden_m_s > most_m_s {
                found.broken("usage-sight", now_ms, Some(*uav), || {
                    format!(
                        "watched streets for {:.0} m s, and houses hid {:.0} of them",
                        w.truth.watched_m_s, w.hidden_m_s
                    )
                });
            }
            if let Some((told, truth)) = &w.told {
                check_told((*uav, now_ms), told, truth, found);
                let told: u32 = told.turns().map(|(_, n)| n).sum();
                turns = (turns.0 + told, turns.1 + w.may_turn);
                let most = TURNS_OFF + (1.0 + TURNS_OFF_SHARE) * f64::from(w.may_turn);
                if f64::from(told) > most {
                    found.broken("usage-turns", now_ms, Some(*uav), || {
                        format!("tells {told} turns, and {} were taken", w.may_turn)
                    });
                }
            }
        }
        if watched + WATCHED_LESS_M_S < WATCHED_SHARE * self.pictured_m_s {
            let pictured = self.pictured_m_s;
            found.broken("usage-idle", now_ms, None, || {
                format!("streets were well in pictures for {pictured:.0} m s, and watched for {watched:.0} m s")
            });
        }
        if let Some(report) = self.report() {
            let (told, wrong) = (report.turns, report.turns_wrong);
            if f64::from(wrong) > TURNS_OFF + TURNS_OFF_SHARE * f64::from(told) {
                found.broken("usage-turns", now_ms, None, || {
                    format!("{wrong} of {told} turns that are told nobody took")
                });
            }
            let (hold, of) = report.density_holds;
            if of >= HOLD_FROM && f64::from(hold) < HOLD_SHARE * f64::from(of) {
                found.broken("usage-range", now_ms, None, || {
                    format!("the true density is in {hold} of {of} ranges that are told")
                });
            }
        }
    }

    /// Estimates beside truth; none without streets, or where nobody knows anything.
    #[must_use]
    pub fn report(&self) -> Option<StreetsReport> {
        let ((streets, network), known) = (self.streets.as_ref()?, self.known.as_ref()?);
        let mut report = StreetsReport {
            stretches: u16::try_from(network.edges().len()).unwrap_or(u16::MAX),
            length_m: network.length_m(),
            hints: self.hints.clone(),
            turned: u32::try_from(self.turned.len()).unwrap_or(u32::MAX),
            ..StreetsReport::default()
        };
        for (turn, n) in known.turns() {
            report.turns += n;
            if !self.taken.contains_key(&turn) {
                report.turns_wrong += n;
            }
        }
        report.compare(
            known,
            (&self.all, &self.lasted_ms),
            (network, streets.usual_mps()),
        );
        Some(report)
    }
}

/// What one UAV told of itself in one life, beside the truth.
fn check_told((uav, now_ms): (u16, u64), told: &Usages, truth: &Seen, found: &mut Findings) {
    let mut says_s = 0.0;
    let mut watched = 0.0;
    for (n, edge) in (0_u16..).zip(told.network().edges()) {
        let says = told.of_stretch(n);
        let is = truth.stretches.get(&n).copied().unwrap_or_default();
        says_s += says.spent_s();
        watched += says.watched_s(edge.length_m) * edge.length_m;
        let (sure_s, may_s) = (secs(is.sure_ms), secs(is.may_ms));
        let least_s = (1.0 - STRETCH_OFF_SHARE) * sure_s - STRETCH_OFF_S;
        let most_s = (1.0 + STRETCH_OFF_SHARE) * may_s + STRETCH_OFF_S;
        if !(least_s..=most_s).contains(&says.spent_s()) {
            found.broken("usage", now_ms, Some(uav), || {
                format!(
                    "tells {:.0} s of vehicles on stretch {n}, and they were {sure_s:.0} to {may_s:.0} s",
                    says.spent_s()
                )
            });
        }
        if let (Some(v), Some(truly)) = (says.speed_mps(), is.speed_mps())
            && is.spent_s() >= SPEED_FROM_S
            && sure_s >= SPEED_SURE_SHARE * may_s
            && (v - truly).abs() > SPEED_OFF_MPS + SPEED_OFF_SHARE * truly
        {
            found.broken("usage", now_ms, Some(uav), || {
                format!("tells {v:.1} m/s on stretch {n}, and it was {truly:.1} m/s")
            });
        }
    }
    let is_s: f64 = truth.stretches.values().map(Driven::spent_s).sum();
    if (says_s - is_s).abs() > SPENT_OFF_S + SPENT_OFF_SHARE * is_s {
        found.broken("usage", now_ms, Some(uav), || {
            format!("tells {says_s:.0} s of vehicles on all streets, and they were {is_s:.0} s")
        });
    }
    let off = (watched - truth.watched_m_s).abs();
    if off > WATCHED_OFF_M_S + WATCHED_OFF_SHARE * truth.watched_m_s {
        found.broken("usage", now_ms, Some(uav), || {
            format!(
                "tells {watched:.0} m s of streets watched, and it was {:.0}",
                truth.watched_m_s
            )
        });
    }
}

#[cfg(test)]
mod tests;
