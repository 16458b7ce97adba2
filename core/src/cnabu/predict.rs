//! sigma_m's predictions: candidates in batches, windows around the pushes, gated with the probability of change.

use super::layout::{LEVELS, Layout, Mirror, OCCUPANCY, SEMANTICS, SUBS, VOXELS_PER_LEVEL};
use super::observe_net::{Evidence, limited};
use super::push_net::{MARKS, PushNet, PushPlanes, Pushed, WINDOW};
use crate::belief::{Belief, Carried, FloorPlan, PushPrediction, SOLID, SweptPush};
use crate::grid::Window;
use crate::scene::CLASS_COUNT;
use rayon::prelude::*;
use std::ops::Range;
use tch::{Device, Kind, Tensor};

/// Candidates that go through the network together.
const BATCH: usize = 16;
/// Probability of change below which a floor cell keeps its belief as it is.
const CHANGE_FLOOR: f32 = 0.02;

/// A push, what it carries along, and the pixels of its window.
pub(crate) struct Windowed<'a> {
    pub(crate) push: &'a SweptPush,
    pub(crate) carried: Option<&'a Carried>,
    pub(crate) x: Range<usize>,
}

/// Planes of evidence as numbers that a window's can be taken from: occupancy and semantics.
pub(crate) struct Numbers([Vec<f32>; 2]);

impl Numbers {
    /// Those of evidence planes of one belief.
    pub(crate) fn of(evidence: &Evidence) -> Self {
        Self([values(&evidence.occupancy), values(&evidence.semantics)])
    }
}

/// A tensor's numbers, on the processor.
pub(super) fn values(tensor: &Tensor) -> Vec<f32> {
    let mut out = vec![0.0_f32; tensor.numel()];
    tensor.to_device(Device::Cpu).to_kind(Kind::Float).contiguous().copy_data(&mut out, tensor.numel());
    out
}

/// What pushes look like to the network, in windows (of mirrored planes, if so), from the logarithms of the (mirrored)
/// prior's evidence.
pub(crate) fn push_planes(layout: &Layout, prior: &Numbers, pushes: &[Windowed<'_>], mirror: Mirror) -> PushPlanes {
    let width = pushes.first().map_or(0, |push| push.x.len());
    let across = layout.pixels()[1];
    let plane = width * across;
    let planes = |channels: usize, fill: &(dyn Fn(&Windowed<'_>, &mut [f32]) + Sync)| {
        let mut out = vec![0.0_f32; channels * plane * pushes.len()];
        out.par_chunks_mut(channels * plane).zip(pushes).for_each(|(out, push)| fill(push, out));
        Tensor::from_slice(&out).reshape([pushes.len() as i64, channels as i64, width as i64, across as i64])
    };
    let arriving = |which: usize, channels: usize| {
        planes(channels, &|push, out| {
            if let Some(carried) = push.carried {
                layout.put_arriving(carried, &prior.0[which], mirror, push.x.clone(), out);
            }
        })
    };
    PushPlanes {
        swept: planes(OCCUPANCY, &|push, out| layout.put_set(&push.push.swept, mirror, push.x.clone(), out)),
        marks: planes(MARKS, &|push, out| {
            let (ends, carry) = out.split_at_mut(out.len() / 2);
            layout.put_marks(&push.push.push, mirror, push.x.clone(), ends);
            if let Some(carried) = push.carried {
                layout.put_carried(carried, mirror, push.x.clone(), carry);
            }
        }),
        arriving: Evidence { occupancy: arriving(0, 2 * OCCUPANCY), semantics: arriving(1, SEMANTICS) },
    }
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
    let numbers = Numbers::of(prior);
    let plan = FloorPlan::new(belief, SOLID);
    let mut predictions = Vec::with_capacity(pushes.len());
    for batch in pushes.chunks(BATCH) {
        let carried: Vec<_> = batch.par_iter().map(|push| Carried::by(push, belief, &plan)).collect();
        let windowed: Vec<_> = batch
            .iter()
            .zip(&carried)
            .map(|(push, carried)| Windowed { push, carried: carried.as_ref(), x: layout.around(&push.push, WINDOW) })
            .collect();
        let xs: Vec<Range<usize>> = windowed.iter().map(|push| push.x.clone()).collect();
        let planes = push_planes(layout, &numbers, &windowed, Mirror::No).to_device(device);
        let prior = Evidence { occupancy: windows(&prior.occupancy, &xs), semantics: windows(&prior.semantics, &xs) };
        let pushed = net.forward(&windows(&stem, &xs), &prior, &planes);
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
        let evidence = |z: &Tensor, kinds: usize| limited(z, kinds).exp() + 1.0;
        let change = evidence(&pushed.change, 2);
        let (yes, no) = (change.narrow(1, 0, SUBS as i64), change.narrow(1, SUBS as i64, SUBS as i64));
        let size = pushed.change.size();
        Self {
            occupancy: values(&evidence(&pushed.occupancy, 2)),
            semantics: values(&evidence(&pushed.semantics, CLASS_COUNT)),
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
