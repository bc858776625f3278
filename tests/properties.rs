//! Invariants on random plants, records and instruments; of the estimators by faer and by lanes of every width.

use asobench::estimator::information::Information;
use asobench::estimator::solver::Solution;
use asobench::estimator::{
    Auxiliary, Drive, Estimator, FailureKind, InstrumentalVariables, Instruments, IvOptions, LeastSquares, Pass, Shape,
    Solver, Stage10, StartState, Window,
};
use asobench::lanes::Isa;
use asobench::metric::relative_error;
use asobench::observer::Gain;
use asobench::plant::{StateSpace, random_stable, simulate};
use asobench::signal::{NoiseFilter, Purpose, RandomSigns, Sequence, stream};
use faer::{Col, Mat};
use proptest::prelude::*;

/// A random stable plant with a record of it.
#[derive(Debug)]
struct Case {
    plant: StateSpace,
    x0: Vec<f64>,
    u: Vec<f64>,
    /// Noise-free output.
    y0: Vec<f64>,
    /// Output with white noise of a tenth of an input's amplitude.
    y: Vec<f64>,
}

impl Case {
    fn new(order: usize, seed: u64, samples: usize, radius: f64) -> Self {
        let plant = random_stable(order, radius, &mut stream(seed, 0, Purpose::Plant));
        let mut u = vec![0.0; samples];
        let input = RandomSigns {
            amplitude: 1.0,
            sequence: Sequence::Independent,
        };
        input.fill(&mut stream(seed, 0, Purpose::Input), &mut u);
        let x0: Vec<f64> = (0..order).map(|i| 1.0 - 0.3 * i as f64).collect();
        let (mut y0, mut states) = (vec![0.0; samples], vec![0.0; samples * order]);
        plant.simulate(&mut x0.clone(), &u, &mut y0, &mut states);
        let mut f = vec![0.0; samples];
        let mut drive = stream(seed, 0, Purpose::NoiseDrive);
        let mut start = stream(seed, 0, Purpose::NoiseStart);
        NoiseFilter::white().fill(&mut start, &mut drive, &mut Vec::new(), &mut f);
        let y = y0.iter().zip(&f).map(|(y, f)| y + 0.1 * f).collect();
        Self { plant, x0, u, y0, y }
    }

    fn shape(&self) -> Shape {
        Shape {
            order: self.plant.order(),
            window: self.u.len(),
        }
    }

    fn window(&self) -> Window<'_> {
        Window::new(&self.u, &self.y, self.y.len())
    }
}

/// The engines that compute the estimates.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Engine {
    Faer(Solver),
    Lanes(Isa),
}

/// Faer by these solvers, and lanes of every width of this machine.
fn engines(solvers: &[Solver]) -> Vec<Engine> {
    let here = Isa::ALL.iter().copied().filter(|isa| isa.is_here());
    let solvers = solvers.iter().copied().map(Engine::Faer);
    solvers.chain(here.map(Engine::Lanes)).collect()
}

fn least_squares(shape: Shape, window: Window<'_>, engine: Engine) -> Pass {
    let mut passes = [Pass::new(shape.order)];
    let mut estimator: Box<dyn Estimator> = match engine {
        Engine::Faer(solver) => Box::new(LeastSquares::new(shape, solver).expect("a valid shape")),
        Engine::Lanes(isa) => {
            let options = IvOptions {
                iterations: 0,
                ..IvOptions::default()
            };
            isa.estimator(shape, &options).expect("a valid shape")
        }
    };
    estimator.estimate(window, &mut passes);
    let [pass] = passes;
    pass
}

/// All passes; faer's solver is that of the options.
fn instrumental_variables(shape: Shape, window: Window<'_>, engine: Engine, options: &IvOptions) -> Vec<Pass> {
    let mut passes = vec![Pass::new(shape.order); options.iterations + 1];
    let mut estimator: Box<dyn Estimator> = match engine {
        Engine::Faer(_) => Box::new(InstrumentalVariables::new(shape, options).expect("a valid shape")),
        Engine::Lanes(isa) => isa.estimator(shape, options).expect("a valid shape"),
    };
    estimator.estimate(window, &mut passes);
    passes
}

fn norm(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum::<f64>().sqrt()
}

fn distance(left: &[f64], right: &[f64]) -> f64 {
    assert_eq!(left.len(), right.len());
    let difference: Vec<f64> = left.iter().zip(right).map(|(l, r)| l - r).collect();
    norm(&difference)
}

const ALL_SOLVERS: [Solver; 7] = [
    Solver::Partitioned,
    Solver::Lu,
    Solver::Cholesky,
    Solver::Qr,
    Solver::Svd,
    Solver::Dual,
    Solver::Augmented,
];

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, ..ProptestConfig::default() })]

    /// Noise-free data give the plant back, and nothing fails where Phi is well conditioned.
    ///
    /// - `theta = (a, h)`: products of N terms have errors of `N eps` of their absolute values, which are at most 2n
    ///   times the matrix's norm; so, with both sides of the equations perturbed, the relative error is at most
    ///   `2 (2n) N eps` times the condition number of the solve. QR forms no products; its own bound is smaller.
    /// - b: the triangular system `T(a) b = h` holds to its own rounding.
    /// - x0: D has the identity as its first rows, so that `|D^+| <= 1`: the error is at most that of the identified
    ///   model's output from the true x0.
    #[test]
    fn noise_free_recovery(order in 1_usize..=8, seed in any::<u64>(), extra in 20_usize..200) {
        let case = Case::new(order, seed, 3 * order + extra, 0.9);
        let window = Window::new(&case.u, &case.y0, case.y0.len());
        let rounding = |pass: &Pass| 4.0 * (order * case.y0.len()) as f64 * f64::EPSILON * pass.condition;
        let theta = [case.plant.a(), &case.plant.h()].concat();
        let by_qr = least_squares(case.shape(), window, Engine::Faer(Solver::Qr));
        prop_assert_eq!(by_qr.failure, None);
        prop_assert!(relative_error(&theta, &[&by_qr.a[..], &by_qr.h].concat()) < rounding(&by_qr));
        let all = engines(&[Solver::Partitioned]).into_iter().flat_map(|engine| {
            let passes = instrumental_variables(case.shape(), window, engine, &IvOptions::default());
            passes.into_iter().map(move |pass| (engine, pass))
        });
        for (engine, pass) in all {
            prop_assert!(pass.failure.is_none() || by_qr.condition > 1e5, "{engine:?}: {:?}", pass.failure);
            if pass.failure.is_some() {
                continue;
            }
            let error = relative_error(&theta, &[&pass.a[..], &pass.h].concat());
            prop_assert!(error < rounding(&pass), "{engine:?}: {error:e}");
            let model = StateSpace::new(pass.a.clone(), pass.b.clone()).unwrap();
            let h_size = norm(&pass.a).max(1.0) * norm(&pass.b);
            prop_assert!(distance(&model.h(), &pass.h) <= 10.0 * order as f64 * f64::EPSILON * h_size);
            let samples = case.y0.len();
            let (mut output, mut states) = (vec![0.0; samples], vec![0.0; samples * order]);
            model.simulate(&mut case.x0.clone(), &case.u, &mut output, &mut states);
            let own = 100.0 * order as f64 * f64::EPSILON * norm(&case.y0);
            let (found, allowed) = (distance(&case.x0, &pass.x0), distance(&output, &case.y0) + own);
            prop_assert!(found <= allowed, "{engine:?}: {found:e} > {allowed:e}");
        }
    }

    /// The shift recurrence gives the blocks that the product of the data matrices gives.
    #[test]
    fn recurrence_is_the_product(order in 1_usize..=8, seed in any::<u64>(), rows in 16_usize..300) {
        let case = Case::new(order, seed, order + rows.max(2 * order), 0.95);
        let (mut fast, mut plain) = (Information::new(order), Information::new(order));
        let agree = |fast: &Information, plain: &Information| {
            let scale = plain.matrix().norm_max();
            let difference = (fast.matrix() - plain.matrix()).norm_max();
            let rhs = fast.rhs().iter().zip(plain.rhs()).map(|(a, b)| (a - b).abs());
            difference <= 1e-13 * scale && rhs.fold(0.0, f64::max) <= 1e-13 * scale
        };
        fast.least_squares(case.window());
        plain.by_product(case.window(), Instruments::new(&case.y));
        prop_assert!(agree(&fast, &plain));
        // Instruments that grow, decay or have an offset too.
        for growth in [1.0, 1.1, 0.9] {
            let grow = |(k, y): (usize, &f64)| 3.0 + y * f64::powi(growth, k as i32);
            let yhat: Vec<f64> = case.y0.iter().enumerate().map(grow).collect();
            fast.instruments(case.window(), Instruments::new(&yhat));
            plain.by_product(case.window(), Instruments::new(&yhat));
            prop_assert!(agree(&fast, &plain), "growth {growth}");
            // Another signal instead of u.
            let r: Vec<f64> = case.u.iter().zip(&case.y).map(|(u, y)| u + 0.5 * y).collect();
            let instruments = Instruments { output: &yhat, input: Some(&r) };
            fast.instruments(case.window(), instruments);
            plain.by_product(case.window(), instruments);
            prop_assert!(agree(&fast, &plain), "growth {growth}, r");
            fast.least_squares(case.window());
        }
    }

    /// All solvers agree on the same regressors and instruments to what the condition allows; `dual` to
    /// its regularisation, 2^-26 |Phi Z'|_F |(Z'Phi)^-1|.
    #[test]
    fn solvers_agree_on_the_same_instruments(
        order in 1_usize..=6, seed in any::<u64>(), rows in 40_usize..160,
    ) {
        let case = Case::new(order, seed, order + rows, 0.8);
        let (shape, window) = (case.shape(), case.window());
        for instruments in [false, true] {
            let output = if instruments { &case.y0 } else { &case.y };
            let (exact, condition, regularisation) = reference(window, output, order);
            for solver in ALL_SOLVERS {
                if instruments && solver == Solver::Cholesky {
                    continue;
                }
                let mut solution = Solution::new(order);
                let solved = if instruments {
                    let mut solver = solver.instruments(shape, Stage10::Corrected).unwrap();
                    let first = solver.least_squares(window, &mut solution);
                    first.and_then(|()| solver.instruments(window, Instruments::new(output), &mut solution))
                } else {
                    let mut solver = solver.least_squares(shape).unwrap();
                    solver.least_squares(window, &mut solution)
                };
                prop_assert_eq!(solved, Ok(()));
                let limit = match solver {
                    Solver::Dual => 10.0 * regularisation,
                    _ => 1e3 * f64::EPSILON * condition,
                };
                let error = relative_error(&exact, &solution.p);
                prop_assert!(error <= limit, "{solver} {instruments}: {error:e} > {limit:e}");
            }
        }
    }

    /// y -> c y and u -> d u scale h and b by c/d, x0 by c, and leave a alone.
    #[test]
    fn scaling_laws(order in 1_usize..=5, seed in any::<u64>(), c in 1e-3..1e3, d in 1e-3..1e3) {
        let case = Case::new(order, seed, 3 * order + 80, 0.8);
        let scaled_u: Vec<f64> = case.u.iter().map(|u| d * u).collect();
        let scaled_y: Vec<f64> = case.y.iter().map(|y| c * y).collect();
        let scaled = Window::new(&scaled_u, &scaled_y, scaled_y.len());
        for engine in engines(&[Solver::Partitioned, Solver::Qr]) {
            let plain = least_squares(case.shape(), case.window(), engine);
            let pass = least_squares(case.shape(), scaled, engine);
            let limit = 1e4 * f64::EPSILON * plain.condition;
            let times = |values: &[f64], factor: f64| -> Vec<f64> {
                values.iter().map(|value| factor * value).collect()
            };
            prop_assert!(relative_error(&plain.a, &pass.a) < limit);
            prop_assert!(relative_error(&times(&plain.h, c / d), &pass.h) < limit);
            prop_assert!(relative_error(&times(&plain.b, c / d), &pass.b) < limit);
            prop_assert!(relative_error(&times(&plain.x0, c), &pass.x0) < limit);
        }
    }

    /// Similarity: the canonical form's input-output behaviour is that of any other realisation of it,
    /// here the transposed (observer) form.
    #[test]
    fn similar_realisations_have_the_same_output(order in 1_usize..=8, seed in any::<u64>()) {
        let case = Case::new(order, seed, 60, 0.9);
        let h = case.plant.h();
        let mut zero_state = vec![0.0; 60];
        simulate(case.plant.a(), case.plant.b(), &mut vec![0.0; order], &case.u, |k, x| zero_state[k] = x[0]);
        // z_i(k+1) = a_(n+1-i) z_1 + z_(i+1) + h_i u, y = z_1.
        let mut z = vec![0.0; order];
        for (k, expected) in zero_state.iter().enumerate() {
            let scale = zero_state.iter().fold(1.0_f64, |m, y| m.max(y.abs()));
            prop_assert!((z[0] - expected).abs() < 1e-11 * scale);
            let first = z[0];
            for i in 0..order {
                let next = if i + 1 < order { z[i + 1] } else { 0.0 };
                z[i] = case.plant.a()[order - 1 - i] * first + next + h[i] * case.u[k];
            }
        }
    }

    /// (a, b) -> (a, h) -> (alpha, beta) -> (a, b).
    #[test]
    fn the_maps_between_forms_are_inverse(order in 1_usize..=10, seed in any::<u64>()) {
        let plant = random_stable(order, 0.95, &mut stream(seed, 0, Purpose::Plant));
        let back = StateSpace::from_polynomials(&plant.denominator()[1..], &plant.h()).unwrap();
        prop_assert_eq!(back.a(), plant.a());
        prop_assert!(relative_error(plant.b(), back.b()) < 1e-10);
    }

    /// Schur-Cohn agrees with the eigenvalues, away from the unit circle.
    #[test]
    fn the_stability_test_agrees_with_the_poles(order in 1_usize..=8, seed in any::<u64>(), scale in 0.3_f64..2.0) {
        let plant = random_stable(order, 0.99, &mut stream(seed, 0, Purpose::Plant));
        // Scaled poles: a_i rho^(n+1-i).
        let a: Vec<f64> = plant.a().iter().enumerate()
            .map(|(i, a)| a * scale.powi((order - i) as i32)).collect();
        let radius = asobench::plant::PoleFinder::new(order).poles(&a)[0].norm();
        prop_assume!((radius - 1.0).abs() > 1e-3);
        let stable = asobench::plant::stability::is_stable(&a, &mut vec![0.0; order]);
        prop_assert_eq!(stable, radius < 1.0);
    }
}

/// p in extended precision (two steps of refinement with residuals in double-double arithmetic), the
/// condition number that bounds every solver's error, and `dual`'s regularisation error.
fn reference(window: Window<'_>, output: &[f64], order: usize) -> (Vec<f64>, f64, f64) {
    let rows = window.len() - order;
    let entry = |signal: &[f64], k: usize, j: usize| {
        if j < order {
            -signal[k - 1 - j]
        } else {
            window.u[k - 1 - (j - order)]
        }
    };
    let phi = Mat::from_fn(rows, 2 * order, |i, j| entry(window.y, order + i, j));
    let z = Mat::from_fn(rows, 2 * order, |i, j| entry(output, order + i, j));
    let g = z.transpose() * &phi;
    let lu = g.partial_piv_lu();
    let mut p = Col::<f64>::zeros(2 * order);
    for _ in 0..6 {
        // Z'(y - Phi p), with the inner sums in double-double.
        let residual: Vec<f64> = (0..rows)
            .map(|i| {
                let mut sum = (window.y[order + i], 0.0);
                for j in 0..2 * order {
                    sum = add_product(sum, -phi[(i, j)], p[j]);
                }
                sum.0 + sum.1
            })
            .collect();
        let rhs = Col::from_fn(2 * order, |j| {
            let sum = (0..rows).fold((0.0, 0.0), |sum, i| add_product(sum, z[(i, j)], residual[i]));
            sum.0 + sum.1
        });
        use faer::linalg::solvers::Solve;
        p += lu.solve(rhs);
    }
    use faer::linalg::solvers::DenseSolveCore;
    let inverse = lu.inverse();
    // First-order bound of forming and solving: |G^-1| (|Z|'|Phi| + |Z|'|y| / |p|), in 1-norms.
    let (phi_size, z_size) = (absolute(&phi), absolute(&z));
    let y_size = Mat::from_fn(rows, 1, |i, _| window.y[order + i].abs());
    let formed = norm1(&(z_size.transpose() * &phi_size));
    let right = norm1(&(z_size.transpose() * &y_size));
    let condition = norm1(&inverse) * (formed + right / p.norm_l1());
    let product = &phi * z.transpose();
    let regularisation = 2.0_f64.powi(-26) * product.norm_l2() * inverse.norm_l2();
    let p: Vec<f64> = p.iter().copied().collect();
    (p, condition, regularisation)
}

/// `sum + x y` in double-double arithmetic.
fn add_product(sum: (f64, f64), x: f64, y: f64) -> (f64, f64) {
    let product = x * y;
    let product_error = x.mul_add(y, -product);
    let total = sum.0 + product;
    let back = total - sum.0;
    let total_error = (sum.0 - (total - back)) + (product - back);
    (total, sum.1 + total_error + product_error)
}

fn absolute(matrix: &Mat<f64>) -> Mat<f64> {
    Mat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)].abs())
}

fn norm1(matrix: &Mat<f64>) -> f64 {
    (0..matrix.ncols()).map(|j| matrix.col(j).norm_l1()).fold(0.0, f64::max)
}

/// A rank-deficient record is typed by every solver but `dual`, which hides it behind its regularisation.
#[test]
fn rank_deficiency_is_typed_by_every_solver() {
    // u and y obey the same first-order law: columns of order 2 are dependent.
    let u: Vec<f64> = (0..60).map(|k| f64::from((k * k * 7 + k) % 11) - 5.0).collect();
    let mut y = vec![0.3];
    for k in 0..59 {
        y.push(0.5 * y[k] + u[k]);
    }
    let shape = Shape { order: 2, window: 60 };
    let window = Window::new(&u, &y, y.len());
    for solver in engines(&ALL_SOLVERS) {
        let pass = least_squares(shape, window, solver);
        if solver == Engine::Faer(Solver::Dual) {
            assert!(pass.failure.is_none());
            continue;
        }
        let condition = pass.condition;
        let failure = pass.failure.unwrap_or_else(|| panic!("{solver:?}: {condition:e}"));
        assert_eq!(failure.kind, FailureKind::RankDeficient, "{solver:?}");
        assert!(
            condition.is_nan(),
            "{solver:?}: a condition number of what was not solved"
        );
        assert!(
            pass.a.iter().all(|a| a.is_nan()),
            "{solver:?}: a number after a failure"
        );
    }
    // Zero output: a zero column is exactly singular.
    let zeros = vec![0.0; 60];
    for engine in engines(&[Solver::Partitioned]) {
        let pass = least_squares(shape, Window::new(&u, &zeros, zeros.len()), engine);
        let kind = pass.failure.map(|failure| failure.kind);
        assert_eq!(kind, Some(FailureKind::Singular), "{engine:?}");
    }
    // A value that is not finite.
    y[30] = f64::INFINITY;
    for engine in engines(&ALL_SOLVERS) {
        let pass = least_squares(shape, Window::new(&u, &y, y.len()), engine);
        let kind = pass.failure.map(|failure| failure.kind);
        assert_eq!(kind, Some(FailureKind::NonFinite), "{engine:?}");
    }
}

/// Readings E4, E11, E12 and E2 do what they say.
#[test]
fn readings_differ_where_they_should() {
    let case = Case::new(3, 11, 120, 0.7);
    for engine in engines(&[Solver::Partitioned]) {
        let run = |options: IvOptions| instrumental_variables(case.shape(), case.window(), engine, &options);
        let refresh = run(IvOptions::default());
        let with = |auxiliary| {
            run(IvOptions {
                auxiliary,
                ..IvOptions::default()
            })
        };
        let (frozen, literal) = (with(Auxiliary::Frozen), with(Auxiliary::Literal));
        // Pass 1 starts from iteration 0 in every reading.
        assert_eq!(frozen[1].a, refresh[1].a);
        assert_ne!(frozen[2].a, refresh[2].a);
        assert_eq!(frozen[4].a, literal[4].a);
        assert_eq!(frozen[4].x0, refresh[0].x0);
        assert_eq!(literal[4].b, refresh[0].b);
        assert_ne!(frozen[4].b, refresh[0].b);
        let five = run(IvOptions {
            iterations: 5,
            ..IvOptions::default()
        });
        assert_eq!(five[4].a, refresh[4].a);
        // Without stage 6 every start is zero, and least squares needs none.
        let from_zero = run(IvOptions {
            initial_state: StartState::Zero,
            ..IvOptions::default()
        });
        assert_eq!(from_zero[0].a, refresh[0].a);
        assert_ne!(from_zero[1].a, refresh[1].a);
        assert!(from_zero.iter().all(|pass| pass.x0 == [0.0; 3]));
    }
    // The rest is for faer alone.
    let faer = Engine::Faer(Solver::Partitioned);
    let run = |options: IvOptions| instrumental_variables(case.shape(), case.window(), faer, &options);
    let refresh = run(IvOptions::default());
    let driven = |gain| {
        run(IvOptions {
            drive: Drive::Observer,
            gain,
            ..IvOptions::default()
        })
    };
    // No feedback is the simulation itself; with feedback y drives the instruments.
    assert_eq!(driven(Gain::Scaled(1.0))[4].a, refresh[4].a);
    assert_ne!(driven(Gain::DeadBeat)[1].a, refresh[1].a);
    for stage10 in [Stage10::AsPrinted, Stage10::AsPrinted2024] {
        let printed = run(IvOptions {
            stage10,
            ..IvOptions::default()
        });
        let error = relative_error(case.plant.a(), &printed[1].a);
        assert!(error > 0.5, "{stage10}: {error}");
    }
}

/// Stage 6 for an unstable plant, whose rows of D grow by six orders of magnitude: sorted QR loses about as
/// many digits (the normal equations would lose twice as many, and leave 1e-4).
#[test]
fn the_initial_state_of_an_unstable_plant() {
    let poles = [1.1, 0.5, -0.3];
    let poles: Vec<faer::c64> = poles.iter().map(|p| faer::c64::new(*p, 0.0)).collect();
    let phi = asobench::plant::polynomial_from_poles(&poles);
    let a: Vec<f64> = phi.iter().rev().map(|phi| -phi.re).collect();
    let plant = StateSpace::new(a, vec![1.0, -0.5, 0.25]).unwrap();
    let u: Vec<f64> = (0..150).map(|k| f64::from((k * 13) % 7) - 3.0).collect();
    let (mut y, mut states) = (vec![0.0; 150], vec![0.0; 450]);
    let x0_true = [1.0, -2.0, 3.0];
    plant.simulate(&mut x0_true.clone(), &u, &mut y, &mut states);
    let window = Window::new(&u, &y, y.len());
    let mut x0 = [0.0; 3];
    let mut initial = asobench::estimator::initial_state::InitialState::new(3);
    initial.estimate(plant.a(), plant.b(), window, &mut x0).unwrap();
    assert!(relative_error(&x0_true, &x0) < 1e-8, "{x0:?}");
}

/// Stage 6 for stable but clustered poles, where cond(D'D) reaches 10^15 and the normal equations would lose
/// every digit: noise-free data give x0 back.
#[test]
fn the_initial_state_of_clustered_poles() {
    for (order, pole) in [(6, 0.95), (4, 0.99), (6, 0.99)] {
        let poles = vec![faer::c64::new(pole, 0.0); order];
        let phi = asobench::plant::polynomial_from_poles(&poles);
        let a: Vec<f64> = phi.iter().rev().map(|phi| -phi.re).collect();
        let plant = StateSpace::new(a, vec![0.1; order]).unwrap();
        let samples = 300;
        let u = vec![0.0; samples];
        let (mut y, mut states) = (vec![0.0; samples], vec![0.0; samples * order]);
        let x0_true: Vec<f64> = (0..order).map(|i| 1.0 + i as f64).collect();
        plant.simulate(&mut x0_true.clone(), &u, &mut y, &mut states);
        let mut x0 = vec![0.0; order];
        let mut initial = asobench::estimator::initial_state::InitialState::new(order);
        initial
            .estimate(plant.a(), plant.b(), Window::new(&u, &y, y.len()), &mut x0)
            .unwrap();
        let error = relative_error(&x0_true, &x0);
        assert!(error < 1e-6, "order {order}, pole {pole}: {error:e}");
    }
}

/// Instruments can make G11 = V'Y singular inside a regular G. The partitioned inverse, which does not pivot
/// between its blocks, must say so; LU solves the same system.
#[test]
fn a_singular_block_in_a_regular_matrix_is_typed() {
    let case = Case::new(1, 5, 80, 0.5);
    let window = case.window();
    // yhat orthogonal to the lagged y, but not to u: yhat(k) = u(k) - c y(k), over k = n-1 ... N-2.
    let lagged = 0..79;
    let inner = |a: &[f64], b: &[f64]| -> f64 { lagged.clone().map(|k| a[k] * b[k]).sum() };
    let c = inner(&case.u, &case.y) / inner(&case.y, &case.y);
    let yhat: Vec<f64> = case.u.iter().zip(&case.y).map(|(u, y)| u - c * y).collect();
    let run = |solver: Solver| {
        let mut solver = solver.instruments(case.shape(), Stage10::Corrected).unwrap();
        let mut solution = Solution::new(1);
        solver.least_squares(window, &mut solution).unwrap();
        (
            solver.instruments(window, Instruments::new(&yhat), &mut solution),
            solution,
        )
    };
    let (by_lu, solution) = run(Solver::Lu);
    assert!(
        by_lu.is_ok() && solution.condition < 1e3,
        "{by_lu:?} {}",
        solution.condition
    );
    let (partitioned, solution) = run(Solver::Partitioned);
    assert_eq!(partitioned, Err(FailureKind::RankDeficient), "{:e}", solution.condition);
}

/// Stage 6 leaves the same bits whatever problems its buffers served before.
#[test]
fn the_initial_state_does_not_depend_on_earlier_ones() {
    use asobench::estimator::initial_state::InitialState;
    for (order, samples) in [(2, 40), (3, 100), (5, 60), (6, 98), (8, 70)] {
        let case = Case::new(order, 77, samples, 0.9);
        // Poles near the unit circle: the way through sorted QR.
        let poles = vec![faer::c64::new(0.97, 0.0); order];
        let phi = asobench::plant::polynomial_from_poles(&poles);
        let a: Vec<f64> = phi.iter().rev().map(|phi| -phi.re).collect();
        let b = vec![1.0; order];
        let estimate = |initial: &mut InitialState| {
            let mut x0 = vec![0.0; order];
            initial.estimate(&a, &b, case.window(), &mut x0).unwrap();
            x0.iter().map(|x| x.to_bits()).collect::<Vec<u64>>()
        };
        let fresh = estimate(&mut InitialState::new(order));
        let mut used = InitialState::new(order);
        let long = Case::new(order, 78, 3000, 0.9);
        used.estimate(&a, &b, long.window(), &mut vec![0.0; order]).unwrap();
        assert_eq!(estimate(&mut used), fresh, "order {order}");
    }
}
