use super::super::{Intrinsics, project};
use super::*;
use crate::scene::{BACKGROUND, Shelf};

const PLAIN: Intrinsics = Intrinsics { width: 8, height: 6, focal_px: 6.0, depth_range_m: [0.07, 1.5] };
const PIXELS: usize = 48;

/// From before the middle of the shelf straight in: z ahead, x right, y down.
fn ahead() -> Pose {
    pose_from_matrix([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, -0.2], [0.0, -1.0, 0.0, 0.15], [0.0, 0.0, 0.0, 1.0]])
        .expect("a rotation")
}

fn frame(depth_m: Vec<f32>, classes: PixelClasses) -> Result<Frame> {
    Frame::new(Path::new("frames/001"), ahead(), PLAIN.into(), depth_m, classes)
}

#[test]
fn a_frame_that_cannot_be_is_refused_with_its_file_and_field() {
    let labels = || PixelClasses::Labels(vec![UNLABELLED; PIXELS]);
    let with = |at: usize, value: f32| {
        let mut depth = vec![0.5; PIXELS];
        depth[at] = value;
        depth
    };
    assert!(frame(with(3, 0.0), labels()).is_ok(), "a pixel without a reading");
    let cases = [
        (with(11, f32::NAN), labels(), "frames/001: depth_m: row 1, column 3: is NaN"),
        (with(0, -0.2), labels(), "frames/001: depth_m: row 0, column 0: is -0.2"),
        (with(0, f32::INFINITY), labels(), "frames/001: depth_m: row 0, column 0: is inf"),
        (vec![0.0; PIXELS], labels(), "frames/001: depth_m: is 0 everywhere"),
        (vec![0.5; PIXELS - 1], labels(), "frames/001: depth_m: 47 values, but the intrinsics are of 8 x 6 pixels"),
        (vec![0.5; PIXELS], PixelClasses::Labels(vec![3; 50]), "frames/001: labels: 50 values"),
        (vec![0.5; PIXELS], PixelClasses::Labels(vec![77; PIXELS]), "frames/001: labels: row 0, column 0: class 77"),
        (vec![0.5; PIXELS], PixelClasses::Scores(vec![0.0; PIXELS]), "frames/001: scores: 48 values"),
        (
            vec![0.5; PIXELS],
            PixelClasses::Scores(vec![f32::NAN; PIXELS * CLASS_COUNT]),
            "frames/001: scores: class 0, row 0, column 0: is NaN",
        ),
    ];
    for (depth, classes, expected) in cases {
        let error = frame(depth, classes).expect_err(expected);
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().starts_with(expected) && !error.to_string().contains('\n'), "{error}");
    }
    let tilted = Pinhole { focal_px: [0.0, 6.0], ..PLAIN.into() };
    let error = Frame::new(Path::new("f"), ahead(), tilted, vec![0.5; PIXELS], labels()).expect_err("no focal length");
    assert!(error.to_string().starts_with("f: focal_px: "), "{error}");
}

#[test]
fn a_pose_that_is_no_rotation_is_refused() {
    assert!(pose_from_quaternion([0.0; 3], [0.0, 0.0, 0.0, 1.0]).is_ok());
    assert!(pose_from_quaternion([0.0; 3], [0.5, 0.0, 0.0, 1.0]).is_err_and(|words| words.contains("no rotation")));
    assert!(pose_from_quaternion([0.0; 3], [f32::NAN, 0.0, 0.0, 1.0]).is_err());
    let mut rows = ahead().to_homogeneous();
    let of = |rows: &nalgebra::Matrix4<f32>| std::array::from_fn(|r| std::array::from_fn(|c| rows[(r, c)]));
    assert!(pose_from_matrix(of(&rows)).is_ok());
    rows[(0, 0)] = -1.0;
    assert!(pose_from_matrix(of(&rows)).is_err(), "a mirror");
    rows[(0, 0)] = 1.2;
    assert!(pose_from_matrix(of(&rows)).is_err(), "stretched");
    rows[(0, 0)] = 1.0;
    rows[(3, 0)] = 0.1;
    assert!(pose_from_matrix(of(&rows)).is_err(), "a perspective");
}

#[test]
fn scores_say_the_likeliest_class_and_nothing_where_two_are_equal() {
    let mut scores = vec![0.0; PIXELS * CLASS_COUNT];
    scores[2 * PIXELS] = 1.5;
    scores[5 * PIXELS] = 1.0;
    let frame = frame(vec![0.5; PIXELS], PixelClasses::Scores(scores)).expect("sound");
    assert_eq!((frame.labels()[0], frame.labels()[1]), (2, UNLABELLED));
}

#[test]
fn a_pixel_without_a_label_is_a_surface_of_no_class_and_the_shelf_stays_the_shelf() {
    let shelf = Shelf { voxel_m: 0.01, ..Shelf::new([0.8, 0.4, 0.3]) };
    let seen = |depth_m: f32, label: u8| {
        let labels = PixelClasses::Labels(vec![label; PIXELS]);
        project(&frame(vec![depth_m; PIXELS], labels).expect("sound"), &shelf)
    };
    let (named, unnamed) = (seen(0.45, 3), seen(0.45, UNLABELLED));
    assert!(!named.occupied.is_empty() && named.occupied == unnamed.occupied && named.free == unnamed.free);
    assert!(named.labels.contains(&3) && unnamed.labels.iter().all(|label| *label == UNOBSERVED));
    // Five millimetres before the back wall is the wall, unless somebody says that it is an object.
    assert!(seen(0.595, UNLABELLED).occupied.is_empty() && !seen(0.595, 3).occupied.is_empty());
    assert!(seen(0.45, BACKGROUND.0).occupied.is_empty());
}

#[test]
fn regions_of_one_class_are_one_thing() {
    let labels = [1, 1, 2, 1, 14, 14, 2, 1, 1, 255, 1, 1];
    let found = regions(&labels, 4);
    assert_eq!(found, [0, 0, 1, 2, u16::MAX, u16::MAX, 1, 2, 3, u16::MAX, 2, 2]);
}
