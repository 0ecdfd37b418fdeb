#!/usr/bin/env bash
# What is handed out of a version: packaging/release.sh puts into target/release-files/kehai-VERSION/
#
#   the firmware of each board     of packaging/firmware.sh, which has made it
#   kehai-tracker_….deb            of packaging/package.sh, which has made it
#   *.cdx.json, THIRD-PARTY.md     what the programs are made of; LICENSE-*
#   69-kehai-probes.rules          for udev, for who flashes a board
#   NOTES.md                       the newest part of CHANGELOG.md
#   SHA256SUMS                     of all of them
#
# ./ci.sh release makes all of it, and tries it. The same commit gives the same bytes.
set -euo pipefail
cd "$(dirname "$0")/.."

version=$(sed -n '/^\[workspace.package\]/,/^\[/s/^version = "\(.*\)"/\1/p' Cargo.toml)
[ -n "$version" ] || { echo "release.sh: Cargo.toml names no version" >&2; exit 1; }
# Whose updates the boot loaders take, as they were built: what the environment names now may be another's.
makers=target/firmware/MAKERS
[ -s "$makers" ] || { echo "release.sh: no $makers: packaging/firmware.sh makes it" >&2; exit 1; }
development=$(sed -n '/const DEVELOPMENT/,/];/s/0x//gp' src/update/maker.rs | tr -cd 0-9a-f)
[ "${#development}" = 64 ] || { echo "release.sh: src/update/maker.rs tells no development key" >&2; exit 1; }
out=target/release-files/kehai-$version
rm -rf target/release-files && mkdir -p "$out"

# QEMU's board is for tests.
find target/firmware -type f ! -name SHA256SUMS ! -name 'mps2-*' -exec cp -t "$out" {} +
cp target/package/*.deb target/package/*.cdx.json LICENSE-APACHE LICENSE-MIT packaging/udev/69-kehai-probes.rules "$out"
python3 packaging/third_party.py target/package/*.cdx.json >"$out/THIRD-PARTY.md"
{
    printf '# kehai %s\n\n' "$version"
    printf 'Flashing a board with these files: docs/hardware.md, part 4. `sha256sum --check SHA256SUMS` compares them.\n\n'
    if grep -qixE "[[:space:]]*(development|$development)[[:space:]]*" "$makers"; then
        printf '**The boot loaders of this release take updates signed with the development key, which everybody has** (docs/security.md).\n\n'
    fi
    awk '/^## \[/ { parts++ } parts == 1' CHANGELOG.md
} >"$out/NOTES.md"
(cd "$out" && sha256sum -- * >SHA256SUMS && cat SHA256SUMS)
