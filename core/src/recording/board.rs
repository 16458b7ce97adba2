//! `board.toml`: where the shelf is in a recording, and how large.
//!
//! ```toml
//! format = 1
//! size = [0.8, 0.4, 0.4]                # width, depth and height of what is mapped, metres
//! position = [0.0, 0.0, 0.0]            # the middle of the board's front edge, in the recording's frame
//! quaternion = [0.0, 0.0, 0.0, 1.0]     # x y z w; turns the board's axes (x right, y into the shelf, z up) into the recording's
//! voxel_m = 0.005                       # optional
//! column_closure = true                 # optional: whether objects stand on the board and do not overhang
//! ```

use super::labels::toml_error;
use crate::fixed;
use crate::scene::Shelf;
use crate::{Error, Pose, Result};
use nalgebra::{Quaternion, Translation3, UnitQuaternion};
use serde::Deserialize;
use std::path::Path;

/// How far the length of a quaternion that a person typed may be from 1.
const TYPED: f32 = 0.01;

/// Where the shelf is in a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Board {
    /// What is mapped.
    pub shelf: Shelf,
    /// The board's pose in the recording's frame.
    pub recording_from_board: Pose,
}

impl Default for Board {
    /// The standard shelf, in a recording whose frame is the board's.
    fn default() -> Self {
        Self { shelf: Shelf::new([0.8, 0.4, 0.4]), recording_from_board: Pose::identity() }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawBoard {
    format: u32,
    #[serde(deserialize_with = "fixed::array")]
    size: [f32; 3],
    #[serde(deserialize_with = "fixed::array")]
    position: [f32; 3],
    #[serde(deserialize_with = "fixed::array")]
    quaternion: [f32; 4],
    voxel_m: Option<f32>,
    column_closure: Option<bool>,
}

impl Board {
    /// Reads `board.toml`.
    ///
    /// # Errors
    /// Broken TOML, unknown keys, another format, a quaternion that is no rotation, a place that is nowhere. Size and voxel
    /// are checked with the scene that they become.
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|error| Error::io(path, error))?;
        Self::parse(path, &text)
    }

    fn parse(path: &Path, text: &str) -> Result<Self> {
        let raw: RawBoard = toml::from_str(text).map_err(|error| toml_error(path, text, &error))?;
        if raw.format != 1 {
            return Err(Error::input(path, "format", format!("is {}, this version reads format 1", raw.format)));
        }
        if !raw.position.iter().all(|x| x.is_finite() && x.abs() <= 1000.0) {
            return Err(Error::input(path, "position", "must be three finite numbers of metres"));
        }
        let [x, y, z, w] = raw.quaternion;
        let quaternion = Quaternion::new(w, x, y, z);
        if (quaternion.norm() - 1.0).abs() > TYPED || !quaternion.norm().is_finite() {
            let words = format!("{:?} is no rotation: its length is {}, not 1", raw.quaternion, quaternion.norm());
            return Err(Error::input(path, "quaternion", words));
        }
        let mut shelf = Shelf::new(raw.size);
        shelf.voxel_m = raw.voxel_m.unwrap_or(shelf.voxel_m);
        shelf.column_closure = raw.column_closure.unwrap_or(shelf.column_closure);
        let rotation = UnitQuaternion::from_quaternion(quaternion);
        Ok(Self { shelf, recording_from_board: Pose::from_parts(Translation3::from(raw.position), rotation) })
    }

    /// The file's text: reading it gives the same numbers.
    pub fn to_toml(&self) -> String {
        let (pose, q) = (self.recording_from_board, self.recording_from_board.rotation);
        let position: [f32; 3] = pose.translation.vector.into();
        format!(
            "# Where the shelf is in a recording: the middle of its board's front edge, in the recording's frame.\n\
             # x is right, y into the shelf, z up. Metres.\nformat = 1\nsize = {:?}\nposition = {position:?}\n\
             quaternion = {:?}\nvoxel_m = {:?}\ncolumn_closure = {}\n",
            self.shelf.size,
            [q.i, q.j, q.k, q.w],
            self.shelf.voxel_m,
            self.shelf.column_closure
        )
    }

    /// A camera's pose in the board's frame; to the bit as it was where the recording's frame is the board's.
    pub fn board_from_camera(&self, recording_from_camera: &Pose) -> Pose {
        if self.recording_from_board == Pose::identity() {
            return *recording_from_camera;
        }
        let mut pose = self.recording_from_board.inverse() * recording_from_camera;
        pose.rotation.renormalize();
        pose
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Point, Vector};

    #[test]
    fn a_board_comes_back_from_its_file_and_brings_cameras_into_its_frame() {
        let turn = UnitQuaternion::from_axis_angle(&Vector::z_axis(), 0.5);
        let board = Board {
            shelf: Shelf { column_closure: false, ..Shelf::new([0.6, 0.35, 0.3]) },
            recording_from_board: Pose::from_parts(Translation3::new(1.0, 2.0, 0.75), turn),
        };
        let back = Board::parse(Path::new("board.toml"), &board.to_toml()).expect("reads");
        assert_eq!(back.shelf, board.shelf);
        assert!((back.recording_from_board.inverse() * board.recording_from_board).translation.vector.norm() < 1e-6);
        let camera = board.recording_from_board * Pose::translation(0.0, -0.5, 0.3);
        let seen = board.board_from_camera(&camera) * Point::origin();
        assert!((seen - Point::new(0.0, -0.5, 0.3)).norm() < 1e-6, "{seen}");
        assert_eq!(Board::default().board_from_camera(&camera), camera);
    }

    #[test]
    fn a_wrong_board_is_told_by_its_place() {
        let good = Board::default().to_toml();
        let cases = [
            ("format = 1", "format = 3", "board.toml: format: is 3"),
            (
                "[0.0, 0.0, 0.0, 1.0]",
                "[0.0, 0.0, 0.0, 0.5]",
                "board.toml: quaternion: [0.0, 0.0, 0.0, 0.5] is no rotation",
            ),
            ("position = [0.0,", "position = [nan,", "board.toml: position: must be"),
            ("size = ", "sise = ", "board.toml: line 4: unknown field"),
            ("size = [0.8, 0.4, 0.4]", "size = [0.8, 0.4]", "board.toml: line 4: 2 numbers where 3"),
        ];
        for (from, to, said) in cases {
            let line = Board::parse(Path::new("board.toml"), &good.replacen(from, to, 1)).expect_err(to).to_string();
            assert!(line.starts_with(said) && !line.contains('\n'), "{line}");
        }
    }
}
