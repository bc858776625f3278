//! The flags of `asobench estimate` for options of estimators, one for each option of the registry.

use super::span::Span;
use crate::estimator::{EstimatorName, OptionEntry, option_keys};
use crate::model::Orders;
use crate::names::UnknownName;
use clap::{Arg, ArgMatches, Command};
use serde_json::{Map, Value};
use std::sync::LazyLock;

/// A flag with the values that it accepts.
struct Flag {
    key: &'static str,
    /// The key, with hyphens.
    long: String,
    help: String,
    schema: Value,
}

/// Returns the names that a value may have; none if the value is not a name.
fn values(schema: &Value) -> Vec<String> {
    let names = schema["enum"].as_array().into_iter().flatten();
    names.filter_map(Value::as_str).map(str::to_owned).collect()
}

/// The options that are flags of the command itself: the gain of every estimator's observer, and the time between
/// samples, which a column of times may tell.
const OWN: [&str; 2] = ["gain", "ts"];

/// All flags but those of the command itself.
static FLAGS: LazyLock<Vec<Flag>> = LazyLock::new(|| {
    let flag = |key: &'static str| {
        let takers = EstimatorName::ALL.iter().filter(|name| name.takes(key));
        let takers: Vec<EstimatorName> = takers.copied().collect();
        let entry = |estimator: EstimatorName| {
            let mut options = estimator.options().iter();
            options.find(|option| option.key == key).cloned()
        };
        let OptionEntry {
            about,
            default,
            mut schema,
            ..
        } = entry(*takers.first()?)?;
        // Estimators with other values of a key add their own description.
        let (mut names, mut other_names, mut others) = (Vec::new(), Vec::new(), String::new());
        for name in &takers {
            let other = entry(*name)?;
            let new: Vec<Value> = values(&other.schema)
                .into_iter()
                .filter(|value| !values(&schema).contains(value))
                .map(Value::from)
                .collect();
            if new.is_empty() && other.about != others {
                names.push(name.name());
            } else {
                other_names.push(name.name());
                others.clone_from(&other.about);
                if let Some(valid) = schema["enum"].as_array_mut() {
                    valid.extend(new);
                }
            }
        }
        let others = match others.trim_end_matches('.') {
            "" => String::new(),
            others => {
                let words: Vec<&str> = others.split_whitespace().collect();
                format!("; {}: {}", other_names.join(", "), words.join(" "))
            }
        };
        let default = match default {
            Value::Null => String::new(),
            Value::String(text) => format!(" [default: {text}]"),
            other => format!(" [default: {other}]"),
        };
        let letters = match key {
            ORDERS => "; also letter by letter, --na 2 --nb 2 --nk 1, or in MATLAB's order, 2,2,1 or \"[2 2 1]\"",
            _ => "",
        };
        let (names, about) = (names.join(", "), about.trim_end_matches('.'));
        Some(Flag {
            key,
            long: key.replace('_', "-"),
            help: format!("{names}: {about}{others}{default}{letters}"),
            schema,
        })
    };
    let keys = option_keys().iter().map(String::as_str);
    let mut flags: Vec<Flag> = keys.filter(|key| !OWN.contains(key)).filter_map(flag).collect();
    // One flag for what the file has under two keys.
    let state = flags.iter().position(|flag| flag.key == STATE);
    if let Some(state) = state.map(|at| flags.remove(at))
        && let Some(signals) = flags.iter_mut().find(|flag| flag.key == SIGNALS)
    {
        let help = signals.help.replace(" [default: zero]", AUTO_HELP);
        signals.help = format!("{help}; {}", state.help);
        if let Some(valid) = signals.schema["enum"].as_array_mut() {
            valid.push(Value::from(AUTO));
        }
    }
    flags
});

/// The keys of the start of a record: the signals before it, and the state at its first sample. `--initial` is either,
/// whichever an estimator has.
const SIGNALS: &str = "initial";
const STATE: &str = "initial_state";

/// Estimates the signals before the record where they are significantly not zero; so does no flag.
const AUTO: &str = "auto";
const AUTO_HELP: &str = "; auto: estimate where a likelihood ratio test at 0.001 says so [default: auto]";

/// The key of the offset, which is estimated where the flag stands alone.
const OFFSET: &str = "offset";

/// The key of the orders.
pub(super) const ORDERS: &str = "orders";

/// Returns the key of an estimator's option that a flag sets.
fn key_of(flag: &str, estimator: EstimatorName) -> &str {
    if flag == SIGNALS && estimator.takes(STATE) {
        STATE
    } else {
        flag
    }
}

/// Returns the flag that sets an option.
pub(super) fn flag_of(key: &str) -> String {
    let key = if key == STATE { SIGNALS } else { key };
    format!("--{}", key.replace('_', "-"))
}

/// The options that were given.
#[derive(Clone, Debug, Default)]
pub(super) struct OptionFlags {
    options: Map<String, Value>,
    /// Orders that were given one by one: `--na 2 --nb 2 --nk 1`.
    pub(super) letters: Vec<(&'static str, Span)>,
}

/// The orders that are flags of their own too, in MATLAB's order.
pub(super) const LETTERS: [&str; 6] = ["na", "nb", "nc", "nd", "nf", "nk"];

impl Flag {
    /// Parses a text, if it fits the schema.
    fn read(&self, text: &str) -> Result<Value, String> {
        if let Some(valid) = self.schema["enum"].as_array() {
            let valid: Vec<&str> = valid.iter().filter_map(Value::as_str).collect();
            if !valid.contains(&text) {
                let what = self.long.as_str();
                return Err(UnknownName::new(what, text, &valid).to_string());
            }
        }
        // An option without a default may also be null.
        let is = |name: &str| {
            let kind = &self.schema["type"];
            let kinds = kind.as_array().map_or(std::slice::from_ref(kind), Vec::as_slice);
            kinds.iter().any(|kind| kind == name)
        };
        if is("boolean") {
            let expected = |_| "expected true or false".to_owned();
            return text.parse().map(Value::Bool).map_err(expected);
        }
        if is("integer") {
            let number: Result<u64, _> = text.parse();
            let expected = |_| "expected a whole number".to_owned();
            return number.map(Value::from).map_err(expected);
        }
        // An option that may be a text too, such as a gain, is read as a text.
        if is("number") && !is("string") {
            let number: Option<f64> = text.parse().ok().filter(|number: &f64| number.is_finite());
            return number.map(Value::from).ok_or_else(|| "expected a number".to_owned());
        }
        Ok(Value::String(text.to_owned()))
    }
}

impl clap::Args for OptionFlags {
    fn augment_args(command: Command) -> Command {
        // Hidden: the help of --orders has them.
        let letters = LETTERS.map(|name| {
            let argument = Arg::new(name).long(name).value_name("N").hide(true);
            argument.allow_negative_numbers(true).value_parser(Span::of_orders)
        });
        FLAGS.iter().fold(command.args(letters), |command, flag| {
            let argument = Arg::new(flag.key)
                .long(flag.long.as_str())
                .value_name("VALUE")
                .help(flag.help.as_str())
                .hide_short_help(true)
                .allow_negative_numbers(true)
                .value_parser(|text: &str| flag.read(text));
            command.arg(match flag.key {
                SIGNALS => argument.alias("initial-state"),
                OFFSET => argument.num_args(0..=1).default_missing_value("estimate"),
                _ if flag.schema["type"] == "boolean" => {
                    let given = argument.num_args(0..=1).require_equals(true);
                    given.default_missing_value("true")
                }
                _ => argument,
            })
        })
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl clap::FromArgMatches for OptionFlags {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut given = Self::default();
        given.update_from_arg_matches(matches)?;
        Ok(given)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        for flag in FLAGS.iter() {
            let value = matches.get_one::<Value>(flag.key);
            if let Some(value) = value.filter(|value| *value != AUTO) {
                self.options.insert(flag.key.to_owned(), value.clone());
            }
        }
        for name in LETTERS {
            self.letters.extend(matches.get_one(name).map(|span| (name, *span)));
        }
        Ok(())
    }
}

impl OptionFlags {
    /// Returns one of the given options as a flag; `None` if none was given.
    pub(super) fn first(&self) -> Option<String> {
        self.options.keys().next().map(|key| flag_of(key))
    }

    /// Sets the orders as one option.
    pub(super) fn set_orders(&mut self, orders: Orders) {
        self.options.insert(ORDERS.to_owned(), Value::from(orders.to_string()));
        self.letters.clear();
    }

    /// Returns the orders as they were given as one option.
    pub(super) fn orders(&self) -> Option<&str> {
        self.options.get(ORDERS)?.as_str()
    }

    /// Returns the given options that some estimators of a list do not take, as flags, each with these estimators.
    pub(super) fn left_out(&self, estimators: &[EstimatorName]) -> Vec<(String, Vec<EstimatorName>)> {
        let without = self.options.keys().map(|key| {
            let takes = |estimator: &&EstimatorName| !estimator.takes(key_of(key, **estimator));
            (
                flag_of(key),
                estimators.iter().filter(takes).copied().collect::<Vec<_>>(),
            )
        });
        without.filter(|(_, estimators)| !estimators.is_empty()).collect()
    }

    /// Whether the record tells how an estimator begins.
    pub(super) fn start_is_free(&self, estimator: EstimatorName) -> bool {
        estimator.takes(SIGNALS) && !self.has(SIGNALS)
    }

    /// Lets an estimator begin as it does in studies, where it can begin in two ways and none was given.
    pub(super) fn begin_as_in_studies(&mut self, estimator: EstimatorName) {
        let mut options = estimator.options().iter();
        let option = options.find(|option| option.key == SIGNALS);
        if let Some(option) = option.filter(|_| self.start_is_free(estimator)) {
            let default = option.default.clone();
            self.options.insert(SIGNALS.to_owned(), default);
        }
    }

    /// Fits the start together with the model.
    pub(super) fn estimate_start(options: &mut Map<String, Value>) {
        options.insert(SIGNALS.to_owned(), Value::from("estimate"));
    }

    /// Whether an option was given.
    pub(super) fn has(&self, key: &str) -> bool {
        self.options.contains_key(key)
    }

    /// Returns the given options that an estimator takes.
    pub(super) fn taken_by(&self, estimator: EstimatorName) -> Map<String, Value> {
        let named = self.options.iter().map(|(key, value)| (key_of(key, estimator), value));
        let taken = named.filter(|(key, _)| estimator.takes(key));
        taken.map(|(key, value)| (key.to_owned(), value.clone())).collect()
    }

    /// Returns a message about a flag that none of the estimators takes, naming those that do.
    pub(super) fn useless(&self, estimators: &[EstimatorName]) -> Option<String> {
        let takes = |estimator: &EstimatorName, key: &str| estimator.takes(key_of(key, *estimator));
        let taken = |key: &String| estimators.iter().any(|estimator| takes(estimator, key));
        // The command itself uses orders, too.
        let mut keys = self.options.keys().filter(|key| *key != ORDERS);
        let key = keys.find(|key| !taken(key))?;
        let takers = EstimatorName::ALL.iter().filter(|name| takes(name, key));
        let takers: Vec<String> = takers.map(|name| format!("'{name}'")).collect();
        Some(format!(
            "{}: an option of estimator {} only",
            flag_of(key),
            takers.join(" or ")
        ))
    }
}
