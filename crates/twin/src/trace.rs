//! The record of one pull over time.

/// Time series of one pull. All columns have the same length; time increases.
///
/// Forces are magnitudes along the pull in newtons (positive while the arm pulls), displacement is that of the
/// tool along the pull in metres, both counted from the start of the pull at time 0. Rows before time 0, where
/// there are any, are the no-load reading.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PullTrace {
    /// Time since the start of the pull.
    pub time_s: Vec<f64>,
    /// Commanded force.
    pub desired_force_n: Vec<f64>,
    /// Force reported by the wrist sensor.
    pub measured_force_n: Vec<f64>,
    /// Displacement of the tool.
    pub displacement_m: Vec<f64>,
}

/// One row of a [`PullTrace`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TraceRow {
    /// Time since the start of the pull.
    pub time_s: f64,
    /// Commanded force.
    pub desired_force_n: f64,
    /// Force reported by the wrist sensor.
    pub measured_force_n: f64,
    /// Displacement of the tool.
    pub displacement_m: f64,
}

impl PullTrace {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    /// Appends a row.
    pub fn push(&mut self, row: TraceRow) {
        self.time_s.push(row.time_s);
        self.desired_force_n.push(row.desired_force_n);
        self.measured_force_n.push(row.measured_force_n);
        self.displacement_m.push(row.displacement_m);
    }

    /// Row `i`.
    pub fn row(&self, i: usize) -> TraceRow {
        TraceRow {
            time_s: self.time_s[i],
            desired_force_n: self.desired_force_n[i],
            measured_force_n: self.measured_force_n[i],
            displacement_m: self.displacement_m[i],
        }
    }

    /// All rows in order.
    pub fn rows(&self) -> impl Iterator<Item = TraceRow> + '_ {
        (0..self.len()).map(|i| self.row(i))
    }

    /// The pull up to and including the first row at which the displacement exceeds `stop_m`.
    pub fn until_displacement(&self, stop_m: f64) -> PullTrace {
        let end = self.displacement_m.iter().position(|&d| d > stop_m).map_or(self.len(), |i| i + 1);
        PullTrace {
            time_s: self.time_s[..end].to_vec(),
            desired_force_n: self.desired_force_n[..end].to_vec(),
            measured_force_n: self.measured_force_n[..end].to_vec(),
            displacement_m: self.displacement_m[..end].to_vec(),
        }
    }
}

impl FromIterator<TraceRow> for PullTrace {
    fn from_iter<I: IntoIterator<Item = TraceRow>>(rows: I) -> Self {
        let mut trace = PullTrace::default();
        for row in rows {
            trace.push(row);
        }
        trace
    }
}
