//! Parquet tables: records of the user, and trials that a run stored.

mod footer;
mod kind;
mod page;
mod record;
mod table;
#[cfg(test)]
mod tests;
mod thrift;

pub(crate) use footer::Column;
pub use record::ParquetText;
pub(crate) use table::{Table, Values};
