//! Whether residuals depend on a column, by permutation: what a curve has to pass before it is named.

use super::chosen::Waves;
use super::curves::Curve;
use super::data::{Column, PullData};
use super::fitting::Fitted;
use crate::draws::Draws;
use crate::permutation::{Covariate, Dependence, dependence, interaction};

/// Permutations of a test, and of one that looks at many frequencies each time.
const PERMUTATIONS: usize = 999;
const WAVE_PERMUTATIONS: usize = 299;

/// Correlation of neighbours from which on blocks of pulls are moved together, and their length.
const REMEMBERS: f64 = 0.25;
const BLOCK: usize = 5;

/// Tests residuals of `fitted` against the column, or the product of two, that a curve is in.
pub fn test(data: &PullData<'_>, fitted: &Fitted, residuals: &[f64], curve: &Curve) -> Dependence {
    let column = |name: &str| match data.columns.get(name) {
        Some(Column::Number(x)) => Covariate::Number(x.clone()),
        Some(Column::Word(at, _)) => Covariate::Word(at.iter().map(|&w| w as u32).collect()),
        None => Covariate::Number(vec![0.0; data.len()]),
    };
    // Neighbours that remember each other move together.
    let length = if fitted.likelihood.memory > REMEMBERS { BLOCK } else { 1 };
    let blocks: Vec<usize> = (0..data.len()).map(|i| i / length).collect();
    // Steps between words at one word of another column are tested there, where all of them are.
    let steps = curve.name.split_once('*').zip(curve.only.as_ref()).and_then(|((name, _), (other, word))| {
        let (Column::Word(steps, _), Column::Word(at, words)) =
            (data.columns.get(name)?, data.columns.get(other)?)
        else {
            return None;
        };
        let own: Vec<usize> = (0..data.len()).filter(|&i| words.get(at[i]) == Some(word)).collect();
        let residuals: Vec<f64> = own.iter().map(|&i| residuals[i]).collect();
        let steps = Covariate::Word(own.iter().map(|&i| steps[i] as u32).collect());
        let blocks: Vec<usize> = own.iter().map(|&i| blocks[i]).collect();
        Some(dependence(&residuals, &[], &steps, &blocks, PERMUTATIONS, 1))
    });
    if let Some(steps) = steps {
        return steps;
    }
    match curve.name.split_once('*') {
        Some((a, b)) => interaction(residuals, &[], (&column(a), &column(b)), &blocks, PERMUTATIONS, 1),
        None if curve.wave => {
            let at = data.numbers(&curve.name).unwrap_or_default();
            wave(&at, residuals, length)
        }
        None => dependence(residuals, &[], &column(&curve.name), &blocks, PERMUTATIONS, 1),
    }
}

/// Share of the variance that the best sine explains, and how often shuffled residuals have a better one.
fn wave(x: &[f64], residuals: &[f64], length: usize) -> Dependence {
    let Some(waves) = Waves::new(x) else { return Dependence { strength: 0.0, p_value: 1.0 } };
    let all: f64 = residuals.iter().map(|r| r * r).sum::<f64>().max(1e-300);
    let strength = waves.best(residuals).1 / all;
    let mut order: Vec<usize> = (0..residuals.len().div_ceil(length)).collect();
    let mut draws = Draws::new(17, 3);
    let mut better = 0;
    for _ in 0..WAVE_PERMUTATIONS {
        draws.shuffle(&mut order);
        let shuffled: Vec<f64> = order
            .iter()
            .flat_map(|&b| residuals[b * length..((b + 1) * length).min(residuals.len())].iter().copied())
            .collect();
        better += usize::from(waves.best(&shuffled).1 / all >= strength);
    }
    Dependence { strength, p_value: (better + 1) as f64 / (WAVE_PERMUTATIONS + 1) as f64 }
}
