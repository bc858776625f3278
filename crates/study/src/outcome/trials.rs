//! Trials of a cell as they are computed.

use crate::design::{Cell, Experiment};
use crate::outcome::curves::Curves;
use crate::outcome::rows::Rows;
use crate::outcome::spent::Spent;
use crate::outcome::traces::Traces;

/// Trials of one cell as they are computed: rows, curves.
pub struct Trials {
    /// All outputs of every trial.
    pub rows: Rows,
    /// e_x(k) over k, if wanted.
    pub curves: Option<Curves>,
    /// The course of trial 0 in continuous time, if wanted and among these trials.
    pub traces: Option<Traces>,
    /// Solves of a lane that were repeated with pivoting.
    pub fallbacks: u64,
    /// Where the time went.
    pub spent: Spent,
}

impl Trials {
    /// Makes an empty set with room for what a study keeps of a cell.
    pub fn new(experiment: &Experiment, cell: &Cell) -> Self {
        let curves = cell.discrete().filter(|_| experiment.file.curves);
        Self {
            curves: curves.map(|cell| Curves::new(cell.horizon)),
            ..Self::from_rows(Rows::new(experiment, cell))
        }
    }

    /// Makes an empty set with room for every measure and no curves.
    pub fn of_all_measures(experiment: &Experiment, cell: &Cell) -> Self {
        Self::from_rows(Rows::of_all_measures(experiment, cell))
    }

    /// Removes rows, traces and counts; allocated room, curves and times stay.
    pub(crate) fn clear(&mut self) {
        self.rows.clear();
        self.traces = None;
        self.fallbacks = 0;
    }

    /// Adds made-up trials until there are so many, whose values differ by up to a half.
    pub(crate) fn make_up(&mut self, trials: u64) {
        // The golden ratio's multiples fill the interval evenly.
        let factors = (1..=trials).map(|trial| 0.5 + (0.618_033_988_749_895 * trial as f64).fract());
        let factors: Vec<f64> = factors.collect();
        if let Some(curves) = &mut self.curves {
            for factor in factors.iter().skip(self.rows.trial_count()) {
                for last in [false, true] {
                    curves.add(last, std::iter::repeat_n(*factor, curves.horizon()));
                }
            }
        }
        self.rows.make_up(&factors);
    }

    fn from_rows(rows: Rows) -> Self {
        Self {
            rows,
            curves: None,
            traces: None,
            fallbacks: 0,
            spent: Spent::default(),
        }
    }
}
