//! Faults of a trial: which are still to come, and what each does to processes,
//! airframes and links, with what should follow.

use crate::live_peer::LivePeer;
use crate::live_world::LiveWorld;
use crate::peers::Peers;
use crate::registry::ConsoleEntry;
use skein_console::{Answer, Command, NewZone, Token, ask};
use skein_netsim::account::{Account, Cause, secs};
use skein_netsim::fault::{Fault, TimedFault};
use skein_peer::input::TaskEdit;
use std::time::Duration;

/// Faults that wait for their times; a plan of a person is shorter.
const MAX_DUE: usize = 1000;

/// How long the ground station may take to judge a mission and speak it.
const CONSOLE_TIMEOUT: Duration = Duration::from_secs(20);

/// A fault that has not happened yet.
#[derive(Clone, Debug)]
struct Due {
    timed: TimedFault,
    /// Whether the scenario wants it.
    scenario: bool,
}

/// The faults that are still to come.
#[derive(Clone, Debug)]
pub(crate) struct Schedule {
    due: Vec<Due>,
    /// Whether somebody made something go wrong by hand.
    by_hand: bool,
}

impl Schedule {
    /// Those of a scenario.
    pub(crate) fn new(faults: &[TimedFault]) -> Self {
        let due = |timed: &TimedFault| Due {
            timed: timed.clone(),
            scenario: true,
        };
        Self {
            due: faults.iter().map(due).collect(),
            by_hand: false,
        }
    }

    /// Somebody makes something go wrong by hand: whom the scenario wants killed may be gone.
    pub(crate) fn note_by_hand(&mut self) {
        self.by_hand = true;
    }

    /// The next fault that is due by now, and whether the run fails without it: the scenario
    /// wants it, and nobody came before it.
    pub(crate) fn take_due(&mut self, now_ms: u64) -> Option<(Fault, bool)> {
        let at = self.due.iter().position(|f| f.timed.at_ms <= now_ms)?;
        let Due { timed, scenario } = self.due.remove(at);
        Some((timed.fault, scenario && !self.by_hand))
    }

    /// Adds faults whose times count from now.
    pub(crate) fn later(&mut self, now_ms: u64, faults: Vec<TimedFault>) -> Answer {
        if self.due.len() + faults.len() > MAX_DUE {
            return Err(format!("more than {MAX_DUE} faults are waiting"));
        }
        let mut lines = Vec::new();
        for timed in faults {
            let at_ms = timed.at_ms.saturating_add(now_ms);
            lines.push(format!("at {:.0} s: {:?}", secs(at_ms), timed.fault));
            self.due.push(Due {
                timed: TimedFault {
                    at_ms,
                    fault: timed.fault,
                },
                scenario: false,
            });
        }
        self.due.sort_by_key(|f| f.timed.at_ms);
        Ok(lines)
    }

    /// The scenario's faults for which the trial was over too soon: it did not show what
    /// it was to show.
    pub(crate) fn missed(&self) -> Vec<String> {
        let missed = self.due.iter().filter(|f| f.scenario);
        missed
            .map(|f| {
                format!(
                    "over before the fault at {:.0} s: {:?}",
                    secs(f.timed.at_ms),
                    f.timed.fault
                )
            })
            .collect()
    }
}

/// Carries faults out.
pub(crate) struct Injector<'a> {
    /// Whose processes are concerned.
    pub(crate) peers: &'a mut Peers,
    /// Whose airframes and links.
    pub(crate) world: &'a mut LiveWorld,
    /// What is told of them.
    pub(crate) account: &'a mut Account,
    /// The ground station and its console, once it is up.
    pub(crate) console: Option<(u16, &'a ConsoleEntry)>,
    /// Scenario time, milliseconds.
    pub(crate) now_ms: u64,
    /// Beacon period T, seconds.
    pub(crate) period_s: f64,
}

impl Injector<'_> {
    /// Carries out a fault and says what should follow.
    pub(crate) async fn inject(&mut self, fault: &Fault) -> Answer {
        match fault {
            Fault::Kill { peer } => self.kill(*peer, Cause::Killed).await,
            Fault::KillComputer { peer } => self.kill(*peer, Cause::ComputerKilled).await,
            Fault::Terminate { peer } => self.terminate(*peer),
            Fault::Pause { peer } => self.pause(*peer),
            Fault::Resume { peer } => self.resume(*peer),
            Fault::Restart { peer, fresh_disk } => self.restart(*peer, *fresh_disk).await,
            Fault::Cut { .. } | Fault::Partition { .. } | Fault::Heal | Fault::Loss { .. } => {
                self.links(fault)
            }
            Fault::Rebase { east_mm, north_mm } => {
                self.operate(&Command::Base((*east_mm, *north_mm))).await
            }
            Fault::Order { order, uav } => self.operate(&Command::order(*uav, *order)).await,
            Fault::AddZone { name, ring } => {
                let zone = NewZone {
                    name: Some(name.clone()),
                    ring: ring.clone(),
                };
                self.operate(&Command::AddZones(vec![zone])).await
            }
            Fault::RemoveZone { name } => self.operate(&Command::RemoveZone(name.clone())).await,
            Fault::AddTask { task } => {
                let edit = TaskEdit::Add(task.clone());
                self.operate(&Command::Task(edit)).await
            }
            Fault::CancelTask { name } => {
                let edit = TaskEdit::Cancel(name.clone());
                self.operate(&Command::Task(edit)).await
            }
            Fault::DoneTask { name } => {
                let edit = TaskEdit::Done(name.clone());
                self.operate(&Command::Task(edit)).await
            }
            Fault::Revise { .. } => {
                Err("another mission is given by `skein mission revise`".to_owned())
            }
            Fault::FailStores { .. }
            | Fault::SlowStores { .. }
            | Fault::HealStores { .. }
            | Fault::SlowComputer { .. }
            | Fault::ClockDrift { .. }
            | Fault::ClockJump { .. }
            | Fault::ShortFuel { .. }
            | Fault::SpoiltRecord { .. }
            | Fault::Twin { .. } => Err(
                "disks, slow computers, clocks, batteries, records and ids go wrong in simulated runs only: `skein sim`"
                    .to_owned(),
            ),
        }
    }

    /// Says something at the console of the ground station, as an operator does.
    async fn operate(&self, command: &Command) -> Answer {
        let console = self.console.filter(|(id, _)| self.peers.on_air(*id));
        let (_, console) = console.ok_or("there is no ground station to speak it")?;
        let token = Token::read(&console.token_file).map_err(|e| e.to_string())?;
        match tokio::time::timeout(CONSOLE_TIMEOUT, ask(console.at, &token, command)).await {
            Ok(said) => said.map_err(|e| e.to_string()),
            Err(_) => Err("the ground station does not answer".to_owned()),
        }
    }

    async fn kill(&mut self, id: u16, cause: Cause) -> Answer {
        let computer_only = !cause.takes_airframe();
        let since = self.since(id);
        let peer = self.peers.known(id)?;
        if !peer.has_process() && (computer_only || !peer.airborne()) {
            return Err(format!("{} does not run{since}", peer.name()));
        }
        peer.kill().await;
        if !computer_only {
            peer.lose_airframe();
        }
        let held = self.account.ended(self.now_ms, id, cause);
        if !self.peers.known(id)?.flies() {
            return Ok(vec![format!("{} is gone", self.peers.name(id))]);
        }
        if computer_only {
            self.world.set_computer(id, false);
        } else {
            self.world.remove(id);
        }
        let what = if computer_only {
            "the computer of uav"
        } else {
            "uav"
        };
        let mut lines = vec![format!(
            "{what}{id} is gone; it held {} uncovered cells",
            held.cells
        )];
        lines.push(self.expect_down(id));
        if held.cells > 0 {
            lines.push(self.expect_takeover());
        }
        if computer_only {
            lines.push(format!("expect: its airframe loiters by itself after 1 s; `skein chaos restart {id}` revives it"));
        }
        Ok(lines)
    }

    fn terminate(&mut self, id: u16) -> Answer {
        self.running(id)?.terminate();
        let held = self.account.ended(self.now_ms, id, Cause::Terminated);
        Ok(vec![
            format!(
                "{} is asked to end; it held {} uncovered cells",
                self.peers.name(id),
                held.cells
            ),
            self.expect_down(id),
        ])
    }

    /// Since when a peer that ended does not run, and what brings it back.
    fn since(&self, id: u16) -> String {
        self.account.ended_ms(id).map_or_else(String::new, |ms| {
            format!(
                ": it ended at {:.1} s; `skein chaos restart {id}` starts it again",
                secs(ms)
            )
        })
    }

    fn running(&mut self, id: u16) -> Result<&mut LivePeer, String> {
        let since = self.since(id);
        let peer = self.peers.known(id)?;
        if peer.runs() {
            Ok(peer)
        } else {
            Err(format!("{} does not run{since}", peer.name()))
        }
    }

    fn pause(&mut self, id: u16) -> Answer {
        self.running(id)?.pause();
        self.account.paused(self.now_ms, id);
        let (name, flies) = (self.peers.name(id), self.peers.known(id)?.flies());
        let loiters = if flies {
            "; its airframe loiters by itself after 1 s"
        } else {
            ""
        };
        let text = format!("{name} stands still{loiters}");
        Ok(vec![text, self.expect_down(id)])
    }

    fn resume(&mut self, id: u16) -> Answer {
        if !self.peers.known(id)?.resume() {
            return Err(format!("{} is not paused", self.peers.name(id)));
        }
        self.account.resumed(self.now_ms, id);
        Ok(vec![
            format!("{} goes on", self.peers.name(id)),
            format!(
                "expect: it speaks within {:.0} s, and yields cells that others have listed since",
                2.0 * self.period_s
            ),
        ])
    }

    async fn restart(&mut self, id: u16, fresh_disk: bool) -> Answer {
        let peer = self.peers.known(id)?;
        peer.kill().await;
        let (flies, airborne) = (peer.flies(), peer.airborne());
        if fresh_disk {
            peer.wipe();
        }
        // Its last words must not be taken for the new life's.
        let radio = peer.take_radio();
        self.account.radio(&radio);
        self.account.ended(self.now_ms, id, Cause::ComputerKilled);
        if flies && !airborne {
            self.world.relaunch(id);
        } else {
            self.world.set_computer(id, true);
        }
        self.peers.start(id)?;
        self.account.restarted(self.now_ms, id, fresh_disk);
        let disk = if fresh_disk {
            "without its journal"
        } else {
            "with its journal"
        };
        let place = if flies && !airborne {
            "at its launch point"
        } else {
            "where it is"
        };
        Ok(vec![
            format!("{} starts again {place}, {disk}", self.peers.name(id)),
            format!(
                "expect: a higher incarnation after {:.0} s of listening, and use within {:.0} s more",
                3.0 * self.period_s,
                20.0 * self.period_s
            ),
        ])
    }

    fn links(&mut self, fault: &Fault) -> Answer {
        let named: Vec<u16> = match fault {
            Fault::Cut { a, b, .. } => vec![*a, *b],
            Fault::Partition { groups } => groups.concat(),
            _ => Vec::new(),
        };
        for peer in named {
            self.peers.known(peer)?;
        }
        self.world.fault(fault);
        let name = |id| self.peers.name(id);
        let text = match fault {
            Fault::Cut {
                a,
                b,
                one_way: true,
            } => format!("the link from {} to {} is cut", name(*a), name(*b)),
            Fault::Cut { a, b, .. } => {
                format!("the link between {} and {} is cut", name(*a), name(*b))
            }
            Fault::Partition { groups } => format!("the swarm is cut into {groups:?} and the rest"),
            Fault::Heal => "all cuts are healed".to_owned(),
            Fault::Loss { permille } => format!(
                "{:.1} % of all messages are lost",
                f64::from(*permille) / 10.0
            ),
            _ => String::new(),
        };
        let follows = match fault {
            Fault::Cut { .. } => "expect: records go round by other peers; nobody is declared down while a way round exists".to_owned(),
            Fault::Partition { .. } => {
                let (_, down_s) = self.bounds_s();
                format!("expect: each side believes the other gone within {down_s:.0} s and plans alone; nothing is left out")
            }
            Fault::Heal => "expect: the sides know of each other within a few beacons, and duplicates are yielded".to_owned(),
            _ => "expect: the same, later; detection keeps its bound".to_owned(),
        };
        Ok(vec![text, follows])
    }

    /// When a silent peer is suspected and when it is known to be down everywhere in
    /// its component, seconds: (k1, k1 + k2 + D + 2) periods.
    fn bounds_s(&self) -> (f64, f64) {
        let (period_s, peers) = (self.period_s, &self.peers);
        let d = f64::from(self.world.diameter(|id| peers.on_air(id)));
        let (k1, k2) = (4.0 + d / 4.0, 4.0 + d / 2.0);
        (k1 * period_s, (k1 + k2 + d + 2.0) * period_s)
    }

    fn expect_down(&self, peer: u16) -> String {
        let (suspect_s, down_s) = self.bounds_s();
        format!(
            "expect: {} suspected within {suspect_s:.0} s, down everywhere within {down_s:.0} s of scenario time",
            self.peers.name(peer)
        )
    }

    fn expect_takeover(&self) -> String {
        let live = self
            .account
            .live_uavs()
            .iter()
            .map(|id| format!("uav{id}"))
            .collect::<Vec<_>>()
            .join(", ");
        format!("expect: its cells listed soon after by some of {live}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(at_ms: u64, peer: u16) -> TimedFault {
        TimedFault {
            at_ms,
            fault: Fault::Kill { peer },
        }
    }

    #[test]
    fn faults_come_at_their_times_and_those_of_the_scenario_are_missed() {
        let mut s = Schedule::new(&[at(2_000, 1), at(90_000, 2)]);
        s.later(1_000, vec![at(500, 3), at(99_000, 4)]).unwrap();
        assert_eq!(s.take_due(1_499), None);
        assert_eq!(s.take_due(2_000), Some((Fault::Kill { peer: 3 }, false)));
        assert_eq!(s.take_due(2_000), Some((Fault::Kill { peer: 1 }, true)));
        assert_eq!(s.take_due(2_000), None);
        assert_eq!(
            s.missed(),
            ["over before the fault at 90 s: Kill { peer: 2 }"]
        );
    }

    #[test]
    fn whoever_is_killed_by_hand_need_not_be_killed_by_the_scenario() {
        let mut s = Schedule::new(&[at(2_000, 1)]);
        s.note_by_hand();
        assert_eq!(s.take_due(2_000), Some((Fault::Kill { peer: 1 }, false)));
    }

    #[test]
    fn a_plan_of_a_person_has_an_end() {
        let mut s = Schedule::new(&[]);
        assert!(s.later(0, vec![at(1, 1); MAX_DUE]).is_ok());
        assert!(s.later(0, vec![at(1, 1)]).is_err());
    }
}
