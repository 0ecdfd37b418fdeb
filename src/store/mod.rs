//! What survives a loss of power: the count of starts, the settings, the background, the sensor's speed.
//!
//! ```text
//!   record   0  boot        u32
//!            1  settings    text, as on the wire
//!            2  baud        u32: speed at which the sensor answered last
//!            3  background  slot u8, version u16, beams u16, fingerprint u32, sum u32, serial 16 u8
//!            4  trial       starts u8, the addressing before, text; empty: none
//!            5  keys        id u8, role u8, 32 bytes, each
//!            6  label       16 bytes: its secret
//!            7  reset       u32: a factory reset is under way if the last start had this number
//!    16 … 31  slot 0: chunks of the background      version u16, 170 beams of 6 bytes
//!    32 … 47  slot 1: the same
//!
//!   storing a background:  chunks into the slot that record 3 does not name … then record 3
//!   a factory reset:       record 7 … start: records 5, 1, 4, 2, 3, 16 … 47 empty, old ones overwritten … record 7 empty
//! ```
//!
//! Each record changes at once or not at all ([`Store`]). A background counts from the moment record 3 names
//! it; until then the old one does. Chunks that do not belong to it, or do not add up to its sum, are none.
//! A reset that was cut off is done at the next start, before anything else is read: what is found is as before it, or as
//! after it. Flash that decays may bring an old record 7 to light again: it names a start long past, and nothing follows.
//!
//! Flash of at least 32 KiB in pages of 8 KiB holds both backgrounds of 1081 beams beside everything else.

mod cooperative;
pub mod damaged;
pub mod flash;
mod images;
#[cfg(test)]
mod start_tests;

use core::ops::Range;

use embassy_futures::yield_now;

use crate::background::{BEAM_BYTES, Background, Fingerprint};
use crate::device::Settings;
use crate::device::trial::{TRIAL_BYTES, Trial};
use crate::link::{RECORD_MAX, Store, StoreError};
use crate::scan::MAX_BEAMS;
use crate::scip::Text;
use crate::seal::{Keyring, LABEL_BYTES};

const BOOT: u8 = 0;
const SETTINGS: u8 = 1;
const BAUD: u8 = 2;
const BACKGROUND: u8 = 3;
const TRIAL: u8 = 4;
/// The record of the keys: [`Keyring::bytes`].
pub const KEYS: u8 = 5;
const LABEL: u8 = 6;
const RESET: u8 = 7;
const CHUNKS: [u8; 2] = [16, 32];
/// The keys of all chunks.
const ALL_CHUNKS: Range<u8> = 16..48;

/// Records of the greatest length that go round all pages of a store, which is of 128 KiB on every board.
const ROUND: usize = 128 * 1024 / RECORD_MAX;

/// Beams of a chunk.
const CHUNK_BEAMS: usize = 170;
/// Bytes of the version in front of a chunk.
const CHUNK_HEAD: usize = 2;
const COMMIT_LEN: usize = 1 + 2 + 2 + 4 + 4 + 16;

const _: () = assert!(CHUNK_HEAD + CHUNK_BEAMS * BEAM_BYTES <= RECORD_MAX);
const _: () = assert!(MAX_BEAMS.div_ceil(CHUNK_BEAMS) <= 16);

/// Stored data at the start of a module.
#[derive(Clone, Debug)]
pub struct Start {
    /// Number of this start, from 1.
    pub boot: u32,
    /// The settings.
    pub settings: Settings,
    /// The stored address could not be used.
    pub address_unusable: bool,
    /// The trial of the settings' addressing.
    pub trial: Option<Trial>,
    /// The keys, and the label's.
    pub keyring: Keyring,
    /// Speed at which the sensor answered last.
    pub last_baud: Option<u32>,
    /// A factory reset was carried out.
    pub was_reset: bool,
    /// Something could not be read or written.
    pub failed: bool,
}

/// Carries out a factory reset that was begun, counts this start and reads the stored data of the module. If the count
/// cannot be read or stored, `boot` is `otherwise`: better a number that was not used before.
///
/// # Cancellation
/// The start may have been counted.
pub async fn start(store: &mut impl Store, otherwise: u32) -> Start {
    let mut start = Start {
        boot: otherwise.max(1),
        settings: Settings::new(),
        address_unusable: false,
        trial: None,
        keyring: Keyring::new(),
        last_baud: None,
        was_reset: false,
        failed: false,
    };
    let mut buffer = [0; RECORD_MAX];
    let mut before = 0;
    match store.load(BOOT, &mut buffer).await {
        Ok(length) => {
            before = number(record(&buffer, length)).unwrap_or(0);
            start.boot = before.checked_add(1).unwrap_or(1);
        }
        Err(StoreError) => start.failed = true,
    }
    match store.load(RESET, &mut buffer).await {
        Ok(length) if record(&buffer, length).first_chunk() == Some(&before.to_le_bytes()) => {
            start.was_reset = reset(store, before, &mut buffer).await.is_ok();
            start.failed |= !start.was_reset;
        }
        Ok(_) => {}
        Err(StoreError) => start.failed = true,
    }
    if store.save(BOOT, &start.boot.to_le_bytes()).await.is_err() {
        // The next start would count the same number again, and hosts would take it for this one.
        (start.boot, start.failed) = (otherwise.max(1), true);
    }
    match store.load(SETTINGS, &mut buffer).await {
        Ok(length) => {
            let restored = Settings::restored(record(&buffer, length));
            (start.settings, start.address_unusable) = (restored.settings, restored.address_unusable);
        }
        Err(StoreError) => start.failed = true,
    }
    match store.load(TRIAL, &mut buffer).await {
        Ok(length) => start.trial = Trial::from_bytes(record(&buffer, length)),
        Err(StoreError) => start.failed = true,
    }
    match store.load(BAUD, &mut buffer).await {
        Ok(length) => start.last_baud = number(record(&buffer, length)),
        Err(StoreError) => start.failed = true,
    }
    let keys = store.load(KEYS, &mut buffer).await;
    start.failed |= keys.is_err();
    start.keyring = Keyring::restored(keys.map(|length| record(&buffer, length)));
    match store.load(LABEL, &mut buffer).await {
        Ok(length) => label(record(&buffer, length)).iter().for_each(|label| start.keyring.set_label(label)),
        Err(StoreError) => start.failed = true,
    }
    start
}

/// Stores the secret of the device's label: once, when it is made.
///
/// # Errors
/// The store cannot be written.
///
/// # Cancellation
/// It may have been stored.
pub async fn save_label(store: &mut impl Store, label: &[u8; LABEL_BYTES]) -> Result<(), StoreError> {
    store.save(LABEL, label).await
}

/// Begins a factory reset: the next [`start`] erases everything but the number of the start before it, so that hosts that
/// know the module recognise it as a later one, and the label's secret, which opens the module again.
///
/// # Errors
/// The store cannot be written.
///
/// # Cancellation
/// It may have begun.
pub async fn begin_reset(store: &mut impl Store) -> Result<(), StoreError> {
    let mut begun = Err(StoreError);
    // A store beyond repair was erased for the first, and takes the second: the number of the last start is lost with it.
    for _ in 0..2 {
        let mut bytes = [0; 4];
        let length = store.load(BOOT, &mut bytes).await.unwrap_or(None);
        let last = number(record(&bytes, length)).unwrap_or(0);
        begun = store.save(RESET, &last.to_le_bytes()).await;
        if begun.is_ok() {
            break;
        }
    }
    begun
}

/// Carries out a reset that was begun after start `last`, from its beginning or where it was cut off. One that fails is
/// not tried again by the next start, which has another number: flash that does not work would keep the module from starting.
async fn reset(store: &mut impl Store, last: u32, buffer: &mut [u8; RECORD_MAX]) -> Result<(), StoreError> {
    // The keys first: they alone would outlive a store that is found to be beyond repair now.
    for key in [KEYS, SETTINGS, TRIAL, BAUD, BACKGROUND].into_iter().chain(ALL_CHUNKS) {
        // An empty record is none, and one that cannot be read gives way to one.
        if !matches!(store.load(key, buffer).await, Ok(None | Some(0))) {
            store.save(key, &[]).await?;
        }
    }
    // The old ones are in flash until their pages are erased. Each page is, by the time that as much has been written as
    // all of them hold; what is to stay is copied before.
    buffer.fill(0);
    buffer.iter_mut().zip(last.to_le_bytes()).for_each(|(place, byte)| *place = byte);
    for _ in 0..ROUND {
        store.save(RESET, buffer).await?;
    }
    store.save(RESET, &[]).await
}

/// Sets the next start's number to the one after `boot`: for a store lost between two starts, whose numbers must still
/// differ.
///
/// # Cancellation
/// It may have been stored.
///
/// # Errors
/// The store cannot be written.
pub async fn count_from(store: &mut impl Store, boot: u32) -> Result<(), StoreError> {
    store.save(BOOT, &boot.to_le_bytes()).await
}

/// What was loaded into `buffer`: empty if there is no such record.
fn record(buffer: &[u8], length: Option<usize>) -> &[u8] {
    buffer.get(..length.unwrap_or(0)).unwrap_or(&[])
}

/// A record that is the secret of a label.
fn label(record: &[u8]) -> Option<[u8; LABEL_BYTES]> {
    record.try_into().ok()
}

/// A record that is one number.
fn number(record: &[u8]) -> Option<u32> {
    record.try_into().ok().map(u32::from_le_bytes)
}

/// Stores the settings. Their addressing counts as it did before: new addressing comes with its trial, by
/// [`save_settings_on_trial`].
///
/// # Errors
/// [`StoreError`]: the old ones are still stored, or the new ones.
///
/// # Cancellation
/// As an error.
pub async fn save_settings(store: &mut impl Store, settings: &Settings) -> Result<(), StoreError> {
    store.save(SETTINGS, settings.text().as_bytes()).await
}

/// Stores the settings, and the trial of their addressing or its absence.
///
/// # Errors
/// [`StoreError`]: the old ones are still stored, or the new ones.
///
/// # Cancellation
/// As an error.
pub async fn save_settings_on_trial(
    store: &mut impl Store,
    settings: &Settings,
    trial: Option<Trial>,
) -> Result<(), StoreError> {
    // A trial that names the addressing in use is none: cut off between the two, nothing has changed.
    if let Some(trial) = trial {
        save_trial(store, &trial.bytes()).await?;
    }
    save_settings(store, settings).await?;
    let mut bytes = [0; TRIAL_BYTES];
    if trial.is_none() && store.load(TRIAL, &mut bytes).await?.is_some_and(|length| length > 0) {
        store.save(TRIAL, &[]).await?;
    }
    Ok(())
}

/// Stores the trial of the addressing that is stored: [`Trial::bytes`]. Not an `async fn`: each of those can panic once it is over.
///
/// # Errors
/// [`StoreError`]: the old one is still stored, or the new one.
///
/// # Cancellation
/// As an error.
pub fn save_trial<'a>(
    store: &'a mut impl Store,
    trial: &'a [u8],
) -> impl Future<Output = Result<(), StoreError>> + 'a {
    store.save(TRIAL, trial)
}

/// Stores the speed at which the sensor answered, if it is another one.
///
/// # Errors
/// [`StoreError`].
///
/// # Cancellation
/// The old one is still stored, or the new one.
pub async fn save_baud(store: &mut impl Store, rate_baud: u32) -> Result<(), StoreError> {
    let mut bytes = [0; 4];
    let length = store.load(BAUD, &mut bytes).await?;
    if number(record(&bytes, length)) == Some(rate_baud) {
        return Ok(());
    }
    store.save(BAUD, &rate_baud.to_le_bytes()).await
}

/// The record that makes chunks a background.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Commit {
    slot: bool,
    version: u16,
    beams: u16,
    fingerprint: u32,
    sum: u32,
    serial: Text<16>,
}

impl Commit {
    fn to_bytes(self) -> [u8; COMMIT_LEN] {
        let mut bytes = [0; COMMIT_LEN];
        let numbers = [u8::from(self.slot)]
            .into_iter()
            .chain(self.version.to_le_bytes())
            .chain(self.beams.to_le_bytes());
        let sums = self.fingerprint.to_le_bytes().into_iter().chain(self.sum.to_le_bytes());
        let all = numbers.chain(sums).chain(self.serial.as_str().bytes());
        bytes.iter_mut().zip(all).for_each(|(place, byte)| *place = byte);
        bytes
    }

    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let whole: &[u8; COMMIT_LEN] = bytes.try_into().ok()?;
        let (&[slot, v0, v1, b0, b1, f0, f1, f2, f3, s0, s1, s2, s3], serial) =
            whole.split_first_chunk::<13>()?;
        let length = serial.iter().position(|&byte| byte == 0).unwrap_or(serial.len());
        Some(Self {
            slot: slot != 0,
            version: u16::from_le_bytes([v0, v1]),
            beams: u16::from_le_bytes([b0, b1]),
            fingerprint: u32::from_le_bytes([f0, f1, f2, f3]),
            sum: u32::from_le_bytes([s0, s1, s2, s3]),
            serial: Text::new(serial.get(..length).unwrap_or(serial)),
        })
    }

    fn chunk_key(&self, chunk: u8) -> u8 {
        let [zero, one] = CHUNKS;
        (if self.slot { one } else { zero }).saturating_add(chunk)
    }

    /// First beam of each chunk.
    fn chunks(&self) -> impl Iterator<Item = (u8, usize)> + use<> {
        (0u8..).zip((0..usize::from(self.beams)).step_by(CHUNK_BEAMS))
    }
}

/// Stores a background and the serial number of its sensor. Others may run before every chunk.
///
/// # Errors
/// [`StoreError`]: the old one is still stored, or the new one.
///
/// # Cancellation
/// As an error.
pub async fn save_background<const BEAMS: usize>(
    store: &mut impl Store,
    background: &Background<BEAMS>,
    serial: Text<16>,
) -> Result<(), StoreError> {
    // An unreadable record names no slot that would have to be spared.
    let mut bytes = [0; COMMIT_LEN];
    let length = store.load(BACKGROUND, &mut bytes).await.unwrap_or(None);
    let old = Commit::from_bytes(record(&bytes, length));
    let mut commit = Commit {
        slot: !old.is_some_and(|old| old.slot),
        version: background.version(),
        beams: background.beams().min(MAX_BEAMS) as u16,
        fingerprint: background.fingerprint().0,
        sum: SUM_BEGIN,
        serial,
    };
    let mut record = [0; CHUNK_HEAD + CHUNK_BEAMS * BEAM_BYTES];
    for (chunk, first) in commit.chunks() {
        yield_now().await;
        let (head, beams) = record.split_at_mut(CHUNK_HEAD);
        head.iter_mut().zip(commit.version.to_le_bytes()).for_each(|(place, byte)| *place = byte);
        let written = background.store_part(first, beams);
        let bytes = record.get(..CHUNK_HEAD + written).unwrap_or(&record);
        commit.sum = sum(commit.sum, bytes);
        store.save(commit.chunk_key(chunk), bytes).await?;
    }
    yield_now().await;
    store.save(BACKGROUND, &commit.to_bytes()).await
}

/// Reads the background into `background`; returns the serial number of its sensor, or none if no background is
/// stored, or if it is damaged or larger than `background`. It is in use once it is bound to that sensor.
///
/// # Errors
/// [`StoreError`]; nothing is known then.
///
/// # Cancellation
/// Nothing is known.
pub async fn load_background<const BEAMS: usize>(
    store: &mut impl Store,
    background: &mut Background<BEAMS>,
) -> Result<Option<Text<16>>, StoreError> {
    let mut bytes = [0; COMMIT_LEN];
    let length = store.load(BACKGROUND, &mut bytes).await?;
    let commit = Commit::from_bytes(record(&bytes, length));
    let Some(commit) = commit.filter(|commit| usize::from(commit.beams) <= BEAMS) else {
        return Ok(None);
    };
    let whole = load_chunks(store, &commit, background).await;
    if !matches!(whole, Ok(true)) {
        background.forget();
        return whole.map(|_| None);
    }
    background.restored(usize::from(commit.beams), commit.version, Fingerprint(commit.fingerprint));
    Ok(Some(commit.serial))
}

/// Whether all chunks are present and belong to the commit.
async fn load_chunks<const BEAMS: usize>(
    store: &mut impl Store,
    commit: &Commit,
    background: &mut Background<BEAMS>,
) -> Result<bool, StoreError> {
    let mut record = [0; CHUNK_HEAD + CHUNK_BEAMS * BEAM_BYTES];
    let mut added = SUM_BEGIN;
    for (chunk, first) in commit.chunks() {
        let Some(length) = store.load(commit.chunk_key(chunk), &mut record).await? else { return Ok(false) };
        let bytes = record.get(..length).unwrap_or(&[]);
        added = sum(added, bytes);
        let (head, beams) = bytes.split_at_checked(CHUNK_HEAD).unwrap_or((&[], &[]));
        if head != commit.version.to_le_bytes() {
            return Ok(false);
        }
        background.restore_part(first, beams);
    }
    Ok(added == commit.sum)
}

const SUM_BEGIN: u32 = 0x811c_9dc5;

/// FNV-1a, 32 bits: shows whether chunks belong together.
fn sum(before: u32, bytes: &[u8]) -> u32 {
    bytes.iter().fold(before, |hash, byte| (hash ^ u32::from(*byte)).wrapping_mul(0x0100_0193))
}
