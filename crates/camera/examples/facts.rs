//! The facts of any recording and the mean count of a region, frame by frame:
//! `cargo run --release -p chainwave-camera --example facts -- RECORDING [X Y WIDTH HEIGHT]`.
#![expect(clippy::print_stdout, reason = "a program for the terminal")]

use std::error::Error;

use chainwave_camera::open;
use chainwave_measurement::{Recording, Region};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (path, region) = match arguments.as_slice() {
        [path] => (path, None),
        [path, region @ ..] if region.len() == 4 => (path, Some(region)),
        _ => {
            return Err(
                "expected a recording, and perhaps the X, Y, WIDTH and HEIGHT of a region in pixels".into()
            );
        }
    };
    let recording = open(path.as_ref())?;
    let info = recording.info();
    println!(
        "{}: {} frames of {} x {} px, {} bit",
        info.format, info.n_frames, info.width_px, info.height_px, info.bit_depth
    );
    match info.rate_hz {
        Some(rate_hz) => {
            let first_s = info.times_s[0];
            println!("{rate_hz} frames a second, the first {first_s} s from the trigger");
        }
        None => println!("no frame rate is known: times count frames"),
    }
    info.warnings.iter().for_each(|warning| println!("note: {warning}"));
    let region = region.map_or(Ok(Region::whole(info.width_px, info.height_px)), parsed)?;
    for frame in 0..info.n_frames {
        println!("{}, {}", info.times_s[frame], mean(recording.as_ref(), frame, region)?);
    }
    Ok(())
}

fn parsed(numbers: &[String]) -> Result<Region, Box<dyn Error>> {
    let number = |index: usize| numbers[index].parse::<usize>();
    Ok(Region { x: number(0)?, y: number(1)?, width: number(2)?, height: number(3)? })
}

/// Mean count of a region; reading costs no more than the region's rows.
fn mean(recording: &dyn Recording, frame: usize, region: Region) -> Result<f64, Box<dyn Error>> {
    let mut pixels = vec![0.0; region.n_pixels()];
    recording.read_region(frame, region, &mut pixels)?;
    Ok(pixels.iter().map(|&count| f64::from(count)).sum::<f64>() / pixels.len() as f64)
}
