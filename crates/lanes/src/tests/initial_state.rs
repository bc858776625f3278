//! Stage 6 by Stein's equation and by sorted QR.

use super::{UNIT, tested};
use crate::{Call, initial_state, lane, sorted_qr};
use asobench_identification::estimator::initial_state::{InitialState, TRACE_LIMIT};
use asobench_identification::estimator::{FailureKind, Window};
use asobench_identification::plant::{StateSpace, polynomial_from_poles, random_stable};
use asobench_identification::real::{Mask, Real};
use asobench_identification::signal::{Purpose, normal::fill_standard_normal, stream};
use faer::c64;

/// Computes a model's x0 by the lanes, and whether its normal equations were good enough.
struct StartOf<'a> {
    plant: &'a StateSpace,
    u: &'a [f64],
    y: &'a [f64],
    /// Whether to use sorted QR in any case.
    alone: bool,
}

impl Call for StartOf<'_> {
    type Output = Vec<(Result<Vec<f64>, FailureKind>, bool)>;

    fn with<R: Real, const N: usize>(self) -> Self::Output {
        let n = self.plant.order();
        let (a, h) = (
            crate::splat::<R, N>(self.plant.a()),
            crate::splat::<R, N>(&self.plant.h()),
        );
        let splat = |numbers: &[f64]| numbers.iter().map(|x| R::splat(*x)).collect::<Vec<R>>();
        let (u, y) = (splat(self.u), splat(self.y));
        let (x0, alone) = R::run(
            #[inline(always)]
            || initial_state::solve(n, &a, &h, &u, &y),
        );
        let of_lane = |l: usize| {
            let found = if self.alone || alone.lane(l) {
                initial_state::solve_alone(n, &a, &h, &u, &y, l, &mut Vec::new())
            } else {
                Ok(lane(&x0, l))
            };
            (found.map(|x0| x0[..n].to_vec()), !alone.lane(l))
        };
        (0..R::LANES).map(of_lane).collect()
    }
}

/// Returns the rows `c'A^k` of D.
fn rows(a: &[f64], count: usize) -> Vec<Vec<f64>> {
    let n = a.len();
    let mut row = vec![0.0; n];
    row[0] = 1.0;
    let next = |row: &Vec<f64>| -> Vec<f64> {
        let before = |i: usize| if i == 0 { 0.0 } else { row[i - 1] };
        (0..n).map(|i| before(i) + row[n - 1] * a[i]).collect()
    };
    let mut rows = Vec::with_capacity(count);
    for _ in 0..count {
        let following = next(&row);
        rows.push(std::mem::replace(&mut row, following));
    }
    rows
}

/// Stein's equation for `M = D'D` gives an x0 close to that of the normal equations as faer forms and solves them. The
/// difference is at most `|M^-1| (|dM| |x0| + |dr|)`, with `|M^-1| <= 1` because D begins with I.
///
/// - dM: an entry is a sum along its diagonal of at most n steps of 4 terms, each at most `(1 + |a|_inf)^2 trace` and
///   with a rounding error of n u. The last column's sums of K products add K u, because all their terms are positive
///   multiples of row sizes. In total: `(4n + K) u (1 + |a|_inf)^2 trace`. Both eliminations perturb M by
///   `4 n u trace`, which is less.
/// - dr: K u of the terms' sizes, and the difference in y_u, which is computed in another form. The latter is n + 2
///   roundings of the output's size at each sample. Each rounding propagates as the impulse response, whose sum of
///   absolute values is at most that of D's entries.
#[test]
fn the_initial_state_by_steins_equation_is_that_of_faer() {
    let mut served = 0;
    for order in [1, 2, 3, 4, 5, 6, 8, 12, 24] {
        for trial in 0..12 {
            let radius = [0.5, 0.8, 0.9, 0.95][trial as usize % 4];
            let plant = random_stable(order, radius, &mut stream(8, trial, Purpose::Plant));
            let samples = [3 * order + 2, 98 + 3 * order, 600][trial as usize / 4];
            let mut u = vec![0.0; samples];
            fill_standard_normal(&mut stream(8, trial, Purpose::Input), &mut u);
            let (mut y, mut states) = (vec![0.0; samples], vec![0.0; samples * order]);
            plant.simulate(&mut vec![1.0; order], &u, &mut y, &mut states);
            let mut f = vec![0.0; samples];
            fill_standard_normal(&mut stream(8, trial, Purpose::NoiseDrive), &mut f);
            y.iter_mut().zip(&f).for_each(|(y, f)| *y += 0.3 * f);

            let mut expected = vec![0.0; order];
            let window = Window::new(&u, &y, samples);
            let estimated = InitialState::new(order).estimate(plant.a(), plant.b(), window, &mut expected);
            assert_eq!(estimated, Ok(()));

            let rows = rows(plant.a(), samples);
            let size = |row: &Vec<f64>| row.iter().map(|x| x * x).sum::<f64>();
            let trace: f64 = rows.iter().map(size).sum();
            let sum: f64 = rows.iter().flatten().map(|x| x.abs()).sum();
            let largest = |numbers: &[f64]| numbers.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let (mut y_u, mut own) = (vec![0.0; samples], states);
            plant.simulate(&mut vec![0.0; order], &u, &mut y_u, &mut own);
            let residual = rows.iter().zip(y.iter().zip(&y_u));
            let residual: f64 = residual.map(|(row, (y, y_u))| size(row).sqrt() * (y - y_u).abs()).sum();
            let norm = expected.iter().map(|x| x * x).sum::<f64>().sqrt();
            let (n, k) = (order as f64, samples as f64);
            let state = largest(&own).max(largest(&y));
            let allowed = UNIT
                * (2.0 * (4.0 * n + k) * (1.0 + largest(plant.a())).powi(2) * trace * norm
                    + 2.0 * k * residual
                    + (n + 2.0) * state * sum * sum);
            for isa in tested() {
                let start = StartOf {
                    plant: &plant,
                    u: &u,
                    y: &y,
                    alone: false,
                };
                for (l, (found, direct)) in isa.dispatch(order, start).into_iter().enumerate() {
                    let name = format!("{isa}, order {order}, trial {trial}, lane {l}");
                    // Up to rounding the same rule.
                    if (trace / TRACE_LIMIT - 1.0).abs() > 1e-6 {
                        assert_eq!(direct, trace < TRACE_LIMIT, "{name}: {trace:e}");
                    }
                    served += usize::from(direct);
                    let found = found.expect("a start");
                    let error = found.iter().zip(&expected).map(|(x, y)| (x - y).powi(2));
                    let error = error.sum::<f64>().sqrt();
                    assert!(error <= allowed, "{name}: {error:e} > {allowed:e}, trace {trace:e}");
                }
            }
        }
    }
    assert!(served > 50);
}

/// Cases in which normal equations would lose every digit: an unstable plant and clustered poles. Cases and limits are
/// those of faer's sorted QR in tests/properties.rs.
#[test]
fn sorted_qr_gives_the_initial_state_back() {
    let model = |poles: &[f64], b: Vec<f64>| {
        let poles: Vec<c64> = poles.iter().map(|p| c64::new(*p, 0.0)).collect();
        let phi = polynomial_from_poles(&poles);
        StateSpace::new(phi.iter().rev().map(|phi| -phi.re).collect(), b).expect("a model")
    };
    let signal: Vec<f64> = (0..150).map(|k| f64::from((k * 13) % 7) - 3.0).collect();
    for (plant, u, limit) in [
        (model(&[1.1, 0.5, -0.3], vec![1.0, -0.5, 0.25]), signal.clone(), 1e-8),
        (model(&[0.95; 6], vec![0.1; 6]), vec![0.0; 300], 1e-6),
        (model(&[0.99; 4], vec![0.1; 4]), vec![0.0; 300], 1e-6),
        (model(&[0.99; 6], vec![0.1; 6]), vec![0.0; 300], 1e-6),
        // Well conditioned: the same x0 in another way.
        (model(&[0.5, -0.3], vec![1.0, 2.0]), signal, 1e-13),
    ] {
        let n = plant.order();
        let truth: Vec<f64> = (0..n).map(|i| 1.0 + i as f64).collect();
        let (mut y, mut states) = (vec![0.0; u.len()], vec![0.0; u.len() * n]);
        plant.simulate(&mut truth.clone(), &u, &mut y, &mut states);
        for isa in tested() {
            let start = StartOf {
                plant: &plant,
                u: &u,
                y: &y,
                alone: true,
            };
            for (found, _) in isa.dispatch(n, start) {
                let error = asobench_identification::metric::relative_error(&truth, &found.expect("a start"));
                assert!(error < limit, "{isa}, {:?}: {error:e}", plant.a());
            }
        }
    }
}

/// Rows over 200 powers of two with an exact solution in whole numbers. The residual of each row is a rounding of that
/// row (Cox and Higham 1998), so x is exact up to eps times the condition of the rows scaled to one size.
#[test]
fn sorted_qr_is_stable_row_by_row() {
    const N: usize = 4;
    let truth = [3.0, -1.0, 4.0, -2.0];
    let mut numbers = [0.0; 12 * N];
    fill_standard_normal(&mut stream(2, 2, Purpose::Input), &mut numbers);
    // Products and sums of whole numbers are exact.
    let whole = |x: f64| (x * 8.0).round();
    let mut problem: Vec<([f64; N], f64)> = Vec::new();
    for (k, entries) in numbers.chunks(N).enumerate() {
        let scale = 2.0_f64.powi(([7, 2, 11, 5, 0, 9, 3, 1, 10, 4, 8, 6][k] - 6) * 18);
        let row: [f64; N] = std::array::from_fn(|i| whole(entries[i]));
        let rhs: f64 = row.iter().zip(&truth).map(|(row, x)| row * x).sum();
        problem.push((row.map(|x| x * scale), rhs * scale));
    }
    let x = sorted_qr::solve(N, &mut problem.clone()).expect("a solution");
    // The condition of 12 random rows of 4 is below 100; growth and sums take m n = 48 roundings.
    let error = asobench_identification::metric::relative_error(&truth, &x);
    assert!(error < 100.0 * 48.0 * f64::EPSILON, "{error:e}");
    // Failures are typed, after pivoting too.
    let mut without: Vec<_> = problem
        .iter()
        .map(|(row, rhs)| ([row[0], 0.0, row[2], row[3]], *rhs))
        .collect();
    assert_eq!(sorted_qr::solve(N, &mut without), Err(FailureKind::RankDeficient));
    for bad in [f64::NAN, f64::INFINITY] {
        let mut wrong = problem.clone();
        wrong[5].0[1] = bad;
        assert_eq!(sorted_qr::solve(N, &mut wrong), Err(FailureKind::NonFinite));
        let mut wrong = problem.clone();
        wrong[7].1 = bad;
        assert_eq!(sorted_qr::solve(N, &mut wrong), Err(FailureKind::NonFinite));
    }
}
