//! Firmware that others wrote: each image leaves the bus or stays, comes up as the device it says it is,
//! and does its work without touching anything that is not modelled.
//!
//! The images come from Debian's packages and PyPI: `tools/setup test` fetches them to build/linux-guest.

mod common;

use common::Bench;
use fx2::eeprom::Eeprom;
use fx2::host::{self, Device, Host, Link, Request};
use fx2::image::Image;
use fx2::pins::{Board, Driven, Sensed};
use fx2::{Config, Fx2, Ram, Rule};
use sim::{MS, Ps, SECOND};
use std::path::Path;

/// Where images are, below build/linux-guest.
const SIGROK: &str = "root/usr/share/sigrok-firmware";
const IXO: &str = "root/lib/firmware/ixo-usb-jtag";
const OPSIS: &str = "root/lib/firmware/opsis-fx2";
const USBDUX: &str = "root/lib/firmware";
const LIBFX2: &str = "files/fx2";

fn image(path: &str) -> Image {
    let whole = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../build/linux-guest").join(path);
    let bytes = std::fs::read(&whole).unwrap_or_else(|error| {
        panic!("{}: {error}; tools/setup test fetches foreign firmware", whole.display())
    });
    Image::parse(&bytes).unwrap_or_else(|error| panic!("{path}: {error}"))
}

fn start(path: &str) -> Fx2 {
    // Sigrok's images and that of the Opsis board are for the FX2LP.
    let large = path.starts_with(OPSIS) || path.starts_with(SIGROK);
    let ram = if large { Ram::K16 } else { Ram::K8 };
    let mut fx2 = Fx2::new(Config { ram, external_ram: false });
    fx2.load(&image(path)).unwrap();
    fx2
}

fn in_request(request: u8, value: u16) -> Request {
    Request { kind: 0xC0, request, value, index: 0 }
}

fn out_request(request: u8, value: u16) -> Request {
    Request { kind: 0x40, request, value, index: 0 }
}

/// String `index` in English.
fn string(host: &mut Host, link: &mut impl Link, index: u8) -> String {
    let get = Request { kind: 0x80, request: 6, value: 0x0300 | u16::from(index), index: 0x0409 };
    let bytes = host.control_in(link, get, 255).unwrap();
    let units = bytes[2..].chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
    String::from_utf16(&units.collect::<Vec<u16>>()).unwrap()
}

/// Lets the firmware come up, and enumerates it.
fn enumerate(link: &mut impl Link, host: &mut Host) -> Device {
    let settled = link.fx2().now() + SECOND;
    link.run_until(settled);
    host.enumerate(link).unwrap()
}

#[test]
fn foreign_firmware_comes_up_as_itself_at_both_speeds() {
    let devices = [
        (SIGROK, "fx2lafw-braintechnology-usb-lps.fw", 0x16D0, 0x0498, "fx2lafw"),
        (SIGROK, "fx2lafw-cwav-usbeeax.fw", 0x08A9, 0x0014, "fx2lafw"),
        (SIGROK, "fx2lafw-cypress-fx2.fw", 0x04B4, 0x8613, "fx2lafw"),
        (SIGROK, "fx2lafw-hantek-6022be.fw", 0x1D50, 0x608E, "fx2lafw"),
        (SIGROK, "fx2lafw-hantek-6022bl.fw", 0x1D50, 0x608E, "fx2lafw"),
        (SIGROK, "fx2lafw-sainsmart-dds120.fw", 0x1D50, 0x608E, "fx2lafw"),
        (SIGROK, "fx2lafw-saleae-logic.fw", 0x0925, 0x3881, "fx2lafw"),
        (SIGROK, "fx2lafw-sigrok-fx2-8ch.fw", 0x1D50, 0x608C, "fx2lafw"),
        (SIGROK, "fx2lafw-sigrok-fx2-16ch.fw", 0x1D50, 0x608D, "fx2lafw"),
        (SIGROK, "fx2lafw-yixingdianzi-mdso.fw", 0x1D50, 0x608E, "fx2lafw"),
        (OPSIS, "eeprom.ihx", 0x2A19, 0x5441, "Opsis (EEPROM Mode)"),
        (IXO, "usbjtag-basic.hex", 0x16C0, 0x06AD, "USB-JTAG-IF"),
        (IXO, "usbjtag-nexys.hex", 0x16C0, 0x06AD, "USB-JTAG-IF"),
        (IXO, "usbjtag-xpcu_x.hex", 0x16C0, 0x06AD, "USB-JTAG-IF"),
        (LIBFX2, "boot-cypress.ihex", 0x04B4, 0x8613, "FX2 series Cypress-class bootloader"),
    ];
    for (folder, name, vendor, product, product_string) in devices {
        for (speed, mut host) in [("high", Host::new()), ("full", Host::full_speed())] {
            let mut fx2 = start(&format!("{folder}/{name}"));
            let mut board = Bench::default();
            let mut link = host::Bench { fx2: &mut fx2, board: &mut board };
            let device = enumerate(&mut link, &mut host);
            assert_eq!((device.vendor(), device.product()), (vendor, product), "{name}, {speed}");
            let index = device.device[15];
            assert_eq!(string(&mut host, &mut link, index), product_string, "{name}, {speed}");
            assert_eq!(fx2.diagnostics(), [], "{name}, {speed}");
        }
    }
}

#[test]
fn libfx2s_boot_loader_writes_and_reads_eeproms_and_memory() {
    let eeproms = [
        (Eeprom::small(0x50, &[]).unwrap(), 0xA2, 3, 0x18),
        (Eeprom::large(0x51, &[]).unwrap(), 0xA9, 6, 0x07C8),
    ];
    for (eeprom, request, page_size, address) in eeproms {
        let mut fx2 = start("files/fx2/boot-cypress.ihex");
        let mut board = Bench { eeprom: Some(eeprom), ..Bench::default() };
        let mut link = host::Bench { fx2: &mut fx2, board: &mut board };
        let mut host = Host::new();
        enumerate(&mut link, &mut host);
        let data: Vec<u8> = (1..=150).collect();
        // Byte by byte without a page size, then in pages; across their borders.
        for (size, chunk) in [(0, 16), (page_size, 64)] {
            host.control_out(&mut link, out_request(0xB0, size), &[]).unwrap();
            let mut at = address;
            for piece in data.chunks(chunk) {
                host.control_out(&mut link, out_request(request, at), piece).unwrap();
                at += piece.len() as u16;
            }
            let read = host.control_in(&mut link, in_request(request, address), 150).unwrap();
            assert_eq!(read, data, "request {request:#x}, pages of 2^{size}");
        }
        host.control_out(&mut link, out_request(0xA3, 0xE140), &data[..64]).unwrap();
        let read = host.control_in(&mut link, in_request(0xA3, 0xE140), 64).unwrap();
        assert_eq!(read, data[..64]);
        let stored = board.eeprom.as_ref().unwrap().data();
        assert_eq!(stored[usize::from(address)..][..150], data);
        assert_eq!(fx2.diagnostics(), []);
    }
}

/// What the logic analyser looks at: a counter of 48 MHz.
#[derive(Default)]
struct Counter;

impl Board for Counter {
    fn drive(&mut self, _now: Ps, _driven: &Driven) {}

    fn sense(&mut self, now: Ps) -> Sensed {
        let edge = sim::Clock::new(48_000_000).edge_at_or_after(now);
        Sensed { fd: edge as u16, ..Sensed::default() }
    }

    fn i2c_start(&mut self, _now: Ps, _address_and_direction: u8) -> bool {
        false
    }

    fn i2c_write(&mut self, _now: Ps, _byte: u8) -> bool {
        false
    }

    fn i2c_read(&mut self, _now: Ps, _acknowledge: bool) -> u8 {
        0xFF
    }

    fn i2c_stop(&mut self, _now: Ps) {}
}

#[test]
fn sigroks_logic_analyser_samples_at_the_rate_it_was_told() {
    // Flags: 0x40 = 48 MHz, 0x20 = 16 channels. So many clocks between two samples.
    for (name, flags, clocks) in [
        ("fx2lafw-sigrok-fx2-8ch.fw", 0x40, 2_u16),
        ("fx2lafw-sigrok-fx2-8ch.fw", 0x40, 48),
        ("fx2lafw-sigrok-fx2-8ch.fw", 0x40, 1000),
        ("fx2lafw-sigrok-fx2-16ch.fw", 0x60, 8),
    ] {
        let mut fx2 = start(&format!("{SIGROK}/{name}"));
        let mut board = Counter;
        let mut link = host::Bench { fx2: &mut fx2, board: &mut board };
        let mut host = Host::new();
        enumerate(&mut link, &mut host);
        let version = host.control_in(&mut link, in_request(0xB0, 0), 2).unwrap();
        assert_eq!(version[0], 1, "fx2lafw's protocol");
        let [high, low] = (clocks - 1).to_be_bytes();
        host.control_out(&mut link, out_request(0xB1, 0), &[flags, high, low]).unwrap();
        let mut bytes = Vec::new();
        for _ in 0..40 {
            bytes.extend(host.bulk_in(&mut link, 2).unwrap());
        }
        assert_eq!(bytes.len(), 40 * 512);
        let wide = flags & 0x20 != 0;
        let samples: Vec<u16> = if wide {
            bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect()
        } else {
            bytes.iter().copied().map(u16::from).collect()
        };
        let mask = if wide { 0xFFFF } else { 0x00FF };
        for (n, pair) in samples.windows(2).enumerate() {
            let step = pair[1].wrapping_sub(pair[0]) & mask;
            assert_eq!(step, clocks & mask, "{name}, {clocks} clocks, sample {n}");
        }
        assert_eq!(fx2.diagnostics(), [], "{name}");
    }
}

#[test]
fn the_opsis_boards_serial_port_passes_bytes_both_ways() {
    let mut fx2 = start(&format!("{OPSIS}/usb-uart.ihx"));
    let mut board = Bench::default();
    let mut link = host::Bench { fx2: &mut fx2, board: &mut board };
    let mut host = Host::new();
    let device = enumerate(&mut link, &mut host);
    assert_eq!((device.vendor(), device.product()), (0x2A19, 0x5441));
    // SET_LINE_CODING (CDC PSTN 6.3.10): 115200 baud, 8N1.
    let coding = Request { kind: 0x21, request: 0x20, value: 0, index: 0 };
    host.control_out(&mut link, coding, &[0x00, 0xC2, 0x01, 0x00, 0, 0, 8]).unwrap();
    let endpoints: Vec<(u8, u8)> = device
        .configuration
        .windows(7)
        .filter(|d| d[..2] == [7, 5])
        .map(|d| (d[2], d[3] & 3))
        .collect();
    assert_eq!(endpoints, [(0x81, 3), (0x02, 2), (0x86, 2)]);
    host.bulk_out(&mut link, 2, b"to the board").unwrap();
    let until = link.fx2().now() + 20 * MS;
    link.run_until(until);
    assert_eq!(link.fx2().take_serial(0), b"to the board");
    for byte in *b"and back" {
        link.fx2().push_serial(0, byte);
    }
    let mut back = Vec::new();
    while back.len() < 8 {
        back.extend(host.bulk_in(&mut link, 6).unwrap());
    }
    assert_eq!(back, b"and back");
    assert_eq!(fx2.diagnostics(), []);
}

#[test]
fn usbdux_boxes_run_on_the_default_device() {
    for name in ["usbdux_firmware.bin", "usbduxfast_firmware.bin", "usbduxsigma_firmware.bin"] {
        let mut fx2 = start(&format!("{USBDUX}/{name}"));
        let mut board = Bench::default();
        let mut link = host::Bench { fx2: &mut fx2, board: &mut board };
        let device = enumerate(&mut link, &mut Host::new());
        assert_eq!((device.vendor(), device.product()), (0x04B4, 0x8613), "{name}");
        // Two of them write FIFORESET five times without a pause.
        let too_soon = |d: &fx2::Diagnostic| d.rule == Rule::SyncDelay && d.address == 0xE604;
        assert!(fx2.diagnostics().iter().all(too_soon), "{name}: {:?}", fx2.diagnostics());
    }
}
