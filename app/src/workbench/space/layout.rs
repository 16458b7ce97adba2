//! Which three-dimensional views every layout has.

use super::at;
use crate::record::blueprint::{Layout, Part};
use crate::record::eye::Eye;
use crate::record::layout::{Ground, spatial};
use crate::workbench::model::LayoutKind;

/// Width over height from which on a view shows the whole shelf with the eye beside the robot.
const WHOLE_SHELF: f32 = 1.05;

/// Width over height in coarse steps, rounded down, so that a window that is made a little wider leaves the eye where a
/// person has turned it.
pub(super) fn coarse(aspect: f32) -> f32 {
    const STEP: f32 = 1.1;
    STEP.powf((aspect.clamp(0.2, 8.0).ln() / STEP.ln()).floor())
}

/// The views of a layout with the first layout that has the same ones; `None` where it has none. `aspect` is width over
/// height of the place for all of them together, `size` the shelf's, metres. With the robot in them they are seen from
/// beside it, or it would stand in the way.
pub(super) fn of(
    layout: LayoutKind,
    aspect: f32,
    size: [f32; 3],
    ground: Ground,
    robot: bool,
) -> Option<(LayoutKind, Layout)> {
    let eye_of = |aspect: f32| match robot {
        true => Eye::ROBOT.farther((WHOLE_SHELF / aspect).max(1.0)),
        false => Eye::framing(size, aspect),
    };
    let always = [at::SHELF, at::EDGES];
    let view_of = |aspect: f32, name: &str, shown: &[&str]| {
        let shown = always.iter().chain(shown).map(|path| format!("/{path}")).collect();
        Part::View(spatial(name, "", eye_of(aspect), ground, shown))
    };
    let view = |name: &str, shown: &[&str]| view_of(aspect, name, shown);
    let pointer = [at::HOVERED, at::PICKED];
    let root = match layout {
        LayoutKind::Episode | LayoutKind::Why => view(
            "Belief",
            &[
                &[
                    at::BELIEF,
                    at::OBJECTS,
                    at::VIEWS,
                    at::CURRENT,
                    at::CANDIDATES,
                    at::CHOSEN,
                    at::LINES,
                    at::ARM,
                    at::ARM_PATH,
                ],
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
                                &[
                                    at::BELIEF,
                                    at::OBJECTS,
                                    at::CANDIDATES,
                                    at::CHOSEN,
                                    at::LINES,
                                    at::ARM,
                                    at::ARM_PATH,
                                ],
                                &pointer[..],
                            ]
                            .concat(),
                        ),
                    ),
                    (1.0, view("Predicted", &[at::PREDICTED, at::SWEPT, at::CHOSEN, at::LINES])),
                ]),
            ),
            (
                1.0,
                Part::Row(vec![
                    (1.0, view("Difference", &[at::DIFFERENCE, at::CHOSEN, at::LINES, at::PICKED])),
                    (1.0, view("What happened", &[at::HAPPENED, at::HAPPENED_NOTE, at::CHOSEN, at::LINES])),
                ]),
            ),
        ]),
        LayoutKind::Compare => {
            // Three in a row where that leaves each at least as wide as high, else the difference below the two.
            let is_row = aspect >= 3.0;
            let [of_two, of_difference] = if is_row { [aspect / 3.0; 2] } else { [aspect, 2.0 * aspect] };
            let a = view_of(of_two, "A", &[at::BELIEF, at::OBJECTS, at::CHOSEN, at::LINES, at::PICKED]);
            let b = view_of(of_two, "B", &[at::OTHER, at::OTHER_OBJECTS]);
            let difference = view_of(of_difference, "A - B", &[at::BETWEEN, at::OBJECTS, at::PICKED]);
            match is_row {
                true => Part::Row(vec![(1.0, a), (1.0, b), (1.0, difference)]),
                false => Part::Column(vec![(1.0, Part::Row(vec![(1.0, a), (1.0, b)])), (1.0, difference)]),
            }
        }
        LayoutKind::Author => return None,
    };
    let same = if layout == LayoutKind::Why { LayoutKind::Episode } else { layout };
    Some((same, Layout { root }))
}
