//! Which three-dimensional views every layout has.

use super::at;
use crate::record::blueprint::{Layout, Part};
use crate::record::layout::{Eye, Ground, spatial};
use crate::workbench::model::LayoutKind;

/// Width over height from which on a view shows the whole shelf with the eye where it is by default.
const WHOLE_SHELF: f32 = 1.05;

/// How far the eye has to be for the whole shelf to show in a view, as a factor of where it is by default; in coarse
/// steps, so that a window that is made a little wider leaves the eye where a person has turned it.
fn distance(aspect: f32) -> f32 {
    const STEP: f32 = 1.1;
    let needed = (WHOLE_SHELF / aspect.clamp(0.2, 5.0)).max(1.0);
    STEP.powf((needed.ln() / STEP.ln()).ceil())
}

/// The views of a layout with the first layout that has the same ones, and the distance of their eyes; `None` where it
/// has none. `aspect` is width over height of the place for all of them together. With the robot in them they are seen
/// from beside it, or it would stand in the way.
pub(super) fn of(layout: LayoutKind, aspect: f32, ground: Ground, robot: bool) -> Option<(LayoutKind, f32, Layout)> {
    let distance = distance(match layout {
        LayoutKind::Compare => aspect / 3.0,
        _ => aspect,
    });
    let eye = if robot { Eye::ROBOT } else { Eye::SHELF };
    let always = [at::SHELF, at::EDGES];
    let view = |name: &str, shown: &[&str]| {
        Part::View(spatial(
            name,
            "",
            eye.farther(distance),
            ground,
            always.iter().chain(shown).map(|path| format!("/{path}")).collect(),
        ))
    };
    let pointer = [at::HOVERED, at::PICKED];
    let root = match layout {
        LayoutKind::Episode | LayoutKind::Why => view(
            "Belief",
            &[
                &[at::BELIEF, at::OBJECTS, at::VIEWS, at::CURRENT, at::CANDIDATES, at::CHOSEN, at::ARM, at::ARM_PATH],
                &pointer[..],
            ]
            .concat(),
        ),
        LayoutKind::Gains => view(
            "Where the gain comes from",
            &[&[at::GAIN, at::OBJECTS, at::VIEWS, at::CURRENT], &pointer[..]].concat(),
        ),
        LayoutKind::Push => Part::Column(vec![
            (
                1.0,
                Part::Row(vec![
                    (
                        1.0,
                        view(
                            "Now",
                            &[
                                &[at::BELIEF, at::OBJECTS, at::CANDIDATES, at::CHOSEN, at::ARM, at::ARM_PATH],
                                &pointer[..],
                            ]
                            .concat(),
                        ),
                    ),
                    (1.0, view("Predicted", &[at::PREDICTED, at::SWEPT, at::CHOSEN])),
                ]),
            ),
            (
                1.0,
                Part::Row(vec![
                    (1.0, view("Difference", &[at::DIFFERENCE, at::CHOSEN, at::PICKED])),
                    (1.0, view("What happened", &[at::HAPPENED, at::HAPPENED_NOTE, at::CHOSEN])),
                ]),
            ),
        ]),
        LayoutKind::Compare => Part::Row(vec![
            (1.0, view("A", &[at::BELIEF, at::OBJECTS, at::CHOSEN, at::PICKED])),
            (1.0, view("B", &[at::OTHER, at::OTHER_OBJECTS])),
            (1.0, view("A - B", &[at::BETWEEN, at::OBJECTS, at::PICKED])),
        ]),
        LayoutKind::Author => return None,
    };
    let same = if layout == LayoutKind::Why { LayoutKind::Episode } else { layout };
    Some((same, distance, Layout { root }))
}
