//! Which three-dimensional views every layout has.

use super::model::LayoutKind;
use super::space::at;
use crate::record::blueprint::{Layout, Part};
use crate::record::layout::spatial;

/// The views of a layout, and the first layout that has the same ones; `None` where it has none.
pub fn of(layout: LayoutKind) -> Option<(LayoutKind, Layout)> {
    let always = [at::SHELF, at::EDGES];
    let view = |name: &str, shown: &[&str]| {
        Part::View(spatial(name, "", always.iter().chain(shown).map(|path| format!("/{path}")).collect()))
    };
    let pointer = [at::HOVERED, at::PICKED];
    let root = match layout {
        LayoutKind::Episode | LayoutKind::Why => view(
            "Belief",
            &[&[at::BELIEF, at::OBJECTS, at::VIEWS, at::CURRENT, at::CANDIDATES, at::CHOSEN], &pointer[..]].concat(),
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
                        view("Now", &[&[at::BELIEF, at::OBJECTS, at::CANDIDATES, at::CHOSEN], &pointer[..]].concat()),
                    ),
                    (1.0, view("Predicted", &[at::PREDICTED, at::SWEPT, at::CHOSEN])),
                ]),
            ),
            (
                1.0,
                Part::Row(vec![
                    (1.0, view("Difference", &[at::DIFFERENCE, at::CHOSEN, at::PICKED])),
                    (1.0, view("What happened", &[at::HAPPENED, at::CHOSEN])),
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
    Some((same, Layout { root }))
}
