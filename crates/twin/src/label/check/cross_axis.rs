//! What other devices and axes say of a pull.

use super::{Finding, FindingKind, LabelEvidence, cap_n};

/// Precision of the torque of a UR e-Series, Nm (data sheet: 0.2 N m, accuracy 0.3 N m).
const TORQUE_NM: f64 = 0.3;
/// Fewest rows that are compared.
const ROWS: usize = 8;

/// What the gripper said of its force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GripForceEvidence {
    /// Asked of a jaw, N.
    pub asked_n: f64,
    /// Reported, of a jaw.
    pub reported_n: f64,
    /// How far they may be apart: the gripper's resolution and accuracy.
    pub allowed_n: f64,
}

/// Force and torque at the grip at one time of a pull.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WrenchRow {
    /// Seconds since the start of the pull; before 0 without a load.
    pub time_s: f64,
    /// Along the pull.
    pub pull_n: f64,
    /// Across it.
    pub across_n: [f64; 2],
    /// About all axes.
    pub torque_nm: [f64; 3],
}

/// The gripper's own word.
pub(super) fn grip_force(evidence: &LabelEvidence<'_>, findings: &mut Vec<Finding>) {
    if let Some(GripForceEvidence { asked_n, reported_n, allowed_n }) = evidence.grip_force {
        findings.push(Finding {
            kind: FindingKind::GripForce,
            found: reported_n,
            wanted: asked_n,
            allowed: allowed_n,
            time_s: None,
        });
    }
}

/// Forces across the pull and torques, up to the label. Friction holds the vector sum, so a force `S` across a pull of `F` makes
/// the label too small by `sqrt(F^2 + S^2) - F`; a torque adds to it by its lever.
pub(super) fn across(evidence: &LabelEvidence<'_>, findings: &mut Vec<Finding>) {
    let rows = evidence.wrench;
    let unloaded: Vec<&WrenchRow> = rows.iter().filter(|row| row.time_s < 0.0).collect();
    let pulled: Vec<&WrenchRow> = rows.iter().filter(|row| row.time_s >= 0.0).collect();
    if pulled.len() < ROWS {
        return;
    }
    let zero = |of: &dyn Fn(&WrenchRow) -> f64| match unloaded.len() {
        n if n < ROWS => 0.0,
        n => unloaded.iter().map(|row| of(row)).sum::<f64>() / n as f64,
    };
    // Around the largest force: noise of single rows is averaged away.
    let most = (0..pulled.len()).max_by(|&a, &b| pulled[a].pull_n.total_cmp(&pulled[b].pull_n)).unwrap_or(0);
    let near = &pulled[most.saturating_sub(ROWS)..=most];
    let mean = |of: &dyn Fn(&WrenchRow) -> f64| {
        near.iter().map(|row| of(row)).sum::<f64>() / near.len() as f64 - zero(of)
    };
    let across_n = libm::hypot(mean(&|row| row.across_n[0]), mean(&|row| row.across_n[1]));
    let label_n = evidence.label_n;
    findings.push(Finding {
        kind: FindingKind::Lateral,
        found: libm::hypot(label_n, across_n),
        wanted: label_n,
        allowed: cap_n(label_n),
        time_s: Some(pulled[most].time_s),
    });
    // What of the torque is no constant lever of the pull, by least squares through the origin.
    let left_nm: Vec<f64> = (0..3)
        .map(|axis| {
            let rest_nm = zero(&|row| row.torque_nm[axis]);
            let (mut ff, mut fm) = (0.0, 0.0);
            for row in &pulled[..=most] {
                ff += row.pull_n * row.pull_n;
                fm += row.pull_n * (row.torque_nm[axis] - rest_nm);
            }
            let lever_m = if ff > 0.0 { fm / ff } else { 0.0 };
            mean(&|row| row.torque_nm[axis]) - lever_m * mean(&|row| row.pull_n)
        })
        .collect();
    findings.push(Finding {
        kind: FindingKind::Torque,
        found: left_nm.iter().map(|m| m * m).sum::<f64>().sqrt(),
        wanted: 0.0,
        allowed: TORQUE_NM,
        time_s: Some(pulled[most].time_s),
    });
}
