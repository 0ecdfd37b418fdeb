//! The leaf, as its contact reports it. Before the first report it may be open, and counts as open. A person who goes in through one
//! that the contact calls shut reports it open, until the contact speaks again.
//!
//! ```text
//!   may be open: none, open        shut: only where the contact has said so
//! ```

use crate::door::terms::Contact;

/// Whether it is shut, and since when.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leaf {
    /// None: not reported yet.
    pub(super) contact: Option<Contact>,
    /// s.
    pub(super) since_s: f64,
    /// Since when it may be open, or when the time for it to shut began anew, s.
    pub(super) open_since_s: Option<f64>,
}

impl Leaf {
    /// Not reported yet.
    pub(super) const fn unknown() -> Self {
        Self { contact: None, since_s: 0.0, open_since_s: Some(0.0) }
    }

    /// The contact says so at `now_s`, or a person who goes in shows it.
    pub(super) fn report(&mut self, contact: Contact, now_s: f64) {
        if self.contact != Some(contact) {
            self.since_s = now_s;
        }
        self.open_since_s = match contact {
            Contact::Open => self.open_since_s.or(Some(now_s)),
            Contact::Shut => None,
        };
        self.contact = Some(contact);
    }

    /// Whether it may be open: it is, or nothing has been reported yet.
    pub(super) const fn may_be_open(&self) -> bool {
        !matches!(self.contact, Some(Contact::Shut))
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
