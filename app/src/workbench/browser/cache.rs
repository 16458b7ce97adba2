//! Cards from one start of the program to the next: text and picture of every file that was looked at, in a folder of the
//! user's. What is lost or damaged there is made again.

use super::look::{Facts, Text};
use crate::picture::RgbImage;
use nudge_core::VERSION;
use nudge_core::files::write_atomically;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Files in the folder from which on it is emptied.
const MOST: usize = 4000;

/// The folder, if there is one.
#[derive(Clone, Debug, Default)]
pub struct Cache(Option<PathBuf>);

impl Cache {
    /// The folder of the user's, `$XDG_CACHE_HOME/nudge/cards` or `~/.cache/nudge/cards`.
    pub fn of_user() -> Self {
        let variable = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
        let folder = variable("XDG_CACHE_HOME").or_else(|| Some(variable("HOME")?.join(".cache")));
        Self(folder.map(|folder| folder.join("nudge/cards")))
    }

    /// A folder.
    #[cfg(test)]
    pub fn of(folder: &Path) -> Self {
        Self(Some(folder.to_owned()))
    }

    /// What was known of a file that was changed last at that time.
    pub fn get(&self, path: &Path, changed: Option<SystemTime>) -> Option<Facts> {
        let stem = self.stem(path, changed)?;
        let text: Text = serde_json::from_slice(&std::fs::read(stem.with_extension("json")).ok()?).ok()?;
        let picture = stem.with_extension("png");
        let picture: Option<RgbImage> =
            if picture.is_file() { Some(image::open(picture).ok()?.to_rgb8()) } else { None };
        Some(Facts { text, picture })
    }

    /// Keeps what is known of a file. Where that cannot be written, it is found out again the next time.
    pub fn put(&self, path: &Path, changed: Option<SystemTime>, facts: &Facts) {
        let Some(stem) = self.stem(path, changed) else { return };
        let Some(folder) = stem.parent() else { return };
        let is_full = std::fs::read_dir(folder).is_ok_and(|files| files.count() >= MOST);
        if (is_full && std::fs::remove_dir_all(folder).is_err()) || std::fs::create_dir_all(folder).is_err() {
            return;
        }
        let mut png = Vec::new();
        let drawn = facts.picture.as_ref().map(|picture| {
            picture.write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png).is_ok()
                && write_atomically(&stem.with_extension("png"), &png).is_ok()
        });
        if let (None | Some(true), Ok(text)) = (drawn, serde_json::to_vec(&facts.text)) {
            let _ = write_atomically(&stem.with_extension("json"), &text);
        }
    }

    /// The name of a file's card, without an ending: of another version of the program or of the file, another one.
    fn stem(&self, path: &Path, changed: Option<SystemTime>) -> Option<PathBuf> {
        let folder = self.0.as_ref()?;
        let mut hasher = DefaultHasher::new();
        (path.canonicalize().ok()?, changed?, VERSION).hash(&mut hasher);
        Some(folder.join(format!("{:016x}", hasher.finish())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workbench::browser::look::About;

    #[test]
    fn a_card_is_there_again_until_the_file_changes_or_the_card_is_damaged() {
        let folder = tempfile::tempdir().expect("folder");
        let (file, cards) = (folder.path().join("a.toml"), folder.path().join("cards"));
        std::fs::write(&file, "").expect("written");
        let cache = Cache::of(&cards);
        let [then, later] = [1, 2].map(|s| Some(SystemTime::UNIX_EPOCH + std::time::Duration::from_secs(s)));
        let about = About::Scene { objects: 3, hidden: Some(1) };
        let text = Text { name: "a".to_owned(), description: "b".to_owned(), about };
        let facts = Facts { text, picture: Some(RgbImage::from_pixel(4, 3, image::Rgb([9, 8, 7]))) };
        assert!(cache.get(&file, then).is_none());
        cache.put(&file, then, &facts);
        let kept = cache.get(&file, then).expect("kept");
        assert_eq!((kept.text, kept.picture), (facts.text.clone(), facts.picture.clone()));
        assert!(cache.get(&file, later).is_none() && Cache::default().get(&file, then).is_none());
        let without = Facts { picture: None, ..facts };
        cache.put(&file, later, &without);
        assert!(cache.get(&file, later).expect("kept").picture.is_none());
        for card in std::fs::read_dir(&cards).expect("cards").flatten() {
            std::fs::write(card.path(), "cut").expect("written");
        }
        assert!(cache.get(&file, then).is_none() && cache.get(&file, later).is_none());
    }
}
