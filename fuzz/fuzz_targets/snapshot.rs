//! The world's snapshots, as robots and planner read them.

#![no_main]

use hostile::Target;

libfuzzer_sys::fuzz_target!(|tape: &[u8]| rearrange_fuzz::run(Target::Snapshot, tape));
