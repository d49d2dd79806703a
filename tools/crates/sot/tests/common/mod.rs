//! What the tests share that use `sot` against `sot twin robot`, as a user would.

// Each test program uses a part of this.
#![allow(dead_code)]

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;
use virtex::bitstream::{Options, make, make_partial};
use virtex::design::Function;

pub const FIRMWARE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../build/firmware");
/// Nothing here takes longer, even on a machine that has other things to do.
pub const PATIENCE: Duration = Duration::from_secs(90);

/// A folder with bitstreams in it, and the list of running twins of whoever works there.
pub struct Desk {
    folder: TempDir,
}

impl Desk {
    pub fn new() -> Self {
        let desk = Self { folder: tempfile::tempdir().expect("a temporary folder") };
        desk.put("soccer.bin", &make(Function::Soccer, &Options::default()));
        desk.put("capture.bin", &make(Function::Capture, &Options::default()));
        desk.put("change.bin", &make_partial(Function::Capture, &Options::default()));
        desk
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn put(&self, name: &str, bytes: &[u8]) {
        fs::write(self.path(name), bytes).expect("a file can be written");
    }

    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sot"));
        command
            .args(arguments)
            .current_dir(self.folder.path())
            .env("XDG_RUNTIME_DIR", self.folder.path())
            .env("STEREOSOT_FIRMWARE", FIRMWARE)
            .stdin(Stdio::null());
        command
    }

    pub fn sot(&self, arguments: &str) -> Output {
        let words: Vec<&str> = arguments.split_whitespace().collect();
        self.command(&words).output().expect("sot was built")
    }

    /// What it prints; it must succeed.
    pub fn ok(&self, arguments: &str) -> String {
        let output = self.sot(arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "sot {arguments}: {said}");
        String::from_utf8(output.stdout).expect("text")
    }

    /// Its one JSON value; it must succeed.
    pub fn json(&self, arguments: &str) -> Value {
        serde_json::from_str(&self.ok(arguments)).expect("one JSON value")
    }

    /// It must fail with `code`, and say all of `words` in one line that says "sot: ".
    pub fn fails(&self, arguments: &str, code: i32, words: &[&str]) {
        let output = self.sot(arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "sot {arguments}: {said}");
        assert_eq!(said.trim_end().lines().count(), 1, "sot {arguments}: {said}");
        for word in words {
            assert!(said.contains(word), "sot {arguments} does not say '{word}': {said}");
        }
    }

    pub fn slot(&self, number: usize) -> Value {
        self.json("fpga slots --json")[number].clone()
    }
}

/// A twin that runs.
pub struct Twin {
    child: Child,
    pub place: String,
}

impl Twin {
    pub fn start(desk: &Desk, arguments: &str) -> Self {
        let mut words = vec!["twin", "robot", "--usbredir", "127.0.0.1:0"];
        words.extend(arguments.split_whitespace());
        let mut command = desk.command(&words);
        let mut child =
            command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("sot was built");
        let mut lines = BufReader::new(child.stderr.take().expect("it is piped")).lines();
        let (send, receive) = mpsc::channel();
        std::thread::spawn(move || {
            // To the end: a full pipe would stop the twin.
            while let Some(Ok(line)) = lines.next() {
                let _ = send.send(line);
            }
        });
        let mut said = String::new();
        loop {
            let Ok(line) = receive.recv_timeout(PATIENCE) else {
                let _ = child.kill();
                let _ = child.wait();
                panic!("the twin does not start; is the preset firmware built? {said}");
            };
            if let Some(place) = line.strip_prefix("serving usbredir at ") {
                return Self { child, place: place.to_owned() };
            }
            said += &line;
        }
    }

    /// As pulling the plug.
    pub fn kill(mut self) {
        self.child.kill().expect("it runs");
        self.child.wait().expect("it ends");
    }
}

impl Drop for Twin {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

pub fn ended(child: &mut Child) -> (Option<i32>, String) {
    let begin = Instant::now();
    loop {
        if let Some(status) = child.try_wait().expect("it can be waited for") {
            let mut said = String::new();
            let mut stderr = child.stderr.take().expect("it is piped");
            stderr.read_to_string(&mut said).expect("text");
            return (status.code(), said);
        }
        if begin.elapsed() > PATIENCE {
            let _ = child.kill();
            panic!("it does not end");
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}

pub fn in_background(desk: &Desk, arguments: &str) -> Child {
    let words: Vec<&str> = arguments.split_whitespace().collect();
    let mut command = desk.command(&words);
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("sot was built")
}
