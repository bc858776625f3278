//! The answer of a study: which method is best in each cell and by how much, who loses trials, and how the error
//! depends on the settings. Every sentence names its method and its cells.

use super::columns::Columns;
use super::extremes::LongTable;
use super::layout::x_key;
use super::lead::{lead_figures, lead_outputs};
use crate::html::CellText;
use crate::results::{OverCells, Study, lost, place, placed, words};
use crate::verdict_table::per_cent;
use asobench_identification::metric::{Quantile, Z};
use asobench_identification::number::{quantile, uncertain};
use asobench_study::study::file::Key;
use asobench_study::study::{Better, CellSummary, Measure, measure};
use asobench_study::text::{grouped, listed};
use std::cmp::Ordering;
use std::collections::BTreeMap;

/// Largest number of cells that get a sentence each.
const CELLS: usize = 4;
/// Largest number of methods whose lost trials get a sentence each, those with most first.
const METHODS: usize = 12;
/// Largest number of methods that are named as best.
const WINNERS: usize = 3;
/// Largest number of settings whose effect is told.
const SETTINGS: usize = 4;

/// The caveat of a comparison of two medians.
const ERROR: &str = "Errors of ratios and differences treat the two medians as independent, although all cells and \
    methods share their random numbers: with alike methods they are too large.";

/// All sentences.
pub(super) fn in_numbers(study: &Study) -> Vec<String> {
    let Some(measure) = lead_figures(study).first().copied() else {
        return vec!["No output has a measure in any cell.".to_owned()];
    };
    let mut all = vec![best(study, measure), lost_trials(study), depends(study, measure)];
    all.push(paired(study, measure));
    all.retain(|text| !text.is_empty());
    all
}

/// The median of a method in a cell.
struct Of {
    label: String,
    median: Quantile,
}

/// A cell with its methods, the best first, of which there is one at least; those without a median are left out.
struct Ranked<'a> {
    cell: &'a CellSummary,
    methods: Vec<Of>,
    of: Measure,
}

impl Ranked<'_> {
    fn best(&self) -> &Of {
        &self.methods[0]
    }

    /// The next method, and its median beside the best.
    fn next(&self) -> Option<(&Of, Lead)> {
        let next = self.methods.get(1)?;
        Some((next, Lead::new(self.best().median, next.median, self.of)))
    }
}

/// The median of a method in a cell, if it is known.
fn median(study: &Study, cell: &CellSummary, label: &str, of: Measure) -> Option<Quantile> {
    let median = study.statistics(cell, label, of)?.q50;
    (median.value.is_finite() && !median.lost).then_some(median)
}

/// The cells with a median: those with noise, if any has.
fn ranked(study: &Study, of: Measure) -> Vec<Ranked<'_>> {
    let labels = lead_outputs(study);
    let cells = study.summary.cells.iter();
    let cells = cells.filter(|cell| !study.is_quiet(cell)).map(|cell| {
        let medians = labels.iter().filter_map(|(_, label)| {
            let (label, median) = (label.clone(), median(study, cell, label, of)?);
            Some(Of { label, median })
        });
        let mut methods: Vec<Of> = medians.collect();
        methods.sort_by(|a, b| match of.entry().better {
            Better::Larger => b.median.value.total_cmp(&a.median.value),
            _ => a.median.value.total_cmp(&b.median.value),
        });
        Ranked { cell, methods, of }
    });
    cells.filter(|of| !of.methods.is_empty()).collect()
}

/// The same; `None` where nothing can be compared.
fn comparable(study: &Study, of: Measure) -> Option<Vec<Ranked<'_>>> {
    let all = ranked(study, of);
    let can = of.entry().better != Better::Neither && all.iter().any(|cell| cell.methods.len() > 1);
    can.then_some(all)
}

/// Two medians compared: their ratio for a positive error, else their difference; the standard error; the value of two
/// equal ones.
struct Lead {
    value: f64,
    error: f64,
    equal: f64,
}

impl Lead {
    /// `later` over, or minus, `first`.
    fn new(first: Quantile, later: Quantile, of: Measure) -> Self {
        let is_ratio = of.entry().scale == measure::Scale::Log && first.value > 0.0;
        if is_ratio {
            let value = later.value / first.value;
            let error = value * (first.mcse / first.value).hypot(later.mcse / later.value.max(f64::MIN_POSITIVE));
            Self {
                value,
                error,
                equal: 1.0,
            }
        } else {
            let value = later.value - first.value;
            Self {
                value,
                error: first.mcse.hypot(later.mcse),
                equal: 0.0,
            }
        }
    }

    fn text(&self) -> String {
        uncertain(self.value, self.error)
    }

    /// Whether the two may be equal, by 1.96 standard errors.
    fn is_tie(&self) -> bool {
        (self.value - self.equal).abs() <= Z * self.error
    }

    /// "1.53(2) times as large", or "0.12(3) % larger".
    fn words(&self, unit: &str) -> String {
        if self.equal > 0.0 {
            return format!("{} times as large", self.text());
        }
        let than = if self.value < 0.0 { "smaller" } else { "larger" };
        let value = uncertain(self.value.abs(), self.error);
        format!("{} {than}", with_unit(&value, unit))
    }
}

pub(super) fn with_unit(value: &str, unit: &str) -> String {
    format!("{value} {unit}").trim_end().to_owned()
}

/// "at eta = 2 %, N = 98", or "in the one cell".
pub(super) fn at(cell: &CellSummary, keys: &[Key]) -> String {
    match place(cell, keys).as_str() {
        "" => "in the one cell".to_owned(),
        place => format!("at {place}"),
    }
}

/// The words for the best of a measure.
fn superlative(of: Measure) -> &'static str {
    match of.entry().better {
        Better::Larger => "largest",
        _ => "smallest",
    }
}

/// Who is best where, and by how much; empty where nothing can be compared.
fn best(study: &Study, of: Measure) -> String {
    let Some(all) = comparable(study, of) else {
        return String::new();
    };
    let (keys, unit) = (study.varying(), of.entry().unit);
    let (most, name) = (superlative(of), of.label());
    let sentence = |ranked: &Ranked<'_>| {
        let (place, Of { label, median }) = (capital(&at(ranked.cell, &keys)), ranked.best());
        let median = with_unit(&uncertain(median.value, median.mcse), unit);
        let begin = format!("{place} {label} has the {most} median {name}, {median}");
        let Some((next, lead)) = ranked.next() else {
            return format!("{begin}, and no other method has a median.");
        };
        let tie = if lead.is_tie() {
            ", a tie within 1.96 standard errors"
        } else {
            ""
        };
        let (next, lead) = (&next.label, lead.words(unit));
        format!("{begin}; that of {next}, the next, is {lead}{tie}.")
    };
    if all.len() <= CELLS {
        let sentences: Vec<String> = all.iter().map(sentence).collect();
        return format!("{} {ERROR}", sentences.join(" "));
    }
    let mut text = wins(&all, of) + " ";
    // The clearest and the closest lead.
    let known = all.iter().filter_map(|cell| Some((cell, cell.next()?.1)));
    let mut known: Vec<(&Ranked<'_>, Lead)> = known.collect();
    let size = |lead: &Lead| (lead.value - lead.equal).abs();
    known.sort_by(|(_, a), (_, b)| size(b).total_cmp(&size(a)));
    if let [(widest, _), .., (closest, _)] = known.as_slice() {
        let [widest, closest] = [widest, closest].map(|cell| sentence(cell));
        text.push_str(&format!("The widest and the closest lead: {widest} {closest}"));
    }
    format!("{text} {ERROR}")
}

/// The methods that are best, by their number of cells; empty where nothing can be compared.
pub(crate) fn winners(study: &Study, of: Measure) -> String {
    comparable(study, of).map_or_else(String::new, |all| wins(&all, of))
}

/// "Smallest median e_a: oe in 5 of 6 cells, bj in 1. In 2 of the 6 the next method is as good within ...".
fn wins(all: &[Ranked<'_>], of: Measure) -> String {
    let mut wins: Vec<(&str, usize)> = Vec::new();
    let mut ties = 0;
    for ranked in all {
        let best = ranked.best().label.as_str();
        match wins.iter_mut().find(|(label, _)| *label == best) {
            Some((_, count)) => *count += 1,
            None => wins.push((best, 1)),
        }
        ties += usize::from(ranked.next().is_some_and(|(_, lead)| lead.is_tie()));
    }
    wins.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let total = all.len();
    let each = wins.iter().take(WINNERS).enumerate();
    let each = each.map(|(i, (label, count))| match i {
        _ if total == 1 => (*label).to_owned(),
        0 => format!("{label} in {count} of {total} cells"),
        _ => format!("{label} in {count}"),
    });
    let others = wins.iter().skip(WINNERS);
    let others = match others.map(|(_, count)| count).sum::<usize>() {
        0 => String::new(),
        rest => format!(", {} other methods in {rest}", wins.len() - WINNERS),
    };
    let ties = match ties {
        0 => String::new(),
        _ if total == 1 => " The next method ties with it within 1.96 standard errors.".to_owned(),
        ties => {
            format!(" In {ties} of the {total} cells the next method ties with the best within 1.96 standard errors.")
        }
    };
    let each = each.collect::<Vec<_>>().join(", ");
    format!(
        "{} median {}: {each}{others}.{ties}",
        capital(superlative(of)),
        of.label()
    )
}

/// The text with its first letter in upper case.
pub(super) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(char::to_uppercase);
    first.into_iter().flatten().chain(letters).collect()
}

/// The lost trials of every method: of outputs with several passes the last.
fn lost_trials(study: &Study) -> String {
    let keys = study.varying();
    let all = last_passes(study).into_iter();
    let mut all: Vec<(&String, OverCells<'_>)> = all
        .filter_map(|label| Some((label, study.over_cells(label, lost)?)))
        .collect();
    all.sort_by(|(_, a), (_, b)| b.all.share.partial_cmp(&a.all.share).unwrap_or(Ordering::Equal));
    let (losing, none): (Vec<_>, Vec<_>) = all.into_iter().partition(|(_, of)| of.all.count > 0);
    let sentence = |(label, of): &(&String, OverCells<'_>)| {
        let (cell, share) = of.most;
        let most = placed(cell, &keys, |place| format!(", most at {place}: {} %", per_cent(share)));
        let total = grouped(of.all.total);
        format!(" {label} loses {} % of its {total} trials{most}.", per_cent(of.all))
    };
    let mut text = "Lost trials, which fail or leave an unstable model:".to_owned();
    text.extend(losing.iter().take(METHODS).map(sentence));
    if let Some((_, next)) = losing.get(METHODS) {
        let more = losing.len() - METHODS;
        text.push_str(&format!(" {more} more lose at most {} % each.", per_cent(next.all)));
    }
    let none: Vec<&String> = none.iter().map(|(label, _)| *label).collect();
    if !none.is_empty() {
        text.push_str(&format!(" None: {}.", listed(&none, METHODS)));
    }
    text
}

/// The last output of each method, in order of appearance.
fn last_passes(study: &Study) -> Vec<&String> {
    let Some(cell) = study.summary.cells.first() else {
        return Vec::new();
    };
    let outputs = cell.outputs.iter().zip(study.labels());
    let last = |i: usize, name: &str| !cell.outputs[i + 1..].iter().any(|later| later.estimator == name);
    let kept = outputs
        .enumerate()
        .filter(|(i, (output, _))| last(*i, &output.estimator));
    kept.map(|(_, (_, label))| label).collect()
}

/// How the median of the method that is best in most cells changes from the first to the last value of each setting.
fn depends(study: &Study, of: Measure) -> String {
    let cells = ranked(study, of);
    let mut wins: BTreeMap<&String, usize> = BTreeMap::new();
    for cell in cells.iter().filter(|_| of.entry().better != Better::Neither) {
        *wins.entry(&cell.best().label).or_default() += 1;
    }
    let winner = wins.into_iter().max_by_key(|(_, count)| *count);
    let Some(label) = winner.map(|(label, _)| label.clone()).or_else(|| study.main_output()) else {
        return String::new();
    };
    let mut keys = study.varying();
    // The setting along x of the figures comes first.
    let first = x_key(study);
    keys.sort_by_key(|key| Some(*key) != first);
    keys.retain(|key| *key != Key::Claim && (study.is_numeric(*key) || study.values(*key).len() == 2));
    let told = keys.into_iter().take(SETTINGS);
    let told: Vec<String> = told.filter_map(|key| effect(study, of, &label, key)).collect();
    told.join(" ")
}

/// A cell at an end of a setting's values, with its median.
type End<'a> = (&'a CellSummary, Quantile);

/// "From eta = 2 % to eta = 30 % the median e_a of oe is multiplied by 14.8(4) (plant a) to 15.2(3) (plant b)."
fn effect(study: &Study, of: Measure, label: &str, key: Key) -> Option<String> {
    let values = study.values(key);
    let [from, .., to] = values else { return None };
    let mut others = study.varying();
    others.retain(|other| *other != key);
    let ends = [0, values.len() - 1];
    let mut groups: BTreeMap<Vec<usize>, [Option<End<'_>>; 2]> = BTreeMap::new();
    for cell in study.summary.cells.iter().filter(|cell| !study.is_quiet(cell)) {
        let Some(end) = ends.iter().position(|end| *end == study.place(cell, key)) else {
            continue;
        };
        let group = others.iter().map(|other| study.place(cell, *other)).collect();
        groups.entry(group).or_default()[end] = median(study, cell, label, of).map(|median| (cell, median));
    }
    let changes = groups.values().filter_map(|ends| match ends {
        [Some((cell, first)), Some((_, last))] => Some((*cell, Lead::new(*first, *last, of))),
        _ => None,
    });
    let mut changes: Vec<(&CellSummary, Lead)> = changes.collect();
    changes.sort_by(|a, b| a.1.value.total_cmp(&b.1.value));
    let how = |lead: &Lead| {
        if lead.equal > 0.0 {
            "is multiplied by"
        } else {
            "changes by"
        }
    };
    let text =
        |(cell, lead): &(&CellSummary, Lead)| lead.text() + &placed(cell, &others, |place| format!(" ({place})"));
    let (how, range) = match changes.as_slice() {
        [] => return None,
        [one] => (how(&one.1), text(one)),
        [least, .., most] => (how(&least.1), format!("{} to {}", text(least), text(most))),
    };
    Some(format!(
        "From {} to {} the median {} of {label} {how} {range}.",
        words(key, from),
        words(key, to),
        of.label()
    ))
}

/// The results of the comparisons on the same trials.
fn paired(study: &Study, measure: Measure) -> String {
    let mut text = String::new();
    for [first, second] in study.file.compare.iter().take(3) {
        let pairs = study.summary.cells.iter().flat_map(|cell| &cell.comparisons);
        let compared = pairs.filter(|pair| pair.first == *first && pair.second == *second);
        let ratios: Vec<Quantile> = compared
            .filter_map(|pair| Some(pair.measures.get(&measure)?.median_ratio))
            .filter(|ratio| ratio.value.is_finite())
            .collect();
        let (better, worse) = ratios.iter().fold((0, 0), |(better, worse), ratio| {
            let (low, high) = ratio.interval();
            (better + usize::from(high < 1.0), worse + usize::from(low > 1.0))
        });
        if !ratios.is_empty() {
            text.push_str(&format!(
                " On the same trials the {} of {} is smaller than that of {} in {better} of {} \
                cells and larger in {worse}, by the 95 % interval of the median ratio.",
                measure.label(),
                first,
                second,
                ratios.len()
            ));
        }
    }
    text.trim_start().to_owned()
}

/// The medians of a measure: a row for each cell, a column for each method, the best in bold, and how far the next is.
/// `None` where one method alone is there.
pub(super) fn medians(study: &Study, of: Measure) -> Option<LongTable> {
    let labels = lead_outputs(study);
    let [(_, first), _, ..] = labels.as_slice() else {
        return None;
    };
    let all = ranked(study, of);
    let find = |cell: &CellSummary| all.iter().find(|ranked| ranked.cell.cell == cell.cell);
    let is_best = |cell: &CellSummary, label: &str| {
        of.entry().better != Better::Neither && find(cell).is_some_and(|of| of.best().label == label)
    };
    let mut columns = Columns::new(study.summary.cells.iter()).settings(study, |cell| *cell);
    for (_, label) in &labels {
        columns = columns.number(label, "", move |cell| {
            let median = study.statistics(cell, label, of).map(|of| of.q50);
            let median = median.unwrap_or(Quantile::UNDEFINED);
            CellText::number(quantile(median), median.value).best(is_best(cell, label))
        });
    }
    let is_ratio = of.entry().scale == measure::Scale::Log;
    if of.entry().better == Better::Neither {
        columns = trials_of(columns);
    } else {
        let heading = if is_ratio { "next / best" } else { "next - best" };
        columns = columns.number(heading, "", |cell| match find(cell).and_then(Ranked::next) {
            Some((_, lead)) => CellText::number(lead.text(), lead.value),
            None => CellText::text("-"),
        });
    }
    let unit = match of.entry().unit {
        "" => String::new(),
        unit => format!(" in {unit}"),
    };
    columns
        .table(
            &format!(
                "Median {}{unit}, the best of a row in bold; in parentheses the standard error of the last digit. \
                 \"none\": half of the trials or more have no {}.",
                of.label(),
                of.label()
            ),
            first,
        )
        .unless_empty()
}

/// With a column of the trials of each cell; by its heading files of these tables are known.
fn trials_of<'a, I>(columns: Columns<'a, I>) -> Columns<'a, I>
where
    I: Iterator<Item = &'a CellSummary> + Clone,
{
    columns.number("trials of a cell", "", |cell| {
        CellText::number(cell.trials.to_string(), cell.trials as f64)
    })
}

/// The lost trials in per cent: a row for each cell, a column for each method; `None` if no trial was lost.
pub(super) fn lost_table(study: &Study) -> Option<LongTable> {
    let labels = lead_outputs(study);
    let share = |cell: &CellSummary, label: &str| study.output(cell, label).map(lost);
    let is_lost = |label: &str| study.over_cells(label, lost).is_some_and(|of| of.all.count > 0);
    let any = labels.iter().any(|(_, label)| is_lost(label));
    let (_, last) = labels.last().filter(|_| any)?;
    let mut columns = Columns::new(study.summary.cells.iter()).settings(study, |cell| *cell);
    for (_, label) in &labels {
        columns = columns.number(label, "", move |cell| match share(cell, label) {
            Some(of) => CellText::number(per_cent(of), super::tables::tidy(100.0 * of.share)),
            None => CellText::text("-"),
        });
    }
    let caption = "Lost trials in per cent: failed, or with an unstable model; in parentheses the standard error of \
        the last digit.";
    trials_of(columns).table(caption, last).unless_empty()
}

#[cfg(test)]
mod tests;
