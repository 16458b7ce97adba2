//! A real browser, headless, driven through a pair of pipes by the DevTools protocol.

use nudge_tests::Folder;
use serde_json::{Value, json};
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// How long anything may take on a busy machine.
const PATIENCE: Duration = Duration::from_secs(120);

/// A page in a browser.
pub struct Browser {
    process: Child,
    to: File,
    from: Receiver<Value>,
    asked: u64,
    session: Option<String>,
    /// What the page said on its console, and what it asked for beside itself.
    pub said: Vec<String>,
    _profile: Folder,
}

impl Browser {
    /// Starts one; `None`, with a word on stderr, where there is none.
    pub fn start() -> Option<Self> {
        let names = ["chromium", "chromium-browser", "google-chrome"];
        let is_there =
            |name: &&&str| Command::new(name).arg("--version").output().is_ok_and(|said| said.status.success());
        let Some(name) = names.iter().find(is_there) else {
            eprintln!("not checked: there is no Chromium here to open the page");
            return None;
        };
        let profile = Folder::new();
        let pipes = ["to", "from"].map(|pipe| profile.name(pipe));
        assert!(Command::new("mkfifo").args(&pipes).status().expect("mkfifo").success());
        let options = [
            "--headless=new",
            "--no-sandbox",
            "--use-gl=angle",
            "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader",
            "--remote-debugging-pipe",
            "--no-first-run",
            "--hide-scrollbars",
        ];
        let process = Command::new("bash")
            .args([
                "-c",
                "to=$1 from=$2; shift 2; exec \"$@\" 3<\"$to\" 4>\"$from\"",
                "bash",
                &pipes[0],
                &pipes[1],
                name,
            ])
            .args(options)
            .arg(format!("--user-data-dir={}", profile.name("profile")))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("bash starts");
        let to = OpenOptions::new().write(true).open(&pipes[0]).expect("a pipe");
        let mut reader = BufReader::new(File::open(&pipes[1]).expect("a pipe"));
        let (tell, from) = channel();
        std::thread::spawn(move || {
            let mut bytes = Vec::new();
            while reader.read_until(0, &mut bytes).is_ok_and(|length| length > 1) {
                bytes.pop();
                if let Ok(message) = serde_json::from_slice(&bytes) {
                    let _ = tell.send(message);
                }
                bytes.clear();
            }
        });
        Some(Self { process, to, from, asked: 0, session: None, said: Vec::new(), _profile: profile })
    }

    /// Asks something of the protocol.
    pub fn ask(&mut self, method: &str, params: Value) -> Value {
        self.asked += 1;
        let mut message = json!({ "id": self.asked, "method": method, "params": params });
        if let Some(session) = &self.session {
            message["sessionId"] = json!(session);
        }
        self.to.write_all(format!("{message}\0").as_bytes()).expect("the browser listens");
        let until = Instant::now() + PATIENCE;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            let answer = self.from.recv_timeout(left).unwrap_or_else(|_| panic!("{method} took too long"));
            if answer["id"] == json!(self.asked) {
                assert!(answer.get("error").is_none(), "{method}: {answer}");
                return answer["result"].clone();
            }
            self.hear(&answer);
        }
    }

    fn hear(&mut self, event: &Value) {
        let params = &event["params"];
        match event["method"].as_str().unwrap_or_default() {
            "Runtime.consoleAPICalled" | "Runtime.exceptionThrown" | "Log.entryAdded" => {
                self.said.push(params.to_string())
            }
            "Network.requestWillBeSent" => {
                let url = params["request"]["url"].as_str().unwrap_or_default();
                if !["file:", "data:", "blob:"].iter().any(|kind| url.starts_with(kind)) {
                    self.said.push(format!("asks for {url}"));
                }
            }
            _ => {}
        }
    }

    /// Opens a page of so many pixels, and waits until it is drawn.
    pub fn open(&mut self, page: &Path, hash: &str, [width, height]: [u32; 2]) {
        self.session = None;
        let target = self.ask("Target.createTarget", json!({ "url": "about:blank" }))["targetId"].clone();
        let session = self.ask("Target.attachToTarget", json!({ "targetId": target, "flatten": true }));
        self.session = session["sessionId"].as_str().map(str::to_owned);
        for method in ["Runtime.enable", "Log.enable", "Network.enable", "Page.enable"] {
            self.ask(method, json!({}));
        }
        let metrics = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 700 });
        self.ask("Emulation.setDeviceMetricsOverride", metrics);
        self.ask("Page.navigate", json!({ "url": format!("file://{}#{hash}", page.display()) }));
        self.wait("document.documentElement?.dataset.ready === 'yes'");
    }

    /// The value of an expression; promises are waited for.
    pub fn value(&mut self, expression: &str) -> Value {
        let params = json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let answer = self.ask("Runtime.evaluate", params);
        assert!(answer.get("exceptionDetails").is_none(), "{expression}: {answer}");
        answer["result"]["value"].clone()
    }

    /// The text of an expression.
    pub fn text(&mut self, expression: &str) -> String {
        self.value(expression).as_str().unwrap_or_else(|| panic!("{expression} is no text")).to_owned()
    }

    /// Waits until an expression is true.
    pub fn wait(&mut self, expression: &str) {
        let until = Instant::now() + PATIENCE;
        while self.value(&format!("Boolean({expression})")) != Value::Bool(true) {
            assert!(Instant::now() < until, "{expression} never became true");
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // Nobody waits for an answer.
        let _ = self.to.write_all(b"{\"id\":0,\"method\":\"Browser.close\"}\0");
        let until = Instant::now() + Duration::from_secs(10);
        while Instant::now() < until && self.process.try_wait().is_ok_and(|ended| ended.is_none()) {
            std::thread::sleep(Duration::from_millis(50));
        }
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
