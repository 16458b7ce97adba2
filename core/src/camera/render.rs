//! Depth and label images by ray casting: one ray through the centre of every pixel, the exact first hit.
//!
//! A ray from the camera that is one metre deep per unit of its parameter meets a face plane at the inverse depth
//! `w = -(n . d) / h`, where `h` is the camera's height above the plane and `d` the ray, so `w` is linear in the
//! pixel's coordinates. A convex part is hit where it is entered before it is left: at the smallest `w` of the planes
//! that the camera is outside of, if that is positive and no smaller than the `w` of every other plane. This is the
//! half-space clipping of [`ConvexPart::ray_enter`](crate::solid::ConvexPart::ray_enter) with the division taken out
//! of the inner loop, done row by row within the rectangle that a part covers in the image; with the few hundred
//! parts of a shelf it beats a tree over boxes, which has to be walked anew for every pixel.

use super::{Frame, Intrinsics, PixelClasses, Sensed, View};
use crate::scene::{BACKGROUND, Body, Shelf};
use crate::solid::{HalfSpace, Solid};
use crate::world::shelf_panels;
use crate::{Point, Pose, Vector};
use rayon::prelude::*;
use std::ops::Range;

/// Number of rows that one task renders.
const ROWS_PER_TASK: usize = 16;
/// No surface in the tag buffer.
pub(super) const NOTHING: u16 = u16::MAX;

/// Depth and labels as `view` sees them, without noise, and which object each pixel shows.
///
/// Shelf panels (board, back, walls and ceiling, [`PANEL_M`](crate::world::PANEL_M) thick) hide what is behind them and
/// are seen as background with their depth, from inside and from outside; only the front is open. Where nothing is
/// hit, or nearer or farther than the sensor's range, depth is 0.
pub fn render(shelf: &Shelf, bodies: &[Body], view: &View, intrinsics: &Intrinsics) -> Sensed {
    let scene = ProjectedScene::new(shelf, bodies, &view.world_from_camera, intrinsics);
    let width = intrinsics.width;
    let pixels = width * intrinsics.height;
    let mut depth_m = vec![0.0; pixels];
    let mut labels = vec![BACKGROUND.0; pixels];
    let mut objects = vec![u16::MAX; pixels];
    let [near, far] = intrinsics.depth_range_m;
    let tasks = depth_m
        .par_chunks_mut(width * ROWS_PER_TASK)
        .zip(labels.par_chunks_mut(width * ROWS_PER_TASK).zip(objects.par_chunks_mut(width * ROWS_PER_TASK)));
    tasks.enumerate().for_each(|(task, (depth, (labels, objects)))| {
        let mut row = RowBuffer::new(width);
        for (at, depth) in depth.chunks_mut(width).enumerate() {
            scene.scan(task * ROWS_PER_TASK + at, 0..width, &mut row);
            let (labels, objects) = (&mut labels[at * width..][..width], &mut objects[at * width..][..width]);
            for column in 0..width {
                let depth_m = 1.0 / row.inverse_depth[column];
                if depth_m >= near && depth_m <= far {
                    depth[column] = depth_m;
                    if let Some(body) = bodies.get(usize::from(row.tag[column])) {
                        labels[column] = body.class.0;
                        objects[column] = body.id.0;
                    }
                }
            }
        }
    });
    let frame = Frame {
        world_from_camera: view.world_from_camera,
        intrinsics: (*intrinsics).into(),
        depth_m,
        classes: PixelClasses::Labels(labels),
    };
    Sensed { frame, objects: Some(objects) }
}

/// Pixels `columns x rows`.
#[derive(Clone, Debug)]
pub(super) struct Rect {
    pub(super) columns: Range<usize>,
    pub(super) rows: Range<usize>,
}

impl Rect {
    pub(super) fn is_empty(&self) -> bool {
        self.columns.is_empty() || self.rows.is_empty()
    }

    /// Whether two rectangles have a pixel in common.
    pub(super) fn meets(&self, other: &Self) -> bool {
        let meet = |a: &Range<usize>, b: &Range<usize>| a.start.max(b.start) < a.end.min(b.end);
        meet(&self.columns, &other.columns) && meet(&self.rows, &other.rows)
    }

    /// Number of pixels that two rectangles have in common.
    pub(super) fn pixels_shared(&self, other: &Self) -> usize {
        let shared = |a: &Range<usize>, b: &Range<usize>| a.end.min(b.end).saturating_sub(a.start.max(b.start));
        shared(&self.columns, &other.columns) * shared(&self.rows, &other.rows)
    }

    pub(super) fn union(self, other: &Self) -> Self {
        let hull = |a: Range<usize>, b: &Range<usize>| {
            if a.is_empty() {
                b.clone()
            } else if b.is_empty() {
                a
            } else {
                a.start.min(b.start)..a.end.max(b.end)
            }
        };
        Self { columns: hull(self.columns, &other.columns), rows: hull(self.rows, &other.rows) }
    }
}

/// The parts of a body as a camera sees them, those outside its image included.
pub(super) fn project_body(
    body: &Body,
    tag: u16,
    camera_from_body: &Pose,
    intrinsics: &Intrinsics,
) -> impl Iterator<Item = ProjectedPart> {
    let Solid { parts } = body.solid.as_ref();
    parts.iter().map(move |part| ProjectedPart::new(&part.vertices, &part.planes, camera_from_body, intrinsics, tag))
}

/// A convex part as the camera sees it.
pub(super) struct ProjectedPart {
    /// Coefficients of `w` over column and row (from the image's centre) and its constant, of planes that the camera is
    /// outside of and that it is inside of.
    outside: Vec<[f32; 3]>,
    inside: Vec<[f32; 3]>,
    pub(super) rect: Rect,
    /// The largest inverse depth of its corners, 1 / m; infinite if one is beside or behind the camera.
    pub(super) nearest: f32,
    /// Index of the body, [`NOTHING`] for the shelf.
    pub(super) tag: u16,
}

/// All parts of a scene as one camera sees them.
pub(super) struct ProjectedScene {
    pub(super) parts: Vec<ProjectedPart>,
    center: [f32; 2],
}

/// What the rays of one row have hit so far.
pub(super) struct RowBuffer {
    pub(super) inverse_depth: Vec<f32>,
    pub(super) tag: Vec<u16>,
    enter: Vec<f32>,
    leave: Vec<f32>,
}

impl RowBuffer {
    pub(super) fn new(width: usize) -> Self {
        let zeros = || vec![0.0; width];
        Self { inverse_depth: zeros(), tag: vec![NOTHING; width], enter: zeros(), leave: zeros() }
    }
}

impl ProjectedScene {
    pub(super) fn new(shelf: &Shelf, bodies: &[Body], world_from_camera: &Pose, intrinsics: &Intrinsics) -> Self {
        let camera_from_world = world_from_camera.inverse();
        let mut parts = Vec::new();
        for panel in shelf_panels(shelf) {
            let corner = |i: usize| {
                let pick = |axis: usize| if i >> axis & 1 == 1 { panel.max[axis] } else { panel.min[axis] };
                Point::new(pick(0), pick(1), pick(2))
            };
            let corners: Vec<Point> = (0..8).map(corner).collect();
            let faces: Vec<HalfSpace> = (0..3)
                .flat_map(|axis| {
                    let normal = Vector::ith(axis, 1.0);
                    [
                        HalfSpace { normal, offset: panel.max[axis] },
                        HalfSpace { normal: -normal, offset: -panel.min[axis] },
                    ]
                })
                .collect();
            parts.push(ProjectedPart::new(&corners, &faces, &camera_from_world, intrinsics, NOTHING));
        }
        for (tag, body) in bodies.iter().enumerate() {
            let camera_from_body = camera_from_world * body.world_from_body;
            parts.extend(project_body(body, tag as u16, &camera_from_body, intrinsics));
        }
        parts.retain(|part| !part.rect.is_empty());
        Self { parts, center: intrinsics.principal_px() }
    }

    /// Finds the first hit of the rays of `columns` in a row, into the same columns of `buffer`.
    pub(super) fn scan(&self, row: usize, columns: Range<usize>, buffer: &mut RowBuffer) {
        scan(self.parts.iter(), self.center, row, columns, buffer);
    }

    /// The image's centre, pixels.
    pub(super) fn center(&self) -> [f32; 2] {
        self.center
    }
}

/// Finds the first hit of the rays of `columns` in a row among some parts, into the same columns of `buffer`. Of parts that
/// are hit at the same depth the first counts.
pub(super) fn scan<'a>(
    parts: impl Iterator<Item = &'a ProjectedPart>,
    center: [f32; 2],
    row: usize,
    columns: Range<usize>,
    buffer: &mut RowBuffer,
) {
    buffer.inverse_depth[columns.clone()].fill(0.0);
    buffer.tag[columns.clone()].fill(NOTHING);
    let v = row as f32 + 0.5 - center[1];
    for part in parts.filter(|part| part.rect.rows.contains(&row)) {
        let start = part.rect.columns.start.max(columns.start);
        let end = part.rect.columns.end.min(columns.end);
        if start >= end {
            continue;
        }
        let first = start as f32 + 0.5 - center[0];
        let (enter, leave) = (&mut buffer.enter[..end - start], &mut buffer.leave[..end - start]);
        part.cross([first, v], enter, leave);
        let (best, tags) = (&mut buffer.inverse_depth[start..end], &mut buffer.tag[start..end]);
        for (((enter, leave), best), tag) in enter.iter().zip(leave.iter()).zip(best).zip(tags) {
            let hit = *enter >= *leave && *enter > *best;
            *best = if hit { *enter } else { *best };
            *tag = if hit { part.tag } else { *tag };
        }
    }
}

/// Takes from what the last [`scan`] of a row has found of one body the pixels that another part hides; `is_first` says whether
/// that part counts where both are hit at the same depth.
pub(super) fn hide(
    part: &ProjectedPart,
    is_first: bool,
    center: [f32; 2],
    row: usize,
    columns: &Range<usize>,
    buffer: &mut RowBuffer,
) {
    let start = part.rect.columns.start.max(columns.start);
    let end = part.rect.columns.end.min(columns.end);
    if start >= end || !part.rect.rows.contains(&row) {
        return;
    }
    let (enter, leave) = (&mut buffer.enter[..end - start], &mut buffer.leave[..end - start]);
    part.cross([start as f32 + 0.5 - center[0], row as f32 + 0.5 - center[1]], enter, leave);
    let (depths, tags) = (&buffer.inverse_depth[start..end], &mut buffer.tag[start..end]);
    for (((enter, leave), depth), tag) in enter.iter().zip(leave.iter()).zip(depths).zip(tags) {
        let hides = *enter >= *leave && (*enter > *depth || is_first && *enter == *depth);
        *tag = if hides { NOTHING } else { *tag };
    }
}

impl ProjectedPart {
    /// Where the rays of a row from the pixel `[u, v]` (from the image's centre) on enter the part, and where they leave it, as
    /// inverse depths: they hit it where the former is no smaller.
    fn cross(&self, [first, v]: [f32; 2], enter: &mut [f32], leave: &mut [f32]) {
        enter.fill(f32::INFINITY);
        for [a, b, c] in &self.outside {
            let base = b * v + c;
            for (i, enter) in enter.iter_mut().enumerate() {
                let w = a * (first + i as u32 as f32) + base;
                *enter = if w < *enter { w } else { *enter };
            }
        }
        // Hits must lie before the camera.
        leave.fill(f32::MIN_POSITIVE);
        for [a, b, c] in &self.inside {
            let base = b * v + c;
            for (i, leave) in leave.iter_mut().enumerate() {
                let w = a * (first + i as u32 as f32) + base;
                *leave = if w > *leave { w } else { *leave };
            }
        }
    }

    /// Whether this part surely hides the hull of some corners, each given by column and row from the image's centre and by its
    /// inverse depth: a convex solid stays convex in these coordinates, where every face plane is linear, so the corners tell for
    /// all of the hull. Planes that the camera is nearly in are not trusted.
    pub(super) fn covers(&self, corners: &[[f32; 3]]) -> bool {
        /// By how much the inverse depth must exceed what is to be hidden, 1 / m: far more than rounding.
        const MARGIN: f32 = 1e-3;
        /// Largest value of a plane's terms that is trusted, 1 / m.
        const MOST: f32 = 1e3;
        let value = |[a, b, c]: &[f32; 3], [u, v, _]: &[f32; 3]| {
            let terms = [a * u, b * v, *c];
            terms.iter().all(|term| term.abs() < MOST).then(|| terms.iter().sum::<f32>())
        };
        !self.outside.is_empty()
            && corners.iter().all(|corner| {
                let mut enter = f32::INFINITY;
                for plane in &self.outside {
                    match value(plane, corner) {
                        Some(w) if w > corner[2] + MARGIN => enter = enter.min(w),
                        _ => return false,
                    }
                }
                self.inside.iter().all(|plane| value(plane, corner).is_some_and(|w| w + MARGIN < enter))
            })
    }

    fn new(
        vertices: &[Point],
        faces: &[HalfSpace],
        camera_from_part: &Pose,
        intrinsics: &Intrinsics,
        tag: u16,
    ) -> Self {
        let (rect, nearest) = image_rect(vertices, camera_from_part, intrinsics);
        let mut part = Self { outside: vec![], inside: vec![], rect, nearest, tag };
        let camera = camera_from_part.inverse_transform_point(&Point::origin()).coords;
        for face in faces {
            let normal = camera_from_part.rotation * face.normal;
            let height = f64::from(face.normal.dot(&camera)) - f64::from(face.offset);
            // A camera in the very plane is taken to be just inside of it.
            let height = if height.abs() < 1e-7 { -1e-7 } else { height };
            let scale = |n: f32, per: f64| (-f64::from(n) / (per * height)) as f32;
            let focal = f64::from(intrinsics.focal_px);
            let plane = [scale(normal.x, focal), scale(normal.y, focal), scale(normal.z, 1.0)];
            if height > 0.0 { &mut part.outside } else { &mut part.inside }.push(plane);
        }
        part
    }
}

/// The pixels whose rays can hit the hull of `vertices`, and the largest inverse depth of these.
fn image_rect(vertices: &[Point], camera_from_part: &Pose, intrinsics: &Intrinsics) -> (Rect, f32) {
    let (mut low, mut high) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
    let center = intrinsics.principal_px();
    let (mut behind, mut before) = (false, false);
    let mut nearest = 0.0_f32;
    for vertex in vertices {
        let seen = camera_from_part * vertex;
        if seen.z < 1e-3 {
            behind = true;
            continue;
        }
        before = true;
        nearest = nearest.max(1.0 / seen.z);
        for axis in 0..2 {
            let pixel = intrinsics.focal_px * seen[axis] / seen.z + center[axis];
            low[axis] = low[axis].min(pixel);
            high[axis] = high[axis].max(pixel);
        }
    }
    let size = [intrinsics.width, intrinsics.height];
    let range = |axis: usize| {
        if behind {
            // The hull passes beside the camera: its outline in the image is not that of its corners.
            return 0..if before { size[axis] } else { 0 };
        }
        let clip = |pixel: f32| pixel.clamp(0.0, size[axis] as f32) as usize;
        clip((low[axis] - 1.0).floor())..clip((high[axis] + 1.0).ceil())
    };
    (Rect { columns: range(0), rows: range(1) }, if behind { f32::INFINITY } else { nearest })
}
