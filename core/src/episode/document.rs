//! `episode.json` as text: written with one line per step part, read with errors that name line and column.

use super::record::{EpisodeRecord, FORMAT};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::io::{self, Write};
use std::path::Path;

impl EpisodeRecord {
    /// The document, ending in a newline: `episode.json` and what `nudge run --json` prints.
    ///
    /// Numbers are written so that reading gives the very same bits. Steps and their parts stand on lines of their
    /// own; lists of numbers stay on one line.
    pub fn to_json(&self) -> String {
        let mut text = Vec::new();
        let mut serializer = serde_json::Serializer::with_formatter(&mut text, Lines::default());
        self.serialize(&mut serializer).expect("a record serialises into memory");
        text.push(b'\n');
        String::from_utf8(text).expect("JSON is UTF-8")
    }

    /// Reads the document. `path` is the file that errors name.
    pub fn from_json(text: &str, path: &Path) -> Result<Self> {
        #[derive(Deserialize)]
        struct Head {
            format: Option<u32>,
        }
        let head: Head = serde_json::from_str(text).map_err(|error| input_error(path, &error))?;
        match head.format {
            Some(1..=FORMAT) => {}
            Some(other) => {
                return Err(Error::input(path, "format", format!("is {other}, this version reads 1 to {FORMAT}")));
            }
            None => return Err(Error::input(path, "format", "is missing: not an episode")),
        }
        let mut record: Self = serde_json::from_str(text).map_err(|error| input_error(path, &error))?;
        record.scene.check_numbers(path)?;
        if let Err(fault) = record.config.planner.check() {
            return Err(Error::input(path, "planner", fault.to_string()));
        }
        // An older document reads into the same record, and is written as that.
        record.format = FORMAT;
        for (at, step) in record.steps.iter().enumerate() {
            if step.index != at + 1 {
                let place = format!("steps[{at}].index");
                return Err(Error::input(path, place, format!("is {}, expected {}", step.index, at + 1)));
            }
            if step.judgement.is_some() != record.has_truth() {
                let message = "is judged and the prior is not, or the other way round";
                return Err(Error::input(path, format!("steps[{at}]"), message));
            }
            if step.action != step.decision.action {
                return Err(Error::input(path, format!("steps[{at}].action"), "is not the action of its decision"));
            }
        }
        if record.steps.len() > record.config.budget {
            let message = format!("{} steps in a budget of {}", record.steps.len(), record.config.budget);
            return Err(Error::input(path, "steps", message));
        }
        // Older versions did not take the rule down with every decision: it was the episode's.
        let rule = record.config.rule();
        record.steps.iter_mut().for_each(|step| _ = step.decision.rule.get_or_insert(rule));
        Ok(record)
    }
}

/// One line with the place apart from the words.
fn input_error(path: &Path, error: &serde_json::Error) -> Error {
    let words = error.to_string();
    let words = words.rsplit_once(" at line ").map_or(words.as_str(), |(words, _)| words);
    let place = match error.line() {
        0 => String::new(),
        line => format!("line {line}, column {}", error.column()),
    };
    Error::input(path, place, words)
}

/// Breaks lines down to the parts of a step and no further.
const BROKEN_DEPTH: usize = 3;

/// JSON layout: indented down to [`BROKEN_DEPTH`], compact below.
#[derive(Default)]
struct Lines {
    depth: usize,
    has_value: bool,
}

impl Lines {
    fn break_line<W: ?Sized + Write>(&self, writer: &mut W, depth: usize) -> io::Result<()> {
        writer.write_all(b"\n")?;
        (0..depth).try_for_each(|_| writer.write_all(b"  "))
    }

    fn begin<W: ?Sized + Write>(&mut self, writer: &mut W, bracket: &[u8]) -> io::Result<()> {
        self.depth += 1;
        self.has_value = false;
        writer.write_all(bracket)
    }

    fn end<W: ?Sized + Write>(&mut self, writer: &mut W, bracket: &[u8]) -> io::Result<()> {
        self.depth -= 1;
        if self.has_value && self.depth < BROKEN_DEPTH {
            self.break_line(writer, self.depth)?;
        }
        writer.write_all(bracket)
    }

    fn separate<W: ?Sized + Write>(&self, writer: &mut W, first: bool) -> io::Result<()> {
        let broken = self.depth <= BROKEN_DEPTH;
        match (first, broken) {
            (true, true) => self.break_line(writer, self.depth),
            (true, false) => Ok(()),
            (false, true) => writer.write_all(b",").and_then(|()| self.break_line(writer, self.depth)),
            (false, false) => writer.write_all(b", "),
        }
    }
}

impl serde_json::ser::Formatter for Lines {
    fn begin_array<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.begin(writer, b"[")
    }

    fn end_array<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.end(writer, b"]")
    }

    fn begin_array_value<W: ?Sized + Write>(&mut self, writer: &mut W, first: bool) -> io::Result<()> {
        self.separate(writer, first)
    }

    fn end_array_value<W: ?Sized + Write>(&mut self, _: &mut W) -> io::Result<()> {
        self.has_value = true;
        Ok(())
    }

    fn begin_object<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.begin(writer, b"{")
    }

    fn end_object<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.end(writer, b"}")
    }

    fn begin_object_key<W: ?Sized + Write>(&mut self, writer: &mut W, first: bool) -> io::Result<()> {
        self.separate(writer, first)
    }

    fn begin_object_value<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        writer.write_all(b": ")
    }

    fn end_object_value<W: ?Sized + Write>(&mut self, _: &mut W) -> io::Result<()> {
        self.has_value = true;
        Ok(())
    }
}

#[cfg(test)]
#[path = "document_tests.rs"]
mod tests;

#[cfg(test)]
#[path = "format_tests.rs"]
mod format_tests;
