//! How the swarm came to who does what, as it was told: its rounds with their bids and what
//! each member got, and what became of each task. Every piece has its time, so that whoever
//! draws a moment leaves out what came later. Bounded: the oldest goes first.

use serde::Serialize;
use skein_recording::Record;
use skein_recording::model::event::{Bid, Event, TaskBid, What};
use std::collections::VecDeque;

/// Rounds that are kept: a swarm of eight has some ten an hour.
pub const ROUNDS: usize = 256;

/// Tasks that are kept: as many as one operator may ask for at a time.
pub const TASKS: usize = 256;

/// What is kept of one task.
pub const STEPS: usize = 64;

/// Members of a round that are kept: the swarm's own rounds have eight at most, a file may say
/// anything.
const MEMBERS: usize = 32;

/// Stretches of a section that are kept.
const STRETCHES: usize = 32;

/// One round.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Round {
    /// Counts the rounds of a run, from 0.
    pub id: u64,
    /// Its counter, as peers say it; parts of a divided swarm may use one twice.
    pub counter: u32,
    /// When the first bid was told, milliseconds of scenario time.
    pub opened_ms: u64,
    /// Whose that was: whoever opened it, as far as was told.
    pub by: Option<u16>,
    /// Whether it answers cells that nobody lists; any other rebalances. None where that was
    /// not told.
    pub repair: Option<bool>,
    /// Its members, ascending.
    pub members: Vec<u16>,
    /// Bids, in the order in which they were told.
    pub bids: Vec<Told<Bid>>,
    /// What members got, in the order in which they said so.
    pub got: Vec<Got>,
}

/// Something, and when it was told.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Told<T> {
    /// Milliseconds of scenario time.
    pub time_ms: u64,
    /// What.
    #[serde(flatten)]
    pub what: T,
}

/// What a member got of a round.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Got {
    /// When it said so, milliseconds of scenario time.
    pub time_ms: u64,
    /// Who.
    pub uav: u16,
    /// How many cells.
    pub n_cells: usize,
    /// Its section in the order of flight: the first cell and the last one of each stretch of
    /// the loop.
    pub stretches: Vec<[u16; 2]>,
}

/// What became of one task.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Task {
    /// Counts the tasks of a run, from 0.
    pub id: u64,
    /// What people call it.
    pub name: String,
    /// Who asked for it, where that was told.
    pub author: Option<u16>,
    /// Which of its author's tasks.
    pub number: Option<u16>,
    /// In which revision.
    pub revision: Option<u32>,
    /// What happened, in order.
    pub steps: Vec<Step>,
    /// Who has it by now.
    pub holder: Option<u16>,
}

/// Something that became of a task.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Step {
    /// When it was told, milliseconds of scenario time.
    pub time_ms: u64,
    /// Whom it concerns.
    pub uav: Option<u16>,
    /// What: as events say it, and `lost` when whoever had it is gone.
    pub news: String,
    /// Who had it before: it was taken over.
    pub from: Option<u16>,
    /// Who held it by then, with their bids, as far as was told.
    pub bids: Vec<TaskBid>,
    /// The same for a person.
    pub text: String,
}

/// Something that changed.
#[derive(Clone, Debug, PartialEq)]
pub enum Changed {
    /// A round.
    Round(Round),
    /// A task.
    Task(Task),
}

/// All that is kept.
#[derive(Debug, Default)]
pub struct History {
    rounds: VecDeque<Round>,
    tasks: VecDeque<Task>,
    n_rounds: u64,
    n_tasks: u64,
}

impl History {
    /// The rounds, the oldest first.
    pub fn rounds(&self) -> impl DoubleEndedIterator<Item = &Round> {
        self.rounds.iter()
    }

    /// The tasks, the oldest first.
    pub fn tasks(&self) -> impl DoubleEndedIterator<Item = &Task> {
        self.tasks.iter()
    }

    /// Takes the next word; gives what it changed, as it is now.
    pub fn hear(&mut self, record: &Record) -> Vec<Changed> {
        match record {
            Record::Event(event) => self.happen(event),
            _ => Vec::new(),
        }
    }

    fn happen(&mut self, event: &Event) -> Vec<Changed> {
        match (&event.what, event.uav) {
            (
                What::Round {
                    counter,
                    members,
                    repair,
                },
                uav,
            ) => self.opened(event.time_ms, uav, (*counter, members, *repair)),
            (What::Bids { counter, bids }, uav) => {
                let round = self.bids(event.time_ms, uav, *counter, bids);
                round.map(Changed::Round).into_iter().collect()
            }
            (What::Claim { counter, cells, .. }, Some(uav)) => {
                let round = self.claimed(event.time_ms, uav, *counter, cells);
                round.map(Changed::Round).into_iter().collect()
            }
            (What::Task { .. }, uav) => {
                let task = self.task(event, uav);
                task.map(Changed::Task).into_iter().collect()
            }
            (What::Ended { .. }, Some(uav)) => self.ended(event.time_ms, uav, &event.text),
            _ => Vec::new(),
        }
    }

    fn opened(
        &mut self,
        time_ms: u64,
        by: Option<u16>,
        (counter, members, repair): (u32, &[u16], Option<bool>),
    ) -> Vec<Changed> {
        let mut members: Vec<u16> = members.iter().copied().take(MEMBERS).collect();
        members.sort_unstable();
        let known = |r: &Round| r.counter == counter && r.members == members;
        if self.rounds.iter().any(known) {
            return Vec::new();
        }
        let round = Round {
            id: self.n_rounds,
            counter,
            opened_ms: time_ms,
            by,
            repair,
            members,
            ..Round::default()
        };
        self.n_rounds += 1;
        self.rounds.push_back(round.clone());
        if self.rounds.len() > ROUNDS {
            self.rounds.pop_front();
        }
        vec![Changed::Round(round)]
    }

    /// The newest round of that counter of which it is a member.
    fn round_of(&mut self, counter: u32, uav: u16) -> Option<&mut Round> {
        let mut newest_first = self.rounds.iter_mut().rev();
        newest_first.find(|r| r.counter == counter && r.members.contains(&uav))
    }

    fn bids(
        &mut self,
        time_ms: u64,
        uav: Option<u16>,
        counter: u32,
        bids: &[Bid],
    ) -> Option<Round> {
        let member = uav.or(bids.first().map(|b| b.by))?;
        let round = self.round_of(counter, member)?;
        let mut is_news = false;
        for bid in bids {
            let known = round.bids.iter().any(|b| b.what.by == bid.by);
            if !known && round.members.contains(&bid.by) {
                let what = *bid;
                round.bids.push(Told { time_ms, what });
                is_news = true;
            }
        }
        is_news.then(|| round.clone())
    }

    /// The first claim that goes back to a round says what its author got.
    fn claimed(&mut self, time_ms: u64, uav: u16, counter: u32, cells: &[u16]) -> Option<Round> {
        let round = self.round_of(counter, uav)?;
        if round.got.iter().any(|g| g.uav == uav) {
            return None;
        }
        round.got.push(Got {
            time_ms,
            uav,
            n_cells: cells.len(),
            stretches: stretches(cells),
        });
        Some(round.clone())
    }

    fn task(&mut self, event: &Event, uav: Option<u16>) -> Option<Task> {
        let What::Task {
            name,
            news,
            author,
            number,
            revision,
            by,
            held_by,
        } = &event.what
        else {
            return None;
        };
        let is_it = |t: &&mut Task| {
            t.name == *name && (t.author, t.number, t.revision) == (*author, *number, *revision)
        };
        let held = self.tasks.iter_mut().rev().find(is_it);
        let task = match held {
            Some(task) => task,
            None => {
                self.tasks.push_back(Task {
                    id: self.n_tasks,
                    name: name.clone(),
                    author: *author,
                    number: *number,
                    revision: *revision,
                    ..Task::default()
                });
                self.n_tasks += 1;
                if self.tasks.len() > TASKS {
                    self.tasks.pop_front();
                }
                self.tasks.back_mut()?
            }
        };
        // Everybody says what it heard; once is enough.
        let concerns = match news.as_str() {
            "asked" | "nobody-can" | "over" => None,
            "done-by" => *by,
            _ => uav,
        };
        let heard = matches!(news.as_str(), "asked" | "nobody-can" | "over" | "done-by");
        let done = |s: &Step| s.news == "seen" || s.news == "done-by";
        let known = task.steps.iter().any(|s| s.news == *news && heard)
            || news == "done-by" && task.steps.iter().any(done);
        if known {
            return None;
        }
        let had = task.holder;
        let mut from = None;
        match news.as_str() {
            "won" | "flies" => {
                let last = task.steps.iter().rev().find(|s| s.news == "lost");
                from = had.or(last.and_then(|s| s.uav)).filter(|h| Some(*h) != uav);
                task.holder = uav;
            }
            "left" if had == uav => task.holder = None,
            _ => {}
        }
        let mut bids = held_by.clone();
        bids.truncate(MEMBERS);
        task.step(Step {
            time_ms: event.time_ms,
            uav: concerns,
            news: news.clone(),
            from,
            bids,
            text: event.text.clone(),
        });
        Some(task.clone())
    }

    /// Whoever is gone has its tasks no more, but for those that were done.
    fn ended(&mut self, time_ms: u64, uav: u16, text: &str) -> Vec<Changed> {
        let over = |t: &Task| {
            let last = ["seen", "done-by", "over"];
            t.steps.iter().any(|s| last.contains(&s.news.as_str()))
        };
        let mut changed = Vec::new();
        for task in &mut self.tasks {
            if task.holder == Some(uav) && !over(task) {
                task.holder = None;
                task.step(Step {
                    time_ms,
                    uav: Some(uav),
                    news: "lost".to_owned(),
                    text: text.to_owned(),
                    ..Step::default()
                });
                changed.push(Changed::Task(task.clone()));
            }
        }
        changed
    }
}

impl Task {
    /// The first one, who asked for it, stays.
    fn step(&mut self, step: Step) {
        if self.steps.len() >= STEPS {
            self.steps.remove(1);
        }
        self.steps.push(step);
    }
}

/// The stretches of a list of cells that follow each other up or down.
fn stretches(cells: &[u16]) -> Vec<[u16; 2]> {
    let mut all: Vec<[u16; 2]> = Vec::new();
    for cell in cells {
        match all.last_mut() {
            Some([first, last])
                if last.abs_diff(*cell) == 1
                    && (first == last || (*first < *last) == (*last < *cell)) =>
            {
                *last = *cell;
            }
            _ => all.push([*cell, *cell]),
        }
        if all.len() > STRETCHES {
            all.pop();
            break;
        }
    }
    all
}

#[cfg(test)]
mod tests;
