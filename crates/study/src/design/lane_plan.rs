//! The part of an experiment that the lanes can run.

use crate::design::{Cell, DiscreteCell, Experiment, ObserverStart, RESPONSE_SAMPLES, ScoredFrom};
use asobench_identification::data::{Feedback, NoiseColour, PlantSource, Process, ProcessSettings, Truth};
use asobench_identification::plant::StateSpace;
use asobench_identification::signal::{Input, NoiseFilter, ProcessVariances};
use asobench_lanes::LARGEST_ORDER;
use asobench_lanes::pack::{PackMethod, PackPlan};
use asobench_lanes::record::RecordSource;
use asobench_lanes::score::Wanted;

/// The longest record of a pack: its lanes together take 256 MiB.
const LONGEST_HORIZON: usize = 1 << 20;

/// The computations of a pack for a cell.
///
/// The lanes cover open loops with one plant for all trials, of the estimator's order and at most [`LARGEST_ORDER`];
/// inputs without measurement noise; least squares and IV by the partitioned inverse, stage 10 corrected, with every
/// reading of E4, E11 and E12; every gain; and the measures that the table of measures marks.
pub struct Plan<'e>(pub(crate) PackPlan<'e>);

impl<'e> Plan<'e> {
    /// Makes the plan of a cell.
    ///
    /// # Errors
    /// The feature that the lanes do not cover, in words.
    pub fn new(experiment: &'e Experiment, cell: &'e Cell) -> Result<Self, String> {
        use crate::design::measure::Measure as F;
        let cell = cell.discrete().ok_or("continuous time")?;
        let (process, (plant, noise, variances)) = covered(experiment, cell)?;
        let file = &experiment.file;
        let asked = experiment.measures_asked();
        let any = |measures: &[F]| asked.iter().any(|measure| measures.contains(measure));
        let methods = experiment.methods.iter().filter_map(|method| {
            Some(PackMethod {
                options: method.options()?.in_lanes().ok()?,
                passes: method.passes(),
                reported: method.reported(),
            })
        });
        Ok(Self(PackPlan {
            source: RecordSource {
                settings: process.settings(),
                plant,
                noise,
                variances,
                seed: file.seed,
                eta: cell.eta,
                window: cell.window,
            },
            truth: Truth {
                a: plant.a().to_vec(),
                b: plant.b().to_vec(),
                h: plant.h(),
                x0: process.settings().x0.clone(),
            },
            order: cell.order,
            horizon: cell.horizon,
            gain: cell.gain.clone(),
            from_zero: cell.observer_start == ObserverStart::Zero,
            methods: methods.collect(),
            wanted_condition: any(&[F::Condition]),
            wanted_states: file.curves || asked.iter().any(|of| of.entry().of_state),
            wanted: Wanted {
                states_as_printed: any(&[F::ExMaxPrinted, F::ExRmsPrinted]),
                states_absolute: any(&[F::RmsState]),
                curves: file.curves,
            },
            wanted_radius: any(&[F::SpectralRadius]),
            wanted_impulse_response: any(&[F::ImpulseResponse]),
            wanted_fresh_fit: any(&[F::FreshFit]),
            response_samples: RESPONSE_SAMPLES,
            wanted_coefficients: file.parameters,
        }))
    }
}

/// A process, with its fixed plant, noise filter and variances.
type Covered<'e> = (&'e Process, (&'e StateSpace, &'e NoiseFilter, ProcessVariances));

/// Returns the process of a cell that lanes cover. The error says what they do not cover.
pub(crate) fn covered<'e>(experiment: &'e Experiment, cell: &'e DiscreteCell) -> Result<Covered<'e>, String> {
    let process = &cell.process;
    covers_process(process.settings())?;
    let open_loop = process.undisturbed();
    let open_loop = open_loop.ok_or("disturbances of the state")?;
    covers_cell(cell, open_loop.0.order())?;
    let asked = experiment.measures_asked();
    if let Some(measure) = asked.iter().find(|measure| !measure.entry().in_lanes) {
        return Err(format!("the measure {measure}"));
    }
    if experiment.file.course.is_some() {
        return Err("errors over the number of samples (course)".to_owned());
    }
    if experiment.file.coverage {
        return Err("standard errors of the coefficients (coverage = true)".to_owned());
    }
    for method in &experiment.methods {
        if method.observer().is_some() {
            return Err("observers of a method's own".to_owned());
        }
        if method.last().is_some() {
            return Err("a method on the last samples alone".to_owned());
        }
        let options = method.options().ok_or("an estimator of your own")?;
        options.in_lanes()?;
    }
    Ok((process, open_loop))
}

// The functions below destructure every field and name the values that lanes have. A new field does not
// compile until someone decides whether they have it, nor does a new value, unless it runs on faer.

/// Whether lanes cover the source of the records.
fn covers_process(settings: &ProcessSettings) -> Result<(), &'static str> {
    // `_`: handled by the code that draws single records, too.
    let ProcessSettings {
        plant,
        x0: _,
        x0_deviation,
        input,
        noise,
        level: _,
        input_noise,
        process_noise,
        state_noise,
        feedback,
        change,
    } = settings;
    let input = matches!(input, Input::Signs(_) | Input::Gaussian { .. } | Input::Samples(_));
    let gaussian = match noise {
        NoiseColour::InverseDenominator => true,
        NoiseColour::Filter(filter) => filter.is_gaussian(),
    };
    let has = [
        (input, "an input through a filter"),
        (change.is_none(), "a plant that changes"),
        (gaussian, "noise that is not Gaussian"),
        (matches!(feedback, Feedback::None), "feedback"),
        (matches!(plant, PlantSource::Fixed(_)), "random plants"),
        (*input_noise == 0.0, "input noise"),
        (*process_noise == 0.0 && state_noise.is_none(), "process noise"),
        (*x0_deviation == 0.0, "random initial states"),
    ];
    let missing = has.into_iter().find(|(has, _)| !has);
    missing.map_or(Ok(()), |(_, what)| Err(what))
}

/// Whether lanes cover a cell with a plant of this order.
fn covers_cell(cell: &DiscreteCell, of_plant: usize) -> Result<(), String> {
    let DiscreteCell {
        process: _,
        eta: _,
        order,
        window: _,
        horizon,
        gain: _,
        observer_start,
        scored_from,
        ahead: _,
        covariances: _,
    } = cell;
    if *order != of_plant {
        return Err("an order that is not the plant's".to_owned());
    }
    if *order > LARGEST_ORDER {
        return Err(format!("orders above {LARGEST_ORDER}"));
    }
    if *horizon > LONGEST_HORIZON {
        return Err(format!("records of more than {LONGEST_HORIZON} samples"));
    }
    match (observer_start, scored_from) {
        (ObserverStart::Estimate | ObserverStart::Zero, ScoredFrom::Window) => Ok(()),
        (_, ScoredFrom::Start) => Err(format!("scored_from = \"{scored_from}\"")),
    }
}
