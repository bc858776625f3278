//! Parquet tables: records of the user, and the tables that a run stores.

mod footer;
mod kind;
mod page;
mod record;
mod table;
#[cfg(test)]
mod tests;
mod thrift;
mod write;

pub(crate) use footer::Column;
pub use record::ParquetText;
pub(crate) use table::{Table, Values};
pub(crate) use write::{EncodedAs, Group, Named, Schema, TableWriter, defined_numbers, numbers, plain, texts};
pub use write::{numbers_as_parquet, parquet_of};
