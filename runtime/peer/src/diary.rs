//! What a peer remembers of the last minutes for people alone: nothing it does depends on it.

use crate::PeerId;
use crate::input::Time;
use crate::output::{Report, Status};
use crate::protocol::rounds::{RoundOrder, order_of};
use crate::why::{BidHeard, LastRound, PastEvent};
use crate::wire::message::Bid;
use std::collections::{BTreeMap, VecDeque};

/// Events that are remembered.
const EVENTS: usize = 20;

/// Peers of whom it is remembered since when they are believed what they are: as many as the
/// membership knows.
const PEERS: usize = 255;

/// The longest text of an event that is remembered, bytes.
const TEXT_MAX_BYTES: usize = 200;

/// What was remembered.
#[derive(Debug, Default)]
pub(crate) struct Diary {
    events: VecDeque<(Time, String)>,
    /// The highest round of which a bid was heard or spoken.
    round: Option<(RoundOrder, LastRound, Time)>,
    /// Since when somebody is believed what it is; as many as the membership knows.
    since: BTreeMap<PeerId, (Status, Time)>,
}

impl Diary {
    /// Something was reported.
    pub fn note(&mut self, now: Time, report: &Report) {
        if let Report::Membership { peer, status, .. } = report {
            self.since.insert(*peer, (*status, now));
            if self.since.len() > PEERS {
                self.since.pop_first();
            }
        }
        let Some(mut text) = told(report) else {
            return;
        };
        let end = (0..=TEXT_MAX_BYTES.min(text.len())).rev();
        text.truncate(
            end.into_iter()
                .find(|i| text.is_char_boundary(*i))
                .unwrap_or(0),
        );
        if self.events.len() == EVENTS {
            self.events.pop_front();
        }
        self.events.push_back((now, text));
    }

    /// A bid was heard, or spoken by this peer.
    pub fn note_bid(&mut self, now: Time, author: u16, bid: &Bid) {
        let order = order_of(&bid.round);
        if self.round.as_ref().is_none_or(|(held, ..)| *held < order) {
            let round = LastRound {
                counter: bid.round.counter,
                members: bid.round.members.iter().map(|m| m.id).collect(),
                repair: bid.round.repair,
                wait_ms: bid.round.wait_ms,
                first_bid_ms_ago: 0,
                bids: Vec::new(),
            };
            self.round = Some((order, round, now));
        }
        if let Some((held, round, _)) = &mut self.round
            && *held == order
            && round.members.contains(&author)
            && round.bids.iter().all(|b| b.by != author)
        {
            round.bids.push(BidHeard::of(author, bid));
        }
    }

    /// The last events, the oldest first.
    pub fn events(&self, now: Time) -> Vec<PastEvent> {
        let told = |(at, text): &(Time, String)| PastEvent {
            ms_ago: now.since_ms(*at),
            text: text.clone(),
        };
        self.events.iter().map(told).collect()
    }

    /// The highest round of which a bid is known.
    pub fn round(&self, now: Time) -> Option<LastRound> {
        let (_, round, at) = self.round.as_ref()?;
        Some(LastRound {
            first_bid_ms_ago: now.since_ms(*at),
            ..round.clone()
        })
    }

    /// How long somebody has been believed what it is.
    pub fn since_ms(&self, now: Time, peer: u16) -> Option<u64> {
        self.since
            .get(&PeerId(peer))
            .map(|(_, at)| now.since_ms(*at))
    }
}

/// An event for a person; nothing of what comes with every cell.
fn told(report: &Report) -> Option<String> {
    Some(match report {
        Report::Covered { .. } => return None,
        Report::Booted { incarnation } => format!("began life {incarnation}"),
        Report::Ready {
            revision, cells, ..
        } => format!("follows revision {revision}, a loop of {cells} cells"),
        Report::Membership { peer, status, .. } => {
            let believed = match status {
                Status::Alive => "alive",
                Status::Suspect => "suspect",
                Status::Down => "down",
            };
            format!("believes {peer} {believed}")
        }
        Report::Round {
            counter, members, ..
        } => {
            format!("bid in round {counter} of {} members", members.len())
        }
        Report::Claim {
            counter,
            take,
            legs,
            held,
            ..
        } => {
            let cells: u32 = legs.iter().map(|l| u32::from(l.count)).sum();
            format!(
                "claimed {cells} cells, {} held, epoch {counter} take {take}",
                held.len()
            )
        }
        Report::Finished { revision } => format!("believes revision {revision} finished"),
        Report::Revised { mission } => format!("was given revision {}", mission.revision),
        Report::Found { mission } => crate::found_obstacles::sentence(mission),
        Report::Task { name, news, .. } => news.sentence(name),
        Report::Detected { id, told } => told.sentence(id.author),
        Report::Crowd { told } => told.sentence(),
        Report::Traced { .. } => crate::trails::sentence(report),
        Report::Silenced => "was silenced: another process speaks under this id".to_owned(),
        Report::Alarm { text } => format!("alarm: {text}"),
        Report::Refused { reason } => format!("refused: {reason}"),
    })
}
