//! The frames of the vehicle stream between a node and its world (D2.7 §1.1: the
//! platform below the mission planner).
//!
//! A frame is four bytes of length, most significant first, and one CBOR value.
//! [`encode`] and [`Decoder`] know no socket; who moves the bytes is up to both ends.
//! Bytes of a [`ToWorld::Report`] or a [`ToWorld::Witness`] stay bytes here: this crate does not
//! know the peer.

use crate::{LinkNews, RadioCounters};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use skein_behaviors::Percept;
use skein_behaviors::Setpoint;
use skein_behaviors::setpoint::{GimbalStep, MAX_GIMBAL_STEPS, MAX_STEPS};

/// The longest frame, bytes: a row of 1,000 links takes about 90 kB with field
/// names, a report that lists 65,535 cells 200 kB.
pub const MAX_FRAME_BYTES: usize = 256 * 1024;

/// Bytes of the length before each frame.
const LENGTH_BYTES: usize = 4;

/// From the world to a node.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(
    clippy::large_enum_variant,
    reason = "a frame lives until it is written or read, and most hold a percept"
)]
pub enum ToPeer {
    /// Answers [`ToWorld::Hello`]; always the first frame.
    Welcome {
        /// Seed of the radio's draws.
        seed: u64,
        /// Scenario time, milliseconds.
        time_ms: u64,
        /// Scenario seconds per second of wall time.
        scale: f64,
    },
    /// Time went on.
    Tick {
        /// Scenario time, milliseconds.
        time_ms: u64,
        /// Scenario seconds per second of wall time.
        scale: f64,
        /// What the vehicle senses, when it is due and there is a vehicle.
        percept: Option<Percept>,
        /// The links, when one of them changed.
        links: Option<LinkNews>,
    },
    /// The trial is over: flush and leave.
    End,
}

/// From a node to the world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ToWorld {
    /// Who is there; always the first frame.
    Hello {
        /// The peer's number.
        id: u16,
        /// Its process.
        pid: u32,
        /// Proves that it was started by this world.
        token: String,
        /// Where its transport listens, as `tcp/127.0.0.1:PORT`.
        locator: String,
        /// Where it listens for an operator, as `127.0.0.1:PORT`, if it does.
        console: Option<String>,
    },
    /// What the vehicle is to fly.
    Setpoint(Setpoint),
    /// A report of the peer, encoded by the peer's own crate.
    Report(#[serde(with = "serde_bytes")] Vec<u8>),
    /// What the peer says of what it sees and knows, encoded likewise: for a judge, not for
    /// displays.
    Witness(#[serde(with = "serde_bytes")] Vec<u8>),
    /// What the radio did since the node started.
    Radio(RadioCounters),
    /// The node has flushed everything and leaves.
    Bye,
}

/// Why bytes are no frame; the stream cannot be read on.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// Longer than [`MAX_FRAME_BYTES`].
    #[error("a frame of {0} bytes exceeds the limit of {MAX_FRAME_BYTES}")]
    TooLong(usize),
    /// Not the CBOR of such a frame.
    #[error("the frame cannot be read: {0}")]
    Malformed(String),
    /// A number that is not finite, or more steps than a setpoint may hold.
    #[error("the frame holds a value out of bounds: {0}")]
    OutOfBounds(&'static str),
    /// The value cannot be written as CBOR.
    #[error("the frame cannot be written: {0}")]
    Unwritable(String),
}

/// What both directions have in common.
pub trait Frame: Serialize + DeserializeOwned {
    /// Checks what the types cannot say.
    ///
    /// # Errors
    /// [`FrameError::OutOfBounds`] with the name of the value.
    fn check(&self) -> Result<(), FrameError>;
}

impl Frame for ToPeer {
    fn check(&self) -> Result<(), FrameError> {
        match self {
            Self::Welcome { scale, .. } => check_scale(*scale),
            Self::Tick { scale, percept, .. } => {
                check_scale(*scale)?;
                percept.as_ref().map_or(Ok(()), check_percept)
            }
            Self::End => Ok(()),
        }
    }
}

impl Frame for ToWorld {
    fn check(&self) -> Result<(), FrameError> {
        match self {
            Self::Setpoint(setpoint) => check_setpoint(setpoint),
            Self::Hello { .. }
            | Self::Report(_)
            | Self::Witness(_)
            | Self::Radio(_)
            | Self::Bye => Ok(()),
        }
    }
}

fn check_scale(scale: f64) -> Result<(), FrameError> {
    if scale.is_finite() && scale > 0.0 {
        Ok(())
    } else {
        Err(FrameError::OutOfBounds("scale"))
    }
}

fn check_percept(p: &Percept) -> Result<(), FrameError> {
    let values = [
        p.pose.east_m,
        p.pose.north_m,
        p.pose.heading_rad,
        p.height_m,
        p.airspeed_mps,
        p.wind_east_mps,
        p.wind_north_mps,
        p.endurance_s,
    ];
    let turned = p.attitude.is_none_or(|a| a.is_finite());
    let circles = p.circles_per_m.is_none_or(|c| c.is_finite() && c != 0.0);
    if turned && circles && values.iter().all(|v| v.is_finite()) {
        Ok(())
    } else {
        Err(FrameError::OutOfBounds("percept"))
    }
}

fn check_setpoint(s: &Setpoint) -> Result<(), FrameError> {
    let finite = s.airspeed_mps.is_finite()
        && s.height_m.is_finite()
        && s.steps.iter().all(|step| step.turn_rate_radps.is_finite())
        && s.gimbal.iter().all(GimbalStep::is_finite);
    if !finite {
        return Err(FrameError::OutOfBounds("setpoint"));
    }
    if s.promised.is_some() && s.promise().is_none() {
        return Err(FrameError::OutOfBounds("promise of the setpoint"));
    }
    if s.steps.len() > MAX_STEPS {
        return Err(FrameError::OutOfBounds("steps of the setpoint"));
    }
    if s.gimbal.len() > MAX_GIMBAL_STEPS {
        return Err(FrameError::OutOfBounds("steps of the gimbal"));
    }
    Ok(())
}

/// The bytes of one frame, with their length in front.
///
/// # Errors
/// When the frame is too long, or holds what its reader would refuse.
pub fn encode<T: Frame>(frame: &T) -> Result<Vec<u8>, FrameError> {
    frame.check()?;
    let body = cbor4ii::serde::to_vec(vec![0; LENGTH_BYTES], frame)
        .map_err(|e| FrameError::Unwritable(e.to_string()))?;
    let length = body.len() - LENGTH_BYTES;
    if length > MAX_FRAME_BYTES {
        return Err(FrameError::TooLong(length));
    }
    let prefix = u32::try_from(length)
        .map_err(|_| FrameError::TooLong(length))?
        .to_be_bytes();
    let mut bytes = body;
    bytes[..LENGTH_BYTES].copy_from_slice(&prefix);
    Ok(bytes)
}

/// Cuts a stream of bytes into frames.
#[derive(Debug, Default)]
pub struct Decoder {
    bytes: Vec<u8>,
    read: usize,
}

impl Decoder {
    /// Takes what arrived.
    pub fn push(&mut self, bytes: &[u8]) {
        // What was read goes first, so that the buffer stays near one frame long.
        self.bytes.drain(..self.read);
        self.read = 0;
        self.bytes.extend_from_slice(bytes);
    }

    /// The next whole frame, if there is one.
    ///
    /// # Errors
    /// When the stream holds anything but frames of this type; give it up then.
    pub fn pop<T: Frame>(&mut self) -> Result<Option<T>, FrameError> {
        let rest = &self.bytes[self.read..];
        let Some((prefix, rest)) = rest.split_first_chunk::<LENGTH_BYTES>() else {
            return Ok(None);
        };
        let length = usize::try_from(u32::from_be_bytes(*prefix)).unwrap_or(usize::MAX);
        if length > MAX_FRAME_BYTES {
            return Err(FrameError::TooLong(length));
        }
        let Some(body) = rest.get(..length) else {
            return Ok(None);
        };
        let frame: T = decode_exact(body)?;
        frame.check()?;
        self.read += LENGTH_BYTES + length;
        Ok(Some(frame))
    }
}

/// Reads one CBOR value that fills `body` to its last byte.
fn decode_exact<T: DeserializeOwned>(body: &[u8]) -> Result<T, FrameError> {
    let mut reader = cbor4ii::core::utils::SliceReader::new(body);
    let value = T::deserialize(&mut cbor4ii::serde::Deserializer::new(&mut reader))
        .map_err(|e| FrameError::Malformed(e.to_string()))?;
    let left = cbor4ii::core::dec::Read::fill(&mut reader, 1).map(|rest| rest.as_ref().len());
    match left {
        Ok(0) => Ok(value),
        _ => Err(FrameError::Malformed("bytes follow the value".to_owned())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Hearing, LinkState};
    use skein_behaviors::setpoint::{Side, Steer};

    fn setpoint(rate: f64, steps: usize) -> ToWorld {
        ToWorld::Setpoint(Setpoint {
            from_ms: 1200,
            airspeed_mps: 13.0,
            height_m: 60.0,
            steps: vec![
                Steer {
                    turn_rate_radps: rate,
                    duration_ms: 400
                };
                steps
            ],
            loiter: Side::Left,
            gimbal: Vec::new(),
            launch: skein_behaviors::setpoint::Launch::Stay,
            promised: None,
        })
    }

    fn tick() -> ToPeer {
        let link = LinkState {
            in_range: true,
            in_sight: false,
            cut: false,
            loss_permille: 20,
            delay_ms: 3,
        };
        ToPeer::Tick {
            time_ms: 5_000,
            scale: 8.0,
            percept: None,
            links: Some(LinkNews {
                row: vec![(3, link)],
                hearing: Hearing::of(vec![1, 3], |_, _| true),
            }),
        }
    }

    #[test]
    fn frames_survive_any_cutting_of_the_stream() {
        let frames = [tick(), ToPeer::End];
        let stream: Vec<u8> = frames.iter().flat_map(|f| encode(f).unwrap()).collect();
        for piece in [1, 2, 3, 7, stream.len()] {
            let mut decoder = Decoder::default();
            let mut seen = Vec::new();
            for bytes in stream.chunks(piece) {
                decoder.push(bytes);
                while let Some(frame) = decoder.pop::<ToPeer>().unwrap() {
                    seen.push(frame);
                }
            }
            assert_eq!(seen, frames, "pieces of {piece}");
        }
    }

    #[test]
    fn a_length_beyond_the_limit_is_refused_before_its_bytes_come() {
        let mut decoder = Decoder::default();
        decoder.push(&[0xff, 0xff, 0xff, 0xff]);
        assert!(matches!(
            decoder.pop::<ToPeer>(),
            Err(FrameError::TooLong(_))
        ));
    }

    #[test]
    fn bytes_behind_the_value_are_refused() {
        let mut bytes = encode(&ToPeer::End).unwrap();
        bytes.push(0);
        let length = u32::try_from(bytes.len() - LENGTH_BYTES).unwrap();
        bytes[..LENGTH_BYTES].copy_from_slice(&length.to_be_bytes());
        let mut decoder = Decoder::default();
        decoder.push(&bytes);
        assert!(matches!(
            decoder.pop::<ToPeer>(),
            Err(FrameError::Malformed(_))
        ));
    }

    #[test]
    fn every_truncation_and_every_flipped_byte_is_an_error_or_a_frame() {
        let bytes = encode(&tick()).unwrap();
        for at in LENGTH_BYTES..bytes.len() {
            let mut bad = bytes.clone();
            bad[at] ^= 0xa5;
            let mut decoder = Decoder::default();
            decoder.push(&bad);
            // Nothing to expect but that it returns.
            let _ = decoder.pop::<ToPeer>();
        }
        let mut decoder = Decoder::default();
        decoder.push(&bytes[..bytes.len() - 1]);
        assert_eq!(decoder.pop::<ToPeer>(), Ok(None));
    }

    #[test]
    fn what_is_not_finite_is_neither_written_nor_read() {
        assert!(matches!(
            encode(&setpoint(f64::NAN, 1)),
            Err(FrameError::OutOfBounds(_))
        ));
        assert!(matches!(
            encode(&setpoint(0.1, MAX_STEPS + 1)),
            Err(FrameError::OutOfBounds(_))
        ));
        let body = cbor4ii::serde::to_vec(Vec::new(), &setpoint(f64::INFINITY, 1)).unwrap();
        let mut stream = u32::try_from(body.len()).unwrap().to_be_bytes().to_vec();
        stream.extend(body);
        let mut decoder = Decoder::default();
        decoder.push(&stream);
        assert!(matches!(
            decoder.pop::<ToWorld>(),
            Err(FrameError::OutOfBounds(_))
        ));
    }
}
