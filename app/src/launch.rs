//! The program `nudge`: starts `nudge-program`, which everything is in, and says in one line what that lacks.
//!
//! `nudge-program` needs libtorch, and where a shared library is missing the system's loader ends a program before its
//! first line, in words of its own. So this one, which needs none, asks the loader first (as `ldd` does, 1 to 10 ms).

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

/// The name of the program that everything is in.
const PROGRAM: &str = "nudge-program";

fn main() -> ExitCode {
    let error = match program() {
        Ok(program) => missing(&program).unwrap_or_else(|| become_it(&program)),
        Err(error) => error,
    };
    eprintln!("nudge: {error}");
    ExitCode::from(2)
}

/// The program: beside this one, as cargo builds it, or in `libexec`, as `make install` lays it out.
fn program() -> Result<PathBuf, String> {
    let this = std::env::current_exe().map_err(|error| format!("the path of this program: {error}"))?;
    let folder = this.parent().unwrap_or(Path::new("/"));
    let places = [folder.join(PROGRAM), folder.join("../libexec").join(PROGRAM)];
    let beside = places[0].display().to_string();
    places.into_iter().find(|place| place.is_file()).ok_or_else(|| {
        format!(
            "{beside}: there is no such program, which `nudge` only starts; run `make demo` or `make install` again"
        )
    })
}

/// What keeps the loader from starting a program, and what helps.
fn missing(program: &Path) -> Option<String> {
    if !cfg!(target_os = "linux") {
        return None;
    }
    let asked = Command::new(program).env("LD_TRACE_LOADED_OBJECTS", "1").output().ok()?;
    let (listed, said) = (String::from_utf8_lossy(&asked.stdout), String::from_utf8_lossy(&asked.stderr));
    let missing: Vec<&str> = listed.lines().filter_map(|line| line.trim().strip_suffix(" => not found")).collect();
    let what = if missing.is_empty() {
        // Such as: PROGRAM: error while loading shared libraries: FILE: file too short
        let last = said.lines().next().filter(|_| !asked.status.success())?;
        last.rsplit_once("shared libraries: ").map_or(last, |(_, what)| what).to_owned()
    } else {
        format!("{} not found", missing.join(", "))
    };
    let is_libtorch = ["libtorch", "libc10"].iter().any(|name| what.contains(name));
    let remedy = if is_libtorch {
        "this is libtorch, which runs the networks: run `make demo` (or `make install`) in the checkout again, which fetches \
         it, or name its folder `lib` in LD_LIBRARY_PATH"
    } else {
        "a shared library of the system: run `make demo` (or `make workbench`) in the checkout, which installs it"
    };
    Some(format!("{what}; {remedy}"))
}

/// How the window's allocator (glibc's) gives memory back: large blocks as soon as they are freed, and few heaps for its many
/// threads. Beliefs of megabytes that come and go otherwise leave hundreds of megabytes unused but taken.
const WINDOW_ALLOCATOR: [(&str, &str); 3] =
    [("MALLOC_ARENA_MAX", "2"), ("MALLOC_MMAP_THRESHOLD_", "1048576"), ("MALLOC_TRIM_THRESHOLD_", "1048576")];

/// What the program's surroundings get beside what they hold: for the window the allocator's settings, unless a person chose
/// others.
fn settings() -> impl Iterator<Item = (&'static str, &'static str)> {
    let is_window = std::env::args_os().nth(1).is_none_or(|first| first == "open");
    WINDOW_ALLOCATOR.into_iter().filter(move |(name, _)| is_window && std::env::var_os(name).is_none())
}

/// Turns this process into the program, with what was typed; comes back only with an error.
#[cfg(unix)]
fn become_it(program: &Path) -> String {
    use std::os::unix::process::CommandExt;
    let error = Command::new(program).arg0("nudge").args(std::env::args_os().skip(1)).envs(settings()).exec();
    format!("{}: {error}", program.display())
}

/// Runs the program and ends as it does.
#[cfg(not(unix))]
fn become_it(program: &Path) -> String {
    match Command::new(program).args(std::env::args_os().skip(1)).envs(settings()).status() {
        Ok(status) => std::process::exit(status.code().unwrap_or(2)),
        Err(error) => format!("{}: {error}", program.display()),
    }
}
