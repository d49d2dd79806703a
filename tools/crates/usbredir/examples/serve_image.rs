//! Serves an image on a chip without a board to a usbredir client.
//!
//! `cargo run --release -p usbredir --example serve_image -- HOST:PORT [IMAGE] [SECONDS]`

use fx2::host::{Bench, Link};
use fx2::image::Image;
use fx2::pins::Unconnected;
use fx2::{Config, Fx2, Ram};
use sim::SECOND;
use std::error::Error;
use std::net::TcpListener;
use usbredir::{Options, serve};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let address = arguments.next().ok_or("give HOST:PORT, and perhaps an image and seconds")?;
    let mut fx2 = Fx2::new(Config { ram: Ram::K16, external_ram: false });
    if let Some(path) = arguments.next().filter(|path| path != "-") {
        fx2.load(&Image::parse(&std::fs::read(path)?)?)?;
    }
    let seconds = arguments.next().map(|text| text.parse::<u64>()).transpose()?;
    let listener = TcpListener::bind(address)?;
    let mut board = Unconnected;
    let mut bench = Bench { fx2: &mut fx2, board: &mut board };
    let duration = seconds.map(|seconds| seconds * SECOND);
    let options = Options { duration, ..Options::default() };
    serve(&listener, &mut bench, options, |notice| println!("{notice:?}"))?;
    for diagnostic in bench.fx2().diagnostics() {
        println!("{diagnostic}");
    }
    Ok(())
}
