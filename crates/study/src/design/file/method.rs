//! The methods of an experiment file: estimators of the registry with their options, or external programs.

use crate::design::file::{At, FileError, LIST_LIMIT, at_most, wrong};
use crate::worker::{self, CommandOptions, Program};
use asobench_identification::estimator::{
    EstimatorName, IvOptions, MOST_ITERATIONS, Method, MethodOptions, Needs, Output, inline_schema, option_keys,
};
use asobench_identification::names::UnknownName;
use asobench_identification::observer::ObserverKind;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, de};
use serde_json::{Map, Value, json};
use std::fmt;
use std::sync::Arc;

/// The keys that every method has, in addition to the options of its estimator.
const COMMON: [&str; 5] = ["name", "estimator", "observer", "last", "report"];

/// The keys of a method that is a program. `orders` is an option of estimators too, so it is not listed.
const OF_PROGRAM: [&str; 6] = ["command", "batch", "timeout", "workers", "told", "worker"];

/// A method: an estimator with its options, or a program. A list in an option, or of observers, makes one method per
/// value.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct MethodTable {
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    estimator: Option<EstimatorName>,
    /// In the registry's order.
    #[serde(flatten)]
    options: Map<String, Value>,
    /// The options of a method that is a program.
    #[serde(flatten)]
    program: Option<CommandOptions>,
    #[serde(skip_serializing_if = "Option::is_none")]
    observer: Option<Value>,
    /// How many of the last samples of the window the method sees; all if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    last: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    report: Option<Vec<usize>>,
}

/// A key of a method, for any estimator.
struct MethodKey(String);

impl<'de> Deserialize<'de> for MethodKey {
    /// Refuses an unknown key while parsing, so that the error names its line.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let key = String::deserialize(deserializer)?;
        let mut valid: Vec<&str> = COMMON[..2].to_vec();
        valid.extend(option_keys().iter().map(String::as_str));
        valid.extend(&COMMON[2..]);
        valid.extend(OF_PROGRAM);
        if valid.contains(&key.as_str()) {
            return Ok(Self(key));
        }
        Err(de::Error::custom(UnknownName::new("key", &key, &valid)))
    }
}

/// Whether an option is true or false.
fn is_boolean(key: &str) -> bool {
    let mut options = EstimatorName::ALL.iter().flat_map(|name| name.options());
    options.any(|option| option.key == key && option.schema["type"] == "boolean")
}

/// A value of any other option, or a list of values.
struct OptionValue(Value);

impl<'de> Deserialize<'de> for OptionValue {
    /// Refuses a value that no option can have while parsing, so that the error names its line.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let is_number = |value: &Value| value.is_u64() || value.is_f64();
        let single = |value: &Value| is_number(value) || value.is_string() || value.is_object();
        let value = Value::deserialize(deserializer)?;
        let fits = match &value {
            Value::Array(values) => values.iter().all(single),
            value => single(value),
        };
        if fits {
            return Ok(Self(value));
        }
        let expected = "expected a whole number, a fraction, a text, or a list of these";
        Err(de::Error::custom(expected))
    }
}

impl<'de> Deserialize<'de> for MethodTable {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Table;

        impl<'de> Visitor<'de> for Table {
            type Value = MethodTable;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a table of a method")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<MethodTable, A::Error> {
                let mut table = MethodTable::default();
                let (mut options, mut program) = (Map::new(), Map::new());
                while let Some(MethodKey(key)) = map.next_key()? {
                    match key.as_str() {
                        "name" => table.name = Some(map.next_value()?),
                        "estimator" => table.estimator = Some(map.next_value()?),
                        "last" => table.last = Some(map.next_value()?),
                        "report" => table.report = Some(map.next_value()?),
                        "observer" => {
                            let OptionValue(value) = map.next_value()?;
                            table.observer = Some(value);
                        }
                        of if OF_PROGRAM.contains(&of) => {
                            program.insert(key, map.next_value()?);
                        }
                        of if is_boolean(of) => {
                            options.insert(key, Value::Bool(map.next_value()?));
                        }
                        _ => {
                            let OptionValue(value) = map.next_value()?;
                            options.insert(key, value);
                        }
                    }
                }
                if !program.is_empty() {
                    program.extend(options.shift_remove_entry("orders"));
                    let read = serde_json::from_value(Value::Object(program));
                    table.program = Some(read.map_err(de::Error::custom)?);
                }
                for key in option_keys() {
                    table.options.extend(options.shift_remove_entry(key));
                }
                Ok(table)
            }
        }

        deserializer.deserialize_map(Table)
    }
}

impl schemars::JsonSchema for MethodTable {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "MethodTable".into()
    }

    /// Describes one form for each estimator of the registry.
    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let form = |estimator: &EstimatorName| {
            let several = |schema: &Value| json!([schema, { "type": "array", "items": schema }]);
            let text = json!({ "type": "string" });
            let name = "Name in the results; by default the estimator's, with the options that have lists.";
            let mut properties = json!({
                "name": { "description": name, "type": "string" },
                "estimator": { "const": estimator.name(), "description": estimator.about() },
            });
            for option in estimator.options() {
                let mut schema = json!({ "description": option.about, "anyOf": several(&option.schema) });
                if !option.default.is_null() {
                    schema["default"] = option.default.clone();
                }
                properties[&option.key] = schema;
            }
            let observer = "The observer of this method's outputs instead of the setting `gain`: dead-beat, \
                scaled:RHO, poles:LIST; kalman (steady state; its noise known with \"known\", else identified on the \
                window, as white); kalman-coloured (the same with the colour C / (A D) of the method's own noise \
                model, not with \"known\"); with \"known\" also kalman-varying (from the covariance of x(0)) and \
                kalman:NAME (with the covariances of the noise in [covariances.NAME], right or wrong).";
            properties["observer"] = json!({ "description": observer, "anyOf": several(&text) });
            properties["last"] = json!({
                "description": "How many of the last samples of the window the method sees, a sliding window; all by \
                 default. x0 is taken as 0 then.",
                "type": "integer",
                "minimum": 1
            });
            properties["report"] = json!({
                "description": "The passes that are reported; all by default.",
                "type": "array",
                "items": { "type": "integer", "minimum": 0 }
            });
            let mut form = json!({
                "type": "object",
                "properties": properties,
                "additionalProperties": false
            });
            if *estimator != EstimatorName::default() {
                form["required"] = json!(["estimator"]);
            }
            form
        };
        let mut forms: Vec<Value> = EstimatorName::ALL.iter().map(form).collect();
        forms.push(program_form(&forms[0]["properties"]));
        schemars::json_schema!({
            "description": "A method: an estimator with its options; a list makes one method per value.",
            "anyOf": forms
        })
    }
}

/// Returns the form of a method that is a program; some properties are those of estimators.
fn program_form(of_estimator: &Value) -> Value {
    let mut form = inline_schema::<CommandOptions>();
    let mut properties = Map::from_iter([("name".to_owned(), json!({ "type": "string" }))]);
    if let Some(Value::Object(own)) = form.get_mut("properties").map(Value::take) {
        properties.extend(own);
    }
    properties.insert("observer".to_owned(), of_estimator["observer"].clone());
    json!({
        "description": "A method that is an external program; see docs/protocol.md.",
        "type": "object",
        "properties": properties,
        "required": ["name", "command"],
        "additionalProperties": false
    })
}

impl MethodTable {
    /// Returns one table per combination of the options' lists, with every option written out. `index` is the place of
    /// this table in the file.
    pub(crate) fn expand(&self, index: usize) -> Result<Vec<Self>, FileError> {
        self.check_program(index)?;
        let mut combinations = vec![(self.base_name(), Map::new())];
        let observer = self.observer.iter().map(|value| ("observer", value));
        let options = self.options.iter().map(|(key, value)| (key.as_str(), value));
        for (key, value) in options.chain(observer) {
            let Value::Array(values) = value else {
                for (_, options) in &mut combinations {
                    options.insert(key.to_owned(), value.clone());
                }
                continue;
            };
            if values.is_empty() {
                let place = format_args!("methods[{index}].{key}");
                return wrong(place, "an empty list; expected at least one value");
            }
            let several = combinations.len().saturating_mul(values.len());
            at_most(
                &format!("methods[{index}]"),
                several,
                "methods of its lists",
                LIST_LIMIT,
            )?;
            let with = |name: &str, options: &Map<String, Value>, value: &Value| {
                let mut options = options.clone();
                options.insert(key.to_owned(), value.clone());
                let text = self.value_text(index, key, value);
                let name = match values.len() {
                    1 => name.to_owned(),
                    _ => format!("{name} {key}={text}"),
                };
                (name, options)
            };
            combinations = combinations
                .iter()
                .flat_map(|(name, options)| values.iter().map(move |v| with(name, options, v)))
                .collect();
        }
        combinations
            .into_iter()
            .map(|(name, mut options)| {
                let observer = options.shift_remove("observer");
                Ok(Self {
                    name: Some(name),
                    estimator: self.program.is_none().then(|| self.estimator()),
                    options: match self.program {
                        None => self.parse(index, options)?.describe(),
                        Some(_) => options,
                    },
                    program: self.program.clone(),
                    observer,
                    last: self.last,
                    report: self.report.clone(),
                })
            })
            .collect()
    }

    /// Checks that the name of a method without an estimator is not that of one.
    fn check_name(&self, index: usize) -> Result<(), FileError> {
        let named = self.name.as_deref().and_then(|name| name.parse::<EstimatorName>().ok());
        match (self.estimator, named) {
            (None, Some(named)) if named != EstimatorName::default() => wrong(
                format_args!("methods[{index}].estimator"),
                format!(
                    "a method without an estimator is {}, but this one is named '{named}'; expected estimator = \
                     \"{named}\", or another name",
                    EstimatorName::default()
                ),
            ),
            _ => Ok(()),
        }
    }

    /// Checks that a program has a name, and no estimator and no option of one.
    fn check_program(&self, index: usize) -> Result<(), FileError> {
        let Some(program) = &self.program else {
            return self.check_name(index);
        };
        let wrong = |key: &str, message: &str| wrong(format_args!("methods[{index}].{key}"), message);
        if self.name.is_none() {
            return wrong("name", "expected a name for the method that 'command' is");
        }
        if self.estimator.is_some() {
            return wrong("estimator", "cannot be set together with 'command'");
        }
        if let Some(key) = self.options.keys().next() {
            return wrong(key, "an option of estimators; a 'command' does not take it");
        }
        match program.check() {
            Ok(()) => Ok(()),
            Err((key, message)) => wrong(key, &message),
        }
    }

    /// Returns the program that the method is, if it is one.
    pub fn program(&self) -> Option<&CommandOptions> {
        self.program.as_ref()
    }

    /// Records what the program says that it is.
    pub fn set_worker(&mut self, identity: String) {
        if let Some(program) = &mut self.program {
            program.worker = Some(identity);
        }
    }

    /// Sends a program at most so many records in a message.
    pub fn limit_batch(&mut self, most: u64) {
        if let Some(program) = &mut self.program {
            program.batch = program.batch.min(most);
        }
    }

    /// Returns an option's value as part of a name, in the option's own spelling.
    fn value_text(&self, index: usize, key: &str, value: &Value) -> String {
        let alone = Map::from_iter([(key.to_owned(), value.clone())]);
        let described = self.parse(index, alone).map(|options| options.describe());
        let written = described.ok().and_then(|mut options| options.remove(key));
        let value = written.as_ref().unwrap_or(value);
        value.as_str().map_or_else(|| value.to_string(), str::to_owned)
    }

    pub(crate) fn base_name(&self) -> String {
        let estimator = self.estimator();
        self.name.clone().unwrap_or_else(|| estimator.to_string())
    }

    fn parse(&self, index: usize, options: Map<String, Value>) -> Result<MethodOptions, FileError> {
        let estimator = self.estimator();
        let place = format!("methods[{index}] ({estimator})");
        if let Some(other) = options.keys().find(|key| !estimator.takes(key)) {
            let takers = EstimatorName::ALL.iter().filter(|name| name.takes(other));
            let takers: Vec<String> = takers.map(|name| format!("'{name}'")).collect();
            let takers = takers.join(" or ");
            let message = format!("'{other}' is an option of estimator {takers} only");
            return wrong(&place, message);
        }
        estimator.parse(options).at(place)
    }

    /// Returns the options of an IV method of a resolved file; `None` for another method.
    pub fn iv_options(&self) -> Option<IvOptions> {
        if self.program.is_some() {
            return None;
        }
        match self.parse(0, self.options.clone()) {
            Ok(MethodOptions::InstrumentalVariables(options)) => Some(options),
            _ => None,
        }
    }

    /// Whether its passes solve the paper's equations, stages 2 and 9.
    pub fn is_of_the_paper(&self) -> bool {
        self.program.is_none() && self.estimator().takes("solver")
    }

    /// Returns the estimator of the method.
    pub(crate) fn estimator(&self) -> EstimatorName {
        self.estimator.unwrap_or_default()
    }

    /// Returns what the method needs besides a record; a program needs nothing.
    pub(crate) fn needs(&self) -> Needs {
        match self.parse(0, self.options.clone()) {
            Ok(options) if self.program.is_none() => options.needs(),
            _ => Needs::default(),
        }
    }

    /// Returns the name of the outputs of a pass, in a resolved file.
    pub fn output_name(&self, pass: usize) -> String {
        let name = self.base_name();
        if self.program.is_some() {
            return name;
        }
        let output = self.outputs().into_iter().find(|output| output.pass == pass);
        output.map_or(name, |output| output.estimator)
    }

    /// Returns the labels of the outputs that a table from [`Self::expand`] that is no program reports.
    pub(crate) fn labels(&self) -> Vec<String> {
        self.reported().iter().map(Output::label).collect()
    }

    /// Returns the table with the reported outputs of these labels alone; `None` if there are none.
    pub(super) fn with_outputs(&self, is_wanted: impl Fn(String) -> bool) -> Option<Self> {
        if self.program.is_some() {
            return None;
        }
        let reported = self.reported();
        let wanted = reported.iter().filter(|output| is_wanted(output.label()));
        let passes: Vec<usize> = wanted.map(|output| output.pass).collect();
        (!passes.is_empty()).then(|| Self {
            report: Some(passes),
            ..self.clone()
        })
    }

    fn reported(&self) -> Vec<Output> {
        let mut outputs = self.outputs();
        if let Some(passes) = &self.report {
            outputs.retain(|output| passes.contains(&output.pass));
        }
        outputs
    }

    fn outputs(&self) -> Vec<Output> {
        let options = self.parse(0, self.options.clone());
        options.map_or_else(|_| Vec::new(), |options| options.outputs(&self.base_name()))
    }

    /// Returns the method's own observer, if a table from [`Self::expand`] has one.
    pub(crate) fn observer(&self, index: usize) -> Result<Option<ObserverKind>, FileError> {
        let place = format!("methods[{index}].observer");
        let text = match &self.observer {
            None => return Ok(None),
            Some(Value::String(text)) => text,
            Some(_) => {
                return wrong(&place, "expected a text, such as \"kalman\"");
            }
        };
        let observer = text.parse::<ObserverKind>().at(&place)?;
        let known = self.estimator == Some(EstimatorName::Known);
        if observer == ObserverKind::KalmanVarying && !known {
            let message = "'kalman-varying' is an observer of estimator 'known' only; expected kalman";
            return wrong(&place, message);
        }
        if let (ObserverKind::KalmanNamed(_), false) = (&observer, known) {
            let message = format!("'{observer}' is an observer of estimator 'known' only; expected kalman");
            return wrong(&place, message);
        }
        if observer == ObserverKind::KalmanColoured && known {
            let message = "'kalman-coloured' is an observer of identified models; expected kalman, which knows the \
                colour";
            return wrong(&place, message);
        }
        Ok(Some(observer))
    }

    /// Makes the method of a table from [`Self::expand`]; `index` is its place. `program` is the program that the
    /// method is, if it is one.
    pub(crate) fn method(&self, index: usize, program: Option<&Arc<Program>>) -> Result<Method, FileError> {
        let mut method = match program {
            Some(program) => worker::method(program),
            None => Method::named(&self.base_name(), self.parse(index, self.options.clone())?),
        };
        if let Some(observer) = self.observer(index)? {
            method = method.observed_by(observer);
        }
        if let Some(last) = self.last {
            if last == 0 || program.is_some() {
                let message = format!("{last}; expected a number of samples above 0, of an estimator");
                return wrong(format_args!("methods[{index}].last"), message);
            }
            method = method.on_last(last);
        }
        let Some(passes) = &self.report else {
            return Ok(method);
        };
        let place = format!("methods[{index}].report");
        if passes.is_empty() {
            let message = "an empty list; expected at least one pass";
            return wrong(&place, message);
        }
        at_most(&place, passes.len(), "passes", MOST_ITERATIONS + 1)?;
        let reporting = method.reporting(passes);
        reporting.map_err(|beyond| FileError::key(&place, format!("there is no pass {beyond}")))
    }
}
