//! Files that the user names, which are written completely or not at all.

use super::error::Error;
use crate::files::{Kind, PathError, Staged, replaceable};
use crate::report::plot::Drawing;
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

/// The forms of a picture, by the ends of their files' names.
pub(super) const PICTURES: &[&str] = &["svg", "pdf"];

/// Checks that the name of a picture or a page ends as it must.
pub(super) fn check_extension(flag: &str, path: &Path, expected: &[&str]) -> Result<(), Error> {
    let fault = extension_fault(path, expected);
    fault.map_or(Ok(()), |fault| {
        Err(Error::Input(format!("{flag} {}: {fault}", path.display())))
    })
}

/// The path of a picture.
///
/// # Errors
/// What its name must end in.
pub(super) fn picture_path(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    extension_fault(&path, PICTURES).map_or(Ok(path), Err)
}

/// What the name of a file must end in, if it does not. Of an SVG, one command makes a PNG.
fn extension_fault(path: &Path, expected: &[&str]) -> Option<String> {
    let own = path.extension().unwrap_or_default();
    if expected.iter().any(|form| own.eq_ignore_ascii_case(form)) {
        return None;
    }
    let way = ["png", "eps", "ps"]
        .into_iter()
        .find(|form| own.eq_ignore_ascii_case(form));
    let way = way
        .filter(|_| expected == PICTURES)
        .map_or_else(String::new, |form| {
            let svg = path.with_extension("svg");
            format!(
                "; rsvg-convert -f {form} -o {} {} converts one",
                path.display(),
                svg.display()
            )
        });
    let ends: Vec<String> = expected.iter().map(|form| format!(".{form}")).collect();
    Some(format!(
        "expected a name that ends in {}{way}",
        ends.join(" or ")
    ))
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
