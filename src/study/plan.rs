//! What of an experiment the lanes can run.

use super::pack::{Pack, PackTrial};
use super::{Cell, Experiment, Measure, ObserverStart, ScoredFrom};
use crate::data::{Process, Truth};
use crate::estimator::{
    Drive, InstrumentSource, IvOptions, MethodOptions, Solver, Stabilise, Stage10,
};
use crate::lanes::record::Source;
use crate::lanes::score::Wanted;
use crate::lanes::{Call, Isa, LARGEST_ORDER};
use crate::plant::StateSpace;
use crate::real::Real;
use crate::signal::{NoiseFilter, ProcessVariances};

/// The longest record of a pack: all lanes of it take 256 MiB.
const LONGEST_HORIZON: usize = 1 << 20;

/// A method of a plan.
pub(super) struct PlannedMethod<'e> {
    pub(super) options: IvOptions,
    pub(super) passes: usize,
    pub(super) reported: &'e [usize],
}

/// What a cell asks of a pack.
///
/// Covered are open loops with one plant for all trials, of an order up to [`LARGEST_ORDER`] that
/// is also the estimator's; inputs without measurement noise; least squares and IV by the
/// partitioned inverse, stage 10 corrected, with every reading of E4 and E11, every gain, and the
/// measures that lanes compute (the table of measures).
#[expect(clippy::struct_excessive_bools, reason = "what is asked for")]
pub struct Plan<'e> {
    pub(super) cell: &'e Cell,
    pub(super) source: Source<'e>,
    pub(super) truth: Truth,
    pub(super) methods: Vec<PlannedMethod<'e>>,
    pub(super) wanted_condition: bool,
    pub(super) wanted_states: bool,
    pub(super) wanted: Wanted,
    pub(super) wanted_radius: bool,
    pub(super) from_zero: bool,
}

impl<'e> Plan<'e> {
    /// The plan of a cell.
    ///
    /// # Errors
    /// What is not covered, in words.
    pub fn new(experiment: &'e Experiment, cell: &'e Cell) -> Result<Self, String> {
        use Measure as F;
        let (process, (plant, noise, variances)) = covered(experiment, cell)?;
        let file = &experiment.file;
        let asked = experiment.measures_asked();
        let any = |measures: &[F]| asked.iter().any(|measure| measures.contains(measure));
        let methods = experiment.methods.iter().filter_map(|method| {
            Some(PlannedMethod {
                options: iv_options(method.options()?)?,
                passes: method.passes(),
                reported: method.reported(),
            })
        });
        Ok(Self {
            cell,
            source: Source {
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
            methods: methods.collect(),
            wanted_condition: any(&[F::Condition]),
            wanted_states: file.curves || asked.iter().any(|of| of.is_of_state()),
            wanted: Wanted {
                states_as_printed: any(&[F::ExMaxPrinted, F::ExRmsPrinted]),
                curves: file.curves,
            },
            wanted_radius: any(&[F::SpectralRadius]),
            from_zero: cell.observer_start == ObserverStart::Zero,
        })
    }

    /// The buffers to run it.
    ///
    /// # Panics
    /// If this machine does not have the instructions.
    pub fn pack(self, isa: Isa) -> Box<dyn PackTrial + 'e> {
        isa.dispatch(self.cell.order, self)
    }
}

impl<'e> Call for Plan<'e> {
    type Output = Box<dyn PackTrial + 'e>;

    fn with<R: Real, const N: usize>(self) -> Self::Output {
        Box::new(Pack::<R, N>::new(self))
    }
}

/// Least squares as IV without iterations; `None` for what lanes do not cover.
fn iv_options(options: &MethodOptions) -> Option<IvOptions> {
    match options {
        MethodOptions::LeastSquares(options) => Some(IvOptions {
            solver: options.solver,
            initial_state: options.initial_state,
            ..IvOptions::default()
        }),
        MethodOptions::InstrumentalVariables(options) => Some(options.clone()),
        MethodOptions::Known => None,
    }
}

/// A process, with its fixed plant, noise filter and variances.
type Covered<'e> = (
    &'e Process,
    (&'e StateSpace, &'e NoiseFilter, ProcessVariances),
);

/// The process of a cell that lanes cover; or what they do not, in words.
pub(super) fn covered<'e>(
    experiment: &'e Experiment,
    cell: &'e Cell,
) -> Result<Covered<'e>, String> {
    let process = cell.process().ok_or("continuous time")?;
    let open_loop = process.open_loop();
    let open_loop = open_loop.ok_or("feedback, input noise or random plants")?;
    if process.undisturbed().is_none() {
        return Err("process noise or random initial states".to_owned());
    }
    if cell.scored_from != ScoredFrom::Window {
        return Err(format!("scored_from = \"{}\"", cell.scored_from));
    }
    let order = open_loop.0.order();
    if cell.order != order {
        return Err("an order that is not the plant's".to_owned());
    }
    if order > LARGEST_ORDER {
        return Err(format!("orders above {LARGEST_ORDER}"));
    }
    if cell.horizon > LONGEST_HORIZON {
        return Err(format!("records of more than {LONGEST_HORIZON} samples"));
    }
    let asked = experiment.measures_asked();
    if let Some(measure) = asked.iter().find(|measure| !measure.is_in_lanes()) {
        return Err(format!("the measure {measure}"));
    }
    for method in &experiment.methods {
        if method.observer().is_some() {
            return Err("observers of a method's own".to_owned());
        }
        covers(method.options().ok_or("an estimator of your own")?)?;
    }
    Ok((process, open_loop))
}

/// Whether a method is covered.
fn covers(options: &MethodOptions) -> Result<(), String> {
    let solver = match options {
        MethodOptions::Known => return Err("the estimator \"known\"".to_owned()),
        MethodOptions::LeastSquares(options) => options.solver,
        MethodOptions::InstrumentalVariables(options) => options.solver,
    };
    if solver != Solver::Partitioned {
        return Err(format!("the solver \"{solver}\""));
    }
    let MethodOptions::InstrumentalVariables(options) = options else {
        return Ok(());
    };
    match options {
        IvOptions { stage10, .. } if *stage10 != Stage10::Corrected => {
            Err(format!("stage10 = \"{stage10}\""))
        }
        IvOptions { drive, .. } if *drive != Drive::Model => Err(format!("drive = \"{drive}\"")),
        IvOptions { instruments, .. } if *instruments != InstrumentSource::Input => {
            Err(format!("instruments = \"{instruments}\""))
        }
        IvOptions { stabilise, .. } if *stabilise != Stabilise::None => {
            Err(format!("stabilise = \"{stabilise}\""))
        }
        _ => Ok(()),
    }
}
