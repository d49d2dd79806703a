//! The same poses through two renderers: ours, and the one that made host-tests/data/scenes. They share
//! no code, so where they agree neither is wrong by itself.

use std::path::{Path, PathBuf};

use common_sys::constants as c;
use common_sys::vision::{EyeParams, Report, detect, rgb565};
use image::RgbImage;
use serde_json::Value;
use world::BallColour;
use world::camera::{BASELINE_MM, Camera, HEIGHT, WIDTH};
use world::physics::Pose;
use world::render::{Frame, Scene, render};

/// Pixels of the picture compared at once, coarsely.
const BLOCK: u32 = 8;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../host-tests/data/scenes")
}

fn scenes() -> Vec<(String, Value)> {
    let text = std::fs::read_to_string(folder().join("truth.json")).expect("truth.json");
    let truth: Value = serde_json::from_str(&text).expect("truth.json is JSON");
    let scenes = truth["scenes"].as_object().expect("scenes");
    scenes.iter().map(|(id, scene)| (id.clone(), scene.clone())).collect()
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn point(value: &Value) -> [f32; 3] {
    [0, 1, 2].map(|i| value[i].as_f64().unwrap_or(0.0) as f32)
}

/// Left and right eye of a scene.
fn cameras(scene: &Value) -> [Camera; 2] {
    let pose = &scene["pose"];
    let (x, y) = (number(&pose["x_mm"]), number(&pose["y_mm"]));
    let yaw = number(&pose["yaw_deg"]).to_radians();
    let left = [x - BASELINE_MM * libm::sin(yaw), y + BASELINE_MM * libm::cos(yaw)];
    [Camera::at_lens(left, yaw), Camera::at_lens([x, y], yaw)]
}

fn ours(scene: &Value, camera: &Camera) -> RgbImage {
    let place =
        |value: &Value| value.as_array().map(|world| [number(&world[0]), number(&world[1])]);
    let robot = place(&scene["opponent"]["world"]);
    let seen = Scene {
        ball_mm: place(&scene["ball"]["world"]),
        ball_colour: BallColour::Yellow,
        robot: robot.map(|[x_mm, y_mm]| Pose { x_mm, y_mm, heading_rad: 0.0 }),
    };
    let mut frame = Frame::new();
    render(camera, &seen, &mut frame);
    let bytes = frame.iter().flat_map(|colour| colour.map(|v| (v * 255.0 + 0.5) as u8)).collect();
    RgbImage::from_raw(WIDTH as u32, HEIGHT as u32, bytes).expect("a frame's size")
}

fn theirs(id: &str, eye: &str) -> RgbImage {
    image::open(folder().join(format!("{id}_{eye}.png"))).expect("a scene's picture").to_rgb8()
}

fn grey(picture: &RgbImage, x: u32, y: u32) -> f64 {
    picture.get_pixel(x, y).0.iter().map(|&channel| f64::from(channel)).sum::<f64>() / 3.0
}

/// Where on a row, near `x`, grey passes half-way between what it is on either side.
fn edge_near(picture: &RgbImage, x: f64, row: u32) -> f64 {
    let (from, to) = ((x - 5.0).max(0.0) as u32, (x + 6.0).min(WIDTH as f64 - 1.0) as u32);
    let half = (grey(picture, from, row) + grey(picture, to, row)) / 2.0;
    (from..to)
        .find_map(|left| {
            let (a, b) = (grey(picture, left, row) - half, grey(picture, left + 1, row) - half);
            (a * b <= 0.0 && a != b).then(|| f64::from(left) + a / (a - b))
        })
        .expect("an edge")
}

/// Middle and area of what is yellow.
fn yellow(picture: &RgbImage) -> ([f64; 2], f64) {
    let (mut sum, mut area) = ([0.0; 2], 0.0);
    for (x, y, pixel) in picture.enumerate_pixels() {
        let [r, g, b] = pixel.0.map(f64::from);
        if r > 1.5 * b && r > 0.9 * g && r > 40.0 {
            sum = [sum[0] + f64::from(x), sum[1] + f64::from(y)];
            area += 1.0;
        }
    }
    (sum.map(|s| s / area), area)
}

/// Clean scenes: what is measured in them is geometry, not noise.
fn clean() -> impl Iterator<Item = (String, Value)> {
    scenes().into_iter().filter(|(_, scene)| scene["tier"] == "clean")
}

#[test]
fn everything_is_projected_where_the_truth_says() {
    let mut compared = 0;
    for (id, scene) in scenes() {
        let [left, right] = cameras(&scene);
        let mut check = |what: &str, camera: &Camera, world: [f32; 3], x: &Value| {
            let seen = camera.project(world).expect("before the lens");
            let off = f64::from(seen[0]) - number(x);
            assert!(off.abs() < 0.05, "{id} {what}: {off:.3} px off");
            compared += 1;
        };
        let ball = &scene["ball"];
        if ball.is_object() {
            check("ball right", &right, point(&ball["world"]), &ball["x_right"]);
            check("ball left", &left, point(&ball["world"]), &ball["x_left"]);
        }
        for side in ["left", "right"] {
            let edge = &scene["goal"][side];
            if edge.is_object() {
                check("goal right", &right, point(&edge["world"]), &edge["projected_x_right"]);
                check("goal left", &left, point(&edge["world"]), &edge["projected_x_left"]);
            }
        }
        let opponent = &scene["opponent"];
        if opponent.is_object() {
            let [x, y, _] = point(&opponent["world"]);
            let axis = [x, y, number(&opponent["row80_height_mm"]) as f32];
            check("opponent right", &right, axis, &opponent["x"]);
            check("opponent left", &left, axis, &opponent["x_left"]);
        }
    }
    assert!(compared >= 40, "only {compared} points compared");
}

#[test]
fn the_goal_s_edges_lie_where_the_other_renderer_has_them() {
    let mut compared = 0;
    for (id, scene) in clean() {
        let eyes = cameras(&scene);
        for (eye, camera) in ["left", "right"].into_iter().zip(&eyes) {
            let pictures = [ours(&scene, camera), theirs(&id, eye)];
            for side in ["left", "right"] {
                let edge = &scene["goal"][side];
                if edge[format!("state_{eye}")] != "visible" {
                    continue;
                }
                let x = number(&edge[format!("projected_x_{eye}")]);
                let [here, there] = [0, 1].map(|i| edge_near(&pictures[i], x, 60));
                assert!((here - x).abs() < 0.3, "{id} {eye} {side}: {here:.2}, truth {x:.2}");
                // The other renderer's own edges are up to a quarter of a pixel off its truth.
                assert!((here - there).abs() < 0.5, "{id} {eye} {side}: {here:.2}, {there:.2}");
                compared += 1;
            }
        }
    }
    assert!(compared >= 6, "only {compared} edges compared");
}

#[test]
fn the_ball_has_the_same_middle_and_the_same_area() {
    for (id, scene) in clean().filter(|(_, scene)| scene["ball"].is_object()) {
        for (eye, camera) in ["left", "right"].into_iter().zip(&cameras(&scene)) {
            let (here, here_area) = yellow(&ours(&scene, camera));
            let (there, there_area) = yellow(&theirs(&id, eye));
            let off = [here[0] - there[0], here[1] - there[1]];
            println!("{id} {eye}: ball off by {off:.2?} px, {here_area} and {there_area} px");
            assert!(off[0].abs() < 0.5 && off[1].abs() < 1.0, "{id} {eye}: {off:?}");
            let area = here_area / there_area;
            assert!((0.93..1.07).contains(&area), "{id} {eye}: {area}");
        }
    }
}

#[test]
fn pictures_agree_coarsely() {
    for (id, scene) in clean() {
        for (eye, camera) in ["left", "right"].into_iter().zip(&cameras(&scene)) {
            let (here, there) = (ours(&scene, camera), theirs(&id, eye));
            let mut off = Vec::new();
            for top in (0..HEIGHT as u32).step_by(BLOCK as usize) {
                for left in (0..WIDTH as u32).step_by(BLOCK as usize) {
                    let mean = |picture: &RgbImage, channel: usize| {
                        let pixels = (0..BLOCK * BLOCK).map(|i| {
                            picture.get_pixel(left + i % BLOCK, top + i / BLOCK).0[channel]
                        });
                        pixels.map(f64::from).sum::<f64>() / f64::from(BLOCK * BLOCK)
                    };
                    let channels = [0, 1, 2].map(|c| (mean(&here, c) - mean(&there, c)).abs());
                    off.push(channels.iter().sum::<f64>() / 3.0);
                }
            }
            off.sort_by(f64::total_cmp);
            let (median, ninth) = (off[off.len() / 2], off[off.len() * 9 / 10]);
            println!("{id} {eye}: blocks differ by {median:.1} (median), {ninth:.1} (90 %) of 255");
            assert!(median < 12.0 && ninth < 40.0, "{id} {eye}: {median:.1}, {ninth:.1}");
        }
    }
}

fn report(pictures: [&RgbImage; 2]) -> Report {
    let [left, right] = pictures.map(|picture| {
        picture.pixels().map(|p| rgb565(p.0[0], p.0[1], p.0[2])).collect::<Vec<u16>>()
    });
    detect(&left, &right, &EyeParams::usual())
}

/// What both reports have, name by name, in pixels; what only one has is left out.
fn in_both(here: &Report, there: &Report) -> Vec<(&'static str, f64, f64)> {
    let both = |flag: u32| [here, there].iter().all(|r| u32::from(r.flags) & flag != 0);
    let px = |here: u16, there: u16| (f64::from(here) / 16.0, f64::from(there) / 16.0);
    let mut found = Vec::new();
    let mut add = |name, (here, there): (f64, f64)| found.push((name, here, there));
    if both(c::REPORT_BALL) {
        add("ball x", px(here.ball_x_q4, there.ball_x_q4));
        if here.ball_disparity_q4 != 0 && there.ball_disparity_q4 != 0 {
            add("ball d", px(here.ball_disparity_q4, there.ball_disparity_q4));
        }
    }
    for (i, flag) in [c::REPORT_GOAL_LEFT_EDGE, c::REPORT_GOAL_RIGHT_EDGE].into_iter().enumerate() {
        if both(flag) {
            add("goal x", px(here.goal_x_q4[i], there.goal_x_q4[i]));
            add("goal d", px(here.goal_disparity_q4[i], there.goal_disparity_q4[i]));
        }
    }
    if both(c::REPORT_OPPONENT) {
        add("opponent d", px(here.opponent_disparity_q4, there.opponent_disparity_q4));
    }
    found
}

#[test]
fn the_detectors_answers_agree_within_half_a_pixel() {
    let mut compared = 0;
    let mut off = Vec::new();
    for (id, scene) in scenes() {
        let eyes = cameras(&scene);
        let drawn = eyes.map(|camera| ours(&scene, &camera));
        let here = report([&drawn[0], &drawn[1]]);
        let there = report([&theirs(&id, "left"), &theirs(&id, "right")]);
        for (name, a, b) in in_both(&here, &there) {
            println!("{id:5} {:7} {name:10} {a:7.2} {b:7.2} {:+.2}", scene["tier"], a - b);
            compared += 1;
            if (a - b).abs() > 0.5 {
                off.push(format!("{id} {name}: {a:.2} here, {b:.2} there"));
            }
        }
    }
    assert!(compared >= 30, "only {compared} answers compared");
    assert!(off.is_empty(), "{off:#?}");
}
