//! Each refusal once, and what must not be refused.

use super::*;

const COUNTS: Counts = Counts {
    robots: 4,
    objects: 5,
};

fn options() -> RunOptions {
    RunOptions::new(Settings::default())
}

#[test]
fn spinning_takes_a_core_for_each_process() {
    let spin = RunOptions {
        wait: Wait::Spin,
        ..options()
    };
    assert_eq!(spin.check(COUNTS, 7), Ok(()));
    let refused = spin.check(COUNTS, 6);
    let expected = OptionError::Spin {
        processes: 7,
        cores: 6,
    };
    assert_eq!(refused, Err(expected));
    assert_eq!(options().check(COUNTS, 2), Ok(()), "hybrid may share cores");
}

#[test]
fn real_time_priority_with_yielding_takes_a_core_for_each_process() {
    let asked = |wait, clock| RunOptions {
        wait,
        clock,
        realtime_scheduling: true,
        ..options()
    };
    let real = Clock::Real {
        rate_hz: 1_000,
        speed: 1.0,
    };
    assert!(
        asked(Wait::Hybrid, Clock::Lockstep)
            .check(COUNTS, 2)
            .is_err()
    );
    assert_eq!(
        asked(Wait::Hybrid, Clock::Lockstep).check(COUNTS, 7),
        Ok(())
    );
    assert_eq!(asked(Wait::Block, Clock::Lockstep).check(COUNTS, 2), Ok(()));
    // In real time everybody sleeps to a deadline.
    assert_eq!(asked(Wait::Hybrid, real).check(COUNTS, 2), Ok(()));
}

#[test]
fn numbers_out_of_range_are_refused() {
    for (rate_hz, speed) in [(0, 1.0), (MAX_RATE_HZ + 1, 1.0), (1, 0.0), (1, f64::NAN)] {
        let clock = Clock::Real { rate_hz, speed };
        let options = RunOptions { clock, ..options() };
        let refused = options.check(COUNTS, 8);
        assert!(matches!(refused, Err(OptionError::Range { .. })));
    }
    let delay = Delay {
        role: Role::Robot(COUNTS.robots + DEFAULT_MORE_ROBOTS),
        ms: 1,
        ticks: 1,
    };
    let options = RunOptions {
        delays: vec![delay],
        ..options()
    };
    let refused = options.check(COUNTS, 8);
    assert!(matches!(refused, Err(OptionError::Delay { .. })));
}

#[test]
fn roles_are_read_as_they_are_written() {
    for role in Role::all(3) {
        assert_eq!(role.to_string().parse(), Ok(role));
    }
    for text in ["", "robot", "robot-", "robot-x", "World"] {
        assert_eq!(text.parse::<Role>(), Err(UnknownRole(text.to_owned())));
    }
}

#[test]
fn virtual_time_of_a_period_is_speed_over_rate() {
    let real = Clock::Real {
        rate_hz: 1_000,
        speed: 20.0,
    };
    assert_eq!(real.tick_ns(7), 20_000_000);
    assert_eq!(real.period_ns(), Some(1_000_000));
    assert_eq!(Clock::Lockstep.tick_ns(7), 7);
    assert_eq!(Clock::Lockstep.period_ns(), None);
}
