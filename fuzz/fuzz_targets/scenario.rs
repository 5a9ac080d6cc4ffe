//! The text of scenario files.

#![no_main]

use hostile::Target;

libfuzzer_sys::fuzz_target!(|tape: &[u8]| rearrange_fuzz::run(Target::Scenario, tape));
