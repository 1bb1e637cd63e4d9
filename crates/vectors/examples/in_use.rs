//! Which instruction sets this machine has, and which one is in use: `CHAINWAVE_INSTRUCTION_SET` names another.
//!
//! `cargo run --release -p chainwave-vectors --example in_use`

use chainwave_vectors::InstructionSet;

#[expect(clippy::print_stdout, reason = "the names are the program's result")]
fn main() {
    let available: Vec<&str> = InstructionSet::available().map(InstructionSet::name).collect();
    println!("available: {}; in use: {}", available.join(", "), InstructionSet::in_use());
}
