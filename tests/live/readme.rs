//! Every command of the README is run, in the order in which somebody would who reads it.
//!
//! Where it names a word in capitals, something stands in its place; where it names several
//! words, each is run. Left out are `cargo test`, which runs this, and `cargo install`, which
//! builds for minutes; `cargo run --release -- trial` is run as `skein trial`; of its thousand
//! storms four are flown.

use crate::commands::{is_a_pattern, named, words};
use crate::support::{Place, alone, ended, interrupt, lines_of, root, wait_until};
use crate::terminal::OnTerminal;
use std::collections::BTreeSet;
use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

/// A trial takes a minute; a slow machine slows it down.
const DEADLINE: Duration = Duration::from_secs(400);

/// How a page whose run is over says that it is still there.
const STAYS: &str = "the page stays until Ctrl-C";

/// The README's commands, and which of them were run.
struct Readme {
    named: BTreeSet<String>,
    run: BTreeSet<String>,
    place: Place,
    /// Whether trials of other tests may go on meanwhile.
    is_aside: bool,
}

impl Readme {
    fn new() -> Self {
        let text = fs::read_to_string(root().join("README.md")).unwrap();
        Self {
            named: named(&text).into_iter().collect(),
            run: BTreeSet::new(),
            place: Place::new(),
            is_aside: true,
        }
    }

    /// The command, as the README has it.
    fn exactly(&mut self, written: &str) -> Command {
        assert!(
            !is_a_pattern(written),
            "{written}: capitals have to be filled in"
        );
        self.instead(written, written)
    }

    /// What is run where the README has words in capitals, or more than a test has time for.
    fn instead(&mut self, written: &str, filled: &str) -> Command {
        assert!(
            self.named.contains(written),
            "the README names no {written:?}"
        );
        self.run.insert(written.to_owned());
        let words = words(filled);
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let mut command = self.place.command(&words);
        if self.is_aside {
            command = aside(&command);
        }
        command.current_dir(self.place.path(""));
        command
    }
}

/// The command with what others leave of the processors.
fn aside(command: &Command) -> Command {
    let mut aside = Command::new("nice");
    aside.args(["-n", "19"]);
    aside.arg(command.get_program()).args(command.get_args());
    aside.envs(command.get_envs().filter_map(|(k, v)| Some((k, v?))));
    aside.stdin(Stdio::null());
    aside
}

/// Runs it to its end, which has to be a good one.
fn well(mut command: Command) -> Output {
    let out = command.output().unwrap();
    assert!(
        out.status.success(),
        "{command:?}: {}\n{}{}",
        out.status,
        String::from_utf8_lossy(&out.stdout),
        String::from_utf8_lossy(&out.stderr)
    );
    out
}

/// What it prints.
fn told(command: Command) -> String {
    String::from_utf8(well(command).stdout).unwrap()
}

/// Something that goes on until it is asked to stop.
struct Running {
    child: Child,
    lines: Arc<Mutex<Vec<String>>>,
}

impl Running {
    fn start(mut command: Command) -> Self {
        let piped = command.stdout(Stdio::null()).stderr(Stdio::piped());
        let mut child = piped.spawn().unwrap();
        let lines = lines_of(child.stderr.take().unwrap());
        Self { child, lines }
    }

    /// The rest of the first line that begins so.
    fn line(&self, begin: &str) -> String {
        let mut found = None;
        wait_until(DEADLINE, begin, || {
            let lines = self.lines.lock().unwrap();
            let rest = |line: &String| Some(line.strip_prefix(begin)?.to_owned());
            found = lines.iter().find_map(rest);
            found.is_some()
        });
        found.unwrap()
    }

    /// Asks it to stop: it has to end with this code.
    fn ends(&mut self, code: i32) {
        interrupt(&self.child);
        let ended = ended(&mut self.child, DEADLINE);
        assert_eq!(ended, Some(code), "{:#?}", self.lines.lock().unwrap());
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The page behind such an address, which is on this computer.
fn page(url: &str) -> String {
    let place = url.trim().strip_prefix("http://").unwrap();
    let host = place.split('/').next().unwrap();
    assert!(host.starts_with("127.0.0.1:"), "{url}");
    let mut stream = TcpStream::connect(host).unwrap();
    write!(
        stream,
        "GET / HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n"
    )
    .unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    answer
}

/// A page as `--web` serves it, until it is asked to stop; of a run, when it is over.
fn serves_a_page(command: Command, of_a_run: bool) {
    let mut running = Running::start(command);
    let url = running.line("page: ");
    assert!(page(&url).contains("<html"), "no page");
    if of_a_run {
        running.line(STAYS);
    } else {
        // Who watches goes on until then, and listens for it once the page is there.
        thread::sleep(Duration::from_secs(2));
    }
    running.ends(0);
}

#[test]
fn every_command_of_the_readme_is_run() {
    let mut readme = Readme::new();
    on_the_ground(&mut readme);
    plans(&mut readme);
    a_simulated_run(&mut readme);
    readme.is_aside = false;
    let _alone = alone();
    a_trial_on_a_terminal(&mut readme);
    a_trial_with_everything(&mut readme);
    let left: Vec<&String> = readme.named.difference(&readme.run).collect();
    assert!(left.is_empty(), "never run: {left:#?}");
}

/// What needs no swarm.
fn on_the_ground(r: &mut Readme) {
    for verb in ["trial", "peer", "plan"] {
        let help = format!("skein {verb} --help");
        assert!(told(r.instead("skein VERB --help", &help)).contains("Usage"));
    }
    assert!(told(r.instead("skein plan", "skein plan --help")).contains("cover"));
    well(r.instead("skein check SCENARIO", "skein check helsinki"));
    assert!(told(r.instead("skein schema [KIND]", "skein schema")).contains("claim"));
    assert!(told(r.instead("skein schema [KIND]", "skein schema state")).contains("$schema"));
    let drawn = "skein mission diagram NAME|FILE";
    assert!(told(r.instead(drawn, "skein mission diagram patrol")).contains("<svg"));
    let shell = r.instead("skein completions SHELL", "skein completions bash");
    assert!(told(shell).contains("complete"));
    well(r.instead("skein man [DIR]", "skein man man"));
    assert!(Path::new(&r.place.path("man/skein.1")).is_file());
    let bench = "skein bench conflicts|auction|tracking";
    let conflicts = "skein bench conflicts --n 8 --seeds 0..10";
    assert!(told(r.exactly(conflicts)).contains("losses_of_separation"));
    let auction = "skein bench auction --n 8 --tasks 24 --seeds 0..10";
    assert!(told(r.exactly(auction)).contains("value"));
    for which in ["conflicts", "auction", "tracking"] {
        let some = format!("skein bench {which} --seeds 0..2");
        assert!(!told(r.instead(bench, &some)).is_empty());
    }
}

const FIELD: &str = r#"{"type": "FeatureCollection", "features": [
  {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [
    [[24.9355, 60.1655], [24.9445, 60.1655], [24.9445, 60.1690], [24.9355, 60.1690], [24.9355, 60.1655]]]}}
]}"#;

const ROAD: &str = r#"{"type": "FeatureCollection", "features": [
  {"type": "Feature", "properties": {}, "geometry": {"type": "LineString", "coordinates": [
    [24.9355, 60.1655], [24.9400, 60.1670], [24.9445, 60.1655]]}}
]}"#;

const PLACES: &str = r#"{"type": "FeatureCollection", "features": [
  {"type": "Feature", "properties": {}, "geometry": {"type": "Point", "coordinates": [24.9360, 60.1660]}},
  {"type": "Feature", "properties": {}, "geometry": {"type": "Point", "coordinates": [24.9400, 60.1680]}},
  {"type": "Feature", "properties": {}, "geometry": {"type": "Point", "coordinates": [24.9440, 60.1660]}}
]}"#;

/// Plans for a person.
fn plans(r: &mut Readme) {
    r.place.file("field.geojson", FIELD);
    r.place.file("road.geojson", ROAD);
    r.place.file("places.geojson", PLACES);
    let plan = "skein plan cover|line|visit|patrol|route FILE";
    let (margin, turn) = ("--clearance-m 10", "--turn-radius-m 25");
    let filled = [
        format!(
            "skein plan cover field.geojson --k 2 --swath-m 45 --quick {margin} {turn} \
             --format plan --out plans"
        ),
        format!("skein plan line road.geojson --swath-m 45 {margin}"),
        format!("skein plan visit places.geojson {margin}"),
        format!("skein plan patrol road.geojson --over lines --swath-m 45 {margin}"),
        format!(
            "skein plan route field.geojson --from 60.1650,24.9350 --to 60.1695,24.9450 {margin}"
        ),
    ];
    for verb in filled {
        well(r.instead(plan, &verb));
    }
    let files = "plans/uav-1.plan plans/uav-2.plan";
    well(r.instead(
        "skein plan verify FILE --area FILE",
        &format!("skein plan verify {files} --area field.geojson --swath-m 45 {margin} {turn}"),
    ));
}

/// A run in virtual time, and what is made of its recording.
fn a_simulated_run(r: &mut Readme) {
    let recorded = "skein sim helsinki --seed 1 --run-dir run";
    assert!(told(r.instead("skein sim [SCENARIO]", recorded)).contains("PASSED"));
    well(r.instead("skein sim", "skein sim --seed 2"));
    for trial in ["skein sim airspace", "skein sim cranes"] {
        assert!(told(r.exactly(trial)).contains("PASSED"));
    }
    assert!(told(r.exactly("skein sim --why 3@120")).contains("uav3"));
    serves_a_page(r.exactly("skein sim helsinki --web"), true);
    well(r.instead("skein report RUN", "skein report run"));
    assert!(told(r.instead("skein export RUN --csv", "skein export run --csv")).contains(','));
    serves_a_page(
        r.instead("skein replay RUN", "skein replay run --web"),
        true,
    );
    let mut played = OnTerminal::start(r.instead("skein replay RUN", "skein replay run"));
    thread::sleep(Duration::from_secs(3));
    played.press("q");
    let (code, screen) = played.end(DEADLINE);
    assert_eq!(code, Some(0), "{screen}");
    assert!(screen.contains("alive"), "{screen}");
    let storms = r.instead(
        "skein sim helsinki --seeds 0..1000 --storm",
        "skein sim helsinki --seeds 0..4 --storm",
    );
    assert!(told(storms).contains('4'));
}

/// The first command, where somebody looks on.
fn a_trial_on_a_terminal(r: &mut Readme) {
    let trial = OnTerminal::start(r.exactly("skein trial"));
    let (code, screen) = trial.end(DEADLINE);
    assert_eq!(code, Some(0), "{screen}");
    assert!(screen.contains("PASSED"), "{screen}");
    let small = root().join("tests/live/square.json5");
    let small = format!("skein trial {} --time-scale 4", small.display());
    well(r.instead("skein trial [SCENARIO]", &small));
}

/// A trial with a page, an operator and faults; what it is called to do at last is to return.
fn a_trial_with_everything(r: &mut Readme) {
    let mut trial = Running::start(r.exactly("skein trial --web"));
    let url = trial.line("page: ");
    assert!(page(&url).contains("<html"), "no page");
    wait_until(DEADLINE, "somebody is heard", || {
        let mut command = r.exactly("skein observe '*/v4/claim/**'");
        command.args(["--timeout", "5"]);
        command.output().unwrap().status.success()
    });
    assert!(told(r.exactly("skein why 3")).contains("uav3"));

    let mut map = OnTerminal::start(r.exactly("skein watch"));
    thread::sleep(Duration::from_secs(4));
    map.press("q");
    let (code, screen) = map.end(DEADLINE);
    assert_eq!(code, Some(0), "{screen}");
    assert!(screen.contains("alive"), "{screen}");
    serves_a_page(r.instead("skein watch [TRIAL]", "skein watch --web"), false);

    let nfz = "skein nfz add|remove|list";
    well(r.exactly("skein nfz add --circle 60.1690,24.9400,30 --id fire"));
    assert!(told(r.instead(nfz, "skein nfz list")).contains("fire"));
    well(r.instead(nfz, "skein nfz remove fire"));
    let task = "skein task add|cancel|done|list";
    well(r.exactly("skein task add point 60.1690,24.9400"));
    well(r.exactly("skein task add line 60.1690,24.9400 60.1701,24.9422 --needs infrared"));
    well(r.exactly("skein task add track 60.1690,24.9400 --for 60"));
    let id = "skein task add point 60.1700,24.9410 --id later";
    well(r.instead("skein task add point 60.1690,24.9400", id));
    assert!(told(r.instead(task, "skein task list")).contains("later"));
    well(r.instead(task, "skein task cancel later"));
    let id = "skein task add point 60.1700,24.9410 --id looked-at";
    well(r.instead("skein task add point 60.1690,24.9400", id));
    well(r.instead(task, "skein task done looked-at"));

    well(r.exactly("skein chaos kill 3"));
    let order = "skein mission hold|resume|rtb [--uav ID]";
    for one in ["hold --uav 2", "resume --uav 2", "hold", "resume"] {
        well(r.instead(order, &format!("skein mission {one}")));
    }
    let given = "skein mission submit|revise SCENARIO";
    well(r.instead(given, "skein mission revise helsinki"));
    a_way_along_streets(r, given);
    well(r.instead(given, "skein mission submit helsinki"));
    well(r.instead(order, "skein mission rtb"));

    peer_of_its_own(r);
    // Nobody is told to go on, so that the trial would last until its scenario's time is over.
    trial.ends(4);
}

/// The mission is replaced by one that brings streets, along which a way is asked for.
fn a_way_along_streets(r: &mut Readme, given: &str) {
    let trials = root().join("configs/trials");
    let text = fs::read_to_string(trials.join("helsinki.json5")).unwrap();
    let data = root().join("configs/data");
    let text = text.replace("../data", data.to_str().unwrap());
    let streets = "mission: { streets: { ways_m: [[[0, 0], [250, 400], [700, 400]]] } },";
    let text = text.replacen("level_m: 45,", &format!("level_m: 45, {streets}"), 1);
    r.place.file("streets.json5", &text);
    well(r.instead(given, "skein mission submit streets.json5"));
    // The ground station follows it as soon as it has computed what follows from it.
    wait_until(DEADLINE, "a way is hinted", || {
        let mut hint = r.exactly("skein hint 60.1690,24.9400 60.1655,24.9355");
        let out = hint.output().unwrap();
        out.status.success() && String::from_utf8_lossy(&out.stdout).contains("way asked for")
    });
    let back = r.instead(
        "skein hint FROM TO",
        "skein hint 60.1655,24.9355 60.1690,24.9400",
    );
    assert!(told(back).contains("m in"));
}

/// A trial runs this verb for each UAV; by the configuration that explains every field it finds
/// no world, and says so.
fn peer_of_its_own(r: &mut Readme) {
    let config = fs::read_to_string(root().join("configs/peer.json5")).unwrap();
    // Its journal is made beside it.
    r.place.file("peer.json5", &config);
    let filled = "skein peer --config peer.json5";
    let peer = r.instead("skein peer --config FILE", filled).output();
    let said = String::from_utf8(peer.unwrap().stderr).unwrap();
    assert!(
        said.contains("the world at 127.0.0.1:4000 cannot be reached"),
        "{said}"
    );
    r.instead("skein peer", filled);
}
