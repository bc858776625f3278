//! Chooses the methods that suit a case, each with orders that contain its model, if its structure can.

use super::arguments::Arguments;
use super::case::Case;
use crate::estimator::{EstimatorName, Method, MethodOptions, Window};
use serde_json::{Map, Value, json};

/// A method of the study.
pub(super) struct Chosen {
    pub(super) name: EstimatorName,
    /// The orders and the user's options.
    pub(super) options: Map<String, Value>,
    /// The last pass of several; only this one is reported.
    pub(super) pass: Option<usize>,
    /// The name of its output in the results.
    pub(super) label: String,
    /// Whether the method has standard errors of the coefficients on this record.
    pub(super) errors: bool,
}

/// The methods that suit the case, with the one that made the model first. Those that do not suit are left out, with
/// the reason.
pub(super) struct Methods {
    pub(super) chosen: Vec<Chosen>,
    pub(super) left_out: Vec<String>,
}

impl Methods {
    pub(super) fn labels(&self) -> Vec<&str> {
        self.chosen.iter().map(|chosen| chosen.label.as_str()).collect()
    }
}

pub(super) fn all(case: &Case, arguments: &Arguments) -> Methods {
    let own = arguments.estimator;
    let others = EstimatorName::ALL.iter().copied().filter(|name| *name != own);
    let mut methods = Methods {
        chosen: Vec::new(),
        left_out: Vec::new(),
    };
    for name in [own].into_iter().chain(others) {
        let mut options = arguments.options.taken_by(name);
        options.shift_remove("orders");
        match suited(case, name, own, options) {
            Ok(Some(chosen)) => methods.chosen.push(chosen),
            Ok(None) => {}
            Err(reason) => methods.left_out.push(format!("{name}: {reason}")),
        }
    }
    methods
}

/// Returns the method with its options; `None` if it knows the true plant. The error is why it does not suit.
fn suited(
    case: &Case,
    name: EstimatorName,
    own: EstimatorName,
    options: Map<String, Value>,
) -> Result<Option<Chosen>, String> {
    let form = name.parse(options.clone()).map_err(|error| error.to_string())?;
    if form.needs().plant {
        return Ok(None);
    }
    if form.needs().reference.is_some() {
        return Err("needs the reference of a closed loop".to_owned());
    }
    let with_orders = form.model_orders(case.plant.order()).map(|form| {
        let orders = if name == own {
            case.model.orders()
        } else {
            case.model.orders().holding(form)
        };
        let mut options = options.clone();
        options.insert("orders".to_owned(), json!(orders));
        options
    });
    match with_orders {
        None if case.model.delay > 1 => Err("has no delay".to_owned()),
        // A state-space method finds the delay among its states.
        Some(given) => chosen(case, name, given).or_else(|reason| chosen(case, name, options).map_err(|_| reason)),
        None => chosen(case, name, options),
    }
    .map(Some)
}

fn chosen(case: &Case, name: EstimatorName, options: Map<String, Value>) -> Result<Chosen, String> {
    let parsed: MethodOptions = name.parse(options.clone()).map_err(|error| error.to_string())?;
    let method = Method::named(name.name(), parsed);
    let (record, order) = (&case.report.record, case.plant.order());
    let window = Window::new(&record.u, &record.y, case.report.window);
    let passes = method.estimate_once(order, &[], window, true);
    let passes = passes.map_err(|error| error.to_string())?;
    let errors = passes.last().and_then(|pass| pass.model.standard_errors());
    let several = method.outputs().len() > 1;
    let last = method.outputs().last().ok_or("no output")?;
    Ok(Chosen {
        name,
        options,
        pass: several.then_some(last.pass),
        label: last.label(),
        errors: errors.is_some(),
    })
}
