//! The page of a batch of runs: how its figures are distributed, and which seeds to look at.

use crate::chart::Chart;
use crate::page::{Page, escaped, s_of};
use skein_netsim::summary::{SeedFigures, Spread, Summary};
use std::fmt::Write as _;

/// Bars of a distribution.
const BARS: usize = 24;

/// Seeds that each list names.
const NAMED: usize = 10;

pub(crate) fn page(summary: &Summary) -> String {
    let title = format!("{}: {} runs", summary.scenario, summary.runs);
    let mut page = Page::new(&title);
    let well = summary.failed_seeds.is_empty() && summary.violations.is_empty();
    let (class, word) = if well {
        ("passed", "PASSED")
    } else {
        ("failed", "FAILED")
    };
    page.raw(&format!(
        "<h1><span class=\"{class}\">{word}</span> {}</h1>",
        escaped(&title)
    ));
    page.note(&format!("history hash {}", summary.history_hash));
    figures(&mut page, summary);
    let seeds = &summary.seeds;
    let each = |of: fn(&SeedFigures) -> Option<f64>| seeds.iter().filter_map(of).collect();
    for (name, unit, values) in [
        (
            "Makespan over the omniscient baseline",
            "times",
            each(|r| r.makespan_over_baseline),
        ),
        (
            "Makespan over the work bound",
            "times",
            each(|r| r.makespan_over_work_bound),
        ),
        (
            "From a death to its detection by each live peer",
            "seconds",
            seeds
                .iter()
                .flat_map(|r| r.detect_s.iter().copied())
                .collect(),
        ),
        (
            "From a detection to the last cell taken over",
            "seconds",
            seeds
                .iter()
                .flat_map(|r| r.takeover_s.iter().copied())
                .collect(),
        ),
    ] {
        distribution(&mut page, (name, unit), values);
    }
    worst(&mut page, summary);
    page.end()
}

fn figures(page: &mut Page, s: &Summary) {
    page.heading("Figures");
    let spread = |name: &str, v: &Spread| {
        let two = |x: f64| format!("{x:.2}");
        vec![
            name.to_owned(),
            two(v.p50),
            two(v.p95),
            two(v.max),
            v.n.to_string(),
        ]
    };
    page.table(
        &["", "half at most", "95 of 100", "most", "of"],
        &[
            spread("makespan over baseline", &s.makespan_ratio),
            spread("makespan over work bound", &s.makespan_over_work_bound),
            spread("detection, s", &s.detect_s),
            spread("takeover, s", &s.takeover_s),
            spread("idle share", &s.idle_share),
        ],
    );
    let dead: Vec<String> = s
        .dead
        .iter()
        .map(|(n, runs)| format!("{n} in {runs} runs"))
        .collect();
    let broken = s
        .violations
        .iter()
        .map(|(rule, n)| format!("{rule} {n} times"));
    let broken: Vec<String> = broken.collect();
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    let none = |list: Vec<String>| {
        if list.is_empty() {
            "none".to_owned()
        } else {
            list.join(", ")
        }
    };
    page.table(
        &[],
        &[
            row("runs completed", format!("{} of {}", s.completed, s.runs)),
            row("least coverage", format!("{:.2} %", s.coverage_min * 100.0)),
            row("rules broken", none(broken)),
            row("UAVs killed for good", none(dead)),
            row(
                "false alarms of death a peer-hour",
                format!("{:.4}", s.false_downs_per_peer_hour_at_any_loss),
            ),
            row(
                "bytes a second and peer",
                format!("{:.0}", s.bytes_per_peer_s),
            ),
        ],
    );
}

fn distribution(page: &mut Page, (name, unit): (&str, &str), values: Vec<f64>) {
    page.heading(name);
    if values.is_empty() {
        page.note("No run tells.");
        return;
    }
    let spread = Spread::of(values.clone());
    let top = if spread.max > 0.0 {
        spread.max * 1.02
    } else {
        1.0
    };
    let counts = counted(&values, top);
    let most = counts.iter().copied().max().unwrap_or(1);
    #[allow(clippy::cast_precision_loss, reason = "counts of runs")]
    let number = |n: usize| n as f64;
    let mut chart = Chart::new(200.0, top, number(most), name);
    chart.y_axis("", 4.0);
    chart.x_axis(unit);
    let width = top / number(BARS);
    let mut bars = String::new();
    for (i, n) in counts.iter().enumerate().filter(|(_, n)| **n > 0) {
        let (from, to) = (chart.x(number(i) * width), chart.x(number(i + 1) * width));
        let (high, low) = (chart.y(number(*n)), chart.y(0.0));
        let _ = write!(
            bars,
            "<rect fill=\"#0072b2\" fill-opacity=\"0.75\" x=\"{:.1}\" y=\"{high:.1}\" width=\"{:.1}\" height=\"{:.1}\"/>",
            from + 1.0,
            (to - from - 2.0).max(1.0),
            low - high
        );
    }
    chart.raw(&bars);
    chart.upright(spread.p50, "bound", "p50");
    chart.upright(spread.p95, "bound", "p95");
    page.plot(
        &chart.end(),
        &format!(
            "p50 {:.2}, p95 {:.2}, most {:.2}, of {}",
            spread.p50, spread.p95, spread.max, spread.n
        ),
    );
}

/// How many values each bar holds, the bars being even from 0 to `top`.
fn counted(values: &[f64], top: f64) -> [usize; BARS] {
    let mut counts = [0; BARS];
    for value in values {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss,
            reason = "casts from floats saturate, and bars are few"
        )]
        let bar = (value / top * BARS as f64) as usize;
        counts[bar.min(BARS - 1)] += 1;
    }
    counts
}

/// The seeds to look at: those that failed, then the slowest, then the longest takeovers.
fn worst(page: &mut Page, s: &Summary) {
    let largest = |values: &[f64]| values.iter().copied().max_by(f64::total_cmp);
    let by = |of: &dyn Fn(&SeedFigures) -> Option<f64>| {
        let mut all: Vec<(&SeedFigures, f64)> =
            s.seeds.iter().filter_map(|r| Some((r, of(r)?))).collect();
        all.sort_by(|a, b| b.1.total_cmp(&a.1));
        all.truncate(NAMED);
        all
    };
    let failed = s.seeds.iter().filter(|r| !r.passed).take(NAMED);
    let failed: Vec<(&SeedFigures, f64)> = failed.map(|r| (r, r.covered_share * 100.0)).collect();
    for (title, unit, list) in [
        ("Seeds that failed", "% covered", failed),
        (
            "Slowest seeds",
            "times the work bound",
            by(&|r| r.makespan_over_work_bound),
        ),
        ("Longest takeovers", "s", by(&|r| largest(&r.takeover_s))),
        ("Latest detections", "s", by(&|r| largest(&r.detect_s))),
    ] {
        if list.is_empty() {
            continue;
        }
        page.heading(title);
        let row = |(r, value): &(&SeedFigures, f64)| {
            vec![
                r.seed.to_string(),
                format!("{value:.2} {unit}"),
                s_of(r.makespan_ms),
                r.dead.to_string(),
                format!("{} {}", s.replay, r.seed),
            ]
        };
        let rows: Vec<Vec<String>> = list.iter().map(row).collect();
        page.table(&["seed", "", "makespan", "killed", "flown again by"], &rows);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_netsim::Prepared;
    use skein_netsim::runs::{self, Wanted};
    use skein_netsim::summary::summarise;
    use skein_netsim::world::fixture::square;

    #[test]
    fn a_batch_reads_back_from_its_json_and_names_its_worst_seeds() {
        let prepared = Prepared::new(square(3));
        let free_ms = runs::failure_free_makespan_ms(&prepared);
        let wanted = Wanted::default();
        let outcomes = (5..9).map(|seed| runs::storm(&prepared, seed, free_ms, wanted));
        let mut summary = summarise(outcomes.collect(), 1.0);
        summary.replay = "skein sim square --storm --seed".to_owned();
        let json = serde_json::to_string(&summary).unwrap();
        let html = crate::batch(&json).unwrap();
        let slowest = summary.seeds.iter().max_by(|a, b| {
            let of = |r: &SeedFigures| r.makespan_over_work_bound.unwrap_or(0.0);
            of(a).total_cmp(&of(b))
        });
        let command = format!("skein sim square --storm --seed {}", slowest.unwrap().seed);
        assert!(html.contains(&command), "{html}");
        assert!(!html.contains("NaN"));
        let why = crate::batch("{}").unwrap_err();
        assert!(why.contains("expected what `skein sim --seeds"), "{why}");
    }

    #[test]
    fn every_value_is_in_one_bar() {
        let values = [0.0, 0.5, 1.0, 1.0, 7.0, f64::NAN];
        let counts = counted(&values, 7.0);
        assert_eq!(counts.iter().sum::<usize>(), values.len());
        assert_eq!(counts[BARS - 1], 1);
    }

    #[test]
    fn no_runs_have_a_page() {
        let html = page(&Summary::default());
        assert!(html.contains("No run tells."));
    }
}
