//! The report of a run for a person.

use super::lifetimes::Cause;
use super::report::{Driver, KillReport, RestartReport, RunReport};
use super::secs;
use crate::check::crowds::CrowdReport;
use crate::check::streets::StreetsReport;
use std::collections::BTreeMap;
use std::fmt;

impl fmt::Display for RunReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let word = if self.passed { "PASSED" } else { "FAILED" };
        let driver = match self.driver {
            Driver::Sim => "simulated",
            Driver::Live => "live",
        };
        writeln!(f, "{word}  {}, seed {}, {driver}", self.scenario, self.seed)?;
        for reason in &self.reasons {
            writeln!(f, "  failed: {reason}")?;
        }
        self.write_times(f)?;
        self.write_world(f)?;
        for kill in &self.kills {
            self.write_kill(kill, f)?;
        }
        for restart in &self.restarts {
            self.write_restart(restart, f)?;
        }
        for task in &self.tasks {
            writeln!(f, "  task       {}", task.line())?;
        }
        for detection in &self.detections {
            writeln!(f, "  detection  {}", detection.line())?;
        }
        if let Some(contour) = &self.contour {
            writeln!(f, "  contour    {}", contour.line())?;
        }
        for count in &self.counts {
            writeln!(f, "  count      {}", count.line())?;
        }
        for line in self.streets.iter().flat_map(StreetsReport::lines) {
            writeln!(f, "  streets    {line}")?;
        }
        for layer in &self.layers {
            writeln!(f, "  layer      {}", layer.line())?;
        }
        for line in self.crowd.iter().flat_map(CrowdReport::lines) {
            writeln!(f, "  crowd      {line}")?;
        }
        self.write_radio(f)?;
        self.write_checks(f)?;
        for alarm in &self.alarms {
            writeln!(f, "  alarm      {alarm}")?;
        }
        Ok(())
    }
}

impl RunReport {
    fn write_times(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "  time       {:.1} s of flight", secs(self.end_ms))?;
        if let Some(live) = &self.live {
            write!(f, " in {:.1} s (x{:.1})", live.wall_s, live.mean_time_scale)?;
            if live.lowest_time_scale < live.time_scale {
                write!(
                    f,
                    " instead of x{:.1}, at times x{:.1}: the machine was too slow",
                    live.time_scale, live.lowest_time_scale
                )?;
            }
        }
        writeln!(f)?;
        let Some(makespan_ms) = self.makespan_ms else {
            return Ok(());
        };
        write!(f, "  makespan   {:.1} s", secs(makespan_ms))?;
        if let Some(ratio) = self.makespan_over_baseline {
            write!(f, ", {ratio:.2} times the omniscient baseline")?;
        }
        if let (Some(ratio), Some(bound_ms)) = (self.makespan_over_work_bound, self.work_bound_ms) {
            write!(
                f,
                ", {ratio:.2} times the work bound of {:.1} s",
                secs(bound_ms)
            )?;
        }
        let later = |ms: &u64| Some(*ms) > self.work_bound_ms;
        if let (Some(ratio), Some(bound_ms)) = (
            self.makespan_over_launch_bound,
            self.launch_bound_ms.filter(later),
        ) {
            write!(
                f,
                ", {ratio:.2} times that from the take-offs on ({:.1} s)",
                secs(bound_ms)
            )?;
        }
        writeln!(f)
    }

    fn write_world(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let c = &self.coverage;
        writeln!(
            f,
            "  coverage   {} of {} coverable cells",
            c.covered_cells, c.coverable_cells
        )?;
        write!(
            f,
            "  coverable  {:.1} % of the area",
            c.coverable_share * 100.0
        )?;
        if c.revised && c.coverable_share < c.needed_share {
            let needed = c.needed_share * 100.0;
            write!(f, " ({needed:.1} % asked for; changed in flight)")?;
        }
        for (reason, n) in &c.uncoverable {
            write!(f, "; {n} cells not: {reason}")?;
        }
        writeln!(f)?;
        if let Some(ground) = &c.ground {
            let hidden = ground.samples - ground.seen;
            writeln!(
                f,
                "  in sight   {:.1} % of the open ground between buildings ({hidden} of {} samples hidden)",
                ground.share * 100.0,
                ground.samples
            )?;
        }
        write!(f, "  zones      {} entries", self.zone_entries)?;
        if let Some(m) = self.nearest_approach_m {
            write!(f, "; closest approach of two UAVs {m:.1} m")?;
        }
        if let Some(m) = self.nearest_intruder_m {
            write!(f, ", of an intruder {m:.1} m")?;
        }
        if let (Some(m), Some(found)) = (self.nearest_obstacle_m, self.obstacles_found) {
            write!(f, ", of an obstacle {m:.1} m ({found} found)")?;
        }
        writeln!(f)?;
        if let Some(ms) = self.revisit_ms {
            write!(f, "  revisit    {:.1} s at most", secs(ms))?;
            if let Some(ms) = self.revisit_late_ms {
                write!(f, ", {:.1} s in the second half", secs(ms))?;
            }
            writeln!(f)?;
        }
        writeln!(f, "  finished   {}", self.names(&self.finished))?;
        if !self.relaying.is_empty() {
            writeln!(f, "  relaying   {}", self.names(&self.relaying))?;
        }
        if !self.unfinished.is_empty() {
            writeln!(f, "  unfinished {}", self.names(&self.unfinished))?;
        }
        Ok(())
    }

    fn write_radio(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (s, r) = (&self.swarm, &self.radio);
        writeln!(
            f,
            "  swarm      split {} times, met again {} times, at most {} parts",
            s.splits, s.merges, s.most_components
        )?;
        writeln!(f, "  link cuts  {}", counted(&r.link_cuts))?;
        writeln!(f, "  lost       {}", counted(&r.lost))?;
        let relays: Vec<u16> = r.relayed_by.keys().copied().collect();
        writeln!(
            f,
            "  radio      {} messages sent ({} bytes, {:.0} a second and peer), {} received, {} of them over several hops, passed on by {}",
            r.sent,
            r.bytes_sent,
            r.bytes_per_peer_s,
            r.received,
            r.multi_hop,
            self.names(&relays)
        )
    }

    fn write_checks(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(v) = &self.violations {
            writeln!(
                f,
                "  violations {}",
                each(&v.counts, |rule, n| format!("{n} of {rule}"))
            )?;
            for v in &v.first {
                writeln!(f, "    {v}")?;
            }
        }
        if let Some(wind) = self.simulated.as_ref().and_then(|s| s.wind_errors) {
            writeln!(
                f,
                "  wind       estimated, {:.2} m/s wrong (root of the mean square), {:.2} m/s at most",
                wind.rms_mps, wind.max_mps
            )?;
        }
        if let Some(e) = self.simulated.as_ref().and_then(|s| s.footprint_errors) {
            writeln!(
                f,
                "  footprint  {:.1} m from where it is planned on the mean, {:.1} m in 99 of 100 looks; {} cells seen, {} missed at first",
                e.mean_m, e.p99_m, e.seen, e.missed
            )?;
        }
        if let Some(simulated) = &self.simulated {
            for d in &simulated.false_downs {
                writeln!(
                    f,
                    "  false down of {} by {} at {:.1} s",
                    self.name(d.of),
                    self.name(d.by),
                    secs(d.at_ms)
                )?;
            }
            writeln!(
                f,
                "  history    {} over {} events",
                simulated.history_hash, simulated.events
            )?;
        }
        Ok(())
    }

    fn write_kill(&self, k: &KillReport, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (word, whose) = match k.cause {
            Cause::Killed => ("killed    ", ""),
            Cause::ComputerKilled => ("killed    ", "the computer of "),
            Cause::Terminated => ("terminated", ""),
            Cause::Crashed => ("crashed   ", ""),
            Cause::Lost => ("lost      ", ""),
            Cause::Landed => ("landed    ", ""),
        };
        write!(
            f,
            "  {word} {whose}{} at {:.1} s with {} cells uncovered ({:.0} % of an even share)",
            self.name(k.peer),
            secs(k.at_ms),
            k.cells_held,
            k.share_held * 100.0
        )?;
        if let (Some(by), Some(ms)) = (k.detected_by, k.detection_ms) {
            write!(f, "; noticed by {} after {:.1} s", self.name(by), secs(ms))?;
        }
        if k.listed_already > 0 {
            write!(f, "; {} listed by others already", k.listed_already)?;
        }
        for t in &k.taken_over_by {
            write!(
                f,
                "; uav{} took over {} after {:.1} s",
                t.peer,
                t.cells,
                secs(t.first_ms)
            )?;
        }
        if k.taken_back > 0 {
            write!(f, "; {} taken back by itself", k.taken_back)?;
        }
        if k.seen_in_passing > 0 {
            write!(f, "; {} seen in passing", k.seen_in_passing)?;
        }
        if let Some(ms) = k.takeover_ms.filter(|_| !k.taken_over_by.is_empty()) {
            write!(f, "; all taken over after {:.1} s", secs(ms))?;
        }
        if k.superseded > 0 {
            write!(f, "; {} superseded by a new mission", k.superseded)?;
        }
        if k.left > 0 {
            write!(f, "; {} left", k.left)?;
        }
        let flown = k.flown_by.iter().map(|(id, n)| format!("{n} by uav{id}"));
        let flown = flown.collect::<Vec<_>>().join(", ");
        if flown.is_empty() {
            writeln!(f)
        } else {
            writeln!(f, "; flown: {flown}")
        }
    }

    fn write_restart(&self, r: &RestartReport, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let disk = if r.fresh_disk {
            "without its disk"
        } else {
            "with its disk"
        };
        write!(
            f,
            "  restarted  {} at {:.1} s {disk}",
            self.name(r.peer),
            secs(r.at_ms)
        )?;
        if let Some(life) = r.incarnation_after {
            write!(f, ", life {life}")?;
        }
        match r.productive_ms {
            Some(ms) => writeln!(f, ", productive after {:.1} s", secs(ms)),
            None => writeln!(f, ", not productive again"),
        }
    }

    /// What people call a peer.
    fn name(&self, peer: u16) -> String {
        name(peer, self.uavs.contains(&peer))
    }

    fn names(&self, peers: &[u16]) -> String {
        if peers.is_empty() {
            return "nobody".to_owned();
        }
        let names: Vec<String> = peers.iter().map(|p| self.name(*p)).collect();
        names.join(", ")
    }
}

/// What people call a peer.
#[must_use]
pub fn name(peer: u16, flies: bool) -> String {
    if flies {
        format!("uav{peer}")
    } else {
        "the ground station".to_owned()
    }
}

fn counted(by: &BTreeMap<String, u64>) -> String {
    each(by, |reason, n| format!("{n} by {reason}"))
}

fn each(by: &BTreeMap<String, u64>, told: impl Fn(&str, u64) -> String) -> String {
    if by.is_empty() {
        return "none".to_owned();
    }
    let each: Vec<String> = by.iter().map(|(what, n)| told(what, *n)).collect();
    each.join(", ")
}
