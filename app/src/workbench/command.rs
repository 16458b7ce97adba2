//! Everything that a person can ask of the window, in one table: menus, shortcuts, buttons and tests use the same.

use super::columns::Column;
use super::model::{LayoutKind, Picked};
use super::session::SessionId;
pub use super::toasts::Level;
use nudge_core::plan::{Action, Decision};
use nudge_core::score::Verdict;
use nudge_core::skill::Manipulation;
use std::path::PathBuf;
use std::sync::Arc;

/// Something to do, with what it needs. Panels return these; [`super::app`] carries them out.
#[derive(Clone, Debug)]
pub enum Command {
    /// Does what a menu entry or a shortcut stands for.
    Menu(MenuCommand),
    /// Opens a scene, an episode's directory or a recording.
    Open(PathBuf),
    /// Starts an episode of the chosen scene with the chosen policy, seed and budget; two that run side by side where a
    /// second policy is chosen.
    Start,
    /// Shows another open episode.
    Show(SessionId),
    /// Closes an open episode; its directory stays.
    Close(SessionId),
    /// Chooses the second episode of a comparison.
    CompareWith(Option<SessionId>),
    /// Moves the time cursor.
    GoTo(usize),
    /// Shows another layout.
    Layout(LayoutKind),
    /// Asks the policy what it would do.
    Decide,
    /// Does what is pending; asks first if nothing is.
    DoIt,
    /// Does something else than the policy would.
    DoInstead(Action),
    /// Decides and acts until the budget is used up.
    Run,
    /// Runs both episodes of the comparison.
    RunBoth,
    /// Stops a run after the action that it is at.
    Pause,
    /// Stops a run without doing what it decides just now, or an opening.
    Cancel,
    /// Stops the opening of one episode.
    CancelOpening(SessionId),
    /// Stops an export or another task, by its position.
    CancelTask(usize),
    /// Starts an episode that shares the steps up to the cursor.
    Branch,
    /// Asks what a push would do to the belief at the cursor.
    Preview(Manipulation),
    /// Asks where a view's gain under the belief at the cursor comes from.
    GainOf(nudge_core::camera::ViewId),
    /// Asks about a voxel or a floor cell.
    Pick(Option<Picked>),
    /// Writes a note on the state at a step; an empty one goes.
    Note(usize, String),
    /// Overrules the scorer's verdict on an object at a step, or takes that back.
    Overrule(usize, String, Option<Verdict>),
    /// Goes back from a foreign recording to the episode.
    CloseRecording,
    /// Starts an episode of the scene that is being authored.
    TryScene,
    /// Opens a copy of the shown episode's scene in the editor.
    EditScene,
    /// Shows the scenes to choose from, or goes back from them.
    Browse(bool),
    /// Tells of something, as a toast.
    Tell(Level, String),
    /// A decision that a test or a script made.
    Act(Arc<Decision>),
}

/// The entries of the menus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MenuCommand {
    /// Shows the scenes to choose from.
    Scenes,
    /// Opens a scene by the system's dialog.
    OpenScene,
    /// Opens an episode's directory by the system's dialog.
    OpenEpisode,
    /// Writes notes and verdicts beside the episode, or the scene that is being authored.
    Save,
    /// Writes the scene that is being authored under another name.
    SaveSceneAs,
    /// Exports the episode with its notes and one self-contained recording.
    ExportEpisode,
    /// Exports scores, decisions and verdicts as CSV.
    ExportTables,
    /// Exports the window as a picture.
    ExportPicture,
    /// Writes the episode, or the two that are compared, as one page.
    Share,
    /// Closes the episode that is shown.
    CloseEpisode,
    /// Ends the program.
    Quit,
    /// Takes the last change of the authored scene back.
    Undo,
    /// Does it again.
    Redo,
    /// Duplicates the chosen object of the authored scene.
    Duplicate,
    /// Deletes the chosen object of the authored scene.
    Delete,
    /// One step back.
    StepBack,
    /// One step on.
    StepForward,
    /// To the prior.
    First,
    /// To the last state.
    Last,
    /// Asks the policy.
    Decide,
    /// Does what is pending.
    DoIt,
    /// Runs to the budget.
    Run,
    /// Stops after the action that is under way.
    Pause,
    /// Stops.
    Cancel,
    /// Runs both episodes of the comparison.
    RunBoth,
    /// Branches at the cursor.
    Branch,
    /// Edits a copy of the scene.
    EditScene,
    /// The layouts, in the order of their tabs.
    Layout(LayoutKind),
    /// A panel that is shown or folded.
    Panel(Column),
    /// Light or dark.
    ToggleTheme,
    /// Larger text.
    ZoomIn,
    /// Smaller text.
    ZoomOut,
    /// The panels' sizes as at the first start.
    ResetLayout,
    /// Five things to know of the window.
    Tour,
    /// The table of shortcuts.
    Shortcuts,
    /// Versions and licences.
    About,
}
