//! The driver: wait for one thing, make it one input, drain the outputs (the
//! canonical loop of `skein_peer`; D2.7 §1.2: the layers of one UAV).
//!
//! Nothing here decides anything. Planning runs beside the loop, storing in its own
//! thread; percept to setpoint waits for neither.

use crate::bus::{Bus, Event};
use crate::clock::Clock;
use crate::journal::Journal;
use crate::radio::Radio;
use crate::vehicle::{News, Tick, Vehicle};
use skein_link::frame::ToWorld;
use skein_peer::offload::{Job, JobResult, run};
use skein_peer::{Command, Input, Output, Peer, Time};
use std::time::{Duration, Instant};
use tokio::sync::mpsc;

/// How often the radio's counters go to the world, milliseconds of scenario time.
const COUNTERS_PERIOD_MS: u64 = 1_000;

/// Plans under way at once: a peer asks for the next division only when the last
/// one is dead, and for the ground once a revision.
const MAX_OPEN_PLANS: usize = 16;

/// Without anything else to wait for, look again after this long.
const IDLE: Duration = Duration::from_secs(3_600);

/// What a driver needs of a mind. [`Peer`] is the one that flies.
pub trait Mind: Send {
    /// Takes one input.
    fn handle(&mut self, now: Time, input: Input);
    /// The next output of the last input.
    fn poll(&mut self) -> Option<Output>;
    /// When it wants [`Input::Timer`] at the latest.
    fn next_timeout(&self) -> Option<Time>;
}

impl Mind for Peer {
    fn handle(&mut self, now: Time, input: Input) {
        Peer::handle(self, now, input);
    }

    fn poll(&mut self) -> Option<Output> {
        Peer::poll(self)
    }

    fn next_timeout(&self) -> Option<Time> {
        Peer::next_timeout(self)
    }
}

/// A mind and everything it acts through.
#[derive(Debug)]
pub struct Driver<M, V> {
    mind: M,
    vehicle: V,
    clock: Clock,
    radio: Radio,
    bus: Bus,
    journal: Journal,
    plans: mpsc::Receiver<(u64, JobResult)>,
    planner: mpsc::Sender<(u64, JobResult)>,
    counters_due: Time,
}

/// Something that happened.
enum Happened {
    News(News),
    Stored(crate::journal::Stored),
    Computed(u64, JobResult),
    Bus(Event),
    Time,
}

impl<M: Mind, V: Vehicle> Driver<M, V> {
    /// Puts the parts together.
    pub fn new(
        mind: M,
        vehicle: V,
        clock: Clock,
        radio: Radio,
        bus: Bus,
        journal: Journal,
    ) -> Self {
        let (planner, plans) = mpsc::channel(MAX_OPEN_PLANS);
        Self {
            mind,
            vehicle,
            clock,
            radio,
            bus,
            journal,
            plans,
            planner,
            counters_due: Time(0),
        }
    }

    /// Runs from the first input until the vehicle's stream ends or `stop` does.
    pub async fn run(mut self, start: Input, stop: impl Future<Output = ()>) {
        tokio::pin!(stop);
        self.step(start).await;
        loop {
            let wait = self.wait();
            let happened = tokio::select! {
                () = &mut stop => break,
                news = self.vehicle.next() => Happened::News(news),
                Some(stored) = self.journal.answer() => Happened::Stored(stored),
                Some((token, result)) = self.plans.recv() => Happened::Computed(token, result),
                event = self.bus.next() => Happened::Bus(event),
                () = tokio::time::sleep(wait) => Happened::Time,
            };
            if !self.take(happened).await {
                break;
            }
            self.deliver().await;
        }
        self.leave().await;
    }

    /// How long nothing but the passing of time can be due.
    fn wait(&mut self) -> Duration {
        let due = [self.mind.next_timeout(), self.radio.next_due()]
            .into_iter()
            .flatten()
            .min();
        let at = Instant::now();
        // Where only a frame of the world can bring the time, the frame will wake us.
        due.and_then(|t| self.clock.wait_until(t, at))
            .unwrap_or(IDLE)
    }

    fn now(&mut self) -> Time {
        self.clock.now(Instant::now())
    }

    /// Makes one input of what happened; false when it is the end.
    async fn take(&mut self, happened: Happened) -> bool {
        match happened {
            Happened::News(News::End) => return false,
            Happened::News(News::Tick(tick)) => self.tick(tick).await,
            Happened::News(News::Command(order)) => {
                self.step(Input::Command(Command::Order(order))).await
            }
            Happened::Stored(s) => {
                self.step(Input::Stored {
                    token: s.token,
                    ok: s.ok,
                })
                .await
            }
            Happened::Computed(token, result) => self.step(Input::Computed { token, result }).await,
            Happened::Bus(Event::Link { neighbour, up }) => {
                self.step(Input::LinkHint { neighbour, up }).await;
            }
            Happened::Bus(Event::Heard { hop, bytes }) => match hop {
                Some(hop) => {
                    let now = self.now();
                    self.radio.receive(now, hop, bytes);
                }
                None => self.radio.refuse(),
            },
            Happened::Time => {
                let now = self.now();
                if self.mind.next_timeout().is_some_and(|due| due <= now) {
                    self.step(Input::Timer).await;
                }
            }
        }
        true
    }

    async fn tick(&mut self, tick: Tick) {
        self.clock.tick(tick.time_ms, tick.scale, Instant::now());
        if let Some(table) = tick.links {
            self.radio.links(table);
        }
        if let Some(percept) = tick.percept {
            self.step(Input::Percept(percept)).await;
        }
        let now = self.now();
        if self.mind.next_timeout().is_some_and(|due| due <= now) {
            self.step(Input::Timer).await;
        }
        if now >= self.counters_due {
            self.counters_due = now.plus_ms(COUNTERS_PERIOD_MS);
            let counters = self.radio.counters(self.bus.overrun());
            self.vehicle.tell(ToWorld::Radio(counters)).await;
        }
    }

    /// Gives the mind what has arrived through the air.
    async fn deliver(&mut self) {
        let now = self.now();
        while let Some(arrived) = self.radio.due(now) {
            let (transmitter, hops) = (arrived.hop.transmitter, arrived.hop.hops);
            self.step(Input::Received {
                transmitter,
                hops,
                bytes: arrived.bytes,
            })
            .await;
        }
    }

    /// One input, and everything that follows from it.
    async fn step(&mut self, input: Input) {
        let now = self.now();
        self.mind.handle(now, input);
        while let Some(output) = self.mind.poll() {
            self.act(now, output).await;
        }
    }

    async fn act(&mut self, now: Time, output: Output) {
        match output {
            Output::Publish {
                key,
                bytes,
                hops,
                priority,
                lifetime_ms: _,
            } => {
                let hop = self.radio.transmit(hops, bytes.len());
                self.bus.publish(&key, bytes, hop, priority).await;
            }
            Output::Setpoint(setpoint) => self.vehicle.tell(ToWorld::Setpoint(setpoint)).await,
            Output::Store { token, record } => self.journal.store(token, record).await,
            Output::Compute { token, job } => self.compute(token, job),
            Output::Report(report) => {
                tracing::info!(time_ms = now.0, ?report);
                match cbor4ii::serde::to_vec(Vec::new(), &report) {
                    Ok(bytes) => self.vehicle.tell(ToWorld::Report(bytes)).await,
                    Err(cause) => tracing::error!(%cause, "a report was not sent"),
                }
            }
        }
    }

    fn compute(&self, token: u64, job: Job) {
        let planner = self.planner.clone();
        tokio::task::spawn_blocking(move || {
            let result = run(&job);
            // A loop that has ended needs no answer.
            let _ = planner.blocking_send((token, result));
        });
    }

    /// Flushes what is under way and says goodbye.
    async fn leave(mut self) {
        let counters = self.radio.counters(self.bus.overrun());
        self.vehicle.tell(ToWorld::Radio(counters)).await;
        self.vehicle.tell(ToWorld::Bye).await;
        self.bus.close().await;
        let _ = tokio::task::spawn_blocking(move || self.journal.close()).await;
    }
}
