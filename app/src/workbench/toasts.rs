//! Messages that fade: what happened, to which file, and what can be done.

use std::time::{Duration, Instant};

/// How much a message matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// Good to know.
    Info,
    /// Something is not as asked.
    Warning,
    /// Something failed.
    Error,
}

/// A message on its way out.
#[derive(Clone, Debug)]
pub struct Toast {
    /// How much it matters.
    pub level: Level,
    /// What it says.
    pub text: String,
    since: Instant,
}

impl Toast {
    fn lasts(&self) -> Duration {
        match self.level {
            Level::Info => Duration::from_secs(4),
            Level::Warning => Duration::from_secs(8),
            // An error stays until it is closed or a minute has gone.
            Level::Error => Duration::from_secs(60),
        }
    }
}

/// The messages that are shown, the latest last.
#[derive(Clone, Debug, Default)]
pub struct Toasts {
    shown: Vec<Toast>,
}

impl Toasts {
    /// Adds a message; the same text twice is shown once.
    pub fn tell(&mut self, level: Level, text: impl Into<String>) {
        let text = text.into();
        self.shown.retain(|toast| toast.text != text);
        self.shown.push(Toast { level, text, since: Instant::now() });
    }

    /// The messages that have not faded yet.
    pub fn shown(&mut self) -> &[Toast] {
        self.shown.retain(|toast| toast.since.elapsed() < toast.lasts());
        &self.shown
    }

    /// Takes a message away.
    pub fn close(&mut self, text: &str) {
        self.shown.retain(|toast| toast.text != text);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_message_is_shown_once() {
        let mut toasts = Toasts::default();
        toasts.tell(Level::Info, "a");
        toasts.tell(Level::Error, "b");
        toasts.tell(Level::Error, "a");
        let texts: Vec<&str> = toasts.shown().iter().map(|toast| toast.text.as_str()).collect();
        assert_eq!(texts, ["b", "a"]);
        toasts.close("b");
        assert_eq!(toasts.shown().len(), 1);
    }
}
