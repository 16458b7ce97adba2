//! The tables of a report as Markdown, to be pasted where results are told.

use super::results::Results;
use super::table::plain;
use super::words::{self, Paragraph};
use super::{picks, promises, scenes, tables};
use nudge_core::Result;
use nudge_core::scene::Catalog;

/// Everything that the page says in words and tables, but for its scenes.
///
/// # Errors
/// For scenes that give no bodies.
pub fn markdown(results: &Results) -> Result<String> {
    let plan = &results.plan;
    let mut text = format!("# Nudge bench: {}\n\n", plain(&words::set_names(plan)));
    for paragraph in words::head(results) {
        text += &match paragraph {
            Paragraph::Plain(words) => format!("{}\n\n", plain(&words)),
            Paragraph::Warning(words) => format!("**{}**\n\n", plain(&words)),
        };
    }
    let catalog = Catalog::standard();
    for (set, in_set) in plan.sets.iter().enumerate() {
        if results.policies(set).is_empty() {
            continue;
        }
        let scenes_of = words::count(in_set.scenes.len(), "scene");
        text += &format!("## {} ({scenes_of})\n\n", plain(&in_set.name));
        let sentences = [Some(scenes::without_hidden(results, set, &catalog)?), tables::against_oracle(results, set)];
        for sentence in sentences.into_iter().flatten() {
            text += &format!("{}\n\n", plain(&sentence));
        }
        let of_set = [
            Some(tables::scores(results, set)),
            tables::differences(results, set),
            Some(tables::actions(results, set)),
            picks::ends(results, set),
            picks::counted_twice(results, set),
            Some(promises::table(results, set)),
            Some(tables::verdicts(results, set)),
        ];
        text += &of_set.into_iter().flatten().map(|table| table.markdown()).collect::<String>();
    }
    let across = tables::across_sets(results);
    if !across.is_empty() {
        text += "## Out of distribution\n\n";
        text += &across.iter().map(|table| table.markdown()).collect::<String>();
    }
    text += &words::made_by(plan).markdown();
    Ok(text + &plain(&words::method()) + "\n")
}
