//! What a card shows of a scene, an episode or a recording.

use crate::driver::SUMMARY;
use crate::picture::{self, RgbImage, View};
use crate::workbench::file_kind::FileKind;
use nudge_core::camera::{ViewArray, hidden_objects};
use nudge_core::episode::{EpisodeDir, EpisodeRecord};
use nudge_core::scene::{Catalog, Scene};
use nudge_core::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Width of a thumbnail, pixels.
pub const THUMBNAIL_PX: u32 = 320;

/// What a card shows.
#[derive(Clone, Debug)]
pub struct Facts {
    /// What is written on it.
    pub text: Text,
    /// The scene from the front, or the figure of an episode of whose scene nothing is known; nothing of a recording.
    pub picture: Option<RgbImage>,
}

/// What is written on a card.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Text {
    /// Its name.
    pub name: String,
    /// The one line on what makes it what it is.
    pub description: String,
    /// What is known of it.
    pub about: About,
}

/// What is known of a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum About {
    /// Of a scene.
    Scene {
        /// Number of objects.
        objects: usize,
        /// Objects that no view shows, once they are counted.
        hidden: Option<usize>,
    },
    /// Of an episode.
    Episode {
        /// Actions so far.
        done: usize,
        /// Actions at the end.
        budget: usize,
        /// Semantic mIoU after the last action, where the truth is known.
        miou: Option<f64>,
    },
    /// Of a recording.
    Recording {
        /// Size of its file, bytes.
        bytes: u64,
    },
}

impl About {
    /// In words: `20 objects, 10 hidden`.
    pub fn words(&self) -> String {
        match self {
            Self::Scene { objects, hidden } => {
                let noun = if *objects == 1 { "object" } else { "objects" };
                hidden
                    .map_or_else(|| format!("{objects} {noun}"), |hidden| format!("{objects} {noun}, {hidden} hidden"))
            }
            Self::Episode { done, budget, miou } => {
                let actions = format!("{done} of {budget} actions");
                miou.map_or_else(|| actions.clone(), |miou| format!("{actions}, mIoU {miou:.3}"))
            }
            Self::Recording { bytes } => format!("recording, {:.1} MB", *bytes as f64 * 1e-6),
        }
    }
}

/// Looks at a file.
///
/// # Errors
/// What is wrong with it.
pub fn look_at(path: &Path, catalog: &Catalog) -> Result<Facts> {
    match FileKind::of(path) {
        FileKind::Scene => scene(path, catalog),
        FileKind::Recording => recording(path),
        FileKind::Other => episode(path, catalog),
    }
}

fn scene(path: &Path, catalog: &Catalog) -> Result<Facts> {
    let (scene, _) = Scene::load(path, catalog)?;
    let picture = picture::thumbnail(&scene, catalog, View::Front, THUMBNAIL_PX)?;
    let Scene { name, description, objects, .. } = scene;
    let about = About::Scene { objects: objects.len(), hidden: None };
    Ok(Facts { text: Text { name, description, about }, picture: Some(picture) })
}

fn episode(path: &Path, catalog: &Catalog) -> Result<Facts> {
    let record = EpisodeDir::open(path)?.record()?;
    let EpisodeRecord { scene, config, steps, .. } = &record;
    let figure =
        || image::open(path.join(SUMMARY)).ok().map(|figure| figure.thumbnail(THUMBNAIL_PX, THUMBNAIL_PX).to_rgb8());
    let picture = if scene.objects.is_empty() {
        figure()
    } else {
        picture::thumbnail(scene, catalog, View::Front, THUMBNAIL_PX).ok()
    };
    let miou = steps.last().and_then(|step| step.scores()).map(|scores| scores.semantic_miou);
    let about = About::Episode { done: steps.len(), budget: config.budget, miou };
    let description = format!("{}, seed {}, in {}", config.policy, config.seed, path.display());
    Ok(Facts { text: Text { name: scene.name.clone(), description, about }, picture })
}

fn recording(path: &Path) -> Result<Facts> {
    let bytes = path.metadata().map_err(|error| Error::io(path, error))?.len();
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let text = Text { name, description: path.display().to_string(), about: About::Recording { bytes } };
    Ok(Facts { text, picture: None })
}

/// How many objects of a scene no view shows.
pub fn hidden(path: &Path, catalog: &Catalog, views: &ViewArray) -> Option<usize> {
    let (scene, _) = Scene::load(path, catalog).ok()?;
    Some(hidden_objects(&scene.shelf, &scene.bodies(catalog).ok()?, views).len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_card_says_what_there_is_in_a_few_words() {
        let scene = |objects, hidden| About::Scene { objects, hidden }.words();
        assert_eq!((scene(1, None), scene(20, Some(10))), ("1 object".to_owned(), "20 objects, 10 hidden".to_owned()));
        let episode = |miou| About::Episode { done: 3, budget: 20, miou }.words();
        assert_eq!(episode(Some(0.71)), "3 of 20 actions, mIoU 0.710");
        assert_eq!(episode(None), "3 of 20 actions");
        assert_eq!(About::Recording { bytes: 2_340_000 }.words(), "recording, 2.3 MB");
    }
}
