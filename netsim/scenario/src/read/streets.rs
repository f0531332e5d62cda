//! The streets of a mission (D2.7 §3.1): `mission.streets`.

use super::shared::{Notices, places, position, targets_of, way_of};
use super::targets::within;
use crate::files::Files;
use skein_flight::streets::chains::chains;
use skein_geometry::Polygon;
use skein_geometry::frame::{Origin, Point};
use skein_interop::json::{Error, Fields, Node};
use skein_peer::mission::{PointMm, mm, ring_mm};
use skein_peer::streets::{AskedWay, INTERVAL_S, Streets, Way};
use std::sync::Arc;

/// How long an interval of the day is unless the file says so, seconds.
const EACH_S: u32 = 300;

/// How fast vehicles drive where nothing was measured unless the file says so, m/s.
const USUAL_MPS: f64 = 8.0;

/// What a street is called that has no name.
const NAMELESS: &str = "unnamed";

/// Lines, each of a street by the number of its name.
#[derive(Debug, Default)]
struct Lines {
    names: Vec<String>,
    all: Vec<(u16, Vec<Point>)>,
}

impl Lines {
    fn add(&mut self, name: &str, way: Vec<Point>) {
        let known = self.names.iter().position(|n| n == name);
        let number = known.unwrap_or(self.names.len());
        if known.is_none() {
            self.names.push(name.to_owned());
        }
        self.all
            .push((u16::try_from(number).unwrap_or(u16::MAX), way));
    }

    /// Those that hang together, joined and thinned, with the names that are left.
    fn made_ready(&self) -> (Vec<String>, Vec<Way>) {
        let mut kept = Self::default();
        for (street, way) in chains(&self.all) {
            let name = self.names.get(usize::from(street));
            kept.add(name.map_or(NAMELESS, String::as_str), way);
        }
        let way = |(street, way): &(u16, Vec<Point>)| Way {
            street: *street,
            places: ring_mm(way),
        };
        let ways = kept.all.iter().map(way).collect();
        (kept.names, ways)
    }
}

/// Reads `mission.streets`; of a file what lies within the area of the mission.
pub(crate) fn of_mission(
    mission: &Node<'_>,
    (origin, files): (Origin, &Files<'_>),
    area: &Polygon,
    notices: &mut Notices,
) -> Result<Option<Arc<Streets>>, Error> {
    let Some(node) = mission.get("streets")? else {
        return Ok(None);
    };
    let f = node.fields(&[
        "file",
        "ways_m",
        "names",
        "interval_s",
        "usual_mps",
        "asked",
        "station",
        "measure",
    ])?;
    let (at, lines) = match (f.get("file"), f.get("ways_m")) {
        (Some(file), None) => (file, of_file(file, (origin, files), area, notices)?),
        (None, Some(ways)) => (ways, of_ways(&f, ways)?),
        _ => {
            return Err(node.wrong(
                "expected either file: \"roads.geojson\" or ways_m: [[[0, 0], [400, 0]], [[400, 0], [400, 200]]]",
            ));
        }
    };
    let (names, ways) = lines.made_ready();
    let (least_s, most_s) = INTERVAL_S;
    let usual_mps = f.number_or("usual_mps", USUAL_MPS, 1.0, 40.0, "m/s")?;
    let interval_s = f
        .get("interval_s")
        .map_or(Ok(EACH_S), |n| n.whole(least_s, most_s, "seconds"))?;
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "10 to 400"
    )]
    let usual_dmps = (usual_mps * 10.0).round() as u16;
    let asked = match f.get("asked") {
        Some(list) => list.items()?.iter().map(asked).collect::<Result<_, _>>()?,
        None => Vec::new(),
    };
    let station = f.get("station").map(place).transpose()?;
    let measure = f.get("measure").map_or(Ok(true), Node::flag)?;
    let streets = Streets {
        names,
        ways,
        interval_s,
        usual_dmps,
        asked,
        station,
        unmeasured: !measure,
    };
    match streets.check() {
        Ok(()) => Ok(Some(Arc::new(streets))),
        Err((place, text)) => {
            let field = place.split(['[', '.']).next().unwrap_or_default();
            let asked = f.get(field).filter(|_| !matches!(field, "ways" | "names"));
            Err(asked.unwrap_or(at).wrong(format!("{place} {text}")))
        }
    }
}

fn place(node: &Node<'_>) -> Result<PointMm, Error> {
    let at = position(&node.fields(&["east_m", "north_m"])?)?;
    Ok((mm(at.x), mm(at.y)))
}

fn asked(node: &Node<'_>) -> Result<AskedWay, Error> {
    let f = node.fields(&["name", "from", "to"])?;
    let example = "{ east_m: 100, north_m: 100 }";
    Ok(AskedWay {
        name: f.need("name", "\"to the hospital\"")?.text()?.to_owned(),
        from: place(f.need("from", example)?)?,
        to: place(f.need("to", example)?)?,
    })
}

fn of_ways(f: &Fields<'_>, ways: &Node<'_>) -> Result<Lines, Error> {
    let mut names = Vec::new();
    if let Some(list) = f.get("names") {
        for name in list.items()? {
            names.push(name.text()?.to_owned());
        }
    }
    let mut lines = Lines::default();
    for (i, way) in ways.items()?.iter().enumerate() {
        let points = places(way)?;
        if points.len() < 2 {
            return Err(way.wrong("expected two places or more"));
        }
        let number = format!("street {}", i + 1);
        lines.add(names.get(i).unwrap_or(&number), points);
    }
    if names.len() > lines.all.len() {
        return Err(ways.wrong("are fewer than the names; expected a way for each name"));
    }
    Ok(lines)
}

fn of_file(
    node: &Node<'_>,
    (origin, files): (Origin, &Files<'_>),
    area: &Polygon,
    notices: &mut Notices,
) -> Result<Lines, Error> {
    let found = targets_of(node, files, notices)?;
    let mut lines = Lines::default();
    for l in &found.lines {
        for part in within(&way_of(node, origin, l)?, area) {
            lines.add(l.name.as_deref().unwrap_or(NAMELESS), part);
        }
    }
    Ok(lines)
}

#[cfg(test)]
mod tests {
    use crate::read::testing::mission_of;

    fn with(streets: &str) -> Result<std::sync::Arc<skein_peer::Mission>, String> {
        mission_of(&format!("{{ streets: {streets} }}"))
    }

    #[test]
    fn streets_are_read_or_refused_with_place_and_remedy() {
        let ways = "ways_m: [[[0, 0], [300, 0]], [[300, 0], [300, 200]], [[300, 0], [500, 0]]]";
        let read = with(&format!(
            "{{ {ways}, names: ['South'], interval_s: 60, asked: [{{ name: 'x', from: {{ east_m: 10, north_m: 0 }}, to: {{ east_m: 300, north_m: 150 }} }}] }}"
        ));
        let streets = read.unwrap().streets.clone().unwrap();
        assert_eq!(streets.names, ["South", "street 2", "street 3"]);
        assert_eq!((streets.interval_s, streets.usual_dmps), (60, 80));
        assert_eq!(streets.network().edges().len(), 3);
        assert!(!streets.unmeasured);
        let known = with(&format!("{{ {ways}, measure: false }}")).unwrap();
        assert!(known.streets.is_some() && known.measured_streets().is_none());
        let town = with("{ file: '../data/helsinki_roads.geojson' }");
        // The default area is larger than a mission's streets may be.
        let said = town.map(|m| m.streets.as_ref().map(|s| s.network().edges().len()));
        assert!(
            said.as_ref().is_ok_and(|n| n.is_some_and(|n| n > 30))
                || said.is_err_and(|e| e.contains("take a smaller part"))
        );
        for (streets, why) in [
            ("{ }".to_owned(), "expected either file"),
            ("{ ways_m: [[[0, 0]]] }".to_owned(), "ways_m[0]"),
            (
                "{ ways_m: [[[0, 0], [5, 0]]] }".to_owned(),
                "none is 25 m long",
            ),
            (format!("{{ {ways}, interval_s: 3 }}"), "interval_s"),
            (format!("{{ {ways}, usual_mps: 0.2 }}"), "usual_mps"),
            (
                format!("{{ {ways}, station: {{ east_m: 0, north_m: 900 }} }}"),
                "150 m",
            ),
            (
                format!(
                    "{{ {ways}, asked: [{{ name: 'x', from: {{ east_m: 0, north_m: 0 }} }}] }}"
                ),
                "to",
            ),
            (
                format!("{{ {ways}, names: ['a', 'b', 'c', 'd'] }}"),
                "a way for each name",
            ),
            (
                format!("{{ {ways}, measure: false, station: {{ east_m: 0, north_m: 0 }} }}"),
                "mission.streets.station: station leads by measured speeds",
            ),
            (
                format!("{{ {ways}, measure: 2 }}"),
                "mission.streets.measure",
            ),
            (
                "{ file: 'none.geojson' }".to_owned(),
                "cannot read none.geojson",
            ),
        ] {
            let said = with(&streets).unwrap_err();
            assert!(said.contains(why), "{said}");
        }
    }
}
