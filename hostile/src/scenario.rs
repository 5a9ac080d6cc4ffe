//! The text of scenario files.
//!
//! Responsible for: changing digits, lines and bytes of good files; that what is accepted is accepted
//! again in its canonical form. Not responsible for: what is wrong with a file (crate `scene`).

use crate::{Got, Tape};

/// Pieces of scenario files, good and bad.
const PIECES: [&str; 16] = [
    "[[robots]]\nhome = [0.5, 0.5]\n",
    "[[objects]]\nstart = [1.0, 1.0]\n",
    "speed = -1.0\n",
    "nan",
    "inf",
    "-0.0",
    "1e308",
    "1e-300",
    "clearance = 0.1\n",
    "pass_under = true\n",
    "[]",
    "{ circle = 0.2 }",
    "{ polygon = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]] }",
    "0.05",
    "4",
    "\"",
];

/// A file that was changed.
pub(crate) fn read(texts: &[String], tape: &mut Tape<'_>) -> Got {
    let mut text = texts[tape.below(texts.len())].clone().into_bytes();
    for _ in 0..tape.below(4) {
        let at = tape.below(text.len());
        let is_end = |byte: &u8| *byte == b'\n';
        let line = text[..at].iter().rposition(is_end).map_or(0, |end| end + 1);
        match tape.below(16) {
            // A digit for a digit: what is said is said well.
            0..=7 => {
                if let Some(digit) = text[line..].iter().position(u8::is_ascii_digit) {
                    text[line + digit] = b'0' + tape.below(10) as u8;
                }
            }
            8..=10 => {
                let piece = PIECES[tape.below(PIECES.len())].bytes();
                text.splice(line..line, piece);
            }
            11..=13 => {
                let end = text[line..].iter().position(is_end);
                text.drain(line..end.map_or(text.len(), |end| line + end + 1));
            }
            14 => text[at] = b"0123456789.-"[tape.below(12)],
            _ => text[at] = tape.word() as u8,
        }
        if text.is_empty() {
            break;
        }
    }
    let Ok(text) = String::from_utf8(text) else {
        return Got::Refused;
    };
    match scene::parse(&text, "hostile.toml") {
        Ok(scene) => {
            let canonical = scene::to_canonical_toml(&scene);
            assert!(scene::parse(&canonical, "canonical.toml").is_ok(), "{text}");
            Got::Accepted
        }
        Err(problems) if text.parse::<toml::Table>().is_err() => {
            assert!(!problems.to_string().is_empty());
            Got::Refused
        }
        Err(_) => Got::Inside,
    }
}
