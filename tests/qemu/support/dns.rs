//! As much of multicast DNS as a test needs: a question, and what an announcement says.
//!
//! ```text
//!   header 12    id, flags, questions, answers, authorities, additional
//!   question     name, type 2, class 2
//!   answer       name, type 2, class 2, lifetime 4, length 2, data
//!   name         length, label, length, label, … 0          no compression: modules use none
//! ```

use std::collections::BTreeMap;

pub const GROUP: [u8; 4] = [224, 0, 0, 251];
pub const GROUP_MAC: [u8; 6] = [0x01, 0, 0x5e, 0, 0, 0xfb];
pub const PORT: u16 = 5353;

const A: u16 = 1;
const PTR: u16 = 12;
const TXT: u16 = 16;
const SRV: u16 = 33;

/// A module as it was announced.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Found {
    /// Instance name.
    pub name: String,
    pub address: [u8; 4],
    pub port: u16,
    pub txt: BTreeMap<String, String>,
}

/// An mDNS query for instances of `service`, such as `_kehai._udp.local`.
pub fn question(id: u16, service: &str) -> Vec<u8> {
    let mut message = [&id.to_be_bytes()[..], &[0, 0, 0, 1, 0, 0, 0, 0, 0, 0]].concat();
    for label in service.split('.') {
        message.push(label.len() as u8);
        message.extend(label.as_bytes());
    }
    message.push(0);
    message.extend([PTR.to_be_bytes(), 1u16.to_be_bytes()].concat());
    message
}

/// The module that `message` is an answer of, if it says everything about it. `service` as for [`question`].
pub fn found(message: &[u8], service: &str) -> Option<Found> {
    let mut reader = Reader(message);
    let [_, flags, questions, answers, _, additional] = reader.numbers()?;
    if flags & 0x8000 == 0 {
        return None;
    }
    for _ in 0..questions {
        reader.name()?;
        reader.numbers::<2>()?;
    }
    let (mut instance, mut place, mut txt, mut addresses) = (None, None, None, BTreeMap::new());
    for _ in 0..answers + additional {
        let name = reader.name()?;
        let [kind, _, _, _, len] = reader.numbers()?;
        let mut data = Reader(reader.take(usize::from(len))?);
        match kind {
            PTR if name == service => instance = Some(data.name()?),
            SRV => {
                let [_, _, port] = data.numbers()?;
                place = Some((name, port, data.name()?));
            }
            TXT => {
                let mut pairs = BTreeMap::new();
                while let Some(&len) = data.0.first() {
                    data.take(1)?;
                    let text = String::from_utf8(data.take(usize::from(len))?.to_vec()).ok()?;
                    let (key, value) = text.split_once('=')?;
                    pairs.insert(key.to_owned(), value.to_owned());
                }
                txt = Some((name, pairs));
            }
            A => drop(addresses.insert(name, <[u8; 4]>::try_from(data.0).ok()?)),
            _ => {}
        }
    }
    let (instance, (placed, port, host), (described, txt)) = (instance?, place?, txt?);
    assert_eq!((&placed, &described), (&instance, &instance));
    let name = instance.strip_suffix(service)?.strip_suffix('.')?.to_owned();
    Some(Found { name, address: *addresses.get(&host)?, port, txt })
}

struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take(&mut self, len: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(len)?;
        self.0 = rest;
        Some(taken)
    }

    fn numbers<const N: usize>(&mut self) -> Option<[u16; N]> {
        let mut numbers = [0; N];
        for number in &mut numbers {
            *number = u16::from_be_bytes(self.take(2)?.try_into().ok()?);
        }
        Some(numbers)
    }

    fn name(&mut self) -> Option<String> {
        let mut labels = Vec::new();
        loop {
            match self.take(1)? {
                [0] => return Some(labels.join(".")),
                [len] => labels.push(String::from_utf8_lossy(self.take(usize::from(*len))?).into_owned()),
                _ => return None,
            }
        }
    }
}
