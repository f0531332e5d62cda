//! How much each station heard of each other one.

use crate::chart::WIDTH;
use crate::page::escaped;
use skein_netsim::account::RunReport;
use skein_netsim::account::text::name;
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// Stations that a matrix shows; of more only the busiest links are listed.
const MOST_STATIONS: usize = 64;
/// Up to so many have room for their numbers.
const MOST_NUMBERED: usize = 16;
/// Links that are listed where there are too many stations for a matrix.
const LISTED: usize = 20;

/// A link: who transmitted, who received, bytes of records.
type Link = (u16, u16, u64);

/// The matrix of a run, or the rows of its busiest links; nothing where no link is known.
pub(crate) enum Links {
    Matrix(String),
    Busiest(Vec<Vec<String>>),
}

/// Of what a report counted.
pub(crate) fn links(report: &RunReport) -> Option<Links> {
    let by_link = report.radio.bytes_by_link.iter();
    let mut all: Vec<Link> = by_link
        .flat_map(|(from, tos)| tos.iter().map(|(to, bytes)| (*from, *to, *bytes)))
        .collect();
    let ends = all.iter().flat_map(|(from, to, _)| [*from, *to]);
    let stations: BTreeSet<u16> = ends.collect();
    if all.is_empty() {
        return None;
    }
    let called = |id: u16| name(id, report.uavs.contains(&id));
    if stations.len() <= MOST_STATIONS {
        let stations: Vec<u16> = stations.into_iter().collect();
        let short = |id: u16| match report.uavs.contains(&id) {
            true => called(id),
            false => "ground".to_owned(),
        };
        return Some(Links::Matrix(matrix(&stations, &all, short)));
    }
    all.sort_by_key(|(from, to, bytes)| (std::cmp::Reverse(*bytes), *from, *to));
    let row = |(from, to, bytes): &Link| vec![called(*from), called(*to), bytes.to_string()];
    Some(Links::Busiest(all.iter().take(LISTED).map(row).collect()))
}

/// A row for each transmitter, a column for each receiver, darker where more arrived.
fn matrix(stations: &[u16], links: &[Link], called: impl Fn(u16) -> String) -> String {
    #[allow(clippy::cast_precision_loss, reason = "counts of stations and bytes")]
    let number = |n: u64| n as f64;
    let (left, top) = (90.0, 28.0);
    let side = ((WIDTH - left) / number(stations.len() as u64)).min(56.0);
    let height_of = side.min(28.0);
    let at = |id: u16| number(stations.partition_point(|s| *s < id) as u64);
    let height = top + height_of * number(stations.len() as u64) + 4.0;
    let most = number(links.iter().map(|l| l.2).max().unwrap_or(1).max(1));
    let mut svg = format!(
        "<svg viewBox=\"0 0 {WIDTH} {height:.0}\" font-size=\"12\" role=\"img\" aria-label=\"bytes by link\">"
    );
    // So that names do not lie on each other.
    let each = if height_of < 14.0 { 4 } else { 1 };
    for (n, id) in stations.iter().enumerate().filter(|(n, _)| n % each == 0) {
        let (name, n) = (escaped(&called(*id)), number(n as u64));
        let (x, y) = (left + side * (n + 0.5), top + height_of * (n + 0.7));
        let label = if side < 40.0 {
            id.to_string()
        } else {
            name.clone()
        };
        let _ = write!(
            svg,
            "<text class=\"ink\" x=\"{x:.1}\" y=\"18\" text-anchor=\"middle\">{label}</text><text class=\"ink\" x=\"{:.1}\" y=\"{y:.1}\" text-anchor=\"end\">{name}</text>",
            left - 6.0
        );
    }
    for (from, to, bytes) in links {
        let (x, y) = (left + side * at(*to), top + height_of * at(*from));
        let share = number(*bytes) / most;
        let _ = write!(
            svg,
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"#3b78c2\" fill-opacity=\"{:.2}\"><title>{} to {}: {bytes} bytes</title></rect>",
            side - 1.0,
            height_of - 1.0,
            0.08 + 0.72 * share,
            escaped(&called(*from)),
            escaped(&called(*to)),
        );
        if stations.len() <= MOST_NUMBERED {
            let (x, y) = (x + side / 2.0, y + height_of * 0.68);
            let _ = write!(
                svg,
                "<text class=\"ink\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\">{:.0}</text>",
                number(*bytes) / 1000.0
            );
        }
    }
    svg.push_str("</svg>");
    svg
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_for_each_link_and_beyond_many_stations_a_list() {
        let called = |id: u16| format!("<{id}>");
        let drawn = matrix(&[0, 3, 7], &[(0, 7, 1000), (7, 3, 500)], called);
        assert_eq!(drawn.matches("<rect").count(), 2);
        assert!(
            drawn.contains("&lt;7&gt; to &lt;3&gt;: 500 bytes"),
            "{drawn}"
        );
        assert!(!drawn.contains("<3>"), "{drawn}");
        // The busiest is drawn darkest.
        assert!(drawn.contains("fill-opacity=\"0.80\"") && drawn.contains("fill-opacity=\"0.44\""));
    }
}
