//! Terminals, pipes, colours.

use std::fs::File;
use std::io::Read;
use std::os::fd::{FromRawFd, OwnedFd};
use std::process::{Command, Stdio};

fn program() -> Command {
    Command::new(assert_cmd::cargo::cargo_bin!("rearrange"))
}

#[test]
fn a_reader_that_goes_away_is_no_error() {
    let commands: [&[&str]; 4] = [
        &["schema"],
        &["scenarios"],
        &["run", "e1", "--driver", "in-process", "--json"],
        &["run", "--help"],
    ];
    for arguments in commands {
        let mut child = program()
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        let complaint = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {complaint}");
        assert_eq!(complaint, "", "{arguments:?}");
    }
}

/// All a run prints on a terminal of 120 columns, with `NO_COLOR` set to this.
fn on_a_terminal(no_color: Option<&str>) -> String {
    let (ours, theirs) = terminal();
    let mut command = program();
    command
        .args(["run", "h1", "--driver", "in-process", "--tick", "0.1"])
        .env("TERM", "xterm")
        .env_remove("NO_COLOR")
        .stdin(Stdio::null())
        .stdout(theirs.try_clone().unwrap())
        .stderr(theirs);
    if let Some(value) = no_color {
        command.env("NO_COLOR", value);
    }
    let mut child = command.spawn().unwrap();
    drop(command);
    let mut bytes = Vec::new();
    // Ends with an error once the other side is closed.
    let _ = File::from(ours).read_to_end(&mut bytes);
    assert_eq!(child.wait().unwrap().code(), Some(0));
    String::from_utf8_lossy(&bytes).into_owned()
}

fn terminal() -> (OwnedFd, OwnedFd) {
    let (mut ours, mut theirs) = (-1, -1);
    let size = libc::winsize {
        ws_row: 40,
        ws_col: 120,
        ws_xpixel: 0,
        ws_ypixel: 0,
    };
    let (name, termios) = (std::ptr::null_mut(), std::ptr::null());
    // SAFETY: both descriptors are written before use, and nobody else owns them.
    unsafe {
        assert_eq!(
            libc::openpty(&mut ours, &mut theirs, name, termios, &size),
            0
        );
        (OwnedFd::from_raw_fd(ours), OwnedFd::from_raw_fd(theirs))
    }
}

/// Whether a text sets a colour of the foreground or background.
fn has_colour(text: &str) -> bool {
    text.match_indices("\u{1b}[")
        .map(|(start, _)| &text[start + 2..])
        .filter_map(|rest| rest.split_once('m'))
        .any(|(codes, _)| codes.starts_with(['3', '4']) && codes.len() <= 8)
}

#[test]
fn a_terminal_shows_progress_and_colours_unless_told_not_to() {
    let text = on_a_terminal(None);
    assert!(text.contains("objects"), "no progress: {text:?}");
    assert!(text.contains("solved"), "{text:?}");
    assert!(has_colour(&text), "{text:?}");
    let plain = on_a_terminal(Some("1"));
    assert!(plain.contains("solved"), "{plain:?}");
    assert!(!has_colour(&plain), "{plain:?}");
}

#[test]
fn pipes_get_neither_progress_nor_colours() {
    let output = program()
        .args(["run", "e1", "--driver", "in-process"])
        .env("CLICOLOR_FORCE", "1")
        .output()
        .unwrap();
    assert!(!output.stdout.contains(&0x1b));
    assert!(output.stderr.is_empty());
}
