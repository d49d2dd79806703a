//! Both cameras: when the next pair is exposed, and when it has been read out.
//!
//! The FPGA gives both their clock, so they expose together, as often as it wants. What each of them
//! makes of the light is a matter of its registers (crate::sensor).

use common_sys::constants as c;
use sim::{Ps, SECOND, US};
use virtex::fpga::Frame;
use world::Exposure;

use crate::robot::Robot;
use crate::sensor::{self, Coding, Fault, Settings};

/// From the middle of an exposure to the end of the read-out; with the report's own delay it stays
/// within the frame period of 25 ms at 40 frames a second.
const READ_OUT: Ps = c::CAMERA_EXPOSURE_TO_END_US as Ps * US;
/// The same at 640x480 and 30 frames a second.
const READ_OUT_LARGE: Ps = c::CAMERA_EXPOSURE_TO_END_LARGE_US as Ps * US;
/// Frames a second while no design asks for another rate.
const DEFAULT_RATE: Ps = 40;

/// A pair that is being read out.
#[derive(Clone, Copy)]
struct Reading {
    middle: Ps,
    end: Ps,
    large: bool,
}

/// The cameras of one robot.
#[derive(Clone)]
pub struct Cameras {
    next_exposure: Ps,
    reading: Option<Reading>,
    /// What the lenses throw on the sensors, left and right.
    seen: [Vec<u16>; 2],
    /// What an eye sends instead, if that is something else.
    sent: [Option<Vec<u16>>; 2],
}

impl Cameras {
    /// Cameras that expose for the first time at `start`.
    pub fn new(start: Ps) -> Self {
        let seen = [Vec::new(), Vec::new()];
        Self { next_exposure: start, reading: None, seen, sent: [None, None] }
    }

    /// When [`Cameras::step`] has something to do next.
    pub fn next_event(&self) -> Ps {
        self.next_exposure.min(self.read_out())
    }

    fn read_out(&self) -> Ps {
        self.reading.map_or(Ps::MAX, |reading| reading.end)
    }

    /// The time is `now`: ends a read-out, begins an exposure, if that is due. An exposure calls
    /// `render` with the way it is taken and the pixels of the left and the right eye, which hold what
    /// they held when it was called last, unless their number has changed.
    /// Returns whether the FPGA has got a pair.
    pub fn step(
        &mut self,
        now: Ps,
        robot: &mut Robot,
        render: impl FnOnce(&Exposure, &mut [u16], &mut [u16]),
    ) -> bool {
        let taken = match self.reading.take_if(|reading| reading.end == now) {
            Some(reading) => self.deliver(&reading, robot),
            None => false,
        };
        if now == self.next_exposure {
            self.expose(now, robot, render);
        }
        taken
    }

    /// What both eyes have sent last, or are sending.
    pub fn last_pair(&self) -> [&[u16]; 2] {
        [0, 1].map(|eye| self.sent[eye].as_ref().unwrap_or(&self.seen[eye]).as_slice())
    }

    /// The last row is in.
    fn deliver(&mut self, reading: &Reading, robot: &mut Robot) -> bool {
        let turret = &mut robot.turret;
        let faults = [0, 1].map(|eye| turret.cameras.eyes[eye].fault);
        let fits = turret.fpga.takes_large(reading.end) == reading.large;
        for (eye, fault) in faults.into_iter().enumerate() {
            if fault != Some(Fault::NoPixels) {
                let torn = fault == Some(Fault::TornFrames) || !fits;
                turret.fpga.eye_ended(reading.end, eye, torn);
            }
        }
        if faults.contains(&Some(Fault::NoPixels)) {
            return false;
        }
        let torn = faults.contains(&Some(Fault::TornFrames));
        let [left, right] = self.last_pair();
        turret.frame(&Frame {
            end: reading.end,
            mid_exposure: reading.middle,
            left,
            right,
            flags: if torn { c::REPORT_FRAME_TORN as u16 } else { 0 },
        })
    }

    /// Both eyes see the world as it is now. Without a design in the FPGA they have no clock.
    fn expose(
        &mut self,
        now: Ps,
        robot: &mut Robot,
        render: impl FnOnce(&Exposure, &mut [u16], &mut [u16]),
    ) {
        let lamps = robot.turret.cameras.lamps;
        let settings = [0, 1].map(|eye| robot.turret.cameras.eyes[eye].settings(lamps));
        let faults = [0, 1].map(|eye| robot.turret.cameras.eyes[eye].fault);
        let large = settings[0].large;
        let fpga = &mut robot.turret.fpga;
        let most = if large { c::CAMERA_LARGE_FRAME_RATE_MAX } else { u32::MAX };
        let rate = fpga.frame_rate(now).map_or(DEFAULT_RATE, |rate| Ps::from(rate.max(1)));
        self.next_exposure = now + SECOND / rate.min(Ps::from(most));
        // Cameras of two sizes make no pair.
        if self.reading.is_some() || fpga.function(now).is_none() || settings[1].large != large {
            return;
        }
        let exposure = Exposure {
            time: fpga.exposure_time(now),
            large,
            light: settings.map(|settings| settings.light),
        };
        let [left, right] = &mut self.seen;
        let pixels = exposure.width() * exposure.height();
        left.resize(pixels, 0);
        right.resize(pixels, 0);
        render(&exposure, left, right);
        for eye in 0..2 {
            self.develop(eye, &exposure, &settings[eye], faults[eye]);
            robot.turret.cameras.eyes[eye].control(lamps);
        }
        let end = now + if large { READ_OUT_LARGE } else { READ_OUT };
        self.reading = Some(Reading { middle: now, end, large });
    }

    /// What an eye sends, if it is not just what it sees.
    fn develop(&mut self, eye: usize, shot: &Exposure, set: &Settings, fault: Option<Fault>) {
        let torn = fault == Some(Fault::TornFrames);
        if set.pattern.is_none() && set.coding == Coding::Rgb565 && !torn {
            self.sent[eye] = None;
            return;
        }
        let (width, height) = (shot.width(), shot.height());
        let sent = self.sent[eye].get_or_insert_default();
        sent.resize(width * height, 0);
        // The rows that do not come keep what was there before.
        let rows = if torn { height / 2 } else { height };
        let seen = self.seen[eye].chunks_exact(width).take(rows);
        for (y, (row, seen)) in sent.chunks_exact_mut(width).zip(seen).enumerate() {
            for (x, (pixel, seen)) in row.iter_mut().zip(seen).enumerate() {
                let colour = match set.pattern {
                    Some(pattern) => sensor::pattern_pixel(pattern, x, y, width, height),
                    None => *seen,
                };
                *pixel = match set.coding {
                    Coding::Rgb565 => colour,
                    Coding::Yuv => sensor::yuv_pixel(colour, x),
                };
            }
        }
    }
}
