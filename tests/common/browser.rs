//! Pages in headless Chromium, and what they say of themselves. Without a browser tests of pages say so and pass;
//! where CI is set they fail.

use super::{answers, is_ci};
use std::path::Path;
use std::process::{Command, Stdio};

const BROWSERS: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];

/// The widths of [`frames`]: a desk and a telephone.
pub const WIDTHS: [u64; 2] = [400, 1280];

/// The page around frames of two widths, which collects what they say.
const FRAMES: &str = r#"<!DOCTYPE html><body><pre id="said"></pre><script>
const said = [];
addEventListener("message", (event) => {
  said.push(event.data);
  document.getElementById("said").textContent = JSON.stringify(said);
});
</script>
<iframe src="measured.html" style="width:400px;height:900px;border:0"></iframe>
<iframe src="measured.html" style="width:1280px;height:900px;border:0"></iframe>"#;

/// The name of a browser that runs; `None` where there is none.
pub fn browser() -> Option<&'static str> {
    let found = BROWSERS.into_iter().find(|name| answers(&[name, "--version"]));
    if found.is_none() {
        eprintln!("not tested: none of {BROWSERS:?} runs here");
        assert!(!is_ci(), "CI needs a browser: one of {BROWSERS:?}");
    }
    found
}

/// A page after its scripts.
pub struct Seen {
    /// The document.
    pub document: String,
    /// The lines of the console.
    pub console: Vec<String>,
}

/// The document that a browser makes of a file in a scheme, "light" or "dark".
pub fn seen(browser: &str, folder: &Path, file: &str, scheme: &str) -> Seen {
    let output = Command::new(browser)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-dev-shm-usage",
            "--window-size=1280,1000",
            "--virtual-time-budget=20000",
            "--enable-logging=stderr",
            "--dump-dom",
        ])
        .arg(format!(
            "--blink-settings=preferredColorScheme={}",
            u8::from(scheme == "light")
        ))
        .arg(format!("--user-data-dir={}", folder.join("profile").display()))
        .arg(format!("file://{}", folder.join(file).display()))
        .stdin(Stdio::null())
        .output()
        .expect("a browser");
    let console = String::from_utf8_lossy(&output.stderr);
    let console = console.lines().filter(|line| line.contains(":CONSOLE"));
    Seen {
        console: console.map(str::to_owned).collect(),
        document: String::from_utf8(output.stdout).expect("UTF-8"),
    }
}

/// The page with one more script, which its policy would forbid.
pub fn with_script(page: &str, script: &str) -> String {
    let (before, rest) = page.split_once("script-src '").expect("a policy");
    let (_, after) = rest.split_once('\'').expect("a hash");
    let open = format!("{before}script-src 'unsafe-inline'{after}");
    open.replace("</body>", &format!("<script>\n{script}</script></body>"))
}

/// The answers of `script` on a page of a folder at both widths, as `parent.postMessage`: in the order of [`WIDTHS`].
pub fn frames(browser: &str, folder: &Path, page: &str, script: &str) -> Vec<serde_json::Value> {
    let page = std::fs::read_to_string(folder.join(page)).expect("a page");
    std::fs::write(folder.join("measured.html"), with_script(&page, script)).expect("written");
    std::fs::write(folder.join("frames.html"), FRAMES).expect("written");
    let document = seen(browser, folder, "frames.html", "light").document;
    let (_, said) = document.split_once("<pre id=\"said\">").expect("what was said");
    let (said, _) = said.split_once("</pre>").expect("all of it");
    let said = said.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&");
    let mut said: Vec<serde_json::Value> =
        serde_json::from_str(&said).unwrap_or_else(|error| panic!("{error}: {said}"));
    said.sort_by_key(|of| of["width"].as_u64());
    let widths: Vec<u64> = said.iter().filter_map(|of| of["width"].as_u64()).collect();
    assert_eq!(widths, WIDTHS);
    said
}
