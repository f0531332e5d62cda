//! The table of kinds: what may be said, how large, how urgent, how long it matters.
//!
//! D2.7 §1.3 asks that members tell each other their state and mission status, over
//! relays too; which records that takes is in docs/protocol.md §7.
//! The bodies themselves are in [`super::message`], their bytes in [`super::codec`].

use crate::output::Priority;
use core::fmt::Write as _;

/// Largest record of any kind, bytes: what one transmission carries at most.
pub const RECORD_MAX_BYTES: usize = 4096;

/// What a record is about. The number is on the wire and never reused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// "I am here", with gossip.
    Beacon = 0,
    /// Pose, fuel, activity, mission status.
    State = 1,
    /// A bid in a round of negotiation.
    Bid = 2,
    /// The author's own section.
    Claim = 3,
    /// The union of covered cells the author knows.
    Cover = 4,
    /// A piece of a mission.
    Mission = 5,
    /// What the operator wants of everybody, and of single UAVs.
    Operator = 6,
    /// "All that can be covered is covered."
    Finished = 7,
    /// Reserved: something people should look at.
    Event = 8,
    /// A task other than coverage that its author asks for.
    Task = 9,
    /// What the author flies, would rather fly, and has accepted of others.
    Intent = 10,
    /// An intent by its versions, for those who know its motions.
    Conflict = 11,
    /// "I am here", with heartbeats of others at most.
    Heartbeat = 12,
    /// Which pieces of a mission the author lacks.
    Lacking = 13,
    /// What the author offers and holds of such tasks.
    Bundle = 14,
    /// A vehicle that the author saw.
    Target = 15,
    /// An object that the mission looks for, which the author saw.
    Detection = 16,
    /// A stretch of a contour that the author flew along.
    Trail = 17,
    /// What the author counted at a site of the mission.
    Count = 18,
    /// How the author saw streets of the mission used.
    Usage = 19,
    /// The people of a mass event that the author saw.
    Crowd = 20,
    /// Obstacles on no map that the author knows.
    Obstacle = 21,
    /// Aircraft that are no members, as the author senses them.
    Aircraft = 22,
}

/// How long a record waiting to be sent matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lifetime {
    /// So many announced intervals.
    Beacons(u32),
    /// So many milliseconds.
    Ms(u32),
}

/// One line of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KindRow {
    /// The kind.
    pub kind: Kind,
    /// Its name in keys.
    pub name: &'static str,
    /// Largest body, bytes; every body whose values are valid fits.
    pub cap_bytes: usize,
    /// Which transmissions go first.
    pub priority: Priority,
    /// How long it may wait to be sent.
    pub lifetime: Lifetime,
    /// Whether other peers hold it and pass it on.
    pub relayed: bool,
    /// How many registers of this kind an author has: subjects `0 .. subjects`.
    pub subjects: u16,
    /// Whether bodies are defined; a reserved kind is refused.
    pub spoken: bool,
}

const fn row(
    kind: Kind,
    name: &'static str,
    cap_bytes: usize,
    priority: Priority,
    lifetime: Lifetime,
) -> KindRow {
    KindRow {
        kind,
        name,
        cap_bytes,
        priority,
        lifetime,
        relayed: true,
        subjects: 1,
        spoken: true,
    }
}

// Lifetimes: a beacon is out of date when the next one is due; state and cover when
// two newer ones could have been written; rounds and claims after the longest wait
// for a round in a component of diameter 3, (2D + 3) periods; what the operator says
// matters until the longest partition a mission tolerates, and is repaired by
// anti-entropy afterwards.
// Caps: the largest valid body, which a test of `codec` computes, rounded up.
const TABLE: [KindRow; 23] = [
    KindRow {
        relayed: false,
        ..row(
            Kind::Beacon,
            "beacon",
            1024,
            Priority::Beacon,
            Lifetime::Beacons(1),
        )
    },
    row(
        Kind::State,
        "state",
        64,
        Priority::Telemetry,
        Lifetime::Beacons(2),
    ),
    row(
        Kind::Bid,
        "bid",
        1216,
        Priority::Claim,
        Lifetime::Beacons(9),
    ),
    row(
        Kind::Claim,
        "claim",
        1024,
        Priority::Claim,
        Lifetime::Beacons(9),
    ),
    // Cover is not passed on: it merges by union, and everybody speaks the whole union.
    KindRow {
        relayed: false,
        ..row(
            Kind::Cover,
            "cover",
            1024,
            Priority::Beacon,
            Lifetime::Beacons(4),
        )
    },
    KindRow {
        subjects: 256,
        ..row(
            Kind::Mission,
            "mission",
            288,
            Priority::Telemetry,
            Lifetime::Ms(60_000),
        )
    },
    row(
        Kind::Operator,
        "operator",
        168,
        Priority::Claim,
        Lifetime::Ms(60_000),
    ),
    row(
        Kind::Finished,
        "finished",
        8,
        Priority::Telemetry,
        Lifetime::Ms(60_000),
    ),
    KindRow {
        subjects: 4,
        spoken: false,
        ..row(
            Kind::Event,
            "event",
            256,
            Priority::Telemetry,
            Lifetime::Ms(60_000),
        )
    },
    KindRow {
        subjects: super::tasks::TASKS_MAX,
        ..row(
            Kind::Task,
            "task",
            352,
            Priority::Claim,
            Lifetime::Ms(60_000),
        )
    },
    KindRow {
        relayed: false,
        ..row(
            Kind::Intent,
            "intent",
            1216,
            Priority::Conflict,
            Lifetime::Beacons(1),
        )
    },
    KindRow {
        relayed: false,
        ..row(
            Kind::Conflict,
            "conflict",
            320,
            Priority::Conflict,
            Lifetime::Beacons(1),
        )
    },
    KindRow {
        relayed: false,
        ..row(
            Kind::Heartbeat,
            "heartbeat",
            288,
            Priority::Beacon,
            Lifetime::Beacons(1),
        )
    },
    KindRow {
        relayed: false,
        ..row(
            Kind::Lacking,
            "lacking",
            56,
            Priority::Beacon,
            Lifetime::Beacons(1),
        )
    },
    row(
        Kind::Bundle,
        "bundle",
        2048,
        Priority::Claim,
        Lifetime::Beacons(9),
    ),
    // The next look at a target takes the place of this one; the last is where it is looked for.
    KindRow {
        subjects: super::target::TARGETS_MAX,
        ..row(
            Kind::Target,
            "target",
            72,
            Priority::Telemetry,
            Lifetime::Beacons(9),
        )
    },
    // Told once: it matters as long as what the operator says.
    KindRow {
        subjects: super::detection::DETECTIONS_MAX,
        ..row(
            Kind::Detection,
            "detection",
            64,
            Priority::Claim,
            Lifetime::Ms(60_000),
        )
    },
    // A stretch that grows is out of date when more of it is told, and older ones are told again
    // in turn.
    KindRow {
        subjects: super::trail::TRAILS_MAX,
        ..row(
            Kind::Trail,
            "trail",
            304,
            Priority::Telemetry,
            Lifetime::Beacons(8),
        )
    },
    // For people: nobody flies by it.
    KindRow {
        subjects: super::count::COUNTS_MAX,
        ..row(
            Kind::Count,
            "count",
            64,
            Priority::Telemetry,
            Lifetime::Ms(60_000),
        )
    },
    KindRow {
        subjects: super::usage::USAGES_MAX,
        ..row(
            Kind::Usage,
            "usage",
            448,
            Priority::Telemetry,
            Lifetime::Ms(60_000),
        )
    },
    // Where it is too dense somebody may be sent, and a later look says more.
    KindRow {
        subjects: super::crowd::TILES_MAX,
        ..row(
            Kind::Crowd,
            "crowd",
            640,
            Priority::Telemetry,
            Lifetime::Ms(60_000),
        )
    },
    // Others fly there, too.
    row(
        Kind::Obstacle,
        "obstacle",
        272,
        Priority::Claim,
        Lifetime::Ms(60_000),
    ),
    // Out of date when the next look is told.
    KindRow {
        relayed: false,
        ..row(
            Kind::Aircraft,
            "aircraft",
            104,
            Priority::Telemetry,
            Lifetime::Beacons(2),
        )
    },
];

impl Kind {
    /// All kinds, by number.
    pub const ALL: [Self; 23] = [
        Self::Beacon,
        Self::State,
        Self::Bid,
        Self::Claim,
        Self::Cover,
        Self::Mission,
        Self::Operator,
        Self::Finished,
        Self::Event,
        Self::Task,
        Self::Intent,
        Self::Conflict,
        Self::Heartbeat,
        Self::Lacking,
        Self::Bundle,
        Self::Target,
        Self::Detection,
        Self::Trail,
        Self::Count,
        Self::Usage,
        Self::Crowd,
        Self::Obstacle,
        Self::Aircraft,
    ];

    /// Its number on the wire.
    #[must_use]
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// The kind of this number, if there is one.
    #[must_use]
    pub fn of_number(number: u8) -> Option<Self> {
        Self::ALL.get(usize::from(number)).copied()
    }

    /// The kind of this name, if there is one.
    #[must_use]
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|k| k.name() == name)
    }

    /// Its line of the table.
    #[must_use]
    pub const fn row(self) -> &'static KindRow {
        &TABLE[self as usize]
    }

    /// Its name in keys.
    #[must_use]
    pub const fn name(self) -> &'static str {
        self.row().name
    }

    /// Largest body, bytes.
    #[must_use]
    pub const fn cap_bytes(self) -> usize {
        self.row().cap_bytes
    }

    /// Which transmissions go first.
    #[must_use]
    pub const fn priority(self) -> Priority {
        self.row().priority
    }

    /// Whether other peers hold it and pass it on.
    #[must_use]
    pub const fn relayed(self) -> bool {
        self.row().relayed
    }

    /// How long it may wait to be sent, milliseconds, at a beacon period.
    #[must_use]
    pub const fn lifetime_ms(self, beacon_period_ms: u32) -> u32 {
        match self.row().lifetime {
            Lifetime::Beacons(n) => beacon_period_ms.saturating_mul(n),
            Lifetime::Ms(ms) => ms,
        }
    }
}

/// The table of kinds as Markdown, for the documentation.
#[must_use]
pub fn docs_table() -> String {
    let mut text = String::from(
        "| number | kind | registers | body, bytes | priority | lifetime | passed on |\n|---|---|---|---|---|---|---|\n",
    );
    for row in &TABLE {
        let lifetime = match row.lifetime {
            Lifetime::Beacons(n) => format!("{n} I"),
            Lifetime::Ms(ms) => format!("{} s", ms / 1000),
        };
        let passed_on = match (row.spoken, row.relayed) {
            (false, _) => "reserved",
            (true, true) => "yes",
            (true, false) => "no",
        };
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {} | `{}` | {} | {} | {:?} | {lifetime} | {passed_on} |",
            row.kind.number(),
            row.name,
            row.subjects,
            row.cap_bytes,
            row.priority,
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_names_and_rows_agree() {
        for (i, kind) in Kind::ALL.into_iter().enumerate() {
            assert_eq!(usize::from(kind.number()), i);
            assert_eq!(kind.row().kind, kind);
            assert_eq!(Kind::of_number(kind.number()), Some(kind));
            assert_eq!(Kind::of_name(kind.name()), Some(kind));
            assert!(kind.cap_bytes() + super::super::codec::ENVELOPE_MAX_BYTES <= RECORD_MAX_BYTES);
        }
        assert_eq!(Kind::of_number(23), None);
        assert_eq!(Kind::of_name("rumour"), None);
    }

    #[test]
    fn the_table_has_a_line_a_kind() {
        let table = docs_table();
        assert_eq!(table.lines().count(), Kind::ALL.len() + 2);
        assert!(table.contains("| 4 | `cover` | 1 | 1024 | Beacon | 4 I | no |"));
    }
}
