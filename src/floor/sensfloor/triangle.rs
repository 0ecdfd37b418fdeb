//! One triangle of a tile: its value at rest, learned, and whether it is down.
//!
//! ```text
//!   value        ╭──╮                       down from 8 above rest on, up again below 4
//!   ┄ 8 ┄┄┄┄┄┄┄┄┄│┄┄│┄┄┄┄┄┄
//!   ┄ 4 ┄┄┄┄┄┄┄┄╭╯┄┄│┄┄┄┄┄┄
//!   rest ───────╯   │ ╭────  it swings below rest when a foot leaves
//!                   ╰─╯
//! ```

/// Steps of the value above rest from which a triangle is down: less than the weakest step (10), and four times the noise
/// at rest (±2).
const DOWN: i32 = 8 * UNIT;

/// Below this it is up again: half, and still twice the noise.
const UP: i32 = 4 * UNIT;

/// Value at rest by the maker's word.
const REST: i32 = 127 * UNIT + UNIT / 2;

/// A first value that is farther from [`REST`] than this is no triangle at rest: some of a floor rest at up to 13 steps beside
/// it for good.
const OFFSET: i32 = 14 * UNIT;

/// Parts of a step in which rest is kept.
const UNIT: i32 = 1 << 12;

/// Rest follows a value above it by a step in 5 s at most, as temperature and moisture drift, and one below by a step in
/// a second: half a second of a swing after a foot costs half a step, and what was learned under a foot is right again
/// within a quarter of a minute.
const RISE_PER_S: u64 = UNIT as u64 / 5;
const FALL_PER_S: u64 = UNIT as u64;

/// Longer silence of a tile counts as this, µs: nobody knows when the value changed.
const SILENCE_US: u64 = 10_000_000;

/// A triangle that has been heard.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Triangle {
    /// Value at rest, in parts of a step.
    rest: i32,
    is_down: bool,
}

impl Triangle {
    /// A triangle whose first value is this.
    #[must_use]
    pub const fn new(value: u8) -> Self {
        let value = value as i32 * UNIT;
        let from_rest = value - REST;
        let is_rest = from_rest <= OFFSET && from_rest >= -OFFSET;
        let rest = if is_rest { value } else { REST };
        Self { rest, is_down: value - rest >= DOWN }
    }

    /// Whether a foot is on it.
    #[must_use]
    pub const fn is_down(&self) -> bool {
        self.is_down
    }

    /// Takes its next value, `past_us` after the last one.
    pub fn take(&mut self, value: u8, past_us: u64) {
        let above = i32::from(value) * UNIT - self.rest;
        self.is_down = above >= if self.is_down { UP } else { DOWN };
        if !self.is_down {
            let per_s = if above > 0 { RISE_PER_S } else { FALL_PER_S };
            // At most ten seconds of a step each.
            let most = (past_us.min(SILENCE_US) * per_s / 1_000_000) as i32;
            self.rest = self.rest.saturating_add(above.clamp(-most, most));
        }
    }
}
