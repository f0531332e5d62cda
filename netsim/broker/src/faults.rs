//! Faults, carried out: on processes, airframes and links; and what should follow.

use crate::ledger::secs;
use crate::member::{Computer, Member};
use crate::trial::{Due, Trial};
use nix::sys::signal::Signal;
use skein_console::{Answer, Command, Token, ask};
use skein_netsim::fault::{Fault, TimedFault};
use std::time::Duration;

/// Faults that wait for their times; a plan of a person is shorter.
const MAX_DUE: usize = 1000;

/// How long the ground station may take to judge a mission and speak it.
const CONSOLE_TIMEOUT: Duration = Duration::from_secs(20);

impl Trial<'_> {
    /// Carries out what is due by now, in the order of the times.
    pub(crate) async fn carry_out_due(&mut self) {
        while let Some(at) = self
            .faults
            .iter()
            .position(|f| f.timed.at_ms <= self.now_ms)
        {
            let Due { timed, scenario } = self.faults.remove(at);
            if let Err(why) = self.inject(&timed.fault).await {
                let text = format!("a fault could not be carried out: {:?}: {why}", timed.fault);
                self.note(text.clone());
                if scenario {
                    self.ledger.failures.push(text);
                }
            }
        }
    }

    /// Takes faults whose times count from now.
    pub(crate) fn later(&mut self, faults: Vec<TimedFault>) -> Answer {
        if self.faults.len() + faults.len() > MAX_DUE {
            return Err(format!("more than {MAX_DUE} faults are waiting"));
        }
        let mut lines = Vec::new();
        for timed in faults {
            let at_ms = timed.at_ms.saturating_add(self.now_ms);
            lines.push(format!("at {:.0} s: {:?}", secs(at_ms), timed.fault));
            self.faults.push(Due {
                timed: TimedFault {
                    at_ms,
                    fault: timed.fault,
                },
                scenario: false,
            });
        }
        self.faults.sort_by_key(|f| f.timed.at_ms);
        Ok(lines)
    }

    /// A scenario whose faults did not all happen did not show what it was to show.
    pub(crate) fn name_missed(&mut self) {
        for missed in self.faults.iter().filter(|f| f.scenario) {
            let text = format!(
                "over before the fault at {:.0} s: {:?}",
                secs(missed.timed.at_ms),
                missed.timed.fault
            );
            self.ledger.failures.push(text);
        }
    }

    /// Carries out a fault and says what should follow.
    pub(crate) async fn inject(&mut self, fault: &Fault) -> Answer {
        let lines = match fault {
            Fault::Kill { peer } => self.kill(*peer, false).await?,
            Fault::KillComputer { peer } => self.kill(*peer, true).await?,
            Fault::Terminate { peer } => self.terminate(*peer)?,
            Fault::Pause { peer } => self.pause(*peer)?,
            Fault::Resume { peer } => self.resume(*peer)?,
            Fault::Restart { peer, fresh_disk } => self.restart(*peer, *fresh_disk).await?,
            Fault::Cut { .. } | Fault::Partition { .. } | Fault::Heal | Fault::Loss { .. } => {
                self.links(fault)?
            }
            Fault::Rebase { east_mm, north_mm } => {
                self.operate(&Command::Base((*east_mm, *north_mm))).await?
            }
        };
        if let Some(text) = lines.first() {
            self.note(text.clone());
        }
        Ok(lines)
    }

    fn known(&mut self, peer: u16) -> Result<&mut Member, String> {
        let known = self
            .members
            .keys()
            .map(|id| format!("uav{id}"))
            .collect::<Vec<_>>()
            .join(" ");
        self.members
            .get_mut(&peer)
            .ok_or_else(|| format!("there is no uav{peer}; there are {known}"))
    }

    /// Says something at the console of the ground station, as an operator does.
    async fn operate(&self, command: &Command) -> Answer {
        let ground = self.spec.ground.as_ref().map(|g| g.id);
        let runs = |m: &&Member| m.computer == Computer::Runs;
        let console = ground
            .and_then(|id| self.members.get(&id))
            .filter(runs)
            .and(self.registered.console())
            .ok_or("there is no ground station to speak it")?;
        let token = Token::read(&console.token_file).map_err(|e| e.to_string())?;
        match tokio::time::timeout(CONSOLE_TIMEOUT, ask(console.at, &token, command)).await {
            Ok(said) => said.map_err(|e| e.to_string()),
            Err(_) => Err("the ground station does not answer".to_owned()),
        }
    }

    async fn kill(&mut self, peer: u16, computer_only: bool) -> Answer {
        let now_ms = self.now_ms;
        let member = self.known(peer)?;
        if !matches!(member.computer, Computer::Runs | Computer::Paused)
            && (computer_only || !member.airborne)
        {
            return Err(format!("uav{peer} does not run"));
        }
        member.computer = Computer::Off;
        if let Some(process) = &mut member.process {
            process.kill().await;
        }
        let flies = member.flies;
        if !computer_only {
            member.airborne = false;
        }
        if !flies {
            return Ok(vec![format!("the ground station uav{peer} is gone")]);
        }
        if !computer_only {
            self.world.remove(peer);
        } else {
            self.world.set_computer(peer, false);
        }
        let cells = self.ledger.killed(now_ms, peer, computer_only);
        let what = if computer_only {
            "the computer of uav"
        } else {
            "uav"
        };
        let mut lines = vec![format!(
            "{what}{peer} is gone; it held {cells} uncovered cells"
        )];
        lines.push(self.expect_down(peer));
        if cells > 0 {
            lines.push(self.expect_takeover());
        }
        if computer_only {
            lines.push(format!("expect: its airframe loiters by itself after 1 s; `skein chaos restart {peer}` revives it"));
        }
        Ok(lines)
    }

    fn terminate(&mut self, peer: u16) -> Answer {
        let now_ms = self.now_ms;
        let member = self.known(peer)?;
        if member.computer != Computer::Runs {
            return Err(format!("uav{peer} does not run"));
        }
        member.computer = Computer::Off;
        member.left = true;
        if let Some(process) = &mut member.process {
            process.signal(Signal::SIGTERM);
        }
        let cells = if member.flies {
            self.ledger.killed(now_ms, peer, true)
        } else {
            0
        };
        Ok(vec![
            format!("uav{peer} is asked to end; it held {cells} uncovered cells"),
            self.expect_down(peer),
        ])
    }

    fn pause(&mut self, peer: u16) -> Answer {
        let member = self.known(peer)?;
        if member.computer != Computer::Runs {
            return Err(format!("uav{peer} does not run"));
        }
        member.computer = Computer::Paused;
        if let Some(process) = &mut member.process {
            process.signal(Signal::SIGSTOP);
        }
        let text = format!("uav{peer} stands still; its airframe loiters by itself after 1 s");
        Ok(vec![text, self.expect_down(peer)])
    }

    fn resume(&mut self, peer: u16) -> Answer {
        let period_s = f64::from(self.spec.beacon_period_ms) / 1000.0;
        let member = self.known(peer)?;
        if member.computer != Computer::Paused {
            return Err(format!("uav{peer} is not paused"));
        }
        member.computer = Computer::Runs;
        if let Some(process) = &mut member.process {
            process.signal(Signal::SIGCONT);
        }
        Ok(vec![
            format!("uav{peer} goes on"),
            format!(
                "expect: it speaks within {:.0} s, and yields cells that others have listed since",
                2.0 * period_s
            ),
        ])
    }

    async fn restart(&mut self, peer: u16, fresh_disk: bool) -> Answer {
        let now_ms = self.now_ms;
        let period_s = f64::from(self.spec.beacon_period_ms) / 1000.0;
        let member = self.known(peer)?;
        let ran = matches!(member.computer, Computer::Runs | Computer::Paused);
        member.computer = Computer::Off;
        if let Some(process) = &mut member.process {
            process.kill().await;
        }
        let (flies, airborne) = (member.flies, member.airborne);
        if fresh_disk {
            member.wipe();
        }
        if ran && flies {
            self.ledger.killed(now_ms, peer, true);
        }
        if flies && !airborne {
            self.world.relaunch(peer);
        } else {
            self.world.set_computer(peer, true);
        }
        // Its last words must not be taken for the new life's.
        let member = self.known(peer)?;
        let radio = std::mem::take(&mut member.radio);
        self.ledger.add_radio(&radio);
        self.ledger.restarted(now_ms, peer, fresh_disk);
        let Some(processes) = &self.processes else {
            return Err("the trial is ending".to_owned());
        };
        let Some(member) = self.members.get_mut(&peer) else {
            return Err("gone".to_owned());
        };
        member.airborne = flies;
        member
            .start(processes)
            .map_err(|e| format!("uav{peer} did not start: {e}"))?;
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
            format!("uav{peer} starts again {place}, {disk}"),
            format!(
                "expect: a higher incarnation after {:.0} s of listening, and use within {:.0} s more",
                3.0 * period_s,
                20.0 * period_s
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
            self.known(peer)?;
        }
        self.world.fault(fault);
        let text = match fault {
            Fault::Cut {
                a,
                b,
                one_way: true,
            } => format!("the link from uav{a} to uav{b} is cut"),
            Fault::Cut { a, b, .. } => format!("the link between uav{a} and uav{b} is cut"),
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
                format!("expect: each side takes the other for gone within {down_s:.0} s and plans alone; nothing is left out")
            }
            Fault::Heal => "expect: the sides know of each other within a few beacons, and duplicates are yielded".to_owned(),
            _ => "expect: the same, later; detection keeps its bound".to_owned(),
        };
        Ok(vec![text, follows])
    }

    /// When a silent peer is suspected and when it is known to be down everywhere in
    /// its component, seconds: (k1, k1 + k2 + D + 2) periods.
    fn bounds_s(&self) -> (f64, f64) {
        let period_s = f64::from(self.spec.beacon_period_ms) / 1000.0;
        let d = f64::from(self.world.diameter(|id| self.on_air(id)));
        let (k1, k2) = (4.0 + d / 4.0, 4.0 + d / 2.0);
        (k1 * period_s, (k1 + k2 + d + 2.0) * period_s)
    }

    fn expect_down(&self, peer: u16) -> String {
        let (suspect_s, down_s) = self.bounds_s();
        format!(
            "expect: uav{peer} suspected within {suspect_s:.0} s, down everywhere within {down_s:.0} s of scenario time"
        )
    }

    fn expect_takeover(&self) -> String {
        let live = self
            .live_uavs()
            .iter()
            .map(|id| format!("uav{id}"))
            .collect::<Vec<_>>()
            .join(", ");
        format!("expect: its cells listed soon after by some of {live}")
    }
}
