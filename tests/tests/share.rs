//! `nudge share`: the page of an episode, and of two, as files and in a real browser.

#[path = "share/browser.rs"]
mod browser;

use browser::Browser;
use nudge_tests::{Folder, TIN, nudge, nudge_bin, nudge_fails, nudge_ok, small_scene, text};
use std::path::Path;
use std::process::Command;

/// A scene's name as bad as it may be: it has no slash in it.
const EVIL: &str = "<img src=x onerror=document.title='stolen'>";
/// A note may hold anything.
const WORSE: &str = "</script><script>document.title='stolen'</script>";

/// Runs a small episode into a folder and returns its path.
fn episode(folder: &Folder, name: &str, scene_name: &str, budget: &str) -> String {
    let objects = format!("{TIN}[[object]]\nclass = \"baking_powder\"\nposition = [0.08, 0.05]\n");
    let scene = small_scene(&objects).replace("name = \"small\"", &format!("name = {scene_name:?}"));
    let scene = folder.write(&format!("{name}.toml"), scene);
    let out = folder.name(name);
    let mut words = vec!["run", scene.as_str(), "--out", out.as_str(), "--budget", budget];
    words.extend(["--policy", "random-view-push-5", "--belief", "classical", "--seed", "1"]);
    nudge_ok(&words);
    out
}

fn share(folder: &Folder, episodes: &[&str], page: &str) -> String {
    let out = folder.name(page);
    let mut words = vec!["share"];
    words.extend(episodes);
    words.extend(["--out", out.as_str()]);
    let said = nudge_ok(&words);
    assert_eq!(said.trim(), out);
    out
}

#[test]
fn a_page_is_one_file_that_asks_for_nothing_and_reads_no_name_as_markup() {
    let folder = Folder::new();
    let directory = episode(&folder, "a", EVIL, "4");
    let page = share(&folder, &[&directory], "page.html");
    let html = std::fs::read_to_string(&page).expect("a page");
    assert!(html.len() < 6_000_000, "{}", html.len());
    assert!(!html.contains("http:") && !html.contains("https:") && !html.contains(EVIL));
    assert!(html.contains("<title>&lt;img src=x"), "the title is its text");
    // The recording is small, and so it is inside.
    assert!(html.contains("id=\"part-a-recording\""));
    // Without weights, and beside the directory unless told otherwise, it is the same.
    let mut bare = Command::new(nudge_bin());
    let output = bare.args(["share", directory.as_str()]).env("NUDGE_MODELS", folder.name("nowhere")).output();
    let output = output.expect("nudge starts");
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(std::fs::read(folder.path("a.html")).expect("a page"), html.as_bytes());
}

#[test]
fn wrong_use_and_bad_input_are_one_line_and_leave_no_page() {
    let folder = Folder::new();
    let directory = episode(&folder, "a", "small", "2");
    let nowhere = folder.name("nowhere/a.html");
    assert!(nudge_fails(2, &["share", &directory, "--out", &nowhere]).contains("nowhere"));
    let empty = folder.path("empty");
    std::fs::create_dir(&empty).expect("folder");
    let page = folder.name("page.html");
    let said = nudge_fails(2, &["share", &directory, &folder.name("empty"), "--out", &page]);
    assert!(said.contains("holds no episode"), "{said}");
    let belief = folder.path("a").join("beliefs/001.npz");
    let whole = std::fs::read(&belief).expect("a belief");
    std::fs::write(&belief, &whole[..whole.len() / 2]).expect("cut");
    assert!(nudge_fails(2, &["share", &directory, "--out", &page]).contains("001.npz"));
    std::fs::write(&belief, &whole).expect("whole again");
    let notes = folder.path("a").join("notes.json");
    std::fs::write(&notes, "{").expect("written");
    assert!(nudge_fails(2, &["share", &directory, "--out", &page]).contains("notes.json"));
    assert!(!Path::new(&page).exists());
}

#[test]
fn the_page_walks_through_the_clock_the_slider_and_a_comparison_with_an_empty_console() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = Folder::new();
    let a = episode(&folder, "a", EVIL, "6");
    let b = episode(&folder, "b", "another", "4");
    std::fs::write(
        folder.path("a").join("notes.json"),
        serde_json::json!({ "format": 1, "notes": { "3": format!("seen {WORSE}") } }).to_string(),
    )
    .expect("written");
    let page = share(&folder, &[&a], "a.html");

    // It opens at the last state.
    browser.open(Path::new(&page), "", [1280, 800]);
    assert!(browser.text("document.title").starts_with(EVIL));
    assert_eq!(browser.text("document.querySelector('h1').textContent"), browser.text("document.title"));
    let clock = "document.querySelector('#clock .words').textContent";
    assert!(browser.text(clock).starts_with("Step 6 of 6 · "));
    let voxels = "document.querySelector('p.over').textContent";
    assert!(browser.text(voxels).ends_with(" voxels"), "{}", browser.text(voxels));
    let drawn = "(() => { const c = document.querySelector('canvas.space'); const [w, h] = [c.width, c.height]; \
                 const pen = new OffscreenCanvas(w, h).getContext('2d'); pen.drawImage(c, 0, 0); \
                 return pen.getImageData(0, 0, w, h).data.filter((v, at) => at % 4 === 3 && v).length / (w * h); })()";
    assert!(browser.value(drawn).as_f64().expect("a share") > 0.1, "the shelf is drawn");

    // The clock by keys and by its slider; the address follows.
    let key = |key: &str| {
        format!("document.body.dispatchEvent(new KeyboardEvent('keydown', {{ key: '{key}', bubbles: true }}))")
    };
    browser.value(&key("Home"));
    assert!(browser.text(clock).starts_with("Step 0 of 6 · nothing is done yet"));
    assert_eq!(browser.text(voxels), "No voxel is more probable than 0.50");
    browser.value(
        "(() => { const s = document.getElementById('step'); s.value = 3; s.dispatchEvent(new Event('input')); })()",
    );
    browser.wait("location.hash.includes('step=3&')");
    assert!(browser.text("document.querySelector('.note').textContent").ends_with(WORSE), "a note is text");
    let before = browser.text(voxels);
    browser.value("(() => { const s = document.getElementById('above'); s.value = 0.95; s.dispatchEvent(new Event('input')); })()");
    assert_ne!(browser.text(voxels), before);
    browser.value(&key("c"));
    browser.wait("location.hash.includes('colour=probability') && location.hash.includes('above=0.95')");
    let link = browser.text("location.hash.slice(1)");

    // A link leads to the same moment; nonsense in it is left aside.
    browser.open(Path::new(&page), &link, [390, 844]);
    assert!(browser.text(clock).starts_with("Step 3 of 6"));
    assert_eq!(browser.text("document.querySelector('select').value"), "probability");
    assert_eq!(browser.value("document.documentElement.scrollWidth <= 390"), true, "nothing is cut on a phone");
    browser.value("location.hash = 'step=99&above=x&colour=<b>&camera=1,nan,9e99,,'");
    browser.wait("document.querySelector('#clock .words').textContent.startsWith('Step 6 of 6')");
    assert_eq!(browser.text("document.querySelector('select').value"), "class");

    // On paper it is light and says what it shows.
    let paper = browser.ask("Page.printToPDF", serde_json::json!({ "printBackground": true }));
    assert!(paper["data"].as_str().expect("a PDF").len() > 10_000);
    assert!(browser.text("document.getElementById('printed').textContent").starts_with("State: step 6 of 6"));

    // Two on one clock: the shorter one ends, and their scenes are said to differ.
    let both = share(&folder, &[&a, &b], "both.html");
    browser.open(Path::new(&both), "step=6", [1280, 800]);
    assert_eq!(browser.value("document.querySelectorAll('canvas.space').length"), 2);
    assert!(browser.text(clock).contains("A: ") && browser.text(clock).ends_with("B: has ended"));
    assert!(browser.text("document.querySelector('.warning').textContent").contains("their scores do not compare"));
    browser.value(&key("ArrowLeft"));
    browser.value(&key("ArrowLeft"));
    assert!(!browser.text(clock).contains("has ended"));
    assert_eq!(browser.said, [""; 0], "the console is empty, and nothing is asked for");
}

#[test]
fn what_has_no_truth_is_shared_without_scores_and_says_so_once() {
    let folder = Folder::new();
    let directory = episode(&folder, "a", "small", "3");
    let path = folder.path("a").join("episode.json");
    let mut record: serde_json::Value = serde_json::from_slice(&std::fs::read(&path).expect("read")).expect("JSON");
    let entropy = record["prior"]["entropy_nats"].clone();
    record["prior"] = serde_json::json!({ "entropy_nats": entropy });
    for step in record["steps"].as_array_mut().expect("steps") {
        let step = step.as_object_mut().expect("a step");
        ["scores", "objects", "dropped", "displacement_m"].iter().for_each(|key| drop(step.remove(*key)));
    }
    std::fs::write(&path, record.to_string()).expect("written");
    let page = share(&folder, &[&directory], "a.html");
    let Some(mut browser) = Browser::start() else { return };
    browser.open(Path::new(&page), "", [1280, 800]);
    let said = browser.text("document.body.innerText.toLowerCase()");
    assert_eq!(said.matches("no ground truth").count(), 1, "{said}");
    assert!(!said.contains(" iou") && !said.contains("miou") && said.contains("map entropy"), "{said}");
    assert_eq!(
        browser.value("[...document.querySelectorAll('select')[0].options].map(o => o.value).includes('error')"),
        false
    );
    assert_eq!(browser.said, [""; 0]);
}

#[test]
fn a_report_links_pages_of_its_recorded_episodes() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("set")).expect("folder");
    folder.write("set/one.toml", small_scene(TIN));
    let (set, out) = (folder.name("set"), folder.name("bench"));
    let mut words = vec!["bench", set.as_str(), "--out", out.as_str(), "--budget", "2", "--seeds", "1", "--record"];
    words.extend(["--policies", "random-view-push-5", "--belief", "classical"]);
    nudge_ok(&words);
    nudge_ok(&["report", &out]);
    let report = folder.path("bench/report/index.html");
    assert!(!std::fs::read_to_string(&report).expect("a report").contains("pages/"));
    let output = nudge(&["report", &out, "--pages"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let html = std::fs::read_to_string(&report).expect("a report");
    let link = html.split("href=\"pages/").nth(1).and_then(|rest| rest.split('"').next()).expect("a link");
    let page = folder.path("bench/report/pages").join(link);
    assert!(std::fs::read_to_string(page).expect("a page").contains("id=\"part-a-story\""));
}
