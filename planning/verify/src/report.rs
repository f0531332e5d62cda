//! What a recount tells: as text for a person, and as JSON.

use crate::recount::{MOST_TOLD, Report, Spot};
use core::fmt::Write as _;
use serde_json::{Value, json};

/// Lines of text that name violations or notices, each.
const MOST_LINES: usize = 100;

fn beside(value: Option<f64>, claimed: Option<f64>, unit: &str, digits: usize) -> String {
    let value = value.map_or("unknown".to_owned(), |v| format!("{v:.digits$}{unit}"));
    match claimed {
        Some(claimed) => format!("{value} (the plan says {claimed:.digits$}{unit})"),
        None => value,
    }
}

fn asked(value: Option<f64>, asked: Option<f64>) -> String {
    let value = value.map_or("none".to_owned(), |v| format!("{v:.3} m"));
    match asked {
        Some(asked) => format!("{value} (asked for {asked} m)"),
        None => value,
    }
}

/// The report as text: a line for each violation, then what was recounted beside what the
/// plan says.
#[must_use]
pub fn text(report: &Report) -> String {
    let mut out = String::new();
    for v in report.violations.iter().take(MOST_LINES) {
        let who = v.flight.as_deref().unwrap_or("all");
        let _ = writeln!(out, "{who}: {}", v.text);
    }
    if report.broken > MOST_LINES {
        let _ = writeln!(out, "and {} more", report.broken - MOST_LINES);
    }
    let _ = match report.broken {
        0 => writeln!(out, "HOLDS"),
        n => writeln!(out, "VIOLATED  {n} violation(s)"),
    };
    for f in report.flights.iter().take(MOST_TOLD) {
        if f.pieces == 0 {
            let _ = writeln!(out, "  {}: stays", f.name);
            continue;
        }
        let (length_m, time_s) = f.claimed;
        let _ = writeln!(out, "  {}: {} pieces", f.name, f.pieces);
        let lines = [
            ("length", beside(Some(f.length_m), length_m, " m", 1)),
            ("time", beside(f.time_s, time_s, " s", 1)),
            ("camera on", beside(Some(f.seeing_m), None, " m", 1)),
            ("from zones", asked(f.to_zone, Some(report.clearance_m))),
            (
                "in fences",
                asked(f.inside_fences, Some(report.fence_clearance_m)),
            ),
            ("tightest", asked(f.tightest_m, f.asked_radius_m)),
        ];
        for (what, text) in lines {
            let _ = writeln!(out, "    {what:<11} {text}");
        }
    }
    let (makespan_s, total_m, share) = report.claimed;
    let percent = |share: Option<f64>| share.map(|s| 100.0 * s);
    let lines = [
        ("makespan", beside(report.makespan_s, makespan_s, " s", 1)),
        ("length", beside(Some(report.total_m), total_m, " m", 1)),
        ("area", beside(report.area_m2, None, " m²", 0)),
        (
            "seen",
            beside(percent(report.covered_share), percent(share), " %", 2),
        ),
    ];
    let _ = writeln!(out, "  all");
    for (what, text) in lines {
        let _ = writeln!(out, "    {what:<11} {text}");
    }
    for notice in report.notices.iter().take(MOST_LINES) {
        let _ = writeln!(out, "note: {notice}");
    }
    out
}

fn spot(spot: &Spot) -> Value {
    json!({
        "along_m": spot.along_m, "time_s": spot.time_s,
        "lat_deg": spot.at.lat_deg, "lon_deg": spot.at.lon_deg,
    })
}

/// The report as one JSON object.
#[must_use]
pub fn json(report: &Report) -> Value {
    let violations = report.violations.iter().map(|v| {
        json!({
            "flight": v.flight, "rule": v.rule.name(), "at": v.spot.as_ref().map(spot),
            "found": v.found, "asked": v.asked, "text": v.text,
        })
    });
    let flights = report.flights.iter().map(|f| {
        json!({
            "name": f.name, "pieces": f.pieces, "length_m": f.length_m, "time_s": f.time_s,
            "camera_m": f.seeing_m, "zone_distance_m": f.to_zone,
            "fence_distance_m": f.inside_fences, "least_radius_m": f.tightest_m,
            "turn_radius_m": f.asked_radius_m,
            "claimed": {"length_m": f.claimed.0, "time_s": f.claimed.1},
        })
    });
    json!({
        "holds": report.holds(),
        "n_violations": report.broken,
        "violations": violations.collect::<Vec<_>>(),
        "flights": flights.collect::<Vec<_>>(),
        "clearance_m": report.clearance_m,
        "fence_clearance_m": report.fence_clearance_m,
        "makespan_s": report.makespan_s,
        "total_m": report.total_m,
        "area_m2": report.area_m2,
        "covered_share": report.covered_share,
        "claimed": {
            "makespan_s": report.claimed.0, "total_m": report.claimed.1,
            "covered_share": report.claimed.2,
        },
        "notices": report.notices,
    })
}
