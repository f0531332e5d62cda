//! Where each UAV flew: one track a life of its airframe.

use crate::model::frame::{Frame, Pose};
use std::collections::BTreeMap;

/// A pose and when it was, milliseconds of scenario time.
pub type Fix = (u64, Pose);

/// The tracks of each UAV, in the order of time.
#[must_use]
pub fn of(frames: &[Frame]) -> BTreeMap<u16, Vec<Vec<Fix>>> {
    let mut all: BTreeMap<u16, Vec<Vec<Fix>>> = BTreeMap::new();
    let mut aloft: BTreeMap<u16, bool> = BTreeMap::new();
    for frame in frames {
        for uav in &frame.uavs {
            let tracks = all.entry(uav.id).or_default();
            let was = aloft.insert(uav.id, uav.pose.is_some()) == Some(true);
            let Some(pose) = uav.pose else {
                continue;
            };
            match tracks.last_mut().filter(|_| was) {
                Some(track) => track.push((frame.time_ms, pose)),
                None => tracks.push(vec![(frame.time_ms, pose)]),
            }
        }
    }
    all
}

/// Where UAVs were seen last before their airframes were gone, by whose they were.
#[must_use]
pub fn losses(frames: &[Frame]) -> Vec<(u16, Fix)> {
    let mut last: BTreeMap<u16, Fix> = BTreeMap::new();
    let mut lost = Vec::new();
    for frame in frames {
        for uav in &frame.uavs {
            match uav.pose {
                Some(pose) => drop(last.insert(uav.id, (frame.time_ms, pose))),
                None => lost.extend(last.remove(&uav.id).map(|fix| (uav.id, fix))),
            }
        }
    }
    lost
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::frame::UavState;

    #[test]
    fn a_new_airframe_begins_a_new_track() {
        let frame = |time_ms: u64, flies: bool| Frame {
            time_ms,
            uavs: vec![UavState {
                id: 3,
                pose: flies.then(Pose::default),
                ..UavState::default()
            }],
            ..Frame::default()
        };
        let frames = [(0, true), (1, true), (2, false), (3, false), (4, true)];
        let frames = frames.map(|(t, f)| frame(t, f));
        let tracks = &of(&frames)[&3];
        let lengths: Vec<usize> = tracks.iter().map(Vec::len).collect();
        assert_eq!(lengths, [2, 1]);
        let lost = losses(&frames);
        assert_eq!((lost.len(), lost[0].1.0), (1, 1));
    }
}
