//! The real window: the binary under a virtual display, the pictures of every layout, the exported recording in the
//! stock viewer. They need software Vulkan (Debian's mesa-vulkan-drivers) and Xvfb, which `make test` installs.

use nudge_tests::{nudge_bin, nudge_ok, root, text, venv_tool};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const SCENE: &str = "scenes/demo/behind-the-boxes.toml";

/// An episode to look at, made once for all tests.
fn episode(policy: &str) -> PathBuf {
    let out = root().join("target-screenshots").join(policy);
    let out = std::env::temp_dir().join(out.file_name().expect("name"));
    let out = out.with_file_name(format!("nudge-window-test-{}-{policy}", std::process::id()));
    if !out.join("summary.png").exists() {
        let args =
            ["run", SCENE, "--belief", "classical", "--budget", "10", "--seed", "1", "--policy", policy, "--out"];
        nudge_ok(&[&args[..], &[out.to_str().expect("utf-8")]].concat());
    }
    out
}

/// Inodes of the sockets that a process listens on or has bound for UDP.
fn open_ports(process: u32) -> Vec<String> {
    let mut own = Vec::new();
    for entry in std::fs::read_dir(format!("/proc/{process}/fd")).into_iter().flatten().flatten() {
        if let Ok(target) = std::fs::read_link(entry.path()) {
            let target = target.to_string_lossy().into_owned();
            if let Some(inode) = target.strip_prefix("socket:[").and_then(|rest| rest.strip_suffix(']')) {
                own.push(inode.to_owned());
            }
        }
    }
    let mut open = Vec::new();
    for table in ["tcp", "tcp6", "udp", "udp6"] {
        let content = std::fs::read_to_string(format!("/proc/net/{table}")).unwrap_or_default();
        for line in content.lines().skip(1) {
            let fields: Vec<&str> = line.split_whitespace().collect();
            let listens = table.starts_with("udp") || fields[3] == "0A";
            if listens && own.iter().any(|inode| inode == fields[9]) {
                open.push(format!("{table} {}", fields[1]));
            }
        }
    }
    open
}

#[test]
fn the_real_window_opens_steps_and_listens_nowhere() {
    let dir = tempfile::tempdir().expect("folder");
    let picture = dir.path().join("window.png");
    let mut child = Command::new("xvfb-run")
        .args(["-a", "-s", "-screen 0 1600x1000x24"])
        .arg(nudge_bin())
        .args(["open", SCENE, "--steps", "2", "--out"])
        .arg(dir.path().join("out"))
        .arg("--picture")
        .arg(&picture)
        .current_dir(root())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("xvfb-run starts; make test installs it");
    let started = Instant::now();
    let mut looked = 0;
    let status = loop {
        if let Some(status) = child.try_wait().expect("waited") {
            break status;
        }
        for window in windows_below(child.id()) {
            assert_eq!(open_ports(window), Vec::<String>::new());
            looked += 1;
        }
        assert!(started.elapsed() < Duration::from_secs(240), "the window did not end by itself");
        std::thread::sleep(Duration::from_millis(100));
    };
    let output = child.wait_with_output().expect("output");
    assert!(status.success(), "{status}: {}", text(&output.stderr));
    assert!(looked > 5, "the window was there to be looked at");
    let shown = image::open(&picture).expect("a picture").into_rgb8();
    assert!(shown.width() >= 1000 && shown.height() >= 600);
    let first = *shown.get_pixel(0, 0);
    assert!(shown.pixels().filter(|pixel| **pixel != first).count() > 50_000, "the window is empty");
    let episode = std::fs::read_dir(dir.path().join("out")).expect("out").next().expect("an episode").expect("entry");
    let record = std::fs::read_to_string(episode.path().join("episode.json")).expect("episode.json");
    assert_eq!(record.matches("\"index\"").count(), 2);
}

/// Processes named nudge below another.
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
    rows.iter().filter(|(pid, _, name)| name == "nudge" && below(*pid)).map(|(pid, ..)| *pid).collect()
}

/// Share of the pixels that differ by more than a little.
fn difference(a: &Path, b: &Path) -> f64 {
    let (a, b) = (image::open(a).expect("picture").into_rgb8(), image::open(b).expect("golden picture").into_rgb8());
    if a.dimensions() != b.dimensions() {
        return 1.0;
    }
    let far = a.pixels().zip(b.pixels()).filter(|(a, b)| a.0.iter().zip(b.0).any(|(a, b)| a.abs_diff(b) > 24)).count();
    far as f64 / f64::from(a.width() * a.height())
}

#[test]
fn every_layout_looks_as_it_did() {
    let (one, two) = (episode("mem"), episode("random"));
    let dir = tempfile::tempdir().expect("folder");
    let mut changed = Vec::new();
    for layout in ["episode", "why", "gains", "push", "compare", "author"] {
        let file = format!("{layout}.png");
        let (new, golden) = (dir.path().join(&file), root().join("screenshots").join(&file));
        let opened = if layout == "author" { root().join(SCENE) } else { one.clone() };
        let mut args = vec!["shot", opened.to_str().expect("utf-8"), "--layout", layout, "--size", "1440x900", "--out"];
        args.push(new.to_str().expect("utf-8"));
        if layout == "compare" {
            args.extend(["--with", two.to_str().expect("utf-8")]);
        }
        nudge_ok(&args);
        if std::env::var_os("NUDGE_BLESS").is_some() {
            std::fs::copy(&new, &golden).expect("blessed");
        }
        let share = difference(&new, &golden);
        if share > 0.02 {
            changed.push(format!("{layout}: {:.1} % of the pixels", 100.0 * share));
        }
    }
    assert!(changed.is_empty(), "run with NUDGE_BLESS=1 and look at screenshots/: {changed:?}");
}

#[test]
fn the_stock_viewer_shows_the_recording() {
    let Some(rerun) = venv_tool("rerun") else { return };
    let recording = episode("mem").join("episode.rrd");
    let dir = tempfile::tempdir().expect("folder");
    let picture = dir.path().join("stock.png");
    let output = Command::new(rerun)
        .args(["--port", "auto"])
        .arg(&recording)
        .args(["--headless", "--window-size", "1600x1000", "--screenshot-to"])
        .arg(&picture)
        .env("XDG_RUNTIME_DIR", dir.path())
        .output()
        .expect("rerun");
    assert!(output.status.success(), "{}", text(&output.stderr));
    let shown = image::open(&picture).expect("a picture").into_rgb8();
    let first = *shown.get_pixel(800, 500);
    assert!(shown.pixels().filter(|pixel| **pixel != first).count() > 100_000, "the recording shows nothing");
}
