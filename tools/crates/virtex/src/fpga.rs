//! The FPGA as the turret sees it: configuration port, registers, frames in, reports out.
//!
//! What a design does is defined bit for bit by the kernels in `common/vision`; here they are only
//! called, and their report is held back for as long as the hardware would need.
//!
//! Unconfigured, or with a design that the model does not know, the FPGA is a piece of plastic: it
//! never asks for attention and whoever reads it reads ones.
//!
//! What the streaming pins show is a matter of [`crate::stream`].

use common_sys::constants as c;
use common_sys::link::{
    self, REGISTER_READ_BYTES, REGISTER_WRITE_BYTES, REPORT_SIZE, Register, register_read_encode,
    register_write_decode, registers, report_encode,
};
use common_sys::vision::{ExposureWatch, EyeParams, HEIGHT, PARAM_COUNT, WIDTH, detect, halve};
use sim::{Clock, MS, Ps, US};

use crate::camera_table;
use crate::config::ConfigPort;
use crate::design::Function;
use crate::part::XCV300E;
use crate::stream::{Source, Stream, Taken};

/// The clock of the design: twice the cameras' greatest pixel clock of 25 MHz. An assumption.
pub const FPGA_CLOCK: Clock = Clock::new(50_000_000);

/// FPGA clocks from the last pixel of a frame until its report is ready.
///
/// Block matching is what takes time. One sequential unit for 8x8 sums of absolute differences
/// needs 8 clocks a candidate (Yosys: 643 LUTs). At most it has to match four things (two edges of
/// the goal, opponent, ball) over 128 disparities in 5 rows each; we let it begin only when the
/// frame is over. 512 clocks remain for sub-pixel fits and for putting the report together.
pub const REPORT_CLOCKS: u64 = 4 * 128 * 5 * 8 + 512;

/// Unit of the times in a report.
const REPORT_TICK: Ps = 100 * US;

/// 16-bit words of a report on the turret bus.
const REPORT_WORDS: usize = REPORT_SIZE / 2;

const REGISTERS: usize = c::FPGA_REG_COUNT as usize;

/// An eye counts as alive for so long after a frame.
const ALIVE: Ps = 250 * MS;

/// A pair of frames at the moment its last row is in.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// End of the last row.
    pub end: Ps,
    /// Middle of the exposure.
    pub mid_exposure: Ps,
    /// The left eye: 320 * 240 or 640 * 480 RGB565 pixels, row by row.
    pub left: &'a [u16],
    /// The right eye.
    pub right: &'a [u16],
    /// `REPORT_FRAME_TORN`, as the cameras are.
    pub flags: u16,
}

type Wire = [u8; REPORT_SIZE];

/// A transfer over the turret bus, from select to deselect.
#[derive(Clone, Debug)]
struct Transfer {
    /// What is being read: the report that was ready when the base selected us.
    wire: Option<Wire>,
    words: usize,
    received: [u8; REGISTER_WRITE_BYTES],
    /// The answer to a register read, which takes the report's place.
    answer: Option<[u8; REGISTER_READ_BYTES]>,
}

/// A transfer over SPI, from SS# low to SS# high.
#[derive(Clone, Copy, Debug, Default)]
struct Spi {
    selected: bool,
    sck: bool,
    bits: u32,
    shift_in: u32,
    value: u16,
    miso: bool,
}

/// When a report went to the base.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Delivery {
    /// It was ready, and attention asked for.
    pub ready: Ps,
    /// Its last word was read.
    pub read: Ps,
}

/// The FPGA.
#[derive(Clone, Debug)]
pub struct Fpga {
    /// The configuration port. Its pins may be moved at any time.
    pub port: ConfigPort,
    generation: u64,
    function: Option<Function>,
    started: Ps,
    registers: [u16; REGISTERS],
    sequence: u8,
    /// A report under way, and when it is ready.
    coming: Option<(Ps, Wire)>,
    ready: Option<Wire>,
    transfer: Option<Transfer>,
    /// Since when the report that is ready has been.
    ready_since: Ps,
    delivered: Vec<Wire>,
    deliveries: Vec<Delivery>,
    spi: Spi,
    /// The way to USB.
    pub stream: Stream,
    /// When each eye's last frame ended, and whether it was torn.
    eyes: [Option<(Ps, bool)>; 2],
    exposure: ExposureWatch,
}

impl Fpga {
    /// At power-on. `cclk_late`: see [`ConfigPort::new`].
    pub fn new(now: Ps, cclk_late: Ps) -> Self {
        Self {
            port: ConfigPort::new(&XCV300E, now, cclk_late),
            generation: 0,
            function: None,
            started: now,
            registers: reset_registers(None),
            sequence: 0,
            coming: None,
            ready: None,
            transfer: None,
            ready_since: now,
            delivered: Vec::new(),
            deliveries: Vec::new(),
            spi: Spi { miso: true, ..Spi::default() },
            stream: Stream::default(),
            eyes: [None; 2],
            exposure: ExposureWatch::default(),
        }
    }

    /// What the running design does.
    pub fn function(&mut self, now: Ps) -> Option<Function> {
        self.settle(now);
        self.function
    }

    /// Value of a register, or None while no known design runs or if there is no such register.
    pub fn register(&mut self, now: Ps, address: u8) -> Option<u16> {
        self.settle(now);
        self.function?;
        self.read_register(now, address)
    }

    /// Frames per second that the design asks of the cameras; None while none runs.
    pub fn frame_rate(&mut self, now: Ps) -> Option<u16> {
        self.register(now, c::FPGA_REG_FRAME_RATE as u8)
    }

    /// Whether the streaming pins drive FD[15:0].
    pub fn streams(&mut self, now: Ps) -> bool {
        self.settle(now);
        self.stream.drives()
    }

    /// Whether it takes frames of 640x480.
    pub fn takes_large(&mut self, now: Ps) -> bool {
        self.register(now, c::FPGA_REG_FORMAT as u8) == Some(c::FPGA_FORMAT_640X480 as u16)
    }

    /// A camera's frame has ended: of eye 0 (left) or 1, with all its rows and columns or `torn`.
    pub fn eye_ended(&mut self, now: Ps, eye: usize, torn: bool) {
        self.eyes[eye] = Some((now, torn));
    }

    /// Both cameras have delivered their last row. False if the pair is not taken: it is of another
    /// size than the design expects, or no design runs.
    ///
    /// # Panics
    /// If the eyes have not the same number of pixels, that of one of the formats.
    pub fn frame(&mut self, frame: &Frame<'_>) -> bool {
        self.settle(frame.end);
        let Some(function) = self.function else { return false };
        let large = frame.left.len() != WIDTH * HEIGHT;
        let fits = self.takes_large(frame.end) == large;
        if !fits || u32::from(frame.flags) & c::REPORT_FRAME_TORN != 0 {
            self.count(c::FPGA_REG_TORN);
        }
        if !fits {
            return false;
        }
        self.count(c::FPGA_REG_FRAME_COUNT);
        let report = (function == Function::Soccer).then(|| self.report(frame, large));
        if let Some(report) = report {
            self.coming = Some(report);
        }
        if self.stream.drives() {
            self.pass_on(frame, large, report);
        }
        true
    }

    fn count(&mut self, register: u32) {
        let count = &mut self.registers[register as usize];
        *count = count.wrapping_add(1);
    }

    /// What the detectors make of a pair, and when they have done so.
    fn report(&mut self, frame: &Frame<'_>, large: bool) -> (Ps, Wire) {
        let params = self.eye_params();
        let halved = large.then(|| [frame.left, frame.right].map(halve));
        let [left, right] = match &halved {
            Some([left, right]) => [left.as_slice(), right.as_slice()],
            None => [frame.left, frame.right],
        };
        let mut report = detect(left, right, &params);
        if self.exposure.is_unsettled(left, right) {
            report.flags |= c::REPORT_EXPOSURE_UNSETTLED as u16;
        }
        let ready = frame.end + FPGA_CLOCK.edge(REPORT_CLOCKS);
        report.function = Function::Soccer.code();
        report.sequence = self.sequence;
        report.flags |= frame.flags;
        report.exposure_time = self.exposure_time(frame.mid_exposure);
        report.delay = ((ready - frame.end) / REPORT_TICK).min(255) as u8;
        self.sequence = self.sequence.wrapping_add(1);
        (ready, report_encode(&report))
    }

    /// The pair goes to the stream.
    fn pass_on(&mut self, frame: &Frame<'_>, large: bool, report: Option<(Ps, Wire)>) {
        let params = self.eye_params();
        let torn = u32::from(frame.flags) & c::REPORT_FRAME_TORN != 0;
        let flags = if torn { c::STREAM_FLAG_TORN } else { 0 }
            | if report.is_some() { c::STREAM_FLAG_REPORT } else { 0 };
        let (width, height) = size(large);
        self.stream.take(&Taken {
            ready: report.map_or(frame.end, |(ready, _)| ready),
            exposure: frame.mid_exposure.saturating_sub(self.started),
            width,
            height,
            flags: flags as u8,
            params,
            report: report.map_or([0; REPORT_SIZE], |(_, wire)| wire),
            pixels: [frame.left, frame.right],
        });
    }

    /// Level of the attention line: low from when a report is ready until it has been read.
    pub fn attention(&mut self, now: Ps) -> bool {
        self.settle(now);
        self.ready.is_none()
    }

    /// When the attention line or INIT# changes by itself next.
    pub fn next_event(&self, now: Ps) -> Option<Ps> {
        let report = self.coming.as_ref().map(|(ready, _)| *ready);
        report.into_iter().chain(self.port.next_event(now)).min()
    }

    /// The base selects the turret (`true`) or lets go of it.
    pub fn select(&mut self, now: Ps, selected: bool) {
        self.settle(now);
        if selected == self.transfer.is_some() {
            return;
        }
        let wire = self.ready;
        self.transfer =
            selected.then_some(Transfer { wire, words: 0, received: [0; _], answer: None });
    }

    /// The base sends `word` of `bits` bits and gets the same number back, right-aligned. A report
    /// comes in 16 words of 16 bits after select; beyond it, in other sizes, without a report or
    /// without select come ones. If the first word reads a register, the answer comes instead.
    pub fn exchange(&mut self, now: Ps, word: u16, bits: u8) -> u16 {
        self.settle(now);
        let ones = u16::MAX >> (16 - u32::from(bits.clamp(1, 16)));
        if self.transfer.is_none() || self.function.is_none() || bits != 16 {
            return ones;
        }
        if let Some(word) = self.read_by_base(now, word) {
            return word;
        }
        let Some(transfer) = &mut self.transfer else { return ones };
        if transfer.words >= REPORT_WORDS {
            return ones;
        }
        let at = 2 * transfer.words;
        transfer.words += 1;
        if let Some(place) = transfer.received.get_mut(at..at + 2) {
            place.copy_from_slice(&word.to_be_bytes());
        }
        let received = (at + 2 == REGISTER_WRITE_BYTES).then_some(transfer.received);
        let wire = transfer.wire;
        let last = transfer.words == REPORT_WORDS;
        if let Some((address, value)) = received.and_then(|bytes| register_write_decode(&bytes)) {
            // The way to the FX2 is the FX2's.
            if u32::from(address) != c::FPGA_REG_STREAM {
                self.write_register(now, address, value);
            }
        }
        if last {
            if wire.is_some() {
                self.deliveries.push(Delivery { ready: self.ready_since, read: now });
            }
            self.delivered.extend(wire);
            // A newer report that came meanwhile keeps its claim to attention.
            if wire == self.ready {
                self.ready = None;
            }
        }
        wire.map_or(ones, |wire| u16::from_be_bytes([wire[at], wire[at + 1]]))
    }

    /// A transfer that reads a register: what its words after the first get.
    fn read_by_base(&mut self, now: Ps, word: u16) -> Option<u16> {
        let first = self.transfer.as_ref()?.words == 0;
        let reads = u32::from(word) & (c::REGISTER_WORD_READ | c::REGISTER_WORD_WRITE)
            == c::REGISTER_WORD_READ;
        if first && reads {
            let address = (word & 0x7F) as u8;
            let value = self.read_register(now, address).unwrap_or(u16::MAX);
            let transfer = self.transfer.as_mut()?;
            transfer.answer = Some(register_read_encode(address, value));
            transfer.words = 1;
            return Some(u16::MAX);
        }
        let transfer = self.transfer.as_mut()?;
        let answer = transfer.answer?;
        let at = 2 * transfer.words;
        transfer.words = (transfer.words + 1).min(REGISTER_READ_BYTES);
        Some(answer.get(at..at + 2).map_or(u16::MAX, |b| u16::from_be_bytes([b[0], b[1]])))
    }

    /// The reports that the base has read to their end since the last call.
    pub fn take_reports(&mut self) -> Vec<[u8; REPORT_SIZE]> {
        self.deliveries.clear();
        std::mem::take(&mut self.delivered)
    }

    /// When the reports came that [`Fpga::take_reports`] is going to return, in its order. A report
    /// that was overtaken by the next one while it was read counts from that one's time.
    pub fn deliveries(&self) -> &[Delivery] {
        &self.deliveries
    }

    /// Levels of the register port's pins (SPI mode 0). Call on every change.
    pub fn spi_pins(&mut self, now: Ps, ss_low: bool, sck: bool, mosi: bool) {
        self.settle(now);
        if !ss_low || self.function.is_none() {
            self.spi = Spi { miso: true, sck, ..Spi::default() };
            return;
        }
        if !self.spi.selected {
            self.spi = Spi { selected: true, miso: true, sck, ..Spi::default() };
            return;
        }
        match (self.spi.sck, sck) {
            (false, true) => self.spi_sample(now, mosi),
            (true, false) => {
                // The value follows the address byte, most significant bit first.
                self.spi.miso = match self.spi.bits {
                    8..24 => self.spi.value >> (23 - self.spi.bits) & 1 != 0,
                    _ => true,
                };
            }
            _ => {}
        }
        self.spi.sck = sck;
    }

    /// Level of MISO: ones unless a value is being read.
    pub fn spi_miso(&self) -> bool {
        self.spi.miso
    }

    fn spi_sample(&mut self, now: Ps, mosi: bool) {
        self.spi.shift_in = self.spi.shift_in << 1 | u32::from(mosi);
        self.spi.bits = (self.spi.bits + 1).min(25);
        let write = |byte: u32| byte & c::FPGA_SPI_WRITE != 0;
        match self.spi.bits {
            8 if !write(self.spi.shift_in) => {
                let address = (self.spi.shift_in & 0x7F) as u8;
                self.spi.value = self.read_register(now, address).unwrap_or(0xFFFF);
            }
            8 => self.spi.value = 0xFFFF,
            24 if write(self.spi.shift_in >> 16) => {
                let address = (self.spi.shift_in >> 16 & 0x7F) as u8;
                self.write_register(now, address, self.spi.shift_in as u16);
            }
            _ => {}
        }
    }

    fn read_register(&self, now: Ps, address: u8) -> Option<u16> {
        let [session, sent, lost] = self.stream.counts();
        Some(match u32::from(address) {
            c::FPGA_REG_STREAM => self.stream.state(),
            c::FPGA_REG_SESSION => session,
            c::FPGA_REG_SENT => sent,
            c::FPGA_REG_LOST => lost,
            c::FPGA_REG_EYES => self.eyes_register(now),
            c::FPGA_REG_CAMERA_TABLE..c::FPGA_REG_COUNT => self.registers[usize::from(address)],
            _ => self.registers[usize::from(find(address)?.address)],
        })
    }

    fn eyes_register(&self, now: Ps) -> u16 {
        let bits = |eye: Option<(Ps, bool)>| {
            let (alive, torn) = eye.map_or((false, false), |(end, torn)| (now - end < ALIVE, torn));
            let alive = if alive { c::FPGA_EYES_ALIVE } else { 0 };
            alive | if torn { c::FPGA_EYES_TORN } else { 0 }
        };
        (bits(self.eyes[0]) | bits(self.eyes[1]) << c::FPGA_EYES_RIGHT_SHIFT) as u16
    }

    /// Writes to read-only and missing registers, and of values out of range, change nothing.
    fn write_register(&mut self, now: Ps, address: u8, value: u16) {
        let taken = match u32::from(address) {
            c::FPGA_REG_STREAM => {
                let source = self.source();
                return self.stream.control(now, value, source);
            }
            c::FPGA_REG_SOURCE if self.function != Some(Function::Capture) => false,
            c::FPGA_REG_CAMERA_TABLE..c::FPGA_REG_COUNT => true,
            _ => find(address)
                .and_then(|register| register.range)
                .is_some_and(|(low, high)| (low..=high).contains(&value)),
        };
        if taken {
            self.registers[usize::from(address)] = value;
        }
    }

    /// What the registers want streamed.
    fn source(&self) -> Source {
        if u32::from(self.registers[c::FPGA_REG_SOURCE as usize]) != c::FPGA_SOURCE_PATTERN {
            return Source::Cameras;
        }
        let format = u32::from(self.registers[c::FPGA_REG_FORMAT as usize]);
        let (width, height) = size(format == c::FPGA_FORMAT_640X480);
        Source::Pattern { width, height }
    }

    fn eye_params(&self) -> EyeParams {
        let mut bytes = [0; PARAM_COUNT];
        for (byte, parameter) in bytes.iter_mut().zip(parameters()) {
            // The ranges of these registers are those of a byte.
            *byte = self.registers[usize::from(parameter.address)] as u8;
        }
        EyeParams::from_bytes(&bytes)
    }

    /// When the design came to life: its own time begins then.
    pub fn started(&self) -> Ps {
        self.started
    }

    /// `at` as a report says it: 100 µs units of the design's own time, which begins when it does.
    pub fn exposure_time(&self, at: Ps) -> u16 {
        (at.saturating_sub(self.started) / REPORT_TICK) as u16
    }

    /// Let happen what time and configuration bring.
    fn settle(&mut self, now: Ps) {
        let generation = self.port.generation(now);
        if generation != self.generation {
            self.generation = generation;
            self.restart(now);
        }
        if let Some((ready, wire)) = self.coming.take_if(|(ready, _)| *ready <= now) {
            self.ready = Some(wire);
            self.ready_since = ready;
        }
    }

    /// A design comes to life or dies: nothing of the one before remains.
    fn restart(&mut self, now: Ps) {
        self.function = self.port.design().map(|design| design.function);
        self.started = now;
        self.registers = reset_registers(self.function);
        self.sequence = 0;
        self.coming = None;
        self.ready = None;
        self.transfer = None;
        self.spi = Spi { miso: true, ..Spi::default() };
        self.stream = Stream::default();
        self.eyes = [None; 2];
        self.exposure = ExposureWatch::default();
    }
}

/// The register at this address, if it has a name.
fn find(address: u8) -> Option<&'static Register> {
    registers().iter().find(|register| register.address == address)
}

/// The registers that are parameters of the detectors.
fn parameters() -> impl Iterator<Item = &'static Register> {
    registers().iter().filter(|register| register.is_param)
}

fn reset_registers(function: Option<Function>) -> [u16; REGISTERS] {
    let mut registers = [0; REGISTERS];
    for register in link::registers() {
        registers[usize::from(register.address)] = register.reset;
    }
    registers[c::FPGA_REG_FUNCTION as usize] = function.map_or(0, |f| u16::from(f.code()));
    let tables = &mut registers[c::FPGA_REG_CAMERA_TABLE as usize..];
    let places = tables.chunks_exact_mut(c::FPGA_CAMERA_TABLE_ENTRIES as usize);
    for (place, table) in places.zip(camera_table::ALL) {
        place.fill(c::FPGA_CAMERA_TABLE_END as u16);
        place[..table.len()].copy_from_slice(table);
    }
    registers
}

/// Pixels of a row, and rows.
fn size(large: bool) -> (u16, u16) {
    let scale = if large { 2 } else { 1 };
    (scale * WIDTH as u16, scale * HEIGHT as u16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bitstream::{Options, make, make_partial};
    use crate::config::POWER_ON_PS;
    use common_sys::constants::{
        FPGA_ID_VALUE, FPGA_REG_FRAME_COUNT, FPGA_REG_FRAME_RATE, FPGA_REG_FUNCTION, FPGA_REG_ID,
        FPGA_REG_SEARCH_MAX, FPGA_REG_STREAM, REPORT_BALL, REPORT_FRAME_TORN,
    };
    use common_sys::link::{Report, register_write_encode, report_decode};
    use common_sys::vision::rgb565;
    use sim::NS;

    const GREEN: u16 = rgb565(40, 120, 40);
    const YELLOW: u16 = rgb565(230, 220, 40);
    const FIRST_FRAME: Ps = 1_000 * MS;

    fn send(fpga: &mut Fpga, now: &mut Ps, bytes: &[u8]) {
        fpga.port.set_selected(*now, true);
        for &byte in bytes {
            *now += 100 * NS;
            fpga.port.cclk_rises(*now, byte, *now - 50 * NS);
        }
    }

    fn configured(function: Function) -> Fpga {
        let mut fpga = Fpga::new(0, 0);
        let mut now = POWER_ON_PS;
        send(&mut fpga, &mut now, &make(function, &Options::default()));
        assert_eq!(fpga.function(now), Some(function));
        fpga
    }

    /// The ball of the paper's scene as a yellow disc: 92 px wide, in the left eye `disparity`
    /// further right.
    fn ball(disparity: usize) -> [Vec<u16>; 2] {
        [disparity, 0].map(|shift| {
            let mut pixels = vec![GREEN; WIDTH * HEIGHT];
            for (y, row) in pixels.chunks_exact_mut(WIDTH).enumerate() {
                for (x, pixel) in row.iter_mut().enumerate() {
                    if (x.abs_diff(146 + shift)).pow(2) + y.abs_diff(148).pow(2) <= 46 * 46 {
                        *pixel = YELLOW;
                    }
                }
            }
            pixels
        })
    }

    fn show(fpga: &mut Fpga, end: Ps) {
        let [left, right] = ball(69);
        let flags = REPORT_FRAME_TORN as u16;
        let mid_exposure = end - 20 * MS;
        fpga.frame(&Frame { end, mid_exposure, left: &left, right: &right, flags });
    }

    fn read_words(fpga: &mut Fpga, now: Ps, words: &[u16; REPORT_WORDS]) -> Wire {
        fpga.select(now, true);
        let mut wire = [0; REPORT_SIZE];
        for (place, &word) in wire.chunks_exact_mut(2).zip(words) {
            place.copy_from_slice(&fpga.exchange(now, word, 16).to_be_bytes());
        }
        fpga.select(now, false);
        wire
    }

    fn read(fpga: &mut Fpga, now: Ps) -> Option<Report> {
        report_decode(&read_words(fpga, now, &[0; REPORT_WORDS]))
    }

    #[test]
    fn unconfigured_it_is_silent_and_reads_as_ones() {
        let mut fpga = Fpga::new(0, 0);
        show(&mut fpga, FIRST_FRAME);
        assert!(fpga.attention(FIRST_FRAME + MS));
        assert_eq!(read_words(&mut fpga, FIRST_FRAME + MS, &[0; 16]), [0xFF; REPORT_SIZE]);
        assert_eq!(fpga.register(FIRST_FRAME, 0), None);
        assert_eq!(fpga.next_event(FIRST_FRAME), None);
    }

    #[test]
    fn a_report_comes_after_its_delay_and_attention_ends_when_it_is_read() {
        let mut fpga = configured(Function::Soccer);
        let started = fpga.started;
        show(&mut fpga, FIRST_FRAME);
        let ready = FIRST_FRAME + FPGA_CLOCK.edge(REPORT_CLOCKS);
        assert_eq!(fpga.next_event(FIRST_FRAME), Some(ready));
        assert!(fpga.attention(ready - 1));
        assert!(!fpga.attention(ready));
        let report = read(&mut fpga, ready).expect("it is whole");
        assert!(fpga.attention(ready));
        assert_eq!(report.function, Function::Soccer.code());
        assert_eq!(fpga.take_reports(), [report_encode(&report)]);
        assert_eq!(fpga.take_reports().len(), 0);
        assert_eq!(report.sequence, 0);
        assert_eq!(report.delay, 4, "420 us");
        assert_eq!(report.flags & REPORT_FRAME_TORN as u16, REPORT_FRAME_TORN as u16);
        let exposed = (FIRST_FRAME - 20 * MS - started) / REPORT_TICK;
        assert_eq!(report.exposure_time, exposed as u16);
        assert_eq!(report.flags & REPORT_BALL as u16, REPORT_BALL as u16);
        assert!(
            report.ball_disparity_q4.abs_diff(69 * 16) <= 2 * 16,
            "{}",
            report.ball_disparity_q4
        );
    }

    #[test]
    fn a_report_that_is_not_read_to_its_end_can_be_read_again() {
        let mut fpga = configured(Function::Soccer);
        show(&mut fpga, FIRST_FRAME);
        let now = FIRST_FRAME + MS;
        fpga.select(now, true);
        for _ in 0..15 {
            fpga.exchange(now, 0, 16);
        }
        fpga.select(now, false);
        assert!(!fpga.attention(now));
        assert_eq!(fpga.take_reports().len(), 0);
        assert!(read(&mut fpga, now).is_some());
        assert!(fpga.attention(now));
    }

    #[test]
    fn a_report_is_never_torn_by_a_newer_one() {
        let mut fpga = configured(Function::Soccer);
        show(&mut fpga, FIRST_FRAME);
        let mut now = FIRST_FRAME + MS;
        fpga.select(now, true);
        let mut wire = [0; REPORT_SIZE];
        for (index, place) in wire.chunks_exact_mut(2).enumerate() {
            if index == 5 {
                show(&mut fpga, now);
                now += MS;
            }
            place.copy_from_slice(&fpga.exchange(now, 0, 16).to_be_bytes());
        }
        fpga.select(now, false);
        assert_eq!(report_decode(&wire).map(|report| report.sequence), Some(0));
        assert!(!fpga.attention(now), "the newer one waits");
        assert_eq!(read(&mut fpga, now).map(|report| report.sequence), Some(1));
    }

    #[test]
    fn capture_counts_frames_but_never_reports() {
        let mut fpga = configured(Function::Capture);
        show(&mut fpga, FIRST_FRAME);
        assert_eq!(fpga.next_event(FIRST_FRAME), None);
        assert!(fpga.attention(FIRST_FRAME + MS));
        assert_eq!(fpga.register(FIRST_FRAME, FPGA_REG_FRAME_COUNT as u8), Some(1));
    }

    #[test]
    fn the_base_writes_registers_while_it_reads_a_report() {
        let mut fpga = configured(Function::Soccer);
        let now = FIRST_FRAME;
        let words = |wire: [u8; REGISTER_WRITE_BYTES]| {
            let mut words = [0; REPORT_WORDS];
            for (word, bytes) in words.iter_mut().zip(wire.chunks_exact(2)) {
                *word = u16::from_be_bytes([bytes[0], bytes[1]]);
            }
            words
        };
        let write = words(register_write_encode(FPGA_REG_SEARCH_MAX as u8, 100));
        read_words(&mut fpga, now, &write);
        assert_eq!(fpga.register(now, FPGA_REG_SEARCH_MAX as u8), Some(100));
        for bit in 0..16 {
            let mut damaged = words(register_write_encode(FPGA_REG_SEARCH_MAX as u8, 50));
            damaged[1] ^= 1 << bit;
            read_words(&mut fpga, now, &damaged);
            assert_eq!(fpga.register(now, FPGA_REG_SEARCH_MAX as u8), Some(100));
        }
        let id = words(register_write_encode(FPGA_REG_ID as u8, 1));
        read_words(&mut fpga, now, &id);
        assert_eq!(fpga.register(now, FPGA_REG_ID as u8), Some(FPGA_ID_VALUE as u16));
    }

    /// One SPI transfer of `bytes`; what MISO showed at the rising edges.
    fn spi(fpga: &mut Fpga, now: Ps, bytes: &[u8]) -> Vec<u8> {
        fpga.spi_pins(now, true, false, false);
        let read = bytes.iter().map(|byte| {
            (0..8).rev().fold(0, |read, bit| {
                let mosi = byte >> bit & 1 != 0;
                fpga.spi_pins(now, true, false, mosi);
                let level = fpga.spi_miso();
                fpga.spi_pins(now, true, true, mosi);
                read << 1 | u8::from(level)
            })
        });
        let read = read.collect();
        fpga.spi_pins(now, true, false, false);
        fpga.spi_pins(now, false, false, false);
        read
    }

    #[test]
    fn spi_reads_and_writes_registers() {
        let mut fpga = configured(Function::Capture);
        let now = FIRST_FRAME;
        assert_eq!(spi(&mut fpga, now, &[FPGA_REG_ID as u8, 0, 0]), [0xFF, 0x53, 0x01]);
        assert_eq!(spi(&mut fpga, now, &[FPGA_REG_FUNCTION as u8, 0, 0])[2], 2);
        assert_eq!(spi(&mut fpga, now, &[0x7F, 0, 0]), [0xFF; 3]);
        spi(&mut fpga, now, &[0x80 | FPGA_REG_STREAM as u8, 0, 1]);
        assert!(fpga.streams(now));
        spi(&mut fpga, now, &[0x80 | FPGA_REG_FRAME_RATE as u8, 0x01, 0x00]);
        assert_eq!(fpga.frame_rate(now), Some(40), "256 is out of range");
        spi(&mut fpga, now, &[0x80 | FPGA_REG_FRAME_RATE as u8, 0, 25]);
        assert_eq!(fpga.frame_rate(now), Some(25));
        spi(&mut fpga, now, &[0x80 | FPGA_REG_FRAME_RATE as u8, 0]);
        assert_eq!(fpga.frame_rate(now), Some(25), "a transfer cut short changes nothing");
    }

    #[test]
    fn a_new_design_starts_with_fresh_registers() {
        let mut fpga = configured(Function::Soccer);
        let mut now = FIRST_FRAME;
        show(&mut fpga, now);
        now += MS;
        spi(&mut fpga, now, &[0x80 | FPGA_REG_STREAM as u8, 0, 1]);
        assert!(!fpga.attention(now));
        send(&mut fpga, &mut now, &make_partial(Function::Capture, &Options::default()));
        assert_eq!(fpga.function(now), Some(Function::Capture));
        assert!(fpga.attention(now));
        assert!(!fpga.streams(now));
    }

    #[test]
    fn the_base_reads_registers_without_losing_its_report() {
        let mut fpga = configured(Function::Soccer);
        show(&mut fpga, FIRST_FRAME);
        let now = FIRST_FRAME + MS;
        fpga.select(now, true);
        let words = [0x4000 | c::FPGA_REG_GOAL_ROW as u16, 0, 0];
        let answer = words.map(|word| fpga.exchange(now, word, 16));
        fpga.select(now, false);
        let wire = register_read_encode(c::FPGA_REG_GOAL_ROW as u8, 60);
        assert_eq!(answer[0], u16::MAX);
        assert_eq!(answer[1].to_be_bytes(), wire[2..4]);
        assert_eq!(answer[2].to_be_bytes(), wire[4..6]);
        assert!(!fpga.attention(now), "the report goes on waiting");
        assert!(read(&mut fpga, now).is_some());
    }

    #[test]
    fn the_way_to_usb_is_the_fx2s_alone() {
        let mut fpga = configured(Function::Soccer);
        let wire = register_write_encode(c::FPGA_REG_STREAM as u8, 1);
        let mut words = [0; REPORT_WORDS];
        for (word, bytes) in words.iter_mut().zip(wire.chunks_exact(2)) {
            *word = u16::from_be_bytes([bytes[0], bytes[1]]);
        }
        read_words(&mut fpga, FIRST_FRAME, &words);
        assert!(!fpga.streams(FIRST_FRAME));
    }

    #[test]
    fn registers_take_what_spec_says_and_nothing_else() {
        let mut fpga = configured(Function::Soccer);
        let now = FIRST_FRAME;
        for (register, value, taken) in [
            (c::FPGA_REG_FORMAT, 1, true),
            (c::FPGA_REG_FORMAT, 2, false),
            (c::FPGA_REG_SOURCE, 1, false),
            (c::FPGA_REG_YELLOW_MARGIN, 255, true),
            (c::FPGA_REG_YELLOW_MARGIN, 256, false),
            (c::FPGA_REG_LOST, 1, false),
            (c::FPGA_REG_EYES, 0, false),
            (c::FPGA_REG_CAMERA_TABLE, 0x1234, true),
        ] {
            let before = fpga.register(now, register as u8).expect("it is there");
            let [high, low] = u16::to_be_bytes(value);
            spi(&mut fpga, now, &[0x80 | register as u8, high, low]);
            let wanted = if taken { value } else { before };
            assert_eq!(
                fpga.register(now, register as u8),
                Some(wanted),
                "{register:02x} := {value}"
            );
        }
        for missing in [0x21, 0x3F] {
            assert_eq!(fpga.register(now, missing), None);
            assert_eq!(spi(&mut fpga, now, &[missing, 0, 0]), [0xFF; 3]);
        }
        let mut capture = configured(Function::Capture);
        spi(&mut capture, now, &[0x80 | c::FPGA_REG_SOURCE as u8, 0, 1]);
        assert_eq!(capture.register(now, c::FPGA_REG_SOURCE as u8), Some(1));
    }

    #[test]
    fn every_parameter_is_a_register_with_its_range_and_reaches_the_detectors() {
        let mut fpga = configured(Function::Soccer);
        let now = FIRST_FRAME;
        for (at, parameter) in parameters().enumerate() {
            let (low, high) = parameter.range.expect("parameters can be written");
            let name = parameter.name;
            assert_eq!(fpga.register(now, parameter.address), Some(parameter.reset), "{name}");
            for (value, taken) in [(low, low), (high, high), (high + 1, high)] {
                let [first, second] = value.to_be_bytes();
                spi(&mut fpga, now, &[0x80 | parameter.address, first, second]);
                assert_eq!(fpga.register(now, parameter.address), Some(taken), "{name}");
                assert_eq!(u16::from(fpga.eye_params().to_bytes()[at]), taken, "{name}");
            }
            if low > 0 {
                let [first, second] = (low - 1).to_be_bytes();
                spi(&mut fpga, now, &[0x80 | parameter.address, first, second]);
                assert_eq!(fpga.register(now, parameter.address), Some(high), "{name}");
            }
        }
    }

    #[test]
    fn large_frames_are_halved_for_the_detectors_and_others_are_not_taken() {
        let mut fpga = configured(Function::Soccer);
        let [left, right] = ball(69).map(|small| {
            let rows = small.chunks_exact(WIDTH).flat_map(|row| [row, row]);
            rows.flat_map(|row| row.iter().flat_map(|&pixel| [pixel, pixel])).collect::<Vec<_>>()
        });
        let end = FIRST_FRAME;
        let frame = Frame { end, mid_exposure: end, left: &left, right: &right, flags: 0 };
        assert!(!fpga.frame(&frame), "the format is 320x240");
        assert_eq!(fpga.register(end, c::FPGA_REG_TORN as u8), Some(1));
        spi(&mut fpga, end, &[0x80 | c::FPGA_REG_FORMAT as u8, 0, 1]);
        assert!(fpga.frame(&frame));
        let large = read(&mut fpga, end + MS).expect("a report");
        spi(&mut fpga, end, &[0x80 | c::FPGA_REG_FORMAT as u8, 0, 0]);
        show(&mut fpga, end + MS);
        let small = read(&mut fpga, end + 2 * MS).expect("a report");
        assert_eq!(
            (large.ball_x_q4, large.ball_disparity_q4),
            (small.ball_x_q4, small.ball_disparity_q4)
        );
    }
}
