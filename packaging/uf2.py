#!/usr/bin/env python3
"""HEX files as one UF2 file, for the RP2350's boot ROM: packaging/uf2.py OUT.uf2 FILE.hex...

    block, 512 bytes   0  "UF2\\n", magic, flags, address, 256, number, count, family
                      32  256 bytes of flash, zeros
                     508  magic

The drive takes one file and vanishes, so boot loader and image are in one. Blocks fill whole sectors, as the boot ROM erases
one when its first block comes; what no file has is erased flash, 0xff. Nothing else of the flash is touched.

Crates convert one ELF file each, and two UF2 files behind each other are not taken. Source: microsoft.github.io/uf2; RP2350
data sheet, part 5.5 (UF2: without a partition table, blocks of this family are written where they say).
"""

import struct
import sys

FAMILY_RP2350_ARM_S = 0xE48BFF59
HAS_FAMILY = 0x2000
PAGE = 256
SECTOR = 4096


def records(path):
    """Address and bytes of each data record of a HEX file."""
    base = 0
    with open(path, encoding="ascii") as lines:
        for line in lines:
            row = bytes.fromhex(line.strip().removeprefix(":"))
            if sum(row) & 0xFF or len(row) != row[0] + 5:
                sys.exit(f"{path}: damaged: {line.strip()}")
            data = row[4:-1]
            match row[3]:
                case 0:
                    yield base + int.from_bytes(row[1:3], "big"), data
                case 2:
                    base = int.from_bytes(data, "big") << 4
                case 4:
                    base = int.from_bytes(data, "big") << 16


def flash(paths):
    """The sectors that the files have bytes for, by their addresses."""
    sectors, taken = {}, set()
    for path in paths:
        for address, data in records(path):
            for at, byte in enumerate(data, address):
                if at in taken:
                    sys.exit(f"{path}: 0x{at:08x} is there twice")
                taken.add(at)
                sectors.setdefault(at // SECTOR * SECTOR, bytearray(b"\xff" * SECTOR))[at % SECTOR] = byte
    return sectors


def blocks(sectors):
    """All blocks, in order of their addresses."""
    pages = [
        (sector + at, bytes(sectors[sector][at : at + PAGE]))
        for sector in sorted(sectors)
        for at in range(0, SECTOR, PAGE)
    ]
    for number, (address, page) in enumerate(pages):
        head = (0x0A324655, 0x9E5D5157, HAS_FAMILY, address, PAGE, number, len(pages), FAMILY_RP2350_ARM_S)
        yield struct.pack("<8I476sI", *head, page, 0x0AB16F30)


def main():
    if len(sys.argv) < 3:
        sys.exit("usage: packaging/uf2.py OUT.uf2 FILE.hex...")
    with open(sys.argv[1], "wb") as out:
        out.writelines(blocks(flash(sys.argv[2:])))


if __name__ == "__main__":
    main()
