//! Verdicts on the claims of an experiment file, with known error rates, in plain words.
//!
//! A test looks at a number of a cell and yields two p-values: one for "it does not pass", one for "it does not fail"
//! (`known`, `statistics`, `evidence`). A claim holds everywhere, typically or somewhere over its cells (`verdict`).
//! If neither verdict is certain, it is undecided, and `power` computes how many trials would decide it. Nothing here
//! knows an experiment, a claim or a method by name.

mod bets;
mod condition;
mod cuts;
mod decision_rule;
mod evidence;
mod family;
mod found;
mod interval;
mod judge;
mod judged;
mod known;
mod needed;
mod one_sided;
mod power;
mod ranked;
mod scale;
mod sentence;
mod standing;
mod statistics;
#[cfg(test)]
mod tests;
mod units;

pub use condition::condition;
pub use decision_rule::Verdict;
pub use judge::{decides, judge, judge_at};
pub use judged::{Judged, JudgedCell, JudgedNumber, JudgedTest, Standing};
pub use needed::Needed;
pub use scale::Scale;
pub use standing::tested;
