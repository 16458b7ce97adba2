//! Remarks on a step as pages: a person's note, and the verdict on each object.

use crate::verdicts::{Judged, VERDICTS, verdict_title};
use std::fmt::Write as _;

/// A note as a page.
pub fn note_page(note: Option<&str>) -> String {
    match note.map(str::trim).filter(|note| !note.is_empty()) {
        // Markdown joins lines; a person who breaks them means it.
        Some(note) => note.replace('\n', "  \n") + "\n",
        None => "*No note on this step*\n".to_owned(),
    }
}

/// Verdicts as a page: totals, and a table in which a person's are marked.
pub fn verdict_page(judged: &[Judged]) -> String {
    if judged.is_empty() {
        return "*Objects are judged after the first step*\n".to_owned();
    }
    let totals = VERDICTS.map(|verdict| {
        let count = judged.iter().filter(|judged| judged.verdict() == verdict).count();
        format!("{count} {}", verdict_title(verdict))
    });
    let mut page = format!("**{}**\n\n| object | verdict | x, y (m) |\n|:--|:--|:--|\n", totals.join(" · "));
    for judged in judged {
        let [x, y] = judged.proposed.position;
        let verdict = match judged.overruled {
            Some(verdict) => {
                let scorer = verdict_title(judged.proposed.verdict);
                format!("**{}** (by hand; the scorer says {scorer})", verdict_title(verdict))
            }
            None => verdict_title(judged.proposed.verdict).to_owned(),
        };
        // Writing into a string cannot fail.
        let _ = writeln!(page, "| {} | {verdict} | {x:.2}, {y:.2} |", judged.name);
    }
    page
}

#[cfg(test)]
mod tests {
    use super::*;
    use nudge_core::score::{ObjectVerdict, Verdict};

    #[test]
    fn pages_tell_who_judged_what() {
        let verdict = |object: Option<u16>, verdict: Verdict| ObjectVerdict {
            object,
            class: "gum_tin".to_owned(),
            verdict,
            position: [0.1, 0.2],
        };
        let proposed = [verdict(Some(3), Verdict::NotFound), verdict(None, Verdict::Hallucinated)];
        let mut judged = Judged::by_scorer(&proposed);
        judged[0].overruled = Some(Verdict::Found);
        let page = verdict_page(&judged);
        assert!(page.starts_with("**1 found · 0 misclassified · 0 not found · 1 hallucinated**"), "{page}");
        assert!(page.contains("| gum_tin#3 | **found** (by hand; the scorer says not found) | 0.10, 0.20 |"), "{page}");
        assert!(page.contains("| gum_tin@(0.10, 0.20) | hallucinated |"), "{page}");
        assert_eq!(note_page(Some("two\nlines")), "two  \nlines\n");
        assert_eq!(note_page(Some("  ")), note_page(None));
    }
}
