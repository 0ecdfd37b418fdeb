//! What is wrong with the tracker itself, kept where whoever finds out can say it and every frame tells it.
//!
//! ```text
//!   database, recording ── set("database", "disk is full") ──▶ Trouble ──▶ Frame.alarms
//! ```

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use crate::frame::AlarmLine;

/// A shared list. Clones are the same list.
#[derive(Clone, Debug, Default)]
pub struct Trouble(Arc<Mutex<BTreeMap<String, String>>>);

impl Trouble {
    /// What is wrong with `name`, in words; empty: nothing is.
    pub fn set(&self, name: &str, text: &str) {
        let mut list = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if text.is_empty() {
            list.remove(name);
        } else if list.get(name).is_none_or(|known| known != text) {
            list.insert(name.to_owned(), text.to_owned());
        }
    }

    /// All of it, by name.
    #[must_use]
    pub fn lines(&self) -> Vec<AlarmLine> {
        let list = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        list.iter().map(|(name, text)| AlarmLine { name: name.clone(), text: text.clone() }).collect()
    }
}
