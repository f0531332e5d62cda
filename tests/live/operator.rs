//! The operator: orders and missions at the console of a ground station, in a trial and
//! without a simulated world.

use crate::DEADLINE;
use crate::support::{Place, Trial, alone, free_port, root};
use serde_json::{Value, json};
use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::Duration;

/// The small scenario, two rows of cells larger and with the base in a corner.
fn wide(place: &Place) -> String {
    let text = std::fs::read_to_string(root().join("tests/live/square.json5")).unwrap();
    let changes = [
        ("north_m: 384 }", "north_m: 480 }"),
        (
            "base: { east_m: 240, north_m: 192 }",
            "base: { east_m: 60, north_m: 420 }",
        ),
    ];
    let wide = changes.iter().fold(text, |text, (old, new)| {
        assert!(text.contains(old), "{old}");
        text.replacen(old, new, 1)
    });
    place.file("wide.json5", &wide)
}

/// How far a state was written from a place, metres.
fn distance_m(state: &Value, east_m: f64, north_m: f64) -> f64 {
    let metres = |name: &str| state[name].as_f64().unwrap() / 1000.0;
    (metres("east_mm") - east_m).hypot(metres("north_mm") - north_m)
}

#[test]
fn the_operator_of_a_trial_revises_the_mission_adds_a_zone_and_calls_all_home() {
    let _alone = alone();
    let place = Place::new();
    let mut trial = Trial::start(&place, "operator", &["--time-scale", "4"]);
    trial.wait_for_time(6.0, DEADLINE);
    strangers_are_refused(&place);

    let (code, said) = place.skein(&["mission", "revise", &wide(&place)]);
    assert_eq!(code, 0, "{said}");
    assert!(said.contains("as revision 2"), "{said}");
    let uavs = [1, 2, 3, 4];
    place.observe_until(&["live/v4/state/**"], DEADLINE, |newest| {
        uavs.iter()
            .all(|id| newest.get(id).is_some_and(|s| s["cells"] == 100))
    });

    a_zone_is_added(&place);
    a_uav_says_why(&place);
    a_task_is_done(&place);
    a_relay_position_is_held(&place);

    // One is told alone, and only it turns home.
    let (code, said) = place.skein(&["mission", "rtb", "--uav", "3"]);
    assert!(
        code == 0 && said.contains("return-to-base to uav3"),
        "{said}"
    );
    place.observe_until(&["live/v4/state/**"], DEADLINE, |newest| {
        let returns = |id: &u64| newest.get(id).is_some_and(|s| s["activity"] == "Returning");
        returns(&3) && uavs.iter().filter(|id| returns(id)).count() == 1
    });

    let (code, said) = place.skein(&["mission", "rtb"]);
    assert_eq!(
        (code, said.trim()),
        (0, "the ground station says return-to-base to all")
    );
    place.observe_until(&["live/v4/state/**"], DEADLINE, |newest| {
        uavs.iter().all(|id| {
            newest
                .get(id)
                .is_some_and(|s| s["activity"] == "Returning" && distance_m(s, 60.0, 420.0) < 120.0)
        })
    });
    let (code, said) = place.skein(&["mission", "--base", "240,192"]);
    assert!(code == 0 && said.contains("as revision 4"), "{said}");
    let (code, said) = place.skein(&["nfz", "remove", "fire"]);
    assert!(code == 0 && said.contains("as revision 5"), "{said}");
    assert!(said.contains("return-to-base stands"), "{said}");
    let (code, said) = place.skein(&["order", "resume"]);
    assert_eq!(code, 0, "{said}");

    let verdict = trial.verdict(DEADLINE);
    assert_eq!(verdict["passed"], true, "{verdict:#}");
    let tasks = verdict["tasks"].as_array().unwrap();
    let gate = tasks.iter().find(|t| t["name"] == "gate").unwrap();
    assert!(
        gate["seen_by"].is_u64() && gate["state"] == "done",
        "{tasks:#?}"
    );
    assert_eq!(
        verdict["finished"].as_array().unwrap().len(),
        4,
        "{verdict:#}"
    );
}

/// A zone in a corner of the area: all hear of it, and ask for fewer cells.
fn a_zone_is_added(place: &Place) {
    let zone = ["--circle", "60.168734,24.942002,20", "--id", "fire"];
    let (code, said) = place.skein(&[&["nfz", "add"], &zone[..]].concat());
    assert!(code == 0 && said.contains("as revision 3"), "{said}");
    let (code, said) = place.skein(&[&["nfz", "add"], &zone[..]].concat());
    assert!(code == 3 && said.contains("is there already"), "{said}");
    let (code, said) = place.skein(&["nfz", "add", "--circle", "60.169273,24.936583,20"]);
    assert!(
        code == 3 && said.contains("cannot be flown: the launch point"),
        "{said}"
    );
    let (code, said) = place.skein(&["nfz", "list"]);
    assert!(code == 0 && said.starts_with("fire  60.16"), "{said}");
    crate::support::wait_until(DEADLINE, "all follow revision 3", || {
        let (code, said) = place.skein(&["mission", "show", "--json"]);
        let shown: Value = serde_json::from_str(&said).unwrap_or(Value::Null);
        let others = shown["others"].as_array().cloned().unwrap_or_default();
        let work = &shown["work"];
        code == 0
            && work["revision"] == 3
            && work["cells"]
                .as_u64()
                .is_some_and(|n| (80..100).contains(&n))
            && (1..=4).all(|id| {
                let follows = |o: &Value| o["id"] == id && o["revision"] == 3;
                others.iter().any(follows)
            })
    });
}

/// A place is asked for in flight: somebody is given it, sees it, and all are told.
fn a_task_is_done(place: &Place) {
    let task = [
        "task",
        "add",
        "point",
        "60.168642,24.938208",
        "--id",
        "gate",
    ];
    let (code, said) = place.skein(&task);
    assert!(
        code == 0 && said.contains("the task gate is asked for"),
        "{said}"
    );
    let (code, said) = place.skein(&task);
    assert!(code == 3 && said.contains("is open already"), "{said}");
    let wide = [&task[..4], &["--radius-m", "90"]].concat();
    let (code, said) = place.skein(&wide);
    assert!(code == 3 && said.contains("larger than"), "{said}");
    let (code, said) = place.skein(&["task", "cancel", "door"]);
    assert!(code == 3 && said.contains("there are: gate"), "{said}");
    crate::support::wait_until(DEADLINE, "the task is done", || {
        let (code, said) = place.skein(&["task", "list", "--json"]);
        let told: Value = serde_json::from_str(&said).unwrap_or(Value::Null);
        let gate = &told["tasks"][0];
        code == 0 && gate["state"] == "done" && gate["done_by"].as_u64().is_some()
    });
    let (_, said) = place.skein(&["task", "list"]);
    let by = said
        .trim()
        .rsplit("uav")
        .next()
        .unwrap_or_default()
        .to_owned();
    crate::support::wait_until(DEADLINE, "who did it says so", || {
        let (code, why) = place.skein(&["why", &by]);
        code == 0 && why.contains("it did the task \"gate\"")
    });
}

/// A relay position is asked for in flight: somebody holds it until it is cancelled.
fn a_relay_position_is_held(place: &Place) {
    let task = [
        "task",
        "add",
        "relay",
        "60.168642,24.938208",
        "--id",
        "link",
    ];
    let narrow = [&task[..4], &["--radius-m", "5"]].concat();
    let (code, said) = place.skein(&narrow);
    assert!(code == 3 && said.contains("expected a radius"), "{said}");
    let (code, said) = place.skein(&task);
    assert!(
        code == 0 && said.contains("the task link is asked for"),
        "{said}"
    );
    let link = || {
        let (_, said) = place.skein(&["task", "list"]);
        let line = said.lines().find(|line| line.starts_with("link"));
        line.unwrap_or_default().to_owned()
    };
    crate::support::wait_until(DEADLINE, "somebody holds the relay position", || {
        link().contains("begun")
    });
    let line = link();
    let words: Vec<&str> = line.split_whitespace().collect();
    let by = words.iter().find(|word| word.starts_with("uav"));
    let by = by.copied().unwrap_or_default().to_owned();
    let (code, why) = place.skein(&["why", &by]);
    assert!(code == 0 && why.contains("relay position"), "{why}");
    let (code, said) = place.skein(&["task", "cancel", "link"]);
    assert_eq!(code, 0, "{said}");
    crate::support::wait_until(DEADLINE, "the relay position is left", || {
        let (code, why) = place.skein(&["why", &by]);
        code == 0 && why.contains("it left the task \"link\"")
    });
}

/// A UAV is asked what it does and why; it takes no orders at its console.
fn a_uav_says_why(place: &Place) {
    let (code, said) = place.skein(&["why", "uav2"]);
    assert!(code == 0 && said.starts_with("uav2 at"), "{said}");
    for word in [
        "order     resume",
        "revision 3",
        "fuel",
        "peer 1    alive",
        "s ago  ",
    ] {
        assert!(said.contains(word), "{word}: {said}");
    }
    let (code, said) = place.skein(&["why", "2", "--json"]);
    let why: Value = serde_json::from_str(&said).unwrap();
    assert!(
        code == 0 && why["id"] == 2 && why["work"]["revision"] == 3,
        "{why:#}"
    );
    let (code, said) = place.skein(&["why", "77"]);
    assert!(code == 4 && said.contains("no peer 77"), "{said}");
    let (code, said) = place.skein(&["hint", "60.165,24.935", "60.166,24.936"]);
    assert!(code == 3 && said.contains("brings no streets"), "{said}");
    let (code, said) = place.skein(&["hint", "60.165,24.935", "10.166,24.936"]);
    assert!(code == 3 && said.contains("km from the origin"), "{said}");
    let console = place.entry()["consoles"]["2"].clone();
    let at = console["at"].as_str().unwrap();
    let token_file = console["token_file"].as_str().unwrap();
    let flags = ["--at", at, "--token-file", token_file];
    let (code, said) = place.skein(&[&["mission", "cancel"], &flags[..]].concat());
    assert!(code == 3 && said.contains("no ground station"), "{said}");
    let (code, said) = place.skein(&[&["why", "3"], &flags[..]].concat());
    assert!(code == 4 && said.contains("peer 2 answers there"), "{said}");
}

/// A wrong token, a mission that does not fit, garbage: nothing follows from them.
fn strangers_are_refused(place: &Place) {
    let console = place.entry()["console"].clone();
    let at = console["at"].as_str().unwrap();
    let token_file = console["token_file"].as_str().unwrap();
    let token = std::fs::read_to_string(token_file).unwrap();
    let guess = place.file("guess", &token.trim().chars().rev().collect::<String>());
    let (code, said) = place.skein(&["order", "hold", "--at", at, "--token-file", &guess]);
    assert!(code == 3 && said.contains("the token is wrong"), "{said}");

    let text = std::fs::read_to_string(root().join("tests/live/square.json5")).unwrap();
    for (right, wrong, message) in [
        (
            "lat_deg: 60.1655",
            "lat_deg: 60.1755",
            "its origin is not that of the swarm",
        ),
        ("bank_deg: 45", "bank_deg: 60", "the UAVs in the air need"),
        ("spacing_m: 48", "spacing_m: 30", "unfit.json5:13:"),
    ] {
        assert!(text.contains(right), "{right}");
        let file = place.file("unfit.json5", &text.replacen(right, wrong, 1));
        let (code, said) = place.skein(&["mission", &file]);
        assert!(code == 3 && said.contains(message), "{wrong}: {said}");
    }

    for bytes in [
        b"\0\xff\n".to_vec(),
        vec![b'x'; 100_000],
        format!("{token}{{]\n").into_bytes(),
    ] {
        let mut stream = TcpStream::connect(at).unwrap();
        stream
            .set_read_timeout(Some(Duration::from_secs(20)))
            .unwrap();
        // The console may close before it was told everything.
        let _ = stream.write_all(&bytes);
        let _ = stream.shutdown(Shutdown::Write);
        let mut said = String::new();
        let _ = stream.read_to_string(&mut said);
        assert!(said.is_empty() || said.contains("Err"), "{said}");
    }
}

#[test]
fn without_a_simulated_world_a_mission_and_an_order_reach_peers_over_the_radio() {
    let place = Place::new();
    let (at, first, second) = (free_port(), free_port(), free_port());
    let config = |id: u16, port: u16, links: &[String]| {
        json!({
            "id": id,
            "role": "ground",
            "fleet": "field",
            "beacon_period_ms": 200,
            "rate_bps": 1_000_000,
            "queue_age_ms": 2000,
            "height_m": 2,
            "mission": null,
            "seed": 1,
            "journal": format!("{id}.journal"),
            "listen": format!("tcp/127.0.0.1:{port}"),
            "links": links,
            "lease_ms": 2000,
        })
    };
    let mut operated = config(100, first, &[]);
    operated["console"] = json!({ "listen": format!("127.0.0.1:{at}"), "token_file": "100.token" });
    let link = format!("tcp/127.0.0.1:{first}");
    let ground = place.peer("100.json5", &operated);
    let _other = place.peer(
        "101.json5",
        &config(101, second, std::slice::from_ref(&link)),
    );

    let console = format!("127.0.0.1:{at}");
    let token_file = place.path("100.token");
    let flags = ["--at", &console, "--token-file", &token_file];
    let say = |what: &[&str]| place.skein(&[what, &flags].concat());
    crate::support::wait_until(DEADLINE, "the console is open", || {
        say(&["order", "resume"]).0 == 0
    });
    let (code, said) = say(&["mission", "--base", "1,2"]);
    assert!(code == 3 && said.contains("no mission"), "{said}");

    // What is spoken once is seen only by an observer that is there already.
    let watching = place.watch(&format!("tcp/127.0.0.1:{second}"));
    watching.until("anything", DEADLINE, |_| true);
    let cells = |of: u64, cells: u64| {
        move |r: &Value| r["kind"] == "state" && r["author"] == of && r["body"]["cells"] == cells
    };
    let hold_in_life = |life: u64| {
        move |r: &Value| {
            r["kind"] == "operator" && r["incarnation"] == life && r["body"]["all"] == "hold"
        }
    };
    let square = root().join("tests/live/square.json5");
    let (code, said) = say(&["mission", square.to_str().unwrap()]);
    assert!(code == 0 && said.contains("as revision 1"), "{said}");
    watching.until("the mission at 101", DEADLINE, cells(101, 80));
    let (code, said) = say(&["mission", &wide(&place)]);
    assert!(code == 0 && said.contains("as revision 2"), "{said}");
    watching.until("its revision at 101", DEADLINE, cells(101, 100));

    // Its end, and another one after it.
    let (code, said) = say(&["mission", "cancel"]);
    assert!(code == 0 && said.contains("as revision 3"), "{said}");
    let (code, said) = say(&["mission", "revise", square.to_str().unwrap()]);
    assert!(code == 3 && said.contains("is cancelled"), "{said}");
    let (code, said) = say(&["mission", "submit", square.to_str().unwrap()]);
    assert!(code == 0 && said.contains("as revision 4"), "{said}");
    let (code, said) = say(&["mission", "show"]);
    assert!(
        code == 0 && said.starts_with("revision 4, content"),
        "{said}"
    );
    let (code, said) = say(&["mission", "submit", &wide(&place)]);
    assert!(code == 0 && said.contains("as revision 5"), "{said}");

    let (code, said) = say(&["mission", "hold"]);
    assert_eq!(
        (code, said.trim()),
        (0, "the ground station says hold to all")
    );
    watching.until("the order at 101", DEADLINE, hold_in_life(1));

    // A number that no UAV has is refused, also that of a ground station.
    let (code, said) = say(&["mission", "rtb", "--uav", "101"]);
    assert!(
        code != 0 && said.contains("no UAV with the number 101"),
        "{said}"
    );

    // A ground station that comes back says the same again, also to who was not there.
    drop(ground);
    let (code, said) = say(&["order", "resume"]);
    assert!(code == 4 && said.contains("no answer"), "{said}");
    let _ground = place.peer("100.json5", &operated);
    let late = free_port();
    let _late = place.peer("102.json5", &config(102, late, &[link]));
    watching.until("the order again", DEADLINE, hold_in_life(2));
    let watching = place.watch(&format!("tcp/127.0.0.1:{late}"));
    watching.until("the revision at 102", DEADLINE, cells(102, 100));
}
