//! What the robot arm costs, beside its targets: `cargo bench --bench arm`.
//!
//! Times of one thread are processor times, so that a busy machine does not count.

use nudge_core::arm::{Arm, ArmTool, DistanceField, Joints, PlanSettings, level_tool, plan, retreat, turned};
use nudge_core::belief::{Belief, BeliefUpdate, Classical};
use nudge_core::camera::{ViewArray, project, render};
use nudge_core::grid::VoxelSet;
use nudge_core::rng::stream;
use nudge_core::scene::{Catalog, RobotPlacement, Scene};
use nudge_core::skill::push::{PushSampler, sample};
use nudge_core::world::{TruthMap, World};
use parry3d::query::PointQuery;
use parry3d::shape::Voxels;
use rand::Rng;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// How far the arm backs out of the shelf at most, metres.
const OUT_M: f64 = 0.5;

fn main() {
    let arm = Arm::standard(&RobotPlacement::default());
    kinematics(&arm);
    let scenes = scenes();
    distances(&arm, &scenes[0]);
    queries(&scenes);
    pushes(&scenes);
}

/// A crowded scene with what is really there.
struct Crowded {
    name: String,
    scene: Scene,
    occupied: VoxelSet,
}

fn scenes() -> Vec<Crowded> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/high");
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(folder).expect("scenes").map(|e| e.expect("entry").path()).collect();
    files.sort();
    let catalog = Catalog::standard();
    let crowded = |path: PathBuf| {
        let (scene, _) = Scene::load(&path, &catalog).expect("scene");
        let truth = TruthMap::of(&scene.grid(), &scene.bodies(&catalog).expect("bodies"));
        let mut occupied = VoxelSet::empty(&scene.grid());
        truth.occupancy.iter().enumerate().filter(|(_, o)| **o > 0).for_each(|(index, _)| occupied.insert(index));
        Crowded { name: scene.name.clone(), occupied, scene }
    };
    files.into_iter().filter(|file| file.extension().is_some_and(|e| e == "toml")).map(crowded).collect()
}

fn kinematics(arm: &Arm) {
    let mut rng = stream(1, "bench", 0);
    let joints: Vec<Joints> = (0..20_000).map(|_| arm.random(&mut rng)).collect();
    let poses: Vec<_> = joints.iter().map(|q| arm.world_from_tool(q)).collect();
    let each = 1e6 / joints.len() as f64;
    let forward = processor_s(|| joints.iter().for_each(|q| _ = black_box(arm.world_from_tool(q))));
    row("forward kinematics, us", forward * each, None);
    let inverse = processor_s(|| {
        poses.iter().zip(&joints).for_each(|(pose, q)| drop(black_box(arm.inverse(pose, q))));
    });
    row("inverse kinematics, all branches of the UR5, us a pose", inverse * each, Some(20.0));
    let margin = processor_s(|| joints.iter().for_each(|q| _ = black_box(arm.singularity_margin(q))));
    row("singularity margin, us", margin * each, None);
}

/// The distance field against parry's voxel shape, asked the same: how far is each ball of the arm?
fn distances(arm: &Arm, crowded: &Crowded) {
    let grid = crowded.scene.grid();
    let before = process_s();
    (0..20).for_each(|_| drop(black_box(DistanceField::new(&grid, &crowded.occupied))));
    row("distance field of the map, ms of all threads", (process_s() - before) * 1e3 / 20.0, None);
    let field = DistanceField::new(&grid, &crowded.occupied);
    let tool = ArmTool::new(arm.clone(), crowded.scene.shelf);
    let space = tool.space().with_map(&crowded.occupied, &field);
    let mut rng = stream(1, "bench", 1);
    // Configurations with the tool in the shelf, where it matters.
    let near: Vec<Joints> = std::iter::repeat_with(|| goal(&tool, &mut rng)).flatten().take(2000).collect();
    let rooms = processor_s(|| near.iter().for_each(|q| _ = black_box(space.room_m(q))));
    row("room of a configuration in the shelf, us", rooms * 1e6 / near.len() as f64, None);
    let free = near.iter().filter(|q| space.is_free(q)).count();
    println!(
        "  {free} of {} random ones in the shelf are free; {} balls",
        near.len(),
        arm.parts().map(|(_, p)| p.balls.len()).sum::<usize>()
    );

    let points: Vec<_> = near
        .iter()
        .take(100)
        .flat_map(|q| {
            let poses = arm.body_poses(q);
            let of_part = move |(body, part): (usize, &nudge_core::arm::Part)| {
                part.balls.iter().map(|ball| (poses[body] * ball.center, ball.radius_m)).collect::<Vec<_>>()
            };
            arm.parts().flat_map(of_part).collect::<Vec<_>>()
        })
        .filter(|(center, radius)| center.y > -radius)
        .collect();
    let by_field = 0.01
        * processor_s(|| (0..100).for_each(|_| points.iter().for_each(|(p, _)| _ = black_box(field.distance_m(p)))));
    row("ball to map by distance field, ns", by_field * 1e9 / points.len() as f64, None);
    let keys: Vec<_> = crowded
        .occupied
        .iter()
        .map(|index| grid.voxel(index))
        .map(|v| parry3d::math::IVector::new(i32::from(v.x), i32::from(v.y), i32::from(v.z)))
        .collect();
    let size = parry3d::math::Vector::new(grid.voxel_m, grid.voxel_m, grid.voxel_m);
    let build = processor_s(|| drop(black_box(Voxels::new(size, &keys))));
    row("parry's voxel shape of the map, ms", build * 1e3, None);
    let voxels = Voxels::new(size, &keys);
    let origin = grid.min();
    let by_parry = processor_s(|| {
        for (p, radius) in &points {
            let center = p.map(|v| v as f32) - origin;
            let at = parry3d::math::Vector::new(center.x, center.y, center.z);
            _ = black_box(voxels.distance_to_local_point(at, true) - *radius as f32);
        }
    });
    row("ball to map by parry's voxel shape, ns", by_parry * 1e9 / points.len() as f64, None);
}

/// A configuration with the tool somewhere in the shelf, if the pose that was drawn is in reach.
fn goal(tool: &ArmTool, rng: &mut nudge_core::rng::ChaCha8Rng) -> Option<Joints> {
    let (min, max) = (tool.shelf.min().map(f64::from), tool.shelf.max().map(f64::from));
    let tip = nalgebra::Point3::new(
        rng.random_range(min.x + 0.05..max.x - 0.05),
        rng.random_range(0.0..max.y - 0.05),
        rng.random_range(0.05..0.20),
    );
    let pose = level_tool(&tip, rng.random_range(-0.6..0.6));
    let branches = tool.arm.inverse(&pose, &tool.ready?);
    (!branches.is_empty()).then(|| branches[rng.random_range(0..branches.len())])
}

/// 200 random queries in crowded shelves, each from where the arm waits to a free configuration with the tool inside.
fn queries(scenes: &[Crowded]) {
    let (mut times, mut straight, mut rounds) = (Vec::new(), 0, Vec::new());
    let (mut solvable, mut solved_in_time, mut asked) = (0, 0, 0);
    for number in 0..600_u64 {
        if asked == 200 {
            break;
        }
        let crowded = &scenes[number as usize % scenes.len()];
        let tool = ArmTool::standard(crowded.scene.shelf);
        let field = DistanceField::new(&crowded.scene.grid(), &crowded.occupied);
        let space = tool.space().with_map(&crowded.occupied, &field);
        let mut rng = stream(1, "queries", number);
        let ready = tool.ready.expect("a place to wait");
        // The densest shelves have hardly a place for the gripper: the next scene is asked then.
        let free = (0..500).find_map(|_| goal(&tool, &mut rng).filter(|q| space.is_free(q)));
        let Some(goal) = free else { continue };
        asked += 1;
        let mut found = None;
        let settings = PlanSettings { rounds: 20_000, shortcuts: 40 };
        let seconds = processor_s(|| {
            let goals = turned(&tool.arm, &retreat(&space, &goal, OUT_M));
            found = plan(&space, &ready, &goals, settings, &mut stream(1, "query", asked));
        });
        if let Some(planned) = found {
            solvable += 1;
            solved_in_time += usize::from(seconds <= 0.2);
            straight += usize::from(planned.rounds == 0);
            times.push(seconds * 1e3);
            rounds.push(planned.rounds as f64);
        }
    }
    times.sort_by(f64::total_cmp);
    rounds.sort_by(f64::total_cmp);
    let at =
        |list: &[f64], share: f64| list.get((share * (list.len() as f64 - 1.0)) as usize).copied().unwrap_or(f64::NAN);
    println!(
        "{asked} random queries in {} crowded shelves: {solvable} solved in 20,000 rounds, {straight} straight",
        scenes.len()
    );
    row("  planning query, median, ms", at(&times, 0.5), Some(20.0));
    row("  planning query, 95th percentile, ms", at(&times, 0.95), None);
    row("  rounds, median", at(&rounds, 0.5), None);
    row(
        "  solved within 200 ms of those solved at all, %",
        100.0 * solved_in_time as f64 / solvable as f64,
        Some(99.0),
    );
}

/// 80 feasible candidates of a mid-episode belief, and what becomes of the pushes.
fn pushes(scenes: &[Crowded]) {
    let catalog = Catalog::standard();
    let views = ViewArray::named("standard300").expect("views");
    for crowded in scenes {
        let (scene, bodies) = (&crowded.scene, crowded.scene.bodies(&catalog).expect("bodies"));
        let mut belief = Belief::uniform(scene.grid());
        for view in views.views.iter().step_by(37) {
            let frame = render(&scene.shelf, &bodies, view, &views.intrinsics).frame;
            belief = Classical.observe(&belief, &project(&frame, &scene.shelf));
        }
        let tool = ArmTool::standard(scene.shelf);
        let (wall, processor) = (Instant::now(), process_s());
        let candidates = sample(PushSampler::Frontier, &belief, None, &tool, 80, &mut stream(1, "pushes", 0));
        let (wall, processor) = (wall.elapsed().as_secs_f64(), process_s() - processor);
        let feasible: Vec<_> = candidates.iter().filter_map(|c| c.motion.as_ref()).collect();
        println!(
            "{}: {} drawn, {} feasible, {:.2} s, {:.2} s of processor",
            crowded.name,
            candidates.len(),
            feasible.len(),
            wall,
            processor
        );
        let mut reasons = std::collections::BTreeMap::<String, usize>::new();
        for words in candidates.iter().filter_map(|c| Some(c.manipulation.against(c.rejection.as_ref()?))) {
            let words = words.split(" would").next().unwrap_or_default().split(" by what").next().unwrap_or_default();
            *reasons.entry(words.to_owned()).or_default() += 1;
        }
        println!("  rejected: {reasons:?}");
        row(
            "  80 candidates on two idle cores at most, s",
            processor / 2.0 * 80.0 / feasible.len().max(1) as f64,
            Some(0.6),
        );
        let mut world = World::new(scene.shelf, bodies.clone());
        world.settle();
        let mut deepest = 0.0_f32;
        let (mut stalls, mut touched, mut pressed, mut moved) = (0, 0, 0, 0);
        for motion in feasible.iter().take(10) {
            let outcome = world.clone().execute(&tool.arm, motion);
            deepest = deepest.max(outcome.arm_in_shelf_m);
            stalls += usize::from(outcome.stalled);
            touched += usize::from(!outcome.link_contacts.is_empty());
            pressed += usize::from(!outcome.against_wall.is_empty());
            moved += usize::from(outcome.displacement_m.iter().any(|m| *m > 0.01));
        }
        println!(
            "  {} executed: {moved} moved something, {stalls} stalled, {touched} touched with a link, {pressed} pressed against a wall",
            feasible.len().min(10)
        );
        row("  deepest in the shelf, mm", f64::from(deepest) * 1e3, Some(2.0));
    }
}

fn row(what: &str, value: f64, target: Option<f64>) {
    println!("{what:<58} {value:>10.3} {}", target.map_or(String::new(), |target| format!("(target {target})")));
}

/// Processor time of this thread, seconds, that `work` takes.
fn processor_s(work: impl FnOnce()) -> f64 {
    let now = || -> f64 {
        let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
        text.split_whitespace().next().and_then(|ns| ns.parse::<f64>().ok()).unwrap_or(f64::NAN) * 1e-9
    };
    let before = now();
    work();
    now() - before
}

/// Processor time of all threads of this process, seconds.
fn process_s() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = text.rsplit(')').next().unwrap_or_default();
    let ticks: f64 = after_name.split_whitespace().skip(11).take(2).filter_map(|t| t.parse::<f64>().ok()).sum();
    ticks / 100.0
}
