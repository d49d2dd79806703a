//! The cameras as I2C and their registers show them: a PCA9540B and behind each of its channels a
//! sensor of the OV7670's kind.
//!
//! Modelled are the registers of `common/link/camera.h`: identity, reset, size and coding of the
//! picture, exposure, gain, white balance, test pattern. All others keep what is written to them.
//!
//! [`NOMINAL_ROWS`] of exposure at gain 1 are as bright as the world is drawn (assumption). The automatic
//! exposure takes a step a frame until the mean is within AEB..AEW: a sixteenth, or by two where VPT says
//! that it is far off (OV9650 Implementation Guide 1.1, page 17; the OV7670 has the same registers). What it
//! measures is the light alone, as if every scene had the same mean (assumption): so it stands still
//! until the light or a setting changes. Automatic gain and white balance are ideal and at once.
//!
//! The sensors' clock comes from the design in the FPGA: without one they neither answer nor send.
//! Sources: data sheets of the OV7670 (version 1.4) and of the PCA9540B.

use common_sys::constants as c;
use sim::{MS, Ps};

/// Rows of exposure that give the picture's own brightness at gain 1: the register's value at reset.
pub const NOMINAL_ROWS: u16 = 0x40 << 2;
/// Mean of a picture that is as bright as the world is drawn: the middle of the stable region at reset.
const NOMINAL_MEAN: f32 = (0x75 + 0x63) as f32 / 2.0;
/// Rows that the automatic exposure goes to at most, those of a frame; then the gain takes over.
const AUTO_ROWS_MAX: u16 = 510;
/// Most by which the automatic gain makes up for a short exposure.
const AUTO_GAIN_MAX: f32 = 16.0;
/// A sensor does not answer for so long after a reset by register.
const RESET_TIME: Ps = MS;
const REGISTERS: usize = c::CAMERA_REG_LAST as usize + 1;

/// What is wrong with a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// It does not answer on I2C; its picture goes on coming.
    NoAck,
    /// It is another chip.
    WrongId,
    /// It answers, but sends no picture.
    NoPixels,
    /// The lower half of its frames does not come.
    TornFrames,
}

/// How the pixels are coded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coding {
    /// RGB565.
    Rgb565,
    /// YCbCr 4:2:2, the sensor's own choice at reset.
    Yuv,
}

/// A picture that the sensor makes by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pattern {
    /// A single one that wanders through the pixel's bits.
    Ones,
    /// Eight bars.
    Bars,
    /// The bars, fading to grey downwards.
    Fade,
}

/// What a sensor's registers make of its picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// 640x480, else 320x240.
    pub large: bool,
    /// See [`Coding`].
    pub coding: Coding,
    /// Factors for red, green and blue.
    pub light: [f32; 3],
    /// Instead of a picture.
    pub pattern: Option<Pattern>,
}

/// One sensor.
#[derive(Clone, Debug)]
pub struct Camera {
    registers: [u8; REGISTERS],
    pointer: u8,
    answers_from: Ps,
    /// What is wrong with it.
    pub fault: Option<Fault>,
}

impl Default for Camera {
    fn default() -> Self {
        Self { registers: reset_values(), pointer: 0, answers_from: 0, fault: None }
    }
}

fn reset_values() -> [u8; REGISTERS] {
    let mut registers = [0; REGISTERS];
    for (register, value) in [
        (c::CAMERA_REG_BLUE, 0x80),
        (c::CAMERA_REG_RED, 0x80),
        (c::CAMERA_REG_PID, c::CAMERA_PID),
        (c::CAMERA_REG_VER, c::CAMERA_VER),
        (c::CAMERA_REG_AECH, 0x40),
        (c::CAMERA_REG_COM8, 0x8F),
        (c::CAMERA_REG_AEW, 0x75),
        (c::CAMERA_REG_AEB, 0x63),
        (c::CAMERA_REG_VPT, 0xD4),
        (c::CAMERA_REG_COM15, 0xC0),
        (c::CAMERA_REG_TEST_X, 0x3A),
        (c::CAMERA_REG_TEST_Y, 0x35),
    ] {
        registers[register as usize] = value as u8;
    }
    registers
}

impl Camera {
    fn register(&self, address: u32) -> u8 {
        self.registers[address as usize]
    }

    fn read(&self) -> u8 {
        match (u32::from(self.pointer), self.fault) {
            (c::CAMERA_REG_VER, Some(Fault::WrongId)) => !(c::CAMERA_VER as u8),
            (pointer, _) => self.registers.get(pointer as usize).copied().unwrap_or(0),
        }
    }

    fn write(&mut self, now: Ps, value: u8) {
        match u32::from(self.pointer) {
            c::CAMERA_REG_COM7 if u32::from(value) & c::CAMERA_COM7_RESET != 0 => {
                self.registers = reset_values();
                self.answers_from = now + RESET_TIME;
            }
            c::CAMERA_REG_PID | c::CAMERA_REG_VER => {}
            pointer => {
                if let Some(register) = self.registers.get_mut(pointer as usize) {
                    *register = value;
                }
            }
        }
    }

    /// What its picture is like under lamps that are `lamps` times as bright as the world is drawn.
    pub fn settings(&self, lamps: f32) -> Settings {
        let com7 = u32::from(self.register(c::CAMERA_REG_COM7));
        let com15 = u32::from(self.register(c::CAMERA_REG_COM15));
        let rgb565 = com7 & c::CAMERA_COM7_CODING == c::CAMERA_COM7_CODING_RGB
            && com15 & c::CAMERA_COM15_RGB == c::CAMERA_COM15_RGB565;
        let bit = |address: u32| u32::from(self.register(address)) & c::CAMERA_TEST_BIT != 0;
        let pattern = match (bit(c::CAMERA_REG_TEST_Y), bit(c::CAMERA_REG_TEST_X)) {
            (false, false) => None,
            (false, true) => Some(Pattern::Ones),
            (true, false) => Some(Pattern::Bars),
            (true, true) => Some(Pattern::Fade),
        };
        Settings {
            large: com7 & c::CAMERA_COM7_SIZE != c::CAMERA_COM7_SIZE_320X240,
            coding: if rgb565 { Coding::Rgb565 } else { Coding::Yuv },
            light: self.light(lamps),
            pattern,
        }
    }

    fn automatic(&self, bit: u32) -> bool {
        u32::from(self.register(c::CAMERA_REG_COM8)) & bit != 0
    }

    fn rows(&self) -> u16 {
        u16::from(self.register(c::CAMERA_REG_AECHH) & 0x3F) << 10
            | u16::from(self.register(c::CAMERA_REG_AECH)) << 2
            | u16::from(self.register(c::CAMERA_REG_COM1) & 3)
    }

    fn set_rows(&mut self, rows: u16) {
        let mut put = |address: u32, bits: u8, value: u16| {
            let register = &mut self.registers[address as usize];
            *register = *register & !bits | value as u8 & bits;
        };
        put(c::CAMERA_REG_AECHH, 0x3F, rows >> 10);
        put(c::CAMERA_REG_AECH, 0xFF, rows >> 2 & 0xFF);
        put(c::CAMERA_REG_COM1, 3, rows);
    }

    /// How bright the picture is: 1 as the world is drawn.
    fn level(&self, lamps: f32) -> f32 {
        let exposed = lamps * f32::from(self.rows()) / f32::from(NOMINAL_ROWS);
        let gain = self.register(c::CAMERA_REG_GAIN);
        let gain = (1.0 + f32::from(gain & 0x0F) / 16.0) * (1 << (gain >> 4).count_ones()) as f32;
        let made_up = (exposed * AUTO_GAIN_MAX).min(exposed.max(1.0));
        match (
            self.automatic(c::CAMERA_COM8_AUTO_EXPOSURE),
            self.automatic(c::CAMERA_COM8_AUTO_GAIN),
        ) {
            // Exposure comes first.
            (true, true) if self.rows() < AUTO_ROWS_MAX => exposed,
            (_, true) => made_up,
            (_, false) => exposed * gain,
        }
    }

    fn light(&self, lamps: f32) -> [f32; 3] {
        let level = self.level(lamps);
        let white = |address: u32| match self.automatic(c::CAMERA_COM8_AUTO_WHITE) {
            true => 1.0,
            false => f32::from(self.register(address)) / 128.0,
        };
        [level * white(c::CAMERA_REG_RED), level, level * white(c::CAMERA_REG_BLUE)]
    }

    /// A frame has been exposed: the automatic exposure takes its step for the next one.
    pub fn control(&mut self, lamps: f32) {
        if !self.automatic(c::CAMERA_COM8_AUTO_EXPOSURE) {
            return;
        }
        let mean = (NOMINAL_MEAN * self.level(lamps)).min(255.0);
        let limit = |address: u32| f32::from(self.register(address));
        let far = self.register(c::CAMERA_REG_VPT);
        let rows = self.rows();
        let step = (rows / 16).max(1);
        let wanted = if mean > f32::from(far & 0xF0) {
            rows / 2
        } else if mean > limit(c::CAMERA_REG_AEW) {
            rows - step.min(rows)
        } else if mean < f32::from(far << 4) {
            rows.saturating_mul(2)
        } else if mean < limit(c::CAMERA_REG_AEB) {
            rows + step
        } else {
            return;
        };
        self.set_rows(wanted.clamp(1, AUTO_ROWS_MAX));
    }
}

/// Who was addressed by the last start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Addressed {
    Nobody,
    Mux,
    /// A sensor; the first byte written to it is a register's address.
    Eye {
        index: usize,
        register_known: bool,
    },
}

/// Multiplexer and sensors.
#[derive(Clone, Debug)]
pub struct CameraBus {
    /// Left and right.
    pub eyes: [Camera; 2],
    /// The multiplexer is soldered in.
    pub mux_present: bool,
    /// Somebody holds the clock line low.
    pub clock_held: bool,
    /// How bright the lamps over the pitch are: 1 as the world is drawn.
    pub lamps: f32,
    control: u8,
    addressed: Addressed,
}

impl Default for CameraBus {
    fn default() -> Self {
        Self {
            eyes: [Camera::default(), Camera::default()],
            mux_present: true,
            clock_held: false,
            lamps: 1.0,
            control: 0,
            addressed: Addressed::Nobody,
        }
    }
}

impl CameraBus {
    /// The supply fails and returns: registers are as at reset, what is broken stays broken.
    pub fn power_cycle(&mut self) {
        for eye in &mut self.eyes {
            *eye = Camera { fault: eye.fault, ..Camera::default() };
        }
        self.control = 0;
        self.addressed = Addressed::Nobody;
    }

    /// The sensor behind the channel that is let through.
    fn chosen(&self) -> Option<usize> {
        match u32::from(self.control) {
            c::TURRET_CAMERA_MUX_LEFT => Some(0),
            c::TURRET_CAMERA_MUX_RIGHT => Some(1),
            _ => None,
        }
    }

    /// See [`fx2::pins::Board::i2c_start`]. `clocked`: the sensors have their clock.
    pub fn i2c_start(&mut self, now: Ps, address_and_direction: u8, clocked: bool) -> bool {
        self.addressed = match u32::from(address_and_direction >> 1) {
            c::TURRET_CAMERA_MUX_ADDRESS if self.mux_present => Addressed::Mux,
            c::TURRET_CAMERA_ADDRESS if clocked => match self.chosen() {
                Some(index) if self.answers(index, now) => {
                    Addressed::Eye { index, register_known: false }
                }
                _ => Addressed::Nobody,
            },
            _ => Addressed::Nobody,
        };
        self.is_addressed()
    }

    fn answers(&self, index: usize, now: Ps) -> bool {
        let eye = &self.eyes[index];
        eye.fault != Some(Fault::NoAck) && now >= eye.answers_from
    }

    /// Whether the transfer under way is with one of these.
    pub fn is_addressed(&self) -> bool {
        self.addressed != Addressed::Nobody
    }

    /// See [`fx2::pins::Board::i2c_write`].
    pub fn i2c_write(&mut self, now: Ps, byte: u8) -> bool {
        match &mut self.addressed {
            Addressed::Nobody => false,
            Addressed::Mux => {
                self.control = byte;
                true
            }
            Addressed::Eye { index, register_known } => {
                let eye = &mut self.eyes[*index];
                if std::mem::replace(register_known, true) {
                    eye.write(now, byte);
                } else {
                    eye.pointer = byte;
                }
                true
            }
        }
    }

    /// See [`fx2::pins::Board::i2c_read`].
    pub fn i2c_read(&mut self) -> u8 {
        match self.addressed {
            Addressed::Nobody => 0xFF,
            Addressed::Mux => self.control,
            Addressed::Eye { index, .. } => self.eyes[index].read(),
        }
    }

    /// See [`fx2::pins::Board::i2c_stop`].
    pub fn i2c_stop(&mut self) {
        self.addressed = Addressed::Nobody;
    }
}

/// Pixel (x, y) of a picture that the sensor makes by itself.
pub fn pattern_pixel(pattern: Pattern, x: usize, y: usize, width: usize, height: usize) -> u16 {
    const BARS: [[u8; 3]; 8] = [
        [255, 255, 255],
        [255, 255, 0],
        [0, 255, 255],
        [0, 255, 0],
        [255, 0, 255],
        [255, 0, 0],
        [0, 0, 255],
        [0, 0, 0],
    ];
    let bar = BARS[8 * x / width];
    let [r, g, b] = match pattern {
        Pattern::Ones => return 1 << (x % 16),
        Pattern::Bars => bar,
        Pattern::Fade => bar.map(|channel| {
            let (colour, grey) = (usize::from(channel) * (height - y), 128 * y);
            ((colour + grey) / height) as u8
        }),
    };
    common_sys::vision::rgb565(r, g, b)
}

/// The 16 bits that column `x` of a YCbCr 4:2:2 picture has for this colour: luma, then Cb in even
/// and Cr in odd columns (ITU-R BT.601, in 1/256).
pub fn yuv_pixel(rgb565: u16, x: usize) -> u16 {
    let channel = |shift: u32, bits: u32| {
        i32::from(rgb565 >> shift & ((1 << bits) - 1)) * 255 / ((1 << bits) - 1)
    };
    let (r, g, b) = (channel(11, 5), channel(5, 6), channel(0, 5));
    let luma = (77 * r + 150 * g + 29 * b) >> 8;
    let chroma = match x % 2 {
        0 => (-43 * r - 85 * g + 128 * b) >> 8,
        _ => (128 * r - 107 * g - 21 * b) >> 8,
    };
    ((luma.clamp(0, 255) as u16) << 8) | (chroma + 128).clamp(0, 255) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(bus: &mut CameraBus, now: Ps, address: u32, bytes: &[u8]) -> bool {
        let ok = bus.i2c_start(now, (address << 1) as u8, true)
            && bytes.iter().all(|&byte| bus.i2c_write(now, byte));
        bus.i2c_stop();
        ok
    }

    fn put(bus: &mut CameraBus, eye: usize, register: u32, value: u32) {
        let channel = c::TURRET_CAMERA_MUX_LEFT as u8 + eye as u8;
        assert!(write(bus, MS, c::TURRET_CAMERA_MUX_ADDRESS, &[channel]));
        assert!(write(bus, MS, c::TURRET_CAMERA_ADDRESS, &[register as u8, value as u8]));
    }

    fn get(bus: &mut CameraBus, eye: usize, register: u32) -> u8 {
        let channel = c::TURRET_CAMERA_MUX_LEFT as u8 + eye as u8;
        assert!(write(bus, MS, c::TURRET_CAMERA_MUX_ADDRESS, &[channel]));
        assert!(write(bus, MS, c::TURRET_CAMERA_ADDRESS, &[register as u8]));
        assert!(bus.i2c_start(MS, (c::TURRET_CAMERA_ADDRESS << 1 | 1) as u8, true));
        let value = bus.i2c_read();
        bus.i2c_stop();
        value
    }

    #[test]
    fn the_multiplexer_tells_two_cameras_of_one_address_apart() {
        let mut bus = CameraBus::default();
        assert!(!write(&mut bus, MS, c::TURRET_CAMERA_ADDRESS, &[0]), "no channel is chosen");
        put(&mut bus, 0, c::CAMERA_REG_GAIN, 0x11);
        put(&mut bus, 1, c::CAMERA_REG_GAIN, 0x22);
        assert_eq!(get(&mut bus, 0, c::CAMERA_REG_GAIN), 0x11);
        assert_eq!(get(&mut bus, 1, c::CAMERA_REG_GAIN), 0x22);
        assert_eq!(u32::from(get(&mut bus, 1, c::CAMERA_REG_PID)), c::CAMERA_PID);
    }

    #[test]
    fn without_its_clock_or_just_after_a_reset_a_camera_is_silent() {
        let mut bus = CameraBus::default();
        put(&mut bus, 0, c::CAMERA_REG_GAIN, 0x11);
        let start = (c::TURRET_CAMERA_ADDRESS << 1) as u8;
        assert!(!bus.i2c_start(MS, start, false));
        put(&mut bus, 0, c::CAMERA_REG_COM7, c::CAMERA_COM7_RESET);
        assert!(!bus.i2c_start(2 * MS - 1, start, true));
        assert!(bus.i2c_start(2 * MS, start, true));
        assert_eq!(bus.eyes[0].registers, reset_values());
    }

    #[test]
    fn exposure_gain_and_white_balance_act_by_hand_only() {
        let mut bus = CameraBus::default();
        let light = |bus: &CameraBus| bus.eyes[0].settings(1.0).light;
        put(&mut bus, 0, c::CAMERA_REG_RED, 0xC0);
        assert_eq!(light(&bus), [1.0; 3]);
        // The automatic gain makes up for half the exposure.
        put(&mut bus, 0, c::CAMERA_REG_COM8, c::CAMERA_COM8_AUTO_GAIN);
        put(&mut bus, 0, c::CAMERA_REG_AECH, 0x20);
        assert_eq!(light(&bus), [1.5, 1.0, 1.0]);
        put(&mut bus, 0, c::CAMERA_REG_COM8, 0);
        assert_eq!(light(&bus), [0.75, 0.5, 0.5]);
        put(&mut bus, 0, c::CAMERA_REG_GAIN, 0x18);
        assert_eq!(light(&bus), [2.25, 1.5, 1.5]);
        assert_eq!(bus.eyes[1].settings(1.0).light, [1.0; 3]);
    }

    /// Levels from frame to frame under such lamps.
    fn levels(eye: &mut Camera, lamps: f32, frames: usize) -> Vec<f32> {
        let mut level = || {
            let level = eye.settings(lamps).light[1];
            eye.control(lamps);
            level
        };
        (0..frames).map(|_| level()).collect()
    }

    #[test]
    fn the_automatic_exposure_follows_the_light_step_by_step() {
        let mut eye = Camera::default();
        assert_eq!(levels(&mut eye, 1.0, 10), [1.0; 10], "steady light, steady exposure");
        // A third of the light is far off: by two at once. Where a frame is too short the gain takes over.
        let dark = levels(&mut eye, 0.35, 20);
        assert_eq!((dark[0], &dark[1..]), (0.35, &[1.0; 19][..]));
        let bright = levels(&mut eye, 1.0, 20);
        assert!(bright[0] > 1.9 && (0.9..1.1).contains(&bright[19]), "{bright:?}");
        let slow = levels(&mut eye, 1.3, 20);
        let steps = slow.windows(2).map(|pair| pair[1] / pair[0]);
        assert!(steps.clone().all(|step| (0.93..=1.0).contains(&step)), "{slow:?}");
        assert!(steps.filter(|step| *step < 0.95).count() >= 3, "{slow:?}");
        // By hand it stays where it is.
        eye.registers[c::CAMERA_REG_COM8 as usize] = 0;
        let held = levels(&mut eye, 0.5, 5);
        assert!(held.iter().all(|level| *level == held[0]), "{held:?}");
    }

    #[test]
    fn patterns_have_eight_bars_and_fade_to_grey() {
        let bar = |x: usize| pattern_pixel(Pattern::Bars, x, 100, 320, 240);
        assert_eq!([bar(0), bar(39), bar(40), bar(319)], [0xFFFF, 0xFFFF, 0xFFE0, 0]);
        assert_eq!(pattern_pixel(Pattern::Fade, 0, 0, 320, 240), 0xFFFF);
        let bottom = pattern_pixel(Pattern::Fade, 0, 239, 320, 240);
        assert!(bottom >> 11 < 18, "nearly grey: {bottom:04x}");
        assert_eq!(yuv_pixel(0xFFFF, 0), 0xFF80);
    }
}
