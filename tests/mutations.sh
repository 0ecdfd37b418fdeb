#!/usr/bin/env bash
# Takes out each repair of the tracker's intake, one after the other, and asks whether the sequences of
# tracking/tests/intake or the scenes of tracking/src/registry/tests.rs and tracking/tests/people.rs find it:
# tests/mutations.sh [SEQUENCES]. A patch that no longer applies fails it, too; tests/mutations.sh --check looks only for
# that.
set -euo pipefail
cd "$(dirname "$0")/.."
if [ "${1:-}" = --check ]; then
    for patch in tests/mutations/*.patch; do
        git apply --check "$patch" || { echo "tests/mutations.sh: make $patch anew" >&2; exit 1; }
    done
    exit
fi
export KEHAI_SEQUENCES=${1:-2000}

[ -z "$(git status --porcelain tracking)" ] || { echo "tests/mutations.sh: commit what is changed in tracking/ first" >&2; exit 1; }
log=$(mktemp)
trap 'git checkout -q -- tracking/src; rm -f "$log"' EXIT

run() {
    cargo test -q --locked -p kehai-tracking --test intake whatever_is_forged -- --nocapture >"$log" 2>&1 \
        && cargo test -q --locked -p kehai-tracking --lib registry:: >>"$log" 2>&1 \
        && cargo test -q --locked -p kehai-tracking --test people >>"$log" 2>&1
}

run || { cat "$log"; echo "tests/mutations.sh: the sequences fail without a mutation" >&2; exit 1; }
missed=0
for patch in tests/mutations/*.patch; do
    git apply "$patch"
    begin_s=$SECONDS
    if run; then
        echo "MISSED  $(basename "$patch" .patch)"
        missed=1
    elif violations=$(grep -o '[0-9]* violations' "$log"); then
        echo "found   $(basename "$patch" .patch): $violations, $((SECONDS - begin_s)) s"
    else
        cat "$log"
        echo "tests/mutations.sh: $patch does not compile" >&2
        exit 1
    fi
    git apply -R "$patch"
done
exit "$missed"
