//! What happened in a run: every event folded into one 64-bit hash, and, where asked
//! for, the main ones kept for a timeline or a file.
//!
//! Only integers are folded (time, peer, kind, content), so the hash of a seed is the
//! same in debug and release builds and on every platform.

use crate::fault::Fault;
use serde::Serialize;
use skein_behaviors::Setpoint;
use skein_geometry::frame::Pose;
use skein_geometry::hash::Fnv;
use skein_peer::Report;
use skein_peer::output::Status;
use std::borrow::Cow;

/// One kept event.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Entry {
    /// Scenario time, milliseconds.
    pub time_ms: u64,
    /// What happened.
    pub what: What,
}

/// An event worth keeping.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum What {
    /// A fault struck.
    Fault(Fault),
    /// A peer reported something.
    Report {
        /// Which peer.
        peer: u16,
        /// What.
        report: Report,
    },
    /// The true components changed, each ascending.
    Components(Vec<Vec<u16>>),
    /// The last coverable cell was seen.
    Covered,
    /// A UAV flew into a no-fly zone.
    ZoneEntry {
        /// Which UAV.
        peer: u16,
        /// Which zone, by its place in the mission.
        zone: usize,
    },
    /// An airframe is gone, by no fault that took it.
    Lost {
        /// Which UAV.
        peer: u16,
    },
    /// A UAV left its launcher, at the word of its computer.
    TookOff {
        /// Which UAV.
        peer: u16,
    },
    /// An airframe began or ceased to loiter by itself.
    Failsafe {
        /// Which UAV.
        peer: u16,
        /// Whether it began.
        on: bool,
    },
    /// A rule was broken.
    Violation {
        /// Which rule.
        check: Cow<'static, str>,
        /// By or at which peer.
        peer: Option<u16>,
        /// How.
        text: String,
    },
}

/// The kinds of event that are folded but not kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A peer was given a percept; content: its position in millimetres.
    Percept,
    /// A peer published bytes.
    Publish,
    /// A peer received bytes.
    Receive,
    /// A record became durable.
    Stored,
    /// A problem was answered.
    Planned,
    /// A peer's timer ran.
    Timer,
    /// A setpoint was taken.
    Setpoint,
    /// A peer reported something.
    Report,
    /// A fault struck.
    Fault,
    /// A peer was started.
    Boot,
}

/// The history of one run.
#[derive(Clone, Debug, Default)]
pub struct History {
    hash: u64,
    events: u64,
    kept: Option<Vec<Entry>>,
}

impl History {
    /// A history that only hashes, or one that also keeps the main events.
    #[must_use]
    pub fn new(keep: bool) -> Self {
        Self {
            hash: Fnv::new().finish(),
            events: 0,
            kept: keep.then(Vec::new),
        }
    }

    /// Folds one event.
    pub fn fold(&mut self, time_ms: u64, peer: u16, kind: Kind, content: u64) {
        // One multiplication a word instead of one a byte: an event costs a few nanoseconds.
        let mut h = self.hash;
        for word in [time_ms, (u64::from(peer) << 8) | kind as u64, content] {
            h = (h ^ word).wrapping_mul(0x9E37_79B9_7F4A_7C15);
            h ^= h >> 29;
        }
        self.hash = h;
        self.events += 1;
    }

    /// Keeps an event, if anything is kept.
    pub fn keep(&mut self, time_ms: u64, what: impl FnOnce() -> What) {
        if let Some(kept) = &mut self.kept {
            kept.push(Entry {
                time_ms,
                what: what(),
            });
        }
    }

    /// The hash so far.
    #[must_use]
    pub fn hash(&self) -> u64 {
        self.hash
    }

    /// Events folded.
    #[must_use]
    pub fn events(&self) -> u64 {
        self.events
    }

    /// The events kept, in order.
    #[must_use]
    pub fn entries(&self) -> &[Entry] {
        self.kept.as_deref().unwrap_or(&[])
    }
}

/// FNV-1a of some bytes.
#[must_use]
pub fn bytes_hash(bytes: &[u8]) -> u64 {
    let mut h = Fnv::new();
    h.write(bytes);
    h.finish()
}

/// A pose as one number: millimetres and 1e-7 radians.
#[must_use]
pub fn pose_hash(pose: &Pose) -> u64 {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "casts from floats saturate, and only bits count"
    )]
    let q = |v: f64, scale: f64| (v * scale).round() as i64 as u64;
    q(pose.east_m, 1e3).rotate_left(42)
        ^ q(pose.north_m, 1e3).rotate_left(21)
        ^ q(pose.heading_rad, 1e7)
}

/// A setpoint as one number.
#[must_use]
pub fn setpoint_hash(s: &Setpoint) -> u64 {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "casts from floats saturate, and only bits count"
    )]
    let q = |v: f64| (v * 1e6).round() as i64 as u64;
    let turns = s
        .steps
        .iter()
        .fold(s.from_ms ^ q(s.airspeed_mps).rotate_left(32), |h, step| {
            (h ^ q(step.turn_rate_radps) ^ (u64::from(step.duration_ms) << 40))
                .wrapping_mul(0x9E37_79B9_7F4A_7C15)
        });
    let turns = s.promised.iter().fold(turns, |h, plan| {
        let ends = plan.stretches.iter().map(|p| u64::from(p.length_mm));
        ends.fold(h ^ plan.start_ms.rotate_left(20), |h, mm| {
            (h ^ mm).wrapping_mul(0x9E37_79B9_7F4A_7C15)
        })
    });
    s.gimbal.iter().fold(turns, |h, step| {
        (h ^ q(step.roll_rad) ^ q(step.pitch_rad).rotate_left(24))
            .wrapping_mul(0x9E37_79B9_7F4A_7C15)
    })
}

/// The content of a report as one number.
#[must_use]
pub fn report_hash(report: &Report) -> u64 {
    let mut h = Fnv::new();
    match report {
        Report::Booted { incarnation } => words(&mut h, 1, &[u64::from(*incarnation)]),
        Report::Ready {
            revision,
            loop_hash,
            cells,
        } => {
            words(
                &mut h,
                2,
                &[u64::from(*revision), *loop_hash, u64::from(*cells)],
            );
        }
        Report::Membership {
            peer,
            incarnation,
            status,
        } => {
            let status = match status {
                Status::Alive => 0,
                Status::Suspect => 1,
                Status::Down => 2,
            };
            words(
                &mut h,
                3,
                &[u64::from(peer.0), u64::from(*incarnation), status],
            );
        }
        Report::Round {
            counter, members, ..
        } => {
            words(&mut h, 4, &[u64::from(*counter)]);
            members
                .iter()
                .for_each(|m| words(&mut h, 0, &[u64::from(m.0)]));
        }
        Report::Claim {
            counter,
            epoch,
            take,
            legs,
            held,
            eta_ms,
        } => {
            words(
                &mut h,
                5,
                &[
                    u64::from(*counter),
                    u64::from(*epoch),
                    u64::from(*take),
                    u64::from(*eta_ms),
                ],
            );
            for l in legs {
                words(
                    &mut h,
                    l.direction as u64,
                    &[u64::from(l.first), u64::from(l.count)],
                );
            }
            held.iter().for_each(|c| words(&mut h, 0, &[u64::from(*c)]));
        }
        Report::Covered { cells } => {
            words(&mut h, 6, &[]);
            cells
                .iter()
                .for_each(|c| words(&mut h, 0, &[u64::from(*c)]));
        }
        Report::Revised { mission } => {
            words(&mut h, 11, &[mission.content_hash()]);
        }
        Report::Found { mission } => words(&mut h, 17, &[mission.content_hash()]),
        Report::Silenced => words(&mut h, 10, &[]),
        Report::Task {
            id,
            revision,
            name,
            news,
            ..
        } => {
            words(&mut h, 12, &[]);
            let told = format!(
                "Task {{ id: {id:?}, revision: {revision}, name: {name:?}, news: {news:?} }}"
            );
            h.write(told.as_bytes());
        }
        Report::Detected { id, told } => {
            words(&mut h, 13, &[u64::from(id.author), u64::from(id.number)]);
            h.write(format!("{told:?}").as_bytes());
        }
        Report::Crowd { told } => {
            words(&mut h, 15, &[u64::from(told.sector)]);
            h.write(format!("{told:?}").as_bytes());
        }
        Report::Traced {
            length_m,
            area_m2,
            places,
        } => words(
            &mut h,
            14,
            &[*length_m, area_m2.unwrap_or(0), u64::from(*places)],
        ),
        Report::Finished { revision } => words(&mut h, 7, &[u64::from(*revision)]),
        Report::Alarm { text } => {
            words(&mut h, 8, &[]);
            h.write(text.as_bytes());
        }
        Report::Refused { reason } => {
            words(&mut h, 9, &[]);
            h.write(reason.as_bytes());
        }
    }
    h.finish()
}

#[allow(clippy::cast_possible_wrap, reason = "only the bits count")]
fn words(h: &mut Fnv, kind: u64, words: &[u64]) {
    h.write_i64(kind as i64);
    for w in words {
        h.write_i64(*w as i64);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_and_content_both_count() {
        let run = |events: &[(u64, u16, u64)]| {
            let mut h = History::new(false);
            for (t, p, c) in events {
                h.fold(*t, *p, Kind::Receive, *c);
            }
            h.hash()
        };
        let a = run(&[(1, 1, 5), (1, 2, 6)]);
        assert_eq!(a, run(&[(1, 1, 5), (1, 2, 6)]));
        assert_ne!(a, run(&[(1, 2, 6), (1, 1, 5)]));
        assert_ne!(a, run(&[(1, 1, 5), (1, 2, 7)]));
    }

    #[test]
    fn nothing_is_kept_unless_asked_for() {
        let mut quiet = History::new(false);
        quiet.keep(1, || What::Covered);
        assert!(quiet.entries().is_empty());
        let mut loud = History::new(true);
        loud.keep(1, || What::Covered);
        assert_eq!(
            loud.entries(),
            [Entry {
                time_ms: 1,
                what: What::Covered
            }]
        );
    }
}
