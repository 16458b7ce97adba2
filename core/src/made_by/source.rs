//! The method's source as one hash: `build.rs` puts it into the library, so that numbers can say which code made them.
//!
//! What counts is what can change a number: the lines of the crate's source but for comments, blank lines and tests, and the
//! files that it embeds (`include_str!`). A commit that only rewords documentation leaves the hash as it was.

use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::io;
use std::path::{Component, Path, PathBuf};

/// The files that count, by their path from the crate's folder, with what counts of each.
pub struct Source(BTreeMap<String, String>);

impl Source {
    /// Reads the source of the crate in `folder`.
    ///
    /// # Errors
    /// For a file that cannot be read or is not UTF-8.
    pub fn read(folder: &Path) -> io::Result<Self> {
        let mut files = BTreeMap::new();
        let mut folders = vec![PathBuf::from("src")];
        while let Some(at) = folders.pop() {
            for entry in std::fs::read_dir(folder.join(&at))? {
                let entry = entry?;
                let path = at.join(entry.file_name());
                if entry.file_type()?.is_dir() {
                    folders.push(path);
                } else if path.extension().is_some_and(|extension| extension == "rs") && !is_test(&path) {
                    let text = counted(&std::fs::read_to_string(folder.join(&path))?);
                    for name in embedded(&text) {
                        let path = plain(&at.join(name));
                        files.insert(slashed(&path), std::fs::read_to_string(folder.join(&path))?);
                    }
                    files.insert(slashed(&path), text);
                }
            }
        }
        Ok(Self(files))
    }

    /// The files that count, from the crate's folder.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }

    /// SHA-256 of everything that counts, with words that stand for other code (`rapier3d 0.36.1`), in hexadecimal digits.
    pub fn hash(&self, others: &[String]) -> String {
        let mut hash = Sha256::new();
        let texts = self.0.iter().flat_map(|(path, text)| [path, text]);
        for text in texts.chain(others) {
            hash.update((text.len() as u64).to_le_bytes());
            hash.update(text);
        }
        hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

/// The versions that a `Cargo.lock` names of some crates: `rapier3d 0.36.1`.
pub fn locked(lock: &str, names: &[&str]) -> Vec<String> {
    let of = |package: &str, key: &str| {
        let value = package.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(" = \"")?.strip_suffix('"'));
        value.map(str::to_owned)
    };
    let packages =
        lock.split("[[package]]").filter_map(|package| Some((of(package, "name")?, of(package, "version")?)));
    packages.filter(|(name, _)| names.contains(&&**name)).map(|(name, version)| format!("{name} {version}")).collect()
}

/// Whether a file holds tests alone.
fn is_test(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name == "tests.rs" || name.ends_with("_tests.rs") || path.iter().any(|part| part == "tests")
}

/// The lines that count: no comments, no blank lines, and no module of tests, which ends with the next `}` at a line's
/// beginning.
fn counted(text: &str) -> String {
    let mut kept = String::new();
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        let bare = line.trim();
        if line == "#[cfg(test)]" && lines.peek() == Some(&"mod tests {") {
            lines.by_ref().take_while(|line| *line != "}").for_each(drop);
        } else if !bare.is_empty() && !bare.starts_with("//") {
            kept += line.trim_end();
            kept.push('\n');
        }
    }
    kept
}

/// The files that a source embeds, from its own folder.
fn embedded(text: &str) -> Vec<&str> {
    let of = |opening: &str| text.split(opening).skip(1).filter_map(|rest| rest.split('"').next()).collect::<Vec<_>>();
    [of("include_str!(\""), of("include_bytes!(\"")].concat()
}

/// A path without `..` after a folder.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        if part == Component::ParentDir
            && plain.components().next_back().is_some_and(|last| last != Component::ParentDir)
        {
            plain.pop();
        } else {
            plain.push(part);
        }
    }
    plain
}

/// A path that reads the same on every system.
fn slashed(path: &Path) -> String {
    path.iter().map(|part| part.to_string_lossy()).collect::<Vec<_>>().join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    const CODE: &str = "//! Says yes.\n\n/// Yes.\nfn yes() -> bool {\n    true // always\n}\n\n\
                        #[cfg(test)]\nmod tests {\n    #[test]\n    fn it_is() {\n        assert!(super::yes());\n    }\n}\n";

    #[test]
    fn comments_blank_lines_and_tests_do_not_count() {
        assert_eq!(counted(CODE), "fn yes() -> bool {\n    true // always\n}\n");
        let reworded = CODE.replace("Says yes", "Agrees").replace("/// Yes.\n", "/// It does.\n/// Always.\n");
        assert_eq!(counted(&reworded.replace("fn it_is", "fn it_really_is")), counted(CODE));
        assert_ne!(counted(&CODE.replace("true", "false")), counted(CODE));
        // What stands behind the tests counts again; carriage returns do not.
        let more = format!("{CODE}\nfn no() -> bool {{\n    false\n}}\n");
        assert!(counted(&more).ends_with("}\nfn no() -> bool {\n    false\n}\n"));
        assert_eq!(counted(&more.replace('\n', "\r\n")), counted(&more));
    }

    #[test]
    fn the_hash_follows_code_and_embedded_files_and_nothing_else() {
        let folder = tempfile::tempdir().expect("a temporary directory");
        let crate_folder = folder.path().join("core");
        std::fs::create_dir_all(crate_folder.join("src/room/tests")).expect("folders");
        std::fs::create_dir(folder.path().join("assets")).expect("folder");
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
        write("assets/a.toml", "size = 1\n");
        write("core/src/lib.rs", CODE);
        let room = "const A: &str = include_str!(\"../../../assets/a.toml\");\n";
        write("core/src/room/mod.rs", room);
        write("core/src/room/tests.rs", "fn one() {}\n");
        write("core/src/room/tests/two.rs", "fn two() {}\n");
        let read = || Source::read(&crate_folder).expect("read");
        let files: Vec<String> = read().files().map(str::to_owned).collect();
        assert_eq!(files, ["../assets/a.toml", "src/lib.rs", "src/room/mod.rs"]);
        let hash = || read().hash(&[]);
        let first = hash();
        assert_eq!(first.len(), 64);
        write("core/src/room/tests.rs", "fn other() {}\n");
        write("core/src/room/mod.rs", &format!("// What it is.\n{room}"));
        assert_eq!(hash(), first);
        write("assets/a.toml", "size = 2\n");
        let resized = hash();
        assert_ne!(resized, first);
        write("core/src/lib.rs", &CODE.replace("true", "false"));
        assert_ne!(hash(), resized);
        assert_ne!(read().hash(&["rapier3d 1".to_owned()]), hash());
    }

    #[test]
    fn the_versions_of_crates_are_read_from_the_lock_file() {
        let lock = "version = 4\n\n[[package]]\nname = \"rand\"\nversion = \"0.9.2\"\ndependencies = [\n \"rand_core\",\n]\n\n\
                    [[package]]\nname = \"rand_core\"\nversion = \"0.9.3\"\n\n[[package]]\nname = \"tch\"\nversion = \"0.26.0\"\n";
        assert_eq!(locked(lock, &["tch", "rand"]), ["rand 0.9.2", "tch 0.26.0"]);
        assert!(locked("", &["tch"]).is_empty());
    }
}
