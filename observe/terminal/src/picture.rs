//! Map, roster and events, in as many characters as there are.

use crate::look::Look;
use crate::raster::{Ground, Raster};
use crate::view::View;
use ratatui::Frame as Canvas;
use ratatui::buffer::Buffer;
use ratatui::layout::{Position, Rect};
use ratatui::style::{Modifier, Style};
use ratatui::text::{Line, Span};
use skein_geometry::frame::Point;
use skein_recording::cells::Cell;
use skein_recording::model::Knowledge;
use skein_recording::model::event::Origin;
use skein_recording::model::frame::{State, UavState};
use skein_recording::{Event, Scene};
use skein_view::Standing;

/// Characters of the roster.
const ROSTER_WIDTH: u16 = 38;

/// Below this many columns there is no roster beside the map.
const LEAST_WIDTH: u16 = 64;

/// Lines of events below the map.
const EVENT_LINES: u16 = 5;

/// What a person has chosen, and what stays between two pictures.
#[derive(Debug)]
pub struct Picture {
    /// What it is.
    pub title: String,
    /// Who knows what frames say.
    pub knowledge: Knowledge,
    /// What the terminal can show.
    pub look: Look,
    /// Whose row and links stand out.
    pub selected: Option<u16>,
    /// Whether links of all are drawn.
    pub links: bool,
    /// What stands at the right of the first line: speed, paused.
    pub pace: String,
    /// What the last line says: keys, or the answer to one.
    pub foot: String,
    pub(crate) view: Option<View>,
    raster: Raster,
}

impl Picture {
    /// Nothing was chosen yet.
    #[must_use]
    pub fn new(title: String, knowledge: Knowledge, look: Look) -> Self {
        Self {
            title,
            knowledge,
            look,
            selected: None,
            links: false,
            pace: String::new(),
            foot: String::new(),
            view: None,
            raster: Raster::default(),
        }
    }

    /// Draws how all stands.
    pub fn draw(&mut self, canvas: &mut Canvas<'_>, standing: &Standing) {
        let all = canvas.area();
        let buffer = canvas.buffer_mut();
        let Some([head, map, roster, events, foot]) = parts(all) else {
            buffer.set_stringn(
                all.x,
                all.y,
                "too small",
                usize::from(all.width),
                Style::new(),
            );
            return;
        };
        self.head(buffer, head, standing);
        if let Some(scene) = &standing.scene {
            let view = *self.view.get_or_insert_with(|| View::of(scene, map));
            self.map(buffer, map, standing, scene, view);
        }
        self.roster(buffer, roster, standing);
        self.events(buffer, events, standing);
        let width = usize::from(foot.width);
        buffer.set_stringn(foot.x, foot.y, &self.foot, width, self.look.dim());
    }

    fn head(&self, buffer: &mut Buffer, at: Rect, standing: &Standing) {
        let mut words = vec![self.title.clone()];
        if let Some(frame) = &standing.frame {
            let alive = frame.uavs.iter().filter(|u| u.state.is_alive()).count();
            let orphans = standing.cells.all();
            let orphans = orphans.iter().filter(|c| matches!(c, Cell::Orphaned(_)));
            words.push(format!("{:.1} s", frame.time_ms as f64 / 1000.0));
            words.push(format!("{:.1} %", frame.covered_share * 100.0));
            words.push(format!("{alive}/{} alive", frame.uavs.len()));
            let parts = frame.components.len();
            words.push(format!("{parts} part{}", if parts == 1 { "" } else { "s" }));
            words.push(format!("{} orphans", orphans.count()));
        }
        if let Some(end) = &standing.end {
            let passed = if end.report.passed {
                "PASSED"
            } else {
                "FAILED"
            };
            words.push(passed.to_owned());
        }
        let text = words.join("  ");
        let bold = Style::new().add_modifier(Modifier::BOLD);
        buffer.set_stringn(at.x, at.y, &text, usize::from(at.width), bold);
        let width = u16::try_from(self.pace.chars().count()).unwrap_or(0);
        if let Some(left) = at.right().checked_sub(width).filter(|left| *left >= at.x) {
            buffer.set_string(left, at.y, &self.pace, bold);
        }
    }

    fn map(
        &mut self,
        buffer: &mut Buffer,
        at: Rect,
        standing: &Standing,
        scene: &Scene,
        view: View,
    ) {
        self.raster.update(scene, view, at);
        let cells = standing.cells.all();
        for row in 0..at.height {
            for column in 0..at.width {
                let ground = self.raster.at(column, row);
                if let Some((c, style)) = self.ground(ground, &cells) {
                    put(buffer, Position::new(at.x + column, at.y + row), c, style);
                }
            }
        }
        let bold = Style::new().add_modifier(Modifier::BOLD);
        for (place, c) in [
            (Some(&scene.base), 'B'),
            (scene.ground.as_ref().map(|g| &g.place), 'G'),
        ] {
            if let Some(at) = place.and_then(|p| view.at(p.point(), at)) {
                put(buffer, at, c, bold);
            }
        }
        self.draw_links(buffer, at, standing, view);
        for uav in standing.uavs() {
            self.uav(buffer, at, standing, uav, view);
        }
    }

    /// The character of what stands on the ground, with its look.
    fn ground(&self, ground: Ground, cells: &[Cell]) -> Option<(char, Style)> {
        let look = self.look;
        match ground {
            Ground::Bare => None,
            Ground::Building => Some((look.building(), look.dim())),
            Ground::Zone => Some((look.zone(), look.bad())),
            Ground::Cell(id) => Some(match cells.get(usize::from(id))? {
                Cell::Open => ('.', look.dim()),
                Cell::Planned(by) => (look.planned(*by), self.faded(*by)),
                Cell::Covered(by) => (look.covered(), self.faded(*by)),
                Cell::Orphaned(_) => (look.orphan(), look.bad()),
            }),
        }
    }

    /// The look of a peer: dim where another one is selected.
    fn faded(&self, id: u16) -> Style {
        let style = self.look.of_peer(id);
        if self.selected.is_some_and(|s| s != id) {
            style.add_modifier(Modifier::DIM)
        } else {
            style
        }
    }

    fn draw_links(&self, buffer: &mut Buffer, area: Rect, standing: &Standing, view: View) {
        let Some(frame) = &standing.frame else { return };
        let ground = standing.scene.as_ref().and_then(|s| s.ground.as_ref());
        let place = |id: u16| -> Option<Point> {
            let uav = frame.uavs.iter().find(|u| u.id == id);
            let flying = uav.and_then(|u| u.pose).map(|p| p.place.point());
            flying.or_else(|| ground.filter(|g| g.id == id).map(|g| g.place.point()))
        };
        for [a, b] in &frame.links {
            let own = self.selected == Some(*a) || self.selected == Some(*b);
            if let (true, Some(from), Some(to)) = (self.links || own, place(*a), place(*b)) {
                let style = if own { Style::new() } else { self.look.dim() };
                stroke(buffer, area, view, (from, to), self.look.link(), style);
            }
        }
    }

    fn uav(
        &self,
        buffer: &mut Buffer,
        area: Rect,
        standing: &Standing,
        uav: &UavState,
        view: View,
    ) {
        let last = || standing.trails.get(&uav.id)?.back().copied();
        let place = uav.pose.map(|p| p.place.point()).or_else(last);
        let Some(at) = place.and_then(|p| view.at(p, area)) else {
            return;
        };
        let mut style = self.look.of_peer(uav.id).add_modifier(Modifier::BOLD);
        // Without colours a number would be lost among those of planned cells.
        if self.selected == Some(uav.id) || !self.look.colour {
            style = style.add_modifier(Modifier::REVERSED);
        }
        let heading = uav.pose.map_or(0.0, |p| p.heading_deg);
        if uav.state.is_alive() {
            put(buffer, at, self.look.heading(heading), style);
        } else {
            style = self.look.bad();
            put(buffer, at, 'x', style);
        }
        let right = usize::from(area.right().saturating_sub(at.x + 1));
        buffer.set_stringn(at.x + 1, at.y, uav.id.to_string(), right, style);
    }

    fn roster(&self, buffer: &mut Buffer, at: Rect, standing: &Standing) {
        let width = usize::from(at.width);
        if at.is_empty() {
            return;
        }
        let head = match self.knowledge {
            Knowledge::World => "UAV  state     fuel left near took",
            Knowledge::Swarm => "UAV  it said   fuel left near took",
        };
        buffer.set_stringn(at.x, at.y, head, width, self.look.dim());
        let rows = usize::from(at.height.saturating_sub(1));
        let uavs = standing.uavs();
        let selected = uavs.iter().position(|u| Some(u.id) == self.selected);
        let most = uavs.len().saturating_sub(rows);
        let first = selected.map_or(0, |s| s.saturating_sub(rows / 2).min(most));
        for (row, uav) in uavs.iter().skip(first).take(rows).enumerate() {
            let y = at.y + 1 + u16::try_from(row).unwrap_or(u16::MAX - at.y - 1);
            let mut style = if uav.state.is_alive() {
                self.look.of_peer(uav.id)
            } else {
                self.look.dim()
            };
            if self.selected == Some(uav.id) {
                style = style.add_modifier(Modifier::REVERSED);
            }
            buffer.set_stringn(at.x, y, line(standing, uav), width, style);
        }
    }

    fn events(&self, buffer: &mut Buffer, at: Rect, standing: &Standing) {
        let about =
            |e: &&Event| self.selected.is_none() || e.uav.is_none() || e.uav == self.selected;
        let rows = usize::from(at.height);
        let mut shown: Vec<&Event> = standing
            .events
            .iter()
            .rev()
            .filter(about)
            .take(rows)
            .collect();
        shown.reverse();
        for (row, event) in (at.y..at.bottom()).zip(shown) {
            let who = match event.origin {
                Origin::World => "world",
                Origin::Peer => "swarm",
                Origin::Run => "",
            };
            let style = if is_bad(event) {
                self.look.bad()
            } else {
                Style::new()
            };
            let line = Line::from(vec![
                Span::styled(
                    format!("{:7.1} {who:5} ", event.time_ms as f64 / 1000.0),
                    self.look.dim(),
                ),
                Span::styled(event.text.as_str(), style),
            ]);
            buffer.set_line(at.x, row, &line, at.width);
        }
    }
}

/// First line, map, roster, events, last line; none where that has no room.
fn parts(all: Rect) -> Option<[Rect; 5]> {
    if all.width < 20 || all.height < EVENT_LINES + 6 {
        return None;
    }
    let middle = all.height - EVENT_LINES - 2;
    let roster = if all.width >= LEAST_WIDTH {
        ROSTER_WIDTH
    } else {
        0
    };
    let map = Rect::new(
        all.x,
        all.y + 1,
        all.width - roster - u16::from(roster > 0),
        middle,
    );
    Some([
        Rect { height: 1, ..all },
        map,
        Rect::new(all.right() - roster, all.y + 1, roster, middle),
        Rect::new(all.x, map.bottom(), all.width, EVENT_LINES),
        Rect::new(all.x, all.bottom() - 1, all.width, 1),
    ])
}

/// A UAV in the roster.
fn line(standing: &Standing, uav: &UavState) -> String {
    let state = match uav.state {
        State::ComputerDead => "no comp.",
        State::Finished => "returns",
        state => state.word(),
    };
    let fuel = uav
        .fuel_left_s
        .map_or_else(String::new, |s| format!("{s:.0}"));
    let least = standing.nearest_m.get(&uav.id);
    let near = least.map_or_else(String::new, |m| format!("{m:.0}"));
    let took = standing.took.get(&uav.id).into_iter().flatten();
    let mut took: Vec<String> = took.map(|(from, n)| format!("{n} of {from}")).collect();
    if !uav.held_down_by.is_empty() && uav.state.is_alive() {
        took.insert(0, "held down!".to_owned());
    }
    let part = part_of(standing, uav.id).map_or(' ', |c| c);
    format!(
        "{:>3}{part} {state:8} {fuel:>5} {:>4} {near:>4} {}",
        uav.id,
        uav.cells_left,
        took.join(", ")
    )
}

/// Which part of a divided swarm a peer is in: A is the first.
fn part_of(standing: &Standing, id: u16) -> Option<char> {
    let parts = &standing.frame.as_ref()?.components;
    if parts.len() < 2 {
        return None;
    }
    let nth = parts.iter().position(|p| p.contains(&id))?;
    Some(char::from(b'a' + u8::try_from(nth.min(25)).unwrap_or(25)))
}

fn is_bad(event: &Event) -> bool {
    let kind = event.what.kind();
    ["fault", "ended", "lost", "zone_entry", "violation", "alarm"].contains(&kind)
}

fn put(buffer: &mut Buffer, at: Position, c: char, style: Style) {
    if let Some(cell) = buffer.cell_mut(at) {
        cell.set_char(c).set_style(style);
    }
}

/// A line of characters between two places, where nothing but ground stands.
fn stroke(
    buffer: &mut Buffer,
    area: Rect,
    view: View,
    ends: (Point, Point),
    c: char,
    style: Style,
) {
    let (from, to) = (view.place(ends.0, area), view.place(ends.1, area));
    let steps = (to.0 - from.0).abs().max((to.1 - from.1).abs());
    if !(steps.is_finite() && steps < 1e4) {
        return;
    }
    let mut share = 0.0;
    while share < 1.0 {
        let p = ends.0 + (ends.1 - ends.0) * share;
        if let Some(at) = view.at(p, area) {
            put(buffer, at, c, style);
        }
        share += 1.0 / steps.max(1.0);
    }
}

#[cfg(test)]
pub(crate) mod tests;
