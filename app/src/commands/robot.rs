//! `nudge robot`: checks an arm and shows what it reaches.

mod skills;

use super::{print, to_json, warn};
use crate::picture;
use nudge_core::Error;
use nudge_core::arm::{Arm, ArmTool, JointKind, Reach};
use nudge_core::camera::{View, ViewArray};
use nudge_core::scene::{Catalog, RobotFile, RobotPlacement, Scene, Shelf};
use nudge_core::skill::PickPlace;
use nudge_core::skill::push::TOOL_HEIGHT_M;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;

/// Distance of the places that are tried in the shelf, metres.
const STEP_M: f32 = 0.02;

/// Check the arm before the shelf.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand, Debug)]
enum Command {
    Check(CheckArgs),
}

/// Read a URDF file, and show what the arm reaches in the shelf and which views its hand can take
#[derive(clap::Args, Debug)]
struct CheckArgs {
    /// The arm's URDF file
    file: PathBuf,
    /// Scene whose shelf it stands before, where the scene's [robot] has it; after six looks it is counted what each skill
    /// can do there [default: the standard shelf and place]
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// Where picks set objects down, of which it is counted what can be taken
    #[arg(long, default_value = "shelf", value_name = "shelf|tray", requires = "scene")]
    place: PickPlace,
    /// Its link at the finger tip, z ahead, x along the gripper's broad side [default: `tool` or another usual name]
    #[arg(long, value_name = "LINK")]
    tool: Option<String>,
    /// Its link of the camera in hand, x right, y down, z forward [default: `camera` or another usual name]
    #[arg(long, value_name = "LINK")]
    camera: Option<String>,
    /// View arrays, by name or file
    #[arg(long, value_delimiter = ',', default_value = "standard300,real75", value_name = "ARRAY,...")]
    views: Vec<String>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
    /// Draw the arm with what it reaches
    #[arg(long, value_name = "PNG")]
    out: Option<PathBuf>,
}

/// The JSON document.
#[derive(Serialize)]
struct Report {
    name: String,
    file: String,
    closed_form: bool,
    /// The link at the finger tip.
    tool: String,
    /// The link of the camera in hand.
    camera: Option<String>,
    camera_in_hand: bool,
    base: [f32; 3],
    yaw_deg: f32,
    joints: Vec<JointReport>,
    /// From the first joint to the finger tip, every bend stretched, metres.
    stretched_m: f64,
    /// The waiting configuration, rad or m; `null` where the arm reaches no place before the shelf.
    waits_at: Option<Vec<f64>>,
    reach: ReachReport,
    views: Vec<ViewsReport>,
    /// What each skill can do in the scene; empty without one.
    skills: Vec<skills::SkillReport>,
}

#[derive(Serialize)]
struct JointReport {
    name: String,
    kind: &'static str,
    lower: f64,
    upper: f64,
    speed: f64,
}

/// Where the level gripper's tip comes over the board of the empty shelf.
#[derive(Serialize)]
struct ReachReport {
    height_m: f32,
    share: f32,
    depth_m: Option<f32>,
}

#[derive(Serialize)]
struct ViewsReport {
    array: String,
    views: usize,
    reachable: Vec<u16>,
    /// Number of views out of reach, by reason.
    faults: BTreeMap<String, usize>,
}

/// Runs the command.
///
/// # Errors
/// What is wrong with the file or the scene; [`Error::Check`] for an arm that reaches nothing.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let Command::Check(args) = &args.command;
    let mut scene = None;
    if let Some(path) = &args.scene {
        let (loaded, warnings) = Scene::load(path, &Catalog::standard())?;
        warnings.iter().for_each(|warning| warn(&format!("{}: {warning}", path.display())));
        scene = Some(loaded);
    }
    let (shelf, placement) = match &scene {
        None => (Shelf::new([0.80, 0.40, 0.40]), RobotPlacement::default()),
        Some(scene) => (scene.shelf, scene.robot.clone()),
    };
    let arrays = args.views.iter().map(|name| ViewArray::named(name)).collect::<Result<Vec<_>, _>>()?;
    let mut urdf = RobotFile::read(&args.file, args.file.to_string_lossy())?;
    (urdf.tool, urdf.camera) = (args.tool.clone(), args.camera.clone());
    let placement = RobotPlacement { urdf: Some(urdf), ..placement };
    let tool = ArmTool::new(Arm::placed(&placement)?, shelf);
    tool.arm.warnings.iter().for_each(|warning| warn(&format!("{}: {warning}", args.file.display())));
    let reach = tool.reach(TOOL_HEIGHT_M, STEP_M);
    let mut views: Vec<Vec<(View, bool)>> = Vec::new();
    for array in &arrays {
        let hands = array.hand_poses(&tool);
        views.push(array.views.iter().cloned().zip(hands.iter().map(Option::is_some)).collect());
    }
    let mut report = report(args, &placement, &tool, &reach, &arrays, &views);
    if let (Some(scene), Some(_)) = (scene, tool.ready) {
        report.skills = skills::of(Scene { robot: placement, ..scene }, args.place)?;
    }
    if let (Some(out), Some(array), Some(views)) = (&args.out, arrays.first(), views.first()) {
        let joints = tool.ready.unwrap_or_else(|| nudge_core::arm::Joints::zero(tool.arm.joints.len()));
        let placed = picture::Placed { arm: &tool, joints, reach: &reach, intrinsics: &array.intrinsics, views };
        picture::save(&picture::of_robot(&placed, [1120, 840]), out)?;
    }
    print(&if args.json { to_json(&report)? } else { table(&report) })?;
    if tool.ready.is_none() {
        let message = "the arm reaches no place before the shelf from where it stands: it would never push";
        return Err(Error::Check(format!("{}: {message}", args.file.display())).into());
    }
    Ok(())
}

fn report(
    args: &CheckArgs,
    placement: &RobotPlacement,
    tool: &ArmTool,
    reach: &Reach,
    arrays: &[ViewArray],
    views: &[Vec<(View, bool)>],
) -> Report {
    let arm = &tool.arm;
    let joints = arm.joints.iter().map(|joint| JointReport {
        name: joint.name.clone(),
        kind: match joint.kind {
            JointKind::Turning => "turning",
            JointKind::Sliding => "sliding",
        },
        lower: joint.lower,
        upper: joint.upper,
        speed: joint.speed,
    });
    let of_array = |(array, views): (&ViewArray, &Vec<(View, bool)>)| {
        let mut faults = BTreeMap::new();
        for (view, _) in views.iter().filter(|(_, reached)| !reached) {
            *faults.entry(tool.hand_fault(&view.world_from_camera).to_string()).or_default() += 1;
        }
        ViewsReport {
            array: array.name.clone(),
            views: views.len(),
            reachable: views.iter().filter(|(_, reached)| *reached).map(|(view, _)| view.id.0).collect(),
            faults,
        }
    };
    Report {
        name: arm.name.clone(),
        file: args.file.display().to_string(),
        closed_form: arm.has_closed_form(),
        tool: arm.tool_link.clone(),
        camera: arm.camera_link.clone(),
        camera_in_hand: arm.last_from_camera.is_some(),
        base: placement.base,
        yaw_deg: placement.yaw_deg,
        joints: joints.collect(),
        stretched_m: arm.stretched_m(),
        waits_at: tool.ready.map(|joints| joints.to_vec()),
        reach: ReachReport { height_m: TOOL_HEIGHT_M, share: reach.share(), depth_m: reach.depth_m() },
        views: arrays.iter().zip(views).map(of_array).collect(),
        skills: Vec::new(),
    }
}

fn table(report: &Report) -> String {
    let [x, y, z] = report.base;
    let inverse = if report.closed_form { "closed-form inverse" } else { "numeric inverse" };
    let camera = if report.camera_in_hand { "a camera in hand" } else { "no camera in hand" };
    let mut text = format!(
        "{}: {} joints, {inverse}, {camera}\n  base       ({x:.3}, {y:.3}, {z:.3}) m, turned by {} degrees\n",
        report.name,
        report.joints.len(),
        report.yaw_deg
    );
    let camera_link = report.camera.as_deref().unwrap_or("none (--camera names one)");
    // Writing into a string cannot fail.
    let _ = writeln!(text, "  links      tool {}, camera {camera_link}", report.tool);
    for joint in &report.joints {
        let (unit, speed, scale) = match joint.kind {
            "turning" => ("deg", "deg/s", 180.0 / std::f64::consts::PI),
            _ => ("mm", "mm/s", 1000.0),
        };
        let _ = writeln!(
            text,
            "  joint      {:<24} {:>8.1} to {:>7.1} {unit}, {:.0} {speed}",
            joint.name,
            joint.lower * scale,
            joint.upper * scale,
            joint.speed * scale
        );
    }
    let _ = writeln!(text, "  stretched  {:.3} m from the first joint to the finger tip", report.stretched_m);
    let words = match report.reach.depth_m {
        Some(depth) => format!("the tip comes to {:.0} % of the board, {depth:.2} m deep", 100.0 * report.reach.share),
        None => "the tip comes nowhere over the board".to_owned(),
    };
    let _ = writeln!(text, "  reach      {words} ({:.0} mm above it, gripper level)", 1e3 * report.reach.height_m);
    for views in &report.views {
        let _ = writeln!(text, "  views      {} of {} in {}", views.reachable.len(), views.views, views.array);
        for (words, count) in &views.faults {
            let _ = writeln!(text, "             {count} not: {words}");
        }
    }
    report.skills.iter().for_each(|skill| text += &skill.table());
    text
}
