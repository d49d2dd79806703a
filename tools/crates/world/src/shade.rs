//! Colours: what each surface looks like at a place, light, grain and lines included.
//!
//! Colours are those of the independent scenes in host-tests/data/scenes, rounded; grain and the
//! unevenness of the light are assumptions, mild enough for the detectors of a quiet day.

use crate::pitch as p;
use crate::stretch::{Line, Stretch};

/// A colour as the camera's sensor has it, 0..1 a channel.
pub type Rgb = [f32; 3];

const FLOOR: Rgb = [0.245, 0.52, 0.305];
const LINE: Rgb = [0.90, 0.91, 0.89];
const WALL: Rgb = [0.395, 0.393, 0.39];
const GOAL: Rgb = [0.045, 0.045, 0.047];
const ROOM: Rgb = [0.64, 0.625, 0.59];
const PANELS: [Rgb; 3] = [[0.27, 0.31, 0.52], [0.36, 0.37, 0.40], [0.56, 0.47, 0.40]];
const BLACK: Rgb = [0.06, 0.06, 0.06];
const WHITE: Rgb = [0.80, 0.80, 0.79];
const TURRET: Rgb = [0.09, 0.10, 0.10];
const SEAM: Rgb = [0.80, 0.80, 0.72];

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
            Self::Yellow => [1.0, 0.915, 0.275],
            Self::Pink => [1.0, 0.50, 0.74],
        }
    }
}

/// Dot product.
#[inline(always)]
pub fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// A colour, so many times as bright.
#[inline(always)]
pub fn scale(colour: Rgb, factor: f32) -> Rgb {
    colour.map(|channel| channel * factor)
}

#[inline(always)]
fn mix(a: Rgb, b: Rgb, share_of_b: f32) -> Rgb {
    [0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * share_of_b)
}

/// Number of the cell of a grid nearest to `v`, which lies within +-2^21 cells: `v` counts cells.
#[inline(always)]
fn cell(v: f32) -> i32 {
    // From 2^23 on a float has no fraction; half of that again keeps negative values there, too.
    // Quicker than a conversion, and the compiler does it for many pixels at once.
    (v + 12_582_912.0).to_bits() as i32
}

/// A fixed random number in -1..1 for a cell of a grid: grain of floor, walls and felt.
#[inline(always)]
fn grain(x: i32, y: i32, z: i32) -> f32 {
    let mut h = (x as u32).wrapping_mul(0x9E37_79B1)
        ^ (y as u32).wrapping_mul(0x85EB_CA77)
        ^ (z as u32).wrapping_mul(0xC2B2_AE3D);
    h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
    h ^= h >> 13;
    (h & 0xFFFF) as i32 as f32 / 32768.0 - 1.0
}

/// A place on the floor that a pixel shows, and how it moves from pixel to pixel, mm.
#[derive(Clone, Copy)]
pub struct Spot {
    /// x and y.
    pub at: [f32; 2],
    /// Change to the next column.
    pub across: [f32; 2],
    /// Change to the next row.
    pub down: [f32; 2],
}

impl Spot {
    /// Width of the pixel along the direction (x, y) of length 1.
    fn width(&self, x: f32, y: f32) -> f32 {
        let along = |step: [f32; 2]| (step[0] * x + step[1] * y).abs();
        along(self.across) + along(self.down)
    }
}

/// How much of a pixel of this width, whose middle is `off` a band's middle, the band covers.
fn covered(off: f32, band: f32, pixel: f32) -> f32 {
    let low = (off - pixel / 2.0).max(-band / 2.0);
    let high = (off + pixel / 2.0).min(band / 2.0);
    ((high - low) / pixel).clamp(0.0, 1.0)
}

/// How much of a pixel on the floor is white line, 0..1.
fn lines(spot: &Spot) -> f32 {
    const WIDTH: f32 = p::LINE_WIDTH_MM as f32;
    const CIRCLE: f32 = p::CENTRE_CIRCLE_MM as f32;
    const HALF: f32 = p::GOAL_HALF_WIDTH_MM as f32;
    let [x, y] = spot.at;
    let (width_x, width_y) = (spot.width(1.0, 0.0), spot.width(0.0, 1.0));
    let mut most = covered(x, WIDTH, width_x);

    let reach = WIDTH + width_x + width_y;
    let square = x * x + y * y;
    let inner = CIRCLE - reach;
    if square > inner * inner && square < (CIRCLE + reach) * (CIRCLE + reach) {
        let radius = square.sqrt();
        let pixel = spot.width(x / radius, y / radius);
        most = most.max(covered(radius - CIRCLE, WIDTH, pixel));
    } else if square < reach * reach + 100.0 {
        // The dot is as large as a pixel or two: its width along the ray decides.
        let radius = square.sqrt();
        most = most.max(covered(radius, p::CENTRE_DOT_MM as f32, width_x.max(width_y)));
    }

    let depth = p::HALF_LENGTH_MM as f32 - x.abs();
    let border = p::GOAL_BORDER_MM as f32;
    if depth < border + reach && y.abs() < HALF + reach {
        let within_y = covered(y, 2.0 * HALF + WIDTH, width_y);
        let within_x = covered(depth - border / 2.0, border + WIDTH, width_x);
        most = most.max(covered(depth - border, WIDTH, width_x) * within_y);
        most = most.max(covered(depth, WIDTH, width_x) * within_y);
        most = most.max(covered(y.abs() - HALF, WIDTH, width_y) * within_x);
    }
    most
}

/// How much fine grain of cells of `size` is left in a pixel so wide: none comes out as noise.
fn kept(size: f32, pixel: f32) -> f32 {
    (size / pixel).min(1.0)
}

const FLOOR_GRAIN_MM: f32 = 4.0;
const FLOOR_GRAIN: f32 = 0.035;

/// Strength of the grain where the floor's pixels are so wide.
pub fn floor_grain(spot: &Spot) -> f32 {
    let pixel = spot.width(1.0, 0.0).max(spot.width(0.0, 1.0));
    FLOOR_GRAIN * kept(FLOOR_GRAIN_MM, pixel)
}

/// Light falls a little unevenly on the floor.
#[inline(always)]
fn floor_light([x, y]: [f32; 2]) -> f32 {
    const PER_X: f32 = 0.06 / p::HALF_LENGTH_MM as f32;
    const PER_Y: f32 = -0.05 / p::HALF_WIDTH_MM as f32;
    1.0 + PER_X * x + PER_Y * y
}

/// The boards, before light falls on them.
#[inline(always)]
fn wood([x, y]: [f32; 2], grain_strength: f32) -> f32 {
    const CELLS: f32 = 1.0 / FLOOR_GRAIN_MM;
    1.0 + grain_strength * grain(cell(x * CELLS), cell(y * CELLS), 0)
}

/// Colour of the floor where there is neither line nor shadow.
#[inline(always)]
pub fn boards(at: [f32; 2], grain_strength: f32) -> Rgb {
    scale(FLOOR, wood(at, grain_strength) * floor_light(at))
}

/// Colour of the floor, before shadows.
pub fn floor(spot: &Spot) -> Rgb {
    let wood = scale(FLOOR, wood(spot.at, floor_grain(spot)));
    scale(mix(wood, LINE, lines(spot)), floor_light(spot.at))
}

/// Parts of a stretch of floor that may show white lines. `place` is what it shows, `pixel` the
/// largest extents of its pixels in x and y.
pub fn each_line(run: Stretch, place: [Line; 2], pixel: [f32; 2], mut touch: impl FnMut(Stretch)) {
    const HALF_LINE: f32 = p::LINE_WIDTH_MM as f32 / 2.0;
    const CIRCLE: f32 = p::CENTRE_CIRCLE_MM as f32;
    const HALF_GOAL: f32 = p::GOAL_HALF_WIDTH_MM as f32;
    const FRONT: f32 = (p::HALF_LENGTH_MM - p::GOAL_BORDER_MM) as f32;
    let between = |part: Stretch, axis: usize, low: f32, high: f32| {
        let margin = HALF_LINE + pixel[axis];
        part.where_positive(place[axis].turned(1.0, margin - low))
            .where_positive(place[axis].turned(-1.0, high + margin))
    };
    touch(between(run, 0, 0.0, 0.0));
    for end in [-1.0, 1.0] {
        let (front, goal) = (end * FRONT, end * p::HALF_LENGTH_MM as f32);
        let border = between(run, 0, front.min(goal), front.max(goal));
        let border = between(border, 1, -HALF_GOAL, HALF_GOAL);
        if !border.is_empty() {
            touch(between(border, 0, front, front));
            touch(between(border, 0, goal, goal));
            touch(between(border, 1, -HALF_GOAL, -HALF_GOAL));
            touch(between(border, 1, HALF_GOAL, HALF_GOAL));
        }
    }
    let margin = HALF_LINE + pixel[0] + pixel[1];
    let outer = run.where_near(place, [0.0; 2], CIRCLE + margin);
    let inner = outer.where_near(place, [0.0; 2], (CIRCLE - margin).max(0.0));
    if inner.is_empty() {
        touch(outer);
        return;
    }
    touch(Stretch { to: inner.from + 1.0, ..outer });
    touch(Stretch { from: inner.to - 1.0, ..outer });
    touch(inner.where_near(place, [0.0; 2], p::CENTRE_DOT_MM as f32 + margin));
}

/// Part of the light from above that something of this radius at `centre` leaves at (x, y): darkest
/// where it stands.
pub fn shadow([x, y]: [f32; 2], centre: [f32; 2], radius: f32, dark: f32) -> f32 {
    let (dx, dy) = (x - centre[0], y - centre[1]);
    let square = (dx * dx + dy * dy) / (radius * radius);
    if square < 1.0 { 1.0 - dark * (1.0 - square) } else { 1.0 }
}

/// Grey walls, each lit a little differently: at `along` mm along the wall and `z` mm above the floor;
/// `pixel_mm` is what a pixel covers there.
#[inline(always)]
pub fn wall(wall: usize, along: f32, z: f32, pixel_mm: f32) -> Rgb {
    const LIGHT: [f32; 8] = [1.0, 0.98, 1.12, 0.96, 1.05, 1.03, 0.97, 0.95];
    const GRAIN_MM: f32 = 3.0;
    const CELLS: f32 = 1.0 / GRAIN_MM;
    let height = 0.94 + 0.06 / p::WALL_HEIGHT_MM as f32 * z;
    let spot = grain(cell(along * CELLS), wall as i32, cell(z * CELLS));
    let fine = 1.0 + 0.03 * spot * kept(GRAIN_MM, pixel_mm);
    scale(WALL, LIGHT[wall] * height * fine)
}

/// Faces of a goal's inside.
#[derive(Clone, Copy)]
pub enum GoalFace {
    /// Opposite the opening.
    Back,
    /// Left and right.
    Side,
    /// Above.
    Top,
    /// Below.
    Floor,
}

/// Black, but not equally so.
pub fn goal(face: GoalFace) -> Rgb {
    let light = match face {
        GoalFace::Back => 1.0,
        GoalFace::Side => 1.25,
        GoalFace::Top => 0.7,
        GoalFace::Floor => 1.15,
    };
    scale(GOAL, light)
}

/// Panels in the room: 0 = none, a plain wall.
#[inline(always)]
pub fn room_panel(along_mm: f32, z_mm: f32) -> u8 {
    const EVERY_MM: f32 = 760.0;
    // Towards zero of something positive: as good as floor() and much quicker.
    let index = (along_mm / EVERY_MM + 64.0) as i32;
    let within = along_mm - (index - 64) as f32 * EVERY_MM;
    let kind = (grain(index, 7, 3) * 2.0 + 2.0) as u8;
    let top = 330.0 + 90.0 * f32::from(kind);
    if kind != 0 && (140.0..560.0).contains(&within) && z_mm < top { kind } else { 0 }
}

/// The room beyond the walls.
#[inline(always)]
pub fn room(panel: u8, z_mm: f32) -> Rgb {
    let light = 0.85 + 0.15 * (z_mm / 500.0).min(1.0);
    match panel {
        0 => scale(ROOM, light),
        n => PANELS[usize::from(n - 1) % PANELS.len()],
    }
}

/// Where the light comes from, beside what comes from everywhere: from above, a little from the side.
const LIGHT: [f32; 3] = [-0.30, 0.35, 0.887];

/// Colour of the ball where its surface has this normal: light, seam, fuzz.
pub fn ball(colour: BallColour, normal: [f32; 3]) -> Rgb {
    let [nx, ny, nz] = normal;
    let light = 0.36 + 0.56 * (0.5 + 0.5 * dot(normal, LIGHT));
    // The seam of a tennis ball: a curve that swings between both halves.
    let off = (nx + 0.15 * nz - 0.75 * (ny * ny - nz * nz)).abs();
    let seam = ((0.075 - off) / 0.03).clamp(0.0, 1.0);
    let felt = match colour {
        BallColour::Yellow => mix(colour.rgb(), SEAM, seam),
        BallColour::Pink => colour.rgb(),
    };
    let [x, y, z] = normal.map(|n| cell(n * 22.0));
    scale(felt, light * (1.0 + 0.07 * grain(x, y, z)))
}

/// A stripe of a robot's dress, 0 = white; `normal` is that of its surface.
pub fn stripe(index: u8, normal: [f32; 2]) -> Rgb {
    let light = 0.8 + 0.2 * (LIGHT[0] * normal[0] + LIGHT[1] * normal[1]) / 0.461;
    scale(if index.is_multiple_of(2) { WHITE } else { BLACK }, light)
}

/// The turret that looks out of the dress.
pub fn turret(normal: [f32; 2]) -> Rgb {
    scale(TURRET, 1.0 + 0.3 * normal[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_thinner_than_a_pixel_covers_its_share() {
        assert_eq!(covered(0.0, 5.0, 20.0), 0.25);
        assert_eq!(covered(2.5, 5.0, 1.0), 0.5);
        assert_eq!(covered(9.0, 5.0, 1.0), 0.0);
    }

    #[test]
    fn a_row_of_pixels_over_a_line_shows_all_of_it() {
        for shift in [0.0, 0.2, 0.5, 0.9] {
            let sum: f32 = (-20..20).map(|i| covered(i as f32 * 1.7 + shift, 5.0, 1.7) * 1.7).sum();
            assert!((sum - 5.0).abs() < 1e-4, "{sum}");
        }
    }
}
