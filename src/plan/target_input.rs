//! Points or lines of a file with the team that is to see them, in the plane of the depot.

use super::site::Site;
use super::tour_args::TourArgs;
use super::zone_input::{self, Polygons, ZoneInput, is_plan};
use super::{lat_lon, plane_at, team_input};
use anyhow::{Context, Result};
use skein_geometry::frame::{Origin, Point};
use skein_geometry::offset::Zone;
use skein_interop::place::to_plane;
use skein_interop::plan;
use skein_interop::targets::{self, read};
use skein_survey::team::{Sensor, Uav};
use skein_survey::tours::{LineTarget, PointTarget, Targets};
use skein_survey::zones::flight_zones;
use std::collections::BTreeMap;
use std::path::Path;

/// What of a file is to be seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Its points.
    Points,
    /// Its lines.
    Lines,
}

/// What a file asks for, and who flies.
pub struct TargetInput {
    /// The depot: the origin of the plane.
    pub origin: Origin,
    /// What is to be seen.
    pub targets: Targets,
    /// The zones of the file and of the flag.
    pub zones: Vec<Zone>,
    /// The UAVs.
    pub team: Vec<Uav>,
    /// What files for upload take over.
    pub site: Site,
    /// What of the file was left out.
    pub notices: Vec<String>,
}

impl TargetInput {
    /// Reads a file; the depot is the flag's, or the file's home position, or its first
    /// target.
    ///
    /// # Errors
    /// When a file or a flag is wrong; names the place.
    pub fn read(kind: Kind, file: &Path, args: &TourArgs, turn_radius_m: f64) -> Result<Self> {
        let shown = || file.display().to_string();
        let text =
            std::fs::read_to_string(file).with_context(|| format!("cannot read {}", shown()))?;
        let found = read(&text).with_context(shown)?;
        let mut notices: Vec<String> = found.notices.iter().map(ToString::to_string).collect();
        let (first, others) = match kind {
            Kind::Points => (found.points.first().map(|p| p.at), found.lines.len()),
            Kind::Lines => {
                let first = found.lines.first().and_then(|l| l.way.first());
                (first.copied(), found.points.len())
            }
        };
        if others > 0 {
            notices.push(match kind {
                Kind::Points => format!("{others} line(s) ignored: `plan line` plans for lines"),
                Kind::Lines => format!("{others} point(s) ignored: `plan visit` plans for points"),
            });
        }
        let depot = match &args.depot {
            Some(text) => lat_lon(text).context("--depot")?,
            None => found
                .home
                .or(first)
                .context("the file holds nothing to plan")?,
        };
        let origin = plane_at(depot).with_context(shown)?;
        let team = team_input::team(
            args.fleet.as_deref(),
            args.k,
            args.speed_mps,
            args.endurance_s,
        )?;
        args.output.check(team.len())?;
        let inside = zone_input::of_text(file, &text, origin, Polygons::NoFly);
        let inside = inside.with_context(shown)?;
        let mut zones = zones_of(&inside);
        let mut site = if is_plan(file) {
            Site::of(&plan::read(&text).with_context(shown)?)
        } else {
            let mut site = Site::default();
            fence(&mut site, &inside);
            site
        };
        if let Some(file) = &args.zones {
            let more = zone_input::read(file, origin, Polygons::All);
            let more = more.context("--zones")?;
            zones.extend(zones_of(&more));
            fence(&mut site, &more);
        }
        let defaults = team_input::Defaults {
            camera: Sensor::Swath {
                width_m: args.swath_m(),
            },
            turn_radius_m,
        };
        let team = team_input::in_plane(&team, origin, defaults)?;
        let targets = match kind {
            Kind::Points => Targets::Points(points(&found.points, origin)?),
            Kind::Lines => Targets::Lines(lines(&found.lines, origin)?),
        };
        Ok(Self {
            origin,
            targets,
            zones,
            team,
            site,
            notices,
        })
    }
}

fn points(found: &[targets::PointTarget], origin: Origin) -> Result<Vec<PointTarget>> {
    let point = |p: &targets::PointTarget| -> Result<PointTarget> {
        Ok(PointTarget {
            name: p.pointer.clone(),
            at: to_plane(origin, p.at).with_context(|| p.pointer.clone())?,
            radius_m: p.radius_m,
            sensor: p.sensor.clone(),
        })
    };
    found.iter().map(point).collect()
}

/// Lines whose points are the same where their coordinates are to the seventh decimal, a
/// centimetre.
fn lines(found: &[targets::LineTarget], origin: Origin) -> Result<Vec<LineTarget>> {
    #[allow(clippy::cast_possible_truncation, reason = "at most 1.8e9")]
    let key = |deg: f64| (deg * 1e7).round() as i64;
    let mut known: BTreeMap<(i64, i64), Point> = BTreeMap::new();
    let mut all = Vec::new();
    for line in found {
        let mut way = Vec::new();
        for p in &line.way {
            let at = to_plane(origin, *p).with_context(|| line.pointer.clone())?;
            let first = known.entry((key(p.lat_deg), key(p.lon_deg))).or_insert(at);
            way.push(*first);
        }
        all.push(LineTarget {
            name: line.pointer.clone(),
            way,
            width_m: line.width_m,
            sensor: line.sensor.clone(),
        });
    }
    Ok(all)
}

/// Adds zones and fences to those that are uploaded.
fn fence(site: &mut Site, input: &ZoneInput) {
    for (inclusion, shape) in &input.drawn {
        site.keep(*inclusion, [shape]);
    }
}

/// Zones and fences as zones.
fn zones_of(input: &ZoneInput) -> Vec<Zone> {
    flight_zones(&input.keep_out, &input.keep_in, &[], None).zones
}
