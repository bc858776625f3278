//! Runs trials of W98 without useful output; `.ci/instructions` counts the instructions.
//!
//! `cargo run --release --example lane_instructions avx2|portable|faer|reproduce TRIALS`

use asobench::lanes::Isa;
use asobench::study::file::ExperimentFile;
use asobench::study::{CellTally, Engine, Experiment, NIKOLOV2023, Plan, Trials, W98, Worker};
use std::hint::black_box;

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let what = arguments.next().ok_or("avx2, portable, faer or reproduce?")?;
    let count: u64 = arguments.next().ok_or("how many trials?")?.parse()?;
    let reproduce = what == "reproduce";
    let text = if reproduce { NIKOLOV2023 } else { W98 };
    let mut file = ExperimentFile::parse(text)?;
    file.engine = Engine::Faer;
    let experiment = Experiment::new(file)?;
    // The paper's cell, with the settings of W98.
    let cell = &experiment.cells[usize::from(reproduce)];
    let mut worker = if what == "faer" {
        Worker::new(&experiment, cell)?
    } else {
        let isa: Isa = if reproduce { Isa::Avx2 } else { what.parse()? };
        if !isa.is_here() {
            return Err(format!("{isa} is not on this machine").into());
        }
        Worker::Lanes(Box::new(Plan::new(&experiment, cell)?.pack(isa)))
    };
    // Reserves room for all rows, so that growing the list adds no instructions.
    let mut trials = Trials::new(&experiment, cell);
    trials.rows.reserve(count as usize);
    worker.run_into(0..count, &mut trials)?;
    if reproduce {
        black_box(CellTally::from_trials(&experiment, cell, &mut trials));
    }
    println!("{} rows, {} fallbacks", trials.rows.len(), trials.fallbacks);
    Ok(())
}
