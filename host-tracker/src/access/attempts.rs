//! How often passwords may be tried: of one address, and of all together.
//!
//! ```text
//!   try ─▶ of this address: ten at once, then one each 30 s ─▶ of all: a hundred at once, then one each 3 s ─▶ compared
//!   the right password gives its try back; one that is not compared says how long to wait, the right one too
//! ```
//!
//! A flood of tries keeps people from logging in, but costs no more than one comparison each 3 s; users who have logged in, tokens and
//! the way out do not notice it. A password made here has 100 bits; of one that a user chose, 28 800 are tried a day.
//!
//! Each limit is one time, by which its tries would have come one after the other (GCRA, ITU-T I.371). An address is
//! forgotten when all its tries are given back: as all together are limited, too, never more than two hundred are known.

use std::collections::BTreeMap;
use std::net::{IpAddr, Ipv6Addr};

/// A limit: `burst` at once, then one each `every_us`.
#[derive(Clone, Copy, Debug)]
struct Limit {
    burst: u64,
    every_us: u64,
}

const OF_ADDRESS: Limit = Limit { burst: 10, every_us: 30_000_000 };
const OF_ALL: Limit = Limit { burst: 100, every_us: 3_000_000 };

/// It must wait so long.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Wait {
    /// Seconds, rounded up.
    pub seconds: u64,
}

/// The tries of late.
#[derive(Debug, Default)]
pub struct Attempts {
    of_address: BTreeMap<IpAddr, u64>,
    of_all: u64,
}

impl Attempts {
    /// A try from this address at `now_us`: counted as wrong until it is said to be right.
    ///
    /// # Errors
    /// There were too many: it is not to be compared.
    pub fn begin(&mut self, from: IpAddr, now_us: u64) -> Result<(), Wait> {
        self.of_address.retain(|_, until_us| *until_us > now_us);
        let whose = whose(from);
        let of_address = OF_ADDRESS.after(self.of_address.get(&whose).copied().unwrap_or(0), now_us)?;
        self.of_all = OF_ALL.after(self.of_all, now_us)?;
        self.of_address.insert(whose, of_address);
        Ok(())
    }

    /// The try was right.
    pub fn was_right(&mut self, from: IpAddr) {
        self.of_all = self.of_all.saturating_sub(OF_ALL.every_us);
        if let Some(until_us) = self.of_address.get_mut(&whose(from)) {
            *until_us = until_us.saturating_sub(OF_ADDRESS.every_us);
        }
    }
}

impl Limit {
    /// Until when its tries reach after one more.
    const fn after(self, until_us: u64, now_us: u64) -> Result<u64, Wait> {
        let begin_us = if until_us > now_us { until_us } else { now_us };
        let ahead_us = begin_us - now_us;
        let most_us = (self.burst - 1) * self.every_us;
        if ahead_us > most_us {
            return Err(Wait { seconds: (ahead_us - most_us).div_ceil(1_000_000) });
        }
        Ok(begin_us.saturating_add(self.every_us))
    }
}

/// Whom an address stands for: a network of IPv6 has 2⁶⁴ of them for each of its hosts.
fn whose(from: IpAddr) -> IpAddr {
    match from.to_canonical() {
        IpAddr::V6(from) => IpAddr::V6(Ipv6Addr::from_bits(from.to_bits() >> 64 << 64)),
        from @ IpAddr::V4(_) => from,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const S: u64 = 1_000_000;

    fn address(last: u8) -> IpAddr {
        IpAddr::from([192, 168, 1, last])
    }

    #[test]
    fn ten_wrong_ones_and_then_one_each_half_minute() {
        let mut attempts = Attempts::default();
        for _ in 0..10 {
            assert_eq!(attempts.begin(address(7), 5 * S), Ok(()));
        }
        assert_eq!(attempts.begin(address(7), 5 * S), Err(Wait { seconds: 30 }));
        assert_eq!(attempts.begin(address(7), 34 * S), Err(Wait { seconds: 1 }));
        assert_eq!(attempts.begin(address(8), 34 * S), Ok(()), "another address");
        assert_eq!(attempts.begin(address(7), 35 * S), Ok(()));
        assert_eq!(attempts.begin(address(7), 35 * S), Err(Wait { seconds: 30 }));
    }

    #[test]
    fn right_ones_are_free_and_a_network_of_ipv6_is_one() {
        let mut attempts = Attempts::default();
        for _ in 0..1000 {
            attempts.begin(address(7), 0).unwrap();
            attempts.was_right(address(7));
        }
        for host in 0..10 {
            let host: IpAddr = format!("2001:db8::{host}").parse().unwrap();
            assert_eq!(attempts.begin(host, 0), Ok(()));
        }
        assert!(attempts.begin("2001:db8::a:b:c:d".parse().unwrap(), 0).is_err());
        assert!(attempts.begin("2001:db8:0:1::1".parse().unwrap(), 0).is_ok());
    }

    proptest! {
        #[test]
        fn a_botnet_tries_no_more_than_all_may_and_is_not_kept(
            tries in prop::collection::vec((any::<u16>(), 0..5 * S), 1..2000)
        ) {
            let (mut attempts, mut now_us, mut taken) = (Attempts::default(), 0, 0_u64);
            for (host, pause_us) in tries {
                now_us += pause_us;
                let [high, low] = host.to_be_bytes();
                taken += u64::from(attempts.begin(IpAddr::from([10, 0, high, low]), now_us).is_ok());
                prop_assert!(attempts.of_address.len() <= 200);
            }
            prop_assert!(taken <= 100 + now_us / (3 * S));
        }
    }
}
