//! `asobench check`: prints what an experiment file asks for, and what it will cost.

use super::error::{Error, bad_input, failed};
use super::execute::threads;
use super::need::{Need, Room, amount, duration, span};
use super::output::print;
use super::study_arguments::StudyArguments;
use super::{groups, memory, progress, timing};
use crate::model::Orders;
use crate::report::Study;
use crate::study::file::{Axis, Key, TrialRule};
use crate::study::{Disk, Experiment, Forecast, check_results, done};
use crate::text::visible;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::Instant;

mod pilot;
mod plants;

/// Check an experiment file; print the grid's size, and time, memory and room on disk, estimated from a few trials. Of
/// a folder of results: check that its files are unchanged.
#[derive(clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    study: StudyArguments,
    /// Folder of the results: trials found there are not counted again [default: results/NAME of NAME.toml]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Simulate M trials of every cell, and print the verdicts that they foretell and the trials that would decide
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pilot: Option<u64>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    if arguments.study.file.is_dir() {
        return results(&arguments.study.file);
    }
    let begin = Instant::now();
    let folder = arguments.study.folder(arguments.out.as_deref());
    let (experiment, rule) = arguments.study.experiment(&folder)?;
    let setup = begin.elapsed().as_secs_f64();
    if let Some(trials) = arguments.pilot {
        pilot::check(&experiment, &rule, trials)?;
        // From here on Ctrl-C ends the pilot, not the program at once.
        progress::stop_flag()?;
    }
    // Print the size first: the estimate takes some seconds if trials are long.
    print(&size(arguments, &experiment, &rule))?;
    print(&plants::plants(&experiment))?;
    memory::fits(&experiment, 0..experiment.cells.len(), 1)?;
    if !experiment.programs.is_empty() {
        print("time      not known: methods are programs, which `check` does not start\n")?;
        let (_, most) = rule.extent();
        if let batch @ 2.. = experiment.batch()
            && most % batch != 0
        {
            print(&format!(
                "          batches are whole: they estimate {} trials of a cell\n",
                most.next_multiple_of(batch)
            ))?;
        }
        return Ok(());
    }
    print(&estimates(&experiment, &rule, &folder, setup)?)?;
    if let Some(trials) = arguments.pilot {
        pilot::print_pilot(&experiment, trials, threads(None))?;
    }
    Ok(())
}

/// Checks that results are what was written.
fn results(folder: &Path) -> Result<(), Error> {
    Study::read(folder).map_err(bad_input)?;
    let names = check_results(folder).map_err(bad_input)?;
    let names = match names.as_slice() {
        [] => "results of a version without checksums".to_owned(),
        names => format!("as they were written: {}", names.join(", ")),
    };
    print(&format!("{}: {names}\n", visible(folder.display())))
}

/// A line of the output.
fn line(name: &str, value: &str) -> String {
    format!("{name:<9} {}\n", visible(value))
}

/// Returns what the file asks for.
fn size(arguments: &Arguments, experiment: &Experiment, rule: &TrialRule) -> String {
    let file = &experiment.file;
    let mut text = String::new();
    let title = if file.title.is_empty() {
        arguments.study.name().display().to_string()
    } else {
        file.title.clone()
    };
    text += &line("title", &title);
    if !file.question.is_empty() {
        text += &line("question", &file.question);
    }
    text += &line("cells", &format!("{}{}", experiment.cells.len(), axes(experiment)));
    let outputs = experiment.outputs();
    let labels: Vec<String> = outputs.iter().map(crate::estimator::Output::label).collect();
    text += &line("outputs", &format!("{}: {}", labels.len(), shortened(&labels)));
    for (i, (orders, names)) in orders(experiment).iter().enumerate() {
        let name = if i == 0 { "orders" } else { "" };
        text += &line(name, &format!("{orders}: {}", shortened(names)));
    }
    text += &line("trials", &trials(experiment, rule));
    text += &line("stores", &file.store.to_string());
    text
}

/// Returns the orders of models with the methods that have them, for methods that take orders.
fn orders(experiment: &Experiment) -> Vec<(String, Vec<String>)> {
    let mut found: Vec<(String, Vec<String>)> = Vec::new();
    let mut add = |orders: Orders, name: &str| groups::add(&mut found, orders.to_string(), name.to_owned());
    let cells = experiment.cells.iter();
    let settings: BTreeSet<usize> = cells.map(asobench_study::study::Cell::order).collect();
    for order in settings {
        for method in &experiment.methods {
            let options = method.options();
            let orders = options.and_then(|options| options.model_orders(order));
            if let (Some(orders), Some(output)) = (orders, method.outputs().last()) {
                add(orders, &output.estimator);
            }
        }
        for program in &experiment.programs {
            add(program.options.orders_for(order), &program.name);
        }
    }
    found
}

/// Returns the number of trials in words.
fn trials(experiment: &Experiment, rule: &TrialRule) -> String {
    let (least, most) = rule.extent();
    let all = format!("{} in each cell", span((least, most)));
    let alike = experiment.cells.iter().filter(|cell| cell.is_deterministic());
    match alike.count() {
        alike @ 1.. if most > 1 => format!("{all}, but 1 in the {alike} without random numbers"),
        _ => all,
    }
}

/// Returns the trials of all cells if so many are asked for in each.
fn total(experiment: &Experiment, asked: u64) -> f64 {
    let cells = 0..experiment.cells.len();
    cells.map(|cell| experiment.trials_of(cell, asked) as f64).sum()
}

/// Returns the costs of a run. Of its time, `setup` seconds have passed already.
fn estimates(experiment: &Experiment, rule: &TrialRule, folder: &Path, setup: f64) -> Result<String, Error> {
    let threads = threads(None);
    let (least, most) = rule.extent();
    let forecast = Forecast::measure(experiment, most).map_err(failed)?;
    // By now it has loaded what a run needs.
    let program = memory::taken();
    let (done, room) = (done(folder, experiment), Room::of(folder));
    let need = Need::of(&forecast, most, threads, done);
    let seconds = |trials: u64| {
        let missing =
            (total(experiment, trials) - done.trials as f64) / (experiment.cells.len() as f64 * trials as f64);
        duration(setup + forecast.seconds(trials, missing.max(0.0), threads))
    };
    let mut time = format!(
        "about {} on {threads} threads of this machine",
        span((seconds(least), seconds(most)))
    );
    if experiment.file.timing {
        let more = duration(timing::duration(experiment, forecast.seconds_per_trial()));
        time.extend([format!(
            ", then about {more} for the times of the methods, on one thread"
        )]);
    }
    let memory = |trials: u64| amount(program + forecast.memory(trials, threads));
    let memory = span((memory(least), memory(most)));
    let memory = format!("about {memory}{}", free(room.memory));
    let disk = [least, most].map(|trials| forecast.disk(trials));
    let mut text = String::new();
    text += &line("time", &time);
    text += &line("memory", &memory);
    text += &line("disk", &(room_taken(disk) + &free(room.disk)));
    if done.trials > 0 {
        let there = format!("{} trials, {}", done.trials, amount(done.bytes as f64));
        text += &line("there", &there);
    }
    if let Some(beyond) = need.beyond(&room) {
        text += &line("warning", &beyond);
    }
    Ok(text)
}

/// Returns how much of something is free, if known.
fn free(free: Option<f64>) -> String {
    free.map_or_else(String::new, |free| format!(", {} are free", amount(free)))
}

/// Returns the disk space for the fewest and the most trials, and its division between files.
fn room_taken(disk: [Disk; 2]) -> String {
    let of = |part: fn(&Disk) -> f64| span((amount(part(&disk[0])), amount(part(&disk[1]))));
    let trials = if disk[1].trials > 0.0 {
        format!(", {} in trials.parquet", of(|disk| disk.trials))
    } else {
        String::new()
    };
    format!(
        "about {}: {} in blocks/{trials}, {} of summaries; a report takes {}",
        of(Disk::of_run),
        of(|disk| disk.blocks),
        of(|disk| disk.summary),
        of(|disk| disk.report),
    )
}

/// Returns the axes with their lengths. Zipped axes count as one.
fn axes(experiment: &Experiment) -> String {
    let file = &experiment.file;
    let mut axes = Vec::new();
    for key in Key::ALL {
        let Some(Axis::Many(values)) = file.settings.get(key) else {
            continue;
        };
        let group = file.zip.iter().find(|group| group.contains(key));
        let names = match group {
            Some(group) if group.iter().min() != Some(key) => continue,
            Some(group) => group.iter().map(ToString::to_string).collect::<Vec<_>>().join("+"),
            None => key.to_string(),
        };
        axes.push(format!("{names} {}", values.len()));
    }
    if axes.is_empty() {
        String::new()
    } else {
        format!(": {}", axes.join(" x "))
    }
}

fn shortened(labels: &[String]) -> String {
    const SHOWN: usize = 6;
    if labels.len() <= SHOWN {
        return labels.join(", ");
    }
    format!("{}, ..., {}", labels[..SHOWN - 1].join(", "), labels[labels.len() - 1])
}
