//! A robot on its own: switched on, on a pitch where nobody starts a match, for whoever works on its
//! firmware or plugs a host into it. Its wheels move it, its cameras see the pitch.

use fx2::Fx2;
use fx2::host::Link;
use sim::Ps;
use world::physics::Pose;
use world::{Exposure, Setup, World};

use crate::cameras::Cameras;
use crate::robot::Robot;

/// Which of the world's robots is ours.
const OURS: usize = 0;

/// The robot and its quiet world.
#[derive(Clone)]
pub struct Desk {
    /// The robot.
    pub robot: Robot,
    world: World,
    cameras: Cameras,
    next_tick: Ps,
    /// What the pixels of the last exposure were drawn for: while nothing moves, they stay.
    drawn: Option<(Pose, [f64; 2], Exposure)>,
}

impl Desk {
    /// `robot` where `seed` puts it at kick-off, with perfect cameras.
    pub fn new(robot: Robot, seed: u64) -> Self {
        let start = robot.now().next_multiple_of(world::TICK);
        let setup = Setup { seed, ..Setup::default() };
        Self {
            robot,
            world: World::new(&setup),
            cameras: Cameras::new(start),
            next_tick: start,
            drawn: None,
        }
    }

    /// What the cameras have sent last, or are sending: left and right eye.
    pub fn last_pair(&self) -> [&[u16]; 2] {
        self.cameras.last_pair()
    }

    /// Mean of green in it, 0..1.
    pub fn brightness(&self) -> f64 {
        let [left, right] = self.last_pair();
        let sum: u64 = left.iter().chain(right).map(|pixel| u64::from(pixel >> 5 & 0x3F)).sum();
        sum as f64 / (63 * (left.len() + right.len()).max(1)) as f64
    }

    fn tick(&mut self) {
        let ours = self.robot.base.wheel_speeds_mm_s();
        self.world.step([ours, [0.0; 2]]);
        self.next_tick += world::TICK;
        // Nobody counts them here; they must not pile up.
        self.robot.turret.take_reports();
    }

    fn see(&mut self, now: Ps) {
        let Self { robot, world, cameras, drawn, .. } = self;
        cameras.step(now, robot, |exposure, left, right| {
            let scene = (world.robot(OURS), world.ball_mm(), Exposure { time: 0, ..*exposure });
            if *drawn != Some(scene) {
                world.expose(OURS, exposure, left, right);
                *drawn = Some(scene);
            }
        });
    }
}

impl Link for Desk {
    fn fx2(&mut self) -> &mut Fx2 {
        self.robot.fx2()
    }

    /// Runs everything until `t`.
    fn run_until(&mut self, t: Ps) {
        while self.robot.now() < t {
            let next = self.next_tick.min(self.cameras.next_event()).min(t);
            self.robot.run_until(next);
            if next == self.next_tick {
                self.tick();
            }
            self.see(next);
        }
    }
}
