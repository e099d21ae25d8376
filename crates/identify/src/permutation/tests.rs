//! Tests of the permutation tests.

use super::*;

fn singles(n: usize) -> Vec<usize> {
    (0..n).collect()
}

fn white(n: usize, seed: u64) -> Vec<f64> {
    let mut draws = Draws::new(seed, 99);
    (0..n).map(|_| draws.normal()).collect()
}

/// A first-order autoregression with unit variance.
fn slow(n: usize, lag_one: f64, seed: u64) -> Vec<f64> {
    let mut x = 0.0;
    white(n, seed)
        .into_iter()
        .enumerate()
        .map(|(i, e)| {
            x = if i == 0 { e } else { lag_one * x + libm::sqrt(1.0 - lag_one * lag_one) * e };
            x
        })
        .collect()
}

#[test]
fn independent_values_give_uniform_p_values() {
    let mut low = 0;
    for seed in 0..400 {
        let found = dependence(
            &white(60, seed),
            &[],
            &Covariate::Number(white(60, seed + 1000)),
            &singles(60),
            199,
            seed,
        );
        low += u32::from(found.p_value <= 0.1);
    }
    // 40 expected, standard deviation 6.
    assert!((22..=58).contains(&low), "{low} of 400 below 0.1");
}

/// Curves, steps and word means are all seen, and their share of the variance is about right.
#[test]
fn dependences_of_any_shape_are_seen() {
    let (x, noise) = (white(300, 1), white(300, 2));
    let shapes: [fn(f64) -> f64; 4] =
        [|x| x, |x| x * x, |x| if x > 0.8 { 1.0 } else { 0.0 }, |x| (3.0 * x).tanh()];
    for (k, shape) in shapes.into_iter().enumerate() {
        let signal: Vec<f64> = x.iter().map(|&x| shape(x)).collect();
        let mean = signal.iter().sum::<f64>() / 300.0;
        let spread = libm::sqrt(signal.iter().map(|s| (s - mean) * (s - mean)).sum::<f64>() / 300.0);
        let residual: Vec<f64> = signal.iter().zip(&noise).map(|(s, e)| (s - mean) / spread + e).collect();
        let found = dependence(&residual, &[], &Covariate::Number(x.clone()), &singles(300), 999, 7);
        assert!(found.p_value <= 0.001, "shape {k}: {found:?}");
        assert!((0.38..0.62).contains(&found.strength), "shape {k}: {found:?}");
    }
    let words = Covariate::words((0..300).map(|i| ["a", "b", "c"][i % 3]));
    let residual: Vec<f64> = (0..300).map(|i| noise[i] + if i % 3 == 1 { 1.0 } else { 0.0 }).collect();
    let found = dependence(&residual, &[], &words, &singles(300), 999, 7);
    assert!(found.p_value <= 0.001 && (0.08..0.3).contains(&found.strength), "{found:?}");
}

/// Two slow signals that have nothing to do with each other: rows "find" a dependence, blocks do not.
#[test]
fn slow_signals_are_a_dependence_by_rows_and_none_by_blocks() {
    let (mut by_rows, mut by_blocks) = (0, 0);
    for seed in 0..100 {
        let residual = slow(600, 0.92, seed);
        let covariate = Covariate::Number(slow(600, 0.92, seed + 500));
        let blocks: Vec<usize> = (0..600).map(|i| i / 60).collect();
        by_rows += u32::from(dependence(&residual, &[], &covariate, &singles(600), 99, seed).p_value <= 0.05);
        by_blocks += u32::from(dependence(&residual, &[], &covariate, &blocks, 99, seed).p_value <= 0.05);
    }
    assert!(by_rows > 50, "{by_rows} of 100");
    assert!(by_blocks <= 12, "{by_blocks} of 100");
}

/// Events of several rows each: what is constant in an event counts once.
#[test]
fn events_of_unequal_length_count_once() {
    let mut false_alarms = 0;
    for seed in 0..200 {
        let mut draws = Draws::new(seed, 5);
        let (mut residual, mut covariate, mut blocks) = (Vec::new(), Vec::new(), Vec::new());
        for event in 0..25 {
            let (r, c) = (draws.normal(), draws.normal());
            for _ in 0..1 + draws.below(30) {
                residual.push(r + 0.1 * draws.normal());
                covariate.push(c);
                blocks.push(event);
            }
        }
        let found = dependence(&residual, &[], &Covariate::Number(covariate), &blocks, 99, seed);
        false_alarms += u32::from(found.p_value <= 0.05);
    }
    assert!(false_alarms <= 20, "{false_alarms} of 200, 10 expected");
}

#[test]
fn two_sessions_prove_nothing() {
    let residual: Vec<f64> = (0..100).map(|i| if i < 50 { 0.0 } else { 1.0 }).collect();
    let session: Vec<usize> = (0..100).map(|i| i / 50).collect();
    let covariate = Covariate::Word(session.iter().map(|&s| s as u32).collect());
    assert!(dependence(&residual, &[], &covariate, &session, 999, 1).p_value > 0.9);
}

#[test]
fn a_product_is_seen_beside_strong_main_effects_and_only_where_it_is() {
    let (a, b, noise) = (white(200, 1), white(200, 2), white(200, 3));
    let pair = (&Covariate::Number(a.clone()), &Covariate::Number(b.clone()));
    let main: Vec<f64> = (0..200).map(|i| 5.0 * a[i] + 3.0 * b[i].tanh() + 2.0 * a[i] * a[i]).collect();
    let without: Vec<f64> = (0..200).map(|i| main[i] + noise[i]).collect();
    let with: Vec<f64> = (0..200).map(|i| without[i] + a[i] * b[i]).collect();
    let nothing = interaction(&without, &[], pair, &singles(200), 499, 1);
    assert!(nothing.p_value > 0.05, "{nothing:?}");
    let found = interaction(&with, &[], pair, &singles(200), 499, 1);
    assert!(found.p_value <= 0.002 && found.strength > 0.2, "{found:?}");
    let words = Covariate::words((0..200).map(|i| if i % 2 == 0 { "old" } else { "new" }));
    let turned: Vec<f64> = (0..200).map(|i| noise[i] + if i % 2 == 0 { a[i] } else { -a[i] }).collect();
    assert!(interaction(&turned, &[], (&words, pair.0), &singles(200), 499, 1).p_value <= 0.002);
}

/// A point with little weight cannot make a dependence.
#[test]
fn weights_count() {
    let x = white(80, 1);
    let mut residual = white(80, 2);
    let mut weight = vec![1.0; 80];
    let top = (0..80).max_by(|&i, &j| x[i].total_cmp(&x[j])).unwrap();
    residual[top] = 100.0;
    weight[top] = 1e-6;
    let found = dependence(&residual, &weight, &Covariate::Number(x), &singles(80), 499, 1);
    assert!(found.p_value > 0.02, "{found:?}");
}

#[test]
fn what_cannot_be_tested_is_no_dependence() {
    let residual = white(20, 1);
    for covariate in [
        Covariate::Number(vec![2.0; 20]),
        Covariate::Number(vec![f64::NAN; 20]),
        Covariate::Word(vec![u32::MAX; 20]),
        Covariate::Number(white(19, 2)),
    ] {
        assert_eq!(dependence(&residual, &[], &covariate, &singles(20), 99, 1), Dependence::NONE);
    }
    let number = Covariate::Number(white(20, 2));
    assert_eq!(dependence(&residual, &[], &number, &[0; 20], 99, 1), Dependence::NONE);
    assert_eq!(dependence(&[0.0; 20], &[], &number, &singles(20), 99, 1).strength, 0.0);
    assert_eq!(dependence(&[], &[], &Covariate::Number(vec![]), &[], 99, 1), Dependence::NONE);
}

/// The example of Benjamini and Hochberg (1995, section 4): 15 comparisons, 4 rejected at 0.05.
#[test]
fn false_discoveries_are_controlled_as_in_the_paper() {
    let p = [
        0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.3240, 0.4262, 0.5719,
        0.6528, 0.7590, 1.0,
    ];
    assert_eq!(benjamini_hochberg(&p, 0.05).iter().filter(|&&s| s).count(), 4);
    // All p-values just below the rate are all significant; none of them is alone enough for Bonferroni.
    assert_eq!(benjamini_hochberg(&[0.04, 0.045, 0.03], 0.05), [true; 3]);
    assert!(benjamini_hochberg(&[], 0.05).is_empty());
}

/// Main effects of every shape, and no product.
#[test]
fn no_product_is_seen_where_there_is_none() {
    let mut low = 0;
    for seed in 0..200 {
        let (a, b, noise) = (white(120, seed), white(120, seed + 300), white(120, seed + 600));
        let residual: Vec<f64> =
            (0..120).map(|i| 4.0 * a[i] * a[i] + 3.0 * (2.0 * b[i]).tanh() + noise[i]).collect();
        let pair = (&Covariate::Number(a), &Covariate::Number(b));
        low += u32::from(interaction(&residual, &[], pair, &singles(120), 99, seed).p_value <= 0.05);
    }
    assert!(low <= 20, "{low} of 200, 10 expected");
}
