//! A cache of what is computed from samples, limited by memory.

use std::collections::HashMap;

/// Memory for what is kept of one kind, bytes.
const ROOM: usize = 6 << 30;

/// What was made of samples, by sample number.
#[derive(Debug)]
pub(super) struct Kept<T> {
    made: HashMap<usize, T>,
    bytes: usize,
    /// What does not fit and is asked for now.
    last: Option<T>,
}

impl<T> Default for Kept<T> {
    fn default() -> Self {
        Self { made: HashMap::new(), bytes: 0, last: None }
    }
}

impl<T> Kept<T> {
    /// What is made of sample `number`: kept, or made now.
    pub(super) fn of(&mut self, number: usize, make: impl FnOnce() -> T, bytes: impl Fn(&T) -> usize) -> &T {
        if !self.made.contains_key(&number) {
            let made = make();
            let size = bytes(&made);
            if self.bytes + size > ROOM {
                return self.last.insert(made);
            }
            self.bytes += size;
            self.made.insert(number, made);
        }
        &self.made[&number]
    }
}
