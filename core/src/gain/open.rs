//! What pushes open: what can be seen after a push, from anywhere, that could not be seen before.
//!
//! A push is not judged by the one look that follows: what was in view before can be looked at without it. It is worth
//! the space that it opens to all views together, each voxel counted once: `sum_k H(p'_k) max(0, V'_k - max(V_k, S_k))`
//! over voxels `k`, where `p'` is the predicted belief, `V_k` and `V'_k` tell whether any ray of any view reaches the
//! voxel before and after the push, and `S_k` whether a look has seen it or it is believed to be free (`p < 0.05`):
//! making those uncertain is no gain.
//!
//! A ray passes where the most likely map is free (`p < 0.5`). Under the expected transmittance of
//! [`super::gain_of_views`] an unseen chamber would block every ray after a few voxels of `p = 0.3`, so that opening it
//! would be worth the same whether it is deep or shallow.

use super::RayDensity;
use super::code::{LIKELIEST, Matter};
use super::field::GainField;
use super::ray::{Camera, Ray, Tally};
use super::skip::is_transparent;
use crate::belief::Prediction;
use crate::camera::{ViewArray, ViewId};
use rayon::prelude::*;

/// What all views together reach under one field, so that under a prediction only those rays are walked that are no
/// longer stopped where they were: no other reaches anything new.
pub struct Openings {
    /// Without skip levels: few rays are walked, and to keep the levels right would cost more than stepping.
    field: GainField,
    /// What stops each ray, a position in the padded grid.
    stops: Vec<usize>,
    /// Each ray where it enters.
    rays: Vec<Ray>,
    /// Per voxel of the padded grid whether a ray reaches it, a look has seen it, or it is believed to be free: 1 or 0, or a
    /// share between.
    open: Vec<f32>,
}

/// Pushes that share what is allocated for them, at least.
const MIN_TOGETHER: usize = 8;

/// What some of the views reach.
type Walked = (Vec<usize>, Vec<Ray>, Vec<f32>);

impl Openings {
    /// Walks all rays of the given views.
    pub fn new(field: &GainField, array: &ViewArray, ids: &[ViewId], density: RayDensity) -> Self {
        let free: Vec<f32> = field.codes.iter().map(|code| f32::from(u8::from(is_transparent(*code)))).collect();
        let open = match &field.seen {
            None => free,
            Some(seen) => free.iter().zip(seen.iter()).map(|(free, seen)| free.max(*seen)).collect(),
        };
        let begin = || (Vec::new(), Vec::new(), open.clone());
        let walk = |(mut stops, mut rays, mut open): Walked, &id: &ViewId| {
            let camera = Camera::of(field, array, id);
            let down = camera.rays(density)[1];
            camera.for_each_ray(field, density, |number, ray| {
                let mut tally = Open { open: &mut open, stop: 0 };
                ray.walk(field, &mut tally);
                // From its entry on: something may come to stand where it passed.
                if let Some(entering) = camera.ray(field, density, [number / down, number % down]) {
                    stops.push(tally.stop);
                    rays.push(entering);
                }
            });
            (stops, rays, open)
        };
        let join = |(mut stops, mut rays, mut open): Walked, (other_stops, other_rays, other_open): Walked| {
            stops.extend(other_stops);
            rays.extend(other_rays);
            open.iter_mut().zip(&other_open).for_each(|(open, other)| *open = open.max(*other));
            (stops, rays, open)
        };
        let (stops, rays, open) = ids.par_iter().fold(begin, walk).reduce(begin, join);
        Self { field: field.flat(), stops, rays, open }
    }

    /// What each of some pushes opens, nats.
    pub fn under_each(&self, predictions: &[Prediction]) -> Vec<f32> {
        let scratch = || (self.field.clone(), Opened::beyond(&self.open));
        let of = |(field, opened): &mut (GainField, Opened<'_>), prediction| self.under(prediction, field, opened);
        predictions.par_iter().with_min_len(MIN_TOGETHER).map_init(scratch, of).collect()
    }

    /// Where what a push opens comes from: voxel positions and their nats, in ascending order of position.
    pub fn per_voxel(&self, prediction: &Prediction) -> Vec<(usize, f32)> {
        let (mut field, mut opened) = (self.field.clone(), Opened::beyond(&self.open));
        field.overwrite(prediction);
        self.walk(&field, &mut opened);
        let nats = |voxel: usize| {
            let at = field.layout.padded(voxel);
            let more = if opened.opened[at] > 0.0 { opened.opened[at] - self.open[at] } else { 0.0 };
            more * LIKELIEST[usize::from(field.codes[at])].information
        };
        let voxels = (0..field.grid().voxel_count()).map(|voxel| (voxel, nats(voxel)));
        voxels.filter(|(_, nats)| *nats > 0.0).collect()
    }

    /// What a push opens; `field` is a copy of the own one, and is that again afterwards.
    fn under(&self, prediction: &Prediction, field: &mut GainField, opened: &mut Opened<'_>) -> f32 {
        field.overwrite(prediction);
        self.walk(field, opened);
        field.restore(&self.field, prediction.window);
        opened.take()
    }

    /// Walks the rays that are no longer stopped where they were.
    fn walk(&self, field: &GainField, opened: &mut Opened<'_>) {
        for (stop, ray) in self.stops.iter().zip(&self.rays) {
            if LIKELIEST[usize::from(field.codes[*stop])].pass > 0.0 {
                ray.walk(field, opened);
            }
        }
    }
}

/// The gain of some views together, nats, counted in the same way: each unseen voxel once, if a ray reaches it through
/// the most likely map.
pub fn gain_together(field: &GainField, array: &ViewArray, ids: &[ViewId], density: RayDensity) -> f32 {
    let nothing;
    let open = match &field.seen {
        Some(seen) => &seen[..],
        None => {
            nothing = vec![0.0; field.codes.len()];
            &nothing[..]
        }
    };
    let mut tally = Opened::beyond(open);
    for &id in ids {
        Camera::of(field, array, id).for_each_ray(field, density, |_, ray| ray.walk(field, &mut tally));
    }
    tally.take()
}

/// Voxels that rays reach, and what stopped the last ray.
struct Open<'a> {
    open: &'a mut [f32],
    stop: usize,
}

impl Tally for Open<'_> {
    fn matter(&self) -> &'static [Matter; 256] {
        &LIKELIEST
    }

    #[inline(always)]
    fn visit(&mut self, index: usize, _information: f32, transmittance: f32) {
        if transmittance > 0.0 {
            self.open[index] = self.open[index].max(transmittance);
            self.stop = index;
        }
    }
}

/// Information of the voxels that rays reach and that were not open.
struct Opened<'a> {
    open: &'a [f32],
    opened: Vec<f32>,
    /// Where `opened` is not 0.
    touched: Vec<usize>,
    nats: f64,
}

impl<'a> Opened<'a> {
    fn beyond(open: &'a [f32]) -> Self {
        Self { open, opened: vec![0.0; open.len()], touched: Vec::new(), nats: 0.0 }
    }

    /// The sum, nats, after which nothing is opened any more.
    fn take(&mut self) -> f32 {
        self.touched.drain(..).for_each(|index| self.opened[index] = 0.0);
        std::mem::take(&mut self.nats) as f32
    }
}

impl Tally for Opened<'_> {
    fn matter(&self) -> &'static [Matter; 256] {
        &LIKELIEST
    }

    #[inline(always)]
    fn visit(&mut self, index: usize, information: f32, transmittance: f32) {
        let more = (transmittance - self.open[index].max(self.opened[index])).max(0.0);
        if more > 0.0 {
            if self.opened[index] == 0.0 {
                self.touched.push(index);
            }
            self.opened[index] = transmittance;
            self.nats += f64::from(more * information);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::code::MATTER;
    use super::super::tests::support::{exactly, facing, patchy, small_grid, standard};
    use super::*;
    use crate::belief::{Belief, bernoulli_entropy};
    use crate::grid::{Grid, VoxelSet, Window};
    use crate::scene::CLASS_COUNT;

    const EVERY: RayDensity = RayDensity { stride_px: 1 };

    /// A row of voxels of 0.1 m into the shelf, a camera that looks straight into it, and the prediction of other
    /// probabilities for it.
    fn row(before: &[f32], after: &[f32]) -> (Belief, ViewArray, Prediction) {
        let grid = Grid::for_shelf([0.1, 0.1 * before.len() as f32, 0.1], 0.1);
        let prediction = Prediction {
            window: Window::whole(&grid),
            occupancy: after.iter().map(|p| [*p, 1.0 - p]).collect(),
            semantics: vec![[1.0; CLASS_COUNT]; after.len()],
            change: vec![1.0; after.len()],
        };
        (exactly(grid, |voxel| before[usize::from(voxel.y)]), facing([0.0, -0.3, 0.05]), prediction)
    }

    fn opened(before: &[f32], after: &[f32], seen: &[usize]) -> f32 {
        let (belief, array, prediction) = row(before, after);
        let mut set = VoxelSet::empty(&belief.grid);
        seen.iter().for_each(|&voxel| set.insert(voxel));
        let field = GainField::new(&belief).with_seen(&set);
        Openings::new(&field, &array, &[ViewId(0)], EVERY).under_each(&[prediction])[0]
    }

    #[test]
    fn a_push_opens_what_was_behind_and_what_is_deep_counts_in_full() {
        let (h3, h5) = (bernoulli_entropy(0.3), bernoulli_entropy(0.5));
        let near = |value: f32, expected: f32| assert!((value - expected).abs() < 0.01, "{value} is not {expected}");
        // The first voxel leaves: a chamber as deep as may be, up to what is as likely occupied as not.
        near(opened(&[0.97, 0.3, 0.3, 0.3, 0.5, 0.3], &[0.01, 0.3, 0.3, 0.3, 0.5, 0.3], &[]), 3.0 * h3 + h5);
        // What could be reached before is not opened, seen or not.
        near(opened(&[0.3, 0.97, 0.3], &[0.3, 0.01, 0.3], &[]), h3);
        // What a look has seen is not opened again.
        near(opened(&[0.97, 0.3, 0.3], &[0.01, 0.3, 0.3], &[1]), h3);
        // A thing that comes in the way opens nothing, nor does one that blurs.
        assert_eq!(opened(&[0.01, 0.3, 0.3], &[0.97, 0.3, 0.3], &[]), 0.0);
        assert_eq!(opened(&[0.01, 0.3, 0.3], &[0.4, 0.3, 0.3], &[]), 0.0);
        assert_eq!(opened(&[0.01, 0.3, 0.3], &[0.01, 0.3, 0.3], &[]), 0.0);
    }

    #[test]
    fn looks_together_count_each_voxel_once() {
        let (belief, array, _) = row(&[0.3, 0.3, 0.97, 0.3], &[0.3; 4]);
        let field = GainField::new(&belief);
        let gain = gain_together(&field, &array, &[ViewId(0); 2], EVERY);
        assert!((gain - 2.0 * bernoulli_entropy(0.3)).abs() < 0.01, "{gain}");
        let mut seen = VoxelSet::empty(&belief.grid);
        seen.insert(0);
        let gain = gain_together(&field.with_seen(&seen), &array, &[ViewId(0)], EVERY);
        assert!((gain - bernoulli_entropy(0.3)).abs() < 0.01, "{gain}");
        assert_eq!(gain_together(&field, &array, &[], EVERY), 0.0);
    }

    #[test]
    fn walking_only_rays_that_go_on_leaves_nothing_out() {
        let (grid, array) = (small_grid(), standard());
        let ids: Vec<ViewId> = (0..300).step_by(29).map(ViewId).collect();
        let density = RayDensity { stride_px: 24 };
        let reach = |field: &GainField| {
            let mut open = vec![0.0; field.codes.len()];
            for &id in &ids {
                Camera::of(field, &array, id).for_each_ray(field, density, |_, ray| {
                    ray.walk(field, &mut Open { open: &mut open, stop: 0 });
                });
            }
            open
        };
        let mut total = 0.0;
        for seed in 0..12 {
            let (belief, other) = (patchy(grid, seed), patchy(grid, 100 + seed));
            let window = Window { x: [6, 24], y: [2, 15] };
            let prediction = Prediction {
                window,
                occupancy: window.cells(&grid).flat_map(|cell| other.occupancy[grid.column(cell)].to_vec()).collect(),
                semantics: vec![[1.0; CLASS_COUNT]; window.cell_count()],
                change: vec![1.0; window.cell_count()],
            };
            let field = GainField::new(&belief);
            let after = field.with_prediction(&prediction);
            let mut was = reach(&field);
            was.iter_mut().zip(&field.codes).filter(|(_, code)| is_transparent(**code)).for_each(|(was, _)| *was = 1.0);
            let expected: f64 = reach(&after)
                .iter()
                .zip(was)
                .zip(&after.codes)
                .map(|((now, was), code)| f64::from((now - was).max(0.0) * MATTER[usize::from(*code)].information))
                .sum();
            let openings = Openings::new(&field, &array, &ids, density);
            let sources: f64 = openings.per_voxel(&prediction).iter().map(|(_, nats)| f64::from(*nats)).sum();
            assert!((sources - expected).abs() < 1e-3 * (1.0 + expected), "{sources} by voxel is not {expected}");
            let opened = openings.under_each(&[prediction])[0];
            assert!((f64::from(opened) - expected).abs() < 1e-4 * (1.0 + expected), "{opened} is not {expected}");
            total += expected;
        }
        assert!(total > 100.0, "the test opens something: {total}");
    }
}
