//! Requests of control, as the world reads them.

#![no_main]

use hostile::Target;

libfuzzer_sys::fuzz_target!(|tape: &[u8]| rearrange_fuzz::run(Target::Control, tape));
