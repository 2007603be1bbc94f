//! Debian's Chromium without a screen, driven by its DevTools protocol over two pipes.
//!
//! Looked for on the PATH. The content of a page is left to `page`.

use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use serde_json::{Value, json};

/// Chromium takes commands from descriptor 3 and answers on 4; its own output is of no use here.
const PIPED: &str = r#"exec chromium "$@" 3<&0 4>&1 </dev/null >/dev/null 2>&1"#;

/// A browser with no page open yet; it ends with this value.
pub(crate) struct Browser {
    child: Child,
    commands: ChildStdin,
    answers: BufReader<ChildStdout>,
    last: u64,
    profile: PathBuf,
}

impl Browser {
    /// Starts one with a profile of its own; `None` where there is no `chromium`.
    pub(crate) fn start(name: &str) -> Option<Self> {
        Command::new("chromium").arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status().ok()?;
        let profile = std::env::temp_dir().join(format!("holdsafe-{name}-{}", std::process::id()));
        let profile_option = format!("--user-data-dir={}", profile.display());
        let options = ["--headless=new", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe", &profile_option];
        let mut command = Command::new("sh");
        command.args(["-c", PIPED, "sh"]).args(options).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let (commands, answers) = (child.stdin.take().unwrap(), BufReader::new(child.stdout.take().unwrap()));
        Some(Self { child, commands, answers, last: 0, profile })
    }

    /// The result of a command, in a session or of the browser itself.
    fn command(&mut self, session: Option<&str>, method: &str, parameters: &Value) -> Value {
        self.last += 1;
        let mut message = json!({ "id": self.last, "method": method, "params": parameters });
        if let Some(session) = session {
            message["sessionId"] = json!(session);
        }
        self.commands.write_all(format!("{message}\0").as_bytes()).unwrap();
        loop {
            let mut bytes = Vec::new();
            let read = self.answers.read_until(0, &mut bytes).unwrap();
            assert!(read > 0, "the browser went away before it answered {method}");
            bytes.pop();
            let answer: Value = serde_json::from_slice(&bytes).unwrap();
            if answer["id"] == self.last {
                assert!(answer["error"].is_null(), "{method}: {answer}");
                return answer["result"].clone();
            }
        }
    }

    /// Opens this address in a tab as wide as a screen of `width` points.
    pub(crate) fn open(&mut self, address: &str, width: u32, scheme: &str) -> Tab<'_> {
        let target = self.command(None, "Target.createTarget", &json!({ "url": "about:blank" }));
        let attach = json!({ "targetId": target["targetId"], "flatten": true });
        let session = self.command(None, "Target.attachToTarget", &attach)["sessionId"].as_str().unwrap().to_owned();
        let mut tab = Tab { browser: self, session };
        let size = json!({ "width": width, "height": 844, "deviceScaleFactor": 1, "mobile": width < 640 });
        tab.command("Emulation.setDeviceMetricsOverride", &size);
        let feature = json!({ "features": [{ "name": "prefers-color-scheme", "value": scheme }] });
        tab.command("Emulation.setEmulatedMedia", &feature);
        tab.command("Page.navigate", &json!({ "url": address }));
        tab
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // It is waited for, so that nothing of it outlives the test.
        let _ = self.child.kill();
        let _ = self.child.wait();
        let _ = std::fs::remove_dir_all(&self.profile);
    }
}

/// A page in a browser.
pub(crate) struct Tab<'a> {
    browser: &'a mut Browser,
    session: String,
}

impl Tab<'_> {
    fn command(&mut self, method: &str, parameters: &Value) -> Value {
        self.browser.command(Some(&self.session), method, parameters)
    }

    /// The value of a JavaScript expression in the page.
    pub(crate) fn value(&mut self, expression: &str) -> Value {
        let ask = json!({ "expression": expression, "awaitPromise": true, "returnByValue": true });
        let answer = self.command("Runtime.evaluate", &ask);
        assert!(answer["exceptionDetails"].is_null(), "{expression}: {answer}");
        answer["result"]["value"].clone()
    }

    /// Waits until an expression holds in the page; the page's text is then the failure, after 20 s without.
    pub(crate) fn until(&mut self, expression: &str) {
        let wait = format!(
            "new Promise((done) => {{ const end = performance.now() + 20000; const look = () => {{ \
             let holds = false; try {{ holds = {expression}; }} catch {{}} \
             holds || performance.now() > end ? done(Boolean(holds)) : setTimeout(look, 20); }}; look(); }})"
        );
        if self.value(&wait) != true {
            panic!("never: {expression}\n{}", self.value("document.body.innerText"));
        }
    }
}
