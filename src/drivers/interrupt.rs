//! Ctrl-C and SIGTERM for work that looks now and then whether it is to stop.
//!
//! Responsible for: turning the first signal into a flag; the second one ends the program at once.
//! Not responsible for: runs with processes, whose supervisor catches signals itself.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use crate::exit::Exit;

/// Set once somebody has asked the run to stop.
#[derive(Clone, Debug)]
pub(crate) struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Watches for both signals from now on.
    ///
    /// # Errors
    /// The handlers cannot be installed.
    pub(crate) fn watch() -> io::Result<Self> {
        let asked = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            let status = i32::from(Exit::Interrupted as u8);
            flag::register_conditional_shutdown(signal, status, Arc::clone(&asked))?;
            flag::register(signal, Arc::clone(&asked))?;
        }
        Ok(Self(asked))
    }

    /// Whether somebody has.
    pub(crate) fn is_asked(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
