//! `nudge mesh`: what Nudge makes of a mesh file.

use super::scene::unknown_class;
use super::{print, to_json, warn};
use crate::picture;
use nudge_core::scene::{Catalog, Class, MeshReport, PartsFrom, Unit, load_mesh};
use std::path::PathBuf;

/// Show what a mesh file (OBJ, STL, GLB) becomes: convex parts, size, footprint, volume and mass.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The mesh
    file: PathBuf,
    /// Class that it stands for; gives the mass, and helps to tell the unit
    #[arg(long, value_name = "NAME")]
    class: Option<String>,
    /// The file's unit: m, dm, cm, mm, in or km [default: guessed from the size]
    #[arg(long)]
    unit: Option<Unit>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
    /// Draw the parts, every one in a tint of its own
    #[arg(long, value_name = "PNG")]
    picture: Option<PathBuf>,
}

/// Reads the mesh and prints the report.
///
/// # Errors
///
/// A file that is no closed mesh, or an unknown class.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let catalog = Catalog::standard();
    let class = match &args.class {
        Some(name) => Some(catalog.by_name(name).ok_or_else(|| unknown_class(&catalog, name))?),
        None => None,
    };
    let (shape, report) = load_mesh(&args.file, &args.file.to_string_lossy(), class, args.unit)?;
    for warning in &report.warnings {
        warn(&format!("{}: {warning}", report.file));
    }
    if let Some(file) = &args.picture {
        picture::save(&picture::of_solid(&shape.solid(), [640, 640]), file)?;
    }
    print(&if args.json { to_json(&report)? } else { table(&report, class) })
}

fn table(report: &MeshReport, class: Option<&Class>) -> String {
    let parts = report.part_vertices.len();
    let obtained = match (report.parts_from, parts) {
        (PartsFrom::Given, 1) => "as given: the mesh is convex",
        (PartsFrom::Given, _) => "as given: every component is convex",
        (PartsFrom::Decomposed, _) => "by convex decomposition (V-HACD)",
        (PartsFrom::Both, _) => "convex components as given, others by convex decomposition (V-HACD)",
    };
    let corners: Vec<String> = report.part_vertices.iter().map(usize::to_string).collect();
    let millimetres = |size: &[f32]| {
        let edges: Vec<String> = size.iter().map(|edge| format!("{:.1}", 1000.0 * edge)).collect();
        format!("{} mm", edges.join(" x "))
    };
    let mass = match class {
        Some(class) => format!("{:.3} kg, of class {}", report.mass_kg, class.name),
        None => format!("{:.3} kg, an estimate at 0.4 g/cm3 (--class NAME takes the class's)", report.mass_kg),
    };
    let mut text = format!(
        "{}\n  mesh       {} triangles, {} corners, {} components, in {}\n  parts      {parts}, {obtained}\n  corners    {}\n  \
         size       {}\n  footprint  {} turned by {:.1} degrees, {:.1} cm2\n  volume     {:.1} cm3 (parts {:.1} cm3)\n  \
         mass       {mass}\n",
        report.file,
        report.triangles,
        report.vertices,
        report.components,
        report.unit.name(),
        corners.join(" + "),
        millimetres(&report.size_m),
        millimetres(&report.footprint.size_m),
        report.footprint.angle_deg,
        1e4 * report.footprint_area_m2,
        1e6 * report.volume_m3,
        1e6 * report.parts_volume_m3,
    );
    if let Some(class) = class {
        let size: [f32; 3] = class.solid.bounds().size().into();
        text += &format!("  class      {} is {} in the catalogue\n", class.name, millimetres(&size));
    }
    text
}
