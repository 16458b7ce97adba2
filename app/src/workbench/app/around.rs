//! The panels around the three-dimensional views: the episode at the left, and what the layout shows. Each can be folded to a
//! strip with a button that opens it.

use super::App;
use crate::workbench::columns::Column;
use crate::workbench::command::{Command, MenuCommand};
use crate::workbench::model::LayoutKind;
use crate::workbench::panels::tour::{self, Spot};
use crate::workbench::panels::{self, Panel};
use crate::workbench::part::Part;
use crate::workbench::session::{Activity, SessionId};
use re_viewer::external::{eframe, egui};

/// Width of a folded panel, points.
const STRIP: f32 = 22.0;

impl App {
    /// The episode and its buttons.
    pub(super) fn episode(
        &mut self,
        ui: &mut egui::Ui,
        openings: &[(SessionId, String, Activity)],
        ask: &mut Vec<Command>,
    ) {
        let width = Column::Episode.width(236.0, self.model.window);
        if !self.model.shows(Column::Episode) {
            let strip = egui::Panel::left("episode folded").exact_size(STRIP).resizable(false);
            strip.show(ui, |ui| opener(ui, Column::Episode, "⏵", ask));
            return;
        }
        egui::Panel::left("episode").default_size(width).size_range(200.0..=480.0).show(ui, |ui| {
            let room = ui.max_rect();
            scrolled(ui, "episode", |ui| {
                panels::episode::openings(ui, openings, ask);
                panels::episode::show(ui, &mut self.model, ask);
            });
            folder(ui, room, Column::Episode, "⏴", ask);
        });
    }

    /// What the layout shows.
    pub(super) fn layout(&mut self, ui: &mut egui::Ui, frame: Option<&mut eframe::Frame>, ask: &mut Vec<Command>) {
        let layout = self.model.kept.layout;
        self.right(ui, layout, ask);
        if matches!(layout, LayoutKind::Episode | LayoutKind::Compare) {
            self.curves(ui, ask);
        }
        if matches!(layout, LayoutKind::Episode | LayoutKind::Why) {
            self.maps(ui, ask);
        }
        egui::Panel::bottom("display").show(ui, |ui| {
            panels::display::show(ui, &mut self.model, self.drawn.count(crate::workbench::space::at::BELIEF), ask);
        });
        self.space_view(ui, frame);
    }

    fn right(&mut self, ui: &mut egui::Ui, layout: LayoutKind, ask: &mut Vec<Command>) {
        if !self.model.shows(Column::Right) {
            let strip = egui::Panel::right("right folded").exact_size(STRIP).resizable(false);
            strip.show(ui, |ui| opener(ui, Column::Right, "⏴", ask));
            return;
        }
        let width = Column::Right.width(layout.right_width(), self.model.window);
        let right = egui::Panel::right(egui::Id::new(("right", layout)))
            .default_size(width)
            .size_range(240.0..=900.0)
            .show(ui, |ui| {
                let room = ui.max_rect();
                ui.add_space(4.0);
                match layout {
                    LayoutKind::Why => self.panels.why.show(ui, &mut self.model, ask),
                    LayoutKind::Gains => self.panels.gains.show(ui, &mut self.model, ask),
                    LayoutKind::Push => self.panels.push.show(ui, &mut self.model, ask),
                    LayoutKind::Compare => self.panels.compare.show(ui, &mut self.model, ask),
                    LayoutKind::Episode | LayoutKind::Author => scrolled(ui, "right", |ui| {
                        self.panels.decision.show(ui, &mut self.model, ask);
                        ui.add_space(6.0);
                        self.panels.promises.show(ui, &mut self.model, ask);
                        ui.add_space(6.0);
                        ui.separator();
                        panels::notes::show(ui, &mut self.model, ask);
                    }),
                }
                folder(ui, room, Column::Right, "⏵", ask);
            });
        self.parts.push((Part::Right, right.response.rect));
        tour::mark(ui.ctx(), Spot::Right, right.response.rect);
    }

    fn curves(&mut self, ui: &mut egui::Ui, ask: &mut Vec<Command>) {
        if !self.model.shows(Column::Curves) {
            let strip = egui::Panel::bottom("curves folded").exact_size(STRIP).resizable(false);
            strip.show(ui, |ui| opener(ui, Column::Curves, "⏶", ask));
            return;
        }
        let curves = egui::Panel::bottom("curves").resizable(true).default_size(190.0).size_range(130.0..=420.0);
        let curves = curves.show(ui, |ui| {
            let room = ui.max_rect();
            panels::curves::show(ui, &mut self.model, ask);
            folder(ui, room, Column::Curves, "⏷", ask);
        });
        self.parts.push((Part::Curves, curves.response.rect));
    }

    fn maps(&mut self, ui: &mut egui::Ui, ask: &mut Vec<Command>) {
        if !self.model.shows(Column::Maps) {
            let strip = egui::Panel::right("maps folded").exact_size(STRIP).resizable(false);
            strip.show(ui, |ui| opener(ui, Column::Maps, "⏴", ask));
            return;
        }
        let width = Column::Maps.width(340.0, self.model.window);
        let maps = egui::Panel::right("maps").default_size(width).size_range(220.0..=1200.0).show(ui, |ui| {
            let room = ui.max_rect();
            scrolled(ui, "maps", |ui| {
                self.panels.maps.show(ui, &mut self.model, ask);
                ui.add_space(6.0);
                self.panels.camera.show(ui, &mut self.model, ask);
            });
            folder(ui, room, Column::Maps, "⏵", ask);
        });
        self.parts.push((Part::Maps, maps.response.rect));
    }
}

/// The button of a folded panel.
fn opener(ui: &mut egui::Ui, column: Column, icon: &str, ask: &mut Vec<Command>) {
    let button = ui.add(egui::Button::new(icon).frame(false).min_size(egui::vec2(STRIP - 8.0, STRIP - 8.0)));
    let name = format!("Show {}", column.title());
    button.widget_info(|| egui::WidgetInfo::labeled(egui::WidgetType::Button, true, &name));
    if button.on_hover_text(name.clone()).clicked() {
        ask.push(Command::Menu(MenuCommand::Panel(column)));
    }
}

/// The button that folds an open panel, in its upper right corner, over what is there.
fn folder(ui: &mut egui::Ui, room: egui::Rect, column: Column, icon: &str, ask: &mut Vec<Command>) {
    let size = egui::vec2(16.0, 16.0);
    let corner = egui::Rect::from_min_size(room.right_top() + egui::vec2(-size.x, 2.0), size);
    let button = ui.put(corner, egui::Button::new(egui::RichText::new(icon).weak()).frame(false).small());
    let name = format!("Fold {}", column.title());
    button.widget_info(|| egui::WidgetInfo::labeled(egui::WidgetType::Button, true, &name));
    if button.on_hover_text(name.clone()).clicked() {
        ask.push(Command::Menu(MenuCommand::Panel(column)));
    }
}

fn scrolled(ui: &mut egui::Ui, id: &str, content: impl FnOnce(&mut egui::Ui)) {
    egui::ScrollArea::vertical().id_salt(id).auto_shrink(false).show(ui, |ui| {
        // Room for the bar, which floats over what is at the edge.
        ui.set_max_width(ui.available_width() - 4.0);
        ui.add_space(4.0);
        content(ui);
    });
}
