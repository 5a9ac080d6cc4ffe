//! Ctrl-C and SIGTERM while a run is on.
//!
//! Responsible for: noting a signal instead of dying of it, as long as any run of this process is
//! on; after that signals do what they always did.
//! Not responsible for: what follows from one (`supervisor`).

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::{SigId, flag, low_level};

const SIGNALS: [i32; 3] = [SIGINT, SIGTERM, SIGHUP];

/// Runs of this process that are on.
static RUNS: Mutex<usize> = Mutex::new(0);
/// Set while none is on.
static IDLE: OnceLock<Arc<AtomicBool>> = OnceLock::new();

/// The signals of one run. A program that makes several runs holds one over all of them, so that
/// a signal between two does not end it.
pub struct Signals {
    noted: Arc<AtomicBool>,
    handlers: Vec<SigId>,
}

impl Signals {
    /// Notes signals from now on, until it is dropped.
    ///
    /// # Errors
    /// The system refused.
    pub fn watch() -> io::Result<Self> {
        let mut runs = RUNS.lock().unwrap_or_else(PoisonError::into_inner);
        if IDLE.get().is_none() {
            let idle = Arc::new(AtomicBool::new(false));
            for signal in SIGNALS {
                flag::register_conditional_default(signal, Arc::clone(&idle))?;
            }
            let _ = IDLE.set(idle);
        }
        let noted = Arc::new(AtomicBool::new(false));
        let mut handlers = Vec::new();
        for signal in SIGNALS {
            handlers.push(flag::register(signal, Arc::clone(&noted))?);
        }
        *runs += 1;
        set_idle(false);
        Ok(Self { noted, handlers })
    }

    /// Whether a signal has come since this was last asked.
    pub fn take(&self) -> bool {
        self.noted.swap(false, Ordering::Relaxed)
    }
}

impl Drop for Signals {
    fn drop(&mut self) {
        for handler in self.handlers.drain(..) {
            low_level::unregister(handler);
        }
        let mut runs = RUNS.lock().unwrap_or_else(PoisonError::into_inner);
        *runs -= 1;
        set_idle(*runs == 0);
    }
}

fn set_idle(now: bool) {
    if let Some(idle) = IDLE.get() {
        idle.store(now, Ordering::Relaxed);
    }
}
