//! The page of one run.

use crate::links::{Links, links};
use crate::map;
use crate::page::{Page, escaped, s, s_of};
use crate::plots::{self, Run};
use skein_geometry::frame::Point;
use skein_netsim::account::RunReport;
use skein_netsim::account::report::KillReport;
use skein_netsim::account::text::name;
use skein_netsim::world::flat::{in_ring, point_ring_m};
use skein_recording::export::cells_at_end;
use skein_recording::foxglove::colour;
use skein_recording::model::event::What;
use skein_recording::model::scene::Driver;
use skein_recording::run_dir::Kept;
use std::fmt::Write as _;

/// Events that a page quotes.
const QUOTED: usize = 60;

pub(crate) fn page(kept: &Kept) -> String {
    let collected = &kept.recorded.run;
    let empty = skein_recording::Scene::default();
    let run = Run::of(collected, &empty);
    let scene = run.scene;
    let title = format!("{}, seed {}", scene.scenario, scene.seed);
    let mut page = Page::new(&title);
    verdict(&mut page, kept, &run, &title);
    if let Some(report) = run.report {
        figures(&mut page, report, &run);
        page.heading("What was checked");
        page.table(&[], &checks(report));
        kills(&mut page, report);
    }
    page.heading("Coverage");
    page.plot(
        &plots::coverage(&run),
        "Share of the coverable cells that cameras saw. Dashed: an even pace that ends at the work bound, as if nobody were lost and no way were flown twice; dotted, the same run without failures, where it was flown; upright, the omniscient baseline, where it was computed. ×N: the end of UAV N.",
    );
    page.heading("Sections");
    page.plot(
        &plots::sections(&run),
        "How many open cells each UAV lists, as a height. ×: its end. ↺: a new life. +N of M: it takes over N cells of UAV M.",
    );
    page.heading("Map");
    let drawn = map::draw(&run, &cells_at_end(collected));
    let legend = legend(&run);
    page.raw(&format!(
        "<figure>{drawn}<figcaption class=\"legend\">{legend}<br>Cells in the colour of the UAV that saw them first. ×: an airframe was lost. Red: no-fly zones. Grey: buildings. Triangle: ground station.</figcaption></figure>"
    ));
    page.heading("Radio");
    page.plot(
        &plots::radio(&run),
        "Parts of the swarm that could not reach each other. Dashed: pairs that heard each other, scaled to the height.",
    );
    if let Some(report) = run.report {
        radio(&mut page, report);
    }
    margins(&mut page, &run);
    events(&mut page, &run);
    page.end()
}

fn verdict(page: &mut Page, kept: &Kept, run: &Run<'_>, title: &str) {
    let how = match run.scene.driver {
        Driver::Sim => "simulated",
        Driver::Live => "flown live by one process a peer",
    };
    let (class, word) = match run.report {
        Some(r) if r.passed => ("passed", "PASSED"),
        Some(_) => ("failed", "FAILED"),
        None => ("failed", "CUT OFF"),
    };
    let (title, n) = (escaped(title), run.scene.uavs.len());
    page.raw(&format!(
        "<h1><span class=\"{class}\">{word}</span> {title}</h1><p class=\"soft\">{n} UAVs, {how}</p>"
    ));
    let reasons = run.report.map(|r| &r.reasons).into_iter().flatten();
    let list: String = reasons
        .map(|r| format!("<li>{}</li>", escaped(r)))
        .collect();
    if !list.is_empty() {
        page.raw(&format!("<ul>{list}</ul>"));
    }
    if let Some(why) = &kept.recorded.cut {
        page.note(&format!(
            "The recording is not complete ({why}): what follows is of what there is."
        ));
    }
    if let Some(manifest) = &kept.manifest {
        let command = escaped(&manifest.command);
        page.raw(&format!("<p>Flown again by <code>{command}</code></p>"));
    }
}

/// Cells that cameras saw, and those of them that somebody had seen before.
fn duplicates(run: &Run<'_>) -> (usize, usize) {
    let mut sums = (0, 0);
    for event in run.events {
        if let What::Covered { cells, new } = &event.what {
            sums.0 += cells.len();
            sums.1 += cells.len() - new.len().min(cells.len());
        }
    }
    sums
}

fn figures(page: &mut Page, r: &RunReport, run: &Run<'_>) {
    page.heading("Figures");
    let ratio = |x: Option<f64>| x.map_or_else(|| "–".to_owned(), |x| format!("{x:.2} times"));
    let (seen, twice) = duplicates(run);
    let mut rows = vec![
        vec!["makespan".to_owned(), s_of(r.makespan_ms), String::new()],
        vec![
            "work bound".to_owned(),
            s_of(r.work_bound_ms),
            ratio(r.makespan_over_work_bound),
        ],
        vec![
            "omniscient baseline".to_owned(),
            s_of(r.baseline_ms),
            ratio(r.makespan_over_baseline),
        ],
        vec![
            "coverable cells covered".to_owned(),
            format!(
                "{} of {}",
                r.coverage.covered_cells, r.coverage.coverable_cells
            ),
            format!(
                "{:.1} % of the area can be covered",
                r.coverage.coverable_share * 100.0
            ),
        ],
        vec![
            "cells seen that were seen before".to_owned(),
            format!("{twice} of {seen}"),
            String::new(),
        ],
        vec!["end".to_owned(), s(r.end_ms), String::new()],
    ];
    if let Some(ground) = &r.coverage.ground {
        rows.push(vec![
            "open ground in sight, past all buildings".to_owned(),
            format!("{:.1} %", ground.share * 100.0),
            format!("{} of {} samples", ground.seen, ground.samples),
        ]);
    }
    if let Some(live) = &r.live {
        rows.push(vec![
            "time scale reached".to_owned(),
            format!("{:.1}", live.mean_time_scale),
            format!(
                "{:.1} asked for, {:.1} at the lowest",
                live.time_scale, live.lowest_time_scale
            ),
        ]);
    }
    page.table(&[], &rows);
}

/// What was checked, and how it went.
fn checks(r: &RunReport) -> Vec<Vec<String>> {
    let row = |ok: bool, what: &str, how: String| {
        let mark = if ok { "✓" } else { "✗" };
        vec![mark.to_owned(), what.to_owned(), how]
    };
    let c = &r.coverage;
    let missed = c.coverable_cells - c.covered_cells.min(c.coverable_cells);
    let mut rows = vec![
        row(
            missed == 0,
            "every coverable cell was seen",
            format!("{missed} missed"),
        ),
        row(
            r.zone_entries == 0,
            "no-fly zones were not entered",
            format!("{} entries", r.zone_entries),
        ),
        row(
            r.unfinished.is_empty() && !r.finished.is_empty(),
            "every live UAV believes the mission finished",
            format!("{} do, {} do not", r.finished.len(), r.unfinished.len()),
        ),
        row(
            c.is_enough(),
            "enough of the area can be covered",
            format!(
                "{:.1} % of {:.1} % asked for{}",
                c.coverable_share * 100.0,
                c.needed_share * 100.0,
                if c.revised {
                    "; the mission was changed in flight"
                } else {
                    ""
                }
            ),
        ),
    ];
    match &r.violations {
        Some(v) => {
            let told = v.counts.iter().map(|(rule, n)| format!("{rule} {n} times"));
            let told: Vec<String> = told.collect();
            let how = if told.is_empty() {
                "none".to_owned()
            } else {
                told.join(", ")
            };
            rows.push(row(
                v.counts.is_empty(),
                "rules of the protocol (docs/protocol.md §8) that were broken",
                how,
            ));
        }
        None => rows.push(vec![
            "–".to_owned(),
            "rules of the protocol".to_owned(),
            "not checked: nobody looks into live peers".to_owned(),
        ]),
    }
    rows.push(vec![
        "–".to_owned(),
        "separation".to_owned(),
        "recorded; a rule only where the mission says separation_m".to_owned(),
    ]);
    rows
}

fn kills(page: &mut Page, r: &RunReport) {
    if r.kills.is_empty() && r.restarts.is_empty() {
        return;
    }
    page.heading("Losses and takeovers");
    let called = |id: u16| name(id, r.uavs.contains(&id));
    let row = |k: &KillReport| {
        let takers = k.taken_over_by.iter();
        let takers: Vec<String> = takers
            .map(|t| format!("{}: {}", called(t.peer), t.cells))
            .collect();
        vec![
            called(k.peer),
            s(k.at_ms),
            format!("{:?}", k.cause),
            k.cells_held.to_string(),
            k.detected_by.map_or_else(|| "nobody".to_owned(), called),
            s_of(k.detection_ms),
            s_of(k.takeover_ms),
            takers.join(", "),
            k.left.to_string(),
        ]
    };
    let head = [
        "lost",
        "at",
        "how",
        "open cells",
        "noticed by",
        "after",
        "taken over after",
        "by",
        "left",
    ];
    page.table(&head, &r.kills.iter().map(row).collect::<Vec<_>>());
    for restart in &r.restarts {
        page.note(&format!(
            "{} starts again at {} {} its disk; of use after {}",
            called(restart.peer),
            s(restart.at_ms),
            if restart.fresh_disk {
                "without"
            } else {
                "with"
            },
            s_of(restart.productive_ms)
        ));
    }
}

fn legend(run: &Run<'_>) -> String {
    let each = run.scene.uavs.iter().map(|u| {
        let (colour, name) = (colour(run.scene, u.id), escaped(&u.name));
        format!("<span><i style=\"background:{colour}\"></i>{name}</span>")
    });
    each.collect()
}

fn radio(page: &mut Page, r: &RunReport) {
    let mut rows = vec![
        vec![
            "bytes a second and peer".to_owned(),
            format!("{:.0}", r.radio.bytes_per_peer_s),
        ],
        vec!["transmissions".to_owned(), r.radio.sent.to_string()],
        vec!["receptions".to_owned(), r.radio.received.to_string()],
        vec![
            "of those passed on before".to_owned(),
            r.radio.multi_hop.to_string(),
        ],
        vec![
            "split, met again, most parts".to_owned(),
            format!(
                "{}, {}, {}",
                r.swarm.splits, r.swarm.merges, r.swarm.most_components
            ),
        ],
    ];
    let lost = r.radio.lost.iter();
    rows.extend(lost.map(|(reason, n)| vec![format!("lost by {reason}"), n.to_string()]));
    let cuts = r.radio.link_cuts.iter();
    rows.extend(cuts.map(|(reason, n)| vec![format!("links cut by {reason}"), n.to_string()]));
    page.table(&[], &rows);
    match links(r) {
        Some(Links::Matrix(drawn)) => page.plot(
            &drawn,
            "Kilobytes of records that arrived: a row for each transmitter, a column for each receiver. All that a receiver heard counts, also what it had heard before.",
        ),
        Some(Links::Busiest(rows)) => {
            page.note("The links over which most arrived, of all pairs:");
            page.table(&["transmitter", "receiver", "bytes"], &rows);
        }
        None => {}
    }
    let by_kind = r.simulated.as_ref().map(|s| &s.bytes_by_kind);
    if let Some(kinds) = by_kind.filter(|k| !k.is_empty()) {
        let total: u64 = kinds.values().sum::<u64>().max(1);
        let row = |(kind, bytes): (&String, &u64)| {
            #[allow(clippy::cast_precision_loss, reason = "far below 2^52 bytes")]
            let share = *bytes as f64 / total as f64 * 100.0;
            vec![kind.clone(), bytes.to_string(), format!("{share:.1} %")]
        };
        let rows: Vec<Vec<String>> = kinds.iter().map(row).collect();
        page.table(&["kind of record", "bytes", "share"], &rows);
    }
}

/// How near UAVs came to each other and to no-fly zones, at the times of the frames.
fn margins(page: &mut Page, run: &Run<'_>) {
    page.heading("Margins");
    let zones: Vec<(&str, Vec<Point>)> = (run.scene.zones.iter())
        .map(|z| {
            let corners = z.ring.east_north_m.iter().map(|p| Point::new(p[0], p[1]));
            (&*z.name, corners.collect())
        })
        .collect();
    let mut rows = Vec::new();
    for uav in &run.scene.uavs {
        let states = run
            .frames
            .iter()
            .flat_map(|f| f.uavs.iter().filter(|u| u.id == uav.id));
        let near = states.clone().filter_map(|u| u.nearest_other_m);
        let near = near.min_by(f64::total_cmp);
        let poses = states.filter_map(|u| u.pose).map(|p| p.place.point());
        let mut zone: Option<(f64, &str)> = None;
        for at in poses {
            for (name, ring) in zones.iter().filter(|(_, ring)| ring.len() > 2) {
                let m = if in_ring(at, ring) {
                    0.0
                } else {
                    point_ring_m(at, ring)
                };
                if zone.is_none_or(|(least, _)| m < least) {
                    zone = Some((m, name));
                }
            }
        }
        let metres = |m: f64| format!("{m:.1} m");
        rows.push(vec![
            uav.name.clone(),
            near.map_or_else(|| "–".to_owned(), metres),
            zone.map_or_else(|| "–".to_owned(), |(m, _)| metres(m)),
            zone.map_or_else(String::new, |(_, name)| name.to_owned()),
        ]);
    }
    page.table(
        &["", "nearest other UAV", "nearest no-fly zone", "which"],
        &rows,
    );
    let nearest = run.report.and_then(|r| r.nearest_approach_m);
    page.note(&format!(
        "At the times of the frames, twice a second; the judge, who looks all the time, found two UAVs {} from each other at the nearest.",
        nearest.map_or_else(|| "at no distance".to_owned(), |m| format!("{m:.1} m"))
    ));
}

fn events(page: &mut Page, run: &Run<'_>) {
    let telling = |what: &What| {
        !matches!(
            what,
            What::Claim { .. }
                | What::Covered { .. }
                | What::Bids { .. }
                | What::Round { .. }
                | What::Ready { .. }
                | What::Booted { .. }
                | What::Components { .. }
                | What::Membership { .. }
        )
    };
    let told: Vec<_> = run.events.iter().filter(|e| telling(&e.what)).collect();
    page.heading("Events");
    let mut list = String::new();
    for event in told.iter().take(QUOTED) {
        let _ = writeln!(list, "{:>8}  {}", s(event.time_ms), escaped(&event.text));
    }
    page.raw(&format!("<div class=\"scroll\"><pre>{list}</pre></div>"));
    if told.len() > QUOTED {
        page.note(&format!(
            "{} more, and claims, rounds and beliefs: skein export RUN --jsonl",
            told.len() - QUOTED
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_netsim::Prepared;
    use skein_netsim::fault::{Fault, TimedFault};
    use skein_netsim::runs::Wanted;
    use skein_netsim::world::fixture::square;
    use skein_recording::reader::Recorded;
    use skein_recording::run_dir::Manifest;
    use skein_recording::simulated;
    use skein_recording::sink::Collected;

    fn kept(n: u16, cut: bool) -> Kept {
        let mut spec = square(n);
        spec.name = "<script>alert(1)</script>".to_owned();
        if n > 1 {
            spec.faults = vec![TimedFault {
                at_ms: 20_000,
                fault: Fault::Kill { peer: 2 },
            }];
        }
        let mut run = Collected::default();
        let prepared = Prepared::new(spec);
        simulated::fly(&prepared, 3, None, Wanted::default(), &mut run).unwrap();
        if cut {
            run.end = None;
            run.frames.truncate(30);
        }
        Kept {
            path: "run.mcap".into(),
            manifest: Some(Manifest {
                command: "skein sim --seed 3".to_owned(),
                ..Manifest::default()
            }),
            recorded: Recorded {
                run,
                cut: cut.then(|| "it was killed".to_owned()),
            },
        }
    }

    /// No tag is left open or closed twice.
    fn balanced(html: &str) {
        for tag in [
            "table", "tr", "figure", "svg", "div", "pre", "h1", "h2", "p", "ul",
        ] {
            let opened = html.matches(&format!("<{tag}>")).count()
                + html.matches(&format!("<{tag} ")).count();
            assert_eq!(opened, html.matches(&format!("</{tag}>")).count(), "{tag}");
        }
    }

    #[test]
    fn a_page_tells_the_run_and_asks_nothing_of_elsewhere() {
        let kept = kept(3, false);
        let html = page(&kept);
        balanced(&html);
        let report = &kept.recorded.run.end.as_ref().unwrap().report;
        assert!(html.contains("PASSED") && html.contains("skein sim --seed 3"));
        assert!(html.contains(&s_of(report.makespan_ms)));
        assert!(
            html.contains("+") && html.contains(" of 2</text>"),
            "a takeover is drawn"
        );
        for kind in report.simulated.as_ref().unwrap().bytes_by_kind.keys() {
            assert!(html.contains(kind.as_str()));
        }
        for forbidden in ["<script", "http://", "https://", "src=", "@import", "url("] {
            assert!(!html.contains(forbidden), "{forbidden}");
        }
    }

    #[test]
    fn one_uav_and_a_recording_that_was_cut_have_pages_too() {
        let html = page(&kept(1, false));
        balanced(&html);
        assert!(html.contains("PASSED"));
        let html = page(&kept(2, true));
        balanced(&html);
        assert!(html.contains("CUT OFF") && html.contains("it was killed"));
        assert!(!html.contains("NaN") && !html.contains("inf"));
    }
}
