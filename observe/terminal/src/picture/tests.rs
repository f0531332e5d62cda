use super::*;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use skein_recording::model::event::What;
use skein_recording::model::frame::Pose;
use skein_recording::model::scene::{Cell as SceneCell, Uav, Zone};
use skein_recording::model::{Place, Ring};
use skein_recording::{Frame, Record};

const ASCII: Look = Look {
    unicode: false,
    colour: false,
};

fn place(east_m: f64, north_m: f64) -> Place {
    Place {
        east_m,
        north_m,
        ..Place::default()
    }
}

pub(crate) fn square(east_m: f64, north_m: f64, side_m: f64) -> Ring {
    let corner = |e: f64, n: f64| [east_m + e * side_m, north_m + n * side_m];
    Ring {
        east_north_m: vec![
            corner(0.0, 0.0),
            corner(1.0, 0.0),
            corner(1.0, 1.0),
            corner(0.0, 1.0),
        ],
        ..Ring::default()
    }
}

/// Sixteen cells of 50 m in a square, a zone beside it, three UAVs.
fn scene() -> Scene {
    let cell = |i: u16| SceneCell {
        ring: square(f64::from(i % 4) * 50.0, f64::from(i / 4) * 50.0, 50.0),
        needed: true,
        ..SceneCell::default()
    };
    let uav = |id: u16| Uav {
        id,
        name: format!("uav{id}"),
        launch: place(0.0, 0.0),
        ..Uav::default()
    };
    Scene {
        area: square(0.0, 0.0, 200.0),
        cells: (0..16).map(cell).collect(),
        zones: vec![Zone {
            ring: square(-60.0, 100.0, 50.0),
            ..Zone::default()
        }],
        uavs: (1..=3).map(uav).collect(),
        ..Scene::default()
    }
}

fn event(uav: u16, text: &str, what: What) -> Record {
    Record::Event(Event {
        time_ms: 9_000,
        origin: Origin::Peer,
        uav: Some(uav),
        text: text.to_owned(),
        what,
    })
}

fn claim(cells: std::ops::Range<u16>) -> What {
    What::Claim {
        counter: 1,
        take: 0,
        cells: cells.collect(),
        held: Vec::new(),
        eta_ms: 0,
    }
}

/// UAV 2 is gone, UAV 1 took two of its cells over and saw two of its own.
fn standing() -> Standing {
    let mut standing = Standing::default();
    standing.hear(Record::Scene(Box::new(scene())));
    standing.hear(event(1, "uav1 lists 4 open cells", claim(0..4)));
    standing.hear(event(2, "uav2 lists 8 open cells", claim(4..12)));
    let covered = What::Covered {
        cells: vec![0, 1],
        new: vec![0, 1],
    };
    standing.hear(event(1, "uav1 saw 2 cells", covered));
    let ended = What::Ended {
        airframe: true,
        cells: (4..12).collect(),
        orphans: (4..12).collect(),
    };
    standing.hear(event(2, "uav2 is no more", ended));
    standing.hear(event(1, "uav1 lists 4 open cells", claim(2..6)));
    let takeover = What::Takeover {
        from: 2,
        cells: vec![4, 5],
        after_ms: 900,
    };
    standing.hear(event(1, "uav1 takes over 2 cells of uav2", takeover));
    let at = |east_m, north_m, heading_deg| {
        Some(Pose {
            place: place(east_m, north_m),
            heading_deg,
            ..Pose::default()
        })
    };
    let uav = |id, state, pose| UavState {
        id,
        state,
        pose,
        fuel_left_s: Some(400.0),
        cells_left: usize::from(id) * 2,
        nearest_other_m: Some(83.0),
        ..UavState::default()
    };
    standing.hear(Record::Frame(Frame {
        time_ms: 9_500,
        uavs: vec![
            uav(1, State::Working, at(125.0, 25.0, 90.0)),
            uav(2, State::Lost, None),
            uav(3, State::Idle, at(175.0, 175.0, 180.0)),
        ],
        links: vec![[1, 3]],
        components: vec![vec![1, 3]],
        covered_cells: 2,
        coverable_cells: 16,
        covered_share: 0.125,
    }));
    standing
}

fn drawn(width: u16, height: u16, picture: &mut Picture) -> String {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    let standing = standing();
    terminal
        .draw(|canvas| picture.draw(canvas, &standing))
        .unwrap();
    let buffer = terminal.backend().buffer();
    let row = |y: u16| -> String {
        let row: String = (0..width).map(|x| buffer[(x, y)].symbol()).collect();
        row.trim_end().to_owned()
    };
    (0..height).map(row).collect::<Vec<_>>().join("\n")
}

fn picture(look: Look) -> Picture {
    let mut picture = Picture::new("square".to_owned(), Knowledge::World, look);
    picture.foot = "q quit".to_owned();
    picture
}

#[test]
fn a_fixed_moment_in_ascii_at_80_by_24() {
    let text = drawn(80, 24, &mut picture(ASCII));
    assert_eq!(text, include_str!("at_80_by_24.txt").trim_end());
}

#[test]
fn small_and_large_terminals_show_what_has_room() {
    for (width, height) in [(1, 1), (20, 11), (40, 12), (63, 24), (64, 11), (200, 60)] {
        let text = drawn(width, height, &mut picture(ASCII));
        assert_eq!(text.contains("near took"), width >= LEAST_WIDTH, "{text}");
        assert_eq!(text.contains("q quit"), width >= 20, "{text}");
    }
}

#[test]
fn a_selected_uav_has_its_links_drawn_and_its_events_alone() {
    let unicode = Look {
        unicode: true,
        colour: true,
    };
    let mut picture = picture(unicode);
    assert!(!drawn(80, 24, &mut picture).contains('·'));
    picture.selected = Some(3);
    let text = drawn(80, 24, &mut picture);
    assert!(
        text.contains('·') && text.contains('█') && text.contains('▚'),
        "{text}"
    );
    assert!(!text.contains("takes over"), "{text}");
}
