//! Writes what both eyes see in the paper's reference scene, and the picture of a few seconds of a
//! match whose robot just drives ahead: `cargo run --release -p world --example look FOLDER`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use world::camera::{Camera, Eye, HEIGHT, WIDTH};
use world::physics::Pose;
use world::render::{Frame, Scene};
use world::sensor::Sensors;
use world::{BallColour, Noise, Setup, World, render};

type Outcome = Result<(), Box<dyn std::error::Error>>;

/// The reference scene: right lens at (-228, 33) mm, yaw -10.6 degrees.
fn eyes(folder: &Path) -> Outcome {
    let pose = Pose { x_mm: -223.3644, y_mm: 57.77, heading_rad: (-10.6_f64).to_radians() };
    let scene = Scene {
        ball_mm: Some([0.0, 0.0]),
        ball_colour: BallColour::Yellow,
        robot: Some(Pose { x_mm: 405.0, y_mm: -53.0, heading_rad: 3.0 }),
    };
    for (eye, name) in [(Eye::Left, "left"), (Eye::Right, "right")] {
        let camera = Camera::of_robot(pose, eye);
        let mut frame = Frame::new();
        let mut best = f64::MAX;
        for _ in 0..40 {
            let start = Instant::now();
            render::render(&camera, &scene, &mut frame);
            best = best.min(start.elapsed().as_secs_f64());
        }
        println!("{name}: {:.2} ms", best * 1000.0);
        for (noise, level) in [(Noise::Measured, "measured"), (Noise::Harsh, "harsh")] {
            let mut sensors = Sensors::new(noise, 1, 0).ok_or("perfect")?;
            let mut seen = frame.clone();
            let start = Instant::now();
            sensors.expose(eye, &mut seen);
            println!("{level}: {:.2} ms more", start.elapsed().as_secs_f64() * 1000.0);
            save(&seen, &folder.join(format!("{name}_{level}.png")))?;
        }
        save(&frame, &folder.join(format!("{name}.png")))?;
    }
    Ok(())
}

fn save(frame: &Frame, file: &Path) -> Outcome {
    let bytes = frame.iter().flat_map(|c| c.map(|v| (v * 255.0 + 0.5) as u8)).collect();
    image::RgbImage::from_raw(WIDTH as u32, HEIGHT as u32, bytes).ok_or("size")?.save(file)?;
    Ok(())
}

/// Three seconds of seed 3, without a report.
fn match_picture(folder: &Path) -> Outcome {
    let mut world = World::new(&Setup { seed: 3, ..Setup::default() });
    let start = Instant::now();
    for tick in 0..3000 {
        let bend = f64::from(tick) / 60.0;
        world.step([[200.0 - bend, 170.0 + bend], [60.0, 90.0]]);
    }
    println!("physics: {:.1} us a step", start.elapsed().as_secs_f64() * 1e6 / 3000.0);
    world.picture(0, None, [0, 0]).save(folder.join("match.png"))?;
    Ok(())
}

fn main() -> Outcome {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("usage: look FOLDER")?);
    eyes(&folder)?;
    match_picture(&folder)
}
