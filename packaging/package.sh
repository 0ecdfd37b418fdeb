#!/usr/bin/env bash
# The Debian package of the tracker: packaging/package.sh makes target/package/kehai-tracker_VERSION_ARCH.deb and says
# where it is, with the bill of materials in it. It needs cargo-deb and cargo-cyclonedx; ./ci.sh package installs them,
# and tries the package in a bare Debian.
# In it is the firmware of each board, for the map to hand out; KEHAI_WITHOUT_FIRMWARE=1 makes a package without, where there is no
# target of rustup.
set -euo pipefail
cd "$(dirname "$0")/.."

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
