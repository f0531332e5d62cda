//! What several readers of a scenario share: positions, the highest height, notices.

use skein_geometry::frame::{MAX_MISSION_RADIUS_M, Point};
use skein_interop::json::{Error, Fields, Node};

/// Highest flight level and roof that are accepted, metres: the service ceiling of
/// small fixed wings with room to spare.
pub(crate) const MAX_HEIGHT_M: f64 = 5000.0;

/// What a file told besides what was asked: field and text.
pub(crate) type Notices = Vec<(String, String)>;

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
