//! sigma_m's predictions: candidates in batches, windows around the pushes, heads only where something is likely to change,
//! gated with the probability of change.

use super::layout::{LEVELS, Layout, Mirror, OCCUPANCY, SEMANTICS, SUBS, VOXELS_PER_LEVEL};
use super::observe_net::{Evidence, LOG_EVIDENCE_LIMIT};
use super::pool::Pool;
use super::push_net::{Body, MARKS, Pixels, PriorParts, PushNet, PushPlanes, WINDOW};
use crate::belief::{Belief, Intervention, Moved, Prediction, Stroke};
use crate::grid::{VoxelSet, Window};
use crate::scene::CLASS_COUNT;
use rayon::prelude::*;
use std::ops::Range;
use tch::{Device, Kind, Tensor};

/// Candidates that go through the network together; batches go through side by side.
const BATCH: usize = 8;
/// Probability of change below which a floor cell keeps its belief as it is.
const CHANGE_FLOOR: f32 = 0.05;

/// An intervention as the network sees it, in the pixels of its window: sigma_m was trained on pushes, of which it sees the
/// swept volume, both ends of the stroke, and the object that moves, before and after.
pub(crate) struct Windowed<'a> {
    pub(crate) swept: &'a VoxelSet,
    pub(crate) stroke: &'a Stroke,
    pub(crate) moved: &'a Moved,
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

/// Inputs that describe pushes to the network, in windows (of mirrored planes, if asked for), from the logarithms of
/// the (mirrored) prior's evidence.
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
            if !push.moved.is_nothing() {
                layout.put_arriving(push.moved, &prior.0[which], mirror, push.x.clone(), out);
            }
        })
    };
    PushPlanes {
        swept: planes(OCCUPANCY, &|push, out| layout.put_set(push.swept, mirror, push.x.clone(), out)),
        marks: planes(MARKS, &|push, out| {
            let (ends, carry) = out.split_at_mut(out.len() / 2);
            layout.put_marks(push.stroke, mirror, push.x.clone(), ends);
            if !push.moved.is_nothing() {
                layout.put_moved(push.moved, mirror, push.x.clone(), carry);
            }
        }),
        arriving: Evidence { occupancy: arriving(0, 2 * OCCUPANCY), semantics: arriving(1, SEMANTICS) },
    }
}

/// The predictions of sigma_m for interventions in one belief, whose evidence is `prior`; its log-odds of change are divided by
/// its temperature. `None` where there is no sigma_m.
pub(super) fn predict(
    pool: &Pool,
    layout: &Layout,
    prior: &Evidence,
    belief: &Belief,
    interventions: &[Intervention],
) -> Option<Vec<Prediction>> {
    let (parts, temperature, device) = {
        let networks = pool.take();
        let (net, temperature) = networks.push.as_ref()?;
        (tch::no_grad(|| net.prior_parts(prior)), *temperature, networks.device())
    };
    let numbers = Numbers::of(prior);
    let batches: Vec<_> = interventions.chunks(BATCH).map(|batch| (batch, parts.shared(), prior.shared())).collect();
    let predict = |(batch, parts, prior): (&[Intervention], PriorParts, Evidence)| {
        let moved: Vec<_> = batch.iter().map(|intervention| intervention.flow.moved(&belief.grid)).collect();
        let windowed: Vec<_> = batch
            .iter()
            .zip(&moved)
            .map(|(Intervention { swept, stroke, .. }, moved)| Windowed {
                swept,
                stroke,
                moved,
                x: layout.around(stroke, WINDOW),
            })
            .collect();
        let xs: Vec<Range<usize>> = windowed.iter().map(|push| push.x.clone()).collect();
        let planes = push_planes(layout, &numbers, &windowed, Mirror::No).to_device(device);
        let body = with_net(pool, |net| net.body(&parts.windows(&xs), &planes))?;
        let z = values(&body.change);
        let (z, each) = (&z[..], z.len() / xs.len());
        let changing: Vec<Changing> =
            z.par_chunks(each).zip(&xs).map(|(z, x)| Changing::new(z, temperature, layout, x.clone())).collect();
        let heads = with_net(pool, |net| Heads::of(net, &prior, &body, &planes, &changing, layout, device))?;
        let mut next = 0;
        let firsts = changing.iter().map(|changing| {
            next += changing.pixels.len();
            next - changing.pixels.len()
        });
        let firsts: Vec<usize> = firsts.collect();
        let each = changing.par_iter().zip(firsts).map(|(changing, first)| heads.prediction(changing, first, belief));
        Some(each.collect::<Vec<_>>())
    };
    let predictions: Option<Vec<Vec<Prediction>>> = batches.into_par_iter().map(predict).collect();
    predictions.map(|batches| batches.into_iter().flatten().collect())
}

/// What one of the pool's sigma_m answers; `work` asks nothing of rayon.
fn with_net<T>(pool: &Pool, work: impl FnOnce(&PushNet) -> T) -> Option<T> {
    let networks = pool.take();
    networks.push.as_ref().map(|(net, _)| tch::no_grad(|| work(net)))
}

/// Where a push is likely to change something.
struct Changing<'a> {
    layout: &'a Layout,
    /// Pixels of the window along x.
    x: Range<usize>,
    /// Probability of change per sub-cell and pixel of the window; 0 below [`CHANGE_FLOOR`].
    chance: Vec<f32>,
    /// Pixels of the window in which it is not 0 everywhere, in ascending order.
    pixels: Vec<usize>,
}

impl<'a> Changing<'a> {
    /// From the change planes of one window, for and against.
    fn new(z: &[f32], temperature: f32, layout: &'a Layout, x: Range<usize>) -> Self {
        let plane = z.len() / (2 * SUBS);
        let (yes, no) = z.split_at(SUBS * plane);
        let chance = |(&yes, &no): (&f32, &f32)| {
            let [yes, no] = evidence([yes, no]);
            let p = 1.0 / (1.0 + (no / yes).powf(1.0 / temperature));
            if p < CHANGE_FLOOR { 0.0 } else { p }
        };
        let chance: Vec<f32> = yes.iter().zip(no).map(chance).collect();
        let pixels = (0..plane).filter(|pixel| (0..SUBS).any(|sub| chance[sub * plane + pixel] > 0.0)).collect();
        Self { layout, x, chance, pixels }
    }

    /// Sub-cell and pixel of the window of a floor cell in it.
    fn place(&self, cell: usize) -> (usize, usize) {
        let (cx, cy) = (cell / self.layout.grid().dims[1], cell % self.layout.grid().dims[1]);
        (cx % 2 * 2 + cy % 2, (cx / 2 - self.x.start) * self.layout.pixels()[1] + cy / 2)
    }

    /// Probability that a floor cell of the window changes.
    fn of_cell(&self, cell: usize) -> f32 {
        let (sub, pixel) = self.place(cell);
        self.chance[sub * (self.chance.len() / SUBS) + pixel]
    }

    /// The smallest window that holds every cell with a chance of change; one cell when there is none.
    fn tight(&self) -> Window {
        let grid = self.layout.grid();
        let [width, depth, _] = grid.dims;
        let reach = Window { x: [(2 * self.x.start).min(width), (2 * self.x.end).min(width)], y: [0, depth] };
        let (mut low, mut high) = ([usize::MAX; 2], [0_usize; 2]);
        for cell in reach.cells(grid).filter(|cell| self.of_cell(*cell) > 0.0) {
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
}

/// What the heads give at the pixels of a batch where something is likely to change, on the processor.
struct Heads {
    /// Pixel by pixel `2 * levels * 4` and `classes * 4` numbers.
    occupancy: Vec<f32>,
    semantics: Vec<f32>,
}

impl Heads {
    fn of(
        net: &PushNet,
        prior: &Evidence,
        body: &Body,
        planes: &PushPlanes,
        changing: &[Changing<'_>],
        layout: &Layout,
        device: Device,
    ) -> Self {
        let numbered = changing.iter().enumerate();
        let all = numbered.flat_map(|(window, changing)| {
            let first = changing.x.start * layout.pixels()[1];
            changing.pixels.iter().map(move |&pixel| [window, pixel, first + pixel].map(|n| n as i64))
        });
        let all: Vec<[i64; 3]> = all.collect();
        if all.is_empty() {
            return Self { occupancy: Vec::new(), semantics: Vec::new() };
        }
        let column = |which: usize| all.iter().map(|numbers| numbers[which]).collect::<Vec<i64>>();
        let in_windows = Pixels::new(&column(0), &column(1), device);
        let in_whole = Pixels::new(&vec![0; all.len()], &column(2), device);
        let (occupancy, semantics) = net.heads(
            &body.at(&in_windows),
            &in_whole.of_evidence(prior),
            &in_windows.of(&planes.swept),
            &in_windows.of_evidence(&planes.arriving),
        );
        let by_pixel = |planes: &Tensor| values(&planes.transpose(1, 2));
        Self { occupancy: by_pixel(&occupancy), semantics: by_pixel(&semantics) }
    }

    /// The prediction of a push whose pixels begin at `first`; cut to where something may change.
    fn prediction(&self, changing: &Changing<'_>, first: usize, belief: &Belief) -> Prediction {
        let grid = &belief.grid;
        let window = changing.tight();
        let mut order = vec![0_usize; changing.chance.len() / SUBS];
        changing.pixels.iter().enumerate().for_each(|(at, &pixel)| order[pixel] = first + at);
        let mut prediction = Prediction {
            window,
            occupancy: Vec::with_capacity(window.cell_count() * grid.dims[2]),
            semantics: Vec::with_capacity(window.cell_count()),
            change: Vec::with_capacity(window.cell_count()),
        };
        for cell in window.cells(grid) {
            let p = changing.of_cell(cell);
            prediction.change.push(p);
            let (before, labels) = (&belief.occupancy[grid.column(cell)], &belief.semantics[cell]);
            if p == 0.0 {
                prediction.occupancy.extend_from_slice(before);
                prediction.semantics.push(*labels);
                continue;
            }
            let (sub, pixel) = changing.place(cell);
            let z = channels_of(&self.occupancy, 2 * OCCUPANCY, order[pixel]);
            let after: [[f32; 2]; LEVELS] =
                std::array::from_fn(|level| evidence([level, LEVELS + level].map(|plane| z[plane * SUBS + sub])));
            // The voxels of a level mostly share their evidence, and those above the levels too.
            let mut last = ([f32::NAN; 2], 0, [0.0; 2]);
            prediction.occupancy.extend(before.iter().enumerate().map(|(z, a)| {
                let level = (z / VOXELS_PER_LEVEL).min(LEVELS - 1);
                if (last.0, last.1) != (*a, level) {
                    last = (*a, level, gated(a, &after[level], p));
                }
                last.2
            }));
            let z = channels_of(&self.semantics, SEMANTICS, order[pixel]);
            let after: [f32; CLASS_COUNT] = evidence(std::array::from_fn(|class| z[class * SUBS + sub]));
            prediction.semantics.push(gated(labels, &after, p));
        }
        prediction
    }
}

/// The channels of a pixel.
fn channels_of(by_pixel: &[f32], channels: usize, pixel: usize) -> &[f32] {
    &by_pixel[pixel * channels..(pixel + 1) * channels]
}

/// Evidence `a = 1 + e^z`, limited as a network's state is ([`super::observe_net`]): all kinds are lowered alike.
fn evidence<const K: usize>(z: [f32; K]) -> [f32; K] {
    let above = (z.into_iter().fold(f32::MIN, f32::max) - LOG_EVIDENCE_LIMIT as f32).max(0.0);
    z.map(|z| 1.0 + (z - above).exp())
}

/// The belief of a cell that changes with probability `p` and then has evidence `after`, and otherwise keeps its
/// evidence.
///
/// The means are mixed, `P = (1 - p) P_kept + p P_changed`, and so are the epistemic uncertainties `K / sum(a)`.
/// (Mixing the evidence itself, `(1 - p) a + p a_changed`, would let large old evidence outweigh an uncertain
/// prediction, however probable the change is.)
#[inline(always)]
fn gated<const K: usize>(kept: &[f32; K], after: &[f32; K], p: f32) -> [f32; K] {
    let [kept_weight, after_weight] = [(kept, 1.0 - p), (after, p)].map(|(a, share)| share / a.iter().sum::<f32>());
    let sum = 1.0 / (kept_weight + after_weight);
    let [kept_weight, after_weight] = [kept_weight, after_weight].map(|weight| sum * weight);
    std::array::from_fn(|k| kept_weight * kept[k] + after_weight * after[k])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cnabu::{Network, Pushed};
    use tch::Kind;

    #[test]
    fn heads_at_some_pixels_are_those_of_the_whole_window() {
        let (batch, across) = (3, 8_i64);
        let store = tch::nn::VarStore::new(Device::Cpu);
        let net = crate::cnabu::seeded(1, || PushNet::new(&store.root(), 8));
        let random = |channels: usize| Tensor::rand([batch, channels as i64, 16, across], (Kind::Float, Device::Cpu));
        let evidence = || Evidence { occupancy: random(2 * OCCUPANCY), semantics: random(SEMANTICS) };
        let planes = PushPlanes { swept: random(OCCUPANCY), marks: random(MARKS), arriving: evidence() };
        let prior = evidence();
        let parts = net.prior_parts(&prior);
        let Pushed { occupancy, semantics, change } = net.forward(&parts, &prior, &planes);

        let body = net.body(&parts, &planes);
        assert!(body.change.equal(&change));
        let pixels = Pixels::new(&[0, 0, 2, 1], &[5, 77, 0, 127], Device::Cpu);
        let (some_occupancy, some_semantics) = net.heads(
            &body.at(&pixels),
            &pixels.of_evidence(&prior),
            &pixels.of(&planes.swept),
            &pixels.of_evidence(&planes.arriving),
        );
        for (some, whole) in [(some_occupancy, occupancy), (some_semantics, semantics)] {
            let off = (some - pixels.of(&whole)).abs().max().double_value(&[]);
            assert!(off < 1e-4, "{off}");
        }
        // The order of pixels is the one asked for.
        let at = change.double_value(&[2, 3, 0, 0]);
        assert_eq!(pixels.of(&change).double_value(&[0, 3, 2, 0]), at);
        let at = change.double_value(&[0, 1, 77 / across, 77 % across]);
        assert_eq!(pixels.of(&change).double_value(&[0, 1, 1, 0]), at);
    }

    #[test]
    fn evidence_of_pixels_is_limited_as_that_of_planes() {
        for z in [[9.0_f32, 1.0, 12.0], [6.5, -3.0, 2.0], [7.5, 7.5, 7.5]] {
            let planes = super::super::observe_net::limited(&Tensor::from_slice(&z).reshape([1, 3, 1, 1]), 3);
            let planes = values(&(planes.exp() + 1.0));
            assert!(evidence(z).iter().zip(&planes).all(|(a, b)| (a - b).abs() < 1e-3 * b), "{z:?} {planes:?}");
        }
    }

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
