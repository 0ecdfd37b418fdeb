#!/usr/bin/env bash
# The firmware, so that the same commit gives the same bytes wherever it is built: packaging/firmware.sh makes these files
# in target/firmware, of every board or of those named:
#
#   BOARD.elf, .hex, .bin          the image; .elf has what decodes its log
#   BOARD-boot.elf, .hex, .bin     its boot loader
#   BOARD-complete.hex             both, for a debugger; of the board with a USB drive BOARD-complete.uf2, too
#   MAKERS                         whose updates the boot loaders take: a public key a line, or "development"
#   SHA256SUMS                     of all of them
#
#   packaging/firmware.sh                      all boards
#   packaging/firmware.sh w5500-evb-pico2      only those named; mps2-an386, QEMU's board, has an image alone
#
# They are compiled as packaging/boards.sh says. The compiler's version is that of rust-toolchain.toml; with another one the
# bytes differ. KEHAI_UPDATE_KEYS names whose updates the boot loaders take (docs/security.md).
set -euo pipefail
cd "$(dirname "$0")/.."

out=target/firmware
boards=("$@")
[ "${#boards[@]}" -gt 0 ] || boards=(nucleo-h563zi w5500-evb-pico2)
rm -rf "$out" && mkdir -p "$out"
. packaging/boards.sh

build() { # build IMAGE FEATURES
    firmware_cargo build --locked --release --target "$(board_target "$1")" -p kehai --bin "$1" --features "$2"
    # Debug information names the path it was built at.
    arm-none-eabi-objcopy --strip-debug "$(built "$1")" "$out/$1.elf"
    arm-none-eabi-objcopy -O ihex "$out/$1.elf" "$out/$1.hex"
    # As kehai-tracker firmware sign flattens an ELF file.
    arm-none-eabi-objcopy -O binary --gap-fill 0xff "$out/$1.elf" "$out/$1.bin"
}

for board in "${boards[@]}"; do
    build "$board" "board-$board"
    [[ $board != mps2-an386* ]] || continue
    build "$board-boot" "board-$board,boot"
    # Behind each other, with one end (01) and no place to start (05): that is for programs in memory.
    { sed '/^:......0[15]/d' "$out/$board-boot.hex" "$out/$board.hex"; printf ':00000001FF\r\n'; } >"$out/$board-complete.hex"
    [[ $board != w5500-* ]] \
        || python3 packaging/uf2.py "$out/$board-complete.uf2" "$out/$board-boot.hex" "$out/$board.hex"
done
tr , '\n' <<<"${KEHAI_UPDATE_KEYS:-development}" >"$out/MAKERS"
(cd "$out" && sha256sum -- * >SHA256SUMS && cat SHA256SUMS)
