//! The kept events of a run as a timeline for a person.

use crate::account::secs;
use crate::history::{Entry, What};
use skein_peer::Report;
use skein_peer::output::Status;
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// The main events, one a line; what many peers report is told when the first one does.
#[must_use]
pub fn timeline(entries: &[Entry]) -> String {
    let mut out = String::new();
    let mut told = BTreeSet::new();
    for e in entries {
        let Some(line) = line(&e.what, &mut told) else {
            continue;
        };
        let _ = writeln!(out, "{:8.1} s  {line}", secs(e.time_ms));
    }
    out
}

fn line(what: &What, told: &mut BTreeSet<String>) -> Option<String> {
    Some(match what {
        What::Fault(f) => format!("! {f}"),
        What::Components(parts) => {
            let parts: Vec<String> = parts.iter().map(|p| format!("{p:?}")).collect();
            format!("radio components {}", parts.join(" "))
        }
        What::Covered => "every coverable cell is covered".to_owned(),
        What::ZoneEntry { peer, zone } => format!("peer {peer} flies into no-fly zone {zone}"),
        What::Lost { peer } => format!("the airframe of peer {peer} is lost"),
        What::TookOff { peer } => format!("peer {peer} takes off"),
        // It follows each loss of a computer, and says no more.
        What::Failsafe { .. } => return None,
        What::Violation { check, peer, text } => format!("VIOLATION {check}{}: {text}", by(*peer)),
        What::Report { peer, report } => return reported(*peer, report, told),
    })
}

fn reported(peer: u16, report: &Report, told: &mut BTreeSet<String>) -> Option<String> {
    let line = match report {
        Report::Booted { incarnation } => {
            return Some(format!("peer {peer} runs, life {incarnation}"));
        }
        Report::Ready { cells, .. } => {
            return told
                .insert("ready".to_owned())
                .then(|| format!("peer {peer} has derived a loop of {cells} cells"));
        }
        Report::Membership {
            peer: of,
            incarnation,
            status,
        } if *status != Status::Alive => {
            let status = if *status == Status::Down {
                "down"
            } else {
                "suspect"
            };
            format!(
                "peer {peer} holds peer {} (life {incarnation}) for {status}",
                of.0
            )
        }
        Report::Round {
            counter, members, ..
        } => {
            let members: Vec<String> = members.iter().map(|m| m.0.to_string()).collect();
            let line = format!("round {counter} among {}", members.join(", "));
            return told.insert(line.clone()).then_some(line);
        }
        Report::Claim {
            counter,
            take,
            legs,
            held,
            eta_ms,
            ..
        } => {
            let cells: u32 = legs.iter().map(|l| u32::from(l.count)).sum();
            let key = format!("claim {peer} {counter} {take}");
            return told.insert(key).then(|| {
                let held = if held.is_empty() {
                    String::new()
                } else {
                    format!(", holds {} more", held.len())
                };
                let how = if *take > 0 {
                    " (taken without a round)"
                } else {
                    ""
                };
                format!(
                    "peer {peer} will fly {cells} cells of round {counter}{how}, {} s{held}",
                    eta_ms / 1000
                )
            });
        }
        Report::Task { name, news, .. } => format!("peer {peer}, task {name}: {news:?}"),
        Report::Detected { id, told: of } => {
            let line = of.sentence(id.author);
            return told.insert(line.clone()).then_some(line);
        }
        Report::Crowd { told: of } => {
            let line = of.sentence();
            return told.insert(line.clone()).then_some(line);
        }
        Report::Traced { length_m, .. } => {
            format!("peer {peer} knows {length_m} m of a contour")
        }
        Report::Silenced => format!("peer {peer} is silent: another process speaks under its id"),
        Report::Finished { .. } => format!("peer {peer} knows that the mission is finished"),
        Report::Alarm { text } => format!("peer {peer} alarm: {text}"),
        Report::Refused { reason } => format!("peer {peer} refused bytes: {reason}"),
        Report::Revised { mission } => {
            format!("peer {peer} was given revision {}", mission.revision)
        }
        Report::Found { mission } => {
            format!(
                "peer {peer} {}",
                skein_peer::found_obstacles::sentence(mission)
            )
        }
        Report::Membership { .. } | Report::Covered { .. } => return None,
    };
    Some(line)
}

fn by(peer: Option<u16>) -> String {
    peer.map_or_else(String::new, |p| format!(", peer {p}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fault::Fault;

    #[test]
    fn what_all_peers_report_is_told_once() {
        let ready = |time_ms: u64, peer: u16| Entry {
            time_ms,
            what: What::Report {
                peer,
                report: Report::Ready {
                    revision: 1,
                    loop_hash: 7,
                    cells: 20,
                },
            },
        };
        let kill = Entry {
            time_ms: 40_000,
            what: What::Fault(Fault::Kill { peer: 3 }),
        };
        let text = timeline(&[ready(1_000, 2), ready(1_100, 1), kill]);
        assert_eq!(
            text,
            "     1.0 s  peer 2 has derived a loop of 20 cells\n    40.0 s  ! peer 3 is killed\n"
        );
    }
}
