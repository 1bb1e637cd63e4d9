//! draft
fn main() {
    divan::main();
}
