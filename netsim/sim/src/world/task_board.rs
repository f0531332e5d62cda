//! Which tasks other than coverage were seen, by whom and when, as the judge sees it: by the
//! flown pieces and geometry of its own (D2.7 §3.2).

use super::board::{LOOK_M, Sighting};
use super::camera::{Eye, Picture};
use super::motion::Piece;
use super::pieces::Pieces;
use skein_geometry::frame::Point;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// A task that is to be seen.
#[derive(Clone, Debug)]
struct Asked {
    pieces: Pieces,
    seen: Vec<bool>,
    left: usize,
    /// Who carries what it needs.
    carriers: BTreeSet<u16>,
    last: Option<Sighting>,
}

impl Asked {
    /// Takes in what one picture shows of it. Returns whether that was the last of it.
    fn snap(&mut self, reach_m: f64, picture: &Picture, sighting: Sighting) -> bool {
        if self.left == 0 || !self.carriers.contains(&sighting.uav) {
            return false;
        }
        for i in self.pieces.near(picture.from(), reach_m) {
            if !self.seen[i] && self.pieces.held(i, picture) {
                self.seen[i] = true;
                self.left -= 1;
                self.last = Some(sighting);
            }
        }
        self.left == 0
    }
}

/// One picture: how far it reaches, what it shows, whose it is.
type Look = (f64, Picture, Sighting);

/// All tasks that were asked for, by number and revision.
#[derive(Clone, Debug, Default)]
pub(super) struct TaskBoard {
    tasks: BTreeMap<(u16, u32), Asked>,
    /// How many are not seen yet.
    open: usize,
    /// For how long pictures are kept, milliseconds, and those that are.
    keeps_ms: u64,
    kept: VecDeque<Look>,
}

impl TaskBoard {
    /// One more, which was asked for then: what pictures that are kept showed of it since counts.
    /// Asked twice it is asked once.
    pub(super) fn ask(
        &mut self,
        task: (u16, u32),
        pieces: Vec<[Point; 4]>,
        carriers: BTreeSet<u16>,
        since_ms: u64,
    ) {
        if pieces.is_empty() || self.tasks.contains_key(&task) {
            return;
        }
        let mut asked = Asked {
            seen: vec![false; pieces.len()],
            left: pieces.len(),
            pieces: Pieces::new(pieces),
            carriers,
            last: None,
        };
        let since = self.kept.iter().filter(|(.., s)| s.at_ms >= since_ms);
        for (reach_m, picture, sighting) in since {
            asked.snap(*reach_m, picture, *sighting);
        }
        self.open += usize::from(asked.left > 0);
        self.tasks.insert(task, asked);
    }

    /// Keeps pictures for so long from now on, for tasks that are heard of late.
    pub(super) fn keep_looks(&mut self, keeps_ms: u64) {
        self.keeps_ms = keeps_ms;
    }

    /// Who saw the last piece of a task and when, once all were seen.
    pub(super) fn saw(&self, task: (u16, u32)) -> Option<Sighting> {
        let asked = self.tasks.get(&task)?;
        asked.last.filter(|_| asked.left == 0)
    }

    /// Looks along a flown piece.
    pub(super) fn look(&mut self, uav: u16, eye: &Eye<'_>, piece: &Piece) {
        if self.open == 0 && self.keeps_ms == 0 {
            return;
        }
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a piece is as long as one step of the world"
        )]
        let n = (piece.length_m() / LOOK_M).ceil().clamp(1.0, 1e6) as u32;
        let span_ms = piece.to_ms - piece.from_ms;
        for k in 0..=n {
            #[allow(clippy::cast_precision_loss, reason = "milliseconds of one step")]
            let dt_s = span_ms as f64 / 1000.0 * f64::from(k) / f64::from(n);
            let at_ms = piece.from_ms + span_ms * u64::from(k) / u64::from(n);
            let picture = eye.picture(piece.pose_after(dt_s), at_ms);
            let look = (eye.reach_m(), picture, Sighting { at_ms, uav });
            for task in self.tasks.values_mut() {
                self.open -= usize::from(task.snap(look.0, &look.1, look.2));
            }
            if self.keeps_ms > 0 {
                self.kept.push_back(look);
            }
        }
        let from_ms = piece.to_ms.saturating_sub(self.keeps_ms);
        while self.kept.front().is_some_and(|(.., s)| s.at_ms < from_ms) {
            self.kept.pop_front();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::fixture::airframe;
    use skein_flight::trajectory::wind::Wind;
    use skein_geometry::frame::Pose;

    fn flown(uav: u16, from: (f64, f64), board: &mut TaskBoard) {
        let piece = Piece {
            from_ms: 0,
            to_ms: 10_000,
            start: Pose::new(Point::new(from.0, from.1), 0.0),
            speed_mps: 13.0,
            turn_rate_radps: 0.0,
            wind: Wind::CALM,
        };
        board.look(uav, &Eye::from(&airframe()), &piece);
    }

    #[test]
    fn a_task_is_seen_once_all_its_pieces_are_by_who_carries_what_it_needs() {
        let square = |x: f64| {
            [(-5.0, -5.0), (5.0, -5.0), (5.0, 5.0), (-5.0, 5.0)].map(|(a, b)| Point::new(x + a, b))
        };
        let mut board = TaskBoard::default();
        board.ask((0, 1), vec![square(60.0), square(200.0)], [1].into(), 0);
        board.ask((0, 1), vec![square(0.0)], [1].into(), 0);
        flown(2, (0.0, 0.0), &mut board);
        flown(2, (100.0, 0.0), &mut board);
        assert_eq!(board.saw((0, 1)), None, "it carries nothing of use");
        flown(1, (0.0, 0.0), &mut board);
        assert_eq!(board.saw((0, 1)), None);
        flown(1, (100.0, 0.0), &mut board);
        let seen = board.saw((0, 1)).unwrap();
        assert!(
            seen.uav == 1 && (4_000..8_000).contains(&seen.at_ms),
            "{seen:?}"
        );
        assert_eq!((board.saw((0, 2)), board.open), (None, 0));
    }

    #[test]
    fn a_task_that_is_heard_of_late_was_seen_by_who_saw_it_since_it_was_asked_for() {
        let corners = [(45.0, -5.0), (55.0, -5.0), (55.0, 5.0), (45.0, 5.0)];
        let pieces = vec![corners.map(|(x, y)| Point::new(x, y))];
        // It is flown over after 3.8 s, and is in the picture for two seconds more; then 50 m of
        // flight follow, until 10 s.
        for (keeps_ms, since_ms, seen) in [
            (5_000, 5_000, true),
            (5_000, 9_500, false),
            (400, 5_000, false),
            (0, 5_000, false),
        ] {
            let mut board = TaskBoard::default();
            board.keep_looks(keeps_ms);
            flown(1, (0.0, 0.0), &mut board);
            assert_eq!(board.saw((0, 1)), None);
            board.ask((0, 1), pieces.clone(), [1].into(), since_ms);
            board.ask((0, 1), pieces.clone(), [1].into(), since_ms);
            let by = board.saw((0, 1)).map(|s| s.uav);
            assert_eq!(by.is_some(), seen, "{keeps_ms} {since_ms} {by:?}");
            assert_eq!(board.open, usize::from(!seen));
        }
    }
}
