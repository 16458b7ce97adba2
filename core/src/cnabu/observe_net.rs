//! sigma_o: from prior evidence and an observation to posterior evidence.
//!
//! A U-Net sees all inputs through a narrow stem and completes what was not seen: the back sides and insides of
//! objects. Skip connections lead prior evidence and observation past it to the heads, scaled per level or class, so
//! that already an untrained network adds the observation to the prior. A semantic head of its own sees the labels, the
//! prior Dirichlet and a slice of the occupancy posterior 3 cm above the board.

use super::layout::{LABELS, LEVELS, OCCUPANCY, SEMANTICS, SUBS};
use super::net::{Network, UNet, conv, head, per_channel};
use crate::scene::CLASS_COUNT;
use tch::nn::{self, Module};
use tch::{Kind, Tensor};

/// Level of the slice that the semantic head sees: 3 cm above the board.
const SLICE_LEVEL: i64 = 3;
/// Largest `ln a` of a state: evidence of about 1,100.
pub(super) const LOG_EVIDENCE_LIMIT: f64 = 7.0;

/// `z` of `kinds` kinds (occupied and free, or classes; `[B, kinds * ..., X, Y]`) with the evidence limited: where the
/// largest is above [`LOG_EVIDENCE_LIMIT`] all kinds are lowered by the same amount, so that the mean does not change.
/// (Clipped one by one, all kinds above the limit would become equally probable.)
pub(super) fn limited(z: &Tensor, kinds: usize) -> Tensor {
    let size = z.size();
    let by_kind = z.view([size[0], kinds as i64, -1, size[2], size[3]]);
    let above = (by_kind.amax([1], true) - LOG_EVIDENCE_LIMIT).clamp_min(0.0);
    (by_kind - above).view(&size[..])
}

/// Logarithms of evidence as planes: a network's state between observations.
#[derive(Debug)]
pub struct Evidence {
    /// `[B, 2 * levels * 4, X, Y]`: occupied, then free.
    pub occupancy: Tensor,
    /// `[B, classes * 4, X, Y]`.
    pub semantics: Tensor,
}

impl Evidence {
    /// The uniform prior for a batch of planes.
    pub fn uniform(batch: i64, [x, y]: [i64; 2], device: tch::Device) -> Self {
        let zeros = |channels: usize| Tensor::zeros([batch, channels as i64, x, y], (Kind::Float, device));
        Self { occupancy: zeros(2 * OCCUPANCY), semantics: zeros(SEMANTICS) }
    }

    /// What heads gave, as state: `ln a = softplus(z)`, limited, cut off from its history.
    pub fn of_heads(z_occupancy: &Tensor, z_semantics: &Tensor) -> Self {
        let log = |z: &Tensor, kinds: usize| limited(&z.detach(), kinds).softplus();
        Self { occupancy: log(z_occupancy, 2), semantics: log(z_semantics, CLASS_COUNT) }
    }

    /// The same numbers, not copied, for another thread.
    pub(super) fn shared(&self) -> Self {
        Self { occupancy: self.occupancy.shallow_clone(), semantics: self.semantics.shallow_clone() }
    }

    /// The same on a device.
    pub fn to_device(&self, device: tch::Device) -> Self {
        Self { occupancy: self.occupancy.to_device(device), semantics: self.semantics.to_device(device) }
    }

    /// The same with numbers of another kind.
    pub fn to_kind(&self, kind: Kind) -> Self {
        Self { occupancy: self.occupancy.to_kind(kind), semantics: self.semantics.to_kind(kind) }
    }

    /// What it takes of memory, bytes.
    pub fn bytes(&self) -> usize {
        let of = |planes: &Tensor| planes.numel() * planes.kind().elt_size_in_bytes();
        of(&self.occupancy) + of(&self.semantics)
    }

    /// The same with left and right exchanged; for planes without padding.
    pub fn mirrored(&self) -> Self {
        let cells = 2 * self.occupancy.size()[2];
        Self { occupancy: mirrored(&self.occupancy, cells), semantics: mirrored(&self.semantics, cells) }
    }
}

/// Planes (`[B, quantities * 4, X, Y]`) with left and right exchanged among the first `cells` floor cells along x. What lies
/// beyond is padding, and stays: the shelf is mirrored, not its surroundings.
pub(super) fn mirrored(planes: &Tensor, cells: i64) -> Tensor {
    let size = planes.size();
    // A channel is a quantity and a sub-cell `2 (x % 2) + y % 2`; along x both pixels and sub-cells turn round.
    let folded = planes.view([size[0], -1, 2, 2, size[2], size[3]]);
    let all = 2 * size[2];
    if cells == all {
        return folded.flip([2, 4]).view(&size[..]);
    }
    // Sub-cells beside their pixels, so that floor cells along x are one axis.
    let order: Vec<i64> = (0..cells).rev().chain(cells..all).collect();
    let order = Tensor::from_slice(&order).to_device(planes.device());
    let rows = folded.permute([0, 1, 3, 4, 2, 5]).reshape([size[0], -1, 2, all, size[3]]).index_select(3, &order);
    rows.view([size[0], -1, 2, size[2], 2, size[3]]).permute([0, 1, 4, 2, 3, 5]).reshape(&size[..])
}

/// The network sigma_o.
#[derive(Debug)]
pub struct ObserveNet {
    stem_prior: nn::Conv2D,
    stem_semantics: nn::Conv2D,
    stem_observed: nn::Conv2D,
    stem_labels: nn::Conv2D,
    unet: UNet,
    occupancy_head: nn::Conv2D,
    semantic_mix: nn::Conv2D,
    semantic_labels: nn::Conv2D,
    semantic_prior: nn::Conv2D,
    semantic_slice: nn::Conv2D,
    semantic_inner: nn::Conv2D,
    semantic_head: nn::Conv2D,
    /// Per channel: what the prior's logarithm, an observation of the same kind and one of the other kind add to `z`.
    keep_occupancy: Tensor,
    agree: Tensor,
    disagree: Tensor,
    keep_semantics: Tensor,
    label: Tensor,
}

/// Channels of the semantic head.
const SEMANTIC_WIDTH: i64 = 64;

impl Network for ObserveNet {
    const NAME: &str = "sigma_o";

    fn new(path: &nn::Path<'_>, width: i64) -> Self {
        let (occupancy, semantics, labels) = (2 * OCCUPANCY as i64, SEMANTICS as i64, LABELS as i64);
        let stem = 2 * width;
        Self {
            stem_prior: conv(path / "stem_prior", occupancy, stem, 1),
            stem_semantics: conv(path / "stem_semantics", semantics, stem, 1),
            stem_observed: conv(path / "stem_observed", occupancy, stem, 1),
            stem_labels: conv(path / "stem_labels", labels, stem, 1),
            unet: UNet::new(&(path / "unet"), stem, width),
            occupancy_head: head(path / "occupancy_head", width, occupancy, -1.0),
            semantic_mix: conv(path / "semantic_mix", width, SEMANTIC_WIDTH, 1),
            semantic_labels: conv(path / "semantic_labels", labels, SEMANTIC_WIDTH, 1),
            semantic_prior: conv(path / "semantic_prior", semantics, SEMANTIC_WIDTH, 1),
            semantic_slice: conv(path / "semantic_slice", 2 * SUBS as i64, SEMANTIC_WIDTH, 1),
            semantic_inner: conv(path / "semantic_inner", SEMANTIC_WIDTH, SEMANTIC_WIDTH, 3),
            semantic_head: head(path / "semantic_head", SEMANTIC_WIDTH, semantics, -1.0),
            keep_occupancy: per_channel(path, "keep_occupancy", occupancy, 1.0),
            agree: per_channel(path, "agree", occupancy, 2.0),
            disagree: per_channel(path, "disagree", occupancy, -1.0),
            keep_semantics: per_channel(path, "keep_semantics", semantics, 1.0),
            label: per_channel(path, "label", semantics, 2.0),
        }
    }
}

impl ObserveNet {
    /// `z` of the posterior (`a = 1 + e^z`), of the shapes of [`Evidence`], from the prior, the levels observed (occupied,
    /// then free; `[B, 2 * levels * 4, X, Y]`) and the one-hot labels (`[B, 16 * 4, X, Y]`).
    pub fn forward(&self, prior: &Evidence, observed: &Tensor, labels: &Tensor) -> (Tensor, Tensor) {
        let half = OCCUPANCY as i64;
        let stem = prior.occupancy.apply(&self.stem_prior)
            + prior.semantics.apply(&self.stem_semantics)
            + observed.apply(&self.stem_observed)
            + labels.apply(&self.stem_labels);
        let features = self.unet.forward(&stem.relu());

        let opposite = observed.roll([half], [1]);
        let z_occupancy = features
            .apply(&self.occupancy_head)
            .addcmul(&self.keep_occupancy, &prior.occupancy)
            .addcmul(&self.agree, observed)
            .addcmul(&self.disagree, &opposite);

        let slice = |first: i64| z_occupancy.narrow(1, first + SLICE_LEVEL * SUBS as i64, SUBS as i64);
        let slice = Tensor::cat(&[slice(0), slice(half)], 1).detach().clamp(-8.0, 8.0);
        let mixed = features.apply(&self.semantic_mix)
            + labels.apply(&self.semantic_labels)
            + prior.semantics.apply(&self.semantic_prior)
            + slice.apply(&self.semantic_slice);
        let mixed = mixed.relu();
        let inner = mixed.apply(&self.semantic_inner).relu_() + mixed;
        let z_semantics = inner
            .apply(&self.semantic_head)
            .addcmul(&self.keep_semantics, &prior.semantics)
            .addcmul(&self.label, &labels.narrow(1, 0, SEMANTICS as i64));
        (z_occupancy, z_semantics)
    }

    /// Numbers of levels and classes that the planes hold.
    pub fn counts() -> (usize, usize) {
        (LEVELS, CLASS_COUNT)
    }
}

#[cfg(test)]
mod tests {
    use super::{LOG_EVIDENCE_LIMIT, limited, mirrored};
    use tch::Tensor;

    #[test]
    fn only_the_shelf_is_mirrored_and_not_its_padding() {
        // Two sub-cells along x and one row: four floor cells, numbered along x, of which three are the shelf.
        let planes = Tensor::from_slice(&[0_i64, 2, 0, 2, 1, 3, 1, 3]).reshape([1, 4, 2, 1]);
        let turned = Vec::<i64>::try_from(mirrored(&planes, 3).flatten(0, -1)).expect("numbers");
        assert_eq!(turned, [2, 0, 2, 0, 1, 3, 1, 3]);
        assert!(mirrored(&mirrored(&planes, 3), 3).equal(&planes), "twice is as it was");
        let turned = Vec::<i64>::try_from(mirrored(&planes, 4).flatten(0, -1)).expect("numbers");
        assert_eq!(turned, [3, 1, 3, 1, 2, 0, 2, 0]);
    }

    #[test]
    fn evidence_is_limited_without_changing_what_is_likeliest() {
        // Three classes (kinds) of two sub-cells at one pixel: the first sub-cell's evidence is too large, the second's not.
        let z = Tensor::from_slice(&[9.0_f32, 1.0, 12.0, 6.5, -3.0, 2.0]).reshape([1, 6, 1, 1]);
        let limited = Vec::<f32>::try_from(limited(&z, 3).flatten(0, -1)).expect("numbers");
        assert_eq!(limited, [4.0, 1.0, LOG_EVIDENCE_LIMIT as f32, 6.5, -8.0, 2.0]);
    }
}
