//! Sign and gain of the force sensor, found with a known mass.

use super::readings::watch;
use super::{AVERAGED, REPLY};
use crate::experiment::config::RigConfig;
use crate::experiment::devices::{ConnectError, connect_listener};
use std::time::{Duration, Instant};

/// Standard gravity.
const GRAVITY_M_S2: f64 = 9.806_65;
/// How long somebody has to hang a mass.
const HANG: Duration = Duration::from_secs(60);

/// What hanging a known mass on the tool says of sign and gain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceCheck {
    /// Change of the reading along z.
    pub change_n: f64,
    /// Weight of the mass.
    pub weight_n: f64,
    /// `force_sign` that follows.
    pub sign: f64,
    /// `force_gain` that follows.
    pub gain: f64,
}

/// Why sign and gain are not known.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ForceCheckError {
    /// The robot.
    #[error("{0}")]
    Connect(#[from] ConnectError),
    /// No readings.
    #[error("{found} readings came, {AVERAGED} are needed{}", .ended.as_ref().map(|end| format!(": {end}")).unwrap_or_default())]
    Readings {
        /// How many.
        found: usize,
        /// Why the connection ended, where it did.
        ended: Option<String>,
    },
    /// Nobody hung a mass, or one of another weight.
    #[error("the reading changed by {change_n:.2} N within {waited_s:.0} s, the mass weighs {weight_n:.2} N")]
    Nothing {
        /// By how much it changed.
        change_n: f64,
        /// How long it was waited.
        waited_s: f64,
        /// What the mass weighs.
        weight_n: f64,
    },
}

/// Finds sign and gain of the force sensor: reads it, says that the mass is to be hung, and reads it again. Nothing moves.
///
/// # Errors
///
/// No connection, too few readings, or a change of the reading that is no weight.
pub fn check_force(
    config: &RigConfig,
    mass_kg: f64,
    hang: impl FnOnce(),
) -> Result<ForceCheck, ForceCheckError> {
    let robot = connect_listener(config, config.patient(REPLY))?;
    let average = || {
        let watch = watch(&robot, AVERAGED, config.patient(REPLY));
        let (rows, ended) = (watch.rows, watch.ended);
        if rows.len() < AVERAGED {
            return Err(ForceCheckError::Readings { found: rows.len(), ended });
        }
        Ok(rows.iter().map(|r| r.force[2]).sum::<f64>() / rows.len() as f64)
    };
    let before_n = average()?;
    hang();
    let weight_n = mass_kg * GRAVITY_M_S2;
    let began = Instant::now();
    loop {
        let change_n = average()? - before_n;
        if change_n.abs() > 0.5 * weight_n {
            // It swings at first.
            std::thread::sleep(Duration::from_secs(1));
            while robot.events().try_recv().is_ok() {}
            let change_n = average()? - before_n;
            // The mass pulls down, as a part does that is pulled up.
            let gain = weight_n / change_n.abs();
            return Ok(ForceCheck { change_n, weight_n, sign: change_n.signum(), gain });
        }
        if began.elapsed() > HANG {
            return Err(ForceCheckError::Nothing {
                change_n,
                waited_s: began.elapsed().as_secs_f64(),
                weight_n,
            });
        }
    }
}
