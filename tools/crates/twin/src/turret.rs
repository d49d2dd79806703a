//! The turret's wiring: flash, FPGA and boot EEPROM around the FX2, and the turret bus to the base.
//!
//! Which pin goes where comes from the firmware's board file, and so do the FPGA's and the flash's
//! times. Pins move here when the FX2's clock edge says so; how late they may really be enters where
//! it can do harm ([`ADDRESS_LATE_PS`], [`CTL_LATE_PS`]).
//!
//! What is assumed: all pins that somebody reads are pulled up; a bus that nobody drives reads as
//! ones.

use std::fmt;

use common_sys::constants::{
    BOARD_PCS_TURRET, BOARD_TURRET_ATTENTION_IRQ, TURRET_CTL_CCLK, TURRET_CTL_FLASH_OE,
    TURRET_CTL_FLASH_WE, TURRET_FLASH_BLOCK, TURRET_PA_FLASH_CE, TURRET_PA_FPGA_CS, TURRET_PA_PROG,
    TURRET_PA_SPI_SS, TURRET_PC_SPI_MISO, TURRET_PC_SPI_MOSI, TURRET_PC_SPI_SCK,
    TURRET_PE_ADDRESS_MASK, TURRET_RDY_DONE, TURRET_RDY_FLASH, TURRET_RDY_INIT,
};
use common_sys::link::REPORT_SIZE;
use fx2::Fx2;
use fx2::eeprom::Eeprom;
use fx2::pins::{Board, Driven, Sensed};
use fx2::slave::Fifo;
use khepera::turret_bus::TurretBus;
use sim::{Ps, US};
use virtex::diagnostics::Diagnostics;
use virtex::{Fpga, Frame};

use crate::flash::{Flash, OUTPUT_DISABLE_PS, Pins};
use crate::sensor::CameraBus;

/// GPIFADR and FD may come so much later than CTL (CY7C68013 data sheet, GPIF timing).
pub const ADDRESS_LATE_PS: Ps = 7_500;
/// CTL may come so much later than the clock edge.
pub const CTL_LATE_PS: Ps = 6_700;
/// The FX2 wants data so long before the edge at which it samples.
pub const SAMPLE_SETUP_PS: Ps = 9_200;

const PORT_A: usize = 0;
const PORT_C: usize = 2;
const PORT_D: usize = 3;
const PORT_E: usize = 4;
/// PE7 is A8 while GPIFADR does not drive it.
const PE_A8: u8 = 7;
const GPIFADR_MASK: u16 = TURRET_FLASH_BLOCK as u16 - 1;
const PE_MASK: u8 = TURRET_PE_ADDRESS_MASK as u8;

/// What is wrong on the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trouble {
    /// FX2 and flash drive FD[7:0] together.
    FlashContention,
    /// The FPGA's streaming pins drive FD[15:0] together with the FX2 or the flash.
    StreamContention,
    /// The FX2 drives FD[7:0] while the flash may not have let go yet.
    TurnAround,
    /// The FX2 drives PC2 while the FPGA drives MISO onto it.
    MisoContention,
    /// The flash is selected, but the FX2 leaves some of its address pins alone.
    FloatingAddress,
    /// The FPGA or the flash takes a byte that nobody drives.
    FloatingData,
    /// SS# and the flash's CE# are low together: the SPI pins are address pins too.
    SpiDuringFlash,
}

impl fmt::Display for Trouble {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::FlashContention => "FX2 and flash drive FD[7:0] together",
            Self::StreamContention => "the FPGA streams onto FD while another chip drives it",
            Self::TurnAround => "the FX2 drives FD[7:0] before the flash has let go",
            Self::MisoContention => "FX2 and FPGA drive PC2 (MISO) together",
            Self::FloatingAddress => "the flash is selected while address pins float",
            Self::FloatingData => "a byte is taken from FD[7:0] while nobody drives it",
            Self::SpiDuringFlash => "SS# and the flash's CE# are low together",
        })
    }
}

/// The levels of port A that others hang on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Selects {
    prog: bool,
    flash_ce: bool,
    fpga_cs: bool,
    spi_ss: bool,
}

/// The turret without its FX2.
#[derive(Clone, Debug)]
pub struct Turret {
    /// The flash chip.
    pub flash: Flash,
    /// The FPGA.
    pub fpga: Fpga,
    /// The boot EEPROM.
    pub eeprom: Eeprom,
    /// The cameras and their multiplexer, on the EEPROM's bus.
    pub cameras: CameraBus,
    driven: Driven,
    selects: Selects,
    pins: Pins,
    cclk: bool,
    /// Since when the FX2 has driven FD[7:0] as it does.
    fd_since: Ps,
    /// Whether the FX2 and the flash drove FD[7:0] after the last change.
    drivers: (bool, bool),
    /// The FPGA has begun or ended to drive FD since the FX2's slice began.
    stream_changed: bool,
    diagnostics: Diagnostics<Trouble>,
}

impl Turret {
    /// At power-on, time 0.
    pub fn new(flash: Flash, eeprom: Eeprom) -> Self {
        Self::powered(flash, eeprom, 0)
    }

    fn powered(flash: Flash, eeprom: Eeprom, now: Ps) -> Self {
        let driven = Driven::default();
        let selects = selects(&driven);
        Self {
            flash,
            fpga: Fpga::new(now, CTL_LATE_PS),
            eeprom,
            cameras: CameraBus::default(),
            pins: flash_pins(&driven, selects),
            cclk: true,
            driven,
            selects,
            fd_since: now,
            drivers: (false, false),
            stream_changed: false,
            diagnostics: Diagnostics::default(),
        }
    }

    /// The supply fails at `now` and returns at once. The FX2 has to be started anew by its owner;
    /// flash and EEPROM keep what the cut left in them.
    pub fn power_cycle(&mut self, now: Ps) {
        self.flash.power_off(now);
        let mut cameras = self.cameras.clone();
        cameras.power_cycle();
        *self = Self::powered(self.flash.clone(), self.eeprom.clone(), now);
        self.cameras = cameras;
    }

    /// Both cameras have delivered their last row. False if the FPGA does not take the pair.
    ///
    /// # Panics
    /// See [`Fpga::frame`].
    pub fn frame(&mut self, frame: &Frame<'_>) -> bool {
        self.fpga.frame(frame)
    }

    /// Whether the FPGA is master of the slave FIFO, so that [`Turret::fill_fifo`] has work.
    pub fn streams(&self) -> bool {
        self.fpga.stream.drives()
    }

    /// The FPGA writes into the FX2's slave FIFO what it could since it did so last, up to the FX2's
    /// time: a word at each edge of IFCLK at which there is something to send and room for it. A buffer
    /// that the host empties has room from the next call on; the FIFO's own buffers bridge that.
    pub fn fill_fifo(&mut self, fx2: &mut Fx2) {
        let now = fx2.now();
        let stream = &mut self.fpga.stream;
        while let Some((words, from)) = stream.words(now) {
            if from >= now {
                break;
            }
            if !fx2.slave_can_write(Fifo::Ep6) {
                stream.held_up(now);
                break;
            }
            let burst = fx2.slave_write(Fifo::Ep6, words, from, now);
            if stream.advance(burst.words, burst.next) {
                fx2.slave_packet_end(Fifo::Ep6);
                break;
            }
        }
    }

    /// The reports that the base has read to their end since the last call.
    pub fn take_reports(&mut self) -> Vec<[u8; REPORT_SIZE]> {
        self.fpga.take_reports()
    }

    /// When RY/BY#, INIT# or the attention line changes by itself next.
    pub fn next_event(&self, now: Ps) -> Option<Ps> {
        self.flash.next_event().into_iter().chain(self.fpga.next_event(now)).min()
    }

    /// What is wrong on the board.
    pub fn diagnostics(&self) -> &Diagnostics<Trouble> {
        &self.diagnostics
    }

    /// One line for each kind of trouble on the board, at the FPGA's port and at the flash, with its
    /// first time and how often it was seen.
    pub fn report(&self) -> Vec<String> {
        fn lines<T: Copy + PartialEq + fmt::Display>(
            place: &str,
            diagnostics: &Diagnostics<T>,
        ) -> Vec<String> {
            let line = |d: &virtex::diagnostics::Diagnostic<T>| {
                format!("{place}: {} ({} times, first at {} us)", d.what, d.count, d.first / US)
            };
            diagnostics.list().iter().map(line).collect()
        }
        [
            lines("turret", &self.diagnostics),
            lines("FPGA", self.fpga.port.diagnostics()),
            lines("flash", self.flash.diagnostics()),
        ]
        .concat()
    }

    /// The byte on FD[7:0] as seen at `now` with the pins as they were until now, and since when it
    /// has been stable.
    fn bus(&mut self, now: Ps) -> (u8, Ps) {
        let enable = self.driven.fd_enable as u8;
        let fx2 = (self.driven.fd as u8 | !enable, self.fd_since + ADDRESS_LATE_PS);
        match (enable != 0, self.flash.drives()) {
            (true, false) => fx2,
            (false, true) => {
                let (byte, since) = self.flash.output(now);
                (byte, since + ADDRESS_LATE_PS)
            }
            (true, true) => (fx2.0 & self.flash.output(now).0, now),
            (false, false) => (0xFF, self.fd_since.max(self.flash.released_since())),
        }
    }

    /// The same for a chip that takes it.
    fn taken(&mut self, now: Ps) -> (u8, Ps) {
        if self.drivers == (false, false) {
            self.diagnostics.note(now, Trouble::FloatingData);
        }
        self.bus(now)
    }

    fn drive_selects(&mut self, now: Ps, driven: &Driven) {
        let selects = selects(driven);
        if selects == self.selects {
            return;
        }
        self.fpga.port.set_prog(now, selects.prog);
        self.fpga.port.set_selected(now, !selects.fpga_cs);
        if !selects.spi_ss && !selects.flash_ce {
            self.diagnostics.note(now, Trouble::SpiDuringFlash);
        }
        self.selects = selects;
    }

    fn drive_flash(&mut self, now: Ps, driven: &Driven) {
        let pins = flash_pins(driven, self.selects);
        if pins == self.pins {
            return;
        }
        let writing = |pins: Pins| !pins.ce && !pins.we;
        let data = if writing(self.pins) && !writing(pins) { self.taken(now) } else { (0xFF, now) };
        self.flash.set_pins(now, pins, data);
        self.pins = pins;
        self.fpga.port.data_changes(now);
        if !pins.ce && floats(driven) {
            self.diagnostics.note(now, Trouble::FloatingAddress);
        }
    }

    fn drive_spi(&mut self, now: Ps, driven: &Driven) {
        let [sck, mosi, miso] = [TURRET_PC_SPI_SCK, TURRET_PC_SPI_MOSI, TURRET_PC_SPI_MISO];
        let level = |pin: u32| port(driven, PORT_C, pin);
        let streamed = self.fpga.streams(now);
        self.fpga.spi_pins(now, !self.selects.spi_ss, level(sck), level(mosi));
        if self.fpga.streams(now) != streamed {
            self.stream_changed = true;
            if self.drivers != (false, false) {
                self.diagnostics.note(now, Trouble::StreamContention);
            }
        }
        if !self.selects.spi_ss && driven.port_enable[PORT_C] >> miso & 1 != 0 {
            self.diagnostics.note(now, Trouble::MisoContention);
        }
    }

    /// Look at who drives FD[7:0] after a change.
    fn check_drivers(&mut self, now: Ps) {
        let drivers = (self.driven.fd_enable as u8 != 0, self.flash.drives());
        if drivers == self.drivers {
            return;
        }
        let was = std::mem::replace(&mut self.drivers, drivers);
        if drivers == (true, true) {
            self.diagnostics.note(now, Trouble::FlashContention);
        }
        let released = self.flash.released_since();
        if drivers == (true, false) && !was.0 && released > 0 && now < released + OUTPUT_DISABLE_PS
        {
            self.diagnostics.note(now, Trouble::TurnAround);
        }
        if drivers != (false, false) && self.fpga.streams(now) {
            self.diagnostics.note(now, Trouble::StreamContention);
        }
    }
}

/// Level of a port pin: as driven, or pulled up.
fn port(driven: &Driven, port: usize, pin: u32) -> bool {
    (driven.port[port] | !driven.port_enable[port]) >> pin & 1 != 0
}

/// Level of a CTL pin: as driven, or pulled up.
fn ctl(driven: &Driven, pin: u32) -> bool {
    (driven.ctl | !driven.ctl_enable) >> pin & 1 != 0
}

fn selects(driven: &Driven) -> Selects {
    Selects {
        prog: port(driven, PORT_A, TURRET_PA_PROG),
        flash_ce: port(driven, PORT_A, TURRET_PA_FLASH_CE),
        fpga_cs: port(driven, PORT_A, TURRET_PA_FPGA_CS),
        spi_ss: port(driven, PORT_A, TURRET_PA_SPI_SS),
    }
}

/// The low nine address pins serve the GPIF or are port pins; either way they are the same pins.
fn low_address(driven: &Driven) -> (u16, u16) {
    let a8 = |ports: &[u8; 5]| u16::from(ports[PORT_E] >> PE_A8 & 1) << 8;
    let pins = u16::from(driven.port[PORT_C]) | a8(&driven.port);
    let pins_enable = u16::from(driven.port_enable[PORT_C]) | a8(&driven.port_enable);
    let gpif = driven.gpifadr_enable & GPIFADR_MASK;
    (driven.gpifadr & gpif | pins & !gpif, gpif | pins_enable)
}

fn flash_pins(driven: &Driven, selects: Selects) -> Pins {
    let (low, low_enable) = low_address(driven);
    let low = u32::from((low | !low_enable) & GPIFADR_MASK);
    let pd = u32::from(driven.port[PORT_D] | !driven.port_enable[PORT_D]);
    let pe = u32::from((driven.port[PORT_E] | !driven.port_enable[PORT_E]) & PE_MASK);
    Pins {
        address: low | pd << 9 | pe << 17,
        ce: selects.flash_ce,
        oe: ctl(driven, TURRET_CTL_FLASH_OE),
        we: ctl(driven, TURRET_CTL_FLASH_WE),
    }
}

fn floats(driven: &Driven) -> bool {
    low_address(driven).1 != GPIFADR_MASK
        || driven.port_enable[PORT_D] != 0xFF
        || driven.port_enable[PORT_E] & PE_MASK != PE_MASK
}

impl Board for Turret {
    fn drive(&mut self, now: Ps, driven: &Driven) {
        let cclk = ctl(driven, TURRET_CTL_CCLK);
        if cclk && !self.cclk {
            let (byte, since) = if self.selects.fpga_cs { (0xFF, now) } else { self.taken(now) };
            self.fpga.port.cclk_rises(now, byte, since);
        }
        self.cclk = cclk;
        self.drive_selects(now, driven);
        self.drive_flash(now, driven);
        if (driven.fd as u8, driven.fd_enable as u8)
            != (self.driven.fd as u8, self.driven.fd_enable as u8)
        {
            self.fd_since = now;
            self.fpga.port.data_changes(now);
        }
        // Port C carries addresses too; only with SS# low do they concern the FPGA.
        if !self.selects.spi_ss || !selects(&self.driven).spi_ss {
            self.drive_spi(now, driven);
        }
        self.driven = *driven;
        self.check_drivers(now);
    }

    fn sense(&mut self, now: Ps) -> Sensed {
        let mut sensed = Sensed::default();
        for (pin, level) in [
            (TURRET_RDY_INIT, self.fpga.port.init(now)),
            (TURRET_RDY_DONE, self.fpga.port.done(now)),
            (TURRET_RDY_FLASH, self.flash.ready(now)),
        ] {
            sensed.rdy &= !(u8::from(!level) << pin);
        }
        if !self.selects.spi_ss && !self.fpga.spi_miso() {
            sensed.port[PORT_C] &= !(1 << TURRET_PC_SPI_MISO);
        }
        let (byte, since) = self.bus(now);
        let byte = if self.drivers.1 && now < since + SAMPLE_SETUP_PS { !byte } else { byte };
        sensed.fd = 0xFF00 | u16::from(byte);
        sensed
    }

    /// The slice ends when streaming begins or ends, so that no word is written too early or too late.
    fn end_slice(&mut self) -> bool {
        std::mem::take(&mut self.stream_changed)
    }

    fn i2c_start(&mut self, now: Ps, address_and_direction: u8) -> bool {
        let clocked = self.fpga.function(now).is_some();
        let camera = self.cameras.i2c_start(now, address_and_direction, clocked);
        self.eeprom.i2c_start(now, address_and_direction) || camera
    }

    fn i2c_write(&mut self, now: Ps, byte: u8) -> bool {
        if self.cameras.is_addressed() {
            return self.cameras.i2c_write(now, byte);
        }
        self.eeprom.i2c_write(now, byte)
    }

    fn i2c_read(&mut self, now: Ps, acknowledge: bool) -> u8 {
        if self.cameras.is_addressed() {
            return self.cameras.i2c_read();
        }
        self.eeprom.i2c_read(now, acknowledge)
    }

    fn i2c_stop(&mut self, now: Ps) {
        self.cameras.i2c_stop();
        self.eeprom.i2c_stop(now);
    }

    fn i2c_clock_held(&mut self, _now: Ps) -> bool {
        self.cameras.clock_held
    }
}

impl TurretBus for Turret {
    fn select(&mut self, now: Ps, pcs: u8) {
        self.fpga.select(now, u32::from(pcs) == BOARD_PCS_TURRET);
    }

    fn exchange(&mut self, now: Ps, word: u16, bits: u8) -> u16 {
        self.fpga.exchange(now, word, bits)
    }

    fn irq_pins(&mut self, now: Ps) -> u8 {
        !(u8::from(!self.fpga.attention(now)) << BOARD_TURRET_ATTENTION_IRQ)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use common_sys::constants::{FPGA_ID_VALUE, FPGA_REG_ID, TURRET_EEPROM_ADDRESS};
    use common_sys::link::report_decode;
    use common_sys::vision::{HEIGHT, WIDTH};
    use sim::{Clock, MS};
    use virtex::bitstream::{Options, XCV300E_BYTES, make};
    use virtex::config::{CLEAR_PS, Violation};
    use virtex::design::Function;

    use crate::flash::SIZE;

    const IFCLK: Clock = Clock::new(48_000_000);
    const CCLK: u8 = 1 << TURRET_CTL_CCLK;
    const OE: u8 = 1 << TURRET_CTL_FLASH_OE;
    const WE: u8 = 1 << TURRET_CTL_FLASH_WE;
    const PROG: u8 = 1 << TURRET_PA_PROG;
    const CE: u8 = 1 << TURRET_PA_FLASH_CE;
    const CS: u8 = 1 << TURRET_PA_FPGA_CS;
    const SS: u8 = 1 << TURRET_PA_SPI_SS;

    /// Stands for the FX2: changes pins at edges of IFCLK.
    struct Bench {
        turret: Turret,
        edge: u64,
        driven: Driven,
    }

    impl Bench {
        /// Supplies have settled, all pins driven, everything deselected.
        fn new(flash: Flash, eeprom: &[u8]) -> Self {
            let eeprom = Eeprom::large(TURRET_EEPROM_ADDRESS as u8, eeprom).expect("it fits");
            let turret = Turret::new(flash, eeprom);
            let driven = Driven {
                port: [0xFF, 0xFF, 0, 0, 0],
                port_enable: [PROG | CE | CS | SS, 0, 0, 0xFF, 0x7F],
                ctl: OE | WE,
                ctl_enable: 0x3F,
                gpifadr_enable: 0x1FF,
                ..Driven::default()
            };
            let edge = IFCLK.edge_at_or_after(3 * MS);
            let mut bench = Self { turret, edge, driven };
            bench.states(1, |_| {});
            bench
        }

        fn with_bitstream(function: Function) -> Self {
            let mut image = make(function, &Options::default());
            image.resize(SIZE, 0xFF);
            Self::new(Flash::from_image(&image).expect("it fills the chip"), &[])
        }

        fn now(&self) -> Ps {
            IFCLK.edge(self.edge)
        }

        /// Change pins now and stay so for `count` states.
        fn states(&mut self, count: u64, change: impl FnOnce(&mut Driven)) {
            let before = self.driven;
            change(&mut self.driven);
            if self.driven != before || self.turret.driven == Driven::default() {
                let driven = self.driven;
                self.turret.drive(self.now(), &driven);
            }
            self.edge += count;
        }

        fn port_a(&mut self, level: bool, bits: u8) {
            self.states(4, |pins| {
                pins.port[PORT_A] =
                    if level { pins.port[PORT_A] | bits } else { pins.port[PORT_A] & !bits };
            });
        }

        fn set_address(pins: &mut Driven, address: u32) {
            pins.gpifadr = (address & 0x1FF) as u16;
            pins.port[PORT_D] = (address >> 9) as u8;
            pins.port[PORT_E] = (address >> 17) as u8;
        }

        fn ready(&mut self, pin: u32) -> bool {
            let now = self.now();
            self.turret.sense(now).rdy >> pin & 1 != 0
        }

        fn prog_pulse(&mut self) {
            self.port_a(false, PROG);
            self.edge += 100;
            self.port_a(true, PROG);
            self.edge = IFCLK.edge_at_or_after(self.now() + CLEAR_PS);
            assert!(self.ready(TURRET_RDY_INIT));
        }

        /// Bytes from flash address 0 on go to the FPGA in flight: `low` states with CCLK low, one
        /// with CCLK high.
        fn stream(&mut self, bytes: usize, low: u64) {
            self.prog_pulse();
            self.port_a(false, CE | CS);
            self.states(4, |pins| pins.ctl &= !OE);
            for address in 0..bytes {
                self.states(low, |pins| {
                    Self::set_address(pins, address as u32);
                    pins.ctl &= !CCLK;
                });
                self.states(1, |pins| pins.ctl |= CCLK);
            }
            self.states(4, |pins| pins.ctl = OE | WE);
            self.port_a(true, CE | CS);
        }

        fn write_flash(&mut self, address: u32, data: u8) {
            self.port_a(false, CE);
            self.states(1, |pins| {
                Self::set_address(pins, address);
                pins.fd = u16::from(data);
                pins.fd_enable = 0xFF;
            });
            self.states(3, |pins| pins.ctl &= !WE);
            self.states(1, |pins| pins.ctl |= WE);
            self.states(1, |pins| pins.fd_enable = 0);
            self.port_a(true, CE);
        }

        fn read_flash(&mut self, address: u32, states: u64) -> u8 {
            self.port_a(false, CE);
            self.states(states, |pins| {
                Self::set_address(pins, address);
                pins.ctl &= !OE;
            });
            let now = self.now();
            let byte = self.turret.sense(now).fd as u8;
            self.states(4, |pins| pins.ctl |= OE);
            self.port_a(true, CE);
            byte
        }
    }

    #[test]
    fn five_states_a_byte_configure_the_fpga_from_flash() {
        let mut bench = Bench::with_bitstream(Function::Soccer);
        let begin = bench.now() + CLEAR_PS;
        bench.stream(XCV300E_BYTES, 4);
        assert!(bench.ready(TURRET_RDY_DONE));
        assert_eq!(bench.turret.report(), Vec::<String>::new());
        let now = bench.now();
        assert_eq!(bench.turret.fpga.function(now), Some(Function::Soccer));
        assert!((24 * MS..25 * MS).contains(&(now - begin)), "{} us", (now - begin) / US);
    }

    #[test]
    fn four_states_a_byte_are_too_fast_for_the_flash() {
        let mut bench = Bench::with_bitstream(Function::Soccer);
        bench.stream(XCV300E_BYTES, 3);
        assert!(!bench.ready(TURRET_RDY_DONE));
        let violations = bench.turret.fpga.port.diagnostics();
        assert_eq!(violations.count(Violation::DataSetup), XCV300E_BYTES as u64 - 1);
    }

    #[test]
    fn an_address_that_changes_with_cclk_breaks_the_hold_time() {
        let mut bench = Bench::with_bitstream(Function::Soccer);
        bench.prog_pulse();
        bench.port_a(false, CE | CS);
        bench.states(8, |pins| pins.ctl &= !OE);
        for address in 1..100 {
            bench.states(8, |pins| pins.ctl &= !CCLK);
            bench.states(8, |pins| {
                pins.ctl |= CCLK;
                Bench::set_address(pins, address);
            });
        }
        let violations = bench.turret.fpga.port.diagnostics();
        assert_eq!(violations.count(Violation::DataHold), 99);
    }

    #[test]
    fn a_damaged_byte_in_flash_shows_as_a_check_sum_error() {
        let mut bench = Bench::with_bitstream(Function::Soccer);
        bench.write_flash(0xAAA, 0xAA);
        bench.write_flash(0x555, 0x55);
        bench.write_flash(0xAAA, 0xA0);
        bench.write_flash(150_000, 0x00);
        assert!(!bench.ready(TURRET_RDY_FLASH));
        bench.edge = IFCLK.edge_at_or_after(bench.turret.flash.next_event().expect("it is busy"));
        assert!(bench.ready(TURRET_RDY_FLASH));
        bench.stream(XCV300E_BYTES, 4);
        assert!(!bench.ready(TURRET_RDY_DONE));
        assert!(!bench.ready(TURRET_RDY_INIT));
    }

    #[test]
    fn every_address_pin_counts() {
        let mut image = vec![0xFF; SIZE];
        for bit in 0..24 {
            image[1 << bit] = bit;
        }
        let mut bench = Bench::new(Flash::from_image(&image).expect("it fills the chip"), &[]);
        for bit in 0..24 {
            assert_eq!(bench.read_flash(1 << bit, 5), bit as u8, "A{bit}");
        }
        assert_eq!(bench.turret.report(), Vec::<String>::new());
        // 70 ns, late address pins and the FX2's set-up time need five states of 20.8 ns.
        assert_ne!(bench.read_flash(1 << 3, 4), 3);
    }

    #[test]
    fn the_flash_answers_its_query_over_the_bus() {
        let mut bench = Bench::new(Flash::erased(), &[]);
        bench.write_flash(0xAA, 0x98);
        assert_eq!([0x20, 0x22, 0x24].map(|at| bench.read_flash(at, 5)), *b"QRY");
        assert_eq!(bench.turret.report(), Vec::<String>::new());
    }

    #[test]
    fn two_chips_on_the_bus_are_noticed() {
        let mut bench = Bench::new(Flash::erased(), &[]);
        bench.port_a(false, CE);
        bench.states(8, |pins| pins.ctl &= !OE);
        bench.states(1, |pins| pins.ctl |= OE);
        bench.states(8, |pins| pins.fd_enable = 0xFF);
        assert_eq!(bench.turret.diagnostics().count(Trouble::TurnAround), 1);
        bench.states(8, |pins| pins.ctl &= !OE);
        assert_eq!(bench.turret.diagnostics().count(Trouble::FlashContention), 1);
        bench.states(1, |pins| pins.port_enable[PORT_D] = 0x7F);
        assert_eq!(bench.turret.diagnostics().count(Trouble::FloatingAddress), 1);
    }

    #[test]
    fn a_byte_that_nobody_drives_is_noticed() {
        let mut bench = Bench::new(Flash::erased(), &[]);
        bench.prog_pulse();
        bench.states(4, |pins| pins.ctl &= !CCLK);
        bench.states(1, |pins| pins.ctl |= CCLK);
        assert_eq!(bench.turret.diagnostics().list(), [], "CS# is high");
        bench.port_a(false, CS);
        bench.states(4, |pins| pins.ctl &= !CCLK);
        bench.states(1, |pins| pins.ctl |= CCLK);
        assert_eq!(bench.turret.diagnostics().count(Trouble::FloatingData), 1);
    }

    #[test]
    fn port_c_is_spi_while_ss_is_low() {
        let mut bench = Bench::with_bitstream(Function::Capture);
        bench.stream(XCV300E_BYTES, 4);
        let [sck, mosi] = [TURRET_PC_SPI_SCK, TURRET_PC_SPI_MOSI].map(|pin| 1_u8 << pin);
        bench.states(4, |pins| {
            pins.gpifadr_enable = 0;
            pins.port_enable[PORT_C] = sck | mosi;
        });
        bench.port_a(false, SS);
        let mut read = 0_u32;
        for bit in (0..24).rev() {
            let out = (FPGA_REG_ID << 16 >> bit & 1) as u8 * mosi;
            bench.states(8, |pins| pins.port[PORT_C] = out);
            let now = bench.now();
            let miso = bench.turret.sense(now).port[PORT_C] >> TURRET_PC_SPI_MISO & 1;
            read = read << 1 | u32::from(miso);
            bench.states(8, |pins| pins.port[PORT_C] = out | sck);
        }
        bench.port_a(true, SS);
        assert_eq!(read & 0xFFFF, FPGA_ID_VALUE);
        assert_eq!(bench.turret.report(), Vec::<String>::new());
    }

    #[test]
    fn the_base_sees_attention_and_reads_the_report() {
        let mut bench = Bench::with_bitstream(Function::Soccer);
        bench.stream(XCV300E_BYTES, 4);
        let eye = vec![0; WIDTH * HEIGHT];
        let end = 100 * MS;
        let mid_exposure = end - 10 * MS;
        let frame = Frame { end, mid_exposure, left: &eye, right: &eye, flags: 0 };
        bench.turret.frame(&frame);
        assert_eq!(bench.turret.irq_pins(end), 0xFF);
        let now = bench.turret.next_event(end).expect("a report is under way");
        assert_eq!(bench.turret.irq_pins(now), !(1 << 4));
        bench.turret.select(now, 0x0E);
        assert_eq!(bench.turret.exchange(now, 0, 16), 0xFFFF, "that is the ADC");
        bench.turret.select(now, BOARD_PCS_TURRET as u8);
        let mut wire = [0; REPORT_SIZE];
        for place in wire.chunks_exact_mut(2) {
            place.copy_from_slice(&bench.turret.exchange(now, 0, 16).to_be_bytes());
        }
        bench.turret.select(now, 0x0F);
        assert!(report_decode(&wire).is_some());
        assert_eq!(bench.turret.take_reports(), [wire]);
        assert_eq!(bench.turret.irq_pins(now), 0xFF);
    }

    #[test]
    fn the_eeprom_answers_at_its_address_only() {
        let mut bench = Bench::new(Flash::erased(), &[0xC2, 0x09]);
        let turret = &mut bench.turret;
        assert!(!turret.i2c_start(0, 0x50 << 1));
        turret.i2c_stop(0);
        assert!(turret.i2c_start(0, 0x51 << 1));
        assert!(turret.i2c_write(0, 0) && turret.i2c_write(0, 1));
        assert!(turret.i2c_start(0, 0x51 << 1 | 1));
        assert_eq!(turret.i2c_read(0, false), 0x09);
    }

    #[test]
    fn a_power_cycle_takes_the_design_but_not_the_flash() {
        let mut bench = Bench::with_bitstream(Function::Soccer);
        bench.stream(XCV300E_BYTES, 4);
        assert!(bench.ready(TURRET_RDY_DONE));
        let now = bench.now();
        bench.turret.power_cycle(now);
        assert!(!bench.ready(TURRET_RDY_DONE));
        assert!(!bench.ready(TURRET_RDY_INIT));
        bench.edge = IFCLK.edge_at_or_after(now + 3 * MS);
        bench.stream(XCV300E_BYTES, 4);
        assert!(bench.ready(TURRET_RDY_DONE));
    }
}
