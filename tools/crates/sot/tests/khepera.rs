//! The base as a user meets it: `sot twin khepera`, `sot console` and `sot flash khepera` as programs.

mod base_twin;

use std::fs;
use std::process::Stdio;
use std::thread::sleep;
use std::time::Duration;

use base_twin::{Twin, letters, output, sot, text, told};

const FAILED: i32 = 1;
const USAGE: i32 = 2;
const INTERRUPTED: i32 = 130;

#[test]
fn a_console_talks_to_the_only_twin_and_a_script_gets_json() {
    let twin = Twin::start(&["--json"]);
    let listed = told(twin.path(), &["list"]);
    assert!(listed.contains("serial:") && listed.contains("tty"), "{listed}");
    assert!(told(twin.path(), &["console", "version"]).contains("StereoSot"));
    assert_eq!(told(twin.path(), &["console", "G,100,-100", "H"]), "g\nh,100,-100\n");

    let said = told(twin.path(), &["console", "--json", "H", "nonsense"]);
    let lines: Vec<serde_json::Value> =
        said.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    assert_eq!(lines[0]["line"], "h,100,-100");
    assert_eq!((&lines[0]["kind"], &lines[1]["kind"]), (&"reply".into(), &"error".into()));

    let command = "stream left.speed_mm_s,right.speed_mm_s 20";
    let said = told(twin.path(), &["console", "--json", "--seconds", "1", command]);
    let values = said.lines().filter(|line| line.contains("\"left.speed_mm_s\":0.0")).count();
    assert!(values >= 10, "{values} values in a second: {said}");
    // The stream ends with the console.
    assert_eq!(told(twin.path(), &["console", "H"]), "h,100,-100\n");

    let plot = output(twin.path(), &["console", "--plot", "left.speed_mm_s"]);
    assert_eq!(plot.status.code(), Some(USAGE), "no terminal, no plot");
    let (code, said) = twin.interrupt();
    assert_eq!(code, Some(INTERRUPTED));
    let report: serde_json::Value = serde_json::from_str(&said).expect("JSON at the end");
    assert_eq!(report["resets"][0]["cause"], "power");
    assert_eq!(report["diagnostics"], serde_json::json!([]));
}

#[test]
fn lines_from_a_pipe_are_answered_in_turn() {
    let twin = Twin::start(&[]);
    let input = twin.path().join("script");
    fs::write(&input, "\nG,1,2\n\nH\nE").expect("writable");
    let output = sot(twin.path(), &["console"])
        .stdin(fs::File::open(&input).expect("it is there"))
        .output()
        .expect("sot was built");
    assert_eq!(text(&output.stdout), "g\nh,1,2\ne,0,0\n");
}

#[test]
fn a_program_is_flashed_and_what_is_there_is_left_alone() {
    let twin = Twin::start(&[]);
    let said = told(twin.path(), &["flash", "khepera"]);
    assert!(said.contains("unchanged"), "{said}");
    twin.wait_for(answers, "answer after the loader");

    fs::write(twin.path().join("letters.s37"), letters()).expect("writable");
    let said = told(twin.path(), &["flash", "khepera", "letters.s37", "--dry-run", "--json"]);
    assert!(said.contains("would_write"), "{said}");
    twin.wait_for(answers, "answer after the dry run");
    let said = told(twin.path(), &["flash", "khepera", "letters.s37"]);
    assert!(said.contains("written") && said.contains("1 blocks sent"), "{said}");
    twin.wait_for(|twin| told(twin.path(), &["console", "x"]).contains("AAAA"), "letters");

    // That program does not listen.
    let output = output(twin.path(), &["flash", "khepera"]);
    assert_eq!(output.status.code(), Some(FAILED));
    assert!(text(&output.stderr).contains("--wait"), "{}", text(&output.stderr));
}

fn answers(twin: &Twin) -> bool {
    output(twin.path(), &["console", "--timeout", "0.5", "B"]).status.code() == Some(0)
}

#[test]
fn a_flash_file_keeps_what_was_flashed() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("flash.bin");
    let name = file.to_str().expect("a name");
    let twin = Twin::start(&["--flash", name]);
    fs::write(twin.path().join("letters.s37"), letters()).expect("writable");
    told(twin.path(), &["flash", "khepera", "letters.s37"]);
    twin.interrupt();
    assert_eq!(fs::metadata(&file).expect("it was written").len(), 512 << 10);
    let said = told(folder.path(), &["twin", "khepera", "--flash", name, "--seconds", "0.3"]);
    assert!(said.contains("AAAA"), "{said}");
}

#[test]
fn a_twin_that_dies_under_a_flash_is_told() {
    let mut twin = Twin::start(&[]);
    let flash = sot(twin.path(), &["flash", "khepera", "--force", "--baud", "9600"])
        .stderr(Stdio::piped())
        .spawn()
        .expect("sot was built");
    sleep(Duration::from_secs(3));
    twin.child.kill().expect("it runs");
    let output = flash.wait_with_output().expect("it ends by itself");
    assert_eq!(output.status.code(), Some(FAILED));
    assert!(
        text(&output.stderr).contains("the base keeps its program"),
        "{}",
        text(&output.stderr)
    );
}

#[test]
fn a_battery_empties_and_the_floor_tells_where_the_robot_is() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let arguments = "twin khepera --seconds 3 --json --battery 50 --noise measured --seed 2";
    let words: Vec<&str> = arguments.split(' ').collect();
    let report: serde_json::Value =
        serde_json::from_str(&told(folder.path(), &words)).expect("JSON");
    let percent = report["battery"]["percent"].as_f64().expect("a number");
    assert!((49.0..50.0).contains(&percent), "{report}");
    assert_eq!(report["pose"]["x_mm"], 0.0, "nobody drives it");

    // Empty: it never starts.
    let said =
        told(folder.path(), &["twin", "khepera", "--seconds", "1", "--battery", "0", "--json"]);
    let report: serde_json::Value = serde_json::from_str(&said).expect("JSON");
    assert_eq!((&report["cpu"], &report["resets"]), (&"held".into(), &serde_json::json!([])));
}

#[test]
fn wrong_use_is_told_in_one_line() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("zeros"), [0; 100]).expect("writable");
    fs::write(folder.path().join("there"), "").expect("writable");
    for (arguments, code, words) in [
        (&["flash", "khepera"][..], FAILED, "no robot found"),
        (&["flash", "khepera", "--robot", "serial:no"], FAILED, "cannot open no"),
        (&["flash", "khepera", "no.elf", "--robot", "serial:no"], FAILED, "no.elf"),
        (&["flash", "khepera", "zeros", "--robot", "serial:no"], FAILED, "neither"),
        (&["flash", "khepera", "--baud", "12345"], USAGE, "115200"),
        (&["console", "--robot", "serial:no", "B"], FAILED, "cannot open no"),
        (&["console", "--timeout", "x"], USAGE, "seconds"),
        (&["twin", "khepera", "--fault", "flood@1"], USAGE, "encoder-stuck-left"),
        (&["twin", "khepera", "--battery", "101"], USAGE, "percentage"),
        (&["twin", "khepera", "--pty", "there"], FAILED, "not a link"),
        (&["twin", "khepera", "zeros", "--seconds", "1"], FAILED, "neither an ELF"),
    ] {
        let output = output(folder.path(), arguments);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
        assert!(said.contains(words), "{arguments:?} does not say '{words}': {said}");
        assert_eq!(said.trim_end().lines().count(), 1, "{arguments:?}: {said}");
    }
}

#[test]
fn an_unpaced_run_prints_what_the_base_says_and_shows_faults() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let said = told(folder.path(), &["twin", "khepera", "--seconds", "2", "--json"]);
    let report: serde_json::Value = serde_json::from_str(&said).expect("JSON");
    assert!(report["sim_seconds"].as_f64().is_some_and(|seconds| seconds >= 2.0));
    let arguments = [
        "twin",
        "khepera",
        "--seconds",
        "2",
        "--json",
        "--fault",
        "power-off@0.5",
        "--fault",
        "repaired@1",
    ];
    let report: serde_json::Value =
        serde_json::from_str(&told(folder.path(), &arguments)).expect("JSON");
    let causes: Vec<_> = report["resets"].as_array().expect("a list").iter().collect();
    assert_eq!(causes.len(), 2, "{causes:?}");
    assert_eq!(causes[1]["cause"], "power");
}
