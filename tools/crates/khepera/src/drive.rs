//! Motors, wheels and encoders.
//!
//! A motor is a first-order lag with Coulomb friction, integrated on a fixed grid of time, so that
//! the result does not depend on how often anybody looks. Between grid points the speed is constant,
//! which makes every encoder edge an event with an exact time.

use common_sys::constants as board;
use sim::{MS, Ps, SECOND, US};

/// Left and right.
pub(crate) const WHEELS: usize = 2;

/// Grid of the integration.
const STEP: Ps = 100 * US;

// The motors' data are not public. ASSUMPTIONS, chosen to give the robot's published top speed of
// about 1 m/s and a start-up that feels like its size.
/// Speed without load at full duty and nominal battery.
const NO_LOAD_MM_S: f64 = 1000.0;
/// Time constant of robot and motor together.
const TIME_CONSTANT_S: f64 = 0.05;
/// Friction while rolling and at rest, as a part of the stall force: the dead band of the duty.
const ROLLING_FRICTION: f64 = 0.02;
const STATIC_FRICTION: f64 = 0.04;
/// Mass that one wheel's motor feels: half of the robot and the geared rotor.
const MASS_KG: f64 = 0.10;
/// Speed without load or friction, and force at the rim at rest, full duty and nominal voltage.
pub(crate) const FULL_SPEED_MM_S: f64 = NO_LOAD_MM_S;
pub(crate) const STALL_FORCE_N: f64 = MASS_KG * NO_LOAD_MM_S / 1000.0 / TIME_CONSTANT_S;
/// The battery's voltage at which the figures above hold.
pub(crate) const NOMINAL_MV: u32 = 4800;

const EDGES_PER_MM: f64 = board::BOARD_PULSES_PER_MM as f64;

/// A fault of one wheel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WheelFault {
    /// None.
    #[default]
    None,
    /// The encoder's outputs stand still, whatever the wheel does.
    EncoderStuck,
    /// The wheel is blocked.
    Stalled,
    /// The motor gets no current; the wheel rolls out.
    MotorOpen,
}

/// What drives one motor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotorDrive {
    /// Share of full voltage, 0..=1.
    pub duty: f64,
    /// Direction pin.
    pub forward: bool,
}

/// Which of a wheel's two encoder channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Channel {
    A,
    B,
}

/// One wheel.
#[derive(Clone, Debug, Default)]
struct Wheel {
    fault: WheelFault,
    load_n: f64,
    mm_s: f64,
    /// Position at the last grid point, in edges of channel A.
    edges: f64,
    /// Position at which a stuck encoder stands.
    stuck_at: f64,
    /// Position up to which edges have been reported, for channels A and B.
    reported: [i64; 2],
}

/// Channel B lags A by half an edge: B is low at a rising edge of A and high at a falling one while
/// the wheel rolls forward (board/khepera.h).
fn phase_of(channel: Channel) -> f64 {
    match channel {
        Channel::A => 0.0,
        Channel::B => 0.5,
    }
}

fn cell(edges: f64, channel: Channel) -> i64 {
    libm::floor(edges - phase_of(channel)) as i64
}

impl Wheel {
    /// The speed after one step.
    fn next_speed(&self, drive: MotorDrive, battery: f64) -> f64 {
        if self.fault == WheelFault::Stalled {
            return 0.0;
        }
        let stall = NO_LOAD_MM_S / TIME_CONSTANT_S; // acceleration at rest, mm/s^2
        let sign = if drive.forward { 1.0 } else { -1.0 };
        // An open motor neither pulls nor brakes.
        let connected = f64::from(u8::from(self.fault != WheelFault::MotorOpen));
        let pull = connected * sign * drive.duty * battery * stall;
        let brake = connected * self.mm_s / TIME_CONSTANT_S;
        let load = 1000.0 * self.load_n / MASS_KG;
        let step_s = STEP as f64 / SECOND as f64;
        if self.mm_s == 0.0 {
            let resistance = STATIC_FRICTION * stall + load;
            if libm::fabs(pull) <= resistance {
                return 0.0;
            }
        }
        let moving = if self.mm_s == 0.0 { pull } else { self.mm_s };
        let resistance = libm::copysign(ROLLING_FRICTION * stall + load, moving);
        let speed = self.mm_s + (pull - brake - resistance) * step_s;
        // Friction stops a wheel but never turns it back.
        let stops = self.mm_s != 0.0 && speed * self.mm_s < 0.0;
        if stops { 0.0 } else { speed }
    }

    fn encoder_edges(&self, since_grid: Ps) -> f64 {
        if self.fault == WheelFault::EncoderStuck {
            return self.stuck_at;
        }
        self.edges + self.mm_s * EDGES_PER_MM * (since_grid as f64 / SECOND as f64)
    }

    /// Time after the grid point of the next unreported edge, if it comes before the next one.
    fn next_edge(&self, channel: Channel) -> Option<Ps> {
        if self.mm_s == 0.0 || self.fault == WheelFault::EncoderStuck {
            return None;
        }
        let reported = self.reported[channel as usize];
        let boundary = if self.mm_s > 0.0 { reported + 1 } else { reported };
        let distance = boundary as f64 + phase_of(channel) - self.edges;
        let time = distance / (self.mm_s * EDGES_PER_MM) * SECOND as f64;
        // Rounding may put an edge a moment before the grid point.
        (time < STEP as f64).then_some(libm::ceil(time.max(0.0)) as Ps)
    }
}

/// An edge of an encoder channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Edge {
    pub wheel: usize,
    pub channel: Channel,
    pub high: bool,
}

/// Both wheels.
#[derive(Clone, Debug)]
pub(crate) struct Drive {
    wheels: [Wheel; WHEELS],
    grid: Ps,
}

impl Drive {
    pub fn new() -> Self {
        Self { wheels: [Wheel::default(), Wheel::default()], grid: 0 }
    }

    pub fn speeds_mm_s(&self) -> [f64; WHEELS] {
        [self.wheels[0].mm_s, self.wheels[1].mm_s]
    }

    /// Distance that each wheel has rolled at time `t`, which must lie in the present step.
    pub fn travel_mm(&self, t: Ps) -> [f64; WHEELS] {
        let seconds = t.saturating_sub(self.grid).min(STEP) as f64 / SECOND as f64;
        [0, 1].map(|n| {
            let wheel: &Wheel = &self.wheels[n];
            wheel.edges / EDGES_PER_MM + wheel.mm_s * seconds
        })
    }

    pub fn set_load(&mut self, newton: [f64; WHEELS]) {
        for (wheel, load) in self.wheels.iter_mut().zip(newton) {
            wheel.load_n = load.max(0.0);
        }
    }

    pub fn set_fault(&mut self, wheel: usize, fault: WheelFault, now: Ps) {
        let since = now.saturating_sub(self.grid).min(STEP);
        let wheel = &mut self.wheels[wheel];
        wheel.stuck_at = wheel.encoder_edges(since);
        wheel.fault = fault;
        // An encoder that works again goes on from where the wheel is.
        let stands = wheel.encoder_edges(since);
        wheel.reported = [cell(stands, Channel::A), cell(stands, Channel::B)];
    }

    /// Level of an encoder channel at time `t` in the present step.
    pub fn level(&self, t: Ps, wheel: usize, channel: Channel) -> bool {
        let since = t.saturating_sub(self.grid).min(STEP);
        cell(self.wheels[wheel].encoder_edges(since), channel) & 1 == 0
    }

    /// When the next step or the next edge of a watched channel is due. `watch[wheel][channel]`.
    pub fn next_event(&self, watch: [[bool; 2]; WHEELS]) -> Ps {
        self.next_edge(watch).map_or(self.grid + STEP, |(t, _)| t)
    }

    fn next_edge(&self, watch: [[bool; 2]; WHEELS]) -> Option<(Ps, Edge)> {
        let mut first: Option<(Ps, Edge)> = None;
        for (n, wheel) in self.wheels.iter().enumerate() {
            for channel in [Channel::A, Channel::B] {
                if !watch[n][channel as usize] {
                    continue;
                }
                if let Some(after) = wheel.next_edge(channel) {
                    let t = self.grid + after;
                    let reported = wheel.reported[channel as usize];
                    let entered = if wheel.mm_s > 0.0 { reported + 1 } else { reported - 1 };
                    let edge = Edge { wheel: n, channel, high: entered & 1 == 0 };
                    if first.is_none_or(|(best, _)| t < best) {
                        first = Some((t, edge));
                    }
                }
            }
        }
        first
    }

    /// Do what is due at or before `t`; an edge is returned, and the caller asks again.
    pub fn event(
        &mut self,
        t: Ps,
        watch: [[bool; 2]; WHEELS],
        drives: [MotorDrive; WHEELS],
        battery_mv: u32,
    ) -> Option<Edge> {
        if let Some((at, edge)) = self.next_edge(watch)
            && at <= t
        {
            let wheel = &mut self.wheels[edge.wheel];
            let forward = wheel.mm_s > 0.0;
            wheel.reported[edge.channel as usize] += if forward { 1 } else { -1 };
            return Some(edge);
        }
        if self.grid + STEP <= t {
            self.step(watch, drives, f64::from(battery_mv) / f64::from(NOMINAL_MV));
        }
        None
    }

    fn step(&mut self, watch: [[bool; 2]; WHEELS], drives: [MotorDrive; WHEELS], battery: f64) {
        self.grid += STEP;
        for ((wheel, drive), watch) in self.wheels.iter_mut().zip(drives).zip(watch) {
            let stuck = wheel.fault == WheelFault::EncoderStuck;
            wheel.edges += wheel.mm_s * EDGES_PER_MM * (STEP as f64 / SECOND as f64);
            wheel.mm_s = wheel.next_speed(drive, battery);
            let stands = if stuck { wheel.stuck_at } else { wheel.edges };
            // Channels that nobody watches must not fall behind; the others report every edge.
            for channel in [Channel::A, Channel::B] {
                if !watch[channel as usize] {
                    wheel.reported[channel as usize] = cell(stands, channel);
                }
            }
        }
    }
}

const _: () = assert!(MS.is_multiple_of(STEP));

#[cfg(test)]
mod tests {
    use super::*;

    const WATCH_A: [[bool; 2]; 2] = [[true, false]; 2];

    /// Runs for `duration`, returns the edges of the left wheel's A with their times and B's level.
    fn run(drive: &mut Drive, from: Ps, duration: Ps, motor: MotorDrive) -> Vec<(Ps, bool, bool)> {
        let mut edges = Vec::new();
        let mut t = drive.next_event(WATCH_A);
        while t <= from + duration {
            if let Some(edge) = drive.event(t, WATCH_A, [motor, MotorDrive::default()], NOMINAL_MV)
                && edge.wheel == 0
            {
                edges.push((t, edge.high, drive.level(t, 0, Channel::B)));
            }
            t = drive.next_event(WATCH_A);
        }
        edges
    }

    #[test]
    fn forward_has_b_low_at_a_rising_edge_of_a_and_backward_high() {
        for forward in [true, false] {
            let mut drive = Drive::new();
            let edges = run(&mut drive, 0, SECOND / 2, MotorDrive { duty: 0.5, forward });
            assert!(edges.len() > 1000, "only {} edges", edges.len());
            assert!(edges.iter().all(|&(_, a, b)| (a == b) != forward));
        }
    }

    #[test]
    fn edges_count_the_distance_rolled() {
        let mut drive = Drive::new();
        let edges = run(&mut drive, 0, SECOND, MotorDrive { duty: 0.4, forward: true });
        let [left, right] = drive.travel_mm(SECOND);
        assert!((left * 12.0 - edges.len() as f64).abs() <= 1.0);
        assert!(left > 300.0 && left < 400.0, "{left} mm");
        assert_eq!(right, 0.0);
    }

    #[test]
    fn a_small_duty_does_not_move_the_wheel_and_a_cut_one_stops_it() {
        let mut drive = Drive::new();
        assert!(run(&mut drive, 0, SECOND, MotorDrive { duty: 0.03, forward: true }).is_empty());
        run(&mut drive, SECOND, SECOND, MotorDrive { duty: 0.3, forward: true });
        run(&mut drive, 2 * SECOND, SECOND, MotorDrive::default());
        assert_eq!(drive.speeds_mm_s(), [0.0, 0.0]);
    }

    #[test]
    fn faults_do_what_they_say() {
        let full = MotorDrive { duty: 1.0, forward: true };
        let mut stuck = Drive::new();
        stuck.set_fault(0, WheelFault::EncoderStuck, 0);
        assert!(run(&mut stuck, 0, SECOND, full).is_empty());
        assert!(stuck.speeds_mm_s()[0] > 900.0);
        let mut stalled = Drive::new();
        stalled.set_fault(0, WheelFault::Stalled, 0);
        assert!(run(&mut stalled, 0, SECOND, full).is_empty());
        assert_eq!(stalled.travel_mm(SECOND), [0.0, 0.0]);
    }
}
