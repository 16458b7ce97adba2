//! What a depth camera and a segmentation network get wrong: a frame becomes another frame, whoever gave it.
//!
//! [`NoiseModel::aim`] is for the pose: the camera is somewhat off where it is thought to be. [`NoiseModel::apply`] is for the
//! pixels. Both draw from streams of the seed and the number of the frame, so that the same frame gets the same noise again.

use super::frame::regions;
use super::{Frame, PixelClasses, Sensed, UNLABELLED, View};
use crate::rng;
use crate::scene::OBJECT_CLASS_COUNT;
use crate::{Error, Pose, Result, Vector};
use nalgebra::{Translation3, UnitQuaternion};
use rand::Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// How an image differs from the truth. [`NoiseModel::OFF`] is the default; [`NoiseModel::STANDARD`] is for robustness
/// checks and training.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NoiseModel {
    /// Depth noise per pixel: Gaussian with `sigma = depth_sigma_m + depth_sigma_per_m * depth^2`, metres.
    pub depth_sigma_m: f32,
    /// How the depth noise grows with the square of the depth, metres per square metre.
    pub depth_sigma_per_m: f32,
    /// Share of pixels with salt and pepper, whose depth is off by much more.
    pub outlier_share: f32,
    /// Standard deviation of salt and pepper, metres.
    pub outlier_sigma_m: f32,
    /// Chance of an object in an image to have the label of another class. A whole segment is wrong at once, as it is
    /// with a segmentation network; objects are never taken for background, nor the shelf for an object.
    pub wrong_label_share: f32,
    /// Standard deviation of the camera's true position around where it is thought to be, per axis, metres.
    pub position_sigma_m: f32,
    /// Standard deviation of the camera's true orientation, per axis, degrees.
    pub rotation_sigma_deg: f32,
}

impl Default for NoiseModel {
    fn default() -> Self {
        Self::OFF
    }
}

impl NoiseModel {
    /// No noise.
    pub const OFF: Self = Self {
        depth_sigma_m: 0.0,
        depth_sigma_per_m: 0.0,
        outlier_share: 0.0,
        outlier_sigma_m: 0.0,
        wrong_label_share: 0.0,
        position_sigma_m: 0.0,
        rotation_sigma_deg: 0.0,
    };

    /// A consumer depth camera on an arm: 1 mm and 1.5 mm at a metre more, salt and pepper of 0.1 m on 0.5 % of the
    /// pixels, 5 % of the objects with a wrong label, poses off by 2 mm and 0.2 degrees.
    pub const STANDARD: Self = Self {
        depth_sigma_m: 0.001,
        depth_sigma_per_m: 0.0015,
        outlier_share: 0.005,
        outlier_sigma_m: 0.1,
        wrong_label_share: 0.05,
        position_sigma_m: 0.002,
        rotation_sigma_deg: 0.2,
    };

    /// An Intel RealSense L515 on an arm: depth as its data sheet has it (a standard deviation of 2.5 mm at 1 m and of
    /// 15.5 mm at 9 m), twice the salt and pepper at edges; labels and poses as in [`NoiseModel::STANDARD`].
    pub const L515: Self =
        Self { depth_sigma_m: 0.00234, depth_sigma_per_m: 0.000_162_5, outlier_share: 0.01, ..Self::STANDARD };

    /// The models that have names.
    pub const NAMED: [(&'static str, Self); 3] =
        [("none", Self::OFF), ("standard", Self::STANDARD), ("l515", Self::L515)];

    /// The model of a name, as episodes keep it: nothing where there is no noise.
    ///
    /// # Errors
    /// [`Error::Usage`] for another name: names those that there are.
    pub fn named(name: &str) -> Result<Option<Self>> {
        let found = Self::NAMED.into_iter().find(|(known, _)| *known == name);
        let (_, model) = found.ok_or_else(|| {
            let known = Self::NAMED.map(|(known, _)| known).join(", ");
            Error::Usage(format!("unknown noise \"{name}\"; there are {known}"))
        })?;
        Ok(Some(model).filter(|model| *model != Self::OFF))
    }

    /// The name of what an episode keeps, or its numbers where it has none.
    pub fn name_of(noise: Option<Self>) -> String {
        let model = noise.unwrap_or(Self::OFF);
        let named = Self::NAMED.into_iter().find(|(_, known)| *known == model);
        named.map_or_else(|| format!("{model:?}"), |(name, _)| name.to_owned())
    }

    /// Takes a frame whose pose is off. `index` tells the frames of one seed apart (the step of an episode).
    ///
    /// `shoot` is asked for the view from where the camera really is; the frame then says where it was sent. A camera that
    /// cannot be placed, because its frames are recorded or a robot carries it, gives a frame with a pose of its own, from
    /// which the same error is taken.
    ///
    /// # Errors
    /// Those of `shoot`.
    pub fn aim(
        &self,
        view: &View,
        seed: u64,
        index: u64,
        shoot: impl FnOnce(&View) -> Result<Sensed>,
    ) -> Result<Sensed> {
        if *self == Self::OFF {
            return shoot(view);
        }
        let error = self.pose_error(seed, index);
        let really = view.world_from_camera * error;
        let Sensed { frame, objects } = shoot(&view.moved_to(really))?;
        let was_placed = *frame.world_from_camera() == really;
        let thought = if was_placed { view.world_from_camera } else { frame.world_from_camera() * error.inverse() };
        Ok(Sensed { frame: frame.moved_to(thought), objects })
    }

    /// Where the camera really is, seen from where it is thought to be.
    fn pose_error(&self, seed: u64, index: u64) -> Pose {
        let mut rng = rng::stream(seed, "camera pose", index);
        let mut triple = |sigma: f32| Vector::from_fn(|_, _| sigma * gaussian(&mut rng));
        let shift = triple(self.position_sigma_m);
        let turn = triple(self.rotation_sigma_deg.to_radians());
        // Both in the camera's own frame.
        Pose::from_parts(Translation3::from(shift), UnitQuaternion::from_scaled_axis(turn))
    }

    /// The frame with depth noise, salt and pepper and wrong labels; its pose stays. Things are told apart by the objects of
    /// a simulator, else by regions of one label. Scores per class stay as they are: who gives scores says how sure it is.
    pub fn apply(&self, sensed: &Sensed, seed: u64, index: u64) -> Frame {
        let mut frame = sensed.frame.clone();
        if *self == Self::OFF {
            return frame;
        }
        let [near, far] = frame.intrinsics.depth_range_m;
        let width = frame.intrinsics.width;
        // One stream per row, so that rows can be done on any number of threads.
        frame.depth_m.par_chunks_mut(width).enumerate().for_each(|(row, depths)| {
            let mut rng = rng::stream(seed, "depth noise", index << 16 | row as u64);
            for depth in depths.iter_mut().filter(|depth| **depth > 0.0) {
                let mut sigma = self.depth_sigma_m + self.depth_sigma_per_m * *depth * *depth;
                if rng.random::<f32>() < self.outlier_share {
                    sigma = self.outlier_sigma_m;
                }
                *depth += sigma * gaussian(&mut rng);
                if !(*depth >= near && *depth <= far) {
                    *depth = 0.0;
                }
            }
        });
        if let PixelClasses::Labels(labels) = &mut frame.classes {
            let things = match &sensed.objects {
                Some(objects) => Cow::Borrowed(&objects[..]),
                None => Cow::Owned(regions(labels, width)),
            };
            self.mislabel(labels, &things, seed, index);
        }
        frame
    }

    /// Gives some of the things in an image the label of another class.
    fn mislabel(&self, labels: &mut [u8], things: &[u16], seed: u64, index: u64) {
        let mut wrong: BTreeMap<u16, u8> = BTreeMap::new();
        for (thing, label) in things.iter().zip(labels) {
            if *thing == u16::MAX || *label == UNLABELLED {
                continue;
            }
            *label = *wrong.entry(*thing).or_insert_with(|| {
                // One stream per thing: what happens to one does not depend on which others show.
                let mut rng = rng::stream(seed, "wrong label", index << 16 | u64::from(*thing));
                if rng.random::<f32>() >= self.wrong_label_share {
                    return *label;
                }
                let other = rng.random_range(1..OBJECT_CLASS_COUNT as u8);
                (*label + other) % OBJECT_CLASS_COUNT as u8
            });
        }
    }
}

/// A draw from the normal distribution (Box and Muller 1958).
fn gaussian(rng: &mut impl Rng) -> f32 {
    let radius = (-2.0 * (1.0 - rng.random::<f32>()).ln()).sqrt();
    radius * (std::f32::consts::TAU * rng.random::<f32>()).cos()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Intrinsics, ViewId};

    const CAMERA: Intrinsics = Intrinsics { width: 400, height: 400, focal_px: 300.0, depth_range_m: [0.07, 1.5] };

    /// A flat image at one depth that shows sixteen thousand objects of class 3, ten pixels each.
    fn flat(depth: f32) -> Sensed {
        let pixels = CAMERA.width * CAMERA.height;
        let frame = Frame {
            world_from_camera: Pose::identity(),
            intrinsics: CAMERA.into(),
            depth_m: vec![depth; pixels],
            classes: PixelClasses::Labels(vec![3; pixels]),
        };
        Sensed { frame, objects: Some((0..pixels).map(|i| (i / 10) as u16).collect()) }
    }

    fn spread(depth: f32, model: NoiseModel) -> f64 {
        let image = model.apply(&flat(depth), 5, 2);
        let square = |d: &f32| f64::from(d - depth).powi(2);
        (image.depth_m.iter().map(square).sum::<f64>() / image.depth_m.len() as f64).sqrt()
    }

    #[test]
    fn noise_has_the_size_that_the_model_says() {
        let depth_only = NoiseModel { outlier_share: 0.0, ..NoiseModel::STANDARD };
        for depth in [0.3_f32, 0.6, 1.0] {
            let sigma = f64::from(0.001 + 0.0015 * depth * depth);
            assert!((spread(depth, depth_only) / sigma - 1.0).abs() < 0.02);
        }
        let image = NoiseModel::STANDARD.apply(&flat(0.6), 1, 0);
        let labels = image.labels();
        let far_off = image.depth_m.iter().filter(|d| (**d - 0.6).abs() > 0.02).count() as f64 / 160_000.0;
        // 84 % of the outliers are off by more than 2 cm, a fifth of a sigma.
        assert!((far_off / (0.005 * 0.8415) - 1.0).abs() < 0.1, "{far_off}");
        let wrong = labels.chunks(10).filter(|segment| segment[0] != 3).count() as f64 / 16_000.0;
        assert!((wrong - 0.05).abs() < 0.006, "{wrong}");
        assert!(labels.chunks(10).all(|segment| segment.iter().all(|label| *label == segment[0])));
        assert!(labels.iter().all(|label| usize::from(*label) < OBJECT_CLASS_COUNT));
    }

    #[test]
    fn noise_has_names_and_others_are_answered_with_them() {
        for (name, model) in NoiseModel::NAMED {
            let kept = NoiseModel::named(name).expect("a known name");
            assert_eq!(kept.unwrap_or(NoiseModel::OFF), model);
            assert_eq!(NoiseModel::name_of(kept), name);
        }
        assert_eq!(NoiseModel::named("none").expect("known"), None, "an episode without noise keeps no numbers");
        let said = NoiseModel::named("d435").expect_err("unknown").to_string();
        assert_eq!(said, "unknown noise \"d435\"; there are none, standard, l515");
        let own = NoiseModel { outlier_share: 0.25, ..NoiseModel::STANDARD };
        assert!(NoiseModel::name_of(Some(own)).contains("outlier_share: 0.25"));
    }

    #[test]
    fn noise_repeats_with_its_seed_and_index() {
        let run = |seed, index| NoiseModel::STANDARD.apply(&flat(0.6), seed, index);
        assert_eq!(run(1, 1), run(1, 1));
        assert!(run(1, 1).depth_m != run(1, 2).depth_m && run(1, 1).depth_m != run(2, 1).depth_m);
        assert_eq!(NoiseModel::OFF.apply(&flat(0.6), 1, 1), flat(0.6).frame);
    }

    #[test]
    fn a_camera_that_is_placed_says_where_it_was_sent_and_another_where_it_was_less_the_error() {
        let view = View {
            id: ViewId(0),
            world_from_camera: Pose::translation(0.1, -0.3, 0.2),
            target: [0.1, 0.2, 0.2],
            slot: [0; 3],
        };
        let noise = NoiseModel::STANDARD;
        let mut stood = None;
        let placed = noise.aim(&view, 3, 1, |view| {
            stood = Some(view.world_from_camera);
            let frame = flat(0.6).frame.moved_to(view.world_from_camera);
            Ok(Sensed { frame, objects: None })
        });
        assert_eq!(*placed.expect("a frame").frame.world_from_camera(), view.world_from_camera);
        let error = view.world_from_camera.inverse() * stood.expect("asked");
        assert!((0.0003..0.02).contains(&error.translation.vector.norm()), "{error}");
        // A recorded frame of a camera that was elsewhere.
        let recorded = flat(0.6).frame.moved_to(Pose::translation(0.0, -0.5, 0.1));
        let thought =
            noise.aim(&view, 3, 1, |_| Ok(Sensed { frame: recorded.clone(), objects: None })).expect("a frame");
        let off = thought.frame.world_from_camera() * error;
        assert!((off.translation.vector - recorded.world_from_camera().translation.vector).norm() < 1e-6);
        let exact = NoiseModel::OFF.aim(&view, 3, 1, |_| Ok(Sensed { frame: recorded.clone(), objects: None }));
        assert_eq!(exact.expect("a frame").frame, recorded);
    }

    #[test]
    fn without_a_simulators_objects_a_region_of_one_label_is_wrong_as_a_whole() {
        let mut sensed = flat(0.6);
        sensed.objects = None;
        let labels: Vec<u8> = (0..CAMERA.width * CAMERA.height).map(|at| (at / 4000 % 14) as u8).collect();
        sensed.frame.classes = PixelClasses::Labels(labels);
        let all_wrong = NoiseModel { wrong_label_share: 1.0, ..NoiseModel::OFF };
        let frame = all_wrong.apply(&sensed, 1, 0);
        let wrong = frame.labels();
        for (band, was) in wrong.chunks(4000).zip(sensed.frame.labels().chunks(4000)) {
            assert!(band.iter().all(|label| *label == band[0]) && band[0] != was[0]);
        }
    }
}
