//! A map: area, zones, buildings, cells in the colours of the UAVs that saw them, tracks, and
//! where UAVs were lost.

use crate::page::escaped;
use crate::plots::Run;
use skein_geometry::frame::Point;
use skein_recording::cells::{Cell, Cells};
use skein_recording::foxglove::colour;
use skein_recording::model::scene::Building;
use skein_recording::model::{Ring, Scene};
use skein_recording::tracks;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Width of the drawing, in its own units.
const WIDTH: f64 = 1000.0;
const MARGIN: f64 = 20.0;

/// Points of a track that lie nearer to a straight line than this are left out, metres.
const STRAIGHT_M: f64 = 0.4;

/// From metres to places of the drawing.
struct View {
    west_m: f64,
    north_m: f64,
    scale: f64,
    height: f64,
}

impl View {
    /// Everything that is flown over or drawn.
    fn of(scene: &Scene) -> Self {
        let cells = scene.cells.iter().flat_map(|c| &c.ring.east_north_m);
        let area = scene.area.east_north_m.iter();
        let zones = scene.zones.iter().flat_map(|z| &z.ring.east_north_m);
        let (mut low, mut high) = ([f64::MAX; 2], [f64::MIN; 2]);
        for p in cells.chain(area).chain(zones) {
            for i in 0..2 {
                low[i] = low[i].min(p[i]);
                high[i] = high[i].max(p[i]);
            }
        }
        if low[0] > high[0] {
            (low, high) = ([0.0; 2], [1.0; 2]);
        }
        let scale = (WIDTH - 2.0 * MARGIN) / (high[0] - low[0]).max(1.0);
        Self {
            west_m: low[0],
            north_m: high[1],
            scale,
            height: (high[1] - low[1]) * scale + 2.0 * MARGIN,
        }
    }

    fn at(&self, [east_m, north_m]: [f64; 2]) -> Point {
        Point::new(
            (east_m - self.west_m) * self.scale + MARGIN,
            (self.north_m - north_m) * self.scale + MARGIN,
        )
    }

    fn holds(&self, place: [f64; 2]) -> bool {
        let p = self.at(place);
        (0.0..=WIDTH).contains(&p.x) && (0.0..=self.height).contains(&p.y)
    }

    fn line(&self, points: impl Iterator<Item = [f64; 2]>) -> String {
        let mut words: Vec<String> = points
            .map(|p| self.at(p))
            .map(|p| format!("{:.1} {:.1}", p.x, p.y))
            .collect();
        words.dedup();
        format!("M{}", words.join("L"))
    }

    fn ring(&self, ring: &Ring) -> String {
        self.line(ring.east_north_m.iter().copied()) + "Z"
    }
}

/// The map of a run, for a page; `cells` are those at its end.
pub(crate) fn draw(run: &Run<'_>, cells: &Cells) -> String {
    let view = View::of(run.scene);
    let shapes = shapes(run, cells, &view);
    format!(
        "<svg viewBox=\"0 0 {WIDTH} {:.0}\" role=\"img\" aria-label=\"map\">{shapes}</svg>",
        view.height
    )
}

/// Colours of a drawing that stands alone follow the reader's: light or dark.
const STYLE: &str = "<style>.page{fill:#fff}.ink{fill:#222}.building{fill:#888;fill-opacity:.22}\
.zone{fill:#d11;fill-opacity:.45;stroke:#d11;stroke-width:3}.grid{fill:none;stroke:#bbb}\
.area{fill:none;stroke:#222}.mark{fill:none;stroke:#111}\
@media(prefers-color-scheme:dark){.page{fill:#0d1117}.ink{fill:#ddd}.mark,.area{stroke:#fff}}</style>";

/// The map of a run as a drawing of its own, with words.
pub(crate) fn picture(run: &Run<'_>, cells: &Cells) -> String {
    let view = View::of(run.scene);
    let (shapes, height) = (shapes(run, cells, &view), view.height);
    let all = cells.all();
    let by = |id: u16| all.iter().filter(|c| **c == Cell::Covered(id)).count();
    let makespan_ms = run.report.and_then(|r| r.makespan_ms);
    let end = makespan_ms.map_or("not all is covered".to_owned(), |ms| {
        format!("all is covered after {} s", ms / 1000)
    });
    let title = format!(
        "{}, seed {}: {} UAVs, {} of them lost; {} cells of the loop, {end}",
        escaped(&run.scene.scenario),
        run.scene.seed,
        run.scene.uavs.len(),
        tracks::losses(run.frames).len(),
        all.len()
    );
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 -60 {WIDTH} {:.0}\" font-family=\"sans-serif\" font-size=\"22\">\n{STYLE}\
         <rect class=\"page\" y=\"-60\" width=\"100%\" height=\"100%\"/>{shapes}\
         <text class=\"ink\" x=\"{MARGIN}\" y=\"-20\">{title}</text>",
        height + 150.0
    );
    #[allow(clippy::cast_precision_loss, reason = "some hundred UAVs at most")]
    let step = (WIDTH - MARGIN) / run.scene.uavs.len().max(1) as f64;
    let mut x = MARGIN;
    for uav in &run.scene.uavs {
        let (fill, y) = (colour(run.scene, uav.id), height + 34.0);
        let _ = write!(
            svg,
            "<rect fill=\"{fill}\" x=\"{x:.0}\" y=\"{:.0}\" width=\"20\" height=\"20\"/><text class=\"ink\" x=\"{:.0}\" y=\"{y:.0}\">{}: {}</text>",
            y - 18.0,
            x + 28.0,
            uav.id,
            by(uav.id)
        );
        x += step;
    }
    let _ = writeln!(
        svg,
        "<text class=\"ink\" x=\"{MARGIN}\" y=\"{:.0}\">UAV: cells that it saw first. ×: lost. Red: no-fly zones. Triangle: ground station</text></svg>",
        height + 74.0
    );
    svg
}

/// Everything that is drawn of a run.
fn shapes(run: &Run<'_>, cells: &Cells, view: &View) -> String {
    let scene = run.scene;
    let mut svg = String::new();
    let all = |rings: &mut dyn Iterator<Item = &Ring>| -> String {
        rings.map(|r| view.ring(r)).collect()
    };
    let inside = |b: &&Building| b.ring.east_north_m.iter().all(|p| view.holds(*p));
    let buildings = all(&mut scene.buildings.iter().filter(inside).map(|b| &b.ring));
    let _ = write!(svg, "<path class=\"building\" d=\"{buildings}\"/>");
    let mut by: BTreeMap<u16, String> = BTreeMap::new();
    let mut left = String::new();
    for (cell, is) in scene.cells.iter().zip(cells.all()) {
        match is {
            Cell::Covered(uav) => by.entry(uav).or_default().push_str(&view.ring(&cell.ring)),
            _ if cell.needed => left.push_str(&view.ring(&cell.ring)),
            _ => {}
        }
    }
    for (uav, d) in by {
        let fill = colour(scene, uav);
        let _ = write!(
            svg,
            "<path fill=\"{fill}\" fill-opacity=\"0.3\" d=\"{d}\"/>"
        );
    }
    let _ = write!(svg, "<path class=\"grid\" d=\"{left}\"/>");
    let area = view.ring(&scene.area);
    let _ = write!(svg, "<path class=\"area\" d=\"{area}\"/>");
    let zones = all(&mut scene.zones.iter().map(|z| &z.ring));
    let _ = write!(svg, "<path class=\"zone\" d=\"{zones}\"/>");
    for (uav, lives) in tracks::of(run.frames) {
        let stroke = colour(scene, uav);
        let d: String = lives.iter().map(|life| track(view, life)).collect();
        let _ = write!(
            svg,
            "<path fill=\"none\" stroke=\"{stroke}\" stroke-width=\"2.5\" stroke-linejoin=\"round\" d=\"{d}\"/>"
        );
    }
    for (_, (_, pose)) in tracks::losses(run.frames) {
        let p = view.at([pose.place.east_m, pose.place.north_m]);
        let _ = write!(
            svg,
            "<path class=\"mark\" stroke-width=\"5\" d=\"M{:.0} {:.0}l20 20m0-20l-20 20\"/>",
            p.x - 10.0,
            p.y - 10.0
        );
    }
    if let Some(station) = &scene.ground {
        let p = view.at([station.place.east_m, station.place.north_m]);
        let _ = write!(
            svg,
            "<path class=\"ink\" d=\"M{:.0} {:.0}l10 18h-20z\"/>",
            p.x,
            p.y - 10.0
        );
    }
    svg
}

fn track(view: &View, fixes: &[tracks::Fix]) -> String {
    let points: Vec<Point> = fixes.iter().map(|(_, p)| p.place.point()).collect();
    view.line(simplified(&points).iter().map(|p| [p.x, p.y]))
}

/// The points without those that lie on a straight line with others (Douglas and
/// Peucker 1973); without recursion, for a track may have many thousand.
fn simplified(points: &[Point]) -> Vec<Point> {
    let mut keep = vec![false; points.len()];
    let mut open = vec![(0, points.len().saturating_sub(1))];
    while let Some((from, to)) = open.pop() {
        let (Some(a), Some(b)) = (points.get(from), points.get(to)) else {
            return Vec::new();
        };
        (keep[from], keep[to]) = (true, true);
        let along = b - a;
        let length_m = along.norm();
        let off_m = |p: &Point| {
            let d = p - a;
            if length_m > 1.0 {
                (along.x * d.y - along.y * d.x).abs() / length_m
            } else {
                d.norm()
            }
        };
        let between = (from + 1..to).map(|i| (i, off_m(&points[i])));
        let farthest = between.max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((i, _)) = farthest.filter(|(_, m)| *m > STRAIGHT_M) {
            open.extend([(from, i), (i, to)]);
        }
    }
    let kept = points.iter().zip(keep).filter(|(_, k)| *k);
    kept.map(|(p, _)| *p).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn straight_stretches_lose_their_points_and_corners_stay() {
        let east = (0..50).map(|i| Point::new(f64::from(i), 0.1 * f64::from(i % 2)));
        let north = (1..50).map(|i| Point::new(49.0, f64::from(i)));
        let points: Vec<Point> = east.chain(north).collect();
        let few = simplified(&points);
        assert!(few.len() <= 4, "{few:?}");
        let corner = Point::new(49.0, 0.0);
        assert!(few.iter().any(|p| (p - corner).norm() < 1.1));
        assert_eq!(few.last(), points.last());
        assert!(simplified(&[]).is_empty());
        assert_eq!(simplified(&points[..1]).len(), 1);
    }
}
