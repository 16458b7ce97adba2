//! Poses as text: sixteen numbers of a 4 x 4 matrix, twelve of its upper rows, or x y z qx qy qz qw.

use crate::Pose;
use crate::camera::{pose_from_matrix, pose_from_quaternion};

/// The pose of a text, or why it is none.
///
/// Twelve and sixteen numbers are a matrix, row by row. Seven are a position and a quaternion, whose numbers are kept to the
/// bit. Numbers that are not finite mean that the camera was lost.
pub(super) fn pose_of(text: &str) -> Result<Pose, String> {
    let numbers: Vec<f32> = text
        .split(|c: char| c.is_whitespace() || c == ',')
        .filter(|word| !word.is_empty())
        .map(|word| word.parse().map_err(|_| format!("no pose: `{}` is no number", word.escape_default())))
        .collect::<Result<_, _>>()?;
    if !numbers.iter().all(|number| number.is_finite()) {
        return Err("no pose: the camera was lost".to_owned());
    }
    match numbers[..] {
        [x, y, z, qx, qy, qz, qw] => pose_from_quaternion([x, y, z], [qx, qy, qz, qw]),
        _ if matches!(numbers.len(), 12 | 16) => {
            let row = |row: usize| [0, 1, 2, 3].map(|column| numbers.get(4 * row + column).copied());
            let whole = |at: usize| row(at).map(|number| number.unwrap_or_default());
            let last = if numbers.len() == 16 { whole(3) } else { [0.0, 0.0, 0.0, 1.0] };
            pose_from_matrix([whole(0), whole(1), whole(2), last])
        }
        _ => Err(format!("no pose: {} numbers where 16, 12 or 7 are needed", numbers.len())),
    }
}

/// The pose of a matrix in double precision.
pub(super) fn pose_of_rows(rows: [[f64; 4]; 4]) -> Result<Pose, String> {
    if !rows.iter().flatten().all(|number| number.is_finite()) {
        return Err("no pose: the camera was lost".to_owned());
    }
    pose_from_matrix(rows.map(|row| row.map(|number| number as f32)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_is_a_matrix_or_a_position_with_a_quaternion() {
        let matrix = pose_of("1 0 0 0.5\n0 0 1 -0.25\n0 -1 0 0.125\n0 0 0 1\n").expect("a matrix");
        assert!((matrix * crate::Point::new(0.0, 0.0, 2.0) - crate::Point::new(0.5, 1.75, 0.125)).norm() < 1e-6);
        let upper = pose_of("1 0 0 0.5 0 0 1 -0.25 0 -1 0 0.125").expect("its upper rows");
        assert_eq!(upper, matrix);
        let quaternion = pose_of("0.5, -0.25, 0.125, -0.70710677, 0, 0, 0.70710677").expect("a quaternion");
        assert!(quaternion.rotation.angle_to(&matrix.rotation) < 1e-3);
        assert_eq!(quaternion.rotation.i.to_bits(), (-0.70710677_f32).to_bits(), "kept to the bit");
    }

    #[test]
    fn what_is_no_pose_says_why() {
        let said = |text: &str| pose_of(text).expect_err(text);
        assert_eq!(said("-inf -inf -inf -inf 0 0 0 1 0 0 0 0 0 0 0 1"), "no pose: the camera was lost");
        assert_eq!(said("1 2 3"), "no pose: 3 numbers where 16, 12 or 7 are needed");
        assert_eq!(said("1 0 0 x"), "no pose: `x` is no number");
        assert!(said("2 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1").contains("no rotation"));
        assert!(said("0 0 0 0 0 0 0.5").contains("no rotation"));
    }
}
