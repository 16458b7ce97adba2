use super::*;
use crate::annotations::Annotations;
use crate::fixture;
use nudge_core::episode::Judgement;
use std::path::PathBuf;
use std::sync::LazyLock;

static PLAYED: LazyLock<fixture::Played> = LazyLock::new(|| fixture::play(5));

/// A played episode as files.
fn filed(folder: &Path, name: &str, change: impl Fn(&mut EpisodeRecord)) -> PathBuf {
    let played = &*PLAYED;
    let mut record = played.record.clone();
    change(&mut record);
    let truths = played.truths.iter().map(|truth| record.has_truth().then_some(truth));
    let directory = folder.join(name);
    EpisodeDir::store(&directory, &record, played.beliefs.iter().cloned().zip(truths)).expect("stored");
    directory
}

fn without_truth(record: &mut EpisodeRecord) {
    record.prior.scores = None;
    record.steps.iter_mut().for_each(|step| step.judgement = None::<Judgement>);
}

fn go_on(_: f32) -> bool {
    true
}

fn shared(sources: &[Source<'_>], out: &Path) -> (Shared, String) {
    let shared = write(sources, out, &go_on).expect("written");
    (shared, std::fs::read_to_string(out).expect("a page"))
}

#[test]
fn names_and_notes_with_markup_are_text_in_the_page() {
    let folder = tempfile::tempdir().expect("folder");
    // A scene's name has no slash in it; a note may hold anything.
    let evil = "<script>alert(1)<script>{{parts}}";
    let directory = filed(folder.path(), "a", |record| record.scene.name = evil.to_owned());
    let mut annotations = Annotations::default();
    annotations.notes.insert(2, "</script><script>alert(1)</script>".to_owned());
    let source = Source { directory: &directory, annotations: Some(annotations) };
    let (_, html) = shared(&[source], &folder.path().join("a.html"));
    assert!(!html.contains("<script>alert"), "the name is a script");
    assert!(html.contains("<title>&lt;script&gt;alert(1)&lt;script&gt;{{parts}}, mem, seed"), "{}", &html[..900]);
    assert_eq!(html.matches("id=\"part-a-states\"").count(), 1);
    assert_eq!(html.matches("<script").count(), html.matches("</script>").count());
}

#[test]
fn the_page_asks_for_nothing_and_names_no_place_to_ask() {
    let folder = tempfile::tempdir().expect("folder");
    let directory = filed(folder.path(), "a", |_| {});
    let (shared, html) = shared(&[Source::filed(&directory)], &folder.path().join("a.html"));
    assert!(!html.contains("http:") && !html.contains("https:") && html.contains("default-src 'none'"));
    assert_eq!(shared.bytes, html.len());
    assert!(shared.bytes < LIMIT, "{}", shared.bytes);
    let frame: usize =
        html.len() - html.split("id=\"part-").skip(1).map(|part| part.find('<').unwrap_or(0)).sum::<usize>();
    assert!(frame < FRAME, "{frame} bytes beside the parts");
}

#[test]
fn what_is_thinned_is_said_and_the_rest_fits() {
    let folder = tempfile::tempdir().expect("folder");
    let directory = filed(folder.path(), "a", |_| {});
    let source = Source::filed(&directory);
    let whole = read(&source, 'a', LIMIT, &go_on).expect("read");
    assert_eq!((whole.story.kept.len(), whole.left_out.len()), (6, 0));
    let room = whole.bytes() * 3 / 4;
    let thin = read(&source, 'a', room, &go_on).expect("read");
    assert!(thin.story.kept.len() < 6 && thin.story.kept.contains(&0) && thin.story.kept.contains(&5));
    assert!(
        thin.left_out[0].starts_with("Of 5 steps the page holds the beliefs and images of every "),
        "{:?}",
        thin.left_out
    );
    assert_eq!(thin.story.moments.len(), 6, "decisions and scores are all there");
}

#[test]
fn a_recording_is_in_the_page_where_it_fits_and_is_missed_aloud_where_not() {
    let folder = tempfile::tempdir().expect("folder");
    let directory = filed(folder.path(), "a", |_| {});
    let page = folder.path().join("a.html");
    let (none, html) = shared(&[Source::filed(&directory)], &page);
    assert!(none.left_out.is_empty() && !html.contains("part-a-recording"));
    std::fs::write(directory.join(RECORDING), [7; 1000]).expect("written");
    let (small, html) = shared(&[Source::filed(&directory)], &page);
    assert!(small.left_out.is_empty() && html.contains("part-a-recording"));
    std::fs::write(directory.join(RECORDING), vec![7; LIMIT]).expect("written");
    let (large, html) = shared(&[Source::filed(&directory)], &page);
    assert_eq!(large.left_out, ["The recording (6.0 MB) is left out to keep the page below 6 MB."]);
    assert!(!html.contains("part-a-recording") && large.bytes < LIMIT);
}

#[test]
fn an_episode_without_truth_tells_its_entropy_and_no_score() {
    let folder = tempfile::tempdir().expect("folder");
    let directory = filed(folder.path(), "a", without_truth);
    let packed = read(&Source::filed(&directory), 'a', LIMIT, &go_on).expect("read");
    assert!(!packed.story.has_truth && packed.parts.iter().all(|(name, _)| name != "a-truths"));
    let last = packed.story.moments.last().expect("moments");
    assert_eq!(last.scores.iter().filter(|score| score.is_some()).count(), 1, "{:?}", last.scores);
    assert!(last.verdicts.is_empty());
}

#[test]
fn two_scenes_are_said_to_be_two() {
    let folder = tempfile::tempdir().expect("folder");
    let a = filed(folder.path(), "a", |_| {});
    let b = filed(folder.path(), "b", |record| record.scene.name = "another".to_owned());
    let read = |letter, directory| read(&Source::filed(directory), letter, LIMIT, &go_on).expect("read");
    let both = [read('a', a.as_path()), read('b', b.as_path())];
    let said = page::differences(&both);
    assert_eq!(said, ["A and B map two scenes, demo shelf and another: their scores do not compare."]);
    let twice = [read('a', a.as_path()), read('b', a.as_path())];
    assert!(page::differences(&twice).is_empty());
}

#[test]
fn a_page_that_cannot_be_written_or_is_cancelled_leaves_nothing() {
    let folder = tempfile::tempdir().expect("folder");
    let directory = filed(folder.path(), "a", |_| {});
    let source = || [Source::filed(&directory)];
    let out = folder.path().join("nowhere").join("a.html");
    assert_eq!(write(&source(), &out, &go_on).expect_err("no folder").exit_code(), 2);
    let out = folder.path().join("a.html");
    let error = write(&source(), &out, &|share| share < 0.3).expect_err("cancelled");
    assert!(error.to_string().contains("cancelled"), "{error}");
    let names: Vec<_> =
        std::fs::read_dir(folder.path()).expect("listed").map(|e| e.expect("entry").file_name()).collect();
    assert_eq!(names, ["a"]);
}
