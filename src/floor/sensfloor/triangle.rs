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

/// A value that is not farther from [`REST`] than this may be rest: some of a floor rest at up to 13 steps beside it for
/// good, and drift. A foot that fully stands on a triangle adds more.
const OFFSET: i32 = 16 * UNIT;

/// A value that may be rest and holds for so long is it, ms: longer than a walker stands on a foot (1.1 s).
const HELD_MS: u16 = 1500;

/// Parts of a step in which rest is kept.
const UNIT: i32 = 1 << 12;

/// Rest follows a value above it by a step in 5 s at most, as temperature and moisture drift, and one below by a step in
/// a second: half a second of a swing after a foot costs half a step, and what was learned under a foot is right again
/// within a quarter of a minute.
const RISE_PER_S: u64 = UNIT as u64 / 5;
const FALL_PER_S: u64 = UNIT as u64;

/// Longer silence of a tile counts as this, µs: what the value was in between is not known.
const SILENCE_US: u64 = 10_000_000;

/// A triangle that has been heard.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Triangle {
    /// Value at rest, in parts of a step.
    rest: i32,
    /// Newest value, in steps.
    value: u8,
    is_down: bool,
    /// For how long it has been down with values that may be rest, ms.
    held_ms: u16,
}

impl Triangle {
    /// A triangle whose first value is this.
    #[must_use]
    pub const fn new(value: u8) -> Self {
        let rest = if may_be_rest(value) { parts(value) } else { REST };
        Self { rest, value, is_down: parts(value) - rest >= DOWN, held_ms: 0 }
    }

    /// Whether a foot is on it, `past_us` after its newest value.
    #[must_use]
    pub const fn is_down(&self, past_us: u64) -> bool {
        self.is_down && !self.is_rest(past_us)
    }

    /// Whether it has held a value that may be rest for long enough.
    const fn is_rest(&self, past_us: u64) -> bool {
        may_be_rest(self.value) && self.held_ms.saturating_add(ms(past_us)) > HELD_MS
    }

    /// Takes its next value, `past_us` after the newest one: until now it has held that.
    pub fn take(&mut self, value: u8, past_us: u64) {
        if self.is_down && self.is_rest(past_us) {
            (self.rest, self.is_down) = (parts(self.value), false);
        } else if !self.is_down {
            let above = parts(self.value) - self.rest;
            let per_s = if above > 0 { RISE_PER_S } else { FALL_PER_S };
            // At most ten seconds of a step each.
            let most = (past_us.min(SILENCE_US) * per_s / 1_000_000) as i32;
            self.rest = self.rest.saturating_add(above.clamp(-most, most));
        }
        let holds = self.is_down && may_be_rest(self.value);
        self.held_ms = if holds { self.held_ms.saturating_add(ms(past_us)) } else { 0 };
        self.value = value;
        self.is_down = parts(value) - self.rest >= if self.is_down { UP } else { DOWN };
    }
}

/// A value in parts of a step.
const fn parts(value: u8) -> i32 {
    value as i32 * UNIT
}

/// At most a minute.
const fn ms(us: u64) -> u16 {
    let ms = us / 1000;
    if ms < 60_000 { ms as u16 } else { 60_000 }
}

/// A value that may be one at rest.
const fn may_be_rest(value: u8) -> bool {
    let from_rest = parts(value) - REST;
    from_rest <= OFFSET && from_rest >= -OFFSET
}
