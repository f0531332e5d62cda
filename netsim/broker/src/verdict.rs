//! The verdict of a trial: what the world and the peers' reports add up to, as data
//! and as text.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

/// The verdict.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// Name of the scenario.
    pub scenario: String,
    /// Seed of the run.
    pub seed: u64,
    /// Whether everything is as it must be.
    pub passed: bool,
    /// Why not, if not.
    pub failures: Vec<String>,
    /// Scenario time of the end, seconds.
    pub time_s: f64,
    /// Wall time of the flight, seconds.
    pub wall_s: f64,
    /// Scenario seconds per second of wall time: asked for.
    pub time_scale: f64,
    /// The lowest to which it had to be lowered, because the machine was too slow.
    pub lowest_time_scale: f64,
    /// What was seen of the area.
    pub coverage: CoverageVerdict,
    /// Flown segments that entered a no-fly zone.
    pub zone_entries: usize,
    /// Smallest distance of two airborne UAVs, metres.
    pub separation_m: Option<f64>,
    /// Each peer that was killed.
    pub kills: Vec<KillVerdict>,
    /// Each restart.
    pub restarts: Vec<RestartVerdict>,
    /// How often the swarm fell apart, by the true link graph.
    pub splits: usize,
    /// How often parts of it met again.
    pub merges: usize,
    /// The largest number of components at once.
    pub most_components: usize,
    /// Links that went down, by reason: `range`, `sight`, `fault`.
    pub link_cuts: BTreeMap<String, u64>,
    /// Messages that did not arrive, by reason.
    pub messages_lost: BTreeMap<String, u64>,
    /// Transmissions of all peers.
    pub messages_sent: u64,
    /// Their bytes.
    pub bytes_sent: u64,
    /// Receptions.
    pub messages_received: u64,
    /// Receptions of records that had been passed on at least once.
    pub multi_hop: u64,
    /// Who passed those on.
    pub relayed_by: BTreeMap<u16, u64>,
    /// Messages dropped because a process was too slow to take them.
    pub overrun: u64,
    /// Live UAVs that hold the mission finished.
    pub finished: Vec<u16>,
    /// Live UAVs that do not.
    pub unfinished: Vec<u16>,
    /// Largest delay of a setpoint behind its percept, milliseconds of scenario time.
    pub setpoint_delay_ms: u64,
    /// What people should look at.
    pub alarms: Vec<String>,
}

/// What was seen of the area.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CoverageVerdict {
    /// Coverable cells that were seen whole.
    pub covered: usize,
    /// Cells that some UAV can see whole on a straight pass.
    pub coverable: usize,
    /// All cells of the area.
    pub cells: usize,
    /// Share of the area that is coverable.
    pub coverable_share: f64,
    /// The share that the scenario asks for.
    pub needed_share: f64,
    /// Why the other cells cannot be seen.
    pub uncoverable: BTreeMap<String, usize>,
    /// Which cells, by column and row of the lane grid.
    pub uncoverable_cells: Vec<Uncovered>,
    /// Coverable cells that were not seen, by column and row.
    pub missed: Vec<(i16, i16)>,
}

/// A cell that cannot be seen.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Uncovered {
    /// Column of the lane grid.
    pub col: i16,
    /// Row of the lane grid.
    pub row: i16,
    /// Why.
    pub reason: String,
}

/// What became of the work of a peer that was killed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KillVerdict {
    /// Who.
    pub peer: u16,
    /// When, seconds of scenario time.
    pub at_s: f64,
    /// Whether its airframe stayed in the air.
    pub computer_only: bool,
    /// Uncovered cells that it listed.
    pub cells_held: usize,
    /// The same, as a share of an even share of the whole loop.
    pub of_even_share: f64,
    /// Who found out first.
    pub detected_by: Option<u16>,
    /// And how long after the kill, seconds.
    pub detected_after_s: Option<f64>,
    /// Who listed its cells.
    pub taken_over_by: Vec<Taker>,
    /// Cells that somebody else listed already when it was killed.
    pub listed_already: usize,
    /// Cells that somebody saw without having listed them.
    pub seen_in_passing: usize,
    /// Who flew its cells in the end, and how many.
    pub flown_by: BTreeMap<u16, usize>,
    /// When the last of its cells was listed or seen, seconds after the kill.
    pub all_after_s: Option<f64>,
    /// Cells that nobody listed or saw.
    pub left: usize,
}

/// A peer that took over cells of another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Taker {
    /// Who.
    pub peer: u16,
    /// How many cells.
    pub cells: usize,
    /// When the first of them, seconds after the kill.
    pub first_after_s: f64,
}

/// What became of a peer that was started again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RestartVerdict {
    /// Who.
    pub peer: u16,
    /// When, seconds of scenario time.
    pub at_s: f64,
    /// Whether its journal was taken away.
    pub fresh_disk: bool,
    /// Its life before.
    pub incarnation_before: Option<u32>,
    /// Its life after.
    pub incarnation_after: Option<u32>,
    /// When it listed or saw a cell or held the mission finished, seconds after the restart.
    pub productive_after_s: Option<f64>,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let word = if self.passed { "PASSED" } else { "FAILED" };
        writeln!(f, "{word}  {}, seed {}", self.scenario, self.seed)?;
        for failure in &self.failures {
            writeln!(f, "  failed: {failure}")?;
        }
        write!(
            f,
            "  time       {:.1} s of flight in {:.1} s (x{:.1})",
            self.time_s, self.wall_s, self.time_scale
        )?;
        if self.lowest_time_scale < self.time_scale {
            write!(
                f,
                ", slowed down to x{:.1}: the machine was too slow",
                self.lowest_time_scale
            )?;
        }
        writeln!(f)?;
        self.write_world(f)?;
        self.write_kills(f)?;
        self.write_radio(f)?;
        for alarm in &self.alarms {
            writeln!(f, "  alarm      {alarm}")?;
        }
        Ok(())
    }
}

impl Verdict {
    fn write_world(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let c = &self.coverage;
        writeln!(
            f,
            "  coverage   {} of {} coverable cells",
            c.covered, c.coverable
        )?;
        write!(
            f,
            "  coverable  {:.1} % of the area",
            c.coverable_share * 100.0
        )?;
        for (reason, n) in &c.uncoverable {
            write!(f, "; {n} cells not: {reason}")?;
        }
        writeln!(f)?;
        write!(f, "  zones      {} entries", self.zone_entries)?;
        if let Some(m) = self.separation_m {
            write!(f, "; closest approach of two UAVs {m:.1} m")?;
        }
        writeln!(f)?;
        writeln!(f, "  finished   {}", named(&self.finished))?;
        if !self.unfinished.is_empty() {
            writeln!(f, "  unfinished {}", named(&self.unfinished))?;
        }
        Ok(())
    }

    fn write_kills(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for k in &self.kills {
            write!(
                f,
                "  killed     {}uav{} at {:.1} s with {} cells uncovered ({:.0} % of an even share)",
                if k.computer_only {
                    "the computer of "
                } else {
                    ""
                },
                k.peer,
                k.at_s,
                k.cells_held,
                k.of_even_share * 100.0
            )?;
            if let (Some(by), Some(after)) = (k.detected_by, k.detected_after_s) {
                write!(f, "; noticed by uav{by} after {after:.1} s")?;
            }
            if k.listed_already > 0 {
                write!(f, "; {} listed by others already", k.listed_already)?;
            }
            for t in &k.taken_over_by {
                write!(
                    f,
                    "; uav{} took over {} after {:.1} s",
                    t.peer, t.cells, t.first_after_s
                )?;
            }
            if k.seen_in_passing > 0 {
                write!(f, "; {} seen in passing", k.seen_in_passing)?;
            }
            if k.left > 0 {
                write!(f, "; {} left", k.left)?;
            }
            let flown = k.flown_by.iter().map(|(id, n)| format!("{n} by uav{id}"));
            let flown = flown.collect::<Vec<_>>().join(", ");
            if flown.is_empty() {
                writeln!(f)?;
            } else {
                writeln!(f, "; flown: {flown}")?;
            }
        }
        for r in &self.restarts {
            let disk = if r.fresh_disk {
                "without its disk"
            } else {
                "with its disk"
            };
            write!(f, "  restarted  uav{} at {:.1} s {disk}", r.peer, r.at_s)?;
            if let Some(life) = r.incarnation_after {
                write!(f, ", life {life}")?;
            }
            match r.productive_after_s {
                Some(after) => writeln!(f, ", productive after {after:.1} s")?,
                None => writeln!(f, ", not productive again")?,
            }
        }
        Ok(())
    }

    fn write_radio(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "  swarm      split {} times, met again {} times, at most {} parts",
            self.splits, self.merges, self.most_components
        )?;
        writeln!(f, "  link cuts  {}", counted(&self.link_cuts))?;
        writeln!(f, "  lost       {}", counted(&self.messages_lost))?;
        let relays: Vec<u16> = self.relayed_by.keys().copied().collect();
        writeln!(
            f,
            "  radio      {} messages sent ({} bytes), {} received, {} of them over several hops, passed on by {}",
            self.messages_sent,
            self.bytes_sent,
            self.messages_received,
            self.multi_hop,
            named(&relays)
        )
    }
}

fn named(peers: &[u16]) -> String {
    if peers.is_empty() {
        return "nobody".to_owned();
    }
    peers
        .iter()
        .map(|p| format!("uav{p}"))
        .collect::<Vec<_>>()
        .join(" ")
}

fn counted(by: &BTreeMap<String, u64>) -> String {
    if by.is_empty() {
        return "none".to_owned();
    }
    by.iter()
        .map(|(reason, n)| format!("{n} by {reason}"))
        .collect::<Vec<_>>()
        .join(", ")
}
