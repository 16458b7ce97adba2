//! The true objects as outlines, which cover nothing of what is believed.

use nudge_core::scene::Body;

/// Angle by which a surface bends at an edge that is drawn, degrees: more than between the facets of a round one.
const CREASE_DEG: f32 = 40.0;

/// The outlines of bodies, in a colour that shows on a light or a dark ground.
pub(super) fn outlines(bodies: &[Body], light: bool) -> rerun::LineStrips3D {
    let edges = bodies.iter().flat_map(|body| {
        let creases = body.solid.parts.iter().flat_map(|part| part.creases(CREASE_DEG.to_radians()));
        creases.map(|ends| ends.map(|end| <[f32; 3]>::from((body.world_from_body * end).coords)).to_vec())
    });
    let grey = if light { 40 } else { 225 };
    rerun::LineStrips3D::new(edges)
        .with_colors([rerun::Color::from_rgb(grey, grey, grey)])
        .with_radii([rerun::Radius::new_ui_points(0.8)])
}
