//! What an eye sees: rays through pixels, to the nearest surface.
//!
//! Along a ray of depth 1, one over the distance to a plane is linear in the picture's x and y. So of
//! floor and walls the nearest is the largest of nine linear functions, and a row of the picture falls
//! into few runs of one surface each. Ball and robot are looked for within their bounds.
//!
//! Every pixel is first looked at through its centre. Where neighbours show different surfaces, it is
//! looked at again through 16 points, each in a column and a row of its own, so that an upright or
//! level edge lies right to a sixteenth of a pixel: disparities are measured to that. White lines are
//! thinner than a pixel far away; their share of it is computed instead.

use core::ops::Range;

use pulp::{Arch, NullaryFnOnce};

use crate::camera::{Camera, FOCAL_PX, HEIGHT, WIDTH};
use crate::physics::Pose;
use crate::pitch as p;
use crate::shade::{self, GoalFace, Rgb, Spot, dot};
use crate::stretch::{Line, Stretch};

pub use crate::shade::BallColour;

/// A picture as a camera's sensor has it, 0..1 a channel.
pub type Frame = Vec<Rgb>;

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
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Surface {
    Floor,
    Wall(u8),
    Goal,
    Room(u8),
    Ball,
    Stripe(u8),
    Turret,
}

impl Surface {
    /// One byte that tells it from all others: quick to compare.
    fn key(self) -> u8 {
        match self {
            Self::Floor => 0,
            Self::Goal => 1,
            Self::Ball => 2,
            Self::Turret => 3,
            Self::Wall(wall) => 0x10 + wall,
            Self::Room(panel) => 0x20 + panel,
            Self::Stripe(stripe) => 0x40 + stripe,
        }
    }
}

/// The walls as planes n . p = c, seen from inside: normals point outwards. The first two have goals.
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
/// Walls of the room, as far from the centre spot in x and in y (assumption).
const ROOM_MM: [f32; 2] = [2200.0, 1800.0];
/// The turret above the dress (assumption).
const TURRET_RADIUS_MM: f32 = 15.0;
/// See [`TURRET_RADIUS_MM`].
const TURRET_TOP_MM: f32 = 112.0;
const BALL_RADIUS: f32 = p::BALL_RADIUS_MM as f32;
const ROBOT_RADIUS: f32 = p::ROBOT_RADIUS_MM as f32;
const ROBOT_HEIGHT: f32 = p::ROBOT_HEIGHT_MM as f32;
const STRIPES: usize = p::ROBOT_STRIPES as usize;

/// A function of the picture's x and y that is linear in both.
#[derive(Clone, Copy, Default)]
struct Linear {
    start: f32,
    across: f32,
    down: f32,
}

impl Linear {
    #[inline(always)]
    fn at(&self, [x, y]: [f32; 2]) -> f32 {
        self.start + self.across * x + self.down * y
    }

    /// Along a row.
    #[inline(always)]
    fn row(&self, y: f32) -> Line {
        Line { start: self.at([0.0, y]), slope: self.across }
    }

    /// The sum of two of them, weighed.
    #[inline(always)]
    fn sum(a: &Self, weight_a: f32, b: &Self, weight_b: f32) -> Self {
        Self {
            start: a.start * weight_a + b.start * weight_b,
            across: a.across * weight_a + b.across * weight_b,
            down: a.down * weight_a + b.down * weight_b,
        }
    }
}

/// The axis along which places on a wall are told apart.
fn along_axis(wall: usize) -> usize {
    if wall < 2 { 1 } else { 0 }
}

/// Pixels that may show an object: x and y ranges.
type Bounds = [Range<usize>; 2];
const NOWHERE: Bounds = [0..0, 0..0];
const EVERYWHERE: Bounds = [0..WIDTH, 0..HEIGHT];

fn contains(bounds: &Bounds, x: usize, y: usize) -> bool {
    bounds[0].contains(&x) && bounds[1].contains(&y)
}

/// The dress of a robot as the camera sees it: stripes by how far left of its axis a point lies.
#[derive(Clone, Copy)]
struct Dress {
    axis: [f32; 2],
    /// Direction from the axis to the left of the camera's view of it, length 1.
    lateral: [f32; 2],
    /// Where the next stripe begins, as part of the radius along `lateral`; `first` is seen before.
    begins: [f32; STRIPES],
    count: usize,
    first: u8,
}

impl Dress {
    fn new(robot: Pose, camera_at: [f32; 3]) -> Self {
        let axis = [robot.x_mm as f32, robot.y_mm as f32];
        let (dx, dy) = (camera_at[0] - axis[0], camera_at[1] - axis[1]);
        let distance = (dx * dx + dy * dy).sqrt().max(1.0);
        let towards = [dx / distance, dy / distance];
        let lateral = [-towards[1], towards[0]];
        let mut dress = Self { axis, lateral, begins: [0.0; STRIPES], count: 0, first: 0 };
        let edges: [[f32; 2]; STRIPES] = core::array::from_fn(|k| {
            let turn = 2.0 * core::f64::consts::PI * k as f64 / STRIPES as f64;
            let (sin, cos) = libm::sincos(robot.heading_rad + turn);
            [cos as f32, sin as f32]
        });
        let seen = |k: usize| edges[k][0] * towards[0] + edges[k][1] * towards[1] > 0.0;
        // The edge after one that is hidden is the first to be seen; angles grow from there.
        if let Some(start) = (0..STRIPES).find(|&k| seen(k) && !seen((k + STRIPES - 1) % STRIPES)) {
            dress.first = ((start + STRIPES - 1) % STRIPES) as u8;
            for k in (start..start + STRIPES).map(|k| k % STRIPES).take_while(|&k| seen(k)) {
                dress.begins[dress.count] = edges[k][0] * lateral[0] + edges[k][1] * lateral[1];
                dress.count += 1;
            }
        }
        dress
    }
}

/// So many points of the picture are looked at at once: the compiler computes them side by side.
const POINTS: usize = 16;

/// Points of the picture.
struct Points {
    x: [f32; POINTS],
    y: [f32; POINTS],
}

impl Points {
    #[inline(always)]
    fn at(&self, index: usize) -> [f32; 2] {
        [self.x[index], self.y[index]]
    }
}

/// What rays meet of the cylinder around a robot's dress: depth (infinite = nothing), height above the
/// floor, number of the stripe.
struct RobotHits {
    depth: [f32; POINTS],
    z: [f32; POINTS],
    stripe: [f32; POINTS],
}

/// A scene as one camera sees it, with what can be computed once a picture.
struct View<'a> {
    camera: &'a Camera,
    scene: &'a Scene,
    /// The ray's three components.
    ray: [Linear; 3],
    /// One over the distance to each wall's plane, and to the floor; negative = behind.
    walls: [Linear; 8],
    floor: Linear,
    ball: Option<[f32; 3]>,
    dress: Option<Dress>,
    ball_bounds: Bounds,
    robot_bounds: Bounds,
    /// Something stands so near a goal that its posts may hide it.
    in_goal: bool,
    /// The lens itself is in a goal: the one at this end.
    lens_in_goal: Option<usize>,
}

/// Draw what `camera` sees of `scene` into `frame`.
pub fn render(camera: &Camera, scene: &Scene, frame: &mut Frame) {
    Arch::new().dispatch(Drawing { view: View::new(camera, scene), frame });
}

/// A picture to be drawn. What is inlined into `call` is compiled for several sets of instructions, of
/// which the widest that this machine has is taken; rounding is the same with all of them.
struct Drawing<'a> {
    view: View<'a>,
    frame: &'a mut Frame,
}

impl NullaryFnOnce for Drawing<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { view, frame } = self;
        let mut keys = vec![Surface::Floor.key(); WIDTH * HEIGHT];
        frame.resize(WIDTH * HEIGHT, [0.0; 3]);
        let rows = keys.chunks_exact_mut(WIDTH).zip(frame.chunks_exact_mut(WIDTH));
        for (y, (keys, colours)) in rows.enumerate() {
            view.draw_row(y as f32, keys, colours);
        }
        for bounds in [&view.ball_bounds, &view.robot_bounds] {
            view.draw_objects(bounds, &mut keys, frame);
        }
        for index in borders(&keys) {
            frame[index] = view.look_closely(index % WIDTH, index / WIDTH);
        }
    }
}

/// What a line camera of so many cells sees of `scene` over `view_rad`, from left to right: its row is
/// the middle of `camera`'s picture. A cell is the mean of four points.
pub fn line(camera: &Camera, scene: &Scene, cells: usize, view_rad: f64) -> Vec<Rgb> {
    const PER_CELL: usize = 4;
    let view = View::new(camera, scene);
    let row = (HEIGHT - 1) as f32 / 2.0;
    let column = |point: usize| {
        let part = (point as f64 + 0.5) / (PER_CELL * cells) as f64 - 0.5;
        ((WIDTH - 1) as f64 / 2.0 + FOCAL_PX * libm::tan(part * view_rad)) as f32
    };
    let colours: Vec<Rgb> = (0..PER_CELL * cells)
        .step_by(POINTS)
        .flat_map(|first| {
            let points =
                Points { x: core::array::from_fn(|i| column(first + i)), y: [row; POINTS] };
            let objects = view.objects_at(&points, [view.ball.is_some(), view.dress.is_some()]);
            core::array::from_fn::<Rgb, POINTS, _>(|i| {
                let point = points.at(i);
                let surface = objects[i].unwrap_or_else(|| view.pitch_at(point).0);
                view.shade(surface, point)
            })
        })
        .collect();
    let mean = |points: &[Rgb]| {
        [0, 1, 2].map(|c| points.iter().map(|colour| colour[c]).sum::<f32>() / PER_CELL as f32)
    };
    colours[..PER_CELL * cells].chunks_exact(PER_CELL).map(mean).collect()
}

/// Pixels with a neighbour that shows another surface.
#[inline(always)]
fn borders(keys: &[u8]) -> Vec<usize> {
    const BLOCK: usize = 32;
    const _: () = assert!((WIDTH * HEIGHT).is_multiple_of(BLOCK));
    let mut marked = vec![false; keys.len()];
    let mut mark = |step: usize, width: usize| {
        for y in 0..keys.len() / WIDTH {
            let from = y * WIDTH;
            let (here, there) = (from..from + width, from + step..from + step + width);
            let Some(others) = keys.get(there.clone()) else { break };
            let differs = |i: usize| keys[here.start + i] != others[i];
            for (i, flag) in marked[here.clone()].iter_mut().enumerate() {
                *flag |= differs(i);
            }
            for (i, flag) in marked[there].iter_mut().enumerate() {
                *flag |= differs(i);
            }
        }
    };
    mark(1, WIDTH - 1);
    mark(WIDTH, WIDTH);
    // Most blocks of pixels have none: they are passed over as a whole.
    let blocks = (0..).step_by(BLOCK).zip(marked.chunks_exact(BLOCK));
    blocks
        .filter(|(_, flags)| flags.iter().fold(false, |any, flag| any | flag))
        .flat_map(|(first, flags)| (first..).zip(flags).filter(|(_, flag)| **flag))
        .map(|(index, _)| index)
        .collect()
}

impl<'a> View<'a> {
    fn new(camera: &'a Camera, scene: &'a Scene) -> Self {
        let at = camera.at;
        let ray = [0, 1, 2].map(|i| {
            let corner = camera.ray(0.0, 0.0)[i];
            let step = |x, y| camera.ray(x, y)[i] - corner;
            let (last_x, last_y) = ((WIDTH - 1) as f32, (HEIGHT - 1) as f32);
            Linear {
                start: corner,
                across: step(last_x, 0.0) / last_x,
                down: step(0.0, last_y) / last_y,
            }
        });
        let walls = WALLS.map(|(n, c)| {
            let distance = c - n[0] * at[0] - n[1] * at[1];
            // A lens in a goal is beyond a wall's plane and never sees that wall.
            let per = if distance > 0.1 { 1.0 / distance } else { 0.0 };
            Linear::sum(&ray[0], n[0] * per, &ray[1], n[1] * per)
        });
        let floor = Linear::sum(&ray[2], -1.0 / at[2], &ray[2], 0.0);
        let near_goal = |x: f64, radius: f64| x.abs() + radius > p::HALF_LENGTH_MM;
        let mut view = Self {
            camera,
            scene,
            ray,
            walls,
            floor,
            ball: scene.ball_mm.map(|[x, y]| [x as f32, y as f32, BALL_RADIUS]),
            dress: scene.robot.map(|robot| Dress::new(robot, at)),
            ball_bounds: NOWHERE,
            robot_bounds: NOWHERE,
            in_goal: scene.ball_mm.is_some_and(|[x, _]| near_goal(x, p::BALL_RADIUS_MM))
                || scene.robot.is_some_and(|robot| near_goal(robot.x_mm, p::ROBOT_RADIUS_MM)),
            lens_in_goal: (0..2).find(|&end| WALLS[end].0[0] * at[0] > WALLS[end].1 - 0.1),
        };
        view.ball_bounds = view.ball.map_or(NOWHERE, |ball| view.bounds(ball, BALL_RADIUS));
        view.robot_bounds = view.dress.map_or(NOWHERE, |dress| view.dress_bounds(dress.axis));
        view
    }

    /// Bounds of a sphere in the picture; everything if the lens is nearly inside.
    fn bounds(&self, centre: [f32; 3], radius: f32) -> Bounds {
        let [depth, right, down] = self.camera.seen_from_lens(centre);
        if depth < -radius {
            return NOWHERE;
        }
        if depth < 1.1 * radius {
            return EVERYWHERE;
        }
        // Tangents from the lens to the sphere, seen along one of the picture's axes.
        let range = |off: f32, middle: f32, most: usize| {
            let square = depth * depth - radius * radius;
            let swing = radius * (off * off + square).sqrt();
            let pixel =
                |sign: f32| middle + FOCAL_PX as f32 * (off * depth + sign * swing) / square;
            let low = (pixel(-1.0).max(0.0) as usize).min(most);
            let high = ((pixel(1.0) + 2.0).max(0.0) as usize).min(most);
            low..high
        };
        let [centre_x, centre_y] = self.camera.centre_px;
        [range(right, centre_x, WIDTH), range(down, centre_y, HEIGHT)]
    }

    /// Bounds of a robot: of the spheres around the lowest and the highest point of its axis.
    fn dress_bounds(&self, axis: [f32; 2]) -> Bounds {
        let [foot, top] =
            [0.0, TURRET_TOP_MM].map(|z| self.bounds([axis[0], axis[1], z], ROBOT_RADIUS));
        let both = |a: &Range<usize>, b: &Range<usize>| {
            if a.is_empty() {
                b.clone()
            } else if b.is_empty() {
                a.clone()
            } else {
                a.start.min(b.start)..a.end.max(b.end)
            }
        };
        [both(&foot[0], &top[0]), both(&foot[1], &top[1])]
    }

    /// Floor and walls of one row, run by run.
    #[inline(always)]
    fn draw_row(&self, row: f32, keys: &mut [u8], colours: &mut [Rgb]) {
        if self.lens_in_goal.is_some() {
            for (x, (key, colour)) in keys.iter_mut().zip(colours).enumerate() {
                let point = [x as f32, row];
                let surface = self.pitch_at(point).0;
                *key = surface.key();
                *colour = self.shade(surface, point);
            }
            return;
        }
        let mut x = 0;
        while x < WIDTH {
            let nearest = self.nearest_plane([x as f32, row]);
            let end = self.end_of_run(nearest, x, row);
            match nearest {
                None => self.draw_floor(row, x, &mut colours[x..end]),
                Some(wall) => {
                    self.draw_wall(wall, row, x, &mut keys[x..end], &mut colours[x..end]);
                }
            }
            x = end;
        }
    }

    /// A run of floor from column `x` on; its keys are there already. Bare boards first, then again
    /// where there may be a line or a shadow.
    #[inline(always)]
    fn draw_floor(&self, row: f32, x: usize, colours: &mut [Rgb]) {
        let floor = FloorRow::new(self, row);
        let run = x..x + colours.len();
        let grain = shade::floor_grain(&floor.spot((run.start + run.end) as f32 / 2.0));
        for (x, colour) in (x as i32..).zip(colours.iter_mut()) {
            *colour = shade::boards(floor.place(x as f32), grain);
        }
        let mut again = |part: Stretch| {
            for column in part.pixels() {
                colours[column - x] = self.shade_spot(&floor.spot(column as f32));
            }
        };
        let place = floor.lines();
        shade::each_line(Stretch::of(&run), place, floor.pixel(&run), &mut again);
        for (centre, radius, _) in self.shadows() {
            again(Stretch::of(&run).where_near(place, centre, radius));
        }
    }

    /// A run of a wall from column `first` on: plain wall first, then its goal and the room above it.
    #[inline(always)]
    fn draw_wall(&self, wall: usize, row: f32, first: usize, keys: &mut [u8], colours: &mut [Rgb]) {
        keys.fill(Surface::Wall(wall as u8).key());
        self.draw_plain_wall(wall, row, first, colours);
        let run = Stretch::of(&(first..first + colours.len()));
        let eye = self.camera.at;
        // Positive where a ray meets the wall's plane above (sign 1) or below (-1) a limit of y or z:
        // compared are the rise to the limit and the ray's, both for one unit of depth.
        let beyond = |sign: f32, axis: usize, limit: f64| {
            let rise = (eye[axis] - limit as f32) * sign;
            Linear::sum(&self.walls[wall], rise, &self.ray[axis], sign).row(row)
        };
        let above = run.where_positive(beyond(1.0, 2, p::WALL_HEIGHT_MM)).pixels();
        if !above.is_empty() {
            let here = above.start - first..above.end - first;
            self.draw_room(row, above.start, &mut keys[here.clone()], &mut colours[here]);
        }
        if wall < 2 {
            let opening = run
                .where_positive(beyond(-1.0, 2, p::GOAL_HEIGHT_MM))
                .where_positive(beyond(-1.0, 1, p::GOAL_HALF_WIDTH_MM))
                .where_positive(beyond(1.0, 1, -p::GOAL_HALF_WIDTH_MM));
            for column in opening.pixels() {
                let ray = self.ray_at([column as f32, row]);
                keys[column - first] = Surface::Goal.key();
                colours[column - first] = shade::goal(self.goal_face(wall, ray).1);
            }
        }
    }

    /// A run of the room beyond the walls, from column `first` on: first where it is looked at, which
    /// the compiler computes for many pixels at once.
    #[inline(always)]
    fn draw_room(&self, row: f32, first: usize, keys: &mut [u8], colours: &mut [Rgb]) {
        let (mut along, mut height) = ([0.0; WIDTH], [0.0; WIDTH]);
        let places = along.iter_mut().zip(&mut height).take(keys.len());
        for (x, (along, height)) in (first as i32..).zip(places) {
            let (room, at) = self.room_at(self.ray_at([x as f32, row]));
            (*along, *height) = (at, room[2]);
        }
        let pixels = keys.iter_mut().zip(colours).zip(along.into_iter().zip(height));
        for ((key, colour), (along, height)) in pixels {
            let panel = shade::room_panel(along, height);
            *key = Surface::Room(panel).key();
            *colour = shade::room(panel, height);
        }
    }

    /// A run of nothing but wall.
    #[inline(always)]
    fn draw_plain_wall(&self, wall: usize, row: f32, first: usize, colours: &mut [Rgb]) {
        let per_depth = self.walls[wall].row(row);
        let [along, up] = [along_axis(wall), 2];
        let (ray_along, ray_up) = (self.ray[along].row(row), self.ray[up].row(row));
        let eye = self.camera.at;
        for (x, colour) in (first as i32..).zip(colours) {
            let x = x as f32;
            let depth = 1.0 / per_depth.at(x);
            let place = eye[along] + ray_along.at(x) * depth;
            let z = eye[up] + ray_up.at(x) * depth;
            *colour = shade::wall(wall, place, z, depth / FOCAL_PX as f32);
        }
    }

    fn wall_depth(&self, wall: usize, point: [f32; 2]) -> f32 {
        1.0 / self.walls[wall].at(point)
    }

    /// The wall whose plane a ray meets first, or None for the floor.
    fn nearest_plane(&self, point: [f32; 2]) -> Option<usize> {
        let mut most = self.floor.at(point);
        let mut nearest = None;
        for (index, wall) in self.walls.iter().enumerate() {
            let quotient = wall.at(point);
            if quotient > most {
                (most, nearest) = (quotient, Some(index));
            }
        }
        nearest
    }

    /// The first column after `x` in which another plane may be nearer.
    fn end_of_run(&self, nearest: Option<usize>, x: usize, row: f32) -> usize {
        let plane = |index: Option<usize>| index.map_or(&self.floor, |wall| &self.walls[wall]);
        let here = plane(nearest);
        let start = [x as f32, row];
        let mut end = WIDTH as f32;
        for other in [None].into_iter().chain((0..WALLS.len()).map(Some)) {
            let closing = plane(other).across - here.across;
            if closing > 0.0 {
                end = end.min(start[0] + (here.at(start) - plane(other).at(start)) / closing);
            }
        }
        (end.ceil() as usize).clamp(x + 1, WIDTH)
    }

    #[inline(always)]
    fn ray_at(&self, point: [f32; 2]) -> [f32; 3] {
        self.ray.map(|component| component.at(point))
    }

    /// Where a ray is after so many units of depth.
    #[inline(always)]
    fn hit(&self, ray: [f32; 3], depth: f32) -> [f32; 3] {
        [0, 1, 2].map(|i| self.camera.at[i] + ray[i] * depth)
    }

    /// What is seen where a ray meets a wall's plane: the wall, its goal, or the room above it.
    #[inline(always)]
    fn on_wall(&self, wall: usize, ray: [f32; 3], [_, y, z]: [f32; 3]) -> Surface {
        if z > p::WALL_HEIGHT_MM as f32 {
            let (room, along) = self.room_at(ray);
            return Surface::Room(shade::room_panel(along, room[2]));
        }
        let opening = y.abs() < p::GOAL_HALF_WIDTH_MM as f32 && z < p::GOAL_HEIGHT_MM as f32;
        if wall < 2 && opening { Surface::Goal } else { Surface::Wall(wall as u8) }
    }

    /// Where a ray meets the room's wall, and how far along that is.
    #[inline(always)]
    fn room_at(&self, ray: [f32; 3]) -> ([f32; 3], f32) {
        let depth = |i: usize| {
            let wall = if ray[i] > 0.0 { ROOM_MM[i] } else { -ROOM_MM[i] };
            if ray[i] == 0.0 { f32::MAX } else { (wall - self.camera.at[i]) / ray[i] }
        };
        let (end, side) = (depth(0), depth(1));
        let hit = self.hit(ray, end.min(side));
        (hit, if end < side { hit[1] + 5000.0 } else { hit[0] })
    }

    /// The nearest surface of the pitch, and one over its distance where it can hide something.
    fn pitch_at(&self, point: [f32; 2]) -> (Surface, f32) {
        self.pitch_on(Planes::all(self).nearest(point), point)
    }

    /// The same, where the nearest plane and one over its distance are known.
    #[inline(always)]
    fn pitch_on(&self, nearest: (usize, f32), point: [f32; 2]) -> (Surface, f32) {
        if let Some(end) = self.lens_in_goal {
            let ray = self.ray_at(point);
            let outwards = WALLS[end].0[0] * ray[0];
            let leaves = (WALLS[end].1 - WALLS[end].0[0] * self.camera.at[0]) / outwards;
            if outwards >= 0.0 || self.goal_face(end, ray).0 < leaves {
                return (Surface::Goal, 0.0);
            }
        }
        match nearest {
            (FLOOR_PLANE, _) => (Surface::Floor, 0.0),
            (wall, per_depth) => {
                let ray = self.ray_at(point);
                (self.on_wall(wall, ray, self.hit(ray, 1.0 / per_depth)), per_depth)
            }
        }
    }

    /// Which face of the inside of the goal at this end a ray meets, and after which depth.
    fn goal_face(&self, end: usize, ray: [f32; 3]) -> (f32, GoalFace) {
        let at = self.camera.at;
        let sign = WALLS[end].0[0];
        let half = p::GOAL_HALF_WIDTH_MM as f32;
        let back = (p::HALF_LENGTH_MM + p::GOAL_DEPTH_MM) as f32;
        let reach = |from: f32, to: f32, speed: f32| {
            let depth = (to - from) / speed;
            if speed != 0.0 && depth > 0.0 { depth } else { f32::MAX }
        };
        let upright = if ray[2] > 0.0 {
            (reach(at[2], p::GOAL_HEIGHT_MM as f32, ray[2]), GoalFace::Top)
        } else {
            (reach(at[2], 0.0, ray[2]), GoalFace::Floor)
        };
        let faces = [
            (reach(sign * at[0], back, sign * ray[0]), GoalFace::Back),
            (reach(at[1], if ray[1] > 0.0 { half } else { -half }, ray[1]), GoalFace::Side),
            upright,
        ];
        faces.into_iter().fold(faces[0], |best, face| if face.0 < best.0 { face } else { best })
    }

    /// Ball and robot, where they hide the pitch.
    #[inline(always)]
    fn draw_objects(&self, bounds: &Bounds, keys: &mut [u8], frame: &mut [Rgb]) {
        for y in bounds[1].clone() {
            for first in bounds[0].clone().step_by(POINTS) {
                let points = Points {
                    x: core::array::from_fn(|i| (first + i) as f32),
                    y: [y as f32; POINTS],
                };
                let columns = first..bounds[0].end.min(first + POINTS);
                let maybe = [&self.ball_bounds, &self.robot_bounds].map(|object| {
                    object[1].contains(&y)
                        && object[0].start < columns.end
                        && columns.start < object[0].end
                });
                for (x, surface) in columns.zip(self.objects_at(&points, maybe)) {
                    if let Some(surface) = surface {
                        keys[y * WIDTH + x] = surface.key();
                        frame[y * WIDTH + x] = self.shade(surface, [x as f32, y as f32]);
                    }
                }
            }
        }
    }

    /// Whether a pixel may show ball and robot.
    fn maybe(&self, x: usize, y: usize) -> [bool; 2] {
        [contains(&self.ball_bounds, x, y), contains(&self.robot_bounds, x, y)]
    }

    /// At each point the nearer of ball and robot, unless the pitch hides it.
    #[inline(always)]
    fn objects_at(&self, points: &Points, maybe: [bool; 2]) -> [Option<Surface>; POINTS] {
        let ball = if maybe[0] { self.ball_depths(points) } else { [f32::INFINITY; POINTS] };
        let robot = maybe[1].then_some(self.dress.as_ref()).flatten();
        let robot = robot.map(|dress| self.robot_hits(dress, points));
        let mut surfaces = [None; POINTS];
        for (i, seen) in surfaces.iter_mut().enumerate() {
            let (mut depth, mut surface) = (ball[i], Surface::Ball);
            if let Some(hits) = &robot
                && hits.depth[i] < depth
            {
                (depth, surface) = (hits.depth[i], Surface::Stripe(hits.stripe[i] as u8));
                if hits.z[i] > ROBOT_HEIGHT {
                    // Above the dress there is the turret, which is thinner: the ball may be before it.
                    match self.turret_depth(self.ray_at(points.at(i))) {
                        Some(turret) if turret < ball[i] => {
                            (depth, surface) = (turret, Surface::Turret);
                        }
                        _ => (depth, surface) = (ball[i], Surface::Ball),
                    }
                }
            }
            if depth.is_finite() && !(self.in_goal && self.hidden(points.at(i), depth)) {
                *seen = Some(surface);
            }
        }
        surfaces
    }

    /// Whether the wall beside a goal is before what is so deep there.
    fn hidden(&self, point: [f32; 2], depth: f32) -> bool {
        let (pitch, per_depth) = self.pitch_at(point);
        matches!(pitch, Surface::Wall(_)) && depth * per_depth > 1.0
    }

    /// Depth of the ball at each point, infinite where it is not.
    #[inline(always)]
    fn ball_depths(&self, points: &Points) -> [f32; POINTS] {
        let Some(centre) = self.ball else { return [f32::INFINITY; POINTS] };
        let offset = [0, 1, 2].map(|i| self.camera.at[i] - centre[i]);
        let c = dot(offset, offset) - BALL_RADIUS * BALL_RADIUS;
        let mut depths = [0.0; POINTS];
        for (i, depth) in depths.iter_mut().enumerate() {
            let ray = self.ray_at(points.at(i));
            *depth = root_or_infinity(dot(ray, ray), dot(ray, offset), c);
        }
        depths
    }

    /// What rays meet of the upright cylinder around the dress.
    #[inline(always)]
    fn robot_hits(&self, dress: &Dress, points: &Points) -> RobotHits {
        let offset = [0, 1].map(|i| self.camera.at[i] - dress.axis[i]);
        let c = offset[0] * offset[0] + offset[1] * offset[1] - ROBOT_RADIUS * ROBOT_RADIUS;
        let mut hits = RobotHits { depth: [0.0; POINTS], z: [0.0; POINTS], stripe: [0.0; POINTS] };
        let mut left = [0.0; POINTS];
        for (i, left) in left.iter_mut().enumerate() {
            let ray = self.ray_at(points.at(i));
            let a = ray[0] * ray[0] + ray[1] * ray[1];
            let depth = root_or_infinity(a, ray[0] * offset[0] + ray[1] * offset[1], c);
            // Infinite times a ray that goes nowhere is no number; no comparison with it holds.
            let z = self.camera.at[2] + ray[2] * depth;
            hits.depth[i] = if z >= 0.0 { depth } else { f32::INFINITY };
            hits.z[i] = z;
            let normal = [0, 1].map(|axis| (offset[axis] + ray[axis] * depth) / ROBOT_RADIUS);
            *left = normal[0] * dress.lateral[0] + normal[1] * dress.lateral[1];
        }
        for begin in &dress.begins[..dress.count] {
            for (stripe, left) in hits.stripe.iter_mut().zip(left) {
                *stripe += if left > *begin { 1.0 } else { 0.0 };
            }
        }
        for stripe in &mut hits.stripe {
            *stripe += f32::from(dress.first);
            *stripe -= if *stripe >= STRIPES as f32 { STRIPES as f32 } else { 0.0 };
        }
        hits
    }

    /// Depth of the turret above the dress. Its top is above the lenses: no eye sees it.
    fn turret_depth(&self, ray: [f32; 3]) -> Option<f32> {
        let depth = self.cylinder_depth(ray, TURRET_RADIUS_MM)?;
        let z = self.camera.at[2] + ray[2] * depth;
        (ROBOT_HEIGHT..TURRET_TOP_MM).contains(&z).then_some(depth)
    }

    fn ball_depth(&self, ray: [f32; 3]) -> Option<f32> {
        let centre = self.ball?;
        let offset = [0, 1, 2].map(|i| self.camera.at[i] - centre[i]);
        nearer_root(
            dot(ray, ray),
            dot(ray, offset),
            dot(offset, offset) - BALL_RADIUS * BALL_RADIUS,
        )
    }

    /// Depth at which a ray meets an upright cylinder of this radius around the robot's axis.
    fn cylinder_depth(&self, ray: [f32; 3], radius: f32) -> Option<f32> {
        let axis = self.dress?.axis;
        let (ox, oy) = (self.camera.at[0] - axis[0], self.camera.at[1] - axis[1]);
        nearer_root(
            ray[0] * ray[0] + ray[1] * ray[1],
            ray[0] * ox + ray[1] * oy,
            ox * ox + oy * oy - radius * radius,
        )
    }

    fn upright_normal(&self, ray: [f32; 3], depth: f32, radius: f32) -> [f32; 2] {
        let axis = self.dress.map_or([0.0; 2], |dress| dress.axis);
        [0, 1].map(|i| (self.camera.at[i] + ray[i] * depth - axis[i]) / radius)
    }

    /// The mean over 16 points of a pixel. Each surface is shaded once, in the middle of its points.
    #[inline(always)]
    fn look_closely(&self, x: usize, y: usize) -> Rgb {
        /// Rows of the points in columns 0..16: bits reversed, so that they spread evenly.
        const ROW: [u8; POINTS] = [0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15];
        let maybe = self.maybe(x, y);
        let mut found: [(Surface, [f32; 2], f32); POINTS] =
            [(Surface::Floor, [0.0; 2], 0.0); POINTS];
        let mut count = 0;
        let planes = Planes::near(self, [x as f32, y as f32]);
        let place =
            |middle: usize, sixteenth: usize| middle as f32 + (sixteenth as f32 - 7.5) / 16.0;
        let points = Points {
            x: core::array::from_fn(|i| place(x, i)),
            y: ROW.map(|row| place(y, usize::from(row))),
        };
        let objects =
            if maybe == [false; 2] { [None; POINTS] } else { self.objects_at(&points, maybe) };
        let (nearest, per_depth) = planes.nearest_of(&points);
        for (i, object) in objects.into_iter().enumerate() {
            let point = points.at(i);
            let surface = match object {
                Some(object) => object,
                None => self.pitch_on((nearest[i] as usize, per_depth[i]), point).0,
            };
            let known = found[..count].iter().position(|entry| entry.0 == surface);
            let index = known.unwrap_or(count);
            count = count.max(index + 1);
            let (_, sum, points) = found[index];
            found[index] = (surface, [sum[0] + point[0], sum[1] + point[1]], points + 1.0);
        }
        let mut mean = [0.0; 3];
        for &(surface, sum, points) in &found[..count] {
            let colour = self.shade(surface, [sum[0] / points, sum[1] / points]);
            mean = [0, 1, 2].map(|i| mean[i] + colour[i] * points / POINTS as f32);
        }
        mean
    }

    /// Colour of a surface in the direction of a point of the picture.
    fn shade(&self, surface: Surface, point: [f32; 2]) -> Rgb {
        let ray = self.ray_at(point);
        match surface {
            Surface::Floor => self.shade_spot(&FloorRow::new(self, point[1]).spot(point[0])),
            Surface::Wall(wall) => {
                let wall = usize::from(wall);
                let depth = self.wall_depth(wall, point);
                let hit = self.hit(ray, depth);
                shade::wall(wall, hit[along_axis(wall)], hit[2], depth / FOCAL_PX as f32)
            }
            Surface::Goal => {
                let end = self.lens_in_goal.unwrap_or(usize::from(ray[0] < 0.0));
                shade::goal(self.goal_face(end, ray).1)
            }
            Surface::Room(panel) => shade::room(panel, self.room_at(ray).0[2]),
            Surface::Ball => self.shade_ball(ray),
            Surface::Stripe(stripe) => {
                let depth = self.cylinder_depth(ray, ROBOT_RADIUS).unwrap_or(0.0);
                shade::stripe(stripe, self.upright_normal(ray, depth, ROBOT_RADIUS))
            }
            Surface::Turret => {
                let depth = self.cylinder_depth(ray, TURRET_RADIUS_MM).unwrap_or(0.0);
                shade::turret(self.upright_normal(ray, depth, TURRET_RADIUS_MM))
            }
        }
    }

    fn shade_ball(&self, ray: [f32; 3]) -> Rgb {
        let (Some(depth), Some(centre)) = (self.ball_depth(ray), self.ball) else {
            return [0.0; 3];
        };
        let hit = self.hit(ray, depth);
        let normal = [0, 1, 2].map(|i| (hit[i] - centre[i]) / BALL_RADIUS);
        shade::ball(self.scene.ball_colour, normal)
    }

    fn shade_spot(&self, spot: &Spot) -> Rgb {
        let light = self.shadows().fold(1.0, |light, (centre, radius, dark)| {
            light * shade::shadow(spot.at, centre, radius, dark)
        });
        shade::scale(shade::floor(spot), light)
    }

    /// Shadows on the floor: where, how far they reach, how dark they are.
    fn shadows(&self) -> impl Iterator<Item = ([f32; 2], f32, f32)> {
        let ball = self.ball.map(|ball| ([ball[0], ball[1]], BALL_RADIUS * 1.15, 0.65));
        let robot = self.dress.map(|dress| (dress.axis, ROBOT_RADIUS * 1.5, 0.5));
        ball.into_iter().chain(robot)
    }
}

/// The floor along one row of the picture: its depth is the same all along.
struct FloorRow {
    /// What column 0 shows.
    start: Spot,
    /// Change of [`Spot::down`] from column to column.
    bend: [f32; 2],
}

impl FloorRow {
    fn new(view: &View, row: f32) -> Self {
        let ray = view.ray_at([0.0, row]);
        let depth = 1.0 / view.floor.at([0.0, row]);
        // The depth's change from row to row: d(1/q) = -dq / q^2.
        let deeper = -view.floor.down * depth * depth;
        let start = Spot {
            at: [0, 1].map(|i| view.camera.at[i] + ray[i] * depth),
            across: [0, 1].map(|i| view.ray[i].across * depth),
            down: [0, 1].map(|i| view.ray[i].down * depth + ray[i] * deeper),
        };
        Self { start, bend: [0, 1].map(|i| view.ray[i].across * deeper) }
    }

    /// What a column shows.
    #[inline(always)]
    fn place(&self, x: f32) -> [f32; 2] {
        [0, 1].map(|i| self.start.at[i] + x * self.start.across[i])
    }

    /// The same for all columns.
    fn lines(&self) -> [Line; 2] {
        [0, 1].map(|i| Line { start: self.start.at[i], slope: self.start.across[i] })
    }

    /// The largest extent in x and y of a pixel in this run: extents change evenly along it.
    fn pixel(&self, run: &Range<usize>) -> [f32; 2] {
        let ends = [run.start, run.end].map(|x| self.spot(x as f32));
        [0, 1].map(|i| ends[0].across[i].abs() + ends[0].down[i].abs().max(ends[1].down[i].abs()))
    }

    #[inline(always)]
    fn spot(&self, x: f32) -> Spot {
        let Spot { across, down, .. } = self.start;
        Spot {
            at: self.place(x),
            across,
            down: [down[0] + x * self.bend[0], down[1] + x * self.bend[1]],
        }
    }
}

/// Number of the floor among the planes; the walls are 0..8.
const FLOOR_PLANE: usize = WALLS.len();

/// Some of floor and walls.
struct Planes {
    planes: [(usize, Linear); WALLS.len() + 1],
    count: usize,
}

impl Planes {
    #[inline(always)]
    fn all(view: &View) -> Self {
        let mut planes = [(FLOOR_PLANE, view.floor); WALLS.len() + 1];
        for (index, wall) in view.walls.iter().enumerate() {
            planes[index + 1] = (index, *wall);
        }
        Self { planes, count: planes.len() }
    }

    /// Those that can be the nearest somewhere within the pixel at `point`.
    #[inline(always)]
    fn near(view: &View, point: [f32; 2]) -> Self {
        let mut planes = Self::all(view);
        let reach = |plane: &Linear| (plane.across.abs() + plane.down.abs()) / 2.0;
        let surely = planes
            .planes
            .iter()
            .fold(f32::MIN, |most, (_, plane)| most.max(plane.at(point) - reach(plane)));
        planes.count = 0;
        for index in 0..planes.planes.len() {
            let (_, plane) = &planes.planes[index];
            if plane.at(point) + reach(plane) >= surely {
                planes.planes[planes.count] = planes.planes[index];
                planes.count += 1;
            }
        }
        planes
    }

    /// The nearest at each point, and one over its distance.
    #[inline(always)]
    fn nearest_of(&self, points: &Points) -> ([u32; POINTS], [f32; POINTS]) {
        let mut nearest = [FLOOR_PLANE as u32; POINTS];
        let mut best = [f32::MIN; POINTS];
        for (index, plane) in &self.planes[..self.count] {
            for i in 0..POINTS {
                let quotient = plane.at(points.at(i));
                let nearer = quotient > best[i];
                best[i] = if nearer { quotient } else { best[i] };
                nearest[i] = if nearer { *index as u32 } else { nearest[i] };
            }
        }
        (nearest, best)
    }

    /// The nearest, and one over its distance.
    #[inline(always)]
    fn nearest(&self, point: [f32; 2]) -> (usize, f32) {
        let mut best = (FLOOR_PLANE, f32::MIN);
        for (index, plane) in &self.planes[..self.count] {
            let quotient = plane.at(point);
            if quotient > best.1 {
                best = (*index, quotient);
            }
        }
        best
    }
}

/// The smaller root of a t^2 + 2 b t + c if it is positive, otherwise infinity.
#[inline(always)]
fn root_or_infinity(a: f32, b: f32, c: f32) -> f32 {
    let square = b * b - a * c;
    let root = (-b - square.max(0.0).sqrt()) / a;
    if square >= 0.0 && root > 0.0 { root } else { f32::INFINITY }
}

/// The smaller root of a t^2 + 2 b t + c, if it is positive.
fn nearer_root(a: f32, b: f32, c: f32) -> Option<f32> {
    let square = b * b - a * c;
    if square < 0.0 || a <= 0.0 {
        return None;
    }
    let root = (-b - square.sqrt()) / a;
    (root > 0.0).then_some(root)
}
