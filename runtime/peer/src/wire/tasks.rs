//! Tasks other than coverage, and what each peer does of them: types, bytes and limits of
//! the kinds `task` and `bundle` (docs/protocol.md §12).
//!
//! A task is one register of whoever asks for it: the operator, or a UAV that saw something
//! (D2.7 §3.2). A bundle is one register of each UAV: the offer on which tasks were settled,
//! and what it holds.

use super::cbor::{In, Listed, Out, Wire, array_of, number_of};
use super::codec::WireError;
use super::limits::{
    DURATION_MAX_MS, HEADING_MAX_E4, POSITION_MAX_MM, SPEED_MAX_MMPS, at_most, in_range,
};
use super::schema::{MM, MS, Place, Shape, U16, U32, at};
use serde::{Deserialize, Serialize};

/// Tasks that one author may ask for at a time: numbers `0 .. 256` are the subjects of its
/// registers.
pub const TASKS_MAX: u16 = 256;
/// Places of a task: a road of a city block; longer lines are several tasks.
pub const TASK_PLACES_MAX: usize = 24;
/// Most that a task may be worth.
pub const WORTH_MAX: u16 = 1000;
/// Sensors that can be told apart: bits of [`Offer::sensors`].
pub const SENSORS_MAX: u8 = 32;
/// Tasks in a bundle: eight times an even share of 100 tasks among 20 UAVs. What one UAV
/// could do beyond them waits until it has done some.
pub const BUNDLE_MAX: usize = 40;
/// Tasks that a bundle tells as done before its offer: who has done so many takes no more.
pub const DONE_MAX: usize = 100;
/// The longest name of a task, bytes.
pub const TASK_NAME_MAX_BYTES: usize = 32;
/// Farthest around a place that a task may ask to see, mm.
pub const TASK_RADIUS_MAX_MM: u32 = 1_000_000;
/// Sensors by name; the first has the number 1. Who says nothing of its sensors carries a
/// camera.
pub const SENSORS: [&str; 6] = [
    "camera",
    "infrared",
    "multispectral",
    "lidar",
    "radio",
    "gas",
];
/// Bits of [`Offer::sensors`] of a UAV with a camera and nothing else.
pub const CAMERA_ALONE: u32 = 1;
/// Farthest turn radius that makes sense of a UAV, mm.
pub const RADIUS_MAX_MM: u32 = 10_000_000;

/// Names a task: who asks for it, and the number of the register.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct TaskId {
    /// Who asks for it.
    pub author: u16,
    /// Which of its tasks.
    pub number: u16,
}

/// What kind of task it is.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, Default,
)]
pub enum TaskKind {
    /// To be flown over once.
    #[default]
    Pinpoint,
    /// To be flown along once, from either end.
    Line,
    /// A place and what lies around it, or what lies within corners, seen in the time that it
    /// says.
    Area,
    /// A target to be followed from that place on.
    Track,
    /// A place to be held as a relay.
    Relay,
}

impl TaskKind {
    /// Whether it goes on until somebody ends it: it counts from arrival on, and changes
    /// hands only to who has arrived.
    #[must_use]
    pub fn goes_on(self) -> bool {
        matches!(self, Self::Track | Self::Relay)
    }
}

/// What became of a task.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, Default,
)]
#[serde(rename_all = "lowercase")]
pub enum TaskState {
    /// It is to be done.
    #[default]
    Open,
    /// Nobody wants it any more.
    Cancelled,
    /// Its time is over.
    Expired,
    /// It was done.
    Done,
}

impl TaskState {
    /// Its name.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Open => "open",
            Self::Cancelled => "cancelled",
            Self::Expired => "expired",
            Self::Done => "done",
        }
    }
}

/// A place, in whole millimetres.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct TaskPlace {
    /// East, mm.
    pub east_mm: i32,
    /// North, mm.
    pub north_mm: i32,
}

/// What somebody asks for. The highest revision counts; of equal ones the greater.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Task {
    /// Grows with each change.
    pub revision: u32,
    /// Whether it is still to be done.
    pub state: TaskState,
    /// What kind it is.
    pub kind: TaskKind,
    /// Where: one place, of a line at least two, of an area one or its corners.
    pub places: Vec<TaskPlace>,
    /// The sensor that it needs, 1 to 32; 0 for any.
    pub sensor: u8,
    /// What it is worth if it were done at once, 1 to 1000.
    pub worth: u16,
    /// How long a UAV stays there, milliseconds; 0 of what goes on: until somebody ends it.
    pub stay_ms: u32,
    /// How far around the place, or to the sides of the line, is to be seen; of a relay position
    /// how far from the place a UAV may be that holds it, mm.
    pub radius_mm: u32,
    /// After so long it is not wanted any more, milliseconds from when it was asked for; 0
    /// for never.
    pub within_ms: u32,
    /// What people call it.
    pub name: Vec<u8>,
    /// Of a task that is done, who did it; else 0.
    pub done_by: u16,
    /// Of a task that is over, how long after it was asked for, milliseconds; else 0.
    pub over_after_ms: u32,
}

impl Task {
    /// Whether it is to be done.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.state == TaskState::Open
    }

    /// Whether who does it stays until somebody ends it, and does nothing else meanwhile: a
    /// relay position.
    #[must_use]
    pub fn is_held(&self) -> bool {
        self.kind.goes_on() && self.stay_ms == 0
    }

    /// The revision in which it was asked for: that it was done is told in the next.
    #[must_use]
    pub fn revision_as_asked(&self) -> u32 {
        let told = u32::from(self.state == TaskState::Done);
        self.revision.saturating_sub(told)
    }

    /// What people call it.
    #[must_use]
    pub fn name(&self) -> String {
        String::from_utf8_lossy(&self.name).into_owned()
    }
}

/// The number of a sensor of this name.
#[must_use]
pub fn sensor_of_name(name: &str) -> Option<u8> {
    let place = SENSORS.iter().position(|s| *s == name)?;
    u8::try_from(place + 1).ok()
}

/// The name of a sensor of this number; `any` for 0.
#[must_use]
pub fn sensor_name(sensor: u8) -> String {
    match usize::from(sensor).checked_sub(1) {
        None => "any".to_owned(),
        Some(i) => SENSORS
            .get(i)
            .map_or_else(|| format!("sensor {sensor}"), |s| (*s).to_owned()),
    }
}

/// What a UAV offered when it was last asked: all that its bids follow from.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct Offer {
    /// East, mm.
    pub east_mm: i32,
    /// North, mm.
    pub north_mm: i32,
    /// Course, 1e-4 rad counter-clockwise from east.
    pub course_e4: i32,
    /// Speed, mm/s; 0 where it takes no task.
    pub speed_mmps: u32,
    /// Turn radius at that speed, mm.
    pub radius_mm: u32,
    /// Flight time that it may spend on tasks, milliseconds.
    pub endurance_ms: u32,
    /// A bit for each sensor on board, the lowest for sensor 1.
    pub sensors: u32,
    /// What it has left to fly of its section, milliseconds; 0 where it has none. Who has some
    /// comes back to it.
    pub section_ms: u32,
    /// A bit for each way in which its mission, as it stands, would fly a task: [`ERRANDS`],
    /// [`RELAYS`], [`TRACKS`].
    pub takes: u8,
}

/// Of [`Offer::takes`]: places, lines and areas, flown to and seen.
pub const ERRANDS: u8 = 1;
/// Of [`Offer::takes`]: relay positions.
pub const RELAYS: u8 = 2;
/// Of [`Offer::takes`]: targets to follow.
pub const TRACKS: u8 = 4;
/// Of [`Offer::takes`]: tasks of every kind.
pub const EVERY_KIND: u8 = ERRANDS | RELAYS | TRACKS;

impl Offer {
    /// Whether its mission, as it stands, would fly a task of this kind.
    #[must_use]
    pub fn flies(&self, kind: TaskKind) -> bool {
        let bit = match kind {
            TaskKind::Pinpoint | TaskKind::Line | TaskKind::Area => ERRANDS,
            TaskKind::Relay => RELAYS,
            TaskKind::Track => TRACKS,
        };
        self.takes & bit != 0
    }
}

/// How far a UAV is with a task. Of two claims on one task the higher state goes before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Progress {
    /// Won, and not yet flown to: it may still go to somebody else.
    Tentative,
    /// At it, and asking to be relieved.
    Leaving,
    /// Under way to it.
    Committed,
    /// At it.
    Begun,
    /// Done.
    Done,
}

/// A task in a bundle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct BundleTask {
    /// Which.
    pub task: TaskId,
    /// In which revision.
    pub revision: u32,
    /// What it adds to the value of the bundle, in millionths of [`Task::worth`].
    pub bid: u32,
    /// How far it is.
    pub progress: Progress,
}

/// A task that is done, in the revision that was done.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct DoneTask {
    /// Which.
    pub task: TaskId,
    /// In which revision.
    pub revision: u32,
}

/// What a UAV offers and holds.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Bundle {
    /// Its offer.
    pub offer: Offer,
    /// So many of its first tasks it held already when it made the offer.
    pub kept: u16,
    /// So many of those it had begun by then.
    pub begun: u16,
    /// What it holds, in the order in which it is flown.
    pub tasks: Vec<BundleTask>,
    /// What it had done when it made the offer, ascending.
    pub done: Vec<DoneTask>,
    /// Hash of all that was known when the tasks were settled: who has the same has the same
    /// settlement.
    pub basis: u32,
}

number_of!(TaskKind {
    Pinpoint,
    Line,
    Area,
    Track,
    Relay
});
number_of!(TaskState {
    Open,
    Cancelled,
    Expired,
    Done
});
number_of!(Progress {
    Tentative,
    Leaving,
    Committed,
    Begun,
    Done
});
array_of!(TaskPlace { east_mm, north_mm });
array_of!(Task {
    revision,
    state,
    kind,
    places,
    sensor,
    worth,
    stay_ms,
    radius_mm,
    within_ms,
    name,
    done_by,
    over_after_ms
});
array_of!(Offer {
    east_mm,
    north_mm,
    course_e4,
    speed_mmps,
    radius_mm,
    endurance_ms,
    sensors,
    section_ms,
    takes
});
array_of!(Bundle {
    offer,
    kept,
    begun,
    tasks,
    done,
    basis
});

impl Listed for TaskPlace {
    const MAX: usize = TASK_PLACES_MAX;
}
impl Listed for BundleTask {
    const MAX: usize = BUNDLE_MAX;
}
impl Listed for DoneTask {
    const MAX: usize = DONE_MAX;
}

/// Flat on the wire: a nested name would cost a byte each time.
impl Wire for BundleTask {
    fn put(&self, out: &mut Out) {
        out.array(5);
        self.task.author.put(out);
        self.task.number.put(out);
        self.revision.put(out);
        self.bid.put(out);
        self.progress.put(out);
    }

    fn get(input: &mut In<'_>) -> Result<Self, WireError> {
        input.array("tasks", 5)?;
        Ok(Self {
            task: TaskId {
                author: Wire::get(input)?,
                number: Wire::get(input)?,
            },
            revision: Wire::get(input)?,
            bid: Wire::get(input)?,
            progress: Wire::get(input)?,
        })
    }
}

impl Wire for DoneTask {
    fn put(&self, out: &mut Out) {
        out.array(3);
        self.task.author.put(out);
        self.task.number.put(out);
        self.revision.put(out);
    }

    fn get(input: &mut In<'_>) -> Result<Self, WireError> {
        input.array("done", 3)?;
        Ok(Self {
            task: TaskId {
                author: Wire::get(input)?,
                number: Wire::get(input)?,
            },
            revision: Wire::get(input)?,
        })
    }
}

fn is_near(mm: i32) -> bool {
    mm.unsigned_abs() <= POSITION_MAX_MM.unsigned_abs()
}

/// The first field of a task that is out of range.
pub(crate) fn check_task(t: &Task) -> Result<(), WireError> {
    let n = t.places.len();
    let fits = match t.kind {
        TaskKind::Line => (2..=TASK_PLACES_MAX).contains(&n),
        TaskKind::Area => n == 1 || (3..=TASK_PLACES_MAX).contains(&n),
        TaskKind::Pinpoint | TaskKind::Track | TaskKind::Relay => n == 1,
    };
    in_range("places", fits)?;
    in_range("places", t.places.is_sorted_by(|a, b| a != b))?;
    let near = |p: &TaskPlace| is_near(p.east_mm) && is_near(p.north_mm);
    in_range("places", t.places.iter().all(near))?;
    in_range("sensor", t.sensor <= SENSORS_MAX)?;
    in_range("worth", (1..=WORTH_MAX).contains(&t.worth))?;
    in_range("stay_ms", t.stay_ms <= DURATION_MAX_MS)?;
    in_range("radius_mm", t.radius_mm <= TASK_RADIUS_MAX_MM)?;
    in_range("within_ms", t.within_ms <= DURATION_MAX_MS)?;
    in_range("over_after_ms", t.over_after_ms <= DURATION_MAX_MS)?;
    let named = core::str::from_utf8(&t.name).is_ok_and(is_task_name);
    in_range("name", t.name.is_empty() || named)
}

/// Whether people can type it and a terminal shows it.
#[must_use]
pub fn is_task_name(name: &str) -> bool {
    name.len() <= TASK_NAME_MAX_BYTES && crate::mission_edit::is_zone_name(name)
}

/// The first field of a bundle that is out of range.
pub(super) fn check_bundle(b: &Bundle) -> Result<(), WireError> {
    in_range("east_mm", is_near(b.offer.east_mm))?;
    in_range("north_mm", is_near(b.offer.north_mm))?;
    let turn = b.offer.course_e4.unsigned_abs() <= HEADING_MAX_E4.unsigned_abs();
    in_range("course_e4", turn)?;
    in_range("speed_mmps", b.offer.speed_mmps <= SPEED_MAX_MMPS)?;
    in_range(
        "radius_mm",
        (1..=RADIUS_MAX_MM).contains(&b.offer.radius_mm) || b.offer.speed_mmps == 0,
    )?;
    in_range("endurance_ms", b.offer.endurance_ms <= DURATION_MAX_MS)?;
    in_range("section_ms", b.offer.section_ms <= DURATION_MAX_MS)?;
    in_range("takes", b.offer.takes <= EVERY_KIND)?;
    at_most("tasks", b.tasks.len(), BUNDLE_MAX)?;
    in_range("kept", usize::from(b.kept) <= b.tasks.len())?;
    in_range("begun", b.begun <= b.kept)?;
    let mut names: Vec<TaskId> = b.tasks.iter().map(|t| t.task).collect();
    names.sort_unstable();
    in_range("tasks", names.is_sorted_by(|a, b| a < b))?;
    let kept = &b.tasks[..usize::from(b.kept)];
    in_range(
        "kept",
        kept.iter().all(|t| t.progress > Progress::Tentative),
    )?;
    at_most("done", b.done.len(), DONE_MAX)?;
    in_range("done", b.done.is_sorted_by(|a, b| a.task < b.task))
}

const PLACE: &[Place] = &[
    at("east_mm", "mm east of the mission's origin", MM),
    at("north_mm", "mm north of the mission's origin", MM),
];

/// The places of a task's body.
pub(super) const TASK: &[Place] = &[
    at("revision", "grows with each change", U32),
    at(
        "state",
        "whether it is still to be done",
        Shape::Choice(&["open", "cancelled", "expired", "done"]),
    ),
    at(
        "kind",
        "what kind it is",
        Shape::Choice(&["pinpoint", "line", "area", "track", "relay"]),
    ),
    at(
        "places",
        "where: one place, of a line at least two, of an area one or its corners",
        Shape::Rows(PLACE, TASK_PLACES_MAX),
    ),
    at(
        "sensor",
        "the sensor that it needs; 0 for any",
        Shape::Number(0, SENSORS_MAX as i128),
    ),
    at(
        "worth",
        "what it is worth if done at once",
        Shape::Number(1, WORTH_MAX as i128),
    ),
    at("stay_ms", "how long a UAV stays there, ms", MS),
    at(
        "radius_mm",
        "how far around it is to be seen, mm",
        Shape::Number(0, TASK_RADIUS_MAX_MM as i128),
    ),
    at(
        "within_ms",
        "how long after it was asked for it is wanted, ms; 0 for ever",
        MS,
    ),
    at(
        "name",
        "what people call it",
        Shape::Bytes(TASK_NAME_MAX_BYTES),
    ),
    at("done_by", "who did it; 0 where nobody did", U16),
    at(
        "over_after_ms",
        "how long after it was asked for it was over, ms; 0 while it is not",
        MS,
    ),
];

const OFFER: &[Place] = &[
    PLACE[0],
    PLACE[1],
    at(
        "course_e4",
        "1e-4 rad counter-clockwise from east",
        Shape::Number(-(HEADING_MAX_E4 as i128), HEADING_MAX_E4 as i128),
    ),
    at(
        "speed_mmps",
        "mm/s; 0 where it takes no task",
        Shape::Number(0, SPEED_MAX_MMPS as i128),
    ),
    at(
        "radius_mm",
        "turn radius, mm",
        Shape::Number(0, RADIUS_MAX_MM as i128),
    ),
    at(
        "endurance_ms",
        "flight time that it may spend on tasks, ms",
        MS,
    ),
    at(
        "sensors",
        "a bit for each sensor, the lowest for sensor 1",
        U32,
    ),
    at(
        "section_ms",
        "flight time left in its section, ms; 0 without one",
        MS,
    ),
    at(
        "takes",
        "what its mission would fly, as bits: 1 places, lines and areas; 2 relay positions; 4 targets",
        Shape::Number(0, EVERY_KIND as i128),
    ),
];

const BUNDLE_TASK: &[Place] = &[
    at("author", "who asks for the task", U16),
    at("number", "which of its tasks", U16),
    at("revision", "in which revision", U32),
    at(
        "bid",
        "what it adds to the value, millionths of the task's worth",
        U32,
    ),
    at(
        "progress",
        "how far it is",
        Shape::Choice(&["tentative", "leaving", "committed", "begun", "done"]),
    ),
];

const DONE_TASK: &[Place] = &[
    at("author", "who asks for the task", U16),
    at("number", "which of its tasks", U16),
    at("revision", "in which revision", U32),
];

/// The places of a bundle's body.
pub(super) const BUNDLE: &[Place] = &[
    at("offer", "what all bids follow from", Shape::Row(OFFER)),
    at(
        "kept",
        "so many of the first tasks were held when the offer was made",
        Shape::Number(0, BUNDLE_MAX as i128),
    ),
    at(
        "begun",
        "so many of those were begun by then",
        Shape::Number(0, BUNDLE_MAX as i128),
    ),
    at(
        "tasks",
        "what it holds, in the order flown",
        Shape::Rows(BUNDLE_TASK, BUNDLE_MAX),
    ),
    at(
        "done",
        "what was done when the offer was made, ascending",
        Shape::Rows(DONE_TASK, DONE_MAX),
    ),
    at(
        "basis",
        "hash of all that was known when tasks were settled",
        U32,
    ),
];

#[cfg(test)]
pub(crate) mod samples;
