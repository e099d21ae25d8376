//! The session of a client, without a socket: bytes in, events and bytes out.
//!
//! ```text
//! protocol 2? --> controller's version --> outputs --> inputs, one by one --> start --> data
//! ```
//!
//! A text message may come at any moment, also between a request and its answer. Every controller that an experiment is made with
//! speaks protocol 2.

use super::frame::{Frame, FrameError, FrameTooLongError, Framer, Kind, encode_frame};
use super::recipe::{Recipe, RecipeError};
use super::value::{Value, ValueError};

/// Longest list of names that a controller takes.
const MAX_NAMES: usize = 2048;

/// What a client wants.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionPlan {
    /// Fields that the controller sends; at least one.
    pub outputs: Vec<String>,
    /// How often it sends them.
    pub frequency_hz: f64,
    /// Fields that the client writes, one list for each input recipe.
    pub inputs: Vec<Vec<String>>,
}

/// What the session learns.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Event {
    /// Version of the controller: major, minor, bugfix, build.
    ControllerVersion([u32; 4]),
    /// All recipes are set up and the controller sends.
    Started,
    /// Values of the output recipe, in its order.
    Data(Vec<Value>),
    /// A message for people; level 0 is an exception, 1 an error, 2 a warning, 3 information.
    Text {
        /// What it says.
        text: String,
        /// Who says it.
        source: String,
        /// How grave it is.
        level: u8,
    },
}

/// Why a session ended. Nothing more may be read; a new connection begins a new session, with all recipes.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SessionError {
    /// The stream.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// A request that does not fit into a frame.
    #[error(transparent)]
    TooLong(#[from] FrameTooLongError),
    /// A recipe.
    #[error(transparent)]
    Recipe(#[from] RecipeError),
    /// A plan without outputs: a controller starts with at least one.
    #[error("no outputs are asked for: a controller starts with at least one")]
    NoOutputs,
    /// Names longer than a controller takes.
    #[error("the names of a recipe are {bytes} bytes long, a controller takes at most {MAX_NAMES}")]
    Names {
        /// Their length.
        bytes: usize,
    },
    /// A controller of another protocol.
    #[error("the controller does not speak protocol 2")]
    Protocol,
    /// The controller refuses to start.
    #[error("the controller refuses to start sending")]
    Refused,
    /// An answer of another length than its kind has.
    #[error("an answer of kind {kind:?} is {found} bytes long, {wanted} were expected")]
    Answer {
        /// Its kind.
        kind: Kind,
        /// Its length.
        found: usize,
        /// What it should be.
        wanted: usize,
    },
    /// An answer to something that was not asked.
    #[error("an answer of kind {found:?} came while {wanted:?} was awaited")]
    Unexpected {
        /// What came.
        found: Kind,
        /// What should have.
        wanted: Kind,
    },
    /// A data frame that does not fit its recipe.
    #[error(
        "a data frame of recipe {id} with {found} bytes does not fit the output recipe {wanted_id} of {wanted}"
    )]
    Data {
        /// Number of its recipe; 0 where it has none.
        id: u8,
        /// Its length, without that number.
        found: usize,
        /// Number of the output recipe.
        wanted_id: u8,
        /// Length by the recipe.
        wanted: usize,
    },
    /// The controller's clock went backwards: it has restarted.
    #[error("the controller's clock went from {before_s:.3} s back to {now_s:.3} s: it has restarted")]
    Restarted {
        /// Time of the data frame before.
        before_s: f64,
        /// Time of this one.
        now_s: f64,
    },
}

/// Why inputs cannot be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum WriteInputError {
    /// The session has not started.
    #[error("inputs are written after the start of the session")]
    NotStarted,
    /// There is no such recipe.
    #[error("there is no input recipe {recipe}, the session has {recipes}")]
    NoRecipe {
        /// Which was asked for, counted from 0.
        recipe: usize,
        /// How many there are.
        recipes: usize,
    },
    /// Another number of values.
    #[error("{found} values for an input recipe of {wanted}")]
    Count {
        /// Values given.
        found: usize,
        /// Fields of the recipe.
        wanted: usize,
    },
    /// A value of another type.
    #[error(transparent)]
    Value(#[from] ValueError),
}

/// Where the session is: which answer it waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Version,
    Controller,
    Outputs,
    Inputs(usize),
    Start,
    Running,
}

/// A session under way.
#[derive(Debug, Clone)]
pub struct Link {
    plan: SessionPlan,
    state: State,
    framer: Framer,
    outgoing: Vec<u8>,
    output: Option<Recipe>,
    inputs: Vec<Recipe>,
    last_s: f64,
}

impl Link {
    /// Begins a session: its first bytes are in [`take_outgoing`](Self::take_outgoing).
    ///
    /// # Errors
    ///
    /// A plan without outputs, or with names that a controller does not take.
    pub fn new(plan: SessionPlan) -> Result<Self, SessionError> {
        if plan.outputs.is_empty() {
            return Err(SessionError::NoOutputs);
        }
        for names in plan.inputs.iter().chain([&plan.outputs]) {
            let bytes = names.join(",").len();
            if bytes > MAX_NAMES {
                return Err(SessionError::Names { bytes });
            }
        }
        let mut link = Self {
            plan,
            state: State::Version,
            framer: Framer::default(),
            outgoing: Vec::new(),
            output: None,
            inputs: Vec::new(),
            last_s: f64::NEG_INFINITY,
        };
        link.ask(Kind::ProtocolVersion, &2_u16.to_be_bytes())?;
        Ok(link)
    }

    /// Bytes to send; nothing the second time.
    pub fn take_outgoing(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.outgoing)
    }

    /// The recipe of [`Event::Data`], once the controller has accepted it.
    pub fn output(&self) -> Option<&Recipe> {
        self.output.as_ref()
    }

    /// Whether the controller sends.
    pub fn is_running(&self) -> bool {
        self.state == State::Running
    }

    /// Takes in what came from the wire and says what it means. After an error the session is over.
    ///
    /// # Errors
    ///
    /// Bytes that are no frame, an answer that was not awaited, a recipe that is refused, or a clock that goes back.
    pub fn receive(&mut self, bytes: &[u8]) -> Result<Vec<Event>, SessionError> {
        self.framer.push(bytes);
        let mut events = Vec::new();
        while let Some(frame) = self.framer.next_frame()? {
            self.take(&frame, &mut events)?;
        }
        Ok(events)
    }

    /// Writes the values of input recipe `recipe`, counted from 0 in the order of the plan.
    ///
    /// # Errors
    ///
    /// Before the start, no such recipe, or values of another number or type.
    pub fn write_input(&mut self, recipe: usize, values: &[Value]) -> Result<(), WriteInputError> {
        if self.state != State::Running {
            return Err(WriteInputError::NotStarted);
        }
        let recipes = self.inputs.len();
        let found = self.inputs.get(recipe).ok_or(WriteInputError::NoRecipe { recipe, recipes })?;
        if values.len() != found.fields.len() {
            return Err(WriteInputError::Count { found: values.len(), wanted: found.fields.len() });
        }
        let payload = found.write(values)?;
        let frame = encode_frame(Kind::Data, &payload).expect("names of 2048 bytes are 1024 fields at most");
        self.outgoing.extend(frame);
        Ok(())
    }

    fn ask(&mut self, kind: Kind, payload: &[u8]) -> Result<(), SessionError> {
        let frame = encode_frame(kind, payload)?;
        self.outgoing.extend(frame);
        Ok(())
    }

    /// The kind of answer that is awaited.
    fn awaited(&self) -> Kind {
        match self.state {
            State::Version => Kind::ProtocolVersion,
            State::Controller => Kind::ControllerVersion,
            State::Outputs => Kind::SetUpOutputs,
            State::Inputs(_) => Kind::SetUpInputs,
            State::Start => Kind::Start,
            State::Running => Kind::Data,
        }
    }

    /// What was asked last, in words.
    pub(super) fn asked(&self) -> &'static str {
        match self.state {
            State::Version => "protocol version 2",
            State::Controller => "version of the controller",
            State::Outputs => "set up outputs",
            State::Inputs(_) => "set up inputs",
            State::Start | State::Running => "start",
        }
    }

    fn take(&mut self, frame: &Frame, events: &mut Vec<Event>) -> Result<(), SessionError> {
        let payload = &frame.payload[..];
        match frame.kind {
            Kind::Text => {
                events.push(Self::text(payload));
                return Ok(());
            }
            Kind::Data => return self.data(payload, events),
            kind if kind != self.awaited() => {
                return Err(SessionError::Unexpected { found: kind, wanted: self.awaited() });
            }
            _ => {}
        }
        match self.state {
            State::Version => {
                if !accepted(frame)? {
                    return Err(SessionError::Protocol);
                }
                self.state = State::Controller;
                self.ask(Kind::ControllerVersion, &[])
            }
            State::Controller => {
                let number =
                    |i: usize| payload.get(4 * i..4 * i + 4)?.try_into().ok().map(u32::from_be_bytes);
                let numbers = [number(0), number(1), number(2), number(3)];
                let ([Some(major), Some(minor), Some(bugfix), Some(build)], 16) = (numbers, payload.len())
                else {
                    return Err(SessionError::Answer { kind: frame.kind, found: payload.len(), wanted: 16 });
                };
                events.push(Event::ControllerVersion([major, minor, bugfix, build]));
                self.state = State::Outputs;
                let mut asked = self.plan.frequency_hz.to_be_bytes().to_vec();
                asked.extend(self.plan.outputs.join(",").bytes());
                self.ask(Kind::SetUpOutputs, &asked)
            }
            State::Outputs => {
                self.output = Some(Recipe::from_answer(&self.plan.outputs, payload)?);
                self.next_input(0)
            }
            State::Inputs(k) => {
                let names = &self.plan.inputs[k];
                self.inputs.push(Recipe::from_answer(names, payload)?);
                self.next_input(k + 1)
            }
            State::Start => {
                if !accepted(frame)? {
                    return Err(SessionError::Refused);
                }
                self.state = State::Running;
                events.push(Event::Started);
                Ok(())
            }
            State::Running => Ok(()),
        }
    }

    fn next_input(&mut self, k: usize) -> Result<(), SessionError> {
        if let Some(names) = self.plan.inputs.get(k) {
            self.state = State::Inputs(k);
            let asked = names.join(",").into_bytes();
            return self.ask(Kind::SetUpInputs, &asked);
        }
        self.state = State::Start;
        self.ask(Kind::Start, &[])
    }

    fn data(&mut self, payload: &[u8], events: &mut Vec<Event>) -> Result<(), SessionError> {
        // The first data frames may overtake the answer to the start.
        let Some(recipe) = &self.output else {
            return Err(SessionError::Unexpected { found: Kind::Data, wanted: self.awaited() });
        };
        let Some(values) = recipe.read(payload) else {
            let (id, found) = (payload.first().copied().unwrap_or(0), payload.len().saturating_sub(1));
            return Err(SessionError::Data { id, found, wanted_id: recipe.id, wanted: recipe.size() });
        };
        let time_s = recipe.place("timestamp").and_then(|place| values.get(place));
        if let Some(&Value::Double(now_s)) = time_s {
            // A time that is no number would silence this check for ever.
            if now_s.is_nan() || now_s < self.last_s {
                return Err(SessionError::Restarted { before_s: self.last_s, now_s });
            }
            self.last_s = now_s;
        }
        events.push(Event::Data(values));
        Ok(())
    }

    /// A message for people. What cannot be read is shown as it is: no message ends a session.
    fn text(payload: &[u8]) -> Event {
        let words = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        let read = || {
            let (&length, rest) = payload.split_first()?;
            let (text, rest) = rest.split_at_checked(usize::from(length))?;
            let (&length, rest) = rest.split_first()?;
            let (source, rest) = rest.split_at_checked(usize::from(length))?;
            Some(Event::Text { text: words(text), source: words(source), level: *rest.first()? })
        };
        read().unwrap_or_else(|| Event::Text { text: words(payload), source: String::new(), level: 3 })
    }
}

/// Answers of one byte.
fn accepted(frame: &Frame) -> Result<bool, SessionError> {
    match frame.payload[..] {
        [flag] => Ok(flag != 0),
        _ => Err(SessionError::Answer { kind: frame.kind, found: frame.payload.len(), wanted: 1 }),
    }
}
