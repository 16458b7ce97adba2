//! What a person says about an episode: notes on its steps, and verdicts on its objects. `notes.json` in the episode's
//! directory keeps them.

pub use crate::verdicts::{Judged, VERDICTS, object_name, verdict_title};

use nudge_core::files::write_atomically;
use nudge_core::score::{ObjectVerdict, Verdict};
use nudge_core::{Error, Result};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// File of the annotations in an episode's directory.
pub const FILE: &str = "notes.json";
const FORMAT: u32 = 1;

/// Notes and verdicts of an episode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Annotations {
    format: u32,
    /// Note on the state after a number of actions.
    #[serde(default)]
    pub notes: BTreeMap<usize, String>,
    /// Verdicts that differ from the scorer's: step, then the object's name as the scorer writes it.
    #[serde(default)]
    pub verdicts: BTreeMap<usize, BTreeMap<String, Verdict>>,
}

impl Default for Annotations {
    fn default() -> Self {
        Self { format: FORMAT, notes: BTreeMap::new(), verdicts: BTreeMap::new() }
    }
}

impl Annotations {
    /// Reads an episode's annotations; none if there is no file.
    ///
    /// # Errors
    /// For a file that is no `notes.json` of this format.
    pub fn read(directory: &Path) -> Result<Self> {
        let path = directory.join(FILE);
        let text = match std::fs::read_to_string(&path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Self::default()),
            text => text.map_err(|error| Error::io(&path, error))?,
        };
        let annotations: Self = serde_json::from_str(&text)
            .map_err(|error| Error::input(&path, format!("line {}", error.line()), error.to_string()))?;
        if annotations.format != FORMAT {
            let message = format!("format {} is not known; this version reads format {FORMAT}", annotations.format);
            return Err(Error::input(&path, "format", message));
        }
        Ok(annotations)
    }

    /// Writes them into an episode's directory, whole or not at all.
    pub fn write(&self, directory: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self).expect("annotations are plain data") + "\n";
        write_atomically(&directory.join(FILE), text.as_bytes())
    }
}

impl Annotations {
    /// The scorer's verdicts after a step with what a person made of them.
    pub fn judge(&self, step: usize, proposed: &[ObjectVerdict]) -> Vec<Judged> {
        let mut judged = Judged::by_scorer(proposed);
        if let Some(overruled) = self.verdicts.get(&step) {
            judged.iter_mut().for_each(|judged| judged.overruled = overruled.get(&judged.name).copied());
        }
        judged
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn annotations_come_back_and_a_broken_file_is_named() {
        let folder = tempfile::tempdir().expect("folder");
        assert_eq!(Annotations::read(folder.path()).expect("none"), Annotations::default());
        let mut annotations = Annotations::default();
        annotations.notes.insert(3, "the can behind the box shows".to_owned());
        annotations.verdicts.entry(3).or_default().insert("tomato_can#2".to_owned(), Verdict::Found);
        annotations.write(folder.path()).expect("written");
        assert_eq!(Annotations::read(folder.path()).expect("read"), annotations);
        std::fs::write(folder.path().join(FILE), "{ \"format\": 9 }").expect("written");
        assert!(Annotations::read(folder.path()).expect_err("format").to_string().contains("notes.json"));
    }
}
