//! Pitch, physics, rules, opponents and the two-eye renderer.
//!
//! Coordinates are mm: x towards the goal that robot 0 attacks in the first half, y left, the origin on
//! the centre spot. Time advances in steps of [`TICK`].

pub mod camera;
mod canvas;
pub mod chronicle;
mod font;
pub mod materials;
pub mod noise;
pub mod open_floor;
pub mod opponents;
pub mod physics;
pub mod picture;
pub mod pitch;
pub mod proximity;
pub mod referee;
pub mod render;
pub mod sensor;
mod shade;
pub mod sight;
mod stretch;

use common_sys::link::Report;
use common_sys::vision::rgb565;
use image::RgbImage;
use pulp::{Arch, NullaryFnOnce};
use sim::{MS, Ps, SECOND};

use camera::{Camera, Eye, HEIGHT, WIDTH};
use chronicle::{Chronicle, Instant, Mark};
use materials::Materials;
pub use noise::Noise;
use physics::{Physics, Pose};
use referee::KickOff;
pub use render::BallColour;
use render::{Frame, Scene};
use sensor::Sensors;
use sight::Sights;

/// Simulated time of one [`World::step`].
pub const TICK: Ps = MS;
/// Every so many ticks a point of the tracks is kept.
const TRACK_TICKS: u32 = 20;
/// So many of the latest exposures are remembered for the picture: a report is a frame or two late.
const SEEN: usize = 4;

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
    /// Draws what robots, eyes and floor are like.
    pub seed: u64,
    /// What the cameras deliver.
    pub eyes: Eyes,
    /// Colour of the ball.
    pub ball: BallColour,
    /// How far cameras, wheels and floor are from perfect.
    pub noise: Noise,
    /// Friction, losses, masses.
    pub materials: Materials,
}

/// How a pair of frames is taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure {
    /// What the report of this pair will bear, by which a picture finds the moment again.
    pub time: u16,
    /// 640x480 instead of 320x240.
    pub large: bool,
    /// What the sensors make of the light, left and right eye, red, green and blue: 1 as it is.
    pub light: [[f32; 3]; 2],
}

impl Exposure {
    /// At 320x240, with the light as it is.
    pub fn plain(time: u16) -> Self {
        Self { time, large: false, light: [[1.0; 3]; 2] }
    }

    /// Pixels of a row.
    pub fn width(&self) -> usize {
        if self.large { 2 * WIDTH } else { WIDTH }
    }

    /// Rows of a frame.
    pub fn height(&self) -> usize {
        if self.large { 2 * HEIGHT } else { HEIGHT }
    }
}

/// Where things have been since the last kick-off, for the picture; turned so that robot 0 plays
/// towards +x.
#[derive(Clone, Debug, Default)]
pub struct Tracks {
    /// Both robots.
    pub robots: [Vec<Pose>; 2],
    /// The ball.
    pub ball: Vec<[f64; 2]>,
}

impl Tracks {
    fn push(&mut self, moment: &Moment, side: f64) {
        let turn = if side > 0.0 { 0.0 } else { core::f64::consts::PI };
        for (track, pose) in self.robots.iter_mut().zip(moment.robots) {
            track.push(Pose {
                x_mm: pose.x_mm * side,
                y_mm: pose.y_mm * side,
                heading_rad: pose.heading_rad + turn,
            });
        }
        self.ball.push(moment.ball_mm.map(|v| v * side));
    }
}

/// Where everything is at one time.
#[derive(Clone, Copy, Debug)]
struct Moment {
    /// What the report of this exposure will say as its time.
    exposure_time: u16,
    robots: [Pose; 2],
    ball_mm: [f64; 2],
}

/// A pitch with two robots and a ball.
#[derive(Clone)]
pub struct World {
    setup: Setup,
    physics: Physics,
    ticks: u32,
    attacks: [f64; 2],
    last_touch: Option<usize>,
    chronicle: Chronicle,
    tracks: Tracks,
    seen: [Vec<Moment>; 2],
    kept: [Option<(u16, Moment)>; 2],
    frame: Frame,
    sensors: [Option<Sensors>; 2],
}

impl World {
    /// Everything somewhere, at rest: the referee's first call puts it elsewhere.
    pub fn new(setup: &Setup) -> Self {
        let aside = |side: f64| Pose { x_mm: side * 200.0, ..Pose::default() };
        let robots = [aside(-1.0), aside(1.0)];
        Self {
            setup: setup.clone(),
            physics: Physics::new(robots, [0.0; 2], setup.materials, setup.noise, setup.seed),
            ticks: 0,
            attacks: [1.0, -1.0],
            last_touch: None,
            chronicle: Chronicle::new(&setup.materials),
            tracks: Tracks::default(),
            seen: [Vec::new(), Vec::new()],
            kept: [None; 2],
            frame: Frame::new(),
            sensors: [0, 1].map(|robot| Sensors::new(setup.noise, setup.seed, robot)),
        }
    }

    /// Handlers put everything where it belongs; robots attack +x (1) or -x (-1).
    pub fn kick_off(&mut self, places: &KickOff, attacks: [f64; 2]) {
        self.physics.place(places.robots, places.ball_mm);
        self.attacks = attacks;
        self.last_touch = None;
        self.chronicle.mark(Mark::KickOff, [0.0; 2]);
        self.tracks = Tracks::default();
        self.track();
    }

    /// A handler puts the ball here.
    pub fn free_ball(&mut self, at_mm: [f64; 2]) {
        self.physics.place_ball(at_mm);
        self.chronicle.mark(Mark::FreeBall, at_mm);
    }

    /// A robot gets a goal.
    pub fn goal(&mut self, robot: usize) {
        let ball_mm = self.turned(self.ball_mm());
        self.chronicle.mark(Mark::Goal(robot), ball_mm);
    }

    /// A place or a velocity as it is for pictures, in which robot 0 always plays towards +x.
    fn turned(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [x * self.attacks[0], y * self.attacks[0]]
    }

    /// One [`TICK`], with these speeds of left and right wheel in mm/s for both robots.
    pub fn step(&mut self, wheels_mm_s: [[f64; 2]; 2]) {
        self.physics.step(wheels_mm_s);
        self.ticks += 1;
        if self.ticks.is_multiple_of(TRACK_TICKS) {
            self.track();
        }
        let touches = [0, 1].map(|robot| self.physics.touches(robot));
        for robot in [0, 1] {
            if touches[robot] {
                self.last_touch = Some(robot);
            }
        }
        let ball = self.ball_mm();
        let apart = |robot: Pose| libm::hypot(robot.x_mm - ball[0], robot.y_mm - ball[1]);
        self.chronicle.step(&Instant {
            ball_mm: self.turned(ball),
            ball_mm_s: self.turned(self.physics.ball_mm_s()),
            apart_mm: [0, 1].map(|robot| apart(self.robot(robot))),
            touches,
        });
    }

    fn track(&mut self) {
        let now = self.now(0);
        self.tracks.push(&now, self.attacks[0]);
    }

    /// Which way a robot plays: +1 towards +x, -1 towards -x.
    pub fn attacks(&self, robot: usize) -> f64 {
        self.attacks[robot]
    }

    /// Who touched the ball last since the kick-off.
    pub fn last_touch(&self) -> Option<usize> {
        self.last_touch
    }

    /// Heading in degrees, -180..=180, as a handler sees it: 0 = towards the goal that the robot
    /// attacks, positive = turned left.
    pub fn heading_deg(&self, robot: usize) -> f64 {
        let heading = self.physics.robot(robot).heading_rad.to_degrees();
        let attacked = if self.attacks[robot] > 0.0 { heading } else { heading + 180.0 };
        let turned = libm::fmod(attacked, 360.0);
        if turned > 180.0 {
            turned - 360.0
        } else if turned < -180.0 {
            turned + 360.0
        } else {
            turned
        }
    }

    /// What there truly is to be seen for a robot now.
    pub fn sights(&self, robot: usize) -> Sights {
        self.sights_of(&self.now(0), robot)
    }

    /// The same when the frames were exposed that a report tells about, one of the latest.
    pub fn sights_then(&self, robot: usize, exposure_time: u16) -> Option<Sights> {
        let mut seen = self.seen[robot].iter();
        let moment = seen.find(|moment| moment.exposure_time == exposure_time)?;
        Some(self.sights_of(moment, robot))
    }

    fn sights_of(&self, moment: &Moment, robot: usize) -> Sights {
        sight::Around {
            me: moment.robots[robot],
            other: moment.robots[1 - robot],
            ball_mm: moment.ball_mm,
            attacks: self.attacks[robot],
        }
        .sights()
    }

    /// What moves.
    pub fn physics(&self) -> &Physics {
        &self.physics
    }

    /// A robot's battery voltage, as part of the nominal one.
    pub fn battery(&mut self, robot: usize) -> f64 {
        self.physics.drive_mut(robot).battery
    }

    /// What a robot's base gets from its surroundings: readings of the infrared sensors.
    pub fn infrared(&mut self, robot: usize) -> [u16; proximity::SENSORS] {
        let readings = self.proximity_mm(robot).map(proximity::reading);
        self.physics.drive_mut(robot).infrared(readings)
    }

    /// What a robot without firmware may know.
    pub fn drive_opponent(&self, opponent: &mut opponents::Opponent, robot: usize) -> [f64; 2] {
        let scene = self.scene(&self.now(0), robot);
        opponent.step(&opponents::Surroundings {
            pose: self.physics.robot(robot),
            ball_mm: self.physics.ball_mm(),
            attacks: self.attacks[robot],
            scene: &scene,
        })
    }

    /// Where a robot is.
    pub fn robot(&self, robot: usize) -> Pose {
        self.physics.robot(robot)
    }

    /// Where the ball is.
    pub fn ball_mm(&self) -> [f64; 2] {
        self.physics.ball_mm()
    }

    /// What the proximity sensors of a robot are from, mm; see [`proximity`].
    pub fn proximity_mm(&self, robot: usize) -> [f64; proximity::SENSORS] {
        let other = self.physics.robot(1 - robot);
        let others = [
            ([other.x_mm, other.y_mm], pitch::ROBOT_RADIUS_MM),
            (self.physics.ball_mm(), pitch::BALL_RADIUS_MM),
        ];
        proximity::distances_mm(self.physics.robot(robot), &others)
    }

    /// Where everything has been.
    pub fn tracks(&self) -> &Tracks {
        &self.tracks
    }

    /// Keep what the robot's eyes saw when the frames were exposed that this report, one of the latest,
    /// tells about: a picture can then be made with it at any time. One moment a robot is kept.
    pub fn keep(&mut self, robot: usize, report: &Report) {
        let time = report.exposure_time;
        self.kept[robot] = Some((time, self.seen_scene(robot, Some(time))));
    }

    /// The match in one picture: both eyes of `robot` when the frames were exposed that `report` tells
    /// about (kept, or one of the last few; the latest that [`World::render`] drew, if none of them
    /// fits), with its findings drawn in, and the pitch with the tracks.
    pub fn picture(&self, robot: usize, report: Option<&Report>, goals: [u32; 2]) -> RgbImage {
        let time = report.map(|report| report.exposure_time);
        let kept = self.kept[robot].filter(|(kept, _)| Some(*kept) == time);
        let scene = kept.map_or_else(|| self.seen_scene(robot, time), |(_, moment)| moment);
        picture::draw(&picture::Story {
            eyes: [Eye::Left, Eye::Right].map(|eye| self.eye_picture(&scene, robot, eye)),
            report,
            tracks: &self.tracks_until_now(),
            chronicle: &self.chronicle,
            goals,
            seconds: f64::from(self.ticks) * TICK as f64 / SECOND as f64,
            seed: self.setup.seed,
            robot,
        })
    }

    /// Where everything was when a frame was exposed; now, if that is not known.
    fn seen_scene(&self, robot: usize, exposure_time: Option<u16>) -> Moment {
        let mut seen = self.seen[robot].iter();
        exposure_time
            .and_then(|time| seen.clone().find(|moment| moment.exposure_time == time))
            .or_else(|| seen.next_back())
            .copied()
            .unwrap_or_else(|| self.now(0))
    }

    /// What an eye sees, for people.
    fn eye_picture(&self, moment: &Moment, robot: usize, eye: Eye) -> RgbImage {
        let mut frame = Frame::new();
        if self.setup.eyes == Eyes::Open {
            let camera = Camera::of_robot(moment.robots[robot], eye);
            render::render(&camera, &self.scene(moment, robot), &mut frame);
            // As bad as the frame was; only that frame's noise is not kept.
            if let Some(mut sensors) = self.sensors[robot].clone() {
                sensors.expose(eye, &mut frame);
            }
        }
        RgbImage::from_fn(WIDTH as u32, HEIGHT as u32, |x, y| {
            let colour = frame.get(y as usize * WIDTH + x as usize);
            image::Rgb(colour.map_or([0; 3], |colour| colour.map(to_byte)))
        })
    }

    fn tracks_until_now(&self) -> Tracks {
        let mut tracks = self.tracks.clone();
        tracks.push(&self.now(0), self.attacks[0]);
        tracks
    }

    fn now(&self, exposure_time: u16) -> Moment {
        Moment {
            exposure_time,
            robots: [self.physics.robot(0), self.physics.robot(1)],
            ball_mm: self.physics.ball_mm(),
        }
    }

    fn scene(&self, moment: &Moment, robot: usize) -> Scene {
        Scene {
            ball_mm: Some(moment.ball_mm),
            ball_colour: self.setup.ball,
            robot: Some(moment.robots[1 - robot]),
        }
    }

    /// What a robot's eyes see now: RGB565 pixels, row by row, as many as the exposure says.
    ///
    /// # Panics
    /// If a buffer has another length.
    pub fn expose(
        &mut self,
        robot: usize,
        exposure: &Exposure,
        left: &mut [u16],
        right: &mut [u16],
    ) {
        let moment = self.now(exposure.time);
        let seen = &mut self.seen[robot];
        if seen.len() == SEEN {
            seen.remove(0);
        }
        seen.push(moment);
        let (width, height) = (exposure.width(), exposure.height());
        for (eye, pixels) in [(Eye::Left, left), (Eye::Right, right)] {
            assert_eq!(pixels.len(), width * height, "a frame has {width}x{height} pixels");
            if self.setup.eyes == Eyes::Black {
                pixels.fill(0);
                continue;
            }
            let light = exposure.light[eye as usize];
            let camera = Camera::of_robot(moment.robots[robot], eye);
            if !exposure.large {
                self.shoot(&camera, &moment, robot, eye, light);
                Arch::new().dispatch(ReadOut { frame: &self.frame, pixels });
                continue;
            }
            for (column, row) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                self.shoot(&camera.quarter(column, row), &moment, robot, eye, light);
                let rows = pixels.chunks_exact_mut(2 * WIDTH).skip(row).step_by(2);
                for (row, colours) in rows.zip(self.frame.chunks_exact(WIDTH)) {
                    let places = row.iter_mut().skip(column).step_by(2);
                    for (pixel, colour) in places.zip(colours) {
                        *pixel = to_pixel(*colour);
                    }
                }
            }
        }
    }

    /// One eye's frame of 320x240, to `self.frame`.
    fn shoot(&mut self, camera: &Camera, moment: &Moment, robot: usize, eye: Eye, light: [f32; 3]) {
        render::render(camera, &self.scene(moment, robot), &mut self.frame);
        if light != [1.0; 3] {
            for colour in &mut self.frame {
                for (channel, factor) in colour.iter_mut().zip(light) {
                    *channel *= factor;
                }
            }
        }
        if let Some(sensors) = &mut self.sensors[robot] {
            sensors.expose(eye, &mut self.frame);
        }
    }
}

/// A frame to be turned into pixels; compiled for several sets of instructions.
struct ReadOut<'a> {
    frame: &'a Frame,
    pixels: &'a mut [u16],
}

impl NullaryFnOnce for ReadOut<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for (pixel, colour) in self.pixels.iter_mut().zip(self.frame) {
            *pixel = to_pixel(*colour);
        }
    }
}

#[inline(always)]
fn to_pixel(colour: shade::Rgb) -> u16 {
    let [r, g, b] = colour.map(to_byte);
    rgb565(r, g, b)
}

/// A channel 0..1 as the sensor's eight bits.
#[inline(always)]
fn to_byte(channel: f32) -> u8 {
    sensor::rounded((channel * 255.0).clamp(0.0, 255.0)).1
}
