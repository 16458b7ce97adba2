//! Floor plans: one pixel a floor cell, x to the right, y (into the shelf) up.

use crate::colors::{self, Colormap, Rgb};
use image::RgbImage;
use nudge_core::belief::{self, Belief, MOST_SURPRISING};
use nudge_core::grid::Grid;
use nudge_core::scene::{BACKGROUND, CLASS_COUNT, Catalog, ClassId};
use nudge_core::score::SCORED_HEIGHT_M;
use nudge_core::world::TruthMap;
use std::sync::LazyLock;

/// A floor cell whose most likely class is at most this probable counts as unknown.
const UNKNOWN_BELOW: f32 = 1.05 / CLASS_COUNT as f32;

/// Where floor cells are in a picture: rows run from the back of the shelf to its front edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FloorPlan {
    /// Cells along x and along y.
    pub size: [usize; 2],
}

impl FloorPlan {
    /// The plan of a grid.
    pub fn of(grid: &Grid) -> Self {
        Self { size: [grid.dims[0], grid.dims[1]] }
    }

    /// Column and row of a cell, by its position in arrays over cells.
    pub fn pixel(&self, cell: usize) -> [usize; 2] {
        [cell / self.size[1], self.size[1] - 1 - cell % self.size[1]]
    }

    /// The cells' positions in the order of the picture's pixels, row by row from the back.
    pub fn cells(self) -> impl Iterator<Item = usize> {
        let [width, depth] = self.size;
        (0..depth).flat_map(move |row| (0..width).map(move |x| x * depth + depth - 1 - row))
    }
}

/// A floor plan with a colour for every cell.
pub fn paint(grid: &Grid, rgb_of_cell: impl Fn(usize) -> Rgb) -> RgbImage {
    let plan = FloorPlan::of(grid);
    let bytes = plan.cells().flat_map(rgb_of_cell).collect();
    RgbImage::from_raw(plan.size[0] as u32, plan.size[1] as u32, bytes).expect("one colour a cell")
}

/// The likeliest class of a cell, or `None` while nothing is known about it.
pub fn believed_class(belief: &Belief, cell: usize) -> Option<ClassId> {
    let (class, certainty) = belief.likeliest(cell);
    (certainty > UNKNOWN_BELOW).then_some(class)
}

/// The semantic belief: the likeliest class's colour, paler where it is less certain; palest where nothing is known.
pub fn paint_semantics(belief: &Belief, catalog: &Catalog) -> RgbImage {
    paint(&belief.grid, |cell| semantics_rgb(&belief.semantics[cell], catalog))
}

/// The colour of a cell in [`paint_semantics`], by its Dirichlet parameters.
pub fn semantics_rgb(parameters: &[f32; CLASS_COUNT], catalog: &Catalog) -> Rgb {
    match believed(parameters) {
        (_, certainty) if certainty.is_nan() || certainty <= UNKNOWN_BELOW => colors::UNKNOWN_RGB,
        (class, certainty) => {
            colors::mix(colors::UNKNOWN_RGB, colors::of_class(catalog, class), (0.4 + 0.6 * certainty).min(1.0))
        }
    }
}

/// The likeliest class of a Dirichlet (the first of equals) and its probability.
fn believed(parameters: &[f32; CLASS_COUNT]) -> (ClassId, f32) {
    let best = (1..CLASS_COUNT).fold(0, |best, k| if parameters[k] > parameters[best] { k } else { best });
    (ClassId(best as u8), parameters[best] / parameters.iter().sum::<f32>())
}

/// The likeliest class's probability (viridis).
pub fn paint_certainty(belief: &Belief) -> RgbImage {
    paint(&belief.grid, |cell| Colormap::Viridis.rgb(belief.likeliest(cell).1))
}

/// Labels in the colours of their classes.
pub fn paint_labels(grid: &Grid, labels: &[u8], catalog: &Catalog) -> RgbImage {
    paint(grid, |cell| colors::of_class(catalog, ClassId(labels[cell])))
}

/// Entropy over every floor cell, nats: the column's voxels in the scored volume and the cell's class. Their sum is
/// the map's entropy, to within a thousandth: logarithms come from a table.
pub fn cell_entropy(belief: &Belief) -> Vec<f32> {
    const STEPS: usize = 4096;
    static TABLE: LazyLock<Vec<f32>> = LazyLock::new(|| {
        (0..=STEPS + 1).map(|i| belief::bernoulli_entropy((i as f32 / STEPS as f32).min(1.0))).collect()
    });
    let table = &*TABLE;
    let levels = belief.grid.levels_below(SCORED_HEIGHT_M);
    let of_voxel = |a: &[f32; 2]| {
        let at = (belief::beta_mean(*a) * STEPS as f32).clamp(0.0, STEPS as f32);
        let low = at as usize;
        table[low] + (table[low + 1] - table[low]) * (at - low as f32)
    };
    let of_cell = |cell: usize| {
        let column = &belief.occupancy[belief.grid.column(cell)][..levels];
        column.iter().map(of_voxel).sum::<f32>() + belief::dirichlet_entropy(&belief.semantics[cell])
    };
    (0..belief.grid.cell_count()).map(of_cell).collect()
}

/// Entropy over one floor cell, nats: the voxels of its column in the scored volume and its class.
pub fn column_entropy(column: &[[f32; 2]], class: &[f32; CLASS_COUNT]) -> f32 {
    let voxels: f32 = column.iter().map(|a| belief::bernoulli_entropy(belief::beta_mean(*a))).sum();
    voxels + belief::dirichlet_entropy(class)
}

/// The scale of [`cell_entropy`], nats: from a certain cell to an unknown one.
pub fn entropy_range(grid: &Grid) -> [f32; 2] {
    [0.0, grid.levels_below(SCORED_HEIGHT_M) as f32 * std::f32::consts::LN_2 + (CLASS_COUNT as f32).ln()]
}

/// [`cell_entropy`] in magma.
pub fn paint_entropy(belief: &Belief) -> RgbImage {
    let (entropy, range) = (cell_entropy(belief), entropy_range(&belief.grid));
    paint(&belief.grid, |cell| Colormap::Magma.of(entropy[cell], range))
}

/// Surprise per cell, 0 to [`MOST_SURPRISING`] nats, in magma.
pub fn paint_surprise(grid: &Grid, surprise: &[f32]) -> RgbImage {
    paint(grid, |cell| Colormap::Magma.of(surprise[cell], [0.0, MOST_SURPRISING]))
}

/// How a cell's likeliest class compares with the truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CellError {
    /// The same.
    Right,
    /// Nothing is known, and nothing stands there.
    Unknown,
    /// An object stands there that is not believed.
    Missed,
    /// An object is believed that does not stand there.
    Hallucinated,
    /// An object is believed to be of another class.
    Confused,
}

impl CellError {
    /// All of them, as legends list them.
    pub const ALL: [Self; 5] = [Self::Right, Self::Unknown, Self::Missed, Self::Hallucinated, Self::Confused];

    /// Its colour: blue for less than there is, orange for more.
    pub fn rgb(self) -> Rgb {
        match self {
            Self::Right => [250, 250, 250],
            Self::Unknown => colors::UNKNOWN_RGB,
            Self::Missed => colors::MISSED_RGB,
            Self::Hallucinated => colors::HALLUCINATED_RGB,
            Self::Confused => colors::CONFUSED_RGB,
        }
    }

    /// Its name in legends.
    pub fn title(self) -> &'static str {
        match self {
            Self::Right => "correct",
            Self::Unknown => "unknown",
            Self::Missed => "missed",
            Self::Hallucinated => "hallucinated",
            Self::Confused => "wrong class",
        }
    }
}

/// The semantic error of every floor cell.
pub fn cell_errors(belief: &Belief, truth: &TruthMap) -> Vec<CellError> {
    (0..truth.labels.len()).map(|cell| cell_error(belief, truth, cell)).collect()
}

/// The semantic error of one floor cell.
pub fn cell_error(belief: &Belief, truth: &TruthMap, cell: usize) -> CellError {
    match (believed_class(belief, cell), ClassId(truth.labels[cell])) {
        (None, BACKGROUND) => CellError::Unknown,
        (Some(believed), truth) if believed == truth => CellError::Right,
        (None | Some(BACKGROUND), _) => CellError::Missed,
        (Some(_), BACKGROUND) => CellError::Hallucinated,
        _ => CellError::Confused,
    }
}

/// [`cell_errors`] in their colours.
pub fn paint_errors(belief: &Belief, truth: &TruthMap) -> RgbImage {
    let errors = cell_errors(belief, truth);
    paint(&belief.grid, |cell| errors[cell].rgb())
}

/// The outlines of the objects on the floor plan: straight runs along cell edges, each from one to another corner in
/// pixels of the plan.
pub fn outlines(truth: &TruthMap) -> Vec<[[usize; 2]; 2]> {
    let [width, depth, _] = truth.dims;
    let object = |x: isize, row: isize| {
        let inside = (0..width as isize).contains(&x) && (0..depth as isize).contains(&row);
        if inside { truth.objects[x as usize * depth + depth - 1 - row as usize] } else { u16::MAX }
    };
    let mut runs = Vec::new();
    // Edges between columns x - 1 and x, then between rows row - 1 and row.
    for x in 0..=width {
        let differs = |row: usize| object(x as isize - 1, row as isize) != object(x as isize, row as isize);
        runs.extend(stretches(depth, differs).map(|[a, b]| [[x, a], [x, b]]));
    }
    for row in 0..=depth {
        let differs = |x: usize| object(x as isize, row as isize - 1) != object(x as isize, row as isize);
        runs.extend(stretches(width, differs).map(|[a, b]| [[a, row], [b, row]]));
    }
    runs
}

/// The runs of consecutive positions below `count` that `holds` for, each from its first to one past its last.
fn stretches(count: usize, holds: impl Fn(usize) -> bool) -> impl Iterator<Item = [usize; 2]> {
    let mut runs: Vec<[usize; 2]> = Vec::new();
    for at in (0..count).filter(|&at| holds(at)) {
        match runs.last_mut() {
            Some(run) if run[1] == at => run[1] = at + 1,
            _ => runs.push([at, at + 1]),
        }
    }
    runs.into_iter()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nudge_core::grid::Cell;

    /// The inverse of [`FloorPlan::pixel`].
    fn cell_at(plan: FloorPlan, [x, row]: [usize; 2]) -> Cell {
        Cell { x: x as u16, y: (plan.size[1] - 1 - row) as u16 }
    }

    fn grid() -> Grid {
        Grid::for_shelf([0.06, 0.04, 0.30], 0.01)
    }

    #[test]
    fn the_back_of_the_shelf_is_the_top_row() {
        let (grid, plan) = (grid(), FloorPlan::of(&grid()));
        let back_right = grid.cell_index(Cell { x: 5, y: 3 });
        let picture = paint(&grid, |cell| if cell == back_right { [255; 3] } else { [0; 3] });
        assert_eq!(picture.dimensions(), (6, 4));
        assert_eq!(picture.get_pixel(5, 0).0, [255; 3]);
        for (at, cell) in plan.cells().enumerate() {
            let pixel = [at % 6, at / 6];
            assert_eq!(plan.pixel(cell), pixel);
            assert_eq!(grid.cell_index(cell_at(plan, pixel)), cell);
        }
    }

    #[test]
    fn entropy_of_the_cells_adds_up_to_that_of_the_map() {
        let mut belief = Belief::uniform(grid());
        belief.occupancy[7] = [9.0, 1.0];
        belief.semantics[3][2] = 30.0;
        let sum: f64 = cell_entropy(&belief).iter().map(|h| f64::from(*h)).sum();
        let map = belief.occupancy_entropy(27) + belief.semantic_entropy();
        assert!((sum - map).abs() < 1e-3, "{sum} {map}");
        let uniform = cell_entropy(&Belief::uniform(grid()));
        assert!((uniform[0] - entropy_range(&grid())[1]).abs() < 1e-4);
    }

    #[test]
    fn errors_tell_missed_from_hallucinated() {
        let grid = grid();
        let mut belief = Belief::uniform(grid);
        let mut truth = TruthMap {
            dims: grid.dims,
            occupancy: vec![0; grid.voxel_count()],
            labels: vec![BACKGROUND.0; grid.cell_count()],
            objects: vec![u16::MAX; grid.cell_count()],
        };
        truth.labels[1..5].fill(3);
        belief.semantics[2][3] = 5.0;
        belief.semantics[3][4] = 5.0;
        belief.semantics[4][14] = 5.0;
        belief.semantics[5][3] = 5.0;
        belief.semantics[6][14] = 5.0;
        use CellError::{Confused, Hallucinated, Missed, Right, Unknown};
        assert_eq!(cell_errors(&belief, &truth)[..7], [Unknown, Missed, Right, Confused, Missed, Hallucinated, Right]);
    }

    #[test]
    fn the_outline_of_a_rectangle_is_four_runs() {
        let grid = grid();
        let mut truth = TruthMap {
            dims: grid.dims,
            occupancy: vec![0; grid.voxel_count()],
            labels: vec![BACKGROUND.0; grid.cell_count()],
            objects: vec![u16::MAX; grid.cell_count()],
        };
        for x in 1..3 {
            for y in 0..2 {
                truth.objects[grid.cell_index(Cell { x, y })] = 0;
            }
        }
        let mut runs = outlines(&truth);
        runs.sort();
        assert_eq!(runs, [[[1, 2], [1, 4]], [[1, 2], [3, 2]], [[1, 4], [3, 4]], [[3, 2], [3, 4]]]);
    }
}
