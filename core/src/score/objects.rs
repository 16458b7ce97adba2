//! The verdict on each object: found, misclassified, not found; and hallucinated objects.
//!
//! A floor cell *shows an object* when a voxel of its column in the scored volume is believed occupied (`p > 0.5`). Its
//! class counts when one class is likelier than every other; a tie (no label seen yet) is no class.

use super::{ObjectVerdict, SCORED_HEIGHT_M, Verdict};
use crate::belief::{Belief, beta_mean};
use crate::grid::Grid;
use crate::scene::{BACKGROUND, CLASS_COUNT, Catalog, ClassId};
use crate::world::TruthMap;
use std::collections::BTreeMap;

/// Predicted patches smaller than this are specks, not objects (the smallest class covers 20 cm^2), square metres.
pub const SPECK_M2: f32 = 6e-4;

/// The verdict on every object that stands on the board, in the scene's order, and then on every hallucinated one.
///
/// An object is judged over the floor cells where it is the tallest (one thinner than a voxel over those that it touches);
/// one that stands wholly under another has no verdict, nor has one that was dropped. A hallucinated object is a connected patch (4 neighbours) of cells that show one object class, at
/// least [`SPECK_M2`] large, of which most lie where no object stands and which does not cover most of any object.
pub fn object_verdicts(belief: &Belief, truth: &TruthMap, catalog: &Catalog) -> Vec<ObjectVerdict> {
    let shown = shown_classes(belief);
    let mut objects: BTreeMap<u16, Vec<usize>> = BTreeMap::new();
    for (cell, &object) in truth.objects.iter().enumerate().filter(|(_, object)| **object != u16::MAX) {
        objects.entry(object).or_default().push(cell);
    }
    let mut verdicts: Vec<ObjectVerdict> = objects
        .iter()
        .map(|(&object, cells)| {
            let class = truth.labels[cells[0]];
            ObjectVerdict {
                object: Some(object),
                class: catalog.name(ClassId(class)).to_owned(),
                verdict: verdict_on(cells, class, &shown),
                position: middle(&belief.grid, cells),
            }
        })
        .collect();
    let speck_cells = (SPECK_M2 / (belief.grid.voxel_m * belief.grid.voxel_m)).round() as usize;
    for (class, patch) in patches(&belief.grid, &shown) {
        if patch.len() >= speck_cells && is_made_up(&patch, truth, &objects) {
            verdicts.push(ObjectVerdict {
                object: None,
                class: catalog.name(ClassId(class)).to_owned(),
                verdict: Verdict::Hallucinated,
                position: middle(&belief.grid, &patch),
            });
        }
    }
    verdicts
}

/// What a floor cell shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shown {
    /// No object: free or unknown.
    Nothing,
    /// Something of no class in particular, or of the background's.
    Unlabelled,
    /// An object of this class.
    Class(u8),
}

fn shown_classes(belief: &Belief) -> Vec<Shown> {
    let levels = belief.grid.levels_below(SCORED_HEIGHT_M);
    (0..belief.grid.cell_count())
        .map(|cell| {
            let column = &belief.occupancy[belief.grid.column(cell)][..levels];
            if !column.iter().any(|evidence| beta_mean(*evidence) > 0.5) {
                return Shown::Nothing;
            }
            let evidence = &belief.semantics[cell];
            let best = (1..CLASS_COUNT).fold(0, |best, k| if evidence[k] > evidence[best] { k } else { best });
            let tied = evidence.iter().filter(|a| **a == evidence[best]).count() > 1;
            if tied || best == usize::from(BACKGROUND.0) { Shown::Unlabelled } else { Shown::Class(best as u8) }
        })
        .collect()
}

fn verdict_on(cells: &[usize], class: u8, shown: &[Shown]) -> Verdict {
    let most = |count: usize| 2 * count > cells.len();
    let right = cells.iter().filter(|&&cell| shown[cell] == Shown::Class(class)).count();
    let any = cells.iter().filter(|&&cell| shown[cell] != Shown::Nothing).count();
    if most(right) {
        Verdict::Found
    } else if most(any) {
        Verdict::Misclassified
    } else {
        Verdict::NotFound
    }
}

fn is_made_up(patch: &[usize], truth: &TruthMap, objects: &BTreeMap<u16, Vec<usize>>) -> bool {
    let mut covered: BTreeMap<u16, usize> = BTreeMap::new();
    for &cell in patch {
        if truth.objects[cell] != u16::MAX {
            *covered.entry(truth.objects[cell]).or_default() += 1;
        }
    }
    let on_objects: usize = covered.values().sum();
    2 * on_objects < patch.len() && covered.iter().all(|(object, count)| 2 * count <= objects[object].len())
}

/// Connected patches of equal class, in the order of their first cell.
fn patches(grid: &Grid, shown: &[Shown]) -> Vec<(u8, Vec<usize>)> {
    let [width, depth, _] = grid.dims;
    let mut visited = vec![false; shown.len()];
    let mut patches = Vec::new();
    for start in 0..shown.len() {
        let Shown::Class(class) = shown[start] else { continue };
        if visited[start] {
            continue;
        }
        visited[start] = true;
        let mut patch = vec![start];
        let mut at = 0;
        while at < patch.len() {
            let cell = patch[at];
            at += 1;
            let (x, y) = (cell / depth, cell % depth);
            let neighbours = [
                (x > 0).then(|| cell - depth),
                (x + 1 < width).then(|| cell + depth),
                (y > 0).then(|| cell - 1),
                (y + 1 < depth).then(|| cell + 1),
            ];
            for next in neighbours.into_iter().flatten() {
                if !visited[next] && shown[next] == shown[start] {
                    visited[next] = true;
                    patch.push(next);
                }
            }
        }
        patches.push((class, patch));
    }
    patches
}

fn middle(grid: &Grid, cells: &[usize]) -> [f32; 2] {
    let mut sum = [0.0_f64; 2];
    for &cell in cells {
        let center = grid.cell_center(grid.cell(cell));
        sum[0] += f64::from(center.x);
        sum[1] += f64::from(center.y);
    }
    sum.map(|sum| (sum / cells.len() as f64) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Cell;

    /// 40 x 20 cells of 1 cm; an object of class 2 on cells x 5..11, y 5..11 and one of class 7 on x 20..26, y 5..11.
    struct Table {
        belief: Belief,
        truth: TruthMap,
    }

    impl Table {
        fn new() -> Self {
            let grid = Grid { voxel_m: 0.01, dims: [40, 20, 30], origin: [-0.2, 0.0, 0.0] };
            let mut truth = TruthMap {
                dims: grid.dims,
                occupancy: vec![0; grid.voxel_count()],
                labels: vec![BACKGROUND.0; grid.cell_count()],
                objects: vec![u16::MAX; grid.cell_count()],
            };
            for (object, class, x0) in [(0, 2, 5), (1, 7, 20)] {
                for cell in square(&grid, x0..x0 + 6, 5..11) {
                    truth.labels[cell] = class;
                    truth.objects[cell] = object;
                    let column = grid.column(cell);
                    truth.occupancy[column.start..column.start + 10].fill(1);
                }
            }
            Self { belief: Belief::uniform(grid), truth }
        }

        /// Makes the belief show `class` (or an object of unknown class) on a square of cells.
        fn show(&mut self, class: Option<usize>, x: std::ops::Range<u16>, y: std::ops::Range<u16>) {
            for cell in square(&self.belief.grid, x, y) {
                let column = self.belief.grid.column(cell);
                self.belief.occupancy[column.start] = [5.0, 1.0];
                self.belief.semantics[cell] = [1.0; CLASS_COUNT];
                if let Some(class) = class {
                    self.belief.semantics[cell][class] = 2.0;
                }
            }
        }

        fn verdicts(&self) -> Vec<(Option<u16>, Verdict)> {
            object_verdicts(&self.belief, &self.truth, &Catalog::standard())
                .iter()
                .map(|v| (v.object, v.verdict))
                .collect()
        }
    }

    fn square(grid: &Grid, x: std::ops::Range<u16>, y: std::ops::Range<u16>) -> Vec<usize> {
        let grid = *grid;
        x.flat_map(|x| y.clone().map(move |y| grid.cell_index(Cell { x, y }))).collect()
    }

    #[test]
    fn an_unseen_object_is_not_found_and_the_prior_makes_nothing_up() {
        let table = Table::new();
        assert_eq!(table.verdicts(), [(Some(0), Verdict::NotFound), (Some(1), Verdict::NotFound)]);
        let verdicts = object_verdicts(&table.belief, &table.truth, &Catalog::standard());
        assert_eq!((verdicts[0].class.as_str(), verdicts[1].class.as_str()), ("coffee_can", "mustard_bottle"));
        let position = verdicts[0].position;
        assert!((position[0] + 0.12).abs() < 1e-6 && (position[1] - 0.08).abs() < 1e-6, "{position:?}");
    }

    #[test]
    fn most_cells_decide() {
        let mut table = Table::new();
        // 4 of 6 rows right: found. 4 of 6 rows of another class: misclassified.
        table.show(Some(2), 5..9, 5..11);
        table.show(Some(3), 20..24, 5..11);
        assert_eq!(table.verdicts(), [(Some(0), Verdict::Found), (Some(1), Verdict::Misclassified)]);
        // Exactly half is not most; something without a label is there, but of no class.
        let mut table = Table::new();
        table.show(Some(2), 5..8, 5..11);
        table.show(None, 20..26, 5..11);
        assert_eq!(table.verdicts(), [(Some(0), Verdict::NotFound), (Some(1), Verdict::Misclassified)]);
    }

    #[test]
    fn patches_where_nothing_stands_are_hallucinated_unless_they_are_specks() {
        let mut table = Table::new();
        table.show(Some(2), 5..11, 5..11);
        table.show(Some(7), 20..26, 5..11);
        let found = [(Some(0), Verdict::Found), (Some(1), Verdict::Found)];
        // 5 cm^2 is a speck; so are two specks that only share a corner.
        table.show(Some(4), 30..35, 2..3);
        table.show(Some(4), 35..36, 3..8);
        assert_eq!(table.verdicts(), found);
        table.show(Some(4), 35..36, 2..3);
        assert_eq!(table.verdicts(), [found[0], found[1], (None, Verdict::Hallucinated)]);
    }

    #[test]
    fn a_found_object_that_is_drawn_too_large_is_not_hallucinated_as_well() {
        let mut table = Table::new();
        table.show(Some(2), 2..14, 2..14);
        assert_eq!(table.verdicts()[0], (Some(0), Verdict::Found));
        assert_eq!(table.verdicts().len(), 2);
        // The same patch beside the object, touching only a third of it, is made up.
        let mut table = Table::new();
        table.show(Some(2), 9..19, 2..14);
        assert_eq!(table.verdicts()[2], (None, Verdict::Hallucinated));
    }
}
