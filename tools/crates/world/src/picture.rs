//! A match in one picture: what both eyes saw last with what was found in it, and below it the pitch
//! from above with the tracks of robots and ball.

use common_sys::constants as c;
use common_sys::link::Report;
use image::RgbImage;

use crate::Tracks;
use crate::camera::{Eye, HEIGHT, WIDTH};
use crate::canvas::{Canvas, Colour};
use crate::physics::Pose;
use crate::pitch as p;

/// What a picture tells.
pub struct Story<'a> {
    /// The left and the right eye's picture, `WIDTH` x `HEIGHT`.
    pub eyes: [RgbImage; 2],
    /// What the FPGA reported of them.
    pub report: Option<&'a Report>,
    /// Where everything has been; ends where everything is now.
    pub tracks: &'a Tracks,
    /// Robot 0's goals and robot 1's.
    pub goals: [u32; 2],
    /// Since kick-off.
    pub seconds: f64,
    /// What drew the kick-off.
    pub seed: u64,
    /// Whose eyes these are: robot 0 or 1.
    pub robot: usize,
}

/// Epipolar lines of goal and opponent as the FPGA's registers hold them after configuration.
const GOAL_ROW: f64 = 60.0;
/// See [`GOAL_ROW`].
const OPPONENT_ROW: f64 = 80.0;

const MARGIN: i64 = 20;
/// Pixels of the picture for one of an eye.
const EYE_SCALE: i64 = 2;
const EYE_WIDTH: i64 = WIDTH as i64 * EYE_SCALE;
const EYES_TOP: i64 = 76;
const CAPTION_TOP: i64 = EYES_TOP + HEIGHT as i64 * EYE_SCALE + 10;
const PITCH_TOP: i64 = CAPTION_TOP + 36;
/// Pixels of the picture for a millimetre of the pitch.
const PITCH_SCALE: f64 = 0.9;
/// Thickness of the walls as drawn, mm.
const WALL_MM: f64 = 12.0;
const PITCH_MIDDLE: [f64; 2] = [
    MARGIN as f64 + PITCH_SCALE * (p::HALF_LENGTH_MM + p::GOAL_DEPTH_MM + WALL_MM),
    PITCH_TOP as f64 + PITCH_SCALE * (p::HALF_WIDTH_MM + WALL_MM),
];
const LEGEND_LEFT: i64 = 1130;
const PICTURE_WIDTH: u32 = (3 * MARGIN + 2 * EYE_WIDTH) as u32;
const PICTURE_HEIGHT: u32 =
    (PITCH_TOP + (PITCH_SCALE * 2.0 * (p::HALF_WIDTH_MM + WALL_MM)) as i64 + MARGIN) as u32;

const GROUND: Colour = [24, 27, 33];
const TEXT: Colour = [226, 230, 236];
const FAINT: Colour = [140, 148, 160];
const FLOOR: Colour = [38, 112, 62];
const WALL: Colour = [112, 116, 122];
const LINE: Colour = [218, 226, 218];
const INSIDE: Colour = [8, 9, 11];
const BALL: Colour = [250, 214, 40];
const ROBOTS: [Colour; 2] = [[74, 168, 255], [255, 106, 92]];
const GOAL_MARK: Colour = [92, 240, 250];
const OPPONENT_MARK: Colour = [255, 106, 92];
const WALL_MARK: Colour = [255, 130, 240];

/// Draw it.
pub fn draw(story: &Story) -> RgbImage {
    let mut canvas = Canvas::new(PICTURE_WIDTH, PICTURE_HEIGHT, GROUND);
    draw_title(&mut canvas, story);
    for (index, eye) in [Eye::Left, Eye::Right].into_iter().enumerate() {
        draw_eye(&mut canvas, story, eye, &story.eyes[index], index as i64);
    }
    draw_caption(&mut canvas, story.report);
    draw_pitch(&mut canvas);
    draw_tracks(&mut canvas, story.tracks);
    draw_legend(&mut canvas, story);
    canvas.picture
}

fn draw_title(canvas: &mut Canvas, story: &Story) {
    let [ours, theirs] = story.goals;
    let score = format!("{ours} : {theirs}");
    canvas.text([MARGIN, 16], 3, TEXT, "StereoSot");
    let facts = format!("seed {}   {:.1} s", story.seed, story.seconds);
    canvas.text([MARGIN + 190, 23], 2, FAINT, &facts);
    let middle = i64::from(PICTURE_WIDTH) / 2 - score.len() as i64 * 12;
    canvas.text([middle, 12], 4, TEXT, &score);
    let verdict = match (ours, theirs) {
        (0, 0) => "no goal yet",
        (1.., 0) => "goal",
        (0, 1..) => "goal for the opponent",
        _ => "goals on both sides",
    };
    let left = i64::from(PICTURE_WIDTH) - MARGIN - verdict.len() as i64 * 12;
    canvas.text([left, 23], 2, BALL, verdict);
}

/// One of a report's marks in one eye's pixels; None if this eye does not see it.
fn x_in(eye: Eye, x_right_q4: u16, disparity_q4: u16) -> Option<f64> {
    let x_right = f64::from(x_right_q4) / 16.0;
    match (eye, disparity_q4) {
        (Eye::Right, _) => Some(x_right),
        (Eye::Left, 0) => None,
        (Eye::Left, disparity) => Some(x_right + f64::from(disparity) / 16.0),
    }
}

fn has(report: &Report, flag: u32) -> bool {
    u32::from(report.flags) & flag != 0
}

fn draw_eye(canvas: &mut Canvas, story: &Story, eye: Eye, picture: &RgbImage, index: i64) {
    let corner = [MARGIN + index * (EYE_WIDTH + MARGIN), EYES_TOP];
    canvas.insert(picture, corner, EYE_SCALE);
    let name = match eye {
        Eye::Left => "left eye",
        Eye::Right => "right eye (reference)",
    };
    canvas.text([corner[0], EYES_TOP - 19], 2, FAINT, name);
    let Some(report) = story.report else { return };
    let mut marks = Marks { canvas, corner };
    marks.ball(report, eye);
    marks.goal(report, eye);
    if has(report, c::REPORT_OPPONENT)
        && let Some(x) = x_in(eye, report.opponent_x_q4, report.opponent_disparity_q4)
    {
        marks.opponent(x);
    }
    if eye == Eye::Right {
        marks.wall(report);
    }
}

/// Marks over one eye's picture, in that picture's pixels.
struct Marks<'a> {
    canvas: &'a mut Canvas,
    corner: [i64; 2],
}

impl Marks<'_> {
    fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let scale = EYE_SCALE as f64;
        // A pixel's centre is the middle of the block that stands for it.
        let middle = (scale - 1.0) / 2.0;
        [self.corner[0] as f64 + x * scale + middle, self.corner[1] as f64 + y * scale + middle]
    }

    /// A line, cut to the picture, with a dark rim so that it shows on anything.
    fn line(&mut self, ends: [[f64; 2]; 2], colour: Colour) {
        let inside = |[x, y]: [f64; 2]| {
            [x.clamp(0.0, (WIDTH - 1) as f64), y.clamp(0.0, (HEIGHT - 1) as f64)]
        };
        let ends = ends.map(|end| self.place(inside(end)));
        self.canvas.line(ends, 4.0, INSIDE, 0.45);
        self.canvas.line(ends, 2.0, colour, 1.0);
    }

    fn label(&mut self, at: [f64; 2], colour: Colour, text: &str) {
        let width = text.len() as f64 * 6.0;
        let x = at[0].clamp(2.0, WIDTH as f64 - 2.0 - width);
        let y = at[1].clamp(2.0, HEIGHT as f64 - 12.0);
        let place = self.place([x, y]);
        let end = [place[0] + width * 2.0, place[1] + 16.0];
        self.canvas.rectangle([place[0] - 3.0, place[1] - 3.0], end, INSIDE, 0.6);
        self.canvas.text([place[0] as i64, place[1] as i64], 2, colour, text);
    }

    fn ball(&mut self, report: &Report, eye: Eye) {
        let seen_here = match eye {
            Eye::Left => !has(report, c::REPORT_BALL_RIGHT_ONLY),
            Eye::Right => !has(report, c::REPORT_BALL_LEFT_ONLY),
        };
        if !has(report, c::REPORT_BALL) || !seen_here {
            return;
        }
        // Seen by the left eye only, its place is the one in the left picture.
        let place = if has(report, c::REPORT_BALL_LEFT_ONLY) { Eye::Right } else { eye };
        let Some(x) = x_in(place, report.ball_x_q4, report.ball_disparity_q4) else { return };
        let (y, half) = (f64::from(report.ball_row), f64::from(report.ball_width_px) / 2.0);
        let (left, right, top, bottom) = (x - half, x + half, y - half, y + half);
        self.line([[left, top], [right, top]], BALL);
        self.line([[left, bottom], [right, bottom]], BALL);
        self.line([[left, top], [left, bottom]], BALL);
        self.line([[right, top], [right, bottom]], BALL);
        self.line([[x - 3.0, y], [x + 3.0, y]], BALL);
        self.line([[x, y - 3.0], [x, y + 3.0]], BALL);
        self.label([left, bottom + 4.0], BALL, "ball");
    }

    fn goal(&mut self, report: &Report, eye: Eye) {
        let row = GOAL_ROW;
        let flags = [c::REPORT_GOAL_LEFT_EDGE, c::REPORT_GOAL_RIGHT_EDGE];
        let mut seen = [None; 2];
        for (side, flag) in flags.into_iter().enumerate() {
            if has(report, flag) {
                seen[side] = x_in(eye, report.goal_x_q4[side], report.goal_disparity_q4[side]);
            }
        }
        for x in seen.into_iter().flatten() {
            self.line([[x, row - 22.0], [x, row + 22.0]], GOAL_MARK);
        }
        if let [Some(left), Some(right)] = seen {
            self.line([[left, row], [right, row]], GOAL_MARK);
        }
        if let Some(x) = seen.into_iter().flatten().next() {
            self.label([x + 4.0, row - 20.0], GOAL_MARK, "goal");
        }
    }

    fn opponent(&mut self, x: f64) {
        let row = OPPONENT_ROW;
        self.line([[x - 12.0, row], [x + 12.0, row]], OPPONENT_MARK);
        self.line([[x, row - 12.0], [x, row + 12.0]], OPPONENT_MARK);
        self.label([x - 20.0, row - 24.0], OPPONENT_MARK, "opponent");
    }

    fn wall(&mut self, report: &Report) {
        let columns =
            [c::REPORT_WALL_COLUMN_LEFT, c::REPORT_WALL_COLUMN_CENTRE, c::REPORT_WALL_COLUMN_RIGHT];
        for (column, row) in columns.into_iter().zip(report.wall_row) {
            if has(report, c::REPORT_WALL) && row != 0 {
                let (x, y) = (f64::from(column), f64::from(row));
                self.line([[x - 7.0, y], [x + 7.0, y]], WALL_MARK);
            }
        }
    }
}

/// What was reported, in words.
fn draw_caption(canvas: &mut Canvas, report: Option<&Report>) {
    let mut x = MARGIN;
    let mut say = |colour: Colour, text: &str| {
        x += canvas.text([x, CAPTION_TOP], 2, colour, text) + 34;
    };
    let Some(report) = report else {
        say(FAINT, "no vision report: the FPGA is not configured, or has not seen a frame");
        return;
    };
    let px = |q4: u16| f64::from(q4) / 16.0;
    if !has(report, c::REPORT_BALL) {
        say(FAINT, "no ball");
    } else if has(report, c::REPORT_BALL_CLIPPED) {
        say(BALL, "ball nearer than the search range");
    } else if has(report, c::REPORT_BALL_RIGHT_ONLY) {
        say(BALL, "ball in the right eye only");
    } else if has(report, c::REPORT_BALL_LEFT_ONLY) {
        say(BALL, "ball in the left eye only");
    } else {
        say(BALL, &format!("ball d = {:.1} px", px(report.ball_disparity_q4)));
    }
    let edges = [
        ("left", c::REPORT_GOAL_LEFT_EDGE, report.goal_disparity_q4[0]),
        ("right", c::REPORT_GOAL_RIGHT_EDGE, report.goal_disparity_q4[1]),
    ];
    let goal: Vec<String> = edges
        .iter()
        .filter(|(_, flag, _)| has(report, *flag))
        .map(|(name, _, disparity)| format!("{name} {:.1}", px(*disparity)))
        .collect();
    if goal.is_empty() {
        say(FAINT, "no goal");
    } else {
        say(GOAL_MARK, &format!("goal d = {} px", goal.join(", ")));
    }
    if has(report, c::REPORT_OPPONENT) {
        let disparity = px(report.opponent_disparity_q4);
        say(OPPONENT_MARK, &format!("opponent d = {disparity:.1} px"));
    } else {
        say(FAINT, "no opponent");
    }
}

/// A place on the pitch in the picture.
fn on_pitch([x_mm, y_mm]: [f64; 2]) -> [f64; 2] {
    [PITCH_MIDDLE[0] + x_mm * PITCH_SCALE, PITCH_MIDDLE[1] - y_mm * PITCH_SCALE]
}

fn draw_pitch(canvas: &mut Canvas) {
    let outline = |grown: f64| {
        let (length, width) = (p::HALF_LENGTH_MM + grown, p::HALF_WIDTH_MM + grown);
        // The diagonal moves outwards as far as the straight walls do.
        let cut = p::CORNER_CUT_MM + grown * (2.0 - core::f64::consts::SQRT_2);
        [
            [length, width - cut],
            [length - cut, width],
            [cut - length, width],
            [-length, width - cut],
            [-length, cut - width],
            [cut - length, -width],
            [length - cut, -width],
            [length, cut - width],
        ]
        .map(on_pitch)
    };
    let goals = |canvas: &mut Canvas, grown: f64, colour: Colour| {
        let (length, half) =
            (p::HALF_LENGTH_MM + p::GOAL_DEPTH_MM + grown, p::GOAL_HALF_WIDTH_MM + grown);
        canvas.rectangle(on_pitch([-length, half]), on_pitch([length, -half]), colour, 1.0);
    };
    goals(canvas, WALL_MM, WALL);
    canvas.polygon(&outline(WALL_MM), WALL);
    goals(canvas, 0.0, INSIDE);
    canvas.polygon(&outline(0.0), FLOOR);

    let line = p::LINE_WIDTH_MM * PITCH_SCALE;
    let mut stroke = |a: [f64; 2], b: [f64; 2]| {
        canvas.line([on_pitch(a), on_pitch(b)], line, LINE, 0.8);
    };
    stroke([0.0, -p::HALF_WIDTH_MM], [0.0, p::HALF_WIDTH_MM]);
    for side in [-1.0, 1.0] {
        let (end, inner) =
            (side * p::HALF_LENGTH_MM, side * (p::HALF_LENGTH_MM - p::GOAL_BORDER_MM));
        let half = p::GOAL_HALF_WIDTH_MM;
        stroke([end, -half], [inner, -half]);
        stroke([inner, -half], [inner, half]);
        stroke([inner, half], [end, half]);
        stroke([end, -half], [end, half]);
    }
    let circle = p::CENTRE_CIRCLE_MM * PITCH_SCALE;
    let middle = on_pitch([0.0, 0.0]);
    canvas.ring(middle, [circle - line / 2.0, circle + line / 2.0], LINE, 0.8);
    canvas.disc(middle, p::CENTRE_DOT_MM / 2.0 * PITCH_SCALE, LINE, 0.9);
}

/// A track: faint where it began, strong where it ends.
fn draw_track(canvas: &mut Canvas, points: &[[f64; 2]], width: f64, colour: Colour) {
    let count = points.len().max(2) as f64 - 1.0;
    for (index, pair) in points.windows(2).enumerate() {
        // Mixed first, opaque then: where pieces overlap at their ends nothing shows twice.
        let share = 0.3 + 0.7 * index as f64 / count;
        let mixed = [0, 1, 2]
            .map(|i| (f64::from(FLOOR[i]) * (1.0 - share) + f64::from(colour[i]) * share) as u8);
        canvas.line([on_pitch(pair[0]), on_pitch(pair[1])], width, mixed, 1.0);
    }
}

fn draw_tracks(canvas: &mut Canvas, tracks: &Tracks) {
    let place = |pose: &Pose| [pose.x_mm, pose.y_mm];
    for (track, colour) in tracks.robots.iter().zip(ROBOTS) {
        let points: Vec<[f64; 2]> = track.iter().map(place).collect();
        draw_track(canvas, &points, 3.5, colour);
    }
    draw_track(canvas, &tracks.ball, 2.5, BALL);

    let radius = p::ROBOT_RADIUS_MM * PITCH_SCALE;
    for (track, colour) in tracks.robots.iter().zip(ROBOTS) {
        if let Some(first) = track.first() {
            canvas.ring(on_pitch(place(first)), [radius - 1.5, radius], colour, 0.7);
        }
    }
    let ball = p::BALL_RADIUS_MM * PITCH_SCALE;
    if let Some(&first) = tracks.ball.first() {
        canvas.ring(on_pitch(first), [ball - 1.5, ball], BALL, 0.7);
    }
    for (track, colour) in tracks.robots.iter().zip(ROBOTS) {
        if let Some(pose) = track.last() {
            draw_robot(canvas, pose, colour);
        }
    }
    if let Some(&last) = tracks.ball.last() {
        let at = on_pitch(last);
        canvas.disc([at[0] + 2.0, at[1] + 3.0], ball, INSIDE, 0.35);
        canvas.disc(at, ball, BALL, 1.0);
        canvas.disc([at[0] - ball * 0.25, at[1] - ball * 0.3], ball * 0.45, [255, 240, 150], 0.5);
    }
}

/// A robot from above: striped dress, its colour on top, a line to where it looks.
fn draw_robot(canvas: &mut Canvas, pose: &Pose, colour: Colour) {
    let radius = p::ROBOT_RADIUS_MM * PITCH_SCALE;
    let at = on_pitch([pose.x_mm, pose.y_mm]);
    canvas.disc([at[0] + 2.0, at[1] + 3.0], radius, INSIDE, 0.35);
    canvas.disc(at, radius, [236, 236, 232], 1.0);
    for stripe in 0..p::ROBOT_STRIPES / 2 {
        let turn = f64::from(stripe * 2) / f64::from(p::ROBOT_STRIPES);
        let angle = pose.heading_rad + turn * 2.0 * core::f64::consts::PI;
        let (sin, cos) = libm::sincos(angle);
        let rim = |part: f64| [at[0] + radius * part * cos, at[1] - radius * part * sin];
        canvas.line([rim(0.72), rim(0.92)], 5.0, INSIDE, 1.0);
    }
    canvas.disc(at, radius * 0.72, colour, 1.0);
    let (sin, cos) = libm::sincos(pose.heading_rad);
    let nose = [at[0] + radius * 1.5 * cos, at[1] - radius * 1.5 * sin];
    canvas.line([at, nose], 3.0, TEXT, 1.0);
}

fn draw_legend(canvas: &mut Canvas, story: &Story) {
    let names =
        if story.robot == 0 { ["our robot", "opponent"] } else { ["opponent", "our robot"] };
    let rows = [(ROBOTS[0], names[0]), (ROBOTS[1], names[1]), (BALL, "ball")];
    let mut y = PITCH_TOP + 14;
    for (colour, name) in rows {
        canvas.disc([(LEGEND_LEFT + 9) as f64, (y + 7) as f64], 9.0, colour, 1.0);
        canvas.text([LEGEND_LEFT + 28, y], 2, TEXT, name);
        y += 34;
    }
    canvas.ring([(LEGEND_LEFT + 9) as f64, (y + 7) as f64], [7.5, 9.0], FAINT, 1.0);
    canvas.text([LEGEND_LEFT + 28, y], 2, FAINT, "at kick-off");
    y += 52;
    for (colour, text) in [
        (FAINT, "blue attacks"),
        (FAINT, "the right goal"),
        (FAINT, ""),
        (FAINT, "pitch 1050 x"),
        (FAINT, "680 mm"),
    ] {
        canvas.text([LEGEND_LEFT, y], 2, colour, text);
        y += 22;
    }
}
