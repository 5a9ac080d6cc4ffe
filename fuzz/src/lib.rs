//! What all fuzz targets share.
//!
//! Responsible for: the good values that a process makes once, counting how far executions got.
//! Not responsible for: the targets (crate `hostile`), the loop and the tapes (libFuzzer).

use std::cell::RefCell;

use hostile::{Got, Target, Targets};

/// How often each came of an execution, by [`Got`]; said when the process ends of itself.
struct Count {
    what: String,
    got: [u64; 3],
}

impl Drop for Count {
    fn drop(&mut self) {
        let [refused, inside, accepted] = self.got;
        let all = refused + inside + accepted;
        let share = |count: u64| 100.0 * count as f64 / all.max(1) as f64;
        eprintln!(
            "{}: {all} executions, {:.1} % past the header, {:.1} % accepted",
            self.what,
            share(inside + accepted),
            share(accepted),
        );
    }
}

thread_local! {
    static TARGETS: Targets = Targets::new();
    static COUNT: RefCell<Option<Count>> = const { RefCell::new(None) };
}

/// Runs `target` on one tape.
pub fn run(target: Target, tape: &[u8]) {
    let got = TARGETS.with(|targets| targets.run(target, tape));
    count(|| format!("{target:?}"), got);
}

/// Counts an execution of the target called `what`.
pub fn count(what: impl FnOnce() -> String, got: Got) {
    COUNT.with_borrow_mut(|count| {
        let count = count.get_or_insert_with(|| Count {
            what: what(),
            got: [0; 3],
        });
        count.got[got as usize] += 1;
    });
}
