//! sigma_m: from prior evidence and a push to the evidence that the push is predicted to leave, and where it changes
//! anything.
//!
//! The network sees a window of the floor plan around the push: as wide as a push can change anything, and as deep as
//! the shelf. Its stem is made of 1 x 1 convolutions, so the prior's part is computed once for all candidates of a
//! decision and cut out per window. As in sigma_o, skip connections lead the prior past the U-Net to the heads. The
//! heads look at one pixel at a time, so they are computed only where something is likely to change.
//!
//! Convolutions are bad at moving a class or a height over 10 cm of floor. So a further input is a guess: the evidence
//! of the first object that the tool touches, moved with the tool (the guess of the classical rule; the object does not
//! turn and pushes no other). A skip connection leads it past the U-Net too, and the network learns how far to trust
//! it.

use super::layout::{OCCUPANCY, SEMANTICS, SUBS};
use super::net::{Network, UNet, conv, head, per_channel};
use super::observe_net::Evidence;
use std::ops::Range;
use tch::Tensor;
use tch::nn::{self, Module};

/// Pixels of the window along x: 0.4 m.
pub(crate) const WINDOW: usize = 40;
/// Planes that mark floor cells: the start of the push, its end, where the moved object stood, and where it comes to.
pub(super) const MARKS: usize = 4 * SUBS;
/// Planes of the change of floor cells: for and against.
const CHANGE: usize = 2 * SUBS;

/// Outputs of the heads: `z` with `a = 1 + e^z`.
#[derive(Debug)]
pub struct Pushed {
    /// `[B, 2 * levels * 4, WINDOW, Y]`: occupied, then free, where something changes.
    pub occupancy: Tensor,
    /// `[B, classes * 4, WINDOW, Y]`.
    pub semantics: Tensor,
    /// `[B, 2 * 4, WINDOW, Y]`: for and against that a floor cell changes.
    pub change: Tensor,
}

/// Features of the prior over the whole floor plan: computed once for all candidates of a decision.
#[derive(Debug)]
pub struct PriorParts {
    stem: Tensor,
    labels: Tensor,
}

impl PriorParts {
    /// The same numbers, not copied, for another thread.
    pub(super) fn shared(&self) -> Self {
        Self { stem: self.stem.shallow_clone(), labels: self.labels.shallow_clone() }
    }

    /// Cut to windows, one above the other.
    pub(crate) fn windows(&self, xs: &[Range<usize>]) -> Self {
        Self { stem: windows(&self.stem, xs), labels: windows(&self.labels, xs) }
    }

    /// Those of several scenes, one above the other.
    pub(crate) fn stacked(parts: &[Self]) -> Self {
        let of = |part: fn(&Self) -> &Tensor| Tensor::cat(&parts.iter().map(part).collect::<Vec<_>>(), 0);
        Self { stem: of(|parts| &parts.stem), labels: of(|parts| &parts.labels) }
    }
}

/// Planes `[1, C, X, Y]` cut to windows, one above the other: `[B, C, WINDOW, Y]`.
pub(crate) fn windows(planes: &Tensor, xs: &[Range<usize>]) -> Tensor {
    let cut: Vec<Tensor> = xs.iter().map(|x| planes.narrow(2, x.start as i64, x.len() as i64)).collect();
    Tensor::cat(&cut, 0)
}

/// What the network knows of every pixel before its heads, which look at one pixel at a time.
#[derive(Debug)]
pub(super) struct Body {
    features: Tensor,
    labels: Tensor,
    /// As in [`Pushed`].
    pub(super) change: Tensor,
}

/// Some pixels of windows: which window each is in, and which pixel of it.
#[derive(Debug)]
pub(super) struct Pixels {
    window: Tensor,
    pixel: Tensor,
}

impl Pixels {
    pub(super) fn new(window: &[i64], pixel: &[i64], device: tch::Device) -> Self {
        let tensor = |numbers: &[i64]| Tensor::from_slice(numbers).to_device(device);
        Self { window: tensor(window), pixel: tensor(pixel) }
    }

    /// These pixels of planes `[B, C, X, Y]`, as planes `[1, C, N, 1]`.
    pub(super) fn of(&self, planes: &Tensor) -> Tensor {
        let size = planes.size();
        let [window, pixel] = [&self.window, &self.pixel].map(|index| Some(index.shallow_clone()));
        let chosen = planes.reshape([size[0], size[1], -1]).index(&[window, None, pixel]);
        chosen.transpose(0, 1).reshape([1, size[1], -1, 1])
    }

    pub(super) fn of_evidence(&self, evidence: &Evidence) -> Evidence {
        Evidence { occupancy: self.of(&evidence.occupancy), semantics: self.of(&evidence.semantics) }
    }
}

impl Body {
    pub(super) fn at(&self, pixels: &Pixels) -> Self {
        let of = |planes: &Tensor| pixels.of(planes);
        Self { features: of(&self.features), labels: of(&self.labels), change: of(&self.change) }
    }
}

/// Inputs that describe pushes, in windows.
#[derive(Debug)]
pub struct PushPlanes {
    /// `[B, levels * 4, WINDOW, Y]`: what the tool and the arm sweep.
    pub swept: Tensor,
    /// `[B, 4 * 4, WINDOW, Y]`: start and end; where the moved object stood, and where it comes to.
    pub marks: Tensor,
    /// The logarithms of the evidence of the moved object, where it comes to; 0 elsewhere.
    pub arriving: Evidence,
}

impl PushPlanes {
    /// The same on a device.
    pub fn to_device(&self, device: tch::Device) -> Self {
        Self {
            swept: self.swept.to_device(device),
            marks: self.marks.to_device(device),
            arriving: self.arriving.to_device(device),
        }
    }
}

/// The network sigma_m.
#[derive(Debug)]
pub struct PushNet {
    stem_prior: nn::Conv2D,
    stem_semantics: nn::Conv2D,
    stem_swept: nn::Conv2D,
    stem_marks: nn::Conv2D,
    stem_arriving: nn::Conv2D,
    stem_labels: nn::Conv2D,
    unet: UNet,
    occupancy_head: nn::Conv2D,
    semantic_mix: nn::Conv2D,
    semantic_prior: nn::Conv2D,
    semantic_arriving: nn::Conv2D,
    semantic_inner: nn::Conv2D,
    semantic_head: nn::Conv2D,
    change_inner: nn::Conv2D,
    change_head: nn::Conv2D,
    keep_occupancy: Tensor,
    keep_semantics: Tensor,
    /// Per channel: what being swept adds to `z`.
    swept: Tensor,
    /// Per channel: what the evidence of the moved object adds to `z`.
    arriving_occupancy: Tensor,
    arriving_semantics: Tensor,
}

impl Network for PushNet {
    const NAME: &str = "sigma_m";

    fn new(path: &nn::Path<'_>, width: i64) -> Self {
        let (occupancy, semantics) = (2 * OCCUPANCY as i64, SEMANTICS as i64);
        let stem = 2 * width;
        Self {
            stem_prior: conv(path / "stem_prior", occupancy, stem, 1),
            stem_semantics: conv(path / "stem_semantics", semantics, stem, 1),
            stem_swept: conv(path / "stem_swept", OCCUPANCY as i64, stem, 1),
            stem_marks: conv(path / "stem_marks", MARKS as i64, stem, 1),
            stem_arriving: conv(path / "stem_arriving", occupancy, stem, 1),
            stem_labels: conv(path / "stem_labels", semantics, stem, 1),
            unet: UNet::new(&(path / "unet"), stem, width),
            occupancy_head: head(path / "occupancy_head", width, occupancy, 0.0),
            semantic_mix: conv(path / "semantic_mix", width, width, 1),
            semantic_prior: conv(path / "semantic_prior", semantics, width, 1),
            semantic_arriving: conv(path / "semantic_arriving", semantics, width, 1),
            semantic_inner: conv(path / "semantic_inner", width, width, 3),
            semantic_head: head(path / "semantic_head", width, semantics, -1.0),
            change_inner: conv(path / "change_inner", width, width, 3),
            change_head: head(path / "change_head", width, CHANGE as i64, 0.0),
            keep_occupancy: per_channel(path, "keep_occupancy", occupancy, 0.5),
            keep_semantics: per_channel(path, "keep_semantics", semantics, 0.5),
            swept: per_channel(path, "swept", occupancy, 0.0),
            arriving_occupancy: per_channel(path, "arriving_occupancy", occupancy, 0.5),
            arriving_semantics: per_channel(path, "arriving_semantics", semantics, 0.5),
        }
    }
}

impl PushNet {
    /// The prior's part, over the whole floor plan.
    pub fn prior_parts(&self, prior: &Evidence) -> PriorParts {
        PriorParts {
            stem: prior.occupancy.apply(&self.stem_prior) + prior.semantics.apply(&self.stem_semantics),
            labels: prior.semantics.apply(&self.semantic_prior),
        }
    }

    /// The prediction from the prior's parts and the prior, both cut to the windows, and the pushes.
    pub fn forward(&self, parts: &PriorParts, prior: &Evidence, pushes: &PushPlanes) -> Pushed {
        let body = self.body(parts, pushes);
        let (occupancy, semantics) = self.heads(&body, prior, &pushes.swept, &pushes.arriving);
        Pushed { occupancy, semantics, change: body.change }
    }

    /// Everything that looks beyond a pixel.
    pub(super) fn body(&self, parts: &PriorParts, pushes: &PushPlanes) -> Body {
        let PushPlanes { swept, marks, arriving } = pushes;
        let mut stem = &parts.stem
            + swept.apply(&self.stem_swept)
            + marks.apply(&self.stem_marks)
            + arriving.occupancy.apply(&self.stem_arriving)
            + arriving.semantics.apply(&self.stem_labels);
        let features = self.unet.forward(&stem.relu_());
        let mut mixed =
            features.apply(&self.semantic_mix) + &parts.labels + arriving.semantics.apply(&self.semantic_arriving);
        let mixed = mixed.relu_();
        let labels = mixed.apply(&self.semantic_inner).relu_() + mixed;
        let change = features.apply(&self.change_inner).relu_().apply(&self.change_head);
        Body { features, labels, change }
    }

    /// Occupancy and semantics from the body, the prior and the pushes, all at the same pixels: of whole windows, or some.
    pub(super) fn heads(&self, body: &Body, prior: &Evidence, swept: &Tensor, arriving: &Evidence) -> (Tensor, Tensor) {
        let occupancy = body
            .features
            .apply(&self.occupancy_head)
            .addcmul(&self.keep_occupancy, &prior.occupancy)
            .addcmul(&self.arriving_occupancy, &arriving.occupancy)
            .addcmul(&self.swept, &Tensor::cat(&[swept, swept], 1));
        let semantics = body
            .labels
            .apply(&self.semantic_head)
            .addcmul(&self.keep_semantics, &prior.semantics)
            .addcmul(&self.arriving_semantics, &arriving.semantics);
        (occupancy, semantics)
    }
}
