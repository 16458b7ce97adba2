//! sigma_m's predictions: candidates in batches, windows around the pushes, gated with the probability of change.

use super::layout::{LEVELS, Layout, Mirror, OCCUPANCY, SEMANTICS, SUBS, VOXELS_PER_LEVEL};
use super::observe_net::{Evidence, LOG_EVIDENCE_LIMIT};
use super::push_net::{MARKS, PushNet, Pushed, WINDOW};
use crate::belief::{Belief, PushPrediction, SweptPush};
use crate::grid::Window;
use crate::scene::CLASS_COUNT;
use rayon::prelude::*;
use std::ops::Range;
use tch::{Device, Kind, Tensor};

/// Candidates that go through the network together.
const BATCH: usize = 16;
/// Probability of change below which a floor cell keeps its belief as it is.
const CHANGE_FLOOR: f32 = 0.02;

/// What pushes look like to the network, in windows (of mirrored planes, if so).
pub(crate) fn push_planes(layout: &Layout, pushes: &[(&SweptPush, Range<usize>)], mirror: Mirror) -> (Tensor, Tensor) {
    let width = pushes.first().map_or(0, |(_, x)| x.len());
    let across = layout.pixels()[1];
    let plane = width * across;
    let (mut swept, mut marks) =
        (vec![0.0_f32; OCCUPANCY * plane * pushes.len()], vec![0.0_f32; MARKS * plane * pushes.len()]);
    swept.par_chunks_mut(OCCUPANCY * plane).zip(marks.par_chunks_mut(MARKS * plane)).zip(pushes).for_each(
        |((swept, marks), (push, x))| {
            layout.put_set(&push.swept, mirror, x.clone(), swept);
            layout.put_marks(&push.push, mirror, x.clone(), marks);
        },
    );
    let tensor = |planes: &[f32], channels: usize| {
        Tensor::from_slice(planes).reshape([pushes.len() as i64, channels as i64, width as i64, across as i64])
    };
    (tensor(&swept, OCCUPANCY), tensor(&marks, MARKS))
}

/// Windows of planes `[1, C, X, Y]`, one above the other: `[B, C, WINDOW, Y]`.
pub(crate) fn windows(planes: &Tensor, xs: &[Range<usize>]) -> Tensor {
    let cut: Vec<Tensor> = xs.iter().map(|x| planes.narrow(2, x.start as i64, x.len() as i64)).collect();
    Tensor::cat(&cut, 0)
}

/// The predictions of a network for pushes from one belief, whose evidence is `prior`.
pub(super) fn predict(
    net: &PushNet,
    layout: &Layout,
    prior: &Evidence,
    belief: &Belief,
    pushes: &[SweptPush],
    device: Device,
) -> Vec<PushPrediction> {
    let stem = net.prior_stem(prior);
    let mut predictions = Vec::with_capacity(pushes.len());
    for batch in pushes.chunks(BATCH) {
        let xs: Vec<Range<usize>> = batch.iter().map(|push| layout.around(&push.push, WINDOW)).collect();
        let windowed: Vec<_> = batch.iter().zip(xs.iter().cloned()).collect();
        let (swept, marks) = push_planes(layout, &windowed, Mirror::No);
        let prior = Evidence { occupancy: windows(&prior.occupancy, &xs), semantics: windows(&prior.semantics, &xs) };
        let pushed = net.forward(&windows(&stem, &xs), &prior, &swept.to_device(device), &marks.to_device(device));
        let planes = Planes::of(&pushed, layout.pixels()[1]);
        predictions.par_extend(xs.into_par_iter().enumerate().map(|(at, x)| planes.prediction(at, layout, belief, x)));
    }
    predictions
}

/// Evidence and probability of change of a batch, on the processor.
struct Planes {
    occupancy: Vec<f32>,
    semantics: Vec<f32>,
    change: Vec<f32>,
    plane: usize,
    across: usize,
}

impl Planes {
    fn of(pushed: &Pushed, across: usize) -> Self {
        let values = |tensor: &Tensor| {
            let mut out = vec![0.0_f32; tensor.numel()];
            tensor.to_device(Device::Cpu).to_kind(Kind::Float).contiguous().copy_data(&mut out, tensor.numel());
            out
        };
        let evidence = |z: &Tensor| z.clamp_max(LOG_EVIDENCE_LIMIT).exp() + 1.0;
        let change = evidence(&pushed.change);
        let (yes, no) = (change.narrow(1, 0, SUBS as i64), change.narrow(1, SUBS as i64, SUBS as i64));
        let size = pushed.change.size();
        Self {
            occupancy: values(&evidence(&pushed.occupancy)),
            semantics: values(&evidence(&pushed.semantics)),
            change: values(&(&yes / (&yes + no))),
            plane: (size[2] * size[3]) as usize,
            across,
        }
    }

    /// The prediction of push `at` of the batch, whose window has the pixels `x`; cut to where something may change.
    fn prediction(&self, at: usize, layout: &Layout, belief: &Belief, x: Range<usize>) -> PushPrediction {
        let plane = self.plane;
        let part = |channels: usize| at * channels * plane..(at + 1) * channels * plane;
        let occupancy = &self.occupancy[part(2 * OCCUPANCY)];
        let semantics = &self.semantics[part(SEMANTICS)];
        let change = &self.change[part(SUBS)];
        let grid = &belief.grid;
        let place = |cell: usize| {
            let (cx, cy) = (cell / grid.dims[1], cell % grid.dims[1]);
            (cx % 2 * 2 + cy % 2, (cx / 2 - x.start) * self.across + cy / 2)
        };
        let chance = |cell: usize| {
            let (sub, pixel) = place(cell);
            let p = change[sub * plane + pixel];
            if p < CHANGE_FLOOR { 0.0 } else { p }
        };
        let reach =
            Window { x: [(2 * x.start).min(grid.dims[0]), (2 * x.end).min(grid.dims[0])], y: [0, grid.dims[1]] };
        let window = tight(reach, layout, &chance);
        let height = grid.dims[2];
        let mut prediction = PushPrediction {
            window,
            occupancy: Vec::with_capacity(window.cell_count() * height),
            semantics: Vec::with_capacity(window.cell_count()),
            change: Vec::with_capacity(window.cell_count()),
        };
        for cell in window.cells(grid) {
            let p = chance(cell);
            prediction.change.push(p);
            let (before, labels) = (&belief.occupancy[grid.column(cell)], &belief.semantics[cell]);
            if p == 0.0 {
                prediction.occupancy.extend_from_slice(before);
                prediction.semantics.push(*labels);
                continue;
            }
            let (sub, pixel) = place(cell);
            prediction.occupancy.extend(before.iter().enumerate().map(|(z, a)| {
                let level = (z / VOXELS_PER_LEVEL).min(LEVELS - 1);
                let after = |side: usize| occupancy[((side * LEVELS + level) * SUBS + sub) * plane + pixel];
                gated(a, &[after(0), after(1)], p)
            }));
            let after: [f32; CLASS_COUNT] = std::array::from_fn(|k| semantics[(k * SUBS + sub) * plane + pixel]);
            prediction.semantics.push(gated(labels, &after, p));
        }
        prediction
    }
}

/// What is believed when with probability `p` a cell changes, and then has evidence `after`, and else keeps its evidence.
///
/// The means are mixed, `P = (1 - p) P_kept + p P_changed`, and so are the epistemic uncertainties `K / sum(a)`. (Mixing
/// the evidence itself, `(1 - p) a + p a_changed`, would let what was once well known drown a prediction that is
/// honestly unsure, however probable the change.)
fn gated<const K: usize>(kept: &[f32; K], after: &[f32; K], p: f32) -> [f32; K] {
    let sums = [kept, after].map(|a| a.iter().sum::<f32>());
    let sum = 1.0 / ((1.0 - p) / sums[0] + p / sums[1]);
    std::array::from_fn(|k| sum * ((1.0 - p) * kept[k] / sums[0] + p * after[k] / sums[1]))
}

/// The smallest window within `reach` that holds every cell with a chance of change; one cell when there is none.
fn tight(reach: Window, layout: &Layout, chance: &impl Fn(usize) -> f32) -> Window {
    let depth = layout.grid().dims[1];
    let (mut low, mut high) = ([usize::MAX; 2], [0_usize; 2]);
    for cell in reach.cells(layout.grid()).filter(|cell| chance(*cell) > 0.0) {
        for (axis, at) in [cell / depth, cell % depth].into_iter().enumerate() {
            low[axis] = low[axis].min(at);
            high[axis] = high[axis].max(at + 1);
        }
    }
    if high[0] == 0 {
        return Window { x: [reach.x[0], reach.x[0] + 1], y: [reach.y[0], reach.y[0] + 1] };
    }
    Window { x: [low[0], high[0]], y: [low[1], high[1]] }
}

#[cfg(test)]
mod tests {
    use super::gated;

    #[test]
    fn a_gate_mixes_probabilities_and_not_evidence() {
        let (kept, after) = ([98.0, 2.0], [1.0, 3.0]);
        let mean = |a: [f32; 2]| a[0] / (a[0] + a[1]);
        for p in [0.0, 0.3, 0.9, 1.0] {
            let posterior = gated(&kept, &after, p);
            assert!((mean(posterior) - ((1.0 - p) * 0.98 + p * 0.25)).abs() < 1e-5, "{p}: {posterior:?}");
        }
        let close = |a: [f32; 2], b: [f32; 2]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-3);
        assert!(close(gated(&kept, &after, 0.0), kept) && close(gated(&kept, &after, 1.0), after));
        // Half and half is little better known than the worse known of the two.
        let sum: f32 = gated(&kept, &after, 0.5).iter().sum();
        assert!((sum - 1.0 / (0.5 / 100.0 + 0.5 / 4.0)).abs() < 1e-3, "{sum}");
    }
}
