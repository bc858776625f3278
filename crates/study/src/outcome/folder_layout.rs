//! The names in a folder of results, and what the program wrote there.

use crate::files::{self, Kind, PathError};
use std::path::{Path, PathBuf};

/// The lock file. It stays in the folder: if it were removed, a third run could enter beside a second.
pub(crate) const LOCK: &str = ".lock";
/// The file with the looks at a study.
pub(crate) const LOOKS: &str = "looks.json";

/// The file of a results folder that says what was run.
pub const MANIFEST: &str = "manifest.json";
/// The results that a manifest describes. Without the manifest or the design of the blocks, their study is unknown.
pub(crate) const RESULTS: [(&str, Kind); 3] = [
    ("trials.parquet", Kind::Parquet),
    ("summary.json", Kind::Summary),
    ("summary.parquet", Kind::Parquet),
];
/// The folder of the blocks.
pub(crate) const BLOCKS: &str = "blocks";
/// Their design.
pub(crate) const DESIGN: &str = "design.json";
/// The folder of the times of the methods.
pub const TIMING: &str = "timing";
/// Their file.
pub const TIMES: &str = "times.json";

/// Returns the kind of a file that is published with the results: one of them, or a figure.
pub(crate) fn kind_of(name: &str) -> Option<Kind> {
    let others = [(MANIFEST, Kind::Manifest), (LOOKS, Kind::Looks)];
    let known = others.into_iter().chain(RESULTS).find(|(of, _)| *of == name);
    let figure = || Kind::of_report(name).filter(|kind| *kind == Kind::Figure);
    known.map(|(_, kind)| kind).or_else(figure)
}

/// Returns the name of a result file in a folder, if there is one.
pub(crate) fn result_file(folder: &Path) -> Option<&'static str> {
    let mut names = RESULTS.into_iter().map(|(name, _)| name);
    names.find(|name| files::is_there(&folder.join(name)))
}

/// Parses the name of a block file, `c00000-0000000000-0000000100.block`: the cell, the first trial and the end.
pub(crate) fn span_of(path: &Path) -> Option<(usize, u64, u64)> {
    let name = path.file_name()?.to_str()?;
    let mut parts = name.strip_prefix('c')?.strip_suffix(".block")?.split('-');
    let mut number = |digits: usize| {
        let part = parts.next()?;
        let fits = part.len() >= digits && part.bytes().all(|b| b.is_ascii_digit());
        part.parse::<u64>().ok().filter(|_| fits)
    };
    let span = (number(5)? as usize, number(10)?, number(10)?);
    parts.next().is_none().then_some(span)
}

/// Returns the files of a folder of blocks with their kinds.
///
/// # Errors
/// If the folder contains anything else.
pub(crate) fn own_blocks(blocks: &Path) -> Result<Vec<(PathBuf, Kind)>, PathError> {
    let mut own = Vec::new();
    for path in files::list(blocks)? {
        let kind = if span_of(&path).is_some() {
            Kind::Block
        } else if path.ends_with(DESIGN) {
            Kind::Design
        } else {
            return Err(PathError::foreign(&path, files::NOT_OWN));
        };
        files::replaceable(&path, kind)?;
        own.push((path, kind));
    }
    Ok(own)
}

/// Removes the blocks in a folder, and the folder.
///
/// # Errors
/// If the folder contains anything else (nothing is removed then), or a file cannot be removed.
pub(crate) fn remove_own(blocks: &Path) -> Result<(), PathError> {
    for (path, kind) in own_blocks(blocks)? {
        files::remove(&path, kind)?;
    }
    files::remove_empty(blocks)
}

/// How much of a study is already computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Done {
    /// Trials, over all cells.
    pub trials: u64,
    /// Bytes of their blocks.
    pub bytes: u64,
}

/// Returns how much the files of a folder of blocks hold, by their names.
pub(crate) fn done_in(blocks: &Path) -> Done {
    let mut spans: Vec<(usize, u64, u64)> = Vec::new();
    let mut done = Done::default();
    for path in files::list(blocks).unwrap_or_default() {
        if let Some(span) = span_of(&path) {
            spans.push(span);
            done.bytes += path.symlink_metadata().map_or(0, |metadata| metadata.len());
        }
    }
    spans.sort_unstable();
    let mut reached = (0, 0);
    for (cell, start, end) in spans {
        if cell != reached.0 {
            reached = (cell, 0);
        }
        done.trials += end.saturating_sub(start.max(reached.1));
        reached.1 = reached.1.max(end);
    }
    done
}
