//! How it is run: trials on engines and threads, blocks, rounds, shards, and what they will take.

pub(crate) mod block_file;
pub(crate) mod campaign;
pub(crate) mod changed_methods;
pub mod cluster;
pub(crate) mod compute;
pub(crate) mod continuous_trial;
pub(crate) mod course;
pub(crate) mod event;
pub(crate) mod forecast;
pub(crate) mod machine_peak;
pub(crate) mod pack_trial;
pub(crate) mod partial;
pub(crate) mod pilot;
pub(crate) mod resume;
pub(crate) mod rounds;
pub(crate) mod runner;
pub(crate) mod score;
pub(crate) mod trial;
pub(crate) mod trial_worker;
pub(crate) mod workload;
