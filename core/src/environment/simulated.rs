//! The simulated shelf: bodies that settle and are pushed, images by ray casting, and the truth.

use super::Environment;
use crate::arm::{Arm, ArmTool, PhasedMotion};
use crate::camera::{Intrinsics, Sensed, View, render};
use crate::scene::{Body, Catalog, Scene};
use crate::world::{ManipulationOutcome, Standing, TruthMap, World};
use crate::{Error, Result};
use std::sync::{Arc, OnceLock};

/// A scene whose bodies obey rapier3d. A clone is a branch with the same future.
#[derive(Clone)]
pub struct Simulated {
    /// The world as it stands; of a resumed one only once something asks for it.
    world: OnceLock<World>,
    /// The settled world before the first push.
    start: Arc<World>,
    /// How the world of a resumed one is reached.
    resumed: Option<Arc<Resumed>>,
    bodies: Arc<Vec<Body>>,
    truth: Arc<TruthMap>,
}

/// What was done to a shelf before it was resumed, and where that led.
struct Resumed {
    arm: Arc<ArmTool>,
    pushed: Vec<PhasedMotion>,
    standing: Vec<Standing>,
}

impl Simulated {
    /// The scene, settled.
    ///
    /// # Errors
    /// A scene that gives no bodies.
    pub fn new(scene: &Scene, catalog: &Catalog) -> Result<Self> {
        let mut world = World::new(scene.shelf, scene.bodies(catalog)?);
        world.settle();
        let bodies = world.bodies();
        let truth = TruthMap::of(&scene.grid(), &bodies);
        Ok(Self {
            start: Arc::new(world.clone()),
            world: OnceLock::from(world),
            resumed: None,
            bodies: Arc::new(bodies),
            truth: Arc::new(truth),
        })
    }

    /// The bodies where they are now, dropped ones left out.
    pub fn bodies(&self) -> &Arc<Vec<Body>> {
        &self.bodies
    }

    /// The bodies before the first push.
    pub fn bodies_at_start(&self) -> Vec<Body> {
        self.start.bodies()
    }

    /// What the camera gives from a view now.
    pub fn frame_from(&self, view: &View, intrinsics: &Intrinsics) -> Sensed {
        render(self.start.shelf(), &self.bodies, view, intrinsics)
    }

    /// The world now. Of a resumed shelf all pushes so far are simulated again when this is first called.
    pub fn world(&self) -> &World {
        self.world.get_or_init(|| {
            let mut world = (*self.start).clone();
            if let Some(resumed) = &self.resumed {
                resumed.pushed.iter().for_each(|motion| drop(world.execute(&resumed.arm.arm, motion)));
            }
            world
        })
    }

    /// Where every body stands now, dropped ones included.
    pub fn standing(&self) -> Vec<Standing> {
        match (self.world.get(), &self.resumed) {
            (None, Some(resumed)) => resumed.standing.clone(),
            _ => self.world().standing(),
        }
    }

    /// The same shelf after pushes that were carried out before: its bodies are put where they stood then. The physics
    /// behind them (contacts and what they press with) is made again only once something is pushed, and it is verified then
    /// that the bodies stand as they stood.
    ///
    /// # Errors
    /// In words, where the bodies are not those of the scene.
    pub(crate) fn resumed(
        &self,
        arm: Arc<ArmTool>,
        pushed: Vec<PhasedMotion>,
        standing: Vec<Standing>,
    ) -> std::result::Result<Self, String> {
        let bodies = self.start.bodies_at(&standing)?;
        let truth = Arc::new(TruthMap::of(&self.start.shelf().grid(), &bodies));
        let world = if pushed.is_empty() { self.world.clone() } else { OnceLock::new() };
        let resumed = Some(Arc::new(Resumed { arm, pushed, standing }));
        Ok(Self { world, start: self.start.clone(), resumed, bodies: Arc::new(bodies), truth })
    }
}

impl Environment for Simulated {
    fn frame(&mut self, view: &View, intrinsics: &Intrinsics) -> Result<Sensed> {
        Ok(self.frame_from(view, intrinsics))
    }

    fn carry_out(&mut self, arm: &Arm, motion: &PhasedMotion) -> Result<ManipulationOutcome> {
        let stood = self.standing();
        if self.world().standing() != stood {
            let message = "simulating the pushes so far again does not lead to where the objects stood: the episode was made \
                           by another version or on another machine, and nothing more can be pushed in it";
            return Err(Error::Check(message.to_owned()));
        }
        let Some(world) = self.world.get_mut() else { return Err(Error::Check("there is no world".to_owned())) };
        let outcome = world.execute(arm, motion);
        self.resumed = None;
        self.bodies = Arc::new(world.bodies());
        self.truth = Arc::new(TruthMap::of(&world.shelf().grid(), &self.bodies));
        Ok(outcome)
    }

    fn truth(&self) -> Option<&TruthMap> {
        Some(&self.truth)
    }

    fn branch(&self) -> Option<Box<dyn Environment>> {
        Some(Box::new(self.clone()))
    }

    fn simulated(&self) -> Option<&Simulated> {
        Some(self)
    }
}
