#!/usr/bin/env bash
# Shows that two commits give the same output, byte for byte: what a move or a renaming must leave as it is.
#
#   tests/same-output.sh OLD_COMMIT NEW_COMMIT [--seeds N | --all] [--only PATTERN]
#
#   --seeds N        so many seeds of every case, from 10000 on [default: 3; of scenes of an hour: 1]
#   --all            every seed of every experiment: about three hours of two cores a commit
#   --only PATTERN   only cases whose name matches this extended regular expression, such as '^recording|^scene H 7'
#
# What is compared, each by its SHA-256:
#
#   recording FILE        ../shared/recordings/*.csv through sensor, driver and pipeline: all candidates
#   case NAME             ../shared/cases/*, recordings of another world with their site: all candidates and tracks
#   scene NAME TRACKER    every case of every table of docs/accuracy.md: candidates, truth, all tracks
#   passage ROW           the guarded door and paper A's experiment: every figure of every seed, by row
#   poses                 calibration by walking: every figure of every seed
#
# Both commits are built in worktrees under target/same-output; digests are kept there by commit, so that a second
# comparison with the same commit takes them, and a comparison that was cut goes on. A case that one of the
# two does not have is named and counts as a difference: rows that were added or removed must be seen.
#
# Exit status: 0 the same, 1 something differs, 2 it could not be compared.
set -euo pipefail
cd "$(dirname "$0")/.."
ROOT=$PWD
KEPT=$ROOT/target/same-output
SHARED=${KEHAI_SHARED:-$ROOT/../shared}

fail() { printf 'same-output: %s\n' "$*" >&2; exit 2; }
usage() { sed -n '2,/^set -/{/^#/s/^# \{0,1\}//p}' "$0"; }

commits=() seeds=3 all='' only=.
while [ $# -gt 0 ]; do
    case $1 in
        -h | --help) usage; exit 0 ;;
        --seeds) seeds=${2:?--seeds needs a number}; shift ;;
        --all) all=1 ;;
        --only) only=${2:?--only needs a pattern}; shift ;;
        -*) fail "unknown option $1; see --help" ;;
        *) commits+=("$(git rev-parse --verify --quiet "$1^{commit}")") || fail "$1 is no commit" ;;
    esac
    shift
done
[ ${#commits[@]} = 2 ] || { usage >&2; exit 2; }
[[ $seeds =~ ^[1-9][0-9]*$ ]] || fail "--seeds $seeds: a number from 1 on"
[ -d "$SHARED/recordings" ] || fail "$SHARED/recordings is missing: set KEHAI_SHARED to the folder that holds it"

# build COMMIT — leaves its kehai-sim in $KEPT/COMMIT.
build() {
    local folder=$KEPT/$1
    [ -x "$folder/kehai-sim" ] && return
    printf 'building %s\n' "$(git log -1 --format='%h %s' "$1")" >&2
    mkdir -p "$folder"
    [ -d "$folder/tree" ] || git worktree add --force --detach --quiet "$folder/tree" "$1"
    (cd "$folder/tree" && CARGO_TARGET_DIR=$KEPT/build cargo build --locked --quiet --profile bench \
        -p host-sim --bin kehai-sim) || fail "$1 cannot be built"
    cp "$KEPT/build/release/kehai-sim" "$folder/kehai-sim"
    git worktree remove --force "$folder/tree"
}

# jobs — a line for each run: its name, a tab, and how it is run. Only options that commit c84fdb3 has.
jobs() {
    local path name learn
    for path in "$SHARED"/recordings/*.csv; do
        name=$(basename "$path" .csv)
        [[ $name == *_legs ]] && continue
        for learn in 60 all; do
            printf 'recording %s, learns %s\treplay %s --learn %s --json\n' "$name" "$learn" "$path" "$learn"
        done
    done
    for path in "$SHARED"/cases/*/site.toml; do
        [ -e "$path" ] || continue
        printf 'case %s\tcase %s\n' "$(basename "$(dirname "$path")")" "$(dirname "$path")"
    done
    local people tracker own="kehai" every="kehai kehai-rules lee lee-38 particle" ideas="kehai" idea
    for idea in annealing best-quarter apart room standing surprise conservation datum soft-edge names entries depth arms \
        company limbs inside openings tow put-down reappearance missing; do
        ideas+=" kehai-without-$idea"
    done
    for people in 1 2 3 4 5 6 7; do
        scenes 200 "$every" "D $people" door-area --people "$people" --condition D
        scenes 200 "$every" "H $people" door-area --people "$people" --condition H
        [ "$people" -le 5 ] && scenes 200 "$every" "T $people" door-area --people "$people" --condition T
        [ "$people" -ge 2 ] && scenes 200 "$every" "P $people" door-area --people "$people" --condition P
        [ "$people" -ge 5 ] && scenes 50 "${ideas#kehai }" "H $people" door-area --people "$people" --condition H
    done
    local scene
    for scene in one-of-two together chair-back chair-legs suitcase pushchair wheelchair backpack crouching \
        embracing child; do
        scenes 200 "kehai kehai-rules lee particle" "$scene" "$scene"
    done
    scenes 200 "$own" touching touching
    scenes 10 "$every" "home, torso" home --section torso --seconds 90
    scenes 10 "$every" "home, thighs" home --section thighs --seconds 90
    scenes 48 "kehai lee" movers movers
    scenes 76 "kehai lee" facing facing
    scenes 200 "kehai lee" mirror mirror
    scenes 100 "kehai lee" "H 5, disturbed" door-area --people 5 --condition H --network disturbed
    # Scenes of an hour: one seed does for a sample.
    seeds=1 scenes 100 "$own" standing standing
    local seed last
    last=$(last_of 200)
    for ((seed = 10000; seed <= last; seed++)); do
        printf 'passage, seed %s\texperiment passages %s\n' "$seed" "$seed"
    done
    last=$(last_of 50)
    for ((seed = 10000; seed <= last; seed++)); do
        printf 'passage of paper A, seed %s\texperiment paper-a %s\n' "$seed" "$seed"
    done
    # A seed of poses is 22 runs of up to four minutes: one does for a sample.
    last=$(seeds=1 last_of 40)
    for ((seed = 10000; seed <= last; seed++)); do
        printf 'poses, seed %s\texperiment poses %s\n' "$seed" "$seed"
    done
}

# last_of RUNS — the last seed of a case whose table has so many.
last_of() { echo $((9999 + (${#all} ? $1 : (seeds < $1 ? seeds : $1)))); }

# scenes RUNS TRACKERS NAME SCENE ARGUMENTS…
scenes() {
    local runs=$1 trackers=$2 name=$3 tracker seed last
    last=$(last_of "$runs")
    for tracker in $trackers; do
        for ((seed = 10000; seed <= last; seed++)); do
            printf 'scene %s, %s, seed %s\tscene %s --seed %s --tracker %s\n' \
                "$name" "$tracker" "$seed" "${*:4}" "$seed" "$tracker"
        done
    done
}

# one FOLDER JOB — runs it with the program of that folder, and adds its digests to the folder's file.
one() {
    local folder=$1 name=${2%%$'\t'*} words out row
    read -ra words <<<"${2#*$'\t'}"
    out=$(mktemp -d "$folder/run.XXXXXX")
    local sim=("$folder/kehai-sim")
    case ${words[0]} in
        replay) "${sim[@]}" "${words[@]}" >"$out/candidates.jsonl" 2>"$out/said" ;;
        case)
            local recordings=() path
            for path in "${words[1]}"/*.csv; do recordings+=("$(basename "$path" .csv)=$path"); done
            "${sim[@]}" replay --site "${words[1]}/site.toml" "${recordings[@]}" --learn 60 --out "$out" \
                >/dev/null 2>"$out/said"
            ;;
        scene) "${sim[@]}" "${words[@]}" --out "$out" >/dev/null 2>"$out/said" ;;
        experiment)
            "${sim[@]}" experiment "${words[1]}" --seeds "${words[2]}-${words[2]}" --out "$out" >/dev/null 2>"$out/said"
            ;;
    esac || {
        printf '%s: %s\n' "$name" "$(tail -n 1 "$out/said")" >>"$folder/failed"
        rm -r "$out"
        return 0
    }
    if [ -e "$out/passages-runs.csv" ] || [ -e "$out/paper-a-runs.csv" ]; then
        # By row of the table, so that a new row makes none of the others differ.
        awk -F, -v out="$out" '
            NR > 1 { row = $0; sub(/,kehai,.*/, "", row); gsub(/[^A-Za-z0-9]+/, "-", row); print > (out "/" row ".row") }
        ' "$out"/*-runs.csv
        rm "$out"/*.csv
    fi
    # Later commits call every run of poses so, and poses.csv the figures of all of them.
    [ ! -e "$out/poses-runs.csv" ] || mv "$out/poses-runs.csv" "$out/poses.csv"
    # One write a job: they do not mix.
    {
        for row in "$out"/*.jsonl "$out"/*.row "$out"/poses.csv; do
            [ -e "$row" ] || continue
            printf '%s: %s\t%s\n' "$name" "$(basename "$row" .row)" "$(sha256sum <"$row" | cut -c 1-64)"
        done
        printf '%s\tdone\n' "$name"
    } >"$out/digests"
    cat "$out/digests" >>"$folder/digests"
    rm -r "$out"
    [ ! -t 2 ] || printf '\r\033[K%s' "$name" >&2
}

# run COMMIT — every job whose digests are not there yet.
run() {
    local folder=$KEPT/$1
    rm -rf "$folder"/run.* "$folder/failed"
    touch "$folder/digests"
    awk -F'\t' 'FILENAME == ARGV[1] { if ($2 == "done") done[$1] = 1; next } !($1 in done)' \
        "$folder/digests" "$KEPT/jobs" >"$folder/jobs"
    printf '%s: %s runs, %s of them kept from before\n' "${1:0:12}" "$(wc -l <"$KEPT/jobs")" \
        "$(($(wc -l <"$KEPT/jobs") - $(wc -l <"$folder/jobs")))" >&2
    # An experiment uses all cores itself, a replay and a scene one.
    tr '\n' '\0' <"$folder/jobs" | xargs -0 -r -P "$(nproc)" -n 1 bash -c 'one "$@"' one "$folder"
    [ ! -t 2 ] || printf '\r\033[K' >&2
}
export -f one

mkdir -p "$KEPT"
jobs | grep -E -- "$only" >"$KEPT/jobs" || fail "no case matches $only"
for commit in "${commits[@]}"; do build "$commit"; done
for commit in "${commits[@]}"; do run "$commit"; done

# Of both only what was asked for this time.
wanted() {
    awk -F'\t' 'FILENAME == ARGV[1] { wanted[$1] = 1; next } $2 != "done" { name = $1; sub(/: [^:]*$/, "", name); if (name in wanted) print }' \
        "$KEPT/jobs" "$KEPT/$1/digests" | sort -u
}
old=$(mktemp) new=$(mktemp)
trap 'rm -f "$old" "$new"' EXIT
wanted "${commits[0]}" >"$old"
wanted "${commits[1]}" >"$new"
failed=''
for commit in "${commits[@]}"; do
    [ -s "$KEPT/$commit/failed" ] || continue
    failed=1
    sed "s/^/${commit:0:12} failed: /" "$KEPT/$commit/failed"
done
differences=$(join -t $'\t' -a 1 -a 2 -e missing -o 0,1.2,2.2 "$old" "$new" | awk -F'\t' '$2 != $3' |
    awk -F'\t' '{ print ($2 == "missing" ? "only in NEW" : $3 == "missing" ? "only in OLD" : "differs"), "\t" $1 }')
same=$(comm -12 "$old" "$new" | wc -l)
if [ -n "$differences" ]; then
    printf '%s\n' "$differences"
    printf 'NOT the same: %s of %s outputs differ between %s and %s\n' "$(wc -l <<<"$differences")" \
        "$((same + $(wc -l <<<"$differences")))" "${commits[0]:0:12}" "${commits[1]:0:12}"
    exit 1
fi
[ -z "$failed" ] || fail "the runs above failed, and are not compared"
[ "$same" -gt 0 ] || fail "nothing was compared"
printf 'the same: all %s outputs of %s and %s\n' "$same" "${commits[0]:0:12}" "${commits[1]:0:12}"
