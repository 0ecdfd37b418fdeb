//! What the tasks say in a board's log; on a PC nothing.

use crate::sensor::SensorState;

/// The sensor's state has changed.
pub(super) fn sensor(state: SensorState) {
    #[cfg(feature = "defmt")]
    defmt::info!("sensor {}", state);
    #[cfg(not(feature = "defmt"))]
    let _ = state;
}

/// A scan has become report number `sequence`, which is on its way.
pub(super) fn report(sequence: u32) {
    #[cfg(feature = "defmt")]
    if sequence == 1 {
        defmt::info!("first report");
    }
    #[cfg(not(feature = "defmt"))]
    let _ = sequence;
}

/// Reading number `sequence` of a floor is on its way.
pub(super) fn reading(sequence: u32) {
    #[cfg(feature = "defmt")]
    if sequence == 1 {
        defmt::info!("first reading");
    }
    #[cfg(not(feature = "defmt"))]
    let _ = sequence;
}
