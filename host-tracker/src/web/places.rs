//! Places for connections, so many in all and so many of one address.
//!
//! ```text
//!   take(192.168.1.7) ─▶ 128 in all? ─▶ 16 of this address, 64 of this machine? ─▶ Place, given back when dropped
//! ```

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::sync::Arc;

use parking_lot::Mutex;

use crate::connections::Cause;

/// How many there are.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Shares {
    /// In all.
    pub all: usize,
    /// Of them for one address.
    pub of_address: usize,
    /// Of them for this machine itself, by its loopback addresses together.
    pub of_loopback: usize,
}

impl Shares {
    /// The half of each.
    #[must_use]
    pub const fn half(self) -> Self {
        Self { all: self.all / 2, of_address: self.of_address / 2, of_loopback: self.of_loopback / 2 }
    }
}

/// Why there is no place.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum Taken {
    /// All are taken.
    #[error("all {0} places for connections are taken: close a page, or come again")]
    All(usize),
    /// The address has its share.
    #[error("{0} connections of one address are the most: close a page there, or come again")]
    Address(usize),
}

impl From<Taken> for Cause {
    fn from(taken: Taken) -> Self {
        match taken {
            Taken::All(_) => Self::Full,
            Taken::Address(_) => Self::Address,
        }
    }
}

/// All places. Clones are the same.
#[derive(Clone, Debug)]
pub struct Places {
    shares: Shares,
    taken: Arc<Mutex<BTreeMap<IpAddr, usize>>>,
}

/// A place, given back when it is dropped.
#[derive(Debug)]
pub struct Place {
    of: Places,
    whose: IpAddr,
}

impl Places {
    /// None of them is taken.
    #[must_use]
    pub fn new(shares: Shares) -> Self {
        Self { shares, taken: Arc::default() }
    }

    /// A place for a client at this address.
    ///
    /// # Errors
    /// [`Taken`].
    pub fn reserve(&self, from: IpAddr) -> Result<Place, Taken> {
        let whose = whose(from);
        let share = if whose.is_loopback() { self.shares.of_loopback } else { self.shares.of_address };
        let mut taken = self.taken.lock();
        if taken.values().sum::<usize>() >= self.shares.all {
            return Err(Taken::All(self.shares.all));
        }
        if taken.get(&whose).is_some_and(|own| *own >= share) {
            return Err(Taken::Address(share));
        }
        *taken.entry(whose).or_default() += 1;
        Ok(Place { of: self.clone(), whose })
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let mut taken = self.of.taken.lock();
        if let Some(own) = taken.get_mut(&self.whose) {
            *own = own.saturating_sub(1);
            if *own == 0 {
                taken.remove(&self.whose);
            }
        }
    }
}

/// Whom an address stands for: all of 127.0.0.0/8 and `::1` are this machine, and an IPv4 address within IPv6 is itself.
fn whose(from: IpAddr) -> IpAddr {
    match from.to_canonical() {
        from if from.is_loopback() => IpAddr::from([127, 0, 0, 1]),
        from => from,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn f11_no_address_takes_all_places_and_each_comes_back() {
        let places = Places::new(Shares { all: 5, of_address: 2, of_loopback: 3 });
        let take = |text: &str| places.reserve(text.parse().unwrap());
        let first = take("192.168.1.7").unwrap();
        let mut held = vec![take("::ffff:192.168.1.7").unwrap()];
        assert_eq!(take("192.168.1.7").unwrap_err(), Taken::Address(2));
        for own in ["127.0.0.1", "127.0.0.2", "::1"] {
            held.push(take(own).unwrap());
        }
        assert_eq!(take("192.168.1.8").unwrap_err(), Taken::All(5));
        drop(first);
        assert_eq!(take("127.9.9.9").unwrap_err(), Taken::Address(3));
        held.push(take("fe80::1").unwrap());
        drop(held);
        assert!(places.taken.lock().is_empty());
    }
}
