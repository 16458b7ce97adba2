//! The outside of a set of voxels as one mesh: a fraction of the corners that a box for every voxel has.
//!
//! Only faces towards what is not in the set are there, and faces of one colour in a row along z, or along y where they look
//! up or down, are one. Nothing is seen from below.

use crate::colors::Rgb;
use nudge_core::grid::Grid;

/// A mesh of flat rectangles: four corners each, two triangles.
#[derive(Debug, Default)]
pub(super) struct Faces {
    corners: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    colors: Vec<rerun::Color>,
    triangles: Vec<[u32; 3]>,
}

impl Faces {
    /// Of the voxels at `shown`, which are among those `inside`.
    pub fn of(grid: &Grid, shown: &[usize], inside: &[bool], rgb: impl Fn(usize) -> Rgb) -> Self {
        let mut faces = Self::default();
        let [width, depth, height] = grid.dims;
        let sizes = [width, depth, height];
        let strides = [depth * height, height, 1];
        let place = |index: usize| [index / strides[0], index / strides[1] % depth, index % height];
        // Towards the left, the right, the front, the back and up.
        for (axis, is_far) in [(0, false), (0, true), (1, false), (1, true), (2, true)] {
            let along = if axis == 2 { 1 } else { 2 };
            let is_open = |index: usize| {
                let at = place(index)[axis];
                let beside = if is_far { index + strides[axis] } else { index.wrapping_sub(strides[axis]) };
                let is_edge = if is_far { at + 1 == sizes[axis] } else { at == 0 };
                is_edge || !inside[beside]
            };
            let mut open: Vec<usize> = shown.iter().copied().filter(|index| is_open(*index)).collect();
            if along == 1 {
                // In rows along y.
                open.sort_unstable_by_key(|index| {
                    let [x, y, z] = place(*index);
                    (x, z, y)
                });
            } else {
                open.sort_unstable();
            }
            let mut row: Option<(usize, usize, Rgb)> = None;
            for index in open {
                let colour = rgb(index);
                match &mut row {
                    Some((_, last, of))
                        if *last + strides[along] == index && *of == colour && place(index)[along] > 0 =>
                    {
                        *last = index;
                    }
                    _ => {
                        if let Some((first, last, of)) = row.replace((index, index, colour)) {
                            faces.add(grid, [place(first), place(last)], axis, is_far, of);
                        }
                    }
                }
            }
            if let Some((first, last, of)) = row {
                faces.add(grid, [place(first), place(last)], axis, is_far, of);
            }
        }
        faces
    }

    /// The face of the box from one voxel to another that looks along an axis.
    fn add(&mut self, grid: &Grid, [first, last]: [[usize; 3]; 2], axis: usize, is_far: bool, rgb: Rgb) {
        let edge = |axis: usize, at: usize| grid.origin[axis] + at as f32 * grid.voxel_m;
        let [across, up] = [(axis + 1) % 3, (axis + 2) % 3];
        let base = self.corners.len() as u32;
        for [a, b] in [[0, 0], [1, 0], [1, 1], [0, 1]] {
            let mut corner = [0.0; 3];
            corner[axis] = edge(axis, if is_far { last[axis] + 1 } else { first[axis] });
            corner[across] = edge(across, if a == 1 { last[across] + 1 } else { first[across] });
            corner[up] = edge(up, if b == 1 { last[up] + 1 } else { first[up] });
            self.corners.push(corner);
            let mut normal = [0.0; 3];
            normal[axis] = if is_far { 1.0 } else { -1.0 };
            self.normals.push(normal);
            self.colors.push(rerun::Color::from(rgb));
        }
        let corners = if is_far { [[0, 1, 2], [0, 2, 3]] } else { [[0, 2, 1], [0, 3, 2]] };
        self.triangles.extend(corners.map(|triangle| triangle.map(|corner| base + corner)));
    }

    /// Number of corners, four for every rectangle.
    pub fn corners(&self) -> usize {
        self.corners.len()
    }

    /// As the viewer draws it; `None` of no voxels.
    pub fn mesh(self) -> Option<rerun::Mesh3D> {
        (!self.corners.is_empty()).then(|| {
            rerun::Mesh3D::new(self.corners)
                .with_vertex_normals(self.normals)
                .with_vertex_colors(self.colors)
                .with_triangle_indices(self.triangles)
                // What was empty before was drawn see-through.
                .with_albedo_factor(rerun::Rgba32::from_unmultiplied_rgba(255, 255, 255, 255))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_looks_at_other_voxels_is_left_out_and_rows_of_one_colour_are_one_face() {
        let grid = Grid::for_shelf([0.04, 0.03, 0.05], 0.01);
        let [_, depth, height] = grid.dims;
        let at = |x: usize, y: usize, z: usize| (x * depth + y) * height + z;
        let of = |voxels: &[usize], rgb: &dyn Fn(usize) -> Rgb| {
            let mut inside = vec![false; grid.voxel_count()];
            voxels.iter().for_each(|voxel| inside[*voxel] = true);
            Faces::of(&grid, voxels, &inside, rgb)
        };
        let grey = |_| [9; 3];
        assert_eq!(of(&[at(1, 1, 1)], &grey).corners() / 4, 5, "a voxel, but for its underside");
        assert_eq!(of(&[at(1, 1, 1), at(1, 1, 2)], &grey).corners() / 4, 5, "a column of one colour is one box");
        let by_height = |voxel: usize| if voxel % height == 1 { [1; 3] } else { [2; 3] };
        assert_eq!(
            of(&[at(1, 1, 1), at(1, 1, 2)], &by_height).corners() / 4,
            9,
            "of two colours it is two, with one top"
        );
        assert_eq!(of(&[at(1, 0, 1), at(1, 1, 1)], &grey).corners() / 4, 7, "tops in a row along y are one");
        assert_eq!(
            of(&[at(1, 1, height - 1), at(1, 2, 0)], &grey).corners() / 4,
            10,
            "the end of a column is no neighbour"
        );
        let one = of(&[at(0, 0, 0)], &grey);
        let high = one.corners.iter().flatten().copied().fold(f32::NEG_INFINITY, f32::max);
        let expected =
            [0, 1, 2].map(|axis| grid.origin[axis] + grid.voxel_m).into_iter().fold(f32::NEG_INFINITY, f32::max);
        assert!((high - expected).abs() < 1e-6);
        // Seen from outside, corners go round against the clock.
        for triangle in &one.triangles {
            let [a, b, c] = triangle.map(|at| nalgebra::Vector3::from(one.corners[at as usize]));
            let normal = nalgebra::Vector3::from(one.normals[triangle[0] as usize]);
            assert!((b - a).cross(&(c - a)).dot(&normal) > 0.0);
        }
        assert!(of(&[], &grey).mesh().is_none());
    }
}
