//! Monte-Carlo studies: experiments from files, trials on all processors, stores that resume, and the verdicts on
//! claims.
//!
//! | module | what |
//! |---|---|
//! | [`design`] | what is to be simulated: file, settings, cells, experiment |
//! | [`outcome`] | what came out: rows, tallies, summaries, and their files |
//! | [`claim`] | verdicts on the claims of an experiment file from its results |
//! | [`run`] | how it is run: trials, threads, blocks, rounds, shards |
//! | [`study`] | the parts of these that callers need, under one name |
//! | [`suite`] | the reference suite: scenarios, scores, shipped results |
//! | [`worker`] | methods that are external programs |
//! | [`files`] | the only access to the file system |

#![warn(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod claim;
pub mod design;
pub mod files;
pub mod outcome;
mod revision;
pub mod run;
pub mod study;
pub mod suite;
pub mod text;
pub mod worker;

pub use revision::GIT_REVISION;
