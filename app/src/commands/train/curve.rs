//! The losses of a training run on their way to the terminal and to `FILE.jsonl`.

use crate::commands::progress::words;
use crate::commands::warn;
use crate::record::training::CurveRecorder;
use nudge_core::Error;
use serde_json::{Value, json};
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Means of named losses since the last report, and the file that keeps them: a line of JSON per report, of `kind` `loss`
/// or `validation`.
pub(super) struct Curve {
    file: File,
    path: PathBuf,
    started: Instant,
    recorder: Option<CurveRecorder>,
    /// Name, sum, count.
    sums: Vec<(&'static str, f64, f64)>,
}

impl Curve {
    /// The curve of the run named `out`, which has `updates` updates; one that is resumed is gone on with. With `follow`
    /// it is recorded too: into `FILE.rrd`, or `FILE-UPDATES.rrd` when it is resumed.
    pub(super) fn open(out: &Path, resume: bool, follow: bool, updates: u64) -> anyhow::Result<Self> {
        let name = out.file_name().unwrap_or_default().to_string_lossy();
        let path = out.with_file_name(format!("{name}.jsonl"));
        let recording = if resume { format!("{name}-{updates}.rrd") } else { format!("{name}.rrd") };
        let recorder = follow
            .then(|| CurveRecorder::create(&out.with_file_name(recording), &format!("training {name}")))
            .transpose()?;
        let mut options = OpenOptions::new();
        if resume {
            options.create(true).append(true)
        } else {
            options.create(true).write(true).truncate(true)
        };
        let file = options.open(&path).map_err(|error| Error::io(&path, error))?;
        Ok(Self { file, path, started: Instant::now(), recorder, sums: Vec::new() })
    }

    /// Adds to the mean of a loss.
    pub(super) fn add(&mut self, name: &'static str, loss: f64) {
        match self.sums.iter_mut().find(|(known, ..)| *known == name) {
            Some((_, sum, count)) => (*sum, *count) = (*sum + loss, *count + 1.0),
            None => self.sums.push((name, loss, 1.0)),
        }
    }

    /// Tells the means since the last report, and how long the run still takes where it has an end.
    pub(super) fn report(&mut self, updates: u64, left: Option<Duration>) -> anyhow::Result<()> {
        if self.sums.is_empty() {
            return Ok(());
        }
        let minutes = self.started.elapsed().as_secs_f64() / 60.0;
        let mut line = json!({ "kind": "loss", "updates": updates, "minutes": minutes });
        let mut text = format!("{minutes:7.1} min {updates:8} updates");
        for (name, sum, count) in self.sums.drain(..) {
            let mean = sum / count;
            text += &format!("   {name} {mean:.4}");
            line[name] = mean.into();
            if let Some(recorder) = &self.recorder {
                recorder.value(name, updates, mean)?;
            }
        }
        if let Some(left) = left {
            text += &format!("   about {} left", words(left));
        }
        eprintln!("{text}");
        self.write(&line)
    }

    /// Keeps a validation.
    pub(super) fn validation(&mut self, updates: u64, scores: Value) -> anyhow::Result<()> {
        let minutes = self.started.elapsed().as_secs_f64() / 60.0;
        if let Some(recorder) = &self.recorder {
            for (name, value) in leaves(&scores, "validation") {
                recorder.value(&name, updates, value)?;
            }
        }
        self.write(&json!({ "kind": "validation", "updates": updates, "minutes": minutes, "scores": scores }))
    }

    fn write(&mut self, line: &Value) -> anyhow::Result<()> {
        let text = serde_json::to_string(line)? + "\n";
        // A full disk stops the curve, not the training.
        if let Err(error) = self.file.write_all(text.as_bytes()) {
            warn(&Error::io(&self.path, error).to_string());
        }
        Ok(())
    }
}

/// The numbers of a document with their places, `validation/3/occupancy_iou`; rows that tell their `views` go by them.
fn leaves(value: &Value, place: &str) -> Vec<(String, f64)> {
    match value {
        Value::Number(number) => number.as_f64().map(|number| (place.to_owned(), number)).into_iter().collect(),
        Value::Array(rows) => {
            let key = |at: usize, row: &Value| row["views"].as_u64().unwrap_or(at as u64);
            rows.iter().enumerate().flat_map(|(at, row)| leaves(row, &format!("{place}/{}", key(at, row)))).collect()
        }
        Value::Object(fields) => fields
            .iter()
            .filter(|(name, _)| *name != "views")
            .flat_map(|(name, field)| leaves(field, &format!("{place}/{name}")))
            .collect(),
        _ => Vec::new(),
    }
}
