#!/usr/bin/env bash
# The bill of materials of a program, as CycloneDX: every crate that it is made of, with version, licence and source.
#
#   packaging/sbom.sh MANIFEST TARGET FEATURES OUT.cdx.json
#
# It needs cargo-cyclonedx; ./ci.sh package installs that. The same commit gives the same bytes.
set -euo pipefail
cd "$(dirname "$0")/.."

manifest=$1 target=$2 features=$3 out=$4
# The tool writes a file beside each manifest of the workspace.
name=kehai-sbom-$$
trap 'find . -path ./target -prune -o -name "$name.json" -exec rm {} +' EXIT
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH
cargo cyclonedx --quiet --manifest-path "$manifest" --format json --spec-version 1.5 --target "$target" \
    --features "$features" --override-filename "$name"
# Paths of this machine say nothing to others.
sed "s#path+file://$PWD#path+file:///kehai#g" "$(dirname "$manifest")/$name.json" >"$out"
