//! What the pointer does on the canvas: moves what is chosen, turns it, or draws a rectangle around what shall be.

use super::edit::Choose;
use super::snap::rounded;
use super::{Author, Edit, Snap};
use nudge_core::scene::Scene;
use std::collections::BTreeSet;

/// A gesture of the pointer, from where it began; points are on the board, metres.
#[derive(Clone, Debug, PartialEq)]
pub enum Gesture {
    /// Moves the chosen objects.
    Move {
        /// The object that was taken hold of; it snaps, the others keep their places beside it.
        grabbed: usize,
        /// Where the pointer was.
        from: [f32; 2],
        /// The scene as it was.
        before: Box<Scene>,
    },
    /// Turns one object about its middle.
    Turn {
        /// The object.
        object: usize,
        /// Its yaw less the pointer's direction at the start, degrees.
        offset_deg: f32,
        /// The scene as it was.
        before: Box<Scene>,
    },
    /// Draws a rectangle around what shall be chosen.
    Band {
        /// One corner.
        from: [f32; 2],
        /// The other.
        to: [f32; 2],
        /// What was chosen and stays.
        and: BTreeSet<usize>,
    },
}

impl Author {
    /// The gesture that is under way.
    pub fn gesture(&self) -> Option<&Gesture> {
        self.gesture.as_ref()
    }

    /// Takes hold of what is at a point: an object (and with it everything that is chosen, if it is), or nothing, which
    /// begins a rectangle.
    pub fn take_hold(&mut self, point: [f32; 2], how: Choose) {
        self.end_gesture();
        match self.plan.at(point, |at| self.selection.contains(&at)) {
            Some(grabbed) => {
                if !self.selection.contains(&grabbed) {
                    let others = std::mem::take(&mut self.selection);
                    self.selection = if how == Choose::Toggle { others } else { BTreeSet::new() };
                    self.selection.insert(grabbed);
                }
                self.gesture = Some(Gesture::Move { grabbed, from: point, before: Box::new(self.scene.clone()) });
            }
            None => {
                let and = if how == Choose::Toggle { self.selection.clone() } else { BTreeSet::new() };
                self.gesture = Some(Gesture::Band { from: point, to: point, and });
            }
        }
    }

    /// Takes hold of an object's handle for turning.
    pub fn take_handle(&mut self, object: usize, point: [f32; 2]) {
        self.end_gesture();
        let Some(standing) = self.scene.objects.get(object) else { return };
        let offset_deg = standing.yaw_deg - direction_deg(standing.position, point);
        self.gesture = Some(Gesture::Turn { object, offset_deg, before: Box::new(self.scene.clone()) });
    }

    /// Goes on with the gesture: the pointer is at a point now.
    pub fn drag_to(&mut self, point: [f32; 2], snap: Snap) {
        // Taken out and put back, because it is read while the scene is changed.
        let Some(mut gesture) = self.gesture.take() else { return };
        match &mut gesture {
            Gesture::Move { grabbed, from, before } => self.move_from(before, *grabbed, *from, point, snap),
            Gesture::Turn { object, offset_deg, before } => {
                let (object, offset_deg) = (*object, *offset_deg);
                if let Some(position) = before.objects.get(object).map(|object| object.position) {
                    let yaw_deg = snap.angle(direction_deg(position, point) + offset_deg);
                    self.edit(Edit::Turn, |scene| {
                        if let Some(object) = scene.objects.get_mut(object) {
                            object.yaw_deg = yaw_deg;
                        }
                    });
                }
            }
            Gesture::Band { from, to, and } => {
                *to = point;
                let within: BTreeSet<usize> = self.plan.within(*from, point).chain(and.iter().copied()).collect();
                self.choose_all(within);
            }
        }
        self.gesture = Some(gesture);
    }

    fn move_from(&mut self, before: &Scene, grabbed: usize, from: [f32; 2], to: [f32; 2], snap: Snap) {
        let Some(start) = before.objects.get(grabbed).map(|object| object.position) else { return };
        let by: [f32; 2] = std::array::from_fn(|axis| {
            let moved = to[axis] - from[axis];
            // A click that trembles moves nothing, also where an object is off the grid.
            if moved.abs() < 1e-6 { 0.0 } else { snap.position(start[axis] + moved) - start[axis] }
        });
        let chosen = self.selection.clone();
        self.edit(Edit::Move, |scene| {
            for at in chosen {
                if let (Some(object), Some(was)) = (scene.objects.get_mut(at), before.objects.get(at)) {
                    object.position = std::array::from_fn(|axis| rounded(was.position[axis] + by[axis]));
                }
            }
        });
    }

    /// Ends the gesture; what it changed is one step.
    pub fn end_gesture(&mut self) {
        if self.gesture.take().is_some() {
            self.settle();
        }
    }

    /// Gives the gesture up: everything is as it was before.
    pub fn cancel_gesture(&mut self) {
        let (edit, before) = match self.gesture.take() {
            Some(Gesture::Move { before, .. }) => (Edit::Move, before),
            Some(Gesture::Turn { before, .. }) => (Edit::Turn, before),
            Some(Gesture::Band { and, .. }) => return self.selection = and,
            None => return,
        };
        self.edit(edit, |scene| *scene = *before);
        self.settle();
    }
}

fn direction_deg(from: [f32; 2], to: [f32; 2]) -> f32 {
    (to[1] - from[1]).atan2(to[0] - from[0]).to_degrees()
}
