//! The `bimorph` command.
fn main() {}
