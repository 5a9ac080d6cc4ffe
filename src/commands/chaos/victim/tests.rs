//! What one run shows of set-ups decides when the processes of the next are struck.

use clap::Parser;

use super::*;
use crate::cli::{Cli, Command as Asked};

const MS: u64 = 1_000_000;

/// Kills of the world, all in set-up.
fn plan() -> Plan {
    let words = "rearrange chaos --kills 100 --during setup --targets world";
    let Asked::Chaos(args) = Cli::parse_from(words.split(' ')).command else {
        panic!("chaos was asked for");
    };
    Plan::new(&args)
}

/// A run of which nothing is there but what its diary says.
fn victim(set_ups: &mut SetUps) -> Victim<'_> {
    let victim = Victim::of(PathBuf::from("true"), Vec::new(), 0, set_ups).unwrap();
    victim.clean_up();
    victim
}

/// A world process in set-up for so long, and when it was to be struck meanwhile, as a share of that.
fn set_up(victim: &mut Victim<'_>, plan: &mut Plan, pid: u32, lasted_ns: u64) -> f64 {
    let started_ns = 1_000 * MS * u64::from(pid);
    let role = Role::World;
    let entry = |at_ns, happened| Entry { at_ns, happened };
    let started = Happened::Started {
        role,
        incarnation: pid,
        pid,
    };
    victim.note(entry(started_ns, started));
    victim.arm(plan);
    let armed = victim.armed.pop().unwrap();
    assert_eq!((armed.role, armed.pid), (Some(role), pid));
    victim.note(entry(started_ns + lasted_ns, Happened::Ready { role, pid }));
    (armed.at_ns - started_ns) as f64 / armed.blow.at / MS as f64
}

#[test]
fn blows_fall_within_set_ups_as_long_as_those_of_this_run_and_the_ones_before_it() {
    let (mut set_ups, mut plan) = (SetUps::default(), plan());
    let mut at =
        |run: &mut Victim<'_>, pid, lasted_ms| set_up(run, &mut plan, pid, lasted_ms * MS).round();
    let mut first = victim(&mut set_ups);
    assert_eq!(at(&mut first, 1, 80), 40.0, "a guess");
    assert_eq!(at(&mut first, 2, 160), 80.0, "as the one before");
    drop(first);
    let mut next = victim(&mut set_ups);
    // Seven eighths of 80, one of 160.
    assert_eq!(at(&mut next, 3, 90), 90.0, "as those of the run before");
    assert_eq!(at(&mut next, 4, 90), 90.0);
}

/// So that one that hung for once is forgotten.
#[test]
fn a_set_up_that_lasts_otherwise_changes_what_is_usual_by_an_eighth_of_the_difference() {
    let mut set_ups = SetUps::default();
    set_ups.learn(Target::Planner, 8 * MS);
    set_ups.learn(Target::Planner, 808 * MS);
    assert_eq!(set_ups.usual_ns(Target::Planner), 108 * MS);
    for _ in 0..60 {
        set_ups.learn(Target::Planner, 8 * MS);
    }
    let usual_ns = set_ups.usual_ns(Target::Planner);
    assert!((8 * MS..9 * MS).contains(&usual_ns), "{usual_ns}");
    // Nothing was seen of others: they are told apart.
    assert_eq!(set_ups.usual_ns(Target::Robots), 40 * MS);
    assert_eq!(set_ups.usual_ns(Target::Supervisor), 160 * MS);
}

/// Otherwise it would come too late in every run after that, too.
#[test]
fn a_blow_that_came_after_the_set_up_falls_sooner_the_next_time() {
    let (mut set_ups, mut plan) = (SetUps::default(), plan());
    let mut run = victim(&mut set_ups);
    let role = Role::World;
    let entry = |at_ns, happened| Entry { at_ns, happened };
    let mut waits = (1..=3).map(|pid| {
        let started = Happened::Started {
            role,
            incarnation: pid,
            pid,
        };
        run.note(entry(1, started));
        run.arm(&mut plan);
        let at = run.armed[0].blow.at;
        run.note(entry(2, Happened::Ready { role, pid }));
        run.strike(&mut plan);
        assert!(run.armed.is_empty() && run.dealt.is_empty());
        at
    });
    let (first, second, third) = (waits.next(), waits.next(), waits.next());
    assert!(
        second < first && third < second,
        "{first:?} {second:?} {third:?}"
    );
}

#[test]
fn a_run_whose_trace_grows_is_not_wedged_though_its_diary_says_nothing() {
    let mut set_ups = SetUps::default();
    let mut run = victim(&mut set_ups);
    let directory = tempfile::tempdir().unwrap();
    run.directory = Some(directory.path().to_owned());
    let mut is_alive_after = |change: &dyn Fn()| {
        let before = run.alive;
        change();
        run.read();
        run.alive > before
    };
    let trace = directory.path().join(TRACE_FILE);
    assert!(is_alive_after(&|| fs::write(&trace, "one").unwrap()));
    assert!(!is_alive_after(&|| ()));
    assert!(is_alive_after(
        &|| fs::write(&trace, "one and more").unwrap()
    ));
}
