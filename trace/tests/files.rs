//! Traces as files: written from the messages of a run, read back whole, cut short, damaged, made
//! up.

#![expect(clippy::unwrap_used, reason = "a test may fail")]

use std::io::Cursor;

use proptest::prelude::*;
use shm_types::{
    BodyKind, Checked, Counts, EventKind, EventRecord, MotionBatch, MotionRecord, NONE, Point,
    WorldSnapshot,
};
use trace::record::{End, FORMAT, Object, Outcome, Outline, Place, RobotKind, SceneRecord};
use trace::{CheckReport, Close, Ending, ReadError, Reader, Replay, Writer};

const TICK_NS: u64 = 10_000_000;
const COUNTS: Counts = Counts {
    robots: 1,
    objects: 1,
};
/// Robot and object of half a metre and less; the robot at (0, 0), at 0.5 m/s 5 mm a tick.
const STEP_M: f64 = 0.005;
/// Ticks of the short run: approach, transfer, way home.
const LEGS: [(u64, f64, f64); 4] = [
    (100, 1.0, 0.0),
    (100, 0.0, 1.0),
    (100, 0.0, -1.0),
    (200, -1.0, 0.0),
];

fn scene() -> SceneRecord {
    let square = |half| Outline::Box {
        half: Place::new(half, half),
    };
    SceneRecord {
        format: FORMAT,
        program_version: "0.1.0".to_owned(),
        name: "short".to_owned(),
        scenario_hash: "00".to_owned(),
        run_id: "01".to_owned(),
        low: Place::new(-2.0, -2.0),
        high: Place::new(2.0, 3.0),
        walls: Vec::new(),
        robot: RobotKind {
            shape: square(0.25),
            speed_m_per_s: 0.5,
            clearance_m: 0.0,
            grasp_ns: 0,
            release_ns: 0,
        },
        homes: vec![Place::new(0.0, 0.0)],
        objects: vec![Object {
            shape: square(0.2),
            grasp: Place::new(0.0, -0.45),
            other_grasps: Vec::new(),
            kind: None,
            pass_under: false,
            start: Place::new(0.5, 0.45),
            goal: Some(Place::new(0.5, 0.95)),
        }],
        before: Vec::new(),
        settings: serde_json::json!({ "tick_ns": TICK_NS }),
    }
}

/// The world of the short run, one tick after the other.
struct World {
    batch: Box<MotionBatch>,
    snapshot: Box<WorldSnapshot>,
    robot: Point,
    object: Point,
    holds: bool,
    claims: bool,
}

impl World {
    fn new() -> Self {
        let mut world = Self {
            batch: shm_types::zeroed(),
            snapshot: shm_types::zeroed(),
            robot: Point::new(0.0, 0.0),
            object: Point::new(0.5, 0.45),
            holds: false,
            claims: false,
        };
        world.show();
        world
    }

    fn event(&mut self, kind: EventKind, value: u64) {
        let named = !matches!(
            kind,
            EventKind::Started | EventKind::Epoch | EventKind::Ended
        );
        let id = if named { 0 } else { NONE };
        self.batch.events[self.batch.event_count as usize] = EventRecord {
            robot: id,
            task: id,
            value,
            ..EventRecord::new(kind, self.batch.time_ns)
        };
        self.batch.event_count += 1;
    }

    fn motion(&mut self, body: BodyKind, from: Point, to: Point) {
        self.batch.motions[self.batch.motion_count as usize] = MotionRecord {
            start_ns: self.batch.tick * TICK_NS,
            end_ns: (self.batch.tick + 1) * TICK_NS,
            body: body.code(),
            id: 0,
            from,
            to,
        };
        self.batch.motion_count += 1;
    }

    /// One tick, moving so many steps along x and y.
    fn tick(&mut self, x: f64, y: f64, events: &[(EventKind, u64)]) {
        (self.batch.motion_count, self.batch.event_count) = (0, 0);
        let is_over = events.iter().any(|&(kind, _)| kind == EventKind::Ended);
        self.batch.time_ns += if is_over { TICK_NS } else { 0 };
        for &(kind, value) in events {
            self.event(kind, value);
            self.claims = kind == EventKind::Claimed || self.claims && kind != EventKind::Released;
            self.holds = kind == EventKind::Grasped || self.holds && kind != EventKind::Released;
        }
        let shift = |at: Point| Point::new(at.x + x * STEP_M, at.y + y * STEP_M);
        if (x, y) != (0.0, 0.0) {
            let to = shift(self.robot);
            self.motion(BodyKind::Robot, self.robot, to);
            self.robot = to;
            if self.holds {
                let to = shift(self.object);
                self.motion(BodyKind::Object, self.object, to);
                self.object = to;
            }
        }
        self.batch.sequence = self.batch.tick;
        self.batch.tick += 1;
        self.batch.time_ns = self.batch.tick * TICK_NS;
        self.show();
    }

    fn show(&mut self) {
        let header = &mut self.snapshot.header;
        *header = shm_types::SnapshotHeader {
            tick: self.batch.tick,
            time_ns: self.batch.time_ns,
            robot_count: 1,
            object_count: 1,
            epoch: 1,
            ..Default::default()
        };
        let id = |named: bool| if named { 0 } else { NONE };
        self.snapshot.robots[0] = shm_types::RobotState {
            position: self.robot,
            holding: id(self.holds),
            task: id(self.claims),
            ..Default::default()
        };
        self.snapshot.objects[0] = shm_types::ObjectState {
            position: self.object,
            holder: id(self.holds),
            ..Default::default()
        };
    }
}

/// The short run, written; `each` is called before each batch and says whether it is written.
fn written(mut each: impl FnMut(u64, &mut Writer<Cursor<Vec<u8>>>) -> bool) -> Vec<u8> {
    let mut writer = Writer::new(Cursor::new(Vec::new()), &scene(), 500_000_000).unwrap();
    let mut world = World::new();
    let mut step = |world: &mut World, writer: &mut Writer<_>| {
        if each(world.batch.sequence, writer) {
            writer.batch(&world.batch).unwrap();
            writer
                .snapshot(Checked::new(&*world.snapshot, COUNTS).unwrap())
                .unwrap();
        }
    };
    writer
        .snapshot(Checked::new(&*world.snapshot, COUNTS).unwrap())
        .unwrap();
    for (leg, (ticks, x, y)) in LEGS.into_iter().enumerate() {
        for tick in 0..ticks {
            let events: &[_] = match (leg, tick) {
                (0, 0) => &[
                    (EventKind::Started, 0),
                    (EventKind::Epoch, 1),
                    (EventKind::Claimed, 1),
                ],
                (1, 0) => &[(EventKind::GraspStarted, 0), (EventKind::Grasped, 0)],
                (2, 0) => &[
                    (EventKind::ReleaseStarted, 0),
                    (EventKind::Released, 0),
                    (EventKind::Completed, 0),
                ],
                _ => &[],
            };
            // The way home takes half its ticks: the robot stands first.
            let waits = leg == 3 && tick < ticks / 2;
            let (x, y) = if waits { (0.0, 0.0) } else { (x, y) };
            world.tick(x, y, events);
            step(&mut world, &mut writer);
        }
    }
    world.tick(
        0.0,
        0.0,
        &[(
            EventKind::Ended,
            u64::from(shm_types::Outcome::Solved.code()),
        )],
    );
    step(&mut world, &mut writer);
    let ending = Ending {
        outcome: Outcome::Solved,
        reason: None,
        makespan_ns: world.batch.time_ns,
        options: serde_json::json!({ "robots": 1 }),
    };
    writer.finish(ending).unwrap().into_inner()
}

/// The short run.
fn short_run() -> Vec<u8> {
    written(|_, _| true)
}

fn check(bytes: &[u8]) -> Result<CheckReport, ReadError> {
    trace::check(bytes)
}

#[test]
fn what_was_written_reads_back_and_is_clean() {
    let report = check(&short_run()).unwrap();
    assert_eq!(report.violations, []);
    assert!(report.complete && !report.truncated);
    assert_eq!(report.outcome, Some(Outcome::Solved));
    assert_eq!(report.checked_until_ns, 501 * TICK_NS);
}

#[test]
fn a_leg_is_one_record_and_bodies_are_where_they_were() {
    let bytes = written(|_, _| true);
    let reader = Reader::new(&bytes[..]).unwrap();
    assert_eq!(reader.scene(), &scene());
    let spans: Vec<_> = reader.map(Result::unwrap).collect();
    let motions = spans.iter().map(|span| span.motions.len()).sum::<usize>();
    assert_eq!(
        motions,
        LEGS.len() + 1,
        "one for each leg, and one for the object"
    );
    let Close::End(End {
        options, complete, ..
    }) = &spans.last().unwrap().close
    else {
        panic!("no end");
    };
    assert!(complete);
    assert_eq!(options["robots"], 1);

    let states: Vec<_> = spans.iter().flat_map(|span| &span.states).collect();
    assert_eq!(states.len(), 11, "every half second, the first included");
    let frames = Replay::new(Reader::new(&bytes[..]).unwrap(), 0, 500_000_000);
    for (frame, state) in frames.map(Result::unwrap).zip(&states) {
        assert_eq!(frame.time_ns, state.time_ns);
        let near = |a: Place, b: Place| (a.x - b.x).hypot(a.y - b.y) < 1e-8;
        assert!(
            near(frame.robots[0], state.robots[0].at)
                && near(frame.objects[0], state.objects[0].at)
        );
    }
    let mut late = Replay::new(Reader::new(&bytes[..]).unwrap(), 1_505_000_000, 1);
    let frame = late.next().unwrap().unwrap();
    assert!(
        (frame.objects[0].y - (0.45 + 0.2525)).abs() < 1e-8,
        "{frame:?}"
    );
}

#[test]
fn a_still_is_as_large_as_what_is_in_it() {
    let story = trace::Story::read(Reader::new(&short_run()[..]).unwrap()).unwrap();
    let still = trace::still(&story, story.until_s());
    let after = |text: &str, what: &str| -> f64 {
        let (_, rest) = text.split_once(what).unwrap();
        rest.split('"').next().unwrap().parse().unwrap()
    };
    let height = after(&still, " height=\"");
    let texts = still.split("<text").skip(1);
    let lowest = texts.map(|text| after(text, " y=\"")).fold(0.0, f64::max);
    // Room for another line, and as much on the right as on the left of the room.
    assert!(
        (lowest..lowest + 60.0).contains(&height),
        "{lowest} of {height}"
    );
    let floor = still
        .split('<')
        .find(|element| element.contains("\"floor\""));
    let (left, wide) = (
        after(floor.unwrap(), " x=\""),
        after(floor.unwrap(), " width=\""),
    );
    assert!((after(&still, " width=\"") - wide - 2.0 * left).abs() < 0.1);
}

#[test]
fn a_lost_batch_makes_it_incomplete_but_does_not_accuse_anybody() {
    for lost in [0..1, 100..101, 150..260, 490..501] {
        let bytes = written(|sequence, _| !lost.contains(&sequence));
        let report = check(&bytes).unwrap();
        assert_eq!(report.violations, [], "{lost:?}");
        assert!(!report.complete && !report.truncated);
        assert_eq!(report.missing_batches, lost.end - lost.start);
        let spans = Reader::new(&bytes[..]).unwrap().map(Result::unwrap);
        for span in spans {
            if let Close::Gap(gap) = span.close {
                // A tick has one batch.
                assert_eq!(
                    gap.before_tick - gap.after_tick - 1,
                    gap.batches,
                    "{lost:?}"
                );
            }
        }
        let frames = Replay::new(Reader::new(&bytes[..]).unwrap(), 4_900_000_000, 1);
        let frame = frames.map(Result::unwrap).next().unwrap();
        assert!(
            (frame.robots[0].x - 0.05).abs() < 1e-8,
            "{lost:?}: {frame:?}"
        );
    }
}

#[test]
fn a_batch_that_comes_twice_counts_once() {
    let mut writer = Writer::new(Cursor::new(Vec::new()), &scene(), 0).unwrap();
    let mut world = World::new();
    world.tick(1.0, 0.0, &[]);
    writer.batch(&world.batch).unwrap();
    writer.batch(&world.batch).unwrap();
    assert_eq!(writer.missing_batches(), 0);
    drop(writer);
}

#[test]
fn a_snapshot_ahead_of_its_batch_is_left_out() {
    let mut writer = Writer::new(Cursor::new(Vec::new()), &scene(), 0).unwrap();
    let mut world = World::new();
    world.tick(1.0, 0.0, &[]);
    writer
        .snapshot(Checked::new(&*world.snapshot, COUNTS).unwrap())
        .unwrap();
    writer.batch(&world.batch).unwrap();
    let ending = Ending {
        outcome: Outcome::Interrupted,
        reason: Some("stopped".to_owned()),
        makespan_ns: TICK_NS,
        options: serde_json::Value::Null,
    };
    let bytes = writer.finish(ending).unwrap().into_inner();
    let spans: Vec<_> = Reader::new(&bytes[..])
        .unwrap()
        .map(Result::unwrap)
        .collect();
    assert!(spans.iter().all(|span| span.states.is_empty()));
}

#[test]
fn an_illegal_batch_is_refused() {
    let mut writer = Writer::new(Cursor::new(Vec::new()), &scene(), 0).unwrap();
    let mut world = World::new();
    world.tick(1.0, 0.0, &[]);
    world.batch.motions[0].id = 7;
    assert!(writer.batch(&world.batch).is_err());
}

#[test]
fn a_file_cut_anywhere_reads_up_to_its_last_whole_chunk() {
    let bytes = short_run();
    let whole = check(&bytes).unwrap();
    let mut reached_ns = 0;
    let mut nothing_yet = 0;
    for length in 0..bytes.len() {
        match check(&bytes[..length]) {
            Ok(report) => {
                assert_eq!(report.violations, [], "cut after {length} bytes");
                assert_eq!(report.truncated, report.outcome.is_none());
                assert!(report.checked_until_ns >= reached_ns);
                reached_ns = report.checked_until_ns;
            }
            Err(ReadError::TooShort | ReadError::Foreign) => {
                assert_eq!(reached_ns, 0);
                nothing_yet = length;
            }
            Err(error) => panic!("cut after {length} bytes: {error}"),
        }
    }
    assert_eq!(reached_ns, whole.checked_until_ns);
    // The first whole chunk holds the scene; the run lasts five seconds, and each ends one.
    assert!(nothing_yet < bytes.len() / 2);
}

#[test]
fn a_writer_that_is_dropped_leaves_a_file_that_reads() {
    let mut out = Cursor::new(Vec::new());
    {
        let mut writer = Writer::new(&mut out, &scene(), 0).unwrap();
        let mut world = World::new();
        for _ in 0..10 {
            world.tick(1.0, 0.0, &[]);
            writer.batch(&world.batch).unwrap();
        }
        writer.flush().unwrap();
        world.tick(1.0, 0.0, &[]);
        writer.batch(&world.batch).unwrap();
    }
    let report = check(out.get_ref()).unwrap();
    assert!(report.truncated && report.violations.is_empty());
    assert_eq!(
        report.checked_until_ns,
        10 * TICK_NS,
        "up to the last flush"
    );
}

/// A recorder that is started again has what its predecessor has left whole, and gets the rest again.
/// The pieces are the same as if it had not died.
#[test]
fn a_trace_that_broke_off_is_gone_on_with_as_if_it_had_not() {
    let whole = short_run();
    let tests = check(&whole).unwrap().swept_tests;
    let chunks: Vec<usize> = (1..whole.len()).step_by(97).collect();
    let mut gone_on_with = 0;
    for cut in chunks {
        let old = &whole[..cut];
        let made = Writer::go_on(old, Cursor::new(Vec::new()), &scene(), 500_000_000).unwrap();
        let Some((writer, resumed)) = made else {
            continue;
        };
        gone_on_with += 1;
        assert_eq!(resumed.scene_version, 0);
        let mut writer = Some(writer);
        // The batches come again, from a little before those that are lacking.
        let from = resumed.next_sequence.saturating_sub(10);
        let again = written(|sequence, other| {
            if sequence == from
                && let Some(writer) = writer.take()
            {
                *other = writer;
            }
            sequence >= from
        });
        let report = check(&again).unwrap();
        assert!(!report.truncated && report.complete, "{cut}");
        assert!(
            report.violations.is_empty(),
            "{cut}: {:?}",
            report.violations
        );
        assert_eq!(report.swept_tests, tests, "{cut}");
        let frames = |bytes: &[u8]| {
            let replay = Replay::new(
                Reader::new(Cursor::new(bytes.to_vec())).unwrap(),
                0,
                33_333_333,
            );
            let frames: Vec<String> = replay.map(|f| format!("{:.9?}", f.unwrap())).collect();
            frames
        };
        assert_eq!(frames(&whole), frames(&again), "{cut}");
    }
    assert!(gone_on_with > 20, "{gone_on_with}");
    let mut foreign = scene();
    foreign.run_id = "02".to_owned();
    let made = Writer::go_on(&*whole, Cursor::new(Vec::new()), &foreign, 0).unwrap();
    assert!(made.is_none(), "a file of another run");
}

/// Lengths of the chunks of a file, in bytes.
fn chunks(file: &[u8]) -> Vec<u64> {
    let mut rest = &file[mcap::MAGIC.len()..];
    let mut found = Vec::new();
    while let [opcode, body @ ..] = rest
        && let Some((length, body)) = body.split_first_chunk()
        && let length = u64::from_le_bytes(*length)
        && let Some(next) = body.get(usize::try_from(length).unwrap()..)
    {
        if *opcode == mcap::records::op::CHUNK {
            found.push(length);
        }
        rest = next;
    }
    found
}

/// A chunk is read as a whole, and refused if it is too large for that.
#[test]
fn what_is_copied_has_chunks_no_larger_than_before() {
    let mut out = Cursor::new(Vec::new());
    {
        let mut writer = Writer::new(&mut out, &scene(), 0).unwrap();
        let mut world = World::new();
        for tick in 0..10_000 {
            let aside = if tick % 2 == 0 { 1.0 } else { -1.0 };
            world.tick(aside, 0.0, &[]);
            writer.batch(&world.batch).unwrap();
            let snapshot = Checked::new(&*world.snapshot, COUNTS).unwrap();
            writer.snapshot(snapshot).unwrap();
        }
        writer.flush().unwrap();
    }
    let before = chunks(out.get_ref());
    assert!(before.len() > 3, "{before:?}");
    let mut copy = Cursor::new(Vec::new());
    let made = Writer::go_on(out.get_ref().as_slice(), &mut copy, &scene(), 0).unwrap();
    let (writer, resumed) = made.unwrap();
    assert_eq!(resumed.next_sequence, 10_000);
    drop(writer);
    let after = chunks(copy.get_ref());
    assert!(after.iter().max() <= before.iter().max(), "{after:?}");
}

#[test]
fn what_is_no_trace_is_refused_with_the_way_out() {
    let said = |bytes: &[u8]| check(bytes).unwrap_err().to_string();
    assert!(said(b"").contains("not begin as an MCAP file"));
    assert!(said(b"[scene]\nname = \"a scenario\"").contains("--trace"));
    assert!(said(&short_run()[..5]).contains("before its first whole chunk"));

    let mut other = mcap::Writer::new(Cursor::new(Vec::new())).unwrap();
    let channel = other
        .add_channel(0, "images", "json", &Default::default())
        .unwrap();
    let header = mcap::records::MessageHeader {
        channel_id: channel,
        sequence: 0,
        log_time: 0,
        publish_time: 0,
    };
    other.write_to_known_channel(&header, b"{}").unwrap();
    other.finish().unwrap();
    assert!(said(&other.into_inner().into_inner()).contains("no trace of this program"));

    let mut newer = scene();
    newer.format = 3;
    let writer = Writer::new(Cursor::new(Vec::new()), &newer, 0).unwrap();
    let ending = Ending {
        outcome: Outcome::Stuck,
        reason: None,
        makespan_ns: 0,
        options: serde_json::Value::Null,
    };
    let newer = writer.finish(ending).unwrap().into_inner();
    assert!(said(&newer).contains("format 3, but this program reads formats up to 2"));

    let mut damaged = short_run();
    let middle = damaged.len() / 2;
    damaged[middle] ^= 1;
    assert!(
        said(&damaged).contains("is damaged after"),
        "{}",
        said(&damaged)
    );
    assert!(said(&damaged).contains("another copy"));

    let error = trace::check_file("/no/such/file.mcap".as_ref()).unwrap_err();
    assert!(error.to_string().contains("/no/such/file.mcap"));
}

#[test]
fn every_bit_that_flips_is_noticed() {
    let bytes = short_run();
    let whole = check(&bytes).unwrap();
    // Every bit of the frames, one bit of every few bytes of the bulk.
    for position in (0..bytes.len()).step_by(7) {
        let mut flipped = bytes.clone();
        flipped[position] ^= 1 << (position % 8);
        if let Ok(report) = check(&flipped) {
            // A length that is wrong may look like the end of the file; nothing else may pass.
            assert!(
                report.truncated || report == whole,
                "byte {position} of {}: {report:#?}",
                bytes.len()
            );
            assert!(report.violations.is_empty(), "byte {position}");
        }
    }
}

/// Messages of a made-up trace: right as to framing and checksums, anything as to what they say.
fn made_up(messages: &[(String, String)]) -> Vec<u8> {
    let mut file = mcap::Writer::new(Cursor::new(Vec::new())).unwrap();
    for (topic, json) in messages {
        let channel_id = file
            .add_channel(0, topic, "json", &Default::default())
            .unwrap();
        let header = mcap::records::MessageHeader {
            channel_id,
            sequence: 0,
            log_time: 0,
            publish_time: 0,
        };
        file.write_to_known_channel(&header, json.as_bytes())
            .unwrap();
    }
    file.finish().unwrap();
    file.into_inner().into_inner()
}

/// The messages of the short run, as topics and JSON.
fn messages() -> Vec<(String, String)> {
    mcap::MessageStream::new(&short_run())
        .unwrap()
        .map(Result::unwrap)
        .map(|message| {
            let json = String::from_utf8(message.data.into_owned()).unwrap();
            (message.channel.topic.clone(), json)
        })
        .collect()
}

/// Replaces the `which`-th number of a JSON text.
fn with_number(json: &str, which: usize, number: &str) -> String {
    let is_number = |c: char| c.is_ascii_digit() || c == '.' || c == '-';
    let starts: Vec<usize> = json
        .char_indices()
        .filter(|&(i, c)| is_number(c) && !json[..i].ends_with(is_number))
        .map(|(i, _)| i)
        .collect();
    let Some(&start) = starts.get(which % starts.len().max(1)) else {
        return json.to_owned();
    };
    let end = json[start..]
        .find(|c| !is_number(c))
        .map_or(json.len(), |length| start + length);
    format!("{}{number}{}", &json[..start], &json[end..])
}

#[derive(Clone, Debug)]
enum Spoiling {
    Drop(prop::sample::Index),
    Twice(prop::sample::Index),
    Swap(prop::sample::Index, prop::sample::Index),
    Number(prop::sample::Index, usize, &'static str),
    Text(prop::sample::Index, String),
}

fn spoilings() -> impl Strategy<Value = Spoiling> {
    let index = any::<prop::sample::Index>;
    let numbers = prop::sample::select(vec![
        "0",
        "-1",
        "1",
        "0.5",
        "1e6",
        "-1e6",
        "1e300",
        "1e-300",
        "9007199254740993",
        "18446744073709551615",
        "5000000000",
    ]);
    prop_oneof![
        index().prop_map(Spoiling::Drop),
        index().prop_map(Spoiling::Twice),
        (index(), index()).prop_map(|(a, b)| Spoiling::Swap(a, b)),
        (index(), 0..40_usize, numbers)
            .prop_map(|(i, which, number)| Spoiling::Number(i, which, number)),
        (index(), ".{0,20}").prop_map(|(i, text)| Spoiling::Text(i, text)),
    ]
}

fn spoil(messages: &mut Vec<(String, String)>, spoiling: &Spoiling) {
    match spoiling {
        _ if messages.is_empty() => {}
        Spoiling::Drop(i) => {
            messages.remove(i.index(messages.len()));
        }
        Spoiling::Twice(i) => {
            let message = messages[i.index(messages.len())].clone();
            messages.push(message);
        }
        Spoiling::Swap(a, b) => {
            let (a, b) = (a.index(messages.len()), b.index(messages.len()));
            messages.swap(a, b);
        }
        Spoiling::Number(i, which, number) => {
            let i = i.index(messages.len());
            messages[i].1 = with_number(&messages[i].1, *which, number);
        }
        Spoiling::Text(i, text) => {
            let i = i.index(messages.len());
            messages[i].1.push_str(text);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    #[test]
    fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..2_000)) {
        prop_assert!(check(&bytes).is_err());
        let mut framed = mcap::MAGIC.to_vec();
        framed.extend(bytes);
        prop_assert!(check(&framed).is_err());
    }

    #[test]
    fn arbitrary_records_never_panic(
        records in prop::collection::vec((0..18_u8, prop::collection::vec(any::<u8>(), 0..100)), 0..20),
    ) {
        let mut framed = mcap::MAGIC.to_vec();
        for (opcode, body) in records {
            framed.push(opcode);
            framed.extend((body.len() as u64).to_le_bytes());
            framed.extend(body);
        }
        prop_assert!(check(&framed).is_err());
    }

    #[test]
    fn a_trace_that_says_anything_never_panics(
        spoils in prop::collection::vec(spoilings(), 0..12), cut in any::<prop::sample::Index>(),
    ) {
        let mut messages = messages();
        for spoiling in &spoils {
            spoil(&mut messages, spoiling);
        }
        let bytes = made_up(&messages);
        if spoils.is_empty() {
            prop_assert_eq!(check(&bytes).unwrap().violations, []);
        }
        let _ = check(&bytes);
        let _ = check(&bytes[..cut.index(bytes.len())]);
        if let Ok(reader) = Reader::new(&bytes[..]) {
            let _ = Replay::new(reader, 0, 100_000_000).take(1_000).count();
        }
    }
}
