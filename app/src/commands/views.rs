//! `nudge views`: the poses of a view array.

use nudge_core::camera::{Intrinsics, View, ViewArray};
use serde::Serialize;

/// Print the candidate camera poses of a view array.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Name of the array (standard300, real75) or a file of one's own (.toml)
    #[arg(long, default_value = "standard300")]
    array: String,
    /// Print one JSON document instead of a table
    #[arg(long)]
    json: bool,
}

/// The JSON document.
#[derive(Serialize)]
struct Document<'a> {
    array: &'a str,
    layout: [usize; 3],
    intrinsics: Camera,
    views: Vec<Pose>,
}

#[derive(Serialize)]
struct Camera {
    #[serde(flatten)]
    intrinsics: Intrinsics,
    principal_px: [f32; 2],
    /// Row-major 3 x 3.
    matrix: [[f32; 3]; 3],
}

#[derive(Serialize)]
struct Pose {
    id: u16,
    slot: [u16; 3],
    target: [f32; 3],
    /// Row-major 4 x 4; the camera looks along its +z, x right, y down.
    world_from_camera: [[f32; 4]; 4],
}

/// Prints the poses to standard output.
///
/// # Errors
///
/// An unknown array, or a wrong file.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let array = ViewArray::named(&args.array)?;
    super::print(&if args.json { json(&array)? } else { table(&array) })
}

fn json(array: &ViewArray) -> anyhow::Result<String> {
    let focal = array.intrinsics.focal_px;
    let [u, v] = array.intrinsics.principal_px();
    let document = Document {
        array: &array.name,
        layout: array.layout,
        intrinsics: Camera {
            intrinsics: array.intrinsics,
            principal_px: [u, v],
            matrix: [[focal, 0.0, u], [0.0, focal, v], [0.0, 0.0, 1.0]],
        },
        views: array
            .views
            .iter()
            .map(|view| Pose {
                id: view.id.0,
                slot: view.slot,
                target: view.target,
                world_from_camera: world_from_camera(view),
            })
            .collect(),
    };
    Ok(serde_json::to_string_pretty(&document)? + "\n")
}

fn table(array: &ViewArray) -> String {
    let Intrinsics { width, height, focal_px, depth_range_m: [near, far] } = array.intrinsics;
    let [u, v] = array.intrinsics.principal_px();
    let [across, up, targets] = array.layout;
    let mut text = format!(
        "{}: {} views, {across} x {up} positions with {targets} targets each\n\
         camera: {width} x {height} px, f = {focal_px} px, principal point ({u}, {v}) px, depth {near} to {far} m\n\
         {:>4}  {:<10}  {:<22}  world_from_camera (rows of the 4 x 4 matrix, metres)\n",
        array.name,
        array.views.len(),
        "view",
        "slot",
        "target",
    );
    for view in &array.views {
        let rows = world_from_camera(view).map(|row| row.map(|x| format!("{x:8.4}")).join(" "));
        let slot = format!("{:?}", view.slot);
        let target = view.target.map(|x| format!("{x:6.3}")).join(" ");
        text += &format!("{:>4}  {slot:<10}  {target:<22}  [{}]\n", view.id.0, rows.join(" |"));
    }
    text
}

fn world_from_camera(view: &View) -> [[f32; 4]; 4] {
    let matrix = view.world_from_camera.to_homogeneous();
    // A zero has no sign for a reader.
    std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)] + 0.0))
}
