//! An episode's events as Rerun entities.
//!
//! The recorder writes step by step on the timeline `step`: 0 is the prior, `n` is the state after the `n`-th action
//! together with the decision that led to it. A file is flushed after every step, so that a run that was killed leaves
//! a recording that opens. The layout is inside the file. Wall-clock timelines are off, so that two runs of the same
//! episode give recordings with the same content. A second timeline, `robot`, is the robot's own clock: along it the arm
//! moves pose by pose.
//!
//! Entity names are in [`paths`] and nowhere else.

pub(crate) mod blueprint;
mod continued;
pub(crate) mod decision;
mod disk;
pub(crate) mod eye;
mod floor;
mod gain;
pub(crate) mod layout;
pub mod paths;
mod remarks;
pub(crate) mod robot;
pub(crate) mod shapes;
#[cfg(feature = "cnabu")]
pub mod training;
pub(crate) mod voxels;

pub(crate) use decision::mishaps;

use crate::picture;
use crate::verdicts::Judged;
use disk::{Disk, Fault};
use nudge_core::arm::ArmTool;
use nudge_core::belief::{Belief, Prediction};
use nudge_core::camera::{Frame, ViewArray, ViewId};
use nudge_core::episode::{Episode, EpisodeRecord, NO_TRUTH, StepOutcome, StepRecord};
use nudge_core::grid::{Grid, VoxelSet};
use nudge_core::plan::{self, Action, PlannerSettings};
use nudge_core::scene::{Body, Catalog, ObjectId, Shelf};
use nudge_core::score::Scores;
use nudge_core::world::TruthMap;
use nudge_core::{Error, Pose, Result};
use rerun::{AsComponents, EntityPath, RecordingStream, RecordingStreamBuilder};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The application id of every recording; the viewer keeps one layout per application.
pub const APPLICATION: &str = "nudge";
/// File of the recording in an episode's directory.
pub const RECORDING: &str = "episode.rrd";

/// What does not change during an episode.
#[derive(Clone, Copy)]
pub struct Setting<'a> {
    /// The shelf.
    pub shelf: &'a Shelf,
    /// Names and colours of the classes.
    pub catalog: &'a Catalog,
    /// The candidate views.
    pub views: &'a ViewArray,
    /// Number of actions in all.
    pub budget: usize,
    /// The planner's numbers.
    pub planner: &'a PlannerSettings,
    /// The arm before the shelf, where there is one to show.
    pub arm: &'a ArmTool,
    /// Views that its hand cannot be at.
    pub unreachable: &'a [ViewId],
}

/// The state after a step.
#[derive(Clone, Copy)]
pub struct State<'a> {
    /// Number of actions so far.
    pub step: usize,
    /// The bodies where they are.
    pub bodies: &'a [Body],
    /// What is believed.
    pub belief: &'a Belief,
    /// Voxels that looks have seen and that no push has probably changed since.
    pub seen: &'a VoxelSet,
    /// What is, if that is known.
    pub truth: Option<&'a TruthMap>,
    /// How they compare, if that is known.
    pub scores: Option<&'a Scores>,
    /// Entropy of what is believed, nats.
    pub entropy_nats: f64,
}

/// Writes an episode into a recording.
pub struct Recorder {
    stream: RecordingStream,
    /// Put before every entity path; empty unless two episodes share a recording.
    root: EntityPath,
    /// The file, for messages.
    file: PathBuf,
    /// What is wrong with the file.
    fault: Fault,
    /// What can be gained in the next step.
    gain: Option<plan::Gain>,
    /// Objects with a mesh in the recording that have not been cleared.
    shown: BTreeMap<ObjectId, Pose>,
    /// The truth that was last recorded.
    truth: Option<TruthMap>,
    /// What the robot's clock shows, seconds.
    robot_s: f64,
}

impl Recorder {
    /// Starts `path` (an `.rrd` file, overwritten) with the layout and everything that does not change.
    pub fn create(path: &Path, episode: &Episode) -> Result<Self> {
        Self::begin(path, &title(episode.record()), &setting(episode))
    }

    /// Goes on with the recording `old` of a run that was stopped, in the file `path` (overwritten): what it holds is copied.
    /// `None` for a recording that does not hold every step of the episode.
    pub fn go_on(path: &Path, old: &Path, episode: &Episode) -> Result<Option<Self>> {
        let fault = Fault::default();
        let disk = Disk::create(path, fault.clone()).map_err(|error| Error::io(path, error))?;
        let steps = episode.record().steps.len();
        let Some(store) = continued::copy(old, &disk, steps) else { return Ok(None) };
        let stream = stream_into(disk, path, RecordingStreamBuilder::from_store_id(&store))?;
        let mut recorder = Self::bare(stream, "", path, fault);
        let counted = episode.record().config.planner.counted;
        recorder.gain = Some(plan::Gain::new(counted, episode.belief(), episode.seen()));
        recorder.shown = episode.bodies().iter().map(|body| (body.id, body.world_from_body)).collect();
        recorder.truth = episode.truth().cloned();
        recorder.robot_s = episode.record().steps.iter().map(|step| step.motion_s).sum();
        recorder.flush()?;
        Ok(Some(recorder))
    }

    /// Starts one for an episode of which only the states are at hand: [`Recorder::record`] writes them one by one.
    pub fn begin(path: &Path, name: &str, setting: &Setting<'_>) -> Result<Self> {
        let (stream, fault) = file_stream(path, name)?;
        let recorder = Self::bare(stream, "", path, fault);
        let plan = picture::FloorPlan::of(&setting.shelf.grid());
        recorder.check(layout::standard("", plan).send(&recorder.stream, APPLICATION))?;
        recorder.set_up(setting)?;
        Ok(recorder)
    }

    /// Writes into a stream of the caller's, under `root` (`""`, or for example `"b"` for the second episode of a
    /// comparison), without a layout. Wall-clock timelines of the stream are switched off.
    pub fn to_stream(stream: RecordingStream, root: &str, episode: &Episode) -> Result<Self> {
        let recorder = Self::bare(stream, root, Path::new("recording"), Fault::default());
        recorder.set_up(&setting(episode))?;
        Ok(recorder)
    }

    fn bare(stream: RecordingStream, root: &str, file: &Path, fault: Fault) -> Self {
        stream.set_log_time_enabled(false);
        stream.set_log_tick_enabled(false);
        Self {
            stream,
            root: EntityPath::parse_forgiving(root),
            file: file.to_owned(),
            fault,
            gain: None,
            shown: BTreeMap::new(),
            truth: None,
            robot_s: 0.0,
        }
    }

    /// Records the state before the first step.
    pub fn prior(&mut self, episode: &Episode) -> Result<()> {
        let bodies = episode.bodies();
        self.record(&setting(episode), &state(episode, &bodies), None)?;
        self.remark(None, &[])
    }

    /// Records a step: what was weighed, what was done, and the state after it.
    pub fn step(&mut self, episode: &Episode, outcome: &StepOutcome) -> Result<()> {
        let bodies = episode.bodies();
        self.record(&setting(episode), &state(episode, &bodies), Some(outcome))?;
        self.remark(None, &Judged::by_scorer(outcome.record.objects()))
    }

    /// Records a state with what led to it: without an outcome the prior. States come in the order of their steps.
    pub fn record(&mut self, setting: &Setting<'_>, state: &State<'_>, outcome: Option<&StepOutcome>) -> Result<()> {
        let gain = outcome.zip(self.gain.as_ref()).and_then(|(outcome, gain)| gain::of(setting, gain, outcome));
        let predicted = outcome.and_then(|outcome| outcome.prediction.as_ref());
        let changed = self.truth.as_ref().zip(state.truth).map(|(before, after)| before.changed_cells(after));
        let surprise =
            predicted.zip(changed).map(|(predicted, changed)| predicted.surprise(&state.belief.grid, &changed));
        self.robot(setting, state.step, outcome)?;
        self.state(setting, state)?;
        let surprise = surprise.map(|surprise| floor::picture(&picture::paint_surprise(&state.belief.grid, &surprise)));
        self.log_or_clear(paths::PREDICTED_SURPRISE, surprise)?;
        match outcome {
            Some(outcome) => self.outcome(setting, state.belief, outcome, gain.as_ref())?,
            None => {
                let line = format!("prior: {}", decision::scores_line(state.scores, state.entropy_nats));
                self.note(line, rerun::TextLogLevel::INFO)?;
                if state.truth.is_none() {
                    self.note(NO_TRUTH.to_owned(), rerun::TextLogLevel::INFO)?;
                }
            }
        }
        self.gain = Some(plan::Gain::new(setting.planner.counted, state.belief, state.seen));
        self.flush()
    }

    /// Records what is said about the state that was recorded last: a person's note, and the verdicts on its objects.
    pub fn remark(&self, note: Option<&str>, verdicts: &[Judged]) -> Result<()> {
        self.log(paths::NOTES, &rerun::TextDocument::from_markdown(remarks::note_page(note)))?;
        self.log(paths::VERDICTS, &rerun::TextDocument::from_markdown(remarks::verdict_page(verdicts)))?;
        self.flush()
    }

    /// Ends the recording; a file gets its index.
    pub fn finish(self) -> Result<()> {
        self.flush()?;
        // The file goes with its sink, after it has got its index; the flush waits for that.
        self.stream.disconnect();
        self.flush()
    }

    /// Gives the file another name, in the same folder; what is there is replaced, and recording goes on.
    pub fn move_to(&mut self, path: &Path) -> Result<()> {
        std::fs::rename(&self.file, path).map_err(|error| Error::io(path, error))?;
        self.file = path.to_owned();
        Ok(())
    }

    fn set_up(&self, setting: &Setting<'_>) -> Result<()> {
        let view_up = rerun::ViewCoordinates::RIGHT_HAND_Z_UP();
        self.check(self.stream.log_static(self.root.clone(), &view_up))?;
        self.check(self.stream.log_static(self.root.clone(), &floor::class_names(setting.catalog)))?;
        self.fix(paths::SHELF, &shapes::shelf_panels(setting.shelf))?;
        self.fix(paths::SHELF_EDGES, &shapes::shelf_edges(setting.shelf))?;
        self.fix(paths::CAMERA_VIEWS, &shapes::view_frusta(setting.views))?;
        self.fix(paths::CAMERA_REACH, &robot::reachable(setting.views, setting.unreachable))?;
        for (number, parts) in setting.arm.arm.bodies.iter().enumerate() {
            if let Some(mesh) = robot::body(parts) {
                self.fix(&paths::robot_body(number), &mesh)?;
            }
        }
        let grid = setting.shelf.grid();
        for (path, legend) in floor::legends(&grid) {
            self.fix(&format!("{path}/{}", paths::SCALE), &legend.bar)?;
            self.fix(&format!("{path}/{}", paths::SCALE_LABELS), &legend.labels)?;
        }
        let legend = floor::ClassLegend::new(setting.catalog);
        self.fix(paths::CLASS_LEGEND, &legend.colors)?;
        self.fix(paths::CLASS_LEGEND_NAMES, &legend.names)?;
        for series in decision::SERIES {
            let line = rerun::SeriesLines::new()
                .with_names([series.title])
                .with_colors([rerun::Color::from(series.rgb)])
                .with_widths([2.0_f32]);
            self.fix(&paths::score(series.key), &line)?;
        }
        let pushes = rerun::SeriesPoints::new()
            .with_names(["push"])
            .with_colors([rerun::Color::from([240, 240, 240])])
            .with_markers([rerun::components::MarkerShape::Up])
            .with_marker_sizes([5.0_f32]);
        self.fix(&paths::score(paths::SCORE_PUSH), &pushes)
    }

    /// Records bodies, belief, truth, error and scores.
    fn state(&mut self, setting: &Setting<'_>, state: &State<'_>) -> Result<()> {
        self.stream.set_time_sequence(paths::TIMELINE, state.step as i64);
        if state.step == 0 {
            self.log(paths::CAMERA_VIEWS, &shapes::frusta_without_gain(setting.views))?;
        }
        self.bodies(setting, state.bodies)?;
        let (grid, belief) = (&state.belief.grid, state.belief);
        self.log(paths::BELIEF_OCCUPANCY, &voxels::believed_occupied(belief))?;
        self.log(paths::BELIEF_CLASSES, &voxels::believed_classes(belief, setting.catalog))?;
        self.log(paths::BELIEF_OPEN, &voxels::undecided(belief))?;
        self.log(paths::BELIEF_SEMANTICS, &floor::classes(belief))?;
        self.log(paths::BELIEF_CERTAINTY, &floor::certainty(belief))?;
        self.log(paths::BELIEF_ENTROPY, &floor::picture(&picture::paint_entropy(belief)))?;
        if let Some(truth) = state.truth {
            if self.truth.as_ref() != Some(truth) {
                self.log(paths::TRUTH_OCCUPANCY, &voxels::true_classes(grid, truth, setting.catalog))?;
                self.log(paths::TRUTH_LABELS, &floor::labels(grid, &truth.labels))?;
                self.log(paths::TRUTH_OUTLINES, &floor::outlines(truth))?;
                self.truth = Some(truth.clone());
            }
            self.log(paths::ERROR_OCCUPANCY, &voxels::errors(belief, truth))?;
            self.log(paths::ERROR_SEMANTICS, &floor::picture(&picture::paint_errors(belief, truth)))?;
        }
        for series in decision::SERIES {
            if let Some(value) = series.at(state.scores, state.entropy_nats) {
                self.log(&paths::score(series.key), &rerun::Scalars::single(value))?;
            }
        }
        Ok(())
    }

    fn bodies(&mut self, setting: &Setting<'_>, bodies: &[Body]) -> Result<()> {
        let present: BTreeMap<ObjectId, Pose> = bodies.iter().map(|body| (body.id, body.world_from_body)).collect();
        for gone in self.shown.keys().filter(|id| !present.contains_key(id)) {
            self.log(&paths::object(*gone), &rerun::Clear::recursive())?;
        }
        for body in bodies {
            let path = paths::object(body.id);
            if !self.shown.contains_key(&body.id) {
                self.log(&path, &shapes::glass(body, setting.catalog))?;
            }
            self.log(&path, &shapes::transform(&body.world_from_body))?;
        }
        self.shown = present;
        Ok(())
    }

    /// Records the decision of a step and what the action brought; what no longer applies is cleared.
    fn outcome(
        &self,
        setting: &Setting<'_>,
        belief: &Belief,
        outcome: &StepOutcome,
        gain: Option<&gain::Gain>,
    ) -> Result<()> {
        let (record, grid) = (&outcome.record, &belief.grid);
        let decision = &record.decision;
        let range = shapes::gain_range(decision);
        self.log(paths::CAMERA_VIEWS, &shapes::frusta_colors(&decision.gains, range))?;
        self.log(paths::GAIN_VIEWS, &floor::gain_map(setting.views, &decision.gains, range))?;
        self.log(paths::GAIN_CHOSEN, &floor::chosen_views(setting.views, decision))?;
        self.log_or_clear(paths::GAIN_VOXELS, gain.map(|gain| voxels::gains(grid, &gain.nats)))?;
        self.log_or_clear(paths::GAIN_LABEL, gain.map(|gain| gain.label(setting.shelf)))?;
        let any = !decision.candidates.is_empty();
        self.log_or_clear(paths::PUSH_CANDIDATES, any.then(|| shapes::candidates(decision)))?;
        match &outcome.frame {
            Some(frame) => self.look(frame)?,
            None => {
                for path in [paths::CAMERA_CURRENT, paths::OBSERVATION_DEPTH, paths::OBSERVATION_LABELS] {
                    self.log(path, &rerun::Clear::flat())?;
                }
            }
        }
        let done = match &record.action {
            Action::Manipulate(manipulation) => Some(manipulation),
            Action::Look { .. } => None,
        };
        self.log_or_clear(paths::PUSH_CHOSEN, done.map(shapes::chosen))?;
        let with_lines = done.filter(|done| !done.outline().lines.is_empty());
        self.log_or_clear(paths::PUSH_LINES, with_lines.map(|done| shapes::chosen_lines(Some(done))))?;
        let told = outcome.swept.as_ref();
        self.log_or_clear(paths::PUSH_SWEPT, told.map(|told| voxels::swept(grid, &told.swept)))?;
        self.predicted(grid, outcome.prediction.as_ref())?;
        let pushed = matches!(record.action, Action::Manipulate(_));
        let mark = rerun::Scalars::single(0.0);
        self.log_or_clear(&paths::score(paths::SCORE_PUSH), pushed.then_some(mark))?;
        self.log(paths::DECISION, &rerun::TextDocument::from_markdown(decision::markdown(setting, record)))?;
        self.note(decision::line(record), rerun::TextLogLevel::INFO)?;
        self.warn(record)
    }

    fn look(&self, frame: &Frame) -> Result<()> {
        self.log(paths::CAMERA_CURRENT, &shapes::transform(frame.world_from_camera()))?;
        self.log(paths::CAMERA_CURRENT, &shapes::pinhole(frame.intrinsics()))?;
        self.log(paths::OBSERVATION_DEPTH, &shapes::depth_image(frame))?;
        self.log(paths::OBSERVATION_LABELS, &shapes::label_image(frame))
    }

    fn predicted(&self, grid: &Grid, prediction: Option<&Prediction>) -> Result<()> {
        let at = [paths::PREDICTED_OCCUPANCY, paths::PREDICTED_SEMANTICS, paths::PREDICTED_CHANGE];
        let Some(prediction) = prediction else {
            return at.iter().try_for_each(|path| self.log(path, &rerun::Clear::flat()));
        };
        self.log(at[0], &voxels::predicted(grid, prediction))?;
        self.log(at[1], &floor::predicted_classes(grid, prediction))?;
        self.log(at[2], &floor::predicted_change(grid, prediction))
    }

    fn warn(&self, record: &StepRecord) -> Result<()> {
        decision::mishaps(record)
            .into_iter()
            .try_for_each(|words| self.note(format!("step {}: {words}", record.index), rerun::TextLogLevel::WARN))
    }

    fn note(&self, text: String, level: &str) -> Result<()> {
        self.log(paths::LOG, &rerun::TextLog::new(text).with_level(level))
    }

    fn at(&self, path: &str) -> EntityPath {
        self.root.join(&EntityPath::parse_forgiving(path))
    }

    fn log(&self, path: &str, content: &impl AsComponents) -> Result<()> {
        self.check(self.stream.log(self.at(path), content))
    }

    fn log_or_clear(&self, path: &str, content: Option<impl AsComponents>) -> Result<()> {
        match content {
            Some(content) => self.log(path, &content),
            None => self.log(path, &rerun::Clear::flat()),
        }
    }

    fn fix(&self, path: &str, content: &impl AsComponents) -> Result<()> {
        self.check(self.stream.log_static(self.at(path), content))
    }

    fn flush(&self) -> Result<()> {
        let flushed = self.stream.flush_blocking();
        // First what the system said.
        match self.fault.error() {
            Some(error) => Err(Error::io(&self.file, error)),
            None => self.check(flushed),
        }
    }

    fn check<T>(&self, result: std::result::Result<T, impl std::fmt::Display>) -> Result<T> {
        result.map_err(|error| Error::input(&self.file, "", format!("the recording cannot be written ({error})")))
    }
}

/// How a recording is named: `tunnel seed 3`.
pub fn title(record: &EpisodeRecord) -> String {
    format!("{} seed {}", record.scene.name, record.config.seed)
}

/// A stream into a file of its own, and what will be wrong with that.
fn file_stream(path: &Path, name: &str) -> Result<(RecordingStream, Fault)> {
    let fault = Fault::default();
    let disk = Disk::create(path, fault.clone()).map_err(|error| Error::io(path, error))?;
    let stream = stream_into(disk, path, RecordingStreamBuilder::new(APPLICATION))?;
    stream.send_recording_name(name).map_err(|error| Error::io(path, std::io::Error::other(error.to_string())))?;
    Ok((stream, fault))
}

/// A stream into a file that has been begun.
fn stream_into(disk: Disk, path: &Path, builder: RecordingStreamBuilder) -> Result<RecordingStream> {
    let (_, store, properties, batches, hooks, _) = builder.send_properties(false).into_args();
    let stream = RecordingStream::new(store, properties, batches, hooks, Box::new(disk));
    stream.map_err(|error| Error::io(path, std::io::Error::other(error.to_string())))
}

fn setting(episode: &Episode) -> Setting<'_> {
    let record = episode.record();
    Setting {
        shelf: &record.scene.shelf,
        catalog: episode.catalog(),
        views: episode.views(),
        budget: record.config.budget,
        planner: &record.config.planner,
        arm: episode.arm(),
        unreachable: episode.unreachable_views(),
    }
}

fn state<'a>(episode: &'a Episode, bodies: &'a [Body]) -> State<'a> {
    let record = episode.record();
    State {
        step: record.steps.len(),
        bodies,
        belief: episode.belief(),
        seen: episode.seen(),
        truth: episode.truth(),
        scores: record.scores_after(record.steps.len()),
        entropy_nats: record.entropy_after(record.steps.len()),
    }
}

#[cfg(test)]
mod tests;
