//! `skein trial`: a scenario with real processes, a display, and a verdict.

use crate::check::Format;
use crate::onlookers::{Map, Shows};
use crate::page::{Page, TrialName, WebArgs, hello};
use crate::scenario_args::ScenarioArgs;
use crate::{cli, exit, onlookers, report};
use anyhow::Context;
use clap::Args;
use skein_broker::{Event, Options, Progress, TrialError};
use skein_netsim::account::RunReport;
use skein_recording::Sink;
use skein_recording::model::Knowledge;
use skein_recording::model::scene::Driver;
use skein_recording::run_dir::Manifest;
use skein_scenario::Severity;
use skein_terminal::{Pace, screen};
use skein_web::Mode;
use std::path::PathBuf;
use std::process::ExitCode;

/// Flies a scenario with real processes over Zenoh on this machine, and judges it.
///
/// Each peer is a process of its own; they reach each other only through a simulated
/// radio on 127.0.0.1. Faults of the scenario happen at their times, and others can
/// be added from another terminal with `skein chaos`. Ends with a report: exit code
/// 0 if everything that can be covered was covered, no no-fly zone was entered and
/// every live peer knows that the mission is finished, else 1.
#[derive(Debug, Args)]
pub struct TrialArgs {
    /// What is flown.
    #[command(flatten)]
    pub scenario: ScenarioArgs,
    /// Scenario seconds per second, at most 10.
    #[arg(long, value_name = "X")]
    pub time_scale: Option<f64>,
    /// Seed of everything that is drawn.
    #[arg(long, value_name = "S")]
    pub seed: Option<u64>,
    /// Stops after so many scenario seconds if the mission is not over by then.
    #[arg(long, value_name = "S", value_parser = clap::value_parser!(u32).range(1..))]
    pub max_time: Option<u32>,
    /// Keeps configurations, journals and logs in this directory, beside recording,
    /// manifest and report. Without it those three are kept of the last ten trials that
    /// went well, and everything of one that failed.
    #[arg(long, value_name = "DIR")]
    pub run_dir: Option<PathBuf>,
    /// How the report is printed.
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
    /// Tells what happens in lines, also where a terminal could show a map.
    #[arg(long)]
    pub plain: bool,
    /// Where it is shown besides.
    #[command(flatten)]
    pub web: WebArgs,
}

/// Runs the verb: a map or progress on stderr, the report on stdout.
///
/// # Errors
/// When the trial could not be run at all.
pub fn run(args: &TrialArgs) -> anyhow::Result<ExitCode> {
    if args.time_scale.is_some_and(|x| !(x > 0.0 && x <= 10.0)) {
        eprintln!(
            "error: --time-scale must be above 0 and at most 10; Zenoh's own timers know no scenario time"
        );
        return Ok(ExitCode::from(exit::USAGE));
    }
    let mut scenario = match args.scenario.open(args.seed, args.time_scale) {
        Ok(scenario) => scenario,
        Err(error) => {
            eprintln!("error: {error}");
            return Ok(ExitCode::from(exit::CONFIG_INVALID));
        }
    };
    for finding in scenario
        .findings
        .iter()
        .filter(|f| f.severity == Severity::Warning)
    {
        eprintln!("{finding}");
    }
    if let Some(longest_s) = args.max_time {
        let spec = &mut scenario.spec;
        spec.max_time_s = spec.max_time_s.min(longest_s);
        spec.faults
            .retain(|f| f.at_ms < u64::from(longest_s) * 1000);
    }
    let manifest = Manifest {
        scenario_text: args.scenario.text(),
        command: format!(
            "skein trial{} --seed {}",
            args.scenario.as_typed(),
            scenario.spec.seed
        ),
        ..Manifest::new(&scenario.spec.name, scenario.spec.seed, Driver::Live)
    };
    let (mut display, sinks) = Display::open(args, &scenario.spec.name, scenario.spec.seed)?;
    let options = Options {
        seed: scenario.spec.seed,
        geometry: scenario.geometry,
        spec: scenario.spec,
        run_dir: args.run_dir.clone(),
        program: std::env::current_exe().context("this program's own file")?,
        sinks,
        manifest,
    };
    let stop = onlookers::asked_to_stop(display.map.as_mut());
    let mut tell = |event: Event| display.show(event);
    let ended = cli::runtime()?.block_on(skein_broker::run(options, stop, &mut tell));
    let is_over = ended.is_ok();
    let page = display.end(is_over);
    let code = verdict(args, ended)?;
    // Who interrupted the trial wants no page either.
    if let Some(page) = page.filter(|_| is_over) {
        page.stay();
    }
    Ok(code)
}

/// Prints what the trial came to.
fn verdict(args: &TrialArgs, ended: Result<RunReport, TrialError>) -> anyhow::Result<ExitCode> {
    match ended {
        Ok(report) => {
            match args.format {
                Format::Text => exit::print(&report)?,
                Format::Json => exit::print(serde_json::to_string_pretty(&report)?)?,
            }
            Ok(ExitCode::from(if report.passed {
                exit::OK
            } else {
                exit::MISSION_FAILED
            }))
        }
        Err(error) => {
            eprintln!("error: {error}");
            Ok(ExitCode::from(match error {
                TrialError::Launch { .. } | TrialError::Interrupted => exit::NO_PEERS,
                TrialError::Io { .. } | TrialError::Registry(_) | TrialError::Token(_) => {
                    exit::INTERNAL
                }
            }))
        }
    }
}

/// A map on a terminal, plain lines elsewhere; a page beside either.
struct Display {
    map: Option<Map>,
    page: Option<Page>,
    trial: TrialName,
    /// Lines that wait until the map is gone.
    held: Vec<String>,
    /// Where the trial is kept.
    run_dir: Option<PathBuf>,
}

impl Display {
    /// Opens what is wanted; gives what the trial tells of itself to.
    fn open(
        args: &TrialArgs,
        scenario: &str,
        seed: u64,
    ) -> anyhow::Result<(Self, Vec<Box<dyn Sink>>)> {
        let title = format!("{scenario}, seed {seed}");
        let command = format!(
            "skein trial{} --seed {seed} --web",
            args.scenario.as_typed()
        );
        let hello = hello(Mode::Trial, title.clone(), command);
        let page = args.web.open(&hello)?;
        let trial = page.as_ref().map(Page::trial).unwrap_or_default();
        let mut sinks: Vec<Box<dyn Sink>> = page.iter().map(Page::sink).collect();
        let mut map = None;
        if screen::is_one() && !args.plain {
            let (opened, sink) = Map::open(Shows {
                title,
                pace: Pace::Live,
                knowledge: Knowledge::World,
                trial: Some(TrialName::clone(&trial)),
            })?;
            sinks.push(sink);
            map = Some(opened);
        }
        let display = Self {
            map,
            page,
            trial,
            held: Vec::new(),
            run_dir: None,
        };
        Ok((display, sinks))
    }

    fn show(&mut self, event: Event) {
        match event {
            Event::Begun { id, run_dir } => {
                let line = format!("trial {id} in {}", run_dir.display());
                // Only one trial is flown by this process.
                let _ = self.trial.set(id);
                self.line(line);
                self.run_dir = Some(run_dir);
            }
            Event::Note { time_s, text } => self.line(format!("{time_s:7.1} s  {text}")),
            Event::Progress(progress) if self.map.is_none() => self.line(words(&progress)),
            Event::Progress(_) => {}
        }
    }

    fn line(&mut self, text: String) {
        if self.map.is_some() {
            self.held.push(text);
        } else {
            eprintln!("{text}");
        }
    }

    /// Gives the terminal back, and tells what waited for that and, of a trial that came to its
    /// end, where it is kept.
    fn end(self, over: bool) -> Option<Page> {
        if let Some(map) = self.map {
            map.stop().store(true, std::sync::atomic::Ordering::SeqCst);
            if let Err(why) = map.join() {
                eprintln!("warning: no map could be drawn: {why}");
            }
        }
        self.held.iter().for_each(|line| eprintln!("{line}"));
        if let Some(dir) = self.run_dir.filter(|_| over) {
            report::tell_recorded(&dir);
        }
        self.page
    }
}

fn words(p: &Progress) -> String {
    let alive = p
        .alive
        .iter()
        .map(|id| format!("uav{id}"))
        .collect::<Vec<_>>()
        .join(" ");
    let parts = if p.components == 1 {
        "1 component".to_owned()
    } else {
        format!("{} components", p.components)
    };
    format!(
        "{:7.1} s  {:5.1} % covered, alive: {alive}, {parts}, {} cells taken over, {} finished (x{:.1})",
        p.time_s,
        p.covered * 100.0,
        p.taken_over,
        p.finished,
        p.scale
    )
}

#[cfg(test)]
mod tests {
    use skein_broker::config::Surroundings;
    use skein_interop::airframe::{self, BANK_DEG, ENDURANCE_S, FOOTPRINT_M, SPEED_MPS};
    use skein_interop::json::Document;
    use skein_netsim::spec::Spec;
    use skein_node::NodeConfig;
    use skein_peer::config::Airframe;
    use skein_scenario::{Overrides, builtin_files, builtin_names, builtin_text};
    use std::path::Path;

    fn resolved(name: &str, text: &str) -> Spec {
        let scenario =
            skein_scenario::parse_with(name, text, &builtin_files(), &Overrides::default());
        scenario.unwrap_or_else(|e| panic!("{e}")).spec
    }

    /// Every peer reads back what the trial writes for it.
    fn is_understood(spec: &Spec, seed: u64, dir: &Path) {
        let mission = serde_json::to_string(&*spec.mission).unwrap();
        std::fs::write(dir.join("mission.json"), mission).unwrap();
        let around = Surroundings {
            spec,
            seed,
            world: "127.0.0.1:65535".parse().unwrap(),
            token: "a token",
            links: vec!["127.0.0.1:1".parse().unwrap(); 3],
        };
        let file = dir.join("peer.json5");
        let read = |text: String| {
            std::fs::write(&file, &text).unwrap();
            let config = NodeConfig::load(&file).unwrap_or_else(|e| panic!("{e}\n{text}"));
            assert_eq!(config.peer.mission.as_deref(), Some(&*spec.mission));
            assert_eq!(config.peer.fleet, spec.fleet);
            assert_eq!(config.peer.beacon_period_ms, spec.beacon_period_ms);
            assert_eq!(config.peer.rate_bps, spec.radio.rate_bps);
            assert_eq!(config.queue_age_ms, spec.radio.queue_age_ms);
            assert_eq!(config.peer.objective, spec.objective);
            config.peer
        };
        for uav in &spec.uavs {
            let peer = read(around.uav(uav).to_string());
            // To the last bit: live and simulated peers plan with the same numbers.
            assert_eq!(peer.airframe, Some(uav.airframe));
            assert_eq!(peer.height_m.to_bits(), uav.height_m.to_bits());
            assert_eq!(peer.id.0, uav.id);
        }
        if let Some(ground) = &spec.ground {
            let peer = read(around.ground(ground).to_string());
            assert_eq!((peer.airframe, peer.id.0), (None, ground.id));
            assert_eq!(peer.height_m.to_bits(), ground.height_m.to_bits());
        }
    }

    /// Airframes with every value at an end of its limits.
    fn extremes() -> Vec<Airframe> {
        let mut all = Vec::new();
        for (stall_mps, cruise_mps) in [
            (SPEED_MPS.0, SPEED_MPS.0.next_up()),
            (SPEED_MPS.1.next_down(), SPEED_MPS.1),
        ] {
            for bank_deg in [BANK_DEG.0, BANK_DEG.1] {
                for side_m in [FOOTPRINT_M.0, FOOTPRINT_M.1] {
                    for endurance_s in [ENDURANCE_S.0, ENDURANCE_S.1] {
                        let text = format!(
                            "{{ stall_mps: {stall_mps}, cruise_mps: {cruise_mps}, max_mps: {cruise_mps},
                                bank_deg: {bank_deg}, endurance_s: {endurance_s}, reserve_s: {},
                                footprint: {{ across_m: {side_m}, along_m: {side_m} }} }}",
                            endurance_s.next_down()
                        );
                        let document = Document::parse("airframe", "", &text).unwrap();
                        all.push(airframe::read(&document.root(), None).unwrap());
                    }
                }
            }
        }
        all
    }

    #[test]
    fn every_peer_understands_what_a_trial_writes_for_it() {
        let dir = tempfile::tempdir().unwrap();
        for name in builtin_names() {
            let spec = resolved(name, builtin_text(name).unwrap());
            is_understood(&spec, spec.seed, dir.path());
        }
        // The ends of what a scenario may say, where the whole still makes sense.
        let text = builtin_text("helsinki").unwrap();
        for (from, to) in [
            ("bank_deg: 45", "bank_deg: 78"),
            ("bank_deg: 45", "bank_deg: 80"),
            ("level_m: 45", "level_m: 3700"),
            ("beacon_period_s: 1,", "beacon_period_s: 60,"),
            ("beacon_period_s: 1,", "beacon_period_s: 0.8,"),
            ("rate_bps: 64000,", "rate_bps: 1200,"),
            ("rate_bps: 64000,", "rate_bps: 1000000000,"),
            ("queue_age_ms: 2000,", "queue_age_ms: 1,"),
            ("queue_age_ms: 2000,", "queue_age_ms: 60000,"),
            ("seed: 1,", "seed: 4294967295, objective: \"energy\","),
            ("seed: 1,", "seed: 0, objective: \"distance\","),
        ] {
            assert!(text.contains(from), "{from}");
            let spec = resolved(to, &text.replace(from, to));
            is_understood(&spec, u64::MAX, dir.path());
        }
        let mut spec = resolved("extremes", text);
        let uav = spec.uavs[0].clone();
        let put = |airframe| skein_netsim::spec::UavSpec {
            id: u16::MAX,
            airframe,
            ..uav.clone()
        };
        spec.uavs = extremes().into_iter().map(put).collect();
        is_understood(&spec, 0, dir.path());
    }
}
