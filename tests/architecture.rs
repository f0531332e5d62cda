//! Who may import whom: read from `cargo metadata`, so that a wrong arrow fails here
//! and not in a review.

#![allow(
    clippy::unwrap_used,
    reason = "a test may; the lint's own exception does not reach helpers"
)]

use cargo_metadata::{DependencyKind, Metadata, MetadataCommand, Package};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// For each crate: which of ours it may use, and which others it must not reach,
/// even through somebody else.
const RULES: &[(&str, &[&str], &[&str])] = &[
    ("skein-geometry", &[], &["tokio", "zenoh", "rand_core"]),
    (
        "skein-flight",
        &["skein-geometry"],
        &["tokio", "zenoh", "rand_core"],
    ),
    (
        "skein-survey",
        &["skein-geometry", "skein-flight"],
        // Values in, values out: flags, files and formats are the command's.
        &[
            "tokio",
            "zenoh",
            "rand_core",
            "clap",
            "serde_json",
            "anyhow",
        ],
    ),
    (
        "skein-lab",
        &["skein-geometry", "skein-flight", "skein-survey"],
        &["tokio", "zenoh", "rand_core"],
    ),
    (
        // Shares no geometry with what it recounts: of the planners it may use nothing, and
        // of formats the readers alone.
        "skein-verify",
        &["skein-interop"],
        &["tokio", "zenoh", "rand_core", "skein-survey", "skein-lab"],
    ),
    (
        "skein-behaviors",
        &["skein-geometry", "skein-flight"],
        &["tokio", "zenoh", "rand_core", "skein-survey", "skein-lab"],
    ),
    (
        "skein-peer",
        &["skein-geometry", "skein-flight", "skein-behaviors"],
        &[
            "tokio",
            "zenoh",
            "skein-netsim",
            "skein-survey",
            "skein-lab",
        ],
    ),
    (
        "skein-link",
        &["skein-geometry", "skein-behaviors"],
        &[
            "tokio",
            "zenoh",
            "skein-netsim",
            "skein-survey",
            "skein-lab",
        ],
    ),
    (
        "skein-console",
        &["skein-peer", "skein-behaviors"],
        &["zenoh", "skein-node", "skein-netsim"],
    ),
    (
        "skein-interop",
        &["skein-geometry", "skein-flight", "skein-peer"],
        &[
            "tokio",
            "zenoh",
            "skein-netsim",
            "skein-survey",
            "skein-lab",
        ],
    ),
    (
        "skein-netsim",
        &[
            "skein-link",
            "skein-peer",
            "skein-behaviors",
            "skein-geometry",
            "skein-flight",
        ],
        &["tokio", "zenoh", "skein-node", "skein-survey", "skein-lab"],
    ),
    (
        "skein-scenario",
        &[
            "skein-netsim",
            "skein-interop",
            "skein-peer",
            "skein-geometry",
            "skein-flight",
        ],
        &["tokio", "zenoh", "skein-node", "skein-survey", "skein-lab"],
    ),
    (
        "skein-bench",
        &[
            "skein-geometry",
            "skein-flight",
            "skein-survey",
            "skein-lab",
            "skein-interop",
            "skein-netsim",
            "skein-scenario",
        ],
        &["tokio", "zenoh", "skein-node", "skein-broker"],
    ),
    (
        "skein-node",
        &[
            "skein-interop",
            "skein-link",
            "skein-console",
            "skein-peer",
            "skein-behaviors",
        ],
        &[
            "skein-netsim",
            "skein-scenario",
            "skein-survey",
            "skein-lab",
            "skein-recording",
            "mcap",
            "skein-view",
            "skein-web",
            "skein-terminal",
        ],
    ),
    (
        "skein-recording",
        &[
            "skein-netsim",
            "skein-peer",
            "skein-flight",
            "skein-geometry",
        ],
        &["tokio", "zenoh", "skein-node", "skein-survey", "skein-lab"],
    ),
    (
        "skein-report",
        &["skein-recording", "skein-netsim", "skein-geometry"],
        &["tokio", "zenoh", "skein-node", "skein-survey", "skein-lab"],
    ),
    (
        "skein-view",
        &["skein-recording", "skein-peer", "skein-geometry"],
        &["tokio", "zenoh", "skein-node", "skein-survey", "skein-lab"],
    ),
    (
        "skein-web",
        &[
            "skein-recording",
            "skein-view",
            "skein-console",
            "skein-netsim",
        ],
        &[
            "zenoh",
            "skein-node",
            "skein-broker",
            "skein-survey",
            "skein-lab",
        ],
    ),
    (
        "skein-terminal",
        &["skein-recording", "skein-view", "skein-geometry"],
        &[
            "tokio",
            "zenoh",
            "skein-node",
            "skein-broker",
            "skein-survey",
            "skein-lab",
        ],
    ),
    (
        "skein-broker",
        &[
            "skein-interop",
            "skein-recording",
            "skein-scenario",
            "skein-netsim",
            "skein-link",
            "skein-console",
            "skein-peer",
            "skein-behaviors",
            "skein-geometry",
            "skein-flight",
        ],
        &["zenoh", "skein-node", "skein-survey", "skein-lab"],
    ),
    (
        "skein-tests",
        &[
            "skein-geometry",
            "skein-flight",
            "skein-behaviors",
            "skein-peer",
            "skein-link",
            "skein-netsim",
            "skein-scenario",
            "skein-interop",
            "skein-survey",
            "skein-verify",
        ],
        &["zenoh", "skein-node", "skein-broker"],
    ),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .unwrap()
        .to_path_buf()
}

/// The host's triple: crates of other platforms need not be on this machine.
fn host() -> String {
    let out = std::process::Command::new("rustc")
        .arg("-vV")
        .output()
        .unwrap();
    let text = String::from_utf8(out.stdout).unwrap();
    let host = text.lines().find_map(|l| l.strip_prefix("host: "));
    host.unwrap().to_owned()
}

fn metadata() -> Metadata {
    let options = ["--offline", "--locked", "--filter-platform", &host()];
    MetadataCommand::new()
        .manifest_path(root().join("Cargo.toml"))
        .other_options(options.map(str::to_owned).to_vec())
        .exec()
        .unwrap()
}

fn package<'a>(metadata: &'a Metadata, name: &str) -> &'a Package {
    metadata
        .packages
        .iter()
        .find(|p| p.name.as_str() == name)
        .unwrap_or_else(|| panic!("no package {name}"))
}

/// All packages that a build of `name` links, by way of normal dependencies.
fn reaches(metadata: &Metadata, name: &str) -> BTreeSet<String> {
    let resolve = metadata.resolve.as_ref().unwrap();
    let nodes: BTreeMap<_, _> = resolve.nodes.iter().map(|n| (&n.id, n)).collect();
    let names: BTreeMap<_, _> = metadata
        .packages
        .iter()
        .map(|p| (&p.id, p.name.to_string()))
        .collect();
    let mut open = vec![&package(metadata, name).id];
    let mut seen = BTreeSet::new();
    while let Some(id) = open.pop() {
        if seen.insert(names[id].clone()) {
            for dep in &nodes[id].deps {
                if dep
                    .dep_kinds
                    .iter()
                    .any(|k| k.kind == DependencyKind::Normal)
                {
                    open.push(&dep.pkg);
                }
            }
        }
    }
    seen
}

#[test]
fn imports_point_from_the_shell_to_the_core() {
    let metadata = metadata();
    for (name, allowed, forbidden) in RULES {
        for dep in &package(&metadata, name).dependencies {
            let is_test_of_tests = *name == "skein-tests" || dep.kind == DependencyKind::Normal;
            if dep.name.starts_with("skein-") && is_test_of_tests {
                assert!(
                    allowed.contains(&dep.name.as_str()),
                    "{name} may not use {}",
                    dep.name
                );
            }
        }
        let reached = reaches(&metadata, name);
        for f in *forbidden {
            assert!(!reached.contains(*f), "{name} reaches {f}");
        }
    }
}

/// `cargo run -- trial`, as the README says it, must mean one program: several packages that
/// are built by default have one.
#[test]
fn cargo_run_runs_the_command() {
    let metadata = metadata();
    let default = metadata.workspace_default_packages();
    let run: Vec<&str> = default
        .iter()
        .filter_map(|p| p.default_run.as_deref())
        .collect();
    assert_eq!(run, ["skein"]);
}

#[test]
fn the_command_carries_no_laboratory() {
    let reached = reaches(&metadata(), "skein");
    assert!(reached.contains("skein-survey"), "`plan` is a verb");
    assert!(!reached.contains("skein-lab") && !reached.contains("skein-bench"));
}

/// Formats come with points of the planners' plane; whoever recounts a plan measures with
/// its own.
#[test]
fn the_recount_knows_no_geometry_of_the_planners() {
    for file in sources(&["planning/verify/src"]) {
        let text = std::fs::read_to_string(&file).unwrap();
        let code = text.split("#[cfg(test)]").next().unwrap_or_default();
        for theirs in [
            "skein_geometry",
            "skein_flight",
            "skein_survey",
            "to_plane",
            "from_plane",
        ] {
            assert!(!code.contains(theirs), "{} uses {theirs}", file.display());
        }
    }
}

#[test]
fn every_package_of_the_workspace_has_a_rule() {
    let metadata = metadata();
    for p in metadata.workspace_packages() {
        let known = p.name.as_str() == "skein" || RULES.iter().any(|r| r.0 == p.name.as_str());
        assert!(known, "{} has no rule in tests/architecture.rs", p.name);
    }
}

#[test]
fn every_third_party_crate_has_a_reason() {
    let text = std::fs::read_to_string(root().join("docs/decisions/dependencies.md")).unwrap();
    let reasons: BTreeSet<&str> = text
        .lines()
        .filter_map(|l| l.strip_prefix("- ")?.split_once(": "))
        .map(|(name, _)| name.trim_matches('`'))
        .collect();
    let metadata = metadata();
    for p in metadata.workspace_packages() {
        for dep in p
            .dependencies
            .iter()
            .filter(|d| !d.name.starts_with("skein-"))
        {
            assert!(
                reasons.contains(dep.name.as_str()),
                "{} uses {} without a reason",
                p.name,
                dep.name
            );
        }
    }
}

/// Rust files below the given folders.
fn sources(folders: &[&str]) -> Vec<PathBuf> {
    let mut open: Vec<PathBuf> = folders.iter().map(|f| root().join(f)).collect();
    let mut out = Vec::new();
    while let Some(path) = open.pop() {
        if path.is_dir() {
            open.extend(std::fs::read_dir(path).unwrap().map(|e| e.unwrap().path()));
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
    out.sort();
    out
}

/// The loop of a mission takes up to seconds: whoever simulates, judges or shows it is
/// given it, and a revised mission's is derived where geometry is remembered.
#[test]
fn the_loop_is_derived_in_one_place_of_the_simulator() {
    for file in sources(&["netsim/sim/src", "netsim/broker/src", "src"]) {
        let text = std::fs::read_to_string(&file).unwrap();
        let here = text.contains(".geometry()") || text.contains("lanes::build(");
        let allowed = file.ends_with("netsim/sim/src/geometry_cache.rs");
        assert!(!here || allowed, "{} derives a loop", file.display());
    }
}

#[test]
fn the_core_asks_neither_clock_nor_chance() {
    let banned = [
        "Instant::now",
        "SystemTime",
        "HashMap",
        "HashSet",
        "std::thread",
        "std::fs",
        "std::net",
        "OsRng",
    ];
    // Plans for people made several at once, joined in the order in which they were asked for:
    // no answer depends on which is done first.
    let threads = "planning/survey/src/area/at_once.rs";
    for file in sources(&[
        "planning/geometry/src",
        "planning/flight/src",
        "planning/survey/src",
        "planning/lab/src",
        "planning/verify/src",
        "behaviors/src",
        "runtime/peer/src",
        "runtime/link/src",
        "netsim/sim/src",
    ]) {
        let text = std::fs::read_to_string(&file).unwrap();
        for (i, line) in text
            .lines()
            .enumerate()
            .filter(|(_, l)| !l.trim_start().starts_with("//"))
        {
            for b in banned {
                let allowed = b == "std::thread" && file.ends_with(threads);
                assert!(
                    allowed || !line.contains(b),
                    "{}:{}: {b} has no place in the core",
                    file.display(),
                    i + 1
                );
            }
        }
    }
}

#[test]
fn only_the_bus_speaks_zenoh() {
    for file in sources(&[
        "src",
        "runtime",
        "netsim",
        "planning",
        "behaviors",
        "interop",
        "observe",
    ]) {
        let text = std::fs::read_to_string(&file).unwrap();
        let code = text.lines().filter(|l| !l.trim_start().starts_with("//"));
        let speaks = code
            .into_iter()
            .any(|l| l.contains("use zenoh") || l.contains("zenoh::"));
        let is_bus = file.ends_with("runtime/node/src/bus.rs");
        assert!(
            is_bus || !speaks,
            "{} uses zenoh; only runtime/node/src/bus.rs may",
            file.display()
        );
    }
}

#[test]
fn only_one_file_of_the_node_knows_the_simulators_frames() {
    for file in sources(&["runtime/node/src"]) {
        let text = std::fs::read_to_string(&file).unwrap();
        let knows = ["link::frame", "ToWorld", "ToPeer"]
            .iter()
            .any(|word| text.contains(word));
        assert_eq!(
            knows,
            file.ends_with("simulator.rs"),
            "{}: frames belong to runtime/node/src/simulator.rs",
            file.display()
        );
    }
}
