//! The loop: words in, keys in, pictures out.

use crate::keys::{Wish, wish};
use crate::look::Look;
use crate::picture::Picture;
use crate::player::{Pace, Player};
use crate::screen::Screen;
use crossterm::event;
use skein_recording::Record;
use skein_recording::model::Knowledge;
use skein_view::Standing;
use std::fmt;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

/// Time between two pictures: enough to see UAVs move, little for two cores that fly a swarm.
const PERIOD: Duration = Duration::from_millis(120);

/// How long an answer stays in the last line.
const ANSWER: Duration = Duration::from_secs(6);

/// A second press within so long means it.
const SURE: Duration = Duration::from_secs(3);

const KEYS: &str = "q quit  arrows move  + - 0 zoom  n p select  l links";

/// Kills a peer: does not wait, and sends what came of it.
pub type Kill = Box<dyn Fn(u16, Sender<String>) + Send>;

/// What is shown, and how.
pub struct Options {
    /// What it is, for the first line.
    pub title: String,
    /// Who knows what frames say.
    pub knowledge: Knowledge,
    /// How the run goes by.
    pub pace: Pace,
    /// What the terminal can show.
    pub look: Look,
    /// What the key `K` does, where there is somebody to kill.
    pub kill: Option<Kill>,
    /// Set from elsewhere when the program is asked to stop.
    pub stop: Arc<AtomicBool>,
    /// Whether the last picture stays until a key.
    pub stays: bool,
}

impl fmt::Debug for Options {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Options")
            .field("title", &self.title)
            .field("pace", &self.pace)
            .finish_non_exhaustive()
    }
}

/// Why the map was left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Left {
    /// By a person, or because the program was asked to stop.
    Asked,
    /// Nothing came any more.
    Over,
}

/// Shows a run until it is over or a person leaves.
///
/// # Errors
/// When the terminal cannot be taken or written.
pub fn show(words: Receiver<Record>, options: Options) -> io::Result<Left> {
    let mut screen = Screen::take()?;
    let (answer, answers) = channel();
    let mut shown = Shown {
        standing: Standing::default(),
        player: Player::new(words, options.pace),
        picture: Picture::new(options.title, options.knowledge, options.look),
        kill: options.kill,
        answer,
        said: None,
        sure: None,
    };
    let mut last = Instant::now();
    loop {
        let passed = last.elapsed();
        last += passed;
        for record in shown.player.due(passed) {
            shown.standing.hear(record);
        }
        if let Ok(text) = answers.try_recv() {
            shown.said = Some((text, Instant::now()));
        }
        shown.words();
        screen
            .terminal
            .draw(|canvas| shown.picture.draw(canvas, &shown.standing))?;
        if shown.player.over && !options.stays {
            return Ok(Left::Over);
        }
        let until = Instant::now() + PERIOD;
        while let Some(left) = until.checked_duration_since(Instant::now()) {
            if options.stop.load(Ordering::SeqCst) {
                return Ok(Left::Asked);
            }
            if event::poll(left)?
                && let Some(wish) = wish(&event::read()?)
            {
                if wish == Wish::Quit {
                    return Ok(Left::Asked);
                }
                shown.wish(wish);
                break;
            }
        }
    }
}

/// All that is on the screen.
struct Shown {
    standing: Standing,
    player: Player,
    picture: Picture,
    kill: Option<Kill>,
    answer: Sender<String>,
    said: Option<(String, Instant)>,
    /// Who is to be killed if that is said again.
    sure: Option<(u16, Instant)>,
}

impl Shown {
    /// Puts into words how the run goes by, and what keys do.
    fn words(&mut self) {
        let paused = if self.player.paused { " paused" } else { "" };
        self.picture.pace = match self.player.pace {
            Pace::Live => String::new(),
            Pace::Play(speed) => format!(" x{speed}{paused}"),
        };
        let said = self.said.as_ref().filter(|(_, at)| at.elapsed() < ANSWER);
        let play = match (self.player.pace, self.kill.is_some()) {
            (Pace::Play(_), _) => "  space pause  [ ] speed",
            (Pace::Live, true) => "  K kill",
            (Pace::Live, false) => "",
        };
        self.picture.foot = match said {
            Some((text, _)) => text.clone(),
            None if self.player.over => format!("over; {KEYS}"),
            None => format!("{KEYS}{play}"),
        };
    }

    fn wish(&mut self, wish: Wish) {
        let view = self.picture.view.as_mut();
        match (wish, view) {
            (Wish::Pan(columns, rows), Some(view)) => view.pan(columns, rows),
            (Wish::Zoom(by), Some(view)) => view.zoom(by),
            (Wish::Fit | Wish::Redraw, _) => self.picture.view = None,
            (Wish::Pause, _) => self.player.paused = !self.player.paused,
            (Wish::Faster(steps), _) => self.player.faster(steps),
            (Wish::Select(step), _) => self.select(step),
            (Wish::Nobody, _) => self.picture.selected = None,
            (Wish::Links, _) => self.picture.links = !self.picture.links,
            (Wish::Kill, _) => self.kill(),
            (Wish::Quit | Wish::Pan(..) | Wish::Zoom(_), _) => {}
        }
    }

    fn select(&mut self, step: isize) {
        let ids: Vec<u16> = self.standing.uavs().iter().map(|u| u.id).collect();
        let at = ids.iter().position(|id| Some(*id) == self.picture.selected);
        let last = ids.len().saturating_sub(1);
        let to = match (at, step) {
            (None, 1..) => 0,
            (Some(at), 1..) if at < last => at + 1,
            (Some(at), ..=-1) if at > 0 => at - 1,
            (Some(_), 1..) => 0,
            _ => last,
        };
        self.picture.selected = ids.get(to).copied();
    }

    /// Kills the selected UAV, if that is said twice.
    fn kill(&mut self) {
        let now = Instant::now();
        let (text, sure) = match (&self.kill, self.picture.selected) {
            (None, _) => ("nothing can be killed here".to_owned(), None),
            (_, None) => ("select a UAV first: n, p".to_owned(), None),
            (Some(kill), Some(id)) => match self.sure {
                Some((of, at)) if of == id && now.duration_since(at) < SURE => {
                    kill(id, self.answer.clone());
                    (format!("uav{id} is to be killed …"), None)
                }
                _ => (format!("K again kills uav{id}"), Some((id, now))),
            },
        };
        self.sure = sure;
        self.said = Some((text, now));
    }
}
