//! Areas, holes, zones and fences of files.
//!
//! In a `.plan` the surveys are the area, exclusion fences are zones, inclusion fences are
//! to be stayed within. In GeoJSON a polygon is the area, or a zone where its property
//! `no_fly` says so; in a file of zones all polygons are. A zone is solid, whatever holes
//! its polygon has; holes of the area are to be kept out of.

use crate::VerifyError;
use crate::ground::{Ground, Named};
use crate::outline::{Outline, Ring};
use crate::plan_file::pair;
use crate::plane::{Plane, Point, REACH_M};
use serde_json::Value;
use skein_interop::geojson::{self, Feature};
use skein_interop::json::{Document, Error, Node};
use skein_interop::place::{LatLon, Shape};
use skein_interop::plan;

/// What a file is given for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// The area with what belongs to it.
    Area,
    /// Zones and fences alone.
    Zones,
}

/// What an outline of a file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Area,
    Hole,
    Zone,
    Fence,
}

/// Outlines of a file, still in degrees.
#[derive(Clone, Debug)]
pub struct GroundFile {
    file: String,
    outlines: Vec<(Kind, String, Shape)>,
    notices: Vec<String>,
}

/// Reads a file.
///
/// # Errors
/// [`VerifyError`] names the place.
pub fn read(file: &str, text: &str, role: Role) -> Result<GroundFile, VerifyError> {
    let document = Document::parse("the file", file, text)?;
    let is_plan = document.root().get("fileType")?.is_some();
    let mut out = GroundFile {
        file: file.to_owned(),
        outlines: Vec::new(),
        notices: Vec::new(),
    };
    if is_plan {
        of_plan(&mut out, &document.root(), text, role)?;
    } else {
        of_geojson(&mut out, text, role)?;
    }
    Ok(out)
}

fn of_plan(
    out: &mut GroundFile,
    root: &Node<'_>,
    text: &str,
    role: Role,
) -> Result<(), VerifyError> {
    let file = plan::read(text).map_err(|e| e.in_file(&out.file))?;
    let surveys = match role {
        Role::Area => surveys(root)?,
        Role::Zones => Vec::new(),
    };
    let each = [
        (Kind::Area, "survey", surveys),
        (Kind::Zone, "exclusion fence", file.keep_out),
        (Kind::Fence, "inclusion fence", file.keep_in),
    ];
    for (kind, name, shapes) in each {
        for (i, shape) in shapes.into_iter().enumerate() {
            out.outlines
                .push((kind, format!("{name} {}", i + 1), shape));
        }
    }
    Ok(())
}

/// The polygons of the surveys of a plan.
fn surveys(root: &Node<'_>) -> Result<Vec<Shape>, Error> {
    let mut out = Vec::new();
    let items = match root.get("mission")? {
        Some(mission) => mission.get("items")?,
        None => None,
    };
    for item in items.map_or(Ok(Vec::new()), |i| i.items())? {
        let kind = item.get("complexItemType")?;
        if kind.is_some_and(|k| k.text().is_ok_and(|k| k == "survey")) {
            let corners = item.need("polygon")?.items()?;
            let corners = corners.iter().map(|c| pair(c, false));
            out.push(Shape::Ring(corners.collect::<Result<_, _>>()?));
        }
    }
    Ok(out)
}

fn of_geojson(out: &mut GroundFile, text: &str, role: Role) -> Result<(), VerifyError> {
    let read = geojson::read(text).map_err(|e| e.in_file(&out.file))?;
    for f in read.polygons {
        let zone = is_no_fly(&out.file, &f)?;
        if zone || role == Role::Zones {
            if f.holes > 0 {
                let text = format!(
                    "{}: zone {}: its holes are forbidden too",
                    out.file, f.pointer
                );
                out.notices.push(text);
            }
            out.outlines
                .push((Kind::Zone, f.pointer, Shape::Ring(f.ring)));
            continue;
        }
        if f.hole_rings.len() < f.holes {
            let text = format!(
                "{}: at {}: a hole without an area was filled",
                out.file, f.pointer
            );
            out.notices.push(text);
        }
        for (i, hole) in f.hole_rings.into_iter().enumerate() {
            let name = format!("{} hole {}", f.pointer, i + 1);
            out.outlines.push((Kind::Hole, name, Shape::Ring(hole)));
        }
        out.outlines
            .push((Kind::Area, f.pointer, Shape::Ring(f.ring)));
    }
    Ok(())
}

/// Whether a polygon says that it is a zone, in any of the ways that programs write it.
fn is_no_fly(file: &str, f: &Feature) -> Result<bool, VerifyError> {
    let said = match f.properties.get("no_fly") {
        None | Some(Value::Null) => return Ok(false),
        Some(Value::Bool(said)) => return Ok(*said),
        Some(Value::Number(n)) => n.to_string(),
        Some(Value::String(text)) => text.trim().to_ascii_lowercase(),
        Some(other) => other.to_string(),
    };
    match said.as_str() {
        "true" | "t" | "yes" | "y" | "on" | "1" | "1.0" => Ok(true),
        "false" | "f" | "no" | "n" | "off" | "0" | "0.0" | "" => Ok(false),
        _ => Err(VerifyError::Value {
            file: file.to_owned(),
            at: format!("{}/properties/no_fly", f.pointer),
            problem: format!("{said} is neither true nor false"),
        }),
    }
}

impl GroundFile {
    /// The first corner of its first area, or of anything: where a plane may touch.
    #[must_use]
    pub fn somewhere(&self) -> Option<LatLon> {
        let area = self.outlines.iter().find(|(kind, ..)| *kind == Kind::Area);
        match &area.or(self.outlines.first())?.2 {
            Shape::Ring(ring) => ring.first().copied(),
            Shape::Circle { centre, .. } => Some(*centre),
        }
    }

    /// Adds all to the ground of a plan.
    ///
    /// # Errors
    /// [`VerifyError::Value`] when something is too far away, or a ring is none.
    pub fn add_to(&self, ground: &mut Ground, plane: Plane) -> Result<(), VerifyError> {
        for (kind, name, shape) in &self.outlines {
            let (list, what) = match kind {
                Kind::Area => (&mut ground.areas, ""),
                Kind::Hole => (&mut ground.holes, ""),
                Kind::Zone => (&mut ground.zones, ""),
                Kind::Fence => (&mut ground.fences, ""),
            };
            list.push(Named {
                name: format!("{what}{name}"),
                outline: self.outline(plane, name, shape)?,
            });
        }
        ground.notices.extend(self.notices.iter().cloned());
        Ok(())
    }

    fn outline(&self, plane: Plane, name: &str, shape: &Shape) -> Result<Outline, VerifyError> {
        let wrong = |problem: String| VerifyError::Value {
            file: self.file.clone(),
            at: name.to_owned(),
            problem,
        };
        let near = |at: &LatLon| plane.near(*at).ok_or_else(|| wrong(too_far(*at)));
        match shape {
            Shape::Ring(ring) => {
                let points = ring.iter().map(near).collect::<Result<Vec<Point>, _>>()?;
                let ring = Ring::new(points).map_err(|e| wrong(e.to_string()))?;
                Ok(Outline::Ring(ring))
            }
            Shape::Circle { centre, radius_m } => Ok(Outline::Circle {
                middle: near(centre)?,
                radius_m: *radius_m,
            }),
        }
    }
}

/// That a place is beyond the plane.
pub(crate) fn too_far(at: LatLon) -> String {
    format!(
        "{:.7},{:.7} lies more than {} km from the origin of the plan",
        at.lat_deg,
        at.lon_deg,
        REACH_M / 1000.0
    )
}
