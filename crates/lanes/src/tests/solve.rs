//! Stages 3 and 10.

use super::{Record, UNIT, packed, tested};
use crate::information::PackedInformation;
use crate::partitioned::{self, Triangles};
use crate::{Call, Isa, inverses, lane};
use asobench_identification::estimator::solver::{Instruments, Solution};
use asobench_identification::estimator::{FailureKind, Shape, Solver, Stage10};
use asobench_identification::real::{MOST_LANES, Mask, Real};
use faer::Mat;

/// The results of the lanes for a record.
struct Solved {
    /// G by rows, and r.
    g: Mat<f64>,
    r: Vec<f64>,
    /// p, by [`inverses::solve_alone`] in lanes that are not safe. In other lanes an error if a number is not finite.
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
        let mut information = PackedInformation::<R, N>::new(n);
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
            let single = information.lane(l);
            let entry = |i: usize, j: usize| single.g[2 * (i / n) + j / n][i % n][j % n];
            let (p, condition) = if alone.lane(l) {
                inverses::solve_alone(&information, l)
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
                r: [&single.r[0][..n], &single.r[1][..n]].concat(),
                p: p.and_then(finite),
                condition,
                safe: !alone.lane(l),
            }
        };
        (0..R::LANES).map(of_lane).collect()
    }
}

/// Returns p and the condition by faer's partitioned inverse.
fn by_faer(order: usize, record: &Record, instruments: bool) -> (Result<Vec<f64>, FailureKind>, f64) {
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

/// Returns `|L| |U|` of Gaussian elimination without pivots that begins with G22.
fn triangles(g: &Mat<f64>) -> Mat<f64> {
    let m = g.nrows();
    let turned = |matrix: &Mat<f64>| Mat::from_fn(m, m, |i, j| matrix[((i + m / 2) % m, (j + m / 2) % m)]);
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
    let absolute = |matrix: &Mat<f64>| Mat::from_fn(m, m, |i, j| matrix[(i, j)].abs());
    turned(&(absolute(&l) * absolute(&u)))
}

/// The lanes' elimination is backward stable (Higham 2002, Theorem 9.4, m = 2n unknowns):
/// `|G p - r| <= 3m u |L| |U| |p|`. Here the factor is 4m, because a pivot's reciprocal rounds once more, and is
/// doubled for the difference of this test's triangles. The rounding of the residual itself adds
/// `(m + 2) u (|G| |p| + |r|)`.
///
/// The parameters agree with faer's as the solvers agree among themselves (tests/properties.rs): to 1e3 eps times the
/// condition number. The condition numbers come from inverses of that accuracy and agree equally.
#[test]
fn elimination_is_backward_stable_and_agrees_with_faer() {
    for order in [1, 2, 3, 4, 5, 6, 8, 12, 24] {
        for (round, noise) in [(0, 0.1), (1, 1.0), (2, 1e-3)] {
            let samples = 5 * order + 30;
            let record = |l: u64| Record::new(order, 100 * round + 8 * order as u64 + l, samples, noise);
            let records: Vec<Record> = (0..MOST_LANES as u64).map(record).collect();
            for (instruments, with_condition) in [(false, false), (false, true), (true, false), (true, true)] {
                for isa in tested() {
                    let solve = Solve {
                        order,
                        records: &records,
                        instruments,
                        with_condition,
                    };
                    for (l, found) in isa.dispatch(order, solve).iter().enumerate() {
                        let name = format!("{isa}, order {order}, lane {l}, noise {noise}, {instruments}");
                        let (expected, condition) = by_faer(order, &records[l], instruments);
                        let allowed = 1e3 * f64::EPSILON * condition;
                        match (&found.p, &expected) {
                            (Ok(p), Ok(expected)) => {
                                if found.safe {
                                    check_backward_error(found, p, &name);
                                }
                                let error = asobench_identification::metric::relative_error(expected, p);
                                assert!(error <= allowed, "{name}: {error:e} > {allowed:e}");
                            }
                            (found, expected) => {
                                assert_eq!(found.as_ref().err(), expected.as_ref().err(), "{name}: {condition:e}");
                            }
                        }
                        if with_condition {
                            let error = (found.condition / condition - 1.0).abs();
                            assert!(error <= allowed, "{name}: {:e} for {condition:e}", found.condition);
                        } else {
                            assert!(found.condition.is_nan() || !found.safe, "{name}");
                        }
                    }
                }
            }
        }
    }
}

/// Checks the backward error row by row.
fn check_backward_error(found: &Solved, p: &[f64], name: &str) {
    let m = p.len();
    let sizes = triangles(&found.g);
    for i in 0..m {
        let row = |j: usize| found.g[(i, j)] * p[j];
        let residual = (0..m).map(row).sum::<f64>() - found.r[i];
        let size = |matrix: &Mat<f64>| (0..m).map(|j| (matrix[(i, j)] * p[j]).abs()).sum::<f64>();
        let (own, elimination) = (size(&found.g) + found.r[i].abs(), size(&sizes));
        let allowed = UNIT * ((m + 2) as f64 * own + 8.0 * m as f64 * elimination);
        assert!(residual.abs() <= allowed, "{name}: row {i}, {residual:e} > {allowed:e}");
    }
}

/// Solves one record in a lane among regular ones, and compares its failure with faer's.
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

/// A matrix that cannot be solved fails as in faer, and its neighbours are solved.
#[test]
fn failures_are_those_of_faer() {
    let u: Vec<f64> = (0..60).map(|k| f64::from((k * k * 7 + k) % 11) - 5.0).collect();
    let mut y = vec![0.3];
    for k in 0..59 {
        y.push(0.5 * y[k] + u[k]);
    }
    let zeros = vec![0.0; 60];
    let changed = |values: &[f64], k: usize, x: f64| {
        let mut values = values.to_vec();
        values[k] = x;
        values
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
            // Zero rows and zero columns.
            (2, false, record(&u, &zeros, &zeros)),
            (2, false, record(&zeros, &plain.y, &zeros)),
            (2, false, record(&zeros, &zeros, &zeros)),
            (1, false, record(&zeros, &plain.y, &zeros)),
            (2, true, record(&plain.u, &plain.y, &zeros)),
            // Constant input: a singular G22.
            (2, false, record(&[1.0; 60], &plain.y, &zeros)),
            // Values that are not finite, and overflowing sums.
            (
                2,
                false,
                record(&plain.u, &changed(&plain.y, 30, f64::INFINITY), &zeros),
            ),
            (2, false, record(&plain.u, &changed(&plain.y, 59, f64::NAN), &zeros)),
            (
                2,
                false,
                record(&changed(&plain.u, 0, f64::NEG_INFINITY), &plain.y, &zeros),
            ),
            (2, false, record(&changed(&plain.u, 57, f64::NAN), &plain.y, &zeros)),
            (2, false, record(&plain.u, &changed(&plain.y, 20, 1e160), &zeros)),
            (2, false, record(&changed(&plain.u, 20, 1e160), &plain.y, &zeros)),
            (2, true, record(&plain.u, &plain.y, &changed(&plain.yhat, 20, f64::NAN))),
            (2, true, record(&plain.u, &plain.y, &changed(&plain.yhat, 20, 1e308))),
            // Numbers so small that products underflow.
            (
                2,
                false,
                record(
                    &plain.u,
                    &plain.y.iter().map(|y| y * 1e-200).collect::<Vec<_>>(),
                    &zeros,
                ),
            ),
            // Regular records, for comparison.
            (2, false, record(&plain.u, &plain.y, &zeros)),
            (2, true, record(&plain.u, &plain.y, &plain.yhat)),
        ] {
            solve_one(order, &record, instruments, with_condition);
        }
    }
}

/// A singular G11 in a regular matrix. Its inverse, which the condition number needs, fails as in faer. The elimination
/// begins with G22 and does not fail.
#[test]
fn a_singular_block_in_a_regular_matrix() {
    // Instruments with G11 = 0, as in tests/properties.rs.
    let lagged = |a: &[f64], b: &[f64]| (0..59).map(|k| a[k] * b[k]).sum::<f64>();
    let first = Record::new(1, 5, 60, 0.3);
    let c = lagged(&first.u, &first.y) / lagged(&first.y, &first.y);
    let orthogonal: Vec<f64> = first.u.iter().zip(&first.y).map(|(u, y)| u - c * y).collect();
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

/// Wherever faer's condition number violates the rank rule, the lane is not safe. Neither the bound used instead of the
/// condition number nor half the rule's limit hides that.
#[test]
fn no_rank_deficient_matrix_is_safe() {
    let mut deficient = 0;
    for order in [1, 2, 3, 6, 12] {
        for power in 0..24 {
            // Noise-free records of order n - 1 plus a little noise: conditions from 1 up to the limit.
            let noise = 0.1_f64.powi(power);
            let record = |l: u64| Record::new(order.max(2) - 1, 500 + l, 8 * order + 20, noise);
            let records: Vec<Record> = (0..MOST_LANES as u64).map(record).collect();
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
