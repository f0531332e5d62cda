//! Pictures of a diagram, drawn from what a peer obeys: Graphviz DOT, Mermaid, and SVG, which a
//! library lays out. Equal diagrams give equal pictures.

use layout::backends::svg::SVGWriter;
use layout::core::base::Orientation;
use layout::core::color::Color;
use layout::core::geometry::Point;
use layout::core::style::StyleAttr;
use layout::std_shapes::shapes::{Arrow, Element, ShapeKind};
use layout::topo::layout::VisualGraph;
use skein_peer::diagram::{Behaviour, Diagram, Part, State, Transition};
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// How a picture is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Scalable vector graphics, for a browser.
    Svg,
    /// Graphviz.
    Dot,
    /// Mermaid, for Markdown.
    Mermaid,
}

impl Format {
    /// All of them, the default first.
    pub const ALL: [Self; 3] = [Self::Svg, Self::Dot, Self::Mermaid];

    /// Its name on a command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Svg => "svg",
            Self::Dot => "dot",
            Self::Mermaid => "mermaid",
        }
    }
}

/// A picture of a diagram.
#[must_use]
pub fn picture(diagram: &Diagram, format: Format) -> String {
    match format {
        Format::Svg => svg(diagram),
        Format::Dot => dot(diagram),
        Format::Mermaid => mermaid(diagram),
    }
}

/// What is done in a state, a line each.
fn lines(state: &State) -> Vec<String> {
    let Behaviour {
        purpose,
        dimension,
        closed,
        endless,
        actions,
    } = &state.behaviour;
    let dimension = dimension.map_or("any dimension".to_owned(), |d| format!("dimension {d}"));
    let way = if *closed { "closed" } else { "open" };
    let often = if *endless { "for ever" } else { "once" };
    let made_of: Vec<&str> = actions.iter().map(|a| a.name()).collect();
    let part = match state.part {
        Part::Takes => "",
        Part::Keeps => ", keeps its section",
        Part::Releases => ", lets its section go",
        Part::Ends => ", ends the mission",
    };
    vec![
        state.name.clone(),
        format!("{}, {dimension}, {way}, {often}", purpose.name()),
        made_of.join(" then "),
        format!("goal {}{part}", state.goal.name()),
    ]
}

/// When a transition is taken, and which comes first.
fn label(t: &Transition) -> String {
    let mut text = format!("{} {}", t.priority, t.on.name());
    if t.on.is_timed() {
        let _ = write!(text, " {} s", t.after_s);
    }
    if t.on.is_of_wind() {
        let _ = write!(text, " {:.1} m/s", f64::from(t.above_dmps) / 10.0);
    }
    text
}

/// Transitions that lead from one place to another are one arrow: its labels, by priority.
fn arrows(diagram: &Diagram) -> Vec<(Option<&str>, &str, Vec<String>)> {
    let mut sorted: Vec<&Transition> = diagram.transitions.iter().collect();
    sorted.sort_by_key(|t| t.priority);
    let mut arrows: Vec<(Option<&str>, &str, Vec<String>)> = Vec::new();
    for t in sorted {
        let (from, to) = (t.from.as_deref(), t.to.as_str());
        let known = arrows.iter_mut().find(|a| (a.0, a.1) == (from, to));
        match known {
            Some((_, _, labels)) => labels.push(label(t)),
            None => arrows.push((from, to, vec![label(t)])),
        }
    }
    arrows
}

/// How a picture calls the dot from which what leads on from any state begins.
const ANY: &str = "any state";

fn dot(diagram: &Diagram) -> String {
    let mut text = format!("digraph \"{}\" {{\n  rankdir=LR;\n", diagram.name);
    let start = diagram.states.first().map_or("", |s| s.name.as_str());
    let _ = writeln!(text, "  \"begin\" [shape=circle];");
    for state in &diagram.states {
        let label = lines(state).join("\\n");
        let _ = writeln!(text, "  \"{}\" [shape=box, label=\"{label}\"];", state.name);
    }
    let _ = writeln!(text, "  \"{ANY}\" [shape=ellipse];");
    let _ = writeln!(text, "  \"begin\" -> \"{start}\";");
    for (from, to, labels) in arrows(diagram) {
        let (from, label) = (from.unwrap_or(ANY), labels.join("\\n"));
        let _ = writeln!(text, "  \"{from}\" -> \"{to}\" [label=\"{label}\"];");
    }
    text.push_str("}\n");
    text
}

fn mermaid(diagram: &Diagram) -> String {
    let id = |name: &str| name.replace('-', "_");
    let mut text = "stateDiagram-v2\n  direction LR\n".to_owned();
    for state in &diagram.states {
        let label = lines(state).join("<br/>");
        let _ = writeln!(text, "  state \"{label}\" as s_{}", id(&state.name));
    }
    let _ = writeln!(text, "  state \"{ANY}\" as any_state");
    if let Some(start) = diagram.states.first() {
        let _ = writeln!(text, "  [*] --> s_{}", id(&start.name));
    }
    for (from, to, labels) in arrows(diagram) {
        let from = from.map_or("any_state".to_owned(), |f| format!("s_{}", id(f)));
        let _ = writeln!(text, "  {from} --> s_{}: {}", id(to), labels.join("<br/>"));
    }
    text
}

/// Size of all letters of an SVG, pixels: that which the library gives to what stands at arrows,
/// since the order in which it tells two sizes is another one each time.
const LETTERS_PX: usize = 15;

/// How wide a letter is, as a share of its size.
const LETTER_WIDTH: f64 = 0.5;

/// Room around the text of a box, pixels.
const ROOM_PX: f64 = 16.0;

/// The size of a box with these lines, pixels.
fn box_size(lines: &[String]) -> Point {
    #[allow(clippy::cast_precision_loss, reason = "letters of a picture")]
    let (longest, n, px) = (
        lines.iter().map(String::len).max().unwrap_or(0) as f64,
        lines.len() as f64,
        LETTERS_PX as f64,
    );
    let (width, height) = (longest * px * LETTER_WIDTH, n * px);
    Point::new(width + 2.0 * ROOM_PX, height + 2.0 * ROOM_PX)
}

fn svg(diagram: &Diagram) -> String {
    let way = Orientation::LeftToRight;
    let look = |rounded| {
        let (line, fill) = (Color::fast("black"), Color::fast("white"));
        StyleAttr::new(line, 1, Some(fill), rounded, LETTERS_PX)
    };
    let mut graph = VisualGraph::new(way);
    let mut add = |shape: ShapeKind, size: Point, rounded: usize| {
        graph.add_node(Element::create(shape, look(rounded), way, size))
    };
    let mut round = |text: &str| {
        let size = box_size(&[text.to_owned()]);
        add(ShapeKind::new_circle(text), size, 0)
    };
    let (begin, any) = (round("begin"), round(ANY));
    let mut nodes = BTreeMap::new();
    for state in &diagram.states {
        let lines = lines(state);
        let shape = ShapeKind::new_box(&lines.join("\n"));
        nodes.insert(state.name.as_str(), add(shape, box_size(&lines), 12));
    }
    if let Some(start) = diagram
        .states
        .first()
        .and_then(|s| nodes.get(s.name.as_str()))
    {
        graph.add_edge(Arrow::simple(""), begin, *start);
    }
    for (from, to, labels) in arrows(diagram) {
        let from = from.map_or(Some(&any), |name| nodes.get(name));
        if let Some((from, to)) = from.zip(nodes.get(to)) {
            graph.add_edge(Arrow::simple(&labels.join("\n")), *from, *to);
        }
    }
    let mut writer = SVGWriter::new();
    graph.do_it(false, false, false, &mut writer);
    writer.finalize()
}
