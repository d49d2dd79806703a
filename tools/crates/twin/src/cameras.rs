//! Both cameras: when the next pair is exposed, and when it has been read out.

use common_sys::constants as c;
use sim::{Ps, SECOND, US};
use virtex::fpga::Frame;

use crate::robot::Robot;

/// From the middle of an exposure to the end of the read-out; with the report's own delay it stays
/// within the frame period of 25 ms at 40 frames a second.
const READ_OUT: Ps = c::CAMERA_EXPOSURE_TO_END_US as Ps * US;
/// Frames a second while no design asks for another rate.
const DEFAULT_RATE: Ps = 40;
/// Pixels of a frame.
const PIXELS: usize = common_sys::vision::WIDTH * common_sys::vision::HEIGHT;

/// The cameras of one robot.
#[derive(Clone)]
pub struct Cameras {
    next_exposure: Ps,
    /// The middle of the exposure that is being read out.
    reading: Option<Ps>,
    left: Vec<u16>,
    right: Vec<u16>,
}

impl Cameras {
    /// Cameras that expose for the first time at `start`.
    pub fn new(start: Ps) -> Self {
        Self { next_exposure: start, reading: None, left: vec![0; PIXELS], right: vec![0; PIXELS] }
    }

    /// When [`Cameras::step`] has something to do next.
    pub fn next_event(&self) -> Ps {
        self.next_exposure.min(self.read_out())
    }

    fn read_out(&self) -> Ps {
        self.reading.map_or(Ps::MAX, |middle| middle + READ_OUT)
    }

    /// The time is `now`: ends a read-out, begins an exposure, if that is due. An exposure calls
    /// `render` with the time that the report will bear and the pixels of the left and the right eye.
    /// Returns whether the FPGA has got a pair.
    pub fn step(
        &mut self,
        now: Ps,
        robot: &mut Robot,
        render: impl FnOnce(u16, &mut [u16], &mut [u16]),
    ) -> bool {
        let taken = now == self.read_out();
        if taken && let Some(mid_exposure) = self.reading.take() {
            robot.turret.frame(&Frame {
                end: now,
                mid_exposure,
                left: &self.left,
                right: &self.right,
                flags: 0,
            });
        }
        if now == self.next_exposure {
            self.expose(now, robot, render);
        }
        taken
    }

    /// Both eyes see the world as it is now. Without a design in the FPGA nobody looks.
    fn expose(
        &mut self,
        now: Ps,
        robot: &mut Robot,
        render: impl FnOnce(u16, &mut [u16], &mut [u16]),
    ) {
        let fpga = &mut robot.turret.fpga;
        let rate = fpga.frame_rate(now).map_or(DEFAULT_RATE, |rate| Ps::from(rate.max(1)));
        self.next_exposure = now + SECOND / rate;
        if self.reading.is_none() && fpga.function(now).is_some() {
            render(fpga.exposure_time(now), &mut self.left, &mut self.right);
            self.reading = Some(now);
        }
    }
}
