//! Triangles as a mesh file has them.

/// Meshes with more triangles are refused.
pub const MAX_TRIANGLES: usize = 200_000;

/// A corner as the file has it: in its unit, z up. Double precision, since a mesh may lie far from its origin.
pub type Corner = nalgebra::Point3<f64>;

/// Triangles that a file keeps together: an object or group of an OBJ, a solid of an STL, a primitive of a GLB.
#[derive(Clone, Debug, Default)]
pub struct Group {
    /// Corners.
    pub points: Vec<Corner>,
    /// Corners of each triangle, by position in `points`.
    pub triangles: Vec<[u32; 3]>,
}

/// The smallest and the largest coordinates of all corners that a triangle uses.
pub fn bounds(groups: &[Group]) -> Option<[Corner; 2]> {
    let corners =
        groups.iter().flat_map(|group| group.triangles.iter().flatten().map(move |i| group.points[*i as usize]));
    corners.fold(None, |bounds: Option<[Corner; 2]>, point| {
        let [low, high] = bounds.unwrap_or([point; 2]);
        Some([low.inf(&point), high.sup(&point)])
    })
}

/// What to say of a mesh with this many triangles.
pub fn too_many(count: usize) -> String {
    format!("{count} triangles; the limit is {MAX_TRIANGLES} (simplify the mesh)")
}
