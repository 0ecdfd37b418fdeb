//! Debouncing, stuck and dead panels.

use std::vec::Vec;

use super::*;

const COLUMNS: u8 = 5;

fn reading(down: &[(usize, usize)]) -> Vec<u8> {
    let mut bits = Bits::default();
    down.iter().for_each(|&(column, row)| bits.set(row * usize::from(COLUMNS) + column, true));
    bits.bytes(15).to_vec()
}

fn floor() -> Floor {
    Floor::new(COLUMNS, 3).unwrap()
}

fn is_down(floor: &Floor, column: usize, row: usize) -> bool {
    floor.pressed().get(row * usize::from(COLUMNS) + column)
}

#[test]
fn a_floor_has_as_many_panels_as_fit() {
    assert!(Floor::new(0, 4).is_none() && Floor::new(33, 32).is_none());
    assert_eq!(Floor::new(32, 32).unwrap().panels(), PANELS);
    assert_eq!(floor().read(&[0; 3]), Err(WrongLength));
    assert_eq!(floor().read(&[]), Err(WrongLength));
}

#[test]
fn a_step_counts_from_its_second_reading_and_a_flicker_never() {
    let mut floor = floor();
    let step = reading(&[(2, 1)]);
    floor.read(&step).unwrap();
    assert!(!is_down(&floor, 2, 1));
    floor.read(&step).unwrap();
    assert!(is_down(&floor, 2, 1) && !is_down(&floor, 1, 1));
    floor.read(&reading(&[(0, 0)])).unwrap();
    floor.read(&step).unwrap();
    assert!(is_down(&floor, 2, 1) && !is_down(&floor, 0, 0), "one reading of another kind");
    floor.read(&reading(&[])).unwrap();
    floor.read(&reading(&[])).unwrap();
    assert_eq!((floor.pressed(), floor.sequence()), (Bits::default(), 6));
}

#[test]
fn a_panel_that_stays_down_for_an_hour_is_stuck_until_it_changes() {
    let mut floor = floor();
    let stuck = reading(&[(4, 2)]);
    for _ in 0..u32::from(STUCK_READINGS) {
        floor.read(&stuck).unwrap();
    }
    assert!(is_down(&floor, 4, 2));
    (0..2).for_each(|_| floor.read(&stuck).unwrap());
    assert!(!is_down(&floor, 4, 2));
    assert_eq!(floor.faulty().collect::<Vec<_>>(), [(14, Fault::Stuck)]);
    (0..2).for_each(|_| floor.read(&reading(&[])).unwrap());
    assert_eq!(floor.faulty().count(), 0);
    (0..2).for_each(|_| floor.read(&stuck).unwrap());
    assert!(is_down(&floor, 4, 2), "it works again");
}

#[test]
fn a_panel_that_every_sole_passes_over_is_dead_until_it_goes_down() {
    let mut floor = floor();
    let walk = |floor: &mut Floor, times: u8| {
        for _ in 0..times {
            (0..2).for_each(|_| floor.read(&reading(&[(1, 1), (3, 1)])).unwrap());
            (0..2).for_each(|_| floor.read(&reading(&[])).unwrap());
        }
    };
    walk(&mut floor, DEAD_TIMES - 1);
    assert_eq!(floor.faulty().count(), 0);
    walk(&mut floor, 1);
    assert_eq!(floor.faulty().collect::<Vec<_>>(), [(7, Fault::Dead)]);
    (0..2).for_each(|_| floor.read(&reading(&[(2, 1)])).unwrap());
    assert_eq!(floor.faulty().count(), 0);
    let mut standing = floor.clone();
    for _ in 0..500 {
        standing.read(&reading(&[(1, 1), (3, 1)])).unwrap();
    }
    assert_eq!(standing.faulty().count(), 0, "two feet that stand astride are one time");
}

#[test]
fn a_panel_larger_than_a_sole_is_not_dead_for_two_feet_astride() {
    let mut floor = Floor::coarse(COLUMNS, 3).unwrap();
    for _ in 0..2 * DEAD_TIMES {
        (0..2).for_each(|_| floor.read(&reading(&[(1, 1), (3, 1)])).unwrap());
        (0..2).for_each(|_| floor.read(&reading(&[])).unwrap());
    }
    assert_eq!(floor.faulty().count(), 0);
}

#[test]
fn the_end_of_a_row_has_no_neighbour_in_the_next() {
    let mut floor = floor();
    for _ in 0..40 {
        (0..2).for_each(|_| floor.read(&reading(&[(3, 0), (0, 1)])).unwrap());
        (0..2).for_each(|_| floor.read(&reading(&[])).unwrap());
    }
    assert_eq!(floor.faulty().count(), 0);
}
