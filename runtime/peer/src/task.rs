//! What a mission asks for within its area (D2.7 §3.2): all of it in lanes or in exact
//! passes, points, or lines; and how often.

use crate::mission::{PointMm, mm, point_m, ring_mm};
use serde::{Deserialize, Serialize};
use skein_flight::coverage::stations::targets::{LineTarget, PointTarget, Targets};
use skein_geometry::hash::Fnv;

/// What is to be seen.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum CoverageTask {
    /// The whole area, in cells of the lane grid on a spanning-tree loop (§3.6.2).
    #[default]
    Area,
    /// The whole area but what is nearer to a zone than the clearance, in straight
    /// passes over the cells of an exact decomposition (§3.6.1).
    Exact,
    /// Points with what lies around them (§3.4).
    Points(Vec<PointTask>),
    /// Lines and corridors along their whole length (§3.5).
    Lines(Vec<LineTask>),
}

/// A point and what lies around it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PointTask {
    /// Where.
    pub at: PointMm,
    /// Radius of what is to be seen, mm.
    pub radius_mm: u32,
}

/// A line and what lies along it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LineTask {
    /// Its vertices in order.
    pub way: Vec<PointMm>,
    /// Width of what is to be seen along it, mm.
    pub width_mm: u32,
}

fn metres(mm: u32) -> f64 {
    f64::from(mm) / 1000.0
}

impl CoverageTask {
    /// Whether it is the whole area in lanes.
    #[must_use]
    pub fn is_area(&self) -> bool {
        *self == Self::Area
    }

    /// Dimension of what is to be seen (D2.7 §1.2.2): 0 points, 1 lines, 2 an area.
    #[must_use]
    pub fn dimension(&self) -> u8 {
        match self {
            Self::Points(_) => 0,
            Self::Lines(_) => 1,
            Self::Area | Self::Exact => 2,
        }
    }

    /// The targets, in metres; none for areas.
    #[must_use]
    pub fn targets(&self) -> Option<Targets> {
        match self {
            Self::Area | Self::Exact => None,
            Self::Points(points) => {
                let target = |p: &PointTask| PointTarget {
                    at: point_m(p.at),
                    radius_m: metres(p.radius_mm),
                };
                Some(Targets::Points(points.iter().map(target).collect()))
            }
            Self::Lines(lines) => {
                let target = |l: &LineTask| LineTarget {
                    way: l.way.iter().copied().map(point_m).collect(),
                    width_m: metres(l.width_mm),
                };
                Some(Targets::Lines(lines.iter().map(target).collect()))
            }
        }
    }

    /// The task of these targets, in whole millimetres.
    #[must_use]
    pub fn of_targets(targets: &Targets) -> Self {
        match targets {
            Targets::Points(points) => {
                let task = |p: &PointTarget| PointTask {
                    at: (mm(p.at.x), mm(p.at.y)),
                    radius_mm: mm(p.radius_m).unsigned_abs(),
                };
                Self::Points(points.iter().map(task).collect())
            }
            Targets::Lines(lines) => {
                let task = |l: &LineTarget| LineTask {
                    way: ring_mm(&l.way),
                    width_mm: mm(l.width_m).unsigned_abs(),
                };
                Self::Lines(lines.iter().map(task).collect())
            }
        }
    }

    /// Adds the content to a hash; nothing for an area, which is what missions ask for
    /// unless they say otherwise.
    pub(crate) fn hash(&self, h: &mut Fnv) {
        let point = |h: &mut Fnv, p: PointMm| {
            h.write_i64(i64::from(p.0));
            h.write_i64(i64::from(p.1));
        };
        let count = |h: &mut Fnv, n: usize| h.write_i64(i64::try_from(n).unwrap_or(i64::MAX));
        match self {
            Self::Area => {}
            Self::Exact => h.write_i64(3),
            Self::Points(points) => {
                h.write_i64(1);
                count(h, points.len());
                for p in points {
                    point(h, p.at);
                    h.write_i64(i64::from(p.radius_mm));
                }
            }
            Self::Lines(lines) => {
                h.write_i64(2);
                count(h, lines.len());
                for l in lines {
                    count(h, l.way.len());
                    l.way.iter().for_each(|&p| point(h, p));
                    h.write_i64(i64::from(l.width_mm));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_come_back_in_metres() {
        let points = CoverageTask::Points(vec![PointTask {
            at: (12_500, -2_250),
            radius_mm: 7_500,
        }]);
        let lines = CoverageTask::Lines(vec![LineTask {
            way: vec![(0, 1_000), (40_000, 1_500)],
            width_mm: 8_250,
        }]);
        let Some(Targets::Points(told)) = points.targets() else {
            panic!("points are targets");
        };
        assert_eq!(
            (told[0].at.x, told[0].at.y, told[0].radius_m),
            (12.5, -2.25, 7.5)
        );
        let Some(Targets::Lines(told)) = lines.targets() else {
            panic!("lines are targets");
        };
        assert_eq!(
            (told[0].way[1].x, told[0].way[1].y, told[0].width_m),
            (40.0, 1.5, 8.25)
        );
        assert!(CoverageTask::Area.is_area() && !CoverageTask::Exact.is_area());
        for task in [points, lines] {
            assert!(!task.is_area());
            assert_eq!(CoverageTask::of_targets(&task.targets().unwrap()), task);
        }
    }
}
