#!/usr/bin/env python3
"""Reads back the files that packaging/firmware.sh has made: tests/firmware.py FOLDER

HEX, BIN and UF2 hold exactly the bytes of the ELF files' loadable segments, at their addresses, and every file is in
SHA256SUMS. HEX is read by PyPI's intelhex, ELF and UF2 by a reader of this file's own, none by what wrote them.
"""

import hashlib
import struct
import sys
from pathlib import Path

from intelhex import IntelHex

FAMILY_RP2350_ARM_S = 0xE48BFF59
SECTOR = 4096
# Boards, and where the flash of each may be written: boot loader, image. What is between and behind them stays.
BOARDS = {
    "mps2-an386": None,
    "nucleo-h563zi": (range(0x0800_0000, 0x0800_C000), range(0x0802_0000, 0x0806_0000)),
    "w5500-evb-pico2": (range(0x1000_0000, 0x1000_C000), range(0x1001_0000, 0x1005_0000)),
}


def elf(path):
    """The bytes of the loadable segments, by their addresses in flash (p_paddr)."""
    data = path.read_bytes()
    assert data[:6] == b"\x7fELF\x01\x01", f"{path}: no ELF file of 32 bits"
    (table,) = struct.unpack_from("<I", data, 28)
    size, count = struct.unpack_from("<2H", data, 42)
    found = {}
    for at in range(table, table + size * count, size):
        kind, offset, _, address, length = struct.unpack_from("<5I", data, at)
        if kind == 1:
            found |= dict(enumerate(data[offset : offset + length], address))
    return found


def hexadecimal(path):
    file = IntelHex(str(path))
    return {at: file[at] for at in file.addresses()}


def uf2(path):
    """What its blocks write: whole sectors, once each, of the right family."""
    data, found = path.read_bytes(), {}
    count, rest = divmod(len(data), 512)
    assert count and not rest, f"{path}: not of blocks of 512 bytes"
    for number in range(count):
        head = struct.unpack_from("<8I", data, 512 * number)
        address = head[3]
        assert head[:3] == (0x0A324655, 0x9E5D5157, 0x2000), f"{path}: block {number}: {head}"
        assert head[4:] == (256, number, count, FAMILY_RP2350_ARM_S), f"{path}: block {number}: {head}"
        assert struct.unpack_from("<I", data, 512 * number + 508) == (0x0AB16F30,), f"{path}: block {number}"
        assert address % 256 == 0 and address not in found, f"{path}: block {number} at 0x{address:08x}"
        found |= dict(enumerate(data[512 * number + 32 :][:256], address))
    sectors = {at // SECTOR for at in found}
    assert len(found) == SECTOR * len(sectors), f"{path}: a sector is not whole"
    return found


def same(path, found, wanted):
    """`found` are the bytes of `wanted`; others are those of erased flash, and not in HEX files."""
    more = {at: byte for at, byte in found.items() if at not in wanted}
    assert path.suffix != ".hex" or not more, f"{path}: {len(more)} bytes that no ELF file has"
    assert set(more.values()) <= {0xFF}, f"{path}: what no ELF file has is not erased flash"
    wrong = [at for at, byte in wanted.items() if found.get(at) != byte]
    assert not wrong, f"{path}: {len(wrong)} bytes differ, the first at 0x{wrong[0]:08x}"
    print(f"{path.name}: {len(wanted)} bytes as in the ELF files")


def check_image(folder, name, room):
    """One image's files; returns its bytes."""
    wanted = elf(folder / f"{name}.elf")
    assert len(wanted) > 8 * 1024, f"{name}: nearly nothing is loaded"
    if room is not None:
        outside = [at for at in wanted if at not in room]
        assert not outside, f"{name}.elf: loads 0x{outside[0]:08x}, outside its place"
        assert min(wanted) == room.start, f"{name}.elf: does not begin at 0x{room.start:08x}"
    same(folder / f"{name}.hex", hexadecimal(folder / f"{name}.hex"), wanted)
    binary = dict(enumerate((folder / f"{name}.bin").read_bytes(), min(wanted)))
    same(folder / f"{name}.bin", binary, wanted)
    return wanted


def main(folder):
    boards = [board for board in BOARDS if (folder / f"{board}.elf").exists()]
    assert boards, f"{folder}: no image"
    for board in boards:
        rooms = BOARDS[board]
        image = check_image(folder, board, rooms and rooms[1])
        if rooms is None:
            continue
        whole = check_image(folder, f"{board}-boot", rooms[0]) | image
        both = folder / f"{board}-complete.hex"
        same(both, hexadecimal(both), whole)
        if board == "w5500-evb-pico2":
            drag = folder / f"{board}-complete.uf2"
            same(drag, uf2(drag), whole)
    sums = dict(reversed(line.split("  ", 1)) for line in (folder / "SHA256SUMS").read_text().splitlines())
    files = {path.name for path in folder.iterdir() if path.name != "SHA256SUMS"}
    assert files == set(sums), f"SHA256SUMS has others than {folder}: {sorted(files ^ set(sums))}"
    for name, digest in sums.items():
        assert hashlib.sha256((folder / name).read_bytes()).hexdigest() == digest, f"{name}: another sum"
    print(f"{len(sums)} files as in SHA256SUMS")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
