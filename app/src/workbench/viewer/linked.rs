//! Linked cameras: where one three-dimensional view is turned, the others of the layout follow.
//!
//! The viewer keeps a view's eye as a property in its blueprint. Once a frame the properties of all views are read; the
//! one that has moved since the last frame is written to the others.

use re_sdk_types::ViewClassIdentifier;
use re_sdk_types::blueprint::archetypes::EyeControls3D;
use re_view_spatial::SpatialView3D;
use re_viewer::external::{re_sdk_types, re_view_spatial, re_viewer_context, re_viewport_blueprint};
use re_viewer_context::{
    IdentifiedViewSystem, MissingChunkReporter, ViewClass as _, ViewContext, ViewContextSystem,
    ViewContextSystemOncePerFrameResult, ViewId, ViewQuery, ViewSystemIdentifier, ViewerContext,
};
use re_viewport_blueprint::ViewProperty;
use rerun::components::{Position3D, Vector3D};
use std::sync::{Mutex, PoisonError};

/// The kind of view that is linked.
pub fn class() -> ViewClassIdentifier {
    SpatialView3D::identifier()
}

/// Where an eye is and what it looks at.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Eye {
    position: Position3D,
    target: Position3D,
    up: Vector3D,
}

/// The eye that all views had after the last frame. The viewer makes view systems itself, so that there is no other
/// place for it; a process has one window.
static LAST: Mutex<Option<Eye>> = Mutex::new(None);

/// Reads and writes the eyes once a frame.
#[derive(Default)]
pub struct LinkedEyes;

impl IdentifiedViewSystem for LinkedEyes {
    fn identifier() -> ViewSystemIdentifier {
        "NudgeLinkedEyes".into()
    }
}

impl ViewContextSystem for LinkedEyes {
    fn execute_once_per_frame(ctx: &ViewerContext<'_>) -> ViewContextSystemOncePerFrameResult {
        link(ctx);
        Box::new(())
    }

    fn execute(
        &mut self,
        _ctx: &ViewContext<'_>,
        _missing: &MissingChunkReporter,
        _query: &ViewQuery<'_>,
        _once: &ViewContextSystemOncePerFrameResult,
    ) {
    }
}

fn link(ctx: &ViewerContext<'_>) {
    let mut views: Vec<ViewId> = ctx.query_results.keys().copied().collect();
    views.sort_by_key(|view| view.to_string());
    let eyes: Vec<(ViewProperty, Eye)> = views
        .into_iter()
        .filter_map(|view| {
            let property = ViewProperty::from_archetype_for_view::<EyeControls3D>(ctx, view);
            let eye = eye_of(&property)?;
            Some((property, eye))
        })
        .collect();
    let mut last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
    let moved = eyes.iter().map(|(_, eye)| *eye).find(|eye| Some(*eye) != *last);
    let Some(leader) = moved else { return };
    *last = Some(leader);
    for (property, _) in eyes.iter().filter(|(_, eye)| *eye != leader) {
        property.save_blueprint_component(ctx, &EyeControls3D::descriptor_position(), &leader.position);
        property.save_blueprint_component(ctx, &EyeControls3D::descriptor_look_target(), &leader.target);
        property.save_blueprint_component(ctx, &EyeControls3D::descriptor_eye_up(), &leader.up);
    }
}

/// Where the eye of all views was in the last frame: its position, what it looks at, and up.
pub(super) fn last() -> Option<[[f32; 3]; 3]> {
    let eye = (*LAST.lock().unwrap_or_else(PoisonError::into_inner))?;
    Some([eye.position.0.0, eye.target.0.0, eye.up.0.0])
}

fn eye_of(property: &ViewProperty) -> Option<Eye> {
    let position = |component| property.component_or_empty::<Position3D>(component).ok().flatten();
    Some(Eye {
        position: position(EyeControls3D::descriptor_position().component)?,
        target: position(EyeControls3D::descriptor_look_target().component)?,
        up: property.component_or_empty::<Vector3D>(EyeControls3D::descriptor_eye_up().component).ok().flatten()?,
    })
}
