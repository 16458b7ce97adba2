//! Which steps changed a voxel or a floor cell, and by what: looks that saw it, pushes that swept it or were predicted
//! to change it.

use super::floor::in_window;
use super::words;
use crate::colors;
use crate::workbench::model::Picked;
use crate::workbench::session::{Moment, Session};
use nudge_core::belief::beta_mean;
use nudge_core::camera::UNOBSERVED;
use nudge_core::episode::StepOutcome;
use nudge_core::grid::{Grid, VoxelSet};
use nudge_core::plan::Action;
use nudge_core::scene::{CLASS_COUNT, ClassId};

/// A predicted probability of change below this is not worth a line.
const WORTH_TELLING: f32 = 0.01;

/// A step that changed what was asked about.
pub struct Change {
    /// Its number, counted from 1.
    pub step: usize,
    /// What did it, in words.
    pub causes: Vec<String>,
    /// Before and after: a voxel's probability, a cell's certainty.
    pub from_to: [f32; 2],
}

/// The steps that changed a voxel or a cell, which must be the grid's.
pub fn of(session: &Session, picked: Picked) -> Vec<Change> {
    let grid = *session.moment(0).belief.grid();
    let (cell, voxel) = match picked {
        Picked::Voxel(voxel) => (voxel / grid.dims[2], Some(voxel)),
        Picked::Cell(cell) => (cell, None),
    };
    let subject = Subject { session, grid, cell, voxel };
    session.moments.windows(2).filter_map(|pair| subject.change(&pair[0], &pair[1])).collect()
}

/// The probability of a cell's likeliest class.
pub fn certainty(moment: &Moment, cell: usize) -> f32 {
    let a = moment.belief.cell(cell);
    a.iter().copied().fold(0.0, f32::max) / a.iter().sum::<f32>()
}

/// What is asked about.
struct Subject<'a> {
    session: &'a Session,
    grid: Grid,
    cell: usize,
    /// `None` for the whole column.
    voxel: Option<usize>,
}

impl Subject<'_> {
    fn change(&self, before: &Moment, after: &Moment) -> Option<Change> {
        let outcome = after.outcome.as_ref()?;
        let mut causes = self.seen(outcome);
        causes.extend(self.pushed(outcome));
        let labels = [before, after].map(|moment| moment.truth.labels.get(self.cell).copied());
        if let [before, Some(label)] = labels
            && before != Some(label)
        {
            causes.push(format!("what stands there became {}", self.class(label)));
        }
        let number = |moment: &Moment| match self.voxel {
            Some(voxel) => beta_mean(moment.belief.voxel(voxel)),
            None => certainty(moment, self.cell),
        };
        let from_to = [number(before), number(after)];
        (!causes.is_empty()).then_some(Change { step: after.step, causes, from_to })
    }

    /// What a look saw of it.
    fn seen(&self, outcome: &StepOutcome) -> Vec<String> {
        let (Some(observation), Action::Look { view }) = (&outcome.observation, outcome.record.action) else {
            return Vec::new();
        };
        let mut causes = Vec::new();
        let from = format!("from view {}", view.0);
        if let Some(voxel) = self.voxel {
            if observation.free.contains(voxel) {
                causes.push(format!("seen free {from}"));
            } else if observation.occupied.contains(voxel) {
                causes.push(format!("seen occupied {from}"));
            }
            return causes;
        }
        let count = |set: &VoxelSet| self.grid.column(self.cell).filter(|voxel| set.contains(*voxel)).count();
        let (free, occupied) = (count(&observation.free), count(&observation.occupied));
        if free + occupied > 0 {
            causes.push(format!("{free} voxels seen free, {occupied} occupied {from}"));
        }
        let label = observation.labels.get(self.cell).copied().unwrap_or(UNOBSERVED);
        if usize::from(label) < CLASS_COUNT {
            causes.push(format!("labelled {}", self.class(label)));
        }
        causes
    }

    /// What a push did to it.
    fn pushed(&self, outcome: &StepOutcome) -> Vec<String> {
        let mut causes = Vec::new();
        if let Some(push) = &outcome.swept {
            let swept = match self.voxel {
                Some(voxel) => push.swept.contains(voxel),
                None => self.grid.column(self.cell).any(|voxel| push.swept.contains(voxel)),
            };
            if swept {
                causes.push("push swept it".to_owned());
            }
        }
        if let Some(prediction) = &outcome.prediction {
            let at = in_window(&prediction.window, &self.grid, self.cell);
            let change = at.and_then(|at| prediction.change.get(at)).copied().unwrap_or(0.0);
            if change >= WORTH_TELLING {
                causes.push(format!("predicted change {}", words::probability(change)));
            }
        }
        causes
    }

    fn class(&self, label: u8) -> String {
        colors::class_title(&self.session.setup.catalog, ClassId(label))
    }
}
