//! The store in flash: records of a map that moves round the pages, so that they wear evenly.
//!
//! ```text
//!   page 0 (full)     │ boot 1 │ settings │ boot 2 │ chunk │ chunk │ …
//!   page 1 (in use)   │ boot 3 │ commit │ settings │            the newest of a key counts
//!   page 2 (erased)   │
//! ```
//!
//! `sequential-storage` writes an item, then its header's checksum makes it count; a page that is to be erased
//! first has its living items copied. A loss of power in between is repaired at the next access.

use core::ops::Range;

use embedded_storage_async::nor_flash::NorFlash;
use heapless::Vec;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage};

use super::cooperative::Cooperative;
use super::{KEYS, LABEL, RESET};
use crate::link::{RECORD_MAX, Store, StoreError};
use crate::seal::Keyring;
use crate::seal::keyring::KEYS_BYTES;
use crate::update::slots::Slots;

/// Room for a record, its key, and the padding of the largest word.
const BUFFER: usize = RECORD_MAX + 1 + 32;

/// Places at which a record is stored until it is read as it was written.
const TRIES: usize = 4;

/// Records that say whose device it is: they outlive the erasure of a store that cannot be repaired.
const KEPT: [u8; 2] = [KEYS, LABEL];

type Map<F> = MapStorage<u8, Cooperative<F>, Cache<Uncached, Uncached, Uncached, u8>>;

/// Records in flash. Other tasks run while it is searched.
pub struct FlashStore<F: NorFlash> {
    map: Map<F>,
    buffer: [u8; BUFFER],
    slots: Option<&'static Slots>,
}

impl<F: NorFlash> FlashStore<F> {
    /// The store in this range of `flash`, whole pages, at least two. None for a range that is not that.
    #[must_use]
    pub fn new(flash: F, range: Range<u32>) -> Option<Self> {
        let config = MapConfig::try_new(range).ok()?;
        Some(Self {
            map: MapStorage::new(Cooperative::new(flash), config, Cache::new_uncached()),
            buffer: [0; BUFFER],
            slots: None,
        })
    }

    /// The same, with slots for images on the same flash: there is a boot loader that knows them.
    #[must_use]
    pub const fn with_slots(mut self, slots: Option<&'static Slots>) -> Self {
        self.slots = slots;
        self
    }

    /// The flash, and where images are on it.
    pub(super) const fn slots(&mut self) -> Option<(&mut F, &'static Slots)> {
        match self.slots {
            Some(slots) => Some((self.map.flash().flash(), slots)),
            None => None,
        }
    }

    /// Gives the flash back.
    pub fn into_flash(self) -> F {
        self.map.destroy().0.into_flash()
    }
}

impl<F: NorFlash> Store for FlashStore<F> {
    async fn load(&mut self, key: u8, buffer: &mut [u8]) -> Result<Option<usize>, StoreError> {
        match self.map.fetch_item::<&[u8]>(&mut self.buffer, &key).await {
            Ok(None) => Ok(None),
            Ok(Some(record)) => {
                let place = buffer.get_mut(..record.len()).ok_or(StoreError)?;
                place.copy_from_slice(record);
                Ok(Some(record.len()))
            }
            Err(_) => Err(StoreError),
        }
    }

    async fn save(&mut self, key: u8, record: &[u8]) -> Result<(), StoreError> {
        if record.len() > RECORD_MAX {
            return Err(StoreError);
        }
        for _ in 0..TRIES {
            let stored = self.map.store_item(&mut self.buffer, &key, &record).await;
            if matches!(stored, Err(sequential_storage::Error::Corrupted { .. })) {
                break;
            }
            stored.map_err(|_| StoreError)?;
            // What is written over a word that was not erased is spoiled, and the flash does not say so.
            let found = self.map.fetch_item::<&[u8]>(&mut self.buffer, &key).await;
            if matches!(found, Ok(Some(found)) if found == record) {
                return Ok(());
            }
        }
        // Memory that was never a store, or is damaged beyond repair or in many words: it is erased, and all other records are lost. That is
        // an error, though this one is stored. But for those that say whose device it is: without its keys any host could ask.
        let mut kept: [Vec<u8, KEYS_BYTES>; KEPT.len()] = [const { Vec::new() }; KEPT.len()];
        for (kept_key, kept) in KEPT.into_iter().zip(&mut kept) {
            let found = self.map.fetch_item::<&[u8]>(&mut self.buffer, &kept_key).await;
            let record = found.map_or(&Keyring::UNREADABLE[..], |record| record.unwrap_or(&[]));
            let too_long = |_| Vec::from_slice(&Keyring::UNREADABLE);
            *kept = Vec::from_slice(record).or_else(too_long).unwrap_or_default();
        }
        // A power cut between the erasure and the keys would leave none, and open the device. One that has keys, or whose keys cannot be
        // read, is erased only for the reset that the board's button has asked for: that one is to open it.
        let opens = key == RESET || key == KEYS && record.is_empty();
        if !opens && kept.first().is_some_and(|keys| !keys.is_empty()) {
            return Err(StoreError);
        }
        self.map.erase_all().await.map_err(|_| StoreError)?;
        let kept = KEPT.into_iter().zip(kept.iter().map(Vec::as_slice));
        for (key, record) in kept.filter(|(_, record)| !record.is_empty()).chain([(key, record)]) {
            self.map.store_item(&mut self.buffer, &key, &record).await.map_err(|_| StoreError)?;
        }
        Err(StoreError)
    }
}
