//! x
use chainwave_correlation::*;
use chainwave_measurement::{MemoryRecording, Subset};
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let b = std::fs::read(&args[1]).unwrap();
    let hl = u16::from_le_bytes([b[8], b[9]]) as usize;
    let head = String::from_utf8_lossy(&b[10..10 + hl]).to_string();
    let shape = &head[head.find("(").unwrap() + 1..head.find(")").unwrap()];
    let s: Vec<usize> = shape.split(',').filter_map(|v| v.trim().parse().ok()).collect();
    let data = &b[10 + hl..];
    let n = s[1] * s[2];
    eprintln!("{head}");
    let frames: Vec<Vec<f32>> =
        (0..s[0]).map(|k| data[k * n..(k + 1) * n].iter().map(|v| f32::from(*v)).collect()).collect();
    let rec = MemoryRecording::new(s[2], 8, frames);
    let sub = Subset::new("b", args[2].parse().unwrap(), args[3].parse().unwrap(), 16, 16);
    let t = track(&rec, &[sub], &ReferenceFrames::Single(0), &Settings::default(), &|_| ()).unwrap();
    for (k, p) in t[0].positions.iter().enumerate() {
        println!(
            "{k} {:?}",
            p.as_ref().map(|p| (
                p.x_px.value,
                p.y_px.value,
                p.x_px.sigma,
                p.zncc,
                p.theta_rad.map(|t| t.value.to_degrees())
            ))
        );
    }
}
