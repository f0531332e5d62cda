//! Coverage, sections and radio over time.

use crate::chart::{Chart, LEFT, WIDTH};
use skein_netsim::account::{RunReport, secs};
use skein_recording::foxglove::colour;
use skein_recording::model::event::What;
use skein_recording::model::frame::{State, UavState};
use skein_recording::model::{Event, FailureFree, Frame, Scene};
use skein_recording::sink::Collected;
use std::fmt::Write as _;

/// What all plots of a run are drawn from.
pub(crate) struct Run<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) frames: &'a [Frame],
    pub(crate) events: &'a [Event],
    pub(crate) failure_free: Option<&'a FailureFree>,
    pub(crate) report: Option<&'a RunReport>,
}

impl<'a> Run<'a> {
    /// Of what was collected; `empty` stands for the scene where there is none.
    pub(crate) fn of(run: &'a Collected, empty: &'a Scene) -> Self {
        Self {
            scene: run.scenes.last().unwrap_or(empty),
            frames: &run.frames,
            events: &run.events,
            failure_free: run.failure_free.as_ref(),
            report: run.end.as_ref().map(|e| &*e.report),
        }
    }

    /// When it ended, as far as is known, seconds.
    pub(crate) fn end_s(&self) -> f64 {
        let last = self.frames.last().map_or(0, |f| f.time_ms);
        secs(self.report.map_or(last, |r| r.end_ms.max(last)))
    }

    /// When a UAV or its computer was no more, seconds.
    fn ends(&self) -> impl Iterator<Item = (f64, u16)> + '_ {
        let ended = |e: &Event| matches!(e.what, What::Ended { .. });
        let ends = self.events.iter().filter(move |e| ended(e));
        ends.filter_map(|e| Some((secs(e.time_ms), e.uav?)))
    }
}

/// The share that was covered, against the work bound and the baseline.
pub(crate) fn coverage(run: &Run<'_>) -> String {
    let bound_s = run.scene.bounds.work_bound_ms.map(secs);
    let free_s = run.failure_free.map_or(0.0, |f| secs(f.end_ms));
    let x_max = run.end_s().max(bound_s.unwrap_or(0.0)).max(free_s);
    let mut chart = Chart::new(320.0, x_max, 100.0, "coverage over time");
    chart.y_axis(" %", 5.0);
    chart.x_axis("seconds");
    // Of several laps each begins at nothing.
    if let Some(bound_s) = bound_s.filter(|_| run.scene.lap == 0) {
        let path = chart.line(&[(0.0, 0.0), (bound_s, 100.0)]);
        chart.raw(&format!("<path class=\"bound\" d=\"{path}\"/>"));
    }
    if let Some(baseline_ms) = run.report.and_then(|r| r.baseline_ms) {
        chart.upright(secs(baseline_ms), "bound", "");
    }
    for (at_s, uav) in run.ends() {
        chart.upright(at_s, "grid", &format!("×{uav}"));
    }
    if let Some(free) = run.failure_free {
        let points = free.coverage.iter();
        let points: Vec<(f64, f64)> = points.map(|(t, s)| (secs(*t), s * 100.0)).collect();
        let path = chart.line(&points);
        chart.raw(&format!("<path class=\"bound free\" d=\"{path}\"/>"));
    }
    let points: Vec<(f64, f64)> = (run.frames.iter())
        .map(|f| (secs(f.time_ms), f.covered_share * 100.0))
        .collect();
    let path = chart.line(&points);
    chart.raw(&format!(
        "<path class=\"mark\" stroke-width=\"2.5\" d=\"{path}\"/>"
    ));
    chart.end()
}

/// Height of the row of one UAV.
const ROW: f64 = 42.0;

/// The open cells of each UAV's section over time, with takeovers, deaths and restarts.
pub(crate) fn sections(run: &Run<'_>) -> String {
    let n = run.scene.uavs.len();
    #[allow(clippy::cast_precision_loss, reason = "at most some hundred UAVs")]
    let height = ROW * n as f64 + 60.0;
    let mut chart = Chart::new(height, run.end_s(), 1.0, "sections over time");
    chart.x_axis("seconds");
    let each = run.frames.iter().flat_map(|f| &f.uavs);
    let most = each.map(|u| u.cells_left).max().unwrap_or(0).max(1);
    let mut rows = String::new();
    for (i, uav) in run.scene.uavs.iter().enumerate() {
        #[allow(clippy::cast_precision_loss, reason = "at most some hundred UAVs")]
        let floor = 14.0 + ROW * (i as f64 + 1.0);
        let to = WIDTH - 16.0;
        let _ = write!(
            rows,
            "<path class=\"grid\" d=\"M{LEFT:.1} {floor:.1}H{to:.1}\"/>"
        );
        chart.text(
            (LEFT - 8.0, floor - 6.0),
            "end",
            "ink",
            uav.name.trim_start_matches("uav"),
        );
        let fill = colour(run.scene, uav.id);
        row(&mut rows, &chart, run, (uav.id, floor, most, fill));
    }
    chart.raw(&rows);
    marks(&mut chart, run);
    chart.end()
}

/// Takeovers of one UAV that follow each other within this share of the run are told together:
/// their words would lie upon each other.
const TOGETHER: f64 = 0.09;

/// Ends, new lives and takeovers.
fn marks(chart: &mut Chart, run: &Run<'_>) {
    for (i, uav) in run.scene.uavs.iter().enumerate() {
        #[allow(clippy::cast_precision_loss, reason = "at most some hundred UAVs")]
        let middle = 14.0 + ROW * (i as f64 + 0.5);
        let mut taken: Vec<(f64, usize, Vec<u16>)> = Vec::new();
        for event in run.events.iter().filter(|e| e.uav == Some(uav.id)) {
            let at_s = secs(event.time_ms);
            let at = (chart.x(at_s), middle + 5.0);
            match &event.what {
                What::Ended { .. } => chart.text(at, "middle", "ink", "×"),
                What::Booted { incarnation } if *incarnation > 1 => {
                    chart.text(at, "middle", "ink", "↺");
                }
                What::Takeover { from, cells, .. } => {
                    let near =
                        |t: &&mut (f64, usize, Vec<u16>)| at_s - t.0 < TOGETHER * run.end_s();
                    match taken.last_mut().filter(near) {
                        Some((_, n, of)) => {
                            *n += cells.len();
                            of.push(*from);
                            of.dedup();
                        }
                        None => taken.push((at_s, cells.len(), vec![*from])),
                    }
                }
                _ => {}
            }
        }
        for (at_s, n, of) in taken {
            let at = (chart.x(at_s), middle + 3.0);
            let anchor = if at.0 > WIDTH * 0.85 { "end" } else { "start" };
            let of: Vec<String> = of.iter().map(u16::to_string).collect();
            chart.text(at, anchor, "ink", &format!("+{n} of {}", of.join(", ")));
        }
    }
}

/// One UAV: how many cells it has left, as a height; a thin line while it flies without any.
fn row(
    out: &mut String,
    chart: &Chart,
    run: &Run<'_>,
    (id, floor, most, fill): (u16, f64, usize, &str),
) {
    let height = |uav: &UavState| {
        #[allow(clippy::cast_precision_loss, reason = "counts of cells")]
        let share = uav.cells_left as f64 / most as f64;
        match uav.state {
            State::Lost | State::ComputerDead => 0.0,
            State::Starting | State::Standing => 1.0,
            _ => 2.0 + share * (ROW - 8.0),
        }
    };
    let mut d = String::new();
    let mut last = None;
    let mut x = chart.x(0.0);
    let _ = write!(d, "M{x:.1} {floor:.1}");
    for frame in run.frames {
        let Some(uav) = frame.uavs.iter().find(|u| u.id == id) else {
            continue;
        };
        let now = format!("{:.1}", floor - height(uav));
        x = chart.x(secs(frame.time_ms));
        if last.as_ref() != Some(&now) {
            let _ = write!(d, "H{x:.1}V{now}");
            last = Some(now);
        }
    }
    let _ = write!(
        out,
        "<path fill=\"{fill}\" fill-opacity=\"0.75\" d=\"{d}H{x:.1}V{floor:.1}Z\"/>"
    );
}

/// How many parts the swarm was in, and how many pairs heard each other.
pub(crate) fn radio(run: &Run<'_>) -> String {
    #[allow(clippy::cast_precision_loss, reason = "counts of peers")]
    let count = |n: usize| n as f64;
    let parts = |f: &Frame| count(f.components.len());
    let most = run.frames.iter().map(parts).fold(1.0, f64::max);
    let mut chart = Chart::new(200.0, run.end_s(), most + 0.5, "radio components over time");
    chart.y_axis("", most.min(6.0) + 0.5);
    chart.x_axis("seconds");
    let mut steps: Vec<(f64, f64)> = Vec::new();
    for frame in run.frames {
        let (at_s, n) = (secs(frame.time_ms), parts(frame));
        if let Some((_, before)) = steps.last().copied() {
            steps.push((at_s, before));
        }
        steps.push((at_s, n));
    }
    let path = chart.line(&steps);
    chart.raw(&format!(
        "<path class=\"mark\" stroke-width=\"2\" d=\"{path}\"/>"
    ));
    let links = run.frames.iter().map(|f| count(f.links.len()));
    let most_links = links.clone().fold(1.0, f64::max);
    let scaled: Vec<(f64, f64)> = (run.frames.iter().zip(links))
        .map(|(f, n)| (secs(f.time_ms), n / most_links * most))
        .collect();
    let path = chart.line(&scaled);
    chart.raw(&format!("<path class=\"bound\" d=\"{path}\"/>"));
    chart.end()
}
