//! Ports of this machine for programs that are given a number and open it themselves, some time later.
//!
//! ```text
//!   16384 ─────────── 32767 │ 32768 ─────────── 60999
//!   from here               │ the system gives these to all that ask for any
//! ```

use std::io;
use std::net::{Ipv4Addr, TcpListener, UdpSocket};
use std::sync::atomic::{AtomicU32, Ordering};

/// Ports to choose from: they end where those begin that Linux gives to all that ask for any.
const FIRST: u32 = 16_384;
const COUNT: u32 = 16_384;

/// Ports of one program before those of the next.
const EACH: u32 = 64;

/// A TCP port of the loopback that is free, and stays so until the caller's program opens it: no connection is given
/// it, and no other program of tests has just chosen it, unless the numbers of both processes differ by a multiple of 256.
///
/// # Errors
/// None is free.
pub fn free_tcp() -> io::Result<u16> {
    free(|address| TcpListener::bind(address).is_ok())
}

/// The same, UDP.
///
/// # Errors
/// None is free.
pub fn free_udp() -> io::Result<u16> {
    free(|address| UdpSocket::bind(address).is_ok())
}

fn free(is_free: impl Fn((Ipv4Addr, u16)) -> bool) -> io::Result<u16> {
    static NEXT: AtomicU32 = AtomicU32::new(0);
    let begin = std::process::id().wrapping_mul(EACH);
    for _ in 0..COUNT {
        let port = FIRST + begin.wrapping_add(NEXT.fetch_add(1, Ordering::Relaxed)) % COUNT;
        let port = u16::try_from(port).unwrap_or(u16::MAX);
        if is_free((Ipv4Addr::LOCALHOST, port)) {
            return Ok(port);
        }
    }
    Err(io::ErrorKind::AddrInUse.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_is_not_given_twice_and_none_that_is_open() {
        let first = free_tcp().unwrap();
        let open = u32::from(first) - FIRST + 1;
        let _next = TcpListener::bind((Ipv4Addr::LOCALHOST, u16::try_from(FIRST + open % COUNT).unwrap()));
        let ports = [first, free_tcp().unwrap(), free_tcp().unwrap()];
        assert!(ports.iter().all(|port| (FIRST..FIRST + COUNT).contains(&u32::from(*port))), "{ports:?}");
        assert!(ports[1] != first && ports[2] != ports[1] && u32::from(ports[1]) != FIRST + open % COUNT);
    }
}
