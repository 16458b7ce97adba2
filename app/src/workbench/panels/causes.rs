//! Which steps changed a voxel or a floor cell, and by what: looks that saw it, pushes that swept it or were predicted
//! to change it, and networks that changed it without either.

use super::floor::in_window;
use super::words;
use crate::colors;
use crate::workbench::changes::{CHANGED, shares};
use crate::workbench::model::Picked;
use crate::workbench::session::{Moment, Session};
use nudge_core::belief::{CNABU, beta_mean};
use nudge_core::camera::UNOBSERVED;
use nudge_core::episode::StepOutcome;
use nudge_core::grid::{Grid, VoxelSet};
use nudge_core::plan::Action;
use nudge_core::scene::{CLASS_COUNT, Catalog, ClassId};

/// A predicted probability of change below this is not worth a line.
const WORTH_TELLING: f32 = 0.01;

/// A step that changed what was asked about.
pub struct Change {
    /// Its number, counted from 1.
    pub step: usize,
    /// What was done, in words.
    pub action: String,
    /// What that did to it, in words.
    pub causes: Vec<String>,
    /// Before and after: a voxel's probability, a cell's certainty.
    pub from_to: [f32; 2],
}

/// The steps that changed a voxel or a cell, which must be the grid's.
pub fn of(session: &Session, picked: Picked) -> Vec<Change> {
    let grid = *session.moment(0).belief.grid();
    let subject = Subject::of(&session.setup.catalog, &session.record.config.belief, grid, picked);
    session.moments.windows(2).filter_map(|pair| subject.change(&pair[0], &pair[1])).collect()
}

/// What made the change of a voxel or a cell, which must be the grid's, from one state to the next, in words.
pub fn of_step(catalog: &Catalog, update: &str, [before, after]: [&Moment; 2], picked: Picked) -> String {
    Subject::of(catalog, update, *after.belief.grid(), picked).causes(before, after, true).join(", ")
}

/// The probability of a cell's likeliest class.
pub fn certainty(moment: &Moment, cell: usize) -> f32 {
    let a = moment.belief.cell(cell);
    a.iter().copied().fold(0.0, f32::max) / a.iter().sum::<f32>()
}

/// What is asked about.
struct Subject<'a> {
    catalog: &'a Catalog,
    /// The belief update's name.
    update: &'a str,
    grid: Grid,
    cell: usize,
    /// `None` for the whole column.
    voxel: Option<usize>,
}

impl<'a> Subject<'a> {
    /// A voxel or a cell, which must be the grid's.
    fn of(catalog: &'a Catalog, update: &'a str, grid: Grid, picked: Picked) -> Self {
        let (cell, voxel) = match picked {
            Picked::Voxel(voxel) => (voxel / grid.dims[2], Some(voxel)),
            Picked::Cell(cell) => (cell, None),
        };
        Self { catalog, update, grid, cell, voxel }
    }

    fn change(&self, before: &Moment, after: &Moment) -> Option<Change> {
        let outcome = after.outcome.as_ref()?;
        let number = |moment: &Moment| match self.voxel {
            Some(voxel) => beta_mean(moment.belief.voxel(voxel)),
            None => certainty(moment, self.cell),
        };
        let from_to = [number(before), number(after)];
        let mut changed = (from_to[1] - from_to[0]).abs() > CHANGED;
        if self.voxel.is_none() {
            let [from, to] = [before, after].map(|moment| shares(&moment.belief.cell(self.cell)));
            changed |= from.iter().zip(to).any(|(from, to)| (to - from).abs() > CHANGED);
        }
        let causes = self.causes(before, after, changed);
        let action = match outcome.record.action {
            Action::Look { view } => format!("look from view {}", view.0),
            Action::Manipulate(done) => done.kind().name().to_owned(),
        };
        (!causes.is_empty()).then_some(Change { step: after.step, action, causes, from_to })
    }

    /// What a step did to it, in words; of one that changed it there is at least one.
    fn causes(&self, before: &Moment, after: &Moment, changed: bool) -> Vec<String> {
        let Some(outcome) = after.outcome.as_ref() else { return Vec::new() };
        if !after.is_whole {
            return if changed { vec!["not known until its log is checked".to_owned()] } else { Vec::new() };
        }
        let mut causes = self.seen(outcome);
        causes.extend(self.pushed(outcome));
        if causes.is_empty() && changed {
            causes.push(self.unseen(outcome));
        }
        let label = |moment: &Moment| moment.truth.as_ref()?.labels.get(self.cell).copied();
        if let (before, Some(label)) = (label(before), label(after))
            && before != Some(label)
        {
            causes.push(format!("what stands there became {}", self.class(label)));
        }
        causes
    }

    /// What a look saw of it.
    fn seen(&self, outcome: &StepOutcome) -> Vec<String> {
        let Some(observation) = &outcome.observation else { return Vec::new() };
        let mut causes = Vec::new();
        if let Some(voxel) = self.voxel {
            if observation.free.contains(voxel) {
                causes.push("a ray passed it (free)".to_owned());
            } else if observation.occupied.contains(voxel) {
                causes.push("a ray met it (occupied)".to_owned());
            }
            return causes;
        }
        let count = |set: &VoxelSet| self.grid.column(self.cell).filter(|voxel| set.contains(*voxel)).count();
        let (free, occupied) = (count(&observation.free), count(&observation.occupied));
        if free + occupied > 0 {
            causes.push(format!("rays passed {free} voxels (free) and met {occupied} (occupied)"));
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
                causes.push("swept by the tool".to_owned());
            }
        }
        if let Some(prediction) = &outcome.prediction {
            let at = in_window(&prediction.window, &self.grid, self.cell);
            let change = at.and_then(|at| prediction.change.get(at)).copied().unwrap_or(0.0);
            if change >= WORTH_TELLING {
                causes.push(format!("predicted to change with probability {}", words::probability(change)));
            }
        }
        causes
    }

    /// What changed it although the step neither saw nor moved it: the belief update itself.
    fn unseen(&self, outcome: &StepOutcome) -> String {
        let update = if self.update == CNABU { "network" } else { "belief update" };
        match outcome.record.action {
            Action::Look { .. } => format!("{update}, not seen"),
            Action::Manipulate(_) => format!("{update}, neither swept nor predicted to change"),
        }
    }

    fn class(&self, label: u8) -> String {
        colors::class_title(self.catalog, ClassId(label))
    }
}
