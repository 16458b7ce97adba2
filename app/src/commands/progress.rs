//! How far long work is: a bar where standard error is a terminal, else a line there for every unit of work, with the time
//! that is left.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Units that come faster than this share a line.
const LEAST_PAUSE: Duration = Duration::from_secs(1);
/// So do those that come within this part of the time that the work has taken, so that a log of days stays readable.
const PART: u32 = 100;

/// Tells how far work of many units is. May be told from any thread.
pub(super) struct Progress {
    what: String,
    of: usize,
    /// Units that were there before.
    begun_at: usize,
    done: AtomicUsize,
    started: Instant,
    bar: ProgressBar,
    /// When the last line was written; `None` where lines are none of its business.
    lines: Option<Mutex<Option<Duration>>>,
}

impl Progress {
    /// Of `of` units of work that is called `what`. A single unit is not worth a word.
    pub fn new(what: impl Into<String>, of: usize) -> Self {
        let is_terminal = std::io::stderr().is_terminal();
        let lines = (!is_terminal && of > 1).then(Mutex::default);
        Self { lines, ..Self::bar(what, of) }
    }

    /// The same without lines, for commands that print one per unit themselves.
    pub fn bar(what: impl Into<String>, of: usize) -> Self {
        let what = what.into();
        let is_shown = std::io::stderr().is_terminal() && of > 1;
        let style = ProgressStyle::with_template("{prefix} {bar:24} {pos}/{len} {msg}").expect("a constant template");
        let bar = if is_shown { ProgressBar::new(of as u64) } else { ProgressBar::hidden() };
        let bar = bar.with_style(style).with_prefix(what.clone());
        Self { what, of, begun_at: 0, done: AtomicUsize::new(0), started: Instant::now(), bar, lines: None }
    }

    /// The same with `done` units that were there before and took no time.
    pub fn with_done(self, done: usize) -> Self {
        self.bar.set_position(done as u64);
        Self { begun_at: done, done: AtomicUsize::new(done), ..self }
    }

    /// One more unit is done.
    pub fn inc(&self) {
        self.at(self.done.fetch_add(1, Ordering::Relaxed) + 1);
    }

    /// So many units are done; the rest is expected to go on as it went.
    pub fn at(&self, done: usize) {
        let (made, to_come) = (done.saturating_sub(self.begun_at), self.of.saturating_sub(done));
        if made > 0 {
            self.at_with(done, self.started.elapsed().mul_f64(to_come as f64 / made as f64));
        }
    }

    /// So many units are done, and the rest is expected to take so long.
    pub fn at_with(&self, done: usize, left: Duration) {
        self.tell(done, left, None);
    }

    fn tell(&self, done: usize, left: Duration, rate: Option<&str>) {
        self.bar.set_position(done as u64);
        let rate = rate.map_or(String::new(), |rate| format!("{rate}, "));
        self.bar.set_message(format!("{rate}about {} left", words(left)));
        let Some(lines) = &self.lines else { return };
        let mut said = lines.lock().unwrap_or_else(PoisonError::into_inner);
        let now = self.started.elapsed();
        if is_due(*said, now, done >= self.of) {
            *said = Some(now);
            eprintln!("{}", line(&self.what, [self.begun_at, done, self.of], &rate, now, left));
        }
    }

    /// So many units are done, and what is told of how fast it goes.
    pub fn at_rate(&self, done: usize, rate: &str) {
        let (made, to_come) = (done.saturating_sub(self.begun_at), self.of.saturating_sub(done));
        if made > 0 {
            let left = self.started.elapsed().mul_f64(to_come as f64 / made as f64);
            self.tell(done, left, Some(rate));
        }
    }

    /// What is being done, for the bar.
    pub fn doing(&self, what: &'static str) {
        self.bar.set_message(what);
    }

    /// Lets somebody write to the terminal while the bar is out of the way.
    pub fn suspend<T>(&self, write: impl FnOnce() -> T) -> T {
        self.bar.suspend(write)
    }

    /// The work is over, or given up.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// Whether a line is due: for the first unit, for later ones after a pause, and for the last one always.
fn is_due(said: Option<Duration>, now: Duration, is_last: bool) -> bool {
    said.is_none_or(|said| is_last || now.saturating_sub(said) >= LEAST_PAUSE.max(now / PART))
}

fn line(what: &str, [begun_at, done, of]: [usize; 3], rate: &str, elapsed: Duration, left: Duration) -> String {
    if done >= of {
        return format!("{what}: {done}/{of} in {}", words(elapsed));
    }
    let each = elapsed.as_secs_f64() / done.saturating_sub(begun_at).max(1) as f64;
    format!("{what}: {done}/{of}, {each:.1} s each, {rate}about {} left", words(left))
}

/// A time in words: `3 h 12 min`, `5 min`, `40 s`.
pub(super) fn words(time: Duration) -> String {
    let seconds = time.as_secs();
    match seconds {
        0..60 => format!("{seconds} s"),
        60..3600 => format!("{} min", (seconds + 30) / 60),
        _ => format!("{} h {:02} min", seconds / 3600, seconds % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn seconds(number: u64) -> Duration {
        Duration::from_secs(number)
    }

    #[test]
    fn the_first_and_the_last_unit_have_a_line_and_quick_ones_share_one() {
        assert!(is_due(None, Duration::from_millis(3), false), "the first");
        assert!(!is_due(Some(seconds(10)), Duration::from_millis(10_900), false));
        assert!(is_due(Some(seconds(10)), seconds(11), false));
        assert!(is_due(Some(seconds(10)), Duration::from_millis(10_001), true), "the last");
        // After three hours a line comes every 108 seconds at most.
        assert!(!is_due(Some(seconds(10_700)), seconds(10_800), false));
        assert!(is_due(Some(seconds(10_690)), seconds(10_800), false));
    }

    #[test]
    fn a_line_tells_what_how_far_and_how_long_still() {
        let told = line("calibrate", [0, 12, 300], "", seconds(24), seconds(576));
        assert_eq!(told, "calibrate: 12/300, 2.0 s each, about 10 min left");
        // What was there before took no time.
        let told = line("data", [100, 110, 200], "7.1 pushes per second, ", seconds(20), seconds(180));
        assert_eq!(told, "data: 110/200, 2.0 s each, 7.1 pushes per second, about 3 min left");
        assert_eq!(line("data", [100, 200, 200], "", seconds(200), seconds(0)), "data: 200/200 in 3 min");
    }

    #[test]
    fn times_are_told_in_words() {
        let told = [0, 59, 60, 89, 90, 3600, 11_520].map(|s| words(seconds(s)));
        assert_eq!(told, ["0 s", "59 s", "1 min", "1 min", "2 min", "1 h 00 min", "3 h 12 min"]);
    }
}
