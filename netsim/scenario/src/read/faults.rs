//! Faults of a scenario and of a chaos plan: a time, a kind, and perhaps `for_s`,
//! which adds what ends the fault.

use crate::error::{Finding, ScenarioError, Severity};
use crate::files::read_text;
use skein_interop::json::{Document, Error, Fields, Node, suggestion};
use skein_netsim::fault::{Fault, Order, TimedFault};
use skein_netsim::spec::{StormSpec, TroubleSpec};
use std::collections::BTreeSet;
use std::path::Path;

/// Kinds of faults and the fields that each has besides `at_s` and `kind`.
const KINDS: [(&str, &[&str]); 21] = [
    ("kill", &["peer", "for_s", "fresh_disk"]),
    ("kill-computer", &["peer", "for_s", "fresh_disk"]),
    ("terminate", &["peer", "for_s", "fresh_disk"]),
    ("pause", &["peer", "for_s"]),
    ("resume", &["peer"]),
    ("restart", &["peer", "fresh_disk"]),
    ("cut", &["a", "b", "one_way", "for_s"]),
    ("partition", &["groups", "for_s"]),
    ("heal", &[]),
    ("loss", &["percent", "for_s"]),
    ("rebase", &["east_m", "north_m"]),
    ("order", &["order", "peer"]),
    ("fail-stores", &["peer", "one_in", "for_s"]),
    ("slow-stores", &["peer", "delay_s", "for_s"]),
    ("heal-stores", &["peer"]),
    ("slow-computer", &["peer", "delay_s", "for_s"]),
    ("clock-drift", &["peer", "gain_percent", "for_s"]),
    ("clock-jump", &["peer", "ahead_s"]),
    ("short-fuel", &["peer", "lasts_s"]),
    ("spoilt-record", &["peer"]),
    ("twin", &["peer", "aboard"]),
];

/// Who there is, until when, and what a loss goes back to.
pub(crate) struct Known<'a> {
    /// Numbers of all peers; `None` when unknown (a chaos plan without a scenario).
    pub(crate) peers: Option<&'a BTreeSet<u16>>,
    /// The number of the ground station, where there is one and it is known.
    pub(crate) ground: Option<u16>,
    /// Time at which the run ends, seconds.
    pub(crate) max_time_s: u32,
    /// The loss of the scenario, thousandths.
    pub(crate) loss_permille: u16,
    /// Faults that name unknown peers are left out with a note: the number of
    /// peers is not the file's.
    pub(crate) lenient: bool,
}

impl Known<'_> {
    fn peer(&self, node: &Node<'_>) -> Result<u16, Error> {
        let id = node.small(0, u16::MAX, "a peer's number")?;
        if let Some(peers) = self.peers
            && !peers.contains(&id)
            && !self.lenient
        {
            let all: Vec<String> = peers.iter().map(u16::to_string).collect();
            return Err(node.wrong(format!(
                "no peer has the number {id}; there are {}",
                all.join(", ")
            )));
        }
        Ok(id)
    }

    /// The number of a peer that is no ground station.
    pub(super) fn uav(&self, node: &Node<'_>) -> Result<u16, Error> {
        let id = self.peer(node)?;
        if self.ground == Some(id) {
            return Err(node.wrong(format!("{id} is the ground station; orders are for UAVs")));
        }
        Ok(id)
    }

    fn has(&self, id: u16) -> bool {
        self.peers.is_none_or(|p| p.contains(&id))
    }
}

/// Reads a list of faults; they come back ascending by time.
pub(crate) fn read(
    list: &Node<'_>,
    known: &Known<'_>,
    notes: &mut Vec<Finding>,
) -> Result<Vec<TimedFault>, Error> {
    let mut out = Vec::new();
    // Times at which cuts begin and end, to tell when one heal ends several.
    let mut cuts: Vec<(u64, u64)> = Vec::new();
    for item in list.items()? {
        let (fault, end) = one(&item, known)?;
        if !names_known(&fault.fault, known) {
            let mut note = Finding::new(
                Severity::Note,
                &item.path(),
                "left out: it names a peer that this fleet has not",
            );
            note.place = Some(item.place());
            notes.push(note);
            continue;
        }
        if matches!(fault.fault, Fault::Cut { .. } | Fault::Partition { .. }) {
            let span = (fault.at_ms, end.as_ref().map_or(u64::MAX, |e| e.at_ms));
            if cuts.iter().any(|c| c.0 < span.1 && span.0 < c.1) {
                let text = "overlaps another cut or partition; the first heal ends both";
                let mut note = Finding::new(Severity::Warning, &item.path(), text);
                note.place = Some(item.place());
                notes.push(note);
            }
            cuts.push(span);
        }
        out.push(fault);
        out.extend(end);
    }
    out.sort_by_key(|f| f.at_ms);
    Ok(out)
}

fn names_known(fault: &Fault, known: &Known<'_>) -> bool {
    let peers = fault.peers();
    match fault {
        Fault::Partition { .. } => peers.iter().any(|p| known.has(*p)),
        _ => peers.iter().all(|p| known.has(*p)),
    }
}

pub(super) fn at_ms(f: &Fields<'_>, name: &str, known: &Known<'_>) -> Result<u64, Error> {
    let seconds = f.need(name, "70")?.number(
        0.0,
        f64::from(known.max_time_s),
        "seconds, not after max_time_s",
    )?;
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 0 and max_time_s"
    )]
    Ok((seconds * 1000.0).round() as u64)
}

fn groups(node: &Node<'_>, known: &Known<'_>) -> Result<Vec<Vec<u16>>, Error> {
    let mut seen = BTreeSet::new();
    let mut groups = Vec::new();
    for group in node.items()? {
        let mut ids = Vec::new();
        for item in group.items()? {
            let id = known.peer(&item)?;
            if !seen.insert(id) {
                return Err(item.wrong(format!("peer {id} is named twice; a peer is in one group")));
            }
            if known.has(id) {
                ids.push(id);
            }
        }
        groups.push(ids);
    }
    groups.retain(|g: &Vec<u16>| !g.is_empty());
    if groups.is_empty() && !known.lenient {
        return Err(node.wrong("names no peer; for example [[1, 2], [3, 4, 100]]"));
    }
    Ok(groups)
}

/// Every field that some kind of fault has.
const ALL: [&str; 19] = [
    "at_s",
    "kind",
    "for_s",
    "peer",
    "fresh_disk",
    "a",
    "b",
    "one_way",
    "groups",
    "percent",
    "east_m",
    "north_m",
    "order",
    "delay_s",
    "gain_percent",
    "ahead_s",
    "one_in",
    "lasts_s",
    "aboard",
];

/// The kind of a fault, with no field that belongs to another kind.
fn kind<'a>(f: &Fields<'a>) -> Result<&'a str, Error> {
    let node = f.need("kind", "\"kill\"")?;
    let kind = node.text()?;
    let names: Vec<&str> = KINDS.iter().map(|(n, _)| *n).collect();
    let Some((_, own)) = KINDS.iter().find(|(n, _)| *n == kind) else {
        return Err(node.wrong(format!(
            "\"{kind}\" is no fault; {}",
            suggestion(kind, &names)
        )));
    };
    for name in &ALL[2..] {
        if let Some(n) = f.get(name)
            && !own.contains(name)
        {
            return Err(n.wrong(format!(
                "a fault of kind {kind} has no such field; it has {}",
                [&["at_s", "kind"], *own].concat().join(", ")
            )));
        }
    }
    Ok(kind)
}

fn flag(f: &Fields<'_>, name: &str) -> Result<bool, Error> {
    f.get(name).map_or(Ok(false), Node::flag)
}

/// A fault and what ends it.
fn one(item: &Node<'_>, known: &Known<'_>) -> Result<(TimedFault, Option<TimedFault>), Error> {
    let f = item.fields(&ALL)?;
    let at_ms = at_ms(&f, "at_s", known)?;
    let kind = kind(&f)?;
    let peer = || known.peer(f.need("peer", "3")?);
    let fresh_disk = flag(&f, "fresh_disk")?;
    let fault = match kind {
        "kill" => Fault::Kill { peer: peer()? },
        "kill-computer" => Fault::KillComputer { peer: peer()? },
        "terminate" => Fault::Terminate { peer: peer()? },
        "pause" => Fault::Pause { peer: peer()? },
        "resume" => Fault::Resume { peer: peer()? },
        "restart" => Fault::Restart {
            peer: peer()?,
            fresh_disk,
        },
        "cut" => cut(&f, known)?,
        "partition" => Fault::Partition {
            groups: groups(f.need("groups", "[[1, 2], [3, 4]]")?, known)?,
        },
        "loss" => Fault::Loss {
            permille: permille(f.need("percent", "10")?)?,
        },
        "rebase" => Fault::Rebase {
            east_mm: millimetres(f.need("east_m", "120")?)?,
            north_mm: millimetres(f.need("north_m", "-40")?)?,
        },
        "order" => Fault::Order {
            order: order(f.need("order", "\"hold\"")?)?,
            uav: f.get("peer").map(|node| known.uav(node)).transpose()?,
        },
        "fail-stores" => Fault::FailStores {
            peer: peer()?,
            one_in: f.whole_or("one_in", 1, 1, 1_000_000, "writes of which one fails")?,
        },
        "slow-stores" => Fault::SlowStores {
            peer: peer()?,
            delay_ms: delay_ms(f.need("delay_s", "0.5")?)?,
        },
        "heal-stores" => Fault::HealStores { peer: peer()? },
        "slow-computer" => Fault::SlowComputer {
            peer: peer()?,
            delay_ms: delay_ms(f.need("delay_s", "0.5")?)?,
        },
        "clock-drift" => Fault::ClockDrift {
            peer: peer()?,
            ppm: ppm(f.need("gain_percent", "2")?)?,
        },
        "clock-jump" => Fault::ClockJump {
            peer: peer()?,
            ahead_ms: delay_ms(f.need("ahead_s", "20")?)?,
        },
        "short-fuel" => Fault::ShortFuel {
            peer: peer()?,
            lasts_ms: delay_ms(f.need("lasts_s", "300")?)?,
        },
        "spoilt-record" => Fault::SpoiltRecord { peer: peer()? },
        "twin" => twin(&f, known)?,
        _ => Fault::Heal,
    };
    let end = match f.get("for_s") {
        Some(node) => Some(ending(node, at_ms, &fault, fresh_disk, known)?),
        None => None,
    };
    if let (Some(node), None) = (f.get("fresh_disk"), &end)
        && kind != "restart"
    {
        return Err(node.wrong("says how the peer restarts, so it needs for_s"));
    }
    Ok((TimedFault { at_ms, fault }, end))
}

pub(super) fn order(node: &Node<'_>) -> Result<Order, Error> {
    let text = node.text()?;
    let names = Order::ALL.map(Order::name);
    let found = Order::ALL.into_iter().find(|o| o.name() == text);
    found.ok_or_else(|| {
        node.wrong(format!(
            "\"{text}\" is no order; {}",
            suggestion(text, &names)
        ))
    })
}

/// Metres of a mission's plane as millimetres.
#[allow(clippy::cast_possible_truncation, reason = "at most 100 km")]
fn millimetres(node: &Node<'_>) -> Result<i32, Error> {
    let metres = node.number(-100_000.0, 100_000.0, "metres from the origin")?;
    Ok((metres * 1000.0).round() as i32)
}

/// A time of at most an hour as milliseconds.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "between 0 and an hour"
)]
fn delay_ms(node: &Node<'_>) -> Result<u32, Error> {
    let seconds = node.number(0.0, 3600.0, "seconds")?;
    Ok((seconds * 1000.0).round() as u32)
}

/// Per cent as millionths.
#[allow(
    clippy::cast_possible_truncation,
    reason = "between -50 and 50 per cent"
)]
fn ppm(node: &Node<'_>) -> Result<i32, Error> {
    let percent = node.number(-50.0, 50.0, "per cent")?;
    Ok((percent * 10_000.0).round() as i32)
}

fn cut(f: &Fields<'_>, known: &Known<'_>) -> Result<Fault, Error> {
    let far = f.need("b", "2")?;
    let (a, b) = (known.peer(f.need("a", "1")?)?, known.peer(far)?);
    if a == b {
        return Err(far.wrong("both ends are the same peer"));
    }
    Ok(Fault::Cut {
        a,
        b,
        one_way: flag(f, "one_way")?,
    })
}

/// Another process under the id of a UAV: a ground station neither flies nor plans, and only
/// one airframe has room for a second program.
fn twin(f: &Fields<'_>, known: &Known<'_>) -> Result<Fault, Error> {
    let node = f.need("peer", "3")?;
    let peer = known.peer(node)?;
    if known.ground == Some(peer) {
        return Err(node.wrong("is the ground station; only a UAV has a twin"));
    }
    let aboard = flag(f, "aboard")?;
    Ok(Fault::Twin { peer, aboard })
}

fn ending(
    node: &Node<'_>,
    at_ms: u64,
    fault: &Fault,
    fresh_disk: bool,
    known: &Known<'_>,
) -> Result<TimedFault, Error> {
    let left_s = f64::from(known.max_time_s) - at_ms as f64 / 1000.0;
    let seconds = node.number(
        0.001,
        left_s.max(0.001),
        "seconds, ending before max_time_s",
    )?;
    let fault = match fault {
        Fault::Kill { peer } | Fault::KillComputer { peer } | Fault::Terminate { peer } => {
            Fault::Restart {
                peer: *peer,
                fresh_disk,
            }
        }
        Fault::Pause { peer } => Fault::Resume { peer: *peer },
        Fault::Loss { .. } => Fault::Loss {
            permille: known.loss_permille,
        },
        Fault::FailStores { peer, .. } | Fault::SlowStores { peer, .. } => {
            Fault::HealStores { peer: *peer }
        }
        Fault::SlowComputer { peer, .. } => Fault::SlowComputer {
            peer: *peer,
            delay_ms: 0,
        },
        Fault::ClockDrift { peer, .. } => Fault::ClockDrift {
            peer: *peer,
            ppm: 0,
        },
        _ => Fault::Heal,
    };
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 0 and max_time_s"
    )]
    Ok(TimedFault {
        at_ms: at_ms + (seconds * 1000.0).round() as u64,
        fault,
    })
}

/// Per cent as thousandths.
pub(crate) fn permille(node: &Node<'_>) -> Result<u16, Error> {
    let percent = node.number(0.0, 100.0, "per cent")?;
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 0 and 1000"
    )]
    Ok((percent * 10.0).round() as u16)
}

/// A storm's limits; without the field nothing storms.
pub(crate) fn storm(
    node: Option<&Node<'_>>,
    n_uavs: usize,
    over_peers: bool,
) -> Result<StormSpec, Error> {
    let calm = StormSpec {
        max_kills: 0,
        until: 0.5,
        max_loss_permille: 0,
        max_partitions: 0,
        max_partition_s: 0,
        max_restarts: 0,
        max_revisions: 0,
        troubles: TroubleSpec::NONE,
    };
    let Some(node) = node else { return Ok(calm) };
    let f = node.fields(&[
        "max_kills",
        "until",
        "max_loss_percent",
        "max_partitions",
        "max_partition_s",
        "max_restarts",
        "max_revisions",
        "max_kinds",
        "max_trouble_s",
        "max_pause_s",
        "max_store_delay_s",
        "max_computer_delay_s",
        "max_clock_drift_percent",
        "max_clock_jump_s",
        "max_uavs",
        "max_crowd",
        "max_missions",
    ])?;
    let mut max_kills = f.small_or("max_kills", 0, 0, u16::MAX, "UAVs")?;
    if usize::from(max_kills) >= n_uavs {
        if !over_peers {
            let at = f.get("max_kills").unwrap_or(node);
            return Err(at.wrong(format!(
                "at most {} of {n_uavs} UAVs: one always lives",
                n_uavs.saturating_sub(1)
            )));
        }
        max_kills = u16::try_from(n_uavs.saturating_sub(1)).unwrap_or(u16::MAX);
    }
    Ok(StormSpec {
        max_kills,
        until: f.number_or(
            "until",
            0.5,
            0.0,
            1.0,
            "as a share of the failure-free makespan",
        )?,
        max_loss_permille: f.get("max_loss_percent").map_or(Ok(0), permille)?,
        max_partitions: f.small_or("max_partitions", 0, 0, 100, "partitions")?,
        max_partition_s: f.whole_or("max_partition_s", 30, 1, 86_400, "seconds")?,
        max_restarts: f.small_or("max_restarts", 0, 0, 100, "restarts")?,
        max_revisions: f.small_or("max_revisions", 0, 0, 10, "revisions")?,
        troubles: troubles(&f)?,
    })
}

/// How bad the other kinds of trouble are, where the file says so.
fn troubles(f: &Fields<'_>) -> Result<TroubleSpec, Error> {
    let usual = TroubleSpec::USUAL;
    let delay = |name, usual_ms| f.get(name).map_or(Ok(usual_ms), delay_ms);
    let drift_ppm = f.get("max_clock_drift_percent").map(ppm).transpose()?;
    Ok(TroubleSpec {
        max_kinds: f.small_or("max_kinds", usual.max_kinds, 0, 100, "kinds of trouble")?,
        max_s: f.whole_or("max_trouble_s", usual.max_s, 2, 3600, "seconds")?,
        max_pause_s: f.whole_or("max_pause_s", usual.max_pause_s, 0, 3600, "seconds")?,
        max_store_delay_ms: delay("max_store_delay_s", usual.max_store_delay_ms)?,
        max_computer_delay_ms: delay("max_computer_delay_s", usual.max_computer_delay_ms)?,
        max_clock_drift_ppm: drift_ppm.map_or(usual.max_clock_drift_ppm, i32::unsigned_abs),
        max_clock_jump_ms: delay("max_clock_jump_s", usual.max_clock_jump_ms)?,
        max_uavs: f.small_or("max_uavs", usual.max_uavs, 0, 60, "UAVs")?,
        max_crowd: f.small_or("max_crowd", usual.max_crowd, 0, 60, "UAVs")?,
        max_missions: f.small_or("max_missions", usual.max_missions, 0, 10, "missions")?,
    })
}

/// Reads a chaos plan: an object with a list `faults`, in the form that scenarios
/// have. `peers` are the peers of the swarm it is for, if they are known.
///
/// # Errors
/// [`ScenarioError`] names the place.
pub fn chaos_plan(
    file: &str,
    text: &str,
    peers: Option<&BTreeSet<u16>>,
) -> Result<Vec<TimedFault>, ScenarioError> {
    let document = Document::parse("chaos plan", file, text)?;
    let root = document.root();
    let f = root.fields(&["name", "faults"])?;
    // A week is longer than any trial.
    let known = Known {
        peers,
        ground: None,
        max_time_s: 604_800,
        loss_permille: 0,
        lenient: false,
    };
    let list = f.need("faults", "[{ at_s: 10, kind: \"kill\", peer: 3 }]")?;
    Ok(read(list, &known, &mut Vec::new())?)
}

/// Reads a chaos plan from a file.
///
/// # Errors
/// [`ScenarioError`] names the place.
pub fn load_chaos_plan(
    path: &Path,
    peers: Option<&BTreeSet<u16>>,
) -> Result<Vec<TimedFault>, ScenarioError> {
    let file = path.display().to_string();
    let text = read_text(path).map_err(|problem| ScenarioError::Unreadable {
        file: file.clone(),
        problem,
    })?;
    chaos_plan(&file, &text, peers)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(faults: &str) -> Result<Vec<TimedFault>, String> {
        let peers = BTreeSet::from([1, 2, 3, 100]);
        chaos_plan(
            "c.json5",
            &format!("{{ faults: [{faults}] }}"),
            Some(&peers),
        )
        .map_err(|e| e.to_string())
    }

    #[test]
    fn for_s_adds_what_ends_the_fault() {
        let cases = [
            (
                "{at_s:1, kind:'kill-computer', peer:2, for_s:20, fresh_disk:true}",
                Fault::Restart {
                    peer: 2,
                    fresh_disk: true,
                },
            ),
            (
                "{at_s:1, kind:'pause', peer:2, for_s:20}",
                Fault::Resume { peer: 2 },
            ),
            (
                "{at_s:1, kind:'partition', groups:[[1,2],[3]], for_s:20}",
                Fault::Heal,
            ),
            ("{at_s:1, kind:'cut', a:1, b:100, for_s:20}", Fault::Heal),
            (
                "{at_s:1, kind:'loss', percent:12.5, for_s:20}",
                Fault::Loss { permille: 0 },
            ),
            (
                "{at_s:1, kind:'fail-stores', peer:2, for_s:20}",
                Fault::HealStores { peer: 2 },
            ),
            (
                "{at_s:1, kind:'slow-stores', peer:2, delay_s:3, for_s:20}",
                Fault::HealStores { peer: 2 },
            ),
            (
                "{at_s:1, kind:'slow-computer', peer:2, delay_s:0.4, for_s:20}",
                Fault::SlowComputer {
                    peer: 2,
                    delay_ms: 0,
                },
            ),
            (
                "{at_s:1, kind:'clock-drift', peer:2, gain_percent:-3, for_s:20}",
                Fault::ClockDrift { peer: 2, ppm: 0 },
            ),
        ];
        for (text, end) in cases {
            let faults = plan(text).unwrap();
            assert_eq!(faults.len(), 2, "{text}");
            assert_eq!(
                (faults[1].at_ms, &faults[1].fault),
                (21_000, &end),
                "{text}"
            );
        }
    }

    #[test]
    fn units_of_a_file_become_those_of_a_run() {
        let cases = [
            (
                "{at_s:1, kind:'rebase', east_m:12.5, north_m:-3}",
                Fault::Rebase {
                    east_mm: 12_500,
                    north_mm: -3_000,
                },
            ),
            (
                "{at_s:1, kind:'order', order:'return-to-base'}",
                Fault::Order {
                    order: Order::ReturnToBase,
                    uav: None,
                },
            ),
            (
                "{at_s:1, kind:'order', order:'return-to-base', peer:2}",
                Fault::Order {
                    order: Order::ReturnToBase,
                    uav: Some(2),
                },
            ),
            (
                "{at_s:1, kind:'fail-stores', peer:3, one_in:50}",
                Fault::FailStores {
                    peer: 3,
                    one_in: 50,
                },
            ),
            (
                "{at_s:1, kind:'slow-stores', peer:3, delay_s:0.25}",
                Fault::SlowStores {
                    peer: 3,
                    delay_ms: 250,
                },
            ),
            (
                "{at_s:1, kind:'slow-computer', peer:3, delay_s:1.5}",
                Fault::SlowComputer {
                    peer: 3,
                    delay_ms: 1500,
                },
            ),
            (
                "{at_s:1, kind:'clock-drift', peer:3, gain_percent:-2.5}",
                Fault::ClockDrift {
                    peer: 3,
                    ppm: -25_000,
                },
            ),
            (
                "{at_s:1, kind:'short-fuel', peer:3, lasts_s:90.5}",
                Fault::ShortFuel {
                    peer: 3,
                    lasts_ms: 90_500,
                },
            ),
            (
                "{at_s:1, kind:'clock-jump', peer:3, ahead_s:20}",
                Fault::ClockJump {
                    peer: 3,
                    ahead_ms: 20_000,
                },
            ),
            (
                "{at_s:1, kind:'twin', peer:3}",
                Fault::Twin {
                    peer: 3,
                    aboard: false,
                },
            ),
            (
                "{at_s:1, kind:'twin', peer:3, aboard:true}",
                Fault::Twin {
                    peer: 3,
                    aboard: true,
                },
            ),
        ];
        for (text, want) in cases {
            assert_eq!(plan(text).unwrap()[0].fault, want, "{text}");
        }
    }

    #[test]
    fn a_ground_station_has_no_twin() {
        let text = "{ faults: [{at_s:1, kind:'twin', peer:100, aboard:true}] }";
        let document = Document::parse("scenario", "c.json5", text).unwrap();
        let root = document.root();
        let fields = root.fields(&["faults"]).unwrap();
        let peers = BTreeSet::from([1, 100]);
        let faults = |ground| {
            let known = Known {
                peers: Some(&peers),
                ground,
                max_time_s: 100,
                loss_permille: 0,
                lenient: false,
            };
            read(fields.need("faults", "").unwrap(), &known, &mut Vec::new())
        };
        let wrong = faults(Some(100)).unwrap_err().to_string();
        assert!(
            wrong.contains("faults[0].peer: is the ground station"),
            "{wrong}"
        );
        assert!(faults(None).is_ok());
    }

    #[test]
    fn faults_come_in_the_order_of_time() {
        let faults = plan("{at_s:9, kind:'heal'}, {at_s:2.5, kind:'kill', peer:1}").unwrap();
        assert_eq!(
            faults[0],
            TimedFault {
                at_ms: 2500,
                fault: Fault::Kill { peer: 1 }
            }
        );
    }

    #[test]
    fn wrong_faults_are_named() {
        let cases = [
            (
                "{at_s:1, kind:'kil', peer:2}",
                "faults[0].kind: \"kil\" is no fault; did you mean kill?",
            ),
            (
                "{at_s:1, kind:'kill', peer:7}",
                "faults[0].peer: no peer has the number 7",
            ),
            (
                "{at_s:1, kind:'heal', peer:2}",
                "faults[0].peer: a fault of kind heal has no such field",
            ),
            (
                "{at_s:-1, kind:'heal'}",
                "faults[0].at_s: -1 is out of range",
            ),
            (
                "{at_s:1, kind:'partition', groups:[[1],[1]]}",
                "faults[0].groups[1][0]: peer 1 is named twice",
            ),
            (
                "{at_s:1, kind:'partition', groups:[]}",
                "faults[0].groups: names no peer",
            ),
            ("{at_s:1, kind:'cut', a:1, b:1}", "faults[0].b: both ends"),
            (
                "{at_s:1, kind:'order', order:'land'}",
                "faults[0].order: \"land\" is no order",
            ),
            (
                "{at_s:1, kind:'clock-drift', peer:2, gain_percent:60}",
                "faults[0].gain_percent: 60 is out of range",
            ),
            (
                "{at_s:1, kind:'clock-jump', peer:2, ahead_s:-1}",
                "faults[0].ahead_s: -1 is out of range",
            ),
            (
                "{at_s:1, kind:'kill', peer:1, aboard:true}",
                "faults[0].aboard: a fault of kind kill has no such field",
            ),
            (
                "{at_s:1, kind:'kill', peer:1, fresh_disk:true}",
                "faults[0].fresh_disk: says how",
            ),
            (
                "{kind:'heal'}",
                "faults[0]: the field faults[0].at_s is missing",
            ),
        ];
        for (text, want) in cases {
            let e = plan(text).unwrap_err();
            assert!(
                e.starts_with("c.json5:1:") && e.contains(want),
                "{text}: {e}"
            );
        }
    }
}
