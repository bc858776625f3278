//! CSV text. Records of u and y have columns of these names, or columns that the reader chooses, and comment lines
//! beginning with `#`. All tables of the program are written by the one line writer here.

mod clock;
mod collect;
mod columns;
mod error;
mod layout;
mod number;
mod options;
mod read;
mod rows;
mod runs;
mod seen;
mod table;
#[cfg(test)]
mod tests;
mod text;
mod times;
mod unused_times;
mod write;

pub use error::{Place, RecordError};
pub use options::{Decimal, Missing, ReadOptions};
pub use read::{read, read_column, read_table, uses};
pub use runs::{Kept, Segment};
pub use table::{LikeTimes, Record, Table};
pub use write::{Cell, comment, line, write, write_columns};
