//! What the three-dimensional views show, as entities of the window's own recording.
//!
//! Everything is logged static, so that what is drawn anew replaces what was there: the time cursor is the window's, not
//! the viewer's. A [`Space`] says what shall be seen; [`Painter::paint`] logs the parts of it that have changed since the
//! last one, and remembers which voxel every drawn instance is, for picking.

mod arm;
pub mod at;
mod faces;
pub mod hit;
mod layout;
mod outlines;
mod push;
mod voxels;

use super::half_belief::HalfBelief;
use super::model::{ColourBy, Display, GainSource, Hovered, LayoutKind, Picked, Preview};
use super::session::{Moment, Session, SessionId, Setup};
use super::viewer;
use crate::colors::{Colormap, Rgb};
use crate::record::layout::Ground;
use crate::record::shapes;
use crate::record::voxels::colored;
use faces::Faces;
use nudge_core::Point;
use nudge_core::belief::Belief;
use nudge_core::camera::ViewId;
use nudge_core::grid::Grid;
use nudge_core::plan::{Action, Decision};
use nudge_core::scene::Shelf;
use outlines::outlines;
use rerun::{AsComponents, RecordingStream};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use voxels::{Shown, Voxels, voxel_key};

/// Drawn instances of one entity at most, so that the window stays quick.
const MOST_VOXELS: usize = 200_000;

/// Corners of a mesh at most, 28 bytes each; what has more is drawn as boxes.
const MOST_CORNERS: usize = 600_000;

/// One episode's state.
#[derive(Clone)]
pub struct Side {
    /// The episode.
    pub id: SessionId,
    /// Its shelf.
    pub shelf: Shelf,
    /// What does not change.
    pub setup: Setup,
    /// The state at the cursor.
    pub moment: Arc<Moment>,
    /// The state before it.
    pub before: Option<Arc<Moment>>,
    /// The state after it.
    pub after: Option<Arc<Moment>>,
    /// What was decided at the cursor, or is pending.
    pub decision: Option<Arc<Decision>>,
}

impl Side {
    /// An episode's state after `step` actions, or its last one.
    pub fn of(session: &Session, step: usize) -> Self {
        let moment = session.moment(step).clone();
        let step = moment.step;
        Self {
            id: session.id,
            shelf: session.record.scene.shelf,
            setup: session.setup.clone(),
            before: step.checked_sub(1).map(|before| session.moment(before).clone()),
            after: session.moments.get(step + 1).cloned(),
            decision: session.decision_after(step).cloned().map(Arc::new),
            moment,
        }
    }

    fn key(&self) -> (SessionId, usize) {
        (self.id, self.moment.step)
    }
}

/// What shall be seen.
#[derive(Clone)]
pub struct Space {
    /// The layout.
    pub layout: LayoutKind,
    /// Width over height of the place for the three-dimensional views.
    pub aspect: f32,
    /// Whether the window is light.
    pub light: bool,
    /// The episode that is shown.
    pub side: Option<Side>,
    /// The second one of a comparison.
    pub other: Option<Side>,
    /// How the belief is drawn.
    pub display: Display,
    /// What the pointer is over.
    pub hovered: Hovered,
    /// What is asked about.
    pub picked: Option<Picked>,
    /// The chosen view.
    pub view: Option<ViewId>,
    /// The chosen push candidate.
    pub candidate: Option<usize>,
    /// What a push would do.
    pub preview: Option<Preview>,
    /// Where a gain comes from.
    pub gain: Option<GainSource>,
    /// How far the arm's motion of the step is scrubbed, seconds.
    pub motion_s: Option<f64>,
}

impl Space {
    /// Whether the arm is in sight: where a person wants it, and while its motion is scrubbed.
    fn shows_arm(&self) -> bool {
        let here = matches!(self.layout, LayoutKind::Episode | LayoutKind::Why | LayoutKind::Push);
        here && (self.display.robot || self.motion_s.is_some())
    }
}

type VoxelsOf = BTreeMap<&'static str, Arc<Vec<usize>>>;

/// Which voxel every drawn instance of an entity is.
#[derive(Clone, Default)]
pub struct Drawn(Arc<Mutex<VoxelsOf>>);

impl Drawn {
    /// The voxel of an instance.
    pub fn voxel(&self, entity: &str, instance: usize) -> Option<usize> {
        let drawn = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        drawn.get(entity)?.get(instance).copied()
    }

    /// The voxels that are drawn of an entity.
    pub fn voxels(&self, entity: &str) -> Arc<Vec<usize>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get(entity).cloned().unwrap_or_default()
    }

    /// Number of voxels drawn.
    pub fn count(&self, entity: &str) -> usize {
        let drawn = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        drawn.get(entity).map_or(0, |voxels| voxels.len())
    }

    fn set(&self, entity: &'static str, voxels: Vec<usize>) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).insert(entity, Arc::new(voxels));
    }
}

/// Logs what has changed.
pub struct Painter {
    stream: RecordingStream,
    drawn: Drawn,
    /// The views that are there, how far from the shelf their eyes began, and their ground.
    layout: Option<(LayoutKind, f32, [f32; 3], Ground, bool)>,
    /// What every entity was last drawn from, as words.
    keys: BTreeMap<&'static str, String>,
    /// The last beliefs in full precision.
    beliefs: Vec<((SessionId, usize), Arc<Belief>)>,
}

impl Painter {
    /// Draws into a stream; nothing is there yet.
    pub fn new(stream: RecordingStream, drawn: Drawn) -> Self {
        Self { stream, drawn, layout: None, keys: BTreeMap::new(), beliefs: Vec::new() }
    }

    /// Logs what differs from the last call.
    pub fn paint(&mut self, space: &Space) {
        let ground = if space.light { Ground::Light } else { Ground::Dark };
        self.lay_out(space, ground);
        let Some(side) = &space.side else { return self.clear_all() };
        self.shelf(side);
        self.objects(side, space);
        self.belief(side, space);
        self.cameras(side, space);
        self.pushes(side, space);
        self.arm(side, space);
        if space.layout == LayoutKind::Push {
            self.push_views(side, space);
        }
        if space.layout.shows_gain() {
            self.gain(side, space);
        }
        if space.layout == LayoutKind::Compare {
            self.comparison(side, space);
        }
        self.pointer(side, space);
        // What was logged shall be seen at once. This is never the window's own thread.
        let _ = self.stream.flush_blocking();
    }

    /// Arranges the views, where others are wanted than there are.
    fn lay_out(&mut self, space: &Space, ground: Ground) {
        let size = space.side.as_ref().map_or([0.8, 0.4, 0.4], |side| side.shelf.size);
        let (aspect, arm) = (layout::coarse(space.aspect), space.shows_arm());
        let Some((views, layout)) = layout::of(space.layout, aspect, size, ground, arm) else { return };
        let wanted = Some((views, aspect, size, ground, arm));
        if self.layout != wanted
            && let Err(error) = layout.send(&self.stream, viewer::APPLICATION)
        {
            eprintln!("warning: layout: {error}");
        }
        self.layout = wanted;
    }

    /// Whether an entity must be drawn anew.
    fn differs(&mut self, entity: &'static str, key: String) -> bool {
        let differs = self.keys.get(entity) != Some(&key);
        if differs {
            self.keys.insert(entity, key);
        }
        differs
    }

    fn log(&self, entity: &str, content: &impl AsComponents) {
        if let Err(error) = self.stream.log_static(entity, content) {
            // A stream in memory has no reason to refuse; the picture is then a step old.
            eprintln!("warning: {entity}: {error}");
        }
    }

    fn log_voxels(&self, entity: &'static str, grid: &Grid, shown: Shown<'_>) {
        let outside = thinned(shown.outside);
        let faces = Faces::of(grid, &outside, &shown.inside, &shown.rgb);
        // A mesh has few corners where voxels of one colour lie side by side; where they do not, boxes take less room.
        let (mesh, boxes) =
            if faces.corners() <= MOST_CORNERS { (faces.mesh(), &[][..]) } else { (None, &outside[..]) };
        self.log(entity, &mesh.unwrap_or_else(nothing));
        self.log(entity, &colored(grid, boxes, shown.rgb));
        self.drawn.set(entity, outside);
    }

    fn clear_all(&mut self) {
        if self.keys.is_empty() {
            return;
        }
        let grid = Grid::for_shelf([0.1; 3], 0.1);
        for entity in [at::BELIEF, at::PREDICTED, at::DIFFERENCE, at::HAPPENED, at::GAIN, at::OTHER, at::BETWEEN] {
            self.log_voxels(entity, &grid, Shown::nothing());
        }
        for entity in [
            at::ARM_PATH,
            at::LINES,
            at::EDGES,
            at::VIEWS,
            at::CURRENT,
            at::HOVERED,
            at::PICKED,
            at::OBJECTS,
            at::OTHER_OBJECTS,
        ] {
            self.log(entity, &rerun::LineStrips3D::new(Vec::<Vec<[f32; 3]>>::new()));
        }
        for entity in [at::CANDIDATES, at::CHOSEN] {
            self.log(entity, &no_arrows());
        }
        self.log(at::HAPPENED_NOTE, &rerun::Points3D::new(Vec::<[f32; 3]>::new()));
        for entity in [at::SHELF, at::ARM] {
            self.log(entity, &nothing());
        }
        self.keys.clear();
    }

    fn full(&mut self, key: (SessionId, usize), belief: &HalfBelief) -> Arc<Belief> {
        if let Some((_, full)) = self.beliefs.iter().find(|(of, _)| *of == key) {
            return full.clone();
        }
        let full = Arc::new(belief.belief());
        self.beliefs.push((key, full.clone()));
        if self.beliefs.len() > 4 {
            self.beliefs.remove(0);
        }
        full
    }

    fn shelf(&mut self, side: &Side) {
        if self.differs(at::SHELF, format!("{:?}", side.shelf)) {
            self.log(at::SHELF, &shapes::shelf_panels(&side.shelf));
            self.log(at::EDGES, &shapes::shelf_edges(&side.shelf));
        }
    }

    fn objects(&mut self, side: &Side, space: &Space) {
        let shown = space.display.truth.then_some(&side.moment.bodies);
        let key = format!("{:?} {}", shown.map(|bodies| (side.id, Arc::as_ptr(bodies))), space.light);
        if self.differs(at::OBJECTS, key) {
            self.log(at::OBJECTS, &outlines(shown.map_or(&[], |bodies| bodies), space.light));
        }
    }

    fn belief(&mut self, side: &Side, space: &Space) {
        if !self.differs(at::BELIEF, format!("{:?} {:?}", side.key(), voxel_key(&space.display))) {
            return;
        }
        let belief = self.full(side.key(), &side.moment.belief);
        let before = match (&side.before, space.display.colour_by) {
            (Some(before), ColourBy::Change) => Some(self.full((side.id, before.step), &before.belief)),
            _ => None,
        };
        let shown = Voxels { belief: &belief, truth: side.moment.truth.as_deref(), catalog: &side.setup.catalog }
            .drawn(&space.display, before.as_deref());
        self.log_voxels(at::BELIEF, &belief.grid, shown);
    }

    fn cameras(&mut self, side: &Side, space: &Space) {
        let shown = space.display.views || space.layout.shows_gain();
        let gains = side.decision.as_ref().map(|decision| &decision.gains);
        if self.differs(at::VIEWS, format!("{shown} {:?} {}", side.key(), gains.is_some())) {
            let views = &side.setup.views;
            if !shown {
                self.log(at::VIEWS, &rerun::LineStrips3D::new(Vec::<Vec<[f32; 3]>>::new()));
            } else {
                let range = side.decision.as_ref().map_or([0.0, 1.0], |decision| shapes::gain_range(decision));
                let colors =
                    views.views.iter().enumerate().map(|(at, _)| match gains.and_then(|gains| gains.get(at)) {
                        Some(_) if side.setup.unreachable.contains(&ViewId(at as u16)) => {
                            rerun::Color::from(shapes::REJECTED_RGB)
                        }
                        Some(gain) => rerun::Color::from(Colormap::Cividis.of(*gain, range)),
                        None => rerun::Color::from(shapes::REJECTED_RGB),
                    });
                self.log(at::VIEWS, &shapes::view_frusta(views).with_colors(colors));
            }
        }
        let looked = match side.moment.outcome.as_ref().map(|outcome| outcome.record.action) {
            Some(Action::Look { view }) => Some(view),
            _ => None,
        };
        if self.differs(at::CURRENT, format!("{:?} {looked:?}", side.id)) {
            self.log(at::CURRENT, &frustum(side, looked, 0.10, shapes::CHOSEN_RGB));
        }
    }

    fn gain(&mut self, side: &Side, space: &Space) {
        let source = space.gain.as_ref().filter(|source| source.of == side.key());
        if !self.differs(at::GAIN, format!("{:?} {:?}", side.key(), source.map(|source| source.view))) {
            return;
        }
        let grid = side.moment.belief.grid();
        match source {
            Some(source) => {
                self.log(at::GAIN, &crate::record::voxels::gains(grid, &source.nats));
                let drawn = crate::record::voxels::telling(&source.nats, source.top);
                self.drawn.set(at::GAIN, drawn.into_iter().map(|(index, _)| index).collect());
            }
            None => self.log_voxels(at::GAIN, grid, Shown::nothing()),
        }
    }

    fn comparison(&mut self, side: &Side, space: &Space) {
        let Some(other) = &space.other else { return };
        let key = format!("{:?} {:?}", other.key(), voxel_key(&space.display));
        let b = self.full(other.key(), &other.moment.belief);
        if self.differs(at::OTHER, key.clone()) {
            let shown = Voxels { belief: &b, truth: other.moment.truth.as_deref(), catalog: &other.setup.catalog }
                .drawn(&space.display, None);
            self.log_voxels(at::OTHER, &b.grid, shown);
        }
        let shown = space.display.truth.then_some(&other.moment.bodies);
        let outlined = format!("{:?} {}", shown.map(|bodies| (other.id, Arc::as_ptr(bodies))), space.light);
        if self.differs(at::OTHER_OBJECTS, outlined) {
            self.log(at::OTHER_OBJECTS, &outlines(shown.map_or(&[], |bodies| bodies), space.light));
        }
        if self.differs(at::BETWEEN, format!("{:?} {key}", side.key())) {
            let a = self.full(side.key(), &side.moment.belief);
            if a.grid != b.grid {
                return self.log_voxels(at::BETWEEN, &a.grid, Shown::nothing());
            }
            let changed = Display { colour_by: ColourBy::Change, band: [0.0, 1.0], ..space.display.clone() };
            let shown = Voxels { belief: &a, truth: side.moment.truth.as_deref(), catalog: &side.setup.catalog }
                .drawn(&changed, Some(&b));
            self.log_voxels(at::BETWEEN, &a.grid, shown);
        }
    }

    fn pointer(&mut self, side: &Side, space: &Space) {
        if self.differs(at::HOVERED, format!("{:?} {:?} {:?}", side.id, space.hovered, space.view)) {
            let strips = match space.hovered {
                Hovered::View(view) => frustum(side, Some(view), 0.16, [255, 255, 255]),
                Hovered::Manipulation(manipulation) => {
                    let outline = manipulation.outline();
                    let ways = outline.arrows.iter().map(|arrow| vec![arrow.start, arrow.end()]);
                    let strip = |line: Vec<Point>| line.iter().map(|p| <[f32; 3]>::from(p.coords)).collect::<Vec<_>>();
                    rerun::LineStrips3D::new(ways.chain(outline.lines.iter().cloned()).map(strip))
                        .with_colors([rerun::Color::from([255, 255, 255])])
                        .with_radii([0.006_f32])
                }
                Hovered::Nothing => frustum(side, space.view, 0.13, [255, 255, 255]),
            };
            self.log(at::HOVERED, &strips);
        }
        // The mark belongs to the question; other layouts ask another.
        let picked = space.picked.filter(|_| space.layout == LayoutKind::Why);
        if self.differs(at::PICKED, format!("{:?} {picked:?}", side.id)) {
            let grid = side.moment.belief.grid();
            let strips = match picked {
                None => rerun::LineStrips3D::new(Vec::<Vec<[f32; 3]>>::new()),
                Some(Picked::Voxel(index)) => box_edges(grid, index..index + 1),
                Some(Picked::Cell(cell)) => box_edges(grid, grid.column(cell)),
            };
            let strips = strips
                .with_colors([rerun::Color::from([255, 60, 160])])
                .with_radii([rerun::Radius::new_ui_points(2.0)]);
            self.log(at::PICKED, &strips);
        }
    }
}

/// Every second, third ... voxel, if there are too many.
fn thinned(voxels: Vec<usize>) -> Vec<usize> {
    let step = voxels.len().div_ceil(MOST_VOXELS).max(1);
    if step == 1 { voxels } else { voxels.into_iter().step_by(step).collect() }
}

fn no_arrows() -> rerun::Arrows3D {
    rerun::Arrows3D::from_vectors(Vec::<[f32; 3]>::new())
}

/// A mesh that cannot be seen.
fn nothing() -> rerun::Mesh3D {
    rerun::Mesh3D::new([[0.0_f32; 3]; 3])
        .with_vertex_normals([[0.0, 0.0, 1.0]; 3])
        .with_triangle_indices([[0, 1, 2]])
        .with_albedo_factor(rerun::Rgba32::from_unmultiplied_rgba(0, 0, 0, 0))
}

/// A view's frustum, or nothing.
fn frustum(side: &Side, view: Option<ViewId>, depth_m: f32, rgb: Rgb) -> rerun::LineStrips3D {
    let Some(view) = view.and_then(|view| side.setup.views.view(view)) else {
        return rerun::LineStrips3D::new(Vec::<Vec<[f32; 3]>>::new());
    };
    shapes::frustum(view, &side.setup.views.intrinsics, depth_m)
        .with_colors([rerun::Color::from(rgb)])
        .with_radii([rerun::Radius::new_ui_points(1.6)])
}

/// The edges of the box around consecutive voxels of a column.
fn box_edges(grid: &Grid, voxels: std::ops::Range<usize>) -> rerun::LineStrips3D {
    let half = 0.5 * grid.voxel_m;
    let low = grid.center(grid.voxel(voxels.start)).coords.add_scalar(-half);
    let high = grid.center(grid.voxel(voxels.end - 1)).coords.add_scalar(half);
    let ring = |z: f32| {
        vec![[low.x, low.y, z], [high.x, low.y, z], [high.x, high.y, z], [low.x, high.y, z], [low.x, low.y, z]]
    };
    let mut strips = vec![ring(low.z), ring(high.z)];
    strips.extend(
        [[low.x, low.y], [high.x, low.y], [high.x, high.y], [low.x, high.y]]
            .map(|[x, y]| vec![[x, y, low.z], [x, y, high.z]]),
    );
    rerun::LineStrips3D::new(strips)
}
