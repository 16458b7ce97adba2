//! What a path that is opened may be, told by its name alone.

use std::path::Path;

/// A kind of file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileKind {
    /// A scene, `.toml`.
    Scene,
    /// A recording, `.rrd`.
    Recording,
    /// Anything else; an episode's directory, if it can be opened.
    Other,
}

impl FileKind {
    /// The kind that the name of `path` tells, in upper or lower case.
    pub fn of(path: &Path) -> Self {
        let is = |extension: &str| path.extension().is_some_and(|other| other.eq_ignore_ascii_case(extension));
        if is("toml") {
            Self::Scene
        } else if is("rrd") {
            Self::Recording
        } else {
            Self::Other
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_tells_the_kind() {
        let kinds =
            ["a/b.toml", "B.TOML", "x.rrd", "out/e.rrd.old", "toml", "out/demo"].map(Path::new).map(FileKind::of);
        let other = FileKind::Other;
        assert_eq!(kinds, [FileKind::Scene, FileKind::Scene, FileKind::Recording, other, other, other]);
    }
}
