//! What a SensFloor says while soles are on it, tick by tick.
//!
//! ```text
//!   soles ─▶ share of each triangle ─▶ value: offset, drift, noise, swing below rest ─▶ a frame of a tile that changed
//!            covered, 2 cm beyond       │ ╭──╮                                         at a tick of 66.7 ms, and again
//!            the sole                   ┴─╯  │ ╭─                                      later and later
//!                                            ╰─╯
//! ```
//!
//! The magnitudes are those that a public recording shows (sensfloor-pipeline, docs/bibliography.md): steps of 10 to 60, a
//! tenth of the triangles 9 to 13 beside 128 for good, swings of up to half the step when a foot leaves, at most three
//! tiles a tick. How they come about is a guess. Nothing here is shared with what decodes or tracks.

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use kehai::floor::sensfloor::{Frame, Layout, TRIANGLES};

/// A place or a direction, m.
pub type Place = (f64, f64);

/// A sole on the floor.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sole {
    /// Its middle, from the floor's corner on, m.
    pub at: Place,
    /// Where its toes point, of length 1.
    pub ahead: Place,
}

/// Between two ticks, µs.
pub const TICK_US: u64 = 66_700;

/// Side of a tile, m.
pub const TILE_M: f64 = 0.5;

/// A sole as a triangle feels it, m: 2 cm beyond it on all sides.
const FELT_M: (f64, f64) = (0.30, 0.14);

/// A sole farther than this from the middle of a tile along x or y touches none of it, m.
const NEAR_M: f64 = 0.45;

/// Places in a triangle that are looked at, along its side.
const GRID: usize = 10;

/// A tile speaks when a value has changed by so much since it spoke last.
const CHANGED: f64 = 3.0;

/// Ticks after which it speaks again, with nothing new to say.
const AGAIN: [u32; 4] = [3, 6, 7, 13];

/// Most tiles that speak in a tick.
const AT_ONCE: usize = 3;

/// Share of the frames that the radio loses.
const LOST: f64 = 0.02;

/// Of a swing below rest so much is left a tick later: a third after 0.3 s.
const FADES: f64 = 0.8;

/// Period of the drift at least and at most, s, and how far it goes to either side, steps.
const DRIFT_S: (f64, f64) = (200.0, 900.0);
const DRIFT: f64 = 4.0;

/// A triangle, as it is built.
#[derive(Clone, Copy, Debug)]
struct Triangle {
    offset: f64,
    /// Steps of drift, and its period, s.
    drift: (f64, f64),
    /// Steps when all of it is covered.
    gain: f64,
    /// Steps below rest.
    swing: f64,
    before: f64,
    value: f64,
}

#[derive(Clone, Debug)]
struct Tile {
    number: (u8, u8),
    triangles: [Triangle; TRIANGLES],
    said: [f64; TRIANGLES],
    /// Ticks since it spoke, and how often it has said the same.
    quiet: u32,
    repeats: usize,
    asked: bool,
}

/// A floor that feels soles.
#[derive(Clone, Debug)]
pub struct Signal {
    group: u16,
    first: (u8, u8),
    tiles: Vec<Tile>,
    random: Random,
    ticks: u64,
    turn: usize,
}

impl Signal {
    /// A floor of these tiles; its corner is the origin.
    #[must_use]
    pub fn new(layout: &Layout, seed: u64) -> Self {
        let mut random = Random(Pcg64Mcg::seed_from_u64(seed));
        let ((columns, rows), first) = (layout.tiles(), layout.first());
        let mut triangle = || {
            let is_beside = random.uniform() < 0.1;
            let offset = if is_beside { random.between(9.0, 13.0) } else { random.between(-1.0, 1.0) };
            Triangle {
                offset,
                drift: (random.between(0.0, DRIFT), random.between(DRIFT_S.0, DRIFT_S.1)),
                gain: random.between(40.0, 70.0),
                swing: 0.0,
                before: 0.0,
                value: 127.5 + offset,
            }
        };
        let numbers = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
        let tiles = numbers.map(|(column, row)| {
            let triangles = [(); TRIANGLES].map(|()| triangle());
            let said = triangles.map(|triangle| triangle.value);
            let number = (first.0 + column, first.1 + row);
            Tile { number, triangles, said, quiet: 0, repeats: AGAIN.len(), asked: false }
        });
        let tiles = tiles.collect();
        Self { group: layout.group(), first, tiles, random, ticks: 0, turn: 0 }
    }

    /// When the next tick is, µs.
    #[must_use]
    pub const fn next_us(&self) -> u64 {
        (self.ticks + 1) * TICK_US
    }

    /// A tile is asked for its state.
    pub fn ask(&mut self, number: (u8, u8)) {
        self.tiles.iter_mut().filter(|tile| tile.number == number).for_each(|tile| tile.asked = true);
    }

    /// The next tick, while these soles are on the floor: the frames that leave it.
    pub fn tick(&mut self, soles: &[Sole]) -> Vec<Frame> {
        self.ticks += 1;
        let at_s = self.ticks as f64 * TICK_US as f64 * 1e-6;
        for tile in &mut self.tiles {
            let place = |number: u8, first: u8| (f64::from(number - first) + 0.5) * TILE_M;
            let middle = (place(tile.number.0, self.first.0), place(tile.number.1, self.first.1));
            let is_near =
                |sole: &&Sole| (sole.at.0 - middle.0).abs() < NEAR_M && (sole.at.1 - middle.1).abs() < NEAR_M;
            let near: Vec<Sole> = soles.iter().filter(is_near).copied().collect();
            for (number, triangle) in tile.triangles.iter_mut().enumerate() {
                let felt = triangle.gain * covered(middle, number, &near);
                let lifted = (triangle.before - felt).max(0.0);
                triangle.swing = triangle.swing * FADES + 0.4 * lifted;
                triangle.before = felt;
                let drift = triangle.drift.0 * to_and_fro(at_s / triangle.drift.1);
                let noise = 0.7 * self.random.normal();
                triangle.value = 127.5 + triangle.offset + drift + felt - triangle.swing + noise;
            }
        }
        let mut frames = Vec::new();
        let count = self.tiles.len();
        let begin = self.turn;
        for index in 0..count {
            let Some(tile) = self.tiles.get_mut((begin + index) % count) else { continue };
            tile.quiet += 1;
            let changed =
                tile.triangles.iter().zip(&tile.said).any(|(now, said)| (now.value - said).abs() > CHANGED);
            let again = AGAIN.get(tile.repeats).is_some_and(|ticks| tile.quiet >= *ticks);
            if !(changed || again || tile.asked) || frames.len() >= AT_ONCE {
                continue;
            }
            tile.repeats = if changed { 0 } else { (tile.repeats + 1).min(AGAIN.len()) };
            (tile.quiet, tile.asked) = (0, false);
            tile.said = tile.triangles.map(|triangle| triangle.value);
            self.turn = (begin + index + 1) % count;
            let values = tile.said.map(|value| value.round().clamp(0.0, 250.0) as u8);
            if self.random.uniform() >= LOST {
                frames.push(Frame { group: self.group, tile: tile.number, values });
            }
        }
        frames
    }
}

/// From 0 up to 1, down to −1 and back in a period.
fn to_and_fro(periods: f64) -> f64 {
    let into = (periods + 0.25).rem_euclid(1.0);
    if into < 0.5 { 4.0 * into - 1.0 } else { 3.0 - 4.0 * into }
}

/// Ends of the triangles, in halves of a tile from its middle: the first is right of the way up, and they go on clockwise.
const ENDS: [Place; TRIANGLES] =
    [(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (1.0, -1.0), (0.0, -1.0), (-1.0, -1.0), (-1.0, 0.0), (-1.0, 1.0)];

/// The share of a triangle that soles cover, as it feels them.
fn covered(middle: Place, triangle: usize, soles: &[Sole]) -> f64 {
    if soles.is_empty() {
        return 0.0;
    }
    let end = |number: usize| ENDS.get(number % TRIANGLES).copied().unwrap_or_default();
    let (one, other) = (end(triangle), end(triangle + 1));
    let (mut under, mut all) = (0_u32, 0_u32);
    for along in 0..GRID {
        for across in 0..GRID - along {
            let part = |index: usize| (index as f64 + 1.0 / 3.0) / GRID as f64 * 0.5 * TILE_M;
            let (along, across) = (part(along), part(across));
            let at =
                (middle.0 + one.0 * along + other.0 * across, middle.1 + one.1 * along + other.1 * across);
            let is_on = |sole: &Sole| {
                let (x, y) = (at.0 - sole.at.0, at.1 - sole.at.1);
                let (ahead, aside) =
                    (x * sole.ahead.0 + y * sole.ahead.1, y * sole.ahead.0 - x * sole.ahead.1);
                ahead.abs() < 0.5 * FELT_M.0 && aside.abs() < 0.5 * FELT_M.1
            };
            all += 1;
            under += u32::from(soles.iter().any(is_on));
        }
    }
    f64::from(under) / f64::from(all)
}

/// Random numbers, the same on every machine.
#[derive(Clone, Debug)]
struct Random(Pcg64Mcg);

impl Random {
    fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// Nearly normal, as the sum of twelve uniform numbers.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tile_speaks_while_a_foot_comes_and_goes_and_then_falls_silent() {
        let layout = Layout::new(10, (1, 1), (2, 2)).unwrap();
        let mut signal = Signal::new(&layout, 3);
        let sole = [Sole { at: (0.35, 0.40), ahead: (0.0, 1.0) }];
        let spoken: Vec<Vec<Frame>> =
            (0..120).map(|tick| signal.tick(if (20..30).contains(&tick) { &sole } else { &[] })).collect();
        let pressed: Vec<u8> = spoken[20..30]
            .iter()
            .flatten()
            .filter(|frame| frame.tile == (1, 1))
            .map(|frame| frame.values[0])
            .collect();
        assert!(pressed.iter().any(|value| *value > 145), "{pressed:?}");
        let frames = |ticks: std::ops::Range<usize>| spoken[ticks].iter().flatten().count();
        assert!(frames(30..50) > 3 && frames(80..120) < 6, "{} then {}", frames(30..50), frames(80..120));
        signal.ask((2, 2));
        let answers: Vec<_> =
            (0..20).flat_map(|_| signal.tick(&[])).filter(|frame| frame.tile == (2, 2)).collect();
        assert!(!answers.is_empty());
    }
}
