//! The orders of a general linear model.

#[cfg(feature = "json")]
use serde::{Deserialize, Deserializer};
use serde::{Serialize, Serializer};
#[cfg(feature = "json")]
use serde_json::Value;

/// The largest number of coefficients of one polynomial, and the longest delay.
pub const LARGEST: usize = 1000;

/// The orders of `A(q) y = B(q)/F(q) u + C(q)/D(q) e` in the usual notation. `na nb nc nd nf` count the free
/// coefficients (A, C, D and F are monic; B has `nb` numbers after `nk` zeros); `nk` is the delay in samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Orders {
    /// Free coefficients of A.
    pub na: usize,
    /// Coefficients of B.
    pub nb: usize,
    /// Free coefficients of C.
    pub nc: usize,
    /// Free coefficients of D.
    pub nd: usize,
    /// Free coefficients of F.
    pub nf: usize,
    /// The delay from u to y in samples; 0: u(k) acts on y(k).
    pub nk: usize,
}

impl Orders {
    /// Makes the orders of an ARX model, `A(q) y = B(q) u + e`.
    pub const fn arx(na: usize, nb: usize, nk: usize) -> Self {
        Self {
            na,
            nb,
            nc: 0,
            nd: 0,
            nf: 0,
            nk,
        }
    }

    /// Makes the orders of an ARMAX model, `A(q) y = B(q) u + C(q) e`.
    pub const fn armax(na: usize, nb: usize, nc: usize, nk: usize) -> Self {
        Self {
            nc,
            ..Self::arx(na, nb, nk)
        }
    }

    /// Makes the orders of an output-error model, `y = B(q)/F(q) u + e`.
    pub const fn output_error(nb: usize, nf: usize, nk: usize) -> Self {
        Self {
            nf,
            ..Self::arx(0, nb, nk)
        }
    }

    /// Returns the number of parameters.
    pub const fn parameters(self) -> usize {
        self.na + self.nb + self.nc + self.nd + self.nf
    }

    /// Returns the order of the part that u drives, `B/(A F)`; at least 1.
    pub fn order(self) -> usize {
        (self.na + self.nf)
            .max(self.nb.saturating_add(self.nk).saturating_sub(1))
            .max(1)
    }

    /// Returns the smallest orders of another form that hold models of these orders. `form` has the form's own
    /// defaults: what is not 0 there is free. The filter of e is C/(A D). Over a common A F it becomes C F/D; where the
    /// form has no A, it stays C/(A D).
    #[must_use]
    pub fn holding(self, form: Self) -> Self {
        let Self { na, nb, nc, nd, nf, nk } = self;
        let denominator = na + nf;
        let common = form.na > 0;
        let where_in = |given: usize, order: usize| if given > 0 { order } else { 0 };
        let numerator = if common { nc + nf } else { nc };
        let nothing = numerator == 0 && (common || na + nd == 0);
        Self {
            na: where_in(form.na, denominator),
            nb,
            nc: where_in(form.nc, numerator.max(usize::from(nothing))),
            nd: where_in(form.nd, na + nd),
            nf: where_in(form.nf, denominator),
            nk,
        }
    }

    /// Returns how many samples before k the equation `A y = B u` looks back: `max(na, nb + nk - 1)`.
    pub fn reach(self) -> usize {
        self.na.max(self.nb.saturating_add(self.nk).saturating_sub(1))
    }

    /// Returns the names with their values, nk last.
    fn entries(mut self) -> [(&'static str, usize); 6] {
        self.places().map(|(name, place)| (name, *place))
    }

    fn places(&mut self) -> [(&'static str, &mut usize); 6] {
        let Self { na, nb, nc, nd, nf, nk } = self;
        [("na", na), ("nb", nb), ("nc", nc), ("nd", nd), ("nf", nf), ("nk", nk)]
    }

    /// Reads names with numbers; `nk` is 1 if not given.
    fn from_entries<'a>(entries: impl Iterator<Item = (&'a str, Option<usize>)>) -> Result<Self, OrdersError> {
        let mut orders = Self {
            nk: 1,
            ..Self::default()
        };
        let mut given: Vec<&str> = Vec::new();
        for (name, number) in entries {
            if name == "n" {
                // Sets na and nb at once.
                let number = number.filter(|number| (1..=LARGEST).contains(number));
                let number = number.ok_or(OrdersError::Order)?;
                (orders.na, orders.nb) = (number, number);
                continue;
            }
            let place = orders.places().into_iter().find(|(of, _)| *of == name);
            let (_, place) = place.ok_or_else(|| OrdersError::Name(name.to_owned()))?;
            if given.contains(&name) {
                return Err(OrdersError::Twice(name.to_owned()));
            }
            given.push(name);
            let number = number.filter(|number| *number <= LARGEST);
            *place = number.ok_or_else(|| OrdersError::Number(name.to_owned()))?;
        }
        Ok(orders)
    }
}

/// Why a text or a table does not define orders.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OrdersError {
    /// A part has no "=".
    #[error("'{0}' is not an order; expected a list such as na=2,nb=2,nk=1")]
    Form(String),
    /// A name is unknown.
    #[error("'{0}' is not an order; expected na, nb, nc, nd, nf, nk, or n for na = nb")]
    Name(String),
    /// A name is given twice.
    #[error("'{0}' is given twice")]
    Twice(String),
    /// The order n is not a valid number.
    #[error("'n' must be a whole number from 1 to {LARGEST}")]
    Order,
    /// A value is not a valid number.
    #[error("'{0}' must be a whole number from 0 to {LARGEST}")]
    Number(String),
}

impl std::str::FromStr for Orders {
    type Err = OrdersError;

    /// Parses `na=2,nb=2,nk=1`, or `n=2` for na = nb = 2. Numbers that are not given are 0, except that `nk` is 1.
    fn from_str(text: &str) -> Result<Self, OrdersError> {
        let parts: Result<Vec<_>, _> = text
            .split(',')
            .map(|part| {
                let pair = part.split_once('=');
                let (name, number) = pair.ok_or_else(|| OrdersError::Form(part.to_owned()))?;
                Ok((name.trim(), number.trim().parse().ok()))
            })
            .collect();
        Self::from_entries(parts?.into_iter())
    }
}

impl std::fmt::Display for Orders {
    /// Writes the form that [`std::str::FromStr`] reads: the orders that are not 0, and nk.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let entries = self.entries();
        let shown = entries.iter().filter(|(name, n)| *n > 0 || *name == "nk");
        let shown: Vec<String> = shown.map(|(name, n)| format!("{name}={n}")).collect();
        f.pad(&shown.join(","))
    }
}

impl Serialize for Orders {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

#[cfg(feature = "json")]
impl<'de> Deserialize<'de> for Orders {
    /// Reads a text, or a table of numbers.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let orders = match Value::deserialize(deserializer)? {
            Value::String(text) => text.parse(),
            Value::Object(table) => {
                let number = |value: &Value| value.as_u64().and_then(|n| usize::try_from(n).ok());
                let entries = table.iter();
                Self::from_entries(entries.map(|(name, value)| (name.as_str(), number(value))))
            }
            other => Err(OrdersError::Form(other.to_string())),
        };
        orders.map_err(serde::de::Error::custom)
    }
}

#[cfg(feature = "json")]
impl schemars::JsonSchema for Orders {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Orders".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let number = schemars::json_schema!({ "type": "integer", "minimum": 0, "maximum": LARGEST });
        let entries = Self::default().entries();
        let properties = entries.map(|(name, _)| (name.to_owned(), number.clone().to_value()));
        let properties: serde_json::Map<String, Value> = properties.into_iter().collect();
        schemars::json_schema!({
            "anyOf": [
                { "type": "string" },
                { "type": "object", "properties": properties, "additionalProperties": false }
            ]
        })
    }
}

#[cfg(all(test, feature = "json"))]
mod tests {
    use super::*;

    #[test]
    fn orders_are_read_as_a_text_and_as_a_table() {
        let orders: Orders = "na=2, nb=3,nk=0".parse().unwrap();
        assert_eq!(orders, Orders::arx(2, 3, 0));
        assert_eq!(orders.to_string(), "na=2,nb=3,nk=0");
        let table: Orders = serde_json::from_str("{\"na\": 2, \"nb\": 3, \"nk\": 0}").unwrap();
        assert_eq!(table, orders);
        let back: Orders = serde_json::from_value(serde_json::to_value(orders).unwrap()).unwrap();
        assert_eq!(back, orders);
        assert_eq!("nb=1".parse::<Orders>().unwrap().nk, 1);
        for (text, part) in [
            ("2,2,1", "'2' is not an order; expected a list"),
            ("na=2,nx=1", "'nx'"),
            ("na=2,na=3", "twice"),
            ("na=-1", "'na' must be a whole number from 0 to 1000"),
            ("na=2000", "'na' must be a whole number"),
            ("", "expected a list"),
        ] {
            let error = text.parse::<Orders>().unwrap_err().to_string();
            assert!(error.contains(part), "{text}: {error}");
        }
    }

    #[test]
    fn what_follows_from_orders() {
        assert_eq!(Orders::arx(2, 2, 3).reach(), 4);
        assert_eq!(Orders::arx(2, 1, 0).reach(), 2);
        assert_eq!(Orders::arx(0, 1, 0).order(), 1);
        assert_eq!(Orders::arx(2, 2, 3).parameters(), 4);
    }
}
