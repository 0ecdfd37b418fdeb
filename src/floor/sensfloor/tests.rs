//! Frames, triangles and panels of a SensFloor.

use std::vec::Vec;

use proptest::prelude::*;

use super::frame::encode;
use super::*;

const GROUP: u16 = 10;
/// After so long a line is still.
const STILL_US: u64 = GAP_US + 1;
const REST: [u8; TRIANGLES] = [127, 128, 127, 128, 127, 128, 127, 128];

fn layout() -> Layout {
    Layout::new(GROUP, (1, 1), (3, 2)).unwrap()
}

fn frame(tile: (u8, u8), triangle: usize, value: u8) -> Frame {
    let mut values = REST;
    values[triangle] = value;
    Frame { group: GROUP, tile, values }
}

/// A floor of which every tile has been heard at rest, at 1 s.
fn floor() -> SensFloor {
    let mut floor = SensFloor::new(layout(), 0);
    for (x, y) in [(1, 1), (2, 1), (3, 1), (1, 2), (2, 2), (3, 2)] {
        floor.receive(&encode(&frame((x, y), 0, REST[0])), 1_000_000);
    }
    floor
}

/// Panels that are down, of what came until `now_us`.
fn down(floor: &mut SensFloor, now_us: u64) -> Vec<usize> {
    let reading = floor.reading(now_us + STILL_US).unwrap();
    (0..24).filter(|panel| reading.down.get(*panel)).collect()
}

#[test]
fn a_layout_has_at_most_64_tiles() {
    assert_eq!(Layout::new(0, (0, 0), (8, 8)).unwrap().panels(), (16, 16));
    assert_eq!(Layout::new(0, (0, 0), (64, 1)).unwrap().panels(), (128, 2));
    assert!(Layout::new(0, (245, 0), (7, 1)).is_some(), "tiles 245 to 251");
    for (first, size) in [((0, 0), (0, 3)), ((0, 0), (9, 8)), ((0, 0), (1, 65)), ((250, 0), (4, 1))] {
        assert_eq!(Layout::new(0, first, size), None, "{first:?} {size:?}");
    }
}

#[test]
fn a_triangle_is_the_panel_in_which_it_lies() {
    // Triangle 0 of tile (2, 1): panel (3, 1), with 6 in a row.
    let mut floor = floor();
    floor.receive(&encode(&frame((2, 1), 0, 160)), 1_070_000);
    assert_eq!(down(&mut floor, 1_070_000), [6 + 3]);
    for triangle in 0..TRIANGLES {
        let mut floor = self::floor();
        floor.receive(&encode(&frame((1, 2), triangle, 160)), 1_070_000);
        let panels = down(&mut floor, 1_070_000);
        let [panel] = panels[..] else { panic!("{triangle}: {panels:?}") };
        let (x, y) = ((panel % 6) as f64 - 0.5, (panel / 6) as f64 - 2.5);
        // The first is just right of the way up, and they go on clockwise.
        let clockwise = (x.atan2(y).to_degrees() + 360.0) % 360.0;
        let middle = 22.5 + 45.0 * triangle as f64;
        assert!((clockwise - middle).abs() < 30.0, "{triangle}: {clockwise}");
    }
}

#[test]
fn a_triangle_goes_down_at_eight_steps_and_up_below_four() {
    let mut triangle = Triangle::new(128);
    let mut took = |value| {
        triangle.take(value, 66_000);
        triangle.is_down(0)
    };
    assert!(!took(135) && took(137) && took(133) && !took(131) && !took(135));
}

#[test]
fn a_triangle_learns_its_rest_and_does_not_unlearn_it_under_a_foot() {
    let (mut beside, mut under) = (Triangle::new(140), Triangle::new(170));
    assert!(!beside.is_down(0), "some rest beside 128 for good");
    assert!(under.is_down(0), "a foot stood on it first");
    beside.take(149, 66_000);
    assert!(beside.is_down(0));
    // An hour of standing, ten frames a second.
    (0..36_000).for_each(|_| under.take(160, 100_000));
    assert!(under.is_down(0));
    under.take(128, 100_000);
    assert!(!under.is_down(0));
    // One that rests beside 128 and is first heard under a foot is up again soon after it has left.
    let mut offset = Triangle::new(160);
    offset.take(140, 66_000);
    assert!(offset.is_down(0), "it may be a light foot");
    (0..3).for_each(|_| offset.take(140, 600_000));
    assert!(!offset.is_down(0));
    offset.take(149, 66_000);
    assert!(offset.is_down(0));
    // It drifts by 20 steps within five minutes.
    let mut drifts = Triangle::new(128);
    for second in 0..300_u32 {
        drifts.take(128 + (second / 15) as u8, 1_000_000);
        assert!(!drifts.is_down(0), "{second} s");
    }
    // A swing below rest for half a second after a foot is not learned.
    let mut swings = Triangle::new(128);
    (0..8).for_each(|_| swings.take(90, 66_000));
    swings.take(131, 66_000);
    assert!(!swings.is_down(0));
    swings.take(137, 66_000);
    assert!(swings.is_down(0));
}

/// Frames in bytes that come at once, on a line that is still afterwards.
fn heard(reader: &mut FrameReader, bytes: &[u8], now_us: u64) -> Vec<Frame> {
    let mut frames: Vec<Frame> =
        bytes.iter().filter_map(|byte| Some(reader.push(*byte, now_us)?.0)).collect();
    frames.extend(reader.still(now_us + STILL_US).map(|(frame, _)| frame));
    frames
}

#[test]
fn a_frame_that_has_lost_bytes_and_the_next_ones_beginning_is_torn() {
    for lost in 1..FRAME_LEN {
        let mut bytes = encode(&frame((1, 1), 3, 150)).to_vec();
        bytes.remove(lost);
        bytes.extend(&encode(&frame((2, 1), 3, 150))[1..]);
        bytes.extend(encode(&frame((2, 2), 4, 150)));
        let mut reader = FrameReader::new();
        assert_eq!(heard(&mut reader, &bytes, 5), [frame((2, 2), 4, 150)], "byte {lost}");
        assert_eq!(reader.losses(), Losses { torn: 1, skipped: 32, others: 0 }, "byte {lost}");
    }
}

#[test]
fn a_torn_frame_costs_itself_and_no_other() {
    for lost in 0..FRAME_LEN {
        let mut bytes = encode(&frame((1, 1), 3, 150)).to_vec();
        bytes.remove(lost);
        bytes.extend(encode(&frame((2, 2), 4, 150)));
        let mut reader = FrameReader::new();
        assert_eq!(heard(&mut reader, &bytes, 5), [frame((2, 2), 4, 150)], "byte {lost}");
        let Losses { torn, skipped, .. } = reader.losses();
        assert_eq!((torn, skipped), (u32::from(lost > 0), 16), "byte {lost}");
    }
}

#[test]
fn a_frame_that_stands_still_has_lost_its_end() {
    let whole = encode(&frame((1, 1), 3, 150));
    let mut reader = FrameReader::new();
    assert!(whole[..9].iter().all(|byte| reader.push(*byte, 1_000).is_none()));
    assert_eq!(heard(&mut reader, &whole, 67_000), [frame((1, 1), 3, 150)]);
    assert_eq!(reader.losses(), Losses { torn: 1, skipped: 9, others: 0 });
}

#[test]
fn what_is_no_word_about_triangles_is_counted_and_left_out() {
    let mut floor = floor();
    for (at, value) in [(7, 4), (7, 1 << 5), (7, 1 << 7), (8, 1)] {
        let mut other = encode(&frame((1, 1), 3, 170));
        other[at] = value;
        floor.receive(&other, 1_010_000);
    }
    floor.receive(&encode(&Frame { group: 11, ..frame((1, 1), 3, 170) }), 1_010_000);
    floor.receive(&encode(&frame((4, 1), 3, 170)), 1_010_000);
    floor.receive(&encode(&frame((1, 0), 3, 170)), 1_010_000);
    assert_eq!(down(&mut floor, 1_010_000), [0; 0]);
    assert_eq!((floor.losses().others, floor.foreign()), (4, 3));
}

#[test]
fn a_silent_line_gives_no_reading_and_a_silent_tile_no_panels() {
    let mut floor = floor();
    assert_eq!(SensFloor::new(layout(), 0).reading(0), None, "nothing heard yet");
    assert!(floor.reading(2_000_000).is_some());
    assert_eq!(floor.reading(2_000_001), None);
    // Only one tile answers: after three rounds of six requests the others are unread.
    for tenth in 11..=28_u64 {
        floor.receive(&encode(&frame((3, 2), 0, REST[0])), tenth * 100_000);
    }
    assert_eq!(floor.reading(2_800_000).unwrap().unread, Bits::default());
    floor.receive(&encode(&frame((3, 2), 0, REST[0])), 2_850_000);
    let unread = floor.reading(2_850_000).unwrap().unread;
    assert_eq!((0..24).filter(|panel| unread.get(*panel)).count(), 20);
    assert!(!unread.get(2 * 6 + 4) && unread.get(2 * 6 + 3));
}

#[test]
fn each_tile_is_asked_in_its_turn() {
    let mut floor = SensFloor::new(layout(), 0);
    let asked: Vec<[u8; FRAME_LEN]> = (0..8).filter_map(|tenth| floor.ask(tenth * 100_000)).collect();
    let tiles: Vec<(u8, u8)> = asked.iter().map(|bytes| (bytes[3], bytes[4])).collect();
    assert_eq!(tiles, [(1, 1), (2, 1), (3, 1), (1, 2), (2, 2), (3, 2), (1, 1), (2, 1)]);
    assert_eq!(asked[0], [0xfd, 0, 10, 1, 1, 0, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(floor.ask(799_999), None);
    let mut echoed = self::floor();
    echoed.receive(&asked[0], 1_010_000);
    assert!(echoed.reading(1_010_000 + STILL_US).is_some());
    assert_eq!(echoed.losses().others, 1, "an adapter that echoes answers nothing");
}

#[test]
fn panels_of_an_unread_tile_are_not_up_but_unknown() {
    let mut panels = super::super::Floor::new(6, 4).unwrap();
    let mut unread = Bits::default();
    unread.set(5, true);
    panels.cannot_read(unread);
    panels.read(&[0; 3]).unwrap();
    assert_eq!(panels.faulty().collect::<Vec<_>>(), [(5, super::super::Fault::Dead)]);
    panels.cannot_read(Bits::default());
    assert_eq!(panels.faulty().count(), 0);
}

proptest! {
    /// Whatever stands between them, whole frames behind a gap arrive.
    #[test]
    fn garbage_hides_no_frame_behind_a_gap(garbage in prop::collection::vec(any::<u8>(), 0..200), seed: u8) {
        let mut floor = floor();
        floor.receive(&garbage, 1_001_000);
        let last = frame((2, 2), usize::from(seed) % 8, 160);
        floor.receive(&encode(&last), 1_067_000);
        prop_assert!(floor.reading(1_067_000).is_some());
        let of_tile = |panel: &usize| panel % 6 / 2 == 1 && panel / 12 == 1;
        prop_assert!(down(&mut floor, 1_067_000).iter().any(of_tile));
    }

    /// Every byte is part of a frame, or counted.
    #[test]
    fn every_byte_is_accounted_for(bytes in prop::collection::vec(prop_oneof![Just(0xfd_u8), any::<u8>()], 0..400)) {
        let mut reader = FrameReader::new();
        let frames = heard(&mut reader, &bytes, 0).len();
        reader.lost();
        let Losses { skipped, others, .. } = reader.losses();
        prop_assert_eq!(bytes.len(), FRAME_LEN * (frames + others as usize) + skipped as usize);
    }
}
