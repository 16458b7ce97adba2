use super::super::fixture;
use super::*;
use crate::annotations::{Annotations, object_name};
use crate::picture::RgbImage;
use nudge_core::score::Verdict;
use std::cell::Cell;

/// An episode with a note that CSV has to quote, and a verdict by hand.
fn annotated() -> Session {
    let mut session = fixture::session(1);
    let objects = session.moments[3].outcome.as_ref().expect("a step").record.objects().to_vec();
    session.annotations.notes.insert(3, "a \"tin\", I think\nor a can".to_owned());
    session.annotations.verdicts.entry(3).or_default().insert(object_name(&objects[0]), Verdict::Hallucinated);
    session
}

fn go_on(_: f32) -> bool {
    true
}

/// Rows of fields, as a CSV reader sees them.
fn read_csv(text: &str) -> Vec<Vec<String>> {
    let (mut rows, mut row, mut field) = (Vec::new(), Vec::new(), String::new());
    let mut is_quoted = false;
    let mut letters = text.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            '"' if is_quoted && letters.peek() == Some(&'"') => field.extend(letters.next()),
            '"' => is_quoted = !is_quoted,
            ',' if !is_quoted => row.push(std::mem::take(&mut field)),
            '\r' if !is_quoted => {}
            '\n' if !is_quoted => {
                row.push(std::mem::take(&mut field));
                rows.push(std::mem::take(&mut row));
            }
            other => field.push(other),
        }
    }
    assert!(row.is_empty() && field.is_empty() && !is_quoted, "the last row ends");
    rows
}

#[test]
fn tables_parse_back_with_one_width_and_the_numbers_of_the_episode() {
    let session = annotated();
    let column =
        |rows: &[Vec<String>], name: &str| rows[0].iter().position(|heading| heading == name).expect("heading");
    for text in [scores_csv(&session), decisions_csv(&session), verdicts_csv(&session)] {
        let rows = read_csv(&text);
        assert!(rows.len() > 3 && rows.iter().all(|row| row.len() == rows[0].len()), "{text}");
    }
    let scores = read_csv(&scores_csv(&session));
    assert_eq!(scores.len(), 1 + 6, "the prior and five steps");
    assert_eq!(scores[4][column(&scores, "note")], "a \"tin\", I think\nor a can");
    let entropy: f64 = scores[6][column(&scores, "entropy_nats")].parse().expect("number");
    assert_eq!(entropy, session.moments[5].entropy_nats, "to the last bit");
    let decisions = read_csv(&decisions_csv(&session));
    assert_eq!((decisions[4][1].as_str(), decisions[4][2].as_str()), ("push", "manual"));
    let length: f32 = decisions[4][column(&decisions, "length_m")].parse().expect("number");
    assert!(length > 0.0 && decisions[3][column(&decisions, "length_m")].is_empty());
    let verdicts = read_csv(&verdicts_csv(&session));
    let by_hand: Vec<_> = verdicts.iter().filter(|row| row[column(&verdicts, "overruled")] == "yes").collect();
    assert_eq!(by_hand.len(), 1);
    assert_eq!(by_hand[0][column(&verdicts, "verdict")], "hallucinated");
}

#[test]
fn an_exported_episode_is_whole_and_brings_notes_and_verdicts_back() {
    let folder = tempfile::tempdir().expect("folder");
    let into = folder.path().join("shared");
    let session = annotated();
    write_episode(&session, &into, &go_on).expect("exported");
    let directory = EpisodeDir::open(&into).expect("an episode");
    assert_eq!(directory.record().expect("record"), session.record);
    for moment in &session.moments {
        let belief = directory.read_belief(moment.step).expect("belief");
        assert!(belief == moment.belief.belief(), "belief {}", moment.step);
        let truth = directory.read_truth(moment.step).expect("truth");
        assert_eq!(
            (&truth.occupancy, &truth.labels),
            moment.truth.as_ref().map(|truth| (&truth.occupancy, &truth.labels)).expect("a truth")
        );
    }
    assert_eq!(Annotations::read(&into).expect("notes"), session.annotations);
    assert!(into.join(SUMMARY).metadata().expect("figure").len() > 10_000);
    assert_eq!(names_in(folder.path()).expect("listed"), ["shared"], "nothing is left beside it");
    verify(&into.join(RECORDING));

    let refused = write_episode(&session, &into, &go_on).expect_err("not empty").to_string();
    assert!(refused.contains("shared: is not empty"), "{refused}");
}

#[test]
fn a_cancelled_export_leaves_nothing() {
    let folder = tempfile::tempdir().expect("folder");
    let session = annotated();
    let asked = Cell::new(0);
    let stop = |share: f32| {
        asked.set(asked.get() + 1);
        share < 0.3
    };
    assert!(write_episode(&session, &folder.path().join("a"), &stop).is_err());
    assert!(write_recording(&session, &folder.path().join("a.rrd"), &stop).is_err());
    assert!(asked.get() > 3);
    assert_eq!(names_in(folder.path()).expect("listed"), Vec::<String>::new());
}

#[test]
fn one_recording_holds_notes_and_verdicts() {
    let folder = tempfile::tempdir().expect("folder");
    let kept = std::env::var_os("NUDGE_KEEP").map_or(folder.path().to_owned(), PathBuf::from);
    let path = kept.join("annotated.rrd");
    write_recording(&annotated(), &path, &go_on).expect("exported");
    verify(&path);
    let bytes = std::fs::read(&path).expect("file");
    assert!(bytes.starts_with(b"RRF2") && bytes.len() > 100_000, "{} bytes", bytes.len());
    for needle in ["or a can", "by hand; the scorer says"] {
        assert!(contains_text(&path, needle), "`{needle}` is in the recording");
    }
}

/// Whether a text document of the recording holds a text.
fn contains_text(path: &Path, needle: &str) -> bool {
    let mut file = std::fs::File::open(path).expect("file");
    let stores = rerun::ChunkStore::from_rrd_reader(&rerun::ChunkStoreConfig::DEFAULT, &mut file).expect("a recording");
    let text = rerun::TextDocument::descriptor_text().component;
    stores.values().any(|store| {
        let chunks = store.iter_physical_chunks();
        chunks.flat_map(|chunk| chunk.iter_slices::<String>(text)).flatten().any(|text| text.contains(needle))
    })
}

/// The stock tool's word on a recording. Set to nothing, `NUDGE_VENV` says that there is none and nothing is checked.
fn verify(recording: &Path) {
    let venv = std::env::var_os("NUDGE_VENV").expect("`make test` sets NUDGE_VENV; set it to nothing to skip");
    if venv.is_empty() {
        return;
    }
    let rerun = Path::new(&venv).join("bin").join("rerun");
    let output =
        std::process::Command::new(rerun).args(["rrd", "verify"]).arg(recording).output().expect("rerun starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn pictures_grow_by_whole_pixels() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("map.png");
    let map = RgbImage::from_fn(3, 2, |x, y| image::Rgb([x as u8 * 80, y as u8 * 90, 7]));
    write_picture(&map, 4, &path).expect("written");
    let read = image::open(&path).expect("a PNG").to_rgb8();
    assert_eq!((read.width(), read.height()), (12, 8));
    assert!(read.enumerate_pixels().all(|(x, y, pixel)| pixel == map.get_pixel(x / 4, y / 4)));
    let window = image::RgbaImage::from_pixel(2, 2, image::Rgba([1, 2, 3, 200]));
    assert_eq!(enlarged(&window, 1), window);
}
