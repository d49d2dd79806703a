//! `sot twin fx2`: images that cannot be used, and small programs whose end is known.

use std::fs;
use std::io::Read;
use std::net::TcpStream;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

/// MOV 0x30,#0x42; SJMP $
const BUSY: &str = ":05000000753042 80FE96\n:00000001FF\n";
/// ORL PCON,#1; SJMP to it: idle for ever.
const IDLE: [u8; 5] = [0x43, 0x87, 0x01, 0x80, 0xFB];

fn twin(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sot"))
        .args(["twin", "fx2"])
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("sot was built")
}

fn json(output: &Output) -> Value {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

#[test]
fn damaged_images_end_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let cases: [(&str, &[u8], &str); 10] = [
        ("sum.ihx", b":0200000001020B\n:00000001FF\n", "checksum"),
        ("cut.hex", b":020000000102FB\n", "end-of-file"),
        ("half.hex", b":0200", "line 1"),
        ("beyond.ihx", b":01200000AA35\n:00000001FF\n", "--ram 16k"),
        ("far.ihx", b":01400000AA15\n:00000001FF\n", "0x2000"),
        ("text.ihx", b"no program", "colon"),
        ("bytes.hex", b":02\xFF\xFE", "line 1"),
        ("empty.ihx", b"", "empty"),
        ("empty.bin", b"", "empty"),
        ("long.bin", &[0; 8193], "0x2000"),
    ];
    for (name, bytes, word) in cases {
        fs::write(folder.path().join(name), bytes).unwrap();
        let output = twin(folder.path(), &[name, "--seconds", "0.01"]);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{name}: {said}");
        assert_eq!(said.lines().count(), 1, "{name} says more than a line: {said}");
        assert!(said.contains(name) && said.contains(word), "{name}: {said}");
        assert!(
            name == "beyond.ihx" || name == "long.bin" || !said.contains("16k"),
            "{name}: {said}"
        );
        assert!(output.stdout.is_empty(), "{name} prints to standard output");
    }
}

#[test]
fn wrong_use_is_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in [["--usbredir", "nowhere"], ["--ram", "32k"], ["--seconds", "-1"]] {
        let output = twin(folder.path(), &arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    }
}

#[test]
fn without_an_image_the_chip_is_blank() {
    let folder = tempfile::tempdir().unwrap();
    let report = json(&twin(folder.path(), &["--seconds", "0.5", "--json"]));
    assert_eq!(report["usb"]["vendor"], "04b4");
    assert_eq!(report["usb"]["product"], "8613");
    assert_eq!(report["usb"]["speed"], "high");
    assert_eq!(report["cycles"], 0, "without a program the CPU stays in reset");
    let report = json(&twin(folder.path(), &["--seconds", "0.5", "--json", "--speed", "full"]));
    assert_eq!(report["usb"]["speed"], "full");
}

#[test]
fn seconds_are_simulated_and_cycles_counted() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("busy.ihx"), BUSY.replace(' ', "")).unwrap();
    let report = json(&twin(folder.path(), &["busy.ihx", "--seconds", "1", "--json"]));
    assert!((report["sim_seconds"].as_f64().unwrap() - 1.0).abs() < 1e-6);
    // CPUCS selects 12 MHz at reset: 3 million machine cycles a second.
    let cycles = report["cycles"].as_u64().unwrap();
    assert!((2_999_990..=3_000_010).contains(&cycles), "{cycles} cycles");
    assert_eq!(report["diagnostics"], Value::Array(Vec::new()));
}

#[test]
fn a_saved_state_goes_on_where_it_was() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("busy.ihx"), BUSY.replace(' ', "")).unwrap();
    let straight = json(&twin(folder.path(), &["busy.ihx", "--seconds", "0.5", "--json"]));
    let half = ["busy.ihx", "--seconds", "0.25", "--save", "half.json"];
    assert!(twin(folder.path(), &half).status.success());
    let rest = ["--restore", "half.json", "--seconds", "0.25", "--json"];
    let rest = json(&twin(folder.path(), &rest));
    assert_eq!((&rest["cycles"], &rest["pc"]), (&straight["cycles"], &straight["pc"]));

    let mut text = fs::read_to_string(folder.path().join("half.json")).unwrap();
    let at = text.find("\\\"ram\\\":\\\"75").expect("its memory") + 12;
    text.replace_range(at..=at, "F");
    fs::write(folder.path().join("damaged.json"), &text).unwrap();
    for (name, word) in [("damaged.json", "damaged"), ("busy.ihx", "no snapshot"), ("none", "none")]
    {
        let output = twin(folder.path(), &["--restore", name, "--seconds", "0.1"]);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{name}: {said}");
        assert!(said.lines().count() == 1 && said.contains(word), "{name}: {said}");
    }
    let both = twin(folder.path(), &["busy.ihx", "--restore", "half.json", "--seconds", "0.1"]);
    assert_eq!(both.status.code(), Some(2), "a program or a state, not both");
}

#[test]
fn a_finding_names_its_line_in_the_listing_beside_the_image() {
    let folder = tempfile::tempdir().unwrap();
    // MOV DPTR,#0xE604; MOV A,#2; MOVX @DPTR,A; SJMP $: resets EP2's FIFO without NAKALL.
    fs::write(folder.path().join("p.ihx"), ":0800000090E6047402F080FE9A\n:00000001FF\n").unwrap();
    fs::write(folder.path().join("p.map"), "C:   00000000  _main      p\n").unwrap();
    fs::write(folder.path().join("p.lk"), "-muwx\n-i p.ihx\n./p.rel\n\n-e\n").unwrap();
    let listing = "                                      1 \t.area CSEG    (CODE)\n\
                   \x20                                     2 ;\tapp/p.c:17: FIFORESET = 2;\n\
                   \x20     000000 90 E6 04         [24]    3 \tmov\tdptr,#_FIFORESET\n";
    fs::write(folder.path().join("p.rst"), listing).unwrap();
    let report = json(&twin(folder.path(), &["p.ihx", "--seconds", "0.01", "--json"]));
    let found = &report["diagnostics"][0];
    assert_eq!((&found["function"], &found["file"]), (&"main".into(), &"p.c".into()), "{found}");
    assert_eq!((&found["line"], &found["rule"]), (&17.into(), &"FifoResetOrder".into()));
    let printed = twin(folder.path(), &["p.ihx", "--seconds", "0.01"]);
    assert!(String::from_utf8_lossy(&printed.stdout).contains("(main+0x5, p.c:17)"), "{printed:?}");
}

#[test]
fn a_raw_program_of_odd_length_runs() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("idle.bin"), IDLE).unwrap();
    let report = json(&twin(folder.path(), &["idle.bin", "--seconds", "1", "--json"]));
    assert!(report["cycles"].as_u64().unwrap() < 100, "an idle CPU executes nothing");
}

#[test]
fn an_identity_in_the_eeprom_is_taken_on() {
    let folder = tempfile::tempdir().unwrap();
    let image = [0xC0, 0xB4, 0x04, 0x34, 0x12, 0x01, 0x00, 0x00];
    fs::write(folder.path().join("boot.iic"), image).unwrap();
    let report = json(&twin(folder.path(), &["--eeprom", "boot.iic", "--seconds", "1", "--json"]));
    assert_eq!(report["usb"]["product"], "1234");
    assert_eq!(fs::read(folder.path().join("boot.iic")).unwrap(), image, "nothing was written");
}

#[test]
fn a_served_chip_says_where_and_greets() {
    let mut server = Command::new(env!("CARGO_BIN_EXE_sot"))
        .args(["twin", "fx2", "--usbredir", ":0", "--seconds", "3"])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut said = String::new();
    let mut errors = server.stderr.take().unwrap();
    let deadline = Instant::now() + Duration::from_secs(10);
    while !said.ends_with('\n') && Instant::now() < deadline {
        let mut byte = [0];
        if errors.read(&mut byte).unwrap() == 0 {
            break;
        }
        said.push(char::from(byte[0]));
    }
    let address = said.trim_end().strip_prefix("serving usbredir at ").expect("where it serves");
    assert!(address.starts_with("127.0.0.1:"), "this machine only: {address}");
    let mut client = TcpStream::connect(address).unwrap();
    client.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
    let mut hello = [0; 12];
    client.read_exact(&mut hello).unwrap();
    assert_eq!(hello[..8], [0, 0, 0, 0, 68, 0, 0, 0], "type hello, 64 + 4 bytes");
    drop(client);
    assert!(server.wait().unwrap().success(), "a client that vanishes does not end the server");
}
