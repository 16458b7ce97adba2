use super::libtorch::{folder_of, version_of};
use super::*;
use nudge_core::places::FoundBy;
use std::path::Path;

#[test]
fn the_library_in_use_is_told_from_the_memory_map() {
    let maps = "7f00-7f01 r-xp 00000000 08:01 12   /usr/lib/libc.so.6\n\
                7f02-7f03 r-xp 00000000 08:01 13                         /home/a b/.local/lib/nudge/libtorch_cpu.so\n\
                7f04-7f05 rw-p 00000000 00:00 0\n";
    assert_eq!(folder_of(maps, "libtorch_cpu.so"), Some("/home/a b/.local/lib/nudge".into()));
    assert_eq!(folder_of(maps, "libtorch.so"), None);
}

#[test]
fn another_version_of_libtorch_is_a_problem_and_a_build_mark_is_none() {
    let folder = tempfile::tempdir().expect("folder");
    let lib = folder.path().join("lib");
    std::fs::create_dir_all(folder.path().join("include/torch/headeronly")).expect("made");
    std::fs::create_dir_all(&lib).expect("made");
    let told = |version: Option<String>| Libtorch { folder: Some(lib.clone()), version }.problem();
    assert_eq!(version_of(&lib), None);
    assert_eq!(told(None), None);
    let header =
        "#pragma once\n#define TORCH_VERSION_MAJOR 2\n#define TORCH_VERSION_MINOR 12\n#define TORCH_VERSION_PATCH 1\n";
    std::fs::write(folder.path().join("include/torch/headeronly/version.h"), header).expect("written");
    assert_eq!(version_of(&lib).as_deref(), Some("2.12.1"));
    let what = told(version_of(&lib)).expect("a problem").what;
    assert!(what.contains("2.12.1") && what.contains(WANTED), "{what}");
    std::fs::write(folder.path().join("build-version"), format!("{WANTED}+cu130\n")).expect("written");
    assert_eq!(told(version_of(&lib)), None);
}

#[test]
fn the_version_wanted_is_the_one_that_the_script_fetches() {
    let script = include_str!("../../../scripts/libtorch.sh");
    assert!(script.contains(&format!("wanted={WANTED}\n")), "scripts/libtorch.sh and doctor::WANTED differ");
}

#[test]
fn weights_that_are_not_there_and_weights_that_are_none_are_problems() {
    let mut problems = Vec::new();
    let none = weights(None, true, &mut problems);
    assert!(none.place.folder.is_none() && problems[0].what.contains("no weights were found"), "{problems:?}");
    assert!(problems[0].remedy.contains("NUDGE_MODELS"), "{problems:?}");

    let folder = tempfile::tempdir().expect("folder");
    let found = |path: &Path| Some(Found { path: path.to_owned(), by: FoundBy::Variable("NUDGE_MODELS") });
    problems.clear();
    weights(found(&folder.path().join("none")), true, &mut problems);
    assert!(problems[0].what.contains("there is no such folder, named by NUDGE_MODELS"), "{problems:?}");

    problems.clear();
    std::fs::write(folder.path().join(cnabu::OBSERVE_WEIGHTS), b"no weights").expect("written");
    let broken = weights(found(folder.path()), true, &mut problems);
    assert_eq!(broken.files[0].bytes, Some(10));
    let hash = nudge_core::files::sha256(b"no weights");
    assert_eq!(broken.files[0].sha256, Some(hash));
    assert_eq!((broken.files[1].bytes, &broken.files[1].sha256), (None, &None));
    assert_eq!(broken.load, Some(false));
    assert!(!cnabu::AVAILABLE || problems[0].what.contains("sigma_o."), "{problems:?}");
    assert_eq!(weights(found(folder.path()), false, &mut Vec::new()).load, None);
}

#[test]
fn a_folder_that_cannot_be_written_to_says_what_to_do_and_nothing_is_left_behind() {
    let folder = tempfile::tempdir().expect("folder");
    let fine = Folder::of("episodes", folder.path().join("out/deep"), "go elsewhere");
    assert!(fine.fault.is_none() && fine.free_bytes.is_some_and(|free| free > 0), "{fine:?}");
    assert_eq!(fine.problems().filter(|problem| problem.remedy == "go elsewhere").count(), 0);
    assert_eq!(std::fs::read_dir(folder.path()).expect("read").count(), 0);
    // Nobody can write below /proc, root neither.
    let refused = Folder::of("episodes", "/proc/out".into(), "go elsewhere");
    let problems: Vec<Problem> = refused.problems().collect();
    assert_eq!(problems.len(), 1, "{problems:?}");
    assert!(problems[0].what.starts_with("/proc/out: episodes cannot be written there"), "{problems:?}");
    assert!(!problems[0].what.contains(".partial-"), "{problems:?}");
}
