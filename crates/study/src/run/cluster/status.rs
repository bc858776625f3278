//! Which trials of a plan are computed.

use crate::run::cluster::collect::Collection;
use crate::run::cluster::shard_plan::ShardPlan;
use crate::run::resume::gaps;
use crate::run::runner::Span;
use std::ops::Range;

/// Trials of a shard or a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PlaceStatus {
    /// Trials wanted.
    pub wanted: u64,
    /// Trials missing.
    pub missing: u64,
}

/// The status of a plan, by shard and by cell.
#[derive(Clone, Debug, Default)]
pub struct Status {
    /// Every shard.
    pub shards: Vec<PlaceStatus>,
    /// Every cell.
    pub cells: Vec<PlaceStatus>,
    /// The trials that are missing, by cell.
    pub missing: Vec<Span>,
    /// Missing trials that no shard of the plan has, because they were there when it was made.
    pub unplanned: u64,
}

impl Status {
    /// Returns the status of a plan, given the blocks in a collection.
    pub fn new(plan: &ShardPlan, found: &Collection) -> Self {
        let gaps_of = |(cell, wanted): (usize, &u64)| -> Vec<Range<u64>> {
            let covered = found.cover(cell, &(0..*wanted));
            gaps(covered.iter().map(|found| found.trials.clone()), 0..*wanted).collect()
        };
        let missing: Vec<Vec<Range<u64>>> = plan.trials.iter().enumerate().map(gaps_of).collect();
        let within = |piece: &Span| -> u64 {
            let gaps = &missing[piece.cell];
            let begun = gaps.partition_point(|gap| gap.end <= piece.trials.start);
            let ends = |gap: &Range<u64>| (gap.start.max(piece.trials.start), gap.end.min(piece.trials.end));
            let within = gaps[begun..].iter().map(ends).take_while(|(from, to)| from < to);
            within.map(|(from, to)| to - from).sum()
        };
        let shards = plan.shards.iter().map(|pieces| PlaceStatus {
            wanted: pieces.iter().map(Span::len).sum(),
            missing: pieces.iter().map(within).sum(),
        });
        let cells = plan.trials.iter().enumerate().map(|(cell, wanted)| PlaceStatus {
            wanted: *wanted,
            missing: within(&Span {
                cell,
                trials: 0..*wanted,
            }),
        });
        let (shards, cells): (Vec<_>, Vec<_>) = (shards.collect(), cells.collect());
        let sum = |places: &[PlaceStatus]| places.iter().map(|place| place.missing).sum::<u64>();
        let spans = missing.iter().enumerate();
        let spans = spans.flat_map(|(cell, gaps)| {
            gaps.iter().map(move |trials| Span {
                cell,
                trials: trials.clone(),
            })
        });
        Self {
            unplanned: sum(&cells) - sum(&shards),
            missing: spans.collect(),
            shards,
            cells,
        }
    }

    /// Whether all trials are there.
    pub fn is_complete(&self) -> bool {
        self.missing.is_empty()
    }

    /// Returns the numbers, from 1, of the shards with missing trials, in the form of Slurm's `--array`: `3,17-19`.
    pub fn array(&self) -> String {
        let shards = (1..).zip(&self.shards);
        let numbers: Vec<usize> = shards
            .filter(|(_, shard)| shard.missing > 0)
            .map(|(number, _)| number)
            .collect();
        let runs = numbers.chunk_by(|a, b| a + 1 == *b).map(|run| match run {
            [first, .., last] => format!("{first}-{last}"),
            _ => run[0].to_string(),
        });
        runs.collect::<Vec<String>>().join(",")
    }
}
