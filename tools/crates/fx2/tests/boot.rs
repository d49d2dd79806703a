//! Power-on: EEPROMs, the blank chip, and loading through vendor request A0.

mod common;

use common::{Bench, Program};
use fx2::eeprom::{BootConfig, Eeprom, Identity, c0_image, c2_image};
use fx2::host::{self, Host, HostError, Request};
use fx2::{Config, Fx2, Ram};
use sim::{MS, Ps, SECOND};

const ID: Identity = Identity { vendor: 0x1234, product: 0x5678, device: 0x9ABC };

/// Writes 0x42 to internal RAM, that is: runs.
fn program() -> Program {
    Program::new().sfr(0x30, 0x42).stop()
}

fn run(eeprom: Option<Eeprom>, until: Ps) -> (Fx2, Bench) {
    let mut fx2 = Fx2::new(Config::default());
    let mut board = Bench { eeprom, ..Bench::default() };
    fx2.run_until(until, &mut board);
    (fx2, board)
}

fn runs(fx2: &Fx2) -> bool {
    fx2.cpu().iram()[0x30] == 0x42
}

#[test]
fn a_c2_image_is_loaded_at_the_speed_of_the_bus_and_run() {
    for (fast, bit) in [(false, 10_000_000), (true, 2_500_000)] {
        let config = BootConfig { disconnected: false, fast };
        let mut code = program();
        code.0.resize(500, 0);
        let image = c2_image(&code.image(), ID, config);
        let eeprom = Eeprom::large(0x51, &image).unwrap();
        let load_time = (image.len() - 8) as Ps * 9 * bit;
        let (fx2, _) = run(Some(eeprom.clone()), load_time);
        assert!(!runs(&fx2) && fx2.is_cpu_held(), "fast {fast}: too early");
        assert!(!fx2.usb_attached());
        let (fx2, _) = run(Some(eeprom), load_time + 3 * MS);
        assert!(runs(&fx2) && fx2.usb_attached(), "fast {fast}");
    }
}

#[test]
fn a_c2_image_can_start_disconnected() {
    let config = BootConfig { disconnected: true, fast: true };
    let image = c2_image(&program().image(), ID, config);
    let (fx2, _) = run(Some(Eeprom::large(0x51, &image).unwrap()), 20 * MS);
    assert!(runs(&fx2) && !fx2.usb_attached());
}

#[test]
fn without_eeprom_the_chip_is_the_blank_device() {
    for (ram, release) in [(Ram::K8, 0x0004), (Ram::K16, 0xA001)] {
        let mut fx2 = Fx2::new(Config { ram, ..Config::default() });
        let mut board = Bench::default();
        let mut bench = host::Bench { fx2: &mut fx2, board: &mut board };
        let device = Host::new().enumerate(&mut bench).unwrap();
        assert_eq!((device.vendor(), device.product()), (0x04B4, 0x8613));
        assert_eq!((device.release(), device.configuration.len()), (release, 171));
        assert_eq!(fx2.usb_address(), 1);
    }
}

#[test]
fn a_c0_image_changes_the_identity_only() {
    let image = c0_image(ID, BootConfig::default());
    let mut fx2 = Fx2::new(Config::default());
    let eeprom = Some(Eeprom::small(0x50, &image).unwrap());
    let mut board = Bench { eeprom, ..Bench::default() };
    let mut bench = host::Bench { fx2: &mut fx2, board: &mut board };
    let device = Host::new().enumerate(&mut bench).unwrap();
    assert_eq!((device.vendor(), device.product(), device.release()), (0x1234, 0x5678, 0x9ABC));
    assert!(fx2.is_cpu_held());
}

#[test]
fn an_eeprom_with_anything_else_counts_as_blank() {
    for contents in [&[][..], &[0x00; 64], &[0xC2]] {
        let (fx2, _) = run(Some(Eeprom::large(0x51, contents).unwrap()), 100 * MS);
        assert!(fx2.usb_attached() || contents == [0xC2], "{contents:?}");
        assert!(fx2.is_cpu_held());
    }
}

#[test]
fn vendor_request_a0_loads_reads_back_and_starts_a_program() {
    let mut fx2 = Fx2::new(Config::default());
    let mut board = Bench::default();
    let mut bench = host::Bench { fx2: &mut fx2, board: &mut board };
    let mut host = Host::new();
    host.enumerate(&mut bench).unwrap();
    let at = |kind, value| Request { kind, request: 0xA0, value, index: 0 };
    host.control_out(&mut bench, at(0x40, 0xE600), &[1]).unwrap();
    let mut code = program().0;
    code.resize(200, 0x5A);
    host.control_out(&mut bench, at(0x40, 0), &code).unwrap();
    host.control_out(&mut bench, at(0x40, 0xE000), &[1, 2, 3]).unwrap();
    assert_eq!(host.control_in(&mut bench, at(0xC0, 0), 200).unwrap(), code);
    assert_eq!(host.control_in(&mut bench, at(0xC0, 0xE001), 2).unwrap(), [2, 3]);
    host.control_out(&mut bench, at(0x40, 0xE600), &[0]).unwrap();
    let until = fx2.now() + MS;
    fx2.run_until(until, &mut board);
    assert!(runs(&fx2) && !fx2.is_cpu_held());
    assert_eq!(fx2.diagnostics(), []);
}

#[test]
fn a_load_outside_the_memory_is_ignored_and_reported() {
    let mut fx2 = Fx2::new(Config::default());
    let mut board = Bench::default();
    let mut bench = host::Bench { fx2: &mut fx2, board: &mut board };
    let mut host = Host::new();
    host.enumerate(&mut bench).unwrap();
    let request = Request { kind: 0x40, request: 0xA0, value: 0x1FFF, index: 0 };
    host.control_out(&mut bench, request, &[1, 2]).unwrap();
    assert_eq!((fx2.peek(0x1FFF), fx2.peek(0x2000)), (1, 0xFF));
    assert_eq!(fx2.diagnostics().len(), 1);
    assert_eq!(fx2.diagnostics()[0].address, 0x2000);
}

#[test]
fn the_blank_device_answers_standard_requests_and_stalls_the_rest() {
    let mut fx2 = Fx2::new(Config::default());
    let mut board = Bench::default();
    let mut bench = host::Bench { fx2: &mut fx2, board: &mut board };
    let mut host = Host::new();
    host.enumerate(&mut bench).unwrap();
    let request = |kind, request, value| Request { kind, request, value, index: 0 };
    assert_eq!(host.control_in(&mut bench, request(0x80, 8, 0), 1).unwrap(), [1]);
    host.control_out(&mut bench, request(0x01, 11, 3), &[]).unwrap();
    assert_eq!(host.control_in(&mut bench, request(0x81, 10, 0), 1).unwrap(), [3]);
    let refused = [
        host.control_out(&mut bench, request(0x01, 11, 4), &[]),
        host.control_out(&mut bench, request(0x40, 0xA2, 0), &[1]),
        host.control_in(&mut bench, request(0x80, 6, 0x0300), 255).map(|_| ()),
    ];
    assert_eq!(refused, [Err(HostError::Stall); 3]);
}

#[test]
fn a_missing_device_is_an_error_after_its_time() {
    let image = c2_image(&program().image(), ID, BootConfig { disconnected: true, fast: true });
    let mut fx2 = Fx2::new(Config::default());
    let eeprom = Some(Eeprom::large(0x51, &image).unwrap());
    let mut board = Bench { eeprom, ..Bench::default() };
    let mut bench = host::Bench { fx2: &mut fx2, board: &mut board };
    assert_eq!(Host::new().enumerate(&mut bench), Err(HostError::NotAttached(1000)));
    assert!(fx2.now() < 2 * SECOND);
}
