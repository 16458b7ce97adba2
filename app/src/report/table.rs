//! A table of a report, as HTML and as Markdown: the same figures in both.

use crate::figure::escape;
use std::fmt::{Display, Write as _};

/// A table: a caption, column titles, and rows that start with their name. All of it is plain text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Table {
    /// What it shows.
    pub caption: String,
    /// Titles of the columns.
    pub titles: Vec<String>,
    /// Its rows, as long as the titles.
    pub rows: Vec<Vec<Cell>>,
}

/// A cell: a figure, and smaller what belongs to it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cell {
    main: String,
    note: String,
    style: Style,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Style {
    #[default]
    Plain,
    Bold,
    /// A name as it is typed.
    Name,
}

impl Cell {
    /// A figure or a word.
    pub fn new(main: impl Display) -> Self {
        Self { main: main.to_string(), ..Self::default() }
    }

    /// A name as it is typed on the command line.
    pub fn named(name: impl Display) -> Self {
        Self { style: Style::Name, ..Self::new(name) }
    }

    /// With an interval, counts, or the like beside it.
    pub fn with_note(self, note: String) -> Self {
        Self { note, ..self }
    }

    /// In bold.
    pub fn bold(self) -> Self {
        Self { style: Style::Bold, ..self }
    }

    fn html(&self) -> String {
        let main = escape(&self.main);
        let text = match self.note.as_str() {
            "" => main,
            note => format!("{main} <small>{}</small>", escape(note)),
        };
        if self.style == Style::Bold { format!("<b>{text}</b>") } else { text }
    }

    fn markdown(&self) -> String {
        let main = match self.style {
            Style::Plain => plain(&self.main),
            Style::Bold => format!("**{}**", plain(&self.main)),
            Style::Name => format!("`{}`", self.main.replace('|', "\\|")),
        };
        if self.note.is_empty() { main } else { format!("{main} {}", plain(&self.note)) }
    }
}

/// Text in which Markdown reads no mark of its own; brackets stay, since no link follows them.
pub fn plain(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        if "\\`*_<>|#".contains(letter) {
            out.push('\\');
        }
        out.push(letter);
    }
    out
}

impl Table {
    /// A table without rows.
    pub fn new(caption: &str, titles: &[&str]) -> Self {
        let titles = titles.iter().map(|title| (*title).to_owned()).collect();
        Self { caption: caption.to_owned(), titles, rows: Vec::new() }
    }

    /// As an HTML figure.
    pub fn html(&self) -> String {
        let mut html = format!(
            "<figure class=\"table\"><figcaption>{}</figcaption><div class=\"wide\"><table><thead><tr>",
            escape(&self.caption)
        );
        for title in &self.titles {
            let _ = write!(html, "<th scope=\"col\">{}</th>", escape(title));
        }
        html += "</tr></thead><tbody>";
        for row in &self.rows {
            html += "<tr>";
            for (at, cell) in row.iter().enumerate() {
                let (tag, scope) = if at == 0 { ("th", " scope=\"row\"") } else { ("td", "") };
                let _ = write!(html, "<{tag}{scope}>{}</{tag}>", cell.html());
            }
            html += "</tr>";
        }
        html + "</tbody></table></div></figure>\n"
    }

    /// As lines for a terminal: the cells of a row side by side, without caption and titles.
    pub fn lines(&self) -> String {
        let width = self.rows.iter().filter_map(|row| Some(row.first()?.main.chars().count())).max().unwrap_or(0);
        let rest = |row: &[Cell]| row[1..].iter().map(|cell| cell.main.clone()).collect::<Vec<_>>().join("  ");
        let line = |row: &Vec<Cell>| format!("{:<width$}  {}\n", row[0].main, rest(row));
        self.rows.iter().filter(|row| !row.is_empty()).map(line).collect()
    }

    /// As a paragraph and a Markdown table, each with an empty line behind it.
    pub fn markdown(&self) -> String {
        let row = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let mut text = format!("{}\n\n", plain(&self.caption));
        text += &row(self.titles.iter().map(|title| plain(title)).collect());
        text += &format!("|{}\n", "---|".repeat(self.titles.len()));
        for cells in &self.rows {
            text += &row(cells.iter().map(Cell::markdown).collect());
        }
        text + "\n"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let mut table = Table::new("Maps: <all> of a|b.", &["policy", "IoU at 20"]);
        let figure = Cell::new("0.588").with_note("[0.534, 0.640]".to_owned());
        table.rows.push(vec![Cell::named("mem-no-push"), figure.clone()]);
        table.rows.push(vec![Cell::named("mem"), figure.bold()]);
        table
    }

    #[test]
    fn a_table_is_the_same_in_markdown_and_html() {
        let expected = "Maps: \\<all\\> of a\\|b.\n\n\
                        | policy | IoU at 20 |\n|---|---|\n\
                        | `mem-no-push` | 0.588 [0.534, 0.640] |\n\
                        | `mem` | **0.588** [0.534, 0.640] |\n\n";
        assert_eq!(table().markdown(), expected);
        let html = table().html();
        for part in [
            "<figcaption>Maps: &lt;all&gt; of a|b.</figcaption>",
            "<th scope=\"row\">mem-no-push</th><td>0.588 <small>[0.534, 0.640]</small></td>",
            "<td><b>0.588 <small>[0.534, 0.640]</small></b></td>",
        ] {
            assert!(html.contains(part), "{part} is not in {html}");
        }
    }
}
