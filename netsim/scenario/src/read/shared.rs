//! What several readers of a scenario share: positions, the highest height, notices.

use crate::files::Files;
use skein_geometry::frame::{MAX_MISSION_RADIUS_M, Origin, Point};
use skein_interop::json::{Error, Fields, Node};
use skein_interop::place::to_plane;
use skein_interop::targets::{self, LineTarget, Targets};

/// Highest flight level and roof that are accepted, metres: the service ceiling of
/// small fixed wings with room to spare.
pub(crate) const MAX_HEIGHT_M: f64 = 5000.0;

/// What a file told besides what was asked: field and text.
pub(crate) type Notices = Vec<(String, String)>;

/// The points, lines and areas of a file that a field names, with what that told besides.
pub(crate) fn targets_of(
    node: &Node<'_>,
    files: &Files<'_>,
    notices: &mut Notices,
) -> Result<Targets, Error> {
    let name = node.text()?;
    let found =
        targets::read(&files.read(node)?).map_err(|e| node.wrong(e.in_file(name).to_string()))?;
    notices.extend(found.notices.iter().map(|n| {
        let said = format!("{name}: at {}: {}", n.pointer, n.text);
        (node.path(), said)
    }));
    Ok(found)
}

/// The way of a line of such a file, in the plane.
pub(crate) fn way_of(node: &Node<'_>, origin: Origin, l: &LineTarget) -> Result<Vec<Point>, Error> {
    let name = node.text()?;
    let way = l.way.iter().map(|p| to_plane(origin, *p));
    let way: Result<Vec<Point>, _> = way.collect();
    way.map_err(|e| node.wrong(format!("{name}: at {}: {e}", l.pointer)))
}

/// The lines of a file, metres from an origin.
pub(crate) fn lines_of(
    node: &Node<'_>,
    (origin, files): (Origin, &Files<'_>),
    notices: &mut Notices,
) -> Result<Vec<Vec<Point>>, Error> {
    let found = targets_of(node, files, notices)?;
    let lines = found.lines.iter();
    lines.map(|l| way_of(node, origin, l)).collect()
}

/// Lines typed as lists of [east, north] in metres.
pub(crate) fn ways(list: &Node<'_>) -> Result<Vec<Vec<Point>>, Error> {
    list.items()?.iter().map(places).collect()
}

/// A position typed as metres `east_m`, `north_m`.
pub(crate) fn position(f: &Fields<'_>) -> Result<Point, Error> {
    let coordinate = |name| {
        f.need(name, "250")?.number(
            -MAX_MISSION_RADIUS_M,
            MAX_MISSION_RADIUS_M,
            "metres from the origin",
        )
    };
    Ok(Point::new(coordinate("east_m")?, coordinate("north_m")?))
}

/// Positions typed as `[[east, north], ...]`, metres.
pub(crate) fn places(list: &Node<'_>) -> Result<Vec<Point>, Error> {
    let far = |n: &Node<'_>| {
        n.number(
            -MAX_MISSION_RADIUS_M,
            MAX_MISSION_RADIUS_M,
            "metres from the origin",
        )
    };
    let place = |n: &Node<'_>| match &n.items()?[..] {
        [east, north] => Ok(Point::new(far(east)?, far(north)?)),
        _ => Err(n.wrong("expected [east, north] in metres")),
    };
    list.items()?.iter().map(place).collect()
}
