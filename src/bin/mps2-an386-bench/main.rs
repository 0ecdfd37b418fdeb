//! What one scan costs on a Cortex-M4, stage by stage: a program that counts its own instructions in QEMU.
//!
//! ```text
//!   room ─▶ SCIP bytes ─▶ reader ─▶ ranges ─▶ background ─▶ clusters, candidates ─▶ report, encoded
//!   not counted           decode              background    candidates              encode
//! ```
//!
//! Under `-icount shift=10` an instruction takes 1024 ns of the board's time, and TIMER0 counts 25 a
//! microsecond: 25.6 counts are one instruction, exactly. `./ci.sh budget` runs it and guards its table.
//!
//! | file | what |
//! |---|---|
//! | `room` | where people walk, and what the sensor sees of it |
//! | `counter` | instructions |
//! | `sealing` | what sealed datagrams cost |
//! | `console` | the table, over UART0 |
//!
//! The cost of candidates is that of the whole pipeline less that of the background alone with the same scans.
#![cfg_attr(target_os = "none", no_std)]
#![cfg_attr(target_os = "none", no_main)]

#[cfg(target_os = "none")]
#[path = "."]
mod image {
    mod console;
    mod counter;
    #[path = "../mps2-an386/mmio.rs"]
    mod mmio;
    mod room;
    mod sealing;

    use core::fmt::Write;
    use core::hint::black_box;
    use core::panic::PanicInfo;

    use console::Console;
    use counter::Counter;
    use heapless::Vec;
    use kehai::background::{BEAM_BYTES, Background, Fingerprint, LEARN_SCANS};
    use kehai::pipeline::{Pipeline, Settings};
    use kehai::scan::{Geometry, GeometryParts, MAX_BEAMS, Scan, ScanTime, URG_04LX};
    use kehai::scip::{Command, Event, Measurement, Reader, Request, Width};
    use kehai::wire::{DATAGRAM_MAX, Identity, Message, Report};
    use room::{REPLY_MAX, Room};

    /// Bytes the sensor's line hands on at once.
    const SLICE_BYTES: usize = 64;
    /// Scans that are counted, after as many that are not.
    const SCANS: u32 = 40;

    /// People in the room: none, as in most scans; two in a talk; more than the room is for.
    const PEOPLE: [usize; 3] = [0, 2, 7];

    /// UST-10LX: 1081 steps of a quarter of a degree, 40 a second.
    const UST_10LX: GeometryParts = GeometryParts {
        first_step: 0,
        last_step: 1080,
        front_step: 540,
        steps_per_turn: 1440,
        period_us: 25_000,
        range_max_mm: 30_000,
        ..URG_04LX
    };

    /// Instructions of one scan.
    #[derive(Clone, Copy, Default)]
    struct Cost {
        decode: u32,
        background: u32,
        candidates: u32,
        encode: u32,
    }

    impl Cost {
        fn sum(self) -> u32 {
            self.decode + self.background + self.candidates + self.encode
        }
    }

    #[cortex_m_rt::entry]
    fn main() -> ! {
        console::start();
        counter::start();
        let head = ["steps", "people", "decode", "background", "candidates", "encode", "all", "dearest"];
        let _ = Console.write_str("instructions a scan\n");
        for title in head {
            let _ = write!(Console, "{title:>11}");
        }
        let _ = Console.write_str("\n");
        for (parts, settings) in [(URG_04LX, Settings::URG_04LX), (UST_10LX, Settings::UST_10LX)] {
            for people in PEOPLE {
                let costs = Bench::new(parts, settings).run(people);
                let mean = |stage: fn(&Cost) -> u32| costs.iter().map(stage).sum::<u32>() / SCANS;
                let dearest = costs.iter().map(|cost| cost.sum()).max().unwrap_or(0);
                let columns = [
                    u32::from(parts.last_step - parts.first_step + 1),
                    people as u32,
                    mean(|cost| cost.decode),
                    mean(|cost| cost.background),
                    mean(|cost| cost.candidates),
                    mean(|cost| cost.encode),
                    mean(|cost| cost.sum()),
                    dearest,
                ];
                for column in columns {
                    let _ = write!(Console, "{column:>11}");
                }
                let _ = Console.write_str("\n");
            }
        }
        sealing::run();
        end()
    }

    /// One sensor, and all that handles its scans.
    struct Bench {
        geometry: Geometry,
        blind_code: Option<u16>,
        request: Request,
        reader: Reader,
        ranges_mm: [u16; MAX_BEAMS],
        pipeline: Pipeline<MAX_BEAMS>,
        /// The pipeline's own once more, to be counted alone.
        background: Background<MAX_BEAMS>,
        counter: Counter,
    }

    impl Bench {
        fn new(parts: GeometryParts, settings: Settings) -> Self {
            let geometry = Geometry::new(parts).expect("a real sensor's");
            let GeometryParts { first_step, last_step, .. } = parts;
            let measurement =
                Measurement { first_step, last_step, cluster: 1, skip: 0, scans: 0, width: Width::Three };
            let request = Command::Measure(measurement).encode().expect("a legal measurement");
            let mut reader = Reader::new();
            reader.expect(&request);
            let mut pipeline = Pipeline::new();
            let fingerprint = Fingerprint::of(b"bench", &geometry);
            pipeline.configure(&geometry, settings, fingerprint).expect("room for every sensor");
            let ranges_mm = [0; MAX_BEAMS];
            let background = Background::new();
            let blind_code = settings.blind_code;
            let counter = Counter::new();
            Self { geometry, blind_code, request, reader, ranges_mm, pipeline, background, counter }
        }

        /// Learns the empty room, lets people in and counts.
        fn run(mut self, people: usize) -> Vec<Cost, { SCANS as usize }> {
            let (empty, lived_in) = (Room { people: 0 }, Room { people });
            let learned = u32::from(LEARN_SCANS);
            (0..learned).for_each(|number| _ = self.scan(&empty, number));
            assert!(self.pipeline.background().is_known(), "nothing was learned");
            self.copy_background();
            let begin = learned + SCANS;
            (learned..begin).for_each(|number| _ = self.scan(&lived_in, number));
            (begin..begin + SCANS).map(|number| self.scan(&lived_in, number)).collect()
        }

        fn copy_background(&mut self) {
            let (from, to) = (self.pipeline.background(), &mut self.background);
            let mut bytes = [0; MAX_BEAMS * BEAM_BYTES];
            let len = from.store_part(0, &mut bytes);
            to.restore_part(0, &bytes[..len]);
            to.restored(from.beams(), from.version(), from.fingerprint());
            to.bind(&self.geometry, from.fingerprint(), self.blind_code);
        }

        /// One scan, from bytes to bytes.
        fn scan(&mut self, room: &Room, number: u32) -> Cost {
            let Self { geometry, request, reader, ranges_mm, pipeline, background, counter, .. } = self;
            let mut reply = Vec::<u8, REPLY_MAX>::new();
            room.reply(geometry, request.echo(), number, &mut reply);
            let (decode, header) = counter.count(|| {
                let mut header = None;
                for slice in black_box(&reply).chunks(SLICE_BYTES) {
                    let mut rest = slice;
                    while !rest.is_empty() {
                        let fed = reader.feed(rest, 0, ranges_mm);
                        rest = rest.get(fed.consumed..).unwrap_or(&[]);
                        if let Some(Event::Scan(scan)) = fed.event {
                            header = Some(scan);
                        }
                    }
                }
                header
            });
            let header = header.expect("a scan");
            let sensor_ms = u64::from(header.stamp_ms);
            let time = ScanTime { sensor_ms, stamp_us: 1000 * sensor_ms, uncertainty_us: 400 };
            let scan = Scan { geometry, ranges_mm: &ranges_mm[..header.beams.into()], time };
            let (judging, ()) =
                counter.count(|| background.judge(black_box(&scan), (sensor_ms / 100) as u32));
            let (all, judgement) = counter.count(|| pipeline.process(black_box(&scan)));
            let mut datagram = [0; DATAGRAM_MAX];
            let (encode, encoded) = counter.count(|| {
                let report = Message::Report(Report::of(black_box(judgement), 1, 0));
                report.encode(Identity::default(), black_box(&mut datagram))
            });
            assert!(encoded.is_ok(), "the report does not fit");
            let found = judgement.candidates().len();
            assert!(found <= room.people + 1 && 2 * found >= room.people, "{found} candidates");
            Cost { decode, background: judging, candidates: all.saturating_sub(judging), encode }
        }
    }

    unsafe extern "C" {
        /// cortex-m-rt's.
        fn DefaultHandler();
    }

    /// Vectors of the board's 32 interrupts; none is let through.
    #[unsafe(link_section = ".vector_table.interrupts")]
    #[unsafe(no_mangle)]
    pub static __INTERRUPTS: [unsafe extern "C" fn(); 32] = [DefaultHandler; 32];

    /// A reset ends QEMU, which runs with `-no-reboot`.
    fn end() -> ! {
        cortex_m::peripheral::SCB::sys_reset()
    }

    #[panic_handler]
    fn panic(info: &PanicInfo<'_>) -> ! {
        let _ = writeln!(Console, "{info}");
        end()
    }
}

/// On a PC there is no board.
#[cfg(not(target_os = "none"))]
fn main() {}
