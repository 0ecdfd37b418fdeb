//! Cookies: with one a host proves that it receives datagrams at its address.
//!
//! ```text
//!   cookie = SipHash-2-4(secret, boot │ address │ port)      8 bytes
//!                                u32    4 bytes   u16        nothing is kept for a host that asks
//! ```
//!
//! Source: J.-P. Aumasson, D. J. Bernstein, "SipHash: a fast short-input PRF" (2012), part 2.

use core::net::SocketAddrV4;

use crate::wire::Cookie;

/// Makes and checks cookies.
#[derive(Clone, Copy, Debug)]
pub struct Cookies {
    key: (u64, u64),
    boot: u32,
}

impl Cookies {
    /// Keyed by `secret`, for this start of the module: cookies of another one are worth nothing.
    #[must_use]
    pub const fn new(secret: [u8; 16], boot: u32) -> Self {
        let [a, b, c, d, e, f, g, h, rest @ ..] = secret;
        let key = (u64::from_le_bytes([a, b, c, d, e, f, g, h]), u64::from_le_bytes(rest));
        Self { key, boot }
    }

    /// The cookie of this address and port; never [`Cookie::NONE`].
    #[must_use]
    pub fn cookie(&self, of: SocketAddrV4) -> Cookie {
        let [a, b, c, d] = self.boot.to_le_bytes();
        let [e, f, g, h] = of.ip().octets();
        let [i, j] = of.port().to_le_bytes();
        let words =
            [u64::from_le_bytes([a, b, c, d, e, f, g, h]), u64::from_le_bytes([i, j, 0, 0, 0, 0, 0, 10])];
        let hash = sip_hash(self.key, words);
        Cookie(if hash == 0 { [1; 8] } else { hash.to_le_bytes() })
    }

    /// Whether `cookie` is this address and port's.
    #[must_use]
    pub fn fits(&self, cookie: Cookie, of: SocketAddrV4) -> bool {
        // Every byte is compared, so that the time does not depend on where they differ.
        let Cookie(own) = self.cookie(of);
        let Cookie(given) = cookie;
        own.iter().zip(given).fold(0, |different, (&own, given)| different | (own ^ given)) == 0
    }
}

/// SipHash-2-4 of a message in whole words, the last of them with the length on top.
fn sip_hash((k0, k1): (u64, u64), words: [u64; 2]) -> u64 {
    let mut state = [
        k0 ^ 0x736f_6d65_7073_6575,
        k1 ^ 0x646f_7261_6e64_6f6d,
        k0 ^ 0x6c79_6765_6e65_7261,
        k1 ^ 0x7465_6462_7974_6573,
    ];
    for word in words {
        state = [state[0], state[1], state[2], state[3] ^ word];
        state = round(round(state));
        state = [state[0] ^ word, state[1], state[2], state[3]];
    }
    state = [state[0], state[1], state[2] ^ 0xff, state[3]];
    let [a, b, c, d] = round(round(round(round(state))));
    a ^ b ^ c ^ d
}

const fn round([mut a, mut b, mut c, mut d]: [u64; 4]) -> [u64; 4] {
    a = a.wrapping_add(b);
    c = c.wrapping_add(d);
    b = b.rotate_left(13) ^ a;
    d = d.rotate_left(16) ^ c;
    a = a.rotate_left(32);
    c = c.wrapping_add(b);
    a = a.wrapping_add(d);
    b = b.rotate_left(17) ^ c;
    d = d.rotate_left(21) ^ a;
    c = c.rotate_left(32);
    [a, b, c, d]
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::net::Ipv4Addr;

    const HOST: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 7), 5000);

    #[test]
    fn the_hash_is_the_one_of_the_paper() {
        // Appendix A: key 00 01 … 0f, message 00 01 … 0e.
        let key = (0x0706_0504_0302_0100, 0x0f0e_0d0c_0b0a_0908);
        let words = [0x0706_0504_0302_0100, 0x0f0e_0d0c_0b0a_0908];
        assert_eq!(sip_hash(key, words), 0xa129_ca61_49be_45e5);
    }

    #[test]
    fn a_cookie_fits_its_address_its_port_its_start_and_nothing_else() {
        let cookies = Cookies::new([3; 16], 7);
        let cookie = cookies.cookie(HOST);
        assert!(cookies.fits(cookie, HOST));
        assert!(!cookies.fits(cookie, SocketAddrV4::new(*HOST.ip(), 5001)));
        assert!(!cookies.fits(cookie, SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 8), 5000)));
        assert!(!Cookies::new([3; 16], 8).fits(cookie, HOST));
        assert!(!Cookies::new([4; 16], 7).fits(cookie, HOST));
        assert!(!cookies.fits(Cookie::NONE, HOST));
    }
}
