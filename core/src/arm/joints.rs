//! One value per joint of an arm.

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::ops::{Deref, DerefMut};

/// Most moving joints that an arm may have.
pub const MAX_JOINTS: usize = 8;

/// A configuration: angles (rad) of turning and offsets (m) of sliding joints, from the base to the tool.
#[derive(Clone, Copy, PartialEq)]
pub struct Joints {
    values: [f64; MAX_JOINTS],
    count: u8,
}

impl Joints {
    /// All `count` joints at zero.
    ///
    /// # Panics
    /// More joints than [`MAX_JOINTS`]; a model with so many is refused when it is read.
    pub fn zero(count: usize) -> Self {
        assert!(count <= MAX_JOINTS, "an arm has at most {MAX_JOINTS} joints");
        Self { values: [0.0; MAX_JOINTS], count: count as u8 }
    }

    /// The configuration with these values.
    ///
    /// # Panics
    /// As for [`Joints::zero`].
    pub fn of(values: &[f64]) -> Self {
        let mut joints = Self::zero(values.len());
        joints.copy_from_slice(values);
        joints
    }

    /// A share of the way from here to `other`, joint by joint.
    pub fn toward(&self, other: &Self, share: f64) -> Self {
        let mut joints = *self;
        for (value, to) in joints.iter_mut().zip(other.iter()) {
            *value += (to - *value) * share;
        }
        joints
    }

    /// The largest difference of a joint, rad or m.
    pub fn largest_change(&self, other: &Self) -> f64 {
        self.iter().zip(other.iter()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }
}

impl Deref for Joints {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.values[..usize::from(self.count)]
    }
}

impl DerefMut for Joints {
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.values[..usize::from(self.count)]
    }
}

impl std::fmt::Debug for Joints {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

impl Serialize for Joints {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.iter())
    }
}

impl<'de> Deserialize<'de> for Joints {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let values = Vec::<f64>::deserialize(deserializer)?;
        if values.len() > MAX_JOINTS {
            return Err(serde::de::Error::invalid_length(values.len(), &"at most eight joints"));
        }
        Ok(Self::of(&values))
    }
}
