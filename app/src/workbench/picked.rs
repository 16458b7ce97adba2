//! What a person asks about.

/// A voxel or a floor cell that a person asks about, by its position in the grid's arrays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Picked {
    /// A voxel.
    Voxel(usize),
    /// A floor cell.
    Cell(usize),
}
