//! Makes a cell from its settings: plant, noise, feedback and the process that draws records.

use crate::design::build_continuous_cell::continuous_cell;
use crate::design::file::{
    At, ExperimentFile, FeedbackTable, FileError, InputTable, Key, LAWS, NoiseTable, OutlierTable, PlantTable, Scalar,
    wrong,
};
use crate::design::{
    CURVES_LIMIT, Cell, DiscreteCell, LARGEST_COUNT, Measure, SettingsReader, Source, StateFeedback, curve_bytes, named,
};
use asobench_identification::data::{
    Change, ChangedPlant, Feedback, NoiseColour, OutputFeedback, PlantSource, Process, ProcessSettings,
};
use asobench_identification::estimator::{SetupError, Shape, Solver};
use asobench_identification::model::LinearModel;
use asobench_identification::names::UnknownName;
use asobench_identification::observer::Gain;
use asobench_identification::plant::{ORDER_LIMIT, nikolov2023};
use asobench_identification::signal::{Input, InputLaw, LevelOf, LevelReading, NoiseFilter, Sequence};
use asobench_identification::text::number;
use faer::Mat;

/// Built-in plants, which need no table.
pub(crate) const PLANTS: [&str; 2] = ["nikolov2023", "random"];
/// Built-in noises, which need no table.
pub(crate) const NOISES: [&str; 2] = ["ar", "white"];
/// Built-in feedbacks, which need no table.
pub(crate) const FEEDBACKS: [&str; 1] = ["none"];

/// Built-in changes, which need no table.
pub(crate) const CHANGES: [&str; 1] = ["none"];

/// The largest size in bytes of a record with its truth; each thread has one.
const RECORD_LIMIT: usize = 4 << 30;

impl SettingsReader<'_> {
    /// Makes the cell.
    pub(crate) fn cell(self) -> Result<Cell, FileError> {
        let source = match &self.file.continuous {
            Some(table) => Source::Continuous(Box::new(continuous_cell(&self, table)?)),
            None => Source::Discrete(Box::new(self.discrete_cell()?)),
        };
        Ok(Cell {
            claim: self.text(Key::Claim),
            settings: self.settings,
            source,
        })
    }

    fn discrete_cell(&self) -> Result<DiscreteCell, FileError> {
        let plant = self.plant()?;
        let n = plant.order();
        if n > ORDER_LIMIT {
            let place = match plant {
                PlantSource::Random { .. } => Key::PlantOrder.name().to_owned(),
                PlantSource::Fixed(_) => format!("plants.{}", self.text(Key::Plant)),
            };
            return wrong(place, SetupError::LargeOrder(n));
        }
        let order = self.count_or(Key::Order, n)?;
        let window = match self.settings.get(&Key::L) {
            Some(_) => 3 * order + 2 * self.count(Key::L)?,
            None => self.count(Key::Window)?,
        };
        Shape { order, window }.check().map_err(|error| {
            let key = match error {
                SetupError::ZeroOrder | SetupError::LargeOrder(_) => Key::Order,
                _ => Key::Window,
            };
            FileError::key(key, error)
        })?;
        let process = self.process(plant)?;
        let most = self.given_samples(&process, window)?;
        let horizon = self.count_or(Key::Horizon, most.unwrap_or(400.max(window + 200)))?;
        if let Some(most) = most.filter(|most| *most < horizon) {
            let message = format!("K = {horizon} samples; the input has {most}");
            return wrong("horizon", message);
        }
        if horizon < window {
            let message = format!("the record of K = {horizon} samples is shorter than the window N = {window}");
            return wrong("horizon", message);
        }
        if let Some(change) = &process.settings().change
            && change.at >= horizon
        {
            let place = format!("changes.{}.at", self.text(Key::Change));
            let message = format!("{}; the record has K = {horizon} samples", change.at);
            return wrong(place, message);
        }
        if horizon as f64 > LARGEST_COUNT {
            let message = format!("a record of K = {horizon} samples; expected at most {LARGEST_COUNT}");
            return wrong("horizon", message);
        }
        let eta = self.number(Key::Eta)?;
        if eta < 0.0 {
            let eta = number(eta);
            return wrong("eta", format!("{eta}; expected a percentage of at least 0"));
        }
        let gain: Gain = self.name(Key::Gain)?;
        gain.check(order).at("gain")?;
        if process.settings().measurement_variance().is_some() && eta != 0.0 {
            let message = format!(
                "{} beside R of covariances.{}; expected eta = 0, since R is all of the measurement noise",
                number(eta),
                self.text(Key::ProcessNoise)
            );
            return wrong("eta", message);
        }
        let cell = DiscreteCell {
            eta,
            order,
            window,
            horizon,
            gain,
            observer_start: self.name(Key::ObserverStart)?,
            scored_from: self.name(Key::ScoredFrom)?,
            covariances: self.covariances(&process)?,
            process,
            ahead: self.count(Key::Ahead)?,
        };
        if cell.ahead == 0 {
            let message = "0; expected a number of samples from 1 on".to_owned();
            return wrong("ahead", message);
        }
        is_scored(&cell, self.file)?;
        level_exists(&cell, &self.text(Key::Noise))?;
        fits_into_memory(&cell, self.file.curves)?;
        Ok(cell)
    }

    fn process(&self, plant: PlantSource) -> Result<Process, FileError> {
        let x0 = self.x0(plant.order())?;
        let (feedback, reference) = self.feedback(plant.order())?;
        let amplitude = match reference {
            Some(reference) => reference,
            None => self.number(Key::Amplitude)?,
        };
        let input = self.input(amplitude)?;
        let own = self.file.inputs.contains_key(&self.text(Key::Input));
        if let (Input::Samples(_), Some(reference), false) = (&input, reference, own) {
            let place = format!("feedbacks.{}.reference", self.text(Key::Feedback));
            let message = format!(
                "{}; the reference is the input '{}', as it is",
                number(reference),
                self.text(Key::Input)
            );
            return wrong(place, message);
        }
        let state_noise = match self.settings.get(&Key::ProcessNoise) {
            Some(Scalar::Text(name)) => Some(self.state_noise(Key::ProcessNoise, name, &plant)?),
            _ => None,
        };
        let settings = ProcessSettings {
            x0,
            x0_deviation: self.number(Key::X0Deviation)?,
            input,
            noise: self.noise()?,
            level: LevelReading {
                over: self.name(Key::EtaOver)?,
                of: self.name(Key::EtaOf)?,
            },
            input_noise: self.number(Key::InputNoise)?,
            process_noise: match state_noise {
                Some(_) => 0.0,
                None => self.number(Key::ProcessNoise)?,
            },
            state_noise,
            feedback,
            change: self.change(&plant)?,
            plant,
        };
        Process::from_settings(settings).at("settings")
    }

    /// Returns how many samples a record may have if the input is given sample by sample; `None` if it is unlimited.
    fn given_samples(&self, process: &Process, window: usize) -> Result<Option<usize>, FileError> {
        let Input::Samples(samples) = process.input() else {
            return Ok(None);
        };
        // A table's sequence goes on after its period.
        if self.file.inputs.contains_key(&self.text(Key::Input)) {
            return Ok(None);
        }
        let most = samples.len().saturating_sub(process.settings().feedback.pilot());
        if window > most {
            let key = if self.settings.contains_key(&Key::L) {
                Key::L
            } else {
                Key::Window
            };
            let message = format!("N = {window} samples; the input '{}' has {most}", self.text(Key::Input));
            return wrong(key, message);
        }
        Ok(Some(most))
    }

    fn input(&self, amplitude: f64) -> Result<Input, FileError> {
        let (key, name) = (Key::Input.name(), self.text(Key::Input));
        if let Some(samples) = self.file.column(key, &name) {
            return Ok(Input::Samples(samples?.into()));
        }
        if let Ok(law) = name.parse() {
            return Ok(Input::new(law, amplitude, self.name(Key::Sequence)?));
        }
        if let Some(table) = self.file.inputs.get(&name) {
            let place = format!("inputs.{name}");
            if let Some(period) = table.period().at(&place)? {
                let samples = period.iter().map(|u| amplitude * u);
                return Ok(Input::Samples(samples.collect()));
            }
            if let InputTable::Binary { filter } = table {
                let place = format!("{place}.filter");
                let filter = self.input_filter(&place, filter, &[])?;
                return Ok(Input::Binary { filter, amplitude });
            }
        }
        let law = name.to_lowercase();
        if LAWS.contains(&law.as_str()) && !self.file.noises.contains_key(&name) {
            let sequence = Sequence::Periodic127;
            let also = match law.as_str() {
                "prbs" => format!(", or input = \"signs\" with sequence = \"{sequence}\""),
                _ => String::new(),
            };
            let message =
                format!("'{name}' is a law; expected the name of a table [inputs.NAME] with law = \"{law}\"{also}");
            return wrong(key, message);
        }
        let laws = InputLaw::ALL.iter().map(|law| law.name());
        let inputs = self.file.inputs.keys().map(String::as_str);
        let others: Vec<&str> = laws.chain(inputs).collect();
        let filter = self.input_filter(key, &name, &others)?;
        Ok(Input::Filtered { filter, amplitude })
    }

    /// Returns the filter of Gaussian numbers that an input names; `others` are further names to offer.
    fn input_filter(&self, place: &str, name: &str, others: &[&str]) -> Result<NoiseFilter, FileError> {
        let noises = &self.file.noises;
        let known = others.iter().copied().chain(noises.keys().map(String::as_str));
        let unknown = || UnknownName::new(Key::Input, name, known);
        let table = noises.get(name).ok_or_else(unknown).at(place)?;
        if table.has_law() {
            let message = format!("noise '{name}' is not Gaussian; expected one that is");
            return wrong(place, message);
        }
        filter(name, table)
    }

    fn plant(&self) -> Result<PlantSource, FileError> {
        self.plant_named(&self.text(Key::Plant))
    }

    fn plant_named(&self, name: &str) -> Result<PlantSource, FileError> {
        match name {
            "nikolov2023" => Ok(nikolov2023(self.name(Key::Numerator)?).into()),
            "random" => Ok(PlantSource::Random {
                order: self.count(Key::PlantOrder)?,
                radius: self.number(Key::PoleRadius)?,
            }),
            _ => {
                let table = named(Key::Plant, name, &PLANTS, &self.file.plants)?;
                let place = format!("plants.{name}");
                // Before anything is computed of them.
                if table.order() > ORDER_LIMIT {
                    return wrong(place, SetupError::LargeOrder(table.order()));
                }
                let plant = table.plant().at(&place)?;
                if !plant.is_stable() && !table.unstable {
                    let model = LinearModel::from(&plant);
                    let equation = model.equation(Some(4));
                    let message = format!(
                        "the plant is not stable: {equation}; expected other signs, or 'unstable = true' if that is \
                         intended"
                    );
                    return wrong(place, message);
                }
                Ok(plant.into())
            }
        }
    }

    /// Returns the change of this plant.
    fn change(&self, plant: &PlantSource) -> Result<Option<Change>, FileError> {
        let name = self.text(Key::Change);
        if name == "none" {
            return Ok(None);
        }
        let table = named(Key::Change, &name, &CHANGES, &self.file.changes)?;
        let wrong = |message: &str| wrong(format_args!("changes.{name}"), message);
        let to = match (&table.plant, table.gain, table.poles) {
            (Some(to), None, None) => match self.plant_named(to)? {
                PlantSource::Fixed(plant) => ChangedPlant::Plant(plant),
                PlantSource::Random { .. } => {
                    return wrong("plant = \"random\"; expected one plant for all trials");
                }
            },
            (Some(_), _, _) => return wrong("both a plant and factors; expected one of them"),
            (None, None, None) => {
                return wrong("expected a plant, or a gain or poles, the factors");
            }
            (None, gain, poles) => ChangedPlant::Factors {
                gain: gain.unwrap_or(1.0),
                poles: poles.unwrap_or(1.0),
            },
        };
        let (at, over) = (table.at, table.over);
        let change = Change { to, at, over };
        // Factors may move the poles of a stable plant outside.
        if let PlantSource::Fixed(plant) = plant
            && plant.is_stable()
            && table.plant.is_none()
            && !change.after(plant).is_some_and(|after| after.is_stable())
        {
            return wrong("the plant after it is not stable; expected a smaller factor on its poles");
        }
        Ok(Some(change))
    }

    fn x0(&self, order: usize) -> Result<Vec<f64>, FileError> {
        match &self.settings[&Key::X0] {
            Scalar::Number(x) => Ok(vec![*x; order]),
            Scalar::Text(text) if text == "plant" => {
                let table = self.file.plants.get(&self.text(Key::Plant));
                let x0 = table.and_then(|table| table.x0.clone());
                let x0 = x0.ok_or("the plant's table has no x0").at("x0")?;
                Ok(match self.own_states()?.filter(|_| x0.len() == order) {
                    Some(own) => {
                        let z = Mat::from_fn(order, 1, |i, _| x0[i]);
                        (own.to_canonical() * z).col_as_slice(0).to_vec()
                    }
                    None => x0,
                })
            }
            Scalar::Text(text) => wrong("x0", format!("'{text}'; expected a number or \"plant\"")),
        }
    }

    fn noise(&self) -> Result<NoiseColour, FileError> {
        let noise = self.stationary_noise()?;
        if !self.file.noise_from_rest {
            return Ok(noise);
        }
        let filter = match (noise, self.plant()?) {
            (NoiseColour::Filter(filter), _) => filter,
            (NoiseColour::InverseDenominator, PlantSource::Fixed(plant)) => {
                NoiseFilter::new(&[1.0], &plant.denominator()).at("noise")?
            }
            _ => {
                let message = "expected the same plant in every trial, or another noise than \"ar\"";
                return wrong("noise_from_rest", message);
            }
        };
        Ok(filter.from_rest().into())
    }

    fn stationary_noise(&self) -> Result<NoiseColour, FileError> {
        let name = self.text(Key::Noise);
        match name.as_str() {
            // 1/A without F, for a plant B/(A F).
            "ar" => match self.file.plants.get(&self.text(Key::Plant)) {
                Some(PlantTable {
                    transfer_polynomial: Some(_),
                    output_polynomial: a,
                    ..
                }) => {
                    let filter = NoiseFilter::new(&[1.0], a.as_deref().unwrap_or(&[1.0]));
                    Ok(filter.at("noise")?.into())
                }
                _ => Ok(NoiseColour::InverseDenominator),
            },
            "white" => Ok(NoiseFilter::white().into()),
            _ => {
                let table = named(Key::Noise, &name, &NOISES, &self.file.noises)?;
                let white = filter(&name, table)?;
                if let Some(freedom) = table.student_t {
                    let heavy = white.student_t(freedom);
                    return Ok(heavy.at(format_args!("noises.{name}.student_t"))?.into());
                }
                if let Some(OutlierTable { share, scale }) = table.outliers {
                    let spiked = white.contaminated(share, scale);
                    return Ok(spiked.at(format_args!("noises.{name}.outliers"))?.into());
                }
                let Some(column) = &table.residuals else {
                    return Ok(white.into());
                };
                let place = format!("noises.{name}.residuals");
                let Some(residuals) = self.file.column(&place, column) else {
                    return wrong(place, format!("'{column}'; expected \"file:PATH#COLUMN\""));
                };
                Ok(white.drawn_from(residuals?).at(&place)?.into())
            }
        }
    }

    /// Returns the feedback, and the reference's amplitude if the table has one.
    fn feedback(&self, order: usize) -> Result<(Feedback, Option<f64>), FileError> {
        let name = self.text(Key::Feedback);
        if name == "none" {
            return Ok((Feedback::None, None));
        }
        let table = named(Key::Feedback, &name, &FEEDBACKS, &self.file.feedbacks)?;
        let place = format!("feedbacks.{name}");
        let FeedbackTable {
            numerator,
            denominator,
            state_gain,
            identify,
            model,
            ..
        } = table;
        let feedback = match (numerator, state_gain, identify) {
            (Some(numerator), None, None) if model.is_none() => {
                let denominator = denominator.as_deref().unwrap_or(&[1.0]);
                Feedback::Output(OutputFeedback::new(numerator, denominator).at(&place)?)
            }
            (None, Some(gain), Some(identify)) if denominator.is_none() => {
                if gain.len() != order {
                    let message = format!("state_gain must be {order} numbers, one per state");
                    return wrong(place, message);
                }
                if *identify as f64 > LARGEST_COUNT {
                    let message = format!("identify = {identify}; expected at most {LARGEST_COUNT}");
                    return wrong(place, message);
                }
                let law = StateFeedback {
                    k: gain.clone(),
                    pilot: *identify,
                    model: model.unwrap_or_default(),
                    gain: self.name(Key::Gain)?,
                    solver: Solver::default(),
                };
                let law = law.law().at(&place)?;
                if table.reference == Some(0.0) {
                    // The model is always identified with a reference.
                    return Ok((Feedback::Controlled(law.without_reference()), None));
                }
                Feedback::Controlled(law)
            }
            _ => {
                let message = "expected numerator (and denominator), or state_gain and identify";
                return wrong(place, message);
            }
        };
        Ok((feedback, table.reference))
    }
}

/// Makes the filter of a table of `[noises]`.
pub(crate) fn filter(name: &str, table: &NoiseTable) -> Result<NoiseFilter, FileError> {
    let (numerator, denominator) = table.filter();
    NoiseFilter::new(numerator, denominator).at(format_args!("noises.{name}"))
}

/// Checks that a measure of the state has at least one scored sample.
pub(crate) fn is_scored(cell: &DiscreteCell, file: &ExperimentFile) -> Result<(), FileError> {
    let last = match &file.course {
        None => None,
        Some(table) => match table.points(cell.window).last() {
            None => {
                let message = format!("no point within the window N = {}", cell.window);
                return wrong("course.at", message);
            }
            last => last,
        },
    };
    if let Some(last) = last.filter(|last| **last >= cell.horizon) {
        let message = format!(
            "the record of K = {} samples has no true state after {last}, the last point of [course]; expected more",
            cell.horizon
        );
        return wrong("horizon", message);
    }
    let mut measures = file.measures.iter();
    let measure = measures.find(|of| of.entry().of_state || **of == Measure::FitAhead);
    match measure {
        Some(measure) if cell.horizon <= cell.first_scored() => {
            let message = format!(
                "the record of K = {} samples ends with the window, so '{measure}' has no sample k >= N; expected \
                 more samples, scored_from = \"start\", or measures without it",
                cell.horizon
            );
            wrong("horizon", message)
        }
        _ => Ok(()),
    }
}

/// Checks that noise of the cell's level exists; `noise` is its name. Otherwise every trial would fail.
pub(crate) fn level_exists(cell: &DiscreteCell, noise: &str) -> Result<(), FileError> {
    let process = &cell.process;
    if cell.eta <= 0.0 {
        return Ok(());
    }
    if let NoiseColour::Filter(filter) = &process.settings().noise
        && !(filter.variance() > 0.0 && filter.variance().is_finite())
    {
        let message = format!(
            "eta = {} % of noise whose filter gives it variance {}; expected a numerator that is not zero",
            cell.eta,
            filter.variance()
        );
        return wrong(format_args!("noises.{noise}"), message);
    }
    if process.settings().level.of == LevelOf::Measured && cell.eta >= 100.0 {
        let message = format!(
            "{} % of the measured output, of which noise is a part; expected less than 100 %, or eta_of = \
             \"noise-free\"",
            cell.eta
        );
        return wrong("eta", message);
    }
    match process.common_scale(cell.eta) {
        Some(scale) if !scale.is_finite() => wrong(
            "eta_over",
            "\"nominal\", but the output has no variance of which noise could be a share (the plant is not \
             stable); expected \"exact\", or eta = 0",
        ),
        _ => Ok(()),
    }
}

/// Checks the memory that a record and its curves take.
pub(crate) fn fits_into_memory(cell: &DiscreteCell, curves: bool) -> Result<(), FileError> {
    let too_large = |what: &str, bytes: usize, limit: usize| {
        let message = format!(
            "{what} of K = {} samples would take {} MiB; expected at most {} MiB",
            cell.horizon,
            bytes.div_ceil(1 << 20),
            limit >> 20
        );
        wrong(Key::Horizon, message)
    };
    let record = cell.record_bytes();
    if record > RECORD_LIMIT {
        let what = format!("a record (plant's order {})", cell.plant_order());
        return too_large(&what, record, RECORD_LIMIT);
    }
    let bytes = curve_bytes(cell.horizon);
    if curves && bytes > CURVES_LIMIT {
        return too_large("curves = true: curves", bytes, CURVES_LIMIT);
    }
    Ok(())
}
