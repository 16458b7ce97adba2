//! The object catalogue: 14 classes and background, in the fixed order of beliefs, weights and files.

use serde::{Deserialize, Serialize};

/// Number of object classes.
pub const OBJECT_CLASS_COUNT: usize = 14;
/// Number of classes with background.
pub const CLASS_COUNT: usize = 15;
/// The class of a floor cell that no object covers.
pub const BACKGROUND: ClassId = ClassId(14);

/// A class by its position in the catalogue's fixed order; 14 is background.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct ClassId(pub u8);

/// What the catalogue tells of a class.
#[derive(Clone, Debug)]
pub struct Class {
    /// Its position in the fixed order.
    pub id: ClassId,
    /// Name in scene files, for example `tomato_can`.
    pub name: String,
    // shape, mass, friction, radius of influence, doubled classes, own chance, large, colour, prompt -- to come
}

/// The classes, in order. [`Catalog::standard`] is `assets/catalog.toml`.
#[derive(Clone, Debug)]
pub struct Catalog {
    /// The object classes, by id.
    pub classes: Vec<Class>,
}
