//! `sot console` on a terminal: typed at and read over a pseudo-terminal, as a person would.

mod base_twin;

use std::fs;
use std::os::fd::OwnedFd;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use base_twin::{Twin, sot};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{Winsize, tcsetwinsize};

const PATIENCE: Duration = Duration::from_secs(60);
const FAILED: i32 = 1;
const INTERRUPTED: i32 = 130;
const PROMPT: &str = "base> ";

const TAB: &str = "\t";
const UP: &str = "\x1b[A";
const CONTROL_C: &str = "\x03";
const CONTROL_D: &str = "\x04";
const CONTROL_U: &str = "\x15";

/// A terminal with `sot console` on it.
struct Terminal {
    master: OwnedFd,
    child: Child,
    /// All that it has drawn, and up to where a test has looked at it.
    drawn: String,
    seen: usize,
}

impl Terminal {
    fn console(twin: &Twin, arguments: &[&str]) -> Self {
        let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
        let master = openpt(flags).expect("the system has pseudo-terminals");
        grantpt(&master).expect("it is ours");
        unlockpt(&master).expect("it is ours");
        let name = ptsname(&master, Vec::new()).expect("it has a name");
        let open = || {
            let end = rustix::fs::open(&name, OFlags::RDWR | OFlags::NOCTTY, Mode::empty());
            Stdio::from(end.expect("it is there"))
        };
        let arguments = [&["console"], arguments].concat();
        let mut command = sot(twin.path(), &arguments);
        command.stdin(open()).stdout(open()).stderr(open());
        command.env("TERM", "xterm").env("XDG_STATE_HOME", twin.path()).env_remove("NO_COLOR");
        let child = command.spawn().expect("sot was built");
        let mut terminal = Self { master, child, drawn: String::new(), seen: 0 };
        terminal.resize(80, 24);
        terminal
    }

    fn resize(&mut self, columns: u16, rows: u16) {
        let size = Winsize { ws_col: columns, ws_row: rows, ws_xpixel: 0, ws_ypixel: 0 };
        tcsetwinsize(&self.master, size).expect("it has a size");
        let pid = self.child.id().to_string();
        let told = std::process::Command::new("kill").args(["-WINCH", &pid]).status();
        assert!(told.expect("kill is there").success());
    }

    fn keys(&mut self, keys: &str) {
        let mut left = keys.as_bytes();
        while !left.is_empty() {
            let count = rustix::io::write(&self.master, left).expect("it takes keys");
            left = &left[count..];
        }
    }

    /// Takes in what is drawn within a moment; false if the terminal has no user any more.
    fn look(&mut self) -> bool {
        let moment = Timespec { tv_sec: 0, tv_nsec: 20_000_000 };
        let mut master = [PollFd::new(&self.master, PollFlags::IN)];
        if poll(&mut master, Some(&moment)).expect("it can be waited for") == 0 {
            return true;
        }
        let mut buffer = [0; 4096];
        match rustix::io::read(&self.master, &mut buffer) {
            Ok(count) if count > 0 => {
                self.drawn += &String::from_utf8_lossy(&buffer[..count]);
                true
            }
            _ => false,
        }
    }

    /// Waits until `text` is drawn, after what was waited for before.
    fn shows(&mut self, text: &str) {
        let started = Instant::now();
        while !self.drawn[self.seen..].contains(text) {
            let in_time = started.elapsed() < PATIENCE && self.look();
            let last: String = self.drawn.chars().rev().take(1000).collect();
            let last: String = last.chars().rev().collect();
            assert!(in_time, "no {text:?}; the last that was drawn: {last:?}");
        }
        self.seen += self.drawn[self.seen..].find(text).unwrap_or(0) + text.len();
    }

    /// What the next `time` draws.
    fn in_the_next(&mut self, time: Duration) -> String {
        let (started, from) = (Instant::now(), self.drawn.len());
        while started.elapsed() < time && self.look() {}
        self.seen = self.drawn.len();
        self.drawn[from..].to_owned()
    }

    fn exit_code(mut self) -> Option<i32> {
        let started = Instant::now();
        while self.child.try_wait().expect("it was started").is_none() {
            self.look();
            assert!(started.elapsed() < PATIENCE, "it does not end: {:?}", self.drawn);
        }
        self.child.wait().expect("it was started").code()
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn a_person_types_recalls_completes_and_pastes() {
    let twin = Twin::start(&[]);
    let mut terminal = Terminal::console(&twin, &[]);
    terminal.shows("Tab completes");
    terminal.shows(PROMPT);
    terminal.keys("G,5,-5\r");
    terminal.shows("g\r\n");
    terminal.keys("H\r");
    terminal.shows("h,5,-5");
    terminal.keys(&format!("{UP}{UP}"));
    terminal.shows("G,5,-5");
    terminal.keys(&format!("{CONTROL_U}nonsense\r"));
    terminal.shows("\x1b[31merror: no such command");

    // The base knows which words there are; they are not shown as its answer.
    terminal.keys(&format!("set spe{TAB}"));
    terminal.shows("speed.");
    terminal.keys(TAB);
    terminal.shows("speed.kp");
    assert!(!terminal.drawn.contains("words:"), "{:?}", terminal.drawn);
    terminal.keys(&format!("{CONTROL_U}versi{TAB}\r"));
    terminal.shows("version ");
    terminal.shows("StereoSot");
    terminal.keys(&format!("D,{TAB}0,0\r"));
    terminal.shows("d\r\n");

    let lines: String = (0..40).map(|n| format!("G,{n},0\rH\r")).collect();
    terminal.keys(&lines);
    for n in 0..40 {
        terminal.shows(&format!("h,{n},0"));
    }
    terminal.keys("stream left.speed_mm_s 20\r");
    terminal.shows("\x1b[36m~");
    terminal.keys(CONTROL_D);
    assert_eq!(terminal.exit_code(), Some(0));
    // It does not go on for whoever comes next.
    let said = base_twin::told(twin.path(), &["console", "--seconds", "0.5", "H"]);
    assert_eq!(said, "h,39,0\n");

    let mut again = Terminal::console(&twin, &[]);
    again.shows(PROMPT);
    again.keys(UP);
    again.shows("stream left.speed_mm_s 20");
    again.keys(CONTROL_C);
    assert_eq!(again.exit_code(), Some(INTERRUPTED));
    let history = fs::read_to_string(twin.path().join("stereosot/console_history"));
    assert!(history.expect("it is kept").contains("nonsense"));
}

#[test]
fn a_base_that_is_silent_or_gone_is_told() {
    let mut twin = Twin::start(&["--fault", "power-off@2"]);
    let mut terminal = Terminal::console(&twin, &["--timeout", "1"]);
    terminal.shows(PROMPT);
    std::thread::sleep(Duration::from_secs(3));
    terminal.keys("status\r");
    terminal.shows("no answer; is the base switched on");
    twin.child.kill().expect("it runs");
    terminal.shows("was closed; was the cable pulled");
    terminal.keys("\r");
    assert_eq!(terminal.exit_code(), Some(FAILED));
}

fn braille(drawn: &str) -> usize {
    drawn.chars().filter(|c| ('\u{2801}'..='\u{28ff}').contains(c)).count()
}

#[test]
fn a_plot_is_drawn_fits_a_new_size_and_ends_with_q_or_with_the_line() {
    let mut twin = Twin::start(&[]);
    let plot = ["--plot", "left.speed_mm_s,right.speed_mm_s"];
    let mut terminal = Terminal::console(&twin, &plot);
    terminal.shows("left.speed_mm_s");
    let drawn = terminal.in_the_next(Duration::from_secs(2));
    assert!(braille(&drawn) >= 3, "no curve: {drawn:?}");
    terminal.resize(50, 12);
    let drawn = terminal.in_the_next(Duration::from_secs(1));
    let bottom = format!("\u{2514}{}\u{2518}", "\u{2500}".repeat(48));
    assert!(drawn.contains(&bottom), "no frame of 50 columns: {drawn:?}");
    terminal.keys("q");
    assert_eq!(terminal.exit_code(), Some(0));
    // The base does not go on sending.
    let said = base_twin::told(twin.path(), &["console", "--seconds", "0.5", "H"]);
    assert_eq!(said, "h,0,0\n");

    let mut terminal = Terminal::console(&twin, &plot);
    terminal.shows("left.speed_mm_s");
    terminal.keys(CONTROL_C);
    assert_eq!(terminal.exit_code(), Some(INTERRUPTED));
    let mut terminal = Terminal::console(&twin, &plot);
    terminal.shows("left.speed_mm_s");
    twin.child.kill().expect("it runs");
    terminal.shows("was closed; was the cable pulled");
    assert_eq!(terminal.exit_code(), Some(FAILED));
}
