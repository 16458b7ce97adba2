//! Where the gain of a step's action comes from, by voxel, and a label that says what gain it is.

use super::{Setting, shapes};
use crate::record::decision::{length, thousands};
use nudge_core::camera::ViewId;
use nudge_core::episode::StepOutcome;
use nudge_core::gain::RayDensity;
use nudge_core::plan::{self, Action};
use nudge_core::scene::Shelf;

/// How far the label hangs above the shelf, metres.
const ABOVE_M: f32 = 0.04;

/// A gain with where it comes from.
pub struct Gain {
    /// Voxel positions and their nats.
    pub nats: Vec<(usize, f32)>,
    /// What it is, in words, with its sum.
    pub words: String,
}

impl Gain {
    fn new(what: &str, nats: Vec<(usize, f32)>) -> Option<Self> {
        let sum: f64 = nats.iter().map(|(_, nats)| f64::from(*nats)).sum();
        let words = format!("{what}: {} nats", thousands(sum));
        (!nats.is_empty()).then_some(Self { nats, words })
    }

    /// The words above the shelf.
    pub fn label(&self, shelf: &Shelf) -> rerun::Points3D {
        let [_, depth, height] = shelf.size;
        shapes::words([0.0, 0.5 * depth, height + ABOVE_M], &self.words)
    }
}

/// The gain of a step's action, by what gains were before it: what the view gains, or what the push is worth by the planner's
/// own measure under the prediction that changed the belief. `None` where the action promised nothing or was not weighed.
pub fn of(setting: &Setting<'_>, gain: &plan::Gain, outcome: &StepOutcome) -> Option<Gain> {
    let record = &outcome.record;
    let done = match record.action {
        Action::Manipulate(manipulation) => manipulation,
        Action::Look { .. } if record.decision.gains.is_empty() => return None,
        Action::Look { view } => {
            let nats = gain.per_voxel(setting.views, view, RayDensity::FULL);
            return Gain::new(&format!("Gain of the look from view {}", view.0), nats);
        }
    };
    let prediction = outcome.prediction.as_ref()?;
    let offered: Vec<ViewId> = setting.views.views.iter().map(|view| view.id).collect();
    let offered: Vec<ViewId> = offered.into_iter().filter(|view| !setting.unreachable.contains(view)).collect();
    let best = record.decision.candidates.iter().find(|candidate| candidate.manipulation == done)?.view;
    let sources = gain.push_sources(setting.views, &offered, prediction, best)?;
    let stalled = record.push.as_ref().is_some_and(|report| report.stalled);
    let far = if stalled { format!(", as far as it went ({})", length(record)?) } else { String::new() };
    Gain::new(&format!("Worth of the {}{far}, {}", done.kind().name(), sources.words), sources.nats)
}
