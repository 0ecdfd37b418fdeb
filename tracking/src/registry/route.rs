//! A way to a device: where it may be, where it is looked for, and what has answered there.
//!
//! ```text
//!   addresses  A · B · C       before its device is known, all are asked, ever more seldom
//!              ▲ at            then the current one; silent for three seconds: the next, and each time the one
//!              ▲ home          where it has answered last
//!                              nothing from there is believed before it has answered
//! ```

use std::net::SocketAddr;

use kehai::wire::ModuleId;

use super::found::Found;
use crate::session::start::SILENT_US;
use crate::session::subscription::Subscription;

/// An address whose device is silent is given up for the next one, µs.
pub const NEXT_US: u64 = SILENT_US;

/// A given address whose device answers elsewhere is asked so often, µs: seldom beside the request of each second, and as
/// soon as a device that is silent there would be looked for elsewhere. Another module may be there by now, and as long as
/// that is not known a peer that posed as the first one has its place.
const AGAIN_US: u64 = NEXT_US;

/// Addresses tried for one device: a PC has an interface or two, and an announcement may name hundreds.
const ADDRESSES: usize = 8;

/// A way to a device.
#[derive(Debug)]
pub struct Route {
    /// Where the device may be, and where it is now looked for.
    pub addresses: Vec<SocketAddr>,
    pub at: usize,
    /// When an answer came from there, or the device was looked for elsewhere.
    pub tried_us: u64,
    /// When its other addresses were asked last which device is there, µs.
    pub asked_us: u64,
    /// When its device has last answered, and where.
    pub answered_us: Option<u64>,
    pub home: Option<SocketAddr>,
    /// Whether it has answered a request at this address: before, nothing from there is believed.
    pub proven: bool,
    pub device: Device,
    pub given: bool,
    /// Its instance name, and whether that is gone.
    pub instance: String,
    pub lost: bool,
}

impl Device {
    /// One that has not answered yet. What was only announced is asked ever more seldom.
    pub fn unknown(given: bool, seed: u64) -> Self {
        let subscription = Subscription::new(given, seed);
        Self::Unknown(if given { subscription } else { subscription.backing_off() })
    }
}

/// The device at the end of a route.
#[derive(Debug)]
pub enum Device {
    /// It has not answered yet.
    Unknown(Subscription),
    /// It has: its session sends the requests.
    Known(ModuleId),
}

impl Route {
    pub fn new(mut addresses: Vec<SocketAddr>, given: bool, seed: u64, now_us: u64) -> Self {
        addresses.truncate(ADDRESSES);
        let device = Device::unknown(given, seed);
        let instance = String::new();
        let (at, tried_us, asked_us) = (0, now_us, now_us);
        let (answered_us, home, proven, lost) = (None, None, false, false);
        Self { addresses, at, tried_us, asked_us, answered_us, home, proven, device, given, instance, lost }
    }

    pub fn is_answering(&self, now_us: u64) -> bool {
        self.answered_us.is_some_and(|answered_us| now_us.saturating_sub(answered_us) < NEXT_US)
    }

    /// Its device answers, and its other addresses have not been asked for long.
    pub fn is_due(&self, now_us: u64) -> bool {
        let has_others = self.device().is_some() && self.addresses.len() > 1;
        has_others && self.is_answering(now_us) && now_us.saturating_sub(self.asked_us) >= AGAIN_US
    }

    /// Takes those of these addresses out at which the device is not.
    pub fn part(&mut self, given: &[SocketAddr]) -> Vec<SocketAddr> {
        let Some(current) = self.address() else { return Vec::new() };
        let addresses = std::mem::take(&mut self.addresses).into_iter();
        let (parted, kept) = addresses.partition(|address| *address != current && given.contains(address));
        self.addresses = kept;
        self.at = self.addresses.iter().position(|address| *address == current).unwrap_or(0);
        parted
    }

    /// Other addresses to try: the newest right after the current one. None is forgotten for it before there are too many,
    /// as a false announcement may come after a true one.
    pub fn announce(&mut self, addresses: Vec<SocketAddr>) {
        let Some(current) = self.address() else { return };
        let mut all = vec![current];
        let home = self.home.filter(|home| self.addresses.contains(home));
        for address in home.into_iter().chain(addresses).chain(std::mem::take(&mut self.addresses)) {
            if all.len() < ADDRESSES && !all.contains(&address) {
                all.push(address);
            }
        }
        (self.addresses, self.at) = (all, 0);
    }

    /// More addresses, to be tried last.
    pub fn also(&mut self, addresses: Vec<SocketAddr>) {
        for address in addresses {
            if self.addresses.len() < ADDRESSES && !self.addresses.contains(&address) {
                self.addresses.push(address);
            }
        }
    }

    /// Whether an answer from there may be this device's; its place among the addresses.
    pub fn place_of(&self, from: SocketAddr) -> Option<usize> {
        let place = self.addresses.iter().position(|address| *address == from)?;
        let is_home = !self.proven && self.home == Some(from);
        (place == self.at || is_home || self.device().is_none()).then_some(place)
    }

    /// Where its device is asked: where it is looked for, and while it does not answer there also where it did last. False
    /// announcements name many addresses, and one that was silent is back at its own.
    pub fn asked(&self) -> impl Iterator<Item = SocketAddr> + Clone + use<> {
        let home = self.home.filter(|home| !self.proven && self.addresses.contains(home));
        let current = self.address();
        current.into_iter().chain(home.filter(|home| current != Some(*home)))
    }

    pub fn address(&self) -> Option<SocketAddr> {
        self.addresses.get(self.at).copied()
    }

    pub const fn device(&self) -> Option<ModuleId> {
        match self.device {
            Device::Unknown(_) => None,
            Device::Known(device) => Some(device),
        }
    }

    pub fn leads_to(&self, device: ModuleId) -> bool {
        self.device() == Some(device)
    }

    /// Whether this route is that of what was found. A name does not say so once another device has answered here.
    pub fn is(&self, found: &Found) -> bool {
        let there = self.address().is_some_and(|address| found.addresses.contains(&address));
        let may_be = self.device().is_none() || found.id == ModuleId::ANY;
        let named = !self.instance.is_empty() && self.instance == found.instance;
        self.leads_to(found.id) || there || (may_be && named)
    }
}
