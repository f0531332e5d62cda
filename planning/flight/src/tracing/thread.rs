//! Looks at a contour, strung together in the order of flight (D2.7 §3.1).
//!
//! A look shows a piece or several; the one that goes on from what was seen before replaces
//! what it shows anew. What has left the picture is final, and is handed over once.
//!
//! # Guarantees
//! Bounded: `KEPT` final places and one look. Equal looks give equal threads.
//!
//! # Complexity
//! A look costs its points times what is kept.

use skein_geometry::frame::{Point, Vector};
use skein_geometry::polyline::{length_m, nearest};

/// Final places that are kept to tell what goes on from them.
const KEPT: usize = 16;

/// What goes on begins no farther from what was seen than this, metres: three places of a look,
/// and what a turn hides meanwhile.
const GAP_M: f64 = 40.0;

/// What was seen no longer ago than this, metres along it, is not taken for something new.
const OLD_M: f64 = 30.0;

/// What was shown before goes on this far beyond the end of a look, metres.
const SPARE_M: f64 = 12.0;

/// Shorter than this a look shows no way, metres.
const LEAST_M: f64 = 10.0;

/// A place of a contour as it was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    /// Where.
    pub at: Point,
    /// When, milliseconds.
    pub seen_ms: u64,
    /// Whether nothing was seen between the place before and this.
    pub begins: bool,
}

/// One look at a contour: pieces, each in order along it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Look {
    /// The pieces.
    pub pieces: Vec<Vec<Point>>,
    /// Whether they are told so that what they enclose is on their left; else either way.
    pub sided: bool,
}

/// A contour as one UAV has it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Thread {
    /// In the order of flight.
    line: Vec<Mark>,
    /// So many of them are final.
    finals: usize,
    passed: Vec<Mark>,
}

/// How a piece goes on from what was seen.
struct Continuation {
    piece: Vec<Point>,
    /// So much of the line stays, metres.
    stays_m: f64,
    /// And what is farther along it than this: it was shown before, and is not now.
    goes_on_m: f64,
    off_m: f64,
}

impl Thread {
    /// Whether nothing was seen, or all was forgotten.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.line.is_empty()
    }

    /// What was seen, in the order of flight.
    #[must_use]
    pub fn line(&self) -> Vec<Point> {
        self.line.iter().map(|m| m.at).collect()
    }

    /// When the newest of it was seen, milliseconds.
    #[must_use]
    pub fn seen_ms(&self) -> Option<u64> {
        self.line.iter().map(|m| m.seen_ms).max()
    }

    /// What has left the picture since the last call, in the order of flight.
    pub fn take_passed(&mut self) -> Vec<Mark> {
        std::mem::take(&mut self.passed)
    }

    /// Takes in a look from a place. Of what goes on from nothing the nearest piece begins a
    /// thread, where there is none, towards `prefers`. Returns whether the thread went on.
    /// Who `seeks` takes what begins elsewhere for what goes on, too.
    pub fn see(
        &mut self,
        (now_ms, from): (u64, Point),
        look: &Look,
        prefers: Vector,
        seeks: bool,
    ) -> bool {
        let long = look.pieces.iter().filter(|p| length_m(p) >= LEAST_M);
        let long: Vec<&Vec<Point>> = long.collect();
        if self.line.is_empty() {
            return self.begin((now_ms, from), &long, look.sided, prefers);
        }
        let line = self.line();
        let both = |piece: &&Vec<Point>| {
            let back: Vec<Point> = piece.iter().rev().copied().collect();
            let other = (!look.sided).then_some(back);
            [Some((*piece).clone()), other].into_iter().flatten()
        };
        let all = long.iter().flat_map(both);
        let goes_on = all.filter_map(|piece| continues(&line, &piece));
        if let Some(on) = goes_on.min_by(|a, b| a.off_m.total_cmp(&b.off_m)) {
            self.go_on(now_ms, &on);
            return true;
        }
        if !seeks {
            return false;
        }
        let is_new = |piece: &&&Vec<Point>| {
            let away = |p: &Point| nearest(&line, *p).is_none_or(|(_, m, _)| m > OLD_M);
            piece.iter().all(away)
        };
        let new: Vec<&Vec<Point>> = long.iter().filter(is_new).copied().collect();
        let end = line.last().copied().unwrap_or(from);
        self.begin((now_ms, from), &new, look.sided, from - end)
    }

    /// Flies the other way from now on.
    pub fn turn_back(&mut self) {
        self.hand_over(self.line.len());
        self.line.reverse();
        if let Some(first) = self.line.first_mut() {
            first.begins = true;
        }
        for m in self.line.iter_mut().skip(1) {
            m.begins = false;
        }
        self.finals = self.line.len();
    }

    /// Forgets what was seen; what was not handed over yet is.
    pub fn end(&mut self) {
        self.hand_over(self.line.len());
        self.line.clear();
        self.finals = 0;
    }

    fn begin(
        &mut self,
        (now_ms, from): (u64, Point),
        pieces: &[&Vec<Point>],
        sided: bool,
        prefers: Vector,
    ) -> bool {
        let near = |p: &&&Vec<Point>| nearest(p, from).map_or(f64::MAX, |(_, m, _)| m);
        let first = pieces
            .iter()
            .min_by(|a, b| near(a).total_cmp(&near(b)))
            .copied();
        let Some(mut piece) = first.cloned() else {
            return false;
        };
        if let (Some(a), Some(b)) = (piece.first(), piece.last())
            && !sided
            && (b - a).dot(&prefers) < 0.0
        {
            piece.reverse();
        }
        self.end();
        let mark = |(i, at): (usize, Point)| Mark {
            at,
            seen_ms: now_ms,
            begins: i == 0,
        };
        self.line = piece.into_iter().enumerate().map(mark).collect();
        true
    }

    fn go_on(&mut self, now_ms: u64, on: &Continuation) {
        let mut along_m = 0.0;
        let mut kept = usize::from(on.stays_m > 0.0);
        let mut tail = self.line.len();
        for (i, both) in self.line.windows(2).enumerate() {
            along_m += (both[1].at - both[0].at).norm();
            if along_m < on.stays_m {
                kept = i + 2;
            }
            if along_m > on.goes_on_m {
                tail = tail.min(i + 1);
            }
        }
        let tail: Vec<Mark> = self.line.drain(tail.max(kept).max(self.finals)..).collect();
        let kept = kept.min(self.line.len());
        let begins = kept == 0;
        self.hand_over(kept);
        self.line.truncate(kept);
        self.finals = kept;
        self.line
            .extend(on.piece.iter().enumerate().map(|(i, at)| Mark {
                at: *at,
                seen_ms: now_ms,
                begins: begins && i == 0,
            }));
        self.line.extend(tail);
        let spare = self.finals.saturating_sub(KEPT);
        self.line.drain(..spare);
        self.finals -= spare;
    }

    /// The first so many places are final.
    fn hand_over(&mut self, count: usize) {
        if count > self.finals {
            let new = &self.line[self.finals..count];
            self.passed.extend_from_slice(new);
            self.finals = count;
        }
    }
}

/// How a piece goes on from a line, if it does.
fn continues(line: &[Point], piece: &[Point]) -> Option<Continuation> {
    let (first, last) = (*piece.first()?, *piece.last()?);
    let way = last - first;
    // Nearer to the end of the line than this it is the end that is shown.
    let length_m = length_m(line);
    let ends_m = nearest(line, last).filter(|(_, m, _)| *m <= GAP_M);
    let goes_on_m = ends_m.map_or(length_m, |(s, ..)| s + SPARE_M);
    let all = piece.to_vec();
    if let Some((along_m, off_m, direction)) = nearest(line, first)
        && off_m <= GAP_M
        && way.dot(&direction) > 0.0
    {
        return Some(Continuation {
            piece: all,
            stays_m: along_m,
            goes_on_m: goes_on_m.max(along_m),
            off_m,
        });
    }
    // It shows more than all that is known.
    let (_, off_m, direction) = nearest(piece, *line.first()?)?;
    let known = line.last()? - line.first()?;
    (off_m <= GAP_M && known.dot(&direction) >= 0.0).then_some(Continuation {
        piece: all,
        stays_m: 0.0,
        goes_on_m: length_m,
        off_m,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(from_m: f64, to_m: f64) -> Vec<Point> {
        let mut all = Vec::new();
        let mut x = from_m;
        while x <= to_m {
            all.push(Point::new(x, 0.01 * x));
            x += 10.0;
        }
        all
    }

    fn look(piece: Vec<Point>, sided: bool) -> Look {
        Look {
            pieces: vec![piece],
            sided,
        }
    }

    #[test]
    fn looks_are_strung_together_and_what_left_the_picture_is_handed_over_once() {
        let mut thread = Thread::default();
        let east = Vector::new(1.0, 0.0);
        let mut passed = Vec::new();
        for k in 0..40_u32 {
            let x = 10.0 * f64::from(k);
            let mut piece = shown(x - 40.0, x + 40.0);
            if k % 2 == 1 {
                piece.reverse();
            }
            let at = Point::new(x, 0.0);
            let now_ms = u64::from(k) * 200;
            assert!(thread.see((now_ms, at), &look(piece, false), east, false));
            passed.extend(thread.take_passed());
        }
        let xs: Vec<f64> = passed.iter().map(|m| m.at.x).collect();
        assert!(xs.windows(2).all(|b| b[1] > b[0]), "{xs:?}");
        assert!(xs[0] < -35.0 && *xs.last().unwrap() > 320.0, "{xs:?}");
        assert_eq!(passed.iter().filter(|m| m.begins).count(), 1);
        assert!(thread.line().last().unwrap().x > 420.0);
        assert!(thread.line().len() < 40);
    }

    #[test]
    fn what_is_elsewhere_goes_on_for_who_seeks_alone_and_what_was_seen_for_nobody() {
        let mut thread = Thread::default();
        let east = Vector::new(1.0, 0.0);
        let at = Point::new(40.0, 0.0);
        thread.see((0, at), &look(shown(0.0, 80.0), false), east, false);
        let beyond = look(shown(200.0, 260.0), false);
        assert!(!thread.see((200, at), &beyond, east, false));
        let mut back = shown(0.0, 60.0);
        back.reverse();
        // Sided looks the other way round are another edge.
        assert!(!thread.see((300, at), &look(back, true), east, true));
        let far = Point::new(190.0, 20.0);
        assert!(thread.see((400, far), &beyond, east, true));
        assert!(thread.line()[0].x > 190.0);
        assert!(thread.take_passed().len() > 6);
    }
}
