//! Scores of a map that is perfect but for some objects.

use super::Scores;
use crate::belief::Belief;
use crate::grid::Grid;
use crate::scene::{Body, ObjectId};
use crate::world::TruthMap;

/// Evidence of a voxel or a cell that is known: as good as certain.
const KNOWN: f32 = 1e6;

/// The scores of a map that is right and certain about everything but the `missing` objects, and holds their space
/// free. With the objects that no view shows as `missing`, it is the best that looking alone can reach without a guess.
pub fn scores_without(grid: &Grid, bodies: &[Body], missing: &[ObjectId]) -> Scores {
    let shown: Vec<Body> = bodies.iter().filter(|body| !missing.contains(&body.id)).cloned().collect();
    Scores::of(&belief_in(grid, &TruthMap::of(grid, &shown)), &TruthMap::of(grid, bodies))
}

/// The belief that is certain of a map.
fn belief_in(grid: &Grid, map: &TruthMap) -> Belief {
    let mut belief = Belief::uniform(*grid);
    for (evidence, &occupied) in belief.occupancy.iter_mut().zip(&map.occupancy) {
        evidence[1 - usize::from(occupied)] = KNOWN;
    }
    for (classes, &label) in belief.semantics.iter_mut().zip(&map.labels) {
        classes[usize::from(label)] = KNOWN;
    }
    belief
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Catalog, Scene};

    #[test]
    fn what_is_missing_lowers_the_scores_and_nothing_else_does() {
        let text = "format = 1\nname = \"two\"\n[shelf]\nsize = [0.8, 0.4, 0.4]\n\
                    [[object]]\nclass = \"cereal_box\"\nposition = [0.0, 0.1]\n\
                    [[object]]\nclass = \"tomato_can\"\nposition = [0.0, 0.3]\n";
        let catalog = Catalog::standard();
        let (scene, _) = Scene::parse(text, std::path::Path::new("two.toml"), &catalog).expect("a scene");
        let (grid, bodies) = (scene.grid(), scene.bodies(&catalog).expect("bodies"));
        let all = scores_without(&grid, &bodies, &[]);
        assert_eq!((all.occupancy_iou, all.semantic_miou), (1.0, 1.0));
        let without_can = scores_without(&grid, &bodies, &[bodies[1].id]);
        // Of background, box and can the can has nothing, the box everything, and the background a few cells too many.
        assert!((0.65..2.0 / 3.0).contains(&without_can.semantic_miou), "{}", without_can.semantic_miou);
        assert!((0.5..0.99).contains(&without_can.occupied_iou), "{}", without_can.occupied_iou);
        assert_eq!(scores_without(&grid, &bodies, &[bodies[0].id, bodies[1].id]).occupied_iou, 0.0);
    }
}
