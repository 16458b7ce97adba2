//! Gives a reader changed files and watches it: no panic, no input that takes longer than [`SLOW`], no memory beyond
//! [`MEMORY`].
//!
//! A few hundred inputs by default, the same in every run. From the environment: `NUDGE_FUZZ`, how many inputs of each
//! target; `NUDGE_FUZZ_SECONDS`, after which a target ends early; `NUDGE_FUZZ_SEED`, for other inputs; `NUDGE_FUZZ_TRACE`, a
//! file that every input is written to before it is read, for what ends the whole process.

use super::change::{changed, input};
use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestError, TestRng, TestRunner};
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, Once, PoisonError};
use std::time::{Duration, Instant};

/// No input may take longer, at the fastest of three tries: on a machine where sound files take long, [`TIMES`] of theirs.
const SLOW: Duration = Duration::from_secs(2);
/// How many times as long as the slowest sound file an input may take, where that is more than [`SLOW`].
const TIMES: u32 = 10;
/// An input that takes longer ends the process.
const HANGS: Duration = Duration::from_secs(60);
/// No input may need more memory, bytes.
const MEMORY: u64 = 1 << 30;

/// What is to be read, and how.
pub struct Target<'a> {
    /// Its name in the printed table.
    pub name: &'a str,
    /// Sound files that inputs are made from.
    pub sound: Vec<Vec<u8>>,
    /// Words of the format.
    pub words: &'a [&'a str],
    /// How many inputs an ordinary run of the tests gives it: fewer where reading takes long.
    pub inputs: u32,
}

impl Target<'_> {
    /// Gives `read` inputs, and prints how many it took and refused. `read` tells whether it took its input.
    ///
    /// # Panics
    /// At an input that `read` panics at, or that takes too long or too much memory. The smallest such is kept in a file.
    pub fn run(self, mut read: impl FnMut(&[u8]) -> bool) {
        // One at a time: the memory that is watched is the process's.
        static ALONE: Mutex<()> = Mutex::new(());
        let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
        let mut slow = SLOW;
        for sound in &self.sound {
            let began = Instant::now();
            assert!(read(sound), "{}: a sound file is refused", self.name);
            slow = slow.max(TIMES * began.elapsed());
        }
        let number = |name: &str| std::env::var(name).ok().map(|text| text.parse::<u64>().expect("a number"));
        let count = number("NUDGE_FUZZ").map_or(self.inputs, |count| count.try_into().unwrap_or(u32::MAX));
        let limit = number("NUDGE_FUZZ_SECONDS").map(Duration::from_secs);
        let trace = std::env::var_os("NUDGE_FUZZ_TRACE").map(PathBuf::from);
        let config = Config {
            cases: count,
            failure_persistence: None,
            max_shrink_iters: 500,
            max_shrink_time: 20_000,
            ..Config::default()
        };
        let mut runner = TestRunner::new_with_rng(config, random(self.name, number("NUDGE_FUZZ_SEED").unwrap_or(0)));
        let (taken, refused) = (Cell::new(0_u64), Cell::new(0_u64));
        let watch = Watch::start(self.name, slow);
        let began = Instant::now();
        let read = std::cell::RefCell::new(&mut read);
        let outcome = runner.run(&input(), |(which, changes)| {
            if limit.is_some_and(|limit| began.elapsed() > limit) {
                return Ok(());
            }
            let file = changed(&self.sound[which.index(self.sound.len())], &changes, self.words);
            if let Some(trace) = &trace {
                std::fs::write(trace, &file).expect("the trace is written");
            }
            let was_taken = watch.over(&file, &mut **read.borrow_mut()).map_err(TestCaseError::fail)?;
            let counter = if was_taken { &taken } else { &refused };
            counter.set(counter.get() + 1);
            Ok(())
        });
        drop(watch);
        let (seconds, all) = (began.elapsed().as_secs_f64(), taken.get() + refused.get());
        println!(
            "{:<24}{all:>9} inputs {:>9} taken {:>9} refused {:>8.0} a second",
            self.name,
            taken.get(),
            refused.get(),
            all as f64 / seconds.max(1e-9)
        );
        match outcome {
            Ok(()) => {}
            Err(TestError::Fail(reason, (which, changes))) => {
                let file = changed(&self.sound[which.index(self.sound.len())], &changes, self.words);
                let kept = keep(self.name, &file);
                panic!("{}: {reason}\nthe input is kept in {}; its changes: {changes:?}", self.name, kept.display());
            }
            Err(TestError::Abort(reason)) => panic!("{}: {reason}", self.name),
        }
    }
}

/// A stream of random numbers of this target's own.
fn random(name: &str, seed: u64) -> TestRng {
    let mut start = [0_u8; 32];
    start[..8].copy_from_slice(&seed.to_le_bytes());
    for (at, byte) in name.bytes().enumerate() {
        start[8 + at % 24] ^= byte;
    }
    TestRng::from_seed(RngAlgorithm::ChaCha, &start)
}

fn keep(name: &str, file: &[u8]) -> PathBuf {
    let path = std::env::temp_dir().join(format!("nudge-fuzz-{}", name.replace([' ', '/'], "-")));
    let _ = std::fs::write(&path, file);
    path
}

/// What is being read, and since when.
type Reading = Arc<Mutex<Option<(Instant, Vec<u8>)>>>;

/// Watches over a reader.
struct Watch {
    reading: Reading,
    ended: Arc<AtomicBool>,
    said: Arc<Mutex<String>>,
    slow: Duration,
}

impl Watch {
    fn start(name: &str, slow: Duration) -> Self {
        let watch = Self { reading: Reading::default(), ended: Arc::default(), said: Arc::default(), slow };
        let (reading, ended, name) = (watch.reading.clone(), watch.ended.clone(), name.to_owned());
        std::thread::spawn(move || {
            while !ended.load(Ordering::Relaxed) {
                std::thread::sleep(Duration::from_millis(200));
                let reading = reading.lock().unwrap_or_else(PoisonError::into_inner);
                if let Some((since, file)) = &*reading
                    && since.elapsed() > HANGS
                {
                    let kept = keep(&name, file);
                    eprintln!("{name}: hangs; the input is kept in {}", kept.display());
                    std::process::exit(101);
                }
            }
        });
        listen(&watch.said);
        watch
    }

    /// Whether `read` takes the file.
    ///
    /// # Errors
    /// What is wrong with how it reads.
    fn over(&self, file: &[u8], read: &mut dyn FnMut(&[u8]) -> bool) -> Result<bool, String> {
        let before = peak_memory();
        let (was_taken, mut took) = self.once(file, read)?;
        let grown = peak_memory().saturating_sub(before);
        if grown > MEMORY {
            return Err(format!("takes {} MB of memory", grown >> 20));
        }
        // The machine may have had something else to do.
        for _ in 0..2 {
            if took > self.slow {
                took = took.min(self.once(file, read)?.1);
            }
        }
        if took > self.slow { Err(format!("takes {:.1} s", took.as_secs_f64())) } else { Ok(was_taken) }
    }

    fn once(&self, file: &[u8], read: &mut dyn FnMut(&[u8]) -> bool) -> Result<(bool, Duration), String> {
        let set = |reading| *self.reading.lock().unwrap_or_else(PoisonError::into_inner) = reading;
        let began = Instant::now();
        set(Some((began, file.to_vec())));
        let outcome = catch_unwind(AssertUnwindSafe(|| read(file)));
        let took = began.elapsed();
        set(None);
        let said = || self.said.lock().unwrap_or_else(PoisonError::into_inner).clone();
        outcome.map(|was_taken| (was_taken, took)).map_err(|_| format!("panics: {}", said()))
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
        *listener().lock().unwrap_or_else(PoisonError::into_inner) = None;
    }
}

/// Who wants to know what panics say.
fn listener() -> &'static Mutex<Option<Arc<Mutex<String>>>> {
    static LISTENER: Mutex<Option<Arc<Mutex<String>>>> = Mutex::new(None);
    &LISTENER
}

/// While somebody listens, panics are told to `said` and not printed.
fn listen(said: &Arc<Mutex<String>>) {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let usual = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            let listener = listener().lock().unwrap_or_else(PoisonError::into_inner).clone();
            match listener {
                Some(said) => *said.lock().unwrap_or_else(PoisonError::into_inner) = info.to_string(),
                None => usual(info),
            }
        }));
    });
    *listener().lock().unwrap_or_else(PoisonError::into_inner) = Some(said.clone());
}

/// The most address space that this process has had, bytes; 0 where the system does not tell.
fn peak_memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmPeak:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok());
    kilobytes.unwrap_or(0) << 10
}
