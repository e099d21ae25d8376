//! A line of a client as a command: its name, its numbers, and how many of them there may be.

use gripgen_rig::gcl::GclLimits;

/// Longest line; the longest command is a fifth of it.
const MAX_LINE: usize = 256;
/// Longest name that an answer repeats.
const MAX_NAME: usize = 16;
/// Shortest and longest period of values that are sent by themselves, ms; 0 ends them.
const AUTOSEND_MS: (f64, f64) = (10.0, 60_000.0);

/// Numbers of the status codes (GCL manual; the words are those of [`status_meaning`](gripgen_rig::gcl::status_meaning)).
pub(super) mod status {
    pub const NOT_AVAILABLE: u32 = 1;
    pub const NOT_INITIALISED: u32 = 3;
    pub const ALREADY_RUNNING: u32 = 4;
    pub const NO_PARAMETER_EXPECTED: u32 = 12;
    pub const NOT_ENOUGH_PARAMETERS: u32 = 13;
    pub const UNKNOWN_COMMAND: u32 = 14;
    pub const FORMAT: u32 = 15;
    pub const ACCESS_DENIED: u32 = 16;
    pub const COMMAND_FAILED: u32 = 18;
    pub const ABORTED: u32 = 19;
    pub const OVERRUN: u32 = 27;
    pub const RANGE: u32 = 28;
    pub const AXIS_BLOCKED: u32 = 29;
}

/// What can be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Readable {
    Position,
    Speed,
    Force,
    GripState,
    PartWidthTolerance,
    ClampingTravel,
    Verbose,
}

impl Readable {
    /// Those that can be sent by themselves come first.
    pub const ALL: [Readable; 7] = [
        Readable::Position,
        Readable::Speed,
        Readable::Force,
        Readable::GripState,
        Readable::PartWidthTolerance,
        Readable::ClampingTravel,
        Readable::Verbose,
    ];
    /// How many of them can be sent by themselves.
    pub const STREAMED: usize = 4;

    pub fn name(self) -> &'static str {
        match self {
            Readable::Position => "POS",
            Readable::Speed => "SPEED",
            Readable::Force => "FORCE",
            Readable::GripState => "GRIPSTATE",
            Readable::PartWidthTolerance => "PWT",
            Readable::ClampingTravel => "CLT",
            Readable::Verbose => "VERBOSE",
        }
    }
}

/// A command whose numbers are inside the limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Asked {
    Read(Readable),
    PartWidthTolerance { tolerance_mm: f64 },
    ClampingTravel { travel_mm: f64 },
    Verbose(bool),
    Autosend { index: usize, period_s: Option<f64> },
    Home { outwards: bool },
    Move { to_mm: f64, speed_mm_s: Option<f64> },
    Grip { force_sum_n: Option<f64>, part_width_mm: Option<f64>, speed_mm_s: Option<f64> },
    Release { pull_back_mm: Option<f64>, speed_mm_s: Option<f64> },
    Stop,
    FastStop,
    AcknowledgeFastStop,
    Bye,
}

/// A line that is no command: the name as far as it can be read, and a status.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Refused {
    pub name: String,
    pub status: u32,
}

/// Reads a line; a name in capitals and its command, `None` of an empty line.
pub(super) fn read(line: &str, limits: &GclLimits) -> Result<Option<(String, Asked)>, Refused> {
    if line.len() > MAX_LINE {
        return Err(Refused { name: String::new(), status: status::OVERRUN });
    }
    let line = line.trim();
    if line.is_empty() {
        return Ok(None);
    }
    let end = line.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(line.len());
    let (name, rest) = line.split_at(end);
    let name = name.to_ascii_uppercase();
    match command(&name, rest.trim(), limits) {
        Ok(asked) => Ok(Some((name, asked))),
        Err(status) => {
            // A number in place of the name would read like a status.
            let repeat = name.len() <= MAX_NAME && name.starts_with(|c: char| c.is_ascii_alphabetic());
            Err(Refused { name: if repeat { name } else { String::new() }, status })
        }
    }
}

fn command(name: &str, rest: &str, limits: &GclLimits) -> Result<Asked, u32> {
    let readable = Readable::ALL.into_iter().find(|r| r.name() == name);
    let called = ["HOME", "MOVE", "GRIP", "RELEASE", "STOP", "FASTSTOP", "FSACK", "BYE", "AUTOSEND"];
    if readable.is_none() && !called.contains(&name) {
        return Err(status::UNKNOWN_COMMAND);
    }
    if let Some(readable) = readable {
        if rest == "?" {
            return Ok(Asked::Read(readable));
        }
        let value = rest.strip_prefix('=').ok_or(status::FORMAT)?;
        return setting(readable, value, limits);
    }
    let inside = rest.strip_prefix('(').and_then(|r| r.strip_suffix(')')).ok_or(status::FORMAT)?.trim();
    let words: Vec<&str> =
        if inside.is_empty() { Vec::new() } else { inside.split(',').map(str::trim).collect() };
    if name == "AUTOSEND" {
        return autosend(&words);
    }
    let numbers = words.into_iter().map(number).collect::<Result<Vec<f64>, u32>>()?;
    call(name, &numbers, limits)
}

fn setting(readable: Readable, value: &str, limits: &GclLimits) -> Result<Asked, u32> {
    let value = number(value.trim())?;
    match readable {
        Readable::PartWidthTolerance => {
            Ok(Asked::PartWidthTolerance { tolerance_mm: within(value, (0.0, limits.width_mm.1))? })
        }
        Readable::ClampingTravel => {
            Ok(Asked::ClampingTravel { travel_mm: within(value, (0.0, limits.width_mm.1))? })
        }
        Readable::Verbose => Ok(Asked::Verbose(switch(value)?)),
        // What is measured cannot be set.
        _ => Err(status::FORMAT),
    }
}

fn autosend(words: &[&str]) -> Result<Asked, u32> {
    let [name, period] = exactly(words)?;
    let name = name.trim_matches('"').trim().to_ascii_uppercase();
    let streamed = Readable::ALL.into_iter().take(Readable::STREAMED);
    let index = streamed.into_iter().position(|r| r.name() == name).ok_or(status::RANGE)?;
    let period_ms = number(period)?;
    let period_s = if period_ms == 0.0 { None } else { Some(within(period_ms, AUTOSEND_MS)? / 1000.0) };
    Ok(Asked::Autosend { index, period_s })
}

fn call(name: &str, numbers: &[f64], limits: &GclLimits) -> Result<Asked, u32> {
    let at_most = |most: usize| {
        if numbers.len() > most { Err(status::NO_PARAMETER_EXPECTED) } else { Ok(()) }
    };
    let optional =
        |index: usize, range: (f64, f64)| numbers.get(index).map(|&value| within(value, range)).transpose();
    match name {
        "HOME" => {
            at_most(1)?;
            Ok(Asked::Home { outwards: numbers.first().map_or(Ok(true), |&direction| switch(direction))? })
        }
        "MOVE" => {
            at_most(2)?;
            let to_mm = optional(0, limits.width_mm)?.ok_or(status::NOT_ENOUGH_PARAMETERS)?;
            Ok(Asked::Move { to_mm, speed_mm_s: optional(1, limits.speed_mm_s)? })
        }
        "GRIP" => {
            at_most(3)?;
            let force_sum_n = optional(0, limits.force_sum_n)?;
            let part_width_mm = optional(1, limits.width_mm)?;
            Ok(Asked::Grip { force_sum_n, part_width_mm, speed_mm_s: optional(2, limits.speed_mm_s)? })
        }
        "RELEASE" => {
            at_most(2)?;
            let pull_back_mm = optional(0, limits.width_mm)?;
            Ok(Asked::Release { pull_back_mm, speed_mm_s: optional(1, limits.speed_mm_s)? })
        }
        _ => {
            at_most(0)?;
            Ok(match name {
                "STOP" => Asked::Stop,
                "FASTSTOP" => Asked::FastStop,
                "FSACK" => Asked::AcknowledgeFastStop,
                _ => Asked::Bye,
            })
        }
    }
}

fn exactly<'a, const N: usize>(words: &[&'a str]) -> Result<[&'a str; N], u32> {
    let wrong = if words.len() < N { status::NOT_ENOUGH_PARAMETERS } else { status::NO_PARAMETER_EXPECTED };
    words.try_into().map_err(|_| wrong)
}

fn number(word: &str) -> Result<f64, u32> {
    word.parse().ok().filter(|x: &f64| x.is_finite()).ok_or(status::FORMAT)
}

fn within(value: f64, (least, most): (f64, f64)) -> Result<f64, u32> {
    if value >= least && value <= most { Ok(value) } else { Err(status::RANGE) }
}

fn switch(value: f64) -> Result<bool, u32> {
    match value {
        0.0 => Ok(false),
        1.0 => Ok(true),
        _ => Err(status::RANGE),
    }
}
