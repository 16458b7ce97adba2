//! `scripts/install.sh`: the program runs from its prefix when the checkout is gone, and goes away again without a trace.

use nudge_tests::{in_own_mounts, nudge_bin, program_bin, root, text, with_small_disk};
use serde_json::Value;
use std::fs::{create_dir_all, read_to_string, set_permissions, write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn script(args: &[&Path]) -> Command {
    let mut command = Command::new(root().join("scripts/install.sh"));
    command.args(args).env_remove("DESTDIR");
    command
}

fn install(prefix: &Path) -> Output {
    script(&[&nudge_bin(), prefix]).output().expect("bash")
}

fn refused(output: &Output) -> String {
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert_eq!(stderr.lines().count(), 1, "one line: {stderr}");
    stderr.trim().to_owned()
}

/// All files below a folder, from there.
fn files_below(folder: &Path) -> Vec<String> {
    let said = Command::new("find").arg(folder).args(["!", "-type", "d", "-printf", "%P\\n"]).output().expect("find");
    let mut files: Vec<String> = text(&said.stdout).lines().map(str::to_owned).collect();
    files.sort();
    files
}

/// A folder that other users may look into, for a prefix with a space in its name.
fn stage() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("folder");
    set_permissions(folder.path(), std::fs::Permissions::from_mode(0o755)).expect("may be looked into");
    let prefix = folder.path().join("pre fix");
    (folder, prefix)
}

/// Runs the installed program in a folder with nothing in its environment, while the checkout, cargo's target folder and
/// the libtorch that it was linked against are hidden from it. Where the system does not let anybody hide them, it says so
/// and runs all the same.
fn alone(prefix: &Path, folder: &Path, args: &[&str]) -> Output {
    let script = "cd \"$1\" && shift\nwhile [ \"$1\" != -- ]; do [ ! -d \"$1\" ] || mount -t tmpfs tmpfs \"$1\" || exit 77; \
                  shift; done\nshift\n\
                  exec env -i PATH=/usr/bin:/bin \"$@\"";
    let mut command = in_own_mounts(script);
    command.arg(folder).args(hidden()).arg("--").arg(prefix.join("bin/nudge")).args(args);
    let output = command.output().expect("unshare starts");
    if output.status.code() != Some(77) && !text(&output.stderr).starts_with("unshare:") {
        return output;
    }
    eprintln!("not checked: this system lets nobody hide the checkout: {}", text(&output.stderr).trim());
    let mut command = Command::new(prefix.join("bin/nudge"));
    command.args(args).current_dir(folder).env_clear().env("PATH", "/usr/bin:/bin").output().expect("nudge starts")
}

/// The checkout, the built program's folder, and the folders of the libraries that it finds by its run path.
fn hidden() -> Vec<PathBuf> {
    let mut hidden = vec![root(), nudge_bin().parent().expect("a folder").to_owned()];
    let run_path = run_path(&program_bin());
    hidden.extend(run_path.split(':').filter(|at| at.starts_with('/')).map(PathBuf::from).filter(|at| at.is_dir()));
    hidden
}

fn run_path(program: &Path) -> String {
    let said = Command::new("readelf").arg("-d").arg(program).output().expect("readelf");
    let line = text(&said.stdout)
        .lines()
        .find(|line| line.contains("(RUNPATH)") || line.contains("(RPATH)"))
        .map(str::to_owned);
    line.and_then(|line| Some(line.split_once('[')?.1.trim_end_matches(']').to_owned())).unwrap_or_default()
}

/// The paths of shared libraries of a program that are not the system's.
fn foreign_libraries(program: &Path) -> Vec<PathBuf> {
    let said = Command::new("ldd").arg(program).env_remove("LD_LIBRARY_PATH").output().expect("ldd");
    let listed = text(&said.stdout);
    assert!(!listed.contains("not found"), "{listed}");
    let paths = listed.lines().filter_map(|line| Some(line.split_once(" => ")?.1.rsplit_once(" (")?.0));
    let paths = paths.filter(|path| !path.starts_with("/lib") && !path.starts_with("/usr/lib"));
    paths.map(|path| Path::new(path).canonicalize().expect("a library")).collect()
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|_| panic!("{} {}", text(&output.stdout), text(&output.stderr)))
}

#[test]
fn the_installed_program_runs_when_the_checkout_is_gone_and_leaves_without_a_trace() {
    let (folder, prefix) = stage();
    let output = install(&prefix);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let has = |file: &str| prefix.join(file).is_file();
    for file in [
        "share/nudge/scenes/high/tunnel.toml",
        "share/nudge/assets/views/standard300.toml",
        "share/nudge/assets/robots/ur5_2f85.urdf",
        "share/man/man1/nudge.1",
        "share/man/man1/nudge-scene-check.1",
        "share/bash-completion/completions/nudge",
        "share/zsh/site-functions/_nudge",
        "share/fish/vendor_completions.d/nudge.fish",
    ] {
        assert!(has(file), "{file} is missing");
    }

    // What it says of itself, from a folder that has nothing to do with it.
    let doctor = alone(&prefix, folder.path(), &["doctor", "--json"]);
    let found = json(&doctor);
    assert_eq!(found["problems"], serde_json::json!([]));
    assert!(doctor.status.success());
    let at = |below: &str| Value::from(prefix.join(below).to_str().expect("utf-8"));
    assert_eq!(found["program"], at("libexec/nudge-program"));
    assert_eq!(found["weights"]["folder"], at("share/nudge/models"));
    assert_eq!(found["weights"]["load"] == true, found["networks"] == true);
    assert_eq!(found["scenes"]["folder"], at("share/nudge/scenes"));
    for file in [
        "share/applications/nudge.desktop",
        "share/mime/packages/nudge.xml",
        "share/icons/hicolor/scalable/apps/nudge.svg",
    ] {
        assert_eq!(has(file), found["window"] == true, "{file}");
    }
    if found["networks"] == true {
        assert_eq!(
            (&found["libtorch"]["folder"], &found["libtorch"]["version"]),
            (&at("lib/nudge"), &Value::from("2.13.0"))
        );
        let program = prefix.join("libexec/nudge-program");
        assert!(run_path(&program).starts_with("$ORIGIN/../lib/nudge:"));
        let libraries = foreign_libraries(&program);
        assert!(libraries.iter().any(|path| path.ends_with("libtorch_cpu.so")), "{libraries:?}");
        let inside = prefix.join("lib/nudge").canonicalize().expect("libraries");
        assert!(libraries.iter().all(|path| path.starts_with(&inside)), "{libraries:?}");
    }

    // An episode of the demo scene, from the root of the disk.
    let out = folder.path().join("episode");
    let scene = prefix.join("share/nudge/scenes/demo/first-look.toml");
    let args =
        ["run", scene.to_str().expect("utf-8"), "--budget", "3", "--json", "--out", out.to_str().expect("utf-8")];
    let run = alone(&prefix, Path::new("/"), &args);
    assert!(run.status.success(), "{}", text(&run.stderr));
    assert_eq!(json(&run)["steps"].as_array().map(Vec::len), Some(3));

    runs_as_another_user(&prefix, folder.path());

    // Installed again, it takes away what is no longer part of it, and keeps what a person has put there.
    let manifest = prefix.join("share/nudge/manifest.txt");
    let gone = prefix.join("share/nudge/scenes/former/gone.toml");
    create_dir_all(gone.parent().expect("a folder")).expect("made");
    write(&gone, "").expect("written");
    write(prefix.join("share/nudge/scenes/mine.toml"), "").expect("written");
    // … also what an installation that was killed has left.
    let killed = prefix.join(".nudge-install.killed");
    create_dir_all(killed.join("bin")).expect("made");
    let listed = read_to_string(&manifest).expect("a list");
    write(&manifest, format!("{listed}file share/nudge/scenes/former/gone.toml\n")).expect("written");
    let output = install(&prefix);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(!gone.parent().expect("a folder").exists() && !killed.exists());
    assert_eq!(read_to_string(&manifest).expect("a list"), listed);

    // The copy of the script that was installed removes it.
    let uninstall =
        Command::new("bash").arg(prefix.join("share/nudge/install.sh")).arg("--uninstall").arg(&prefix).output();
    let uninstall = uninstall.expect("bash");
    assert!(uninstall.status.success(), "{}", text(&uninstall.stderr));
    assert_eq!(files_below(&prefix), ["share/nudge/scenes/mine.toml"]);
    let again = script(&[Path::new("--uninstall"), &prefix]).output().expect("bash");
    assert!(refused(&again).contains("there is no installation"));
}

/// Another user finds and may read everything, whatever the umask of who installed it.
fn runs_as_another_user(prefix: &Path, folder: &Path) {
    for file in files_below(prefix) {
        let mode = prefix.join(&file).metadata().expect("a file").permissions().mode();
        assert_eq!(mode & 0o004, 0o004, "{file} cannot be read by others");
    }
    let own = folder.join("of nobody");
    create_dir_all(&own).expect("made");
    let mut command = Command::new("setpriv");
    command.args(["--reuid=65534", "--regid=65534", "--clear-groups"]).arg(prefix.join("bin/nudge"));
    command.args(["doctor", "--json"]).current_dir(&own).env_clear().env("PATH", "/usr/bin:/bin").env("HOME", &own);
    if std::os::unix::fs::chown(&own, Some(65534), Some(65534)).is_err() {
        eprintln!("not checked: only root can run the program as another user");
        return;
    }
    let doctor = command.output().expect("setpriv");
    assert_eq!(json(&doctor)["problems"], serde_json::json!([]));
    assert!(doctor.status.success());
}

/// The two programs in a prefix of their own, and the libraries' folder that they look into first.
fn prefix_without_libraries(prefix: &Path) -> PathBuf {
    for (from, to) in [(nudge_bin(), "bin/nudge"), (program_bin(), "libexec/nudge-program")] {
        let to = prefix.join(to);
        create_dir_all(to.parent().expect("a folder")).expect("made");
        std::fs::copy(from, to).expect("copied");
    }
    let libraries = prefix.join("lib/nudge");
    create_dir_all(&libraries).expect("made");
    libraries
}

#[test]
fn a_library_that_is_missing_or_damaged_is_told_in_one_line_by_the_program_and_not_by_the_loader() {
    if !run_path(&program_bin()).contains("libtorch") {
        eprintln!("not checked: this build needs no libtorch");
        return;
    }
    let (folder, prefix) = stage();
    let libraries = prefix_without_libraries(&prefix);
    let missing = alone(&prefix, folder.path(), &["settings"]);
    // It finds libtorch where nobody may hide it; `alone` has said so then.
    if !missing.status.success() {
        let missing = refused(&missing);
        assert!(missing.contains("libtorch_cpu.so, libc10.so not found; this is libtorch"), "{missing}");
    }
    write(libraries.join("libtorch_cpu.so"), "").expect("written");
    let damaged = refused(&alone(&prefix, folder.path(), &["settings"]));
    assert!(damaged.contains("lib/nudge/libtorch_cpu.so: file too short; this is libtorch"), "{damaged}");
    std::fs::remove_file(prefix.join("libexec/nudge-program")).expect("removed");
    let gone = refused(&alone(&prefix, folder.path(), &["settings"]));
    assert!(gone.contains("bin/nudge-program: there is no such program"), "{gone}");
}

#[test]
fn destdir_goes_before_the_prefix_and_a_relative_prefix_is_one_of_this_folder() {
    let (folder, _) = stage();
    let package = folder.path().join("package");
    let output = script(&[&nudge_bin(), Path::new("/usr")]).env("DESTDIR", &package).output().expect("bash");
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(package.join("usr/bin/nudge").is_file());
    if let Ok(entry) = read_to_string(package.join("usr/share/applications/nudge.desktop")) {
        assert!(entry.contains("Exec=\"/usr/bin/nudge\" open %f\n"), "{entry}");
    }
    let output =
        script(&[Path::new("--uninstall"), Path::new("usr")]).env("DESTDIR", "").current_dir(&package).output();
    assert!(output.expect("bash").status.success());
    assert!(files_below(&package).is_empty(), "{:?}", files_below(&package));
}

#[test]
fn a_full_disk_leaves_what_was_there() {
    let (folder, _) = stage();
    let disk = folder.path().join("disk");
    create_dir_all(&disk).expect("made");
    let Some(seen) = with_small_disk(&disk, 8, script(&[&nudge_bin(), &disk.join("pre fix")])) else { return };
    let line = refused(&seen.output);
    assert!(
        line.contains("no room in") && line.contains("MB are needed") && line.contains("nothing was installed"),
        "{line}"
    );
    assert!(seen.left.is_empty(), "{:?}", seen.left);
}

#[test]
fn what_cannot_be_installed_is_refused_in_one_line_and_nothing_is_touched() {
    let (_folder, prefix) = stage();
    // Nobody can write below /proc, root neither.
    let line = refused(&install(Path::new("/proc/nudge")));
    assert!(line.contains("/proc/nudge") && line.contains("choose another PREFIX"), "{line}");
    let line = refused(&script(&[Path::new("no-such-nudge"), &prefix]).output().expect("bash"));
    assert!(line.contains("no-such-nudge: no such program"), "{line}");
    // A program of the same name that somebody else has put there.
    create_dir_all(prefix.join("bin")).expect("made");
    write(prefix.join("bin/nudge"), "of somebody else").expect("written");
    let line = refused(&install(&prefix));
    assert!(line.contains("bin/nudge is there already"), "{line}");
    assert_eq!(files_below(&prefix), ["bin/nudge"]);
    assert_eq!(std::fs::read_dir(&prefix).expect("a folder").count(), 1);
    // A list that leads out of the prefix is not followed.
    create_dir_all(prefix.join("share/nudge")).expect("made");
    write(prefix.join("share/nudge/manifest.txt"), "file ../precious\n").expect("written");
    write(prefix.with_file_name("precious"), "").expect("written");
    let line = refused(&script(&[Path::new("--uninstall"), &prefix]).output().expect("bash"));
    assert!(line.contains("does not lie below the prefix"), "{line}");
    assert!(prefix.with_file_name("precious").exists());
}
