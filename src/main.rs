//! The `rearrange` binary.
fn main() {}
