//! The beginning and the end of a trial's processes.

use crate::member::{Computer, Surroundings};
use crate::process::Process;
use crate::registry::private_file;
use crate::stream::Heard;
use crate::trial::{Trial, TrialError, io};
use nix::sys::signal::Signal;
use skein_link::frame::ToWorld;
use std::time::Duration;
use tokio::time::Instant;

/// How long all peers together may take to say hello: debug builds, two cores, 64 of
/// them.
const LAUNCH_TIMEOUT: Duration = Duration::from_secs(60);

/// How long UAVs may take to derive the loop of the mission before time begins
/// without them: they share two cores, and a square kilometre takes a debug build
/// some seconds each.
const READY_TIMEOUT: Duration = Duration::from_secs(45);

/// How long peers may take to say goodbye.
const GOODBYE_TIMEOUT: Duration = Duration::from_secs(2);

impl Trial<'_> {
    /// Writes what each peer reads when it starts.
    pub(crate) fn write_configs(&self, token: &str) -> Result<(), TrialError> {
        let mission =
            serde_json::to_vec(&*self.spec.mission).map_err(|e| io("mission.json")(e.into()))?;
        private_file(&self.run_dir.join("mission.json"), &mission)?;
        let around = |id: u16| Surroundings {
            spec: &self.spec,
            seed: self.seed,
            world: self.streams.address(),
            token,
            links: self
                .pairs
                .iter()
                .filter(|((low, _), _)| *low == id)
                .map(|(_, p)| p.proxy.address())
                .collect(),
        };
        let uavs = self.spec.uavs.iter().map(|u| (u.id, around(u.id).uav(u)));
        let ground = self
            .spec
            .ground
            .iter()
            .map(|g| (g.id, around(g.id).ground(g)));
        for (id, config) in uavs.chain(ground) {
            let json =
                serde_json::to_vec_pretty(&config).map_err(|e| io("a configuration")(e.into()))?;
            if let Some(member) = self.members.get(&id) {
                private_file(member.config(), &json)?;
            }
        }
        Ok(())
    }

    /// Starts everybody and waits until all said hello.
    pub(crate) async fn launch(&mut self) -> Result<(), TrialError> {
        let Some(processes) = &self.processes else {
            return Ok(());
        };
        for member in self.members.values_mut() {
            let started = member.start(processes);
            started.map_err(|e| TrialError::Launch {
                peer: member.id,
                why: e.to_string(),
            })?;
        }
        let deadline = Instant::now() + LAUNCH_TIMEOUT;
        while let Some(waiting) = self.members.values_mut().find(|m| m.line.is_none()) {
            let peer = waiting.id;
            if !waiting.process.as_mut().is_some_and(Process::is_there) {
                return Err(TrialError::Launch {
                    peer,
                    why: waiting.last_words(),
                });
            }
            if Instant::now() > deadline {
                let why = format!(
                    "no hello within {} s; {}",
                    LAUNCH_TIMEOUT.as_secs(),
                    waiting.last_words()
                );
                return Err(TrialError::Launch { peer, why });
            }
            // The wait is short, so that a process that ended is noticed.
            let heard = tokio::time::timeout(Duration::from_millis(100), self.streams.next()).await;
            if let Ok(Some(heard)) = heard {
                self.hear(heard);
            }
        }
        self.wait_until_ready().await;
        Ok(())
    }

    /// Waits until all UAVs have derived the loop of their mission: nobody launches an
    /// airframe whose computer is still busy starting, and here all computers share
    /// one machine. Time stands still meanwhile.
    async fn wait_until_ready(&mut self) {
        let deadline = Instant::now() + READY_TIMEOUT;
        while !self.live_uavs().iter().all(|id| self.ledger.is_ready(*id)) {
            match tokio::time::timeout_at(deadline, self.streams.next()).await {
                Ok(Some(heard)) => self.hear(heard),
                Ok(None) | Err(_) => {
                    let text = "not all UAVs are ready; time begins all the same";
                    return self.note(text.to_owned());
                }
            }
        }
    }

    /// Tells everybody to leave, and ends who does not.
    pub(crate) async fn end(&mut self) {
        for member in self.members.values_mut() {
            if let (Computer::Paused, Some(process)) = (member.computer, &mut member.process) {
                process.signal(Signal::SIGCONT);
            }
            match (&member.line, &mut member.process) {
                (Some(line), _) => line.end(),
                (None, Some(process)) => process.signal(Signal::SIGTERM),
                (None, None) => {}
            }
        }
        let deadline = Instant::now() + GOODBYE_TIMEOUT;
        while self.members.values().any(|m| m.line.is_some()) {
            match tokio::time::timeout_at(deadline, self.streams.next()).await {
                Ok(Some(
                    heard @ (Heard::Frame {
                        frame: ToWorld::Radio(_) | ToWorld::Bye,
                        ..
                    }
                    | Heard::Gone { .. }),
                )) => {
                    self.part(heard);
                }
                Ok(Some(_)) => {}
                Ok(None) | Err(_) => break,
            }
        }
        for member in self.members.values_mut() {
            self.ledger.add_radio(&std::mem::take(&mut member.radio));
            if let Some(process) = &mut member.process {
                process.wait_or_kill().await;
            }
        }
    }

    /// Takes last words; whoever leaves now leaves because it was told to.
    fn part(&mut self, heard: Heard) {
        if let Heard::Gone { id, .. } = &heard
            && let Some(member) = self.members.get_mut(id)
        {
            member.left = true;
        }
        self.hear(heard);
    }

    /// Ends the guard and removes what is not worth keeping.
    pub(crate) async fn close(self, keep: bool) {
        if let Some(processes) = self.processes {
            processes.end().await;
        }
        if !keep {
            let _ = std::fs::remove_dir_all(&self.run_dir);
        }
    }
}
