//! Modules of the user's own in place of sigma_o and sigma_m, as a belief update.
//!
//! A module sees the belief's own arrays, `[x][y][z]` as in `beliefs/NNN.npz`, in single precision and without a batch; what
//! it answers is believed as it is. W, D, H are the numbers of voxels along x, y, z.
//!
//! | sigma_o | shape | what it is |
//! |---|---|---|
//! | input `occupancy` | `[W, D, H, 2]` | evidence for occupied and free before the look; ones where nothing is known |
//! | input `semantics` | `[W, D, 15]` | Dirichlet over the classes before the look |
//! | input `seen` | `[W, D, H, 2]` | 1 where the look found something; 1 where rays passed; never both |
//! | input `labels` | `[W, D, 15]` | 1 at the class that the look saw from above, all 0 where it saw none |
//! | answer | as `occupancy`, `semantics` | the evidence after the look, each number at least 0.001 |
//!
//! | sigma_m | shape | what it is |
//! |---|---|---|
//! | inputs `occupancy`, `semantics` | as above | the belief before the manipulation |
//! | input `swept` | `[W, D, H]` | 1 where arm and tool pass |
//! | input `flow` | `[W, D, 3]` | 1 where something is expected to move, and by how many cells along x and y |
//! | input `stroke` | `[6]` | in cells from the grid's corner: start x, y of the tool's way in contact, its direction x, y, its length; and the edge of a voxel in metres |
//! | answer | as `occupancy`, `semantics`, and `[W, D]` | the belief afterwards, and the probability that a cell changes; where that is 0 the belief stays |
//!
//! What is held by a suction cup moves as a whole; sigma_m is not asked.

use super::module::{Module, Range, Wanted};
use crate::belief::{
    Belief, BeliefUpdate, Intervention, ModuleFiles, NetworksUsed, Prediction, Weights, mixed_name, predict_held_apart,
};
use crate::camera::{MapObservation, UNOBSERVED};
use crate::grid::{Grid, VoxelSet, Window};
use crate::scene::CLASS_COUNT;
use crate::{Error, Result};
use probing::{probe_intervention, probe_observation};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use tch::{Device, Tensor};

mod probing;

/// Modules of the user's own; what they do not do, another update does.
pub(super) struct Own {
    name: String,
    sigma_o: Option<Module>,
    sigma_m: Option<Module>,
    rest: Arc<dyn BeliefUpdate>,
    device: Device,
    /// The file and the words of what went wrong first.
    fault: Mutex<Option<(PathBuf, String)>>,
}

impl Own {
    /// Loads modules; `rest` does what is not given.
    ///
    /// # Errors
    /// For a file that is missing or no TorchScript module.
    pub(super) fn load(
        sigma_o: Option<&Path>,
        sigma_m: Option<&Path>,
        rest: Arc<dyn BeliefUpdate>,
        device: Device,
    ) -> Result<Self> {
        let load = |path: Option<&Path>| path.map(|path| Module::load(path, device)).transpose();
        let (sigma_o, sigma_m) = (load(sigma_o)?, load(sigma_m)?);
        let name = mixed_name(sigma_o.is_some(), sigma_m.is_some(), rest.name());
        Ok(Self { name, sigma_o, sigma_m, rest, device, fault: Mutex::default() })
    }

    fn fail(&self, module: &Module, words: String) {
        let mut fault = self.fault.lock().unwrap_or_else(PoisonError::into_inner);
        fault.get_or_insert_with(|| (module.path().to_owned(), words));
    }
}

/// What a module knows of a belief, on the processor.
fn belief_tensors(belief: &Belief) -> [(&'static str, Tensor); 2] {
    let Belief { grid, occupancy, semantics } = belief;
    [
        ("occupancy", tensor(occupancy.as_flattened(), &occupancy_shape(grid))),
        ("semantics", tensor(semantics.as_flattened(), &semantics_shape(grid))),
    ]
}

fn tensor(numbers: &[f32], shape: &[i64]) -> Tensor {
    Tensor::from_slice(numbers).reshape(shape)
}

fn occupancy_shape(grid: &Grid) -> Vec<i64> {
    grid.dims.iter().map(|n| *n as i64).chain([2]).collect()
}

fn semantics_shape(grid: &Grid) -> Vec<i64> {
    vec![grid.dims[0] as i64, grid.dims[1] as i64, CLASS_COUNT as i64]
}

fn wanted_belief(grid: &Grid) -> [Wanted; 2] {
    [("occupancy", occupancy_shape(grid)), ("semantics", semantics_shape(grid))].map(|(name, shape)| Wanted {
        name,
        shape,
        range: Range::Evidence,
    })
}

fn set_into(set: &VoxelSet, each: usize, offset: usize, out: &mut [f32]) {
    set.iter().for_each(|voxel| out[each * voxel + offset] = 1.0);
}

/// The belief after a look, as a module answers.
fn observed(module: &Module, belief: &Belief, observation: &MapObservation) -> std::result::Result<Belief, String> {
    let grid = belief.grid;
    let mut seen = vec![0.0; 2 * grid.voxel_count()];
    set_into(&observation.occupied, 2, 0, &mut seen);
    set_into(&observation.free, 2, 1, &mut seen);
    let mut labels = vec![0.0; CLASS_COUNT * grid.cell_count()];
    for (cell, label) in observation.labels.iter().enumerate().filter(|(_, label)| **label != UNOBSERVED) {
        if usize::from(*label) < CLASS_COUNT {
            labels[CLASS_COUNT * cell + usize::from(*label)] = 1.0;
        }
    }
    let [occupancy, semantics] = belief_tensors(belief);
    let seen = ("seen", tensor(&seen, &occupancy_shape(&grid)));
    let labels = ("labels", tensor(&labels, &semantics_shape(&grid)));
    let answer = module.ask(&[occupancy, semantics, seen, labels], &wanted_belief(&grid))?;
    Ok(Belief { grid, occupancy: answer[0].as_chunks().0.to_vec(), semantics: answer[1].as_chunks().0.to_vec() })
}

/// The prediction for a manipulation, as a module answers; `before` is the belief as tensors.
fn predicted(
    module: &Module,
    belief: &Belief,
    before: [(&'static str, Tensor); 2],
    intervention: &Intervention,
) -> std::result::Result<Prediction, String> {
    let grid = belief.grid;
    let [width, depth, height] = grid.dims;
    let mut swept = vec![0.0; grid.voxel_count()];
    set_into(&intervention.swept, 1, 0, &mut swept);
    let mut flow = vec![0.0; 3 * grid.cell_count()];
    for (cell, displacement_m) in intervention.flow.window.cells(&grid).zip(&intervention.flow.displacement_m) {
        if let Some([dx, dy]) = displacement_m.map(|moved| moved.map(|m| (m / grid.voxel_m).round())) {
            flow[3 * cell..3 * cell + 3].copy_from_slice(&[1.0, dx, dy]);
        }
    }
    let stroke = &intervention.stroke;
    let start = [0, 1].map(|axis| (stroke.start[axis] - grid.origin[axis]) / grid.voxel_m);
    let stroke =
        [start[0], start[1], stroke.direction.x, stroke.direction.y, stroke.length_m / grid.voxel_m, grid.voxel_m];
    let [occupancy, semantics] = before;
    let dims = grid.dims.map(|n| n as i64);
    let inputs = [
        occupancy,
        semantics,
        ("swept", tensor(&swept, &dims)),
        ("flow", tensor(&flow, &[dims[0], dims[1], 3])),
        ("stroke", tensor(&stroke, &[6])),
    ];
    let change = Wanted { name: "change", shape: vec![dims[0], dims[1]], range: Range::Probability };
    let [wanted_occupancy, wanted_semantics] = wanted_belief(&grid);
    let answer = module.ask(&inputs, &[wanted_occupancy, wanted_semantics, change])?;
    let (occupancy, change) = (answer[0].as_chunks::<2>().0, &answer[2]);
    let semantics = answer[1].as_chunks::<CLASS_COUNT>().0;
    let window = around(change, [width, depth]);
    let mut prediction = unchanged(belief, window);
    for (at, cell) in window.cells(&grid).enumerate().filter(|(_, cell)| change[*cell] > 0.0) {
        prediction.occupancy[at * height..(at + 1) * height].copy_from_slice(&occupancy[grid.column(cell)]);
        prediction.semantics[at] = semantics[cell];
        prediction.change[at] = change[cell];
    }
    Ok(prediction)
}

/// The smallest window that holds all that may change; one cell where nothing does.
fn around(change: &[f32], [width, depth]: [usize; 2]) -> Window {
    let (mut low, mut high) = ([width, depth], [0, 0]);
    for cell in (0..change.len()).filter(|cell| change[*cell] > 0.0) {
        for (axis, at) in [cell / depth, cell % depth].into_iter().enumerate() {
            low[axis] = low[axis].min(at);
            high[axis] = high[axis].max(at + 1);
        }
    }
    if high == [0, 0] { Window { x: [0, 1], y: [0, 1] } } else { Window { x: [low[0], high[0]], y: [low[1], high[1]] } }
}

/// The prediction that everything stays as it is.
fn unchanged(belief: &Belief, window: Window) -> Prediction {
    let cells = || window.cells(&belief.grid);
    Prediction {
        window,
        occupancy: cells().flat_map(|cell| belief.occupancy[belief.grid.column(cell)].iter().copied()).collect(),
        semantics: cells().map(|cell| belief.semantics[cell]).collect(),
        change: vec![0.0; window.cell_count()],
    }
}

impl BeliefUpdate for Own {
    fn name(&self) -> &str {
        &self.name
    }

    /// Has every module answer once on the grid's size.
    fn check_grid(&self, grid: &Grid) -> Result<()> {
        if self.sigma_o.is_none() || self.sigma_m.is_none() {
            self.rest.check_grid(grid)?;
        }
        let belief = Belief::uniform(*grid);
        if let Some(module) = &self.sigma_o {
            let refused = |words| Error::input(module.path(), "sigma_o", words);
            observed(module, &belief, &probe_observation(grid)).map_err(refused)?;
        }
        if let Some(module) = &self.sigma_m {
            let refused = |words| Error::input(module.path(), "sigma_m", words);
            predicted(module, &belief, belief_tensors(&belief), &probe_intervention(grid)).map_err(refused)?;
        }
        Ok(())
    }

    fn wears(&self) -> bool {
        self.sigma_o.is_none() && self.rest.wears()
    }

    fn networks_used(&self) -> Option<NetworksUsed> {
        let rest = self.rest.networks_used();
        let Weights { sigma_o, sigma_m, change_temperature } = rest.map(|used| used.weights).unwrap_or_default();
        let hash = |own: &Option<Module>, rest| own.as_ref().map_or(rest, |own| Some(own.sha256().to_owned()));
        let weights = Weights {
            sigma_o: hash(&self.sigma_o, sigma_o),
            sigma_m: hash(&self.sigma_m, sigma_m),
            change_temperature: change_temperature.filter(|_| self.sigma_m.is_none()),
        };
        let file = |own: &Option<Module>| own.as_ref().map(Module::file_name);
        Some(NetworksUsed {
            weights,
            modules: ModuleFiles { sigma_o: file(&self.sigma_o), sigma_m: file(&self.sigma_m) },
            libtorch: env!("NUDGE_LIBTORCH").to_owned(),
            device: if self.device.is_cuda() { "cuda" } else { "cpu" }.to_owned(),
        })
    }

    fn fault(&self) -> Option<Error> {
        let fault = self.fault.lock().unwrap_or_else(PoisonError::into_inner);
        fault.as_ref().map(|(path, words)| Error::input(path, "", words.clone())).or_else(|| self.rest.fault())
    }

    fn observe(&self, belief: &Belief, observation: &MapObservation) -> Belief {
        let Some(module) = &self.sigma_o else { return self.rest.observe(belief, observation) };
        observed(module, belief, observation).unwrap_or_else(|words| {
            self.fail(module, words);
            belief.clone()
        })
    }

    fn predict(&self, belief: &Belief, interventions: &[Intervention]) -> Vec<Prediction> {
        let Some(module) = &self.sigma_m else { return self.rest.predict(belief, interventions) };
        predict_held_apart(belief, interventions, |rest| {
            let before = belief_tensors(belief);
            // A tensor may go to another thread, but two threads may not share one.
            let asked: Vec<_> = rest
                .iter()
                .map(|intervention| (intervention, before.each_ref().map(|(name, t)| (*name, t.shallow_clone()))))
                .collect();
            let predict = |(intervention, before): (&Intervention, [(&'static str, Tensor); 2])| {
                predicted(module, belief, before, intervention).unwrap_or_else(|words| {
                    self.fail(module, words);
                    unchanged(belief, Window { x: [0, 1], y: [0, 1] })
                })
            };
            asked.into_par_iter().map(predict).collect()
        })
    }
}
