//! Merging the directories of shards into one bench.

use super::makers::Mixing;
use super::plan::Plan;
use super::store::BenchDir;
use nudge_core::files::temporary_of;
use nudge_core::shard::Shard;
use nudge_core::{Error, Result};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Merges the shards in `parts` into a new directory, the same as if one process had run all of it; returns its plan.
///
/// # Errors
/// For shards of different plans, shards that were made otherwise (unless they may be mixed), shards that overlap, are
/// missing or unfinished (each named), and for an output directory that is there already. Nothing is written then.
pub fn merge(parts: &[PathBuf], out: &Path, mixing: Mixing) -> Result<Plan> {
    if fs::exists(out).map_err(|error| Error::io(out, error))? {
        return Err(Error::input(out, "", "is there already; choose a new directory to merge into"));
    }
    let shards = open(parts)?;
    let (_, (first_part, _, first)) =
        shards.first_key_value().ok_or_else(|| Error::Usage("no shards to merge".to_owned()))?;
    let mut whole = Plan { shard: None, ..first.clone() };
    for (part, directory, plan) in shards.values() {
        let same = Plan { shard: None, ..plan.clone() };
        if let Some(difference) = same.difference(&whole) {
            let message = format!("does not belong to the bench in {}: {difference}", first_part.display());
            return Err(Error::input(part, "", message));
        }
        whole.join(&same, mixing).map_err(|words| {
            let message =
                format!("was made otherwise than {}: {words}; --allow-mixed merges all the same", first_part.display());
            Error::input(part, "", message)
        })?;
        let missing = directory.missing(plan)?;
        if let Some(first) = missing.first() {
            let of = plan.episodes().len();
            let message = format!("{} of {of} episodes are missing, first {}", missing.len(), plan.name(*first));
            return Err(Error::input(part, "", message));
        }
    }
    let partial = temporary_of(out);
    let written = write(&partial, &whole, shards.into_values());
    if written.is_err() {
        let _ = fs::remove_dir_all(&partial);
    }
    written?;
    fs::rename(&partial, out).map_err(|error| Error::io(out, error))?;
    Ok(whole)
}

type Part<'a> = (&'a PathBuf, BenchDir, Plan);

/// The shards by index: every one there, none twice.
fn open(parts: &[PathBuf]) -> Result<BTreeMap<usize, Part<'_>>> {
    let mut shards: BTreeMap<usize, Part<'_>> = BTreeMap::new();
    let mut count = None;
    for part in parts {
        let (directory, plan) = BenchDir::open(part)?;
        let Some(shard) = plan.shard else {
            return Err(Error::input(part, "", "is a whole bench, not a shard of one"));
        };
        let of = *count.get_or_insert(shard.count);
        if shard.count != of {
            let message = format!("is shard {shard}, the others are of {of}: they overlap");
            return Err(Error::input(part, "", message));
        }
        if let Some((other, ..)) = shards.insert(shard.index, (part, directory, plan)) {
            let message = format!("is shard {shard}, which {} is, too: they overlap", other.display());
            return Err(Error::input(part, "", message));
        }
    }
    let count = count.unwrap_or(0);
    let missing: Vec<String> = (0..count)
        .filter(|index| !shards.contains_key(index))
        .map(|index| Shard { index, count }.to_string())
        .collect();
    if missing.is_empty() {
        return Ok(shards);
    }
    let (what, verb) = if missing.len() == 1 { ("shard", "is") } else { ("shards", "are") };
    Err(Error::Usage(format!("{what} {} {verb} missing: name the directories of all {count}", missing.join(", "))))
}

fn write<'a>(out: &Path, whole: &Plan, shards: impl Iterator<Item = Part<'a>>) -> Result<()> {
    if out.exists() {
        // Left by a merge that was killed.
        fs::remove_dir_all(out).map_err(|error| Error::io(out, error))?;
    }
    let merged = BenchDir::prepare(out, whole)?;
    for (part, directory, plan) in shards {
        for id in plan.episodes() {
            let Some(result) = directory.result(&plan, id)? else { continue };
            let seconds = directory
                .seconds(&plan, id)
                .ok_or_else(|| Error::input(part, "", format!("the seconds of {} are missing", plan.name(id))))?;
            merged.file_episode(whole, id, &result, &seconds)?;
            let recording = BenchDir::recording(&plan, id);
            if part.join(&recording).is_dir() {
                copy_directory(&part.join(&recording), &out.join(&recording))?;
            }
        }
    }
    Ok(())
}

fn copy_directory(from: &Path, to: &Path) -> Result<()> {
    fs::create_dir_all(to).map_err(|error| Error::io(to, error))?;
    for entry in fs::read_dir(from).map_err(|error| Error::io(from, error))? {
        let entry = entry.map_err(|error| Error::io(from, error))?;
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy_directory(&entry.path(), &target)?;
        } else {
            fs::copy(entry.path(), &target).map_err(|error| Error::io(&target, error))?;
        }
    }
    Ok(())
}
