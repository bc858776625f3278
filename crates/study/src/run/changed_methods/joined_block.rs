//! A block of the new study, put together from that of the old one and the same trials of the new methods.

use super::{ADDED, Change, Source, place_of_ratio, remove_added};
use crate::design::file::{JointTable, Store};
use crate::files::{self, Kind};
use crate::outcome::curves::Curves;
use crate::outcome::folder_layout::{BLOCKS, DESIGN, span_of};
use crate::outcome::tally::CellTally;
use crate::outcome::trials::Trials;
use crate::run::block_file::{BlockError, BlockFolder, StoredBlock};
use crate::run::event::CampaignError;
use crate::run::runner::{Block, Span};
use asobench_identification::metric::Paired;
use std::path::Path;

impl Change<'_> {
    /// Replaces every block of the old study by one of the new.
    pub(super) fn replace(&self, path: &Path) -> Result<(), CampaignError> {
        let blocks = path.join(BLOCKS);
        let [old, new] = [&self.old, self.new].map(|of| BlockFolder::at(blocks.clone(), of));
        let mut added = Vec::new();
        for ((name, engine), experiment) in ADDED.into_iter().zip(self.added.iter().flatten()) {
            if let Some(folder) = files::subfolder(path, name)? {
                let folder = BlockFolder::at(folder, experiment);
                let there = folder.list()?.0;
                added.push((engine, folder, there));
            }
        }
        for file in files::list(&blocks)? {
            if span_of(&file).is_none() {
                continue;
            }
            let (span, bytes) = match old.verified(&file) {
                Ok(found) => found,
                // It was replaced before.
                Err(BlockError::OtherDesign { .. }) => continue,
                Err(error) => return Err(error.into()),
            };
            let before = Block::decode(&bytes, &self.old, span.clone());
            let path = file.clone();
            let before = before.map_err(|reason| BlockError::Damaged { path, reason })?;
            let of_engine = added.iter().find(|(engine, ..)| *engine == self.engine(span.cell));
            let parts = match of_engine {
                Some((_, folder, there)) => Some(read_within(folder, there, &span)?),
                None => None,
            };
            match self.joined(span, &before, parts) {
                Some(block) => {
                    new.encode(&block)?.write()?;
                }
                None => files::remove(&file, Kind::Block)?,
            }
        }
        let design = files::sealed(&self.new.stamped_design());
        files::replace(&blocks.join(DESIGN), Kind::Design, design.as_bytes())?;
        remove_added(path)
    }

    /// Returns a block of the new study. `None` if it cannot be told: the lanes' repeated solves are
    /// counted for all methods together.
    fn joined(&self, span: Span, before: &Block, added: Option<Block>) -> Option<Block> {
        let fewer = self
            .places
            .iter()
            .zip(&self.computed)
            .filter(|(place, computed)| place.is_some() && !**computed);
        if before.tally.fallbacks > 0 && fewer.count() < self.old.methods.len() {
            return None;
        }
        let cell = &self.new.cells[span.cell];
        let added = added.unwrap_or_else(|| Block::of_tally(span.clone(), CellTally::default()));
        let from = |source: &Source| match source {
            Source::Old(at) => (before, *at),
            Source::Added(at) => (&added, *at),
        };
        // The new methods' trials are not there: their blocks were damaged, or removed.
        let is_added = |source: &Source| matches!(source, Source::Added(_));
        if added.tally.outputs.is_empty() && self.sources.iter().any(is_added) {
            return None;
        }
        let curves = self.new.file.curves.then(|| {
            let of = |at: usize| from(&self.sources[at]).0.tally.curves.as_ref();
            Some(Curves::of_ends(of(0)?, of(self.sources.len() - 1)?))
        });
        let tally = CellTally {
            trials: before.tally.trials,
            fallbacks: before.tally.fallbacks + added.tally.fallbacks,
            outputs: self
                .sources
                .iter()
                .map(from)
                .map(|(of, at)| of.tally.outputs[at].clone())
                .collect(),
            curves: curves.unwrap_or_default(),
            ..CellTally::default()
        };
        if self.new.file.store == Store::Summaries {
            let tally = self.with_shared(tally, span.cell, &before.tally, &added.tally)?;
            return Some(Block::of_tally(span, tally));
        }
        let outputs = self
            .sources
            .iter()
            .map(from)
            .map(|(of, at)| of.rows.outputs()[at].clone());
        let mut trials = Trials::new(self.new, cell);
        (trials.rows, trials.curves) = (before.rows.with_outputs(outputs.collect()), None);
        let of_rows = CellTally::from_trials(self.new, cell, &mut trials);
        let tally = CellTally {
            pairs: of_rows.pairs,
            groups: of_rows.groups,
            series: of_rows.series,
            ..tally
        };
        Some(Block {
            rows: trials.rows,
            ..Block::of_tally(span, tally)
        })
    }

    /// Adds comparisons, the jackknife's groups and series to a tally, from those of both studies.
    fn with_shared(&self, tally: CellTally, cell: usize, before: &CellTally, added: &CellTally) -> Option<CellTally> {
        let of_added = self.added.as_ref().map(|[added, _]| added);
        let from = |source: Source| match source {
            Source::Old(at) => (before, at),
            Source::Added(at) => (added, at),
        };
        let pair = |pair: &[usize; 2]| {
            if let Some(at) = self.old_pair(*pair) {
                return Some(before.pairs[at].clone());
            }
            let places = pair.map(|of| from(self.sources[of]).1);
            let mut compared = of_added?.compare.iter();
            let at = compared.position(|other| *other == places)?;
            Some(added.pairs[at].clone())
        };
        let ratio = |(of, places): (&JointTable, [(usize, usize); 2])| {
            let outputs = places.map(|(output, _)| output);
            if let Some(at) = self.old_ratio(of, outputs) {
                return before.ratios(&self.old).get(at).cloned();
            }
            let places = outputs.map(|output| from(self.sources[output]).1);
            let at = place_of_ratio(of_added?, of, places).filter(|_| self.are_added(outputs))?;
            added.ratios(of_added?).get(at).cloned()
        };
        let mut pairs = self.new.compare.iter().map(pair).collect::<Option<Vec<_>>>()?;
        let ratios: Vec<Paired> = self.new.kept_ratios().into_iter().map(ratio).collect::<Option<_>>()?;
        pairs.extend(Some(ratios).filter(|ratios| !ratios.is_empty()));
        let groups = |measure: usize| {
            let groups = self.sources.iter().map(|source| from(*source));
            groups.map(|(tally, at)| tally.groups[measure][at].clone()).collect()
        };
        let series = |(output, measure): (usize, _)| {
            let (tally, at) = from(self.sources[output]);
            let of = match self.sources[output] {
                Source::Old(_) => &self.old,
                Source::Added(_) => of_added?,
            };
            let place = of.series_of(&of.cells[cell]).position(|other| other == (at, measure))?;
            Some(tally.series[place].clone())
        };
        Some(CellTally {
            pairs,
            groups: (0..self.new.sloped_measures().len()).map(groups).collect(),
            series: self
                .new
                .series_of(&self.new.cells[cell])
                .map(series)
                .collect::<Option<_>>()?,
            ..tally
        })
    }
}

/// Reads what a folder has of the trials of a span, which its blocks cover.
fn read_within(folder: &BlockFolder<'_>, there: &[StoredBlock], span: &Span) -> Result<Block, BlockError> {
    let mut whole = Block::of_tally(span.clone(), CellTally::default());
    for block in there.iter().filter(|block| span.holds(&block.span)) {
        let Block { tally, rows, .. } = folder.read(block)?;
        whole.tally.merge(tally);
        if whole.rows.is_empty() {
            whole.rows = rows;
        } else {
            whole.rows.append(rows);
        }
    }
    Ok(whole)
}
