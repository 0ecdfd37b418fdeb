//! What modules see empty, on its way from an area: in every fifth frame. It is most of the bytes, and slow to change.
//!
//! ```text
//!   frame number   5   6  7  8  9   10
//!   what is empty  ■   ·  ·  ·  ·   ■      · as the last one said, for two seconds at most
//! ```

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use super::{AreaFrame, SILENT_US};
use crate::snapshot::Snapshot;

/// Frames from one that says it to the next: half a second, as on the map.
const EVERY: u64 = 5;

const fn says_it(number: u64) -> bool {
    number.is_multiple_of(EVERY)
}

/// A frame as it is sent under this number: with all corners, or none.
#[must_use]
pub fn packed(frame: &Snapshot, number: u64) -> Cow<'_, Snapshot> {
    if says_it(number) { Cow::Borrowed(frame) } else { Cow::Owned(frame.without_free()) }
}

/// What an area has said last of it.
#[derive(Debug, Default)]
pub(super) struct Fields {
    /// By the module's name.
    free: BTreeMap<String, Arc<Vec<[f64; 2]>>>,
    epoch: u64,
    said_us: u64,
}

impl Fields {
    /// Puts into a frame that does not say it what was said last, if that is not old.
    pub(super) fn unpack(&mut self, said: &mut AreaFrame, now_us: u64) {
        let modules = &mut said.frame.modules;
        if says_it(said.number) {
            self.free =
                modules.iter().map(|module| (module.name.clone(), Arc::clone(&module.free))).collect();
            (self.epoch, self.said_us) = (said.epoch, now_us);
        } else if self.epoch == said.epoch && now_us.saturating_sub(self.said_us) <= SILENT_US {
            for module in modules {
                if let Some(free) = self.free.get(&module.name) {
                    module.free = Arc::clone(free);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::snapshot::ModuleLine;

    const CORNER: [f64; 2] = [1.23, -4.57];

    fn said(epoch: u64, number: u64) -> AreaFrame {
        let module = ModuleLine { name: "left".into(), free: vec![CORNER].into(), ..ModuleLine::default() };
        let frame = Snapshot { modules: vec![module], ..Snapshot::default() };
        AreaFrame { epoch, number, frame: packed(&frame, number).into_owned() }
    }

    fn unpacked(fields: &mut Fields, epoch: u64, number: u64, now_us: u64) -> Vec<[f64; 2]> {
        let mut said = said(epoch, number);
        fields.unpack(&mut said, now_us);
        said.frame.modules[0].free.to_vec()
    }

    #[test]
    fn between_two_frames_that_say_it_the_last_one_counts() {
        let mut fields = Fields::default();
        assert_eq!(unpacked(&mut fields, 1, 4, 0), [[0.0; 2]; 0]);
        for number in 5..9 {
            assert_eq!(unpacked(&mut fields, 1, number, number * 100_000), [CORNER]);
        }
        assert!(said(1, 7).frame.modules[0].free.is_empty(), "most frames are short");
    }

    #[test]
    fn what_was_said_long_ago_or_before_a_restart_is_not_known() {
        let mut fields = Fields::default();
        assert_eq!(unpacked(&mut fields, 1, 5, 0), [CORNER]);
        assert_eq!(unpacked(&mut fields, 1, 6, SILENT_US), [CORNER]);
        assert_eq!(unpacked(&mut fields, 1, 7, SILENT_US + 1), [[0.0; 2]; 0]);
        assert_eq!(unpacked(&mut fields, 1, 10, SILENT_US + 2), [CORNER]);
        assert_eq!(unpacked(&mut fields, 2, 11, SILENT_US + 3), [[0.0; 2]; 0]);
    }
}
