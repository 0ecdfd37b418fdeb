//! The image for a SensFloor, in QEMU: a host tells it its tiles, and is told which panels are down. A floor that it cannot
//! hear is unknown, not empty.
//!
//! ```text
//!   soles ─▶ SensFloor ══ serial line, up │ noisy │ cut ══▶ image in QEMU ══ network ══▶ host
//! ```

use crate::support::board::{floor_image, host_of, start, wait_for};
use kehai::floor::sensfloor::Layout;
use kehai::wire::{Alarms, Counter, Message, Pressed, Request, SensorCode};
use kehai_emulator::pc::host::{Host, Way};
use kehai_emulator::qemu::{Forwarded, Line, Qemu};
use kehai_emulator::sensfloor::{LineState, SensFloor, Signal, Sole};
use kehai_emulator::serve::UdpSensor;

/// The setting for the floor of these tests: 3 × 2 tiles.
const TILES: &str = "tiles=10,1,1,3,2";

/// Its panels in a row.
const COLUMNS: usize = 6;

/// A sole on panel (1, 1), m.
const STANDS: Sole = Sole { at: (0.375, 0.375), ahead: (0.0, 1.0) };

const SECOND_US: u64 = 1_000_000;

fn floor() -> UdpSensor<SensFloor> {
    let layout = Layout::new(10, (1, 1), (3, 2)).unwrap();
    UdpSensor::new(SensFloor::new(Signal::new(&layout, 7), |_| Vec::new())).unwrap()
}

/// A reading as it came.
#[derive(Debug)]
struct Reading {
    sequence: u32,
    stamp_us: u64,
    down: Vec<usize>,
    faulty: usize,
}

impl Reading {
    fn of(pressed: &Pressed<'_>) -> Self {
        assert_eq!((pressed.columns, pressed.rows), (6, 4));
        let bits: Vec<u8> = pressed.down.iter().collect();
        let is_down = |panel: &usize| bits[panel / 8] >> (panel % 8) & 1 == 1;
        Self {
            sequence: pressed.head.sequence,
            stamp_us: pressed.head.stamp_us,
            down: (0..COLUMNS * 4).filter(is_down).collect(),
            faulty: pressed.faulty.iter().count(),
        }
    }
}

/// The next reading that will do.
fn reading(host: &mut Host<Forwarded>, wanted: impl Fn(&Reading) -> bool) -> Reading {
    host.look(|_, message| match message {
        Message::Pressed(pressed) => Some(Reading::of(pressed)).filter(&wanted),
        _ => None,
    })
}

/// A board that knows its tiles and has heard all of them, and its host.
fn settled(floor: &UdpSensor<SensFloor>) -> Option<(Qemu, Host<Forwarded>)> {
    let board = start(floor_image()?, Line::Floor(floor), None);
    let mut host = host_of(&board);
    host.subscribe();
    host.ask(Request::SetSettings { text: TILES });
    host.look(|_, message| matches!(message, Message::Done { .. }).then_some(()));
    reading(&mut host, |reading| reading.faulty == 0);
    Some((board, host))
}

#[test]
fn a_floor_is_told_its_tiles_once_and_says_who_stands_where() {
    let floor = floor();
    let Some(image) = floor_image() else { return };
    let board = start(image, Line::Floor(&floor), None);
    let mut host = host_of(&board);
    let health = host.health(|health| health.head.uptime_us > SECOND_US);
    assert_eq!(health.head.sensor.code, SensorCode::Searching, "it does not know its tiles");
    assert_eq!(health.counters.get(Counter::ScansAccepted), 0);
    assert!(health.head.alarms.has(Alarms::NO_SCANS) && !health.head.alarms.has(Alarms::NO_BACKGROUND));
    drop(board);

    let Some((mut board, mut host)) = settled(&floor) else { return };
    assert_eq!(wait_for(&mut board, "first reading").text, "first reading");
    let mut before = reading(&mut host, |_| true);
    let first_us = before.stamp_us;
    for _ in 0..20 {
        let next = reading(&mut host, |_| true);
        assert_eq!((next.sequence, &next.down[..]), (before.sequence + 1, &[][..]), "no panel is pressed");
        // 9 Hz, and a reading waits for up to 33 ms for the end of a frame.
        let period_us = next.stamp_us - before.stamp_us;
        assert!((75_000..150_000).contains(&period_us), "{period_us}");
        before = next;
    }
    let mean_us = (before.stamp_us - first_us) / 20;
    assert!((105_000..120_000).contains(&mean_us), "9 Hz: {mean_us}");
    floor.with(|floor, _| floor.walk(|_| vec![STANDS]));
    let stands = reading(&mut host, |reading| !reading.down.is_empty());
    assert!(stands.stamp_us - before.stamp_us < SECOND_US, "{stands:?} after {before:?}");
    let stands = reading(&mut host, |reading| reading.down.contains(&(COLUMNS + 1)));
    // Its heel and toes may touch what is next to it.
    assert!(stands.down.iter().all(|panel| panel % COLUMNS <= 2), "{stands:?}");
    floor.with(|floor, _| floor.walk(|_| Vec::new()));
    reading(&mut host, |reading| reading.down.is_empty());

    board.reset().unwrap();
    wait_for(&mut board, "boot 2");
    let mut host = host_of(&board);
    reading(&mut host, |reading| reading.faulty == 0);
    assert_eq!(host.identity.boot, 2, "it knows its tiles still");
}

#[test]
fn a_line_that_is_cut_is_said_and_a_noisy_one_is_counted() {
    let floor = floor();
    let Some((_board, mut host)) = settled(&floor) else { return };
    host.health(|health| {
        health.head.sensor.code == SensorCode::Streaming && health.head.alarms == Alarms::default()
    });

    floor.with(|floor, _| floor.set_line(LineState::Noisy));
    let begin_us = host.way.now_us();
    let (mut readings, mut feet) = (0_u32, 0_u32);
    while host.way.now_us() < begin_us + 20 * SECOND_US {
        let noisy = reading(&mut host, |_| true);
        feet += u32::from(!noisy.down.is_empty());
        readings += 1;
    }
    let health = host.health(|_| true);
    let torn = health.counters.get(Counter::ScansDamaged);
    println!(
        "a byte in forty is lost for 20 s: {readings} readings, {torn} torn frames, {feet} readings with a foot"
    );
    assert!(readings > 0 && feet == 0, "{feet} of {readings}");
    assert!(torn > 0 && health.counters.get(Counter::SensorEcho) > torn, "{health:?}");

    floor.with(|floor, _| floor.set_line(LineState::Cut));
    let cut_us = host.way.now_us();
    host.health(|health| {
        health.head.sensor.code == SensorCode::Stalled && health.head.alarms.has(Alarms::NO_SCANS)
    });
    let said_us = host.way.now_us() - cut_us;
    println!("cut: said {} ms later", said_us / 1000);
    assert!(said_us < 2 * SECOND_US, "{said_us}");
    // Silence is no reading: no message says that the floor is empty.
    let end_us = host.way.now_us() + 5 * SECOND_US;
    while host.way.now_us() < end_us {
        let pressed = host.turn(|_, message| matches!(message, Message::Pressed(_)).then_some(()));
        assert_eq!(pressed, None);
    }

    floor.with(|floor, _| {
        floor.set_line(LineState::Up);
        floor.walk(|_| vec![STANDS]);
    });
    reading(&mut host, |reading| reading.faulty == 0 && reading.down.contains(&(COLUMNS + 1)));
    host.health(|health| health.head.alarms == Alarms::default());
}

/// Start, network, storing settings, requests.
#[test]
fn the_stack_stays_within_its_budget() {
    // While what is known of the tiles is made, before it moves to its place.
    const BUDGET: usize = 40 * 1024;
    let floor = floor();
    let Some((mut board, mut host)) = settled(&floor) else { return };
    floor.with(|floor, _| floor.walk(|_| vec![STANDS]));
    host.ask(Request::Info);
    host.look(|_, message| matches!(message, Message::Info(_)).then_some(()));
    reading(&mut host, |reading| !reading.down.is_empty());
    let used = board.stack_used().unwrap();
    println!("stack of mps2-an386-floor: {used} bytes at most, budget {BUDGET}");
    assert!((256..=BUDGET).contains(&used), "{used} bytes of stack");
}
