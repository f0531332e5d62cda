//! `skein chaos`: something goes wrong in a running trial, or is put right.

use crate::{cli, exit};
use clap::{Args, Subcommand};
use skein_broker::control::{Request, command};
use skein_broker::registry;
use skein_netsim::fault::{Fault, TimedFault};
use std::path::PathBuf;
use std::process::ExitCode;

/// Makes something go wrong in a running trial, or puts it right.
///
/// Finds the only running trial by itself; with several, choose one by `--trial`.
/// Prints what was done and what should follow. Peers are named `3` or `uav3`.
#[derive(Debug, Args)]
pub struct ChaosArgs {
    /// The trial, as it named itself when it began.
    #[arg(long, global = true, value_name = "ID")]
    pub trial: Option<String>,
    /// Puts it right again after this many seconds of scenario time: a restart after a
    /// kill, a resume after a pause, a heal after a cut.
    #[arg(long = "for", global = true, value_name = "SECONDS")]
    pub for_s: Option<u32>,
    /// What happens.
    #[command(subcommand)]
    pub what: What,
}

/// What happens.
#[derive(Debug, Subcommand)]
pub enum What {
    /// The process and the airframe are gone at once.
    Kill {
        /// Which peer.
        #[arg(value_parser = peer)]
        peer: u16,
    },
    /// The process ends at once; the airframe loiters by itself.
    KillComputer {
        /// Which peer.
        #[arg(value_parser = peer)]
        peer: u16,
    },
    /// The process is asked to end.
    Terminate {
        /// Which peer.
        #[arg(value_parser = peer)]
        peer: u16,
    },
    /// The process stands still.
    Pause {
        /// Which peer.
        #[arg(value_parser = peer)]
        peer: u16,
    },
    /// The process goes on.
    Resume {
        /// Which peer.
        #[arg(value_parser = peer)]
        peer: u16,
    },
    /// The process starts again, in a new airframe at the launch point if the old one
    /// is gone.
    Restart {
        /// Which peer.
        #[arg(value_parser = peer)]
        peer: u16,
        /// Without its journal.
        #[arg(long)]
        fresh_disk: bool,
    },
    /// The radio link between two peers is cut.
    Cut {
        /// One end.
        #[arg(value_parser = peer)]
        a: u16,
        /// The other end.
        #[arg(value_parser = peer)]
        b: u16,
        /// Only what the first sends to the second is lost.
        #[arg(long)]
        one_way: bool,
    },
    /// Links between groups are cut; peers in no group form one more.
    Partition {
        /// The groups, for example `1,3 4,6,8`.
        #[arg(required = true, value_parser = group)]
        groups: Vec<Group>,
    },
    /// All cuts and partitions end.
    Heal,
    /// From now on this share of all messages is lost.
    Loss {
        /// Percent, 0 to 100.
        #[arg(value_parser = percent)]
        percent: f64,
    },
    /// The faults of a file happen, at their times from now on.
    Plan {
        /// A list of faults as in a scenario; see `configs/chaos/`.
        file: PathBuf,
    },
}

/// Peers that stay together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Group(Vec<u16>);

/// A peer by its number, as people write it: `3` or `uav3`.
///
/// # Errors
/// When it names none.
pub(crate) fn peer(text: &str) -> Result<u16, String> {
    let digits = text.strip_prefix("uav").unwrap_or(text);
    digits
        .parse()
        .map_err(|_| format!("{text:?} names no peer; write 3 or uav3"))
}

fn group(text: &str) -> Result<Group, String> {
    text.split(',')
        .map(peer)
        .collect::<Result<_, _>>()
        .map(Group)
}

fn percent(text: &str) -> Result<f64, String> {
    let number = text.strip_suffix('%').unwrap_or(text).parse::<f64>();
    number
        .ok()
        .filter(|p| (0.0..=100.0).contains(p))
        .ok_or_else(|| "write a percentage from 0 to 100".to_owned())
}

/// Runs the verb.
///
/// # Errors
/// When there is no runtime.
pub fn run(args: &ChaosArgs) -> anyhow::Result<ExitCode> {
    let requests = match requests(args) {
        Ok(requests) => requests,
        Err((code, why)) => {
            eprintln!("error: {why}");
            return Ok(ExitCode::from(code));
        }
    };
    let trial = match registry::find(args.trial.as_deref()) {
        Ok(trial) => trial,
        Err(error) => {
            eprintln!("error: {error}");
            return Ok(ExitCode::from(exit::NO_PEERS));
        }
    };
    let runtime = cli::runtime()?;
    for request in requests {
        match runtime.block_on(command(&trial, &request)) {
            Ok(lines) => lines.iter().try_for_each(exit::print)?,
            Err(error) => {
                eprintln!("error: {error}");
                return Ok(ExitCode::from(exit::NO_PEERS));
            }
        }
    }
    Ok(ExitCode::from(exit::OK))
}

fn requests(args: &ChaosArgs) -> Result<Vec<Request>, (u8, String)> {
    if let What::Plan { file } = &args.what {
        let plan = skein_scenario::load_chaos_plan(file, None);
        return match plan {
            Ok(faults) => Ok(vec![Request::Later(faults)]),
            Err(error) => Err((exit::CONFIG_INVALID, error.to_string())),
        };
    }
    let fault = fault(&args.what).ok_or((exit::USAGE, "nothing to do".to_owned()))?;
    let mut requests = vec![Request::Fault(fault.clone())];
    if let Some(seconds) = args.for_s {
        let end = end(&fault).ok_or((exit::USAGE, "--for has no meaning here".to_owned()))?;
        requests.push(Request::Later(vec![TimedFault {
            at_ms: u64::from(seconds) * 1000,
            fault: end,
        }]));
    }
    Ok(requests)
}

fn fault(what: &What) -> Option<Fault> {
    Some(match what {
        What::Kill { peer } => Fault::Kill { peer: *peer },
        What::KillComputer { peer } => Fault::KillComputer { peer: *peer },
        What::Terminate { peer } => Fault::Terminate { peer: *peer },
        What::Pause { peer } => Fault::Pause { peer: *peer },
        What::Resume { peer } => Fault::Resume { peer: *peer },
        What::Restart { peer, fresh_disk } => Fault::Restart {
            peer: *peer,
            fresh_disk: *fresh_disk,
        },
        What::Cut { a, b, one_way } => Fault::Cut {
            a: *a,
            b: *b,
            one_way: *one_way,
        },
        What::Partition { groups } => Fault::Partition {
            groups: groups.iter().map(|g| g.0.clone()).collect(),
        },
        What::Heal => Fault::Heal,
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "0 to 1000"
        )]
        What::Loss { percent } => Fault::Loss {
            permille: (percent * 10.0).round() as u16,
        },
        What::Plan { .. } => return None,
    })
}

/// What puts a fault right.
fn end(fault: &Fault) -> Option<Fault> {
    match fault {
        Fault::Kill { peer } | Fault::KillComputer { peer } | Fault::Terminate { peer } => {
            Some(Fault::Restart {
                peer: *peer,
                fresh_disk: false,
            })
        }
        Fault::Pause { peer } => Some(Fault::Resume { peer: *peer }),
        Fault::Cut { .. } | Fault::Partition { .. } => Some(Fault::Heal),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peers_and_groups_are_read_as_people_write_them() {
        assert_eq!(peer("uav12"), Ok(12));
        assert_eq!(peer("7"), Ok(7));
        assert!(peer("uav").is_err() && peer("70000").is_err());
        assert_eq!(group("1,uav3"), Ok(Group(vec![1, 3])));
        assert!(percent("101").is_err() && percent("NaN").is_err());
    }
}
