//! All peers of a trial: their processes, their files, the streams and transports that
//! join them. What they say comes out as [`Said`].

use crate::config::{Surroundings, lease_ms};
use crate::error::{TrialError, io};
use crate::live_peer::LivePeer;
use crate::live_world::LiveWorld;
use crate::pacer::STEP_MS;
use crate::process::{Processes, Used};
use crate::registry::{ConsoleEntry, private_file};
use crate::stream::{Heard, Line, Streams};
use crate::transports::Transports;
use serde::de::DeserializeOwned;
use skein_behaviors::Setpoint;
use skein_link::frame::ToWorld;
use skein_link::{LinkNews, RadioCounters};
use skein_netsim::spec::Spec;
use skein_netsim::world::percept_phase_ms;
use skein_peer::Report;
use skein_peer::witness::Witness;
use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::path::Path;
use std::time::Duration;
use tokio::time::Instant;

/// How long all peers together may take to say hello: debug builds, two cores, 64 of
/// them.
const LAUNCH_TIMEOUT: Duration = Duration::from_secs(60);

/// How long peers may take to say goodbye.
const GOODBYE_TIMEOUT: Duration = Duration::from_secs(2);

/// Something that a peer said, or that became of it.
#[derive(Debug)]
pub(crate) enum Said {
    /// Its process is up and listens there.
    Up {
        /// Which.
        id: u16,
        /// Where, as `tcp/127.0.0.1:PORT`.
        locator: String,
        /// Where it listens for an operator, if it does.
        console: Option<ConsoleEntry>,
    },
    /// It flies on like this.
    Setpoint {
        /// Which.
        id: u16,
        /// How.
        setpoint: Setpoint,
        /// Whether its process runs; a paused one's last words may still arrive.
        runs: bool,
    },
    /// Of so many transmissions that reached it in the last second so many came late.
    Heard {
        /// How many came.
        arrived: u64,
        /// Late ones among them.
        late: u64,
    },
    /// It reports something.
    Report {
        /// Which.
        id: u16,
        /// What.
        report: Report,
    },
    /// It says what it sees or knows.
    Witness {
        /// Which.
        id: u16,
        /// What.
        witness: Witness,
    },
    /// One life of it has ended: what its radio did.
    Radio(RadioCounters),
    /// Its process ended by itself.
    Crashed {
        /// Which.
        id: u16,
        /// What its radio did.
        radio: RadioCounters,
        /// Its last words.
        why: String,
    },
    /// It does something that no peer may do.
    Wrong(String),
}

/// When it is, for those who are welcomed or told.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Clock {
    /// Scenario time, milliseconds.
    pub(crate) now_ms: u64,
    /// Scenario seconds per second.
    pub(crate) scale: f64,
}

/// All peers of a trial.
#[derive(Debug)]
pub(crate) struct Peers {
    by_id: BTreeMap<u16, LivePeer>,
    streams: Streams,
    transports: Transports,
    processes: Processes,
    seed: u64,
}

/// Whether one of so many senses in the step of the world that ends now.
fn senses(now_ms: u64, nth: usize, of: usize, period_ms: u32) -> bool {
    let period = u64::from(period_ms.max(1));
    let ahead_ms = period - percept_phase_ms(nth, of, period_ms) % period;
    (now_ms + ahead_ms) / period > (now_ms + ahead_ms).saturating_sub(STEP_MS) / period
}

impl Peers {
    /// Opens every port and writes every file; starts only the guard.
    pub(crate) async fn prepare(
        spec: &Spec,
        seed: u64,
        run_dir: &Path,
        program: &Path,
        token: &str,
    ) -> Result<Self, TrialError> {
        let streams = Streams::listen(token.to_owned())
            .await
            .map_err(io("the vehicle streams"))?;
        let uavs = spec.uavs.iter().map(|u| (u.id, true));
        let ground = spec.ground.iter().map(|g| (g.id, false));
        let by_id: BTreeMap<u16, LivePeer> = uavs
            .chain(ground)
            .map(|(id, flies)| (id, LivePeer::new(run_dir, id, flies)))
            .collect();
        let ids: Vec<u16> = by_id.keys().copied().collect();
        let transports = Transports::bind(&ids, lease_ms(spec)).await;
        let transports = transports.map_err(io("a link's proxy"))?;
        let mission =
            serde_json::to_vec(&*spec.mission).map_err(|e| io("mission.json")(e.into()))?;
        private_file(&run_dir.join("mission.json"), &mission)?;
        let around = |id: u16| Surroundings {
            spec,
            seed,
            world: streams.address(),
            token,
            links: transports.from(id),
        };
        let uavs = spec.uavs.iter().map(|u| (u.id, around(u.id).uav(u)));
        let ground = spec.ground.iter().map(|g| (g.id, around(g.id).ground(g)));
        for (id, config) in uavs.chain(ground) {
            let json =
                serde_json::to_vec_pretty(&config).map_err(|e| io("a configuration")(e.into()))?;
            if let Some(peer) = by_id.get(&id) {
                private_file(peer.config(), &json)?;
            }
        }
        let processes = Processes::start(program).map_err(io(program.display().to_string()))?;
        Ok(Self {
            by_id,
            streams,
            transports,
            processes,
            seed,
        })
    }

    /// Starts everybody.
    pub(crate) fn start_all(&mut self) -> Result<(), TrialError> {
        for peer in self.by_id.values_mut() {
            peer.start(&self.processes)
                .map_err(|e| TrialError::Launch {
                    peer: peer.id(),
                    why: e.to_string(),
                })?;
        }
        Ok(())
    }

    /// Waits until all said hello; gives what else was said meanwhile.
    pub(crate) async fn wait_for_all(&mut self, clock: Clock) -> Result<Vec<Said>, TrialError> {
        let deadline = Instant::now() + LAUNCH_TIMEOUT;
        let mut said = Vec::new();
        while let Some(waiting) = self.by_id.values_mut().find(|p| !p.is_connected()) {
            let peer = waiting.id();
            if !waiting.is_there() {
                let why = waiting.last_words();
                return Err(TrialError::Launch { peer, why });
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
                said.extend(self.take(heard, clock));
            }
        }
        Ok(said)
    }

    /// The next frame of any peer, for [`Peers::take`]. Cancel-safe.
    pub(crate) async fn next(&mut self) -> Option<Heard> {
        self.streams.next().await
    }

    /// Takes a frame; gives what it means to the trial.
    pub(crate) fn take(&mut self, heard: Heard, clock: Clock) -> Option<Said> {
        match heard {
            Heard::Hello {
                id,
                pid,
                locator,
                console,
                line,
            } => self.hello((id, pid), (locator, console), line, clock),
            Heard::Frame { id, pid, frame } => self.frame((id, pid), frame),
            Heard::Gone { id, pid } => {
                let peer = self.by_id.get_mut(&id).filter(|p| p.is_process(pid))?;
                let (radio, crashed) = peer.disconnect();
                Some(if crashed {
                    let why = peer.last_words();
                    Said::Crashed { id, radio, why }
                } else {
                    Said::Radio(radio)
                })
            }
        }
    }

    fn hello(
        &mut self,
        (id, pid): (u16, u32),
        (locator, console): (String, Option<String>),
        line: Line,
        clock: Clock,
    ) -> Option<Said> {
        let address: Option<SocketAddr> = locator.strip_prefix("tcp/").and_then(|a| a.parse().ok());
        let peer = self.by_id.get_mut(&id).filter(|p| p.is_process(pid))?;
        let Some(address) = address.filter(|a| a.ip().is_loopback()) else {
            let text = format!("{} listens at {locator}, beyond this machine", peer.name());
            return Some(Said::Wrong(text));
        };
        line.welcome(self.seed, clock.now_ms, clock.scale);
        peer.connect(line);
        let console = console.and_then(|at| at.parse().ok());
        let console = console.map(|at| ConsoleEntry {
            at,
            token_file: peer.console_token().to_owned(),
        });
        self.transports.lead_to(id, address);
        Some(Said::Up {
            id,
            locator,
            console,
        })
    }

    fn frame(&mut self, (id, pid): (u16, u32), frame: ToWorld) -> Option<Said> {
        let peer = self.by_id.get_mut(&id).filter(|p| p.is_process(pid))?;
        // What was under way when a computer ended is not said any more.
        let silent = !peer.has_process();
        match frame {
            ToWorld::Setpoint(setpoint) => {
                peer.answers(setpoint.from_ms);
                (!silent).then(|| Said::Setpoint {
                    id,
                    setpoint,
                    runs: peer.runs(),
                })
            }
            ToWorld::Report(_) | ToWorld::Witness(_) if silent => None,
            ToWorld::Report(bytes) => {
                let report = read(id, "a report", &bytes)?;
                Some(Said::Report { id, report })
            }
            ToWorld::Witness(bytes) => {
                let witness = read(id, "what a peer sees", &bytes)?;
                Some(Said::Witness { id, witness })
            }
            ToWorld::Radio(counters) => {
                let (arrived, late) = peer.counted(counters);
                (!silent).then_some(Said::Heard { arrived, late })
            }
            ToWorld::Bye => {
                peer.leaves();
                None
            }
            ToWorld::Hello { .. } => None,
        }
    }

    /// Follows the world by a step: tells everybody the time and the links, and what it senses
    /// once in so many milliseconds, each when it is due as in simulated runs.
    /// Gives who was told what it senses.
    pub(crate) fn tell(
        &mut self,
        clock: Clock,
        world: &LiveWorld,
        percept_period_ms: u32,
    ) -> Vec<u16> {
        let mut sensed = Vec::new();
        self.transports.follow(world);
        let on_air: Vec<u16> = self
            .by_id
            .values()
            .filter(|p| p.on_air())
            .map(LivePeer::id)
            .collect();
        let hearing = world.hearing(on_air);
        let of = self.by_id.len();
        for (nth, (id, peer)) in self.by_id.iter_mut().enumerate() {
            if !peer.is_connected() {
                continue;
            }
            let others = hearing.stations.iter().filter(|tx| *tx != id);
            let news = peer.news_of_links(LinkNews {
                row: others.map(|tx| (*tx, world.link(*tx, *id))).collect(),
                hearing: hearing.clone(),
            });
            let percept = world
                .percept(*id)
                .filter(|_| peer.flies() && peer.airborne())
                .filter(|_| senses(clock.now_ms, nth, of, percept_period_ms));
            if percept.is_some() {
                peer.told_percept(clock.now_ms);
                sensed.push(*id);
            }
            if let Some(line) = peer.line() {
                line.tick(clock.now_ms, clock.scale, percept, news);
            }
        }
        sensed
    }

    /// How long anybody has owed the answer to a percept, milliseconds of scenario time.
    pub(crate) fn owed_ms(&self, now_ms: u64) -> u64 {
        let owed = self.by_id.values().map(|p| p.owed_ms(now_ms));
        owed.max().unwrap_or(0)
    }

    /// Everybody is ready to fly: whoever is told a percept from now on owes an answer.
    pub(crate) fn all_answer(&mut self) {
        for peer in self.by_id.values_mut().filter(|p| p.on_air()) {
            peer.answers(0);
        }
    }

    /// Nobody is waited for any longer; gives who was.
    pub(crate) fn excuse_all(&mut self) -> Vec<u16> {
        let owing = self
            .by_id
            .iter_mut()
            .filter_map(|(id, p)| p.excuse().then_some(*id));
        owing.collect()
    }

    /// What the processes that are there have used so far.
    pub(crate) fn used(&self) -> Vec<Used> {
        self.by_id.values().filter_map(LivePeer::used).collect()
    }

    /// What people call a peer.
    pub(crate) fn name(&self, id: u16) -> String {
        self.by_id
            .get(&id)
            .map_or_else(|| format!("peer {id}"), LivePeer::name)
    }

    /// A peer by its number, or who there is instead.
    pub(crate) fn known(&mut self, id: u16) -> Result<&mut LivePeer, String> {
        let named = |(id, peer): (&u16, &LivePeer)| format!("{id} ({})", peer.name());
        let names: Vec<String> = self.by_id.iter().map(named).collect();
        self.by_id
            .get_mut(&id)
            .ok_or_else(|| format!("there is no peer {id}; there are {}", names.join(", ")))
    }

    /// Starts a peer's process again.
    pub(crate) fn start(&mut self, id: u16) -> Result<(), String> {
        let peer = self.by_id.get_mut(&id).ok_or("gone")?;
        peer.start(&self.processes)
            .map_err(|e| format!("{} did not start: {e}", peer.name()))
    }

    /// Whether the radio of a peer works.
    pub(crate) fn on_air(&self, id: u16) -> bool {
        self.by_id.get(&id).is_some_and(LivePeer::on_air)
    }

    /// Tells everybody to leave, and ends who does not; gives what their radios did.
    pub(crate) async fn end(&mut self) -> (Vec<RadioCounters>, Vec<Said>) {
        for peer in self.by_id.values_mut() {
            peer.dismiss();
        }
        let (mut radios, mut said) = (Vec::new(), Vec::new());
        let deadline = Instant::now() + GOODBYE_TIMEOUT;
        while self.by_id.values().any(LivePeer::is_connected) {
            match tokio::time::timeout_at(deadline, self.streams.next()).await {
                Ok(Some(Heard::Frame {
                    id,
                    pid,
                    frame: frame @ (ToWorld::Radio(_) | ToWorld::Witness(_) | ToWorld::Bye),
                })) => {
                    said.extend(self.frame((id, pid), frame));
                }
                Ok(Some(Heard::Gone { id, pid })) => {
                    if let Some(peer) = self.by_id.get_mut(&id).filter(|p| p.is_process(pid)) {
                        // Whoever leaves now leaves because it was told to.
                        peer.leaves();
                        radios.push(peer.disconnect().0);
                    }
                }
                Ok(Some(_)) => {}
                Ok(None) | Err(_) => break,
            }
        }
        for peer in self.by_id.values_mut() {
            radios.push(peer.take_radio());
            peer.wait_or_kill().await;
        }
        (radios, said)
    }

    /// Ends the guard.
    pub(crate) async fn close(self) {
        self.processes.end().await;
    }
}

/// What a peer's own crate wrote; a warning where it cannot be read.
fn read<T: DeserializeOwned>(id: u16, what: &str, bytes: &[u8]) -> Option<T> {
    cbor4ii::serde::from_slice(bytes)
        .inspect_err(|cause| tracing::warn!(id, %cause, "{what} cannot be read"))
        .ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_senses_once_in_a_period_and_not_all_at_once() {
        for (of, period_ms) in [(1, 200), (8, 200), (20, 500), (50, 500), (8, 250), (3, 20)] {
            let steps: Vec<u64> = (1..=100).map(|step| step * STEP_MS).collect();
            let each = (0..of).map(|nth| {
                let at = steps.iter().filter(|ms| senses(**ms, nth, of, period_ms));
                at.count() as u64
            });
            let often = 100 * STEP_MS / u64::from(period_ms).max(STEP_MS);
            assert!(each.into_iter().all(|n| n.abs_diff(often) <= 1));
            let at_once = steps.iter().map(|ms| {
                (0..of)
                    .filter(|nth| senses(*ms, *nth, of, period_ms))
                    .count()
            });
            let most = if of > 1 && period_ms > 100 {
                of - 1
            } else {
                of
            };
            assert!(at_once.max() <= Some(most));
        }
    }
}
