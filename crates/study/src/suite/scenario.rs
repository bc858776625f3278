//! The experiments of the suite, and the scenarios in them.

use super::competitor::{Competitor, Told};
use super::manifest::{Division, Manifest, StudyEntry, Tier, systems};
use super::stored::SuiteError;
use crate::design::file::lists::each_once;
use crate::design::file::{
    Axis, ExperimentFile, InformationOf, Key, MethodTable, Scalar, Store, TrialRule, Unfinished,
};
use crate::design::{Cell, DiscreteCell, Experiment, Measure};
use crate::files::checksum;
use asobench_identification::data::{Feedback, NoiseColour, Process, Realisation};
use asobench_identification::model::Orders;
use asobench_identification::names::UnknownName;
use asobench_identification::signal::NoiseLaw;
use asobench_identification::theory::{
    FisherInformation, Missing, OwnInformation, ResponseBound, quantile, weights_between,
};
use serde_json::json;
use std::collections::BTreeMap;

/// Records of at most this many samples are short.
const SHORT: usize = 200;
/// Records whose laws of d of the response are averaged.
const RECORDS: u64 = 5;

/// The experiment of a study, if a method can serve it, and the names of those that cannot, with the reason.
pub type Made = (Option<Experiment>, Vec<(String, String)>);

/// The suite of one tier.
pub struct Suite {
    /// The manifest.
    pub manifest: Manifest,
    /// The knowledge that methods are given.
    pub division: Division,
    /// The tier.
    pub tier: Tier,
    /// Take only so many trials of each scenario, the first; all of the tier if `None`.
    pub first: Option<u64>,
    /// The studies of the tier, in the manifest's order.
    pub studies: Vec<SuiteStudy>,
}

/// A study of the suite.
pub struct SuiteStudy {
    /// Its name: the system and the variant.
    pub name: String,
    /// Its entry of the manifest.
    pub entry: StudyEntry,
    /// The experiment without methods.
    file: ExperimentFile,
    /// The facts that methods may be told.
    told: Told,
    /// Its scenarios, one for each N.
    pub scenarios: Vec<Scenario>,
}

/// A scenario: a study at one N.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// Its name.
    pub name: String,
    /// The checksum of what it is: system, settings, seed and N.
    pub content: String,
    /// N.
    pub window: usize,
    /// The number p of free coefficients.
    pub free: usize,
    /// The weights of the law of d of an efficient method, a sum of squares of normal numbers.
    pub weights: Vec<f64>,
    /// Whether there is feedback.
    pub is_closed: bool,
    /// Its difficulties.
    pub hard: Vec<String>,
    /// Whether its plant is one of the bank.
    pub is_bank: bool,
    /// Its plant: the checksum of the transfer function, to ten digits.
    pub plant: String,
    /// Its weight. 1 in editions 1. From 2.0 on a plant counts once, its sets of difficulties share that equally, and
    /// so do the scenarios of a set; the published plants and the bank, each as a whole, have the weight 1.
    pub weight: f64,
    /// The efficiency that a method with separate polynomials of plant and noise, `B/F u + C/D e`, cannot exceed on the
    /// first record; 1 where the truth has no common one.
    pub separate: f64,
    /// Whether its efficiency counts up to 1 in a score, so that luck or bias here does not make up for another: from
    /// edition 2.0 on.
    pub is_capped: bool,
}

impl Suite {
    /// Makes the contest `orders` of a tier. `only`: systems, studies or scenarios; all if empty.
    ///
    /// # Errors
    /// [`SuiteError`].
    pub fn new(tier: Tier, only: &[String]) -> Result<Self, SuiteError> {
        Self::of(None, None, tier, only)
    }

    /// Makes a contest of a tier, of an edition or the current one; without one `orders`, or `closed` of editions 1.
    /// `only`: systems, studies or scenarios; all if empty.
    ///
    /// # Errors
    /// [`SuiteError`].
    pub fn of(
        edition: Option<&str>,
        division: Option<Division>,
        tier: Tier,
        only: &[String],
    ) -> Result<Self, SuiteError> {
        let manifest = Manifest::read(edition)?;
        let known = if manifest.has_contests() {
            &[Division::Orders, Division::Structure, Division::Open][..]
        } else {
            &[Division::Closed, Division::Open]
        };
        let division = division.unwrap_or(known[0]);
        if !known.contains(&division) {
            let known = known.iter().map(|of| of.name());
            let error = UnknownName::new("contest of this edition", division.name(), known);
            return Err(SuiteError::new(error));
        }
        let mut studies = Vec::new();
        let entries = manifest.studies.iter();
        for entry in entries.filter(|entry| tier.contains(entry.tier)) {
            studies.push(SuiteStudy::new(&manifest, entry, division)?);
        }
        if manifest.has_contests() {
            weigh(&mut studies);
        }
        for wanted in only {
            let names = |study: &SuiteStudy| study.names();
            if !studies.iter().flat_map(names).any(|name| name == *wanted) {
                let known = studies.iter().flat_map(names);
                return Err(SuiteError::new(UnknownName::new("system or scenario", wanted, known)));
            }
        }
        if !only.is_empty() {
            for study in &mut studies {
                study.keep(only);
            }
            studies.retain(|study| !study.scenarios.is_empty());
        }
        Ok(Self {
            manifest,
            division,
            tier,
            first: None,
            studies,
        })
    }

    /// The scenarios, in order.
    pub fn scenarios(&self) -> impl Iterator<Item = &Scenario> {
        self.studies.iter().flat_map(|study| &study.scenarios)
    }

    /// Trials of a scenario of a published system, or of a plant of the bank.
    pub fn trials(&self, is_bank: bool) -> u64 {
        let all = self.manifest.trials_of(self.tier, is_bank);
        self.first.map_or(all, |first| first.min(all))
    }

    /// The names of all systems that the program carries.
    pub fn systems() -> Vec<&'static str> {
        systems().collect()
    }

    /// The words that say what is hard about some scenario, each once, in the order of their first scenario.
    pub fn difficulties(&self) -> Vec<String> {
        each_once(self.scenarios().flat_map(|scenario| &scenario.hard).cloned())
    }
}

impl SuiteStudy {
    fn new(manifest: &Manifest, entry: &StudyEntry, division: Division) -> Result<Self, SuiteError> {
        let (name, is_bank, has_contests) = (entry.name(), entry.is_bank(), manifest.has_contests());
        let missing = SuiteError::of(format!("{name}: no Fisher information"));
        let mut file = entry.file()?;
        file.settings.extend(entry.settings.clone());
        file.seed = manifest.seed;
        let given = file.clone();
        file.settings.insert(Key::Window, Axis::Many(entry.window.values(true)));
        file.trials = TrialRule::Fixed(manifest.trials_of(entry.tier, is_bank));
        file.store = Store::Trials;
        if has_contests {
            file.information = InformationOf::Record;
            file.noise_from_rest = true;
        }
        if division.is_open() {
            // A model that a search left without a minimum is a response like any other.
            file.unfinished = Unfinished::Counted;
        }
        file.coverage = !division.is_open();
        file.measures = vec![distance(division), Measure::FreshFit];
        let experiment = Experiment::new(file.clone()).map_err(SuiteError::of(&name))?;
        let cells: Vec<&DiscreteCell> = experiment.cells.iter().filter_map(Cell::discrete).collect();
        let cell = *cells.first().ok_or_else(|| SuiteError::of(&name)("window: no N"))?;
        let process = &cell.process;
        let has_noisy_input = process.settings().input_noise > 0.0;
        let truth = if has_contests && !has_noisy_input {
            // Near the unit circle a record has an information where a stationary one is lost by rounding.
            let own = OwnInformation::new(process, cell.eta, cell.window);
            own.map_err(&missing)?.orders
        } else {
            information(cell).map_err(&missing)?.orders
        };
        let free = truth.na + truth.nf + truth.nb;
        let mut scenarios = Vec::new();
        for cell in &cells {
            let window = cell.window;
            let weights = if division.is_open() {
                response_weights(cell, has_contests.then_some(file.seed)).map_err(&missing)?
            } else {
                ideal_weights(free)
            };
            let separate = (has_contests && truth.na > 0).then(|| separate(cell, file.seed));
            scenarios.push(Scenario {
                name: if is_bank {
                    name.clone()
                } else {
                    format!("{name}-{window}")
                },
                content: content(&given, window),
                window,
                free,
                weights,
                is_closed: is_closed(process),
                hard: hard(entry, process, truth, window),
                is_bank,
                plant: plant(process),
                weight: 1.0,
                separate: separate.flatten().unwrap_or(1.0),
                is_capped: has_contests,
            });
        }
        Ok(Self {
            told: Told {
                order: process.order(),
                truth,
                controller: match &process.settings().feedback {
                    Feedback::Output(law) => serde_json::to_value(law).ok(),
                    _ => None,
                },
                shortest: cells.iter().map(|cell| cell.window).min().unwrap_or(0),
                division,
                has_contests,
                law: law(process),
                has_noisy_input,
            },
            scenarios,
            entry: entry.clone(),
            file,
            name,
        })
    }

    /// The orders of the truth, `A y = B/F u + C/D e` in lowest terms.
    pub fn truth(&self) -> Orders {
        self.told.truth
    }

    /// The measure that is d.
    pub(super) fn distance(&self) -> Measure {
        distance(self.told.division)
    }

    /// The names that choose it or a part of it.
    fn names(&self) -> Vec<String> {
        let scenarios = self.scenarios.iter().map(|scenario| &scenario.name);
        [&self.entry.system, &self.name]
            .into_iter()
            .chain(scenarios)
            .cloned()
            .collect()
    }

    /// Keeps the scenarios that are chosen.
    fn keep(&mut self, only: &[String]) {
        let whole = [&self.entry.system, &self.name];
        if only.iter().any(|name| whole.contains(&name)) {
            return;
        }
        self.scenarios.retain(|scenario| only.contains(&scenario.name));
        let windows = self.scenarios.iter().map(|of| Scalar::Number(of.window as f64));
        self.file.settings.insert(Key::Window, Axis::Many(windows.collect()));
    }

    /// The description of the system: the file's title, question and source.
    pub fn file(&self) -> &ExperimentFile {
        &self.file
    }

    /// Returns the experiment with the methods that are for it and can serve it, and the names of those that cannot,
    /// with the reason.
    ///
    /// # Errors
    /// [`SuiteError`].
    pub fn experiment(&self, competitors: &[Competitor], trials: u64) -> Result<Made, SuiteError> {
        let mut file = self.file.clone();
        file.trials = TrialRule::Fixed(trials);
        file.methods = Vec::new();
        let mut declined = Vec::new();
        for competitor in competitors.iter().filter(|of| self.is_for(of)) {
            match self.method(competitor) {
                Ok(mut table) => {
                    // Records beyond the trials would be estimated for nothing.
                    table.limit_batch(trials);
                    file.methods.push(table);
                }
                Err(reason) => declined.push((competitor.name(), reason)),
            }
        }
        if file.methods.is_empty() {
            return Ok((None, declined));
        }
        let experiment = Experiment::new(file).map_err(SuiteError::of(&self.name))?;
        Ok((Some(experiment), declined))
    }

    /// Whether the study gives what a method needs: a reference and a controller where there is feedback, a hold where
    /// the system is in continuous time. A method is for such studies alone; any other that it declines is lost.
    pub fn is_for(&self, competitor: &Competitor) -> bool {
        let (needs, told) = (competitor.needs(), &self.told);
        let is_closed = self.scenarios.iter().all(|scenario| scenario.is_closed);
        // No prediction error method of editions 1 has the structure of a noisy input.
        let has_truth = *competitor != Competitor::Ideal || told.has_contests || !told.has_noisy_input;
        has_truth
            && (needs.reference.is_none() || is_closed)
            && (!needs.controller || told.controller.is_some())
            && (!needs.hold || self.entry.sampled)
    }

    /// Returns the table of a method that serves the study. The error says why none does.
    fn method(&self, competitor: &Competitor) -> Result<MethodTable, String> {
        let mut reason = "no table of it can be made".to_owned();
        for table in competitor.tables(&self.told) {
            let made = serde_json::from_value::<MethodTable>(table).map_err(SuiteError::new);
            let made = made.and_then(|table| {
                let file = ExperimentFile {
                    methods: vec![table.clone()],
                    ..self.file.clone()
                };
                Experiment::new(file).map(|_| table).map_err(SuiteError::new)
            });
            match made {
                Ok(table) => return Ok(table),
                Err(error) => reason = error.to_string(),
            }
        }
        Err(reason)
    }
}

/// The measure that is d in a division.
fn distance(division: Division) -> Measure {
    if division.is_open() {
        Measure::ResponseDistance
    } else {
        Measure::Distance
    }
}

/// The information of the stationary record of a cell.
fn information(cell: &DiscreteCell) -> Result<FisherInformation, Missing> {
    FisherInformation::new(&cell.process, cell.eta, cell.window)
}

/// The information of the record of a trial.
fn information_of(
    own: &OwnInformation,
    cell: &DiscreteCell,
    seed: u64,
    trial: u64,
) -> Result<FisherInformation, Missing> {
    let mut record = Realisation::default();
    let (eta, window) = (cell.eta, cell.window);
    cell.process.realise(seed, trial, eta, window, window, &mut record);
    own.of(&record.r, record.scale)
}

/// Returns the weights whose sum of squares of normal numbers is d of an efficient method in the closed division.
pub fn ideal_weights(free: usize) -> Vec<f64> {
    vec![1.0 / free as f64; free]
}

/// The weights of the law of d of the response: of the stationary record, or, with a seed, the mean of the ordered
/// weights of the first records.
fn response_weights(cell: &DiscreteCell, of_records: Option<u64>) -> Result<Vec<f64>, Missing> {
    let plant = cell.process.plant().ok_or(Missing::Singular)?;
    let of = |information: &FisherInformation| {
        let mut weights = ResponseBound::new(information, plant)?.weights;
        weights.sort_unstable_by(f64::total_cmp);
        Ok(weights)
    };
    let Some(seed) = of_records else {
        return of(&information(cell)?);
    };
    let own = OwnInformation::new(&cell.process, cell.eta, cell.window)?;
    let mut mean = Vec::new();
    for trial in 0..RECORDS {
        let weights = of(&information_of(&own, cell, seed, trial)?)?;
        mean.resize(weights.len(), 0.0);
        mean.iter_mut()
            .zip(weights)
            .for_each(|(mean, weight)| *mean += weight / RECORDS as f64);
    }
    Ok(mean)
}

/// The typical efficiency at the bound of separate polynomials, on the first record; `None` without such a bound.
fn separate(cell: &DiscreteCell, seed: u64) -> Option<f64> {
    let own = OwnInformation::new(&cell.process, cell.eta, cell.window).ok()?;
    let of_first = |of: &OwnInformation| information_of(of, cell, seed, 0).ok();
    let separate = of_first(&own.separate()?)?;
    let own = of_first(&own)?;
    let weights = weights_between(&own, &separate)?;
    let median = |weights: &[f64]| quantile(weights, 0.5).powi(2);
    Some(median(&ideal_weights(own.free())) / median(&weights))
}

/// Gives each scenario its weight.
fn weigh(studies: &mut [SuiteStudy]) {
    let mut sets: BTreeMap<(bool, String), BTreeMap<Vec<String>, usize>> = BTreeMap::new();
    let all = || studies.iter().flat_map(|study| &study.scenarios);
    for of in all() {
        let plant = sets.entry((of.is_bank, of.plant.clone())).or_default();
        *plant.entry(of.hard.clone()).or_default() += 1;
    }
    let plants = |bank: bool| sets.keys().filter(|(of, _)| *of == bank).count();
    let plants = [plants(false), plants(true)];
    for of in studies.iter_mut().flat_map(|study| &mut study.scenarios) {
        let own = &sets[&(of.is_bank, of.plant.clone())];
        let alike = own[&of.hard] * own.len() * plants[usize::from(of.is_bank)];
        of.weight = 1.0 / alike as f64;
    }
}

/// The checksum of the transfer function.
fn plant(process: &Process) -> String {
    let coefficients = process.plant().map(|plant| [plant.a().to_vec(), plant.h()]);
    let digits = coefficients.into_iter().flatten().flatten();
    let digits: Vec<String> = digits.map(|x| format!("{:.9e}", x + 0.0)).collect();
    checksum(digits.join(" ").as_bytes())[..16].to_owned()
}

fn is_closed(process: &Process) -> bool {
    !matches!(process.settings().feedback, Feedback::None)
}

/// The checksum of what a scenario is: the tables and settings that are given, the seed and N. Words do not enter, nor
/// do defaults that a later program may add.
fn content(file: &ExperimentFile, window: usize) -> String {
    let of = json!({
        "plants": file.plants,
        "inputs": file.inputs,
        "noises": file.noises,
        "feedbacks": file.feedbacks,
        "settings": file.settings,
        "seed": file.seed,
        "window": window,
    });
    checksum(of.to_string().as_bytes())[..16].to_owned()
}

/// The density of the innovations.
fn law(process: &Process) -> NoiseLaw {
    match &process.settings().noise {
        NoiseColour::Filter(filter) => filter.law().clone(),
        NoiseColour::InverseDenominator => NoiseLaw::Gaussian,
    }
}

/// The difficulties: the noises (white, 1/A as least squares has it, or another colour; heavy tails; on the input too),
/// loop, delay and a short record by themselves, then the words of the manifest.
fn hard(entry: &StudyEntry, process: &Process, truth: Orders, window: usize) -> Vec<String> {
    let Orders { na, nc, nd, nk, .. } = truth;
    let settings = process.settings();
    let is_noisy = settings.input_noise > 0.0;
    let law = law(process);
    let is_contaminated = matches!(law, NoiseLaw::Contaminated { .. });
    let is_heavy = law != NoiseLaw::Gaussian && !is_contaminated;
    let (is_white, is_shaped) = (na + nc + nd == 0 && !is_noisy, nc + nd > 0);
    let own = [
        (is_white, "white"),
        (na > 0 && !is_shaped, "1/A"),
        (is_shaped, "coloured"),
        (is_noisy, "errors in variables"),
        (is_heavy, "heavy tails"),
        (is_contaminated, "outliers"),
        (window <= SHORT, "short"),
        (nk > 1, "delay"),
        (is_closed(process), "closed loop"),
    ];
    let own = own.into_iter().filter(|(is, _)| *is);
    let own = own.map(|(_, word)| word.to_owned());
    own.chain(entry.hard.iter().cloned()).collect()
}
