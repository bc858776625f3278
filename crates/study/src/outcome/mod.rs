//! What came out: rows of trials, tallies, summaries, and the files that hold them.

pub(crate) mod cell_pair;
pub(crate) mod coefficient_statistics;
pub(crate) mod coefficients;
pub(crate) mod course_summary;
pub(crate) mod curves;
pub(crate) mod design_difference;
pub(crate) mod layout;
pub(crate) mod looks;
pub(crate) mod method_times;
pub(crate) mod nine_digits;
pub(crate) mod outcomes;
pub mod place;
pub(crate) mod publication;
pub(crate) mod results_folder;
pub(crate) mod row;
pub(crate) mod rows;
pub(crate) mod spent;
pub(crate) mod stored_trials;
pub(crate) mod summary;
pub(crate) mod summary_table;
pub(crate) mod tally;
pub(crate) mod theory_summary;
pub(crate) mod traces;
pub(crate) mod trial_table;
pub(crate) mod trials;
