//! What a user can get wrong: every case ends with one clear line on standard error and the exit code
//! that README and --help document.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use tempfile::TempDir;

const FAILED: i32 = 1;
const USAGE: i32 = 2;

fn sot(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sot"))
        .args(arguments)
        .current_dir(folder)
        .env("STEREOSOT_FIRMWARE", concat!(env!("CARGO_MANIFEST_DIR"), "/../../../build/firmware"))
        .output()
        .expect("sot was built")
}

/// Runs sot in `folder`, which must fail with `code` and one line that contains all of `words`.
fn fails(folder: &Path, arguments: &[&str], code: i32, words: &[&str]) {
    let output = sot(folder, arguments);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
    assert_eq!(said.trim_end().lines().count(), 1, "{arguments:?} says more than a line: {said}");
    assert!(said.starts_with("sot: "), "{arguments:?}: {said}");
    assert!(output.stdout.is_empty(), "{arguments:?} prints to standard output");
    for word in words {
        assert!(said.contains(word), "{arguments:?} does not say '{word}': {said}");
    }
}

fn folder() -> TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn put(folder: &TempDir, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.path().join(name);
    fs::write(&path, bytes).expect("the temporary folder is writable");
    path
}

/// A grey picture as PGM.
fn grey(width: usize, height: usize) -> Vec<u8> {
    let mut bytes = format!("P5\n{width} {height}\n255\n").into_bytes();
    bytes.resize(bytes.len() + width * height, 0x80);
    bytes
}

#[test]
fn wrong_arguments_are_told_in_one_line() {
    let folder = folder();
    let here = folder.path();
    fails(here, &[], USAGE, &["verb", "--help"]);
    fails(here, &["plya"], USAGE, &["plya", "play"]);
    fails(here, &["play", "--sead", "1"], USAGE, &["--sead", "--seed"]);
    fails(here, &["play", "--seed", "one"], USAGE, &["--seed", "one"]);
    fails(here, &["play", "--seconds", "0"], USAGE, &["--seconds"]);
    fails(here, &["play", "--seconds", "nan"], USAGE, &["--seconds"]);
    fails(here, &["play", "--opponent", "nobody"], USAGE, &["nobody", "idle"]);
    fails(here, &["play", "--csv", "x.csv"], USAGE, &["--matches"]);
    fails(here, &["play", "--matches", "0"], USAGE, &["--matches", "1"]);
    fails(here, &["play", "--vary", "grip=2"], USAGE, &["grip", "tyre-grip"]);
    fails(here, &["play", "--vary", "tyre-grip=0"], USAGE, &["NAME=FACTOR"]);
    fails(here, &["detect", "one.png"], USAGE, &["RIGHT"]);
    fails(here, &["bitstream", "make", "tennis", "-o", "x"], USAGE, &["tennis", "soccer"]);
    fails(here, &["bitstream", "pack", "32=x", "-o", "y"], USAGE, &["32", "31"]);
    fails(here, &["bitstream", "pack", "x", "-o", "y"], USAGE, &["SLOT=FILE"]);
}

#[test]
fn missing_files_are_named() {
    let folder = folder();
    let here = folder.path();
    fails(here, &["detect", "no.png", "no.png"], FAILED, &["no.png", "No such file"]);
    fails(here, &["bitstream", "check", "no.bit"], FAILED, &["no.bit", "No such file"]);
    fails(here, &["play", "--headless", "--flash", "no.img"], FAILED, &["no.img", "No such file"]);
    fails(here, &["play", "--headless", "--khepera-image", "no.elf"], FAILED, &["no.elf"]);
}

#[test]
fn unreadable_pictures_are_named_with_what_could_be_read() {
    let folder = folder();
    let here = folder.path();
    put(&folder, "text.png", b"this is no picture");
    put(&folder, "empty.png", b"");
    put(&folder, "cut.pgm", &grey(320, 240)[..5000]);
    put(&folder, "good.pgm", &grey(320, 240));
    put(&folder, "small.pgm", &grey(160, 120));
    put(&folder, "wide.pgm", &grey(5000, 2));
    for bad in ["text.png", "empty.png", "cut.pgm", "wide.pgm"] {
        fails(here, &["detect", "good.pgm", bad], FAILED, &[bad]);
    }
    fails(here, &["detect", "good.pgm", "small.pgm"], FAILED, &["320x240", "160x120"]);
}

#[test]
fn pictures_of_another_size_are_scaled_to_the_robots() {
    let folder = folder();
    put(&folder, "odd.pgm", &grey(641, 479));
    let output = sot(folder.path(), &["detect", "odd.pgm", "odd.pgm", "--json"]);
    assert!(output.status.success(), "{output:?}");
    assert!(String::from_utf8_lossy(&output.stderr).contains("641x479"), "{output:?}");
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(found["ball"], serde_json::Value::Null);
    assert_eq!(found["goal"], serde_json::Value::Null);
    assert_eq!(found["opponent"], serde_json::Value::Null);
}

#[test]
fn truncated_and_foreign_images_are_refused_before_anything_runs() {
    let folder = folder();
    let here = folder.path();
    put(&folder, "short.img", &[0xFF; 1000]);
    put(&folder, "bad.ihx", b":0300000002000EFF\n");
    put(&folder, "half.elf", b"\x7fELF\x01\x02\x01");
    let play = ["play", "--headless", "--seconds", "1"];
    let with = |extra: [&'static str; 2]| [play.as_slice(), extra.as_slice()].concat();
    fails(here, &with(["--flash", "short.img"]), FAILED, &["1000 bytes", "bitstream pack"]);
    fails(here, &with(["--fx2-image", "bad.ihx"]), FAILED, &["FX2 image"]);
    fails(here, &with(["--khepera-image", "half.elf"]), FAILED, &["68331 image"]);
}

#[test]
fn options_that_do_not_fit_together_are_refused() {
    let folder = folder();
    let here = folder.path();
    let image = ["play", "--headless", "--opponent-image", "other.elf"];
    fails(here, &image, USAGE, &["--opponent self"]);
    let picture = ["play", "--matches", "2", "--picture", "match.png"];
    fails(here, &picture, USAGE, &["--matches", "picture"]);
    let nowhere = ["play", "--headless", "--matches", "1", "--csv", "no/rows.csv"];
    fails(here, &nowhere, FAILED, &["no/rows.csv"]);
}

#[test]
fn a_row_of_a_series_is_what_its_seed_gives_alone() {
    let folder = folder();
    let play = |extra: &[&str]| {
        let common = ["play", "--headless", "--json", "--noise", "harsh", "--seconds", "2"];
        let opponent = ["--opponent", "linear"];
        let output = sot(folder.path(), &[common.as_slice(), opponent.as_slice(), extra].concat());
        assert!(output.status.success(), "{extra:?}: {output:?}");
        let text = String::from_utf8(output.stdout).expect("text");
        let last = text.lines().last().expect("a line").to_owned();
        serde_json::from_str::<serde_json::Value>(&last).expect("JSON")
    };
    let together = play(&["--matches", "3", "--seed", "5", "--jobs", "2", "--csv", "rows.csv"]);
    assert_eq!(together["matches"], 3);
    let csv = fs::read_to_string(folder.path().join("rows.csv")).expect("was written");
    let rows: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 4);
    assert!(rows.iter().all(|row| row.len() == rows[0].len()), "{csv}");
    let column = |name: &str| rows[0].iter().position(|head| *head == name).expect("a column");
    let alone = play(&["--seed", "6"]);
    assert_eq!(rows[2][column("seed")], "6");
    assert_eq!(alone["trace_hash"], rows[2][column("trace_hash")]);
    assert_eq!(alone["reports"].to_string(), rows[2][column("reports")]);
}

#[test]
fn bitstreams_are_made_checked_and_packed() {
    let folder = folder();
    let here = folder.path();
    let ok = |arguments: &[&str]| {
        let output = sot(here, arguments);
        assert!(output.status.success(), "{arguments:?}: {output:?}");
        String::from_utf8(output.stdout).expect("text")
    };
    ok(&["bitstream", "make", "soccer", "-o", "soccer.bin"]);
    ok(&["bitstream", "make", "capture", "-o", "capture.bit"]);
    let stream = fs::read(here.join("soccer.bin")).expect("was written");
    assert_eq!(stream.len(), 234_456);

    let said = ok(&["bitstream", "check", "soccer.bin", "capture.bit", "--json"]);
    let verdicts: Vec<serde_json::Value> =
        said.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    assert_eq!(verdicts.len(), 2);
    assert_eq!(verdicts[0]["function"], "soccer");
    assert_eq!(verdicts[1]["function"], "capture");
    assert_eq!(verdicts[1]["bytes"], 234_456);

    ok(&["bitstream", "pack", "0=soccer.bin", "31=capture.bit", "-o", "flash.img"]);
    assert_eq!(fs::metadata(here.join("flash.img")).expect("was written").len(), 16 << 20);

    let mut damaged = stream.clone();
    damaged[100_000] ^= 1;
    put(&folder, "damaged.bin", &damaged);
    put(&folder, "cut.bin", &stream[..100_000]);
    fails(here, &["bitstream", "check", "damaged.bin"], FAILED, &["damaged.bin", "CRC"]);
    fails(here, &["bitstream", "check", "cut.bin"], FAILED, &["cut.bin", "100000"]);
    fails(here, &["bitstream", "pack", "0=damaged.bin", "-o", "y"], FAILED, &["damaged.bin"]);
    assert!(!here.join("y").exists());
}

#[test]
fn filters_of_a_dense_map_take_away_what_they_should() {
    let folder = folder();
    let here = folder.path();
    // A bright square that lies 8 px further right in the left eye, and noise nowhere.
    let eye = |shift: usize| {
        let mut bytes = grey(160, 120);
        let pixels = bytes.len() - 160 * 120;
        for y in 40..80 {
            for x in 60..100 {
                bytes[pixels + y * 160 + x + shift] = ((x * 7 + y * 13) % 251) as u8;
            }
        }
        bytes
    };
    put(&folder, "left.pgm", &eye(8));
    put(&folder, "right.pgm", &eye(0));
    let density = |extra: &[&str]| {
        let base =
            ["disparity", "left.pgm", "right.pgm", "-o", "map.png", "--json", "--method", "bm"];
        let output = sot(here, &[&base, ["--disparities", "16"].as_slice(), extra].concat());
        assert!(output.status.success(), "{output:?}");
        let said: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        said["density"].as_f64().expect("a number")
    };
    let plain = density(&[]);
    assert!(plain > 0.02, "the square is not found: {plain}");
    assert!(density(&["--speckles", "10000"]) < plain / 10.0);
    assert!(density(&["--texture", "65535"]) < plain / 10.0);
    assert!(density(&["--left-right", "0"]) <= plain);
    assert_ne!(density(&["--median"]), plain);
    let sad = ["disparity", "left.pgm", "right.pgm", "-o", "x.png", "--texture", "10"];
    fails(here, &sad, USAGE, &["--texture", "bm"]);
}

#[test]
fn a_picture_that_cannot_be_written_does_not_cost_the_match() {
    let folder = folder();
    let play = ["play", "--headless", "--seconds", "1", "--json", "--picture", "nowhere/match.png"];
    let output = sot(folder.path(), &play);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(FAILED), "{said}");
    assert!(said.contains("nowhere/match.png"), "{said}");
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(summary["fpga"]["configured"], true);
}
