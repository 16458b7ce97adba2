//! Which objects are hidden after some of them have moved, without looking at everything again.
//!
//! The answer is that of [`hidden_objects`](super::hidden_objects), pixel for pixel. Four things make it fast:
//!
//! * What stands still is projected once per view.
//! * An object that was seen is looked for first in the view that showed it.
//! * In a view where nothing that stood before an object has moved, no more of it can show than before: an object that was
//!   hidden and stands still is looked for only in views where something that has moved was drawn over its outline.
//! * What one convex part alone hides is not drawn ([`ProjectedPart::covers`]).

use super::render::{ProjectedPart, ProjectedScene, Rect, RowBuffer, hide, project_body, scan};
use super::visibility::UNSEEN_PX;
use super::{View, ViewArray};
use crate::scene::{Body, ObjectId, Shelf};
use crate::solid::{Bounds, ConvexPart};
use crate::{Point, Pose, Vector};
use rayon::prelude::*;
use std::cmp::Reverse;

/// So many views are passed over between two that are tried one after the other: neighbours see the same things.
const STRIDE: usize = 37;

/// What is not even so many times as near as a body's farthest corner stands behind it: far more than rounding.
const BEHIND: f32 = 1.001;
/// How much larger than its part a box is to every side, metres.
const GROWN_M: f32 = 0.001;
/// Nearer to the camera's plane than this, a corner has no place in the image, metres.
const NEAREST_M: f32 = 1e-2;

/// Bodies as all views of an array see them.
pub struct HiddenWatch<'a> {
    views: &'a ViewArray,
    bodies: Vec<Body>,
    /// Per body, boxes around its parts, in its frame, a little larger than these.
    boxes: Vec<Vec<Bounds>>,
    /// Per view.
    scenes: Vec<ProjectedScene>,
    /// The order in which views are tried.
    order: Vec<usize>,
    /// Per body, a view that shows it; `None` for hidden ones.
    witness: Vec<Option<usize>>,
}

/// Bodies that have moved or gone, in one view.
struct Changed {
    /// What was drawn of them before.
    before: Vec<Rect>,
    /// Them now, those that are there.
    now: Vec<ProjectedPart>,
}

impl<'a> HiddenWatch<'a> {
    /// Looks at bodies from all views.
    pub fn new(shelf: &Shelf, bodies: &[Body], views: &'a ViewArray) -> Self {
        let project = |view: &View| ProjectedScene::new(shelf, bodies, &view.world_from_camera, &views.intrinsics);
        let count = views.views.len();
        let mut watch = Self {
            views,
            bodies: bodies.to_vec(),
            boxes: bodies.iter().map(boxes).collect(),
            scenes: views.views.par_iter().map(project).collect(),
            order: order(count),
            witness: Vec::new(),
        };
        let nothing = vec![false; bodies.len()];
        let finds = |body| {
            let buffer = &mut RowBuffer::new(views.intrinsics.width);
            watch
                .order
                .iter()
                .copied()
                .find(|view| watch.shows([body, *view], &bodies[body].world_from_body, &nothing, &[], buffer))
        };
        watch.witness = (0..bodies.len()).into_par_iter().map(finds).collect();
        watch
    }

    /// The bodies that no view shows, in their order.
    pub fn hidden(&self) -> Vec<ObjectId> {
        let unseen = self.bodies.iter().zip(&self.witness).filter(|(_, witness)| witness.is_none());
        unseen.map(|(body, _)| body.id).collect()
    }

    /// The bodies of `after` that no view shows: the same bodies in the same order, some elsewhere, some gone.
    pub fn hidden_after(&self, after: &[Body]) -> Vec<ObjectId> {
        let now: Vec<Option<&Body>> =
            self.bodies.iter().map(|body| after.iter().find(|now| now.id == body.id)).collect();
        let stays =
            |(body, now): (&Body, &Option<&Body>)| now.is_some_and(|now| now.world_from_body == body.world_from_body);
        let changed: Vec<bool> = self.bodies.iter().zip(&now).map(|pair| !stays(pair)).collect();
        let mut buffer = RowBuffer::new(self.views.intrinsics.width);
        // Views are looked at when they are needed.
        let mut seen_from: Vec<Option<Changed>> = self.scenes.iter().map(|_| None).collect();
        let mut hidden = Vec::new();
        for (at, body) in self.bodies.iter().enumerate() {
            let Some(here) = now[at] else { continue };
            let mut shows = |view: usize, only_if_bared: bool| {
                let seen = seen_from[view].get_or_insert_with(|| self.changed_in(view, &changed, &now));
                if only_if_bared && !self.is_bared(at, view, seen) {
                    return false;
                }
                self.shows([at, view], &here.world_from_body, &changed, &seen.now, &mut buffer)
            };
            let found = match self.witness[at] {
                Some(view) => {
                    shows(view, false) || self.order.iter().any(|other| *other != view && shows(*other, false))
                }
                None => self.order.iter().any(|view| shows(*view, !changed[at])),
            };
            if !found {
                hidden.push(body.id);
            }
        }
        hidden
    }

    fn changed_in(&self, view: usize, changed: &[bool], now: &[Option<&Body>]) -> Changed {
        let has_changed = |part: &&ProjectedPart| changed.get(usize::from(part.tag)).is_some_and(|changed| *changed);
        let before = self.scenes[view].parts.iter().filter(has_changed).map(|part| part.rect.clone()).collect();
        let camera_from_world = self.views.views[view].world_from_camera.inverse();
        let mut parts = Vec::new();
        for (tag, body) in now.iter().enumerate().filter(|(tag, _)| changed[*tag]) {
            if let Some(body) = body {
                let camera_from_body = camera_from_world * body.world_from_body;
                parts.extend(project_body(body, tag as u16, &camera_from_body, &self.views.intrinsics));
            }
        }
        parts.retain(|part| !part.rect.is_empty());
        Changed { before, now: parts }
    }

    /// Whether something that has moved was drawn over the outline of a body that stands still.
    fn is_bared(&self, body: usize, view: usize, seen: &Changed) -> bool {
        let own = self.scenes[view].parts.iter().filter(|part| usize::from(part.tag) == body);
        let outline = own.map(|part| part.rect.clone()).reduce(|a, b| a.union(&b));
        outline.is_some_and(|outline| seen.before.iter().any(|rect| rect.meets(&outline)))
    }

    /// Whether a view shows [`UNSEEN_PX`] pixels or more of a body that is at a pose, when those that have changed are drawn
    /// as `now`.
    fn shows(
        &self,
        [body, view]: [usize; 2],
        world_from_body: &Pose,
        changed: &[bool],
        now: &[ProjectedPart],
        buffer: &mut RowBuffer,
    ) -> bool {
        let scene = &self.scenes[view];
        let stays = |part: &&ProjectedPart| !changed.get(usize::from(part.tag)).is_some_and(|changed| *changed);
        let parts = || scene.parts.iter().filter(stays).chain(now);
        let outline = parts().filter(|part| usize::from(part.tag) == body).map(|part| part.rect.clone());
        let Some(outline) = outline.reduce(|a, b| a.union(&b)) else { return false };
        let camera_from_body = self.views.views[view].world_from_camera.inverse() * world_from_body;
        let boxes: Option<Vec<[[f32; 3]; 8]>> = (self.boxes[body].iter())
            .map(|bounds| corners(bounds, &camera_from_body, self.views.intrinsics.focal_px))
            .collect();
        let farthest = boxes.iter().flatten().flatten().map(|corner| corner[2]).reduce(f32::min).unwrap_or(0.0);
        let may_hide = |part: &&ProjectedPart| {
            usize::from(part.tag) != body && part.nearest * BEHIND >= farthest && part.rect.meets(&outline)
        };
        let mut others: Vec<&ProjectedPart> = parts().filter(may_hide).collect();
        let is_covered = |corners: &[[f32; 3]; 8]| others.iter().any(|part| part.covers(corners));
        if boxes.is_some_and(|boxes| boxes.iter().all(is_covered)) {
            return false;
        }
        // What hides most first, so that little is left to ask of the others.
        others.sort_by_key(|part| Reverse(part.rect.pixels_shared(&outline)));
        let own: Vec<&ProjectedPart> = parts().filter(|part| usize::from(part.tag) == body).collect();
        let [least, most] = self.views.intrinsics.depth_range_m;
        let in_range = (1.0 / most)..=(1.0 / least);
        let mut count = 0;
        for row in outline.rows {
            let columns = outline.columns.clone();
            scan(own.iter().copied(), scene.center(), row, columns.clone(), buffer);
            let shown = |buffer: &RowBuffer| {
                let hits = buffer.tag[columns.clone()].iter().zip(&buffer.inverse_depth[columns.clone()]);
                hits.filter(|(tag, depth)| usize::from(**tag) == body && in_range.contains(depth)).count()
            };
            let mut left = shown(buffer);
            for other in &others {
                if left == 0 {
                    break;
                }
                // Of two that are hit at the same depth the shelf counts first, then the bodies in their order.
                let is_first = usize::from(other.tag.wrapping_add(1)) < body + 1;
                hide(other, is_first, scene.center(), row, &columns, buffer);
                left = shown(buffer);
            }
            count += left;
            if count >= UNSEEN_PX {
                return true;
            }
        }
        false
    }
}

/// Boxes around a body's parts, in its frame.
fn boxes(body: &Body) -> Vec<Bounds> {
    let grown = Vector::repeat(GROWN_M);
    let around = |part: &ConvexPart| Bounds::around(part.vertices.iter().copied());
    let boxes = body.solid.parts.iter().filter_map(around);
    boxes.map(|bounds| Bounds { min: bounds.min - grown, max: bounds.max + grown }).collect()
}

/// The corners of a box by column and row from the image's centre and inverse depth; `None` if one is not before the camera.
fn corners(bounds: &Bounds, camera_from_box: &Pose, focal_px: f32) -> Option<[[f32; 3]; 8]> {
    let mut corners = [[0.0; 3]; 8];
    for (at, corner) in corners.iter_mut().enumerate() {
        let pick = |axis: usize| if at >> axis & 1 == 1 { bounds.max[axis] } else { bounds.min[axis] };
        let seen = camera_from_box * Point::new(pick(0), pick(1), pick(2));
        if seen.z < NEAREST_M {
            return None;
        }
        *corner = [focal_px * seen.x / seen.z, focal_px * seen.y / seen.z, 1.0 / seen.z];
    }
    Some(corners)
}

/// All of `count` views, neighbours far apart.
fn order(count: usize) -> Vec<usize> {
    (0..STRIDE).flat_map(|first| (first..count).step_by(STRIDE)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::hidden_objects;
    use crate::rng::stream;
    use crate::scene::{Catalog, Family, GenerateConfig, generate};
    use crate::world::World;
    use rand::Rng;

    #[test]
    fn what_is_hidden_after_a_change_is_what_a_look_from_all_views_says() {
        let catalog = Catalog::standard();
        let array = ViewArray::named("standard300").expect("shipped");
        let (mut hidden, mut other) = (0, 0);
        for (seed, family) in [Family::Walls, Family::Rows, Family::Rings, Family::TallFirst].into_iter().enumerate() {
            let scene = generate(&catalog, &GenerateConfig::of_family(family), seed as u64).expect("scene");
            let mut world = World::new(scene.shelf, scene.bodies(&catalog).expect("bodies"));
            world.settle();
            let bodies = world.bodies();
            let watch = HiddenWatch::new(world.shelf(), &bodies, &array);
            assert_eq!(watch.hidden(), hidden_objects(world.shelf(), &bodies, &array));
            for change in 0..6 {
                let mut rng = stream(seed as u64, "changes", change);
                let mut after = bodies.clone();
                // Some are moved, also into each other; one is taken away.
                for _ in 0..3 {
                    let at = rng.random_range(0..after.len());
                    let by = Vector::new(rng.random_range(-0.1..0.1), rng.random_range(-0.1..0.1), 0.0);
                    after[at].world_from_body =
                        Pose::from(nalgebra::Translation3::from(by)) * after[at].world_from_body;
                }
                if change == 2 {
                    after.remove(rng.random_range(0..after.len()));
                }
                let expected = hidden_objects(world.shelf(), &after, &array);
                assert_eq!(watch.hidden_after(&after), expected, "{family} {change}");
                hidden += expected.len();
                other += usize::from(expected != watch.hidden());
            }
            assert_eq!(watch.hidden_after(&bodies), watch.hidden());
        }
        assert!(hidden > 20 && other > 5, "{hidden} hidden, {other} other");
    }

    #[test]
    fn every_view_is_tried_once() {
        for count in [1, 36, 75, 300] {
            let mut all = order(count);
            all.sort_unstable();
            assert!(all.into_iter().eq(0..count));
        }
    }
}
