//! Reading experiment files. An error is one line with its place.

use crate::design::Measure;
use crate::design::file::{ExperimentFile, FileError, Key, StudyKind, wrong};
use crate::files::{self, Kind};
use asobench_identification::names::UnknownName;
use serde_json::Value;
use std::path::Path;

/// Adds the nearest name to serde's messages "unknown field `x`, expected one of `a`, `b`" and "unknown variant `x`,
/// expected ...".
fn with_nearest(message: &str) -> String {
    let mut quoted = message.split('`').skip(1).step_by(2);
    let kinds = [("unknown field", "key"), ("unknown variant", "kind")];
    let what = kinds.iter().find(|(start, _)| message.starts_with(start));
    let (Some((_, what)), Some(given)) = (what, quoted.next()) else {
        return message.replace('\n', " ");
    };
    UnknownName::new(what, given, quoted).to_string()
}

/// The message of an unknown setting, with the settings of this kind of study alone.
fn of_kind(message: &str, kind: StudyKind) -> Option<String> {
    let given = message.strip_prefix("unknown setting '")?.split('\'').next()?;
    let of_kind = Key::ALL.iter().filter(|key| key.is_of(kind));
    Some(UnknownName::new("setting", given, of_kind).to_string())
}

/// The kind of the study of a text that cannot be read.
fn kind_of(text: &str) -> StudyKind {
    let mut lines = text.lines().map(str::trim_start);
    if lines.any(|line| line.starts_with("[continuous")) {
        StudyKind::Continuous
    } else {
        StudyKind::Discrete
    }
}

impl ExperimentFile {
    /// Reads TOML.
    ///
    /// # Errors
    /// [`FileError::Text`] with line and column.
    pub fn parse(text: &str) -> Result<Self, FileError> {
        toml::from_str(text).map_err(|error| {
            let at = error.span().map_or(0, |span| span.start).min(text.len());
            let before = text.get(..at).unwrap_or_default();
            let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
            FileError::Text {
                line: before.matches('\n').count() + 1,
                column: before[line_start..].chars().count() + 1,
                message: of_kind(error.message(), kind_of(text)).unwrap_or_else(|| with_nearest(error.message())),
            }
        })
    }

    /// Reads a TOML file, or the experiment of a manifest (`manifest.json`).
    ///
    /// # Errors
    /// The error, with the file's name.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let json = path.extension().is_some_and(|extension| extension == "json");
        let kind = if json { Kind::Manifest } else { Kind::Experiment };
        let read = match files::read_named(path, kind) {
            Ok(text) if path == Path::new("-") && text.trim().is_empty() => Err(FileError::Io(
                "standard input is empty; expected an experiment file".to_owned(),
            )),
            Ok(text) if json => Self::parse_manifest(&text),
            Ok(text) => Self::parse(&text).and_then(|file| file.with_samples(path)),
            Err(error) => Err(FileError::Io(error.to_string())),
        };
        read.map_err(|error| FileError::In {
            path: path.display().to_string(),
            error: Box::new(error),
        })
    }

    /// Reads the samples of files that disturbances, inputs and noises name, unless they were read before. Paths are
    /// relative to the folder of the experiment file `path`.
    ///
    /// # Errors
    /// If one cannot be read.
    pub fn with_samples(mut self, path: &Path) -> Result<Self, FileError> {
        let folder = path.parent().unwrap_or(Path::new(""));
        self.read_columns(folder)?;
        for (name, signal) in &mut self.signals {
            signal.read_files(folder, &format!("signals.{name}"))?;
        }
        Ok(self)
    }

    fn parse_manifest(text: &str) -> Result<Self, FileError> {
        let wrong = |message: &str| FileError::key("experiment", message);
        let manifest = files::parsed(text.as_bytes()).map_err(|error| wrong(&error))?;
        let experiment = manifest.get("experiment");
        let expected = "expected a manifest.json of a results folder, or a TOML file";
        Self::from_json(experiment.ok_or_else(|| wrong(expected))?)
    }

    /// Reads the JSON of a manifest.
    ///
    /// # Errors
    /// If it does not have this structure.
    pub fn from_json(value: &Value) -> Result<Self, FileError> {
        serde_json::from_value(value.clone())
            .map_err(|error| FileError::key("experiment", with_nearest(&error.to_string())))
    }

    /// Sets one key, `eta=5`, `seed=7`, `methods.0.solver=["lu","qr"]`: a setting by its name, or a path into the file.
    /// The value is TOML; anything else is a text.
    ///
    /// # Errors
    /// If there is no such key, or the value does not fit.
    pub fn set(&self, assignment: &str) -> Result<Self, FileError> {
        let Some((path, text)) = assignment.split_once('=') else {
            return wrong(assignment, "expected KEY=VALUE");
        };
        let path = path.trim();
        let wrong = |message: String| FileError::key(path, message);
        let value = toml_value(text.trim());
        if holds_null(&value) {
            return Err(wrong(format!("'{}' is not a finite number", text.trim())));
        }
        let mut file = serde_json::to_value(self).map_err(|error| wrong(error.to_string()))?;
        let top = file.get(path.split('.').next().unwrap_or_default()).is_some();
        let full = if top || path.contains('.') {
            path.to_owned()
        } else {
            if path.parse::<Key>().is_err() {
                // The settings that this kind of study has.
                let kind = self.kind();
                let settings = Key::ALL.iter().filter(|key| key.is_of(kind)).map(|key| key.name());
                let keys = file
                    .as_object()
                    .into_iter()
                    .flat_map(|keys| keys.keys().map(String::as_str));
                let all = settings.chain(keys);
                return Err(wrong(UnknownName::new("setting or key", path, all).to_string()));
            }
            format!("settings.{path}")
        };
        let mut place = &mut file;
        for part in full.split('.') {
            let next = match part.parse::<usize>() {
                Ok(index) if place.is_array() => place.get_mut(index),
                _ if place.is_object() => Some(&mut place[part]),
                _ => None,
            };
            place = next.ok_or_else(|| wrong(format!("no '{part}' there")))?;
        }
        *place = value;
        serde_json::from_value(file).map_err(|error| {
            let message = error.to_string();
            wrong(of_kind(&message, self.kind()).unwrap_or_else(|| with_nearest(&message)))
        })
    }
}

/// Parses the text as a TOML value; anything else is a text.
fn toml_value(text: &str) -> Value {
    #[derive(serde::Deserialize)]
    struct Line {
        v: Value,
    }
    let parsed: Result<Line, _> = toml::from_str(&format!("v = {text}"));
    parsed.map_or_else(|_| Value::String(text.to_owned()), |line| line.v)
}

/// Whether the value contains a null, which JSON has instead of NaN and infinity.
fn holds_null(value: &Value) -> bool {
    match value {
        Value::Null => true,
        Value::Array(values) => values.iter().any(holds_null),
        Value::Object(values) => values.values().any(holds_null),
        _ => false,
    }
}

/// Returns the JSON schema of experiment files, for editors.
pub fn schema() -> Value {
    let mut schema = schemars::schema_for!(ExperimentFile).to_value();
    schema["title"] = "asobench experiment".into();
    let settings: serde_json::Map<String, Value> = Key::ALL
        .iter()
        .map(|key| {
            let mut setting = serde_json::json!({ "$ref": "#/$defs/Axis", "description": key.about() });
            if let Some(default) = key.default() {
                setting["default"] = serde_json::json!(default);
            }
            (key.to_string(), setting)
        })
        .collect();
    schema["properties"]["settings"] = serde_json::json!({
        "type": "object",
        "description": "The settings: one value each, or a list or range, which makes an axis of the grid.",
        "properties": settings,
        "additionalProperties": false,
    });
    let measures = Measure::ALL.iter();
    let measures = measures.map(|of| serde_json::json!({ "const": of.name(), "description": of.about() }));
    schema["$defs"]["Measure"] = serde_json::json!({ "oneOf": measures.collect::<Vec<_>>() });
    join_lines(&mut schema);
    schema
}

/// Joins the lines of descriptions, which end where those of the comments in the code do.
fn join_lines(schema: &mut Value) {
    match schema {
        Value::Array(values) => values.iter_mut().for_each(join_lines),
        Value::Object(values) => {
            for (key, value) in values {
                match value {
                    Value::String(text) if key == "description" => {
                        let paragraphs = text.split("\n\n").map(|text| text.replace('\n', " "));
                        *text = paragraphs.collect::<Vec<_>>().join("\n\n");
                    }
                    other => join_lines(other),
                }
            }
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::file::axis::Axis;
    use crate::design::file::axis::Scalar;

    fn refused(text: &str) -> String {
        ExperimentFile::parse(text).unwrap_err().to_string()
    }

    #[test]
    fn mistakes_are_named_with_line_column_and_the_nearest_key() {
        for (text, parts) in [
            ("titel = \"x\"", ["line 1, column 1", "did you mean 'title'"]),
            (
                "seed = 1\n[settings]\netaa = 5",
                ["line 3, column 1", "did you mean 'eta'"],
            ),
            ("[settings]\neta = true", ["line 2, column 7", "expected a number"]),
            ("[settings]\neta = []", ["line 2, column 7", "empty list"]),
            (
                "[[methods]]\nsolvr = \"lu\"",
                ["line 2, column 1", "did you mean 'solver'"],
            ),
            ("seed = \"x\"", ["line 1, column 8", "expected u64"]),
            ("trials = -3", ["line 1, column 10", "expected at least 1"]),
            (
                "measures = [\"e_c\"]",
                ["line 1", "unknown measure 'e_c', did you mean"],
            ),
            ("seed = = 1", ["line 1", ""]),
            ("trials = { until = \"e_a\" }", ["line 1", "missing field"]),
        ] {
            let error = refused(text);
            for part in parts {
                assert!(error.contains(part), "{text}: {error}");
            }
            assert_eq!(error.lines().count(), 1, "{error}");
        }
    }

    #[test]
    fn keys_can_be_set() {
        let file = ExperimentFile::parse("[settings]\neta = 3\n[[methods]]\nsolver = \"lu\"").unwrap();
        let set = |text: &str| file.set(text);
        let number = |x| Axis::One(Scalar::Number(x));
        assert_eq!(set("eta=5").unwrap().settings[&Key::Eta], number(5.0));
        assert_eq!(
            set("settings.window = 98").unwrap().settings[&Key::Window],
            number(98.0)
        );
        let white = Axis::One(Scalar::Text("white".to_owned()));
        assert_eq!(set("noise=white").unwrap().settings[&Key::Noise], white);
        assert!(matches!(set("eta=[1, 2]").unwrap().settings[&Key::Eta], Axis::Many(_)));
        assert_eq!(set("seed=7").unwrap().seed, 7);
        assert!(set("methods.0.solver=qr").unwrap() != file);
        for (text, part) in [
            ("etaa=1", "did you mean 'eta'"),
            ("eta", "expected KEY=VALUE"),
            ("seed=x", "invalid type"),
            ("methods.7.solver=lu", "no '7'"),
            ("methods.0.solvr=lu", "did you mean 'solver'"),
        ] {
            let error = set(text).unwrap_err().to_string();
            assert!(error.contains(part), "{text}: {error}");
        }
    }

    #[test]
    fn a_resolved_file_is_its_own_resolution_through_json_too() {
        let text = "[settings]\neta = { logspace = [1, 100, 3] }\nl = [1, 2]\n\
                    [[methods]]\nsolver = [\"lu\", \"qr\"]\n[[methods]]\nestimator = \"ls\"";
        let resolved = ExperimentFile::parse(text).unwrap().resolve().unwrap();
        assert_eq!(resolved.methods.len(), 3);
        let json = serde_json::to_value(&resolved).unwrap();
        let back = ExperimentFile::from_json(&json).unwrap();
        assert_eq!(back, resolved);
        assert_eq!(back.clone().resolve().unwrap(), resolved);
        let only_iv = "[[methods]]\nestimator = \"ls\"\niterations = 3";
        let error = ExperimentFile::parse(only_iv)
            .unwrap()
            .resolve()
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("methods[0] (ls)") && error.contains("'iv' or 'wnsf' only"),
            "{error}"
        );
    }
}
