//! From a source's ranges to the data block of a measurement reply.
//!
//! ```text
//! steps asked for:  r r r r r r r …      outside the measured steps: 19
//!                   └cluster┘            the smallest valid range of each group is sent
//! values:           rrr | rrriii | rrr&rrr | rrriii&rrriii   then lines of 64 characters
//! ```

use super::encode::push_value;
use super::model::{Family, Model};
use super::request::{Coding, Measurement};

/// "Cannot be measured": what a step outside the sensor's field reads.
const OUTSIDE: u32 = 19;

/// What a two-character reply of a URG says for a range beyond its 12 bits.
const BEYOND_TWO_CHARACTERS: u32 = 16;

/// Largest value of two characters.
const MAX_TWO: u32 = 4095;

/// Largest value of three characters.
const MAX_THREE: u32 = 262_143;

/// A beam that hits an edge by part sees what lies this much behind it as a second echo.
const ECHO_DISTANCE_MM: u32 = 300;

/// Strength of an echo: synthetic, falling with the distance, within what recordings of a UTM-30LX show
/// (137 to 16 219); 0 where there is no range.
#[must_use]
pub(crate) fn intensity(range_mm: u32, model: &Model) -> u32 {
    if range_mm < model.geometry.range_min_mm || range_mm > model.geometry.range_max_mm {
        return 0;
    }
    (16_000_000 / (range_mm + 1000)).clamp(137, 16_219)
}

/// The characters of a data block.
#[must_use]
pub(crate) fn characters(model: &Model, asked: &Measurement, ranges_mm: &[u32]) -> Vec<u8> {
    let at = |step: u16| {
        let index = usize::from(step).checked_sub(usize::from(model.geometry.first_step));
        index.and_then(|index| ranges_mm.get(index)).copied().unwrap_or(OUTSIDE)
    };
    let mut out = Vec::with_capacity(3 * ranges_mm.len());
    let mut step = asked.first_step;
    while step <= asked.last_step {
        let group_end = step.saturating_add(asked.cluster - 1).min(asked.last_step);
        let valid = |step: &u16| at(*step) >= model.geometry.range_min_mm;
        let chosen = if group_end == step {
            step
        } else {
            (step..=group_end).filter(valid).min_by_key(|&step| at(step)).unwrap_or(step)
        };
        push_beam(&mut out, model, asked, at(chosen));
        if asked.multi_echo {
            let near_mm = at(chosen);
            let far_mm = [chosen.saturating_sub(1), chosen.saturating_add(1)].map(at).into_iter().max();
            let valid = near_mm >= model.geometry.range_min_mm;
            let far_mm = far_mm.filter(|&far_mm| valid && far_mm > near_mm + ECHO_DISTANCE_MM);
            if let Some(far_mm) = far_mm {
                out.push(b'&');
                push_beam(&mut out, model, asked, far_mm);
            }
        }
        step = group_end.saturating_add(1);
    }
    out
}

fn push_beam(out: &mut Vec<u8>, model: &Model, asked: &Measurement, range_mm: u32) {
    match asked.coding {
        Coding::Two => {
            let beyond = if model.family == Family::Classic { BEYOND_TWO_CHARACTERS } else { MAX_TWO };
            push_value(out, if range_mm > MAX_TWO { beyond } else { range_mm }, 2);
        }
        Coding::Three => push_value(out, range_mm.min(MAX_THREE), 3),
        Coding::WithIntensity => {
            push_value(out, range_mm.min(MAX_THREE), 3);
            push_value(out, intensity(range_mm, model), 3);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::urg::model::{URG_04LX, UST_10LX};

    fn block(command: &str, model: &Model, ranges_mm: &[u32]) -> String {
        let asked = Measurement::parse(command.as_bytes(), model.max_step).unwrap();
        String::from_utf8(characters(model, &asked, ranges_mm)).unwrap()
    }

    fn values(command: &str, ranges_mm: &[u32]) -> Vec<u32> {
        let block = block(command, &URG_04LX, ranges_mm);
        let value = |chunk: &[u8]| chunk.iter().fold(0, |sum, c| sum * 64 + u32::from(c - 0x30));
        block.as_bytes().chunks(3).map(value).collect()
    }

    #[test]
    fn a_group_sends_its_smallest_valid_range() {
        let ranges = [30, 31, 32, 33, 32, 31];
        assert_eq!(values("GD0044004902", &ranges), [30, 32, 31]);
        assert_eq!(values("GD0044004903", &ranges), [30, 31]);
        assert_eq!(values("GD0044004904", &ranges), [30, 31]);
        assert_eq!(values("GD0044004902", &[7, 500, 400, 0, 6, 19]), [500, 400, 6]);
    }

    #[test]
    fn steps_outside_the_field_read_19() {
        assert_eq!(values("GD0042004500", &[500, 600]), [19, 19, 500, 600]);
    }

    #[test]
    fn two_characters_cannot_show_more_than_4095_mm() {
        assert_eq!(block("GS0044004600", &URG_04LX, &[1234, 4095, 4096]), "CBoo0@");
    }

    #[test]
    fn an_edge_has_two_echoes_near_then_far() {
        let ranges = [1000, 1000, 3000, 3000];
        assert_eq!(block("HD0000000300", &UST_10LX, &ranges), "0?X0?X&0^h0^h0^h");
        let with_intensity = block("HE0001000100", &UST_10LX, &ranges);
        assert_eq!(with_intensity.len(), 13);
        assert_eq!(with_intensity.as_bytes()[6], b'&');
    }
}
