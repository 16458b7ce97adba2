//! Bodies, cameras and pushes as meshes, lines, images and arrows.

use crate::colors::{self, Colormap, Rgb};
use nudge_core::camera::{Frame, Intrinsics, Pinhole, View, ViewArray};
use nudge_core::plan::Decision;
use nudge_core::scene::{Body, Catalog, Shelf};
use nudge_core::skill::{Arrow, Manipulation};
use nudge_core::solid::ConvexPart;
use nudge_core::{Point, Pose, Vector};

/// Images are recorded at half their size along both axes.
const IMAGE_STEP: usize = 2;
/// Facets whose normals differ by less than this (cosine) are shaded as one rounded surface.
const ROUND_COS: f32 = 0.86;
pub(crate) const REJECTED_RGB: Rgb = [120, 122, 128];
pub(crate) const CHOSEN_RGB: Rgb = [255, 112, 67];
pub(crate) const GLASS_ALPHA: u8 = 52;

/// A pose as Rerun's transform.
pub fn transform(world_from: &Pose) -> rerun::Transform3D {
    let [i, j, k, w] = world_from.rotation.coords.into();
    let translation: [f32; 3] = world_from.translation.vector.into();
    rerun::Transform3D::from_translation_rotation(translation, rerun::Quaternion::from_xyzw([i, j, k, w]))
}

/// A body's mesh in its own frame, see-through in its class's colour.
pub fn glass(body: &Body, catalog: &Catalog) -> rerun::Mesh3D {
    let [r, g, b] = colors::of_class(catalog, body.class);
    mesh(&body.solid.parts).with_albedo_factor(rerun::Rgba32::from_unmultiplied_rgba(r, g, b, GLASS_ALPHA))
}

/// The corners of convex parts' triangles with normals that round the facets of curved surfaces and keep edges.
pub(crate) fn facets(parts: &[ConvexPart]) -> Vec<(Point, Vector)> {
    let mut corners = Vec::new();
    for part in parts {
        let face = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|i| part.vertices[i as usize]);
            (b - a).cross(&(c - a))
        };
        for triangle in &part.triangles {
            let own = face(triangle).try_normalize(1e-12).unwrap_or(Vector::z());
            for &corner in triangle {
                // Area-weighted mean over the faces that meet here and bend only a little.
                let meets = part.triangles.iter().filter(|other| other.contains(&corner));
                let sum = meets
                    .map(face)
                    .filter(|normal| normal.dot(&own) > ROUND_COS * normal.norm())
                    .fold(Vector::zeros(), |sum, normal| sum + normal);
                corners.push((part.vertices[corner as usize], sum.try_normalize(1e-12).unwrap_or(own)));
            }
        }
    }
    corners
}

/// Convex parts as a mesh.
pub(super) fn mesh(parts: &[ConvexPart]) -> rerun::Mesh3D {
    let corners = facets(parts);
    let triangles = (0..corners.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    rerun::Mesh3D::new(corners.iter().map(|(position, _)| <[f32; 3]>::from(position.coords)))
        .with_vertex_normals(corners.iter().map(|(_, normal)| <[f32; 3]>::from(*normal)))
        .with_triangle_indices(triangles)
}

/// Board, back and sides of a shelf as thin panels outside the interior; no ceiling, so that one can look in.
pub fn shelf_panels(shelf: &Shelf) -> rerun::Mesh3D {
    const PANEL_M: f32 = 0.012;
    let (min, max) = (shelf.min(), shelf.max());
    let panel = |from: [f32; 3], to: [f32; 3]| {
        let corner = |i: usize| {
            let at = |axis: usize| if i >> axis & 1 == 1 { to[axis] } else { from[axis] };
            Point::new(at(0), at(1), at(2))
        };
        ConvexPart::hull(&(0..8).map(corner).collect::<Vec<_>>())
    };
    let panels = [
        panel([min.x - PANEL_M, min.y, min.z - PANEL_M], [max.x + PANEL_M, max.y + PANEL_M, min.z - 0.0008]),
        panel([min.x - PANEL_M, max.y, min.z], [max.x + PANEL_M, max.y + PANEL_M, max.z]),
        panel([min.x - PANEL_M, min.y, min.z], [min.x, max.y, max.z]),
        panel([max.x, min.y, min.z], [max.x + PANEL_M, max.y, max.z]),
    ];
    let parts: Vec<ConvexPart> = panels.into_iter().flatten().collect();
    mesh(&parts).with_albedo_factor(rerun::Rgba32::from_unmultiplied_rgba(196, 186, 170, 255))
}

/// The edges of a shelf's interior.
pub fn shelf_edges(shelf: &Shelf) -> rerun::LineStrips3D {
    let (min, max) = (shelf.min(), shelf.max());
    let ring =
        |z: f32| vec![[min.x, min.y, z], [max.x, min.y, z], [max.x, max.y, z], [min.x, max.y, z], [min.x, min.y, z]];
    let posts = [[min.x, min.y], [max.x, min.y], [max.x, max.y], [min.x, max.y]];
    let mut strips = vec![ring(min.z), ring(max.z)];
    strips.extend(posts.map(|[x, y]| vec![[x, y, min.z], [x, y, max.z]]));
    rerun::LineStrips3D::new(strips)
        .with_colors([rerun::Color::from([150, 150, 156])])
        .with_radii([rerun::Radius::new_ui_points(0.8)])
}

/// Every view as a small frustum, one line each.
pub fn view_frusta(array: &ViewArray) -> rerun::LineStrips3D {
    const DEPTH_M: f32 = 0.016;
    let strips = array.views.iter().map(|view| frustum_line(view, &array.intrinsics, DEPTH_M));
    // No colours here: static ones would hide those of the steps.
    rerun::LineStrips3D::new(strips).with_radii([rerun::Radius::new_ui_points(0.7)])
}

/// One view as a frustum of the given depth, metres.
#[cfg(feature = "workbench")]
pub(crate) fn frustum(view: &View, intrinsics: &Intrinsics, depth_m: f32) -> rerun::LineStrips3D {
    rerun::LineStrips3D::new([frustum_line(view, intrinsics, depth_m)])
}

fn frustum_line(view: &View, intrinsics: &Intrinsics, depth_m: f32) -> [[f32; 3]; 11] {
    let half = [intrinsics.width, intrinsics.height].map(|n| 0.5 * n as f32 / intrinsics.focal_px);
    let place = |x: f32, y: f32, z: f32| -> [f32; 3] {
        let point = view.world_from_camera * Point::new(x * half[0] * depth_m, y * half[1] * depth_m, z * depth_m);
        point.coords.into()
    };
    let [apex, a, b, c, d] =
        [place(0.0, 0.0, 0.0), place(-1., -1., 1.), place(1., -1., 1.), place(1., 1., 1.), place(-1., 1., 1.)];
    [apex, a, b, apex, c, d, apex, d, a, b, c]
}

/// The scale of a step's gains, nats: from nothing to the best view's.
pub fn gain_range(decision: &Decision) -> [f32; 2] {
    [0.0, decision.gains.iter().copied().filter(|gain| gain.is_finite()).fold(f32::MIN_POSITIVE, f32::max)]
}

/// Colours for [`view_frusta`] while no gain is known.
pub fn frusta_without_gain(array: &ViewArray) -> rerun::LineStrips3D {
    let colors = array.views.iter().map(|_| rerun::Color::from(REJECTED_RGB));
    rerun::LineStrips3D::update_fields().with_colors(colors)
}

/// Colours for [`view_frusta`].
pub fn frusta_colors(gains: &[f32], range: [f32; 2]) -> rerun::LineStrips3D {
    let colors = gains.iter().map(|gain| rerun::Color::from(Colormap::Cividis.of(*gain, range)));
    rerun::LineStrips3D::update_fields().with_colors(colors)
}

/// The camera that took an image, at the size that images are recorded.
pub fn pinhole(intrinsics: &Pinhole) -> rerun::Pinhole {
    let size = thinned_size([intrinsics.width, intrinsics.height]).map(|n| n as f32);
    let focal = intrinsics.focal_px.map(|px| px / IMAGE_STEP as f32);
    let camera = rerun::Pinhole::from_focal_length_and_resolution(focal, size);
    let camera = if intrinsics.principal_px == [0.5 * intrinsics.width as f32, 0.5 * intrinsics.height as f32] {
        camera
    } else {
        camera.with_principal_point(intrinsics.principal_px.map(|px| px / IMAGE_STEP as f32))
    };
    camera
        .with_image_plane_distance(0.10)
        .with_color(rerun::Color::from(CHOSEN_RGB))
        .with_line_width(rerun::Radius::new_ui_points(1.6))
}

/// Every [`IMAGE_STEP`]th pixel of an image, the first one always.
fn thinned<T: Copy>(pixels: &[T], [width, height]: [usize; 2]) -> impl Iterator<Item = T> + '_ {
    let rows = (0..height).step_by(IMAGE_STEP);
    rows.flat_map(move |row| (0..width).step_by(IMAGE_STEP).map(move |column| pixels[row * width + column]))
}

fn thinned_size(size: [usize; 2]) -> [u32; 2] {
    size.map(|n| n.div_ceil(IMAGE_STEP) as u32)
}

/// Depth in millimetres, 16 bit, as a PNG.
pub fn depth_image(frame: &Frame) -> rerun::EncodedDepthImage {
    let [width, height] = thinned_size(frame.size());
    let millimetres: Vec<u16> = thinned(frame.depth_m(), frame.size()).map(|m| (m * 1e3).round() as u16).collect();
    let mut png = std::io::Cursor::new(Vec::new());
    image::ImageBuffer::<image::Luma<u16>, _>::from_raw(width, height, millimetres)
        .expect("one value a pixel")
        .write_to(&mut png, image::ImageFormat::Png)
        .expect("a PNG in memory cannot fail");
    let [near, far] = frame.intrinsics().depth_range_m.map(f64::from);
    rerun::EncodedDepthImage::new(png.into_inner())
        .with_media_type(rerun::components::MediaType::PNG)
        .with_meter(1000.0)
        .with_colormap(rerun::components::Colormap::Turbo)
        .with_depth_range([near * 1e3, far.min(0.9) * 1e3])
}

/// The class of every pixel.
pub fn label_image(frame: &Frame) -> rerun::SegmentationImage {
    let labels: Vec<u8> = thinned(&frame.labels(), frame.size()).collect();
    segmentation(labels, thinned_size(frame.size()))
}

/// Class ids as an image.
pub fn segmentation(labels: Vec<u8>, size: [u32; 2]) -> rerun::SegmentationImage {
    let format = rerun::datatypes::ImageFormat::segmentation(size, rerun::datatypes::ChannelDatatype::U8);
    rerun::SegmentationImage::new(labels, format)
}

/// The candidates as arrows, one each: feasible ones by value in the colours of the gain, rejected ones thin and grey.
pub fn candidates(decision: &Decision) -> rerun::Arrows3D {
    let values: Vec<Option<f32>> = decision.candidates.iter().map(|c| decision.value_of(c)).collect();
    let best = values.iter().flatten().copied().fold(f32::MIN_POSITIVE, f32::max);
    let worst = values.iter().flatten().copied().fold(best, f32::min);
    let arrows: Vec<Arrow> = decision.candidates.iter().map(|candidate| candidate.manipulation.arrow()).collect();
    let colors = values.iter().map(|value| match value {
        Some(value) => rerun::Color::from(Colormap::Cividis.of(*value, [worst, best])),
        None => rerun::Color::from(REJECTED_RGB),
    });
    let radii = values.iter().map(|value| if value.is_some() { 0.0022_f32 } else { 0.0008 });
    rerun::Arrows3D::from_vectors(arrows.iter().map(|arrow| vector(arrow.way)))
        .with_origins(arrows.iter().map(|arrow| <[f32; 3]>::from(arrow.start.coords)))
        .with_colors(colors)
        .with_radii(radii)
}

/// The manipulation that was carried out: its ways in contact.
pub fn chosen(manipulation: &Manipulation) -> rerun::Arrows3D {
    let arrows = manipulation.outline().arrows;
    rerun::Arrows3D::from_vectors(arrows.iter().map(|arrow| vector(arrow.way)))
        .with_origins(arrows.iter().map(|arrow| <[f32; 3]>::from(arrow.start.coords)))
        .with_colors([rerun::Color::from(CHOSEN_RGB)])
        .with_radii([0.005_f32])
}

/// The lines beside the ways of the manipulation that was carried out.
pub fn chosen_lines(manipulation: Option<&Manipulation>) -> rerun::LineStrips3D {
    let lines = manipulation.map_or_else(Vec::new, |manipulation| manipulation.outline().lines);
    let strip = |line: &Vec<Point>| line.iter().map(|point| <[f32; 3]>::from(point.coords)).collect::<Vec<_>>();
    rerun::LineStrips3D::new(lines.iter().map(strip))
        .with_colors([rerun::Color::from(CHOSEN_RGB)])
        .with_radii([0.004_f32])
}

/// Words that hang at a place, metres; none for an empty text.
pub(crate) fn words(at: [f32; 3], text: &str) -> rerun::Points3D {
    rerun::Points3D::new((!text.is_empty()).then_some(at))
        .with_radii([rerun::Radius::new_ui_points(0.5)])
        .with_colors([rerun::Color::from([200, 202, 208])])
        .with_labels((!text.is_empty()).then_some(text))
        .with_show_labels(true)
}

fn vector(vector: Vector) -> [f32; 3] {
    vector.into()
}
