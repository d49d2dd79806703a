//! Pitch, physics, referee and the two-eye renderer.
//!
//! Coordinates are mm: x towards the goal that our robot attacks, y left, the origin on the centre
//! spot. Time advances in steps of [`TICK`].

pub mod camera;
pub mod physics;
pub mod picture;
pub mod pitch;
pub mod referee;
pub mod render;

use common_sys::vision::rgb565;
use sim::{MS, Ps};

use camera::{Camera, Eye, HEIGHT, WIDTH};
use physics::{Physics, Pose};
pub use render::BallColour;
use render::{Frame, Scene};

/// Simulated time of one [`World::step`].
pub const TICK: Ps = MS;
/// Every so many ticks a point of the tracks is kept.
const TRACK_TICKS: u32 = 20;

/// What the cameras deliver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Eyes {
    /// What is before them.
    #[default]
    Open,
    /// Black pictures.
    Black,
}

/// What a world is made of.
#[derive(Clone, Debug, Default)]
pub struct Setup {
    /// Draws the kick-off.
    pub seed: u64,
    /// What the cameras deliver.
    pub eyes: Eyes,
    /// Colour of the ball.
    pub ball: BallColour,
}

/// Where things have been, for the picture.
#[derive(Clone, Debug, Default)]
pub struct Tracks {
    /// Both robots.
    pub robots: [Vec<Pose>; 2],
    /// The ball.
    pub ball: Vec<[f64; 2]>,
}

/// A pitch with two robots and a ball.
pub struct World {
    setup: Setup,
    kick_off: referee::KickOff,
    physics: Physics,
    ticks: u32,
    goals: [u32; 2],
    tracks: Tracks,
    frame: Frame,
}

impl World {
    /// Everything where the seed puts it, at rest.
    pub fn new(setup: &Setup) -> Self {
        let kick_off = referee::kick_off(setup.seed);
        let mut world = Self {
            setup: setup.clone(),
            kick_off,
            physics: Physics::new(kick_off.robots, kick_off.ball_mm),
            ticks: 0,
            goals: [0; 2],
            tracks: Tracks::default(),
            frame: Frame::new(),
        };
        world.track();
        world
    }

    /// One [`TICK`], with these speeds of left and right wheel in mm/s for both robots.
    pub fn step(&mut self, wheels_mm_s: [[f64; 2]; 2]) {
        self.physics.step(wheels_mm_s);
        self.ticks += 1;
        if self.ticks.is_multiple_of(TRACK_TICKS) {
            self.track();
        }
        if self.goals == [0, 0] && let Some(robot) = referee::scorer(self.physics.ball_mm()) {
            self.goals[robot] += 1;
            self.track();
        }
    }

    fn track(&mut self) {
        for (index, track) in self.tracks.robots.iter_mut().enumerate() {
            track.push(self.physics.robot(index));
        }
        self.tracks.ball.push(self.physics.ball_mm());
    }

    /// Goals of robot 0 and of robot 1.
    pub fn goals(&self) -> [u32; 2] {
        self.goals
    }

    /// Heading at kick-off in degrees, -180..=180, 0 = towards the goal that the robot attacks,
    /// positive = turned left.
    pub fn kick_off_heading_deg(&self, robot: usize) -> f64 {
        let heading = self.kick_off.robots[robot].heading_rad.to_degrees();
        let attacked = if robot == 0 { heading } else { heading + 180.0 };
        let turned = libm::fmod(attacked, 360.0);
        if turned > 180.0 { turned - 360.0 } else { turned }
    }

    /// Where a robot is.
    pub fn robot(&self, robot: usize) -> Pose {
        self.physics.robot(robot)
    }

    /// Where the ball is.
    pub fn ball_mm(&self) -> [f64; 2] {
        self.physics.ball_mm()
    }

    /// Where everything has been.
    pub fn tracks(&self) -> &Tracks {
        &self.tracks
    }

    /// What a robot's eyes see now: `WIDTH` * `HEIGHT` RGB565 pixels each, row by row.
    ///
    /// # Panics
    /// If a buffer has another length.
    pub fn render(&mut self, robot: usize, left: &mut [u16], right: &mut [u16]) {
        for (eye, pixels) in [(Eye::Left, left), (Eye::Right, right)] {
            assert_eq!(pixels.len(), WIDTH * HEIGHT, "a frame has {WIDTH}x{HEIGHT} pixels");
            if self.setup.eyes == Eyes::Black {
                pixels.fill(0);
                continue;
            }
            let scene = Scene {
                ball_mm: Some(self.physics.ball_mm()),
                ball_colour: self.setup.ball,
                robot: Some(self.physics.robot(1 - robot)),
            };
            let camera = Camera::of_robot(self.physics.robot(robot), eye);
            render::render(&camera, &scene, &mut self.frame);
            for (pixel, colour) in pixels.iter_mut().zip(&self.frame) {
                let [r, g, b] = colour.map(to_byte);
                *pixel = rgb565(r, g, b);
            }
        }
    }
}

/// A channel 0..1 as the sensor's eight bits.
fn to_byte(channel: f32) -> u8 {
    (channel * 255.0 + 0.5).clamp(0.0, 255.0) as u8
}
