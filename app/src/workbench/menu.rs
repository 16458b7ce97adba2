//! The menus: text, tooltip and shortcut of every entry, in one table.

use super::columns::Column;
use super::command::MenuCommand as M;
use super::model::{LayoutKind, Model};
use super::session::{Activity, Session};
use re_viewer::external::egui::{Key, KeyboardShortcut, Modifiers};

/// A menu with its entries; `None` is a line between them.
pub const MENUS: [(&str, &[Option<M>]); 5] = [
    (
        "File",
        &[
            Some(M::Scenes),
            Some(M::OpenScene),
            Some(M::OpenEpisode),
            None,
            Some(M::Save),
            Some(M::SaveSceneAs),
            None,
            Some(M::ExportEpisode),
            Some(M::ExportTables),
            Some(M::ExportPicture),
            Some(M::Share),
            None,
            Some(M::CloseEpisode),
            Some(M::Quit),
        ],
    ),
    ("Edit", &[Some(M::Undo), Some(M::Redo), None, Some(M::Duplicate), Some(M::Delete)]),
    (
        "View",
        &[
            Some(M::Layout(LayoutKind::Episode)),
            Some(M::Layout(LayoutKind::Why)),
            Some(M::Layout(LayoutKind::Gains)),
            Some(M::Layout(LayoutKind::Push)),
            Some(M::Layout(LayoutKind::Compare)),
            Some(M::Layout(LayoutKind::Author)),
            None,
            Some(M::Panel(Column::Episode)),
            Some(M::Panel(Column::Maps)),
            Some(M::Panel(Column::Curves)),
            Some(M::Panel(Column::Right)),
            None,
            Some(M::ToggleTheme),
            Some(M::ZoomIn),
            Some(M::ZoomOut),
            Some(M::ResetLayout),
        ],
    ),
    (
        "Episode",
        &[
            Some(M::Decide),
            Some(M::DoIt),
            Some(M::Run),
            Some(M::RunBoth),
            Some(M::Pause),
            Some(M::Cancel),
            None,
            Some(M::First),
            Some(M::StepBack),
            Some(M::StepForward),
            Some(M::Last),
            None,
            Some(M::Branch),
            Some(M::EditScene),
        ],
    ),
    ("Help", &[Some(M::Tour), Some(M::Shortcuts), Some(M::About)]),
];

impl M {
    /// All entries, in the order of the menus.
    pub fn all() -> impl Iterator<Item = Self> {
        MENUS.iter().flat_map(|(_, entries)| entries.iter().flatten().copied())
    }

    /// The entry's text; an ellipsis where more is asked for.
    pub fn title(self) -> &'static str {
        match self {
            M::Scenes => "New episode…",
            M::OpenScene => "Open scene…",
            M::OpenEpisode => "Open episode…",
            M::Save => "Save",
            M::SaveSceneAs => "Save scene as…",
            M::ExportEpisode => "Export episode…",
            M::ExportTables => "Export tables…",
            M::ExportPicture => "Export picture…",
            M::Share => "Share as a page…",
            M::CloseEpisode => "Close episode",
            M::Quit => "Quit",
            M::Undo => "Undo",
            M::Redo => "Redo",
            M::Duplicate => "Duplicate object",
            M::Delete => "Delete object",
            M::StepBack => "Step back",
            M::StepForward => "Step forward",
            M::First => "First step",
            M::Last => "Last step",
            M::Decide => "Decide",
            M::DoIt => "Do it",
            M::Run => "Run",
            M::RunBoth => "Run both",
            M::Pause => "Pause",
            M::Cancel => "Cancel",
            M::Branch => "Branch from here",
            M::EditScene => "Edit a copy of the scene",
            M::Layout(layout) => layout.title(),
            M::Panel(column) => column.title(),
            M::ToggleTheme => "Light or dark",
            M::ZoomIn => "Zoom in",
            M::ZoomOut => "Zoom out",
            M::ResetLayout => "Reset layout",
            M::Tour => "Tour",
            M::Shortcuts => "Keyboard shortcuts",
            M::About => "About Nudge",
        }
    }

    /// What it does, in a sentence.
    pub fn tooltip(self) -> &'static str {
        match self {
            M::Scenes => "Show the scenes, to start an episode of one of them",
            M::OpenScene => "Choose a scene file (.toml) to start an episode of; in the editor, to edit",
            M::OpenEpisode => "Choose an episode's directory, to look at or to resume",
            M::Save => "Write notes and verdicts beside the episode, or the scene that is being authored",
            M::SaveSceneAs => "Write the scene that is being authored to another file",
            M::ExportEpisode => "Write the episode with its notes as one directory and one self-contained recording",
            M::ExportTables => "Write scores, decisions and verdicts as CSV",
            M::ExportPicture => "Write the window, or a part of it, as a PNG",
            M::Share => "Write the episode, or the two that are compared, as one HTML page that opens in any browser",
            M::CloseEpisode => "Close the episode that is shown; its directory stays",
            M::Quit => "End the program; asks first if notes or a scene are not saved",
            M::Undo => "Take the last change of the scene back",
            M::Redo => "Make the change again",
            M::Duplicate => "Put a copy of the chosen object beside it",
            M::Delete => "Take the chosen object away",
            M::StepBack => "Show the state one action earlier (also ←)",
            M::StepForward => "Show the state one action later (also →)",
            M::First => "Show the state before the first action",
            M::Last => "Show the latest state",
            M::Decide => "Ask the policy what it would do next, and show what it weighed",
            M::DoIt => "Do what was decided; decides first if nothing was",
            M::Run => "Decide and act until the budget is used up",
            M::RunBoth => "Run both episodes of the comparison until their budgets are used up",
            M::Pause => "Stop after the action that is under way; Run resumes",
            M::Cancel => "Stop now: what is being decided is not done, an action under way is finished",
            M::Branch => "Start an episode that shares the actions up to the cursor; both stay open",
            M::EditScene => "Open a copy of this episode's scene in Author",
            M::Layout(layout) => layout.tooltip(),
            M::Panel(column) => column.tooltip(),
            M::ToggleTheme => "Switch between the light and the dark theme",
            M::ZoomIn => "Larger text and controls",
            M::ZoomOut => "Smaller text and controls",
            M::ResetLayout => "Panels open and wide as at the first start",
            M::Tour => "Five things to know of this window",
            M::Shortcuts => "Every command that has a key",
            M::About => "Versions and licences",
        }
    }

    /// Its keys.
    pub fn shortcut(self) -> Option<KeyboardShortcut> {
        let command = |key| Some(KeyboardShortcut::new(Modifiers::COMMAND, key));
        let shifted = |key| Some(KeyboardShortcut::new(Modifiers::COMMAND | Modifiers::SHIFT, key));
        let plain = |key| Some(KeyboardShortcut::new(Modifiers::NONE, key));
        match self {
            M::Scenes => command(Key::N),
            M::OpenScene => command(Key::O),
            M::OpenEpisode => shifted(Key::O),
            M::Save => command(Key::S),
            M::SaveSceneAs => shifted(Key::S),
            M::ExportEpisode => command(Key::E),
            M::ExportTables => shifted(Key::E),
            M::ExportPicture => shifted(Key::P),
            M::CloseEpisode => command(Key::W),
            M::Quit => command(Key::Q),
            M::Undo => command(Key::Z),
            M::Redo => shifted(Key::Z),
            M::Duplicate => command(Key::D),
            M::Delete => plain(Key::Delete),
            M::StepBack => plain(Key::Comma),
            M::StepForward => plain(Key::Period),
            M::First => plain(Key::Home),
            M::Last => plain(Key::End),
            M::Decide => plain(Key::D),
            M::DoIt => plain(Key::Enter),
            M::Run => command(Key::R),
            M::RunBoth => shifted(Key::R),
            M::Pause => plain(Key::P),
            M::Cancel => plain(Key::Escape),
            M::Branch => command(Key::B),
            M::Layout(layout) => command(
                [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6]
                    [LayoutKind::ALL.iter().position(|other| *other == layout).unwrap_or(0)],
            ),
            M::ToggleTheme => command(Key::L),
            M::ZoomIn => command(Key::Plus),
            M::ZoomOut => command(Key::Minus),
            M::Shortcuts => plain(Key::F1),
            M::EditScene => shifted(Key::D),
            M::Panel(_) | M::ResetLayout | M::Tour | M::About | M::Share => None,
        }
    }

    /// Whether it can be done now: what is about an episode, only while one is in sight.
    pub fn is_available(self, model: &Model) -> bool {
        let session = model.session().filter(|_| model.shows_episode());
        let orders = session.is_some_and(Session::takes_orders);
        let authoring = model.kept.layout == LayoutKind::Author;
        match self {
            M::Save => authoring || model.session().is_some_and(|session| session.unsaved),
            M::SaveSceneAs | M::Undo | M::Redo | M::Duplicate | M::Delete => authoring,
            M::ExportEpisode | M::ExportTables | M::Share | M::CloseEpisode => session.is_some(),
            M::StepBack | M::First => session.is_some() && model.cursor > 0,
            M::StepForward | M::Last => session.is_some() && model.cursor < model.last_step(),
            M::Decide | M::DoIt | M::Run => orders,
            M::RunBoth => {
                let other = model.other_session().filter(|_| session.is_some());
                other.is_some_and(|other| other.takes_orders() || orders)
            }
            M::Pause => {
                session.is_some() && model.runs_any(|session| session.activity == Activity::Running && !session.pausing)
            }
            M::Cancel => session.is_some() && model.runs_any(Session::can_be_cancelled),
            M::Branch | M::Tour | M::Panel(_) => session.is_some(),
            M::EditScene => model.session().is_some(),
            _ => true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workbench::fixture;
    use std::collections::BTreeSet;

    #[test]
    fn no_two_entries_share_a_key_or_a_name() {
        let keys: Vec<_> = M::all().filter_map(M::shortcut).collect();
        for (at, key) in keys.iter().enumerate() {
            assert!(!keys[..at].contains(key), "{key:?} is taken twice");
        }
        let titles: BTreeSet<&str> = M::all().map(M::title).collect();
        assert_eq!(titles.len(), M::all().count());
    }

    #[test]
    fn without_an_episode_only_what_needs_none_can_be_done() {
        let model = Model::default();
        for entry in [M::Decide, M::DoIt, M::Run, M::Cancel, M::Branch, M::ExportEpisode, M::StepBack] {
            assert!(!entry.is_available(&model), "{entry:?}");
        }
        assert!(M::OpenScene.is_available(&model) && M::Quit.is_available(&model));
    }

    #[test]
    fn an_episode_that_is_out_of_sight_takes_no_orders() {
        let mut model = fixture::model();
        model.cursor = 3;
        let about_it = [M::Decide, M::DoIt, M::Run, M::Branch, M::CloseEpisode, M::StepBack, M::StepForward, M::First];
        let available = |model: &Model| about_it.into_iter().filter(|entry| entry.is_available(model)).count();
        assert_eq!(available(&model), about_it.len());
        model.browsing = true;
        assert_eq!(available(&model), 0, "behind the scenes to choose from");
        model.browsing = false;
        model.recording = Some("a.rrd".into());
        assert_eq!(available(&model), 0, "behind a recording");
        model.recording = None;
        model.kept.layout = LayoutKind::Author;
        assert_eq!(available(&model), 0, "behind the editor");
    }
}
