//! Obstacles that may stand where the program wants a file or a folder of its own.

use super::Place;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::Command;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Obstacle {
    /// Nothing was done to it.
    Own,
    /// Nothing is there.
    Nothing,
    /// A file of somebody.
    Foreign,
    /// A file of the kind that stands there, and of somebody: the same ending, another content.
    Alike,
    /// One more name of a file of somebody.
    HardLink,
    LinkToFile,
    /// The program's own file or folder of the same name, elsewhere.
    LinkToOwn,
    LinkToFolder,
    LinkToNothing,
    Pipe,
    LinkToZero,
    LinkToFull,
    Folder,
}

impl Obstacle {
    pub const ALL: [Self; 13] = [
        Self::Own,
        Self::Nothing,
        Self::Foreign,
        Self::Alike,
        Self::HardLink,
        Self::LinkToFile,
        Self::LinkToOwn,
        Self::LinkToFolder,
        Self::LinkToNothing,
        Self::Pipe,
        Self::LinkToZero,
        Self::LinkToFull,
        Self::Folder,
    ];

    /// Whether it is somebody's, or leads to what is.
    pub fn is_foreign(self) -> bool {
        !matches!(self, Self::Own | Self::Nothing)
    }

    /// Puts it at a path below a place.
    pub fn put(self, place: &Place, name: &str) {
        let path = place.path(name);
        if self == Self::Own {
            return;
        }
        clear(&path);
        let victim = place.path("victim");
        let link = |to: &Path| symlink(to, &path).expect("a link");
        match self {
            Self::Own | Self::Nothing => {}
            Self::Foreign => std::fs::write(&path, "a thesis\n").expect("written"),
            Self::Alike => std::fs::write(&path, alike(name)).expect("written"),
            Self::HardLink => {
                std::fs::hard_link(victim.join("thesis.txt"), &path).expect("a link");
            }
            Self::LinkToFile => link(&victim.join("thesis.txt")),
            Self::LinkToOwn => {
                let (_, inner) = name.split_once('/').unwrap_or_default();
                link(&victim.join("own").join(inner));
            }
            Self::LinkToFolder => link(&victim),
            Self::LinkToNothing => link(&victim.join("new")),
            Self::Pipe => {
                let made = Command::new("mkfifo").arg(&path).status();
                assert!(made.expect("mkfifo runs").success());
            }
            Self::LinkToZero => link(Path::new("/dev/zero")),
            Self::LinkToFull => link(Path::new("/dev/full")),
            Self::Folder => {
                std::fs::create_dir(&path).expect("a folder");
                std::fs::write(path.join("thesis.txt"), "a thesis\n").expect("written");
            }
        }
    }
}

/// A valid file of another program.
fn alike(name: &str) -> &'static [u8] {
    match name.rsplit_once('.').map(|(_, extension)| extension) {
        Some("json") => b"{\"title\":\"My thesis\",\"version\":\"1\",\"cells\":[]}\n",
        Some("svg") => b"<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"900\" height=\"980\"/>\n",
        Some("html") => b"<!DOCTYPE html>\n<html><title>My report</title></html>\n",
        Some("csv") => b"k,u,y\r\n0,1,2\r\n",
        Some("md") => b"# Verdicts\n\nOf my court.\n",
        Some("parquet") => b"PAR1 a table of somebody \x08\0\0\0PAR1",
        Some("block") => b"blocks of wood, and long enough to have a head and a checksum by their length",
        Some("toml") => b"[package]\nname = \"thesis\"\n",
        _ => b"a thesis\n",
    }
}

fn clear(path: &Path) {
    match std::fs::symlink_metadata(path) {
        Ok(metadata) if metadata.is_dir() => std::fs::remove_dir_all(path),
        Ok(_) => std::fs::remove_file(path),
        Err(_) => Ok(()),
    }
    .expect("removed");
}
