//! A state of an episode and the pushes from it, as they are filed.

use crate::grid::{Voxel, VoxelSet};
use crate::scene::{Family, ObjectId};
use crate::skill::Push;
use crate::skill::PushSampler;

/// Height bands of a predicted change.
pub const BANDS: usize = 8;

/// A state, and what pushes from it do.
#[derive(Clone, Debug, PartialEq)]
pub struct WorthState {
    /// Seed of the episode, and of its shelf.
    pub seed: u64,
    /// Which of the episode's states it is, from 0.
    pub leg: u8,
    /// What kind of shelf it is.
    pub family: Family,
    /// Whether the sensor's noise is on.
    pub noisy: bool,
    /// Views that were looked from since the start, in order.
    pub looks: Vec<u16>,
    /// Pushes that were made before.
    pub earlier_pushes: u8,
    /// Gain of the best two views together: what looking promises, nats.
    pub igv: f32,
    /// How good the map is.
    pub scores: MapScores,
    /// How good it is after three looks more, where that was found.
    pub looked_on: Option<MapScores>,
    /// The believed occupancy.
    pub map: BeliefMap,
    /// The believed classes.
    pub floor: FloorFacts,
    /// Voxels inside objects.
    pub truth: VoxelSet,
    /// True class per floor cell.
    pub labels: Vec<u8>,
    /// The objects, those that were dropped left out.
    pub objects: Vec<ObjectState>,
    /// The pushes, in the order drawn.
    pub pushes: Vec<WorthPush>,
}

/// How good a map is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MapScores {
    /// Mean IoU of free and occupied.
    pub occupancy_iou: f32,
    /// Mean IoU over the classes.
    pub semantic_miou: f32,
}

/// Occupancy in blocks of 2 x 2 x 2 voxels, a byte each.
#[derive(Clone, Debug, PartialEq)]
pub struct BeliefMap {
    /// Mean probability, in 255ths.
    pub occupancy: Vec<u8>,
    /// Mean standard deviation of the Betas, in 510ths.
    pub deviation: Vec<u8>,
    /// How many of the voxels looks have seen, of 8.
    pub seen: Vec<u8>,
    /// How many of them some view reaches through the likeliest map, of 8, by one ray in 16 pixels along both axes; what none
    /// reaches only pushes can show.
    pub reached: Vec<u8>,
}

/// The classes of the floor's cells, a byte each.
#[derive(Clone, Debug, PartialEq)]
pub struct FloorFacts {
    /// The likeliest class.
    pub class: Vec<u8>,
    /// Its probability, in 255ths.
    pub certainty: Vec<u8>,
    /// Entropy of the mean distribution, in 255ths of that of 15 equally likely classes.
    pub entropy: Vec<u8>,
    /// Epistemic uncertainty `K / sum(a)`, in 255ths.
    pub vacuity: Vec<u8>,
}

/// An object as it really stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectState {
    /// Its position in the scene.
    pub id: ObjectId,
    /// Its class.
    pub class: u8,
    /// Whether no view shows it.
    pub hidden: bool,
    /// How many of its voxels a view reaches, of every fourth view.
    pub shown: u32,
    /// Its pose: x, y, z in metres, then the rotation's quaternion i, j, k, w.
    pub pose: [f32; 7],
}

/// A push, what was promised of it and what it did.
#[derive(Clone, Debug, PartialEq)]
pub struct WorthPush {
    /// The push.
    pub push: Push,
    /// The voxel that it is aimed at.
    pub contact: Voxel,
    /// Where it was drawn.
    pub sampler: PushSampler,
    /// How long the arm's motion takes, seconds.
    pub motion_s: f32,
    /// Blocks of 2 x 2 x 2 voxels that arm and gripper touch, a bit each, the first in the lowest bit.
    pub swept: Vec<u8>,
    /// What was promised.
    pub promise: Promise,
    /// How far the tip came, metres.
    pub pushed_m: f32,
    /// Whether the arm was blocked and gave up.
    pub jammed: bool,
    /// Sum of the objects' displacements, metres.
    pub displacement_m: f32,
    /// Voxels that it opens: that no look has seen, no view reached before and one reaches after it.
    pub opened: u32,
    /// What is unknown of them, nats.
    pub opened_nats: f32,
    /// Objects that stood and then lie.
    pub toppled: u8,
    /// What became of each object, in the order of [`WorthState::objects`].
    pub objects: Vec<ObjectOutcome>,
    /// What the map gains, where that was found.
    pub followed: Option<Followed>,
}

/// What sigma_m says of a push.
#[derive(Clone, Debug, PartialEq)]
pub struct Promise {
    /// What it opens to all views together, nats.
    pub gain: f32,
    /// `min(0, H_s(belief) - H_s(predicted))`, nats.
    pub reg: f32,
    /// Per block of 2 x 2 floor cells, the largest probability that one of them changes, in 255ths.
    pub change: Vec<u8>,
    /// Per block of 4 x 4 floor cells and [`BANDS`] height bands, the change of the mean occupancy probability, in 127ths.
    pub occupancy: Vec<i8>,
}

/// What became of an object by a push.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ObjectOutcome {
    /// Whether no view shows it afterwards; of a dropped one as before.
    pub hidden: bool,
    /// Whether it left the board.
    pub dropped: bool,
    /// How many of its voxels a view reaches afterwards, of every fourth view.
    pub shown: u32,
}

/// How good the map is after a push and the looks after it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Followed {
    /// After the push and its best two looks, against the truth then.
    pub scores: MapScores,
}

impl WorthState {
    /// Objects that a push brings into sight and takes out of it, dropped ones among the latter.
    pub fn won_and_lost(&self, push: &WorthPush) -> [usize; 2] {
        let pairs = || self.objects.iter().zip(&push.objects);
        let won = pairs().filter(|(before, after)| !after.dropped && before.hidden && !after.hidden).count();
        let lost = pairs().filter(|(before, after)| after.dropped || !before.hidden && after.hidden).count();
        [won, lost]
    }

    /// Object voxels that come into sight and that go out of it, over all objects.
    pub fn appeared_and_vanished(&self, push: &WorthPush) -> [u32; 2] {
        let pairs = || self.objects.iter().zip(&push.objects);
        let appeared = pairs().map(|(before, after)| after.shown.saturating_sub(before.shown)).sum();
        [appeared, pairs().map(|(before, after)| before.shown.saturating_sub(after.shown)).sum()]
    }
}
