//! A running `sot twin khepera`, and `sot` beside it, for the tests that need a base on a serial line.

#![allow(dead_code)] // every test file uses a part of it

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use tempfile::TempDir;

const FIRMWARE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../build/firmware");

/// `sot` with these arguments, in `folder`.
pub fn sot(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sot"));
    command
        .args(arguments)
        .current_dir(folder)
        .env("STEREOSOT_FIRMWARE", FIRMWARE)
        .env("XDG_RUNTIME_DIR", folder)
        .stdin(Stdio::null());
    command
}

/// What it does.
pub fn output(folder: &Path, arguments: &[&str]) -> Output {
    sot(folder, arguments).output().expect("sot was built")
}

/// Bytes as text.
pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Standard output of a command that must end with 0.
pub fn told(folder: &Path, arguments: &[&str]) -> String {
    let output = output(folder, arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

/// A running twin and the folder that it is linked in.
pub struct Twin {
    folder: TempDir,
    pub child: Child,
}

impl Twin {
    pub fn start(arguments: &[&str]) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let all = [&["twin", "khepera", "--pty", "tty"], arguments].concat();
        let child = sot(folder.path(), &all)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("sot was built");
        let twin = Self { folder, child };
        twin.wait_for(|twin| twin.line().exists(), "the pseudo-terminal");
        twin
    }

    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    pub fn line(&self) -> PathBuf {
        self.path().join("tty")
    }

    pub fn wait_for(&self, condition: impl Fn(&Self) -> bool, what: &str) {
        let started = Instant::now();
        while !condition(self) {
            assert!(started.elapsed() < Duration::from_secs(60), "no {what} within a minute");
            sleep(Duration::from_millis(20));
        }
    }

    /// Ctrl-C; exit code and standard output.
    pub fn interrupt(mut self) -> (Option<i32>, String) {
        let pid = self.child.id().to_string();
        Command::new("kill").args(["-INT", &pid]).status().expect("kill is there");
        let status = self.child.wait().expect("it was started");
        let mut said = String::new();
        let output = self.child.stdout.as_mut().expect("it is a pipe");
        output.read_to_string(&mut said).expect("text");
        assert!(fs::symlink_metadata(self.line()).is_err(), "the link goes with the twin");
        (status.code(), said)
    }
}

impl Drop for Twin {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// S-records of a program for RAM that sends the letter A again and again.
pub fn letters() -> String {
    let bytes = "31FC0052FC0831FC0008FC0A11FC0055FA2711FC00AAFA2708380000FC0C67EC31FC0041FC0E60E4";
    let length = bytes.len() / 2 + 5;
    let digits = format!("{length:02X}00102800{bytes}");
    let sum = (0..digits.len()).step_by(2).fold(0u8, |sum, at| {
        sum.wrapping_add(u8::from_str_radix(&digits[at..at + 2], 16).expect("digits"))
    });
    format!("S3{digits}{:02X}\nS70500102800C2\n", !sum)
}
