//! `sot` against `sot twin robot`, as a user would: everything that is done to a turret, what goes
//! wrong, and what is left when the power goes.

mod base_twin;
mod common;

use std::fs;
use std::process::Command;
use std::time::Duration;

use common::{Desk, FIRMWARE, PATIENCE, Twin, ended, in_background};
use serde_json::Value;
use usbredir::client::Client;
use virtex::bitstream::{Options, make};
use virtex::design::Function;
use virtex::part::XCV50E;

#[test]
fn a_slot_is_written_verified_read_marked_booted_and_erased() {
    let desk = Desk::new();
    let _twin = Twin::start(&desk, "");

    let would = desk.json("flash fpga capture.bin --slot 3 --dry-run --json");
    assert_eq!(would["action"], "would_write");
    assert_eq!(desk.slot(3)["state"], "empty", "a dry run writes nothing");

    let written = desk.json("flash fpga capture.bin --slot 3 --name eyes --json");
    assert_eq!((&written["part"], &written["action"]), (&"slot 3".into(), &"written".into()));
    let again = desk.json("flash fpga capture.bin --slot 3 --name eyes --json");
    assert_eq!(again["action"], "unchanged");
    let slot = desk.slot(3);
    assert_eq!((&slot["state"], &slot["name"]), (&"whole".into(), &"eyes".into()));
    assert_eq!((&slot["function"], &slot["bytes"]), (&"capture".into(), &234_456.into()));

    desk.ok("fpga verify 3 capture.bin");
    desk.fails("fpga verify 3 soccer.bin", 1, &["slot 3", "differs", "another bitstream"]);
    desk.fails("fpga verify 4", 1, &["slot 4", "empty"]);
    desk.ok("fpga read 3 -o back.bin");
    assert!(
        fs::read(desk.path("back.bin")).unwrap() == fs::read(desk.path("capture.bin")).unwrap()
    );

    let status = desk.json("fpga boot 3 --json");
    assert_eq!((&status["configured"], &status["slot"]), (&true.into(), &3.into()));
    desk.fails("fpga boot 4", 1, &["no whole bitstream", "runs"]);
    desk.ok("fpga golden 0");
    assert_eq!(desk.json("fpga default 3 --json")["action"], "written");
    assert_eq!(desk.json("fpga default 3 --json")["action"], "unchanged");
    desk.fails("fpga golden 7", 1, &["slot 7", "whole bitstream"]);
    let slots = desk.json("fpga slots --json");
    assert_eq!((&slots[0]["golden"], &slots[3]["default"]), (&true.into(), &true.into()));

    desk.ok("fpga erase 3");
    let slot = desk.slot(3);
    assert_eq!((&slot["state"], &slot["default"]), (&"empty".into(), &false.into()));
    let info = desk.json("info --json");
    assert_eq!(info["slots"].as_array().unwrap().len(), 1);
    assert!(info["serial"].as_str().unwrap().starts_with("TWIN"));
}

#[test]
fn the_fpga_takes_full_and_partial_bitstreams_and_nothing_else() {
    let desk = Desk::new();
    let _twin = Twin::start(&desk, "");
    let mut damaged = fs::read(desk.path("soccer.bin")).unwrap();
    damaged[100_000] ^= 1;
    desk.put("damaged.bin", &damaged);
    desk.put("cut.bin", &damaged[..100_000]);
    desk.put("none.bin", b"no bitstream");
    let options = Options { part: &XCV50E, ..Options::default() };
    desk.put("small.bin", &make(Function::Soccer, &options));

    for (file, words) in [
        ("damaged.bin", &["damaged.bin", "the CRC is"][..]),
        ("cut.bin", &["cut.bin", "100000", "not whole"]),
        ("none.bin", &["none.bin", "synchronisation"]),
        ("small.bin", &["small.bin", "XCV50E"]),
        ("gone.bin", &["gone.bin", "No such file"]),
    ] {
        desk.fails(&format!("flash fpga {file}"), 1, words);
        desk.fails(&format!("flash fpga {file} --slot 5"), 1, words);
    }
    desk.fails("flash fpga change.bin --slot 5", 1, &["change.bin", "partial"]);
    assert_eq!(desk.json("fpga status --json")["source"], "default slot");

    let written = desk.json("flash fpga capture.bin --json");
    assert_eq!(written["action"], "written");
    let status = desk.json("fpga status --json");
    assert_eq!((&status["source"], &status["bytes"]), (&"USB".into(), &234_456.into()));
    assert!(status["time_ms"].as_f64().unwrap() < 12.0, "{status}");
    desk.ok("flash fpga change.bin");
    assert_eq!(desk.json("fpga status --json")["source"], "USB, in part");
    assert_eq!(desk.json("fpga boot --json")["source"], "default slot");
}

/// A cut somewhere in a write, at some of its stages: erasing, programming, just before its end. (At
/// every single operation it is tried where that takes no time: on the host build of the firmware.)
#[test]
fn a_robot_that_loses_power_in_a_write_holds_the_old_or_the_new_bitstream() {
    let desk = Desk::new();
    desk.ok("bitstream pack 0=soccer.bin 3=capture.bin -o flash.img");
    for after in [1500, 4000, 7000] {
        let twin = Twin::start(&desk, "--flash flash.img");
        let mut writer = in_background(&desk, "flash fpga soccer.bin --slot 3 --name new");
        std::thread::sleep(Duration::from_millis(after));
        twin.kill();
        let (code, said) = ended(&mut writer);
        // On a fast machine the last cut may come too late.
        let told = said.contains("gone") || said.contains("ended");
        assert!(code == Some(1) && told || code == Some(0), "{code:?}: {said}");

        let _twin = Twin::start(&desk, "--flash flash.img");
        let slot = desk.slot(3);
        let name = slot["name"].as_str().unwrap_or_default();
        assert!(["capture", "new"].contains(&name), "after {after} ms: {slot}");
        let file = if name == "new" { "soccer.bin" } else { "capture.bin" };
        desk.ok(&format!("fpga verify 3 {file}"));
        desk.ok("fpga verify 0 soccer.bin");
        assert_eq!(desk.json("fpga status --json")["configured"], true);
    }
}

#[test]
fn ctrl_c_ends_a_write_with_130_and_leaves_the_slot_as_it_was() {
    let desk = Desk::new();
    let _twin = Twin::start(&desk, "");
    let mut writer = in_background(&desk, "flash fpga capture.bin --slot 0");
    std::thread::sleep(Duration::from_millis(1500));
    let killed = Command::new("kill").args(["-INT", &writer.id().to_string()]).status();
    assert!(killed.expect("kill is there").success());
    assert_eq!(ended(&mut writer).0, Some(130));
    desk.ok("fpga verify 0 soccer.bin");
    assert_eq!(desk.slot(0)["default"], true);
}

#[test]
fn of_several_robots_one_must_be_named_and_twins_that_ended_are_not_listed() {
    let desk = Desk::new();
    desk.fails("info", 1, &["no robot found", "sot twin robot"]);
    let first = Twin::start(&desk, "--serial FIRST0000001");
    let second = Twin::start(&desk, "");
    let names = [&first, &second].map(|twin| format!("twin:{}", twin.place));
    desk.fails("info", 2, &["there are 2", &names[0], &names[1], "--robot"]);
    let listed = desk.json("list --json");
    let mut robots: Vec<&str> =
        listed.as_array().unwrap().iter().map(|robot| robot["robot"].as_str().unwrap()).collect();
    robots.sort_unstable();
    let mut expected = names.each_ref().map(String::as_str);
    expected.sort_unstable();
    assert_eq!(robots, expected);
    let info = desk.json(&format!("info --robot {} --json", names[0]));
    assert_eq!(info["serial"], "FIRST0000001");

    second.kill();
    assert_eq!(desk.json("list --json").as_array().unwrap().len(), 1);
    assert_eq!(desk.json("info --json")["robot"], names[0].as_str());
    desk.fails(&format!("info --robot {}", names[1]), 1, &["no twin answers", "sot list"]);
    desk.fails("info --robot serial:/dev/null", 2, &["serial:/dev/null", "usb:SERIAL"]);
    desk.fails("info --robot usb:NOBODY", 1, &["usb:NOBODY", "sot list"]);
}

#[test]
fn a_second_client_is_told_that_the_twin_is_in_use() {
    let desk = Desk::new();
    let twin = Twin::start(&desk, "");
    let address = twin.place.parse().expect("an address");
    let first = Client::connect(address, PATIENCE).expect("the twin answers");
    desk.fails("info", 1, &["in use", &twin.place]);
    drop(first);
    desk.ok("info");
}

#[test]
fn a_blank_turret_gets_its_firmware_and_keeps_it() {
    let desk = Desk::new();
    desk.put("eeprom.img", b"");
    let program = format!("{FIRMWARE}/fx2-firmware/fx2-firmware.ihx");
    {
        let _twin = Twin::start(&desk, "--eeprom eeprom.img");
        desk.fails("info", 1, &["04b4:8613", "sot flash eeprom"]);
        // Into RAM: until it is switched off.
        let loaded = desk.json(&format!("flash fx2 {program} --json"));
        assert!(loaded["detail"].as_str().unwrap().contains("API level 1"), "{loaded}");
        assert_eq!(desk.json("info --json")["serial"], Value::Null);
    }
    {
        let _twin = Twin::start(&desk, "--eeprom eeprom.img");
        desk.fails("info", 1, &["04b4:8613"]);
        let flash = format!("flash eeprom {program} --serial SOT000000042 --json");
        let said = desk.ok(&flash);
        assert_eq!(said.matches("\"written\"").count(), 2, "{said}");
        assert_eq!(desk.json("info --json")["serial"], "SOT000000042");
        let said = desk.ok(&flash);
        assert_eq!(said.matches("\"unchanged\"").count(), 2, "{said}");
    }
    let _twin = Twin::start(&desk, "--eeprom eeprom.img");
    assert_eq!(desk.json("info --json")["serial"], "SOT000000042");
    desk.fails(&format!("flash eeprom {program} --serial short"), 2, &["12 characters"]);
}

#[test]
fn a_turret_that_loses_power_while_its_eeprom_is_written_starts_blank_or_whole() {
    let desk = Desk::new();
    let program = format!("{FIRMWARE}/fx2-firmware/fx2-firmware.ihx");
    // Another image, so that there is something to write.
    let mut image = twin::robot::boot_image(&fs::read(&program).unwrap()).unwrap();
    image[7] ^= 1;
    desk.put("other.iic", &image);
    for after in [150, 700] {
        let twin = Twin::start(&desk, "--eeprom eeprom.img");
        let mut writer = in_background(&desk, "flash eeprom other.iic");
        std::thread::sleep(Duration::from_millis(after));
        twin.kill();
        ended(&mut writer);
        let _twin = Twin::start(&desk, "--eeprom eeprom.img");
        let info = desk.sot("info");
        let said = String::from_utf8_lossy(&info.stderr);
        assert!(info.status.success() || said.contains("04b4:8613"), "after {after} ms: {said}");
        // Whatever it was, it can be mended.
        desk.ok(&format!("flash eeprom {program}"));
        desk.ok("info");
    }
}

#[test]
fn a_manifest_brings_a_robot_to_what_it_says_and_gives_one_verdict() {
    let desk = Desk::new();
    let program = format!("{FIRMWARE}/fx2-firmware/fx2-firmware.ihx");
    desk.put(
        "team.toml",
        format!("eeprom = {program:?}\ndefault = 1\ngolden = 0\n[slots]\n1 = \"capture.bin\"\n")
            .as_bytes(),
    );
    let _twin = Twin::start(&desk, "");
    let would = desk.sot("flash robot team.toml --dry-run");
    let said = String::from_utf8_lossy(&would.stderr);
    assert!(would.status.code() == Some(1) && said.contains("slot 1, default, golden"), "{said}");

    let said = desk.ok("flash robot team.toml");
    let parts: Vec<&str> = said.lines().filter_map(|line| line.split("  ").next()).collect();
    assert_eq!(
        parts,
        [
            "eeprom",
            "slot 1",
            "default",
            "golden",
            "fpga",
            "fit to play (the manifest names no base)"
        ]
    );
    let again = desk.json("flash robot team.toml --json");
    assert_eq!(again["fit"], true);
    let unchanged = |part: &Value| part["action"] == "unchanged";
    assert!(again["parts"].as_array().unwrap().iter().all(unchanged), "{again}");
    assert_eq!(desk.json("fpga status --json")["slot"], 1);

    for (text, words) in [
        ("slot = 3", &["no manifest", "slot"][..]),
        ("default = 32", &["no slot 32"]),
        ("[slots]\n1 = \"gone.bin\"", &["gone.bin"]),
        ("[slots]\nx = \"capture.bin\"", &["no slot x"]),
        ("serial = \"SOT000000042\"", &["eeprom"]),
    ] {
        desk.put("bad.toml", text.as_bytes());
        desk.fails("flash robot bad.toml", 1, words);
    }
    // Marks of slots that hold nothing cannot be: the verdict says which part.
    desk.put("empty.json", b"{\"golden\": 9}");
    let output = desk.sot("flash robot empty.json");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(1) && said.contains("NOT fit to play"), "{said}");
}

/// The whole robot: turret over USB and base over its serial line, which the twin's list entry names.
#[test]
fn a_manifest_with_a_base_brings_both_halves_of_a_robot_to_what_it_says() {
    let desk = Desk::new();
    let firmware = format!("{FIRMWARE}/khepera-firmware/khepera-firmware.elf");
    let manifest =
        |base: &str| format!("golden = 0\nbase = {base:?}\n[slots]\n0 = \"soccer.bin\"\n");
    desk.put("team.toml", manifest(&firmware).as_bytes());
    desk.put("other.toml", manifest("letters.s37").as_bytes());
    desk.put("letters.s37", base_twin::letters().as_bytes());
    let _twin = Twin::start(&desk, "--pty serial");
    let base = |report: &Value| {
        let parts = report["parts"].as_array().expect("a list");
        parts.iter().find(|part| part["part"] == "base").expect("the base").clone()
    };

    let report = desk.json("flash robot team.toml --json");
    assert_eq!((&report["fit"], &base(&report)["action"]), (&true.into(), &"unchanged".into()));
    let answered = desk.ok("console --timeout 5 B");
    assert_eq!(answered, "b,5.02,5.01\n", "it runs again after its loader was asked");

    let would = desk.sot("flash robot other.toml --dry-run --json");
    assert_eq!(would.status.code(), Some(1));
    let report: Value = serde_json::from_slice(&would.stdout).expect("JSON");
    assert_eq!((&report["fit"], &base(&report)["action"]), (&false.into(), &"would_write".into()));
    assert_eq!(desk.ok("console --timeout 5 B"), "b,5.02,5.01\n");

    let report = desk.json("flash robot other.toml --json");
    assert_eq!((&report["fit"], &base(&report)["action"]), (&true.into(), &"written".into()));
    assert!(desk.ok("console --timeout 5 x").contains("AAAA"), "the other program runs");

    // That program does not listen: the turret is as it should be, and the robot is not fit.
    let failed = desk.sot("flash robot team.toml");
    let said = String::from_utf8_lossy(&failed.stderr).into_owned();
    assert_eq!(failed.status.code(), Some(1), "{said}");
    assert!(said.contains("NOT fit to play: base failed"), "{said}");
    let told = String::from_utf8_lossy(&failed.stdout).into_owned();
    assert!(told.contains("slot 0    unchanged") && told.contains("--wait"), "{told}");
}
