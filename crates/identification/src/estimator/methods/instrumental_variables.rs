//! Instrumental variables: least squares as iteration 0, then passes of stages 7 to 10 (stage 11).

use super::arx::ArxOptions;
use super::least_squares::{LeastSquaresErrors, conclude, iteration_zero};
use crate::estimator::auxiliary::AuxiliaryModel;
use crate::estimator::covariance::Covariance;
use crate::estimator::covariance::freedom;
use crate::estimator::general_iv::{GeneralIv, GeneralOptions};
use crate::estimator::initial_state_choice::{StartState, StateEstimate};
use crate::estimator::instruments::{InstrumentalRegression, Instruments as InstrumentsOf, Signals};
use crate::estimator::iv_options::{Auxiliary, Drive, InstrumentSource, IvOptions, MOST_ITERATIONS};
use crate::estimator::method_kind::{MethodKind, Needs, OptionUnits, Output, Problem};
use crate::estimator::option_error::OptionError;
use crate::estimator::other_tools::Reading;
use crate::estimator::reflection::{PoleReflection, Stabilise};
use crate::estimator::regression::Rows;
use crate::estimator::solver::{Instruments, Solution, SolveInstruments};
use crate::estimator::{Estimator, FailureKind, Pass, Progress, SetupError, Shape, Solver, Stage, Stage10, Window};
use crate::model::Orders;

impl IvOptions {
    /// Returns the options of the general form if one is given that the paper's form does not have; otherwise `None`.
    fn general(&self, order: usize) -> Option<GeneralOptions> {
        let asked =
            self.orders.is_some() || self.rows.is_some() || self.reading.is_some() || self.fixed_model.is_some();
        asked.then(|| GeneralOptions {
            orders: self.orders.unwrap_or(Orders::arx(order, order, 1)),
            rows: self.rows.unwrap_or_default(),
            reading: self.reading,
            fixed_model: self.fixed_model.clone(),
            initial_state: self.initial_state,
            covariance: self.covariance.unwrap_or_default(),
        })
    }

    /// Returns the same options with orders, which only the general form has.
    fn in_general_form(&self, order: usize) -> Self {
        Self {
            orders: self.orders.or(Some(Orders::arx(order, order, 1))),
            ..self.clone()
        }
    }

    /// Checks that the options of the paper's form alone have their defaults if one of the general form is given.
    fn check_general(&self) -> Result<(), OptionError> {
        let Some(general) = self.general(1) else {
            return Ok(());
        };
        if general.reading.is_some() {
            Reading::refuse(self.rows, None)?;
        }
        let paper = Self::default();
        let other = [
            (self.solver != paper.solver, "solver"),
            (self.stage10 != paper.stage10, "stage10"),
            (self.auxiliary != paper.auxiliary, "auxiliary"),
            (self.drive != paper.drive, "drive"),
            (self.instruments != paper.instruments, "instruments"),
            (self.stabilise != paper.stabilise, "stabilise"),
        ];
        if let Some((_, key)) = other.into_iter().find(|(differs, _)| *differs) {
            let message = "applies to the paper's form only; leave out orders, rows, reading and fixed_model";
            return Err(OptionError::new(key, message));
        }
        ArxOptions::check_orders(self.orders)
    }

    /// Returns how many passes follow iteration 0: one if the instruments are not renewed.
    fn passes(&self) -> usize {
        match (self.reading, &self.fixed_model) {
            (None, None) => self.iterations,
            _ => 1,
        }
    }
}

impl MethodKind for IvOptions {
    fn check(&self) -> Result<(), OptionError> {
        if !(1..=MOST_ITERATIONS).contains(&self.iterations) {
            let message = format!("{}; expected 1 to {MOST_ITERATIONS}", self.iterations);
            return Err(OptionError::new("iterations", message));
        }
        let (stage10, solver) = (self.stage10, self.solver);
        if stage10 != Stage10::Corrected && solver != Solver::Partitioned {
            let message = format!("'{stage10}' exists for solver 'partitioned' only, not '{solver}'");
            return Err(OptionError::new("stage10", message));
        }
        self.check_general()
    }

    fn model_orders(&self, setting: usize) -> Option<Orders> {
        self.general(setting).map(|general| general.orders)
    }

    /// Iteration 0 of "iv" is "ls".
    fn outputs(&self, name: &str) -> Vec<Output> {
        let name_of = |pass| {
            if name == "iv" && pass == 0 { "ls" } else { name }
        };
        let output = |pass| Output {
            estimator: name_of(pass).to_owned(),
            pass,
        };
        (0..=self.passes()).map(output).collect()
    }

    fn needs(&self) -> Needs {
        let of_reference = self.instruments == InstrumentSource::Reference;
        Needs {
            reference: of_reference.then(|| ("instruments", self.instruments.name())),
            ..Needs::default()
        }
    }

    fn option_units(&self) -> OptionUnits {
        match (&self.reading, &self.fixed_model) {
            (Some(_), _) => OptionUnits::Signals,
            (None, fixed) => OptionUnits::Gain.only_if(fixed.is_some()),
        }
    }

    fn begins_at_rest(&self) -> bool {
        self.rows.is_some_and(|rows| rows != Rows::Complete)
    }

    /// By the general form.
    fn takes_runs(&self) -> bool {
        let asked = self.in_general_form(1).check_general().is_ok();
        asked && !self.begins_at_rest() && self.reading.is_none()
    }

    fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
        let runs = problem.runs();
        let order = problem.shape.order;
        let general = match runs.count() {
            1 => self.general(order),
            _ => self.in_general_form(order).general(order),
        };
        if let Some(general) = general {
            return Ok(Box::new(GeneralIv::new(general, runs)?));
        }
        let mut paper = InstrumentalVariables::new(problem.shape, self)?;
        if problem.covariance {
            let kind = self.covariance.unwrap_or_default();
            let passes = (problem.shape, self.iterations);
            let errors = InstrumentalErrors::new(passes, kind, problem.reported)?;
            paper.errors = Some(errors);
        }
        Ok(Box::new(paper))
    }

    fn in_lanes(&self) -> Option<Result<IvOptions, String>> {
        // The ignored fields (`_`): any number of passes and every gain is possible; lanes do not run if standard
        // errors are wanted.
        let Self {
            iterations: _,
            solver,
            stage10,
            auxiliary,
            drive,
            gain: _,
            instruments,
            stabilise,
            initial_state,
            orders,
            rows,
            reading,
            fixed_model,
            covariance: _,
        } = self;
        let partitioned = matches!(solver, Solver::Partitioned);
        let corrected = matches!(stage10, Stage10::Corrected);
        let renews = matches!(auxiliary, Auxiliary::Refresh | Auxiliary::Frozen | Auxiliary::Literal);
        let drives = matches!(drive, Drive::Model | Drive::Observer);
        let of_input = matches!(instruments, InstrumentSource::Input);
        let as_found = matches!(stabilise, Stabilise::None);
        let papers = orders.is_none() && rows.is_none();
        let own = reading.is_none() && fixed_model.is_none();
        let starts = matches!(initial_state, StartState::Estimate | StartState::Zero);
        let has = [
            (partitioned, ("solver", solver.name())),
            (corrected, ("stage10", stage10.name())),
            (renews, ("auxiliary", auxiliary.name())),
            (drives, ("drive", drive.name())),
            (of_input, ("instruments", instruments.name())),
            (as_found, ("stabilise", stabilise.name())),
            (starts, ("initial_state", initial_state.name())),
            (papers && own, ("orders, rows, reading or fixed_model", "given")),
        ];
        let missing = has.into_iter().find(|(has, _)| !has);
        Some(match missing {
            None => Ok(self.clone()),
            Some((_, (key, value))) => Err(format!("{key} = \"{value}\"")),
        })
    }
}

/// The IV estimator: pass 0 is least squares; passes 1, 2, ... use instruments from the previous pass.
pub struct InstrumentalVariables {
    auxiliary: Auxiliary,
    solver: Box<dyn SolveInstruments>,
    solution: Solution,
    state: StateEstimate,
    model: AuxiliaryModel,
    source: InstrumentSource,
    reflection: Option<PoleReflection>,
    /// Present if standard errors are wanted.
    errors: Option<InstrumentalErrors>,
}

/// Computes the covariance of the passes of which it is wanted.
struct InstrumentalErrors {
    wanted: Vec<bool>,
    first: LeastSquaresErrors,
    instruments: InstrumentalRegression,
    /// The pass whose equations were solved last, and the variance of their errors.
    solved: Option<(usize, f64)>,
}

impl InstrumentalErrors {
    /// Makes buffers for so many passes besides iteration 0; `reported`: those whose covariance is wanted, or all.
    fn new((shape, passes): (Shape, usize), kind: Covariance, reported: Option<&[usize]>) -> Result<Self, SetupError> {
        let orders = Orders::arx(shape.order, shape.order, 1);
        let signal = InstrumentsOf::Signal;
        let wanted = |pass| reported.is_none_or(|of| of.contains(&pass));
        Ok(Self {
            wanted: (0..=passes).map(wanted).collect(),
            first: LeastSquaresErrors::new(shape, kind)?,
            instruments: InstrumentalRegression::new(orders, signal, Rows::Complete, shape.window)?,
            solved: None,
        })
    }

    /// Sets the covariance of an IV pass with these instruments, if it is wanted.
    fn set(&mut self, window: Window<'_>, instruments: Instruments<'_>, number: usize, pass: &mut Pass) {
        if !self.wanted[number] {
            return;
        }
        let regression = &mut self.instruments;
        let signals = Signals {
            v: instruments.input,
            ..Signals::new(window.u, window.y, instruments.output)
        };
        let solved = regression.solve(signals);
        let freedom = freedom(regression.rows(), regression.theta().len());
        let Some(freedom) = freedom.filter(|_| solved.is_ok()) else {
            return;
        };
        let variance = regression.residual_sum() / freedom;
        pass.model.noise_variance = variance;
        regression.covariance(self.first.kind, variance, &mut pass.model.covariance);
        self.solved = Some((number, variance));
    }

    /// Sets the covariances for another assumption, of passes that were copied. Returns false if more was
    /// solved than is kept.
    fn set_again(&mut self, kind: Covariance, passes: &mut [Pass]) -> bool {
        let mut wanted = (0..passes.len()).filter(|number| self.wanted[*number]);
        let (Some(number @ 1..), None) = (wanted.next(), wanted.next()) else {
            return false;
        };
        if let Some((solved, variance)) = self.solved {
            debug_assert_eq!(solved, number);
            let to = &mut passes[number].model.covariance;
            self.instruments.covariance(kind, variance, to);
        }
        true
    }
}

impl InstrumentalVariables {
    /// Makes buffers for a shape.
    ///
    /// # Errors
    /// As for [`Solver::instruments`]; also if the gain does not fit the order, or if instruments are to be formed from
    /// r by an observer, which y drives.
    pub fn new(shape: Shape, options: &IvOptions) -> Result<Self, SetupError> {
        options.gain.check(shape.order)?;
        if options.instruments == InstrumentSource::Reference && options.drive != Drive::Model {
            return Err(SetupError::ReferenceNeedsModel(options.drive));
        }
        let reflect = options.stabilise == Stabilise::Reflect;
        Ok(Self {
            auxiliary: options.auxiliary,
            solver: options.solver.instruments(shape, options.stage10)?,
            solution: Solution::new(shape.order),
            state: StateEstimate::new(shape.order, options.initial_state),
            model: AuxiliaryModel::new(shape.order, shape.window, options.drive, options.gain.clone()),
            source: options.instruments,
            reflection: reflect.then(|| PoleReflection::new(shape.order)),
            errors: None,
        })
    }

    /// Computes stage 7: yhat of A-hat of `previous` with b and x0 of `source`, stabilised if asked for.
    fn simulate(&mut self, window: Window<'_>, previous: &Pass, source: &Pass) -> Result<(), FailureKind> {
        let input = match self.source {
            InstrumentSource::Input => window.u,
            InstrumentSource::Reference => window.r,
        };
        let (a, b) = match &mut self.reflection {
            Some(reflection) if previous.unstable => reflection.run(&previous.a, &source.b)?,
            _ => (previous.a.as_slice(), source.b.as_slice()),
        };
        self.model.run_driven(a, b, &source.x0, window, input, 0)
    }

    /// Runs one pass: stages 7 to 10, and 5 and 6 if the reading includes them.
    fn pass(&mut self, window: Window<'_>, number: usize, first: &Pass, previous: &Pass, pass: &mut Pass) {
        // Reading E4 decides whose b and x0 drive the auxiliary model.
        let source = match self.auxiliary {
            Auxiliary::Refresh => previous,
            Auxiliary::Frozen | Auxiliary::Literal => first,
        };
        if let Err(kind) = self.simulate(window, previous, source) {
            return pass.fail_at(Stage::AuxiliaryModel, number, kind);
        }
        self.solution.condition = f64::NAN;
        let instruments = Instruments {
            output: &self.model.yhat,
            input: (self.source == InstrumentSource::Reference).then_some(window.r),
        };
        let solved = self.solver.instruments(window, instruments, &mut self.solution);
        if !conclude(solved, &self.solution, Stage::Instruments, number, pass) {
            return;
        }
        if let Some(errors) = &mut self.errors {
            errors.set(window, instruments, number, pass);
        }
        match self.auxiliary {
            Auxiliary::Refresh => self.state.estimate(window, number, pass),
            kept => keep_first(kept, first, pass),
        }
    }

    /// Runs the passes from a number on; those before are done.
    fn run_from(&mut self, number: usize, window: Window<'_>, passes: &mut [Pass]) {
        for number in number..passes.len() {
            let (done, rest) = passes.split_at_mut(number);
            let (first, previous, pass) = (&done[0], &done[number - 1], &mut rest[0]);
            if previous.progress == Progress::InitialState {
                self.pass(window, number, first, previous, pass);
            } else {
                // Nothing to start from: the failure is passed on.
                pass.failure = previous.failure;
            }
        }
    }
}

/// Gives a pass, whose a is known, what this reading keeps of iteration 0.
fn keep_first(auxiliary: Auxiliary, first: &Pass, pass: &mut Pass) {
    if auxiliary == Auxiliary::Literal {
        pass.b.copy_from_slice(&first.b);
    }
    if auxiliary != Auxiliary::Refresh {
        pass.set_initial_state(&first.x0);
    }
}

impl Estimator for InstrumentalVariables {
    fn estimate(&mut self, window: Window<'_>, passes: &mut [Pass]) {
        for pass in &mut *passes {
            pass.clear();
        }
        let Some(first) = passes.first_mut() else {
            return;
        };
        let (solution, state) = (&mut self.solution, &mut self.state);
        iteration_zero(&mut *self.solver, solution, state, window, first);
        if let Some(errors) = &mut self.errors {
            errors.solved = None;
            if errors.wanted[0] {
                errors.first.set(window, first);
            }
        }
        self.run_from(1, window, passes);
    }

    /// Standard errors of known passes are not known: with them everything is estimated.
    fn estimate_from(&mut self, known: &[Pass], window: Window<'_>, passes: &mut [Pass]) {
        let count = known.len().min(passes.len());
        if count == 0 || self.errors.is_some() {
            return self.estimate(window, passes);
        }
        for (pass, known) in passes.iter_mut().zip(known) {
            pass.assign(known);
        }
        let (first, others) = passes[..count].split_at_mut(1);
        for pass in others {
            if pass.progress >= Progress::Parameters && self.auxiliary != Auxiliary::Refresh {
                // A failure of `refresh` with x0 does not matter here.
                pass.failure = None;
                keep_first(self.auxiliary, &first[0], pass);
            }
        }
        for pass in &mut passes[count..] {
            pass.clear();
        }
        if count < passes.len() {
            self.solver.begin(window, &mut self.solution);
            self.run_from(count, window, passes);
        }
    }

    fn estimate_again(&mut self, covariance: Covariance, _: Window<'_>, found: &[Pass], passes: &mut [Pass]) -> bool {
        let Some(errors) = &mut self.errors else {
            return false;
        };
        for (pass, found) in passes.iter_mut().zip(found) {
            pass.assign(found);
        }
        errors.set_again(covariance, passes)
    }
}
