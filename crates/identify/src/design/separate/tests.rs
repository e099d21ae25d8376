use super::*;
use crate::Draws;

const NOISE_N: f64 = 0.4;

fn candidates(n: usize) -> Vec<CandidatePull> {
    vec![CandidatePull { noise_n: NOISE_N, minutes: 1.0 }; n]
}

fn rival(predicted: Vec<f64>, columns: &[Vec<f64>], information: f64) -> SeparableRival {
    let n = predicted.len();
    SeparableRival {
        weight: 0.5,
        predicted_n: DVector::from_vec(predicted),
        jacobian: DMatrix::from_fn(n, columns.len(), |i, j| columns[j][i]),
        information: DMatrix::identity(columns.len(), columns.len()) * information,
    }
}

/// A line through the origin against a constant, nothing known of either: the constant is refitted to the mean, so that T
/// is the sum of squares about it, and the best pulls are the two ends in turn. The line is refitted to the constant with
/// T = c^2 (n - (sum x)^2 / sum x^2).
#[test]
fn a_line_and_a_constant_have_their_closed_form() {
    let x: Vec<f64> = (1..=10).map(f64::from).collect();
    let line = rival(x.clone(), std::slice::from_ref(&x), 1e-7);
    let constant = rival(vec![5.5; 10], &[vec![1.0; 10]], 1e-7);
    let plan = plan_separating(&candidates(10), &[line, constant], 8, 1e9).unwrap();
    assert_eq!(plan.pulls.len(), 8);
    let chosen: Vec<f64> = plan.pulls.iter().map(|&i| x[i]).collect();
    let at_ends = chosen.iter().filter(|&&x| x == 1.0 || x == 10.0).count();
    assert!(at_ends >= 7, "{chosen:?}");
    let n = chosen.len() as f64;
    let (sum, squares) = (chosen.iter().sum::<f64>(), chosen.iter().map(|x| x * x).sum::<f64>());
    let about_the_mean = (squares - sum * sum / n) / (NOISE_N * NOISE_N);
    let about_the_line = 5.5 * 5.5 * (n - sum * sum / squares) / (NOISE_N * NOISE_N);
    let t = plan.separation[0].2;
    let wanted = about_the_mean.min(about_the_line);
    assert!((t / wanted - 1.0).abs() < 1e-4, "{t} against {wanted}");
}

/// T with the information of old data is the minimum that its definition says, found by solving the normal equations.
#[test]
fn the_criterion_is_the_minimum_over_the_refit() {
    let mut draws = Draws::new(3, 0);
    let n = 12;
    let mut numbers = |n: usize| (0..n).map(|_| draws.normal()).collect::<Vec<f64>>();
    let a = rival(numbers(n), &[numbers(n), numbers(n)], 2.0);
    let b = rival(numbers(n), &[numbers(n), numbers(n), numbers(n)], 0.7);
    let plan = plan_separating(&candidates(n), &[a.clone(), b.clone()], 5, 1e9).unwrap();
    let criterion = |truth: &SeparableRival, other: &SeparableRival| {
        let rows = plan.pulls.len();
        let weight = 1.0 / (NOISE_N * NOISE_N);
        let d = DVector::from_fn(rows, |k, _| {
            truth.predicted_n[plan.pulls[k]] - other.predicted_n[plan.pulls[k]]
        });
        let j = DMatrix::from_fn(rows, other.jacobian.ncols(), |k, c| other.jacobian[(plan.pulls[k], c)]);
        let normal = &other.information + weight * j.transpose() * &j;
        let step = normal.lu().solve(&(weight * j.transpose() * &d)).unwrap();
        let left = &d - &j * &step;
        weight * left.dot(&left) + step.dot(&(&other.information * &step))
    };
    let wanted = criterion(&a, &b).min(criterion(&b, &a));
    assert!((plan.separation[0].2 / wanted - 1.0).abs() < 1e-6, "{} {wanted}", plan.separation[0].2);
}

/// A pull that tells twice as much is not worth five times the minutes.
#[test]
fn minutes_count() {
    let line = |scale: f64| rival(vec![0.1 * scale, 0.2 * scale], &[vec![0.0, 0.0]], 1.0);
    let mut pulls = candidates(2);
    let rivals = [line(0.0), line(1.0)];
    assert_eq!(plan_separating(&pulls, &rivals, 1, 100.0).unwrap().pulls, [1]);
    pulls[1].minutes = 5.0;
    let plan = plan_separating(&pulls, &rivals, 3, 100.0).unwrap();
    assert_eq!((plan.pulls, plan.minutes), (vec![0; 3], 3.0));
}

#[test]
fn it_stops_when_all_are_apart_or_none_can_be() {
    let level = |y: f64| rival(vec![y, 2.0 * y], &[vec![0.0, 0.0]], 1.0);
    let plan = plan_separating(&candidates(2), &[level(0.0), level(1.0)], 50, 16.0).unwrap();
    assert_eq!(plan.pulls, [1], "one pull is 25 noise variances");
    let same = plan_separating(&candidates(2), &[level(1.0), level(1.0)], 50, 16.0).unwrap();
    assert!(same.pulls.is_empty() && same.separation == [(0, 1, 0.0)]);
    let three = plan_separating(&candidates(2), &[level(0.0), level(1.0), level(1.5)], 50, 16.0).unwrap();
    assert!(three.separation.iter().all(|s| s.2 >= 16.0), "{three:?}");
    assert_eq!(three.separation.len(), 3);
}

#[test]
fn what_cannot_be_planned_is_refused() {
    let good = || rival(vec![0.0, 1.0], &[vec![1.0, 1.0]], 1.0);
    let message = |pulls: &[CandidatePull], rivals: &[SeparableRival]| {
        plan_separating(pulls, rivals, 5, 9.0).unwrap_err().to_string()
    };
    assert!(message(&candidates(2), &[good()]).contains("1 rivals"));
    assert!(message(&candidates(3), &[good(), good()]).contains("`predicted_n` has 2 rows"));
    assert!(
        message(&candidates(2), &[good(), SeparableRival { weight: 0.0, ..good() }])
            .contains("weight of rival 1 is 0")
    );
    let free = [CandidatePull { noise_n: 1.0, minutes: 0.0 }; 2];
    assert!(message(&free, &[good(), good()]).contains("minutes of candidate 0 is 0"));
    let mut odd = good();
    odd.predicted_n[0] = f64::NAN;
    assert!(message(&candidates(2), &[good(), odd]).contains("not a number"));
    let negative = SeparableRival { information: DMatrix::from_element(1, 1, -1.0), ..good() };
    assert!(message(&candidates(2), &[good(), negative]).contains("rival 1: its information"));
    assert!(
        plan_separating(&[], &[rival(vec![], &[vec![]], 1.0), rival(vec![], &[vec![]], 1.0)], 5, 9.0)
            .unwrap()
            .pulls
            .is_empty()
    );
}

/// The classic tie: an offset against a power law, both fitted to pulls from 20 to 80 N (4 % apart at most there). The
/// pulls that are planned separate them with half of those that are drawn at random, or fewer.
#[test]
fn planned_pulls_separate_sooner_than_random_ones() {
    let forces: Vec<f64> = vec![5.0, 8.0, 12.0, 20.0, 30.0, 45.0, 60.0, 80.0];
    let noise = |f: f64| (0.3f64.powi(2) + (0.04 * 0.33 * f).powi(2)).sqrt();
    // F = 2 mu f + F0, with F0 = 1 N; and F = k f^(1 + n), fitted to it on the old pulls.
    let old = [20.0, 30.0, 45.0, 60.0, 80.0];
    let offset = |f: f64| 0.33 * f + 1.0;
    let (mut k, mut n) = (0.4, -0.05);
    for _ in 0..50 {
        let columns = |f: f64| (f.powf(1.0 + n), k * f.powf(1.0 + n) * f.ln());
        let (mut normal, mut right) = (DMatrix::<f64>::zeros(2, 2), DVector::<f64>::zeros(2));
        for f in old {
            let (a, b) = columns(f);
            let (j, w) = (DVector::from_vec(vec![a, b]), 1.0 / noise(f).powi(2));
            normal += w * &j * j.transpose();
            right += w * (offset(f) - k * f.powf(1.0 + n)) * &j;
        }
        let step = normal.lu().solve(&right).unwrap();
        k += step[0];
        n += step[1];
    }
    let law = |f: f64| k * f.powf(1.0 + n);
    let worst = old.iter().map(|&f| (law(f) / offset(f) - 1.0).abs()).fold(0.0, f64::max);
    assert!(worst < 0.02, "a tie on the old pulls: {worst}");
    let information = |columns: &dyn Fn(f64) -> [f64; 2]| {
        // Each of the old levels was pulled ten times.
        old.iter().fold(DMatrix::zeros(2, 2), |sum, &f| {
            let j = DVector::from_column_slice(&columns(f));
            sum + 10.0 / noise(f).powi(2) * &j * j.transpose()
        })
    };
    let build = |predict: &dyn Fn(f64) -> f64, columns: &dyn Fn(f64) -> [f64; 2]| SeparableRival {
        weight: 0.5,
        predicted_n: DVector::from_fn(8, |i, _| predict(forces[i])),
        jacobian: DMatrix::from_fn(8, 2, |i, c| columns(forces[i])[c]),
        information: information(columns),
    };
    let rivals =
        [build(&offset, &|f| [f, 1.0]), build(&law, &|f| [f.powf(1.0 + n), k * f.powf(1.0 + n) * f.ln()])];
    let pulls: Vec<CandidatePull> =
        forces.iter().map(|&f| CandidatePull { noise_n: noise(f), minutes: 1.0 }).collect();
    let plan = plan_separating(&pulls, &rivals, 200, 1e9).unwrap();
    assert!(plan.pulls[..4].iter().all(|&i| forces[i] < 10.0), "{:?}", &plan.pulls[..4]);
    let mut needed = [Vec::new(), Vec::new()];
    for seed in 0..60 {
        let mut draws = Draws::new(11, seed);
        let random: Vec<usize> = (0..200).map(|_| draws.below(8)).collect();
        for (order, needed) in [&plan.pulls, &random].into_iter().zip(&mut needed) {
            needed.push(pulls_until_decided(order, &rivals, &pulls, &mut Draws::new(12, seed)));
        }
    }
    let median = |n: &mut Vec<usize>| {
        n.sort_unstable();
        n[n.len() / 2]
    };
    let (planned, random) = (median(&mut needed[0]), median(&mut needed[1]));
    println!("pulls until 20 : 1: planned {planned}, random {random}");
    assert!(2 * planned <= random, "{planned} against {random}");
}

/// Pulls of the first rival, with noise, until the evidence against the refitted second one is 20 : 1.
fn pulls_until_decided(
    order: &[usize],
    rivals: &[SeparableRival],
    candidates: &[CandidatePull],
    draws: &mut Draws,
) -> usize {
    // Both follow the data: the sum of squares of each after its own refit.
    let mut follow: Vec<(DMatrix<f64>, DVector<f64>, f64)> =
        rivals.iter().map(|r| (r.information.clone(), DVector::zeros(r.jacobian.ncols()), 0.0)).collect();
    for (made, &i) in order.iter().enumerate() {
        let noise = candidates[i].noise_n;
        let measured = rivals[0].predicted_n[i] + noise * draws.normal();
        for (rival, (normal, right, squares)) in rivals.iter().zip(&mut follow) {
            let j = rival.jacobian.row(i).transpose();
            let d = measured - rival.predicted_n[i];
            *squares += d * d / noise.powi(2);
            *right += &j * (d / noise.powi(2));
            *normal += &j * j.transpose() / noise.powi(2);
        }
        let misfit = |(normal, right, squares): &(DMatrix<f64>, DVector<f64>, f64)| {
            squares - right.dot(&normal.clone().lu().solve(right).unwrap())
        };
        if misfit(&follow[1]) - misfit(&follow[0]) > 2.0 * 20f64.ln() {
            return made + 1;
        }
    }
    order.len() + 1
}
