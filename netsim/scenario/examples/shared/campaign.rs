//! Several scenarios, each with several numbers of UAVs and seeds, every run to its verdict.

use super::shared;
use core::fmt::{Display, Formatter};
use skein_netsim::fault::TimedFault;
use skein_netsim::prepared::Prepared;
use skein_netsim::runs::{Wanted, failure_free_makespan_ms, faults_of, run};
use skein_netsim::swarm::Outcome;
use skein_scenario::Seeds;
use std::process::ExitCode;

/// What the arguments ask for: scenarios, numbers of UAVs, seeds, what goes wrong, and `timeline`
/// for all that happened.
pub struct Campaign {
    names: Vec<String>,
    uavs: Vec<u16>,
    seeds: Seeds,
    wrong: String,
    timeline: bool,
}

/// One run, and of what it is one.
pub struct Flown<'a> {
    pub name: &'a str,
    pub uavs: u16,
    pub seed: u64,
    pub outcome: &'a Outcome,
}

/// Of what it is a run, and whether it passed.
impl Display for Flown<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> core::fmt::Result {
        let passed = self.outcome.report.passed;
        let verdict = if passed { "passed" } else { "FAILED" };
        let Self {
            name, uavs, seed, ..
        } = self;
        write!(f, "{name} {uavs} uavs, seed {seed}: {verdict}")
    }
}

impl Flown<'_> {
    /// When all was seen, and when it was over.
    #[allow(dead_code, reason = "each example tells what it is about")]
    pub fn times(&self) -> String {
        let r = &self.outcome.report;
        format!("over {:?} ms, end {} ms", r.makespan_ms, r.end_ms)
    }
}

/// What an example makes of its runs.
pub trait Teller {
    /// What happens besides, in a storm and where nothing goes wrong.
    fn besides(&self, _prepared: &Prepared) -> Vec<TimedFault> {
        Vec::new()
    }

    /// A run is over; the rules that it broke are told after.
    fn tell(&mut self, flown: &Flown<'_>);

    /// All seeds of a scenario with so many UAVs are over.
    fn conclude(&mut self, _name: &str, _uavs: u16) {}
}

impl Campaign {
    /// By the arguments, and what is flown where there are none.
    pub fn of_arguments(names: &str, uavs: &str) -> Result<Self, ExitCode> {
        let args: Vec<String> = std::env::args().skip(1).collect();
        let arg = |i: usize, default: &str| args.get(i).map_or(default, String::as_str).to_owned();
        let numbers = arg(1, uavs);
        Ok(Self {
            names: arg(0, names).split(',').map(str::to_owned).collect(),
            uavs: numbers.split(',').filter_map(|n| n.parse().ok()).collect(),
            seeds: shared::seeds(&arg(2, "1..2"))?,
            wrong: arg(3, ""),
            timeline: args.iter().any(|a| a == "timeline"),
        })
    }

    /// Flies all of it. Exit code 1 where a run did not pass.
    pub fn fly(&self, teller: &mut impl Teller) -> ExitCode {
        self.fly_all(teller).unwrap_or_else(|code| code)
    }

    fn fly_all(&self, teller: &mut impl Teller) -> Result<ExitCode, ExitCode> {
        let mut passed = true;
        for name in &self.names {
            for &uavs in &self.uavs {
                let prepared = Prepared::new(shared::scenario(name, uavs, None)?.spec);
                let storms = self.wrong == "storm";
                let free_ms = storms.then(|| failure_free_makespan_ms(&prepared));
                for seed in self.seeds.from..self.seeds.to {
                    let wanted = Wanted {
                        events: self.timeline,
                        ..Wanted::default()
                    };
                    let (struck, faults) = self.faults_of(&prepared, seed, free_ms, teller);
                    let outcome = run(&struck, seed, faults, wanted);
                    passed &= outcome.report.passed;
                    teller.tell(&Flown {
                        name,
                        uavs,
                        seed,
                        outcome: &outcome,
                    });
                    self.tell_of(&outcome);
                }
                teller.conclude(name, uavs);
            }
        }
        Ok(if passed {
            ExitCode::SUCCESS
        } else {
            ExitCode::FAILURE
        })
    }

    /// What happens to which UAVs in a seed: what the `storm` draws, whose makespan without faults
    /// is given, nothing where that is `calm` or `none`, or else the faults of the scenario.
    fn faults_of(
        &self,
        prepared: &Prepared,
        seed: u64,
        free_ms: Option<u64>,
        teller: &impl Teller,
    ) -> (Prepared, Vec<TimedFault>) {
        let is_calm = ["calm", "none"].contains(&self.wrong.as_str());
        let (struck, mut faults) = if is_calm {
            (prepared.clone(), Vec::new())
        } else {
            faults_of(prepared, seed, free_ms)
        };
        if is_calm || free_ms.is_some() {
            faults.extend(teller.besides(prepared));
            faults.sort_by_key(|f| f.at_ms);
        }
        (struck, faults)
    }

    /// Rules that were broken, and what happened where that is asked for.
    fn tell_of(&self, outcome: &Outcome) {
        for v in outcome.violations() {
            println!(
                "  {} at {} ms, {:?}: {}",
                v.check, v.time_ms, v.peer, v.text
            );
        }
        if self.timeline {
            println!("{}", skein_netsim::timeline::timeline(&outcome.entries));
        }
    }
}
