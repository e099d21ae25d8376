//! What can be wrong with a sensor file.

use crate::npz::NpzError;
use std::ops::RangeInclusive;

/// Version of the sensor file format, stored under the key `gripgen_sensor`.
pub const SENSOR_VERSION: f64 = 1.0;

/// Why a sensor file could not be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SensorError {
    /// The archive or one of its arrays.
    #[error(transparent)]
    Npz(#[from] NpzError),
    /// Made by a later gripgen.
    #[error("the sensor file has version {found}, this gripgen reads version {SENSOR_VERSION}")]
    Version {
        /// Version in the file.
        found: f64,
    },
    /// An archive with neither set of keys.
    #[error(
        "neither a gripgen sensor (key `gripgen_sensor`) nor a Taxim calibration (key `grad_r`); found: {present}"
    )]
    Unknown {
        /// Keys found.
        present: String,
    },
    /// A Taxim calibration lacks what its file does not hold.
    #[error("a Taxim calibration holds no {missing}")]
    Incomplete {
        /// `background` or `mm_per_px`.
        missing: &'static str,
    },
    /// A colour table whose positions are those of other images.
    #[error(
        "{share_percent:.0} % of the colours of the table lie outside 0 to 255 where its positions are those of images {width_px} px \
         wide, more than {most_percent:.0} %{}", likely(.likely_px)
    )]
    TableScale {
        /// Share of the values that lie outside.
        share_percent: f64,
        /// The largest share of a table that is read as it was made.
        most_percent: f64,
        /// Width of the images in whose positions it was read.
        width_px: u32,
        /// Widths at which the share is small enough.
        likely_px: Vec<u32>,
    },
    /// The background has not the size of the rest frame that it replaces.
    #[error("the background is {found:?} pixels, the sensor's rest frame {wanted:?}")]
    BackgroundSize {
        /// Width and height of the background.
        found: (usize, usize),
        /// Width and height of the rest frame.
        wanted: (usize, usize),
    },
    /// A gel map of another size.
    #[error("the gel map is {found:?} pixels, the sensor's images {wanted:?}")]
    GelMapSize {
        /// Width and height of the map.
        found: (usize, usize),
        /// Width and height of the images.
        wanted: (usize, usize),
    },
    /// A shadow table beside the sensor file.
    #[error("shadow table: {0}")]
    ShadowTable(NpzError),
    /// A gel map that is no plain array.
    #[error("gel map: {problem}")]
    GelMap {
        /// What is wrong with it.
        problem: String,
    },
    /// A colour model with an infinite or undefined coefficient.
    #[error("`{key}` holds a number that is not finite")]
    NotFinite {
        /// Key in the file.
        key: &'static str,
    },
    /// A value is out of range.
    #[error("`{key}` is {value}, it must be {range}")]
    Value {
        /// Key in the file.
        key: &'static str,
        /// Value found.
        value: f64,
        /// What is allowed.
        range: &'static str,
    },
}

fn likely(widths_px: &[u32]) -> String {
    let widths: Vec<String> = widths_px.iter().map(u32::to_string).collect();
    if widths.is_empty() {
        String::new()
    } else {
        format!("; likely is a width of {} px", widths.join(" or "))
    }
}

/// Refuses the first of some values that does not lie in a range, which `text` tells.
pub(crate) fn check_range(
    key: &'static str,
    values: impl IntoIterator<Item = f64>,
    range: RangeInclusive<f64>,
    text: &'static str,
) -> Result<(), SensorError> {
    let outside = values.into_iter().find(|value| !range.contains(value));
    outside.map_or(Ok(()), |value| Err(SensorError::Value { key, value, range: text }))
}
