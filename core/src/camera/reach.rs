//! Which views of an array the hand can be at.

use super::{ViewArray, ViewId};
use crate::Pose;
use crate::arm::{ArmTool, HandPose};

impl ViewArray {
    /// Per view, how the hand gets there; `None` where it cannot be.
    pub fn hand_poses(&self, arm: &ArmTool) -> Vec<Option<HandPose>> {
        let poses: Vec<Pose> = self.views.iter().map(|view| view.world_from_camera).collect();
        arm.hand_poses(&poses)
    }

    /// The views that are not offered, given [`ViewArray::hand_poses`]: those that the hand cannot be at. None where it can
    /// be at none, so that an episode without a fitting arm still looks.
    pub fn unreachable(&self, hands: &[Option<HandPose>]) -> Vec<ViewId> {
        if hands.iter().all(Option::is_none) {
            return Vec::new();
        }
        self.views.iter().zip(hands).filter(|(_, hand)| hand.is_none()).map(|(view, _)| view.id).collect()
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::arm::{ArmTool, frame_of};
    use crate::camera::views::look_at;
    use crate::scene::Shelf;
    use std::fmt::Write;

    /// Positions across and up, and look-at targets.
    const LAYOUT: [usize; 3] = [5, 5, 3];
    const TARGETS_X: [f32; 3] = [-0.3, 0.0, 0.3];
    /// Distance of the positions that are tried instead of one that the hand cannot be at, metres.
    const STEP_M: f32 = 0.02;
    /// How far away they may be, in steps.
    const STEPS: i32 = 8;
    /// Distance from a singularity that a hand pose keeps.
    const MARGIN: f64 = 0.02;

    fn robot() -> ArmTool {
        ArmTool::standard(Shelf::new([0.80, 0.40, 0.40]))
    }

    /// The dome's position at a slot.
    fn dome(slot: [usize; 3]) -> [f32; 3] {
        let [u, v] = [0, 1].map(|axis| slot[axis] as f32 / (LAYOUT[axis] - 1) as f32);
        let bulge = (std::f32::consts::PI * u).sin() * (std::f32::consts::PI * v).sin();
        [-0.3375 + 0.675 * u, -0.20 - 0.10 * bulge, 0.055 + 0.2 * v]
    }

    /// Whether the hand can be there, well away from singularities.
    fn fits(robot: &ArmTool, pose: &Pose) -> bool {
        let hands = robot.hand_poses(std::slice::from_ref(pose));
        let well = |hand: &HandPose| robot.arm.singularity_margin(&hand.joints()) > MARGIN;
        hands.iter().flatten().any(well)
    }

    /// The text of `real75`: for every slot of a dome of 5 x 5 positions and three targets the hand pose that is nearest to
    /// it and that the shipped arm reaches.
    pub(in crate::camera) fn real75() -> String {
        let description = "75 poses that the hand of the shipped arm reaches before the standard shelf";
        let mut text = format!(
            "# {description}: around a dome of 5 x 5 positions\n# with three look-at targets each, moved in steps of 2 cm \
             where the arm cannot be at the dome.\nformat = 1\nname = \"real75\"\ndescription = \"{description}\"\n\
             camera = {{ width = 640, height = 480, focal_px = 433.0, depth_range_m = [0.07, 1.5] }}\n\
             layout = {LAYOUT:?}\nviews = [\n"
        );
        let robot = robot();
        let mut offsets: Vec<[i32; 3]> = Vec::new();
        for x in -STEPS..=STEPS {
            for y in -STEPS..=STEPS {
                offsets.extend((-STEPS..=STEPS).map(|z| [x, y, z]));
            }
        }
        offsets.sort_by_key(|offset| (offset.iter().map(|o| o * o).sum::<i32>(), *offset));
        for j in 0..LAYOUT[1] {
            for i in 0..LAYOUT[0] {
                for (k, x) in TARGETS_X.into_iter().enumerate() {
                    let (from, target) = (dome([i, j, k]), [x, 0.25, 0.155]);
                    let moved = |o: &[i32; 3]| [0, 1, 2].map(|a| from[a] + STEP_M * o[a] as f32);
                    // Before the shelf, above the board, and round enough to be the same in the file.
                    let allowed = |p: &[f32; 3]| p[1] <= -0.16 && p[2] >= 0.05;
                    let rounded = |p: [f32; 3]| p.map(|v| (v * 1e4).round() / 1e4);
                    let position = offsets
                        .iter()
                        .map(|offset| rounded(moved(offset)))
                        .filter(allowed)
                        .find(|position| look_at(*position, target).is_ok_and(|pose| fits(&robot, &pose)))
                        .expect("a hand pose near the dome");
                    let [a, b, c] = position;
                    let place = format!("[{a:.4}, {b:.4}, {c:.4}]");
                    writeln!(text, "    {{ position = {place}, target = {target:?}, slot = [{i}, {j}, {k}] }},")
                        .expect("text");
                }
            }
        }
        text + "]\n"
    }

    #[test]
    fn the_hand_reaches_every_view_of_real75() {
        let (robot, array) = (robot(), ViewArray::named("real75").expect("shipped"));
        assert_eq!((array.views.len(), array.layout), (75, LAYOUT));
        let hands = array.hand_poses(&robot);
        assert!(array.unreachable(&hands).is_empty());
        for (view, hand) in array.views.iter().zip(&hands) {
            let joints = hand.as_ref().expect("in reach").joints();
            let camera = robot.arm.world_from_camera(&joints).expect("a camera in hand");
            let asked = frame_of(&view.world_from_camera);
            assert!((camera.translation.vector - asked.translation.vector).norm() < 1e-5);
            // Upright or upside down, it looks the same way.
            let ahead = |frame: &crate::arm::Frame| frame.rotation * nalgebra::Vector3::z();
            assert!((ahead(&camera) - ahead(&asked)).norm() < 1e-5);
            assert!(robot.arm.within_limits(&joints) && robot.arm.singularity_margin(&joints) > MARGIN);
        }
        // They still look from all over the dome.
        let spread = |axis: usize| {
            let at = array.views.iter().map(|view| view.position()[axis]);
            at.clone().fold(f32::NEG_INFINITY, f32::max) - at.fold(f32::INFINITY, f32::min)
        };
        assert!(spread(0) > 0.5 && spread(2) > 0.15, "{} {}", spread(0), spread(2));
    }

    #[test]
    fn views_out_of_reach_are_not_offered() {
        let robot = robot();
        let mut array = ViewArray::named("real75").expect("shipped");
        array.views[7].world_from_camera.translation.vector.x += 3.0;
        let hands = array.hand_poses(&robot);
        assert_eq!(array.unreachable(&hands), [ViewId(7)]);
        array.views.iter_mut().for_each(|view| view.world_from_camera.translation.vector.z += 5.0);
        assert!(
            array.unreachable(&array.hand_poses(&robot)).is_empty(),
            "an episode without a fitting arm still looks"
        );
    }

    #[test]
    fn the_hand_stays_out_of_the_shelf_between_views() {
        let (robot, array) = (robot(), ViewArray::named("real75").expect("shipped"));
        let hands: Vec<HandPose> = array.hand_poses(&robot).into_iter().flatten().collect();
        let space = crate::arm::Space::closed(&robot.arm, &robot.shelf);
        for pair in hands.windows(2).step_by(5) {
            let motion = robot.carry(&pair[0], &pair[1], &mut crate::rng::stream(1, "carry", 0));
            assert_eq!(
                (motion.at(0.0), motion.at(motion.duration_s())),
                (Some(pair[0].joints()), Some(pair[1].joints()))
            );
            for step in 0..=100 {
                let joints = motion.at(motion.duration_s() * f64::from(step) / 100.0).expect("on the way");
                assert!(space.room_m(&joints) > -0.004, "{:?}", space.hit(&joints));
            }
        }
    }
}
