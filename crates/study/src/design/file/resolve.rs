//! Writes out every default of a file, and refuses what belongs to another kind of study.

use crate::design::Measure;
use crate::design::file::{Axis, ExperimentFile, FileError, Key, MethodTable, StudyKind, TrialRule, Unfinished, wrong};

impl ExperimentFile {
    /// Applies the changes of `[quick]` to the file.
    #[must_use]
    pub fn quick(mut self) -> Self {
        if let Some(quick) = self.quick.take() {
            self.trials = TrialRule::Fixed(quick.trials);
            self.settings.extend(quick.settings);
        }
        self
    }

    /// Returns the methods, one for each combination of the lists in their options.
    pub(crate) fn expanded(&self) -> Result<Vec<MethodTable>, FileError> {
        let methods = self.methods.iter().enumerate();
        let expanded = methods.map(|(i, method)| method.expand(i));
        Ok(expanded.collect::<Result<Vec<_>, FileError>>()?.concat())
    }

    /// Refuses keys that belong to the other kind of study.
    fn check_kind(&self) -> Result<(), FileError> {
        let kind = self.kind();
        let of_kind = match kind {
            StudyKind::Continuous => "continuous time (the file has [continuous])",
            StudyKind::Discrete => "discrete time (the file has no [continuous])",
        };
        let unused = |key: &str, known: &[&str]| {
            // The names that this kind of study has instead.
            let instead = if known.is_empty() { "" } else { "; expected one of " };
            let names = known.join(", ");
            wrong(key, format!("is not used in a study in {of_kind}{instead}{names}"))
        };
        if let Some(key) = self.settings.keys().find(|key| !key.is_of(kind)) {
            let known = Key::ALL.iter().filter(|key| key.is_of(kind));
            return unused(key.name(), &known.map(|key| key.name()).collect::<Vec<_>>());
        }
        let default = Self::default();
        let measured = self.measures.iter().find(|measure| !measure.is_of(kind));
        if let Some(measure) = measured.filter(|_| self.measures != default.measures) {
            let known = Measure::ALL.iter().filter(|of| of.is_of(kind));
            let key = format!("measures: '{measure}'");
            return unused(&key, &known.map(|of| of.name()).collect::<Vec<_>>());
        }
        let methods = self.methods != default.methods && !self.methods.is_empty();
        let of_other: &[(&str, bool)] = match kind {
            StudyKind::Continuous => &[
                ("methods", methods),
                ("plants", !self.plants.is_empty()),
                ("changes", !self.changes.is_empty()),
                ("inputs", !self.inputs.is_empty()),
                ("noises", !self.noises.is_empty()),
                ("covariances", !self.covariances.is_empty()),
                ("feedbacks", !self.feedbacks.is_empty()),
                ("parameters", self.parameters),
                ("coverage", self.coverage),
                ("curves", self.curves),
                ("course", self.course.is_some()),
                ("timing", self.timing),
                ("unfinished", self.unfinished == Unfinished::Counted),
            ],
            StudyKind::Discrete => &[
                ("continuous_plants", !self.continuous_plants.is_empty()),
                ("signals", !self.signals.is_empty()),
                ("observers", !self.observers.is_empty()),
            ],
        };
        match of_other.iter().find(|(_, given)| *given) {
            Some((key, _)) => unused(key, &[]),
            None => Ok(()),
        }
    }

    /// Writes out every default, except those that a resolved file leaves out: settings, and one table per method.
    ///
    /// # Errors
    /// If both `l` and `window` are given, or a method's options contradict each other.
    pub fn resolve(mut self) -> Result<Self, FileError> {
        if self.settings.contains_key(&Key::L) && self.settings.contains_key(&Key::Window) {
            let message = "cannot be set together with 'window' (N = 3n + 2l)";
            return wrong("l", message);
        }
        let kind = self.kind();
        self.check_kind()?;
        self.check_lengths()?;
        if kind == StudyKind::Continuous {
            self.methods.clear();
            if self.measures == Self::default().measures {
                self.measures = vec![Measure::RmsState, Measure::Theta, Measure::ThetaRms, Measure::StepError];
            }
        }
        for key in Key::ALL {
            let absent = *key == Key::Window && self.settings.contains_key(&Key::L);
            if let Some(default) = key.default_of(kind).filter(|_| !absent) {
                self.settings.entry(*key).or_insert(Axis::One(default));
            }
        }
        // Ranges and lists of counts become the values that they stand for.
        for (key, axis) in &mut self.settings {
            let mut values = axis.values(key.entry().count);
            *axis = match (axis.clone(), values.len()) {
                (Axis::One(_), _) | (_, 1) => Axis::One(values.swap_remove(0)),
                _ => Axis::Many(values),
            };
        }
        self.settings.retain(|key, axis| {
            let default = key.default().map(Axis::One);
            !(key.entry().left_out && Some(&*axis) == default.as_ref())
        });
        self.drop_columns();
        for (name, noise) in &mut self.noises {
            let resolved = std::mem::take(noise).resolve();
            let wrong = |message: String| FileError::key(format_args!("noises.{name}"), message);
            *noise = resolved.map_err(wrong)?;
        }
        self.methods = self.expanded()?;
        self.check_lengths()?;
        self.add_needs();
        self.measures.sort_unstable();
        self.measures.dedup();
        self.quick = None;
        Ok(self)
    }
}
