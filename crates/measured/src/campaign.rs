//! `campaign.toml`: how a campaign of pulls was made, or is to be made.

use gripgen_twin::columns::notes::check_note;
use gripgen_twin::columns::{COLUMNS, InTable};
use gripgen_twin::config::{Feedback, ForceConvention};
use gripgen_twin::draw::Drawn;
use gripgen_twin::{Campaign, PlannedPull, PullKind};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The campaign file of a folder of measured pulls.
pub const CAMPAIGN_FILE: &str = "campaign.toml";

/// What holds for all pulls of a campaign. Keys that nobody wrote down have their defaults; further keys are left alone.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
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
    /// Whether the traces say anything of the labels.
    #[serde(skip_serializing_if = "LabelEvidenceKind::is_trace")]
    pub label_evidence: LabelEvidenceKind,
    /// The traces hold every reading of the sensor, as those of a run: a diagnosis takes one each 10 ms, and not of all pulls.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub every_reading: bool,
}

/// What the labels of a campaign may be judged by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum LabelEvidenceKind {
    /// The traces, where there are any.
    #[default]
    Trace,
    /// Nothing: the labels are from elsewhere.
    None,
}

impl LabelEvidenceKind {
    fn is_trace(&self) -> bool {
        *self == Self::Trace
    }
}

impl Default for CampaignHeader {
    /// Tolerance of Wucherer et al. 2023, who print no stop; 5 mm is that of a sweep.
    fn default() -> Self {
        Self {
            force_convention: ForceConvention::PerJaw,
            label_tolerance_n: 3.0,
            stop_mm: 5.0,
            feedback: None,
            label_evidence: LabelEvidenceKind::Trace,
            every_reading: false,
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

impl CampaignFileError {
    /// What to do about it.
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Io { .. } => {
                "it is `campaign.toml` of a folder of pulls, or a file that `gripgen campaign -o FILE` wrote"
            }
            Self::Format { .. } => "`gripgen schema campaign` prints its keys and what each may hold",
        }
    }
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

pub(crate) fn check_header(path: &Path, header: &CampaignHeader) -> Result<(), CampaignFileError> {
    for (key, value) in [("label_tolerance_n", header.label_tolerance_n), ("stop_mm", header.stop_mm)] {
        if !(value.is_finite() && value > 0.0) {
            let problem = format!("`{key}` is {value}, it must be a number above 0");
            return Err(CampaignFileError::Format { path: path.into(), line: None, problem });
        }
    }
    Ok(())
}

/// A campaign file with its pulls.
#[derive(Debug, Deserialize, JsonSchema)]
pub struct CampaignFile {
    /// What holds for all of them.
    #[serde(flatten)]
    header: CampaignHeader,
    /// The pulls, in order.
    #[serde(default)]
    pulls: Vec<PlannedPull>,
}

/// Reads a campaign with its list of pulls, grip forces per jaw. Unknown keys of the file are left alone, those of a pull are columns
/// that a lab notes; one that is nearly a known key is an error: a misspelt dwell would be made as if it were not there.
///
/// # Errors
///
/// A file that cannot be read or is no campaign, with its line.
pub fn read_campaign(path: &Path) -> Result<Campaign, CampaignFileError> {
    let text = std::fs::read_to_string(path)
        .map_err(|e| CampaignFileError::Io { path: path.into(), problem: e.to_string() })?;
    let CampaignFile { header, mut pulls } = parse(path, &text)?;
    check_header(path, &header)?;
    if pulls.is_empty() {
        let problem = "it has no `pulls`, there is nothing to do".to_string();
        return Err(CampaignFileError::Format { path: path.into(), line: None, problem });
    }
    for (i, pull) in pulls.iter_mut().enumerate() {
        check_pull(pull).map_err(|problem| {
            let problem = format!("pulls[{i}]: {problem}");
            CampaignFileError::Format { path: path.into(), line: None, problem }
        })?;
        pull.grip_force_n = header.per_jaw_n(pull.grip_force_n);
    }
    let CampaignHeader { label_tolerance_n, stop_mm, feedback, .. } = header;
    Ok(Campaign { label_tolerance_n, stop_m: stop_mm * 1e-3, feedback, pulls })
}

/// Checks an entry; a pull may be what a table of measured pulls may say of it.
fn check_pull(pull: &PlannedPull) -> Result<(), String> {
    let loaded = pull.kind == PullKind::Pull;
    if loaded && pull.part.is_empty() {
        return Err("a pull needs a `part`".into());
    }
    for (name, value) in &pull.notes {
        check_note(name, value)?;
    }
    let covariates = pull.covariates();
    for column in COLUMNS.iter().filter(|column| column.in_table != InTable::Absent) {
        let Some(x) = column.number(pull.view(&covariates)) else { continue };
        let checked = match column.name {
            // Without a load there is no grip and no staircase, and the dwell is how long the sensor is read.
            "grip_force_n" | "force_increment_n" | "step_time_s" if !loaded && x == 0.0 => Ok(x),
            "dwell_s" if !loaded && x <= 0.0 => Err("a number above 0".into()),
            _ => column.check_measured(x),
        };
        checked.map_err(|wanted| format!("`{}` is {x}, it must be {wanted}", column.name))?;
    }
    if !(pull.pause_s.is_finite() && pull.pause_s >= 0.0) {
        return Err(format!("`pause_s` is {}, it must be a number of at least 0", pull.pause_s));
    }
    Ok(())
}

/// The text of a campaign file, a line per pull; `about` becomes its comment. [`read_campaign`] reads it back.
pub fn campaign_toml(campaign: &Campaign, about: &str) -> String {
    let mut text = String::new();
    for line in about.lines() {
        text += format!("# {line}").trim_end();
        text.push('\n');
    }
    text += &header_toml(campaign.label_tolerance_n, campaign.stop_m, campaign.feedback);
    text += "pulls = [\n";
    let number = |x: f64| toml::Value::Float(x).to_string();
    let word = |x: &str| toml::Value::String(x.into()).to_string();
    // `größe` is no bare key.
    let key = |x: &str| match x.is_ascii() {
        true => x.to_string(),
        false => word(x),
    };
    for pull in &campaign.pulls {
        let entry = match pull.kind {
            PullKind::NoLoad => format!("kind = \"no_load\", dwell_s = {}", number(pull.dwell_s)),
            PullKind::Pull => format!(
                "kind = \"pull\", part = {}, grip_force_n = {}, force_increment_n = {}, step_time_s = {}, dwell_s = {}, \
                 pull_direction = {}, grip_offset_mm = {}, grip_angle_deg = {}{}",
                word(&pull.part),
                number(pull.grip_force_n),
                number(pull.force_increment_n),
                number(pull.step_time_s),
                number(pull.dwell_s),
                number(pull.pull_direction),
                number(pull.grip_offset_mm),
                number(pull.grip_angle_deg),
                pull.force_start_n.map(|n| format!(", force_start_n = {}", number(n))).unwrap_or_default(),
            ),
        };
        let (pause, session, gel) = (number(pull.pause_s), word(&pull.session), word(&pull.gel_id));
        let notes: String = pull
            .notes
            .iter()
            .map(|(name, value)| match value {
                Drawn::Number(x) => format!(", {} = {}", key(name), number(*x)),
                Drawn::Text(text) => format!(", {} = {}", key(name), word(text)),
            })
            .collect();
        text += &format!("  {{ {entry}, pause_s = {pause}, session = {session}, gel_id = {gel}{notes} }},\n");
    }
    text + "]\n"
}

/// The keys that hold for all pulls.
pub(crate) fn header_toml(label_tolerance_n: f64, stop_m: f64, feedback: Option<Feedback>) -> String {
    // Without the last bits that the way to metres and back costs.
    let stop_mm = (stop_m * 1e12).round() / 1e9;
    let header = CampaignHeader { label_tolerance_n, stop_mm, feedback, ..CampaignHeader::default() };
    toml::to_string(&header).unwrap_or_else(|e| unreachable!("four plain keys are always TOML: {e}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Campaign, CampaignFileError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(CAMPAIGN_FILE);
        std::fs::write(&path, text).unwrap();
        read_campaign(&path)
    }

    #[test]
    fn a_campaign_that_was_written_is_read_back() {
        let pull = PlannedPull { part: "gear \"a\"".into(), grip_force_n: 0.1 + 0.2, ..Default::default() };
        let pull = PlannedPull { force_start_n: Some(4.5), ..pull };
        let notes = [
            ("operator".to_string(), Drawn::Text("anna".into())),
            ("humidity_pct".to_string(), Drawn::Number(43.0)),
            ("größe".to_string(), Drawn::Number(2.5)),
        ];
        let second = PlannedPull {
            notes: notes.into(),
            force_start_n: None,
            pull_direction: -1.0,
            pause_s: 1500.0,
            session: "2".into(),
            ..pull.clone()
        };
        let none = PlannedPull { kind: PullKind::NoLoad, dwell_s: 5.0, ..Default::default() };
        let campaign = Campaign {
            label_tolerance_n: 2.5,
            stop_m: 4e-3,
            feedback: Some(Feedback::Independent),
            pulls: vec![none, pull, second],
        };
        let text = campaign_toml(&campaign, "two pulls\n[not a section]");
        assert!(
            text.starts_with("# two pulls\n# [not a section]\nforce_convention = \"per_jaw\"\n"),
            "{text}"
        );
        assert_eq!(read(&text).unwrap(), campaign);
        let header = parse_header(Path::new("c"), &text).unwrap();
        assert_eq!((header.stop_mm, header.label_tolerance_n), (4.0, 2.5), "a data folder takes the header");
    }

    #[test]
    fn plain_tables_and_total_forces_are_read_too() {
        let text =
            "force_convention = \"total\"\nrobot = \"r\"\n[[pulls]]\npart = \"gear\"\ngrip_force_n = 40\n";
        let campaign = read(text).unwrap();
        assert_eq!(
            campaign.pulls,
            [PlannedPull { part: "gear".into(), grip_force_n: 20.0, ..Default::default() }]
        );
        // (25 s + 1 s + 11 steps of 0.104 s): 2 x 0.2 x 20 N and 3 N in steps of 1 N.
        assert!((campaign.estimated_minutes() * 60.0 - 27.144).abs() < 1e-9);
        // From 5 N the steps to 1, 2, 3 and 4 N are not made.
        let from = read(&format!("{text}force_start_n = 5\n")).unwrap();
        assert!((from.estimated_minutes() * 60.0 - (27.144 - 4.0 * 0.104)).abs() < 1e-9);
    }

    #[test]
    fn faults_name_the_pull_and_the_key() {
        let pull = "[[pulls]]\npart = \"gear\"\ngrip_force_n = 40\n";
        for (text, part) in [
            (String::new(), "no `pulls`"),
            (format!("{pull}dwel_s = 3\n"), "pulls[0]: unknown field `dwel_s`: did you mean `dwell_s`?"),
            (format!("{pull}humidity_pct = true\n"), "a number or a word is needed"),
            (format!("{pull}temperature_c = \"warm\"\n"), "`temperature_c` is `warm`, it must be a number"),
            (format!("{pull}pull_index = 3\n"), "the campaign or the rig says it"),
            (format!("{pull}{}", pull.replace("40", "-4")), "pulls[1]: `grip_force_n` is -4"),
            (pull.replace("part = \"gear\"", ""), "pulls[0]: a pull needs a `part`"),
            (format!("{pull}pull_direction = 0\n"), "1 (up) or -1 (down)"),
            (format!("{pull}step_time_s = nan\n"), "`step_time_s` is NaN"),
            (format!("{pull}force_start_n = -1\n"), "`force_start_n` is -1"),
            (format!("{pull}pause_s = -1\n"), "`pause_s` is -1"),
            (format!("stop_mm = 0\n{pull}"), "`stop_mm` is 0"),
        ] {
            let error = read(&text).unwrap_err().to_string();
            assert!(error.contains(part) && error.contains("campaign.toml"), "{text}: {error}");
        }
    }
}
