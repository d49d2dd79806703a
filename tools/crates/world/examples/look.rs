//! Writes what both eyes see at the kick-off of a seed: `cargo run --release -p world --example look
//! SEED FOLDER`.

use std::path::Path;
use std::time::Instant;

use world::camera::{Camera, Eye, HEIGHT, WIDTH};
use world::physics::Pose;
use world::render::{Frame, Scene};
use world::{BallColour, render};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let folder = args.next().ok_or("usage: look FOLDER")?;
    let pose = Pose { x_mm: -223.3644, y_mm: 57.77, heading_rad: (-10.6_f64).to_radians() };
    let scene = Scene {
        ball_mm: Some([0.0, 0.0]),
        ball_colour: BallColour::Yellow,
        robot: Some(Pose { x_mm: 405.0, y_mm: -53.0, heading_rad: 3.0 }),
    };
    for (eye, name) in [(Eye::Left, "left"), (Eye::Right, "right")] {
        let camera = Camera::of_robot(pose, eye);
        let mut frame = Frame::new();
        let start = Instant::now();
        for _ in 0..10 {
            render::render(&camera, &scene, &mut frame);
        }
        println!("{name}: {:.2} ms", start.elapsed().as_secs_f64() * 100.0);
        let bytes = frame.iter().flat_map(|c| c.map(|v| (v * 255.0 + 0.5) as u8)).collect();
        image::RgbImage::from_raw(WIDTH as u32, HEIGHT as u32, bytes)
            .ok_or("size")?
            .save(Path::new(&folder).join(format!("{name}.png")))?;
    }
    Ok(())
}
