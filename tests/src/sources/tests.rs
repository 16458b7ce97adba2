use super::*;

fn sources(files: &[(&str, &str)]) -> Sources {
    Sources::of(files.iter().map(|(path, text)| (PathBuf::from(path), (*text).to_owned())).collect())
}

fn uses(sources: &Sources, module: &str) -> Vec<String> {
    let module: ModulePath = module.split("::").map(str::to_owned).collect();
    sources.uses()[&module].iter().map(words).collect()
}

#[test]
fn a_file_uses_what_its_paths_name() {
    let sources = sources(&[
        ("lib.rs", "pub mod a;\npub mod b;\nmod c;\nmod d;\nmod e;"),
        ("a.rs", "use crate::{b::{self, One}, c::f as g};\n// use crate::e;\nfn x() { b::two(\"crate::e::x\") }"),
        ("b.rs", "pub struct One; pub fn two(_: &str) {} "),
        ("c.rs", "pub fn f() { let _ = super::d::x(); let c = '\"'; crate::b::two(c) }"),
        ("d.rs", "/* crate::a */ pub fn x<'a>() {}"),
        (
            "e.rs",
            "#[cfg(test)]\nmod tests { use crate::a; }\n#[cfg(test)]\nuse crate::b;\nmod inner { use super::F; }\nstruct F;",
        ),
    ]);
    assert_eq!(uses(&sources, "a"), ["b", "c"]);
    assert_eq!(uses(&sources, "c"), ["b", "d"]);
    assert!(uses(&sources, "d").is_empty() && uses(&sources, "e").is_empty());
    assert!(sources.circles().is_empty());
}

#[test]
fn who_names_a_reexport_uses_what_is_behind_it() {
    let sources = sources(&[
        ("lib.rs", "mod a; mod b;"),
        ("a.rs", "mod inner; mod other; pub use inner::Thing;"),
        ("a/inner.rs", "pub struct Thing;"),
        ("a/other.rs", "use super::Thing; fn f(_: Thing) {}"),
        ("b.rs", "fn f() { let _ = crate::a::Thing; }"),
    ]);
    assert_eq!(uses(&sources, "b"), ["a::inner"]);
    assert_eq!(uses(&sources, "a::other"), ["a::inner"]);
    assert!(uses(&sources, "a").is_empty());
}

#[test]
fn a_circle_over_three_files_is_found() {
    let files = [
        ("lib.rs", "mod model; mod panels; mod toasts;"),
        ("model.rs", "use crate::panels::State; pub struct Model(State);"),
        ("panels.rs", "mod maps; pub struct State(maps::State);"),
        ("panels/maps.rs", "use super::super::model::Model; pub struct State;"),
        ("toasts.rs", "use crate::model::Model;"),
    ];
    let circles = sources(&files).circles();
    assert_eq!(circles.len(), 1);
    assert_eq!(circles[0].iter().map(words).collect::<Vec<_>>(), ["model", "panels", "panels::maps"]);
}

#[test]
fn a_child_may_use_what_its_parent_defines_but_not_an_uncle_that_uses_them() {
    let mut files = vec![
        ("lib.rs", "mod a; mod b;"),
        ("a.rs", "mod child; pub struct Thing; fn f() { child::g() }"),
        ("a/child.rs", "use super::Thing; pub fn g() {}"),
        ("b.rs", "use crate::a::Thing;"),
    ];
    assert_eq!((sources(&files).circles().len(), sources(&files).circles_between_rooms().len()), (1, 0));
    files[2].1 = "use crate::b::h; pub fn g() {}";
    assert_eq!(sources(&files).circles_between_rooms()[0].len(), 3);
}

#[test]
fn snippets_are_found_in_code_but_not_in_comments_or_tests() {
    let sources = sources(&[
        ("lib.rs", "mod a; mod b; mod c;"),
        ("a.rs", "fn f() { Kind :: One; }"),
        ("b.rs", "// Kind::One\nfn f() { MyKind::One; Kind::OneMore; \"Kind::One\" }"),
        ("c.rs", "#[cfg(test)]\n#[allow(dead_code)]\nmod tests { fn f() { Kind::One } }\nfn g() { \"one\" }"),
    ]);
    assert_eq!(sources.naming("Kind::One").into_iter().collect::<Vec<_>>(), [Path::new("a.rs")]);
    assert_eq!(sources.naming("\"one\"").into_iter().collect::<Vec<_>>(), [Path::new("c.rs")]);
}
