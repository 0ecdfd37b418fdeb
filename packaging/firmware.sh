#!/usr/bin/env bash
# The firmware, so that the same commit gives the same bytes wherever it is built: packaging/firmware.sh makes
# target/firmware/IMAGE.elf and IMAGE.bin of every board, and target/firmware/SHA256SUMS.
#
#   packaging/firmware.sh                      all images
#   packaging/firmware.sh w5500-evb-pico2      only those named
#
# What would differ from one machine to the next are the paths of the sources, which panics name: they are replaced.
# The compiler's version is that of rust-toolchain.toml; with another one the bytes differ.
set -euo pipefail
cd "$(dirname "$0")/.."

out=target/firmware
images=("$@")
[ "${#images[@]}" -gt 0 ] || images=(nucleo-h563zi w5500-evb-pico2)
rm -rf "$out" && mkdir -p "$out"
export CARGO_TARGET_DIR=target/firmware-build
registry=${CARGO_HOME:-$HOME/.cargo}/registry/src
RUSTFLAGS="--remap-path-prefix=$PWD=/kehai"
for folder in "$registry"/*; do RUSTFLAGS+=" --remap-path-prefix=$folder=/crates"; done
export RUSTFLAGS
for image in "${images[@]}"; do
    target=thumbv8m.main-none-eabihf
    [[ $image != mps2-an386* ]] || target=thumbv7em-none-eabihf
    cargo build --locked --release --target "$target" -p kehai --bin "$image" --features "board-$image"
    cp "$CARGO_TARGET_DIR/$target/release/$image" "$out/$image.elf"
    # Without debug information, which names the path it was built at.
    arm-none-eabi-objcopy -O binary "$out/$image.elf" "$out/$image.bin"
done
(cd "$out" && sha256sum ./*.bin | tee SHA256SUMS)
