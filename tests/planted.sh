#!/usr/bin/env bash
# Plants one defect after the other and asks whether the check that should find it fails: tests/planted.sh [PATCH…].
# A patch of tests/planted/ opens with what it breaks and, after "Judge:", the command that must fail. Each command is first run
# without a defect, and must pass. A patch that no longer applies fails it, too; tests/planted.sh --check looks only for that.
set -euo pipefail
cd "$(dirname "$0")/.."
fail() { echo "tests/planted.sh: $*" >&2; exit 1; }

patches=(tests/planted/*.patch)
if [ "${1:-}" = --check ]; then
    for patch in "${patches[@]}"; do git apply --check "$patch" || fail "make $patch anew"; done
    exit
fi
[ $# -eq 0 ] || patches=("$@")
[ -z "$(git status --porcelain --untracked-files=no)" ] || fail "commit what is changed first"
export CI=true
log=$(mktemp)
planted=
trap '[ -z "$planted" ] || git apply -R "$planted"; rm -f "$log"' EXIT

missed=0
for patch in "${patches[@]}"; do
    judge=$(sed -n 's/^Judge: //p' "$patch")
    [ -n "$judge" ] || fail "$patch names no command after Judge:"
    $judge >"$log" 2>&1 || { tail -n 30 "$log"; fail "$judge fails without a defect"; }
    git apply "$patch"
    planted=$patch
    begin_s=$SECONDS
    if $judge >"$log" 2>&1; then
        echo "MISSED  $(basename "$patch" .patch)"
        missed=1
    elif grep -q '^error: could not compile' "$log"; then
        cat "$log"
        fail "$patch does not compile"
    else
        echo "found   $(basename "$patch" .patch): $judge, $((SECONDS - begin_s)) s"
    fi
    git apply -R "$patch"
    planted=
done
exit "$missed"
