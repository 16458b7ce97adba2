//! The real window: the binary under a virtual display, the pictures of every layout, the exported recording in the
//! stock viewer. They need software Vulkan (Debian's mesa-vulkan-drivers) and Xvfb, which `make test-window` installs.

#[path = "window/clicks.rs"]
mod clicks;
#[path = "window/pictures.rs"]
mod pictures;

use nudge_tests::{nudge_bin, nudge_fails, nudge_ok, root, text, venv_tool};
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::LazyLock;
use std::time::{Duration, Instant};

const SCENE: &str = "scenes/demo/behind-the-boxes.toml";
/// The crowded shelf of `make demo`: pushes bring hidden cans into sight.
const DEMO: &str = "scenes/high/can-phalanx.toml";
/// The demo's shelf, mapped with pushes and without, made once for all tests of this process.
static EPISODES: LazyLock<(tempfile::TempDir, [PathBuf; 2])> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("folder");
    let out = folder.path().join("demo");
    let path = out.to_str().expect("utf-8");
    nudge_ok(&[
        "run",
        DEMO,
        "--policy",
        "mem",
        "--beside",
        "mem-no-push",
        "--budget",
        "12",
        "--seed",
        "0",
        "--out",
        path,
    ]);
    (folder, [out.clone(), out.with_file_name("demo-mem-no-push")])
});

/// A socket of the internet's protocols that a process holds.
#[derive(Debug, PartialEq)]
struct Socket {
    protocol: &'static str,
    /// Address and port in hexadecimal, as the kernel lists them: `0100007F:2694` is 127.0.0.1:9876.
    local: String,
    listens: bool,
}

/// The sockets of a process.
fn sockets(process: u32) -> Vec<Socket> {
    let links = std::fs::read_dir(format!("/proc/{process}/fd")).into_iter().flatten().flatten();
    let own: Vec<String> = links
        .filter_map(|entry| {
            let target = std::fs::read_link(entry.path()).ok()?.to_string_lossy().into_owned();
            Some(target.strip_prefix("socket:[")?.strip_suffix(']')?.to_owned())
        })
        .collect();
    let mut open = Vec::new();
    for protocol in ["tcp", "tcp6", "udp", "udp6"] {
        let table = std::fs::read_to_string(format!("/proc/{process}/net/{protocol}")).unwrap_or_default();
        for line in table.lines().skip(1) {
            let fields: Vec<&str> = line.split_whitespace().collect();
            if own.iter().any(|inode| inode == fields[9]) {
                let listens = protocol.starts_with("udp") || fields[3] == "0A";
                open.push(Socket { protocol, local: fields[1].to_owned(), listens });
            }
        }
    }
    open
}

/// Processes of the program, once `nudge` has become it, below another.
fn windows_below(parent: u32) -> Vec<u32> {
    let listed = Command::new("ps").args(["-e", "-o", "pid=,ppid=,comm="]).output().map(|output| text(&output.stdout));
    let rows: Vec<(u32, u32, String)> = listed
        .unwrap_or_default()
        .lines()
        .filter_map(|line| {
            let mut fields = line.split_whitespace();
            Some((fields.next()?.parse().ok()?, fields.next()?.parse().ok()?, fields.next()?.to_owned()))
        })
        .collect();
    let below = |mut process: u32| {
        while let Some((_, above, _)) = rows.iter().find(|(pid, ..)| *pid == process) {
            if *above == parent {
                return true;
            }
            process = *above;
        }
        false
    };
    rows.iter().filter(|(pid, _, name)| name == "nudge-program" && below(*pid)).map(|(pid, ..)| *pid).collect()
}

/// Runs `nudge` with arguments under a virtual display until it ends by itself; `look` is shown the window's process
/// every now and then. Returns how it ended and what it said on standard error.
fn under_xvfb(args: &[&str], mut look: impl FnMut(u32)) -> (ExitStatus, String) {
    let mut child: Child = Command::new("xvfb-run")
        .args(["-a", "-s", "-screen 0 1600x1000x24"])
        .arg(nudge_bin())
        .args(args)
        .current_dir(root())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("xvfb-run starts; make test installs it");
    let mut stderr = child.stderr.take().expect("piped");
    let said = std::thread::spawn(move || {
        let mut bytes = Vec::new();
        stderr.read_to_end(&mut bytes).map(|_| text(&bytes)).unwrap_or_default()
    });
    let started = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().expect("waited") {
            break status;
        }
        windows_below(child.id()).into_iter().for_each(&mut look);
        if started.elapsed() > Duration::from_secs(300) {
            windows_below(child.id()).into_iter().for_each(|window| {
                let _ = Command::new("kill").arg(window.to_string()).status();
            });
            panic!("the window did not end by itself");
        }
        std::thread::sleep(Duration::from_millis(100));
    };
    (status, said.join().expect("read"))
}

/// Asserts that a picture of the window shows something all over.
fn assert_drawn(picture: &Path) {
    let shown = image::open(picture).expect("a picture").into_rgb8();
    assert!(shown.width() >= 1000 && shown.height() >= 600);
    let first = *shown.get_pixel(0, 0);
    assert!(shown.pixels().filter(|pixel| **pixel != first).count() > 50_000, "the window is empty");
}

#[test]
fn the_real_window_opens_steps_and_has_no_socket() {
    let dir = tempfile::tempdir().expect("folder");
    let (picture, out) = (dir.path().join("window.png"), dir.path().join("out"));
    let args = ["open", SCENE, "--steps", "2", "--out", out.to_str().expect("utf-8"), "--picture"];
    let mut looked = 0;
    let (status, said) = under_xvfb(&[&args[..], &[picture.to_str().expect("utf-8")]].concat(), |window| {
        assert_eq!(sockets(window), [], "no port, and no network at all");
        looked += 1;
    });
    assert!(status.success(), "{status}: {said}");
    assert!(looked > 5, "the window was there to be looked at");
    assert_drawn(&picture);
    let episode = std::fs::read_dir(&out).expect("out").next().expect("an episode").expect("entry").path();
    let record = std::fs::read_to_string(episode.join("episode.json")).expect("episode.json");
    assert_eq!(record.matches("\"index\"").count(), 2);
    assert!(episode.join("summary.png").exists(), "the recording was ended before the program was gone");
}

#[test]
fn it_serves_only_when_asked_and_only_this_machine() {
    let dir = tempfile::tempdir().expect("folder");
    let (picture, out) = (dir.path().join("window.png"), dir.path().join("out"));
    // A port that was free a moment ago.
    let port =
        std::net::TcpListener::bind("127.0.0.1:0").and_then(|socket| socket.local_addr()).expect("a port").port();
    let (port_text, out_text) = (port.to_string(), out.to_str().expect("utf-8").to_owned());
    let args = ["open", SCENE, "--serve", &port_text, "--out", &out_text, "--picture"];
    let (mut served, mut refused) = (0, 0);
    let (status, said) = under_xvfb(&[&args[..], &[picture.to_str().expect("utf-8")]].concat(), |window| {
        let listening = || -> Vec<Socket> { sockets(window).into_iter().filter(|socket| socket.listens).collect() };
        let before = listening();
        if !before.is_empty() {
            assert_eq!(before.len(), 1, "{before:?}");
            assert_eq!((before[0].protocol, &*before[0].local), ("tcp", &*format!("0100007F:{port:04X}")));
            match std::net::TcpStream::connect(("127.0.0.1", port)) {
                Ok(_) => served += 1,
                // Only of a window that is closing meanwhile.
                Err(_) => refused += usize::from(!listening().is_empty()),
            }
        }
    });
    assert!(status.success(), "{status}: {said}");
    assert!(served > 5, "it was served {served} times only");
    assert_eq!(refused, 0, "it listened and served nobody, beside {served} times");
    // A port that is taken is one clear line.
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("address").port().to_string();
    let line = nudge_tests::nudge_fails(2, &["open", SCENE, "--serve", &port]);
    assert!(line.contains("--serve") && line.contains(&port), "{line}");
}

#[test]
fn every_layout_looks_as_it_did() {
    let [one, two] = &EPISODES.1;
    let dir = tempfile::tempdir().expect("folder");
    let drawn = dir.path().join("workbench.png");
    let path = |path: &Path| path.to_str().expect("utf-8").to_owned();
    let (one, two, out) = (path(one), path(two), path(&drawn));
    nudge_ok(&["shot", &one, "--with", &two, "--layout", "all", "--size", "1440x900", "--out", &out]);
    let mut changed = Vec::new();
    for layout in ["episode", "why", "gains", "push", "compare", "author"] {
        let file = format!("workbench-{layout}.png");
        let (new, golden) = (dir.path().join(&file), root().join("screenshots").join(&file));
        if std::env::var_os("NUDGE_BLESS").is_some() {
            std::fs::copy(&new, &golden).expect("blessed");
        }
        let pictures::Difference { share, at: [x, y] } = pictures::difference(&new, &golden);
        println!("{layout}: differs most at ({x}, {y}), by {:.0} % of the pixels there", 100.0 * share);
        if share > pictures::TOLERANCE {
            let kept = std::env::temp_dir().join(&file);
            std::fs::copy(&new, &kept).expect("kept");
            changed.push(format!(
                "{layout}: {:.0} % of the pixels at ({x}, {y}), see {}",
                100.0 * share,
                kept.display()
            ));
        }
    }
    assert!(changed.is_empty(), "if that is as it should be, bless with NUDGE_BLESS=1 and look: {changed:#?}");
}

#[test]
fn a_recording_is_shown_in_its_own_layout() {
    let dir = tempfile::tempdir().expect("folder");
    let picture = dir.path().join("recording.png");
    let recording = EPISODES.1[0].join("episode.rrd");
    let args = ["open", recording.to_str().expect("utf-8"), "--picture", picture.to_str().expect("utf-8")];
    let (status, said) = under_xvfb(&args, |_| ());
    assert!(status.success(), "{status}: {said}");
    // The map of errors is mostly white, where the window's own views have nothing so light at all.
    let shown = image::open(&picture).expect("a picture").into_rgb8();
    let white = shown.pixels().filter(|pixel| pixel.0.iter().all(|channel| *channel > 240)).count();
    assert!(white > 10_000, "{white} white pixels");
}

#[test]
fn the_stock_viewer_verifies_and_shows_an_export() {
    let Some(rerun) = venv_tool("rerun") else { return };
    let dir = tempfile::tempdir().expect("folder");
    let export = dir.path().join("export");
    let session = export_of(&EPISODES.1[0], &export);
    let recording = export.join("episode.rrd");
    let alone = dir.path().join("alone.rrd");
    nudge::workbench::export::write_recording(&session, &alone, &|_| true).expect("written");
    for recording in [&recording, &alone] {
        let verified = Command::new(&rerun).args(["rrd", "verify"]).arg(recording).output().expect("rerun");
        assert!(verified.status.success(), "{}", text(&verified.stderr));
        let printed = Command::new(&rerun).args(["rrd", "print", "-v"]).arg(recording).output().expect("rerun");
        let printed = text(&printed.stdout);
        for entity in ["/belief/occupancy", "/scores/", "/note", "blueprint"] {
            assert!(printed.contains(entity), "{entity} is not in {}", recording.display());
        }
    }
    let words = ["shot", alone.to_str().expect("utf-8"), "--out", "unwritten.png"];
    let line = nudge_fails(2, &words);
    assert!(line.contains("alone.rrd: is a recording") && line.contains("--picture"), "{line}");
    let picture = dir.path().join("stock.png");
    let output = Command::new(rerun)
        .args(["--port", "auto"])
        .arg(&alone)
        .args(["--headless", "--window-size", "1600x1000", "--screenshot-to"])
        .arg(&picture)
        .env("XDG_RUNTIME_DIR", dir.path())
        .output()
        .expect("rerun");
    assert!(output.status.success(), "{}", text(&output.stderr));
    let shown = image::open(&picture).expect("a picture").into_rgb8();
    let ground = *shown.get_pixel(800, 500);
    assert!(shown.pixels().filter(|pixel| **pixel != ground).count() > 100_000, "the recording shows nothing");
}

/// Opens an episode in a window without a graphics driver, writes a note and a verdict on it, and exports it.
fn export_of(episode: &Path, into: &Path) -> nudge::workbench::session::Session {
    use nudge::workbench::app::{App, Options};
    use nudge::workbench::command::Command as Ask;
    let options = Options { look_only: true, ..Options::default() };
    let mut harness =
        egui_kittest::Harness::builder().build_eframe(move |cc| App::without_viewer(&cc.egui_ctx, options.clone()));
    harness.state_mut().ask(Ask::Open(episode.to_owned()));
    let started = Instant::now();
    while harness.state().is_busy() || harness.state().model.sessions.is_empty() {
        harness.step();
        assert!(started.elapsed() < Duration::from_secs(300), "it never opened");
        std::thread::sleep(Duration::from_millis(5));
    }
    let last = harness.state().model.session().expect("open").steps();
    let object = harness.state().model.session().expect("open").record.steps[last - 1].objects()[0].clone();
    harness.state_mut().ask(Ask::Note(last, "the stock viewer shows this".to_owned()));
    let name = nudge::verdicts::object_name(&object);
    harness.state_mut().ask(Ask::Overrule(last, name, Some(nudge_core::score::Verdict::Misclassified)));
    let session = harness.state().model.session().expect("open").clone();
    nudge::workbench::export::write_episode(&session, into, &|_| true).expect("exported");
    session
}

#[test]
fn an_episode_of_networks_is_shown_where_their_weights_are_broken() {
    let dir = tempfile::tempdir().expect("folder");
    let (out, models) = (dir.path().join("episode"), dir.path().join("models"));
    let path = out.to_str().expect("utf-8");
    nudge_ok(&["run", "scenes/demo/first-look.toml", "--belief", "classical", "--budget", "1", "--out", path]);
    let document = out.join("episode.json");
    let mut record: serde_json::Value = serde_json::from_slice(&std::fs::read(&document).expect("read")).expect("JSON");
    record["belief"] = "cnabu".into();
    std::fs::write(&document, record.to_string()).expect("written");
    std::fs::create_dir(&models).expect("folder");
    for file in ["sigma_o.safetensors", "sigma_o.toml", "sigma_m.safetensors", "sigma_m.toml"] {
        let bytes = std::fs::read(root().join("models").join(file)).expect("read");
        let kept = if file == "sigma_o.safetensors" { bytes.len() / 3 } else { bytes.len() };
        std::fs::write(models.join(file), &bytes[..kept]).expect("written");
    }
    let picture = dir.path().join("shown.png");
    let shot = Command::new(nudge_bin())
        .current_dir(root())
        .env("NUDGE_MODELS", &models)
        .args(["shot", path, "--size", "1440x900", "--out", picture.to_str().expect("utf-8")])
        .output()
        .expect("nudge starts");
    assert!(shot.status.success(), "{}", text(&shot.stderr));
    assert!(image::open(&picture).expect("a picture").into_rgb8().width() == 1440);
    // To go on with it is another thing.
    let replay =
        Command::new(nudge_bin()).env("NUDGE_MODELS", &models).args(["replay", path]).output().expect("starts");
    let said = text(&replay.stderr);
    assert!(replay.status.code() == Some(2) && said.contains("sigma_o.safetensors"), "{said}");
}
