//! Undo and redo: states before and after changes, with a whole gesture as one step.

/// What a change belongs to. Changes of one gesture that follow each other are one step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edit {
    /// A step of its own.
    Once,
    /// Moving with the pointer.
    Move,
    /// Turning with the pointer.
    Turn,
    /// Moving with the arrow keys.
    Nudge,
    /// Changing a field, by its name.
    Field(&'static str),
}

/// Steps that are kept.
const MOST: usize = 200;

/// What was and what will have been.
#[derive(Clone, Debug)]
pub struct History<T> {
    past: Vec<T>,
    future: Vec<T>,
    open: Option<Edit>,
}

impl<T> Default for History<T> {
    /// Nothing was done yet.
    fn default() -> Self {
        Self { past: Vec::new(), future: Vec::new(), open: None }
    }
}

impl<T: PartialEq> History<T> {
    /// Takes down that `before` was changed.
    pub fn record(&mut self, before: T, edit: Edit) {
        self.future.clear();
        if self.open == Some(edit) && edit != Edit::Once {
            return;
        }
        self.open = Some(edit);
        self.past.push(before);
        if self.past.len() > MOST {
            self.past.remove(0);
        }
    }

    /// Ends a gesture; one that came back to where it began leaves no step.
    pub fn settle(&mut self, now: &T) {
        if self.open.take().is_some() && self.past.last() == Some(now) {
            self.past.pop();
        }
    }

    /// The state before the last step, in exchange for the one now.
    pub fn undo(&mut self, now: T) -> Result<T, T> {
        self.settle(&now);
        match self.past.pop() {
            Some(before) => {
                self.future.push(now);
                Ok(before)
            }
            None => Err(now),
        }
    }

    /// The state after the step that was taken back last, in exchange for the one now.
    pub fn redo(&mut self, now: T) -> Result<T, T> {
        match self.future.pop() {
            Some(after) => {
                self.open = None;
                self.past.push(now);
                Ok(after)
            }
            None => Err(now),
        }
    }

    /// Whether there is something to take back.
    pub fn has_undo(&self) -> bool {
        !self.past.is_empty()
    }

    /// Whether there is something to do again.
    pub fn has_redo(&self) -> bool {
        !self.future.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gesture_is_one_step_and_a_new_change_forgets_what_was_undone() {
        let mut history = History::default();
        for before in [0, 1, 2] {
            history.record(before, Edit::Move);
        }
        history.settle(&3);
        history.record(3, Edit::Move);
        assert_eq!(history.undo(4), Ok(3));
        assert_eq!(history.undo(3), Ok(0));
        assert_eq!(history.undo(0), Err(0));
        assert_eq!(history.redo(0), Ok(3));
        history.record(3, Edit::Once);
        assert!(!history.has_redo());
        history.record(7, Edit::Once);
        assert_eq!(history.undo(8), Ok(7));
        assert_eq!(history.undo(7), Ok(3));
    }

    #[test]
    fn coming_back_to_the_start_leaves_no_step() {
        let mut history = History::default();
        history.record(0, Edit::Turn);
        history.settle(&0);
        assert!(!history.has_undo());
    }
}
