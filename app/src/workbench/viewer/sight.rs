//! From the pointer into the room: which ray a click on a three-dimensional view follows.

use super::linked;
use crate::workbench::ray::Ray;
use nudge_core::{Point, Vector};
use re_viewer::external::egui::{Context, Pos2, Rect};

/// The viewer's field of view from top to bottom, radians.
const FIELD_OF_VIEW: f32 = 55.0 * std::f32::consts::PI / 180.0;
/// Points that a view is high at least; what is lower is a heading.
const LEAST_HEIGHT: f32 = 48.0;

/// The ray of a click on a view inside `space` in this frame. To be asked after the views were drawn.
pub fn clicked(ctx: &Context, space: Rect) -> Option<Ray> {
    let clicked = ctx.interaction_snapshot(|snapshot| snapshot.clicked)?;
    let view = ctx.viewport(|viewport| {
        let widgets = [&viewport.this_pass.widgets, &viewport.prev_pass.widgets];
        widgets.into_iter().find_map(|widgets| widgets.get(clicked).copied())
    })?;
    let is_view = view.sense.senses_drag() && view.rect.height() >= LEAST_HEIGHT && space.contains_rect(view.rect);
    let at = ctx.input(|input| input.pointer.primary_released().then(|| input.pointer.interact_pos()).flatten())?;
    let eye = linked::last().filter(|_| is_view)?;
    ray(eye, view.rect, at)
}

/// The ray from an eye through a place in its view; `None` for an eye that looks nowhere.
fn ray([position, target, up]: [[f32; 3]; 3], view: Rect, at: Pos2) -> Option<Ray> {
    let (origin, up) = (Point::from(position), Vector::from(up));
    let forward = (Point::from(target) - origin).try_normalize(1e-6)?;
    let right = forward.cross(&up).try_normalize(1e-6)?;
    let above = right.cross(&forward);
    let reach = (0.5 * FIELD_OF_VIEW).tan();
    let from_middle = (at - view.center()) / (0.5 * view.height());
    let direction = forward + right * (from_middle.x * reach) - above * (from_middle.y * reach);
    Some(Ray { origin, direction: direction.normalize() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use re_viewer::external::egui::{pos2, vec2};

    #[test]
    fn the_middle_of_a_view_is_what_the_eye_looks_at_and_its_upper_edge_half_the_field_of_view_above() {
        let view = Rect::from_min_size(pos2(100.0, 50.0), vec2(400.0, 200.0));
        let eye = [[0.0, -1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let middle = ray(eye, view, view.center()).expect("a ray").direction;
        assert!((middle - Vector::new(0.0, 1.0, 0.0)).norm() < 1e-6, "{middle}");
        let top = ray(eye, view, view.center_top()).expect("a ray").direction;
        assert!((top.z.asin() - 0.5 * FIELD_OF_VIEW).abs() < 1e-5 && top.x.abs() < 1e-6, "{top}");
        let right = ray(eye, view, view.right_center()).expect("a ray").direction;
        assert!((right.x / right.y - 2.0 * (0.5 * FIELD_OF_VIEW).tan()).abs() < 1e-5, "x right: {right}");
        assert_eq!(ray([[0.0; 3], [0.0; 3], [0.0, 0.0, 1.0]], view, view.center()), None);
    }
}
