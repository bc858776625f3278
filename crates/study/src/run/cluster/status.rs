//! Which trials of a plan are computed.

use crate::run::cluster::collect::Collection;
use crate::run::cluster::shard_plan::{Part, ShardPlan};
use crate::run::rounds::gaps;
use crate::run::runner::Span;

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
        let mut status = Self {
            shards: vec![PlaceStatus::default(); plan.shards.len()],
            ..Self::default()
        };
        // The parts of every cell with their shards. They ascend, and so do missing trials.
        let mut parts: Vec<Vec<(Part, usize)>> = vec![Vec::new(); plan.trials.len()];
        for (shard, of_shard) in plan.shards.iter().enumerate() {
            for part in of_shard {
                parts[part.cell].push((*part, shard));
                status.shards[shard].wanted += part.len();
            }
        }
        for (cell, wanted) in plan.trials.iter().enumerate() {
            let covered = found.cover(cell, &(0..*wanted));
            let trials = covered.iter().map(|found| found.trials.clone());
            let mut of_cell = PlaceStatus {
                wanted: *wanted,
                missing: 0,
            };
            let mut parts = &parts[cell][..];
            for gap in gaps(trials, 0..*wanted) {
                of_cell.missing += gap.end - gap.start;
                status.unplanned += gap.end - gap.start;
                let begun = parts.partition_point(|(part, _)| part.to <= gap.start);
                parts = &parts[begun..];
                let within = parts.iter().take_while(|(part, _)| part.from < gap.end);
                for (part, shard) in within {
                    let both = part.to.min(gap.end) - part.from.max(gap.start);
                    status.shards[*shard].missing += both;
                    status.unplanned -= both;
                }
                let trials = gap;
                status.missing.push(Span { cell, trials });
            }
            status.cells.push(of_cell);
        }
        status
    }

    /// Whether all trials are there.
    pub fn is_complete(&self) -> bool {
        self.missing.is_empty()
    }

    /// Returns the numbers, from 1, of the shards with missing trials, in the form of Slurm's `--array`: `3,17-19`.
    pub fn array(&self) -> String {
        let shards = self.shards.iter().enumerate();
        let numbers: Vec<usize> = shards
            .filter(|(_, shard)| shard.missing > 0)
            .map(|(i, _)| i + 1)
            .collect();
        let runs = numbers.chunk_by(|a, b| a + 1 == *b).map(|run| match run {
            [first, .., last] => format!("{first}-{last}"),
            _ => run[0].to_string(),
        });
        runs.collect::<Vec<String>>().join(",")
    }
}
