//! CSV text. Records of u and y have columns of these names, or columns that the reader chooses, and comment lines
//! beginning with `#`. All tables of the program are written by the one line writer here.

mod columns;
mod dialect;
mod error;
mod first_line;
mod lines;
mod options;
mod read;
mod runs;
mod times;
mod write;

pub use error::RecordError;
pub use options::{Missing, ReadOptions};
pub use read::{Record, Table, read, read_column, read_table};
pub use runs::Kept;
pub use write::{Cell, comment, line, write, write_columns};
