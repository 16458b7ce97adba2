//! `scripts/libtorch.sh` where something is missing: the network, room on the disk, the right version. What PyPI's wheels
//! hold is played by small ones, and what pip does by a stand-in where the real one would fetch half a gigabyte.

use nudge_tests::{root, text, with_small_disk};
use std::fs::{create_dir_all, read_to_string, write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// In place of `python3`: pip copies wheels from a folder, fails at the one that `PIP_FAILS_AT` names, and writes down what
/// it copied; everything else is the real Python's.
const PYTHON: &str = r#"#!/bin/bash
[ "$1 $2" = "-m pip" ] || exec "$REAL_PYTHON" "$@"
[ "$3" = download ] || exit 0
case "$*" in *--help*) exit 0 ;; esac
to=${!#}
wanted=$(cut -d = -f 1 "$to/wanted.txt")
if [ "$wanted" = "${PIP_FAILS_AT:-}" ]; then echo "ERROR: the connection broke" >&2; exit 1; fi
for wheel in "$WHEELS/${wanted//-/_}"-*.whl; do
    [ -e "$to/${wheel##*/}" ] || { cp "$wheel" "$to" && echo "$wanted" >>"$WHEELS/log"; }
done
"#;

/// Makes the three wheels in a folder; the library of torch is so many MB larger than it need be.
const MAKE_WHEELS: &str = r#"
import sys, zipfile
folder, library, more = sys.argv[1], open(sys.argv[2], "rb").read(), bytes(int(sys.argv[3]) * 2**20)
def wheel(name, files):
    with zipfile.ZipFile(f"{folder}/{name}-py3-none-manylinux_2_28_x86_64.whl", "w", zipfile.ZIP_DEFLATED) as archive:
        for path, content in files.items():
            archive.writestr(path, content)
wheel("nvidia_cuda_runtime-13.0.96", {"nvidia/cu13/lib/libcudart.so.13": library})
wheel("nvidia_cuda_cupti-13.0.85", {"nvidia/cu13/lib/libcupti.so.13": library})
wheel("torch-2.13.0", {
    "torch/include/torch/version.h": "// a header\n", "torch/lib/libtorch_cpu.so": library + more,
    "torch/lib/libc10.so": library, "torch/lib/libgomp.so.1": library, "torch/lib/libtorch_cuda.so": more})
"#;

struct Stage {
    folder: tempfile::TempDir,
}

impl Stage {
    /// With wheels whose libraries are so many MB larger than they need be.
    fn new(more_mb: u32) -> Self {
        let stage = Self { folder: tempfile::tempdir().expect("folder") };
        create_dir_all(stage.at("bin")).expect("made");
        create_dir_all(stage.at("wheels")).expect("made");
        stage.tool("python3", PYTHON);
        let (source, library) = (stage.at("a.c"), stage.at("a.so"));
        write(&source, "int a;\n").expect("written");
        let compiled = Command::new("gcc").args(["-shared", "-fPIC", "-o"]).args([&library, &source]).status();
        assert!(compiled.expect("gcc").success());
        let mut make = Command::new("python3");
        make.args(["-c", MAKE_WHEELS]).arg(stage.at("wheels")).arg(&library).arg(more_mb.to_string());
        assert!(make.status().expect("python3").success());
        stage
    }

    fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// A program that goes before the system's one of that name.
    fn tool(&self, name: &str, script: &str) {
        let path = self.at("bin").join(name);
        write(&path, script).expect("written");
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).expect("may be executed");
    }

    /// `scripts/libtorch.sh` for a folder, with these tools and wheels.
    fn script(&self, to: &Path) -> Command {
        let mut command = script(&[to.to_str().expect("utf-8")]);
        let path = std::env::var("PATH").expect("PATH");
        command.env("PATH", format!("{}:{path}", self.at("bin").display()));
        command.env("REAL_PYTHON", real_python()).env("WHEELS", self.at("wheels"));
        command
    }

    /// What the stand-in for pip has copied, in its order.
    fn copied(&self) -> Vec<String> {
        read_to_string(self.at("wheels/log")).unwrap_or_default().lines().map(str::to_owned).collect()
    }
}

fn real_python() -> String {
    let said = Command::new("python3").args(["-c", "import sys; print(sys.executable)"]).output().expect("python3");
    text(&said.stdout).trim().to_owned()
}

fn script(args: &[&str]) -> Command {
    let mut command = Command::new(root().join("scripts/libtorch.sh"));
    command.args(args).env_remove("LIBTORCH").env_remove("NUDGE_LIBTORCH");
    command
}

/// Expects a refusal and returns its line; lines before it may only tell which wheel is fetched.
fn refused(output: &Output) -> String {
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(output.stdout.is_empty(), "{}", text(&output.stdout));
    let lines: Vec<&str> = stderr.lines().filter(|line| !line.contains("==") || line.contains("could not")).collect();
    assert_eq!(lines.len(), 1, "one line: {stderr}");
    lines[0].to_owned()
}

fn names_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder").flatten();
    let mut names: Vec<String> = entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn a_download_that_broke_off_is_gone_on_with() {
    let stage = Stage::new(0);
    let to = stage.at("lib torch");
    let line = refused(&stage.script(&to).env("PIP_FAILS_AT", "torch").output().expect("bash"));
    assert!(line.contains("torch==2.13.0") && line.contains("run again"), "{line}");
    assert!(!to.exists() && !stage.at("lib torch.part").exists());
    assert_eq!(stage.copied(), ["nvidia-cuda-runtime", "nvidia-cuda-cupti"]);

    let output = stage.script(&to).output().expect("bash");
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(text(&output.stdout), format!("{}\n", to.display()));
    assert_eq!(stage.copied(), ["nvidia-cuda-runtime", "nvidia-cuda-cupti", "torch"]);
    let libraries =
        ["libc10.so", "libcudart.so.13", "libcupti.so.13", "libgomp.so.1", "libtorch.so", "libtorch_cpu.so"];
    assert_eq!(names_in(&to.join("lib")), libraries);
    assert!(to.join("include/torch/version.h").exists());
    assert!(!stage.at("lib torch.wheels").exists() && !stage.at("lib torch.part").exists());

    // Once it is there, nothing is asked of pip.
    stage.tool("python3", "#!/bin/sh\nexit 1\n");
    let output = stage.script(&to).output().expect("bash");
    assert_eq!(text(&output.stdout), format!("{}\n", to.display()), "{}", text(&output.stderr));
    // One of another version is made anew.
    write(to.join("build-version"), "2.12.0\n").expect("written");
    stage.tool("python3", PYTHON);
    assert!(stage.script(&to).output().expect("bash").status.success());
    assert_eq!(read_to_string(to.join("build-version")).expect("read"), "2.13.0\n");
}

#[test]
fn without_a_network_one_line_says_what_to_do() {
    let folder = tempfile::tempdir().expect("folder");
    let to = folder.path().join("libtorch");
    let mut command = script(&[to.to_str().expect("utf-8")]);
    // Nothing listens at the port: the real pip finds no index.
    command.env("PIP_INDEX_URL", "http://127.0.0.1:9/simple").env("PIP_RETRIES", "0");
    command.env_remove("PIP_FIND_LINKS").env_remove("PIP_NO_INDEX").env_remove("PIP_EXTRA_INDEX_URL");
    let line = refused(&command.output().expect("bash"));
    for word in ["no package index that has it can be reached", "run again", "LIBTORCH"] {
        assert!(line.contains(word), "{word:?} is not in: {line}");
    }
    assert!(!to.exists());
}

#[test]
fn a_wheel_that_is_not_the_expected_one_is_refused() {
    let stage = Stage::new(0);
    let to = stage.at("libtorch");
    let mut command = script(&[to.to_str().expect("utf-8")]);
    // The real pip, which finds these wheels and no others.
    command.env("PIP_NO_INDEX", "1").env("PIP_FIND_LINKS", stage.at("wheels"));
    let line = refused(&command.output().expect("bash"));
    assert!(line.contains("nvidia-cuda-runtime==13.0.96: ERROR: THESE PACKAGES DO NOT MATCH THE HASHES"), "{line}");
    assert!(!to.exists());
}

#[test]
fn too_little_room_is_told_before_anything_is_fetched() {
    let stage = Stage::new(0);
    stage.tool("df", "#!/bin/sh\necho head\necho disk 0 0 300 0 /\n");
    let line = refused(&stage.script(&stage.at("libtorch")).output().expect("bash"));
    assert!(line.contains("MB are needed and 300 MB are free"), "{line}");
    assert!(stage.copied().is_empty());
}

#[test]
fn a_disk_that_fills_while_unpacking_keeps_nothing_half_unpacked() {
    let stage = Stage::new(20);
    // It says that there is room, as a disk does that others write to as well.
    stage.tool("df", "#!/bin/sh\necho head\necho disk 0 0 9999 0 /\n");
    let disk = stage.at("disk");
    create_dir_all(&disk).expect("made");
    let Some(seen) = with_small_disk(&disk, 10, stage.script(&disk.join("libtorch"))) else { return };
    let line = refused(&seen.output);
    assert!(line.contains("no room in") && line.contains("21 MB are needed"), "{line}");
    assert_eq!(seen.left, ["libtorch.wheels"], "only what the next run goes on with");
}

#[test]
fn a_libtorch_of_another_version_is_refused_with_both_versions() {
    let folder = tempfile::tempdir().expect("folder");
    let at = |name: &str| folder.path().join(name);
    let run = || script(&[]).env("LIBTORCH", folder.path()).output().expect("bash");
    let line = refused(&run());
    assert!(line.contains("has no lib/libtorch"), "{line}");
    create_dir_all(at("lib")).expect("made");
    write(at("lib/libtorch_cpu.so"), "").expect("written");
    let unknown = run();
    assert!(unknown.status.success() && text(&unknown.stderr).contains("does not tell its version"));

    create_dir_all(at("include/torch/headeronly")).expect("made");
    let header = "#define TORCH_VERSION_MAJOR 2\n#define TORCH_VERSION_MINOR 12\n#define TORCH_VERSION_PATCH 1\n";
    write(at("include/torch/headeronly/version.h"), header).expect("written");
    let line = refused(&run());
    assert!(line.contains("2.12.1") && line.contains("2.13.0"), "{line}");
    write(at("build-version"), "2.13.0+cu130\n").expect("written");
    let right = run();
    assert_eq!(text(&right.stdout), format!("{}\n", folder.path().display()), "{}", text(&right.stderr));
}

#[test]
fn a_folder_of_something_else_is_not_replaced() {
    let folder = tempfile::tempdir().expect("folder");
    write(folder.path().join("thesis.txt"), "years of work").expect("written");
    let mut command = script(&[folder.path().to_str().expect("utf-8")]);
    // Should it go on after all, it shall not fetch half a gigabyte.
    let line = refused(&command.env("PIP_NO_INDEX", "1").output().expect("bash"));
    assert!(line.contains("is no libtorch"), "{line}");
    assert_eq!(names_in(folder.path()), ["thesis.txt"]);
}
