//! A sign as a message from outside: what is malformed or cannot be changes nothing, and says why.
//!
//! ```text
//!   {"id": "04A22B…"}                                         read somewhere
//!   {"id": "04A22B…", "reader": "hall"}                       near the site's reader of that name
//!   {"id": "04A22B…", "reader": "camera", "u": 312, "v": 205} at the place of a pixel of a camera
//!   {"id": "04A22B…", "x": 1.2, "y": 3.4, "sigma_m": 0.3}     at a place
//!       and "at_ms": when, ms since 1970; without it, now
//! ```
//!
//! A message that comes twice is one more reading of the same: it needs no number, unlike a door's.

use schemars::JsonSchema;
use serde::Deserialize;

use super::sign::{NotTaken, Read};
use crate::card::Card;
use crate::geometry::Point;
use crate::site::reader::Reads;
use crate::site::{BESIDE_M, Site, beside_m};

/// Longest message, bytes.
pub const LONGEST: usize = 1024;

/// Longest ID, characters.
const ID_MAX: usize = 128;

/// Spread of a place of which the message does not say how well it is known, m: a person and an arm's length.
const SIGMA_M: f64 = 0.3;

/// A reading this old is still compared with where the tracks were then, ms.
pub(super) const LATE_MS: u64 = 2000;

/// Clocks that are set from the network differ by less, ms.
const AHEAD_MS: u64 = 500;

/// What a reader has read, and where.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Sign")]
pub struct Message {
    /// The ID that was read: 1 to 128 characters, of which only a keyed hash is kept.
    #[schemars(length(min = 1, max = 128))]
    id: String,
    /// When, ms since 1970; without it, now.
    at_ms: Option<u64>,
    /// The reader of the site that has read it.
    reader: Option<String>,
    /// Of a camera: the pixel's column, with `v`.
    u: Option<f64>,
    /// Of a camera: the pixel's row.
    v: Option<f64>,
    /// Without a reader: where, m, with `y`.
    x: Option<f64>,
    /// See `x`.
    y: Option<f64>,
    /// Spread of that place along each axis, m.
    sigma_m: Option<f64>,
}

/// A message, read.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Reading {
    /// Whose.
    pub card: Card,
    /// How long ago, s.
    pub ago_s: f64,
    /// Where.
    pub read: Read,
}

/// The ID of a message or a question, without space around it.
///
/// # Errors
/// It has no letter and no digit, or too many characters.
pub fn id(text: &str) -> Result<&str, NotTaken> {
    let id = text.trim();
    if !id.contains(char::is_alphanumeric) || text.chars().count() > ID_MAX {
        return Err(malformed("id must have 1 to 128 characters, a letter or a digit among them"));
    }
    Ok(id)
}

/// What a message says that came at `now_ms`, since 1970; `hash` makes of an ID what may be kept of it.
///
/// # Errors
/// Why it is not taken.
pub fn read(
    bytes: &[u8],
    site: &Site,
    now_ms: u64,
    hash: impl FnOnce(&str) -> Card,
) -> Result<Reading, NotTaken> {
    if bytes.len() > LONGEST {
        return Err(malformed("longer than 1024 bytes"));
    }
    let message: Message =
        serde_json::from_slice(bytes).map_err(|error| NotTaken::Malformed(error.to_string()))?;
    let at_ms = message.at_ms.unwrap_or(now_ms);
    let ago_ms = now_ms.saturating_sub(at_ms);
    if ago_ms > LATE_MS {
        return Err(NotTaken::Late(ago_ms as f64 * 1e-3));
    }
    let ahead_ms = at_ms.saturating_sub(now_ms);
    if ahead_ms > AHEAD_MS {
        return Err(NotTaken::Ahead(ahead_ms as f64 * 1e-3));
    }
    let read = place(&message, site)?;
    // A place that cannot be is said before anything else changes.
    if let Some((at, _)) = read.gaussian()? {
        near(at, site)?;
    }
    Ok(Reading { card: hash(id(&message.id)?), ago_s: ago_ms as f64 * 1e-3, read })
}

fn place(message: &Message, site: &Site) -> Result<Read, NotTaken> {
    let Message { reader, u, v, x, y, sigma_m, .. } = message;
    let reads = match reader {
        None => None,
        Some(name) => {
            let reader = site.readers.iter().find(|reader| reader.name == *name);
            Some(reader.ok_or_else(|| NotTaken::NoReader(name.clone()))?.reads)
        }
    };
    match (reads, (u, v), (x, y), sigma_m) {
        (None, (None, None), (None, None), None) => Ok(Read::Somewhere),
        (None, (None, None), (Some(x), Some(y)), sigma_m) => {
            Ok(round(Point::new(*x, *y), sigma_m.unwrap_or(SIGMA_M)))
        }
        (Some(Reads::Near { at, reach_m }), (None, None), (None, None), None) => {
            Ok(Read::Near { at, reach_m })
        }
        (Some(reads @ Reads::Pixels { sigma_m, .. }), (Some(u), Some(v)), (None, None), own) => {
            let floor = reads.floor(*u, *v);
            let at = floor.ok_or_else(|| NotTaken::NoPlace(format!("pixel ({u}, {v}) shows no floor")))?;
            Ok(round(at, own.unwrap_or(sigma_m)))
        }
        (Some(Reads::Pixels { .. }), ..) => Err(malformed("a camera's reading has u and v, and no x and y")),
        (Some(Reads::Near { .. }), ..) => {
            Err(malformed("this reader has its place in the site: name it alone"))
        }
        (None, ..) => {
            Err(malformed("a place is x and y together, with or without sigma_m; u and v need a reader"))
        }
    }
}

/// What is read far beside the site is no sign of anybody in it: most likely its numbers are no metres.
fn near(at: Point, site: &Site) -> Result<(), NotTaken> {
    let away_m = beside_m(site, at);
    if away_m > BESIDE_M {
        let Point { x, y } = at;
        return Err(NotTaken::NoPlace(format!(
            "({x:.1}, {y:.1}) is {away_m:.0} m beside the site, at most {BESIDE_M}: x and y are metres of its plan"
        )));
    }
    Ok(())
}

fn round(at: Point, sigma_m: f64) -> Read {
    // A negative spread must not become a positive variance.
    let variance_m2 = sigma_m * sigma_m.abs();
    Read::Place { at, covariance_m2: [variance_m2, 0.0, variance_m2] }
}

fn malformed(what: &str) -> NotTaken {
    NotTaken::Malformed(what.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const NOW_MS: u64 = 1_700_000_000_000;

    const SITE: &str = "
[[reader]]
name = \"hall\"
x = 1.0
y = 0.2
reach_m = 0.8

[[reader]]
name = \"camera\"
homography = [0.01, 0, -3.2, 0, 0.012, 0.4, 0, 0.0002, 1]
sigma_m = 0.1
";

    fn taken(text: &str) -> Result<Reading, NotTaken> {
        let site = Site::parse("x.toml", SITE).unwrap();
        read(text.as_bytes(), &site, NOW_MS, |id| Card(id.len() as u128))
    }

    #[test]
    fn each_way_of_saying_where_is_read() {
        let read = |text: &str| taken(text).unwrap().read;
        assert_eq!(read(r#"{"id":"a"}"#), Read::Somewhere);
        let near = Read::Near { at: Point::new(1.0, 0.2), reach_m: 0.8 };
        assert_eq!(read(r#"{"id":"a","reader":"hall"}"#), near);
        let place = |x, y, sigma_m| round(Point::new(x, y), sigma_m);
        assert_eq!(read(r#"{"id":"a","x":1,"y":2}"#), place(1.0, 2.0, SIGMA_M));
        assert_eq!(read(r#"{"id":"a","x":1,"y":2,"sigma_m":0.5}"#), place(1.0, 2.0, 0.5));
        assert_eq!(read(r#"{"id":"a","reader":"camera","u":420,"v":0}"#), place(1.0, 0.4, 0.1));
        let sign = taken(&format!(r#"{{"id":" ab ","at_ms":{}}}"#, NOW_MS - 1500)).unwrap();
        assert_eq!((sign.card, sign.ago_s), (Card(2), 1.5));
        // Characters count, not bytes.
        assert_eq!(id(&"鍵".repeat(ID_MAX)).unwrap().len(), 3 * ID_MAX);
        assert!(id(&"a".repeat(ID_MAX + 1)).is_err());
        let ahead = taken(&format!(r#"{{"id":"a","at_ms":{}}}"#, NOW_MS + 400)).unwrap();
        assert_eq!(ahead.ago_s, 0.0);
    }

    #[test]
    fn what_is_wrong_is_named() {
        let said = |text: &str| taken(text).unwrap_err().to_string();
        assert!(said("tag").starts_with("malformed: expected"));
        assert!(said("{}").contains("missing field `id`"));
        assert!(said(r#"{"id":" "}"#).contains("1 to 128 characters"));
        assert!(said(r#"{"id":"--"}"#).contains("a letter or a digit"));
        assert!(said(r#"{"id":"a","z":1}"#).contains("unknown field `z`"));
        assert!(said(r#"{"id":"a","x":1}"#).contains("x and y together"));
        assert!(said(r#"{"id":"a","u":1,"v":1}"#).contains("need a reader"));
        assert!(said(r#"{"id":"a","reader":"hall","x":1,"y":1}"#).contains("name it alone"));
        assert!(said(r#"{"id":"a","reader":"camera"}"#).contains("has u and v"));
        assert_eq!(said(r#"{"id":"a","reader":"attic"}"#), "there is no reader \"attic\" in the site");
        assert!(said(r#"{"id":"a","x":1e9,"y":0}"#).starts_with("no place: 1000000000 is no place"));
        // Millimetres; and a pixel far beside the camera's image.
        assert_eq!(
            said(r#"{"id":"a","x":1200,"y":200}"#),
            "no place: (1200.0, 200.0) is 1216 m beside the site, at most 100: x and y are metres of its plan"
        );
        assert!(said(r#"{"id":"a","reader":"camera","u":42000,"v":0}"#).contains("m beside the site"));
        assert!(said(r#"{"id":"a","x":1e999,"y":0}"#).starts_with("malformed: number out of range"));
        assert!(said(r#"{"id":"a","x":0,"y":0,"sigma_m":-1}"#).starts_with("no place: its spread"));
        assert!(said(r#"{"id":"a","x":0,"y":0,"sigma_m":101}"#).starts_with("no place: its spread"));
        assert!(said(r#"{"id":"a","reader":"camera","u":0,"v":-5000}"#).contains("shows no floor"));
        assert!(
            said(&format!(r#"{{"id":"a","at_ms":{}}}"#, NOW_MS - 2001))
                .starts_with("late: it was read 2.0 s")
        );
        assert!(said(&format!(r#"{{"id":"a","at_ms":{}}}"#, NOW_MS + 900)).contains("0.9 s ahead"));
        assert!(said(&" ".repeat(2000)).contains("longer than"));
    }

    proptest! {
        #[test]
        fn whatever_bytes_come_nothing_panics(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            let _ = read(&bytes, &Site::default(), NOW_MS, |_| Card(0));
        }
    }
}
