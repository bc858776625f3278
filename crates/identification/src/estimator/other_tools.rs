//! Defaults of other tools that differ from this program's, available as readings that an option names.

use super::option_error::OptionError;
use super::regression::Rows;
use crate::names::named_enum;

named_enum! {
    /// The conventions of another tool.
    Reading, "reading" {
        /// R's package sysid: least squares with a ridge of 0.1, zeros before and after the record, autoregressions by
        /// Yule and Walker.
        RSysid = "r-sysid",
    }
}

/// The ridge of R's package sysid.
pub(super) const R_SYSID_RIDGE: f64 = 0.1;

impl Reading {
    /// Refuses options that the reading itself determines.
    pub(super) fn refuse(rows: Option<Rows>, ridge: Option<f64>) -> Result<(), OptionError> {
        let said = [(rows.is_some(), "rows"), (ridge.is_some(), "ridge")];
        match said.into_iter().find(|(given, _)| *given) {
            Some((_, key)) => Err(OptionError::new(
                key,
                "the reading already determines it; leave one of the two out",
            )),
            None => Ok(()),
        }
    }
}
