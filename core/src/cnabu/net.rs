//! The parts that both networks are built of: residual blocks and a U-Net of four levels.

use std::sync::{Mutex, PoisonError};
use tch::Tensor;
use tch::nn::{self, Module};

/// A network of the belief update.
pub trait Network: Sized {
    /// Its name in cards.
    const NAME: &str;

    /// The network with its variables under `path`; `width` is the channels of the U-Net's first level, a multiple of 8.
    fn new(path: &nn::Path<'_>, width: i64) -> Self;
}

/// A network with fresh weights, drawn with `seed`, or by another draw of it.
///
/// libtorch has one stream of random numbers for the whole process: without this lock two networks that are made at once
/// would share it, and neither would have the weights of its seed.
pub(crate) fn seeded<T>(seed: i64, draw: impl FnOnce() -> T) -> T {
    static DRAWING: Mutex<()> = Mutex::new(());
    let _drawing = DRAWING.lock().unwrap_or_else(PoisonError::into_inner);
    tch::manual_seed(seed);
    draw()
}

/// Groups of the group norms.
const GROUPS: i64 = 8;

/// A convolution that keeps the planes' size.
pub(super) fn conv(path: nn::Path<'_>, from: i64, to: i64, kernel: i64) -> nn::Conv2D {
    nn::conv2d(path, from, to, kernel, nn::ConvConfig { padding: kernel / 2, ..Default::default() })
}

/// A 1 x 1 convolution whose output begins near `bias`: what a network says before it has learnt.
pub(super) fn head(path: nn::Path<'_>, from: i64, to: i64, bias: f64) -> nn::Conv2D {
    let init = nn::ConvConfig {
        ws_init: nn::Init::Randn { mean: 0.0, stdev: 0.02 },
        bs_init: nn::Init::Const(bias),
        ..Default::default()
    };
    nn::conv2d(path, from, to, 1, init)
}

/// What every channel of the planes is multiplied by or shifted by, to be learnt from `value` on.
pub(super) fn per_channel(path: &nn::Path<'_>, name: &str, channels: i64, value: f64) -> Tensor {
    path.var(name, &[1, channels, 1, 1], nn::Init::Const(value))
}

/// Two 3 x 3 convolutions with group norm, and a way past them.
#[derive(Debug)]
pub(super) struct Block {
    first: nn::Conv2D,
    first_norm: nn::GroupNorm,
    second: nn::Conv2D,
    second_norm: nn::GroupNorm,
    past: Option<nn::Conv2D>,
}

impl Block {
    pub(super) fn new(path: &nn::Path<'_>, from: i64, to: i64) -> Self {
        Self {
            first: conv(path / "first", from, to, 3),
            first_norm: nn::group_norm(path / "first_norm", GROUPS, to, Default::default()),
            second: conv(path / "second", to, to, 3),
            second_norm: nn::group_norm(path / "second_norm", GROUPS, to, Default::default()),
            past: (from != to).then(|| conv(path / "past", from, to, 1)),
        }
    }
}

impl Module for Block {
    fn forward(&self, x: &Tensor) -> Tensor {
        let inner = x.apply(&self.first).apply(&self.first_norm).relu_();
        let inner = inner.apply(&self.second).apply(&self.second_norm);
        match &self.past {
            Some(past) => inner + x.apply(past),
            None => inner + x,
        }
        .relu_()
    }
}

/// A U-Net of four levels; the planes halve and the width doubles from one to the next.
#[derive(Debug)]
pub(super) struct UNet {
    down: Vec<Block>,
    up: Vec<Block>,
}

impl UNet {
    /// From `from` channels to `width`.
    pub(super) fn new(path: &nn::Path<'_>, from: i64, width: i64) -> Self {
        let widths = [width, 2 * width, 4 * width, 8 * width];
        let down = (0..4).map(|level| {
            let from = if level == 0 { from } else { widths[level - 1] };
            Block::new(&(path / format!("down{level}")), from, widths[level])
        });
        let up = (0..3)
            .map(|level| Block::new(&(path / format!("up{level}")), widths[level] + widths[level + 1], widths[level]));
        Self { down: down.collect(), up: up.collect() }
    }
}

impl Module for UNet {
    fn forward(&self, x: &Tensor) -> Tensor {
        let mut levels = vec![x.apply(&self.down[0])];
        for block in &self.down[1..] {
            let above = &levels[levels.len() - 1];
            levels.push(above.avg_pool2d(2, 2, 0, false, true, None).apply(block));
        }
        let mut below = levels.pop().unwrap_or_else(|| x.shallow_clone());
        for (level, block) in levels.iter().zip(&self.up).rev() {
            let size = level.size();
            let grown = below.upsample_nearest2d([size[2], size[3]], None, None);
            below = Tensor::cat(&[level, &grown], 1).apply(block);
        }
        below
    }
}
