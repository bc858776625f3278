//! The methods that take part in the suite, and what they are told of a system.

use super::manifest::Division;
use crate::design::file::MethodTable;
use crate::suite::IDEAL;
use asobench_identification::estimator::{EstimatorName, Needs, OrderRule};
use asobench_identification::model::Orders;
use asobench_identification::signal::NoiseLaw;
use serde_json::{Map, Value, json};

/// In the open division the largest order to choose from.
const MOST: usize = 6;
/// There the taps of an impulse response, but for short records.
const TAPS: usize = 100;

/// One method of each kind for the first picture: least squares, instrumental variables, prediction errors, a subspace,
/// a kernel, an adaptive observer.
pub const KINDS: [&str; 6] = ["arx", "iv4", "bj", "ssarx", "kernel-fir", "zhang"];

/// A method that takes part in the suite.
#[derive(Clone, Debug, PartialEq)]
pub enum Competitor {
    /// An estimator of the registry with its default options; in the open division it chooses its order.
    Estimator(EstimatorName),
    /// The same, told the structure of the truth too: for estimators of several structures, whose default is B/F. In
    /// the contest `structure` all are told it.
    Structured(EstimatorName),
    /// The maximum likelihood of the scenario's own structure and density, started at the truth; in editions 1 the
    /// prediction error method.
    Ideal,
    /// A method of a user's file.
    Own(Box<MethodTable>),
}

/// The facts of a study that methods may be told.
#[derive(Clone, Debug, Default)]
pub(super) struct Told {
    /// The order of the plant.
    pub(super) order: usize,
    /// The orders of the truth, `A y = B/F u + C/D e` in lowest terms.
    pub(super) truth: Orders,
    /// The controller of the loop, as methods take it.
    pub(super) controller: Option<Value>,
    /// The smallest N.
    pub(super) shortest: usize,
    /// The knowledge of it that methods are given.
    pub(super) division: Division,
    /// Whether the edition has contests.
    pub(super) has_contests: bool,
    /// The density of the innovations.
    pub(super) law: NoiseLaw,
    /// Whether the input is measured with noise.
    pub(super) has_noisy_input: bool,
}

impl Told {
    /// The estimator that reaches the bound, and whether it searches: maximum likelihood of the input's noise, of the
    /// density, or of the structure. Outliers have that of Student's t, which is near theirs.
    fn ideal(&self) -> (&'static str, bool) {
        match (self.has_contests, &self.law, self.has_noisy_input) {
            (true, _, true) => ("pem-eiv", true),
            (true, NoiseLaw::StudentT(_) | NoiseLaw::Contaminated { .. }, _) => ("pem-t", true),
            (true, _, _) if self.truth.na > 0 && self.truth.nd + self.truth.nf > 0 => ("general", true),
            _ => of_structure(self.truth),
        }
    }

    /// The orders of the truth, as far as methods are told them: na, nb and nk of the plant, all, or the largest to
    /// choose from. In the open contest the delay is not told either.
    fn orders(&self) -> Orders {
        let Orders { na, nb, nf, nk, .. } = self.truth;
        match self.division {
            Division::Closed | Division::Structure => self.truth,
            Division::Orders => Orders::arx(na + nf, nb, nk),
            Division::Open if self.has_contests => Orders::arx(MOST, MOST, 1),
            Division::Open => Orders::arx(MOST, MOST, nk),
        }
    }

    /// The orders that an estimator of a form is told; `form`: its own defaults, of an order.
    fn of_form(&self, form: impl Fn(usize) -> Option<Orders>) -> Option<Orders> {
        let told = self.orders();
        match self.division {
            Division::Closed | Division::Structure => Some(told.holding(form(self.order)?)),
            Division::Orders => {
                // Of the noise it has its own defaults.
                let own = form(told.na)?;
                let Orders { na, nb, nf, nk, .. } = told.holding(own);
                Some(Orders { na, nb, nf, nk, ..own })
            }
            Division::Open => Some(Orders {
                nk: told.nk,
                ..form(MOST)?
            }),
        }
    }
}

impl Competitor {
    /// All that take part in a division by default, the ideal last. Closed: the estimators of the registry, and those
    /// that are told the structure. Orders: the estimators of the registry. Structure: those whose form has a model of
    /// the noise, and those of any structure. Open: the estimators that choose their order by themselves.
    pub fn of(division: Division) -> Vec<Self> {
        let estimators = EstimatorName::ALL.iter().copied();
        // By default `general` is `oe`.
        let others = [EstimatorName::Known, EstimatorName::General];
        let estimators = estimators.filter(|name| !others.contains(name));
        let structured = STRUCTURED.map(Self::Structured);
        let mut all: Vec<Self> = match division {
            Division::Closed => {
                let estimators = estimators.filter(|name| !LATER.contains(name));
                let structured = structured.into_iter().take(2);
                estimators.map(Self::Estimator).chain(structured).collect()
            }
            Division::Orders => estimators.map(Self::Estimator).collect(),
            Division::Structure => {
                let shaped = estimators.filter(|name| models_noise(*name));
                shaped.map(Self::Estimator).chain(structured).collect()
            }
            Division::Open => estimators.filter(|name| chooses(*name)).map(Self::Estimator).collect(),
        };
        all.push(Self::Ideal);
        all
    }

    /// Its name in results.
    pub fn name(&self) -> String {
        match self {
            Self::Estimator(name) => name.name().to_owned(),
            Self::Structured(EstimatorName::General) => "pem-structure".to_owned(),
            Self::Structured(name) => format!("{name}-structure"),
            Self::Ideal => IDEAL.to_owned(),
            Self::Own(table) => table.output_name(0),
        }
    }

    /// The knowledge that it needs besides a record.
    pub(super) fn needs(&self) -> Needs {
        match self {
            Self::Estimator(estimator) | Self::Structured(estimator) => {
                let default = estimator.parse(Map::new());
                default.map_or_else(|_| Needs::default(), |options| options.needs())
            }
            Self::Ideal => Needs::default(),
            Self::Own(table) => table.needs(),
        }
    }

    /// The tables of the method for a study, the preferred one first: told the orders if it takes any, and the
    /// controller if it needs it.
    pub(super) fn tables(&self, told: &Told) -> Vec<Value> {
        let (name, truth) = (self.name(), told.truth);
        let controller = told.controller.clone().filter(|_| self.needs().controller);
        let controller = controller.map(|law| ("controller".to_owned(), law));
        let mut options: Map<String, Value> = controller.into_iter().collect();
        let with_orders =
            |orders: Orders, estimator: &str| json!({ "name": name, "estimator": estimator, "orders": orders });
        match self {
            Self::Structured(estimator) => {
                // The structure of the truth, or the smallest ARMAX model that holds it.
                let common = Orders {
                    nc: 1,
                    ..Orders::arx(1, 1, 1)
                };
                let orders = [truth, truth.holding(common)];
                orders.map(|orders| with_orders(orders, estimator.name())).to_vec()
            }
            Self::Estimator(EstimatorName::KernelFir) if told.division.is_open() => {
                // The response is the model.
                let orders = Orders {
                    nb: TAPS.min(told.shortest / 2),
                    nk: told.orders().nk,
                    ..Orders::default()
                };
                vec![with_orders(orders, EstimatorName::KernelFir.name())]
            }
            Self::Estimator(estimator) => {
                if told.division.is_open() {
                    options.insert("choose".to_owned(), json!(OrderRule::default()));
                }
                of_estimator(*estimator, &name, options, told)
            }
            Self::Ideal => {
                let (estimator, is_searched) = told.ideal();
                let mut table = with_orders(truth, estimator);
                if is_searched {
                    table["starts"] = json!("truth");
                }
                if let (NoiseLaw::StudentT(freedom), "pem-t") = (&told.law, estimator) {
                    table["freedom"] = json!(freedom);
                }
                vec![table]
            }
            Self::Own(table) => {
                let Ok(Value::Object(mut given)) = serde_json::to_value(&**table) else {
                    return Vec::new();
                };
                if given.contains_key("orders") {
                    return vec![Value::Object(given)];
                }
                if table.program().is_some() {
                    given.insert("orders".to_owned(), json!(told.orders()));
                    return vec![Value::Object(given)];
                }
                let options = options.into_iter().chain(given).collect();
                of_estimator(table.estimator(), &name, options, told)
            }
        }
    }
}

/// The estimators of several structures; the first two take part in editions 1.
const STRUCTURED: [EstimatorName; 4] = [
    EstimatorName::Wnsf,
    EstimatorName::Rpem,
    EstimatorName::General,
    EstimatorName::PemT,
];
/// The estimators that came after editions 1.
const LATER: [EstimatorName; 3] = [EstimatorName::General, EstimatorName::PemT, EstimatorName::PemEiv];

/// Whether the form of an estimator has C or D.
fn models_noise(estimator: EstimatorName) -> bool {
    let default = estimator.parse(Map::new());
    let form = default.ok().and_then(|options| options.model_orders(1));
    form.is_some_and(|form| form.nc + form.nd > 0)
}

/// Whether an estimator chooses its order: by an option, or as an impulse response that needs none.
fn chooses(estimator: EstimatorName) -> bool {
    let rule = Map::from_iter([("choose".to_owned(), json!(OrderRule::default()))]);
    estimator == EstimatorName::KernelFir || estimator.parse(rule).is_ok()
}

/// The prediction error method of a structure, and whether it searches.
fn of_structure(truth: Orders) -> (&'static str, bool) {
    match truth {
        Orders {
            na: 1.., nf: 0, nc: 0, ..
        } => ("arx", false),
        Orders { na: 1.., nf: 0, .. } => ("armax", true),
        Orders { nc: 0, nd: 0, .. } => ("oe", true),
        _ => ("bj", true),
    }
}

/// The tables of an estimator with some options, with the orders that it is told and without.
fn of_estimator(estimator: EstimatorName, name: &str, options: Map<String, Value>, told: &Told) -> Vec<Value> {
    let mut plain = options;
    plain.insert("name".to_owned(), json!(name));
    plain.insert("estimator".to_owned(), json!(estimator.name()));
    let Ok(default) = estimator.parse(Map::new()) else {
        return Vec::new();
    };
    if let Some(last) = default.outputs("").last().filter(|last| last.pass > 0) {
        plain.entry("report").or_insert(json!([last.pass]));
    }
    let orders = told.of_form(|order| {
        if told.division.is_open() {
            default.default_orders(order)
        } else {
            default.model_orders(order)
        }
    });
    let told = orders.map(|orders| {
        let mut told = plain.clone();
        told.insert("orders".to_owned(), json!(orders));
        Value::Object(told)
    });
    told.into_iter().chain([Value::Object(plain)]).collect()
}
