//! What a peer knows of the mission, for a person who asks: what is flown, who follows which
//! revision of it, how far it is. Asking changes nothing.

use crate::layers::Layer;
use crate::mission::{Mission, PointMm};
use crate::mission_edit::is_zone_name;
use crate::output::Status;
use crate::task_desk::TaskView;
use crate::why::{LayerFlown, Other, Work};
use crate::wire::message::{Order, Orders};
use core::fmt;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The mission as a ground station knows it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Overview {
    /// The newest mission that it holds whole.
    pub revision: u32,
    /// Identifies its content.
    pub content_hash: u64,
    /// Counts the missions that were begun anew.
    pub sortie: u16,
    /// Which lap it is, from 0.
    pub lap: u16,
    /// How many laps follow.
    pub further_laps: u16,
    /// In which layer that lap is flown, where there are some.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub layer: Option<Layer>,
    /// Whether the operator ended it.
    pub cancelled: bool,
    /// Latitude of the origin, degrees.
    pub origin_lat_deg: f64,
    /// Longitude of the origin, degrees.
    pub origin_lon_deg: f64,
    /// The area, millimetres east and north of the origin.
    pub area: Vec<PointMm>,
    /// Where UAVs loiter at the end, likewise.
    pub base: PointMm,
    /// How many no-fly zones it has besides those that were added.
    pub zones: usize,
    /// No-fly zones that were added in flight, by name, likewise.
    pub added_zones: BTreeMap<String, Vec<PointMm>>,
    /// The standing order to all.
    pub order: Order,
    /// Those to single UAVs.
    #[serde(default)]
    pub singles: BTreeMap<u16, Order>,
    /// How far the mission is that is followed; none before its loop is derived.
    pub work: Option<Work>,
    /// Tasks other than coverage that it knows.
    #[serde(default)]
    pub tasks: Vec<TaskView>,
    /// Who else there is, and which revision each follows.
    pub others: Vec<Other>,
}

impl Overview {
    pub(crate) fn of(
        mission: &Mission,
        orders: &Orders,
        work: Option<Work>,
        (tasks, others): (Vec<TaskView>, Vec<Other>),
    ) -> Self {
        let zones = mission.added_zones.iter();
        let named = zones.filter(|(name, _)| is_zone_name(name));
        Self {
            revision: mission.revision,
            content_hash: mission.content_hash(),
            sortie: mission.sortie,
            lap: mission.lap,
            further_laps: mission.further_laps,
            layer: mission.layer(),
            cancelled: mission.cancelled,
            origin_lat_deg: f64::from(mission.origin_lat_e7) / 1e7,
            origin_lon_deg: f64::from(mission.origin_lon_e7) / 1e7,
            area: mission.area.clone(),
            base: mission.base,
            zones: mission.zones.len(),
            // What anybody may have put on the air is shown on a terminal.
            added_zones: named
                .map(|(name, ring)| (name.clone(), ring.clone()))
                .collect(),
            order: orders.all,
            singles: orders.singles.clone(),
            work,
            tasks,
            others,
        }
    }
}

fn metres((east, north): PointMm) -> (f64, f64) {
    (f64::from(east) / 1000.0, f64::from(north) / 1000.0)
}

impl fmt::Display for Overview {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ended = if self.cancelled { ", cancelled" } else { "" };
        writeln!(
            f,
            "revision {}{ended}, content {:016x}",
            self.revision, self.content_hash
        )?;
        let (all, singles) = (self.order, self.singles.clone());
        writeln!(f, "  order     {}", Orders { all, singles })?;
        let points = self.area.iter().copied().map(metres);
        let (mut low, mut high) = ((f64::MAX, f64::MAX), (f64::MIN, f64::MIN));
        for (east, north) in points {
            low = (low.0.min(east), low.1.min(north));
            high = (high.0.max(east), high.1.max(north));
        }
        writeln!(
            f,
            "  area      {} corners within {:.0} to {:.0} m east, {:.0} to {:.0} m north of {:.7}, {:.7}",
            self.area.len(),
            low.0,
            high.0,
            low.1,
            high.1,
            self.origin_lat_deg,
            self.origin_lon_deg
        )?;
        let (east, north) = metres(self.base);
        writeln!(f, "  base      {east:.0} m east, {north:.0} m north")?;
        if self.lap > 0 || self.further_laps > 0 {
            let laps = u32::from(self.lap) + u32::from(self.further_laps) + 1;
            writeln!(f, "  lap       {} of {laps}", u32::from(self.lap) + 1)?;
        }
        if let Some(layer) = self.layer {
            let next_mm = None;
            writeln!(f, "  layer     {}", LayerFlown { layer, next_mm })?;
        }
        writeln!(
            f,
            "  zones     {}, and {} added",
            self.zones,
            self.added_zones.len()
        )?;
        for (name, ring) in &self.added_zones {
            writeln!(f, "    {name}: {} corners", ring.len())?;
        }
        match &self.work {
            Some(work) => writeln!(
                f,
                "  progress  {} of {} cells of revision {} are covered",
                work.covered, work.cells, work.revision
            )?,
            None => writeln!(f, "  progress  its loop is not derived yet")?,
        }
        for other in self.others.iter().filter(|o| o.status != Status::Down) {
            match other.revision {
                0 => writeln!(f, "  peer {:<4} was not heard yet", other.id)?,
                revision => writeln!(f, "  peer {:<4} follows revision {revision}", other.id)?,
            }
        }
        Ok(())
    }
}
