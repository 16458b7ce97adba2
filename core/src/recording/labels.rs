//! What the numbers of somebody else's label images mean.
//!
//! ```toml
//! format = 1
//!
//! [classes]                  # number in the images = class of the catalogue
//! 0 = "background"
//! 2 = "cracker_box"
//! ```

use crate::camera::UNLABELLED;
use crate::scene::{BACKGROUND, CLASS_COUNT, Catalog};
use crate::{Error, Result};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

/// What numbers mean. A number that is not in the map has no label.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelMap {
    class_of: BTreeMap<u16, u8>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawMap {
    format: u32,
    classes: BTreeMap<String, String>,
}

impl LabelMap {
    /// Reads a map.
    ///
    /// # Errors
    /// Broken TOML, another format, keys that are no numbers from 0 to 65535, classes that the catalogue does not have.
    pub fn read(path: &Path, catalog: &Catalog) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|error| Error::io(path, error))?;
        Self::parse(path, &text, catalog)
    }

    fn parse(path: &Path, text: &str, catalog: &Catalog) -> Result<Self> {
        let raw: RawMap = toml::from_str(text).map_err(|error| toml_error(path, text, &error))?;
        if raw.format != 1 {
            return Err(Error::input(path, "format", format!("is {}, this version reads format 1", raw.format)));
        }
        let mut class_of = BTreeMap::new();
        for (number, name) in &raw.classes {
            let place = || format!("classes.{number}");
            let key = number.parse().map_err(|_| Error::input(path, place(), "is no number from 0 to 65535"))?;
            let class = match catalog.by_name(name) {
                Some(_) => catalog.classes.iter().position(|class| class.name == *name).unwrap_or_default() as u8,
                None if *name == catalog.background.name => BACKGROUND.0,
                None => {
                    let near =
                        catalog.nearest_name(name).map_or(String::new(), |near| format!("; did you mean `{near}`?"));
                    return Err(Error::input(path, place(), format!("unknown class `{name}`{near}")));
                }
            };
            class_of.insert(key, class);
        }
        Ok(Self { class_of })
    }

    /// The class of a number, or [`UNLABELLED`].
    pub fn class(&self, number: u16) -> u8 {
        self.class_of.get(&number).copied().unwrap_or(UNLABELLED)
    }
}

/// The class that a number is by itself, where no map says otherwise.
pub(super) fn own_class(number: u16) -> Option<u8> {
    let label = u8::try_from(number).ok()?;
    (usize::from(label) < CLASS_COUNT || label == UNLABELLED).then_some(label)
}

/// One line with the line of the text.
pub(super) fn toml_error(path: &Path, text: &str, error: &toml::de::Error) -> Error {
    let line = |at: usize| format!("line {}", text[..at.min(text.len())].matches('\n').count() + 1);
    let place = error.span().map(|span| line(span.start)).unwrap_or_default();
    Error::input(path, place, error.message().lines().collect::<Vec<_>>().join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(text: &str) -> Result<LabelMap> {
        LabelMap::parse(Path::new("labels.toml"), text, &Catalog::standard())
    }

    #[test]
    fn numbers_of_another_list_become_classes_and_the_rest_has_no_label() {
        let map = map("format = 1\n[classes]\n0 = \"background\"\n2 = \"cracker_box\"\n40000 = \"milk_carton\"\n")
            .expect("a map");
        assert_eq!([0, 2, 40_000].map(|number| map.class(number)), [14, 5, 13]);
        assert_eq!([1, 255].map(|number| map.class(number)), [UNLABELLED; 2]);
        assert_eq!([0, 14, 15, 255, 256].map(own_class), [Some(0), Some(14), None, Some(255), None]);
    }

    #[test]
    fn a_wrong_map_is_told_by_its_place() {
        let cases = [
            ("format = 2\n[classes]\n", "labels.toml: format: is 2"),
            (
                "format = 1\n[classes]\n1 = \"craker_box\"\n",
                "labels.toml: classes.1: unknown class `craker_box`; did you mean",
            ),
            ("format = 1\n[classes]\none = \"cracker_box\"\n", "labels.toml: classes.one: is no number"),
            ("format = 1\n[classes]\n1 = cracker_box\n", "labels.toml: line 3: "),
            ("format = 1\n[clases]\n", "labels.toml: line 2: unknown field"),
        ];
        for (text, said) in cases {
            let line = map(text).expect_err(text).to_string();
            assert!(line.starts_with(said) && !line.contains('\n'), "{line}");
        }
    }
}
