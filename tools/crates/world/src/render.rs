//! What an eye sees: rays through pixels, to the nearest surface.
//!
//! Every pixel is first looked at through its centre. Where neighbours show different surfaces, the
//! pixel is looked at again through 16 points, so that edges lie where they should to a sixteenth of a
//! pixel or so: disparities are measured to that. White lines are thinner than a pixel far away; their
//! share of a pixel is computed instead.

use crate::camera::{Camera, HEIGHT, WIDTH};
use crate::physics::Pose;
use crate::pitch as p;

/// A colour, linear, 0..1 a channel.
type Rgb = [f32; 3];

/// A picture as a camera's sensor has it, 0..1 a channel.
pub type Frame = Vec<Rgb>;

const FLOOR: Rgb = [0.10, 0.42, 0.20];
const LINE: Rgb = [0.92, 0.92, 0.90];
const WALL: Rgb = [0.40, 0.40, 0.41];
const GOAL: Rgb = [0.02, 0.02, 0.022];
const ROOM: [Rgb; 3] = [[0.62, 0.60, 0.56], [0.24, 0.28, 0.45], [0.50, 0.46, 0.40]];
const BLACK: Rgb = [0.04, 0.04, 0.04];
const WHITE: Rgb = [0.90, 0.90, 0.88];
const TURRET: Rgb = [0.12, 0.14, 0.13];
const SEAM: Rgb = [0.86, 0.86, 0.74];

/// Colours of the ball.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BallColour {
    /// As the league plays.
    #[default]
    Yellow,
    /// One that no yellow detector may find.
    Pink,
}

impl BallColour {
    const fn rgb(self) -> Rgb {
        match self {
            Self::Yellow => [0.93, 0.80, 0.12],
            Self::Pink => [0.93, 0.45, 0.68],
        }
    }
}

/// What there is to see.
#[derive(Clone, Copy, Debug)]
pub struct Scene {
    /// Centre of the ball on the floor plane; None = no ball.
    pub ball_mm: Option<[f64; 2]>,
    /// Its colour.
    pub ball_colour: BallColour,
    /// Robots to be seen: all but the one that looks.
    pub robot: Option<Pose>,
}

/// Surfaces that may border on each other in a picture.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Surface {
    Floor,
    Wall,
    Goal,
    Room,
    Ball,
    Stripe(u8),
    Turret,
}

/// The walls as planes n . p = c, seen from inside: normals point outwards.
const SQRT_HALF: f32 = core::f32::consts::FRAC_1_SQRT_2;
const CORNER: f32 = (p::HALF_LENGTH_MM + p::HALF_WIDTH_MM - p::CORNER_CUT_MM) as f32 * SQRT_HALF;
const WALLS: [([f32; 2], f32); 8] = [
    ([1.0, 0.0], p::HALF_LENGTH_MM as f32),
    ([-1.0, 0.0], p::HALF_LENGTH_MM as f32),
    ([0.0, 1.0], p::HALF_WIDTH_MM as f32),
    ([0.0, -1.0], p::HALF_WIDTH_MM as f32),
    ([SQRT_HALF, SQRT_HALF], CORNER),
    ([-SQRT_HALF, SQRT_HALF], CORNER),
    ([SQRT_HALF, -SQRT_HALF], CORNER),
    ([-SQRT_HALF, -SQRT_HALF], CORNER),
];

/// A scene as one camera sees it, with what can be computed once a picture.
struct View<'a> {
    camera: &'a Camera,
    scene: &'a Scene,
    /// Distance of each wall from the lens.
    wall_distance: [f32; 8],
    ball: Option<[f32; 3]>,
    robot: Option<[f32; 3]>,
}

/// Pixels that may show an object: x and y ranges.
type Bounds = [core::ops::Range<usize>; 2];

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn scale(colour: Rgb, factor: f32) -> Rgb {
    colour.map(|channel| channel * factor)
}

fn mix(a: Rgb, b: Rgb, share_of_b: f32) -> Rgb {
    [0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * share_of_b)
}

/// A fixed random number in -1..1 for a place on a grid: grain of floor and felt.
fn grain(x: i32, y: i32, z: i32) -> f32 {
    let mut h = (x as u32).wrapping_mul(0x9E37_79B1)
        ^ (y as u32).wrapping_mul(0x85EB_CA77)
        ^ (z as u32).wrapping_mul(0xC2B2_AE3D);
    h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
    h ^= h >> 13;
    (h & 0xFFFF) as f32 / 32768.0 - 1.0
}

/// Draw what `camera` sees of `scene` into `frame`.
pub fn render(camera: &Camera, scene: &Scene, frame: &mut Frame) {
    let view = View::new(camera, scene);
    let ball_bounds = view.ball_bounds();
    let robot_bounds = view.robot_bounds();
    let mut surfaces = vec![Surface::Floor; WIDTH * HEIGHT];
    frame.resize(WIDTH * HEIGHT, [0.0; 3]);

    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let inside = |b: &Bounds| b[0].contains(&x) && b[1].contains(&y);
            let ray = camera.ray(x as f32, y as f32);
            let (surface, colour) = view.look(ray, inside(&ball_bounds), inside(&robot_bounds));
            surfaces[y * WIDTH + x] = surface;
            frame[y * WIDTH + x] = colour;
        }
    }
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            if borders(&surfaces, x, y) {
                frame[y * WIDTH + x] = view.look_closely(x, y);
            }
        }
    }
}

/// Whether a neighbour shows another surface.
fn borders(surfaces: &[Surface], x: usize, y: usize) -> bool {
    let here = surfaces[y * WIDTH + x];
    (x > 0 && surfaces[y * WIDTH + x - 1] != here)
        || (x + 1 < WIDTH && surfaces[y * WIDTH + x + 1] != here)
        || (y > 0 && surfaces[(y - 1) * WIDTH + x] != here)
        || (y + 1 < HEIGHT && surfaces[(y + 1) * WIDTH + x] != here)
}

impl<'a> View<'a> {
    fn new(camera: &'a Camera, scene: &'a Scene) -> Self {
        let at = camera.at;
        let centre = |xy: [f64; 2], z: f64| [xy[0] as f32, xy[1] as f32, z as f32];
        Self {
            camera,
            scene,
            wall_distance: WALLS.map(|(n, c)| c - n[0] * at[0] - n[1] * at[1]),
            ball: scene.ball_mm.map(|ball| centre(ball, p::BALL_RADIUS_MM)),
            robot: scene.robot.map(|robot| centre([robot.x_mm, robot.y_mm], 0.0)),
        }
    }

    /// Bounds of a sphere in the picture, generously; everything if it is very near.
    fn bounds(&self, centre: [f32; 3], radius: f32) -> Bounds {
        let clamp = |low: f32, high: f32, most: usize| {
            (low.max(0.0) as usize).min(most)..(high.max(0.0) as usize).min(most)
        };
        let Some([x, y, depth]) = self.camera.project(centre) else {
            let offset = [0, 1, 2].map(|i| centre[i] - self.camera.at[i]);
            let near = dot(offset, offset) < (3.0 * radius) * (3.0 * radius);
            return if near { [0..WIDTH, 0..HEIGHT] } else { [0..0, 0..0] };
        };
        if depth < 2.0 * radius {
            return [0..WIDTH, 0..HEIGHT];
        }
        // A sphere off the axis appears as an ellipse, larger by at most 1/cos of its angle.
        let size = crate::camera::FOCAL_PX as f32 * radius / (depth - radius) * 1.4 + 2.0;
        [clamp(x - size, x + size + 1.0, WIDTH), clamp(y - size, y + size + 1.0, HEIGHT)]
    }

    fn ball_bounds(&self) -> Bounds {
        self.ball.map_or([0..0, 0..0], |ball| self.bounds(ball, p::BALL_RADIUS_MM as f32))
    }

    fn robot_bounds(&self) -> Bounds {
        let half_height = p::ROBOT_HEIGHT_MM as f32 / 2.0;
        let radius = p::ROBOT_RADIUS_MM as f32;
        self.robot.map_or([0..0, 0..0], |[x, y, _]| {
            self.bounds([x, y, half_height], (half_height * half_height + radius * radius).sqrt())
        })
    }

    /// The mean over 16 points of a pixel.
    fn look_closely(&self, x: usize, y: usize) -> Rgb {
        let mut sum = [0.0; 3];
        for sub_y in 0..4 {
            for sub_x in 0..4 {
                let ray = self.camera.ray(
                    x as f32 + (sub_x as f32 - 1.5) / 4.0,
                    y as f32 + (sub_y as f32 - 1.5) / 4.0,
                );
                let (_, colour) = self.look(ray, true, true);
                sum = [0, 1, 2].map(|i| sum[i] + colour[i]);
            }
        }
        scale(sum, 1.0 / 16.0)
    }

    /// The nearest surface along a ray, and its colour.
    fn look(&self, ray: [f32; 3], maybe_ball: bool, maybe_robot: bool) -> (Surface, Rgb) {
        let ball = if maybe_ball { self.hit_ball(ray) } else { None };
        let robot = if maybe_robot { self.hit_robot(ray) } else { None };
        match (ball, robot) {
            (Some((near, colour)), Some((far, ..))) if near <= far => (Surface::Ball, colour),
            (Some((_, colour)), None) => (Surface::Ball, colour),
            (_, Some((_, surface, colour))) => (surface, colour),
            (None, None) => self.look_at_pitch(ray),
        }
    }

    fn hit_ball(&self, ray: [f32; 3]) -> Option<(f32, Rgb)> {
        let centre = self.ball?;
        let radius = p::BALL_RADIUS_MM as f32;
        let offset = [0, 1, 2].map(|i| self.camera.at[i] - centre[i]);
        let (a, b) = (dot(ray, ray), dot(ray, offset));
        let c = dot(offset, offset) - radius * radius;
        let root = b * b - a * c;
        if root < 0.0 {
            return None;
        }
        let distance = (-b - root.sqrt()) / a;
        if distance <= 0.0 {
            return None;
        }
        let normal = [0, 1, 2].map(|i| (offset[i] + ray[i] * distance) / radius);
        Some((distance, self.felt(normal)))
    }

    /// Colour of the ball where its surface has this normal: light from above, seam, fuzz.
    fn felt(&self, normal: [f32; 3]) -> Rgb {
        let [nx, ny, nz] = normal;
        let light = 0.62 + 0.38 * nz;
        // The seam of a tennis ball: a curve that swings between both halves.
        let swing = nx * nx - ny * ny;
        let seam = (nz - 0.55 * swing).abs() < 0.05;
        let colour = if seam && self.scene.ball_colour == BallColour::Yellow {
            SEAM
        } else {
            self.scene.ball_colour.rgb()
        };
        let cell = |n: f32| (n * 24.0).floor() as i32;
        scale(colour, light * (1.0 + 0.05 * grain(cell(nx), cell(ny), cell(nz))))
    }

    fn hit_robot(&self, ray: [f32; 3]) -> Option<(f32, Surface, Rgb)> {
        let [x, y, _] = self.robot?;
        let at = self.camera.at;
        let (radius, height) = (p::ROBOT_RADIUS_MM as f32, p::ROBOT_HEIGHT_MM as f32);
        let (ox, oy) = (at[0] - x, at[1] - y);
        let a = ray[0] * ray[0] + ray[1] * ray[1];
        let b = ray[0] * ox + ray[1] * oy;
        let c = ox * ox + oy * oy - radius * radius;
        let root = b * b - a * c;
        if root < 0.0 || a == 0.0 {
            return None;
        }
        let distance = (-b - root.sqrt()) / a;
        if distance <= 0.0 {
            return None;
        }
        let z = at[2] + ray[2] * distance;
        if (0.0..=height).contains(&z) {
            let normal = [(ox + ray[0] * distance) / radius, (oy + ray[1] * distance) / radius];
            let (surface, colour) = self.dress(normal, z);
            return Some((distance, surface, colour));
        }
        self.hit_top(ray, [ox, oy], radius, height)
    }

    /// The flat top of the robot, seen from above only.
    fn hit_top(
        &self,
        ray: [f32; 3],
        offset: [f32; 2],
        radius: f32,
        height: f32,
    ) -> Option<(f32, Surface, Rgb)> {
        let above = self.camera.at[2] - height;
        if above <= 0.0 || ray[2] >= 0.0 {
            return None;
        }
        let distance = -above / ray[2];
        let (hx, hy) = (offset[0] + ray[0] * distance, offset[1] + ray[1] * distance);
        (hx * hx + hy * hy < radius * radius).then_some((distance, Surface::Turret, TURRET))
    }

    /// The striped dress, with a dark band on top where the turret looks out.
    fn dress(&self, normal: [f32; 2], z: f32) -> (Surface, Rgb) {
        let heading = self.scene.robot.map_or(0.0, |robot| robot.heading_rad as f32);
        let angle = libm::atan2f(normal[1], normal[0]) - heading;
        let turns = angle / (2.0 * core::f32::consts::PI);
        let stripe = ((turns - turns.floor()) * p::ROBOT_STRIPES as f32) as u8;
        let light = 0.75 + 0.25 * (0.6 * normal[0] + 0.8 * normal[1]);
        if z > p::ROBOT_HEIGHT_MM as f32 - 8.0 {
            return (Surface::Turret, scale(TURRET, light));
        }
        let colour = if stripe.is_multiple_of(2) { WHITE } else { BLACK };
        (Surface::Stripe(stripe), scale(colour, light))
    }

    fn look_at_pitch(&self, ray: [f32; 3]) -> (Surface, Rgb) {
        // One over the distance to the nearest wall: the largest quotient.
        let (mut nearest, mut wall) = (0.0_f32, 0);
        for (index, ((n, _), distance)) in WALLS.iter().zip(self.wall_distance).enumerate() {
            let quotient = (n[0] * ray[0] + n[1] * ray[1]) / distance;
            if quotient > nearest {
                (nearest, wall) = (quotient, index);
            }
        }
        let at = self.camera.at;
        let floor = -ray[2] / at[2];
        if floor > nearest {
            return (
                Surface::Floor,
                self.floor(at[0] + ray[0] / floor, at[1] + ray[1] / floor, floor),
            );
        }
        let distance = 1.0 / nearest;
        let hit = [0, 1, 2].map(|i| at[i] + ray[i] * distance);
        let in_goal = wall < 2
            && hit[1].abs() < p::GOAL_HALF_WIDTH_MM as f32
            && hit[2] < p::GOAL_HEIGHT_MM as f32;
        if in_goal {
            (Surface::Goal, GOAL)
        } else if hit[2] > p::WALL_HEIGHT_MM as f32 {
            (Surface::Room, room(ray))
        } else {
            (Surface::Wall, wall_colour(wall, hit))
        }
    }

    /// Colour of the floor at (x, y); `per_mm` is one over the distance along the axis.
    fn floor(&self, x: f32, y: f32, per_distance: f32) -> Rgb {
        // Light falls a little unevenly; the boards have a grain.
        let light = 1.0 + 0.06 * (x / 525.0) - 0.05 * (y / 340.0);
        let fine = grain((x / 4.0).floor() as i32, (y / 4.0).floor() as i32, 0);
        let mut colour = scale(FLOOR, light * (1.0 + 0.03 * fine));
        // A pixel covers so many mm across; along the ray more, which a line hardly notices.
        let pixel_mm = 1.0 / (per_distance * crate::camera::FOCAL_PX as f32);
        colour = mix(colour, scale(LINE, light), lines(x, y, pixel_mm));
        scale(colour, self.shadow(x, y))
    }

    /// What ball and robot leave of the light from above.
    fn shadow(&self, x: f32, y: f32) -> f32 {
        let soft = |centre: Option<[f32; 3]>, radius: f64, dark: f32| {
            centre.map_or(1.0, |c| {
                let reach = radius as f32 * 1.15;
                let (dx, dy) = (x - c[0], y - c[1]);
                let square = (dx * dx + dy * dy) / (reach * reach);
                if square < 1.0 { 1.0 - dark * (1.0 - square) } else { 1.0 }
            })
        };
        soft(self.ball, p::BALL_RADIUS_MM, 0.65) * soft(self.robot, p::ROBOT_RADIUS_MM * 1.3, 0.5)
    }
}

/// How much of a pixel at (x, y) on the floor is a white line, 0..1.
fn lines(x: f32, y: f32, pixel_mm: f32) -> f32 {
    let share = |off_centre_mm: f32, width_mm: f32| {
        let inside = (width_mm / 2.0 - off_centre_mm.abs()) / pixel_mm + 0.5;
        inside.clamp(0.0, 1.0) * (width_mm / pixel_mm).min(1.0)
    };
    let width = p::LINE_WIDTH_MM as f32;
    let mut most = share(x, width);
    let radius = (x * x + y * y).sqrt();
    most = most.max(share(radius - p::CENTRE_CIRCLE_MM as f32, width));
    most = most.max(share(radius, p::CENTRE_DOT_MM as f32));
    let depth = p::HALF_LENGTH_MM as f32 - x.abs();
    let border = p::GOAL_BORDER_MM as f32;
    let half = p::GOAL_HALF_WIDTH_MM as f32;
    if y.abs() < half + width {
        most = most.max(share(depth - border, width));
        most = most.max(share(depth, width));
    }
    if depth < border + width {
        most = most.max(share(y.abs() - half, width));
    }
    most
}

/// Grey walls, each lit a little differently.
fn wall_colour(wall: usize, hit: [f32; 3]) -> Rgb {
    const LIGHT: [f32; 8] = [1.0, 0.97, 0.88, 0.84, 0.93, 0.91, 0.90, 0.88];
    let height = 0.94 + 0.06 * hit[2] / p::WALL_HEIGHT_MM as f32;
    let cell = |v: f32| (v / 9.0).floor() as i32;
    let fine = 1.0 + 0.02 * grain(cell(hit[0]), cell(hit[1]), cell(hit[2]));
    scale(WALL, LIGHT[wall] * height * fine)
}

/// The room beyond: a few broad panels, so that there is something to see above the walls.
fn room(ray: [f32; 3]) -> Rgb {
    let bearing = libm::atan2f(ray[1], ray[0]);
    let panel = (bearing * 2.2).floor() as i32;
    ROOM[panel.rem_euclid(3) as usize]
}
