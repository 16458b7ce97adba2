//! What became of each object: the scorer's verdict, and a person's where it differs.

use nudge_core::score::{ObjectVerdict, Verdict};

/// A verdict of the scorer with what a person made of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    /// The object's name: `tomato_can#2`; a hallucinated one is named after its place, `tomato_can@(0.12, 0.30)`.
    pub name: String,
    /// What the scorer says.
    pub proposed: ObjectVerdict,
    /// What a person says instead.
    pub overruled: Option<Verdict>,
}

impl Judged {
    /// Verdicts that nobody has overruled.
    pub fn by_scorer(proposed: &[ObjectVerdict]) -> Vec<Self> {
        let judged = |proposed: &ObjectVerdict| Self {
            name: object_name(proposed),
            proposed: proposed.clone(),
            overruled: None,
        };
        proposed.iter().map(judged).collect()
    }

    /// The verdict that counts.
    pub fn verdict(&self) -> Verdict {
        self.overruled.unwrap_or(self.proposed.verdict)
    }
}

/// An object's name in verdict tables and in `notes.json`.
pub fn object_name(verdict: &ObjectVerdict) -> String {
    let [x, y] = verdict.position;
    match verdict.object {
        Some(object) => format!("{}#{object}", verdict.class),
        None => format!("{}@({x:.2}, {y:.2})", verdict.class),
    }
}

/// A verdict in words.
pub fn verdict_title(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Found => "found",
        Verdict::Misclassified => "misclassified",
        Verdict::NotFound => "not found",
        Verdict::Hallucinated => "hallucinated",
    }
}

/// All verdicts, in the order of tables.
pub const VERDICTS: [Verdict; 4] = [Verdict::Found, Verdict::Misclassified, Verdict::NotFound, Verdict::Hallucinated];
