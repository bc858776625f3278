//! Monte-Carlo studies: experiments from files, trials on all processors, stores that resume, and the verdicts on
//! claims.
//!
//! | module | what |
//! |---|---|
//! | [`study`] | experiment, trial, runner, store, summary |
//! | [`claim`] | verdicts on the claims of an experiment file from its results |
//! | [`worker`] | methods that are external programs |
//! | [`files`] | the only access to the file system |

#![warn(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod claim;
pub mod files;
pub mod study;
pub mod text;
pub mod worker;

/// The git revision that this was built from, if it was built in a checkout.
pub const GIT_REVISION: Option<&str> = option_env!("ASOBENCH_GIT_REVISION");
