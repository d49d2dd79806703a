//! The FPGA's registers from the base: K-Team's `T,26` over the serial line, through the 68331's
//! firmware, its QSPI and the turret bus to the FPGA that the turret's firmware has configured.

use std::path::Path;

use common_sys::constants as c;
use fx2::host::Link;
use sim::{MS, Ps, SECOND};
use twin::desk::Desk;
use twin::robot::{Images, Robot};
use virtex::bitstream;
use virtex::design::Function;
use virtex::store::{Entry, pack};

/// Both processors and the FPGA are up.
const UP: Ps = SECOND / 2;
const REPLY: Ps = 50 * MS;

fn built(path: &str) -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../build/firmware").join(path);
    std::fs::read(&path).unwrap_or_else(|error| {
        panic!(
            "{}: {error}; build it with: cmake --preset firmware && cmake --build --preset firmware",
            path.display()
        )
    })
}

/// A robot that has been on for a moment; without a function its store is empty.
fn desk(function: Option<Function>) -> Desk {
    let entries: Vec<Entry> = function
        .map(|function| {
            let bits = bitstream::make(function, &bitstream::Options::default());
            Entry::from_file(0, &bits, "test".into()).expect("a good stream")
        })
        .into_iter()
        .collect();
    let images = Images {
        fx2: built("fx2-firmware/fx2-firmware.ihx"),
        khepera: built("khepera-firmware/khepera-firmware.elf"),
        flash: pack(&entries, 0),
    };
    let mut desk = Desk::new(Robot::new(&images).expect("good images"), 1);
    desk.run_until(UP);
    desk.robot.base.serial_take();
    desk
}

/// What the base answers to `line`, beginning in time.
fn ask(desk: &mut Desk, line: &str) -> String {
    desk.robot.base.serial_take();
    desk.robot.base.serial_send(format!("{line}\r\n").as_bytes());
    while desk.robot.base.serial_waiting() > 0 {
        let next = desk.robot.now() + MS;
        desk.run_until(next);
    }
    let sent = desk.robot.now();
    let mut answer = Vec::new();
    while !answer.ends_with(b"\r\n") {
        let next = desk.robot.now() + MS;
        desk.run_until(next);
        for (time, byte) in desk.robot.base.serial_take() {
            assert!(!answer.is_empty() || time < sent + REPLY, "'{line}' is answered too late");
            answer.push(byte);
        }
        assert!(desk.robot.now() < sent + SECOND, "'{line}' gets no whole answer");
    }
    String::from_utf8(answer).expect("text").trim_end().to_owned()
}

fn register(desk: &mut Desk, address: u32) -> Option<u16> {
    let now = desk.robot.now();
    desk.robot.turret.fpga.register(now, address as u8)
}

#[test]
fn registers_are_read_and_written_while_reports_come_and_none_is_lost() {
    let mut desk = desk(Some(Function::Soccer));
    assert_eq!(ask(&mut desk, "T,26,B"), "t,26,b,1,1");
    assert_eq!(ask(&mut desk, "T,26,R,0"), format!("t,26,r,{}", c::FPGA_ID_VALUE));
    assert_eq!(ask(&mut desk, "T,26,R,4"), "t,26,r,60");
    for value in [4, 235, 61] {
        assert_eq!(ask(&mut desk, &format!("T,26,W,{value},4")), "t,26,w");
        assert_eq!(register(&mut desk, c::FPGA_REG_GOAL_ROW), Some(value));
        assert_eq!(ask(&mut desk, "T,26,R,4"), format!("t,26,r,{value}"));
    }
    assert_eq!(ask(&mut desk, "T,26,W,3,4"), "z,Register 4 does not take 3 and is 61");
    assert_eq!(ask(&mut desk, "T,26,W,1,0"), "z,Register 0 does not take 1 and is 21249");
    assert_eq!(ask(&mut desk, "T,26,W,1,2"), "z,Register 2 does not take 1 and is 0");
    assert_eq!(ask(&mut desk, "fpga set search-max 100"), "ok: search_max = 100 px");
    assert_eq!(register(&mut desk, c::FPGA_REG_SEARCH_MAX), Some(100));
    let told = ask(&mut desk, "fpga get search_max");
    assert_eq!(told, "search_max = 100 px (16..127, reset 79) largest disparity searched");
    let status = ask(&mut desk, "T,26,S");
    let fields: Vec<u32> =
        status.split(',').skip(3).map(|field| field.parse().expect("a decimal")).collect();
    assert!(fields[1] > 20 && fields[2..] == [0, 0], "age, good, damaged, lost: {status}");
    assert_eq!(desk.robot.diagnostics(), [""; 0]);
}

#[test]
fn registers_answer_without_reports() {
    let mut desk = desk(Some(Function::Capture));
    assert_eq!(ask(&mut desk, "T,26,B"), "t,26,b,1,2");
    assert_eq!(ask(&mut desk, "T,26,N"), "z,Turret does not answer");
    assert_eq!(ask(&mut desk, "T,26,W,1,9"), "t,26,w");
    assert_eq!(register(&mut desk, c::FPGA_REG_SOURCE), Some(1));
}

#[test]
fn an_fpga_that_is_not_configured_does_not_answer() {
    let mut desk = desk(None);
    for line in ["T,26,B", "T,26,R,4", "T,26,W,61,4", "T,26,N"] {
        assert_eq!(ask(&mut desk, line), "z,Turret does not answer", "{line}");
    }
    assert_eq!(ask(&mut desk, "H"), "h,0,0");
}
