//! The walls of the code: which modules may use which, how long files are, and where something new is added, as
//! ARCHITECTURE.md tells it.

use nudge_tests::root;
use nudge_tests::sources::{ModulePath, Sources, words};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

fn architecture() -> String {
    std::fs::read_to_string(root().join("ARCHITECTURE.md")).expect("ARCHITECTURE.md")
}

fn sources(of: &str) -> Sources {
    Sources::read(&root().join(of).join("src"))
}

/// The rows below a table's head that begins like `head`, cell by cell.
fn table(head: &str) -> Vec<Vec<String>> {
    let text = architecture();
    let rows = text.lines().skip_while(|line| !line.starts_with(head)).skip(2).take_while(|line| line.starts_with('|'));
    let cells = |line: &str| line.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect();
    let rows: Vec<Vec<String>> = rows.map(cells).collect();
    assert!(!rows.is_empty(), "no table begins with {head}");
    rows
}

/// What stands between backticks.
fn quoted(cell: &str) -> Vec<String> {
    cell.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// The module of a crate that another one is in, by its name; `crate` for what the root itself defines.
fn top(module: &ModulePath) -> &str {
    module.first().map_or("crate", String::as_str)
}

/// The uses from one top module to another, each with the files' modules: `model -> panels::maps`.
fn arrows(sources: &Sources) -> BTreeMap<(String, String), String> {
    let mut arrows = BTreeMap::new();
    for (from, used) in sources.uses() {
        for to in used.iter().filter(|to| top(to) != top(&from)) {
            let words = format!("{} -> {}", words(&from), words(to));
            arrows.insert((top(&from).to_owned(), top(to).to_owned()), words);
        }
    }
    arrows
}

#[test]
fn rooms_of_the_app_use_only_what_the_table_allows() {
    let rooms = table("| room | modules | may use |");
    let mut room_of = BTreeMap::new();
    for (at, row) in rooms.iter().enumerate() {
        for module in quoted(&row[1]) {
            assert_eq!(room_of.insert(module.clone(), at), None, "{module} is in two rooms");
        }
    }
    let app = sources("app");
    let there: BTreeSet<String> = app.modules().filter(|module| module.len() == 1).map(|m| m[0].clone()).collect();
    assert_eq!(there, room_of.keys().cloned().collect(), "every module stands in a room");
    let may_use: Vec<BTreeSet<usize>> = rooms
        .iter()
        .map(|row| {
            let named = row[2].split(';').map(str::trim).filter(|name| !name.is_empty());
            let at = |name: &str| rooms.iter().position(|row| row[0] == name).unwrap_or_else(|| panic!("no {name}"));
            named.map(at).collect()
        })
        .collect();
    for (room, used) in may_use.iter().enumerate() {
        assert!(used.iter().all(|used| *used < room), "{} may use only rooms above it", rooms[room][0]);
    }
    for ((from, to), words) in arrows(&app) {
        let (Some(&from), Some(&to)) = (room_of.get(&from), room_of.get(&to)) else { continue };
        let allowed = from == to || may_use[from].contains(&to);
        assert!(allowed, "{words}: {} may not use {}", rooms[from][0], rooms[to][0]);
    }
}

#[test]
fn modules_of_the_core_use_only_the_ones_before_them() {
    let street: Vec<String> = table("| module | what it holds |").iter().flat_map(|row| quoted(&row[0])).collect();
    let core = sources("core");
    let place = |module: &str| street.iter().position(|name| name == module);
    for name in &street {
        assert!(core.modules().any(|module| module == std::slice::from_ref(name)), "{name} is no module of core");
    }
    for ((from, to), words) in arrows(&core) {
        match (place(&from), place(&to)) {
            (Some(from), Some(to)) => assert!(to < from, "{words}: a module may use only the ones before it"),
            (None, Some(_)) => assert_eq!(from, "crate", "{words}: what is used by all may use none of the street"),
            (_, None) => {}
        }
    }
}

#[test]
fn no_modules_use_each_other_in_a_circle() {
    let told = |circles: Vec<Vec<ModulePath>>| -> Vec<String> {
        circles.iter().map(|circle| circle.iter().map(words).collect::<Vec<_>>().join(", ")).collect()
    };
    let (core, app) = (sources("core"), sources("app"));
    assert_eq!(told(core.circles_between_rooms()), [""; 0]);
    assert_eq!(told(app.circles_between_rooms()), [""; 0]);
    let in_workbench = app.circles().into_iter().filter(|circle| circle.iter().any(|m| top(m) == "workbench"));
    assert_eq!(told(in_workbench.collect()), [""; 0]);
}

#[test]
fn no_file_is_longer_than_500_lines_and_half_have_at_most_160() {
    let mut lengths = Vec::new();
    let mut folders: Vec<PathBuf> = ["core/src", "app/src"].iter().map(|folder| root().join(folder)).collect();
    while let Some(folder) = folders.pop() {
        for path in std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("listed").path()) {
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|end| end == "rs") {
                lengths.push((std::fs::read_to_string(&path).expect("text").lines().count(), path));
            }
        }
    }
    lengths.sort();
    let (longest, path) = lengths.last().expect("files");
    assert!(*longest <= 500, "{} has {longest} lines", path.display());
    let median = lengths[lengths.len() / 2].0;
    assert!(median <= 160, "the median of {} files is {median} lines", lengths.len());
}

#[test]
fn what_is_added_is_added_in_the_files_that_are_listed() {
    let rows = table("| to add | like | named as | files |");
    let named: Vec<&str> = rows.iter().map(|row| row[0].as_str()).collect();
    for kind in ["a policy", "a planner setting", "a belief update", "a skill", "an environment", "a panel", "a layout"]
    {
        assert!(named.contains(&kind), "nothing tells how to add {kind}");
    }
    let crates = ["core", "app"].map(|of| (of, sources(of)));
    for row in &rows {
        let (what, like) = (&row[0], &quoted(&row[1])[0]);
        // Files, and not what is said of them in brackets.
        let listed: BTreeSet<String> = quoted(&row[3]).into_iter().filter(|word| word.contains('/')).collect();
        for file in &listed {
            assert!(root().join(file).is_file(), "{what}: {file} is not there");
        }
        let snippets = quoted(&row[2]);
        if snippets.is_empty() {
            continue;
        }
        let mut naming: BTreeSet<String> = BTreeSet::new();
        for (of, sources) in &crates {
            let files = snippets.iter().flat_map(|snippet| sources.naming(snippet));
            naming.extend(files.map(|file| format!("{of}/src/{}", file.display())));
        }
        // Its own file need not name it.
        let own = format!("/{like}.rs");
        let listed: BTreeSet<String> = listed.into_iter().filter(|file| !file.ends_with(&own)).collect();
        naming.retain(|file| !file.ends_with(&own));
        assert_eq!(naming, listed, "{what}, like {like}: where the code names it, and where ARCHITECTURE.md says");
    }
}
