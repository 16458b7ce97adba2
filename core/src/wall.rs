//! The wall around third-party code that reads what people bring along: where it breaks, the file is refused.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};

thread_local! {
    static GUARDING: Cell<usize> = const { Cell::new(0) };
}

/// Runs `read`; a panic inside becomes an error.
pub(crate) fn guarded<T>(read: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    GUARDING.set(GUARDING.get() + 1);
    let outcome = catch_unwind(AssertUnwindSafe(read));
    GUARDING.set(GUARDING.get() - 1);
    outcome.unwrap_or_else(|_| Err("cannot be read: its content breaks the reader".to_owned()))
}

/// Whether a panic of this thread is caught and told as an error, so that a panic hook need not print it.
pub fn is_guarding() -> bool {
    GUARDING.get() > 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_of_a_reader_is_an_error_and_ends_the_guard() {
        let broken: Result<(), String> = guarded(|| {
            assert!(is_guarding());
            panic!("as foreign code does")
        });
        assert!(broken.is_err_and(|message| message.contains("breaks the reader")));
        assert_eq!((guarded(|| Ok(3)), is_guarding()), (Ok(3), false));
    }
}
