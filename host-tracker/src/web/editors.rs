//! Who has the map's editor open.
//!
//! ```text
//!   anna   ─{"editing": true}─▶ ┐            ┌─▶ {"editors": [{"name": "ben"}, {"name": null}]}
//!   ben    ─{"editing": true}─▶ ├─ the open ─┼─▶ {"editors": [{"name": "anna"}, {"name": null}]}
//!   a page ─{"editing": true}─▶ ┘   editors  └─▶ each is told of the others, whenever they are others
//! ```
//!
//! An editor is open from the message on until it is closed, the right is lost, or the connection ends; one that just
//! falls silent ends by the pings of [`super::socket`].

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;
use tokio::sync::watch;

use crate::access::Who;

/// Another open editor.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct OtherEditor {
    /// The user or program that has it open; null if not known by name.
    pub name: Option<String>,
}

/// The open editors, in the order in which they were opened.
#[derive(Debug)]
pub struct Editors(watch::Sender<Open>);

#[derive(Debug, Default)]
struct Open {
    next: u64,
    editors: BTreeMap<u64, OtherEditor>,
}

impl Default for Editors {
    fn default() -> Self {
        Self(watch::Sender::new(Open::default()))
    }
}

impl Editors {
    /// One more, until it is dropped.
    pub fn open(&self, who: &Who) -> Editing {
        let name = match who {
            Who::Person { name, .. } | Who::Program { name, .. } => Some(name.clone()),
            Who::Anybody | Who::Nobody => None,
        };
        let mut number = 0;
        self.0.send_modify(|open| {
            number = open.next;
            open.next += 1;
            open.editors.insert(number, OtherEditor { name });
        });
        let mut changes = self.0.subscribe();
        // What is there already is news for this one.
        changes.mark_changed();
        Editing { number, editors: self.0.clone(), changes, told: None }
    }
}

/// An open editor.
#[derive(Debug)]
pub struct Editing {
    number: u64,
    editors: watch::Sender<Open>,
    changes: watch::Receiver<Open>,
    told: Option<Vec<OtherEditor>>,
}

impl Editing {
    /// The others, once, and whenever they are others.
    pub async fn others(&mut self) -> Vec<OtherEditor> {
        loop {
            // This one holds a sender: it does not end.
            let _ = self.changes.changed().await;
            let open = self.changes.borrow_and_update();
            let others = open.editors.iter().filter(|(number, _)| **number != self.number);
            let others: Vec<OtherEditor> = others.map(|(_, editor)| editor.clone()).collect();
            drop(open);
            if self.told.as_ref() != Some(&others) {
                self.told = Some(others.clone());
                return others;
            }
        }
    }
}

impl Drop for Editing {
    fn drop(&mut self) {
        self.editors.send_modify(|open| {
            open.editors.remove(&self.number);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::access::roles::Role;

    /// What one is told now, if anything.
    fn told(editing: &mut Editing) -> Option<Vec<Option<String>>> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build().unwrap();
        let soon = std::time::Duration::from_millis(1);
        let others = runtime.block_on(async { tokio::time::timeout(soon, editing.others()).await.ok() })?;
        Some(others.into_iter().map(|other| other.name).collect())
    }

    #[test]
    fn each_is_told_of_the_others_once_and_when_they_go() {
        let editors = Editors::default();
        let person = |name: &str| Who::Person { name: name.into(), role: Role::Edit };
        let mut anna = editors.open(&person("anna"));
        assert_eq!(told(&mut anna), Some(vec![]));
        assert_eq!(told(&mut anna), None, "nothing has changed");
        let mut ben = editors.open(&person("ben"));
        let window = editors.open(&Who::Anybody);
        assert_eq!(told(&mut anna), Some(vec![Some("ben".into()), None]));
        assert_eq!(told(&mut ben), Some(vec![Some("anna".into()), None]));
        drop(window);
        drop(anna);
        assert_eq!(told(&mut ben), Some(vec![]));
        assert_eq!(told(&mut ben), None);
    }
}
