//! One way from a sender to a reader, with what can happen to messages on it.
//!
//! Responsible for: when each message arrives, and in what order. Not responsible for: which of
//! them something happens to (`active.rs`), what a reader makes of them (`driver.rs`).
//!
//! Messages on time arrive in the order in which they were sent, late ones behind them.

/// What happens to one message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fate {
    /// It never arrives.
    Lost,
    /// It arrives, and so many ticks later once more.
    Again(u64),
    /// It arrives behind the next one.
    Swapped,
    /// It arrives so many ticks late.
    Late(u64),
}

/// A message on its way.
struct Sent<T> {
    due: u64,
    late: bool,
    message: T,
}

/// Messages on their way to one reader.
pub(crate) struct Line<T> {
    sent: Vec<Sent<T>>,
    swapped: Option<T>,
}

impl<T: Clone> Line<T> {
    /// Nothing sent yet.
    pub(crate) const fn new() -> Self {
        Self {
            sent: Vec::new(),
            swapped: None,
        }
    }

    /// Sends a message that is due at tick `due`.
    pub(crate) fn send(&mut self, due: u64, message: T, fate: Option<Fate>) {
        match fate {
            None => self.put(due, false, message),
            Some(Fate::Lost) => {}
            Some(Fate::Again(after)) => {
                self.put(due + after, true, message.clone());
                self.put(due, false, message);
            }
            Some(Fate::Late(by)) => self.put(due + by, true, message),
            Some(Fate::Swapped) => {
                let before = self.swapped.replace(message);
                if let Some(before) = before {
                    self.put(due, false, before);
                }
                return;
            }
        }
        if let Some(swapped) = self.swapped.take() {
            self.put(due, true, swapped);
        }
    }

    fn put(&mut self, due: u64, late: bool, message: T) {
        self.sent.push(Sent { due, late, message });
    }

    /// Takes what has arrived by tick `now`, in the order of its arrival.
    pub(crate) fn arrived(&mut self, now: u64) -> Vec<T> {
        if self.sent.iter().all(|sent| sent.due > now) {
            return Vec::new();
        }
        let (mut arrived, waiting): (Vec<_>, Vec<_>) =
            self.sent.drain(..).partition(|sent| sent.due <= now);
        self.sent = waiting;
        arrived.sort_by_key(|sent| (sent.due, sent.late));
        arrived.into_iter().map(|sent| sent.message).collect()
    }

    /// What is on its way does not arrive: its reader is gone.
    pub(crate) fn clear(&mut self) {
        self.sent.clear();
        self.swapped = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sends 0, 1, 2, … at the ticks of those numbers, the first as `fate` says; what arrives at
    /// each tick.
    fn arrivals(fate: Fate) -> Vec<Vec<u64>> {
        let mut line = Line::new();
        (0..4)
            .map(|tick| {
                line.send(tick, tick, (tick == 0).then_some(fate));
                line.arrived(tick)
            })
            .collect()
    }

    #[test]
    fn messages_are_lost_doubled_swapped_and_late() {
        let none: Vec<u64> = Vec::new();
        assert_eq!(
            arrivals(Fate::Lost),
            [none.clone(), vec![1], vec![2], vec![3]]
        );
        assert_eq!(
            arrivals(Fate::Again(2)),
            [vec![0], vec![1], vec![2, 0], vec![3]]
        );
        assert_eq!(
            arrivals(Fate::Swapped),
            [none.clone(), vec![1, 0], vec![2], vec![3]]
        );
        assert_eq!(
            arrivals(Fate::Late(2)),
            [none, vec![1], vec![2, 0], vec![3]]
        );
    }
}
