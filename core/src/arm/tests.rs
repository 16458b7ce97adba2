use super::*;
use crate::Result;
use crate::grid::VoxelSet;
use crate::rng::stream;
use crate::scene::{RobotFile, RobotPlacement, Shelf};
use nalgebra::{Matrix4, Vector3};

pub(super) fn ur5() -> Arm {
    Arm::standard(&RobotPlacement::default())
}

fn shelf() -> Shelf {
    Shelf::new([0.80, 0.40, 0.40])
}

/// How far two poses are apart: the larger of metres and radians.
fn apart(a: &Frame, b: &Frame) -> f64 {
    (a.translation.vector - b.translation.vector).norm().max(a.rotation.angle_to(&b.rotation))
}

/// Forward kinematics by the maker's Denavit-Hartenberg table, from the base to the flange.
fn by_table(joints: &[f64]) -> Matrix4<f64> {
    use std::f64::consts::FRAC_PI_2;
    let table = [
        (0.0, FRAC_PI_2, 0.089159),
        (-0.425, 0.0, 0.0),
        (-0.39225, 0.0, 0.0),
        (0.0, FRAC_PI_2, 0.10915),
        (0.0, -FRAC_PI_2, 0.09465),
        (0.0, 0.0, 0.0823),
    ];
    table.iter().zip(joints).fold(Matrix4::identity(), |pose, (&(a, alpha, d), q)| {
        let ((s, c), (sa, ca)) = (q.sin_cos(), f64::sin_cos(alpha));
        #[rustfmt::skip]
        let link = Matrix4::new(
            c, -s * ca,  s * sa, a * c,
            s,  c * ca, -c * sa, a * s,
            0.0,    sa,      ca,     d,
            0.0,   0.0,     0.0,   1.0,
        );
        pose * link
    })
}

#[test]
fn forward_kinematics_agrees_with_the_makers_table() {
    // The maker's table has its base turned by half a turn against the ROS frames that the URDF uses.
    let arm = Arm::standard(&RobotPlacement { base: [0.0; 3], ..RobotPlacement::default() });
    let turn = Matrix4::from_euler_angles(0.0, 0.0, std::f64::consts::PI);
    let mut rng = stream(1, "forward", 0);
    for _ in 0..1000 {
        let joints = arm.random(&mut rng);
        let table = turn * by_table(&joints);
        let tip = table * nalgebra::Vector4::new(0.0, 0.0, 0.16, 1.0);
        let pose = arm.world_from_tool(&joints);
        assert!((pose.translation.vector - tip.xyz()).norm() < 1e-9, "{joints:?}");
        let approach = pose.rotation * Vector3::z();
        assert!((approach - table.fixed_view::<3, 1>(0, 2)).norm() < 1e-9, "{joints:?}");
    }
}

#[test]
fn forward_kinematics_agrees_with_an_independent_implementation() {
    // Made by scripts/reference_poses.py: pinocchio on the makers' own description.
    let arm = Arm::standard(&RobotPlacement { base: [0.0; 3], ..RobotPlacement::default() });
    let tool_from_flange = Frame::translation(0.0, 0.0, -0.16);
    let mut compared = 0;
    for line in include_str!("ur5_reference.csv").lines().filter(|line| !line.starts_with('#')) {
        let numbers: Vec<f64> = line.split(',').map(|number| number.parse().expect("a number")).collect();
        let [.., x, y, z, i, j, k, w] = numbers[..] else { panic!("{line}") };
        let rotation = nalgebra::UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, i, j, k));
        let reference = Frame::from_parts(nalgebra::Translation3::new(x, y, z), rotation);
        let flange = arm.world_from_tool(&Joints::of(&numbers[..6])) * tool_from_flange;
        assert!(apart(&flange, &reference) < 1e-6, "{line}: {flange}");
        compared += 1;
    }
    assert_eq!(compared, 500);
}

#[test]
fn forward_and_closed_form_inverse_agree_on_a_hundred_thousand_poses() {
    let arm = ur5();
    assert!(arm.has_closed_form());
    let mut rng = stream(1, "inverse", 0);
    let (mut branches, mut worst, mut missed) = (0, 0.0_f64, 0);
    for _ in 0..100_000 {
        let joints = arm.random(&mut rng);
        let pose = arm.world_from_tool(&joints);
        let found = arm.inverse(&pose, &joints);
        branches += found.len();
        for solution in &found {
            worst = worst.max(apart(&arm.world_from_tool(solution), &pose));
            assert!(arm.within_limits(solution));
        }
        missed += usize::from(!found.iter().any(|solution| solution.largest_change(&joints) < 1e-4));
    }
    assert!(worst < 1e-6, "{worst}");
    assert_eq!(missed, 0, "the configuration itself is among its solutions");
    assert!(branches > 400_000, "{branches} branches of 100,000 poses");
}

#[test]
fn the_inverse_of_stretched_and_folded_poses_is_exact_too() {
    let arm = ur5();
    for joints in [
        [0.0; 6],
        [0.3, -0.5, 0.0, 0.2, 0.7, 0.1],
        [0.3, -0.5, 1.0, 0.2, 0.0, 0.4],
        [0.3, -0.5, 1.0, 0.2, std::f64::consts::PI, 0.4],
        [0.3, -0.5, 1e-5, 0.2, 1e-5, 0.4],
    ] {
        let joints = Joints::of(&joints);
        let pose = arm.world_from_tool(&joints);
        let found = arm.inverse(&pose, &joints);
        assert!(!found.is_empty(), "{joints:?}");
        for solution in &found {
            assert!(apart(&arm.world_from_tool(solution), &pose) < 1e-6, "{joints:?} {solution:?}");
        }
        assert!(found[0].largest_change(&joints) < 1e-3, "{joints:?} {:?}", found[0]);
    }
}

#[test]
fn what_is_out_of_reach_has_no_inverse() {
    let arm = ur5();
    let mut pose = arm.world_from_tool(&Joints::zero(6));
    pose.translation.vector += Vector3::new(0.5, 0.0, 0.0);
    assert!(arm.inverse(&pose, &Joints::zero(6)).is_empty());
}

/// The shipped arm with its wrist bent out of shape: no closed form, but an arm all the same.
fn bent() -> String {
    include_str!("../../../assets/robots/ur5_2f85.urdf")
        .replace(r#"<origin xyz="0 0 0.09465"/>"#, r#"<origin xyz="0.02 0 0.09465" rpy="0.2 0 0"/>"#)
}

#[test]
fn the_numeric_inverse_serves_other_arms() {
    let arm = parse(&bent()).expect("an arm");
    assert!(!arm.has_closed_form());
    let mut rng = stream(1, "numeric", 0);
    let mut found = 0;
    for _ in 0..100 {
        let joints = arm.random(&mut rng);
        let pose = arm.world_from_tool(&joints);
        let solutions = arm.inverse(&pose, &arm.random(&mut rng));
        assert!(solutions.iter().all(|s| apart(&arm.world_from_tool(s), &pose) < 1e-6 && arm.within_limits(s)));
        found += usize::from(!solutions.is_empty());
    }
    assert!(found >= 95, "{found} of 100");
}

#[test]
fn the_numeric_inverse_finds_a_closed_form_solution() {
    let mut arm = ur5();
    let mut rng = stream(1, "both", 0);
    for _ in 0..50 {
        let joints = arm.random(&mut rng);
        let near = arm.random(&mut rng);
        let pose = arm.world_from_tool(&joints);
        let closed = arm.inverse(&pose, &near);
        let form = arm.closed_form.take();
        for solution in arm.inverse(&pose, &near) {
            let turned = |a: &f64, b: &f64| ((a - b) / std::f64::consts::TAU).fract().abs();
            let same = |other: &Joints| {
                other.iter().zip(solution.iter()).all(|(a, b)| turned(a, b) < 1e-3 || turned(a, b) > 1.0 - 1e-3)
            };
            assert!(arm.singularity_margin(&solution) < 0.01 || closed.iter().any(same), "{solution:?}");
        }
        arm.closed_form = form;
    }
}

#[test]
fn the_jacobian_is_the_derivative() {
    let arm = ur5();
    let mut rng = stream(1, "jacobian", 0);
    for _ in 0..20 {
        let joints = arm.random(&mut rng);
        let before = arm.world_from_tool(&joints);
        for (at, column) in arm.jacobian(&joints).iter().enumerate() {
            let mut moved = joints;
            moved[at] += 1e-6;
            let after = arm.world_from_tool(&moved);
            let linear = (after.translation.vector - before.translation.vector) / 1e-6;
            let angular = (after.rotation * before.rotation.inverse()).scaled_axis() / 1e-6;
            assert!((linear - column.fixed_rows::<3>(0)).norm() < 1e-5);
            assert!((angular - column.fixed_rows::<3>(3)).norm() < 1e-5);
        }
    }
}

#[test]
fn the_margin_vanishes_at_singularities_only() {
    let arm = ur5();
    let margin = |joints: [f64; 6]| arm.singularity_margin(&Joints::of(&joints));
    assert!(margin([0.3, -1.2, 1.8, -0.6, 1.57, 0.0]) > 0.1);
    assert!(margin([0.3, -1.2, 0.0, -0.6, 1.57, 0.0]) < 1e-6, "elbow stretched");
    assert!(margin([0.3, -1.2, 1.8, -0.6, 0.0, 0.0]) < 1e-6, "wrist stretched");
}

#[test]
fn balls_cover_their_parts_and_little_more() {
    let arm = ur5();
    let mut rng = stream(1, "cover", 0);
    let mut count = 0;
    for (_, part) in arm.parts() {
        count += part.balls.len();
        let bounds = crate::solid::Bounds::around(part.shape.vertices.iter().copied()).expect("corners");
        for _ in 0..2000 {
            let p = crate::Point::from([0, 1, 2].map(|a| {
                let grown = 0.03;
                bounds.min[a] - grown + rand::Rng::random::<f32>(&mut rng) * (bounds.size()[a] + 2.0 * grown)
            }));
            let in_ball = |by: f64| part.balls.iter().any(|b| (b.center - p.map(f64::from)).norm() <= b.radius_m + by);
            if part.shape.contains(p) {
                assert!(in_ball(1e-6), "{} at {p}", part.link);
            }
            let outside = part.shape.planes.iter().map(|f| f.normal.dot(&p.coords) - f.offset).fold(0.0, f32::max);
            assert!(outside < 0.016 || !in_ball(0.0), "{} sticks out by {outside} at {p}", part.link);
        }
    }
    assert!((100..1000).contains(&count), "{count} balls");
}

#[test]
fn room_is_a_promise() {
    // Whatever moves less than the room may not touch: no configuration nearer than that is in the way.
    let arm = ur5();
    let grid = shelf().grid();
    let mut occupied = VoxelSet::empty(&grid);
    for index in 0..grid.voxel_count() {
        let at = grid.center(grid.voxel(index));
        if at.y > 0.2 && at.z < 0.2 && at.x.abs() < 0.1 {
            occupied.insert(index);
        }
    }
    let field = DistanceField::new(&grid, &occupied);
    let space = Space::empty(&arm, &shelf()).with_map(&occupied, &field);
    let mut rng = stream(1, "room", 0);
    let mut tested = 0;
    while tested < 300 {
        let joints = arm.random(&mut rng);
        let room = space.room_m(&joints);
        if room <= 0.0 {
            continue;
        }
        tested += 1;
        for _ in 0..20 {
            let other = arm.random(&mut rng);
            let share = room / arm.travel_m(&joints, &other);
            let near = joints.toward(&other, share.min(1.0));
            // A voxel's half diagonal is what the field may be off by.
            assert!(space.room_m(&near) > -0.009, "{} from {room}", space.room_m(&near));
        }
    }
}

#[test]
fn hits_say_what_meets_what() {
    let arm = ur5();
    let space = Space::empty(&arm, &shelf());
    let ready = ready(&space);
    assert!(space.is_free(&ready) && space.hit(&ready).is_none());
    let at = |tip: [f64; 3]| arm.inverse(&tool_at(tip), &ready);
    let hits: Vec<String> = at([0.0, -0.2, 0.0]).iter().map(|q| space.hit(q).expect("low").to_string()).collect();
    assert!(hits.iter().any(|hit| hit.contains("would meet the table")), "{hits:?}");
    let hits: Vec<String> = at([0.37, 0.1, 0.1]).iter().map(|q| space.hit(q).expect("aside").to_string()).collect();
    assert!(hits.iter().any(|hit| hit.contains("would meet the shelf's right wall")), "{hits:?}");
    let mut rng = stream(1, "folded", 0);
    let hits = (0..500).filter_map(|_| space.hit(&arm.random(&mut rng)));
    let folded: Vec<Hit> = hits.filter(|hit| matches!(hit.obstacle, Obstacle::Arm { .. })).collect();
    assert!(folded.len() > 20, "{folded:?}");
    assert!(folded.iter().all(|hit| hit.to_string().contains("would meet the arm's own ")));
    let grid = shelf().grid();
    let mut occupied = VoxelSet::empty(&grid);
    let at = crate::Point::new(0.0, 0.1, 0.1);
    occupied.insert(grid.index(grid.voxel_at(at).expect("inside")));
    let field = DistanceField::new(&grid, &occupied);
    let space = space.with_map(&occupied, &field);
    let pose = tool_at([0.0, 0.1, 0.1]);
    let inside = arm.inverse(&pose, &ready);
    let hit = inside.iter().find_map(|joints| space.hit(joints)).expect("the finger on the voxel");
    assert!(hit.to_string().contains("gripper_link would meet what is believed to stand at (0.00"), "{hit}");
    let pushing = space.pushing();
    assert!(inside.iter().any(|joints| pushing.is_free(joints)), "the gripper may touch it");
    let touched = |tip: [f64; 3]| arm.gripper_touches(&tool_at(tip), &field, |index| occupied.contains(index));
    assert!(touched([0.0, 0.108, 0.1]).is_some() && touched([0.0, 0.12, 0.1]).is_some());
    assert!(touched([0.0, 0.08, 0.1]).is_none() && touched([0.0, 0.1, 0.13]).is_none());
}

/// The tool at a point, level, pointing into the shelf.
fn tool_at(tip: [f64; 3]) -> Frame {
    crate::arm::ready::level_tool(&nalgebra::Point3::from(tip), 0.0)
}

fn ready(space: &Space<'_>) -> Joints {
    space.ready().expect("somewhere before the shelf")
}

#[test]
fn plans_are_free_within_limits_and_the_same_every_time() {
    let arm = ur5();
    let grid = shelf().grid();
    let mut occupied = VoxelSet::empty(&grid);
    for index in 0..grid.voxel_count() {
        let at = grid.center(grid.voxel(index));
        if at.z < 0.2 && (0.04..0.10).contains(&at.y) && (0.0..0.12).contains(&at.x) {
            occupied.insert(index);
        }
    }
    let field = DistanceField::new(&grid, &occupied);
    let space = Space::empty(&arm, &shelf()).with_map(&occupied, &field);
    let start = ready(&space);
    // Behind the box, from the side.
    let tips = [-0.04, -0.07, -0.10].map(|x| crate::arm::ready::level_tool(&[x, 0.20, 0.10].into(), -0.4));
    let goals: Vec<Vec<Joints>> = tips
        .iter()
        .flat_map(|pose| arm.inverse(pose, &start))
        .filter(|joints| space.is_free(joints))
        .map(|joints| vec![joints])
        .collect();
    assert!(!goals.is_empty());
    let way = |seed| plan(&space, &start, &goals, PlanSettings::default(), &mut stream(seed, "plan", 0));
    let planned = way(1).expect("a way");
    assert_eq!(planned.path.first(), Some(&start));
    assert!(goals.iter().any(|goal| planned.path.last() == goal.first()));
    for pair in planned.path.windows(2) {
        for step in 0..=200 {
            let joints = pair[0].toward(&pair[1], f64::from(step) / 200.0);
            assert!(space.room_m(&joints) > -0.005 && arm.within_limits(&joints));
        }
    }
    assert_eq!(way(1).expect("a way").path, planned.path);
    let walled = goals.iter().map(|chain| vec![chain[0]]).collect::<Vec<_>>();
    let inside_out = plan(
        &space,
        &Joints::of(&[0.0, 1.5, 0.0, 0.0, 0.0, 0.0]),
        &walled,
        PlanSettings::default(),
        &mut stream(1, "plan", 0),
    );
    assert!(inside_out.is_none(), "a start in the table leads nowhere");
}

#[test]
fn motions_keep_within_speeds() {
    let arm = ur5();
    let path = [[0.0, -1.5, 1.0, 0.0, 1.0, 0.0], [1.0, -1.5, 1.2, 0.0, 1.0, 0.0], [1.0, -1.0, 1.2, -2.0, 1.0, 0.3]]
        .map(|q| Joints::of(&q));
    for (tool_m_s, slow) in [(10.0, false), (0.1, true)] {
        let motion = Motion::along(&arm, &path, tool_m_s);
        let end = motion.duration_s();
        assert_eq!((motion.at(-1.0), motion.at(end + 1.0)), (Some(path[0]), Some(path[2])));
        let back = motion.reversed();
        let mut fastest = 0.0_f64;
        let dt = end / 5000.0;
        for step in 0..5000 {
            let at = f64::from(step) * dt;
            let (a, b) = (motion.at(at).expect("on the way"), motion.at(at + dt).expect("on the way"));
            for ((a, b), joint) in a.iter().zip(b.iter()).zip(&arm.joints) {
                assert!((a - b).abs() / dt <= joint.speed * 1.001, "{} at {at}", joint.name);
                fastest = fastest.max((a - b).abs() / dt / joint.speed);
            }
            assert!(back.at(end - at).expect("on the way").largest_change(&a) < 1e-9);
        }
        assert!(slow || fastest > 0.99, "{fastest}");
        assert!((motion.clone().then(&back).duration_s() - 2.0 * end).abs() < 1e-9);
    }
}

#[test]
fn the_swept_volume_holds_the_arm() {
    let arm = ur5();
    let grid = shelf().grid();
    let space = Space::empty(&arm, &shelf());
    let start = arm.inverse(&tool_at([0.05, -0.02, 0.06]), &ready(&space))[0];
    let follow = follow_line(&arm, &start, &Vector3::new(0.0, 0.2, 0.0), |_| true);
    assert!(follow.complete);
    let mut swept = VoxelSet::empty(&grid);
    arm.sweep(&follow.path, &grid, &mut swept);
    for joints in &follow.path {
        let poses = arm.body_poses(joints);
        for (body, part) in arm.parts() {
            let center =
                part.shape.vertices.iter().map(|v| v.coords).sum::<crate::Vector>() / part.shape.vertices.len() as f32;
            for vertex in &part.shape.vertices {
                let inner = crate::Point::from(center + (vertex.coords - center) * 0.999);
                let point = pose_of(&poses[body]) * inner;
                if let Some(voxel) = grid.voxel_at(point) {
                    assert!(swept.contains(grid.index(voxel)), "{} at {point}", part.link);
                }
            }
        }
    }
    let field = DistanceField::new(&grid, &swept);
    assert!(field.distance_m(&[0.05, 0.1, 0.06].into()) < 0.0 && field.distance_m(&[0.05, 0.25, 0.06].into()) > 0.05);
    // The gripper's broad middle is 111 mm wide and 35 mm thick; nothing of it is swept 25 mm above its middle.
    for index in swept.iter() {
        let at = grid.center(grid.voxel(index));
        assert!((at.x - 0.05).abs() < 0.062 && at.y < 0.186, "{at}");
    }
}

pub(super) fn parse(text: &str) -> Result<Arm> {
    let file = RobotFile {
        source: "arm.urdf".to_owned(),
        text: text.to_owned(),
        meshes: Default::default(),
        tool: None,
        camera: None,
    };
    Arm::placed(&RobotPlacement { urdf: Some(file), ..RobotPlacement::default() })
}
