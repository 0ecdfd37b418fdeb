#!/usr/bin/env bash
# The Debian package of the tracker: packaging/package.sh makes target/package/kehai-tracker_VERSION_ARCH.deb and says
# where it is, with the bill of materials in it. It needs cargo-deb, cargo-cyclonedx and dpkg-dev, and for the firmware the
# boards' target of rustup, binutils-arm-none-eabi and python3; ./ci.sh package installs them, and tries the package in a bare
# Debian.
# In it is the firmware of each board, for the map to hand out; KEHAI_WITHOUT_FIRMWARE=1 makes a package without, where there is no
# target of rustup.
set -euo pipefail
cd "$(dirname "$0")/.."
. packaging/boards.sh

# Asked before the build, which takes minutes.
missing=()
need() { # need PROGRAM HOW-TO-INSTALL-IT
    command -v "$1" >/dev/null || missing+=("$2")
}
cargo deb --version >/dev/null 2>&1 || missing+=("cargo install --locked cargo-deb")
cargo cyclonedx --version >/dev/null 2>&1 || missing+=("cargo install --locked cargo-cyclonedx")
need dpkg-shlibdeps "apt install dpkg-dev"
without=
if [ -z "${KEHAI_WITHOUT_FIRMWARE:-}" ]; then
    # rustc says where the target's libraries would be, also where they are not.
    [ -d "$(rustc --print target-libdir --target "$CORTEX_M33")" ] || missing+=("rustup target add $CORTEX_M33")
    need arm-none-eabi-objcopy "apt install binutils-arm-none-eabi"
    need python3 "apt install python3"
    without="; KEHAI_WITHOUT_FIRMWARE=1 makes it without firmware, and needs no target and no binutils"
fi
if [ "${#missing[@]}" -gt 0 ]; then
    printf -v list ', %s' "${missing[@]}"
    echo "package.sh: something is missing; first: ${list:2}$without" >&2
    exit 1
fi

out=target/package
rm -rf "$out" && mkdir -p "$out"
mkdir "$out/firmware"
cp packaging/udev/69-kehai-probes.rules "$out/firmware"
if [ -z "${KEHAI_WITHOUT_FIRMWARE:-}" ]; then
    packaging/firmware.sh
    find target/firmware -type f \( -name '*-complete.*' -o -name '*.elf' ! -name '*-boot.elf' -o -name MAKERS \) \
        -exec cp -t "$out/firmware" {} +
fi
(cd "$out/firmware" && sha256sum -- * >SHA256SUMS)
cargo build --locked --profile bench -p host-tracker --bin kehai-tracker
tracker=${CARGO_TARGET_DIR:-target}/release/kehai-tracker
"$tracker" completions bash >"$out/kehai-tracker.bash"
"$tracker" completions zsh >"$out/_kehai-tracker"
"$tracker" completions fish >"$out/kehai-tracker.fish"
"$tracker" man "$out/man"
packaging/sbom.sh host-tracker/Cargo.toml "$(rustc -vV | sed -n 's/^host: //p')" "" "$out/kehai-tracker.cdx.json"
# A release of the same commit is the same file.
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH
cargo deb --locked --no-build --strip --quiet -p host-tracker --output "$out/"
