//! Measures passes against the truth.

use crate::design::file::{InformationOf, Unfinished};
use crate::design::{CellObserver, DiscreteCell, Experiment, Measure, ObserverStart, RESPONSE_SAMPLES};
use crate::outcome::row::Row;
use asobench_identification::data::{Realisation, Truth};
use asobench_identification::diagnosis::Whiteness;
use asobench_identification::estimator::{Failure, FailureKind, Pass, Progress, SetupError, Stage};
use asobench_identification::metric::{
    Response, StateError, System, fit_ahead, relative_error, relative_error_as_printed,
};
use asobench_identification::observer::ObservedModel;
use asobench_identification::plant::{PoleFinder, StateSpace};
use asobench_identification::real::with_fma;
use asobench_identification::signal::{Input, Purpose, stream};
use asobench_identification::theory::{FisherInformation, OwnInformation, ResponseBound};

/// Measures passes of one cell, with its own buffers.
pub(crate) struct Scorer {
    /// The first sample at which the state's error counts.
    from: usize,
    unfinished: Unfinished,
    start: ObserverStart,
    zero: Vec<f64>,
    /// The order for which each method's observer was made.
    orders: Vec<usize>,
    /// One for each method.
    observers: Vec<CellObserver>,
    poles: PoleFinder,
    input: Input,
    response: Response,
    /// The information of a record, if d is wanted and there is one.
    information: Option<FisherInformation>,
    /// The bound of the response, if `d_g` is wanted and there is one.
    bound: Option<ResponseBound>,
    /// Where these two are each record's own: their source, the plant and the window.
    own: Option<(OwnInformation, StateSpace, usize)>,
    /// Room for the state of the plant or of a model.
    x: Vec<f64>,
    /// Whether each measure is asked for; one that takes time is computed only then.
    asked: Vec<bool>,
    /// Whether stage 12 runs.
    observes: bool,
    /// Steps of predictions ahead, and the window, which determines the predictor's start.
    ahead: (usize, usize),
    /// Error of the states that the trial's controller fed back; empty without one.
    fed_back: StateError,
    /// The innovations of the scored samples; empty if not wanted.
    innovations: Vec<f64>,
    /// e_x(k), k = 0 ... K-1, of the pass measured last; NaN if undefined, empty if not wanted.
    curve: Vec<f64>,
}

impl Scorer {
    /// # Errors
    /// If a method's observer cannot serve the cell.
    pub(crate) fn new(experiment: &Experiment, cell: &DiscreteCell) -> Result<Self, SetupError> {
        let process = &cell.process;
        let asked = experiment.measures_asked();
        let methods = experiment.methods.iter();
        // States of a model of another order cannot be compared with the plant's.
        let comparable = methods
            .clone()
            .any(|method| method.order(cell.order) == process.order());
        let largest = methods.clone().map(|method| method.order(cell.order)).max();
        let largest = largest.unwrap_or(cell.order).max(process.order());
        let [distance, response] = [Measure::Distance, Measure::ResponseDistance].map(|of| asked.contains(&of));
        let wanted = distance || response;
        let is_own = wanted && experiment.file.information == InformationOf::Record;
        let information = || {
            let of_record = || FisherInformation::new(process, cell.eta, cell.window).ok();
            (wanted && !is_own).then(of_record).flatten()
        };
        let own = || {
            let own = OwnInformation::new(process, cell.eta, cell.window).ok()?;
            Some((own, process.plant()?.clone(), cell.window))
        };
        let observers: Result<_, SetupError> = methods.map(|method| CellObserver::new(cell, method)).collect();
        Ok(Self {
            from: cell.first_scored(),
            unfinished: experiment.file.unfinished,
            start: cell.observer_start,
            zero: vec![0.0; process.order()],
            orders: experiment.methods.iter().map(|m| m.order(cell.order)).collect(),
            observers: observers?,
            poles: PoleFinder::new(cell.order),
            input: process.input().clone(),
            response: Response::new(RESPONSE_SAMPLES),
            information: information().filter(|_| distance),
            bound: process.plant().filter(|_| response).and_then(|plant| {
                let information = information()?;
                ResponseBound::new(&information, plant).ok()
            }),
            own: is_own.then(own).flatten(),
            x: vec![0.0; largest],
            fed_back: StateError::default(),
            observes: comparable && (experiment.file.curves || asked.iter().any(|of| of.entry().of_state)),
            ahead: (cell.ahead, cell.window),
            asked: Measure::ALL.iter().map(|of| asked.contains(of)).collect(),
            innovations: Vec::new(),
            curve: vec![f64::NAN; if experiment.file.curves { cell.horizon } else { 0 }],
        })
    }

    /// Prepares for scoring the passes of a trial.
    pub(crate) fn begin(&mut self, seed: u64, trial: u64, record: &Realisation) {
        self.fed_back = StateError::default();
        if record.failure.is_some() {
            return;
        }
        if let Some((own, plant, window)) = &self.own {
            let information = own.of(&record.r[..*window], record.scale).ok();
            let bound = information
                .as_ref()
                .filter(|_| self.asked[Measure::ResponseDistance as usize]);
            self.bound = bound.and_then(|of| ResponseBound::new(of, plant).ok());
            self.information = information.filter(|_| self.asked[Measure::Distance as usize]);
        }
        let n = record.truth.a.len();
        let estimates = record.estimates.chunks_exact(n);
        let pairs = record.states.chunks_exact(n).zip(estimates);
        let fed_back = &mut self.fed_back;
        with_fma(
            #[inline(always)]
            || {
                for (x, x_hat) in pairs {
                    fed_back.add(x, x_hat);
                }
            },
        );
        let Truth { a, b, .. } = &record.truth;
        let (plant, x) = (System { a, b, d: 0.0 }, &mut self.x[..a.len()]);
        let response = &mut self.response;
        if self.asked[Measure::ImpulseResponse as usize] {
            with_fma(
                #[inline(always)]
                || response.set_impulse_response(plant, x),
            );
        }
        if self.asked[Measure::FreshFit as usize] {
            let mut fresh = stream(seed, trial, Purpose::FreshInput);
            self.input.fill(&mut fresh, response.input());
            with_fma(
                #[inline(always)]
                || response.set_fresh_output(plant, x),
            );
        }
    }

    /// Returns e_x(k) of the pass measured last.
    pub(crate) fn curve(&self) -> &[f64] {
        &self.curve
    }

    /// Fills the row of a pass of a method. `number` is the pass's number, used for its failures.
    pub(crate) fn score(&mut self, method: usize, number: usize, pass: &Pass, record: &Realisation, row: &mut Row) {
        row.failure = pass.failure;
        if let (Some(failure), Unfinished::Counted) = (&mut row.failure, self.unfinished) {
            failure.kind = failure.kind.counted();
        }
        let truth = &record.truth;
        row[Measure::Condition] = pass.condition;
        row[Measure::FedBackMax] = self.fed_back.relative.maximum();
        row[Measure::FedBackRms] = self.fed_back.relative.rms();
        let fed_back = [Measure::FedBackMax, Measure::FedBackRms];
        if fed_back.iter().any(|of| row[*of].is_infinite()) {
            for of in fed_back {
                row[of] = f64::NAN;
            }
            row.failure.get_or_insert(Failure {
                kind: FailureKind::NonFinite,
                stage: Stage::Observer,
                pass: number,
            });
            return;
        }
        self.curve.fill(f64::NAN);
        if pass.progress < Progress::Parameters {
            return;
        }
        row.unstable = Some(pass.unstable);
        if self.asked[Measure::SpectralRadius as usize] {
            row[Measure::SpectralRadius] = self.poles.spectral_radius(&pass.a, !pass.unstable);
        }
        let Pass { a, b, direct, .. } = pass;
        // A user's own method may return a model of any order.
        self.x.resize(self.x.len().max(a.len()), 0.0);
        let (model, x) = (System { a, b, d: *direct }, &mut self.x[..a.len()]);
        let response = &self.response;
        if self.asked[Measure::ImpulseResponse as usize] {
            row[Measure::ImpulseResponse] = with_fma(
                #[inline(always)]
                || response.impulse_response_error(model, x),
            );
        }
        if self.asked[Measure::FreshFit as usize] {
            row[Measure::FreshFit] = with_fma(
                #[inline(always)]
                || response.fresh_fit(model, x),
            );
        }
        if self.asked[Measure::FitAhead as usize] {
            let (steps, window) = self.ahead;
            let scored = self.from..record.y.len();
            row[Measure::FitAhead] = fit_ahead(&pass.model, &record.u, &record.y, window, scored, steps);
        }
        if let Some(bound) = &self.bound {
            row[Measure::ResponseDistance] = bound.distance(a, b, *direct);
        }
        if let Some(information) = &self.information {
            row[Measure::Distance] = information.distance([&pass.a, &pass.h], [&truth.a, &truth.h]);
        }
        if truth.a.len() != pass.a.len() {
            return;
        }
        for (truth, found, relative, printed) in [
            (&truth.a, &pass.a, Measure::Ea, Measure::EaPrinted),
            (&truth.b, &pass.b, Measure::Eb, Measure::EbPrinted),
            (&truth.h, &pass.h, Measure::Eh, Measure::EhPrinted),
        ] {
            row[relative] = relative_error(truth, found);
            row[printed] = relative_error_as_printed(truth, found);
        }
        let Some(mut model) = pass.observed() else {
            return;
        };
        row[Measure::Ex0] = relative_error(&truth.x0, model.x0);
        row[Measure::Ex0Printed] = relative_error_as_printed(&truth.x0, model.x0);
        if !self.observes || self.orders[method] != model.a.len() {
            return;
        }
        let zero = std::mem::take(&mut self.zero);
        if self.start == ObserverStart::Zero {
            model.x0 = &zero;
        }
        if let Err(kind) = self.observe(method, (pass, model), record, row) {
            self.curve.fill(f64::NAN);
            row.failure = Some(Failure {
                kind,
                stage: Stage::Observer,
                pass: number,
            });
        }
        self.zero = zero;
    }

    /// Stage 12: runs the observer from k = 0 to K, and takes its errors from the first scored sample on.
    fn observe(
        &mut self,
        method: usize,
        (pass, model): (&Pass, ObservedModel<'_>),
        record: &Realisation,
        row: &mut Row,
    ) -> Result<(), FailureKind> {
        let mut errors = StateError::default();
        let (from, curve, states) = (self.from, &mut self.curve, &record.states);
        let tested = self.asked[Measure::InnovationsWhite as usize];
        let innovations = &mut self.innovations;
        innovations.clear();
        self.observers[method].run(
            pass,
            model,
            &record.u,
            &record.y,
            #[inline(always)]
            |k, x_hat, e| {
                if tested && k >= from {
                    innovations.push(e);
                }
                // The length of xhat is a constant for small orders.
                let n = x_hat.len();
                let x = &states[k * n..(k + 1) * n];
                let curve = curve.get_mut(k);
                if k >= from {
                    let square = errors.add(x, x_hat);
                    if let Some(error) = curve {
                        *error = square.sqrt();
                    }
                } else if let Some(error) = curve {
                    *error = StateError::default().add(x, x_hat).sqrt();
                }
            },
        )?;
        let values = [
            (Measure::ExMax, errors.relative.maximum()),
            (Measure::ExRms, errors.relative.rms()),
            (Measure::ExMaxPrinted, errors.as_printed.maximum()),
            (Measure::ExRmsPrinted, errors.as_printed.rms()),
        ];
        let absolute = Some(errors.absolute.rms()).filter(|_| self.asked[Measure::RmsState as usize]);
        let values = values.into_iter().chain(absolute.map(|rms| (Measure::RmsState, rms)));
        if values.clone().any(|(_, value)| value.is_infinite()) {
            return Err(FailureKind::NonFinite);
        }
        for (measure, value) in values {
            row[measure] = value;
        }
        if tested && let Some(test) = Whiteness::of(innovations, 0) {
            row[Measure::InnovationsWhite] = test.p_value;
        }
        Ok(())
    }
}
