//! Tables that are sorted by a click on a column's heading.

use super::words;
use egui_extras::{Column as Width, TableBuilder};
use re_viewer::external::egui::{
    Align, Button, Color32, Label, Layout, RichText, Sense, TextStyle, Ui, Vec2b, WidgetInfo, WidgetType,
};

/// A column's heading.
pub struct Column {
    /// Its text.
    pub title: &'static str,
    /// What it means, with unit and range.
    pub hint: &'static str,
    /// Its width, points.
    pub width: f32,
}

/// What stands in a row and column.
pub enum Cell {
    /// A number, to sort by and as it is written.
    Figure(f64, String),
    /// A word.
    Word(String),
}

impl Cell {
    /// A number with one decimal, or none where it is large.
    pub fn nats(value: Option<f32>) -> Self {
        match value {
            Some(value) if value.is_finite() => {
                let text = if value.abs() < 9_999.5 { format!("{value:.1}") } else { format!("{value:.0}") };
                Self::Figure(f64::from(value), text.replace('-', "−"))
            }
            _ => Self::Figure(f64::NAN, "–".to_owned()),
        }
    }

    /// A whole number.
    pub fn number(value: usize) -> Self {
        Self::Figure(value as f64, value.to_string())
    }
}

/// A row.
pub struct Row {
    /// What it is about: what [`Touched`] speaks of.
    pub key: usize,
    /// One cell a column.
    pub cells: Vec<Cell>,
    /// Whether it is what was chosen by the policy: bold.
    pub chosen: bool,
    /// Whether it is what the person chose: highlighted.
    pub selected: bool,
    /// Whether it is out of question: grey.
    pub grey: bool,
    /// What screen readers say.
    pub name: String,
    /// The tooltip.
    pub hint: String,
}

/// By which column a table is sorted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sort {
    /// Its position; `None` leaves the rows in the order in which they are given.
    pub column: Option<usize>,
    /// The largest first.
    pub falling: bool,
}

impl Sort {
    /// The largest of a column first.
    pub fn falling(column: usize) -> Self {
        Self { column: Some(column), falling: true }
    }

    /// As the rows are given.
    pub fn as_given() -> Self {
        Self { column: None, falling: true }
    }

    /// What a click on a column's heading leads to.
    fn click(&mut self, column: usize) {
        *self = Self { column: Some(column), falling: self.column != Some(column) || !self.falling };
    }

    /// Sorts rows; what is no number comes last, equals stay in their order.
    fn apply(self, rows: &mut [Row]) {
        let Some(column) = self.column else { return };
        let order = |a: &Row, b: &Row| match (a.cells.get(column), b.cells.get(column)) {
            (Some(Cell::Figure(a, _)), Some(Cell::Figure(b, _))) => match (a.is_nan(), b.is_nan()) {
                (false, false) if self.falling => b.total_cmp(a),
                (false, false) => a.total_cmp(b),
                (a, b) => a.cmp(&b),
            },
            (Some(Cell::Word(a)), Some(Cell::Word(b))) if self.falling => b.cmp(a),
            (Some(Cell::Word(a)), Some(Cell::Word(b))) => a.cmp(b),
            _ => std::cmp::Ordering::Equal,
        };
        rows.sort_by(order);
    }
}

/// What the pointer did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Touched {
    /// The row under it.
    pub over: Option<usize>,
    /// The row that was clicked.
    pub clicked: Option<usize>,
}

/// Draws a table, at most `height` points high.
pub fn show(ui: &mut Ui, id: &str, columns: &[Column], mut rows: Vec<Row>, sort: &mut Sort, height: f32) -> Touched {
    let mut touched = Touched::default();
    let line = ui.text_style_height(&TextStyle::Small) + 5.0;
    ui.push_id(id, |ui| {
        ui.spacing_mut().item_spacing.x = 6.0;
        let mut table = TableBuilder::new(ui)
            .id_salt(id)
            .striped(true)
            .sense(Sense::click())
            .vscroll(true)
            .max_scroll_height(height)
            .min_scrolled_height(height.min(6.0 * line))
            .auto_shrink(Vec2b::new(false, true))
            .cell_layout(Layout::right_to_left(Align::Center));
        for (at, column) in columns.iter().enumerate() {
            let last = at + 1 == columns.len();
            table = table.column(if last {
                Width::remainder().at_least(column.width).clip(true)
            } else {
                Width::exact(column.width)
            });
        }
        table
            .header(line + 1.0, |mut header| {
                for (at, column) in columns.iter().enumerate() {
                    header.col(|ui| {
                        if heading(ui, column, (sort.column == Some(at)).then_some(sort.falling)) {
                            sort.click(at);
                        }
                    });
                }
            })
            .body(|body| {
                sort.apply(&mut rows);
                body.rows(line, rows.len(), |mut tr| {
                    let row = &rows[tr.index()];
                    tr.set_selected(row.selected);
                    for cell in &row.cells {
                        tr.col(|ui| show_cell(ui, cell, row));
                    }
                    let response = tr.response();
                    response.widget_info(|| {
                        WidgetInfo::selected(WidgetType::SelectableLabel, true, row.selected, &row.name)
                    });
                    if response.hovered() {
                        touched.over = Some(row.key);
                    }
                    if response.clicked() {
                        touched.clicked = Some(row.key);
                    }
                    if !row.hint.is_empty() {
                        response.on_hover_text_at_pointer(&row.hint);
                    }
                });
            });
    });
    touched
}

/// A heading that is clicked to sort; says whether it was.
fn heading(ui: &mut Ui, column: &Column, sorted: Option<bool>) -> bool {
    let arrow = match sorted {
        Some(true) => " ⬇",
        Some(false) => " ⬆",
        None => "",
    };
    let text = RichText::new(format!("{}{arrow}", column.title)).small();
    let text = if sorted.is_some() { text.strong() } else { text.color(ui.visuals().weak_text_color()) };
    let button = ui.add(Button::new(text).frame(false).small());
    button.widget_info(|| WidgetInfo::labeled(WidgetType::Button, true, format!("Sort by {}", column.title)));
    button.on_hover_text(column.hint).clicked()
}

fn show_cell(ui: &mut Ui, cell: &Cell, row: &Row) {
    let text = match cell {
        Cell::Figure(_, text) => words::figure(text),
        Cell::Word(text) => RichText::new(text).small(),
    };
    let colour: Color32 = match row {
        Row { grey: true, .. } => ui.visuals().weak_text_color(),
        Row { chosen: true, .. } => ui.visuals().strong_text_color(),
        _ => ui.visuals().text_color(),
    };
    ui.add(Label::new(text.color(colour)).selectable(false).truncate());
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(key: usize, value: f64) -> Row {
        Row {
            key,
            cells: vec![Cell::Figure(value, String::new())],
            chosen: false,
            selected: false,
            grey: false,
            name: String::new(),
            hint: String::new(),
        }
    }

    #[test]
    fn what_is_no_number_comes_last_either_way() {
        let mut sort = Sort::falling(0);
        let mut rows = vec![row(0, 2.0), row(1, f64::NAN), row(2, 3.0)];
        let keys = |rows: &[Row]| rows.iter().map(|row| row.key).collect::<Vec<_>>();
        sort.apply(&mut rows);
        assert_eq!(keys(&rows), [2, 0, 1]);
        sort.click(0);
        sort.apply(&mut rows);
        assert_eq!(keys(&rows), [0, 2, 1]);
    }

    #[test]
    fn rows_stay_as_they_are_given_until_a_heading_is_clicked() {
        let mut sort = Sort::as_given();
        let mut rows = vec![row(0, 2.0), row(1, 1.0), row(2, 3.0)];
        sort.apply(&mut rows);
        assert_eq!(rows.iter().map(|row| row.key).collect::<Vec<_>>(), [0, 1, 2]);
        sort.click(0);
        assert_eq!(sort, Sort::falling(0));
    }
}
