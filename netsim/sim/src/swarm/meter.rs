//! How long each part of a simulated run keeps a computer busy.
//!
//! The simulator looks at no clock. Whoever wants to know lends it one, and what it shows
//! changes nothing in the run.

use super::latency::{Asked, Latency};

/// What a run spends its time on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Part {
    /// Events, disks, the history and the account.
    #[default]
    Driver,
    /// Airframes, links, and the judge of what was seen.
    World,
    /// The channel.
    Medium,
    /// The minds of all peers.
    Peer,
    /// Loops and divisions, which peers compute beside their minds.
    Planning,
    /// The rules of the protocol.
    Checks,
}

impl Part {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Driver,
        Self::World,
        Self::Medium,
        Self::Peer,
        Self::Planning,
        Self::Checks,
    ];

    /// Its name in figures.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Driver => "driver",
            Self::World => "world",
            Self::Medium => "medium",
            Self::Peer => "peer",
            Self::Planning => "planning",
            Self::Checks => "checks",
        }
    }
}

/// A clock that is lent, nanoseconds since whenever it likes.
pub type ClockNs = fn() -> u64;

/// Adds up what each part takes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Meter {
    clock: Option<ClockNs>,
    part: Part,
    since_ns: u64,
    spent_ns: [u64; Part::ALL.len()],
    inputs: u64,
    answers: [Latency; Asked::ALL.len()],
    /// The longest of a percept, nanoseconds, and what was planned meanwhile.
    longest: Option<(u64, &'static str)>,
}

impl Meter {
    /// A meter that begins now.
    #[must_use]
    pub fn with(clock: ClockNs) -> Self {
        Self {
            clock: Some(clock),
            since_ns: clock(),
            ..Self::default()
        }
    }

    /// Another part begins; gives the one that ends.
    pub(super) fn enter(&mut self, part: Part) -> Part {
        if let Some(clock) = self.clock {
            let now_ns = clock();
            self.spent_ns[self.part as usize] += now_ns.saturating_sub(self.since_ns);
            self.since_ns = now_ns;
        }
        std::mem::replace(&mut self.part, part)
    }

    /// A peer is given an input.
    pub(super) fn input(&mut self) {
        self.inputs += 1;
    }

    /// What its clock shows; none where none was lent.
    pub(super) fn now_ns(&self) -> Option<u64> {
        self.clock.map(|clock| clock())
    }

    /// A peer answered an input that it was given then, while this was planned for it.
    pub(super) fn answered(
        &mut self,
        from_ns: Option<u64>,
        is_percept: bool,
        plan: Option<&'static str>,
    ) {
        let Some(took_ns) = self.now_ns().zip(from_ns).map(|(to, from)| to - from) else {
            return;
        };
        let asked = match (is_percept, plan) {
            (false, _) => Asked::Other,
            (true, None) => Asked::Percept,
            (true, Some(_)) => Asked::PerceptBesidePlan,
        };
        self.answers[asked as usize].note(took_ns);
        if is_percept && self.longest.is_none_or(|(ns, _)| took_ns > ns) {
            self.longest = Some((took_ns, plan.unwrap_or("no plan")));
        }
    }

    /// How long inputs of a kind took.
    #[must_use]
    pub fn answers(&self, asked: Asked) -> &Latency {
        &self.answers[asked as usize]
    }

    /// The longest from a percept to its setpoint, nanoseconds, and what was planned meanwhile.
    #[must_use]
    pub fn longest(&self) -> Option<(u64, &'static str)> {
        self.longest
    }

    /// What a part took so far, but for what is under way, nanoseconds.
    #[must_use]
    pub fn spent_ns(&self, part: Part) -> u64 {
        self.spent_ns[part as usize]
    }

    /// Inputs that all peers were given.
    #[must_use]
    pub fn inputs(&self) -> u64 {
        self.inputs
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    thread_local! {
        static NOW_NS: Cell<u64> = const { Cell::new(0) };
    }

    /// A clock on which ten nanoseconds pass from one look to the next.
    fn ticking() -> u64 {
        NOW_NS.with(|n| {
            n.set(n.get() + 10);
            n.get()
        })
    }

    #[test]
    fn each_part_is_charged_for_its_own_time() {
        let mut meter = Meter::with(ticking);
        let before = meter.enter(Part::Peer);
        assert_eq!(before, Part::Driver);
        assert_eq!(meter.enter(Part::Checks), Part::Peer);
        meter.enter(Part::Peer);
        meter.enter(before);
        let spent: Vec<u64> = Part::ALL.iter().map(|p| meter.spent_ns(*p)).collect();
        assert_eq!(spent, [10, 0, 0, 20, 0, 10]);
        assert!(Part::ALL.iter().enumerate().all(|(i, p)| *p as usize == i));
    }

    #[test]
    fn without_a_clock_nothing_is_measured() {
        let mut meter = Meter::default();
        meter.enter(Part::Peer);
        meter.input();
        assert_eq!((meter.spent_ns(Part::Driver), meter.inputs()), (0, 1));
    }
}
