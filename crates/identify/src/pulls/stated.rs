//! Fits through the simulator: what its labels lie above the fast prediction, and the fit that is stated and written.

use super::context::Context;
use super::fitting::Fitted;
use super::heldout::scatter;
use gripgen_twin::predict::PullModel;

impl Context<'_> {
    /// Learns what the simulator's labels lie above the fast prediction at a model: fits near it are fits through the simulator.
    pub fn correct_at(&mut self, model: &PullModel) {
        let fitted: Vec<usize> = (0..self.data.len()).filter(|&i| self.limit_of(i).is_none()).collect();
        self.correct_rows(model, &fitted);
    }

    fn correct_rows(&mut self, model: &PullModel, rows: &[usize]) {
        let exact = self.predictor.labels_n(model, rows);
        let fast = self.predictor.pulls(model, rows);
        for ((&row, exact_n), fast) in rows.iter().zip(exact).zip(fast) {
            self.above_fast_n[row] = exact_n - fast.label_n;
        }
    }

    /// Expected labels of the pulls at `rows`: the fast prediction and what the simulator said beyond it where the context was
    /// corrected.
    pub fn labels_n(&self, model: &PullModel, rows: &[usize]) -> Vec<f64> {
        let fast = self.predictor.pulls(model, rows);
        let above = rows.iter().map(|&i| self.above_fast_n[i] + model.misread_n);
        fast.iter().zip(above).map(|(p, above_n)| p.label_n + above_n).collect()
    }

    /// The fit as it is written into a twin: at labels of the simulator, and without a nuisance that no twin has.
    pub fn stated(&self, fitted: &Fitted) -> (Self, Fitted) {
        let mut context = self.clone();
        let rows: Vec<usize> = (0..self.data.len()).collect();
        let mut fitted = fitted.clone();
        fitted.terms.stated = true;
        fitted.model.misread_n = 0.0;
        // Scatter as it will be stated; pulls with traces too, whose labels are predicted although their slips are fitted.
        let mut model = fitted.model.clone();
        model.scatter = scatter(&model, fitted.likelihood.scale);
        context.correct_rows(&model, &rows);
        let found = context.fit_again(&fitted.model, &fitted.terms, &rows);
        (context, found.unwrap_or(fitted))
    }
}
