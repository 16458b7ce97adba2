//! The window rendered without a display: the same [`App`], on software Vulkan or GL.

use super::app::{App, Options};
use super::command::Command;
use super::model::{LayoutKind, Picked};
use super::session::Session;
use egui_kittest::Harness;
use image::RgbImage;
use nudge_core::belief::{Belief, beta_mean};
use nudge_core::plan::Action;
use nudge_core::{Error, Result};
use re_viewer::external::egui;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// What shall be on the picture.
#[derive(Clone, Debug)]
pub struct Shot {
    /// A scene, or an episode's directory.
    pub open: PathBuf,
    /// A second episode, for the comparison.
    pub with: Option<PathBuf>,
    /// Number of actions after which it is shown; the last state unless told.
    pub step: Option<usize>,
    /// The layouts, one picture of each.
    pub layouts: Vec<LayoutKind>,
    /// Width and height, points.
    pub size: [u32; 2],
    /// Pixels per point.
    pub scale: f32,
    /// Light instead of dark.
    pub light: bool,
    /// The arm, so many seconds into the motion of the step before.
    pub arm_s: Option<f64>,
}

/// How long a picture may take to come to rest.
const PATIENCE: Duration = Duration::from_secs(300);
/// Frames after everything is done, so that what was logged is drawn and animations have ended.
const CALM_FRAMES: usize = 25;

/// Renders the window, once for every layout that is asked for. New episodes go to `out`, a folder of the caller's.
///
/// # Errors
/// When the file cannot be opened, or there is no graphics driver, not even a software one.
pub fn shoot(shot: &Shot, out: PathBuf) -> Result<Vec<(LayoutKind, RgbImage)>> {
    // A scene is opened in the editor if nothing but the editor shall be on the pictures; else it starts an episode.
    let first = shot.layouts.iter().copied().find(|layout| *layout != LayoutKind::Author);
    let layout = Some(first.unwrap_or(LayoutKind::Author));
    let options = Options { out, light: Some(shot.light), layout, look_only: true, ..Options::default() };
    let [width, height] = shot.size.map(|n| n as f32);
    let setup = re_viewer::native::eframe_options(None).wgpu_options.wgpu_setup;
    let mut harness = Harness::<App>::builder()
        .with_size(egui::vec2(width, height))
        .with_pixels_per_point(shot.scale)
        .wgpu_setup(setup)
        .build_eframe(|cc| App::new(cc, options));
    if let Some(reason) = harness.state().no_viewer() {
        return Err(Error::Usage(format!("no graphics driver for a picture: {reason}")));
    }
    open(&mut harness, &shot.open)?;
    let first = harness.state().model.shown;
    if let Some(with) = &shot.with {
        open(&mut harness, with)?;
        let second = harness.state().model.shown;
        if let Some(first) = first {
            harness.state_mut().ask(Command::Show(first));
        }
        harness.state_mut().ask(Command::CompareWith(second));
    }
    let mut pictures = Vec::with_capacity(shot.layouts.len());
    for &layout in &shot.layouts {
        lay_out(harness.state_mut(), layout);
        choose(harness.state_mut(), shot.step, layout);
        settle(&mut harness)?;
        if let Some(at_s) = shot.arm_s {
            let model = &mut harness.state_mut().model;
            let step = model.session().map(|session| (session.id, model.cursor.min(session.steps())));
            model.kept.display.robot = true;
            step.into_iter().for_each(|step| model.scrubbed.scrub(step, at_s));
        }
        explain(harness.state_mut(), layout);
        settle(&mut harness)?;
        let picture = harness.render().map_err(Error::Usage)?;
        pictures.push((layout, image::DynamicImage::ImageRgba8(picture).into_rgb8()));
    }
    Ok(pictures)
}

/// Shows a layout as if it were the first: nothing is chosen in it yet.
fn lay_out(app: &mut App, layout: LayoutKind) {
    let model = &mut app.model;
    (model.picked, model.view, model.candidate, model.preview) = (None, None, None, None);
    if layout == LayoutKind::Author && model.author.scene().objects.is_empty() {
        app.ask(Command::EditScene);
    }
    app.ask(Command::Layout(layout));
}

/// Opens a file and waits until it is there; what went wrong is the toast's text.
fn open(harness: &mut Harness<'_, App>, path: &std::path::Path) -> Result<()> {
    let before = harness.state().model.sessions.len();
    harness.state_mut().ask(Command::Open(path.to_owned()));
    settle(harness)?;
    let app = harness.state_mut();
    let edited = app.model.kept.layout == LayoutKind::Author && app.model.author.path().is_some();
    if app.model.sessions.len() > before || edited {
        return Ok(());
    }
    let said = app.model.toasts.shown().last().map(|toast| toast.text.clone());
    Err(Error::Usage(said.unwrap_or_else(|| format!("{}: could not be opened", path.display()))))
}

/// Runs frames until nothing is under way any more, and some more.
fn settle(harness: &mut Harness<'_, App>) -> Result<()> {
    let started = Instant::now();
    let mut calm = 0;
    while calm < CALM_FRAMES {
        if started.elapsed() > PATIENCE {
            return Err(Error::Usage("the window did not come to rest".to_owned()));
        }
        harness.step();
        calm = if harness.state().is_busy() { 0 } else { calm + 1 };
        std::thread::sleep(Duration::from_millis(15));
    }
    Ok(())
}

/// Moves the cursor; without a step to where the layout has most to show.
fn choose(app: &mut App, step: Option<usize>, layout: LayoutKind) {
    let Some(session) = app.model.session() else { return };
    let before_push = session.moments.iter().rev().find_map(|moment| {
        let pushed = matches!(moment.outcome.as_ref()?.record.action, Action::Manipulate(_));
        pushed.then(|| moment.step - 1)
    });
    // The last state of a finished episode has no decision to show; the one before it has. Of a recording of one frame that is
    // the prior, which shows nothing at all.
    let explains = matches!(layout, LayoutKind::Episode | LayoutKind::Gains | LayoutKind::Push);
    let least = if session.record.has_truth() { 0 } else { 1 };
    let last = session.steps() - usize::from(explains && session.is_finished() && session.steps() > least);
    let step = step.or(before_push.filter(|_| layout == LayoutKind::Push)).unwrap_or(last);
    let undecided = session.decision_after(step).is_none() && !session.is_finished() && session.read_only.is_none();
    app.ask(Command::GoTo(step));
    if undecided {
        app.ask(Command::Decide);
    }
}

/// The voxel with most to tell: one that a look and a push both changed, by the lesser of the two changes of its probability.
/// `None` where no push changed a voxel that looks had told of.
fn most_telling(session: &Session) -> Option<usize> {
    let mut before: Option<Belief> = None;
    // The largest change by a look, and by a push.
    let mut changes: Vec<[f32; 2]> = Vec::new();
    for moment in &session.moments {
        let belief = moment.belief.belief();
        if let (Some(before), Some(outcome)) = (&before, &moment.outcome) {
            let by = usize::from(matches!(outcome.record.action, Action::Manipulate(_)));
            let pairs = before.occupancy.iter().zip(&belief.occupancy);
            for (change, (a, b)) in changes.iter_mut().zip(pairs) {
                change[by] = change[by].max((beta_mean(*a) - beta_mean(*b)).abs());
            }
        } else {
            changes = vec![[0.0; 2]; belief.occupancy.len()];
        }
        before = Some(belief);
    }
    let lesser = |voxel: &usize| changes[*voxel][0].min(changes[*voxel][1]);
    let most = (0..changes.len()).max_by(|a, b| lesser(a).total_cmp(&lesser(b)))?;
    (lesser(&most) > 0.1).then_some(most)
}

/// Asks what the layout is there to answer.
fn explain(app: &mut App, layout: LayoutKind) {
    let Some(session) = app.model.session() else { return };
    let decision = session.decision_after(app.model.cursor).or_else(|| session.moment(app.model.cursor).decision());
    match layout {
        LayoutKind::Why => {
            if let Some(voxel) = most_telling(session) {
                return app.ask(Command::Pick(Some(Picked::Voxel(voxel))));
            }
            let entropy = app.model.derived().map(|derived| crate::picture::cell_entropy(&derived.belief));
            let most =
                entropy.and_then(|entropy| (0..entropy.len()).max_by(|&a, &b| entropy[a].total_cmp(&entropy[b])));
            app.ask(Command::Pick(most.map(Picked::Cell)));
        }
        LayoutKind::Gains => {
            if let Some(view) = decision.and_then(|decision| decision.pair.first().copied()) {
                app.ask(Command::GainOf(view));
            }
        }
        // The layout of pushes chooses one by itself.
        LayoutKind::Episode | LayoutKind::Push | LayoutKind::Compare | LayoutKind::Author => {}
    }
}
