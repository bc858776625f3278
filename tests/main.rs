//! All tests of the package in one program, since each program links all libraries anew: a module for each subject.
//! `cargo test --release --test it theory::` runs one of them. Tests run side by side in one process: none may change
//! what belongs to all of it (its environment, its folder, its limits).

mod changed_methods;
mod cli;
mod closed_loop;
mod cluster;
mod commands;
mod common;
mod coverage;
mod determinism;
mod every_method;
#[cfg(target_os = "linux")]
mod external;
mod failures;
mod first_guesses;
mod formats;
mod golden;
mod gpebo;
#[cfg(unix)]
mod hostile;
mod lanes;
mod large_samples;
mod meant_commands;
mod meant_values;
mod observe;
mod observers;
mod pages;
mod panel;
mod paper;
mod pictures;
mod promises;
mod properties;
mod readme;
mod recorded_data;
mod records;
mod report;
#[cfg(unix)]
mod six_doors;
mod standard_errors;
mod stored_damage;
mod studies;
mod suite;
mod theory;
mod value_stability;
#[cfg(target_os = "linux")]
mod verdict_audit;
