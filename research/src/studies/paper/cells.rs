//! Labels of repetitions, by part and grip force.

/// Repetitions of one part at one grip force.
pub struct Cell {
    pub grip_force_n: f64,
    pub labels_n: Vec<f64>,
}

impl Cell {
    pub fn mean_n(&self) -> f64 {
        self.labels_n.iter().sum::<f64>() / self.labels_n.len() as f64
    }

    /// Root mean square deviation from the mean.
    pub fn rms_n(&self) -> f64 {
        let mean = self.mean_n();
        let square: f64 = self.labels_n.iter().map(|l| (l - mean).powi(2)).sum();
        (square / self.labels_n.len() as f64).sqrt()
    }
}

/// All cells of a part.
pub struct PartCells {
    pub name: String,
    pub mu: f64,
    /// a and b (in N) of the paper's correction, where the twin has it.
    pub law: Option<(f64, f64)>,
    pub cells: Vec<Cell>,
}
