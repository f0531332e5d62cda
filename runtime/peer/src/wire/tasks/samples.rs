//! Bodies of tasks and bundles that tests share.

use super::super::codec::Body;
use super::*;

/// A pinpoint task, typically.
pub(crate) fn task() -> Task {
    Task {
        revision: 2,
        state: TaskState::Open,
        kind: TaskKind::Pinpoint,
        places: vec![TaskPlace {
            east_mm: 120_000,
            north_mm: -31_415,
        }],
        sensor: 1,
        worth: 100,
        stay_ms: 0,
        radius_mm: 15_000,
        name: b"gate".to_vec(),
        ..Task::default()
    }
}

/// A bundle with one task done before the offer, one flown to and one won, typically.
pub(crate) fn bundle() -> Bundle {
    let entry = |number, progress| BundleTask {
        task: TaskId { author: 9, number },
        revision: 2,
        bid: 50_000_000,
        progress,
    };
    Bundle {
        offer: Offer {
            east_mm: 1000,
            north_mm: -2000,
            course_e4: 15_708,
            speed_mmps: 18_000,
            radius_mm: 57_000,
            endurance_ms: 1_200_000,
            sensors: 1,
            section_ms: 90_000,
            takes: ERRANDS | TRACKS,
        },
        kept: 1,
        begun: 0,
        tasks: vec![
            entry(7, Progress::Committed),
            entry(300, Progress::Tentative),
        ],
        done: vec![DoneTask {
            task: TaskId {
                author: 9,
                number: 1,
            },
            revision: 1,
        }],
        basis: 0xdead_beef,
    }
}

/// The typical bodies and their bytes.
pub(crate) fn golden() -> Vec<(Body, &'static str)> {
    vec![
        (
            Body::Task(task()),
            "8c02000081821a0001d4c0397ab601186400193a980044676174650000",
        ),
        (
            Body::Bundle(bundle()),
            "86891903e83907cf193d5c19465019dea81a00124f80011a00015f9005010082\
             85090702\
             1a02faf080028509\
             19012c021a02faf080008183090101\
             1adeadbeef",
        ),
    ]
}

/// The largest valid bodies.
pub(crate) fn largest() -> Vec<Body> {
    let place = |k: i32| TaskPlace {
        east_mm: -POSITION_MAX_MM + k % 2,
        north_mm: -POSITION_MAX_MM,
    };
    let name = |k: u16| TaskId {
        author: u16::MAX,
        number: u16::MAX - 100 + k,
    };
    let count = |n: usize| u16::try_from(n).unwrap_or(0);
    vec![
        Body::Task(Task {
            revision: u32::MAX,
            state: TaskState::Done,
            kind: TaskKind::Line,
            places: (0..24).map(place).collect(),
            sensor: SENSORS_MAX,
            worth: WORTH_MAX,
            stay_ms: DURATION_MAX_MS,
            radius_mm: TASK_RADIUS_MAX_MM,
            within_ms: DURATION_MAX_MS,
            name: vec![b'x'; TASK_NAME_MAX_BYTES],
            done_by: u16::MAX,
            over_after_ms: DURATION_MAX_MS,
        }),
        Body::Bundle(Bundle {
            offer: Offer {
                east_mm: -POSITION_MAX_MM,
                north_mm: -POSITION_MAX_MM,
                course_e4: -HEADING_MAX_E4,
                speed_mmps: SPEED_MAX_MMPS,
                radius_mm: RADIUS_MAX_MM,
                endurance_ms: DURATION_MAX_MS,
                sensors: u32::MAX,
                section_ms: DURATION_MAX_MS,
                takes: EVERY_KIND,
            },
            kept: count(BUNDLE_MAX),
            begun: count(BUNDLE_MAX),
            tasks: (0..count(BUNDLE_MAX))
                .map(|k| BundleTask {
                    task: name(k),
                    revision: u32::MAX,
                    bid: u32::MAX,
                    progress: Progress::Done,
                })
                .collect(),
            done: (0..count(DONE_MAX))
                .map(|k| DoneTask {
                    task: name(k),
                    revision: u32::MAX,
                })
                .collect(),
            basis: u32::MAX,
        }),
    ]
}
