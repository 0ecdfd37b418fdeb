//! Small rooms whose sizes, doors and walls within are drawn by their number: what the planner and its figures are tried on.
//!
//! ```text
//!   ┌──────┐  ┌──────┐  ┌──────┐  ┌──────┐
//!   │      │  │   ┌──┘  │  │   │  │  □   │
//!   └─ ────┘  └─ ─┘     └─ ────┘  └─ ────┘
//! ```

use kehai_tracking::site::{Site, SiteError};

use crate::world::random::{Purpose, Stream};

/// Between which widths and depths rooms are drawn, m.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sizes {
    /// Along the door's wall.
    pub width_m: (f64, f64),
    /// Away from it.
    pub depth_m: (f64, f64),
}

/// As large as a bedroom or an office for one or two.
pub const SMALL: Sizes = Sizes { width_m: (3.5, 6.0), depth_m: (3.0, 5.0) };

/// Up to a class room.
pub const ALL: Sizes = Sizes { width_m: (3.5, 9.0), depth_m: (3.0, 7.0) };

/// Room `number`, with a door in its lower wall and one zone that counts; without modules.
///
/// # Errors
/// None that a site which is written here could have.
pub fn room(number: u64, sizes: Sizes) -> Result<Site, SiteError> {
    let mut stream = Stream::new(number, Purpose::Installed, [7, 7]);
    let mut between = |(low, high)| stream.between(low, high);
    let (width, depth) = (between(sizes.width_m), between(sizes.depth_m));
    let door = between((0.3, width - 1.3));
    let (x, y) = (width * between((0.35, 0.65)), depth * between((0.4, 0.6)));
    let corners = match number % 4 {
        1 => vec![[width, 0.0], [width, y], [x, y], [x, depth], [0.0, depth], [0.0, 0.0]],
        _ => vec![[width, 0.0], [width, depth], [0.0, depth], [0.0, 0.0]],
    };
    let outer: Vec<[f64; 2]> = [vec![[door + 1.0, 0.0]], corners.clone(), vec![[door, 0.0]]].concat();
    let mut text = format!("[[wall]]\npoints = {outer:?}\n");
    match number % 4 {
        2 => text += &format!("[[wall]]\npoints = [[{x}, {depth}], [{x}, {y}]]\n"),
        3 => {
            let (right, upper) = (x + 0.4, y + 0.4);
            text += &format!(
                "[[wall]]\npoints = [[{x}, {y}], [{right}, {y}], [{right}, {upper}], [{x}, {upper}], [{x}, {y}]]\n"
            );
        }
        _ => {}
    }
    text += &format!("[[zone]]\nname = \"room\"\ncount = true\npolygon = {corners:?}\n");
    text += &format!("[[entry]]\nname = \"door\"\nline = [[{door}, 0], [{}, 0]]\n", door + 1.0);
    Site::parse("room.toml", &text)
}
