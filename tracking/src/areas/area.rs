//! What was heard of one area: its last frame, its site, since when it is missed.

use super::fields::Fields;
use super::{AreaFrame, SILENT_US, Taken};
use crate::site::Site;

/// An area.
#[derive(Debug, Default)]
pub(super) struct Area {
    pub site: Option<Site>,
    /// Its tracker uses another site than this by now, which it has not said yet.
    pub is_site_old: bool,
    pub last: Option<AreaFrame>,
    pub fields: Fields,
    pub heard_us: u64,
    pub is_gone: bool,
    /// Since when it is not heard, or has not said its site, ms since 1970.
    pub missed_since_ms: Option<u64>,
    /// Since when it is heard without its site, µs.
    pub unsited_us: Option<u64>,
    /// When a frame of an earlier start than the one before was heard last, and when the last of two such, µs.
    pub earlier_us: Option<u64>,
    pub shared_us: Option<u64>,
    /// Since when two trackers have its name, ms since 1970.
    pub shared_since_ms: Option<u64>,
}

impl Area {
    /// What it has said last, if it is heard.
    pub fn said(&self, now_us: u64) -> Option<&AreaFrame> {
        let is_heard = !self.is_gone && now_us.saturating_sub(self.heard_us) <= SILENT_US;
        self.last.as_ref().filter(|_| is_heard)
    }

    /// Whether it is heard, and has said the site that it uses: without that, which of its zones are counted is not known.
    pub fn is_known(&self, now_us: u64) -> bool {
        self.said(now_us).is_some() && self.site.is_some() && !self.is_site_old
    }

    /// Takes what it says; a frame that is older than the last one of the same start is left out.
    pub fn hear(&mut self, mut frame: AreaFrame, now_us: u64) -> Taken {
        self.note_start(frame.epoch, now_us);
        let is_old = |last: &AreaFrame| last.epoch == frame.epoch && last.number >= frame.number;
        if self.last.as_ref().is_some_and(is_old) {
            return Taken::Late;
        }
        self.fields.unpack(&mut frame, now_us);
        (self.last, self.heard_us, self.is_gone) = (Some(frame), now_us, false);
        Taken::News
    }

    /// Notes since when it is missed, and since when two trackers have its name.
    pub fn note_time(&mut self, now_us: u64, unix_ms: u64) {
        let is_heard = self.said(now_us).is_some();
        let is_unsited = is_heard && self.site.is_none();
        self.unsited_us = is_unsited.then(|| self.unsited_us.unwrap_or(now_us));
        // Its site is asked for once it is heard: the answer takes a moment.
        if is_heard && !is_unsited {
            self.missed_since_ms = None;
        } else if !is_lately(self.unsited_us, now_us) {
            self.missed_since_ms.get_or_insert(unix_ms);
        }
        if is_lately(self.shared_us, now_us) {
            self.shared_since_ms.get_or_insert(unix_ms);
        } else {
            self.shared_since_ms = None;
        }
    }

    /// Notes of which start a frame is. A tracker that is started anew does not go on with its earlier start: one frame of that may have
    /// been held up on its way, a second one between later ones is of another tracker with the same name.
    fn note_start(&mut self, epoch: u64, now_us: u64) {
        if self.last.as_ref().is_none_or(|last| last.epoch <= epoch) {
            return;
        }
        if is_lately(self.earlier_us, now_us) {
            self.shared_us = Some(now_us);
        }
        self.earlier_us = Some(now_us);
    }
}

fn is_lately(at_us: Option<u64>, now_us: u64) -> bool {
    at_us.is_some_and(|at_us| now_us.saturating_sub(at_us) <= SILENT_US)
}
