//! A finished study whose file has other methods now: what is there is kept, and the new methods alone are computed.
//!
//! No record and no estimate depends on the other methods of a study. So a block of the new design is put together from
//! the block of the old one and the same trials of the new methods, which a study of their own computes into the folder
//! `added` within the results. When all are there, each block is replaced by the new one; `design.json` names the
//! design before, too, until the last one is. A kill at any moment leaves a folder that the same command continues.

use crate::design::Experiment;
use crate::design::file::{Engine, ExperimentFile, FileError, JointTable, MethodTable, Store, TrialRule};
use crate::files::{self, Kind};
use crate::outcome::design_difference::same_but_for_methods;
use crate::outcome::folder_layout::{BLOCKS, DESIGN, remove_own};
use crate::outcome::results_folder::ResultsFolder;
use crate::run::block_file::BlockFolder;
use crate::run::campaign::RunOptions;
use crate::run::compute::Work;
use crate::run::event::{CampaignError, Event, go_on};
use crate::run::resume::{discard_damaged, gaps};
use crate::run::runner::Span;
use serde_json::Value;
use std::ops::Range;
use std::path::Path;
use std::sync::atomic::AtomicBool;

mod joined_block;

/// The folders of the new methods' blocks, by their engine.
const ADDED: [(&str, Engine); 2] = [("added-lanes", Engine::Auto), ("added-faer", Engine::Faer)];

/// The effect of a change of methods on a folder.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MethodChange {
    /// New or changed methods, which are computed.
    pub added: Vec<String>,
    /// Methods that are there but computed again, as claims or comparisons need what was not kept of them.
    pub again: Vec<String>,
    /// Methods whose results leave the folder.
    pub removed: Vec<String>,
    /// Methods that are kept as they are.
    pub kept: usize,
}

/// Takes over what a folder holds of a study whose methods were others, and computes the new ones for the trials that
/// are there. Does nothing if the designs differ in more than methods, or not at all. `on_change` learns what is done
/// before it is.
///
/// # Errors
/// [`CampaignError`]. Finished blocks stay.
pub fn take_over(
    path: &Path,
    experiment: &Experiment,
    options: RunOptions,
    stop: &AtomicBool,
    mut on_event: impl FnMut(Event),
    on_change: impl FnOnce(&MethodChange),
) -> Result<(), CampaignError> {
    if options.fresh || options.same_methods || stored(path).is_none() {
        return Ok(());
    }
    let folder = ResultsFolder::open(path)?;
    // A change that was under way when the program was ended.
    if let Some((design, before)) =
        stored(path).and_then(|design| Some((design.clone(), design.get("before")?.clone())))
        && let (Some(new), Some(old)) = (experiment_of(&design), experiment_of(&before))
        && let Some(change) = Change::new(old, &new)
    {
        change.replace(folder.path())?;
    }
    let Some(design) = stored(path) else {
        return Ok(());
    };
    if design == experiment.stamped_design() {
        return remove_added(path);
    }
    let Some(change) = experiment_of(&design).and_then(|old| Change::new(old, experiment)) else {
        return Ok(());
    };
    let checked = change.check_engines(path);
    if checked.is_err() && options.overwrite {
        return Ok(());
    }
    checked?;
    on_change(&change.told());
    change.compute(path, options, stop, &mut on_event)?;
    let mut under_way = experiment.stamped_design();
    under_way["before"] = design;
    files::replace(
        &path.join(BLOCKS).join(DESIGN),
        Kind::Design,
        files::sealed(&under_way).as_bytes(),
    )?;
    change.replace(path)
}

/// Returns the design of the blocks of a folder, if it can be read.
fn stored(path: &Path) -> Option<Value> {
    let blocks = files::subfolder(path, BLOCKS).ok()??;
    let text = files::read_own(&blocks.join(DESIGN), Kind::Design).ok()??;
    files::parsed(&text).ok()
}

/// Returns the experiment of a design that this version wrote.
fn experiment_of(design: &Value) -> Option<Experiment> {
    let file = ExperimentFile::from_json(&design["experiment"]).ok()?;
    let experiment = Experiment::new(file).ok()?;
    let mut found = design.clone();
    found.as_object_mut()?.shift_remove("before");
    (experiment.stamped_design() == found).then_some(experiment)
}

fn remove_added(path: &Path) -> Result<(), CampaignError> {
    for (name, _) in ADDED {
        if let Some(folder) = files::subfolder(path, name)? {
            remove_own(&folder)?;
        }
    }
    Ok(())
}

/// Where an output of the new study comes from: an output of the old one, or of the study of the new methods.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    Old(usize),
    Added(usize),
}

/// A study before and after its methods changed.
struct Change<'e> {
    old: Experiment,
    new: &'e Experiment,
    /// The study of the new methods, for the lanes' cells and for faer's; none if no method is new.
    added: Option<[Experiment; 2]>,
    /// For every method of the new study, its place in the old one, if it is there unchanged.
    places: Vec<Option<usize>>,
    /// For every method of the new study, whether it is computed.
    computed: Vec<bool>,
    /// For every output of the new study.
    sources: Vec<Source>,
}

/// Returns the outputs of each method, in the order of all outputs.
fn outputs_of(experiment: &Experiment) -> Vec<Range<usize>> {
    let mut end = 0;
    let methods = experiment.methods.iter();
    let range = methods.map(|method| {
        let begin = end;
        end += method.outputs().len();
        begin..end
    });
    range.collect()
}

impl<'e> Change<'e> {
    /// Returns the change from one study to another; `None` if they differ in more than methods and comparisons, or
    /// have no method in common.
    fn new(old: Experiment, new: &'e Experiment) -> Option<Self> {
        let own = |experiment: &Experiment| experiment.file.methods.len() != experiment.methods.len();
        if new.methods.is_empty()
            || own(&old)
            || own(new)
            || !same_but_for_methods(&old.stamped_design(), &new.stamped_design())
        {
            return None;
        }
        let place = |table: &MethodTable| old.file.methods.iter().position(|other| other == table);
        let places: Vec<Option<usize>> = new.file.methods.iter().map(place).collect();
        let computed = places.iter().map(Option::is_none).collect();
        let (added, sources) = (None, Vec::new());
        let mut change = Self {
            old,
            new,
            added,
            places,
            computed,
            sources,
        };
        change.sources = change.find_sources();
        while let Some(method) = change.missing() {
            change.computed[method] = true;
            change.sources = change.find_sources();
        }
        if change.computed.iter().all(|computed| *computed) {
            return None;
        }
        if change.computed.contains(&true) {
            let of_engine = |engine| Experiment::new(change.file_of_added(engine)).ok();
            change.added = Some([of_engine(Engine::Auto)?, of_engine(Engine::Faer)?]);
        }
        Some(change)
    }

    /// Returns the file of the study of the new methods. It has the comparisons among them, and what claims look at.
    fn file_of_added(&self, engine: Engine) -> ExperimentFile {
        let labels = self.new.outputs();
        let is_added = |label: &String| {
            let of = labels.iter().position(|output| output.label() == *label);
            of.is_some_and(|of| matches!(self.sources[of], Source::Added(_)))
        };
        let mut file = self.new.file.clone();
        let computed = self.computed.iter();
        file.methods = file
            .methods
            .into_iter()
            .zip(computed)
            .filter_map(|(of, computed)| computed.then_some(of))
            .collect();
        file.compare.retain(|pair| pair.iter().all(is_added));
        if let Some(needed) = &mut file.needed {
            needed.compare.retain(|pair| pair.iter().all(is_added));
        }
        ExperimentFile {
            claims: Vec::new(),
            trials: TrialRule::Fixed(1),
            timing: false,
            engine,
            ..file
        }
    }

    fn find_sources(&self) -> Vec<Source> {
        let old = outputs_of(&self.old);
        let mut next = 0;
        let methods = outputs_of(self.new).into_iter().zip(&self.places).zip(&self.computed);
        let sources = methods.flat_map(|((outputs, place), computed)| {
            let first = match place.filter(|_| !computed) {
                Some(place) => Source::Old(old[place].start),
                None => Source::Added(next),
            };
            next += if matches!(first, Source::Added(_)) {
                outputs.len()
            } else {
                0
            };
            (0..outputs.len()).map(move |at| match first {
                Source::Old(begin) => Source::Old(begin + at),
                Source::Added(begin) => Source::Added(begin + at),
            })
        });
        sources.collect()
    }

    /// Returns a method of the old study that must be computed again: something is asked of it that neither its tally
    /// nor its rows have.
    fn missing(&self) -> Option<usize> {
        let last = self.sources.len() - 1;
        let last_of_old = self.old.output_count() - 1;
        let mut wanted = Vec::new();
        if self.new.file.curves {
            wanted.extend(
                [(0, Source::Old(0)), (last, Source::Old(last_of_old))].map(|(of, has)| (of, self.sources[of] == has)),
            );
        }
        if self.new.file.store == Store::Summaries {
            for [first, second] in &self.new.compare {
                let is_there = self.old_pair([*first, *second]).is_some() || self.are_added([*first, *second]);
                wanted.extend([(*first, is_there), (*second, is_there)]);
            }
            for (of, places) in self.new.kept_ratios() {
                let [first, second] = places.map(|(output, _)| output);
                let is_there = self.old_ratio(of, [first, second]).is_some() || self.are_added([first, second]);
                wanted.extend([(first, is_there), (second, is_there)]);
            }
            for (old, new) in self.old.cells.iter().zip(&self.new.cells) {
                let kept: Vec<_> = self.old.series_of(old).collect();
                wanted.extend(self.new.series_of(new).map(|(output, measure)| {
                    let is_kept = |at: usize| kept.contains(&(at, measure));
                    (output, matches!(self.sources[output], Source::Old(at) if is_kept(at)))
                }));
            }
        }
        let mut wanted = wanted.into_iter();
        let (output, _) = wanted.find(|(output, has)| !has && matches!(self.sources[*output], Source::Old(_)))?;
        outputs_of(self.new)
            .iter()
            .position(|outputs| outputs.contains(&output))
    }

    /// Returns the place of a comparison in the old study, if both outputs come from there.
    fn old_pair(&self, pair: [usize; 2]) -> Option<usize> {
        let [Source::Old(first), Source::Old(second)] = pair.map(|of| self.sources[of]) else {
            return None;
        };
        self.old.compare.iter().position(|other| *other == [first, second])
    }

    /// Returns the place of a ratio in the old study, if it kept it.
    fn old_ratio(&self, of: &JointTable, outputs: [usize; 2]) -> Option<usize> {
        let [Source::Old(first), Source::Old(second)] = outputs.map(|output| self.sources[output]) else {
            return None;
        };
        place_of_ratio(&self.old, of, [first, second])
    }

    fn are_added(&self, pair: [usize; 2]) -> bool {
        pair.iter().all(|of| matches!(self.sources[*of], Source::Added(_)))
    }

    fn told(&self) -> MethodChange {
        let name = |at: usize| self.new.file.methods[at].base_name();
        let of = |wanted: &dyn Fn(usize) -> bool| (0..self.places.len()).filter(|at| wanted(*at)).map(name).collect();
        let stays = |at: usize| self.places.contains(&Some(at));
        let removed = (0..self.old.file.methods.len()).filter(|at| !stays(*at));
        MethodChange {
            added: of(&|at| self.places[at].is_none()),
            again: of(&|at| self.computed[at] && self.places[at].is_some()),
            removed: removed.map(|at| self.old.file.methods[at].base_name()).collect(),
            kept: self.computed.iter().filter(|computed| !**computed).count(),
        }
    }

    /// Checks that the same engine runs each cell as before, as the last digits are an engine's own.
    fn check_engines(&self, path: &Path) -> Result<(), CampaignError> {
        for cell in 0..self.new.cells.len() {
            let (before, now) = (self.old.engine(cell)?, self.new.engine(cell)?);
            if before != now {
                let message = format!(
                    "{}: holds results of {before} for methods that {now} would compute now, beside {}, and the last \
                     digits are an engine's own; choose another folder, in which all are computed",
                    path.display(),
                    self.told().added.join(", ")
                );
                return Err(FileError::key("engine", message).into());
            }
        }
        Ok(())
    }

    /// Computes the new methods for the trials of all blocks.
    fn compute(
        &self,
        path: &Path,
        options: RunOptions,
        stop: &AtomicBool,
        on_event: &mut impl FnMut(Event),
    ) -> Result<(), CampaignError> {
        let (blocks, damaged) = BlockFolder::at(path.join(BLOCKS), &self.old).list()?;
        discard_damaged(damaged, options.repair)?;
        let Some(added) = &self.added else {
            return Ok(());
        };
        let trials = blocks.iter().map(|block| block.span.len()).sum();
        let mut work = Vec::new();
        for ((name, engine), experiment) in ADDED.into_iter().zip(added) {
            let spans = blocks.iter().map(|block| &block.span);
            let spans: Vec<&Span> = spans.filter(|span| engine == self.engine(span.cell)).collect();
            if spans.is_empty() {
                continue;
            }
            let folder = BlockFolder::at(files::make_subfolder(path, name)?, experiment);
            let there = match folder.list() {
                Ok((there, damaged)) if damaged.is_empty() => there,
                // Of another change, which was given up.
                _ => {
                    remove_own(&files::make_subfolder(path, name)?)?;
                    files::make_subfolder(path, name)?;
                    Vec::new()
                }
            };
            let missing = spans.iter().flat_map(|span| {
                let of_cell = there.iter().filter(|block| block.span.cell == span.cell);
                let parts = of_cell.map(|block| block.span.trials.clone());
                let parts = parts.filter(|part| part.start < span.trials.end && part.end > span.trials.start);
                let gaps: Vec<Range<u64>> = gaps(parts, span.trials.clone()).collect();
                gaps.into_iter().map(|trials| Span {
                    cell: span.cell,
                    trials,
                })
            });
            let missing: Vec<Span> = missing.collect();
            work.push((experiment, folder, missing));
        }
        let left: u64 = work.iter().flat_map(|(_, _, missing)| missing).map(Span::len).sum();
        on_event(Event::Planned {
            trials,
            done: trials - left,
        });
        for (experiment, blocks, spans) in &work {
            let work = Work {
                experiment,
                blocks,
                spans,
                block: options.block,
                threads: options.threads,
            };
            work.run(stop, &mut *on_event, |_, _| Ok(false))?;
        }
        go_on(stop)
    }

    /// Returns the engine of a cell as [`ADDED`] has it.
    fn engine(&self, cell: usize) -> Engine {
        match self.new.engine(cell) {
            Ok(Engine::Lanes) => Engine::Auto,
            _ => Engine::Faer,
        }
    }
}

/// Returns the place of the ratio of two outputs among those whose distribution a study keeps.
fn place_of_ratio(study: &Experiment, of: &JointTable, outputs: [usize; 2]) -> Option<usize> {
    let measures = |of: &JointTable| [of.measure, of.measure_of_to];
    let mut kept = study.kept_ratios().into_iter();
    kept.position(|(other, places)| measures(other) == measures(of) && places.map(|(output, _)| output) == outputs)
}
