//! What is read and written: scenes, episodes and recordings that are opened, notes and scenes that are saved, exports.

use super::{App, Chosen, ChosenFor, Opening};
use crate::annotations;
use crate::share::{self, Source};
use crate::workbench::command::{Command, Level, MenuCommand};
use crate::workbench::dialog::Dialog;
use crate::workbench::export;
use crate::workbench::file_kind::FileKind;
use crate::workbench::model::LayoutKind;
use crate::workbench::part::Part;
use crate::workbench::recording_file::{self, Ending};
use crate::workbench::session::{Session, SessionId};
use crate::workbench::threads;
use crate::workbench::worker::Begin;
use re_viewer::external::egui;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A file dialog that ends sooner, without a choice, was none.
const TOO_FAST: Duration = Duration::from_millis(300);
/// How many paths are remembered.
const RECENT: usize = 12;

impl App {
    /// Opens a scene, an episode's directory or a recording; what it is none of becomes a message.
    pub(super) fn open(&mut self, path: &Path) {
        match FileKind::of(path) {
            FileKind::Scene => {
                let opened =
                    if self.model.kept.layout == LayoutKind::Author { self.edit(path) } else { self.start(path, None) };
                if opened {
                    self.remember(path);
                }
            }
            FileKind::Recording => self.open_recording(path),
            FileKind::Other => {
                let directory = if path.is_file() { path.parent().unwrap_or(path) } else { path };
                if directory.join("episode.json").is_file() {
                    self.open_episode(directory);
                } else {
                    let message = "is neither a scene (.toml), nor an episode's directory, nor a recording (.rrd)";
                    self.tell(Level::Error, format!("{}: {message}", path.display()));
                }
            }
        }
    }

    fn open_recording(&mut self, path: &Path) {
        let ending = match recording_file::check(path) {
            Ok(ending) => ending,
            Err(words) => return self.tell(Level::Error, format!("{}: {words}", path.display())),
        };
        let Some(viewer) = &mut self.viewer else {
            return self.tell(Level::Error, format!("{}: recordings need a graphics driver", path.display()));
        };
        viewer.open_recording(path);
        self.model.recording = Some(path.to_owned());
        self.model.browsing = false;
        if self.model.kept.layout == LayoutKind::Author {
            self.model.kept.layout = LayoutKind::Episode;
        }
        self.remember(path);
        if let Ending::CutShort(bytes) = ending {
            let words = format!("is cut short after {bytes} bytes; shown is what comes before");
            self.tell(Level::Warning, format!("{}: {words}", path.display()));
        }
    }

    fn open_episode(&mut self, directory: &Path) {
        let wanted = threads::plain(directory);
        let open = self.model.sessions.iter().find(|session| threads::plain(&session.path) == wanted);
        if let Some(id) = open.map(|session| session.id) {
            self.remember(directory);
            return self.carry_out(Command::Show(id));
        }
        let begin = Begin::Open { path: directory.to_owned(), look_only: self.options.look_only };
        let opening = Opening::of(directory.display().to_string());
        self.spawn(Opening { remember: Some(directory.to_owned()), ..opening }, begin);
    }

    /// Opens a scene in the editor; false if it is none, or the editor holds changes.
    fn edit(&mut self, path: &Path) -> bool {
        if self.keeps_changes() {
            return false;
        }
        match self.model.author.open(path) {
            Ok(warnings) => {
                for warning in warnings {
                    self.tell(Level::Warning, format!("{}: {warning}", path.display()));
                }
                true
            }
            Err(error) => {
                self.tell(Level::Error, error.to_string());
                false
            }
        }
    }

    /// Opens a copy of the shown episode's scene in the editor.
    pub(super) fn edit_scene(&mut self) {
        let Some(scene) = self.model.session().map(|session| session.record.scene.clone()) else { return };
        if !self.keeps_changes() {
            self.model.author.edit_copy(scene);
        }
        self.lay_out(LayoutKind::Author);
    }

    /// Whether the editor holds changes that must not be lost; says so.
    fn keeps_changes(&mut self) -> bool {
        let unsaved = self.model.author.is_unsaved();
        if unsaved {
            let name = self.model.author.scene().name.clone();
            self.tell(Level::Warning, format!("{name} has changes: save or undo them in Author first"));
        }
        unsaved
    }

    pub(super) fn remember(&mut self, path: &Path) {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let recent = &mut self.model.kept.recent;
        recent.retain(|other| *other != path);
        recent.insert(0, path);
        recent.truncate(RECENT);
    }

    /// Opens the system's dialog on a thread of its own, since it blocks.
    pub(super) fn browse(&mut self, what: MenuCommand, purpose: ChosenFor) {
        let (chosen, wake) = (self.chosen.0.clone(), self.wake.clone());
        let started = std::thread::Builder::new().name("file dialog".to_owned()).spawn(move || {
            let started = Instant::now();
            let dialog = rfd::FileDialog::new().set_title(what.title().trim_end_matches('…'));
            let path = match what {
                MenuCommand::OpenScene => dialog.add_filter("Scene", &["toml"]).pick_file(),
                MenuCommand::OpenEpisode | MenuCommand::ExportTables | MenuCommand::ExportEpisode => {
                    dialog.pick_folder()
                }
                MenuCommand::SaveSceneAs => dialog.add_filter("Scene", &["toml"]).save_file(),
                MenuCommand::Share => dialog.add_filter("Page", &["html"]).save_file(),
                _ => dialog.add_filter("Picture", &["png"]).save_file(),
            };
            let told = match path {
                Some(path) => Chosen::Path(purpose, path),
                // Nobody closes a dialog that fast: there was none.
                None if started.elapsed() < TOO_FAST => Chosen::NoDialog(purpose, what),
                None => return,
            };
            let _ = chosen.send(told);
            wake();
        });
        if let Err(error) = started {
            self.tell(Level::Error, format!("No file dialog: {error}"));
        }
    }

    /// Writes notes and verdicts, or the scene in the making.
    pub(super) fn save(&mut self) {
        if self.model.kept.layout == LayoutKind::Author {
            if self.model.author.path().is_none() {
                return self.menu(MenuCommand::SaveSceneAs);
            }
            let saved = self.model.author.save();
            return self.saved(saved.map_err(|error| error.to_string()));
        }
        if let Some(id) = self.model.shown {
            let saved = self.save_notes(id);
            self.saved(saved);
        }
    }

    pub(super) fn save_notes(&mut self, id: SessionId) -> Result<PathBuf, String> {
        let Some(session) = self.model.session_of_mut(id) else { return Err("no episode is open".to_owned()) };
        session.annotations.write(&session.path).map_err(|error| error.to_string())?;
        session.unsaved = false;
        Ok(session.path.join(annotations::FILE))
    }

    fn saved(&mut self, saved: Result<PathBuf, String>) {
        match saved {
            Ok(path) => self.tell(Level::Info, format!("Wrote {}", path.display())),
            Err(words) => self.tell(Level::Error, words),
        }
    }

    /// Saves everything that is unsaved; false if something could not be.
    pub(super) fn save_all(&mut self) -> bool {
        let unsaved: Vec<SessionId> =
            self.model.sessions.iter().filter(|session| session.unsaved).map(|session| session.id).collect();
        for id in unsaved {
            if let Err(words) = self.save_notes(id) {
                self.tell(Level::Error, words);
                return false;
            }
        }
        if self.model.author.is_unsaved() {
            if self.model.author.path().is_none() {
                self.menu(MenuCommand::SaveSceneAs);
                return false;
            }
            if let Err(error) = self.model.author.save() {
                self.tell(Level::Error, error.to_string());
                return false;
            }
        }
        true
    }

    /// Asks where something shall be written.
    pub(super) fn ask_where(&mut self, what: MenuCommand) {
        self.dialog = Some(Dialog::write_to(what, &self.proposal(what)));
    }

    /// Where something would go unless a person says otherwise: a place where nothing is yet.
    fn proposal(&self, what: MenuCommand) -> PathBuf {
        let name = self.model.session().map_or_else(
            || "window".to_owned(),
            |session| session.path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        );
        let exports = self.options.out.join("exports");
        match what {
            MenuCommand::ExportEpisode => free(&exports, &name, ""),
            MenuCommand::ExportTables => free(&exports, &format!("{name}-tables"), ""),
            MenuCommand::Share => free(&exports, &name, ".html"),
            MenuCommand::SaveSceneAs => {
                free(&self.options.scenes.join("mine"), &self.model.author.scene().name, ".toml")
            }
            _ => free(&exports, &format!("{name}-{}", self.model.kept.layout.title().to_lowercase()), ".png"),
        }
    }

    pub(super) fn write(&mut self, what: MenuCommand, path: PathBuf, part: Part) {
        match what {
            MenuCommand::SaveSceneAs => {
                if let Some(folder) = path.parent() {
                    let _ = std::fs::create_dir_all(folder);
                }
                let saved = self.model.author.save_as(&path);
                self.saved(saved.map_err(|error| error.to_string()));
            }
            MenuCommand::ExportPicture => {
                self.picture_to = Some((part, path));
                self.picture_asked = true;
            }
            MenuCommand::Share => self.share(path),
            _ => {
                if let Some(session) = self.model.session().cloned() {
                    self.export(what, session, path);
                }
            }
        }
    }

    fn export(&mut self, what: MenuCommand, session: Session, path: PathBuf) {
        if session.moments.iter().any(|moment| !moment.is_whole) {
            return self.tell(Level::Warning, "Its log is still being checked; export it once that is done");
        }
        let title = format!("Exporting to {}", path.display());
        self.task(title, move |watch| {
            let written = if what == MenuCommand::ExportTables {
                export::write_tables(&session, &path).map(|_| ())
            } else {
                let recording =
                    path.with_file_name(format!("{}.rrd", path.file_name().unwrap_or_default().to_string_lossy()));
                export::write_episode(&session, &path, &|share| watch(0.5 * share))
                    .and_then(|()| export::write_recording(&session, &recording, &|share| watch(0.5 + 0.5 * share)))
            };
            match written {
                Ok(()) => (Level::Info, format!("Exported to {}", path.display())),
                Err(error) => (Level::Error, error.to_string()),
            }
        });
    }

    /// Writes what is on the window as one page, from the files of its episodes and from notes that are not saved yet.
    fn share(&mut self, path: PathBuf) {
        let on_show = self.model.on_show();
        let episodes: Vec<_> = on_show.map(|session| (session.path.clone(), session.annotations.clone())).collect();
        if episodes.is_empty() {
            return;
        }
        self.task(format!("Writing {}", path.display()), move |watch| {
            if let Some(folder) = path.parent() {
                let _ = std::fs::create_dir_all(folder);
            }
            let filed =
                episodes.iter().map(|(directory, notes)| Source { directory, annotations: Some(notes.clone()) });
            match share::write(&filed.collect::<Vec<_>>(), &path, watch) {
                Ok(shared) => {
                    let said = std::iter::once(format!("Wrote {}.", path.display())).chain(shared.left_out);
                    (Level::Info, said.collect::<Vec<_>>().join(" "))
                }
                Err(error) => (Level::Error, error.to_string()),
            }
        });
    }

    /// Writes a picture of the window, or of a part of it that was drawn where `parts` says.
    pub(super) fn write_picture(&mut self, image: Arc<egui::ColorImage>, part: Part, path: PathBuf, scale: f32) {
        let all = egui::Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(image.width() as f32, image.height() as f32));
        let drawn = self.parts.iter().find(|(of, _)| *of == part).map(|(_, rect)| *rect * scale);
        if part != Part::Window && drawn.is_none() {
            return self.tell(Level::Warning, format!("This layout does not show {}", part.title()));
        }
        let rect = drawn.unwrap_or(all).intersect(all);
        self.task(format!("Writing {}", path.display()), move |_| match write_png(&image, rect, &path) {
            Ok(()) => (Level::Info, format!("Wrote {}", path.display())),
            Err(words) => (Level::Error, words),
        });
    }

    /// Starts something that is done to the end.
    fn task(&mut self, title: String, work: impl FnOnce(&dyn Fn(f32) -> bool) -> (Level, String) + Send + 'static) {
        if let Err(error) = self.tasks.start(title.clone(), self.wake.clone(), work) {
            self.tell(Level::Error, format!("{title}: {error}"));
        }
    }
}

/// `folder/name`, with a number behind the name if that is taken.
fn free(folder: &Path, name: &str, extension: &str) -> PathBuf {
    let numbered = (2..).map(|n| folder.join(format!("{name}-{n}{extension}")));
    let plain = folder.join(format!("{name}{extension}"));
    std::iter::once(plain.clone()).chain(numbered).find(|path| !path.exists()).unwrap_or(plain)
}

/// Writes the pixels of a rectangle of the window.
fn write_png(image: &egui::ColorImage, rect: egui::Rect, path: &Path) -> Result<(), String> {
    let [left, top] = [rect.left().round() as usize, rect.top().round() as usize];
    let [width, height] = [rect.width().floor() as usize, rect.height().floor() as usize];
    if width == 0 || height == 0 || left + width > image.width() || top + height > image.height() {
        return Err(format!("{}: the picture is empty", path.display()));
    }
    let picture = image::RgbImage::from_fn(width as u32, height as u32, |x, y| {
        let pixel = image[(left + x as usize, top + y as usize)];
        image::Rgb([pixel.r(), pixel.g(), pixel.b()])
    });
    if let Some(folder) = path.parent().filter(|folder| *folder != Path::new("")) {
        std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    }
    export::write_picture(&picture, 1, path).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_of_the_window_is_cut_out() {
        let folder = tempfile::tempdir().expect("folder");
        let mut image = egui::ColorImage::filled([8, 6], egui::Color32::BLACK);
        image[(3, 2)] = egui::Color32::from_rgb(9, 8, 7);
        let path = folder.path().join("new/part.png");
        let rect = egui::Rect::from_min_size(egui::pos2(3.0, 2.0), egui::vec2(4.0, 3.0));
        write_png(&image, rect, &path).expect("written");
        let read = image::open(&path).expect("a picture").into_rgb8();
        assert_eq!((read.dimensions(), read.get_pixel(0, 0).0, read.get_pixel(1, 0).0), ((4, 3), [9, 8, 7], [0; 3]));
        assert!(write_png(&image, rect.translate(egui::vec2(9.0, 0.0)), &path).is_err());
    }

    #[test]
    fn a_proposal_is_a_place_where_nothing_is() {
        let folder = tempfile::tempdir().expect("folder");
        assert_eq!(free(folder.path(), "a", ".png"), folder.path().join("a.png"));
        std::fs::write(folder.path().join("a.png"), "").expect("written");
        assert_eq!(free(folder.path(), "a", ".png"), folder.path().join("a-2.png"));
    }
}
