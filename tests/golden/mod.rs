//! Reference values in 50-digit arithmetic, made without this program (`data/README.md`).
//!
//! Every file of `tests/golden/data`, or of the folder named by `ASOBENCH_GOLDEN`, is run: least squares and
//! every IV pass in the readings `refresh` and `frozen`, the gain and the observer's states; by faer and by lanes of
//! every width.

use asobench::estimator::information::Information;
use asobench::estimator::{
    Auxiliary, Estimator, InstrumentalVariables, IvOptions, LeastSquares, Pass, Shape, Solver, Window,
};
use asobench::lanes::Isa;
use asobench::metric::relative_error;
use asobench::observer::Gain;
use asobench::plant::observe;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// The engines that compute the estimates.
#[derive(Clone, Copy, Debug)]
enum Engine {
    Faer(Solver),
    Lanes(Isa),
}

/// The partitioned inverse by everything that computes it here.
fn partitioned() -> Vec<Engine> {
    let here = Isa::ALL.iter().copied().filter(|isa| isa.is_here());
    let faer = Engine::Faer(Solver::Partitioned);
    std::iter::once(faer).chain(here.map(Engine::Lanes)).collect()
}

/// One file: the record and its reference values.
struct Case {
    name: String,
    reference: Value,
    shape: Shape,
    u: Vec<f64>,
    y: Vec<f64>,
}

fn numbers(value: &Value) -> Vec<f64> {
    let array = value.as_array().expect("an array of numbers");
    array.iter().map(|v| v.as_f64().expect("a number")).collect()
}

impl Case {
    fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).expect("a readable file");
        let reference: Value = serde_json::from_str(&text).expect("JSON");
        let record = std::fs::read_to_string(path.with_extension("csv")).expect("a record");
        let rows = record.lines().skip(1).map(|line| {
            let mut cells = line
                .split(',')
                .skip(1)
                .map(|cell| cell.parse::<f64>().expect("a number"));
            (cells.next().expect("u"), cells.next().expect("y"))
        });
        let (u, y) = rows.unzip();
        let size = |key: &str| reference[key].as_u64().expect("a size") as usize;
        Self {
            name: reference["name"].as_str().expect("a name").to_owned(),
            shape: Shape {
                order: size("order"),
                window: size("window"),
            },
            reference,
            u,
            y,
        }
    }

    fn all() -> Vec<Self> {
        let folder = std::env::var_os("ASOBENCH_GOLDEN").map_or_else(
            || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/golden/data"),
            PathBuf::from,
        );
        let files = std::fs::read_dir(&folder).expect("the folder of golden files");
        let mut paths: Vec<PathBuf> = files.map(|f| f.expect("a file").path()).collect();
        paths.retain(|path| path.extension().is_some_and(|e| e == "json"));
        paths.sort();
        assert!(!paths.is_empty(), "no golden file in {}", folder.display());
        paths.iter().map(|path| Self::read(path)).collect()
    }

    fn noisy(&self) -> bool {
        self.reference["eta"].as_f64() != Some(0.0)
    }

    /// The accuracy asked for: 1e-8 with noise, 1e-6 without (N = 18 is ill-conditioned).
    fn tolerance(&self) -> f64 {
        if self.noisy() { 1e-8 } else { 1e-6 }
    }

    fn window(&self) -> Window<'_> {
        Window::new(&self.u, &self.y, self.shape.window)
    }

    fn least_squares(&self, engine: Engine) -> Pass {
        let mut passes = vec![Pass::new(self.shape.order)];
        let estimator: Result<Box<dyn Estimator>, _> = match engine {
            Engine::Faer(solver) => LeastSquares::new(self.shape, solver).map(|estimator| Box::new(estimator) as _),
            Engine::Lanes(isa) => {
                let options = IvOptions {
                    iterations: 0,
                    ..IvOptions::default()
                };
                isa.estimator(self.shape, &options)
            }
        };
        let mut estimator = estimator.expect("a valid shape");
        estimator.estimate(self.window(), &mut passes);
        passes.remove(0)
    }

    fn passes(&self, engine: Engine, auxiliary: Auxiliary) -> Vec<Pass> {
        let mut options = IvOptions {
            auxiliary,
            ..IvOptions::default()
        };
        let mut passes = vec![Pass::new(self.shape.order); 5];
        let estimator: Result<Box<dyn Estimator>, _> = match engine {
            Engine::Faer(solver) => {
                options.solver = solver;
                InstrumentalVariables::new(self.shape, &options).map(|estimator| Box::new(estimator) as _)
            }
            Engine::Lanes(isa) => isa.estimator(self.shape, &options),
        };
        let mut estimator = estimator.expect("a valid shape");
        estimator.estimate(self.window(), &mut passes);
        passes
    }
}

/// The largest relative difference of a, b, h, x0; infinite for a failed pass.
fn difference(pass: &Pass, reference: &Value) -> f64 {
    if pass.failure.is_some() {
        return f64::INFINITY;
    }
    [("a", &pass.a), ("b", &pass.b), ("h", &pass.h), ("x0", &pass.x0)]
        .into_iter()
        .map(|(key, found)| relative_error(&numbers(&reference[key]), found))
        .fold(0.0, f64::max)
}

/// Largest differences of least squares and of the IV passes of one engine on one case.
fn differences(case: &Case, engine: Engine) -> (f64, f64) {
    let ls = difference(&case.least_squares(engine), &case.reference["ls"]);
    if matches!(engine, Engine::Faer(Solver::Cholesky)) {
        return (ls, f64::NAN);
    }
    let mut iv = 0.0_f64;
    for (auxiliary, key) in [(Auxiliary::Refresh, "iv_refresh"), (Auxiliary::Frozen, "iv_frozen")] {
        let passes = case.passes(engine, auxiliary);
        let references = case.reference[key].as_array().expect("passes");
        assert_eq!(references.len(), 4);
        for (pass, reference) in passes[1..].iter().zip(references) {
            iv = iv.max(difference(pass, reference));
        }
    }
    (ls, iv)
}

/// The partitioned inverse, default and subject of the papers, on every file.
#[test]
fn partitioned_reaches_the_reference_values() {
    for case in Case::all() {
        for engine in partitioned() {
            let (ls, iv) = differences(&case, engine);
            println!("{} {engine:?}: ls {ls:.1e}, iv {iv:.1e}", case.name);
            let limit = case.tolerance();
            assert!(ls <= limit && iv <= limit, "{} {engine:?}", case.name);
        }
    }
}

/// Every other solver on every file but `dual`.
#[test]
fn every_solver_reaches_the_reference_values() {
    for case in Case::all() {
        for solver in [Solver::Lu, Solver::Cholesky, Solver::Qr, Solver::Svd, Solver::Augmented] {
            let (ls, iv) = differences(&case, Engine::Faer(solver));
            println!("{} {solver}: ls {ls:.1e}, iv {iv:.1e}", case.name);
            let limit = case.tolerance();
            assert!(
                ls <= limit && (solver == Solver::Cholesky || iv <= limit),
                "{} {solver}",
                case.name
            );
        }
    }
}

/// `dual` is regularised by eps = 2^-26 |Phi Z'|_F. For least squares p's relative error is at most about
/// eps |(Phi'Phi)^-1|, and |Phi Phi'|_F = |Phi'Phi|_F: a finding of the comparison, asserted as such.
#[test]
fn dual_reaches_what_its_regularisation_allows() {
    use faer::linalg::solvers::DenseSolveCore;
    for case in Case::all() {
        let mut information = Information::new(case.shape.order);
        information.least_squares(case.window());
        let g = information.matrix();
        let bound = 2.0_f64.powi(-26) * g.norm_l2() * g.partial_piv_lu().inverse().norm_l2();
        let pass = case.least_squares(Engine::Faer(Solver::Dual));
        let reference = &case.reference["ls"];
        let theta = |a: &[f64], h: &[f64]| [a, h].concat();
        let expected = theta(&numbers(&reference["a"]), &numbers(&reference["h"]));
        let error = relative_error(&expected, &theta(&pass.a, &pass.h));
        println!("{} dual: {error:.1e}, bound {bound:.1e}", case.name);
        assert!(error <= 2.0 * bound, "{}: {error:e} > {bound:e}", case.name);
    }
}

/// Stage 12: the dead-beat gain and the states at k = N and k = K - 1.
#[test]
fn the_observer_reaches_the_reference_values() {
    let cases = Case::all();
    let engines = partitioned();
    for (case, engine) in cases
        .iter()
        .flat_map(|case| engines.iter().map(move |engine| (case, *engine)))
    {
        let expected = &case.reference["observer"];
        let pass = case.passes(engine, Auxiliary::Refresh).remove(4);
        let mut g = vec![0.0; case.shape.order];
        Gain::DeadBeat.compute(&pass.a, &mut g);
        let mut x = pass.x0.clone();
        let (mut at_window, mut last) = (Vec::new(), Vec::new());
        observe(&pass.a, &pass.b, &g, &mut x, &case.u, &case.y, |k, x| {
            if k == case.shape.window {
                at_window = x.to_vec();
            }
            last = x.to_vec();
        });
        for (key, found) in [("g", &g), ("x_at_window", &at_window), ("x_last", &last)] {
            let error = relative_error(&numbers(&expected[key]), found);
            println!("{} {engine:?} {key}: {error:.1e}", case.name);
            let name = &case.name;
            assert!(error <= case.tolerance(), "{name} {engine:?} {key}: {error:e}");
        }
    }
}
