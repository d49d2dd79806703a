//! A match in one picture: what both eyes saw with what was found in it; the pitch from above with the
//! tracks since the last kick-off; the same with who had the ball where in the whole match, and the shots;
//! and the match as a line of time.

use common_sys::constants as c;
use common_sys::link::Report;
use image::RgbImage;

use crate::Tracks;
use crate::camera::{Eye, HEIGHT, WIDTH};
use crate::canvas::{Canvas, Colour};
use crate::chronicle::{self, Chronicle, Mark};
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
    /// What the whole match was like.
    pub chronicle: &'a Chronicle,
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
const PITCH_TOP: i64 = CAPTION_TOP + 60;
/// Thickness of the walls as drawn, mm.
const WALL_MM: f64 = 12.0;
/// Pixels of the picture for a millimetre of a pitch: one pitch is as wide as an eye's picture.
const PITCH_SCALE: f64 =
    EYE_WIDTH as f64 / (2.0 * (p::HALF_LENGTH_MM + p::GOAL_DEPTH_MM + WALL_MM));
const PITCH_HEIGHT: f64 = PITCH_SCALE * 2.0 * (p::HALF_WIDTH_MM + WALL_MM);
const LEGEND_TOP: i64 = PITCH_TOP + PITCH_HEIGHT as i64 + 14;
const LINE_TOP: i64 = LEGEND_TOP + 34;
const LINE_HEIGHT: f64 = 26.0;
const PICTURE_WIDTH: u32 = (3 * MARGIN + 2 * EYE_WIDTH) as u32;
const PICTURE_HEIGHT: u32 = (LINE_TOP + LINE_HEIGHT as i64 + 26 + MARGIN) as u32;

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
    let tracks = Pitch::number(0);
    tracks.title(&mut canvas, "tracks since the last kick-off");
    tracks.draw(&mut canvas);
    tracks.draw_tracks(&mut canvas, story.tracks);
    let heat = Pitch::number(1);
    heat.title(&mut canvas, "who had the ball where, and shots, in the whole match");
    heat.draw(&mut canvas);
    heat.draw_heat(&mut canvas, story.chronicle);
    heat.draw_lines(&mut canvas);
    heat.draw_shots(&mut canvas, story.chronicle);
    draw_legend(&mut canvas, story);
    draw_time(&mut canvas, story);
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
        (0, 0) => "no goal",
        (a, b) if a > b => "we lead",
        (a, b) if a < b => "the opponent leads",
        _ => "level",
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

/// One of the two pitches from above.
struct Pitch {
    middle: [f64; 2],
}

impl Pitch {
    fn number(index: i64) -> Self {
        let left = MARGIN + index * (EYE_WIDTH + MARGIN);
        let middle = [left as f64 + EYE_WIDTH as f64 / 2.0, PITCH_TOP as f64 + PITCH_HEIGHT / 2.0];
        Self { middle }
    }

    /// A place on the pitch in the picture.
    fn at(&self, [x_mm, y_mm]: [f64; 2]) -> [f64; 2] {
        [self.middle[0] + x_mm * PITCH_SCALE, self.middle[1] - y_mm * PITCH_SCALE]
    }

    fn title(&self, canvas: &mut Canvas, text: &str) {
        let left = (self.middle[0] - EYE_WIDTH as f64 / 2.0) as i64;
        canvas.text([left, PITCH_TOP - 20], 2, FAINT, text);
    }

    fn draw(&self, canvas: &mut Canvas) {
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
            .map(|place| self.at(place))
        };
        let goals = |canvas: &mut Canvas, grown: f64, colour: Colour| {
            let (length, half) =
                (p::HALF_LENGTH_MM + p::GOAL_DEPTH_MM + grown, p::GOAL_HALF_WIDTH_MM + grown);
            canvas.rectangle(self.at([-length, half]), self.at([length, -half]), colour, 1.0);
        };
        goals(canvas, WALL_MM, WALL);
        canvas.polygon(&outline(WALL_MM), WALL);
        goals(canvas, 0.0, INSIDE);
        canvas.polygon(&outline(0.0), FLOOR);
        self.draw_lines(canvas);
    }

    fn draw_lines(&self, canvas: &mut Canvas) {
        let line = (p::LINE_WIDTH_MM * PITCH_SCALE).max(1.5);
        let mut stroke = |a: [f64; 2], b: [f64; 2]| {
            canvas.line([self.at(a), self.at(b)], line, LINE, 0.6);
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
        let middle = self.at([0.0, 0.0]);
        canvas.ring(middle, [circle - line / 2.0, circle + line / 2.0], LINE, 0.6);
        canvas.disc(middle, p::CENTRE_DOT_MM / 2.0 * PITCH_SCALE, LINE, 0.9);
    }

    /// A track: faint where it began, strong where it ends.
    fn draw_track(&self, canvas: &mut Canvas, points: &[[f64; 2]], width: f64, colour: Colour) {
        let count = points.len().max(2) as f64 - 1.0;
        for (index, pair) in points.windows(2).enumerate() {
            // Mixed first, opaque then: where pieces overlap at their ends nothing shows twice.
            let share = 0.3 + 0.7 * index as f64 / count;
            let ends = [self.at(pair[0]), self.at(pair[1])];
            canvas.line(ends, width, mixed(FLOOR, colour, share), 1.0);
        }
    }

    fn draw_tracks(&self, canvas: &mut Canvas, tracks: &Tracks) {
        let place = |pose: &Pose| [pose.x_mm, pose.y_mm];
        for (track, colour) in tracks.robots.iter().zip(ROBOTS) {
            let points: Vec<[f64; 2]> = track.iter().map(place).collect();
            self.draw_track(canvas, &points, 2.5, colour);
        }
        self.draw_track(canvas, &tracks.ball, 2.0, BALL);

        let radius = p::ROBOT_RADIUS_MM * PITCH_SCALE;
        for (track, colour) in tracks.robots.iter().zip(ROBOTS) {
            if let Some(first) = track.first() {
                canvas.ring(self.at(place(first)), [radius - 1.5, radius], colour, 0.7);
            }
        }
        let ball = p::BALL_RADIUS_MM * PITCH_SCALE;
        if let Some(&first) = tracks.ball.first() {
            canvas.ring(self.at(first), [ball - 1.5, ball], BALL, 0.7);
        }
        for (track, colour) in tracks.robots.iter().zip(ROBOTS) {
            if let Some(pose) = track.last() {
                self.draw_robot(canvas, pose, colour);
            }
        }
        if let Some(&last) = tracks.ball.last() {
            let at = self.at(last);
            canvas.disc([at[0] + 2.0, at[1] + 2.0], ball, INSIDE, 0.35);
            canvas.disc(at, ball, BALL, 1.0);
            let light = [at[0] - ball * 0.25, at[1] - ball * 0.3];
            canvas.disc(light, ball * 0.45, [255, 240, 150], 0.5);
        }
    }

    /// A robot from above: striped dress, its colour on top, a line to where it looks.
    fn draw_robot(&self, canvas: &mut Canvas, pose: &Pose, colour: Colour) {
        let radius = p::ROBOT_RADIUS_MM * PITCH_SCALE;
        let at = self.at([pose.x_mm, pose.y_mm]);
        canvas.disc([at[0] + 2.0, at[1] + 2.0], radius, INSIDE, 0.35);
        canvas.disc(at, radius, [236, 236, 232], 1.0);
        for stripe in 0..p::ROBOT_STRIPES / 2 {
            let turn = f64::from(stripe * 2) / f64::from(p::ROBOT_STRIPES);
            let angle = pose.heading_rad + turn * 2.0 * core::f64::consts::PI;
            let (sin, cos) = libm::sincos(angle);
            let rim = |part: f64| [at[0] + radius * part * cos, at[1] - radius * part * sin];
            canvas.line([rim(0.75), rim(0.92)], 3.0, INSIDE, 1.0);
        }
        canvas.disc(at, radius * 0.72, colour, 1.0);
        let (sin, cos) = libm::sincos(pose.heading_rad);
        let nose = [at[0] + radius * 1.6 * cos, at[1] - radius * 1.6 * sin];
        canvas.line([at, nose], 2.5, TEXT, 1.0);
    }

    /// Cells in the colour of who had the ball there, the stronger the longer.
    fn draw_heat(&self, canvas: &mut Canvas, chronicle: &Chronicle) {
        let [ours, theirs] = &chronicle.heat;
        let blurred = [ours, theirs].map(|heat| blurred(heat));
        let sums = blurred[0].iter().zip(&blurred[1]).map(|(a, b)| a + b);
        let most = sums.fold(0.0, f64::max);
        if most == 0.0 {
            return;
        }
        for (index, (a, b)) in blurred[0].iter().zip(&blurred[1]).enumerate() {
            let strength = ((a + b) / most).sqrt();
            if strength < 0.06 {
                continue;
            }
            let (column, row) = (index % chronicle::COLUMNS, index / chronicle::COLUMNS);
            let edge =
                |i: usize, cells: usize| (i as f64 - cells as f64 / 2.0) * chronicle::CELL_MM;
            let (x, y) = (edge(column, chronicle::COLUMNS), edge(row, chronicle::ROWS));
            if y.abs() > p::HALF_WIDTH_MM || x.abs() > p::HALF_LENGTH_MM + p::GOAL_DEPTH_MM {
                continue;
            }
            let colour = mixed(ROBOTS[0], ROBOTS[1], b / (a + b));
            // Edges between pixels: neighbours neither overlap nor leave a gap.
            let corner = |place| self.at(place).map(|v| v.round() - 0.5);
            let from = corner([x, y + chronicle::CELL_MM]);
            let to = corner([x + chronicle::CELL_MM, y]);
            canvas.rectangle(from, to, colour, 0.85 * strength);
        }
    }

    /// Shots as arrows; a disc where one went in.
    fn draw_shots(&self, canvas: &mut Canvas, chronicle: &Chronicle) {
        for shot in &chronicle.shots {
            let colour = mixed(ROBOTS[shot.robot], TEXT, 0.35);
            let [from, to] = [self.at(shot.from_mm), self.at(shot.to_mm)];
            canvas.line([from, to], 5.0, INSIDE, 0.4);
            canvas.line([from, to], 2.5, colour, 1.0);
            let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
            let length = libm::hypot(dx, dy).max(1.0);
            let (dx, dy) = (dx / length, dy / length);
            for side in [-1.0, 1.0] {
                let barb =
                    [to[0] - 11.0 * dx - side * 6.0 * dy, to[1] - 11.0 * dy + side * 6.0 * dx];
                canvas.line([to, barb], 2.5, colour, 1.0);
            }
            if shot.goal {
                canvas.disc(to, 8.0, INSIDE, 0.6);
                canvas.disc(to, 6.0, BALL, 1.0);
            }
        }
    }
}

fn mixed(a: Colour, b: Colour, share_of_b: f64) -> Colour {
    [0, 1, 2].map(|i| (f64::from(a[i]) * (1.0 - share_of_b) + f64::from(b[i]) * share_of_b) as u8)
}

/// Each cell with its neighbours: nobody stands in one cell only.
fn blurred(heat: &[u32]) -> Vec<f64> {
    let cell = |column: i64, row: i64| {
        let inside = (0..chronicle::COLUMNS as i64).contains(&column)
            && (0..chronicle::ROWS as i64).contains(&row);
        if inside {
            f64::from(heat[row as usize * chronicle::COLUMNS + column as usize])
        } else {
            0.0
        }
    };
    (0..heat.len() as i64)
        .map(|index| {
            let columns = chronicle::COLUMNS as i64;
            let (column, row) = (index % columns, index / columns);
            let mut sum = 0.0;
            for (dx, dy) in (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (dx, dy))) {
                let weight = f64::from((2 - i32::abs(dx)) * (2 - i32::abs(dy)));
                sum += weight * cell(column + i64::from(dx), row + i64::from(dy));
            }
            sum / 16.0
        })
        .collect()
}

/// Names, and numbers of the match.
fn draw_legend(canvas: &mut Canvas, story: &Story) {
    let names =
        if story.robot == 0 { ["our robot", "opponent"] } else { ["opponent", "our robot"] };
    let chronicle = story.chronicle;
    let had: u32 = chronicle.possession_ms.iter().sum();
    let mut x = MARGIN;
    for robot in [0, 1] {
        let shots = chronicle.shots.iter().filter(|shot| shot.robot == robot).count();
        let share = chronicle.possession_ms[robot] * 100 / had.max(1);
        let way = if robot == 0 { "to the right" } else { "to the left" };
        let plural = if shots == 1 { "" } else { "s" };
        canvas.disc([(x + 9) as f64, (LEGEND_TOP + 7) as f64], 8.0, ROBOTS[robot], 1.0);
        let text = format!("{} ({way}): {share} % of the ball, {shots} shot{plural}", names[robot]);
        x += 26 + canvas.text([x + 26, LEGEND_TOP], 2, TEXT, &text) + 30;
    }
}

/// The match from left to right: who had the ball, goals, free balls.
fn draw_time(canvas: &mut Canvas, story: &Story) {
    let left = MARGIN as f64;
    let width = f64::from(PICTURE_WIDTH) - 2.0 * left;
    let top = LINE_TOP as f64;
    let (middle, bottom) = (top + LINE_HEIGHT / 2.0, top + LINE_HEIGHT);
    let ms = (story.seconds * 1000.0).max(1.0);
    let at = |time_ms: f64| left + (time_ms / ms).min(1.0) * width;
    canvas.rectangle([left, top], [left + width, bottom], WALL, 0.35);
    let moment = f64::from(chronicle::MOMENT_MS);
    for (index, who) in story.chronicle.line.iter().enumerate() {
        let Some(robot) = *who else { continue };
        let (from, to) = (at(index as f64 * moment), at((index + 1) as f64 * moment));
        let (high, low) = if robot == 0 { (top, middle) } else { (middle, bottom) };
        canvas.rectangle([from, high], [to, low], ROBOTS[robot], 0.9);
    }
    for (time, mark) in &story.chronicle.marks {
        let x = at(f64::from(*time));
        match mark {
            Mark::Goal(robot) => {
                let y = if *robot == 0 { top } else { bottom };
                canvas.disc([x, y], 9.0, INSIDE, 0.8);
                canvas.disc([x, y], 7.0, BALL, 1.0);
            }
            Mark::FreeBall => canvas.line([[x, top], [x, bottom]], 2.0, BALL, 0.9),
            Mark::KickOff => canvas.line([[x, top], [x, bottom]], 2.0, TEXT, 0.9),
        }
    }
    let text_top = bottom as i64 + 10;
    canvas.text([MARGIN, text_top], 2, FAINT, "0 s");
    let end = format!("{:.0} s", story.seconds);
    let end_left = i64::from(PICTURE_WIDTH) - MARGIN - end.len() as i64 * 12;
    canvas.text([end_left, text_top], 2, FAINT, &end);
    let legend =
        "white: kick-off   yellow disc: goal, above ours, below theirs   yellow line: free ball";
    canvas.text([MARGIN + 150, text_top], 2, FAINT, legend);
}
