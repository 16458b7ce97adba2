//! The opening page: episodes and recordings to open and scenes to start from, as cards with a picture, a name, a line, and a few
//! facts.

#[cfg(test)]
mod tests;

use super::episode::{choices, start_title};
use crate::workbench::author::Author;
use crate::workbench::browser::{Browser, Entry, Look};
use crate::workbench::command::{Command, Level, MenuCommand};
use crate::workbench::latest::Wake;
use crate::workbench::model::{LayoutKind, Model};
use crate::workbench::theme::LEAST_SIZE;
use re_viewer::external::egui::{self, Color32, FontId, Pos2, Rect, Sense, StrokeKind, Vec2, WidgetInfo, WidgetType};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Cards are about this wide, points.
const CARD: f32 = 214.0;
const WIDEST_CARD: f32 = 300.0;
const GAP: f32 = 10.0;
/// Height of a thumbnail over its width.
const ASPECT: f32 = 0.58;
const TEXT_HEIGHT: f32 = 74.0;

/// Draws the browser over the whole of `ui`.
pub fn show(ui: &mut egui::Ui, model: &mut Model, ask: &mut Vec<Command>) {
    let context = ui.ctx().clone();
    let wake: Wake = Arc::new(move || context.request_repaint());
    let goes_back = !model.sessions.is_empty();
    let Model { browser, kept, author, .. } = model;
    browser.poll(&kept.recent, &wake);
    head(ui, browser, goes_back, &wake, ask);
    ui.separator();
    let (chosen, title) = (kept.form.scene.clone(), start_title(&kept.form));
    let bottom = egui::Panel::bottom("scenes start").show_separator_line(true);
    bottom.show(ui, |ui| foot(ui, chosen.as_deref(), title, author, ask));
    egui::Panel::right("scenes with").default_size(236.0).size_range(210.0..=340.0).show(ui, |ui| {
        ui.add_space(4.0);
        ui.strong("Episode").on_hover_text("With what the episode is started");
        ui.add_space(2.0);
        egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| choices(ui, &mut kept.form));
    });
    egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        if browser.entries().is_empty() {
            empty(ui, browser);
            return;
        }
        cards(ui, browser, &mut kept.form.scene, &wake, ask);
    });
}

fn head(ui: &mut egui::Ui, browser: &mut Browser, goes_back: bool, wake: &Wake, ask: &mut Vec<Command>) {
    ui.horizontal_wrapped(|ui| {
        if goes_back && ui.button("Back").on_hover_text("Go back to the open episode (Esc)").clicked() {
            ask.push(Command::Browse(false));
        }
        let search = egui::TextEdit::singleline(&mut browser.search).hint_text("Search").desired_width(150.0);
        named(ui.add(search), "Search");
        let typed = egui::TextEdit::singleline(&mut browser.typed).hint_text("Path of a scene or an episode");
        let response = named(ui.add(typed.desired_width(220.0)), "Path of a scene or an episode");
        let entered = response.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        let path = browser.typed.trim().to_owned();
        let open = ui.add_enabled(!path.is_empty(), egui::Button::new("Open path"));
        let open = open.on_disabled_hover_text("Type a path first").on_hover_text("Open what is typed");
        if !path.is_empty() && (entered || open.clicked()) {
            ask.push(Command::Open(PathBuf::from(path)));
        }
        if ui.button("Open…").on_hover_text("Choose a scene's file in a dialog").clicked() {
            ask.push(Command::Menu(MenuCommand::OpenScene));
        }
        if ui.button("Refresh").on_hover_text("Look again at what is in the folder").clicked() {
            browser.refresh(wake);
        }
    });
}

fn foot(ui: &mut egui::Ui, chosen: Option<&Path>, title: &str, author: &mut Author, ask: &mut Vec<Command>) {
    ui.add_space(4.0);
    ui.horizontal(|ui| {
        let start = ui.add_enabled(chosen.is_some(), egui::Button::new(format!("▶ {title}")));
        let start = named(start, title);
        let start =
            start.on_hover_text("Start an episode of the chosen scene").on_disabled_hover_text("Choose a scene");
        if start.clicked() {
            ask.push(Command::Start);
        }
        let edit = ui.add_enabled(chosen.is_some(), egui::Button::new("Edit"));
        let edit = edit.on_hover_text("Open the chosen scene in Author").on_disabled_hover_text("Choose a scene");
        if let Some(path) = chosen.filter(|_| edit.clicked()) {
            open_in_author(path, author, ask);
        }
        match chosen {
            Some(path) => ui.label(path.display().to_string()),
            None => ui.weak("Choose a scene; a double click starts it"),
        };
    });
    ui.add_space(2.0);
}

fn open_in_author(path: &Path, author: &mut Author, ask: &mut Vec<Command>) {
    if author.is_unsaved() {
        let words = format!("{} has changes: save or undo them in Author first", author.scene().name);
        ask.push(Command::Tell(Level::Warning, words));
        return ask.push(Command::Layout(LayoutKind::Author));
    }
    match author.open(path) {
        Ok(warnings) => {
            ask.extend(warnings.into_iter().map(|warning| Command::Tell(Level::Warning, warning)));
            ask.push(Command::Layout(LayoutKind::Author));
        }
        Err(error) => ask.push(Command::Tell(Level::Error, error.to_string())),
    }
}

fn empty(ui: &mut egui::Ui, browser: &Browser) {
    ui.add_space(40.0);
    ui.vertical_centered(|ui| {
        if browser.is_listed() {
            ui.heading("No scenes here");
            let folder = browser.folder().display();
            ui.weak(format!("There is none below {folder}/. Open one, drop one here, or make one in Author."));
        } else {
            ui.spinner();
        }
    });
}

fn cards(ui: &mut egui::Ui, browser: &mut Browser, chosen: &mut Option<PathBuf>, wake: &Wake, ask: &mut Vec<Command>) {
    let room = ui.available_width() - 8.0;
    let columns = ((room + GAP) / (CARD + GAP)).floor().max(1.0);
    let width = ((room - GAP * (columns - 1.0)) / columns).min(WIDEST_CARD);
    let shown = browser.hits();
    let is_search = !browser.search.trim().is_empty();
    if shown.is_empty() {
        ui.add_space(20.0);
        ui.vertical_centered(|ui| ui.weak(format!("Nothing matches “{}”", browser.search.trim())));
    }
    let hits = match shown.len() {
        1 => "One hit".to_owned(),
        count => format!("{count} hits, the best first"),
    };
    let group = |at: &usize| if is_search { hits.clone() } else { browser.entries()[*at].group.clone() };
    let groups: Vec<(String, Vec<usize>)> =
        shown.chunk_by(|a, b| group(a) == group(b)).map(|chunk| (group(&chunk[0]), chunk.to_vec())).collect();
    for (title, group) in groups {
        ui.add_space(6.0);
        ui.strong(title);
        ui.add_space(2.0);
        for row in group.chunks(columns as usize) {
            ui.horizontal(|ui| {
                ui.spacing_mut().item_spacing.x = GAP;
                for &at in row {
                    card(ui, browser, at, width, chosen, wake, ask);
                }
            });
            ui.add_space(GAP - ui.spacing().item_spacing.y);
        }
    }
}

fn card(
    ui: &mut egui::Ui,
    browser: &mut Browser,
    at: usize,
    width: f32,
    chosen: &mut Option<PathBuf>,
    wake: &Wake,
    ask: &mut Vec<Command>,
) {
    let size = Vec2::new(width, (width * ASPECT + TEXT_HEIGHT).round());
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    let Some(entry) = browser.entry_mut(at) else { return };
    let is_chosen = chosen.as_deref() == Some(entry.path.as_path());
    let label = describe(entry);
    response.widget_info(|| WidgetInfo::selected(WidgetType::SelectableLabel, true, is_chosen, label.as_str()));
    if ui.is_rect_visible(rect) {
        draw(ui, rect, &response, entry, is_chosen);
        browser.want(at, wake);
    }
    let Some(entry) = browser.entries().get(at) else { return };
    if response.clicked() || response.double_clicked() {
        match &entry.look {
            Look::Broken(error) => ask.push(Command::Tell(Level::Error, error.clone())),
            Look::Unknown | Look::Sound(_) if entry.is_opened() => ask.push(Command::Open(entry.path.clone())),
            Look::Unknown | Look::Sound(_) => {
                *chosen = Some(entry.path.clone());
                if response.double_clicked() {
                    ask.push(Command::Start);
                }
            }
        }
    }
    response.on_hover_text(match &entry.look {
        Look::Broken(error) => error.clone(),
        _ if entry.is_opened() => format!("{}\nClick to open", entry.path.display()),
        _ => format!("{}\nClick to choose, double click to start", entry.path.display()),
    });
}

/// `tunnel, 20 objects, 10 hidden`.
fn describe(entry: &Entry) -> String {
    let stem = || entry.path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    match &entry.look {
        Look::Unknown => stem(),
        Look::Sound(facts) => format!("{}, {}", facts.text.name, facts.text.about.words()),
        Look::Broken(error) => format!("{}, cannot be read: {error}", stem()),
    }
}

fn draw(ui: &egui::Ui, rect: Rect, response: &egui::Response, entry: &mut Entry, is_chosen: bool) {
    let visuals = ui.visuals();
    let painter = ui.painter().with_clip_rect(ui.clip_rect().intersect(rect.expand(3.0)));
    let radius = 6.0;
    painter.rect_filled(rect, radius, visuals.faint_bg_color);
    let picture = Rect::from_min_size(rect.min, Vec2::new(rect.width(), rect.width() * ASPECT));
    let text = Rect::from_min_max(picture.left_bottom() + Vec2::new(9.0, 6.0), rect.max - Vec2::new(9.0, 5.0));
    let ink = visuals.strong_text_color();
    match &mut entry.look {
        Look::Unknown => {
            egui::Spinner::new().paint_at(ui, Rect::from_center_size(picture.center(), Vec2::splat(18.0)));
            let name = entry.path.file_stem().unwrap_or_default().to_string_lossy();
            line(&painter, text.min, &name, 13.5, ink, text.width(), 1);
        }
        Look::Sound(facts) => {
            let mut top = egui::CornerRadius::same(radius as u8);
            (top.sw, top.se) = (0, 0);
            match &facts.picture {
                Some(drawn) => {
                    let texture = entry.texture.get_or_insert_with(|| {
                        let size = [drawn.width() as usize, drawn.height() as usize];
                        let image = egui::ColorImage::from_rgb(size, drawn.as_raw());
                        ui.ctx().load_texture(entry.path.display().to_string(), image, egui::TextureOptions::LINEAR)
                    });
                    cover(&painter, picture, texture, top);
                }
                None => {
                    painter.rect_filled(picture, top, visuals.extreme_bg_color);
                    let (at, font) = (picture.center(), FontId::proportional(26.0));
                    painter.text(at, egui::Align2::CENTER_CENTER, "⏵", font, visuals.weak_text_color());
                }
            }
            let below = line(&painter, text.min, &facts.text.name, 13.5, ink, text.width(), 1);
            let weak = visuals.weak_text_color();
            let about = Pos2::new(text.left(), below + 1.0);
            line(&painter, about, &facts.text.description, LEAST_SIZE, weak, text.width(), 2);
            let foot = Pos2::new(text.left(), text.bottom() - 13.0);
            let known = facts.text.about.words();
            line(&painter, foot, &known, LEAST_SIZE, visuals.text_color(), text.width(), 1);
        }
        Look::Broken(error) => {
            let red = visuals.error_fg_color;
            let place = rect.min + Vec2::new(9.0, 9.0);
            let name = entry.path.file_name().unwrap_or_default().to_string_lossy();
            let below = line(&painter, place, &format!("⚠ {name}"), 13.5, red, text.width(), 1);
            let below = Pos2::new(place.x, below + 4.0);
            line(&painter, below, error, LEAST_SIZE, visuals.text_color(), text.width(), 9);
        }
    }
    let outline = |stroke: egui::Stroke| painter.rect_stroke(rect, radius, stroke, StrokeKind::Outside);
    if is_chosen {
        outline(egui::Stroke::new(2.5, visuals.selection.bg_fill));
        mark(&painter, picture, visuals.selection.bg_fill);
    } else if response.hovered() || response.has_focus() {
        outline(visuals.widgets.hovered.bg_stroke);
    } else {
        outline(visuals.window_stroke());
    }
}

/// A picture that fills a rectangle; what is too much at the sides or ends is cut.
fn cover(painter: &egui::Painter, rect: Rect, texture: &egui::TextureHandle, corners: egui::CornerRadius) {
    let size = texture.size_vec2();
    let scale = (rect.width() / size.x).max(rect.height() / size.y);
    let part = rect.size() / (size * scale);
    let uv = Rect::from_center_size(Pos2::new(0.5, 0.5), part);
    let shape = egui::epaint::RectShape::filled(rect, corners, Color32::WHITE).with_texture(texture.id(), uv);
    painter.add(shape);
}

/// A tick in a circle at the top right.
fn mark(painter: &egui::Painter, picture: Rect, ground: Color32) {
    let at = picture.right_top() + Vec2::new(-16.0, 16.0);
    painter.circle_filled(at, 9.0, ground);
    let tick = [Vec2::new(-4.0, 0.2), Vec2::new(-1.2, 3.2), Vec2::new(4.2, -3.2)].map(|by| at + by);
    painter.line(tick.to_vec(), egui::Stroke::new(2.0, Color32::WHITE));
}

/// Text of at most so many rows; returns where it ends.
fn line(painter: &egui::Painter, at: Pos2, text: &str, size: f32, ink: Color32, width: f32, rows: usize) -> f32 {
    let mut job = egui::text::LayoutJob::simple(text.to_owned(), FontId::proportional(size), ink, width);
    job.wrap.max_rows = rows;
    job.wrap.break_anywhere = rows == 1;
    let galley = painter.layout_job(job);
    let bottom = at.y + galley.size().y;
    painter.galley(at, galley, ink);
    bottom
}

/// Gives a widget the name that it is told by.
fn named(response: egui::Response, name: &str) -> egui::Response {
    response.ctx.accesskit_node_builder(response.id, |node| node.set_label(name));
    response
}
