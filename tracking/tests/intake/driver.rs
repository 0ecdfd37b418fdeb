//! A row of bytes decides what happens in a [`World`]; the [judge](super::judge) looks at it after each tenth of a second.
//!
//! ```text
//!   byte 0      who is in the room      then steps of four bytes:  what, and three for its fields
//!   what 0–13   up to 1.6 s pass        14 │ 15–17  3 s pass │ a forged report   18–19  a forged answer
//!   20 │ 21     forged health │ a part of a background      22 │ 23 │ 24   repeated │ announced │ a peer poses
//!   25 │ 26     loss, delay │ silence   27 │ 28 │ 29 │ 30   a restart │ a clock jumps │ the host sleeps │ both jump
//! ```

use super::judge::RECOVERED_US;
use super::scene::People;
use super::times::SECOND_US;
use super::world::World;

/// More steps say nothing new.
pub const STEPS: usize = 48;

/// Lets happen what the bytes say.
///
/// # Panics
/// What must never be is.
pub fn drive(input: &[u8]) {
    let Some((&first, rest)) = input.split_first() else { return };
    let people = People { stands: first & 1 != 0, walks: first & 2 != 0 };
    let mut world = World::new(people, u64::from(first));
    world.seconds(u64::from(first >> 2 & 3));
    for step in rest.chunks_exact(4).take(STEPS) {
        let fields = [step[1], step[2], step[3]];
        match step[0] % 32 {
            0..=13 => (0..=step[1] % 16).for_each(|_| world.tenth()),
            14 => world.seconds(3),
            15..=17 => world.forge_report(fields),
            18 | 19 => world.forge_answer(fields),
            20 => world.forge_health(fields),
            21 => world.forge_part(fields),
            22 => world.repeat(fields),
            23 => world.announce_falsely(fields),
            24 => world.pose(fields),
            25 => world.mishap(fields),
            26 => world.silence(fields),
            27 => world.restart(fields),
            28 => world.jump(fields),
            29 => world.suspend(fields),
            _ => {
                world.jump([0, step[2], step[3]]);
                world.jump([1, step[2], step[3]]);
            }
        }
    }
    world.end();
    world.seconds(RECOVERED_US / SECOND_US + 1);
}
