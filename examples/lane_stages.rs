//! Prints the cost of each stage of a W98 trial in the lanes: time, share of the peak rate of fused multiply-adds, and
//! the time of the same stage on faer. The stages are measured in turn, in rounds; the medians are printed.
//!
//! `cargo run --release --example lane_stages [avx512|avx2|portable]`

use asobench::data::Realisation;
use asobench::estimator::auxiliary::AuxiliaryModel;
use asobench::estimator::information::Information;
use asobench::estimator::initial_state::InitialState;
use asobench::estimator::solver::{Solution, SolveInstruments};
use asobench::estimator::{
    Drive, Estimator, InstrumentalVariables, Instruments, IvOptions, Pass, Shape, Solver, Stage10, Window,
};
use asobench::lanes::Isa;
use asobench::lanes::pack::Kernel;
use asobench::metric::{Response, StateError, System};
use asobench::observer::{Gain, ObservedModel, Observer};
use asobench::plant::PoleFinder;
use asobench::signal::{Purpose, stream};
use asobench::study::file::ExperimentFile;
use asobench::study::{DiscreteCell, Engine, Experiment, Plan, Trials, W98, Worker, fma_peak};
use std::hint::black_box;
use std::time::{Duration, Instant};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

const ROUNDS: usize = 51;

/// Time that one stage is measured in a round.
const STRETCH: Duration = Duration::from_millis(2);

/// Number of samples of the responses.
const FRESH: usize = 200;

/// The stages of a trial: name, runs per trial, kernel.
const STAGES: [(&str, usize, Kernel); 7] = [
    ("record", 1, Kernel::Draw),
    ("least-squares sums", 1, Kernel::LeastSquaresSums),
    ("IV sums", 4, Kernel::IvSums),
    ("solve", 5, Kernel::Solve),
    ("initial state", 5, Kernel::InitialState),
    ("auxiliary model", 4, Kernel::Auxiliary),
    ("observer, errors", 1, Kernel::Observer),
];

/// Floating-point operations of one run of a kernel in one lane: 2 for a fused multiply-add, 1 for any other. Integer
/// operations, signs, comparisons and mere checks (finite? stable? regular?) do not count.
///
/// n, N (window) and K (horizon) are as usual; `rows` is the number of rows of D, and m = 2n. A simulated sample S has
/// 2n products, all but one of them fused: `4n - 1`.
///
/// - Record: K + n normal numbers (33 each: a pair takes 28 for the logarithm, 33 for sine and cosine, 5 for the rest);
///   the noise with n fused products and a sum (2n + 1) K, its start n (n + 1); S N; two variances, 4 N each; adding
///   the noise, 2 N.
/// - Least-squares sums: 4n + 1 products for each of N - n samples; extending three blocks, two fused products for each
///   of `(n-1)^2` entries; the same for 2 (n - 1) entries of first columns.
/// - IV sums: 4n - 1 products for each of N - n samples; two blocks, one first column.
/// - Solve: elimination of m x m, `(m-1) m (2m-1) / 6` fused products; for each of m (m-1) / 2 multipliers one product,
///   and one fused product each for the right-hand side and for back substitution; m divisions and products with them;
///   b from h, n (n-1) / 2 fused products.
/// - Initial state: for each row the residual 1, two sums 4n, the response 4n - 1, the next row 2n - 1; D'D from its
///   last column, 3 fused products for each of n (n+1) / 2 entries; `L D L'`: `(n^3-n) / 6` fused products, for each of
///   n (n-1) / 2 factors one product and two fused ones, n divisions, n products.
/// - Auxiliary model: S N.
/// - Observer: the observer 6n K; for each of K - N samples the truth S, y(k) 2, the state's size 2n + 1, the error
///   3n + 2.
/// - Spectral radius: six steps of n numbers; p and its derivative 16 n, its terms 2n, distances 18 (n - 1), the rest.
/// - Impulse response: for each of L = 200 samples n products, all but one of them fused, and the error 3.
/// - FIT on fresh data: for each of L samples S twice, the mean 1, the spread 3, the error 3; no normal numbers.
fn flop(kernel: Kernel, cell: &DiscreteCell, rows: usize) -> usize {
    let (n, window, horizon) = (cell.order, cell.window, cell.horizon);
    let m = 2 * n;
    let sample = 4 * n - 1;
    match kernel {
        Kernel::Draw => 33 * (horizon + n) + (2 * n + 1) * horizon + n * (n + 1) + (sample + 4 + 4 + 2) * window,
        Kernel::LeastSquaresSums => 2 * (4 * n + 1) * (window - n) + 3 * 4 * (n - 1) * (n - 1) + 4 * 2 * (n - 1),
        Kernel::IvSums => 2 * (4 * n - 1) * (window - n) + 2 * 4 * (n - 1) * (n - 1) + 4 * (n - 1),
        Kernel::Solve => (m - 1) * m * (2 * m - 1) / 3 + 5 * m * (m - 1) / 2 + 2 * m + n * (n - 1),
        Kernel::InitialState => {
            (10 * n - 1) * rows + 3 * n * (n + 1) + (n * n * n - n) / 3 + 5 * n * (n - 1) / 2 + 2 * n
        }
        Kernel::Auxiliary => sample * window,
        Kernel::Observer => 6 * n * horizon + (sample + 2 + 2 * n + 1 + 3 * n + 2) * (horizon - window),
        Kernel::SpectralRadius => 6 * n * (18 * n + 18 * (n - 1) + 48),
        Kernel::ImpulseResponse => (2 * n - 1 + 3) * FRESH,
        Kernel::FreshFit => (2 * sample + 1 + 3 + 3) * FRESH,
        Kernel::Estimate => {
            let flop_of = |kernel| flop(kernel, cell, rows);
            flop_of(Kernel::LeastSquaresSums)
                + 4 * (flop_of(Kernel::IvSums) + flop_of(Kernel::Auxiliary))
                + 5 * (flop_of(Kernel::Solve) + flop_of(Kernel::InitialState))
        }
    }
}

/// Bytes that one run of a kernel reads and writes in one lane: samples (8 bytes each), and G and r of the sums. Each
/// number counts once per pass over it. Numbers that stay in registers or are read again from near caches do not count.
///
/// - Record: u and f to the horizon, y in the window.
/// - Sums: u and y, for IV yhat too; G and r, m (m + 1).
/// - Solve: G and r, p.
/// - Initial state: u and y in as many samples as D has rows; D'D, n (n + 1).
/// - Auxiliary model: u, yhat.
/// - Observer: u and f to the horizon, y in the window; true states of K - N samples, written and read.
/// - Impulse response: the impulse response of the plant. FIT on fresh data: u and y.
fn bytes(kernel: Kernel, cell: &DiscreteCell, rows: usize) -> usize {
    let (n, window, horizon) = (cell.order, cell.window, cell.horizon);
    let m = 2 * n;
    8 * match kernel {
        Kernel::Draw => 2 * horizon + window,
        Kernel::LeastSquaresSums => 2 * window + m * (m + 1),
        Kernel::IvSums => 3 * window + m * (m + 1),
        Kernel::Solve => m * (m + 1) + m,
        Kernel::InitialState => 2 * rows + n * (n + 1),
        Kernel::Auxiliary => 2 * window,
        Kernel::Observer => 2 * horizon + window + 2 * n * (horizon - window),
        Kernel::SpectralRadius => n,
        Kernel::ImpulseResponse => FRESH,
        Kernel::FreshFit => 2 * FRESH,
        Kernel::Estimate => {
            let numbers_of = |kernel| bytes(kernel, cell, rows) / 8;
            numbers_of(Kernel::LeastSquaresSums)
                + 4 * (numbers_of(Kernel::IvSums) + numbers_of(Kernel::Auxiliary))
                + 5 * (numbers_of(Kernel::Solve) + numbers_of(Kernel::InitialState))
        }
    }
}

/// Number of rows of D, for the true plant, until all of `c'A^k` is below 2^-80; the test is made at multiples of 32.
fn rows(a: &[f64], window: usize) -> usize {
    let mut row = vec![0.0; a.len()];
    row[0] = 1.0;
    for k in 1..=window {
        let last = row[a.len() - 1];
        row.rotate_right(1);
        row[0] = 0.0;
        row.iter_mut().zip(a).for_each(|(r, a)| *r += last * a);
        if k % 32 == 0 && row.iter().all(|r| r.abs() < 2.0_f64.powi(-80)) {
            return k;
        }
    }
    window
}

/// The stages of one trial on faer.
struct Faer<'e> {
    experiment: &'e Experiment,
    cell: &'e DiscreteCell,
    record: Realisation,
    information: Information,
    solver: Box<dyn SolveInstruments>,
    solution: Solution,
    pass: Pass,
    initial_state: InitialState,
    response: Response,
    x0: Vec<f64>,
    auxiliary: AuxiliaryModel,
    observer: Observer,
    estimator: InstrumentalVariables,
    passes: Vec<Pass>,
}

impl<'e> Faer<'e> {
    fn new(experiment: &'e Experiment) -> Result<Self> {
        let cell = experiment.cells[0].discrete().ok_or("records")?;
        let n = cell.order;
        let shape = Shape {
            order: n,
            window: cell.window,
        };
        let mut this = Self {
            experiment,
            cell,
            record: Realisation::default(),
            information: Information::new(n),
            solver: Solver::Partitioned.instruments(shape, Stage10::Corrected)?,
            solution: Solution::new(n),
            pass: Pass::new(n),
            initial_state: InitialState::new(n),
            response: Response::new(FRESH),
            x0: vec![0.0; n],
            auxiliary: AuxiliaryModel::new(n, cell.window, Drive::Model, Gain::DeadBeat),
            observer: Observer::new(Gain::DeadBeat, n),
            estimator: InstrumentalVariables::new(shape, &IvOptions::default())?,
            passes: vec![Pass::new(n); 5],
        };
        this.run(Kernel::Draw);
        this.run(Kernel::Estimate);
        let window = Window::new(&this.record.u, &this.record.y, cell.window);
        let kind = |kind| format!("{kind:?}");
        let solved = this.solver.least_squares(window, &mut this.solution);
        solved.map_err(kind)?;
        this.information.least_squares(window);
        this.run(Kernel::Auxiliary);
        Ok(this)
    }

    /// Runs the same stage as the lanes' kernel, except that the solve also computes its sums.
    fn run(&mut self, kernel: Kernel) {
        let (cell, record) = (self.cell, &mut self.record);
        if kernel == Kernel::Draw {
            let seed = self.experiment.file.seed;
            cell.realise(seed, 0, record);
            return;
        }
        let window = Window::new(&record.u, &record.y, cell.window);
        let Pass { a, b, x0, .. } = &self.passes[4];
        let instruments = Instruments::new(&self.auxiliary.yhat);
        match kernel {
            Kernel::Draw => {}
            Kernel::LeastSquaresSums => self.information.least_squares(window),
            Kernel::IvSums => self.information.instruments(window, instruments),
            Kernel::Solve => {
                let solution = &mut self.solution;
                let solved = self.solver.instruments(window, instruments, solution);
                let set = self.pass.set_parameters(&solution.p, solution.condition);
                let _ = black_box((solved, set));
            }
            Kernel::InitialState => {
                let found = self.initial_state.estimate(a, b, window, &mut self.x0);
                let _ = black_box(found);
            }
            Kernel::Auxiliary => {
                let _ = black_box(self.auxiliary.run(a, b, x0, window));
            }
            Kernel::SpectralRadius => {
                black_box(PoleFinder::new(cell.order).poles(a));
            }
            Kernel::ImpulseResponse => {
                black_box(
                    self.response
                        .impulse_response_error(System { a, b, d: 0.0 }, &mut self.x0),
                );
            }
            Kernel::FreshFit => {
                let plant = System {
                    a: &record.truth.a,
                    b: &record.truth.b,
                    d: 0.0,
                };
                let mut fresh = stream(1, 0, Purpose::FreshInput);
                let input = cell.process.input();
                input.fill(&mut fresh, self.response.input());
                self.response.set_fresh_output(plant, &mut self.x0);
                black_box(self.response.fresh_fit(System { a, b, d: 0.0 }, &mut self.x0));
            }
            Kernel::Estimate => {
                self.passes.iter_mut().for_each(Pass::clear);
                self.estimator.estimate(window, &mut self.passes);
            }
            Kernel::Observer => {
                let (n, states) = (cell.order, &record.states);
                let mut errors = StateError::default();
                let done = self.observer.run(
                    ObservedModel { a, b, x0 },
                    &record.u,
                    &record.y,
                    #[inline(always)]
                    |k, x_hat| {
                        if k >= cell.window {
                            errors.add(&states[k * n..(k + 1) * n], x_hat);
                        }
                    },
                );
                let _ = black_box((done, errors.relative.maximum()));
            }
        }
    }
}

/// A piece of code that is measured.
struct Timed<'a> {
    run: Box<dyn FnMut() + 'a>,
    /// Runs per round.
    count: u32,
    /// Nanoseconds per run, one number for each round.
    times: Vec<f64>,
}

impl<'a> Timed<'a> {
    fn new(mut run: impl FnMut() + 'a) -> Self {
        let (begin, mut count) = (Instant::now(), 0);
        while begin.elapsed() < STRETCH {
            run();
            count += 1;
        }
        Self {
            run: Box::new(run),
            count,
            times: Vec::new(),
        }
    }

    fn measure(&mut self) {
        let begin = Instant::now();
        for _ in 0..self.count {
            (self.run)();
        }
        let time = begin.elapsed().as_secs_f64() * 1e9;
        self.times.push(time / f64::from(self.count));
    }
}

/// The kernel of a stage in the lanes, and on faer.
fn stage<'e>(fast: &'e Experiment, slow: &'e Experiment, isa: Isa, kernel: Kernel) -> Result<[Timed<'e>; 2]> {
    let mut pack = Plan::new(fast, &fast.cells[0])?.first_pack(isa);
    let mut faer = Faer::new(slow)?;
    Ok([
        Timed::new(move || pack.run_kernel(kernel)),
        Timed::new(move || faer.run(kernel)),
    ])
}

/// Whole trials, `at_once` per run.
fn whole<'e>(experiment: &Experiment, at_once: u64, mut worker: Worker<'e>) -> Timed<'e> {
    let (mut trials, mut from) = (Trials::new(experiment, &experiment.cells[0]), 0);
    Timed::new(move || {
        trials.rows.clear();
        let ran = worker.run_into(from..from + at_once, &mut trials);
        ran.expect("trials");
        from += at_once;
        black_box(trials.rows.len());
    })
}

fn median(mut x: Vec<f64>) -> f64 {
    x.sort_by(f64::total_cmp);
    x[x.len() / 2]
}

/// Prints the nanoseconds of a trial in the lanes and on faer: the stages, all passes, the whole trial.
fn print(isa: Isa, lanes: usize, cell: &DiscreteCell, rows: usize, peak: f64, times: &[[f64; 2]]) {
    let (n, window, horizon) = (cell.order, cell.window, cell.horizon);
    println!("W98 (n = {n}, N = {window}, K = {horizon}), {isa}, lanes: {lanes}; a trial's share of a pack");
    println!("medians of {ROUNDS} rounds; peak of fused multiply-adds {peak:.1} Gflop/s\n");
    println!("stage              times     flop    bytes  lanes ns  of peak   faer ns  ratio");
    println!("{}", "-".repeat(79));
    let line = |name: &str, count: usize, work: [usize; 2], [fast, slow]: [f64; 2]| {
        let [flop, bytes] = work;
        let share = 100.0 * flop as f64 / fast / peak;
        let ratio = slow / fast;
        println!("{name:<18} {count:>5} {flop:>8} {bytes:>8} {fast:>9.1} {share:>6.1} % {slow:>9.0} {ratio:>6.1}");
    };
    let [iv_sums, estimate, whole] = [times[2], times[STAGES.len()], times[STAGES.len() + 1]];
    let (mut sum, mut sum_work) = ([0.0; 2], [0; 2]);
    for ((name, count, kernel), [fast, slow]) in STAGES.into_iter().zip(times.iter().copied()) {
        // On faer a solve also computes its sums.
        let slow = if kernel == Kernel::Solve {
            slow - iv_sums[1]
        } else {
            slow
        };
        let all = [fast, slow].map(|time| time * count as f64);
        let work = [flop, bytes].map(|work_of| count * work_of(kernel, cell, rows));
        line(name, count, work, all);
        sum = [sum[0] + all[0], sum[1] + all[1]];
        sum_work = [sum_work[0] + work[0], sum_work[1] + work[1]];
    }
    println!("{}", "-".repeat(79));
    line("sum", 1, sum_work, sum);
    line(
        "all passes",
        1,
        [flop, bytes].map(|work_of| work_of(Kernel::Estimate, cell, rows)),
        estimate,
    );
    line("whole trial", 1, sum_work, whole);
    println!(
        "\nA line is all of its stage in a trial. Whole trial less sum, {:.1} ns: what is not a\n\
         stage (errors of parameters, rows), and caches. Rows of D: {rows}. faer's record\n\
         simulates all K samples, the lanes' observer those after N; faer's solve, which\n\
         finds the condition number too, is timed with its sums, which are subtracted.",
        whole[0] - sum[0],
    );
}

fn main() -> Result<()> {
    let isa = match std::env::args().nth(1) {
        Some(name) => name.parse()?,
        None => Isa::best(),
    };
    if !isa.is_here() {
        return Err(format!("{isa} is not on this machine").into());
    }
    let file = ExperimentFile::parse(W98)?;
    let mut slow_file = file.clone();
    slow_file.engine = Engine::Faer;
    let (fast, slow) = (Experiment::new(file)?, Experiment::new(slow_file)?);
    let cell = &fast.cells[0];
    let of = cell.discrete().ok_or("records")?;
    let lanes = Plan::new(&fast, cell)?.pack(isa).lanes();

    let mut timed: Vec<[Timed<'_>; 2]> = Vec::new();
    for (_, _, kernel) in STAGES {
        timed.push(stage(&fast, &slow, isa, kernel)?);
    }
    timed.push(stage(&fast, &slow, isa, Kernel::Estimate)?);
    let pack = Worker::Lanes(Box::new(Plan::new(&fast, cell)?.pack(isa)));
    let trial = Worker::new(&slow, &slow.cells[0])?;
    timed.push([whole(&fast, lanes as u64, pack), whole(&slow, 1, trial)]);
    let mut peaks = Vec::new();
    for _ in 0..ROUNDS {
        peaks.push(fma_peak(isa, 1, STRETCH));
        for timed in timed.iter_mut().flatten() {
            timed.measure();
        }
    }
    let peak = median(peaks) / 1e9;
    let times: Vec<[f64; 2]> = timed
        .into_iter()
        .map(|[fast, slow]| [median(fast.times) / lanes as f64, median(slow.times)])
        .collect();
    print(
        isa,
        lanes,
        of,
        rows(&Faer::new(&slow)?.record.truth.a, of.window),
        peak,
        &times,
    );
    Ok(())
}
