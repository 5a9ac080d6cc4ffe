//! What it costs to copy: Unix datagrams of the same payload to as many readers.
//!
//! Responsible for: the time from before the first datagram of a tick is sent to each reader's
//! having it, all of them blocking; each tick waits for all answers.
//! Not responsible for: processes: the kernel copies between threads as between processes.

use std::io;
use std::os::unix::net::UnixDatagram;
use std::thread;
use std::time::{Duration, Instant};

use hdrhistogram::Histogram;
use node::histograms::empty;

/// Ticks before it counts.
const WARM_UP: u64 = 20;
/// How long an answer may take.
const PATIENCE: Duration = Duration::from_secs(5);
/// Bytes of a stamp.
const STAMP: usize = 8;

/// What was measured.
pub(super) struct Measured {
    /// From the stamp to the reader's having the datagram.
    pub(super) age: Histogram<u64>,
    /// Sending one tick's datagrams to all readers.
    pub(super) send: Histogram<u64>,
    /// From one tick to the next.
    pub(super) tick: Histogram<u64>,
}

/// Sends `bytes` to each of `readers`, tick by tick, for as long as `duration`.
///
/// # Errors
/// The system refuses sockets, threads or datagrams of this size.
pub(super) fn measure(readers: usize, bytes: usize, duration: Duration) -> io::Result<Measured> {
    let epoch = Instant::now();
    let mut sockets = Vec::with_capacity(readers);
    let mut threads = Vec::with_capacity(readers);
    for _ in 0..readers {
        let (ours, theirs) = UnixDatagram::pair()?;
        ours.set_read_timeout(Some(PATIENCE))?;
        sockets.push(ours);
        threads.push(thread::Builder::new().spawn(move || read(&theirs, bytes, epoch))?);
    }
    let published = publish(&sockets, bytes, duration, epoch);
    for socket in &sockets {
        // An empty datagram is the end; a reader that is gone needs none.
        let _ = socket.send(&[]);
    }
    let mut age = empty();
    for thread in threads {
        let own = thread
            .join()
            .map_err(|_| io::Error::other("a reader broke off"))??;
        age.add(own).map_err(io::Error::other)?;
    }
    let (send, tick) = published?;
    Ok(Measured { age, send, tick })
}

fn publish(
    sockets: &[UnixDatagram],
    bytes: usize,
    duration: Duration,
    epoch: Instant,
) -> io::Result<(Histogram<u64>, Histogram<u64>)> {
    let (mut send, mut tick) = (empty(), empty());
    let mut payload = vec![0; bytes.max(STAMP)];
    let mut answer = [0; STAMP];
    let until = Instant::now() + duration;
    for turn in 0.. {
        let started = Instant::now();
        let stamp = (started - epoch).as_nanos() as u64;
        // The reader leaves the warm-up out.
        let stamp = if turn < WARM_UP { 0 } else { stamp };
        payload[..STAMP].copy_from_slice(&stamp.to_le_bytes());
        for socket in sockets {
            socket.send(&payload)?;
        }
        let sent = Instant::now();
        for socket in sockets {
            socket.recv(&mut answer)?;
        }
        let done = Instant::now();
        if turn >= WARM_UP {
            send.saturating_record((sent - started).as_nanos() as u64);
            tick.saturating_record((done - started).as_nanos() as u64);
        }
        if done > until {
            break;
        }
    }
    Ok((send, tick))
}

fn read(socket: &UnixDatagram, bytes: usize, epoch: Instant) -> io::Result<Histogram<u64>> {
    let mut age = empty();
    let mut payload = vec![0; bytes.max(STAMP)];
    loop {
        let stamp = match socket.recv(&mut payload) {
            Ok(0) => return Ok(age),
            Ok(_) => payload
                .first_chunk()
                .map_or(0, |stamp| u64::from_le_bytes(*stamp)),
            Err(error) => return Err(error),
        };
        if stamp > 0 {
            let now_ns = epoch.elapsed().as_nanos() as u64;
            age.saturating_record(now_ns.saturating_sub(stamp));
        }
        socket.send(&[0; STAMP])?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_reader_gets_every_datagram() {
        let measured = measure(3, 20_000, Duration::from_millis(50)).unwrap();
        assert!(!measured.tick.is_empty());
        assert_eq!(measured.age.len(), measured.tick.len() * 3);
        assert_eq!(measured.send.len(), measured.tick.len());
    }
}
