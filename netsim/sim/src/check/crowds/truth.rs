//! How many people truly are in the sectors of an event, second by second, and how many would be
//! where places are off.

use crate::world::crowd::Crowd as People;
use skein_geometry::frame::{Point, Vector};
use skein_peer::crowd::CrowdWatch;
use skein_peer::gathering::CrowdAlert;
use std::collections::BTreeMap;

/// Places are off by no more than this where something is said to be clear, metres: three standard
/// deviations.
const CLEAR_M: f64 = 6.0;

/// And by no more than this where something is said to be near, metres: four.
const NEAR_M: f64 = 8.0;

/// Clearly too dense is what has so many times the norm, and clearly eased what has so much of what
/// counts as eased.
const CLEAR_DENSE: f64 = 1.5;
const CLEAR_EASED: f64 = 0.5;

/// Not near to too dense is what has less than so much of the norm, and not near to eased what has
/// more than so many times what counts as eased.
const NEAR_DENSE: f64 = 0.8;
const NEAR_EASED: f64 = 1.25;

/// What is too dense for no longer than this nobody need have seen, seconds.
const BRIEF_S: u64 = 20;

/// One sector in one second.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Moment {
    people: u32,
    /// The fewest and the most wherever within [`CLEAR_M`] it is taken to be.
    clear: (u32, u32),
    /// The same within [`NEAR_M`].
    near: (u32, u32),
}

/// A sector that was too dense for a while.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Episode {
    pub sector: u16,
    /// From the first second on to the last one.
    pub from_s: u64,
    pub to_s: u64,
    /// Whether somebody looked at it while it was clearly so, and when first, ms.
    pub looked_ms: Option<u64>,
}

/// What is true, second by second.
#[derive(Clone, Debug, Default)]
pub struct Truth {
    /// By sector number.
    seconds: BTreeMap<u64, Vec<Moment>>,
    /// When somebody looked at a sector that was clearly too dense.
    looked: BTreeMap<u16, Vec<u64>>,
}

/// The corners of a sector.
pub fn corners(low: Point, side_m: f64) -> [Point; 4] {
    [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(e, n)| low + Vector::new(e, n) * side_m)
}

/// The middles of the squares of 10 m that a sector has.
pub fn middles(low: Point, side_m: f64) -> Vec<Point> {
    let n = (0_u32..).take_while(|k| 10.0 * f64::from(*k) + 5.0 < side_m);
    let n: Vec<f64> = n.map(|k| 10.0 * f64::from(k) + 5.0).collect();
    let rows = n
        .iter()
        .flat_map(|north| n.iter().map(move |east| (*east, *north)));
    rows.map(|(e, n)| low + Vector::new(e, n)).collect()
}

fn shifted(people: &People, low: Point, side_m: f64, by_m: f64) -> (u32, u32) {
    let steps = [-by_m, 0.0, by_m];
    let all = steps
        .iter()
        .flat_map(|e| steps.iter().map(move |n| (*e, *n)));
    let each = all.map(|(e, n)| people.within(low + Vector::new(e, n), side_m));
    each.fold((u32::MAX, 0), |(least, most), n| {
        (least.min(n), most.max(n))
    })
}

impl Truth {
    pub fn new(_: &CrowdWatch) -> Self {
        Self::default()
    }

    /// Where people are in a second, once.
    pub fn note(&mut self, people: &People, watch: &CrowdWatch) {
        let second = people.second();
        if self.seconds.contains_key(&second) {
            return;
        }
        let side_m = f64::from(watch.sector_m);
        let n = watch.sectors().last().map_or(0, |n| usize::from(n) + 1);
        let mut all = vec![Moment::default(); n];
        for sector in watch.sectors() {
            let Some(low) = watch.low(sector) else {
                continue;
            };
            let around = people.within(low - Vector::new(NEAR_M, NEAR_M), side_m + 2.0 * NEAR_M);
            // Far from every norm it does not matter how far.
            let few = f64::from(around) < CLEAR_EASED * watch.eased_people();
            let moment = &mut all[usize::from(sector)];
            *moment = Moment {
                people: people.within(low, side_m),
                clear: (0, around),
                near: (0, around),
            };
            if !few {
                moment.clear = shifted(people, low, side_m, CLEAR_M);
                moment.near = shifted(people, low, side_m, NEAR_M);
            }
        }
        self.seconds.insert(second, all);
    }

    fn moment(&self, second: u64, sector: u16) -> Option<Moment> {
        let all = self.seconds.get(&second)?;
        all.get(usize::from(sector)).copied()
    }

    /// How many people a sector had; none where nobody looked in that second.
    pub fn people(&self, second: u64, sector: u16) -> Option<u32> {
        self.moment(second, sector).map(|m| m.people)
    }

    /// Whether it was clearly too dense, or clearly was not; none where neither is clear.
    pub fn clear(&self, second: u64, sector: u16, watch: &CrowdWatch) -> Option<bool> {
        let m = self.moment(second, sector)?;
        if f64::from(m.clear.0) >= CLEAR_DENSE * watch.dense_people() {
            return Some(true);
        }
        let eased = CLEAR_EASED * watch.eased_people();
        (f64::from(m.clear.1) <= eased).then_some(false)
    }

    /// Somebody looked at a sector that was clearly too dense.
    pub fn looked(&mut self, sector: u16, now_ms: u64) {
        self.looked.entry(sector).or_default().push(now_ms);
    }

    /// Why what is told was not near to the truth, if so.
    pub fn why_wrong(&self, second: u64, told: &CrowdAlert, watch: &CrowdWatch) -> Option<String> {
        let m = self.moment(second, told.sector)?;
        let (sector, people) = (told.sector, m.people);
        let dense = watch.dense_people();
        if told.is_dense && f64::from(m.near.1) < NEAR_DENSE * dense {
            return Some(format!(
                "tells that sector {sector} is too dense, which has {people} people; {dense:.0} are the norm"
            ));
        }
        let eased = watch.eased_people();
        (!told.is_dense && f64::from(m.near.0) > NEAR_EASED * eased).then(|| {
            format!(
                "tells that sector {sector} has eased, which has {people} people; {eased:.0} would be few enough"
            )
        })
    }

    /// Since when a sector that is too dense in a second has been so, milliseconds.
    pub fn dense_since_ms(&self, sector: u16, second: u64, watch: &CrowdWatch) -> Option<u64> {
        let before = self.seconds.range(..=second).rev();
        let is_dense = |m: &Moment| f64::from(m.people) > watch.dense_people();
        let dense =
            before.take_while(|(_, all)| all.get(usize::from(sector)).is_some_and(is_dense));
        dense.last().map(|(s, _)| 1_000 * s)
    }

    /// All that was too dense for longer than a moment.
    pub fn episodes(&self, watch: &CrowdWatch) -> Vec<Episode> {
        let mut all = Vec::new();
        for sector in watch.sectors() {
            let mut now: Option<Episode> = None;
            for (second, moments) in &self.seconds {
                let people = moments.get(usize::from(sector)).map_or(0, |m| m.people);
                if f64::from(people) > watch.dense_people() {
                    let begun = now.get_or_insert(Episode {
                        sector,
                        from_s: *second,
                        to_s: *second,
                        looked_ms: None,
                    });
                    begun.to_s = *second;
                } else {
                    all.extend(now.take());
                }
            }
            all.extend(now);
        }
        all.retain(|e: &Episode| e.to_s - e.from_s > BRIEF_S);
        for e in &mut all {
            let looked = self.looked.get(&e.sector).into_iter().flatten();
            let within = |ms: &&u64| (1_000 * e.from_s..=1_000 * e.to_s).contains(*ms);
            e.looked_ms = looked.filter(within).min().copied();
        }
        all
    }
}
