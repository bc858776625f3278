//! Claims, tables and figures: readers of stored results, never of a running study.

mod claims;
#[cfg(test)]
mod demo;
mod figures;
pub mod html;
mod markup;
mod number;
pub mod plot;
mod summary;
mod table;

pub use claims::{Bound, Limit, NIKOLOV2023};
pub use figures::{FigureError, draw};
pub use number::uncertain;
pub use summary::{BoundSummary, CellSummary, EstimatorShare, OutputSummary, Quantiles, Summary};
pub use table::verdict_table;
