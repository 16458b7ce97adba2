//! Authoring a scene.

/// The scene in the making.
#[derive(Default)]
pub struct Author {}
