//! A virtual rig and a client of it, each a process of its own.

use super::{assert_code, gripgen, run, text};
use gripgen::record::{RunFolder, ShardReader, status_name};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, ExitStatus, Output, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Longest wait for a process or its word.
pub const PATIENCE: Duration = Duration::from_secs(600);

/// A virtual rig that is served with faults, and the flags that find it.
pub struct Served {
    process: Child,
    faults: ChildStdin,
    pub flags: Vec<String>,
}

impl Served {
    /// `more` are further flags of `rig serve`.
    pub fn start(more: &[&str]) -> Self {
        let mut command = gripgen();
        command.args(["rig", "serve", "--any-ports", "--faults", "--in-step", "-q"]).args(more);
        let mut process = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut line).unwrap();
        // A machine that does something else at the same time is slow, not broken: the rig's clock waits, and so do its clients.
        let mut flags = vec!["--set".into(), "limits.patience=20".into()];
        for (what, key) in [
            ("rtde", "robot.rtde_port"),
            ("dashboard", "robot.dashboard_port"),
            ("primary", "robot.primary_port"),
            ("gripper", "gripper.port"),
            ("camera_left", "cameras.left.port"),
            ("camera_right", "cameras.right.port"),
        ] {
            let word = line.split_whitespace().find_map(|w| w.strip_prefix(&format!("{what}=")));
            let port =
                word.and_then(|address| address.rsplit(':').next()).unwrap_or_else(|| panic!("{line}"));
            flags.extend(["--set".into(), format!("{key}={port}")]);
        }
        let faults = process.stdin.take().unwrap();
        Self { process, faults, flags }
    }

    /// Lets something go wrong.
    pub fn inject(&mut self, fault: &str) {
        writeln!(self.faults, "{fault}").unwrap();
    }

    /// Runs a verb of `gripgen rig` on it.
    pub fn rig(&self, verb: &str, more: &[&str]) -> Output {
        let mut arguments = vec!["rig", verb];
        arguments.extend(more);
        arguments.extend(self.flags.iter().map(String::as_str));
        run(&arguments)
    }

    /// What `rig check` says: its exit code, and what was found of each thing.
    pub fn check(&self) -> (Option<i32>, serde_json::Value) {
        let output = self.rig("check", &["--json", "-q"]);
        (output.status.code(), serde_json::from_slice(&output.stdout).unwrap())
    }

    /// What `rig check` found of one thing.
    pub fn found(&self, what: &str) -> String {
        let (_, json) = self.check();
        let checks = json["checks"].as_array().unwrap();
        let line = checks.iter().find(|line| line["what"] == what).unwrap_or_else(|| panic!("{json}"));
        line["found"].as_str().unwrap().into()
    }

    /// Where the tool stands; a tool that moves is not taught.
    pub fn place(&self) -> String {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("rig.toml");
        std::fs::write(&file, gripgen::assets::get("configs/rig.toml").unwrap()).unwrap();
        let taught = self.rig("teach", &["here", "--rig", file.to_str().unwrap(), "--json"]);
        assert_code(&taught, 0);
        text(&taught.stdout)
    }

    /// The flags of a campaign of a gear, into a folder.
    pub fn pull_flags(&self, out: &Path, pulls: usize) -> Vec<String> {
        let own =
            ["rig", "pull", "--parts", "gear", "--grip-force-n", "25", "--repetitions"].map(String::from);
        let mut flags = own.to_vec();
        flags.extend([pulls.to_string(), "-o".into(), out.to_str().unwrap().into(), "-v".into()]);
        flags.extend(self.flags.clone());
        flags
    }

    /// Begins a campaign.
    pub fn pull(&self, out: &Path, pulls: usize, more: &[&str]) -> Pulling {
        self.pull_answering(out, pulls, more, "")
    }

    /// Begins a campaign with somebody at the keyboard, who has typed these lines.
    pub fn pull_answering(&self, out: &Path, pulls: usize, more: &[&str], typed: &str) -> Pulling {
        let mut command = gripgen();
        command.args(self.pull_flags(out, pulls)).args(more);
        let mut process =
            command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        process.stdin.take().unwrap().write_all(typed.as_bytes()).unwrap();
        let stderr = process.stderr.take().unwrap();
        let (tell, lines) = channel();
        std::thread::spawn(move || {
            BufReader::new(stderr).lines().map_while(Result::ok).for_each(|line| drop(tell.send(line)));
        });
        Pulling { process, lines, said: String::new() }
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Status of each pull of a folder, and why it failed or is suspect; `None` where there is none.
pub fn pulls(out: &Path) -> Vec<Option<(String, String)>> {
    let folder = RunFolder::open(out).unwrap();
    let pull = |index: u64| {
        // A shard without its sidecar is half written: it is taken for none.
        let done = folder.sidecar_path(index).exists();
        done.then(|| {
            let (sample, _) = ShardReader::open(&folder.shard_path(index)).unwrap().pull(index).unwrap();
            let reason = if sample.failure.is_empty() { &sample.status_reason } else { &sample.failure };
            (status_name(sample.status()).to_string(), reason.clone())
        })
    };
    (0..folder.info().shards).map(pull).collect()
}

/// A campaign under way.
pub struct Pulling {
    pub process: Child,
    lines: Receiver<String>,
    /// What it said so far.
    pub said: String,
}

impl Pulling {
    /// Waits for a line that has all of these words.
    pub fn until(&mut self, words: &[&str]) {
        let began = Instant::now();
        loop {
            let left = PATIENCE.saturating_sub(began.elapsed());
            let line = self
                .lines
                .recv_timeout(left)
                .unwrap_or_else(|_| panic!("no line with {words:?}:\n{}", self.said));
            self.said += &(line.clone() + "\n");
            if words.iter().all(|word| line.contains(word)) {
                return;
            }
        }
    }

    /// Ctrl-C.
    pub fn interrupt(&self) {
        let signal = Command::new("kill").args(["-INT", &self.process.id().to_string()]).status().unwrap();
        assert!(signal.success());
    }

    /// Waits for its end and gives its code, or what ended it; and how long that took.
    pub fn end(&mut self) -> (ExitStatus, Duration) {
        let began = Instant::now();
        let status = loop {
            if let Some(status) = self.process.try_wait().unwrap() {
                break status;
            }
            assert!(began.elapsed() < PATIENCE, "it hangs:\n{}", self.said);
            std::thread::sleep(Duration::from_millis(5));
        };
        let took = began.elapsed();
        self.said.extend(self.lines.iter().map(|line| line + "\n"));
        (status, took)
    }

    /// Waits for its end and gives its code.
    pub fn ends(&mut self) -> i32 {
        self.end().0.code().unwrap()
    }

    #[track_caller]
    pub fn ends_with(&mut self, code: i32) -> Duration {
        let (status, took) = self.end();
        assert_eq!(status.code(), Some(code), "{}", self.said);
        took
    }
}
