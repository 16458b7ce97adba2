//! Files of frames: what an environment gave from a view, to the bit.
//!
//! The first line is JSON: the camera, its pose, what stands behind it. The rest is compressed (Zstandard): the depth
//! (`depth_code`), the label of every pixel or the scores, and, of a simulated shelf, the object of every pixel.
//!
//! Noise is not in the file. It is drawn again from the episode's seed, which says the same in no bytes: the noise of a depth
//! camera alone would be half a megabyte a frame.

use super::{Frame, Pinhole, PixelClasses, Sensed, depth_code, pose_from_quaternion};
use crate::files::{split_head, with_head};
use crate::scene::CLASS_COUNT;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The format number of the files.
const FORMAT: u32 = 1;
/// How hard the compressor tries; what is gained beyond it is not worth the time.
const LEVEL: i32 = 9;
/// The same for frames of real cameras, whose noise no effort makes smaller.
const NOISY_LEVEL: i32 = 1;

/// The first line.
#[derive(Serialize, Deserialize)]
struct Head {
    format: u32,
    intrinsics: Pinhole,
    /// Where the camera was thought to be: position, and rotation as a quaternion x, y, z, w.
    position: [f32; 3],
    quaternion: [f32; 4],
    classes: ClassesKind,
    /// Whether the objects of the pixels are in the file.
    objects: bool,
    /// Number of pixels with a depth.
    readings: usize,
}

#[derive(Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum ClassesKind {
    Labels,
    Scores,
}

impl Sensed {
    /// The file's bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let frame = &self.frame;
        let (pose, q) = (frame.world_from_camera(), frame.world_from_camera().rotation);
        let head = Head {
            format: FORMAT,
            intrinsics: *frame.intrinsics(),
            position: pose.translation.vector.into(),
            quaternion: [q.i, q.j, q.k, q.w],
            classes: match frame.classes() {
                PixelClasses::Labels(_) => ClassesKind::Labels,
                PixelClasses::Scores(_) => ClassesKind::Scores,
            },
            objects: self.objects.is_some(),
            readings: frame.readings(),
        };
        let mut content = depth_code::encode(frame.depth_m(), frame.size()[0]);
        match frame.classes() {
            PixelClasses::Labels(labels) => content.extend(labels),
            PixelClasses::Scores(scores) => content.extend(scores.iter().flat_map(|score| score.to_le_bytes())),
        }
        content.extend(self.objects.iter().flatten().flat_map(|object| object.to_le_bytes()));
        with_head(&head, &content, if self.objects.is_some() { LEVEL } else { NOISY_LEVEL })
    }

    /// Reads a file's bytes; `file` is what errors name.
    ///
    /// # Errors
    /// [`Error::Input`] for bytes that are no whole frame, and for one that cannot be ([`Frame::new`]; one in which nothing
    /// was seen is allowed here, a simulated camera may look away).
    pub fn from_bytes(bytes: &[u8], file: &Path) -> Result<Self> {
        let fail = |place: &str, words: String| Error::input(file, place, words);
        let (head, content) = split_head(bytes).ok_or_else(|| fail("", "is no frame".to_owned()))?;
        let head: Head = serde_json::from_slice(head).map_err(|error| {
            let words = error.to_string();
            fail("line 1", words.split(" at line ").next().unwrap_or("is no frame's").to_owned())
        })?;
        if head.format != FORMAT {
            return Err(fail("format", format!("is {}, this version reads {FORMAT}", head.format)));
        }
        head.intrinsics.check().map_err(|(field, words)| fail(field, words))?;
        let world_from_camera =
            pose_from_quaternion(head.position, head.quaternion).map_err(|words| fail("quaternion", words))?;
        let (width, height) = (head.intrinsics.width, head.intrinsics.height);
        let pixels = width * height;
        let of_classes = match head.classes {
            ClassesKind::Labels => pixels,
            ClassesKind::Scores => 4 * CLASS_COUNT * pixels,
        };
        let of_objects = if head.objects { 2 * pixels } else { 0 };
        let largest = pixels.div_ceil(8) + 4 * pixels + of_classes + of_objects;
        let content = zstd::bulk::decompress(content, largest)
            .map_err(|error| fail("", format!("is cut short or damaged ({error})")))?;
        let (depth_m, used) = depth_code::decode(&content, width, height)
            .ok_or_else(|| fail("depth_m", "is cut short or damaged".to_owned()))?;
        if content.len() != used + of_classes + of_objects {
            return Err(fail("", format!("has {} bytes where its first line says another number", content.len())));
        }
        let (classes, objects) = content[used..].split_at(of_classes);
        let classes = match head.classes {
            ClassesKind::Labels => PixelClasses::Labels(classes.to_vec()),
            ClassesKind::Scores => {
                PixelClasses::Scores(classes.as_chunks().0.iter().map(|score| f32::from_le_bytes(*score)).collect())
            }
        };
        let frame = Frame { world_from_camera, intrinsics: head.intrinsics, depth_m, classes };
        frame.check(file)?;
        if frame.readings() != head.readings {
            let words = format!("{} pixels have a depth, the first line says {}", frame.readings(), head.readings);
            return Err(fail("depth_m", words));
        }
        let objects =
            head.objects.then(|| objects.as_chunks().0.iter().map(|object| u16::from_le_bytes(*object)).collect());
        Ok(Self { frame, objects })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{NoiseModel, UNLABELLED, View, ViewArray, render};
    use crate::scene::{Catalog, Scene};

    fn taken(view: usize) -> Sensed {
        let catalog = Catalog::standard();
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/demo/behind-the-boxes.toml");
        let (scene, _) = Scene::load(&path, &catalog).expect("shipped");
        let array = ViewArray::named("standard300").expect("shipped");
        let bodies = scene.bodies(&catalog).expect("bodies");
        let shoot = |view: &View| Ok(render(&scene.shelf, &bodies, view, &array.intrinsics));
        NoiseModel::STANDARD.aim(&array.views[view], 1, 1, shoot).expect("a frame")
    }

    #[test]
    fn a_filed_frame_is_the_frame_to_the_bit_in_less_than_150_kb() {
        for view in [0, 145, 290] {
            let sensed = taken(view);
            let bytes = sensed.to_bytes();
            let back = Sensed::from_bytes(&bytes, Path::new("001.frame")).expect("reads");
            let bits = |frame: &Frame| frame.depth_m().iter().map(|depth| depth.to_bits()).collect::<Vec<_>>();
            assert!(back == sensed && bits(&back.frame) == bits(&sensed.frame));
            let noisy = |sensed: &Sensed| NoiseModel::STANDARD.apply(sensed, 4, 9);
            assert!(noisy(&back) == noisy(&sensed));
            assert!(bytes.len() <= 150_000, "{} bytes", bytes.len());
        }
    }

    #[test]
    fn scores_and_frames_without_objects_are_filed_too() {
        let mut sensed = taken(3);
        let pixels = sensed.frame.depth_m().len();
        sensed.objects = None;
        sensed.frame.classes = PixelClasses::Scores((0..pixels * CLASS_COUNT).map(|at| at as f32 * 0.25).collect());
        let back = Sensed::from_bytes(&sensed.to_bytes(), Path::new("x")).expect("reads");
        assert!(back == sensed);
        sensed.frame.classes = PixelClasses::Labels(vec![UNLABELLED; pixels]);
        sensed.frame.depth_m.fill(0.0);
        let blind = Sensed::from_bytes(&sensed.to_bytes(), Path::new("x")).expect("a camera that looked away");
        assert!(blind == sensed);
    }

    #[test]
    fn a_file_that_is_no_frame_is_told_with_its_field() {
        let good = taken(145).to_bytes();
        let end = good.iter().position(|byte| *byte == b'\n').expect("a line");
        let with = |change: &dyn Fn(&mut serde_json::Value)| {
            let mut head = serde_json::from_slice(&good[..end]).expect("JSON");
            change(&mut head);
            [head.to_string().as_bytes(), &good[end..]].concat()
        };
        let cases = [
            (good[..good.len() / 2].to_vec(), "001.frame: is cut short or damaged"),
            (good[..5].to_vec(), "001.frame: is no frame"),
            (with(&|head| head["format"] = 7.into()), "001.frame: format: is 7"),
            (with(&|head| head["intrinsics"]["width"] = 320.into()), "001.frame: "),
            (with(&|head| head["intrinsics"]["focal_px"][0] = (-4.5).into()), "001.frame: focal_px: is [-4.5"),
            (with(&|head| head["quaternion"][0] = 9.0.into()), "001.frame: quaternion: the quaternion [9.0"),
            (with(&|head| head["readings"] = 9.into()), "001.frame: depth_m: "),
            (with(&|head| head["classes"] = "colours".into()), "001.frame: line 1: unknown variant `colours`"),
        ];
        for (bytes, expected) in cases {
            let error = Sensed::from_bytes(&bytes, Path::new("001.frame")).expect_err(expected);
            assert!(error.to_string().starts_with(expected) && error.exit_code() == 2, "{error}");
        }
    }
}
