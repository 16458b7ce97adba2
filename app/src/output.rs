//! Standard output and standard error, behind one wall.
//!
//! What a command prints is for whoever reads along, and its work does not depend on it: an error of the output ends the
//! output, never the work, and is told at the end. A reader that has seen enough (`| head`) is no error at all. The
//! standard library's `println!` and `eprintln!` would panic instead, so the macros of these names here stand in for
//! them in the whole crate.

use std::io::{ErrorKind, Write};
use std::sync::Mutex;

/// What has become of standard output.
enum Output {
    Open,
    /// Nobody reads it any more.
    Closed,
    /// It failed; what the system said, until that has been told.
    Failed(Option<std::io::Error>),
}

static OUTPUT: Mutex<Output> = Mutex::new(Output::Open);

/// Writes to standard output, unless it has ended.
pub(crate) fn print(text: &str) {
    let mut output = OUTPUT.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if !matches!(*output, Output::Open) {
        return;
    }
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Ok(()) => {}
        Err(error) if error.kind() == ErrorKind::BrokenPipe => *output = Output::Closed,
        Err(error) => *output = Output::Failed(Some(error)),
    }
}

/// Writes to standard error; there is nowhere to tell that this failed.
pub(crate) fn print_error(text: &str) {
    let _ = std::io::stderr().lock().write_all(text.as_bytes());
}

/// Why standard output ended before everything was printed, once.
pub(crate) fn take_fault() -> Option<std::io::Error> {
    match &mut *OUTPUT.lock().unwrap_or_else(std::sync::PoisonError::into_inner) {
        Output::Failed(error) => error.take(),
        Output::Open | Output::Closed => None,
    }
}

/// Prints a line to standard output.
macro_rules! println {
    () => { $crate::output::print("\n") };
    ($($words:tt)*) => { $crate::output::print(&(::std::format!($($words)*) + "\n")) };
}

/// Prints a line to standard error.
macro_rules! eprintln {
    ($($words:tt)*) => { $crate::output::print_error(&(::std::format!($($words)*) + "\n")) };
}
