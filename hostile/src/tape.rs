//! What to do to a good value.
//!
//! Responsible for: reading a tape of bytes as numbers, changing words as it says.
//! Not responsible for: what is changed (the targets), where tapes come from.
//!
//! A number below 257 takes one byte of the tape, one below 65,537 two, any other four, so that a
//! fuzzer that changes a byte changes one choice. A tape that has ended reads as zeros: every tape is
//! one, and most of them leave most words as they are.

use zerocopy::{FromBytes, Immutable, IntoBytes};

/// Words that break things.
const WORDS: [u32; 12] = [
    0,
    1,
    2,
    3,
    31,
    32,
    33,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_fffe,
    0xffff_ffff,
    0x7ff8_0000,
];
/// Bytes of a word.
const WORD: usize = 4;

/// What to do to a good value, byte by byte.
pub struct Tape<'a>(&'a [u8]);

impl<'a> Tape<'a> {
    /// One from its beginning.
    #[must_use]
    pub const fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    fn bytes(&mut self, count: usize) -> u32 {
        let (read, rest) = self.0.split_at(self.0.len().min(count));
        self.0 = rest;
        let mut bytes = [0; WORD];
        bytes[..read.len()].copy_from_slice(read);
        u32::from_le_bytes(bytes)
    }

    /// Any number.
    pub fn word(&mut self) -> u32 {
        self.bytes(WORD)
    }

    /// A number below `end`; 0 where there is none.
    pub fn below(&mut self, end: usize) -> usize {
        let bytes = match end {
            0..=0x100 => 1,
            0x101..=0x1_0000 => 2,
            _ => WORD,
        };
        self.bytes(bytes) as usize % end.max(1)
    }

    /// Whether something happens that does so once in `times`.
    pub fn once_in(&mut self, times: usize) -> bool {
        self.below(times) == times - 1
    }

    /// Whether there is nothing left of it.
    #[must_use]
    pub const fn has_ended(&self) -> bool {
        self.0.is_empty()
    }

    /// Changes up to three words of `bytes`.
    pub fn change(&mut self, bytes: &mut [u8]) {
        for _ in 0..self.below(4) {
            let at = self.below(bytes.len() / WORD) * WORD;
            let Some(place) = bytes.get_mut(at..at + WORD) else {
                return;
            };
            let old = u32::from_le_bytes([place[0], place[1], place[2], place[3]]);
            let new = match self.below(4) {
                0 => WORDS[self.below(WORDS.len())],
                1 => old ^ 1 << self.below(32),
                2 => old.wrapping_add(self.below(5) as u32).wrapping_sub(2),
                _ => self.word(),
            };
            place.copy_from_slice(&new.to_le_bytes());
        }
    }

    /// Changes words of a message's first `live` bytes.
    pub fn change_message<T: IntoBytes + FromBytes + Immutable>(
        &mut self,
        message: &mut T,
        live: usize,
    ) {
        let bytes = message.as_mut_bytes();
        let live = live.min(bytes.len());
        self.change(&mut bytes[..live]);
    }
}
