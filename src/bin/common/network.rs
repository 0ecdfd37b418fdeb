//! Keeps the module reachable: by DHCP, else at its link-local address while DHCP keeps trying.
//!
//! ```text
//!          ┌───────── lease ──────────▶ leased ──── lost, or link down ────┐
//!  asking ─┤                              ▲                                ▼
//!          └─ nothing in 4 s ─▶ link-local ┴─ a server gives a lease ◀── asking
//! ```
//!
//! embassy-net has either DHCP or an address, so the module at its link-local address looks for a lease
//! itself ([`kehai::address::dhcp`]) and hands over to embassy's DHCP once a server has given one: it is
//! without an address only during that exchange. A lease of an address that no interface can have counts
//! as none.

use defmt::{info, warn};
use embassy_futures::select::{Either, select};
use embassy_net::udp::{PacketMetadata, UdpSocket};
use embassy_net::{ConfigV4, DhcpConfig, Ipv4Address, Ipv4Cidr, Stack, StaticConfigV4};
use embassy_time::{Duration, Instant, Timer, with_timeout};
use kehai::address::dhcp::{DHCP_MESSAGE_LEN, Heard, LeaseSearch};
use kehai::address::{self, InterfaceAddress, Mac};
use kehai::device::Addressing;

/// A server on the same segment answers in milliseconds; three requests may be lost.
const PATIENCE: Duration = Duration::from_secs(4);
/// Between two requests of embassy's DHCP; by itself it would wait 10 s.
const RETRY: core::time::Duration = core::time::Duration::from_secs(1);
/// Between two questions for a server.
const QUESTION_PERIOD: Duration = Duration::from_secs(5);
/// Where a lease was given and embassy's DHCP then got none, the module is at its link-local address for so long before
/// it asks again: hosts have time to find it there.
const BROKEN_PROMISE: Duration = Duration::from_secs(60);
const DHCP_CLIENT: u16 = 68;
const DHCP_SERVER: u16 = 67;
/// Most that a server may send to a client that has not asked for more (RFC 2131 part 2).
const ANSWER_LEN: usize = 576;

/// DHCP under the module's name.
pub fn dhcp(mac: Mac) -> embassy_net::Config {
    embassy_net::Config::dhcpv4(dhcp_config(mac))
}

fn dhcp_config(mac: Mac) -> DhcpConfig {
    let mut config = DhcpConfig::default();
    // The name is shorter than what DHCP allows.
    config.hostname = address::host_name(mac).as_str().try_into().ok();
    config.retry_config.discover_timeout = RETRY.into();
    config.retry_config.initial_request_timeout = RETRY.into();
    config
}

fn link_local(mac: Mac) -> StaticConfigV4 {
    StaticConfigV4 {
        address: Ipv4Cidr::new(Ipv4Address::from(address::link_local(mac)), 16),
        gateway: None,
        dns_servers: Default::default(),
    }
}

/// Keeps an address, for ever: the one given, or else by DHCP. The stack begins with [`dhcp`].
///
/// # Cancellation
/// The address stays as it is.
pub async fn keep_address(stack: Stack<'static>, mac: Mac, addressing: Addressing) {
    if let Addressing::Static(address) = addressing {
        stack.set_config_v4(ConfigV4::Static(StaticConfigV4 {
            address: Ipv4Cidr::new(address.address(), address.prefix_bits()),
            gateway: address.gateway(),
            dns_servers: Default::default(),
        }));
        log_address(stack);
        core::future::pending::<()>().await;
    }
    let mut is_promised = false;
    loop {
        stack.wait_link_up().await;
        let leased = with_timeout(PATIENCE, stack.wait_config_up()).await.is_ok();
        if leased && is_usable(stack) {
            is_promised = false;
            log_address(stack);
            stack.wait_config_down().await;
            info!("address lost");
        } else if stack.is_link_up() {
            stack.set_config_v4(ConfigV4::Static(link_local(mac)));
            log_address(stack);
            if leased {
                warn!("the server leased an address that no interface can have");
            }
            if is_promised {
                Timer::after(BROKEN_PROMISE).await;
            }
            wait_for_lease(stack, mac).await;
            is_promised = true;
            stack.set_config_v4(ConfigV4::Dhcp(dhcp_config(mac)));
        }
    }
}

/// Whether the address that a DHCP server gave is one that an interface can have.
fn is_usable(stack: Stack<'static>) -> bool {
    stack.config_v4().is_some_and(|StaticConfigV4 { address, gateway, .. }| {
        InterfaceAddress::new(address.address(), address.prefix_len(), gateway).is_ok()
    })
}

fn log_address(stack: Stack<'static>) {
    if let Some(config) = stack.config_v4() {
        info!("address {}", config.address);
    }
}

/// Returns once a DHCP server has given a lease.
async fn wait_for_lease(stack: Stack<'static>, mac: Mac) {
    let (mut receive_metadata, mut transmit_metadata) =
        ([PacketMetadata::EMPTY; 1], [PacketMetadata::EMPTY; 1]);
    let (mut received, mut to_send) = ([0; ANSWER_LEN], [0; DHCP_MESSAGE_LEN]);
    let mut socket =
        UdpSocket::new(stack, &mut receive_metadata, &mut received, &mut transmit_metadata, &mut to_send);
    if socket.bind(DHCP_CLIENT).is_err() {
        return;
    }
    let mut search = LeaseSearch::new(mac, Instant::now().as_ticks() as u32);
    let mut answer = [0; ANSWER_LEN];
    loop {
        let _ = socket.send_to(&search.message(), (Ipv4Address::BROADCAST, DHCP_SERVER)).await;
        let next_message = Instant::now() + QUESTION_PERIOD;
        while let Either::First(received) =
            select(socket.recv_from(&mut answer), Timer::at(next_message)).await
        {
            let Ok((len, _)) = received else { continue };
            match search.hear(answer.get(..len).unwrap_or_default()) {
                Heard::Nothing => {}
                Heard::Offer => break,
                Heard::Lease => return,
            }
        }
    }
}
