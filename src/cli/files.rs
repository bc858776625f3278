//! Files that the user names, which are written completely or not at all.

use super::error::Error;
use crate::files::{Kind, PathError, Staged, replaceable};
use crate::report::plot::Drawing;
use crate::text::shell_word;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

fn refused(flag: &str) -> impl Fn(PathError) -> Error + '_ {
    move |error| Error::Input(format!("{flag} {error}"))
}

/// Returns the error for a folder of results or of a report that cannot be written to.
pub(super) fn cannot_write(PathError { path, source, .. }: &PathError) -> Error {
    let path = path.display();
    Error::Input(format!("--out {path}: cannot write there ({source})"))
}

/// Refuses an existing file that this program did not write. `flag` names the option in a message.
pub(super) fn check_output(flag: &str, path: Option<&Path>, kind: Kind) -> Result<(), Error> {
    path.map_or(Ok(()), |path| replaceable(path, kind))
        .map_err(refused(flag))
}

/// Writes a file under a temporary name beside it, then renames it.
pub(super) fn write_whole(
    flag: &str,
    path: &Path,
    kind: Kind,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), Error> {
    let attempt = || {
        let mut staged = Staged::default();
        let mut to = BufWriter::new(staged.create(path, kind)?.0);
        let written = write(&mut to).and_then(|()| to.flush());
        written.map_err(PathError::io(path))?;
        staged.publish()
    };
    attempt().map_err(refused(flag))
}

/// The path of a picture.
///
/// # Errors
/// The ends that its name may have; of an SVG, one command makes a PNG.
#[expect(clippy::needless_pass_by_value, reason = "clap passes it")]
pub(super) fn picture_path(path: PathBuf) -> Result<PathBuf, String> {
    let error = match path_in(path.clone(), &["svg", "pdf"]) {
        Ok(path) => return Ok(path),
        Err(error) => error,
    };
    let form = path.extension().and_then(|form| form.to_str());
    match form.filter(|form| ["png", "eps", "ps"].contains(form)) {
        Some(form) => {
            let svg = path.with_extension("svg");
            let [path, svg] = [&path, &svg].map(|path| shell_word(path.display()));
            Err(format!("{error}; rsvg-convert -f {form} -o {path} {svg} converts one"))
        }
        None => Err(error),
    }
}

/// The path of a page.
///
/// # Errors
/// The ends that its name may have.
pub(super) fn page_path(path: PathBuf) -> Result<PathBuf, String> {
    path_in(path, &["html"])
}

/// The path of a table of numbers.
///
/// # Errors
/// The ends that its name may have.
pub(super) fn table_path(path: PathBuf) -> Result<PathBuf, String> {
    path_in(path, &["csv", "parquet"])
}

/// A path whose name ends in one of some forms.
fn path_in(path: PathBuf, forms: &[&str]) -> Result<PathBuf, String> {
    let own = path.extension().unwrap_or_default();
    if forms.iter().any(|form| own.eq_ignore_ascii_case(form)) {
        return Ok(path);
    }
    let ends: Vec<String> = forms.iter().map(|form| format!(".{form}")).collect();
    Err(format!("expected a name that ends in {}", ends.join(" or ")))
}

/// A picture in the form that the name of its file ends in.
pub(super) fn drawn(flag: &str, path: &Path, picture: &Drawing) -> Result<Vec<u8>, Error> {
    match path.extension() {
        Some(form) if form.eq_ignore_ascii_case("pdf") => picture
            .pdf()
            .map_err(|why| Error::Input(format!("{flag} {}: {why}", path.display()))),
        _ => Ok(picture.svg().into_bytes()),
    }
}
