//! Clients of K-Team's protocol that nobody here wrote, by what is known of their ways: how they begin,
//! end their lines, wait, and read. The firmware is the image as built.
//!
//! | client | baud | ends a line by | reads |
//! |---|---|---|---|
//! | Player's driver | 38400 | CR LF, and begins with an empty line | up to CR LF |
//! | Pyro | 38400 | LF, five questions at once | whole lines, in the order of its questions |
//! | Edinburgh's course, in Python | 9600 | LF | one line for each, within a second; nothing may wait |
//! | a terminal, as K-Team's FAQ has it | 9600 | CR | what is on the screen |

use std::path::Path;

use khepera::turret_bus::Unconnected;
use khepera::{Base, Config};
use sim::{MS, Ps, SECOND};

fn image() -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../../build/firmware/khepera-firmware/khepera-firmware.elf");
    std::fs::read(&path).unwrap_or_else(|error| {
        panic!(
            "{}: {error}; build it with: cmake --preset firmware && cmake --build --preset firmware",
            path.display()
        )
    })
}

/// A base and what its client has not read yet.
struct Client {
    base: Base,
    heard: Vec<u8>,
}

impl Client {
    /// At 9600 baud, the base on for half a second.
    fn new() -> Self {
        Self::of(Base::new(&image(), Config::default()).expect("a good image"))
    }

    fn of(base: Base) -> Self {
        let mut client = Self { base, heard: vec![] };
        client.wait(SECOND / 2);
        client.heard.clear();
        client
    }

    /// At a rate that the robot has been told to start with: by the shell, once, and saved.
    fn at(baud: u32) -> Self {
        let mut first = Self::new();
        first.base.serial_send(format!("set serial.baud {baud}\r\nsave\r\n").as_bytes());
        first.wait(5 * SECOND);
        assert!(String::from_utf8_lossy(&first.heard).contains("ok: saved"));
        let config = Config { host_baud: Some(baud), ..Config::default() };
        Self::of(Base::from_flash(first.base.flash(), config).expect("a flash"))
    }

    fn wait(&mut self, time: Ps) {
        self.base.run_until(self.base.now() + time, &mut Unconnected);
        self.heard.extend(self.base.serial_take().into_iter().map(|(_, byte)| byte));
    }

    fn send(&mut self, text: &str) {
        self.base.serial_send(text.as_bytes());
    }

    /// The next line with its end; what has come of it after `limit`.
    fn read_line(&mut self, limit: Ps) -> String {
        let end = self.base.now() + limit;
        loop {
            if let Some(at) = self.heard.iter().position(|&byte| byte == b'\n') {
                return String::from_utf8(self.heard.drain(..=at).collect()).expect("text");
            }
            if self.base.now() >= end {
                return String::from_utf8_lossy(&self.heard).into_owned();
            }
            self.wait(MS);
        }
    }
}

/// The values of an answer, cut out by position: two characters before, CR and LF behind.
fn values(answer: &str) -> Vec<i32> {
    let inside = answer.get(2..answer.len() - 2).expect("a letter, a comma, and CR LF");
    inside.split(',').map(|value| value.parse().expect("a decimal")).collect()
}

#[test]
fn one_question_one_line_within_a_second() {
    let mut client = Client::new();
    let mut ask = |command: &str| {
        assert_eq!(client.heard, [], "something waits before {command}");
        client.send(&format!("{command}\n"));
        let answer = client.read_line(SECOND);
        let letter = command.chars().next().map(|letter| letter.to_ascii_lowercase());
        assert_eq!(answer.chars().next(), letter, "{command}: {answer:?}");
        assert!(answer.ends_with("\r\n"), "{command}: {answer:?}");
        client.wait(if command.starts_with('D') { SECOND } else { 0 });
        answer
    };
    ask("G,0,0");
    ask("D,2,2");
    ask("D,-2,2");
    ask("D,0,0");
    let counts = values(&ask("H"));
    assert!((counts[0]).abs() < 60 && (counts[1] - 400).abs() < 60, "{counts:?}");
    assert_eq!(values(&ask("N")).len(), 8);
    assert_eq!(values(&ask("O")).len(), 8);
}

#[test]
fn an_empty_line_first_and_then_everything_at_38400() {
    let mut client = Client::at(38_400);
    client.send("\r\n");
    client.wait(200 * MS);
    assert_eq!(client.heard, [], "an empty line gets no answer");
    for (line, begins) in [
        ("A,3800,800,100", "a\r\n"),
        ("G,0,0", "g\r\n"),
        ("B", "b,"),
        ("D,0,0", "d\r\n"),
        ("H", "h,0,0\r\n"),
        ("N", "n,"),
        ("E", "e,0,0\r\n"),
        ("D,20,20", "d\r\n"),
        ("D,0,0", "d\r\n"),
    ] {
        client.send(&format!("{line}\r\n"));
        let answer = client.read_line(100 * MS);
        assert!(answer.starts_with(begins) && answer.ends_with("\r\n"), "{line}: {answer:?}");
    }
    client.wait(200 * MS);
    assert_eq!(client.heard, []);
}

#[test]
fn five_questions_at_once_are_answered_in_their_order() {
    let mut client = Client::at(38_400);
    client.send("H\n");
    assert_eq!(client.read_line(SECOND), "h,0,0\r\n");
    for round in 0..20 {
        client.send("N\nO\nH\nE\nK\nT,1,G\n");
        client.send(&format!("D,{round},{}\n", round / 2));
        let letters: String =
            (0..7).map(|_| client.read_line(SECOND).chars().next().unwrap_or('?')).collect();
        assert_eq!(letters, "nohekzd", "a gripper is not there");
        client.wait(30 * MS);
    }
    assert_eq!(client.heard, []);
    let [left, right] = client.base.wheel_speeds_mm_s();
    assert!(left > right && right > 20.0, "{left}, {right} mm/s");
}

#[test]
fn a_terminal_that_ends_lines_by_cr_sees_answers_and_no_echo() {
    let mut client = Client::new();
    for letter in "B\rD,5,5\rL,0,2\rK\r".chars() {
        client.send(&letter.to_string());
        client.wait(80 * MS);
    }
    let screen = String::from_utf8_lossy(&client.heard).into_owned();
    let lines: Vec<&str> = screen.split_terminator("\r\n").collect();
    assert_eq!(lines[..3], ["b,5.02,5.01", "d", "l"]);
    assert!(lines.len() == 4 && lines[3].starts_with("k,"), "{screen:?}");
}

#[test]
fn a_client_that_dies_in_the_middle_of_a_line_spoils_one_line_of_the_next() {
    let mut client = Client::new();
    client.send("D,10");
    client.wait(SECOND);
    // The next one begins with an empty line, which ends what was left ...
    client.send("\r\n");
    assert_eq!(client.read_line(100 * MS), "z,Protocol error\r\n");
    client.send("B\r\n");
    assert_eq!(client.read_line(100 * MS), "b,5.02,5.01\r\n");
    // ... or finds its first line refused.
    client.send("G,1");
    client.wait(SECOND);
    client.send("H\n");
    assert_eq!(client.read_line(100 * MS), "z,Protocol error\r\n");
    client.send("H\n");
    assert_eq!(client.read_line(100 * MS), "h,0,0\r\n");
}
