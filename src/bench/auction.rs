//! `skein bench auction`: tasks shared by auction, beside the published algorithm.

use super::share;
use crate::exit;
use clap::Args;
use skein_broker::auctions;
use skein_netsim::auctions::Setup;
use skein_netsim::auctions::totals::{Column, Totals};
use skein_scenario::Seeds;
use std::num::NonZeroUsize;
use std::process::ExitCode;

/// UAVs that share tasks by auction, over a channel of rounds (docs/protocol.md §12).
///
/// A mixed fleet and pinpoint, line, area, track and relay tasks lie in 4 by 4 km. In a round
/// everybody says one thing, and neighbours hear it. Beside it, on the same instances and the
/// same channel, the consensus-based bundle algorithm as published. Exit code 1 if the auction
/// came to no agreement, left a conflict or a task, or was worth less than sequential greedy.
#[derive(Debug, Args)]
pub struct AuctionArgs {
    /// UAVs.
    #[arg(long, value_name = "N", default_value_t = 8,
          value_parser = clap::value_parser!(u16).range(1..=64))]
    pub n: u16,
    /// Tasks.
    #[arg(long, value_name = "M", default_value_t = 24,
          value_parser = clap::value_parser!(u16).range(0..=200))]
    pub tasks: u16,
    /// The seeds: from A up to but not including B.
    #[arg(long, value_name = "A..B")]
    pub seeds: Seeds,
    /// The share of messages that is lost, drawn for each listener by itself.
    #[arg(long, value_name = "L", default_value_t = 0.0, value_parser = share)]
    pub loss: f64,
    /// Hops between the two UAVs that are farthest apart; at most one less than UAVs.
    #[arg(long, value_name = "D", default_value_t = 2,
          value_parser = clap::value_parser!(u16).range(1..=16))]
    pub hops: u16,
    /// Begins in two halves that do not hear each other, commit to their first tasks and meet
    /// after 57 rounds; rounds are counted from then on.
    #[arg(long)]
    pub partition: bool,
    /// Prints one JSON object with all figures.
    #[arg(long)]
    pub json: bool,
    /// Runs at the same time; without it one a processor.
    #[arg(long, value_name = "J")]
    pub jobs: Option<NonZeroUsize>,
}

/// Runs the verb.
///
/// # Errors
/// When stdout cannot be written.
pub fn run(args: &AuctionArgs) -> anyhow::Result<ExitCode> {
    let hops = args.hops.min(args.n.saturating_sub(1)).max(1);
    if hops < args.hops {
        eprintln!("note: {} UAVs are {hops} hops apart at most", args.n);
    }
    let setup = Setup {
        n: args.n,
        tasks: args.tasks,
        hops,
        loss: args.loss,
        partition: args.partition,
    };
    let totals = auctions::settle(setup, args.seeds.from..args.seeds.to, args.jobs);
    let text = if args.json {
        serde_json::to_string(&totals)?
    } else {
        table(&totals)
    };
    exit::print(text)?;
    let good = totals.failed_seeds.is_empty() && totals.registers.runs > 0;
    Ok(ExitCode::from(if good {
        exit::OK
    } else {
        exit::MISSION_FAILED
    }))
}

/// Both algorithms, side by side.
fn table(totals: &Totals) -> String {
    let (ours, theirs) = (&totals.registers, &totals.cbba);
    let ratio = |r: Option<f64>| r.map_or("-".to_owned(), |r| format!("{r:.4}"));
    let rounds = |r: Option<u32>| r.map_or("-".to_owned(), |r| r.to_string());
    type Figure<'a> = (&'a str, Box<dyn Fn(&Column) -> String>);
    let figures: Vec<Figure<'_>> = vec![
        ("runs", Box::new(|c| c.runs.to_string())),
        ("without agreement", Box::new(|c| c.disagreed.to_string())),
        ("conflicts", Box::new(|c| c.conflicts.to_string())),
        ("unassigned", Box::new(|c| c.unassigned.to_string())),
        (
            "value / greedy",
            Box::new(move |c| ratio(c.value_ratio_greedy)),
        ),
        (
            "  least",
            Box::new(move |c| ratio(c.value_ratio_greedy_min)),
        ),
        (
            "value / optimum",
            Box::new(move |c| ratio(c.value_ratio_optimum)),
        ),
        (
            "  least",
            Box::new(move |c| ratio(c.value_ratio_optimum_min)),
        ),
        ("rounds p50", Box::new(move |c| rounds(c.rounds_p50))),
        ("rounds p99", Box::new(move |c| rounds(c.rounds_p99))),
        ("messages", Box::new(|c| format!("{:.0}", c.messages))),
        ("bytes", Box::new(|c| format!("{:.0}", c.bytes))),
    ];
    let mut text = format!("{:<18}{:>12}{:>12}", "", "registers", "CBBA");
    for (name, of) in figures {
        text += &format!("\n{name:<18}{:>12}{:>12}", of(ours), of(theirs));
    }
    if !totals.failed_seeds.is_empty() {
        text += &format!("\nfailed seeds: {:?}", totals.failed_seeds);
    }
    text
}
