//! The kernels against faer's solvers and against exact solutions.

#![allow(
    clippy::print_stdout,
    reason = "a test may say how near its bound it came"
)]

use super::information::Information;
use super::partitioned::{self, Triangles};
use super::{Call, Isa, initial_state, lane, sorted_qr};
use crate::estimator::initial_state::{InitialState, TRACE_LIMIT};
use crate::estimator::solver::{Instruments, Solution};
use crate::estimator::{FailureKind, Shape, Solver, Stage10, Window};
use crate::plant::{StateSpace, polynomial_from_poles, random_stable};
use crate::real::{MOST_LANES, Mask, Real};
use crate::signal::{Purpose, normal::fill_standard_normal, stream};
use faer::{Mat, c64};

/// Half an ulp of 1, which bounds a rounding.
const UNIT: f64 = f64::EPSILON / 2.0;

/// The widths of this machine, of those that `ASOBENCH_LANES` lists (all without it): valgrind has no AVX-512.
pub(super) fn tested() -> Vec<Isa> {
    let asked = std::env::var("ASOBENCH_LANES").ok();
    let asked = |isa: &Isa| match &asked {
        None => true,
        Some(list) => list.split(',').any(|name| name == isa.name()),
    };
    let all = Isa::ALL.iter().copied();
    let tested: Vec<Isa> = all.filter(|isa| isa.is_here() && asked(isa)).collect();
    assert!(!tested.is_empty());
    tested
}

/// Records of a random plant: u, y with noise, and instruments yhat without.
struct Record {
    u: Vec<f64>,
    y: Vec<f64>,
    yhat: Vec<f64>,
}

impl Record {
    fn new(order: usize, trial: u64, samples: usize, noise: f64) -> Self {
        let plant = random_stable(order, 0.8, &mut stream(4, trial, Purpose::Plant));
        let mut u = vec![0.0; samples];
        fill_standard_normal(&mut stream(4, trial, Purpose::Input), &mut u);
        let (mut yhat, mut states) = (vec![0.0; samples], vec![0.0; samples * order]);
        plant.simulate(&mut vec![1.0; order], &u, &mut yhat, &mut states);
        let mut f = vec![0.0; samples];
        fill_standard_normal(&mut stream(4, trial, Purpose::NoiseDrive), &mut f);
        let y = yhat.iter().zip(&f).map(|(y, f)| y + noise * f).collect();
        Self { u, y, yhat }
    }

    fn window(&self) -> Window<'_> {
        Window::new(&self.u, &self.y, self.u.len())
    }
}

/// The records' samples, lane by lane.
fn packed<R: Real>(records: &[Record], part: impl Fn(&Record) -> &[f64]) -> Vec<R> {
    let of = |k: usize| {
        R::load(&std::array::from_fn::<f64, MOST_LANES, _>(|l| {
            part(&records[l])[k]
        }))
    };
    (0..part(&records[0]).len()).map(of).collect()
}

/// What the lanes make of a record.
struct Solved {
    /// G by rows, and r.
    g: Mat<f64>,
    r: Vec<f64>,
    /// p; of lanes that are not safe by [`partitioned::solve_alone`], of others not finite where a number is not.
    p: Result<Vec<f64>, FailureKind>,
    condition: f64,
    /// Whether the lane was safe without pivots.
    safe: bool,
}

/// Solves all records at once.
struct Solve<'a> {
    order: usize,
    records: &'a [Record],
    instruments: bool,
    with_condition: bool,
}

impl Call for Solve<'_> {
    type Output = Vec<Solved>;

    fn with<R: Real, const N: usize>(self) -> Vec<Solved> {
        let n = self.order;
        let [u, y, yhat] = [
            packed::<R>(self.records, |record| &record.u),
            packed::<R>(self.records, |record| &record.y),
            packed::<R>(self.records, |record| &record.yhat),
        ];
        let mut information = Information::<R, N>::new(n);
        let mut triangles = Triangles::<R, N>::new();
        let (solved, alone) = R::run(
            #[inline(always)]
            || {
                information.least_squares(&u, &y);
                if self.instruments {
                    information.instruments(&u, &y, &yhat);
                }
                triangles.eliminate_input(&information);
                partitioned::solve(&information, &mut triangles, self.with_condition)
            },
        );
        let of_lane = |l: usize| {
            let of = information.lane(l);
            let entry = |i: usize, j: usize| of.g[2 * (i / n) + j / n][i % n][j % n];
            let (p, condition) = if alone.lane(l) {
                partitioned::solve_alone(&information, l)
            } else {
                let p = [lane(&solved.p[0], l), lane(&solved.p[1], l)];
                (Ok(p), solved.condition.lane(l))
            };
            let p = p.map(|[alpha, beta]| [&alpha[..n], &beta[..n]].concat());
            let finite = |p: Vec<f64>| {
                let finite = p.iter().all(|x| x.is_finite());
                finite.then_some(p).ok_or(FailureKind::NonFinite)
            };
            Solved {
                g: Mat::from_fn(2 * n, 2 * n, entry),
                r: [&of.r[0][..n], &of.r[1][..n]].concat(),
                p: p.and_then(finite),
                condition,
                safe: !alone.lane(l),
            }
        };
        (0..R::LANES).map(of_lane).collect()
    }
}

/// p and condition of faer's partitioned inverse.
fn by_faer(
    order: usize,
    record: &Record,
    instruments: bool,
) -> (Result<Vec<f64>, FailureKind>, f64) {
    let shape = Shape {
        order,
        window: record.u.len(),
    };
    let solver = Solver::Partitioned.instruments(shape, Stage10::Corrected);
    let (mut solver, mut solution) = (solver.expect("a solver"), Solution::new(order));
    let mut solved = solver.least_squares(record.window(), &mut solution);
    if instruments {
        solution.condition = f64::NAN;
        let yhat = Instruments::new(&record.yhat);
        solved = solver.instruments(record.window(), yhat, &mut solution);
    }
    (solved.map(|()| solution.p), solution.condition)
}

/// `|L| |U|` of Gaussian elimination without pivots that begins with G22.
fn triangles(g: &Mat<f64>) -> Mat<f64> {
    let m = g.nrows();
    let turned = |of: &Mat<f64>| Mat::from_fn(m, m, |i, j| of[((i + m / 2) % m, (j + m / 2) % m)]);
    let (mut u, mut l) = (turned(g), Mat::<f64>::identity(m, m));
    for k in 0..m {
        for i in k + 1..m {
            l[(i, k)] = u[(i, k)] / u[(k, k)];
            for j in k..m {
                u[(i, j)] -= l[(i, k)] * u[(k, j)];
            }
            u[(i, k)] = 0.0;
        }
    }
    let absolute = |of: &Mat<f64>| Mat::from_fn(m, m, |i, j| of[(i, j)].abs());
    turned(&(absolute(&l) * absolute(&u)))
}

/// Elimination is as backward stable as elimination is (Higham 2002, Theorem 9.4, m = 2n unknowns):
/// `|G p - r| <= 3m u |L| |U| |p|`, here 4m, since a pivot's reciprocal rounds once more, twice for what the triangles of
/// this test differ by; and rounding of the residual itself, `(m + 2) u (|G| |p| + |r|)`.
///
/// The parameters agree with faer's as the solvers agree among themselves (tests/properties.rs), 1e3 eps times the
/// condition number; the condition numbers, made of inverses that are that accurate, to the same.
#[test]
fn elimination_is_backward_stable_and_agrees_with_faer() {
    for order in [1, 2, 3, 4, 5, 6, 8, 12, 24] {
        for (round, noise) in [(0, 0.1), (1, 1.0), (2, 1e-3)] {
            let samples = 5 * order + 30;
            let of =
                |l: u64| Record::new(order, 100 * round + 8 * order as u64 + l, samples, noise);
            let records: Vec<Record> = (0..MOST_LANES as u64).map(of).collect();
            for (instruments, with_condition) in
                [(false, false), (false, true), (true, false), (true, true)]
            {
                for isa in tested() {
                    let solve = Solve {
                        order,
                        records: &records,
                        instruments,
                        with_condition,
                    };
                    for (l, found) in isa.dispatch(order, solve).iter().enumerate() {
                        let name =
                            format!("{isa}, order {order}, lane {l}, noise {noise}, {instruments}");
                        let (expected, condition) = by_faer(order, &records[l], instruments);
                        let allowed = 1e3 * f64::EPSILON * condition;
                        match (&found.p, &expected) {
                            (Ok(p), Ok(expected)) => {
                                if found.safe {
                                    check_backward_error(found, p, &name);
                                }
                                let error = crate::metric::relative_error(expected, p);
                                assert!(error <= allowed, "{name}: {error:e} > {allowed:e}");
                            }
                            (found, expected) => assert_eq!(
                                found.as_ref().err(),
                                expected.as_ref().err(),
                                "{name}: {condition:e}"
                            ),
                        }
                        if with_condition {
                            let error = (found.condition / condition - 1.0).abs();
                            assert!(
                                error <= allowed,
                                "{name}: {:e} for {condition:e}",
                                found.condition
                            );
                        } else {
                            assert!(found.condition.is_nan() || !found.safe, "{name}");
                        }
                    }
                }
            }
        }
    }
}

/// The backward error, row by row.
fn check_backward_error(found: &Solved, p: &[f64], name: &str) {
    let m = p.len();
    let sizes = triangles(&found.g);
    for i in 0..m {
        let row = |j: usize| found.g[(i, j)] * p[j];
        let residual = (0..m).map(row).sum::<f64>() - found.r[i];
        let size = |of: &Mat<f64>| (0..m).map(|j| (of[(i, j)] * p[j]).abs()).sum::<f64>();
        let (own, elimination) = (size(&found.g) + found.r[i].abs(), size(&sizes));
        let allowed = UNIT * ((m + 2) as f64 * own + 8.0 * m as f64 * elimination);
        assert!(
            residual.abs() <= allowed,
            "{name}: row {i}, {residual:e} > {allowed:e}"
        );
    }
}

/// One record in the lane after regular ones.
fn solve_one(order: usize, record: &Record, instruments: bool, with_condition: bool) {
    let (expected, condition) = by_faer(order, record, instruments);
    let samples = record.u.len();
    for isa in tested() {
        let mut records: Vec<Record> = (0..MOST_LANES as u64)
            .map(|l| Record::new(order, 900 + l, samples, 0.1))
            .collect();
        let at = if isa == Isa::Portable { 0 } else { 3 };
        records[at] = Record {
            u: record.u.clone(),
            y: record.y.clone(),
            yhat: record.yhat.clone(),
        };
        let solve = Solve {
            order,
            records: &records,
            instruments,
            with_condition,
        };
        let solved = isa.dispatch(order, solve);
        let found = &solved[at];
        assert_eq!(
            found.p.as_ref().err(),
            expected.as_ref().err(),
            "{isa}, condition {:e} for {condition:e}",
            found.condition
        );
        for (l, other) in solved.iter().enumerate().filter(|(l, _)| *l != at) {
            assert!(other.p.is_ok(), "{isa}, lane {l}: {:?}", other.p);
        }
    }
}

/// The failure of a matrix that cannot be solved is faer's, and its neighbours are solved.
#[test]
fn failures_are_those_of_faer() {
    let u: Vec<f64> = (0..60)
        .map(|k| f64::from((k * k * 7 + k) % 11) - 5.0)
        .collect();
    let mut y = vec![0.3];
    for k in 0..59 {
        y.push(0.5 * y[k] + u[k]);
    }
    let zeros = vec![0.0; 60];
    let changed = |of: &[f64], k: usize, x: f64| {
        let mut of = of.to_vec();
        of[k] = x;
        of
    };
    let record = |u: &[f64], y: &[f64], yhat: &[f64]| Record {
        u: u.to_vec(),
        y: y.to_vec(),
        yhat: yhat.to_vec(),
    };
    let plain = Record::new(2, 1, 60, 0.3);
    for with_condition in [false, true] {
        for (order, instruments, record) in [
            // Columns of order 2 are dependent.
            (2, false, record(&u, &y, &y)),
            (3, false, record(&u, &y, &y)),
            // Zero rows and columns.
            (2, false, record(&u, &zeros, &zeros)),
            (2, false, record(&zeros, &plain.y, &zeros)),
            (2, false, record(&zeros, &zeros, &zeros)),
            (1, false, record(&zeros, &plain.y, &zeros)),
            (2, true, record(&plain.u, &plain.y, &zeros)),
            // Constant input: a singular G22.
            (2, false, record(&[1.0; 60], &plain.y, &zeros)),
            // Values that are not finite, and sums that overflow.
            (
                2,
                false,
                record(&plain.u, &changed(&plain.y, 30, f64::INFINITY), &zeros),
            ),
            (
                2,
                false,
                record(&plain.u, &changed(&plain.y, 59, f64::NAN), &zeros),
            ),
            (
                2,
                false,
                record(&changed(&plain.u, 0, f64::NEG_INFINITY), &plain.y, &zeros),
            ),
            (
                2,
                false,
                record(&changed(&plain.u, 57, f64::NAN), &plain.y, &zeros),
            ),
            (
                2,
                false,
                record(&plain.u, &changed(&plain.y, 20, 1e160), &zeros),
            ),
            (
                2,
                false,
                record(&changed(&plain.u, 20, 1e160), &plain.y, &zeros),
            ),
            (
                2,
                true,
                record(&plain.u, &plain.y, &changed(&plain.yhat, 20, f64::NAN)),
            ),
            (
                2,
                true,
                record(&plain.u, &plain.y, &changed(&plain.yhat, 20, 1e308)),
            ),
            // Numbers so small that products vanish.
            (
                2,
                false,
                record(
                    &plain.u,
                    &plain.y.iter().map(|y| y * 1e-200).collect::<Vec<_>>(),
                    &zeros,
                ),
            ),
            // Regular ones, for comparison.
            (2, false, record(&plain.u, &plain.y, &zeros)),
            (2, true, record(&plain.u, &plain.y, &plain.yhat)),
        ] {
            solve_one(order, &record, instruments, with_condition);
        }
    }
}

/// A singular G11 in a regular matrix: its inverse, which the condition number is made of, fails as faer's does; the
/// elimination, which begins with G22, does not.
#[test]
fn a_singular_block_in_a_regular_matrix() {
    // Instruments of which G11 = 0: tests/properties.rs.
    let lagged = |a: &[f64], b: &[f64]| (0..59).map(|k| a[k] * b[k]).sum::<f64>();
    let first = Record::new(1, 5, 60, 0.3);
    let c = lagged(&first.u, &first.y) / lagged(&first.y, &first.y);
    let orthogonal: Vec<f64> = first
        .u
        .iter()
        .zip(&first.y)
        .map(|(u, y)| u - c * y)
        .collect();
    let records = [(); MOST_LANES].map(|()| Record {
        u: first.u.clone(),
        y: first.y.clone(),
        yhat: orthogonal.clone(),
    });
    solve_one(1, &records[0], true, true);
    for isa in tested() {
        let solve = Solve {
            order: 1,
            records: &records,
            instruments: true,
            with_condition: false,
        };
        let solved = isa.dispatch(1, solve).swap_remove(0);
        let p = solved.p.clone().expect("a solution");
        check_backward_error(&solved, &p, isa.name());
    }
}

/// Wherever faer's condition number breaks the rank rule, the lane is not safe: neither the bound that stands for it nor
/// half the rule's limit hides that.
#[test]
fn no_rank_deficient_matrix_is_safe() {
    let mut deficient = 0;
    for order in [1, 2, 3, 6, 12] {
        for power in 0..24 {
            // Noise-free records of order n - 1 with a little noise: conditions from 1 to the end.
            let noise = 0.1_f64.powi(power);
            let of = |l: u64| Record::new(order.max(2) - 1, 500 + l, 8 * order + 20, noise);
            let records: Vec<Record> = (0..MOST_LANES as u64).map(of).collect();
            for isa in tested() {
                let solve = Solve {
                    order,
                    records: &records,
                    instruments: false,
                    with_condition: false,
                };
                for (found, record) in isa.dispatch(order, solve).iter().zip(&records) {
                    let (expected, condition) = by_faer(order, record, false);
                    if expected.is_err() {
                        deficient += 1;
                        assert!(!found.safe, "{isa}, order {order}: {condition:e}");
                    }
                }
            }
        }
    }
    assert!(deficient > 100, "{deficient}");
}

/// The model's x0 by the lanes, and whether its normal equations served.
struct StartOf<'a> {
    plant: &'a StateSpace,
    u: &'a [f64],
    y: &'a [f64],
    /// By sorted QR in any case.
    alone: bool,
}

impl Call for StartOf<'_> {
    type Output = Vec<(Result<Vec<f64>, FailureKind>, bool)>;

    fn with<R: Real, const N: usize>(self) -> Self::Output {
        let n = self.plant.order();
        let (a, h) = (
            super::splat::<R, N>(self.plant.a()),
            super::splat::<R, N>(&self.plant.h()),
        );
        let splat = |of: &[f64]| of.iter().map(|x| R::splat(*x)).collect::<Vec<R>>();
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

/// Rows `c'A^k` of D.
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

/// Stein's equation for `M = D'D`: x0 differs from the solution of the normal equations as faer forms and solves them
/// by at most `|M^-1| (|dM| |x0| + |dr|)`, where `|M^-1| <= 1` since D begins with I.
///
/// - dM: an entry is a sum along its diagonal of at most n steps of 4 terms, each at most `(1 + |a|_inf)^2 trace`, with
///   an error of n u of each from the last column's sums of K products, where all terms are positive multiples of row
///   sizes: `(4n + K) u (1 + |a|_inf)^2 trace`. Both eliminations perturb M by `4 n u trace`, less than that.
/// - dr: K u of the terms' sizes; and what y_u differs by, which is computed in another form: n + 2 roundings of the
///   output's size at each sample, each of which goes on as the impulse response, whose sum of sizes is at most that of
///   D's entries.
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
            let estimated =
                InitialState::new(order).estimate(plant.a(), plant.b(), window, &mut expected);
            assert_eq!(estimated, Ok(()));

            let rows = rows(plant.a(), samples);
            let size = |row: &Vec<f64>| row.iter().map(|x| x * x).sum::<f64>();
            let trace: f64 = rows.iter().map(size).sum();
            let sum: f64 = rows.iter().flatten().map(|x| x.abs()).sum();
            let largest = |of: &[f64]| of.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let (mut y_u, mut own) = (vec![0.0; samples], states);
            plant.simulate(&mut vec![0.0; order], &u, &mut y_u, &mut own);
            let residual = rows.iter().zip(y.iter().zip(&y_u));
            let residual: f64 = residual
                .map(|(row, (y, y_u))| size(row).sqrt() * (y - y_u).abs())
                .sum();
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
                    // To rounding the same rule.
                    if (trace / TRACE_LIMIT - 1.0).abs() > 1e-6 {
                        assert_eq!(direct, trace < TRACE_LIMIT, "{name}: {trace:e}");
                    }
                    served += usize::from(direct);
                    let found = found.expect("a start");
                    let error = found.iter().zip(&expected).map(|(x, y)| (x - y).powi(2));
                    let error = error.sum::<f64>().sqrt();
                    assert!(
                        error <= allowed,
                        "{name}: {error:e} > {allowed:e}, trace {trace:e}"
                    );
                }
            }
        }
    }
    assert!(served > 50);
}

/// Where normal equations would lose every digit: the cases, and the limits, of faer's sorted QR in
/// tests/properties.rs, an unstable plant and clustered poles.
#[test]
fn sorted_qr_gives_the_initial_state_back() {
    let model = |poles: &[f64], b: Vec<f64>| {
        let poles: Vec<c64> = poles.iter().map(|p| c64::new(*p, 0.0)).collect();
        let phi = polynomial_from_poles(&poles);
        StateSpace::new(phi.iter().rev().map(|phi| -phi.re).collect(), b).expect("a model")
    };
    let signal: Vec<f64> = (0..150).map(|k| f64::from((k * 13) % 7) - 3.0).collect();
    for (plant, u, limit) in [
        (
            model(&[1.1, 0.5, -0.3], vec![1.0, -0.5, 0.25]),
            signal.clone(),
            1e-8,
        ),
        (model(&[0.95; 6], vec![0.1; 6]), vec![0.0; 300], 1e-6),
        (model(&[0.99; 4], vec![0.1; 4]), vec![0.0; 300], 1e-6),
        (model(&[0.99; 6], vec![0.1; 6]), vec![0.0; 300], 1e-6),
        // Well conditioned: the same x0 by another way.
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
                let error = crate::metric::relative_error(&truth, &found.expect("a start"));
                assert!(error < limit, "{isa}, {:?}: {error:e}", plant.a());
            }
        }
    }
}

/// Rows over 200 powers of two with an exact solution in whole numbers: each row's residual is a rounding of that row
/// (Cox and Higham 1998), so that x is exact to eps times the condition of the rows scaled to one size.
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
    // cond of 12 random rows of 4 is below 100; growth and sums take m n = 48 roundings.
    let error = crate::metric::relative_error(&truth, &x);
    assert!(error < 100.0 * 48.0 * f64::EPSILON, "{error:e}");
    // Failures are typed, after pivoting too.
    let mut without: Vec<_> = problem
        .iter()
        .map(|(row, rhs)| ([row[0], 0.0, row[2], row[3]], *rhs))
        .collect();
    assert_eq!(
        sorted_qr::solve(N, &mut without),
        Err(FailureKind::RankDeficient)
    );
    for bad in [f64::NAN, f64::INFINITY] {
        let mut wrong = problem.clone();
        wrong[5].0[1] = bad;
        assert_eq!(sorted_qr::solve(N, &mut wrong), Err(FailureKind::NonFinite));
        let mut wrong = problem.clone();
        wrong[7].1 = bad;
        assert_eq!(sorted_qr::solve(N, &mut wrong), Err(FailureKind::NonFinite));
    }
}
