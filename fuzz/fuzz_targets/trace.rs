//! Traces, as the checker and a recorder that goes on read them.

#![no_main]

use hostile::Target;

libfuzzer_sys::fuzz_target!(|tape: &[u8]| rearrange_fuzz::run(Target::Trace, tape));
