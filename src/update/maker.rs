//! Makers: whose signature an image needs to be started.
//!
//! A boot loader is built with the public keys of its maker, one or two: the present one, and the one to come.
//! `KEHAI_UPDATE_KEYS` names them when it is built. Without, images are signed with a key whose secret lies in this
//! repository (`tests/data/update/development.key`): for trying out, and no protection at all.

/// Most public keys of a boot loader.
pub const MAKERS: usize = 2;

/// The public key of the secret that everybody has.
pub const DEVELOPMENT: [u8; 32] = [
    0x67, 0x06, 0x04, 0x2b, 0x4a, 0xc3, 0x73, 0x96, 0xe3, 0xeb, 0x4f, 0x2b, 0x7a, 0x6a, 0xd2, 0x31, 0x56,
    0x63, 0xdc, 0x68, 0x35, 0xb5, 0x8b, 0x60, 0xed, 0xfb, 0x4c, 0x06, 0x8e, 0x0c, 0xca, 0x47,
];
