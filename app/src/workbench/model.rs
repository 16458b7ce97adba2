//! What the window shows: the open episodes, the time cursor, and every choice that a person has made. No egui widgets
//! and no viewer in here, so that tests can look at all of it.

use super::author::Author;
use super::browser::Browser;
use super::changes::{self, Largest};
use super::columns::{Column, Columns};
use super::derive::Derived;
pub use super::layout_kind::LayoutKind;
pub use super::picked::Picked;
use super::session::{Moment, Session, SessionId};
use super::toasts::Toasts;
use crate::driver::default_belief;
use nudge_core::belief::Prediction;
use nudge_core::camera::{NoiseModel, ViewId};
use nudge_core::plan::{Counted, PlannerSettings, PolicyKind};
use nudge_core::skill::Manipulation;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;

/// What the colour of a drawn voxel says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ColourBy {
    /// Probability of being occupied (viridis).
    #[default]
    Probability,
    /// Entropy of the voxel, nats (magma).
    Entropy,
    /// The likeliest class of its floor cell.
    Class,
    /// Where belief and truth differ.
    Error,
    /// Change of probability since the step before (blue - white - orange).
    Change,
}

impl ColourBy {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Probability, Self::Entropy, Self::Class, Self::Error, Self::Change];

    /// As the choice names it.
    pub fn title(self) -> &'static str {
        match self {
            Self::Probability => "probability",
            Self::Entropy => "entropy",
            Self::Class => "class",
            Self::Error => "error",
            Self::Change => "change",
        }
    }
}

/// How the belief is drawn in three dimensions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Display {
    /// What colour says.
    pub colour_by: ColourBy,
    /// Voxels with a probability in this range are drawn.
    pub band: [f32; 2],
    /// Voxels between these places along x, y and z are drawn, metres: a slice when two are close.
    pub slice_m: [[f32; 2]; 3],
    /// The outlines of the true objects.
    pub truth: bool,
    /// The candidate views as frusta.
    pub views: bool,
    /// The push candidates as arrows.
    pub pushes: bool,
    /// The arm.
    pub robot: bool,
}

/// No slice: beyond any shelf, so that a shelf of any size is whole.
pub const EVERYWHERE_M: [[f32; 2]; 3] = [[-5.0, 5.0]; 3];

impl Default for Display {
    fn default() -> Self {
        Self {
            colour_by: ColourBy::Class,
            band: [0.5, 1.0],
            slice_m: EVERYWHERE_M,
            truth: true,
            views: false,
            pushes: false,
            robot: false,
        }
    }
}

/// What the pointer is over, to be highlighted in three dimensions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Hovered {
    /// Nothing.
    #[default]
    Nothing,
    /// A view.
    View(ViewId),
    /// A candidate to move something.
    Manipulation(Manipulation),
}

/// How far a person has moved the arm along its motion: of which step, and to which time, seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Scrubbed(Option<((SessionId, usize), f64)>);

impl Scrubbed {
    /// The time in the motion of a step, seconds; `None` where nobody moves the arm along it.
    pub fn at_s(&self, step: (SessionId, usize)) -> Option<f64> {
        self.0.filter(|(of, _)| *of == step).map(|(_, at_s)| at_s)
    }

    /// Moves the arm to a time in the motion of a step, seconds.
    pub fn scrub(&mut self, step: (SessionId, usize), at_s: f64) {
        self.0 = Some((step, at_s));
    }

    /// Shows the step without the arm again.
    pub fn hide(&mut self) {
        self.0 = None;
    }
}

/// With what an episode is started.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct StartForm {
    /// The scene's file; none yet at the first start.
    pub scene: Option<PathBuf>,
    /// The rule that chooses actions.
    pub policy: PolicyKind,
    /// The belief update: `classical` or `cnabu`.
    pub belief: String,
    /// Seed of every random choice.
    pub seed: u64,
    /// Number of actions.
    pub budget: usize,
    /// The view array: the name of one that comes with the program, or a file.
    pub views: String,
    /// What the camera gets wrong.
    pub noise: Option<NoiseModel>,
    /// The planner's numbers.
    pub planner: PlannerSettings,
    /// A second policy to run side by side with the first.
    pub against: Option<PolicyKind>,
}

impl Default for StartForm {
    fn default() -> Self {
        let policy = PolicyKind::Mem;
        let belief = default_belief(policy);
        Self {
            scene: None,
            policy,
            belief: belief.to_owned(),
            seed: 0,
            budget: 20,
            views: "standard300".to_owned(),
            noise: None,
            planner: PlannerSettings::of_belief(belief),
            against: None,
        }
    }
}

impl StartForm {
    /// With another belief update, and the way to count gains that goes with it.
    pub fn with_belief(self, belief: &str) -> Self {
        let planner = self.planner.counting(Counted::of_belief(belief));
        Self { belief: belief.to_owned(), planner, ..self }
    }
}

/// A belief update asked for, with the manipulation that it is about.
#[derive(Clone, Debug)]
pub struct Preview {
    /// The episode and the step whose belief it starts from.
    pub of: (SessionId, usize),
    /// The manipulation.
    pub manipulation: Manipulation,
    /// Belief and change that are predicted, with what is swept.
    pub prediction: Arc<Prediction>,
    /// The voxels that the tool sweeps.
    pub swept: Arc<nudge_core::grid::VoxelSet>,
}

/// Where a view's gain comes from.
#[derive(Clone, Debug)]
pub struct GainSource {
    /// The episode and the step whose belief it is about.
    pub of: (SessionId, usize),
    /// The view.
    pub view: ViewId,
    /// Nats by voxel.
    pub nats: Arc<Vec<(usize, f32)>>,
    /// The top of the colour scale, nats; see `gain_top` in the recording's voxels.
    pub top: f32,
}

impl GainSource {
    /// The gain of a view under the belief after a step of an episode, by voxel in nats.
    pub fn new(of: (SessionId, usize), view: ViewId, nats: Vec<(usize, f32)>) -> Self {
        let top = crate::record::voxels::gain_top(&nats);
        Self { of, view, nats: Arc::new(nats), top }
    }
}

/// What is remembered from one start of the program to the next.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Remembered {
    /// The layout that was shown.
    pub layout: LayoutKind,
    /// How the belief is drawn.
    pub display: Display,
    /// With what an episode is started.
    pub form: StartForm,
    /// What was opened lately, the latest first.
    pub recent: Vec<PathBuf>,
    /// Light, where a person asked for it.
    pub light: bool,
    /// Which panels are open.
    pub columns: Columns,
    /// Whether the tour was shown to its end, or skipped.
    pub toured: bool,
}

/// Everything that the window shows.
#[derive(Default)]
pub struct Model {
    /// What outlasts the program.
    pub kept: Remembered,
    /// The open episodes, in the order of opening.
    pub sessions: Vec<Session>,
    /// The one that is shown.
    pub shown: Option<SessionId>,
    /// The second one of a comparison.
    pub other: Option<SessionId>,
    /// Number of actions after which everything is shown.
    pub cursor: usize,
    /// What a person asks about.
    pub picked: Option<Picked>,
    /// What the pointer is over.
    pub hovered: Hovered,
    /// The view whose gain is explained.
    pub view: Option<ViewId>,
    /// The push whose prediction is shown, by its position among the candidates of [`Session::decision_after`].
    pub candidate: Option<usize>,
    /// The last answered preview.
    pub preview: Option<Preview>,
    /// The last answered gain source.
    pub gain_source: Option<GainSource>,
    /// The largest changes of the step that they were asked for last.
    pub largest: Option<(changes::Of, Arc<Largest>)>,
    /// Floor maps and full-precision beliefs of the states that are shown, made in the background.
    pub derived: BTreeMap<(SessionId, usize), Arc<Derived>>,
    /// Whether the scenes to choose from are shown in place of the episode.
    pub browsing: bool,
    /// The port at 127.0.0.1 where other viewers may look on.
    pub serving: Option<u16>,
    /// A foreign recording that is shown in place of the episode.
    pub recording: Option<PathBuf>,
    /// States whose maps are being made.
    pub deriving: BTreeSet<(SessionId, usize)>,
    /// The height of the slice that maps show, metres; `None` for the whole column.
    pub slice_m: Option<f32>,
    /// The scene in the making.
    pub author: Author,
    /// The scenes to choose from.
    pub browser: Browser,
    /// Messages that fade.
    pub toasts: Toasts,
    /// Size of the window, points.
    pub window: [f32; 2],
    /// How far the arm is moved along its motion.
    pub scrubbed: Scrubbed,
}

impl Model {
    /// An open episode.
    pub fn session_of(&self, id: SessionId) -> Option<&Session> {
        self.sessions.iter().find(|session| session.id == id)
    }

    /// An open episode, to be changed.
    pub fn session_of_mut(&mut self, id: SessionId) -> Option<&mut Session> {
        self.sessions.iter_mut().find(|session| session.id == id)
    }

    /// Shows an open episode at its last state. What was chosen in another one is let go.
    pub fn show(&mut self, id: SessionId) {
        if self.shown != Some(id) {
            if self.other == Some(id) {
                self.other = self.shown;
            }
            (self.picked, self.view, self.candidate) = (None, None, None);
            self.hovered = Hovered::Nothing;
        }
        self.shown = Some(id);
        self.go_to(self.session().map_or(0, Session::steps));
    }

    /// Moves the cursor. A push was chosen among those of one decision: at another step it is let go.
    pub fn go_to(&mut self, step: usize) {
        if step != self.cursor {
            self.candidate = None;
        }
        self.cursor = step;
    }

    /// Lets an open episode go, with all that was made of it.
    pub fn forget(&mut self, id: SessionId) {
        self.sessions.retain(|session| session.id != id);
        self.derived.retain(|(of, _), _| *of != id);
        self.deriving.retain(|(of, _)| *of != id);
        self.other = self.other.filter(|other| *other != id);
        if self.shown == Some(id) {
            self.shown = None;
            if let Some(last) = self.sessions.last().map(|session| session.id) {
                self.show(last);
            }
        }
    }

    /// The episode that is shown.
    pub fn session(&self) -> Option<&Session> {
        self.session_of(self.shown?)
    }

    /// The second episode of the comparison.
    pub fn other_session(&self) -> Option<&Session> {
        self.session_of(self.other?)
    }

    /// The episodes that are on the window: the shown one, and in a comparison the second one.
    pub fn on_show(&self) -> impl Iterator<Item = &Session> {
        let other = self.other_session().filter(|_| self.kept.layout == LayoutKind::Compare);
        self.session().into_iter().chain(other)
    }

    /// The last step that the cursor can go to: of a comparison, the longer episode's.
    pub fn last_step(&self) -> usize {
        self.on_show().map(Session::steps).max().unwrap_or(0)
    }

    /// Whether one of the episodes on the window is at something.
    pub fn runs_any(&self, is: impl Fn(&Session) -> bool) -> bool {
        self.on_show().any(is)
    }

    /// Whether an episode is in sight: open, and neither the scenes to choose from, nor the editor, nor a foreign recording
    /// are in its place.
    pub fn shows_episode(&self) -> bool {
        let hidden = self.browsing || self.recording.is_some() || self.kept.layout == LayoutKind::Author;
        self.session().is_some() && !hidden
    }

    /// Whether a panel is open.
    pub fn shows(&self, column: Column) -> bool {
        self.kept.columns.is_open(column, self.window)
    }

    /// The state at the cursor.
    pub fn moment(&self) -> Option<&Arc<Moment>> {
        Some(self.session()?.moment(self.cursor))
    }

    /// Maps and full belief at the cursor, once they are made.
    pub fn derived(&self) -> Option<&Arc<Derived>> {
        let session = self.session()?;
        self.derived.get(&(session.id, self.cursor.min(session.steps())))
    }

    /// The same for an episode and a step.
    pub fn derived_of(&self, id: SessionId, step: usize) -> Option<&Arc<Derived>> {
        self.derived.get(&(id, step))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nudge_core::belief::{CLASSICAL, CNABU};

    #[test]
    fn a_new_episode_begins_with_the_networks_where_they_are_and_with_the_gain_that_goes_with_them() {
        let form = StartForm::default();
        let here = nudge_core::cnabu::AVAILABLE && nudge_core::cnabu::models_dir().is_some();
        assert_eq!(form.belief, if here { CNABU } else { CLASSICAL });
        assert_eq!(form.planner.counted, if here { Counted::Unseen } else { Counted::All });
        assert_eq!(form.planner, PlannerSettings::of_belief(&form.belief));
        let classical = form.with_belief(CLASSICAL);
        assert_eq!((classical.belief.as_str(), classical.planner), (CLASSICAL, PlannerSettings::default()));
    }
}
