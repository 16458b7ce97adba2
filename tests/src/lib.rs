//! What the end-to-end tests share: running the binary, and the stock tools that read what it writes.

pub mod sources;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The `nudge` binary: `NUDGE_BIN`, or the one beside this test's own build.
pub fn nudge_bin() -> PathBuf {
    if let Some(path) = std::env::var_os("NUDGE_BIN") {
        return path.into();
    }
    let test = std::env::current_exe().expect("path of this test");
    let bin = test.parent().and_then(Path::parent).expect("target folder").join("nudge");
    assert!(bin.exists(), "{} is missing: build it first (make test does)", bin.display());
    bin
}

/// What `nudge` starts: it lies beside it.
pub fn program_bin() -> PathBuf {
    nudge_bin().with_file_name("nudge-program")
}

/// The repository's root.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("workspace").to_owned()
}

/// Runs `nudge` with arguments and waits for it.
pub fn nudge(args: &[&str]) -> Output {
    Command::new(nudge_bin()).args(args).current_dir(root()).output().expect("nudge starts")
}

/// Runs `nudge`, expects success and returns what it printed.
pub fn nudge_ok(args: &[&str]) -> String {
    let output = nudge(args);
    assert!(output.status.success(), "nudge {args:?}: {}\n{}", output.status, text(&output.stderr));
    text(&output.stdout)
}

/// Whether a line tells how far long work is: `regress: 3/14, 2.0 s each, about 22 s left`.
pub fn is_progress(line: &str) -> bool {
    let Some((_, said)) = line.split_once(": ") else { return false };
    let share = said.split([',', ' ']).next().and_then(|share| share.split_once('/'));
    let is_number = |text: &str| !text.is_empty() && text.chars().all(|c| c.is_ascii_digit());
    share.is_some_and(|(done, of)| is_number(done) && is_number(of))
        && (said.contains(" in ") || said.ends_with(" left"))
}

/// Runs `nudge`, expects exit code `code` and one line on stderr that tells no progress, and returns that line.
pub fn nudge_fails(code: i32, args: &[&str]) -> String {
    let output = nudge(args);
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "nudge {args:?}: {stderr}");
    let lines: Vec<&str> = stderr.lines().filter(|line| !line.starts_with("warning:") && !is_progress(line)).collect();
    assert_eq!(lines.len(), 1, "nudge {args:?} should say one line, said: {stderr}");
    lines[0].to_owned()
}

/// Bytes as text.
pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A tool of the virtual environment that `make test` sets up and names in `NUDGE_VENV`. `None` only where that is set to
/// nothing, which says that what needs the tool shall not be checked.
///
/// # Panics
/// Where nothing is said, and where the tool is missing: a test that checks nothing is not to pass in silence.
pub fn venv_tool(name: &str) -> Option<PathBuf> {
    let venv = std::env::var_os("NUDGE_VENV");
    let venv =
        venv.unwrap_or_else(|| panic!("{name} is needed: `make test` sets NUDGE_VENV; set it to nothing to skip"));
    if venv.is_empty() {
        eprintln!("not checked: NUDGE_VENV is empty, so there is no {name}");
        return None;
    }
    let tool = Path::new(&venv).join("bin").join(name);
    assert!(tool.exists(), "{} is missing", tool.display());
    Some(tool)
}

/// What a command did on a disk of a few megabytes.
pub struct OnSmallDisk {
    /// What it said.
    pub output: Output,
    /// The names of what it left on the disk.
    pub left: Vec<String>,
}

/// Runs a command while a disk of so many megabytes is mounted at `folder`, seen by that command alone. `None`, with a word
/// on stderr, where the system lets nobody mount one.
pub fn with_small_disk(folder: &Path, megabytes: u32, command: Command) -> Option<OnSmallDisk> {
    let listing = tempfile::NamedTempFile::new().expect("a file");
    let mount = format!("mount -t tmpfs -o size={megabytes}m tmpfs \"$1\"");
    let script =
        format!("{mount} || exit 77\nat=$1 list=$2\nshift 2\n\"$@\"\ncode=$?\nls -A \"$at\" >\"$list\"\nexit $code");
    let mut around = in_own_mounts(&script);
    around.arg(folder).arg(listing.path()).arg(command.get_program()).args(command.get_args());
    for (name, value) in command.get_envs() {
        match value {
            Some(value) => around.env(name, value),
            None => around.env_remove(name),
        };
    }
    let output = around.output().expect("unshare starts");
    if output.status.code() == Some(77) || text(&output.stderr).starts_with("unshare:") {
        eprintln!("not checked: this system lets nobody mount a small disk: {}", text(&output.stderr).trim());
        return None;
    }
    let left = std::fs::read_to_string(listing.path()).expect("a list").lines().map(str::to_owned).collect();
    Some(OnSmallDisk { output, left })
}

/// A shell script that may mount what nobody else sees; its arguments follow.
pub fn in_own_mounts(script: &str) -> Command {
    let mut command = Command::new("unshare");
    // Who is not root becomes it, as far as these mounts go.
    command.args(["--map-root-user", "--mount", "bash", "-c", script, "bash"]);
    command
}

/// A folder of one test's files.
pub struct Folder(tempfile::TempDir);

impl Folder {
    /// A new one, gone when this is dropped.
    #[expect(clippy::new_without_default, reason = "a folder on the disk is no default value")]
    pub fn new() -> Self {
        Self(tempfile::tempdir().expect("tempdir"))
    }

    /// The path of a file in it, or of the folder itself for an empty name.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// The path of a file that may not be there yet, as an argument.
    pub fn name(&self, name: &str) -> String {
        argument(&self.path(name))
    }

    /// Writes a file and returns its path as an argument.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> String {
        std::fs::write(self.path(name), content).expect("written");
        self.name(name)
    }
}

/// A path as an argument.
pub fn argument(path: &Path) -> String {
    path.to_str().expect("utf-8").to_owned()
}

/// A scene of the given objects that is quick to map: a small shelf of coarse voxels.
pub fn small_scene(objects: &str) -> String {
    format!("format = 1\nname = \"small\"\n[shelf]\nsize = [0.3, 0.2, 0.2]\nvoxel_m = 0.01\n{objects}")
}

/// A tin that stands in [`small_scene`].
pub const TIN: &str = "[[object]]\nclass = \"tomato_can\"\nposition = [0.0, 0.1]\n";
