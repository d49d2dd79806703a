//! The robot's detectors on the rendered pairs of host-tests/data/scenes, which another renderer
//! made: prints what was found and how far off, and holds the paper's scene to the paper's figures.

use std::path::PathBuf;

use common_sys::constants as c;
use common_sys::vision::{self, EyeParams, Report};
use serde_json::Value;

fn scenes_dir() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../host-tests/data/scenes")
}

/// The picture as the camera would deliver it.
fn read_eye(scene: &str, eye: &str) -> Vec<u16> {
    let path = scenes_dir().join(format!("{scene}_{eye}.png"));
    let picture = image::open(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let picture = picture.to_rgb8();
    assert_eq!(picture.dimensions(), (vision::WIDTH as u32, vision::HEIGHT as u32));
    picture.pixels().map(|p| vision::rgb565(p[0], p[1], p[2])).collect()
}

fn detect(scene: &str) -> Report {
    vision::detect(&read_eye(scene, "left"), &read_eye(scene, "right"), &EyeParams::usual())
}

fn truth() -> Value {
    let path = scenes_dir().join("truth.json");
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    serde_json::from_str(&text).expect("truth.json is JSON")
}

fn px(q4: u16) -> f64 {
    f64::from(q4) / 16.0
}

fn has(report: &Report, flag: u32) -> bool {
    u32::from(report.flags) & flag != 0
}

/// What is said about one thing in one scene.
struct Finding {
    expect: String,
    found: bool,
    /// Disparity found minus true one, px; one entry for each that both know.
    errors: Vec<f64>,
}

fn ball(report: &Report, scene: &Value) -> Finding {
    let found = has(report, c::REPORT_BALL);
    let known = found && report.ball_disparity_q4 != 0;
    let errors = match scene["ball"]["disparity"].as_f64() {
        Some(d) if known => vec![px(report.ball_disparity_q4) - d],
        _ => vec![],
    };
    Finding { expect: expected(scene, "ball"), found, errors }
}

fn goal(report: &Report, scene: &Value) -> Finding {
    let edges = [(c::REPORT_GOAL_LEFT_EDGE, "d_left"), (c::REPORT_GOAL_RIGHT_EDGE, "d_right")];
    let mut errors = vec![];
    let mut found = false;
    for (i, (flag, key)) in edges.into_iter().enumerate() {
        if has(report, flag) {
            found = true;
            if let Some(d) = scene["goal"][key].as_f64() {
                errors.push(px(report.goal_disparity_q4[i]) - d);
            }
        }
    }
    Finding { expect: expected(scene, "goal"), found, errors }
}

fn opponent(report: &Report, scene: &Value) -> Finding {
    let found = has(report, c::REPORT_OPPONENT);
    let errors = match scene["opponent"]["disparity_surface"].as_f64() {
        Some(d) if found => vec![px(report.opponent_disparity_q4) - d],
        _ => vec![],
    };
    Finding { expect: expected(scene, "opponent"), found, errors }
}

fn expected(scene: &Value, thing: &str) -> String {
    scene["expect"][thing].as_str().expect("truth.json says what to expect").to_owned()
}

type Detector = fn(&Report, &Value) -> Finding;
const DETECTORS: [(&str, Detector); 3] = [("ball", ball), ("goal", goal), ("opponent", opponent)];

#[test]
fn every_scene_shows_what_the_truth_expects() {
    let truth = truth();
    let scenes = truth["scenes"].as_object().expect("truth.json has scenes");
    assert!(scenes.len() >= 8);
    let mut wrong = vec![];
    for (name, detector) in DETECTORS {
        let (mut wanted, mut hit, mut absent, mut ghosts) = (0, 0, 0, 0);
        let mut errors = vec![];
        for (id, scene) in scenes {
            let finding = detector(&detect(id), scene);
            let text: Vec<_> = finding.errors.iter().map(|e| format!("{e:+.2}")).collect();
            println!(
                "{name:8} {id:5} {:7} expect {:4} found {:5} error {} px",
                scene["tier"].as_str().unwrap_or("?"),
                finding.expect,
                finding.found,
                text.join(" ")
            );
            match finding.expect.as_str() {
                "yes" => {
                    wanted += 1;
                    hit += usize::from(finding.found);
                    errors.extend(finding.errors);
                    if !finding.found {
                        wrong.push(format!("{name} missed in {id}"));
                    }
                }
                "no" => {
                    absent += 1;
                    ghosts += usize::from(finding.found);
                    if finding.found {
                        wrong.push(format!("{name} seen in {id}, where there is none"));
                    }
                }
                _ => {}
            }
        }
        let mut sizes: Vec<f64> = errors.iter().map(|e| e.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        println!(
            "{name}: found {hit} of {wanted}, false {ghosts} of {absent}, \
             disparity |error| median {:.2} px, largest {:.2} px",
            sizes.get(sizes.len() / 2).copied().unwrap_or(f64::NAN),
            sizes.last().copied().unwrap_or(f64::NAN),
        );
        if sizes.last().is_some_and(|e| *e > 1.5) {
            wrong.push(format!("{name}: a disparity is more than 1.5 px off"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn the_papers_scene_gives_the_papers_figures() {
    let report = detect("paper");
    let near = |name: &str, value: f64, wanted: f64, limit: f64| {
        println!("paper: {name} {value:.2}, wanted {wanted} +- {limit}");
        assert!((value - wanted).abs() <= limit, "{name}: {value}, wanted {wanted} +- {limit}");
    };
    let wanted_flags = c::REPORT_BALL
        | c::REPORT_GOAL_LEFT_EDGE
        | c::REPORT_GOAL_RIGHT_EDGE
        | c::REPORT_OPPONENT
        | c::REPORT_WALL;
    assert_eq!(u32::from(report.flags), wanted_flags);

    // Figure 9 of the paper; its ball has 69 by its centres, and 70 in print.
    near("goal left x", px(report.goal_x_q4[0]), 42.0, 1.5);
    near("goal right x", px(report.goal_x_q4[1]), 177.0, 1.5);
    near("goal left disparity", px(report.goal_disparity_q4[0]), 23.0, 1.5);
    near("goal right disparity", px(report.goal_disparity_q4[1]), 22.0, 1.5);
    near("ball x", px(report.ball_x_q4), 146.0, 1.5);
    near("ball row", f64::from(report.ball_row), 148.0, 1.5);
    near("ball disparity", px(report.ball_disparity_q4), 69.0, 1.5);

    let opponent = &truth()["scenes"]["paper"]["opponent"];
    let surface = opponent["disparity_surface"].as_f64().expect("the truth has a surface");
    near("opponent disparity", px(report.opponent_disparity_q4), surface, 1.0);
    near("opponent x", px(report.opponent_x_q4), 143.0, 1.5);
}
