#!/usr/bin/env python3
"""The sealed wire of a kehai module with keys: docs/wire.md, "Keys", in code. Needs `cryptography` from PyPI.

    kehai_seal.py --check tests/data/seal/exchange.txt     opens a recorded exchange with the keys beside it

As a library: Channel(key_id, key), whose seal() and take() stand between a socket and kehai_wire.
"""

import argparse
import hashlib
import os
import struct
import sys
import time

from cryptography.exceptions import InvalidTag
from cryptography.hazmat.primitives.ciphers.aead import ChaCha20Poly1305

MAGIC = b"\xe6\xb0\x97"
HEADER = struct.Struct("<3sBI6sBBQ16s")  # 40 bytes
SUBSCRIBE, OPEN, REFUSED, COOKIE, OPENED = 0x01, 0x0B, 0x80, 0x81, 0x87
BAD_COOKIE = 3  # the refusal
NO_COOKIE = bytes(8)
WIDTH = 64  # counters that are told apart behind the newest one
SILENT_S = 3.0  # a session whose module is silent for so long is given up: three renewals


def derive(key, purpose, *parts):
    """A key of 32 bytes from another, for a purpose."""
    text = purpose.ljust(16, b"\0") + b"".join(parts)
    return hashlib.blake2s(text.ljust(64, b"\0"), key=key).digest()


def session_keys(role_key, module, boot, host, device):
    """From the host to the module, and back."""
    parts = (module, struct.pack("<I", boot), host, device)
    return derive(role_key, b"kehai inward", *parts), derive(role_key, b"kehai outward", *parts)


def nonce(counter):
    return bytes(4) + struct.pack("<Q", counter)


def named(datagram, number, counter):
    """The datagram with this key and counter in its header, and no tag."""
    return datagram[:15] + struct.pack("<BQ", number, counter) + bytes(16) + datagram[40:]


def seal(datagram, key, number, counter):
    """Encrypts the message behind the header."""
    datagram = named(datagram, number, counter)
    sealed = ChaCha20Poly1305(key).encrypt(nonce(counter), datagram[40:], datagram[:24])
    return datagram[:24] + sealed[-16:] + sealed[:-16]


def unseal(datagram, key):
    """The datagram in clear; None if it was not sealed with this key."""
    _, _, _, _, _, _, counter, tag = HEADER.unpack_from(datagram)
    try:
        message = ChaCha20Poly1305(key).decrypt(nonce(counter), datagram[40:] + tag, datagram[:24])
    except InvalidTag:
        return None
    return datagram[:24] + tag + message


def sign(datagram, key, number):
    """Authenticates a datagram that stays in clear, under counter 0."""
    datagram = named(datagram, number, 0)
    tag = ChaCha20Poly1305(key).encrypt(nonce(0), b"", datagram[:24] + datagram[40:])
    return datagram[:24] + tag + datagram[40:]


def is_signed(datagram, key):
    return sign(datagram, key, datagram[15]) == datagram


class Channel:
    """The host's end of a session with one module."""

    def __init__(self, key_id, key):
        self.key_id, self.key = key_id, key
        self.module, self.boot, self.cookie = bytes(6), 0, NO_COOKIE
        self.session = None  # number, inward key, outward key
        self.counter, self.newest, self.taken = 0, -1, set()
        self.asked, self.request_id, self.host = None, 0, b""  # on the way to a session
        self.heard_s = 0.0
        # Opens since the last one that was answered: a module does not answer one made with another key.
        self.unanswered = 0
        # The module has answered with a step towards a session: the next request is to follow at once.
        self.is_due = False

    def seal(self, request):
        """What is to be sent in the place of a request in clear."""
        self.is_due = False
        if self.session and time.monotonic() >= self.heard_s + SILENT_S:
            # The module may have started anew, and knows nothing of this session.
            self.session = None
        if self.session:
            number, inward, _ = self.session
            self.counter += 1
            return seal(request, inward, number, self.counter - 1)
        self.request_id, self.host = int.from_bytes(os.urandom(4), "little"), os.urandom(16)
        # A cookie is for one open: if that is lost or refused, the next request asks for another one.
        cookie, self.cookie = self.cookie, NO_COOKIE
        self.asked = SUBSCRIBE if cookie == NO_COOKIE else OPEN
        if self.asked == SUBSCRIBE:
            header = HEADER.pack(MAGIC, 1, 0, bytes(6), SUBSCRIBE, 0, 0, bytes(16))
            return header + struct.pack("<I8s8s", self.request_id, NO_COOKIE, bytes(8))
        self.unanswered += 1
        header = HEADER.pack(MAGIC, 1, self.boot, self.module, OPEN, 0, 0, bytes(16))
        message = struct.pack("<I8s16s", self.request_id, cookie, self.host)
        return sign(header + message, derive(self.key, b"kehai open", self.module, self.host), self.key_id)

    def take(self, datagram):
        """The message in a datagram of the module, in clear; None if there is none for anybody else.

        What the module refuses before there is a session is a message, too; it comes in clear, and anybody may have sent it.
        """
        if len(datagram) < HEADER.size or not datagram.startswith(MAGIC):
            return None
        _, _, boot, module, kind, number, counter, _ = HEADER.unpack_from(datagram)
        if not self.session:
            return self._step(datagram, boot, module, kind, number)
        if number != self.session[0] or counter in self.taken or counter <= self.newest - WIDTH:
            return None
        opened = unseal(datagram, self.session[2])
        if opened is not None:
            self.heard_s = time.monotonic()
            self.newest = max(self.newest, counter)
            self.taken = {taken for taken in self.taken | {counter} if taken > self.newest - WIDTH}
        return opened

    def _step(self, datagram, boot, module, kind, number):
        """Takes an answer to what was asked for a session. Returns a refusal that does not go away by another cookie."""
        if datagram[40:44] != struct.pack("<I", self.request_id):
            return None
        if kind == COOKIE and self.asked == SUBSCRIBE and len(datagram) >= 60:
            self.module, self.boot, self.cookie = module, boot, datagram[52:60]
            self.is_due = True
        elif kind == OPENED and self.asked == OPEN and len(datagram) == 61:
            session, device = struct.unpack_from("<B16s", datagram, 44)
            inward, outward = session_keys(self.key, module, boot, self.host, device)
            if number == session and is_signed(datagram, outward):
                self.session = (session, inward, outward)
                self.counter, self.newest, self.taken = 0, 0, {0}
                self.heard_s, self.is_due, self.unanswered = time.monotonic(), True, 0
        elif kind == REFUSED and len(datagram) >= 46:
            self.unanswered = 0
            if datagram[45] != BAD_COOKIE:
                return datagram
        return None


def check(path):
    """Opens a recorded exchange; raises ValueError where it differs."""
    with open(path, encoding="ascii") as file:
        rows = (line.split() for line in file if line.strip() and not line.startswith("#"))
        values = {name: bytes.fromhex(value) for name, value in rows}
    opening, opened, key = values["open"], values["opened"], values["role_key"]
    _, _, boot, module, _, _, _, _ = HEADER.unpack_from(opening)
    host, device = opening[52:68], opened[45:61]
    inward, outward = session_keys(key, module, boot, host, device)
    wrong = []
    if sign(opening, derive(key, b"kehai open", module, host), opening[15]) != opening:
        wrong.append("open")
    if not is_signed(opened, outward):
        wrong.append("opened")
    for name, session_key in (("request", inward), ("message", outward)):
        sealed = values[f"{name}_sealed"]
        plain = unseal(sealed, session_key)
        if plain is None or plain[40:] != values[name][40:]:
            wrong.append(name)
        elif seal(values[name], session_key, sealed[15], struct.unpack_from("<Q", sealed, 16)[0]) != sealed:
            wrong.append(f"{name}, sealed again")
    if wrong:
        raise ValueError(f"{path}: does not open: {', '.join(wrong)}")


def main():
    parser = argparse.ArgumentParser(description="Opens a recorded exchange of the sealed wire.")
    parser.add_argument(
        "--check", metavar="FILE", required=True, help="names and hexadecimal bytes, a line each"
    )
    arguments = parser.parse_args()
    try:
        check(arguments.check)
    except (OSError, ValueError, KeyError) as error:
        sys.exit(f"kehai_seal.py: {error}")
    print("everything opens")


if __name__ == "__main__":
    main()
