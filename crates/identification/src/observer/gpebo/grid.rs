//! The time grid: no step crosses a breakpoint.

use super::settings::{CascadeError, Scenario};

/// The largest number of different step lengths of a run. Each length needs propagators of its own.
const LARGEST_LENGTHS: usize = 4096;

/// The numbers of parts into which step halving divides each base step.
pub const REFINEMENTS: [usize; 3] = [1, 2, 4];

/// Equal steps between two breakpoints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// Time of the first breakpoint.
    pub start: f64,
    /// Time of the second one.
    pub end: f64,
    /// Number of steps.
    pub count: usize,
    /// Index of the step's length in [`Grid::lengths`].
    pub length: usize,
}

impl Gap {
    /// Returns the time after `k` steps; exactly `end` after the last.
    pub fn time(&self, k: usize) -> f64 {
        if k == self.count {
            self.end
        } else {
            self.start + (self.end - self.start) * (k as f64 / self.count as f64)
        }
    }
}

/// The gaps from 0 to T and the lengths of their steps.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// In order of time, without holes.
    pub gaps: Vec<Gap>,
    /// Distinct lengths in seconds.
    pub lengths: Vec<f64>,
}

impl Grid {
    /// Makes the grid. The breakpoints of u and delta, the start of the score, 0 and T bound the gaps. Each gap has
    /// `ceil(gap / step)` equal steps.
    ///
    /// Breakpoints closer than `1e-13 T` are merged. Two gaps share a step length if that moves no time by more than
    /// `8 eps T`, the rounding of the breakpoints themselves.
    ///
    /// # Errors
    /// If there are more than 4096 different lengths.
    pub fn new(scenario: &Scenario) -> Result<Self, CascadeError> {
        let horizon = scenario.horizon;
        let mut times = vec![];
        scenario.u.breakpoints(horizon, &mut times);
        scenario.delta.breakpoints(horizon, &mut times);
        times.push(scenario.scored_from);
        times.sort_unstable_by(f64::total_cmp);
        let closest = 1e-13 * horizon;
        let mut grid = Self {
            gaps: vec![],
            lengths: vec![],
        };
        let mut start = 0.0;
        for t in times {
            if t - start > closest && horizon - t > closest {
                grid.push(start, t, scenario)?;
                start = t;
            }
        }
        grid.push(start, horizon, scenario)?;
        Ok(grid)
    }

    fn push(&mut self, start: f64, end: f64, scenario: &Scenario) -> Result<(), CascadeError> {
        // A gap of 1000.0000000001 steps counts as 1000.
        let count = ((end - start) / scenario.step * (1.0 - 1e-12)).ceil().max(1.0);
        let h = (end - start) / count;
        let tolerance = 8.0 * f64::EPSILON * scenario.horizon / count;
        let known = self.lengths.iter().position(|l| (l - h).abs() <= tolerance);
        let length = known.unwrap_or_else(|| {
            self.lengths.push(h);
            self.lengths.len() - 1
        });
        if self.lengths.len() > LARGEST_LENGTHS {
            return Err(CascadeError::Setting(format!(
                "the signals' switches and samples have more than {LARGEST_LENGTHS} different distances: use \
                 intervals that are multiples of a common one"
            )));
        }
        self.gaps.push(Gap {
            start,
            end,
            count: count as usize,
            length,
        });
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::{Signal, Wave};
    use std::f64::consts::PI;

    fn scenario(frequency: f64, horizon: f64, step: f64) -> Scenario {
        let square = Wave::Square {
            amplitude: 1.0,
            frequency,
            phase: 0.0,
        };
        Scenario {
            u: Signal::new(vec![square.clone()]),
            delta: Signal::new(vec![square]),
            x0: vec![],
            horizon,
            scored_from: 0.0,
            step,
        }
    }

    #[test]
    fn equal_gaps_share_one_length() {
        let grid = Grid::new(&scenario(3.7, 100.0, 0.01)).unwrap();
        assert_eq!(grid.gaps.len(), (100.0 * 3.7 / PI) as usize + 1);
        assert_eq!(grid.lengths.len(), 2, "the last gap is shorter");
        assert_eq!(grid.gaps[0].count, 85);
        for pair in grid.gaps.windows(2) {
            assert_eq!(pair[0].end, pair[1].start);
        }
        assert_eq!(grid.gaps.last().map(|gap| gap.time(gap.count)), Some(100.0));
    }

    #[test]
    fn no_breakpoints() {
        let mut scenario = scenario(1.0, 0.3, 0.1);
        scenario.u = Signal::default();
        scenario.delta = Signal::default();
        let grid = Grid::new(&scenario).unwrap();
        assert_eq!((grid.gaps.len(), grid.gaps[0].count), (1, 3));
    }

    /// Combs of 1 ms and 1.0001 ms meet at ever new distances.
    #[test]
    fn too_many_lengths() {
        let mut scenario = scenario(PI * 1000.0, 20.0, 0.1);
        scenario.u = Signal::new(vec![Wave::Square {
            amplitude: 1.0,
            frequency: PI * 999.9,
            phase: 0.0,
        }]);
        let refusal = Grid::new(&scenario).unwrap_err().to_string();
        assert!(refusal.contains("more than 4096 different distances"), "{refusal}");
    }
}
