//! The number of a start, where flash is worn.

use embassy_futures::block_on;

use super::start;
use crate::link::{Store, StoreError};

/// Reads the number 7 and nothing else; writes nothing.
struct Worn;

impl Store for Worn {
    async fn load(&mut self, key: u8, out: &mut [u8]) -> Result<Option<usize>, StoreError> {
        if key != super::BOOT {
            return Ok(None);
        }
        out.iter_mut().zip(7_u32.to_le_bytes()).for_each(|(place, byte)| *place = byte);
        Ok(Some(4))
    }

    async fn save(&mut self, _: u8, _: &[u8]) -> Result<(), StoreError> {
        Err(StoreError)
    }
}

#[test]
fn a_start_that_cannot_be_counted_has_a_number_of_its_own() {
    let first = block_on(start(&mut Worn, 0x8000_1234));
    assert_eq!((first.boot, first.failed), (0x8000_1234, true));
    assert_eq!(block_on(start(&mut Worn, 0x8000_5678)).boot, 0x8000_5678);
}
