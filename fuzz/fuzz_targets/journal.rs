//! The world's saved state, as a world that is started again reads it.

#![no_main]

use hostile::Target;

libfuzzer_sys::fuzz_target!(|tape: &[u8]| rearrange_fuzz::run(Target::Journal, tape));
