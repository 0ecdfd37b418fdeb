//! The session under a script of bytes, replies, failures and time: no panic, always a next deadline
//! within a minute, never more than a handful of actions at one time.
//!
//! ```text
//!   input:  settings │ step │ step │ …
//!            1 byte
//!   step:   0–99   that many bytes from the sensor, as they follow
//!           100–   a well-formed reply, one of the table or the next scan
//!           160–   time passes: 2^(step − 160) · 100 µs
//!           180–   what the session has asked for is answered 00
//!           200–   … with the status that follows
//!           220–   the link fails
//! ```
#![no_main]

use kehai::scip::{LossCause, checksum};
use kehai::sensor::{Action, LineSettings, SensorSettings, Session};
use libfuzzer_sys::fuzz_target;

const BEAMS: usize = 16;

const REPLIES: [&str; 8] = [
    "QT\nE\n\n",
    "SCIP2.0\n0\n\n",
    "PP\n00P\n",
    "TM1\n00P\n<SfkP\n\n",
    "MD0000001501000\n21S\n\n",
    "MD0000001501000\n0Mm\n\n",
    "MD0000001501000\n50U\n\n",
    "\n\n",
];

struct Talk {
    session: Session,
    now_us: u64,
    ranges_mm: [u16; BEAMS],
    /// The last request, without its line feed.
    asked: Vec<u8>,
    stamp_ms: u32,
}

impl Talk {
    fn hears(&mut self, bytes: &[u8]) {
        let mut rest = bytes;
        while !rest.is_empty() {
            let received = self.session.receive(rest, self.now_us, &mut self.ranges_mm);
            assert!(received.consumed > 0, "no progress");
            if let Some(taken) = received.scan {
                assert!(usize::from(taken.beams) <= BEAMS);
                assert!(self.session.geometry().is_some());
            }
            rest = &rest[received.consumed..];
        }
    }

    fn hears_lines(&mut self, head: &[u8], lines: &[&str]) {
        let mut text = head.to_vec();
        for line in lines {
            text.extend_from_slice(line.as_bytes());
            text.push(checksum::of(line.as_bytes()));
            text.push(b'\n');
        }
        text.push(b'\n');
        self.hears(&text);
    }

    fn hears_scan(&mut self) {
        self.stamp_ms = (self.stamp_ms + 100) % (1 << 24);
        let code = |shift: u32| char::from((self.stamp_ms >> shift & 63) as u8 + 0x30);
        let stamp: String = [18, 12, 6, 0].map(code).into_iter().collect();
        let data = "0C4".repeat(BEAMS);
        self.hears_lines(b"MD0000001501000\n99b\n", &[&stamp, &data]);
    }

    fn hears_parameters(&mut self) {
        let keys = ["DMIN:20", "DMAX:5600", "ARES:1024", "AMIN:0", "AMAX:15", "AFRT:8", "SCAN:600"];
        let lines = keys.map(|key| format!("{key};"));
        let mut text = b"PP\n00P\n".to_vec();
        for (line, key) in lines.iter().zip(keys) {
            text.extend_from_slice(line.as_bytes());
            text.push(checksum::of(key.as_bytes()));
            text.push(b'\n');
        }
        text.push(b'\n');
        self.hears(&text);
    }

    /// Answers the last request.
    fn answers(&mut self, status: [u8; 2]) {
        let asked = self.asked.clone();
        match (&asked[..], &status) {
            (b"PP", b"00") => self.hears_parameters(),
            (b"TM1", b"00") => self.hears(REPLIES[3].as_bytes()),
            _ => {
                let text = [&asked[..], b"\n"].concat();
                let status = String::from_utf8_lossy(&status).into_owned();
                self.hears_lines(&text, &[&status]);
            }
        }
    }

    fn settles(&mut self) {
        for _ in 0..10 {
            match self.session.poll(self.now_us) {
                Action::Wait(until_us) | Action::Pause(until_us) if until_us > self.now_us => {
                    assert!(until_us - self.now_us <= 60_000_000, "waits too long");
                    return;
                }
                Action::Send(message) => {
                    let request = message.parts().concat();
                    self.asked = request.strip_suffix(b"\n").unwrap().trim_ascii_start().to_vec();
                }
                Action::Wait(_) | Action::Pause(_) | Action::SetBaud(_) => {}
            }
        }
        panic!("no end of actions");
    }
}

fuzz_target!(|input: &[u8]| {
    let Some((&settings, mut rest)) = input.split_first() else { return };
    let line = match settings % 3 {
        0 => LineSettings::NoSpeed,
        1 => LineSettings::Serial { last_baud: None, wanted_baud: None, fastest_baud: 750_000 },
        _ => LineSettings::Serial { last_baud: Some(1), wanted_baud: Some(115_200), fastest_baud: 0 },
    };
    let session = Session::new(SensorSettings { line, ..SensorSettings::SERIAL }, BEAMS as u16);
    let mut talk = Talk { session, now_us: 0, ranges_mm: [0; BEAMS], asked: Vec::new(), stamp_ms: 0 };
    talk.settles();
    while let Some((&step, behind)) = rest.split_first() {
        rest = behind;
        match step {
            0..100 => {
                let (bytes, behind) = rest.split_at(rest.len().min(step.into()));
                rest = behind;
                talk.hears(bytes);
            }
            100..108 => talk.hears(REPLIES[usize::from(step - 100)].as_bytes()),
            108..130 => talk.hears_scan(),
            130..160 => talk.hears_parameters(),
            160..180 => talk.now_us += 100 << (step - 160),
            180..200 => talk.answers(*b"00"),
            200..220 => {
                let Some((&status, behind)) = rest.split_first_chunk() else { return };
                rest = behind;
                talk.answers(status);
            }
            220.. => talk.session.link_failed(talk.now_us),
        }
        talk.settles();
    }
    let losses = talk.session.losses();
    assert_eq!(losses.buffer_too_short, 0, "{}", LossCause::BufferTooShort);
});
