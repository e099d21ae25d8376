//! `campaign.toml`: how a campaign of pulls was made, or is to be made.

use gripgen_twin::config::{Feedback, ForceConvention};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The campaign file of a folder of measured pulls.
pub const CAMPAIGN_FILE: &str = "campaign.toml";

/// What holds for all pulls of a campaign. Keys that nobody wrote down have their defaults; further keys are left alone.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct CampaignHeader {
    /// What a grip force means in the campaign and in its table; one jaw's where it is left out.
    pub force_convention: ForceConvention,
    /// Tolerance of the label rule.
    pub label_tolerance_n: f64,
    /// Displacement at which a pull ends.
    pub stop_mm: f64,
    /// What the force loop closed on, where it is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub feedback: Option<Feedback>,
}

impl Default for CampaignHeader {
    /// Tolerance of Wucherer et al. 2023, who print no stop; 5 mm is that of a sweep.
    fn default() -> Self {
        Self {
            force_convention: ForceConvention::PerJaw,
            label_tolerance_n: 3.0,
            stop_mm: 5.0,
            feedback: None,
        }
    }
}

impl CampaignHeader {
    /// Grip force per jaw of a number in this campaign.
    pub fn per_jaw_n(&self, grip_force_n: f64) -> f64 {
        match self.force_convention {
            ForceConvention::PerJaw => grip_force_n,
            ForceConvention::Total => 0.5 * grip_force_n,
        }
    }
}

/// Why a campaign file could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CampaignFileError {
    /// The file cannot be read.
    #[error("{}: {problem}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        problem: String,
    },
    /// It is not TOML, or a key holds what it must not.
    #[error("{}{}: {problem}", .path.display(), .line.map(|l| format!(":{l}")).unwrap_or_default())]
    Format {
        /// The file.
        path: PathBuf,
        /// Line, where it is known.
        line: Option<usize>,
        /// What is wrong, with the value.
        problem: String,
    },
}

/// Reads what holds for all pulls of a campaign from its text; `path` is for errors.
pub(crate) fn parse_header(path: &Path, text: &str) -> Result<CampaignHeader, CampaignFileError> {
    let header: CampaignHeader = parse(path, text)?;
    check_header(path, &header)?;
    Ok(header)
}

pub(crate) fn parse<T: serde::de::DeserializeOwned>(path: &Path, text: &str) -> Result<T, CampaignFileError> {
    toml::from_str(text.trim_start_matches('\u{feff}')).map_err(|e| {
        let line = e.span().and_then(|s| text.get(..s.start)).map(|before| before.matches('\n').count() + 1);
        CampaignFileError::Format { path: path.into(), line, problem: e.message().to_string() }
    })
}

fn check_header(path: &Path, header: &CampaignHeader) -> Result<(), CampaignFileError> {
    for (key, value) in [("label_tolerance_n", header.label_tolerance_n), ("stop_mm", header.stop_mm)] {
        if !(value.is_finite() && value > 0.0) {
            let problem = format!("`{key}` is {value}, it must be a number above 0");
            return Err(CampaignFileError::Format { path: path.into(), line: None, problem });
        }
    }
    Ok(())
}
