//! An experiment is made from its file, and every part is checked against the others.

use crate::design::file::{
    At, Axis, ExperimentFile, FileError, Key, MethodTable, Scalar, StudyKind, TrialRule, at_most, cells, wrong,
};
use crate::design::{
    Cell, CellObserver, DiscreteCell, Experiment, SettingsReader, check_labels, check_names, design_of,
};
use crate::worker::Program;
use asobench_identification::estimator::{Method, Output, Shape};
use asobench_identification::observer::ObserverKind;
use std::sync::{Arc, OnceLock};
use xxhash_rust::xxh3::xxh3_128;

/// The largest number of outputs over all methods, counting passes.
pub(crate) const OUTPUT_LIMIT: usize = 10_000;

/// The experiment file of Nikolov et al. (2023), claims C1 to C3.
pub const NIKOLOV2023: &str = include_str!("../../experiments/nikolov2023.toml");

/// The experiment files of Bobtsov et al. (2023) that `asobench reproduce` runs, the example first. Each comes with the
/// number of trials that decides its claims.
pub const BOBTSOV2023: [(&str, &str, u64); 3] = [
    ("gpebo-figures", include_str!("../../experiments/gpebo-figures.toml"), 1),
    ("gpebo-noise", include_str!("../../experiments/gpebo-noise.toml"), 100),
    (
        "gpebo-amplitude",
        include_str!("../../experiments/gpebo-amplitude.toml"),
        60,
    ),
];

/// Returns, for every method of a resolved file, the program that it is, if it is one.
pub(crate) fn programs(file: &ExperimentFile) -> Vec<Option<Arc<Program>>> {
    // Identifies the study, whatever version a program reports.
    let mut design = design_of(&serde_json::to_value(file).unwrap_or_default());
    for method in design["methods"].as_array_mut().into_iter().flatten() {
        if let Some(method) = method.as_object_mut() {
            method.shift_remove("worker");
        }
    }
    let fingerprint = format!("{:032x}", xxh3_128(design.to_string().as_bytes()));
    let program = |table: &MethodTable| {
        let options = table.program()?.clone();
        let program = Program::new(table.base_name(), options, fingerprint.clone());
        Some(Arc::new(program))
    };
    file.methods.iter().map(program).collect()
}

/// Checks that not too many points of courses are kept.
pub(crate) fn traces_fit(file: &ExperimentFile, cells: usize) -> Result<(), FileError> {
    const MOST: f64 = 1e5;
    let per_cell = file.continuous.as_ref().and_then(|of| Some(of.until / of.trace_every?));
    match per_cell.map(|points| points * cells as f64) {
        Some(points) if !(points <= MOST) => {
            let message = format!("{points:.0} points over all cells; expected at most {MOST}");
            wrong("continuous.trace_every", message)
        }
        _ => Ok(()),
    }
}

impl Experiment {
    /// Resolves a file and checks every cell with every method.
    ///
    /// # Errors
    /// The first fault that is found.
    pub fn new(file: ExperimentFile) -> Result<Self, FileError> {
        if let Some(fault) = file
            .quick
            .as_ref()
            .and_then(|quick| TrialRule::Fixed(quick.trials).fault())
        {
            return wrong("quick.trials", fault);
        }
        let file = file.resolve()?;
        if let Some(fault) = file.trials.fault() {
            return wrong("trials", fault);
        }
        if file.measures.is_empty() {
            return wrong("measures", "an empty list; expected at least one measure");
        }
        check_names(&file)?;
        if let Some(table) = &file.course {
            table.check()?;
        }
        let all = cells(&file.settings, &file.zip, &file.exclude)?;
        let file_of = &file;
        let reader = |settings| SettingsReader {
            file: file_of,
            settings,
        };
        let cells = all.into_iter().map(|settings| reader(settings).cell());
        let cells: Result<Vec<Cell>, FileError> = cells.collect();
        let tables = file.methods.iter().enumerate();
        let programs = programs(&file);
        let method = |(i, table): (usize, &MethodTable)| table.method(i, programs[i].as_ref());
        let methods: Result<Vec<Method>, FileError> = tables.map(method).collect();
        let mut experiment = Self {
            cells: cells?,
            methods: methods?,
            programs: programs.into_iter().flatten().collect(),
            compare: Vec::new(),
            theories: OnceLock::new(),
            file,
        };
        experiment.check()?;
        traces_fit(&experiment.file, experiment.cells.len())?;
        for cell in 0..experiment.cells.len() {
            experiment.engine(cell)?;
        }
        Ok(experiment)
    }

    /// Returns the experiment of Nikolov et al. (2023): claims C1 (noise-free, N = 18), C2 (eta 10.018 %, N = 98) and
    /// C3 (eta 10.014 %, N = 218), K = 400 samples, least squares and four IV passes, every reading at its default.
    ///
    /// # Panics
    /// Never: the file is part of the program, and tested.
    pub fn nikolov2023(seed: u64) -> Self {
        let file = ExperimentFile::parse(NIKOLOV2023).expect("a valid file");
        Self::new(ExperimentFile { seed, ..file }).expect("a valid experiment")
    }

    /// Checks the parts of the file against each other, and resolves the indices of the comparisons.
    fn check(&mut self) -> Result<(), FileError> {
        self.check_methods()?;
        self.check_use()?;
        self.check_course()?;
        crate::design::claim_checks::check(self)?;
        for [first, second] in &self.file.compare {
            let pair = [self.output("compare", first)?, self.output("compare", second)?];
            if first == second {
                return wrong("compare", format!("'{first}' is compared with itself"));
            }
            self.compare.push(pair);
        }
        match &self.file.trials {
            TrialRule::Fixed(_) => {}
            TrialRule::Until(until) => {
                self.target(until)?;
            }
            TrialRule::Decided(until) => {
                crate::design::claim_checks::check_target(&self.file, &until.claim)?;
            }
        }
        for slope in &self.file.slopes {
            self.measure("slopes", slope.measure)?;
            let checked = slope.check(&self.file.settings);
            checked.at("slopes.over")?;
        }
        for bound in &self.file.bounds {
            self.measure("bounds", bound.measure)?;
            let limits = [bound.below, bound.rounding];
            if limits == [None; 2] {
                let message = "expected 'below', 'rounding' or both";
                return wrong("bounds", message);
            }
            let mut limits = limits.into_iter().flatten();
            if let Some(limit) = limits.find(|limit| !limit.is_finite()) {
                return wrong("bounds", format!("{limit} is not a finite number"));
            }
        }
        Ok(())
    }

    /// Checks that every method serves every cell, and that every output has a distinct name.
    fn check_methods(&self) -> Result<(), FileError> {
        let place = match self.file.kind() {
            StudyKind::Continuous => "observers",
            StudyKind::Discrete => "methods",
        };
        if self.output_count() == 0 {
            return wrong(place, "an empty list; expected at least one");
        }
        at_most(place, self.output_count(), "outputs", OUTPUT_LIMIT)?;
        let labels: Vec<String> = self.outputs().iter().map(Output::label).collect();
        check_labels(place, &labels)?;
        let mut shapes: Vec<Shape> = self
            .cells
            .iter()
            .filter_map(Cell::discrete)
            .map(DiscreteCell::shape)
            .collect();
        shapes.sort_by_key(|shape| (shape.order, shape.window));
        shapes.dedup();
        for (i, method) in self.methods.iter().enumerate() {
            if method.needs().plant {
                continue;
            }
            for shape in &shapes {
                let prepared = method.prepare(*shape);
                prepared.at(format_args!("methods[{i}]"))?;
            }
        }
        self.check_observers()
    }

    /// Checks that a method that knows the plant knows it in every cell, and that every method's own observer serves
    /// every cell.
    fn check_observers(&self) -> Result<(), FileError> {
        for (i, method) in self.methods.iter().enumerate() {
            let known = method.needs().plant;
            if !known && method.observer().is_none() {
                continue;
            }
            let cells = self.cells.iter().map(Cell::discrete).enumerate();
            for (number, cell) in cells.filter_map(|(number, cell)| Some((number, cell?))) {
                let model = if known { cell.known_model().map(|_| ()) } else { Ok(()) };
                let observer = model.and_then(|()| CellObserver::new(cell, method));
                observer.map_err(|e| FileError::key(format_args!("methods[{i}]"), format!("{e} (cell {number})")))?;
            }
        }
        Ok(())
    }

    /// Checks what `[course]` asks for.
    fn check_course(&self) -> Result<(), FileError> {
        let mut measures = self.file.measures.iter();
        let asked = measures.find(|measure| measure.entry().of_course);
        if self.file.course.is_none() {
            return asked.map_or(Ok(()), |measure| {
                let message = "is taken from the points of [course]; expected that table";
                wrong(format_args!("measures: '{measure}'"), message)
            });
        }
        for (i, method) in self.methods.iter().enumerate() {
            if method.options().is_none() {
                let message = "a program or method of your own has no course; expected a file without [course]";
                return wrong(format_args!("methods[{i}]"), message);
            }
            if let Some(kind) = method.observer()
                && !matches!(kind, ObserverKind::Luenberger(_))
            {
                let message = format!(
                    "'{kind}' is made from the whole window; beside [course] expected dead-beat, scaled:RHO or \
                     poles:LIST"
                );
                return wrong(format_args!("methods[{i}].observer"), message);
            }
        }
        Ok(())
    }

    /// Checks that every given key has a meaning in at least one cell.
    fn check_use(&self) -> Result<(), FileError> {
        // A resolved file has every setting, so a default value does not show that the setting was given.
        let is_given = |key: &Key| {
            let given = self.file.settings.get(key);
            given.is_some_and(|axis| Some(axis) != key.default().map(Axis::One).as_ref())
        };
        let fixed = |cell: &Cell| cell.settings.get(&Key::Plant) != Some(&"random".into());
        let of_random = [Key::PlantOrder, Key::PoleRadius];
        if self.cells.iter().all(fixed)
            && let Some(key) = of_random.iter().find(|key| is_given(key))
        {
            let message = "no cell has plant = \"random\", so it has no effect; expected a random plant or no such key";
            return wrong(key, message);
        }
        let given = |cell: &Cell| match cell.settings.get(&Key::Input) {
            Some(Scalar::Text(name)) => self.file.columns.contains_key(name),
            _ => false,
        };
        let of_input = [Key::Amplitude, Key::Sequence];
        if !self.cells.is_empty()
            && self.cells.iter().all(given)
            && let Some(key) = of_input.iter().find(|key| is_given(key))
        {
            let message = "the input is a file's in every cell, so it means nothing; expected no such key";
            return wrong(key, message);
        }
        let states = self.cells.iter().map(Cell::plant_order).max();
        let most = states.unwrap_or(usize::MAX);
        let mut measures = self.file.measures.iter();
        if let Some(measure) = measures.find(|measure| measure.least_order() > most) {
            let message = format!("no plant has so many states; expected at most 'rms_x{most}'");
            return wrong(format_args!("measures: '{measure}'"), message);
        }
        let open = |cell: &Cell| cell.settings.get(&Key::Feedback) == Some(&"none".into());
        if self.cells.iter().all(open) {
            for (i, method) in self.methods.iter().enumerate() {
                if let Some((key, value)) = method.needs().reference {
                    let other = if key == "estimator" { "a" } else { "\"u\", or a" };
                    let message = format!(
                        "\"{value}\" where no cell has feedback, so there is no reference; expected {other} \
                         feedback in [settings]"
                    );
                    return wrong(format_args!("methods[{i}].{key}"), message);
                }
            }
        }
        Ok(())
    }
}
