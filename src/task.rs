//! `skein task`: tasks other than coverage that are asked for, cancelled, and said to be done, in
//! flight.

use crate::console::{AtArgs, Refusal, look, say};
use crate::exit;
use crate::places::{corner, origin, pairs, words};
use clap::{Args, Subcommand};
use serde_json::{Value, json};
use skein_console::Command;
use skein_geometry::frame::Origin;
use skein_interop::place::{LatLon, to_plane};
use skein_peer::input::{NewTask, TaskEdit};
use skein_peer::mission::mm;
use skein_peer::wire::tasks::{SENSORS, TaskKind, WORTH_MAX, sensor_of_name};
use skein_peer::{Overview, TaskView, WATCHERS_MAX};
use std::process::ExitCode;

/// Asks for tasks in flight, cancels them, and says that they were done on the ground.
///
/// The UAVs settle by auction who does which: who wins leaves its section between two cells,
/// flies there, and comes back. A task is done when a UAV saw all of it. A relay
/// position is held until it is cancelled or its time is over, and keeps nobody else in the air;
/// while cells are open one UAV at least is left to cover. The mission is over
/// when everything is covered and no task is open that somebody can do. Without flags the
/// ground station of the only running trial is meant.
#[derive(Debug, Args)]
pub struct TaskArgs {
    /// What happens.
    #[command(subcommand)]
    pub what: What,
    /// Which ground station.
    #[command(flatten)]
    pub at: AtArgs,
}

/// What happens.
#[derive(Debug, Subcommand)]
pub enum What {
    /// Asks for a task.
    #[command(subcommand)]
    Add(Add),
    /// Cancels a task that is open.
    Cancel {
        /// Its name.
        name: String,
    },
    /// Says that a task was done on the ground: services have reached what is followed, or
    /// somebody looked there. Whoever flies for it goes on with its own.
    Done {
        /// Its name, whoever asked for it; `skein task list` tells all.
        name: String,
    },
    /// All tasks and what became of them.
    List {
        /// As one line of JSON.
        #[arg(long)]
        json: bool,
    },
}

/// A task.
#[derive(Debug, Subcommand)]
pub enum Add {
    /// A place that is to be seen, with what lies around it.
    Point {
        /// Latitude and longitude in degrees.
        #[arg(value_name = "LAT,LON", value_parser = corner)]
        place: LatLon,
        /// How it is to be done.
        #[command(flatten)]
        how: How,
    },
    /// An area that is to be seen, in one flight.
    Area {
        /// Latitude and longitude of its corners in degrees.
        #[arg(value_name = "LAT,LON", value_parser = corner, num_args = 3.., required = true)]
        corners: Vec<LatLon>,
        /// After so long it is not wanted any more.
        #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u32).range(1..=86_400))]
        within_s: Option<u32>,
        /// The sensor that it needs; only UAVs that carry it bid.
        #[arg(long, value_name = "SENSOR", value_parser = SENSORS)]
        needs: Option<String>,
        /// What it is worth, next to other tasks.
        #[arg(long, value_name = "WORTH", default_value_t = 100, value_parser = clap::value_parser!(u16).range(1..=i64::from(WORTH_MAX)))]
        worth: u16,
        /// What it is called from now on; without it `task-1` and so on.
        #[arg(long, value_name = "NAME")]
        id: Option<String>,
    },
    /// A place that is to be held as a relay: who wins gives its section up and circles there.
    Relay {
        /// Latitude and longitude in degrees.
        #[arg(value_name = "LAT,LON", value_parser = corner)]
        place: LatLon,
        /// For how long it is to be held; without it until it is cancelled.
        #[arg(long = "for", value_name = "SECONDS", value_parser = clap::value_parser!(u32).range(1..=86_400))]
        for_s: Option<u32>,
        /// How far from the place a UAV may be that holds it.
        #[arg(long, value_name = "METRES", default_value_t = 100.0, value_parser = radius_m)]
        radius_m: f64,
        /// What it is worth, next to other tasks.
        #[arg(long, value_name = "WORTH", default_value_t = 100, value_parser = clap::value_parser!(u16).range(1..=i64::from(WORTH_MAX)))]
        worth: u16,
        /// What it is called from now on; without it `task-1` and so on.
        #[arg(long, value_name = "NAME")]
        id: Option<String>,
    },
    /// A target that is to be followed: who wins gives its section up, flies to the place and
    /// follows the vehicle that is seen nearest to it.
    Track {
        /// Latitude and longitude in degrees of where it is about.
        #[arg(value_name = "LAT,LON", value_parser = corner)]
        place: LatLon,
        /// For how long it is to be followed; without it until it is cancelled.
        #[arg(long = "for", value_name = "SECONDS", value_parser = clap::value_parser!(u32).range(1..=86_400))]
        for_s: Option<u32>,
        /// How far from it a UAV stays; without it half of what its camera sees to either side.
        #[arg(long, value_name = "METRES", value_parser = radius_m)]
        stand_off_m: Option<f64>,
        /// How many UAVs stay with it, so that it is not lost with one of them: each is a task
        /// of its own, `NAME.2` and so on.
        #[arg(long, value_name = "UAVS", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=i64::from(WATCHERS_MAX)))]
        watchers: u8,
        /// What it is worth, next to other tasks.
        #[arg(long, value_name = "WORTH", default_value_t = 100, value_parser = clap::value_parser!(u16).range(1..=i64::from(WORTH_MAX)))]
        worth: u16,
        /// What it is called from now on; without it `task-1` and so on.
        #[arg(long, value_name = "NAME")]
        id: Option<String>,
    },
    /// A line that is to be seen along its length, from either end.
    Line {
        /// Latitude and longitude of its vertices in degrees.
        #[arg(value_name = "LAT,LON", value_parser = corner, num_args = 2.., required = true)]
        way: Vec<LatLon>,
        /// How it is to be done.
        #[command(flatten)]
        how: How,
    },
}

/// How a task is to be done.
#[derive(Debug, Args)]
pub struct How {
    /// How far around the place, or to the sides of the line, is to be seen.
    #[arg(long, value_name = "METRES", default_value_t = 10.0, value_parser = radius_m)]
    pub radius_m: f64,
    /// After so long it is not wanted any more.
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u32).range(1..=86_400))]
    pub within_s: Option<u32>,
    /// The sensor that it needs; only UAVs that carry it bid.
    #[arg(long, value_name = "SENSOR", value_parser = SENSORS)]
    pub needs: Option<String>,
    /// What it is worth, next to other tasks.
    #[arg(long, value_name = "WORTH", default_value_t = 100, value_parser = clap::value_parser!(u16).range(1..=i64::from(WORTH_MAX)))]
    pub worth: u16,
    /// What it is called from now on; without it `task-1` and so on.
    #[arg(long, value_name = "NAME")]
    pub id: Option<String>,
}

fn radius_m(text: &str) -> Result<f64, String> {
    let found = text.parse().ok().filter(|m| (0.0..=1_000.0).contains(m));
    found.ok_or_else(|| "write 0 to 1000 metres".to_owned())
}

/// Runs the verb.
///
/// # Errors
/// When there is no runtime or stdout cannot be written.
pub fn run(args: &TaskArgs) -> anyhow::Result<ExitCode> {
    let edit = match &args.what {
        What::Cancel { name } => Some(TaskEdit::Cancel(name.clone())),
        What::Done { name } => Some(TaskEdit::Done(name.clone())),
        What::Add(_) | What::List { .. } => None,
    };
    if let Some(edit) = edit {
        return say(&args.at, &Command::Task(edit));
    }
    let overview = match look::<Overview>(&args.at, None, &Command::Show)? {
        Ok((overview, _)) => overview,
        Err(refusal) => return Ok(refusal.told()),
    };
    let origin = origin(&overview);
    match &args.what {
        What::Add(add) => match asked(add, origin) {
            Ok(task) => {
                let mut code = ExitCode::from(exit::OK);
                for task in for_all_watchers(add, task) {
                    code = say(&args.at, &Command::Task(TaskEdit::Add(task)))?;
                }
                Ok(code)
            }
            Err(refusal) => Ok(refusal.told()),
        },
        What::List { json: true } => {
            let tasks: Vec<Value> = overview.tasks.iter().map(|t| as_json(t, origin)).collect();
            exit::print(json!({ "revision": overview.revision, "tasks": tasks }))?;
            Ok(ExitCode::from(exit::OK))
        }
        What::List { .. } | What::Cancel { .. } | What::Done { .. } => {
            exit::print(as_text(&overview.tasks, origin))?;
            Ok(ExitCode::from(exit::OK))
        }
    }
}

/// The task that is asked for, in the plane of the mission.
fn asked(add: &Add, origin: Origin) -> Result<NewTask, Refusal> {
    let place = |p: &LatLon| {
        let at = to_plane(origin, *p).map_err(Refusal::of_input)?;
        Ok((mm(at.x), mm(at.y)))
    };
    let (kind, way, how) = match add {
        Add::Point { place, how } => (TaskKind::Pinpoint, std::slice::from_ref(place), how),
        Add::Line { way, how } => (TaskKind::Line, &way[..], how),
        Add::Area {
            corners,
            within_s,
            needs,
            worth,
            id,
        } => {
            return Ok(NewTask {
                name: id.clone(),
                kind: TaskKind::Area,
                places: corners.iter().map(place).collect::<Result<_, Refusal>>()?,
                radius_mm: 0,
                worth: *worth,
                within_ms: within_s.map(|s| s * 1000),
                sensor: needs.as_deref().and_then(sensor_of_name).unwrap_or(0),
            });
        }
        Add::Track {
            place: at,
            for_s,
            stand_off_m,
            worth,
            id,
            watchers: _,
        } => {
            return Ok(NewTask {
                name: id.clone(),
                kind: TaskKind::Track,
                places: vec![place(at)?],
                radius_mm: mm(stand_off_m.unwrap_or(0.0)).unsigned_abs(),
                worth: *worth,
                within_ms: for_s.map(|s| s * 1000),
                sensor: 0,
            });
        }
        Add::Relay {
            place: at,
            for_s,
            radius_m,
            worth,
            id,
        } => {
            return Ok(NewTask {
                name: id.clone(),
                kind: TaskKind::Relay,
                places: vec![place(at)?],
                radius_mm: mm(*radius_m).unsigned_abs(),
                worth: *worth,
                within_ms: for_s.map(|s| s * 1000),
                sensor: 0,
            });
        }
    };
    Ok(NewTask {
        name: how.id.clone(),
        kind,
        places: way.iter().map(place).collect::<Result<_, Refusal>>()?,
        radius_mm: mm(how.radius_m).unsigned_abs(),
        worth: how.worth,
        within_ms: how.within_s.map(|s| s * 1000),
        sensor: how.needs.as_deref().and_then(sensor_of_name).unwrap_or(0),
    })
}

/// What is asked for once for each UAV that is to stay with a target.
fn for_all_watchers(add: &Add, task: NewTask) -> Vec<NewTask> {
    match add {
        Add::Track { watchers, .. } => task.for_watchers(*watchers),
        _ => vec![task],
    }
}

fn as_json(task: &TaskView, origin: Origin) -> Value {
    let held: Vec<Value> = task
        .held_by
        .iter()
        .map(|h| json!({ "uav": h.uav, "bid": f64::from(h.bid) / 1e6, "progress": h.progress }))
        .collect();
    json!({
        "name": task.name,
        "kind": task.kind,
        "state": task.state,
        "places_lat_lon_deg": pairs(origin, &task.places_mm),
        "radius_m": f64::from(task.radius_mm) / 1000.0,
        "needs": task.needs,
        "worth": task.worth,
        "age_ms": task.age_ms,
        "within_ms": task.within_ms,
        "done_by": task.done_by,
        "over_after_ms": task.over_after_ms,
        "held_by": held,
        "nobody_can": task.nobody_can,
    })
}

fn as_text(tasks: &[TaskView], origin: Origin) -> String {
    if tasks.is_empty() {
        return "no task was asked for".to_owned();
    }
    let line = |task: &TaskView| {
        let places = words(origin, &task.places_mm);
        let mut text = format!("{}  {}  {places}", task.name, task.state.word());
        if let Some(by) = task.done_by {
            text += &format!("  by uav{by}");
        }
        for h in &task.held_by {
            text += &format!(
                "  uav{} {}",
                h.uav,
                format!("{:?}", h.progress).to_lowercase()
            );
        }
        if let Some(why) = &task.nobody_can {
            text += &format!("  nobody can: {why}");
        }
        text
    };
    let lines: Vec<String> = tasks.iter().map(line).collect();
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::typed;
    use clap::Parser;

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        task: TaskArgs,
    }

    const ORIGIN: Origin = Origin {
        lat_deg: 60.0,
        lon_deg: 25.0,
    };

    fn added(text: &str) -> Result<NewTask, String> {
        let cli = Cli::try_parse_from(typed(text)).map_err(|e| e.to_string())?;
        match cli.task.what {
            What::Add(add) => asked(&add, ORIGIN).map_err(|r| format!("{r:?}")),
            other => Err(format!("{other:?}")),
        }
    }

    #[test]
    fn tasks_are_read_as_people_write_them() {
        let point = added(
            "task add point 60.001,25 --radius-m 15 --within-s 90 --needs infrared --id gate",
        );
        let point = point.unwrap();
        assert_eq!((point.kind, point.radius_mm), (TaskKind::Pinpoint, 15_000));
        assert_eq!((point.within_ms, point.sensor), (Some(90_000), 2));
        assert_eq!(point.name.as_deref(), Some("gate"));
        assert!((point.places[0].1 - 111_400).abs() < 300, "{point:?}");
        let line = added("task add line 60,25 60.001,25 60.001,25.002").unwrap();
        assert_eq!((line.kind, line.places.len()), (TaskKind::Line, 3));
        assert_eq!((line.worth, line.within_ms, line.sensor), (100, None, 0));
        let area = added("task add area 60,25 60.001,25 60.001,25.002 --within-s 90").unwrap();
        assert_eq!((area.kind, area.places.len()), (TaskKind::Area, 3));
        assert_eq!((area.within_ms, area.radius_mm), (Some(90_000), 0));
        let relay = added("task add relay 60.001,25 --for 300 --id link").unwrap();
        assert_eq!((relay.kind, relay.radius_mm), (TaskKind::Relay, 100_000));
        assert_eq!((relay.within_ms, relay.places.len()), (Some(300_000), 1));
        let cli = Cli::try_parse_from(typed("task add track 60,25 --watchers 2 --id car"));
        let What::Add(add) = cli.unwrap().task.what else {
            panic!("a task is added");
        };
        let both = for_all_watchers(&add, asked(&add, ORIGIN).unwrap());
        assert_eq!(both[0].places, both[1].places);
        assert_eq!([both[0].worth, both[1].worth], [100, 50]);
        let names: Vec<_> = both.into_iter().filter_map(|t| t.name).collect();
        assert_eq!(names, ["car", "car.2"]);
        assert!(added("task add point -33,-70").unwrap_err().contains("km"));
        for wrong in [
            "task add",
            "task add point",
            "task add point 60",
            "task add point 60,25 --radius-m NaN",
            "task add point 60,25 --within-s 0",
            "task add point 60,25 --needs eyes",
            "task add point 60,25 --worth 0",
            "task add line 60,25",
            "task add area 60,25 60.001,25",
            "task add relay 60,25 60,26",
            "task add relay 60,25 --within-s 60",
            "task add track 60,25 --watchers 0",
            "task cancel",
            "task done",
        ] {
            assert!(added(wrong).is_err(), "{wrong}");
        }
    }
}
