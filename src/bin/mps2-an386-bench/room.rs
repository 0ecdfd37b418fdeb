//! The room: five metres square, the sensor in its middle, walking people, and the sensor's answers in bytes.
//!
//! ```text
//!   ┌───────────────┐   person k walks a circle of 0.25 m, 1 m/s, around a place 1.2 to 1.8 m away;
//!   │  ╭╮   ╭╮      │   the places are 0.55 rad apart, in front of the sensor first
//!   │  ╰╯   ╰╯  ╭╮  │
//!   │      ●    ╰╯  │   a person is a cylinder of 0.4 m, noise is ±4 mm
//!   └───────────────┘
//! ```

use heapless::Vec;
use kehai::math;
use kehai::scan::{Geometry, MAX_BEAMS};
use kehai::scip::{checksum, encoding};

/// From the sensor to a wall.
const WALL_MM: f32 = 2500.0;
/// Radius of a person, and of the circle it walks.
const BODY_MM: f32 = 200.0;
const CIRCLE_MM: f32 = 250.0;
/// Walking speed: 1 m/s.
const WALKED_MM_PER_US: f32 = 0.001;
/// Characters of a data line.
const LINE: usize = 64;

/// Echo, status, stamp, three characters a value, checksums and line feeds, the empty line.
pub const REPLY_MAX: usize = 32 + 3 * MAX_BEAMS + 2 * (3 * MAX_BEAMS).div_ceil(LINE);

/// The room with people in it.
pub struct Room {
    /// How many.
    pub people: usize,
}

impl Room {
    /// Appends the sensor's reply for scan `number`.
    pub fn reply<const N: usize>(&self, geometry: &Geometry, echo: &[u8], number: u32, out: &mut Vec<u8, N>) {
        let stamp_ms = number * (geometry.period_us() / 1000);
        line(echo, false, out);
        line(b"99", true, out);
        line(&characters::<4>(stamp_ms), true, out);
        let mut data = Vec::<u8, LINE>::new();
        for beam in 0..geometry.beams() {
            for character in characters::<3>(self.range_mm(geometry, beam, number).into()) {
                if data.is_full() {
                    line(&data, true, out);
                    data.clear();
                }
                data.push(character).expect("it was not full");
            }
        }
        line(&data, true, out);
        line(b"", false, out);
    }

    fn range_mm(&self, geometry: &Geometry, beam: u16, number: u32) -> u16 {
        let (sine, cosine) = math::sin_cos(geometry.bearing_rad(beam));
        let across = if sine < 0.0 { -sine } else { sine };
        let ahead = if cosine < 0.0 { -cosine } else { cosine };
        let mut nearest_mm = WALL_MM / if across > ahead { across } else { ahead };
        let time_us = number as f32 * geometry.period_us() as f32;
        for person in 0..self.people {
            let (x_mm, y_mm) = place_mm(person, time_us);
            let (along_mm, aside_mm) = (x_mm * cosine + y_mm * sine, y_mm * cosine - x_mm * sine);
            let inside = BODY_MM * BODY_MM - aside_mm * aside_mm;
            if along_mm > 0.0 && inside > 0.0 {
                let range_mm = along_mm - math::sqrt(inside);
                nearest_mm = if range_mm < nearest_mm { range_mm } else { nearest_mm };
            }
        }
        // Noise that repeats itself in every run.
        let noise_mm = ((u32::from(beam) * 7919) ^ (number * 104)) % 9;
        nearest_mm as u16 + noise_mm as u16 - 4
    }
}

/// Where person `person` is.
fn place_mm(person: usize, time_us: f32) -> (f32, f32) {
    // 0, 1, −1, 2, −2 … times 0.55 rad from straight ahead.
    let turns = if person % 2 == 1 { person.div_ceil(2) as f32 } else { -((person / 2) as f32) };
    let (sine, cosine) = math::sin_cos(turns * 0.55);
    let away_mm = 1200.0 + 100.0 * person as f32;
    let walked_rad = math::wrap_angle(time_us * WALKED_MM_PER_US / CIRCLE_MM + person as f32);
    let (aside, along) = math::sin_cos(walked_rad);
    (away_mm * cosine + CIRCLE_MM * along, away_mm * sine + CIRCLE_MM * aside)
}

/// `N` characters of the sensor's code.
fn characters<const N: usize>(value: u32) -> [u8; N] {
    core::array::from_fn(|place| encoding::encode_char((value >> (6 * (N - 1 - place)) & 0x3f) as u8))
}

/// Appends a line, with its checksum if it has one.
fn line<const N: usize>(content: &[u8], summed: bool, out: &mut Vec<u8, N>) {
    out.extend_from_slice(content).expect("room for the longest reply");
    if summed {
        out.push(checksum::of(content)).expect("room for the longest reply");
    }
    out.push(b'\n').expect("room for the longest reply");
}
