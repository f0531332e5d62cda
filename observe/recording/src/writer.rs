//! Writes a run into an MCAP file (mcap.dev): each word of the model as JSON on its channel,
//! and the same for Foxglove.

use crate::cells::{Cell, Cells};
use crate::channels::{self, Channel};
use crate::foxglove;
use crate::model::{End, Event, FailureFree, Frame, Record, Scene};
use crate::sink::Sink;
use crate::space;
use mcap::records::MessageHeader;
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;

/// What was said is on the disk after so long, milliseconds of scenario time: so much is lost
/// where the program is killed. Shorter chunks compress worse.
const FLUSH_MS: u64 = 5_000;

/// The map of the cells is drawn so often, milliseconds of scenario time, or more seldom where
/// there are many: whoever wants each change reads the events.
const CELLS_MS: u64 = 10_000;

/// One more millisecond between two maps for so many cells in 50.
const CELLS_MS_PER_CELL: u64 = 20;

/// A recording that is being written. When it is dropped its file is complete.
pub struct Writer {
    out: mcap::Writer<BufWriter<File>>,
    schemas: BTreeMap<&'static str, u16>,
    /// By topic.
    channels: BTreeMap<String, u16>,
    sequence: u32,
    scene: Scene,
    cells: Cells,
    /// Of the last word.
    time_ms: u64,
    flushed_ms: u64,
    cells_due_ms: u64,
    /// The features of the last map.
    cells_told: Vec<Value>,
}

impl fmt::Debug for Writer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let messages = &self.sequence;
        f.debug_struct("Writer")
            .field("messages", messages)
            .finish_non_exhaustive()
    }
}

/// What goes wrong with the file.
fn io(error: mcap::McapError) -> io::Error {
    match error {
        mcap::McapError::Io(error) => error,
        other => io::Error::other(other),
    }
}

impl Writer {
    /// Makes a file, in place of one that is there.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn create(path: &Path) -> io::Result<Self> {
        let options = mcap::WriteOptions::new()
            .compression(Some(mcap::Compression::Lz4))
            .profile("")
            .library(concat!("skein ", env!("CARGO_PKG_VERSION")));
        let out = options.create(BufWriter::new(File::create(path)?));
        Ok(Self {
            out: out.map_err(io)?,
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            sequence: 0,
            scene: Scene::default(),
            cells: Cells::default(),
            time_ms: 0,
            flushed_ms: 0,
            cells_due_ms: 0,
            cells_told: Vec::new(),
        })
    }

    /// Completes the file.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn finish(mut self) -> io::Result<()> {
        self.out.finish().map(drop).map_err(io)
    }

    fn channel(&mut self, channel: Channel, topic: String) -> io::Result<u16> {
        if let Some(id) = self.channels.get(&topic) {
            return Ok(*id);
        }
        let schema = match self.schemas.get(channel.schema) {
            Some(id) => *id,
            None => {
                let data = serde_json::to_vec(&channel.json_schema())?;
                let added = self.out.add_schema(channel.schema, "jsonschema", &data);
                *self
                    .schemas
                    .entry(channel.schema)
                    .or_insert(added.map_err(io)?)
            }
        };
        let id = self
            .out
            .add_channel(schema, &topic, "json", &BTreeMap::new())
            .map_err(io)?;
        self.channels.insert(topic, id);
        Ok(id)
    }

    fn write(&mut self, channel: Channel, time_ms: u64, value: &impl Serialize) -> io::Result<()> {
        self.write_on(channel, channel.topic.to_owned(), (time_ms, value))
    }

    fn write_on(
        &mut self,
        channel: Channel,
        topic: String,
        (time_ms, value): (u64, &impl Serialize),
    ) -> io::Result<()> {
        let data = serde_json::to_vec(value)?;
        let channel_id = self.channel(channel, topic)?;
        self.sequence = self.sequence.wrapping_add(1);
        let time_ns = time_ms.saturating_mul(1_000_000);
        let header = MessageHeader {
            channel_id,
            sequence: self.sequence,
            log_time: time_ns,
            publish_time: time_ns,
        };
        self.out.write_to_known_channel(&header, &data).map_err(io)
    }

    /// Draws the map of the cells, where it is time and it has changed: those that were covered,
    /// or were left by somebody who is gone. Viewers lay later maps over earlier ones, and these
    /// stay right below them.
    fn map(&mut self, time_ms: u64, at_once: bool) -> io::Result<()> {
        if time_ms < self.cells_due_ms && !at_once {
            return Ok(());
        }
        let every_ms = CELLS_MS.max(CELLS_MS_PER_CELL * self.cells.len() as u64);
        self.cells_due_ms = time_ms + every_ms;
        let is_settled = |cell| matches!(cell, Cell::Covered(_) | Cell::Orphaned(_));
        let features = foxglove::cells(&self.scene, &self.cells, is_settled);
        if features == self.cells_told {
            return Ok(());
        }
        self.cells_told.clone_from(&features);
        self.write(channels::CELLS, time_ms, &foxglove::geojson(features))
    }

    fn flush(&mut self, time_ms: u64) -> io::Result<()> {
        if time_ms < self.flushed_ms + FLUSH_MS {
            return Ok(());
        }
        self.flushed_ms = time_ms;
        self.out.flush().map_err(io)
    }
}

impl Sink for Writer {
    fn take(&mut self, record: &Record) -> io::Result<()> {
        self.cells.hear(record);
        self.time_ms = self.time_ms.max(record.time_ms());
        match record {
            Record::Scene(scene) => self.scene(scene),
            Record::Frame(frame) => self.frame(frame),
            Record::Event(event) => self.event(event),
            Record::FailureFree(run) => self.failure_free(run),
            Record::End(end) => self.end(end),
        }
    }
}

impl Writer {
    fn scene(&mut self, scene: &Scene) -> io::Result<()> {
        self.scene = scene.clone();
        self.write(channels::SCENE, scene.time_ms, scene)?;
        let site = foxglove::geojson(foxglove::site(scene));
        self.write(channels::SITE, scene.time_ms, &site)?;
        self.write(channels::SITE_DRAWN, scene.time_ms, &space::site(scene))?;
        self.cells_due_ms = 0;
        self.out.flush().map_err(io)
    }

    fn frame(&mut self, frame: &Frame) -> io::Result<()> {
        self.write(channels::FRAME, frame.time_ms, frame)?;
        for uav in &frame.uavs {
            if let Some(fix) = foxglove::location(frame.time_ms, &self.scene, uav) {
                let topic = channels::LOCATION.topic.replace('*', &uav.id.to_string());
                self.write_on(channels::LOCATION, topic, (frame.time_ms, &fix))?;
            }
        }
        if let Some(transforms) = space::transforms(frame) {
            self.write(channels::TRANSFORMS, frame.time_ms, &transforms)?;
        }
        let drawn = space::uavs(&self.scene, frame);
        self.write(channels::UAVS_DRAWN, frame.time_ms, &drawn)?;
        self.map(frame.time_ms, false)?;
        self.flush(frame.time_ms)
    }

    fn event(&mut self, event: &Event) -> io::Result<()> {
        self.write(channels::EVENT, event.time_ms, event)?;
        self.write(channels::LOG, event.time_ms, &foxglove::log(event))
    }

    /// It is of no moment of the run: its time is that when it became known, so that a file is
    /// in the order of time.
    fn failure_free(&mut self, run: &FailureFree) -> io::Result<()> {
        self.write(channels::FAILURE_FREE, self.time_ms, run)
    }

    fn end(&mut self, end: &End) -> io::Result<()> {
        self.map(end.time_ms, true)?;
        self.write(channels::END, end.time_ms, end)?;
        self.out.finish().map(drop).map_err(io)
    }
}
