//! The floor of all latencies: a cache line that two cores hand to and fro.
//!
//! Responsible for: the time one way, as half of each round trip.
//! Not responsible for: anything with a message in it (`datagram`, crate `node`).

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use hdrhistogram::Histogram;
use node::histograms::empty;

/// Round trips before it counts.
const WARM_UP: u64 = 1_000;
/// Tells the other side to stop.
const STOP: u64 = u64::MAX;

/// A word that shares its cache line, and the one fetched along with it, with nothing.
#[repr(align(128))]
#[derive(Default)]
struct Line(AtomicU64);

/// Hands a line to and fro for as long as `duration`, between the first two cores.
///
/// # Errors
/// There are no two cores, or the system gives no thread: the reason.
pub(super) fn measure(duration: Duration) -> Result<Histogram<u64>, String> {
    if thread::available_parallelism().map_or(1, usize::from) < 2 {
        return Err("takes two cores".to_owned());
    }
    let lines = Arc::new((Line::default(), Line::default()));
    let echo = {
        let lines = Arc::clone(&lines);
        thread::Builder::new()
            .spawn(move || echo(&lines.0, &lines.1))
            .map_err(|error| error.to_string())?
    };
    let there = Arc::clone(&lines);
    let ping = thread::Builder::new()
        .spawn(move || ping(&there.0, &there.1, duration))
        .map_err(|error| error.to_string());
    let histogram = ping.and_then(|ping| ping.join().map_err(|_| "broke off".to_owned()));
    lines.0.0.store(STOP, Ordering::Release);
    let _ = echo.join();
    histogram
}

fn ping(out: &Line, back: &Line, duration: Duration) -> Histogram<u64> {
    // Where the system refuses, it chooses the cores itself.
    let _ = node::pin_thread(0);
    let mut histogram = empty();
    let until = Instant::now() + duration;
    for turn in 1.. {
        let started = Instant::now();
        out.0.store(turn, Ordering::Release);
        while back.0.load(Ordering::Acquire) != turn {
            std::hint::spin_loop();
        }
        let now = Instant::now();
        if turn > WARM_UP {
            histogram.saturating_record((now - started).as_nanos() as u64 / 2);
        }
        if now > until {
            break;
        }
    }
    histogram
}

fn echo(there: &Line, back: &Line) {
    let _ = node::pin_thread(1);
    let mut last = 0;
    loop {
        match there.0.load(Ordering::Acquire) {
            STOP => return,
            turn if turn != last => {
                back.0.store(turn, Ordering::Release);
                last = turn;
            }
            _ => std::hint::spin_loop(),
        }
    }
}
