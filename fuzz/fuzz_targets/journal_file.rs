//! The file of the world's journal. The process shell (crate `node`) would bring iceoryx2 along, so its
//! two files are compiled in here.

#![no_main]

#[path = "../../node/src/journal/damage.rs"]
mod damage;
#[path = "../../node/src/journal.rs"]
mod journal;

use damage::Left;
use journal::{Found, INDEX, Journal, RING_AT, SLOTS_AT};

thread_local! {
    static LEFT: Left = Left::new();
}

libfuzzer_sys::fuzz_target!(|tape: &[u8]| {
    let got = LEFT.with(|left| left.open(tape));
    rearrange_fuzz::count(|| "JournalFile".to_owned(), got);
});
