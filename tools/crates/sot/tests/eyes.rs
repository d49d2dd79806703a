//! `sot stream`, `sot camera` and `sot fpga reg` against `sot twin robot`, as a user would: recordings
//! from the first pair to the pictures, what is damaged, what is wrong with the cameras, and wrong use.

mod common;

use std::fs;
use std::process::Command;
use std::time::{Duration, Instant};

use common::{Desk, PATIENCE, Twin, ended, in_background};
use serde_json::{Value, json};

const FRAME: usize = 512 + 2 * 320 * 240;

/// It must fail, and say all of `words`, in as many lines as it likes.
fn fails_with(desk: &Desk, arguments: &str, code: i32, words: &[&str]) {
    let output = desk.sot(arguments);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "sot {arguments}: {said}");
    for word in words {
        assert!(said.contains(word), "sot {arguments} does not say '{word}': {said}");
    }
}

/// What a check says, with its exit code.
fn checked(desk: &Desk, file: &str) -> (Option<i32>, Value) {
    let output = desk.sot(&format!("stream check {file} --json"));
    let said = String::from_utf8_lossy(&output.stdout);
    (output.status.code(), serde_json::from_str(&said).unwrap_or(Value::Null))
}

/// A twin that has its cameras up, and a short recording of it.
fn recorded(desk: &Desk, arguments: &str) -> Twin {
    let twin = Twin::start(desk, arguments);
    let said = desk.json("stream record a.stream --pairs 12 --json");
    assert_eq!((&said["counts_agree"], &said["problems"]), (&true.into(), &json!([])), "{said}");
    assert!(said["pairs"].as_u64() >= Some(12), "{said}");
    assert_eq!(said["turret"]["sent"], said["pairs"], "{said}");
    twin
}

#[test]
fn what_was_recorded_is_told_checked_and_exported() {
    let desk = Desk::new();
    let _twin = recorded(&desk, "");
    let info = desk.json("stream info a.stream --json");
    let pairs = info["pairs"].as_u64().expect("a number");
    assert_eq!((&info["sizes"], &info["reports"]), (&json!(["320x240"]), &pairs.into()), "{info}");
    assert_eq!((&info["ended"], &info["index"]), (&true.into(), &true.into()), "{info}");
    assert_eq!(info["registers"][0]["values"]["goal-row"], 60, "{info}");
    let index = fs::read_to_string(desk.path("a.stream.index")).expect("an index");
    assert_eq!(index.lines().count() as u64, 2 * pairs + 1);

    let (code, found) = checked(&desk, "a.stream");
    assert_eq!((code, &found["ok"]), (Some(0), &true.into()), "{found}");
    assert_eq!(found["reports_checked"], pairs, "{found}");
    for nothing in ["reports_different", "out_of_order", "damaged", "torn", "altered"] {
        assert_eq!(found[nothing], 0, "{found}");
    }

    desk.ok("stream export a.stream pictures --every 5");
    let lines = fs::read_to_string(desk.path("pictures/reports.jsonl")).expect("reports");
    let lines: Vec<Value> = lines.lines().map(|l| serde_json::from_str(l).expect("JSON")).collect();
    assert_eq!(lines.len() as u64, pairs.div_ceil(5));
    assert_eq!(fs::read_dir(desk.path("pictures")).expect("a folder").count(), 2 * lines.len() + 1);
    // What the PC sees in the pictures is what the robot has reported.
    for line in &lines {
        let stem = line["pair"].as_str().expect("a name");
        let seen =
            desk.json(&format!("detect pictures/{stem}_left.png pictures/{stem}_right.png --json"));
        let wall = |value: &Value| value.as_u64().unwrap_or(0);
        let rows: Vec<u64> = seen["wall"].as_array().expect("rows").iter().map(wall).collect();
        assert_eq!(json!(rows), line["report"]["wall"], "{line} {seen}");
        for what in ["/ball/disparity", "/ball/y", "/opponent/x", "/opponent/disparity"] {
            let path = what.replace("/y", "/row");
            assert_eq!(seen.pointer(what), line["report"].pointer(&path), "{line} {seen}");
        }
    }

    desk.fails("stream record a.stream --pairs 1", 1, &["a.stream", "--force"]);
    desk.ok("stream record a.stream --pairs 1 --force");
    desk.fails("stream record nowhere/a.stream", 1, &["nowhere/a.stream"]);
}

#[test]
fn large_frames_and_a_rate_are_recorded_as_they_were_asked_for() {
    let desk = Desk::new();
    let _twin = Twin::start(&desk, "");
    desk.ok("stream record large.stream --size 640x480 --rate 10 --pairs 4");
    let info = desk.json("stream info large.stream --json");
    assert_eq!(info["sizes"], json!(["640x480"]));
    let spacing = info["seconds"].as_f64().expect("a time")
        / (info["pairs"].as_f64().expect("a number") + info["lost"].as_f64().unwrap() - 1.0);
    assert!((spacing - 0.1).abs() < 1e-3, "{info}");
    assert_eq!(checked(&desk, "large.stream").0, Some(0));
    assert_eq!(desk.json("fpga reg --json")["format"], 0, "soccer's own again");

    fails_with(&desk, "stream record p.stream --pattern --pairs 2", 1, &["capture"]);
    desk.ok("flash fpga capture.bin");
    desk.ok("stream record p.stream --pattern --pairs 20 --force");
    let (code, found) = checked(&desk, "p.stream");
    assert_eq!((code, &found["pattern_wrong"]), (Some(0), &0.into()), "{found}");
}

#[test]
fn registers_that_the_base_changes_in_a_recording_are_in_it() {
    let desk = Desk::new();
    let twin = Twin::start(&desk, "--pty line");
    desk.ok("fpga reg search-max 64");
    let robot = format!("--robot twin:{}", twin.place);
    let mut recorder = in_background(&desk, &format!("stream record a.stream --pairs 120 {robot}"));
    let began = Instant::now();
    while fs::metadata(desk.path("a.stream")).map_or(0, |file| file.len()) < 20 * FRAME as u64 {
        assert!(began.elapsed() < PATIENCE, "nothing is recorded");
        std::thread::sleep(Duration::from_millis(20));
    }
    let said = desk.ok("console --robot serial:line T,26,W,61,4 T,26,R,4");
    assert!(said.contains("t,26,r,61"), "{said}");
    assert_eq!(ended(&mut recorder).0, Some(0));
    let info = desk.json("stream info a.stream --json");
    let changes = info["registers"].as_array().expect("a list");
    assert_eq!(changes.len(), 2, "{info}");
    for (change, row) in changes.iter().zip([60, 61]) {
        let values = &change["values"];
        assert_eq!((&values["goal-row"], &values["search-max"]), (&row.into(), &64.into()));
    }
    let (code, found) = checked(&desk, "a.stream");
    assert_eq!((code, &found["reports_different"]), (Some(0), &0.into()), "{found}");
}

#[test]
fn damage_to_a_recording_is_found_and_told_by_its_place() {
    let desk = Desk::new();
    drop(recorded(&desk, ""));
    let whole = fs::read(desk.path("a.stream")).expect("a recording");
    // One bit of one pixel: the detectors may not care, the index does.
    let mut bit = whole.clone();
    bit[3 * FRAME + 512 + 4000] ^= 1;
    desk.put("bit.stream", &bit);
    fs::copy(desk.path("a.stream.index"), desk.path("bit.stream.index")).expect("a copy");
    let (code, found) = checked(&desk, "bit.stream");
    assert_eq!((code, &found["altered"]), (Some(1), &1.into()), "{found}");
    assert!(found["problems"][0].as_str().is_some_and(|said| said.contains("pair 1, right eye")));

    let mut header = whole.clone();
    header[2 * FRAME + 20] ^= 0x10;
    let shifted = [&whole[..FRAME + 1000], &whole[FRAME + 1001..]].concat();
    let missing = [&whole[..2 * FRAME], &whole[4 * FRAME..]].concat();
    let one_eye = [&whole[..3 * FRAME], &whole[4 * FRAME..]].concat();
    for (name, bytes, word) in [
        ("cut in a frame", &whole[..5 * FRAME / 2], "cut off"),
        ("cut between pairs", &whole[..4 * FRAME], "no end record"),
        ("cut in the end record", &whole[..whole.len() - 9], "cut off"),
        ("a damaged header", &header, "damaged"),
        ("a byte missing", &shifted, "no record begins here"),
        ("a pair missing", &missing, "are missing"),
        ("an eye missing", &one_eye, "right eye is missing"),
    ] {
        desk.put("b.stream", bytes);
        let (code, found) = checked(&desk, "b.stream");
        assert_eq!((code, &found["ok"]), (Some(1), &false.into()), "{name}: {found}");
        let problems = found["problems"].to_string();
        assert!(problems.contains(word), "{name}: {problems}");
        assert_ne!(desk.json("stream info b.stream --json")["problems"], json!([]), "{name}");
        assert!(found["reports_checked"].as_u64() > Some(0), "{name}: what is whole is checked");
    }
    desk.put("b.stream", &shifted);
    fails_with(&desk, "stream export b.stream some", 1, &["b.stream", "damaged"]);
    assert!(desk.path("some/000000_left.png").exists(), "what is whole is exported");

    desk.put("empty", b"");
    desk.put("other", b"This is no recording.\n".repeat(100).as_slice());
    for verb in ["info", "check", "export"] {
        let folder = if verb == "export" { " x" } else { "" };
        desk.fails(&format!("stream {verb} empty{folder}"), 1, &["empty", "nothing was recorded"]);
        desk.fails(&format!("stream {verb} other{folder}"), 1, &["other", "no recording"]);
        desk.fails(&format!("stream {verb} gone{folder}"), 1, &["gone", "No such file"]);
    }
    desk.put("bit.stream.index", b"{}\n");
    desk.fails("stream check bit.stream", 1, &["bit.stream.index", "line 1"]);
}

#[test]
fn ctrl_c_ends_a_recording_in_order() {
    let desk = Desk::new();
    let _twin = Twin::start(&desk, "");
    let mut recorder = in_background(&desk, "stream record a.stream");
    let began = Instant::now();
    while fs::metadata(desk.path("a.stream")).map_or(0, |file| file.len()) < 8 * FRAME as u64 {
        assert!(began.elapsed() < PATIENCE, "nothing is recorded");
        std::thread::sleep(Duration::from_millis(20));
    }
    let killed = Command::new("kill").args(["-INT", &recorder.id().to_string()]).status();
    assert!(killed.expect("kill is there").success());
    assert_eq!(ended(&mut recorder).0, Some(130));
    let (code, found) = checked(&desk, "a.stream");
    assert_eq!((code, &found["ended"]), (Some(0), &true.into()), "{found}");
    assert_eq!(desk.json("fpga reg stream --json")["stream"], 0);
}

#[test]
fn a_twin_that_is_switched_off_leaves_what_was_recorded() {
    let desk = Desk::new();
    let twin = Twin::start(&desk, "");
    let mut recorder = in_background(&desk, "stream record a.stream");
    let began = Instant::now();
    while fs::metadata(desk.path("a.stream")).map_or(0, |file| file.len()) < 8 * FRAME as u64 {
        assert!(began.elapsed() < PATIENCE, "nothing is recorded");
        std::thread::sleep(Duration::from_millis(20));
    }
    twin.kill();
    let (code, said) = ended(&mut recorder);
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("gone"), "{said}");
    let (code, found) = checked(&desk, "a.stream");
    assert_eq!((code, &found["ended"]), (Some(1), &false.into()), "{found}");
    assert!(found["pairs"].as_u64() >= Some(3), "{found}");
    assert_eq!(found["reports_different"], 0, "{found}");
}

#[test]
fn registers_have_names_ranges_and_defaults() {
    let desk = Desk::new();
    let _twin = Twin::start(&desk, "");
    let all = desk.json("fpga reg --json --describe");
    let all = all.as_object().expect("an object");
    let parameters = || all.iter().filter(|(_, register)| register["detectors"] == true);
    assert_eq!(parameters().count(), 21);
    for (name, register) in parameters() {
        assert_eq!(register["value"], register["reset"], "{name}");
        let most = register["max"].as_u64().expect("a range");
        let said = desk.json(&format!("fpga reg {name} {most} --json"));
        assert_eq!(said[name], most);
        desk.fails(&format!("fpga reg {name} {}", most + 1), 1, &[name, "it takes"]);
    }
    assert_eq!(desk.json("fpga reg goal_row --json")["goal-row"], 235, "underscores do as well");
    assert_eq!(desk.json("fpga reg 04 default --json")["goal-row"], 60);
    assert_eq!(desk.json("fpga reg 0x06 0x40 --json")["search-max"], 64);
    assert_eq!(desk.json("fpga reg 40 --json")["40"], 0x1214, "the cameras' table");
    let listed = desk.ok("fpga reg");
    assert!(listed.lines().any(|line| line.contains("goal-row") && line.contains("4..235")));

    desk.fails("fpga reg goal", 2, &["goal", "sot fpga reg"]);
    desk.fails("fpga reg 80", 2, &["80", "7f"]);
    desk.fails("fpga reg goal-row high", 2, &["high", "65535"]);
    desk.fails("fpga reg id default", 2, &["id", "no default"]);
    desk.fails("fpga reg id 5", 1, &["id", "only be read"]);
    desk.fails("fpga reg 3f 5", 1, &["3f", "no such register"]);
    desk.fails("fpga reg source 1", 1, &["source", "capture"]);
    desk.fails("fpga reg stream 1", 1, &["sot stream record"]);
    fails_with(&desk, "fpga reg --describe", 2, &["--json"]);
}

#[test]
fn camera_settings_are_set_shown_and_seen() {
    let desk = Desk::new();
    let _twin = Twin::start(&desk, "");
    let probed = desk.json("camera probe --json");
    assert_eq!((&probed["left"]["state"], &probed["right"]["id"]), (&"ok".into(), &"7673".into()));
    for (setting, value, shown) in [
        ("exposure", "128", "128"),
        ("exposure", "auto", "auto"),
        ("gain", "2", "2"),
        ("white", "1.5,0.5", "1.5,0.5"),
        ("pattern", "bars", "bars"),
    ] {
        let said = desk.json(&format!("camera {setting} {value} --json"));
        assert_eq!(said, json!({"left": shown, "right": shown}), "{setting} {value}");
    }
    desk.ok("camera exposure 64 --eye left");
    assert_eq!(desk.json("camera exposure --json"), json!({"left": "64", "right": "auto"}));
    assert_eq!(desk.json("camera reg 0a --json"), json!({"left": 0x76, "right": 0x76}));

    desk.ok("stream record bars.stream --pairs 8");
    desk.ok("stream export bars.stream bars --every 4");
    let picture = image::open(desk.path("bars/000004_right.png")).expect("a picture").to_rgb8();
    let bars: Vec<[u8; 3]> = (0..8).map(|bar| picture.get_pixel(40 * bar + 20, 120).0).collect();
    assert_eq!(
        (bars[0], bars[1], bars[5], bars[7]),
        ([255; 3], [255, 255, 0], [255, 0, 0], [0; 3])
    );

    desk.ok("camera setup");
    for (setting, shown) in
        [("exposure", "auto"), ("gain", "auto"), ("white", "auto"), ("pattern", "none")]
    {
        let said = desk.json(&format!("camera {setting} --json"));
        assert_eq!(said, json!({"left": shown, "right": shown}), "{setting}");
    }
    for (arguments, words) in [
        ("camera exposure bright", &["bright", "auto"][..]),
        ("camera gain 99", &["99", "1 to 31"]),
        ("camera white 1.1", &["1.1", "red and blue"]),
        ("camera pattern stars", &["stars", "bars"]),
        ("camera gain 2 --eye middle", &["middle", "both"]),
        ("camera reg zz", &["zz", "hexadecimal"]),
        ("camera reg 13 256", &["256", "255"]),
        ("camera setup --size 800x600", &["800x600", "640x480"]),
        ("camera focus", &["focus"]),
        ("stream record a.stream --rate 41", &["41", "40"]),
        ("stream record a.stream --seconds 0", &["--seconds"]),
        ("stream record", &["<FILE>"]),
        ("stream export a.stream", &["<DIR>"]),
        ("stream export a.stream d --every 0", &["--every"]),
    ] {
        fails_with(&desk, arguments, 2, words);
    }
    assert!(!desk.path("a.stream").exists(), "wrong use leaves no file");
}

/// All states that both eyes are seen in until they are well after the last of `expected`.
fn states_until_well(desk: &Desk, eye: &str, expected: &[&str]) {
    let mut seen: Vec<String> = Vec::new();
    let began = Instant::now();
    loop {
        let output = desk.sot("camera probe --json");
        let said: Value = serde_json::from_slice(&output.stdout).unwrap_or_default();
        let state = said[eye]["state"].as_str().unwrap_or_default().to_owned();
        let well = ["left", "right"].iter().all(|eye| said[eye]["state"] == "ok");
        assert_eq!(output.status.code(), Some(i32::from(!well)), "{said}");
        if seen.last() != Some(&state) {
            seen.push(state);
        }
        let bad: Vec<&str> = seen.iter().map(String::as_str).filter(|s| *s != "ok").collect();
        if well && bad == expected {
            return;
        }
        assert!(began.elapsed() < PATIENCE, "{eye}: {seen:?} instead of {expected:?}");
        std::thread::sleep(Duration::from_millis(100));
    }
}

#[test]
fn camera_faults_on_i2c_have_their_names_and_go_with_their_cause() {
    let desk = Desk::new();
    let _twin = Twin::start(
        &desk,
        "--camera-fault right:no-ack@1..4 --camera-fault right:wrong-id@6..9 \
         --camera-fault stuck-clock@11..14 --camera-fault no-mux@16..19",
    );
    states_until_well(&desk, "right", &["no_ack", "wrong_id", "bus_stuck", "no_mux"]);
}

#[test]
fn camera_faults_in_the_picture_have_their_names_and_go_with_their_cause() {
    let desk = Desk::new();
    let _twin =
        Twin::start(&desk, "--camera-fault left:no-pixels@1..5 --camera-fault left:torn@8..12");
    states_until_well(&desk, "left", &["no_pixels", "torn_frames"]);
}

#[test]
fn a_recording_from_a_camera_with_a_fault_names_it() {
    for (fault, file, words) in [
        ("left:no-ack", false, &["left camera", "no acknowledge"][..]),
        ("right:no-pixels", true, &["no frame came", "right camera", "no pixels"]),
        ("right:torn", true, &["torn by a camera"]),
    ] {
        let desk = Desk::new();
        let _twin = Twin::start(&desk, &format!("--camera-fault {fault}"));
        fails_with(&desk, "stream record a.stream --pairs 3", 1, words);
        assert_eq!(desk.path("a.stream").exists(), file, "{fault}");
        assert_eq!(desk.json("fpga reg stream --json")["stream"], 0, "{fault}");
    }
}

#[test]
fn switched_lamps_show_in_a_recording_until_the_exposure_has_followed() {
    let desk = Desk::new();
    let _twin = Twin::start(&desk, "--lamps 0.4@2..4");
    desk.ok("stream record a.stream --seconds 5");
    let info = desk.json("stream info a.stream --json");
    let unsettled = info["exposure_unsettled"].as_u64().expect("a number");
    assert!((4..info["pairs"].as_u64().expect("a number") / 2).contains(&unsettled), "{info}");
    assert_eq!(checked(&desk, "a.stream").0, Some(0));
    fails_with(&desk, "twin robot --lamps bright", 2, &["bright", "1 is as usual"]);
}
