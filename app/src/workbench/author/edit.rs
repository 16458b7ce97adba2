//! What can be done to a scene in the making. Every change goes through [`Author::edit`], so that it can be taken back.

use super::snap::{normal_angle, rounded};
use super::{Author, Edit, Snap};
use nudge_core::scene::{Object, Scene};

/// How much *Rotate* turns when nothing snaps, degrees.
const TURN_DEG: f32 = 15.0;
/// How far an arrow key moves when nothing snaps, metres.
const NUDGE_M: f32 = 0.001;

/// Which objects a click leaves chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choose {
    /// This one and no other.
    Only,
    /// This one as well, or no longer.
    Toggle,
}

impl Author {
    /// Changes the document; changes of one gesture that follow each other are one step to take back.
    pub fn edit(&mut self, edit: Edit, change: impl FnOnce(&mut Scene)) {
        let before = self.scene.clone();
        change(&mut self.scene);
        if self.scene != before {
            self.history.record(before, edit);
            self.changed();
            if edit == Edit::Once {
                self.count.hurry();
            }
        }
    }

    /// Ends a gesture: what follows is a step of its own, and the hidden objects are counted for what is there now.
    pub fn settle(&mut self) {
        self.history.settle(&self.scene);
        self.count.hurry();
    }

    /// Takes the last step back.
    pub fn undo(&mut self) {
        self.end_gesture();
        let now = std::mem::replace(&mut self.scene, super::empty());
        let (Ok(scene) | Err(scene)) = self.history.undo(now);
        self.go_to(scene);
    }

    /// Does the step that was taken back last again.
    pub fn redo(&mut self) {
        self.end_gesture();
        let now = std::mem::replace(&mut self.scene, super::empty());
        let (Ok(scene) | Err(scene)) = self.history.redo(now);
        self.go_to(scene);
    }

    fn go_to(&mut self, scene: Scene) {
        self.scene = scene;
        self.changed();
        self.count.hurry();
    }

    /// Chooses an object.
    pub fn choose(&mut self, at: usize, how: Choose) {
        if at >= self.scene.objects.len() {
            return;
        }
        match how {
            Choose::Only => self.selection = [at].into(),
            Choose::Toggle if self.selection.remove(&at) => {}
            Choose::Toggle => {
                self.selection.insert(at);
            }
        }
    }

    /// Chooses several objects and no other.
    pub fn choose_all(&mut self, objects: impl IntoIterator<Item = usize>) {
        let count = self.scene.objects.len();
        self.selection = objects.into_iter().filter(|at| *at < count).collect();
    }

    /// Chooses nothing.
    pub fn choose_none(&mut self) {
        self.selection.clear();
    }

    /// Adds an object of a class at a point, snapped, and chooses it.
    pub fn add_at(&mut self, class: &str, position: [f32; 2]) {
        let object = Object::new(class, position.map(|v| self.snap.position(v)), 0.0);
        self.edit(Edit::Once, |scene| scene.objects.push(object));
        self.choose(self.scene.objects.len() - 1, Choose::Only);
    }

    /// Adds an object of a class where there is room, as near as can be to the middle of the board; in the middle where
    /// there is none.
    pub fn add(&mut self, class: &str) {
        let middle = [0.0, 0.5 * self.scene.shelf.size[1]];
        let place = self.room_for(&Object::new(class, middle, 0.0)).unwrap_or(middle);
        let snap = std::mem::replace(&mut self.snap, Snap::Off);
        self.add_at(class, place);
        self.snap = snap;
    }

    /// The nearest place to an object's own where it would have room.
    fn room_for(&self, object: &Object) -> Option<[f32; 2]> {
        let alone = Scene { objects: vec![object.clone()], ..self.scene.clone() };
        let body = alone.bodies(&self.catalog).ok()?.pop()?;
        self.plan.room_for(&self.scene, &body.solid.footprint(), object.yaw_deg, object.position)
    }

    /// Duplicates the chosen objects, each to the nearest place with room, and chooses the copies.
    pub fn duplicate(&mut self) {
        let first_copy = self.scene.objects.len();
        for at in self.selection.clone() {
            let mut copy = self.scene.objects[at].clone();
            let beside = [copy.position[0] + 0.02, copy.position[1]].map(rounded);
            copy.position = self.room_for(&copy).unwrap_or(beside);
            // One step for all copies.
            self.edit(Edit::Field("duplicate"), |scene| scene.objects.push(copy));
        }
        self.settle();
        self.choose_all(first_copy..self.scene.objects.len());
    }

    /// Deletes the chosen objects.
    pub fn delete(&mut self) {
        let gone = std::mem::take(&mut self.selection);
        let catalog = self.catalog.clone();
        self.edit(Edit::Once, |scene| {
            let mut at = 0;
            scene.objects.retain(|_| {
                at += 1;
                !gone.contains(&(at - 1))
            });
            let Scene { meshes, objects, .. } = scene;
            // A mesh of an object's own goes with its last object: nothing would name it any more.
            let is_used = |key: &String| objects.iter().any(|object| object.mesh.as_ref() == Some(key));
            meshes.retain(|key, _| catalog.by_name(key).is_some() || is_used(key));
        });
    }

    /// Turns the chosen objects about their own middles, counter-clockwise by the snap's angle, or back.
    pub fn turn(&mut self, steps: f32) {
        self.change_selected(Edit::Once, |object| {
            object.yaw_deg = normal_angle(((object.yaw_deg / TURN_DEG).round() + steps) * TURN_DEG);
        });
    }

    /// Moves the chosen objects by one step of the snap's grid, or a millimetre where nothing snaps.
    pub fn nudge(&mut self, [x, y]: [f32; 2]) {
        let step = self.snap.step_m().unwrap_or(NUDGE_M);
        self.change_selected(Edit::Nudge, |object| {
            object.position = [rounded(object.position[0] + x * step), rounded(object.position[1] + y * step)];
        });
    }

    /// Changes every chosen object.
    pub fn change_selected(&mut self, edit: Edit, change: impl Fn(&mut Object)) {
        let chosen = self.selection.clone();
        self.edit(edit, |scene| {
            for at in chosen {
                if let Some(object) = scene.objects.get_mut(at) {
                    change(object);
                }
            }
        });
    }

    /// Makes the chosen objects another class; a shape of their own goes.
    pub fn change_class(&mut self, class: &str) {
        self.change_selected(Edit::Once, |object| {
            if object.class != class {
                object.class = class.to_owned();
                object.mesh = None;
            }
        });
    }
}
