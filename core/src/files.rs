//! Atomic file writing: a file is there whole or not at all.
//!
//! A file is written beside its place under a name that starts with [`TEMPORARY`] and then renamed over it. A process
//! that is killed leaves at most one such leftover, which the next writer removes.

use crate::{Error, Result};
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

/// How the names of half-written files start.
pub const TEMPORARY: &str = ".partial-";

/// Writes `bytes` to `path`, whole or not at all. A link is followed, and what is no file but takes bytes (a pipe, a
/// terminal, `/dev/null`) is written to: neither is ever replaced.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    let target = match place_of(path)? {
        Place::File(target) => target,
        Place::Stream => {
            let stream = fs::OpenOptions::new().write(true).open(path);
            return stream.and_then(|mut stream| stream.write_all(bytes)).map_err(|source| Error::io(path, source));
        }
    };
    let temporary = temporary_of(&target);
    let written = write_and_rename(&temporary, &target, bytes);
    if written.is_err() && !cut::is_cut() {
        let _ = fs::remove_file(&temporary);
    }
    written.map_err(|source| Error::io(path, source))
}

/// Where a file that is to be at `path` really goes: the end of a chain of links, else `path` itself. For whoever writes
/// beside it and renames.
///
/// # Errors
/// Something is there that is no file and that a rename would replace.
pub fn target_of(path: &Path) -> Result<PathBuf> {
    match place_of(path)? {
        Place::File(target) => Ok(target),
        Place::Stream => Err(Error::input(path, "", "is a pipe or a device; a file is needed")),
    }
}

/// What a path leads to.
enum Place {
    /// A file, or nothing yet: the path without links.
    File(PathBuf),
    /// Something that takes bytes one after the other.
    Stream,
}

fn place_of(path: &Path) -> Result<Place> {
    /// More links than this in a row are a circle.
    const MAX_LINKS: usize = 40;
    match fs::metadata(path) {
        Ok(found) if found.is_file() => fs::canonicalize(path).map(Place::File).map_err(|error| Error::io(path, error)),
        // What the system says of a folder is said when it is written.
        Ok(found) if found.is_dir() => Ok(Place::File(path.to_owned())),
        Ok(found) if takes_bytes(found.file_type()) => Ok(Place::Stream),
        Ok(_) => Err(Error::input(path, "", "is a disk or a socket; a file is needed")),
        // Nothing yet; perhaps a link to what is to be.
        Err(_) => {
            let mut target = path.to_owned();
            for _ in 0..MAX_LINKS {
                let Ok(next) = fs::read_link(&target) else { return Ok(Place::File(target)) };
                target = target.parent().unwrap_or(Path::new("")).join(next);
            }
            Err(Error::input(path, "", "is a circle of links"))
        }
    }
}

#[cfg(unix)]
fn takes_bytes(kind: fs::FileType) -> bool {
    use std::os::unix::fs::FileTypeExt;
    kind.is_fifo() || kind.is_char_device()
}

#[cfg(not(unix))]
fn takes_bytes(_: fs::FileType) -> bool {
    false
}

fn write_and_rename(temporary: &Path, path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    cut::point()?;
    let mut file = fs::File::create(temporary)?;
    cut::point()?;
    let (first, second) = bytes.split_at(bytes.len() / 2);
    file.write_all(first)?;
    cut::point()?;
    file.write_all(second)?;
    drop(file);
    cut::point()?;
    fs::rename(temporary, path)?;
    cut::point()
}

/// What the file or folder that is to stand at `path` is called until it is whole.
pub fn temporary_of(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{TEMPORARY}{name}"))
}

/// Removes a file; that it is not there is fine.
pub fn remove_if_there(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(Error::io(path, error)),
        _ => Ok(()),
    }
}

/// Names of what is in a directory; nothing for one that is not there.
pub fn names_in(path: &Path) -> Result<Vec<String>> {
    match fs::read_dir(path) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Vec::new()),
        Err(error) => Err(Error::io(path, error)),
        Ok(entries) => {
            let mut names = Vec::new();
            for entry in entries {
                names.push(entry.map_err(|error| Error::io(path, error))?.file_name().to_string_lossy().into_owned());
            }
            names.sort();
            Ok(names)
        }
    }
}

/// Bytes of a file with a header: one line of JSON, and behind it `content`, compressed (Zstandard) at a level.
pub(crate) fn with_head(head: &impl Serialize, content: &[u8], level: i32) -> Vec<u8> {
    let mut bytes = serde_json::to_vec(head).expect("a header goes into memory");
    bytes.push(b'\n');
    bytes.extend(zstd::bulk::compress(content, level).expect("content is compressed in memory"));
    bytes
}

/// The header and the compressed content of such a file; `None` for bytes without a first line.
pub(crate) fn split_head(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let end = bytes.iter().position(|byte| *byte == b'\n')?;
    Some((&bytes[..end], &bytes[end + 1..]))
}

/// SHA-256 of bytes, in hexadecimal digits.
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// SHA-256 of a file, in hexadecimal digits: what `sha256sum` prints.
///
/// # Errors
/// When the file cannot be read.
pub fn sha256_of_file(path: &Path) -> Result<String> {
    Ok(sha256(&fs::read(path).map_err(|error| Error::io(path, error))?))
}

/// Stops writing at a chosen point, as a kill would, so that tests can look at what is left.
#[cfg(test)]
pub mod cut {
    use std::cell::Cell;

    thread_local! {
        static LEFT: Cell<Option<usize>> = const { Cell::new(None) };
    }

    /// Lets this thread pass `points` points and stops it at the next.
    pub fn after(points: usize) {
        LEFT.set(Some(points));
    }

    /// Lets this thread write again.
    pub fn never() {
        LEFT.set(None);
    }

    pub(super) fn point() -> std::io::Result<()> {
        match LEFT.get() {
            None => Ok(()),
            Some(0) => Err(std::io::Error::other("cut")),
            Some(left) => {
                LEFT.set(Some(left - 1));
                Ok(())
            }
        }
    }

    pub(super) fn is_cut() -> bool {
        LEFT.get() == Some(0)
    }
}

#[cfg(not(test))]
mod cut {
    pub(super) fn point() -> std::io::Result<()> {
        Ok(())
    }

    pub(super) fn is_cut() -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_old_or_new_at_every_cut_and_never_half() {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let path = directory.path().join("file");
        write_atomically(&path, b"old").expect("written");
        for points in 0..5 {
            cut::after(points);
            assert!(write_atomically(&path, b"new").is_err());
            cut::never();
            let content = fs::read(&path).expect("read");
            assert_eq!(content, if points < 4 { b"old" } else { b"new" }, "cut after {points}");
        }
        write_atomically(&path, b"new").expect("written");
        assert_eq!(names_in(directory.path()).expect("listed"), ["file"]);
    }

    #[cfg(unix)]
    #[test]
    fn an_output_that_is_a_link_a_pipe_or_a_device_is_not_replaced_by_a_file() {
        use std::os::unix::fs::{FileTypeExt, symlink};
        let directory = tempfile::tempdir().expect("a temporary directory");
        let at = |name: &str| directory.path().join(name);
        let is_link = |name: &str| fs::symlink_metadata(at(name)).expect("there").is_symlink();
        // A link to a file elsewhere, one to what is not there yet, and a chain of relative ones.
        fs::create_dir(at("elsewhere")).expect("created");
        fs::write(at("elsewhere/real"), "old").expect("written");
        symlink(at("elsewhere/real"), at("link")).expect("linked");
        symlink("elsewhere/new", at("dangling")).expect("linked");
        symlink("dangling", at("chain")).expect("linked");
        write_atomically(&at("link"), b"new").expect("written");
        write_atomically(&at("chain"), b"fresh").expect("written");
        assert_eq!(fs::read(at("elsewhere/real")).expect("read"), b"new");
        assert_eq!(fs::read(at("elsewhere/new")).expect("read"), b"fresh");
        assert!(is_link("link") && is_link("dangling") && is_link("chain"));
        symlink("circle", at("circle")).expect("linked");
        assert!(write_atomically(&at("circle"), b"new").is_err() && is_link("circle"));

        let made = std::process::Command::new("mkfifo").arg(at("pipe")).status().expect("mkfifo");
        assert!(made.success());
        let path = at("pipe");
        let reader = std::thread::spawn(move || fs::read(path).expect("read"));
        write_atomically(&at("pipe"), b"through").expect("written");
        assert_eq!(reader.join().expect("no panic"), b"through");
        assert!(fs::symlink_metadata(at("pipe")).expect("there").file_type().is_fifo());
        assert!(target_of(&at("pipe")).is_err_and(|error| error.to_string().contains("is a pipe or a device")));

        write_atomically(Path::new("/dev/null"), b"nothing").expect("written");
        if Path::new("/dev/full").exists() {
            assert!(write_atomically(Path::new("/dev/full"), b"something").is_err());
        }
        assert!(fs::symlink_metadata("/dev/null").expect("there").file_type().is_char_device());
    }

    #[test]
    fn hashes_are_those_of_the_standard() {
        // FIPS 180-4, the examples of one block and of none.
        assert_eq!(sha256(b"abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
        assert_eq!(sha256(b""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
        let directory = tempfile::tempdir().expect("a temporary directory");
        let path = directory.path().join("file");
        fs::write(&path, b"abc").expect("written");
        assert_eq!(sha256_of_file(&path).expect("read"), sha256(b"abc"));
        assert!(sha256_of_file(&directory.path().join("none")).is_err());
    }

    #[test]
    fn a_failed_write_names_the_file_and_leaves_nothing() {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let path = directory.path().join("nowhere").join("file");
        let error = write_atomically(&path, b"new").expect_err("no directory");
        assert!(error.to_string().starts_with(&path.display().to_string()), "{error}");
        assert_eq!(error.exit_code(), 2);
    }
}
