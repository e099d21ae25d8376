//! RTDE as a controller speaks it, without a socket: bytes in, bytes out, data frames when they are due.

use super::controller::Controller;
use crate::fields::{input_type, output_type};
use gripgen_rig::rtde::{FieldType, Frame, FrameError, Framer, Kind, Value, encode_frame};
use std::collections::BTreeMap;

/// Version of the controller that the virtual rig says it is: major, minor, bugfix, build.
pub const CONTROLLER_VERSION: [u32; 4] = [5, 12, 0, 0];
/// Rate of an e-Series controller, and how often protocol 1 sends.
const FULL_RATE_HZ: f64 = 500.0;
/// Longest list of names.
const MAX_NAMES: usize = 2048;
/// Output recipes are one a connection, input recipes have one byte for their number.
const MAX_INPUT_RECIPES: usize = 255;

/// Who writes which input: one connection at a time.
#[derive(Debug, Clone, Default)]
pub struct InputOwners(BTreeMap<String, u64>);

impl InputOwners {
    /// Whether no client writes inputs.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Frees what a connection had.
    pub fn release(&mut self, connection: u64) {
        self.0.retain(|_, owner| *owner != connection);
    }
}

/// Why a connection is closed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ServerError {
    /// The stream.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// A request of a length that its kind does not have.
    #[error("a request of kind {kind:?} is {bytes} bytes long")]
    Request {
        /// Its kind.
        kind: Kind,
        /// Its length.
        bytes: usize,
    },
    /// A data frame for a recipe that there is not, or of another length.
    #[error("a data frame of {bytes} bytes fits none of the {recipes} input recipes")]
    Data {
        /// Its length.
        bytes: usize,
        /// Recipes of the connection.
        recipes: usize,
    },
}

/// A connection.
#[derive(Debug, Clone)]
pub struct RtdeServer {
    connection: u64,
    framer: Framer,
    protocol: u16,
    outputs: Vec<String>,
    /// Control steps between two data frames.
    every: u64,
    inputs: Vec<Vec<(String, FieldType)>>,
    started: bool,
}

impl RtdeServer {
    /// A connection that nothing was said on.
    pub fn new(connection: u64) -> Self {
        let (framer, outputs, inputs) = (Framer::default(), Vec::new(), Vec::new());
        Self { connection, framer, protocol: 1, outputs, every: 1, inputs, started: false }
    }

    /// Takes in what came and gives the answers. After an error the connection is closed.
    ///
    /// # Errors
    ///
    /// Bytes that are no frame or no request, or data that fit no recipe.
    pub fn receive(
        &mut self,
        bytes: &[u8],
        controller: &mut Controller,
        owners: &mut InputOwners,
    ) -> Result<Vec<u8>, ServerError> {
        self.framer.push(bytes);
        let mut answers = Vec::new();
        while let Some(frame) = self.framer.next_frame()? {
            if let Some(payload) = self.answer(&frame, controller, owners)? {
                // What this side writes fits: lists of types are shorter than the names they answer.
                answers.extend(encode_frame(frame.kind, &payload).unwrap_or_default());
            }
        }
        Ok(answers)
    }

    /// The data frame of control step `step`, if one is due.
    pub fn data(&self, step: u64, controller: &Controller) -> Option<Vec<u8>> {
        if !self.started || !step.is_multiple_of(self.every) {
            return None;
        }
        let mut payload = Vec::with_capacity(512);
        if self.protocol > 1 {
            payload.push(1);
        }
        for name in &self.outputs {
            controller.robot().output(name)?.write(&mut payload);
        }
        encode_frame(Kind::Data, &payload).ok()
    }

    /// A message for people, as a frame.
    pub fn text(&self, text: &str, source: &str, level: u8) -> Vec<u8> {
        let short = |words: &str| words.as_bytes()[..words.len().min(255)].to_vec();
        let mut payload = Vec::new();
        if self.protocol > 1 {
            for words in [short(text), short(source)] {
                payload.push(words.len() as u8);
                payload.extend(words);
            }
            payload.push(level);
        } else {
            payload.push(level);
            payload.extend(short(text));
        }
        encode_frame(Kind::Text, &payload).unwrap_or_default()
    }

    fn answer(
        &mut self,
        frame: &Frame,
        controller: &mut Controller,
        owners: &mut InputOwners,
    ) -> Result<Option<Vec<u8>>, ServerError> {
        let payload = &frame.payload[..];
        let wrong = || ServerError::Request { kind: frame.kind, bytes: payload.len() };
        Ok(match frame.kind {
            Kind::ProtocolVersion => {
                let asked: [u8; 2] = payload.try_into().map_err(|_| wrong())?;
                let version = u16::from_be_bytes(asked);
                let accepted = matches!(version, 1 | 2);
                if accepted {
                    self.protocol = version;
                }
                Some(vec![u8::from(accepted)])
            }
            Kind::ControllerVersion => {
                Some(CONTROLLER_VERSION.iter().flat_map(|n| n.to_be_bytes()).collect())
            }
            Kind::SetUpOutputs => Some(self.set_up_outputs(payload).ok_or_else(wrong)?),
            Kind::SetUpInputs => Some(self.set_up_inputs(payload, owners).ok_or_else(wrong)?),
            Kind::Start => {
                self.started = !self.outputs.is_empty();
                Some(vec![u8::from(self.started)])
            }
            Kind::Pause => {
                self.started = false;
                Some(vec![1])
            }
            Kind::Data => {
                self.write_inputs(payload, controller)?;
                None
            }
            // What a client has to say goes nowhere.
            Kind::Text => None,
        })
    }

    fn set_up_outputs(&mut self, payload: &[u8]) -> Option<Vec<u8>> {
        let (rate_hz, names) = match self.protocol {
            1 => (FULL_RATE_HZ, payload),
            _ => {
                let (rate, names) = payload.split_at_checked(8)?;
                (f64::from_be_bytes(rate.try_into().ok()?), names)
            }
        };
        let names = names_of(names)?;
        let types: Vec<&str> =
            names.iter().map(|name| output_type(name).map_or("NOT_FOUND", FieldType::name)).collect();
        let known = !types.contains(&"NOT_FOUND") && !names.is_empty();
        let mut answer = if self.protocol > 1 { vec![u8::from(known)] } else { vec![] };
        answer.extend(types.join(",").bytes());
        // A rate that is no number is the full one.
        self.every = (FULL_RATE_HZ / rate_hz.clamp(1.0, FULL_RATE_HZ)).round().max(1.0) as u64;
        self.outputs = if known { names } else { vec![] };
        self.started &= known;
        Some(answer)
    }

    fn set_up_inputs(&mut self, payload: &[u8], owners: &mut InputOwners) -> Option<Vec<u8>> {
        let names = names_of(payload)?;
        if self.inputs.len() >= MAX_INPUT_RECIPES {
            return None;
        }
        let mut usable = !names.is_empty();
        let mut fields = Vec::with_capacity(names.len());
        let mut types = Vec::with_capacity(names.len());
        for name in names {
            let taken = owners.0.get(&name).is_some_and(|owner| *owner != self.connection);
            types.push(match input_type(&name) {
                None => "NOT_FOUND",
                Some(_) if taken => "IN_USE",
                Some(kind) => {
                    fields.push((name, kind));
                    kind.name()
                }
            });
        }
        usable &= fields.len() == types.len();
        let id = if usable { self.inputs.len() as u8 + 1 } else { 0 };
        if usable {
            owners.0.extend(fields.iter().map(|(name, _)| (name.clone(), self.connection)));
            self.inputs.push(fields);
        }
        let mut answer = vec![id];
        answer.extend(types.join(",").bytes());
        Some(answer)
    }

    /// Inputs are taken before the start, too: a client that only writes never starts.
    fn write_inputs(&self, payload: &[u8], controller: &mut Controller) -> Result<(), ServerError> {
        let wrong = || ServerError::Data { bytes: payload.len(), recipes: self.inputs.len() };
        let (&id, mut rest) = payload.split_first().ok_or_else(wrong)?;
        let fields = usize::from(id).checked_sub(1).and_then(|i| self.inputs.get(i)).ok_or_else(wrong)?;
        if rest.len() != fields.iter().map(|(_, kind)| kind.size()).sum::<usize>() {
            return Err(wrong());
        }
        let mut values: Vec<(&str, Value)> = Vec::with_capacity(fields.len());
        for (name, kind) in fields {
            let (bytes, after) = rest.split_at_checked(kind.size()).ok_or_else(wrong)?;
            values.push((name, kind.read(bytes).ok_or_else(wrong)?));
            rest = after;
        }
        for (name, value) in values {
            controller.write_input(name, value);
        }
        Ok(())
    }
}

/// Names between commas; a comma at the end is no name.
fn names_of(bytes: &[u8]) -> Option<Vec<String>> {
    if bytes.len() > MAX_NAMES {
        return None;
    }
    let text = std::str::from_utf8(bytes).ok()?;
    Some(text.split(',').map(str::trim).filter(|name| !name.is_empty()).map(String::from).collect())
}
