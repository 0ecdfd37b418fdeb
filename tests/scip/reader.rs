//! The reader against pieces of every size, damage of every kind, and arbitrary bytes.

use kehai::scip::*;
use proptest::prelude::*;

/// A stream of `beams` steps.
fn stream(beams: u16) -> Measurement {
    let last_step = 44 + beams - 1;
    Measurement { first_step: 44, last_step, cluster: 1, skip: 0, scans: 0, width: Width::Three }
}

/// A line of data and the checksum behind it.
fn summed(data: &[u8]) -> Vec<u8> {
    let sum = data.iter().map(|&c| u32::from(c)).sum::<u32>() % 64 + 0x30;
    [data, &[sum as u8, b'\n']].concat()
}

/// The code of `value` in `width` characters.
fn code(value: u32, width: u32) -> Vec<u8> {
    (0..width).rev().map(|i| (value >> (6 * i) & 63) as u8 + 0x30).collect()
}

fn echo(measurement: Measurement) -> Vec<u8> {
    let Measurement { first_step, last_step, cluster, width, .. } = measurement;
    let letter = if width == Width::Three { 'D' } else { 'S' };
    format!("M{letter}{first_step:04}{last_step:04}{cluster:02}000\n").into_bytes()
}

/// Echo, status and stamp of a streamed scan.
fn head(measurement: Measurement, stamp_ms: u32) -> Vec<u8> {
    [echo(measurement), summed(b"99"), summed(&code(stamp_ms, 4))].concat()
}

fn data(measurement: Measurement, ranges_mm: &[u32]) -> Vec<u8> {
    let width = measurement.width.characters();
    let characters: Vec<u8> = ranges_mm.iter().flat_map(|&range| code(range, width.into())).collect();
    characters.chunks(64).flat_map(summed).chain([b'\n']).collect()
}

fn scan(measurement: Measurement, stamp_ms: u32, ranges_mm: &[u32]) -> Vec<u8> {
    [head(measurement, stamp_ms), data(measurement, ranges_mm)].concat()
}

/// Numbers that look random and are the same every time.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % limit
    }

    fn ranges(&mut self, beams: u16) -> Vec<u32> {
        (0..beams).map(|_| self.below(5600) as u32).collect()
    }
}

/// The reader's events, with the ranges of every scan.
type ReaderEvents = Vec<(Event, Vec<u16>)>;

/// Feeds pieces as they are cut, without handing any byte over twice; a reply makes the next command
/// of `commands` expected.
struct Listener {
    reader: Reader,
    commands: Vec<Command>,
    events: ReaderEvents,
    ranges_mm: [u16; 800],
    fed: usize,
}

impl Listener {
    fn new(measurement: Measurement, commands: &[Command]) -> Self {
        let mut reader = Reader::new();
        reader.expect(&Command::Measure(measurement).encode().unwrap());
        let mut commands: Vec<_> = commands.iter().rev().copied().collect();
        commands.pop().inspect(|first| reader.expect(&first.encode().unwrap()));
        Self { reader, commands, events: Vec::new(), ranges_mm: [0; 800], fed: 0 }
    }

    fn hear(&mut self, bytes: &[u8]) {
        let now_us = self.fed as u64;
        let mut rest = bytes;
        while !rest.is_empty() {
            let Fed { consumed, event } = self.reader.feed(rest, now_us, &mut self.ranges_mm);
            assert!(consumed > 0 && (event.is_some() || consumed == rest.len()));
            rest = &rest[consumed..];
            self.fed += consumed;
            let Some(event) = event else { continue };
            let beams = if let Event::Scan(scan) = event { scan.beams } else { 0 };
            self.events.push((event, self.ranges_mm[..beams.into()].to_vec()));
            if !matches!(event, Event::Scan(_) | Event::Lost(_) | Event::Unexpected(_)) {
                let next = self.commands.pop();
                next.inspect(|next| self.reader.expect(&next.encode().unwrap()));
            }
        }
    }

    fn scans(&self) -> Vec<u32> {
        let stamp = |(event, _): &(Event, _)| match event {
            Event::Scan(scan) => Some(scan.stamp_ms),
            _ => None,
        };
        self.events.iter().filter_map(stamp).collect()
    }

    fn losses(&self) -> Vec<Loss> {
        let loss = |(event, _): &(Event, _)| match event {
            Event::Lost(loss) => Some(*loss),
            _ => None,
        };
        self.events.iter().filter_map(loss).collect()
    }
}

/// Stamps of the scans in `bytes` as the reader accepts them.
fn accepted(measurement: Measurement, bytes: &[u8]) -> Vec<u32> {
    let mut listener = Listener::new(measurement, &[]);
    listener.hear(bytes);
    listener.scans()
}

/// The events, with the moments set to 0: they depend on the cuts.
fn timeless(mut events: ReaderEvents) -> ReaderEvents {
    for (event, _) in &mut events {
        match event {
            Event::Scan(scan) => scan.first_byte_us = 0,
            Event::Reply(reply) => reply.first_byte_us = 0,
            Event::Time(time) => time.first_byte_us = 0,
            _ => {}
        }
    }
    events
}

fn heard(commands: &[Command], pieces: impl Iterator<Item = Vec<u8>>) -> (ReaderEvents, Losses) {
    let mut listener = Listener::new(stream(40), commands);
    pieces.for_each(|piece| listener.hear(&piece));
    (timeless(listener.events), *listener.reader.losses())
}

const COMMANDS: [Command; 9] = [
    Command::Quit,
    Command::Parameters,
    Command::Version,
    Command::State,
    Command::TimeRead,
    Command::StateCode,
    Command::Scip20,
    Command::LaserOn,
    Command::Get(Measurement {
        first_step: 0,
        last_step: 6,
        cluster: 2,
        skip: 0,
        scans: 0,
        width: Width::Two,
    }),
];

/// Replies to [`COMMANDS`], and to others.
const REPLIES: [&[u8]; 13] = [
    b"QT\n00P\n\n",
    b"PP\n00P\nMODL:URG-04LX(Hokuyo Automatic Co.,Ltd.);N\nDMIN:20;4\nDMAX:5600;_\nARES:1024;\\\nAMIN:44;7\n\
      AMAX:725;o\nAFRT:384;6\nSCAN:600;e\n\n",
    b"VV\n00P\nVEND:Hokuyo Automatic Co.,Ltd.;[\nPROT:SCIP 2.0;N\nstray\nSERI:H0706400;G\n\n",
    b"II\n00P\nLASR:ON;9\nSBPS:19200[bps]<-Default setting by user;A\nTIME:6A5404;]\n\n",
    b"TM1\n00P\n<SfkP\n\n",
    b"%ST\n00P\n004T\n\n",
    b"SCIP2.0\n0\n\n",
    b"BM\n02R\n\n",
    b"GS0000000602\n00P\n<SfkP\nCB0C00Xh\n\n",
    b"GS0000000602\n00P\n<SfkP\nCB0C00h\n\n",
    b"MD0044008301000\n0Mm\n\n",
    b"RS\n00P\n\n",
    b"TM1;x\n00P\n<SfkP\n\n",
];

/// A piece of what may come down the line: whole or cut replies and scans, garbage, flipped bits.
fn piece() -> impl Strategy<Value = Vec<u8>> {
    let whole = prop_oneof![
        3 => prop::collection::vec(0u32..0x4_0000, 40).prop_map(|ranges| scan(stream(40), 77, &ranges)),
        3 => prop::sample::select(&REPLIES[..]).prop_map(<[u8]>::to_vec),
        1 => prop::collection::vec(prop_oneof![Just(b'\n'), 0x30..0x70u8, any::<u8>()], 0..90),
        1 => prop::sample::select(&b"\n\n\nMDQTJ"[..]).prop_map(|byte| vec![byte]),
    ];
    (whole, 0..6, any::<prop::sample::Index>(), 0..8).prop_map(|(mut bytes, damage, index, bit)| {
        let at = if bytes.is_empty() { 0 } else { index.index(bytes.len()) };
        match damage {
            0 => bytes.truncate(at),
            1 => {
                bytes.drain(..at);
            }
            2 => bytes.iter_mut().skip(at).take(1).for_each(|byte| *byte ^= 1u8 << bit),
            _ => {}
        }
        bytes
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn pieces_of_any_size_say_the_same(
        pieces in prop::collection::vec(piece(), 1..12),
        order in Just(COMMANDS.to_vec()).prop_shuffle(),
        sizes in prop::collection::vec(1..200usize, 1..20),
    ) {
        let bytes = pieces.concat();
        let whole = heard(&order, [bytes.clone()].into_iter());
        let single = heard(&order, bytes.iter().map(|&byte| vec![byte]));
        prop_assert_eq!(&whole, &single);
        let mut rest = &bytes[..];
        let cut = sizes.iter().cycle().map_while(|&size| {
            let (piece, behind) = rest.split_at(size.min(rest.len()));
            rest = behind;
            (!piece.is_empty()).then(|| piece.to_vec())
        });
        prop_assert_eq!(&whole, &heard(&order, cut));
        let lost = whole.0.iter().filter(|(event, _)| matches!(event, Event::Lost(_))).count();
        let Losses { checksum, character, line_length, value_count, buffer_too_short, .. } = whole.1;
        let Losses { echo, status, foreign_reply, parameters, info_line, .. } = whole.1;
        let counted = checksum + character + line_length + value_count + buffer_too_short
            + echo + status + foreign_reply + parameters + info_line;
        prop_assert_eq!(lost, counted as usize);
    }

    #[test]
    fn arbitrary_bytes_do_not_panic_and_do_not_wedge(
        bytes in prop::collection::vec(prop_oneof![Just(b'\n'), 0x30..0x70u8, any::<u8>()], 0..700),
        command in prop::sample::select(&COMMANDS[..]),
    ) {
        let mut listener = Listener::new(stream(40), &[command]);
        listener.hear(&bytes);
        listener.events.clear();
        let ranges = Numbers(1).ranges(40);
        listener.hear(&[scan(stream(40), 1, &ranges), scan(stream(40), 2, &ranges)].concat());
        prop_assert_eq!(listener.scans(), [1, 2]);
    }
}

#[test]
fn a_cut_at_every_position_says_the_same() {
    let measurement = stream(682);
    let bytes = scan(measurement, 5, &Numbers(2).ranges(682));
    assert_eq!(bytes.len(), 2137);
    let mut whole = Listener::new(measurement, &[]);
    whole.hear(&bytes);
    assert_eq!(whole.scans(), [5]);
    let events = timeless(whole.events);
    for cut in 0..=bytes.len() {
        let mut listener = Listener::new(measurement, &[]);
        listener.hear(&bytes[..cut]);
        listener.hear(&bytes[cut..]);
        assert_eq!(timeless(listener.events), events, "{cut}");
    }
}

#[test]
fn no_single_bit_flip_of_a_data_block_is_accepted_nor_costs_the_next_scan() {
    // 726 values leave two characters for the last line, 64 leave none.
    for beams in [682, 726, 64] {
        let measurement = stream(beams);
        let (start, good) = (head(measurement, 1), data(measurement, &Numbers(3).ranges(beams)));
        let next = scan(measurement, 2, &Numbers(4).ranges(beams));
        for bit in 0..8 * good.len() {
            let mut bad = good.clone();
            bad[bit / 8] ^= 1 << (bit % 8);
            let stamps = accepted(measurement, &[&start[..], &bad, &next].concat());
            assert_eq!(stamps, [2], "bit {} of byte {} of {beams} beams", bit % 8, bit / 8);
        }
    }
}

#[test]
fn fewer_than_one_double_flip_in_64_is_accepted() {
    const FLIPS: usize = 200_000;
    let measurement = stream(682);
    let (start, good) = (head(measurement, 1), data(measurement, &Numbers(5).ranges(682)));
    let mut numbers = Numbers(6);
    let mut wrong = 0;
    for _ in 0..FLIPS {
        let first = numbers.below(8 * good.len());
        let second = (first + 1 + numbers.below(8 * good.len() - 1)) % (8 * good.len());
        let mut bad = good.clone();
        bad[first / 8] ^= 1 << (first % 8);
        bad[second / 8] ^= 1 << (second % 8);
        wrong += accepted(measurement, &[&start[..], &bad].concat()).len();
    }
    println!("double flips: {wrong} of {FLIPS} accepted, 1 in {}", FLIPS / wrong.max(1));
    assert!(wrong > 0, "two flips that cancel out cannot be seen");
    assert!(wrong * 64 < FLIPS, "{wrong}");
}

#[test]
fn a_scan_cut_anywhere_costs_only_itself() {
    let measurement = stream(100);
    let ranges = Numbers(7).ranges(100);
    let first = scan(measurement, 1, &ranges);
    let rest = [scan(measurement, 2, &ranges), scan(measurement, 3, &ranges)].concat();
    for cut in 0..first.len() {
        let mut listener = Listener::new(measurement, &[]);
        listener.hear(&first[..cut]);
        for byte in &rest {
            listener.hear(&[*byte]);
        }
        assert_eq!(listener.scans(), [2, 3], "{cut} bytes: {:?}", listener.losses());
        let scans_lost = listener.losses().iter().filter(|loss| loss.dropped == Dropped::Scan).count();
        assert_eq!(scans_lost, usize::from(cut > 15), "{cut} bytes: {:?}", listener.losses());
        assert_eq!(accepted(measurement, &[&first[..cut], &rest].concat()), [2, 3]);
    }
}

#[test]
fn bytes_lost_to_an_overrun_cost_one_scan() {
    let measurement = stream(100);
    let ranges = Numbers(8).ranges(100);
    let (first, second) = (scan(measurement, 1, &ranges), scan(measurement, 2, &ranges));
    for start in 0..first.len() {
        for length in [1, 2, 3, 5, 16, 64, 65, 66, 100] {
            let end = (start + length).min(first.len());
            let bytes = [&first[..start], &first[end..], &second].concat();
            assert_eq!(accepted(measurement, &bytes), [2], "{start}..{end}");
        }
    }
}

#[test]
fn a_foreign_reply_in_the_middle_of_a_scan_costs_that_scan_only() {
    let measurement = stream(100);
    let ranges = Numbers(9).ranges(100);
    let (first, second) = (scan(measurement, 1, &ranges), scan(measurement, 2, &ranges));
    for foreign in REPLIES {
        for at in 1..first.len() {
            let bytes = [&first[..at], foreign, &first[at..], &second].concat();
            assert_eq!(accepted(measurement, &bytes), [2], "{:?} at {at}", String::from_utf8_lossy(foreign));
        }
    }
}

#[test]
fn an_awaited_reply_in_the_middle_of_a_scan_is_heard() {
    let measurement = stream(100);
    let first = scan(measurement, 1, &Numbers(10).ranges(100));
    let line = echo(measurement).len() + 4 + 6 + 66;
    let bytes = [&first[..line], b"QT\n00P\n\n", &first[line..]].concat();
    for size in [1, 7, 64, 1000] {
        let mut listener = Listener::new(measurement, &[Command::Quit]);
        bytes.chunks(size).for_each(|chunk| listener.hear(chunk));
        let [(Event::Lost(loss), _), (Event::Reply(reply), _), ..] = listener.events[..] else {
            panic!("{:?}", listener.events)
        };
        assert_eq!(loss, Loss { cause: LossCause::ForeignReply, dropped: Dropped::Scan });
        assert_eq!((reply.status, reply.first_byte_us), (Status::OK, (line / size * size) as u64));
        assert_eq!(listener.scans(), []);
    }
}

#[test]
fn a_scan_is_timed_by_the_chunk_that_holds_its_first_byte() {
    let measurement = stream(100);
    let ranges = Numbers(11).ranges(100);
    let bytes = [scan(measurement, 1, &ranges), scan(measurement, 2, &ranges)].concat();
    for size in [1, 7, 64, 1000] {
        let mut listener = Listener::new(measurement, &[]);
        bytes.chunks(size).for_each(|chunk| listener.hear(chunk));
        let moments: Vec<u64> = listener
            .events
            .iter()
            .filter_map(|(event, _)| match event {
                Event::Scan(scan) => Some(scan.first_byte_us),
                _ => None,
            })
            .collect();
        let second = (bytes.len() / 2 / size * size) as u64;
        assert_eq!(moments, [0, second], "chunks of {size}");
    }
}

#[test]
fn ranges_come_out_as_they_went_in() {
    for width in [Width::Two, Width::Three] {
        for beams in [1, 21, 22, 43, 64, 86, 107, 682, 726, 769] {
            let measurement = Measurement { width, ..stream(beams) };
            let limit = 1 << (6 * u32::from(width.characters()));
            let mut numbers = Numbers(u64::from(beams));
            let ranges: Vec<u32> = (0..beams).map(|_| numbers.below(limit) as u32).collect();
            let mut listener = Listener::new(measurement, &[]);
            listener.hear(&scan(measurement, 1, &ranges));
            let stored: Vec<u16> = ranges.iter().map(|&range| range.min(65_535) as u16).collect();
            assert_eq!(listener.events.len(), 1);
            assert_eq!(listener.events[0].1, stored);
        }
    }
}

#[test]
fn a_scan_larger_than_its_buffer_is_lost_and_the_next_reply_is_not() {
    let measurement = stream(801);
    let mut listener = Listener::new(measurement, &[Command::Quit]);
    let large = scan(measurement, 1, &Numbers(12).ranges(801));
    listener.hear(&[&large[..], b"QT\n00P\n\n"].concat());
    let loss = Loss { cause: LossCause::BufferTooShort, dropped: Dropped::Scan };
    assert_eq!(listener.losses(), [loss]);
    assert!(matches!(listener.events[1].0, Event::Reply(Reply { status: Status::OK, .. })));
    assert_eq!(listener.reader.losses().buffer_too_short, 1);
}
