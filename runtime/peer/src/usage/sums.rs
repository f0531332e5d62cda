//! What is known of how streets are used, all authors together, for people and for whoever looks
//! for a way.

use crate::counting::poisson_range;
use crate::streets::Streets;
use crate::wire::usage::{Usage, interval_of};
use crate::witness::StreetsSeen;
use serde::{Deserialize, Serialize};
use skein_flight::streets::{Network, Turn};
use std::collections::BTreeMap;
use std::sync::Arc;

/// How unlike the speeds of vehicles on one stretch are, standard deviation: this share, and so
/// much more, m/s.
const UNLIKE_SHARE: f64 = 0.35;
const UNLIKE_MPS: f64 = 0.5;

/// Vehicles come in platoons, and some come into view twice: so many of those that were seen tell
/// as much as one that comes alone.
const ALIKE: u32 = 2;

/// What all authors together saw of a stretch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct StretchSum {
    /// How much of it was watched for how long, metres times seconds.
    pub watched_m_s: u64,
    /// How long vehicles were there meanwhile, 100 ms.
    pub spent_ds: u64,
    /// And stood, 100 ms.
    pub stood_ds: u64,
    /// How far they drove there, metres.
    pub driven_m: u64,
    /// How often one came into view.
    pub vehicles: u32,
}

#[allow(clippy::cast_precision_loss, reason = "no sum is as large as 2^52")]
fn float(n: u64) -> f64 {
    n as f64
}

impl StretchSum {
    /// Adds what was seen in another interval, or by somebody else.
    pub fn add(&mut self, more: &Self) {
        self.watched_m_s += more.watched_m_s;
        self.spent_ds += more.spent_ds;
        self.stood_ds += more.stood_ds;
        self.driven_m += more.driven_m;
        self.vehicles += more.vehicles;
    }

    /// How long vehicles were there, seconds.
    #[must_use]
    pub fn spent_s(&self) -> f64 {
        float(self.spent_ds) / 10.0
    }

    /// For how long all of it was watched, or a part of it for longer, seconds.
    #[must_use]
    pub fn watched_s(&self, length_m: f64) -> f64 {
        float(self.watched_m_s) / length_m.max(1.0)
    }

    /// Density, vehicles a kilometre: time spent over what was watched (Edie 1963); none where
    /// nothing was.
    #[must_use]
    pub fn density_per_km(&self) -> Option<f64> {
        let watched = float(self.watched_m_s);
        (self.watched_m_s > 0).then(|| 1_000.0 * self.spent_s() / watched)
    }

    /// Flow both ways, vehicles an hour: ways driven over what was watched.
    #[must_use]
    pub fn flow_per_h(&self) -> Option<f64> {
        let watched = float(self.watched_m_s);
        (self.watched_m_s > 0).then(|| 3_600.0 * float(self.driven_m) / watched)
    }

    /// Space-mean speed, m/s; none where nobody was there.
    #[must_use]
    pub fn speed_mps(&self) -> Option<f64> {
        (self.spent_ds > 0).then(|| float(self.driven_m) / self.spent_s())
    }

    /// How many stood there at a time, in the mean; of a stretch of this length, metres.
    #[must_use]
    pub fn standing(&self, length_m: f64) -> Option<f64> {
        let watched_s = self.watched_s(length_m);
        (self.watched_m_s > 0).then(|| float(self.stood_ds) / 10.0 / watched_s)
    }

    /// Where the density is in nineteen cases of twenty, vehicles a kilometre, if pairs of vehicles
    /// come independently of each other and one that is seen takes as long as the others did;
    /// where none was, as long as half of the stretch at this speed, m/s.
    #[must_use]
    pub fn density_range_per_km(&self, length_m: f64, usual_mps: f64) -> Option<(f64, f64)> {
        let n = self.vehicles.div_ceil(ALIKE);
        let each_s = if n > 0 {
            self.spent_s() / f64::from(n)
        } else {
            length_m / 2.0 / usual_mps.max(0.1)
        };
        let (low, high) = poisson_range(n);
        let per_km = |n: f64| 1_000.0 * n * each_s / float(self.watched_m_s);
        (self.watched_m_s > 0).then(|| (per_km(low), per_km(high)))
    }

    /// Where the space-mean speed is in nineteen cases of twenty, m/s, if vehicles are as unlike
    /// as on any street.
    #[must_use]
    pub fn speed_range_mps(&self) -> Option<(f64, f64)> {
        let v = self.speed_mps()?;
        let off = 1.96 * (UNLIKE_SHARE * v + UNLIKE_MPS)
            / f64::from(self.vehicles.div_ceil(ALIKE).max(1)).sqrt();
        Some(((v - off).max(0.0), v + off))
    }
}

/// What is known of all streets of a mission.
#[derive(Clone, Debug)]
pub struct Usages {
    streets: Arc<Streets>,
    network: Arc<Network>,
    stretches: BTreeMap<(u16, u16), StretchSum>,
    turns: BTreeMap<u16, u32>,
}

impl Usages {
    /// Nothing is known of these.
    #[must_use]
    pub fn new(streets: Arc<Streets>, network: Arc<Network>) -> Self {
        Self {
            streets,
            network,
            stretches: BTreeMap::new(),
            turns: BTreeMap::new(),
        }
    }

    /// Adds a register of somebody.
    pub(crate) fn add(&mut self, subject: u16, usage: &Usage) {
        if let Some(interval) = interval_of(subject) {
            let all = self.network.edges().len();
            let known = usage.stretches.iter();
            for s in known.filter(|s| usize::from(s.stretch) < all) {
                let sum = self.stretches.entry((interval, s.stretch)).or_default();
                sum.add(&StretchSum {
                    watched_m_s: u64::from(s.watched_m_s),
                    spent_ds: u64::from(s.spent_ds),
                    stood_ds: u64::from(s.stood_ds),
                    driven_m: u64::from(s.driven_m),
                    vehicles: u32::from(s.vehicles),
                });
            }
            return;
        }
        for t in &usage.turns {
            *self.turns.entry(t.turn).or_default() += u32::from(t.vehicles);
        }
    }

    /// Adds what somebody saw in the first interval, and turns.
    pub fn with(&mut self, usage: &Usage) {
        self.add(0, usage);
        self.add(crate::wire::usage::subject_of_turn(0), usage);
    }

    /// The streets of the mission.
    #[must_use]
    pub fn streets(&self) -> &Streets {
        &self.streets
    }

    /// Their network.
    #[must_use]
    pub fn network(&self) -> &Network {
        &self.network
    }

    /// What was seen, by interval and stretch, ascending.
    pub fn stretches(&self) -> impl Iterator<Item = ((u16, u16), &StretchSum)> {
        self.stretches.iter().map(|(key, sum)| (*key, sum))
    }

    /// What was seen of a stretch all the time.
    #[must_use]
    pub fn of_stretch(&self, stretch: u16) -> StretchSum {
        let mut all = StretchSum::default();
        let of = self.stretches.iter().filter(|((_, s), _)| *s == stretch);
        of.for_each(|(_, sum)| all.add(sum));
        all
    }

    /// What was seen of a street in an interval, and how long it is, metres.
    #[must_use]
    pub fn of_street(&self, street: u16, interval: u16) -> (StretchSum, f64) {
        let mut all = StretchSum::default();
        let mut length_m = 0.0;
        for (n, e) in (0_u16..).zip(self.network.edges()) {
            if e.street == street {
                length_m += e.length_m;
                if let Some(sum) = self.stretches.get(&(interval, n)) {
                    all.add(sum);
                }
            }
        }
        (all, length_m)
    }

    /// How many took each turn, where anybody did.
    pub fn turns(&self) -> impl Iterator<Item = (Turn, u32)> + '_ {
        let all = self.turns.iter();
        all.filter_map(|(n, taken)| Some((*self.network.turns().get(usize::from(*n))?, *taken)))
    }

    /// It without the streets, to be carried to who has these too.
    #[must_use]
    pub fn seen(&self) -> StreetsSeen {
        let stretches = self.stretches().map(|((i, s), sum)| (i, s, *sum));
        StreetsSeen {
            stretches: stretches.collect(),
            turns: self.turns.iter().map(|(n, taken)| (*n, *taken)).collect(),
        }
    }

    /// What was carried, of these streets; stretches that they do not have are left out.
    #[must_use]
    pub fn of(streets: Arc<Streets>, network: Arc<Network>, seen: &StreetsSeen) -> Self {
        let all = network.edges().len();
        let of_these = seen.stretches.iter().filter(|s| usize::from(s.1) < all);
        Self {
            stretches: of_these.map(|(i, s, sum)| ((*i, *s), *sum)).collect(),
            turns: seen.turns.iter().copied().collect(),
            ..Self::new(streets, network)
        }
    }

    /// How much was watched, metres times seconds.
    #[must_use]
    pub fn watched_m_s(&self) -> u64 {
        self.stretches.values().map(|s| s.watched_m_s).sum()
    }

    /// The course of the day of each street, and the turns at crossings, for a person: a sentence
    /// a street, and one a stretch that anybody turned from.
    #[must_use]
    pub fn sentences(&self) -> Vec<String> {
        let mut told = Vec::new();
        for (street, name) in (0_u16..).zip(&self.streets.names) {
            let intervals = (0..crate::wire::usage::INTERVALS_MAX)
                .filter_map(|i| self.interval(street, i))
                .collect::<Vec<_>>();
            if !intervals.is_empty() {
                told.push(format!("{name}: {}", intervals.join("; ")));
            }
        }
        told.extend(self.turned());
        told
    }

    fn interval(&self, street: u16, interval: u16) -> Option<String> {
        let (sum, length_m) = self.of_street(street, interval);
        let density = sum.density_per_km()?;
        let (low, high) = sum.density_range_per_km(length_m, self.streets.usual_mps())?;
        let from_s = u64::from(interval) * u64::from(self.streets.interval_s);
        let speed = sum.speed_mps().zip(sum.speed_range_mps());
        let speed = speed.map_or_else(String::new, |(v, (least, most))| {
            format!(" at {v:.1} m/s ({least:.1} to {most:.1})")
        });
        Some(format!(
            "from {from_s} s on {density:.1} vehicles a km ({low:.1} to {high:.1}){speed}, {:.0} an hour, watched for {:.0} s",
            sum.flow_per_h()?,
            sum.watched_s(length_m)
        ))
    }

    /// Of each stretch and crossing, where who came from there went.
    fn turned(&self) -> Vec<String> {
        let mut by: BTreeMap<(u16, u16), Vec<(u16, u32)>> = BTreeMap::new();
        for (turn, taken) in self.turns().filter(|(_, taken)| *taken > 0) {
            by.entry((turn.from, turn.over))
                .or_default()
                .push((turn.to, taken));
        }
        let called = |stretch: u16| {
            let edge = &self.network.edges()[usize::from(stretch)];
            format!("{} [{stretch}]", self.streets.name(edge.street))
        };
        let one = |((from, over), to): (&(u16, u16), &Vec<(u16, u32)>)| {
            let all: u32 = to.iter().map(|(_, n)| n).sum();
            let each = to
                .iter()
                .map(|(to, n)| format!("{n} to {}", called(*to)))
                .collect::<Vec<_>>();
            let from = called(*from);
            format!(
                "of {all} from {from} over crossing {over} {}",
                each.join(", ")
            )
        };
        by.iter().map(one).collect()
    }
}
