//! What a depth camera and a segmentation network get wrong.

use super::{Image, Intrinsics, View, render};
use crate::rng;
use crate::scene::{Body, OBJECT_CLASS_COUNT, Shelf};
use crate::{Error, Pose, Result, Vector};
use nalgebra::{Translation3, UnitQuaternion};
use rand::Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

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

    /// The models that have names.
    pub const NAMED: [(&'static str, Self); 2] = [("none", Self::OFF), ("standard", Self::STANDARD)];

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

    /// Takes an image with this noise. `index` tells the images of one seed apart (the step of an episode).
    ///
    /// The camera stands where jitter puts it while `view`, and so the projection, says where it was sent.
    pub fn take(
        &self,
        shelf: &Shelf,
        bodies: &[Body],
        view: &View,
        intrinsics: &Intrinsics,
        seed: u64,
        index: u64,
    ) -> Image {
        if *self == Self::OFF {
            return render(shelf, bodies, view, intrinsics);
        }
        let mut image = render(shelf, bodies, &self.jittered(view, seed, index), intrinsics);
        self.disturb(&mut image, intrinsics, seed, index);
        image
    }

    /// The view where the camera really is.
    fn jittered(&self, view: &View, seed: u64, index: u64) -> View {
        let mut rng = rng::stream(seed, "camera pose", index);
        let mut triple = |sigma: f32| Vector::from_fn(|_, _| sigma * gaussian(&mut rng));
        let shift = triple(self.position_sigma_m);
        let turn = triple(self.rotation_sigma_deg.to_radians());
        // Both in the camera's own frame.
        let jitter = Pose::from_parts(Translation3::from(shift), UnitQuaternion::from_scaled_axis(turn));
        View { world_from_camera: view.world_from_camera * jitter, ..view.clone() }
    }

    /// Adds depth noise, salt and pepper and wrong labels to an image.
    pub fn disturb(&self, image: &mut Image, intrinsics: &Intrinsics, seed: u64, index: u64) {
        let [near, far] = intrinsics.depth_range_m;
        let width = image.size[0];
        // One stream per row, so that rows can be done on any number of threads.
        image.depth_m.par_chunks_mut(width).enumerate().for_each(|(row, depths)| {
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
        let mut wrong: std::collections::BTreeMap<u16, u8> = std::collections::BTreeMap::new();
        for (object, label) in image.objects.iter().zip(&mut image.labels) {
            if *object == u16::MAX {
                continue;
            }
            *label = *wrong.entry(*object).or_insert_with(|| {
                // One stream per object: what happens to one does not depend on which others show.
                let mut rng = rng::stream(seed, "wrong label", index << 16 | u64::from(*object));
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
    use crate::camera::ViewId;

    const CAMERA: Intrinsics = Intrinsics { width: 400, height: 400, focal_px: 300.0, depth_range_m: [0.07, 1.5] };

    /// A flat image at one depth that shows sixteen thousand objects of class 3, ten pixels each.
    fn flat(depth: f32) -> Image {
        let pixels = CAMERA.width * CAMERA.height;
        Image {
            view: ViewId(0),
            size: [CAMERA.width, CAMERA.height],
            depth_m: vec![depth; pixels],
            labels: vec![3; pixels],
            objects: (0..pixels).map(|i| (i / 10) as u16).collect(),
        }
    }

    fn spread(depth: f32, model: NoiseModel) -> f64 {
        let mut image = flat(depth);
        model.disturb(&mut image, &CAMERA, 5, 2);
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
        let mut image = flat(0.6);
        NoiseModel::STANDARD.disturb(&mut image, &CAMERA, 1, 0);
        let far_off = image.depth_m.iter().filter(|d| (**d - 0.6).abs() > 0.02).count() as f64 / 160_000.0;
        // 84 % of the outliers are off by more than 2 cm, a fifth of a sigma.
        assert!((far_off / (0.005 * 0.8415) - 1.0).abs() < 0.1, "{far_off}");
        let wrong = image.labels.chunks(10).filter(|segment| segment[0] != 3).count() as f64 / 16_000.0;
        assert!((wrong - 0.05).abs() < 0.006, "{wrong}");
        assert!(image.labels.chunks(10).all(|segment| segment.iter().all(|label| *label == segment[0])));
        assert!(image.labels.iter().all(|label| usize::from(*label) < OBJECT_CLASS_COUNT));
    }

    #[test]
    fn noise_has_names_and_others_are_answered_with_them() {
        for (name, model) in NoiseModel::NAMED {
            let kept = NoiseModel::named(name).expect("a known name");
            assert_eq!(kept.unwrap_or(NoiseModel::OFF), model);
            assert_eq!(NoiseModel::name_of(kept), name);
        }
        assert_eq!(NoiseModel::named("none").expect("known"), None, "an episode without noise keeps no numbers");
        let said = NoiseModel::named("l515").expect_err("unknown").to_string();
        assert_eq!(said, "unknown noise \"l515\"; there are none, standard");
        let own = NoiseModel { outlier_share: 0.25, ..NoiseModel::STANDARD };
        assert!(NoiseModel::name_of(Some(own)).contains("outlier_share: 0.25"));
    }

    #[test]
    fn noise_repeats_with_its_seed_and_index() {
        let run = |seed, index| {
            let mut image = flat(0.6);
            NoiseModel::STANDARD.disturb(&mut image, &CAMERA, seed, index);
            image
        };
        assert_eq!(run(1, 1), run(1, 1));
        assert!(run(1, 1).depth_m != run(1, 2).depth_m && run(1, 1).depth_m != run(2, 1).depth_m);
        let mut untouched = flat(0.6);
        NoiseModel::OFF.disturb(&mut untouched, &CAMERA, 1, 1);
        assert_eq!(untouched, flat(0.6));
    }
}
