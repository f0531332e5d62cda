//! What peers say on their vehicle streams, taken in.

use crate::member::Computer;
use crate::registry::ConsoleEntry;
use crate::stream::{Heard, Line};
use crate::trial::Trial;
use skein_link::frame::ToWorld;
use std::net::SocketAddr;

impl Trial<'_> {
    /// Takes what a peer said.
    pub(crate) fn hear(&mut self, heard: Heard) {
        match heard {
            Heard::Hello {
                id,
                pid,
                locator,
                console,
                line,
            } => self.hello(id, pid, (locator, console), line),
            Heard::Frame { id, pid, frame } => self.frame(id, pid, frame),
            Heard::Gone { id, pid } => self.gone(id, pid),
        }
    }

    /// A peer's process is up; it listens for neighbours, and perhaps for an operator.
    fn hello(
        &mut self,
        id: u16,
        pid: u32,
        (locator, console): (String, Option<String>),
        line: Line,
    ) {
        let address: Option<SocketAddr> = locator.strip_prefix("tcp/").and_then(|a| a.parse().ok());
        let Some(member) = self.members.get_mut(&id).filter(|m| m.pid() == Some(pid)) else {
            return;
        };
        let Some(address) = address.filter(|a| a.ip().is_loopback()) else {
            self.ledger
                .failures
                .push(format!("uav{id} listens at {locator}, beyond this machine"));
            return;
        };
        line.welcome(self.seed, self.now_ms, self.pacer.scale());
        member.line = Some(line);
        member.locator = Some(locator.clone());
        let console = console.and_then(|at| at.parse::<SocketAddr>().ok());
        if let Some(at) = console {
            let console = ConsoleEntry {
                at,
                token_file: member.console_token().to_owned(),
            };
            if let Err(cause) = self.registered.console_at(console) {
                tracing::warn!(%cause, "orders will not find the ground station of this trial");
            }
        }
        for ((_, high), pair) in &self.pairs {
            if *high == id {
                pair.proxy.lead_to(address);
            }
        }
        let observed = self
            .spec
            .ground
            .as_ref()
            .map(|g| g.id)
            .or_else(|| self.spec.uavs.first().map(|u| u.id));
        if observed == Some(id)
            && let Err(cause) = self.registered.observe_at(locator)
        {
            tracing::warn!(%cause, "observers will not find this trial");
        }
    }

    fn frame(&mut self, id: u16, pid: u32, frame: ToWorld) {
        let Some(member) = self.members.get_mut(&id).filter(|m| m.pid() == Some(pid)) else {
            return;
        };
        // What was under way when a computer ended is not said any more.
        let silent = matches!(member.computer, Computer::Off | Computer::Crashed);
        if silent && matches!(frame, ToWorld::Setpoint(_) | ToWorld::Report(_)) {
            return;
        }
        match frame {
            ToWorld::Setpoint(setpoint) => {
                let delay_ms = self.now_ms.saturating_sub(setpoint.from_ms);
                if member.computer == Computer::Runs {
                    self.setpoint_delay_ms = self.setpoint_delay_ms.max(delay_ms);
                    if self.pacer.answered(delay_ms) {
                        self.note_slow("peers answer late");
                    }
                }
                self.world.apply(id, setpoint);
            }
            ToWorld::Report(bytes) => match cbor4ii::serde::from_slice(&bytes) {
                Ok(report) => {
                    if let Some(line) = self.ledger.report(self.now_ms, id, report) {
                        self.note(line);
                    }
                }
                Err(cause) => tracing::warn!(id, %cause, "a report cannot be read"),
            },
            ToWorld::Radio(counters) => member.radio = counters,
            ToWorld::Bye => member.left = true,
            ToWorld::Hello { .. } => {}
        }
    }

    fn gone(&mut self, id: u16, pid: u32) {
        let Some(member) = self.members.get_mut(&id).filter(|m| m.pid() == Some(pid)) else {
            return;
        };
        self.ledger.add_radio(&std::mem::take(&mut member.radio));
        member.line = None;
        if member.computer == Computer::Runs && !member.left {
            member.computer = Computer::Crashed;
            let text = format!("uav{id} ended by itself: {}", member.last_words());
            self.ledger.failures.push(text.clone());
            self.note(text);
        }
    }
}
