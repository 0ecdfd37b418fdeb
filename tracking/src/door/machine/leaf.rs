//! The leaf, as its contact reports it.

use crate::door::terms::Contact;

/// Whether it is shut, and since when.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Leaf {
    /// None: not reported yet.
    pub(super) contact: Option<Contact>,
    /// s.
    pub(super) since_s: f64,
    /// When it opened, or when the time for it to shut began anew, s.
    pub(super) open_since_s: Option<f64>,
}

impl Leaf {
    /// The contact says so at `now_s`.
    pub(super) fn report(&mut self, contact: Contact, now_s: f64) {
        if self.contact != Some(contact) {
            self.since_s = now_s;
            self.open_since_s = (contact == Contact::Open).then_some(now_s);
        }
        self.contact = Some(contact);
    }

    /// The time for it to shut begins anew.
    pub(super) fn begin_anew(&mut self, now_s: f64) {
        self.open_since_s = self.open_since_s.map(|_| now_s);
    }

    /// Whether it has been shut for `for_s`.
    pub(super) fn is_shut(&self, for_s: f64, now_s: f64) -> bool {
        self.contact == Some(Contact::Shut) && now_s - self.since_s >= for_s
    }
}
