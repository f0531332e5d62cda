//! An area to be covered, as files have it: survey polygons and fences of a QGroundControl
//! `.plan`, polygons of GeoJSON (D2.7 §3.6).

use super::site::Site;
use super::zone_input::{self, Polygons, ZoneInput, is_plan, polygon, simple};
use super::{lat_lon, plane_at};
use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;
use skein_geometry::frame::{Origin, Point};
use skein_geometry::{NoFlyZones, Polygon};
use skein_interop::place::{LatLon, Shape, from_plane};
use skein_interop::plan::SurveyGrid;
use skein_interop::{geojson, plan};
use skein_survey::team::Uav;
use std::path::Path;
use std::sync::Arc;

/// What is to be covered, in the plane of the launch point.
#[derive(Debug)]
pub struct AreaInput {
    /// The launch point: the origin of the plane.
    pub origin: Origin,
    /// The area.
    pub area: Polygon,
    /// Parts of it that need not be seen and may be flown over.
    pub holes: Vec<Polygon>,
    /// Where nobody may fly.
    pub zones: Vec<Named>,
    /// What must be stayed within: inside each of them.
    pub fences: Vec<Named>,
    /// The sensor that it is to be seen with, if the file says so.
    pub sensor: Option<String>,
    /// How the file's survey is to be flown and seen, if it has one.
    pub survey: Option<SurveyGrid>,
    /// What files for upload take over.
    pub site: Site,
    /// What of the file was left out or is worth saying.
    pub notices: Vec<String>,
}

/// A zone or a fence.
#[derive(Clone, Debug)]
pub struct Named {
    /// What it is called in errors.
    pub name: String,
    /// Where it is.
    pub polygon: Polygon,
}

/// What is asked beside the file.
#[derive(Clone, Copy, Debug, Default)]
pub struct Asked<'a> {
    /// The launch point, `LAT,LON`.
    pub launch: Option<&'a str>,
    /// Whether holes of the area may be flown over.
    pub cross_holes: bool,
    /// A file of more zones and fences.
    pub zones: Option<&'a Path>,
}

/// An area of a file.
struct Drawn {
    name: String,
    ring: Vec<LatLon>,
    holes: Vec<Vec<LatLon>>,
    sensor: Option<String>,
    survey: Option<SurveyGrid>,
}

/// What a file holds beside its zones.
#[derive(Default)]
struct FileShapes {
    areas: Vec<Drawn>,
    home: Option<LatLon>,
    site: Site,
    /// Whether the site's fence has the file's zones already.
    fenced: bool,
    notices: Vec<String>,
}

/// Reads a file; the launch point is the one that is asked for, or the file's home
/// position, or the area's first corner.
///
/// In a `.plan` the survey's polygon is the area, exclusion fences are zones, and every
/// inclusion fence is stayed within. In GeoJSON a polygon whose property `no_fly` is true
/// is a zone, the other one the area; its holes are zones too unless they may be crossed,
/// and its property `sensor` names what it is to be seen with.
///
/// # Errors
/// When a file cannot be read, has no area or more than one, or something of it is wrong;
/// names the place.
pub fn read(file: &Path, asked: Asked<'_>) -> Result<AreaInput> {
    let shown = || file.display().to_string();
    let text = std::fs::read_to_string(file).with_context(|| format!("cannot read {}", shown()))?;
    let shapes = if is_plan(file) {
        of_plan(&text)
    } else {
        of_geojson(&text)
    };
    let mut shapes = shapes.with_context(shown)?;
    let area = match shapes.areas.len() {
        1 => shapes.areas.remove(0),
        n => bail!(
            "{}: one area is planned at a time, found {n}: a survey of a .plan, or a polygon of GeoJSON that is no zone (property no_fly)",
            shown()
        ),
    };
    let launch = match asked.launch {
        Some(text) => lat_lon(text).context("--launch")?,
        None => match shapes.home.or(area.ring.first().copied()) {
            Some(at) => at,
            None => bail!("{}: {}: the area has no corner", shown(), area.name),
        },
    };
    let origin = plane_at(launch).with_context(shown)?;
    let fenced = shapes.fenced;
    let mut input = in_plane(area, shapes, origin, asked.cross_holes).with_context(shown)?;
    let own = zone_input::of_text(file, &text, origin, Polygons::NoFly);
    own.and_then(|own| input.add(own, fenced))
        .with_context(shown)?;
    if let Some(file) = asked.zones {
        let mut more = zone_input::read(file, origin, Polygons::All).context("--zones")?;
        let zones = more.keep_out.iter_mut().map(|z| &mut z.name);
        for name in zones.chain(more.keep_in.iter_mut().map(|f| &mut f.name)) {
            *name += &format!(" of {}", file.display());
        }
        input.notices.extend(more.notices.iter().cloned());
        input.add(more, false).context("--zones")?;
    }
    Ok(input)
}

fn of_plan(text: &str) -> Result<FileShapes> {
    let file = plan::read(text)?;
    let mut shapes = FileShapes {
        home: file.home,
        site: Site::of(&file),
        fenced: true,
        notices: file.notices.iter().map(ToString::to_string).collect(),
        ..FileShapes::default()
    };
    for survey in file.surveys {
        shapes.areas.push(Drawn {
            name: format!("survey at {}", survey.pointer),
            ring: survey.ring,
            holes: Vec::new(),
            sensor: None,
            survey: Some(survey.grid),
        });
    }
    Ok(shapes)
}

fn of_geojson(text: &str) -> Result<FileShapes> {
    let read = geojson::read(text)?;
    let mut shapes = FileShapes::default();
    let mut areas = Vec::new();
    for f in read.polygons {
        if f.is_no_fly()? {
            continue;
        }
        // What cannot be read is not flown over as if it were not there.
        ensure!(
            f.hole_rings.len() == f.holes,
            "at {}: {} of its {} holes is no ring of at least 3 different points with a longitude and a latitude each: mend or delete it",
            f.pointer,
            f.holes - f.hole_rings.len(),
            f.holes
        );
        let sensor = match f.properties.get("sensor") {
            None | Some(Value::Null) => None,
            Some(Value::String(name)) => Some(name.clone()),
            Some(other) => bail!(
                "at {}/properties/sensor: expected the name of a sensor, found {other}",
                f.pointer
            ),
        };
        areas.push(f.pointer.clone());
        shapes.areas.push(Drawn {
            name: f.pointer,
            ring: f.ring,
            holes: f.hole_rings,
            sensor,
            survey: None,
        });
    }
    // Holes of an area are used here, whatever the reader says to those who ask for rings
    // alone.
    let told = read.notices.iter();
    let told = told.filter(|n| !(n.text.contains("hole(s)") && areas.contains(&n.pointer)));
    shapes.notices.extend(told.map(ToString::to_string));
    Ok(shapes)
}

fn in_plane(
    area: Drawn,
    shapes: FileShapes,
    origin: Origin,
    cross_holes: bool,
) -> Result<AreaInput> {
    let mut input = AreaInput {
        origin,
        area: polygon(origin, &area.ring, &area.name)?,
        holes: Vec::new(),
        zones: Vec::new(),
        fences: Vec::new(),
        sensor: area.sensor,
        survey: area.survey,
        site: shapes.site,
        notices: shapes.notices,
    };
    let n = area.holes.len();
    for (i, ring) in area.holes.into_iter().enumerate() {
        let name = format!("{}, hole {}", area.name, i + 1);
        let hole = polygon(origin, &ring, &name)?;
        if cross_holes {
            input.holes.push(hole);
        } else {
            input.site.keep(false, &[Shape::Ring(ring)]);
            input.zones.push(Named {
                name,
                polygon: hole,
            });
        }
    }
    if n > 0 {
        input.notices.push(if cross_holes {
            format!("{n} hole(s) of the area need not be seen and may be flown over")
        } else {
            format!("{n} hole(s) of the area are no-fly: --cross-holes flies over them")
        });
    }
    Ok(input)
}

impl AreaInput {
    /// Adds zones and fences; `fenced` if the site's fence has them already.
    fn add(&mut self, more: ZoneInput, fenced: bool) -> Result<()> {
        let origin = self.origin;
        let named = |name: String, ring: Vec<Point>| -> Result<Named> {
            let polygon = simple(origin, ring, &name)?;
            Ok(Named { name, polygon })
        };
        for zone in more.keep_out {
            self.zones.push(named(zone.name, zone.zone.zone.outer)?);
        }
        for fence in more.keep_in {
            self.fences.push(named(fence.name, fence.ring)?);
        }
        if !fenced {
            for (inclusion, shape) in &more.drawn {
                self.site.keep(*inclusion, [shape]);
            }
        }
        Ok(())
    }

    /// The zones for a planner.
    #[must_use]
    pub fn no_fly(&self) -> Arc<NoFlyZones> {
        let zones = self.zones.iter().map(|z| z.polygon.clone());
        Arc::new(NoFlyZones::new(zones.collect()))
    }

    /// The fences for a planner.
    #[must_use]
    pub fn stay_within(&self) -> Vec<Polygon> {
        self.fences.iter().map(|f| f.polygon.clone()).collect()
    }

    /// Refuses starts in a zone or outside of a fence.
    ///
    /// # Errors
    /// Names the UAV, the place, and the zone or fence.
    pub fn check_starts(&self, team: &[Uav]) -> Result<()> {
        self.check_zones(team)?;
        for uav in team {
            let outside = |fence: &&Named| !fence.polygon.contains(uav.start);
            if let Some(fence) = self.fences.iter().find(outside) {
                bail!(self.misplaced(uav, &format!("outside {}", fence.name)));
            }
        }
        Ok(())
    }

    /// Refuses starts in a zone.
    ///
    /// # Errors
    /// Names the UAV, the place and the zone.
    pub fn check_zones(&self, team: &[Uav]) -> Result<()> {
        for uav in team {
            let inside = |zone: &&Named| zone.polygon.contains(uav.start);
            if let Some(zone) = self.zones.iter().find(inside) {
                bail!(self.misplaced(uav, &format!("inside {}", zone.name)));
            }
        }
        Ok(())
    }

    fn misplaced(&self, uav: &Uav, place: &str) -> String {
        let LatLon { lat_deg, lon_deg } = from_plane(self.origin, uav.start);
        format!(
            "the launch point of {}, {lat_deg:.7},{lon_deg:.7}, lies {place}: choose another with --launch LAT,LON, or `start` in the fleet file",
            uav.name
        )
    }
}
