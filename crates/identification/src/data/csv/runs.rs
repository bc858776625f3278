//! Rows without a gap between them: the whole table, its longest run, or all runs.

use super::times::{Time, Times, Unequal};
use std::collections::VecDeque;

/// The columns of a row that are used.
#[derive(Clone, Debug)]
pub(super) struct Row {
    pub(super) line: u64,
    pub(super) k: Option<f64>,
    pub(super) time: Option<Time>,
    pub(super) u: f64,
    pub(super) y: f64,
    pub(super) r: Option<f64>,
}

/// Why a row does not continue the run before it.
pub(super) enum Break {
    /// The k found and the k expected.
    Number(f64, f64),
    Time(Unequal),
}

/// Consecutive rows at equal steps.
#[derive(Clone, Debug)]
pub(super) struct Run {
    pub(super) u: Vec<f64>,
    pub(super) y: Vec<f64>,
    /// Empty in a table without a reference.
    pub(super) r: Vec<f64>,
    pub(super) times: Times,
    next: Option<f64>,
    /// The line of each row.
    pub(super) lines: Vec<u64>,
    /// The rows, if the run may have to be divided before one of them.
    rows: Option<Vec<Row>>,
}

impl Run {
    /// Begins a run. One that may be divided keeps its rows.
    pub(super) fn new(divisible: bool) -> Self {
        Self {
            u: Vec::new(),
            y: Vec::new(),
            r: Vec::new(),
            times: Times::new(),
            next: None,
            lines: Vec::new(),
            rows: divisible.then(Vec::new),
        }
    }

    /// Adds a row, if it continues the run.
    pub(super) fn add(&mut self, row: Row) -> Result<(), (Break, Row)> {
        if let (Some(found), Some(expected)) = (row.k, self.next)
            && found != expected
        {
            return Err((Break::Number(found, expected), row));
        }
        if let Some(time) = row.time
            && let Err(unequal) = self.times.add(time, row.line)
        {
            return Err((Break::Time(unequal), row));
        }
        self.next = row.k.map(|k| k + 1.0);
        self.lines.push(row.line);
        self.u.push(row.u);
        self.y.push(row.y);
        self.r.extend(row.r);
        if let Some(rows) = &mut self.rows
            && row.time.is_some()
        {
            rows.push(row);
        }
        Ok(())
    }

    /// Removes the rows from a line on, and returns them.
    fn divide(&mut self, line: u64) -> Vec<Row> {
        let rows = self.rows.as_mut();
        let tail = rows.map_or_else(Vec::new, |rows| {
            let at = rows.partition_point(|row| row.line < line);
            rows.split_off(at)
        });
        let left = self.u.len() - tail.len();
        self.u.truncate(left);
        self.y.truncate(left);
        self.r.truncate(left);
        self.lines.truncate(left);
        self.times = Times::new();
        for row in self.rows.iter().flatten() {
            if let Some(time) = row.time {
                // These were equal steps already.
                let _ = self.times.add(time, row.line);
            }
        }
        tail
    }

    /// The first and the last line.
    fn ends(&self) -> [u64; 2] {
        [self.lines.first(), self.lines.last()].map(|line| line.copied().unwrap_or(0))
    }
}

/// The part of a table that was kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kept {
    /// Its first and last line.
    pub lines: [u64; 2],
    /// Rows of the table, those with missing samples included.
    pub rows: usize,
    /// Parts without a gap.
    pub parts: usize,
}

/// A run of rows between gaps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// Its first and last line.
    pub lines: [u64; 2],
    /// Its rows.
    pub samples: usize,
}

/// The runs of a table with gaps: all, or the longest.
pub(super) struct Pieces {
    run: Run,
    /// Whether all are kept.
    all: bool,
    kept: Vec<Run>,
    parts: usize,
    pub(super) rows: usize,
}

impl Pieces {
    pub(super) fn new(all: bool) -> Self {
        Self {
            run: Run::new(true),
            all,
            kept: Vec::new(),
            parts: 0,
            rows: 0,
        }
    }

    /// Adds a row, to the run before it or to a new one.
    pub(super) fn add(&mut self, row: Row) {
        let mut queue = VecDeque::from([row]);
        while let Some(row) = queue.pop_front() {
            let Err((reason, row)) = self.run.add(row) else {
                continue;
            };
            let mut tail = match reason {
                Break::Number(..) => Vec::new(),
                // The step that differs may have been before this row.
                Break::Time(unequal) => self.run.divide(unequal.line),
            };
            self.end();
            tail.push(row);
            tail.into_iter().rev().for_each(|row| queue.push_front(row));
        }
    }

    /// Ends the run.
    pub(super) fn end(&mut self) {
        let mut run = std::mem::replace(&mut self.run, Run::new(true));
        if run.u.is_empty() {
            return;
        }
        self.parts += 1;
        run.rows = None;
        if self.all {
            self.kept.push(run);
        } else if self.kept.first().is_none_or(|best| run.u.len() > best.u.len()) {
            self.kept = vec![run];
        }
    }

    /// Returns the longest run, the first one of several, or all, one after the other with the times of the first of
    /// them that has a step, and how they were divided; nothing of a table without gaps.
    pub(super) fn finish(mut self) -> Result<(Run, Option<Kept>, Vec<Segment>), Unequal> {
        self.end();
        let segment = |run: &Run| Segment {
            lines: run.ends(),
            samples: run.u.len(),
        };
        let segments: Vec<Segment> = self.kept.iter().map(segment).collect();
        let mut runs = self.kept.into_iter();
        let mut first = runs.next().unwrap_or_else(|| Run::new(false));
        let lines = first.ends();
        for mut run in runs {
            first.times.same_step(&run.times, run.ends()[0])?;
            first.u.append(&mut run.u);
            first.y.append(&mut run.y);
            first.r.append(&mut run.r);
            first.lines.append(&mut run.lines);
        }
        let is_part = first.u.len() < self.rows;
        let kept = Kept {
            lines,
            rows: self.rows,
            parts: self.parts,
        };
        Ok(match segments.len() {
            0 | 1 => (first, is_part.then_some(kept), Vec::new()),
            _ => (first, None, segments),
        })
    }
}
