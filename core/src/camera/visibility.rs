//! How much of every object shows, and which objects no view of an array sees.

use super::render::{ProjectedScene, Rect, RowBuffer};
use super::{View, ViewArray, ViewId};
use crate::scene::{Body, ObjectId, Shelf};
use rayon::prelude::*;

/// An object is unseen from a view when fewer of its pixels than this show at 640 x 480.
pub const UNSEEN_PX: usize = 25;
/// Views that are looked at together before objects that have been seen are left out.
const VIEWS_PER_ROUND: usize = 12;

/// How much of an object shows in the view that shows most of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ObjectVisibility {
    /// The object.
    pub object: ObjectId,
    /// The largest number of its pixels in a view.
    pub most_px: usize,
    /// The first view with that number.
    pub view: ViewId,
}

impl ObjectVisibility {
    /// Whether the object is unseen from every view.
    pub fn is_hidden(&self) -> bool {
        self.most_px < UNSEEN_PX
    }
}

/// For every body, in their order, how much of it shows at most in a view of the array. Exact; every view is rendered.
pub fn visibility(shelf: &Shelf, bodies: &[Body], array: &ViewArray) -> Vec<ObjectVisibility> {
    let all: Vec<usize> = (0..bodies.len()).collect();
    let counts: Vec<Vec<usize>> =
        array.views.par_iter().map(|view| count_pixels(shelf, bodies, array, view, &all, usize::MAX)).collect();
    let best = |at: usize| {
        let mut best = ObjectVisibility { object: bodies[at].id, most_px: 0, view: ViewId(0) };
        for (view, counts) in array.views.iter().zip(&counts) {
            if counts[at] > best.most_px {
                best = ObjectVisibility { most_px: counts[at], view: view.id, ..best };
            }
        }
        best
    };
    all.into_iter().map(best).collect()
}

/// The bodies that are unseen from every view of the array, in their order. The same answer as [`visibility`] gives, but
/// a body is left out of the search as soon as a view has shown enough of it.
pub fn hidden_objects(shelf: &Shelf, bodies: &[Body], array: &ViewArray) -> Vec<ObjectId> {
    hidden_objects_while(shelf, bodies, array, || true).unwrap_or_default()
}

/// The same; `None` if `go_on`, which is called between rounds of a few views, returns false.
pub fn hidden_objects_while(
    shelf: &Shelf,
    bodies: &[Body],
    array: &ViewArray,
    go_on: impl Fn() -> bool,
) -> Option<Vec<ObjectId>> {
    let mut unseen: Vec<usize> = (0..bodies.len()).collect();
    // Views that are far apart first: neighbours see the same things.
    let count = array.views.len();
    let rounds = count.div_ceil(VIEWS_PER_ROUND);
    for round in 0..rounds {
        if unseen.is_empty() {
            break;
        }
        if !go_on() {
            return None;
        }
        let views: Vec<&View> = array.views.iter().skip(round).step_by(rounds).collect();
        let counts: Vec<Vec<usize>> =
            views.par_iter().map(|view| count_pixels(shelf, bodies, array, view, &unseen, UNSEEN_PX)).collect();
        let mut at = 0;
        unseen.retain(|_| {
            at += 1;
            counts.iter().all(|counts| counts[at - 1] < UNSEEN_PX)
        });
    }
    Some(unseen.into_iter().map(|at| bodies[at].id).collect())
}

/// Number of bodies that are unseen from every view of the array.
pub fn hidden_count(shelf: &Shelf, bodies: &[Body], array: &ViewArray) -> usize {
    hidden_objects(shelf, bodies, array).len()
}

/// How many pixels of each of the `wanted` bodies show in a view; counting may stop at `enough`.
fn count_pixels(
    shelf: &Shelf,
    bodies: &[Body],
    array: &ViewArray,
    view: &View,
    wanted: &[usize],
    enough: usize,
) -> Vec<usize> {
    let camera = &array.intrinsics;
    let scene = ProjectedScene::new(shelf, bodies, &view.world_from_camera, camera);
    let mut row = RowBuffer::new(camera.width);
    let [near, far] = camera.depth_range_m;
    let in_range = (1.0 / far)..=(1.0 / near);
    let mut counts = vec![0; bodies.len()];
    let outline = |body: usize| {
        let parts = scene.parts.iter().filter(|part| usize::from(part.tag) == body).map(|part| part.rect.clone());
        parts.reduce(|a, b| a.union(&b))
    };
    let outlines: Vec<(usize, Rect)> = wanted.iter().filter_map(|&body| Some((body, outline(body)?))).collect();
    let area: usize = outlines.iter().map(|(_, Rect { columns, rows })| columns.len() * rows.len()).sum();
    // Each body within its own outline, unless that is more work than one pass over the image.
    if area > camera.width * camera.height / 2 {
        for at in 0..camera.height {
            scene.scan(at, 0..camera.width, &mut row);
            for (tag, depth) in row.tag.iter().zip(&row.inverse_depth) {
                if usize::from(*tag) < bodies.len() && in_range.contains(depth) {
                    counts[usize::from(*tag)] += 1;
                }
            }
        }
    } else {
        for (body, Rect { columns, rows }) in outlines {
            for at in rows {
                scene.scan(at, columns.clone(), &mut row);
                let shows = |column: &usize| {
                    usize::from(row.tag[*column]) == body && in_range.contains(&row.inverse_depth[*column])
                };
                counts[body] += columns.clone().filter(shows).count();
                if counts[body] >= enough {
                    break;
                }
            }
        }
    }
    wanted.iter().map(|&body| counts[body]).collect()
}
