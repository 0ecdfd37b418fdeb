#!/usr/bin/env bash
# Every check of the project. `./ci.sh` runs the usual ones, `./ci.sh STEP…` just those named.
#
#   fmt       formatting
#   clippy    lints on the PC, warnings denied
#   test      all tests on the PC, overflow checks on
#   doc       documentation, warnings denied
#   embedded  the library for a Cortex-M4 without std, with lints
#   no-panic  a program that links only if the core cannot panic
#   bench     instructions a scan and static memory, against their budgets
#   demo      the demo and the commands of the README, headless
# and, slower, only when named:
#   fuzz      every fuzz target, 60 s each (FUZZ_SECONDS=n for another time)
#   deny      licences and advisories of the dependencies
#   fallback  `embedded` and `no-panic` with the distribution's own Rust instead of rustup's
#
# What is missing on a fresh Debian or Ubuntu machine is installed, and said.
set -euo pipefail
cd "$(dirname "$0")"

CORTEX_M4=thumbv7em-none-eabihf
USUAL=(fmt clippy test doc embedded no-panic bench demo)
EXTRA=(fuzz deny fallback)

say() { printf '\n== %s\n' "$*"; }
fail() { printf 'ci.sh: %s\n' "$*" >&2; exit 1; }

# apt_install PACKAGE… — as root, or through sudo.
apt_install() {
    command -v apt-get >/dev/null || fail "cannot install $* here: no apt-get; install it by hand"
    local root=()
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null || fail "cannot install $*: neither root nor sudo"
        root=(sudo)
    fi
    say "installing $*"
    "${root[@]}" apt-get update -qq
    DEBIAN_FRONTEND=noninteractive "${root[@]}" apt-get install -y -qq "$@" >/dev/null
}

need_command() { # need_command COMMAND PACKAGE
    command -v "$1" >/dev/null || apt_install "$2"
}

need_cargo() {
    [ -x "$HOME/.cargo/bin/cargo" ] && export PATH="$HOME/.cargo/bin:$PATH"
    need_command cc gcc
    if ! command -v cargo >/dev/null; then
        apt_install rustup && rustup toolchain install stable --profile default \
            || fail "no cargo, and rustup could not be installed: install Rust 1.90 or newer"
    fi
}

# Where the code for the board comes from: `rustup` has the target's core library, or the
# distribution's Rust builds it from its own sources.
EMBEDDED_RUST=
need_target() {
    if [ -z "$EMBEDDED_RUST" ]; then
        if [ "${KEHAI_EMBEDDED_RUST:-}" != distribution ] \
            && command -v rustup >/dev/null && rustup target add "$CORTEX_M4" 2>/dev/null; then
            EMBEDDED_RUST=rustup
        else
            say "no rustup target: the distribution's Rust builds core itself"
            [ -x /usr/bin/rustc ] && [ -d "$(/usr/bin/rustc --print sysroot)/lib/rustlib/src/rust/library" ] \
                || apt_install rustc-web cargo-web rust-web-src
            need_command ld.lld lld
            EMBEDDED_RUST=distribution
        fi
    fi
}

# embedded_cargo COMMAND ARGUMENTS… — cargo for the board, whichever Rust there is.
embedded_cargo() {
    need_target
    if [ "$EMBEDDED_RUST" = rustup ]; then
        cargo "$@" --target "$CORTEX_M4"
    else
        RUSTC=/usr/bin/rustc RUSTC_BOOTSTRAP=1 CARGO_TARGET_DIR=target/distribution \
            /usr/bin/cargo "$@" --target "$CORTEX_M4" \
            -Z build-std=core -Z build-std-features=compiler-builtins-mem \
            --config "target.$CORTEX_M4.linker='ld.lld'"
    fi
}

step_fmt() { cargo fmt --all --check; }

step_clippy() { cargo clippy --locked --workspace --all-targets --all-features -- -D warnings; }

step_test() { cargo test --locked --workspace; }

step_doc() { RUSTDOCFLAGS="-D warnings" cargo doc --locked --workspace --no-deps; }

step_embedded() {
    embedded_cargo build --locked -p kehai --lib
    embedded_cargo build --locked -p kehai --lib --features defmt
    if [ "$EMBEDDED_RUST" = rustup ]; then
        cargo clippy --locked -p kehai --lib --all-features --target "$CORTEX_M4" -- -D warnings
    fi
}

step_no_panic() {
    embedded_cargo build --locked --release -p kehai --bin no-panic --features proof
    say "no panic is reachable in the release build for $CORTEX_M4"
}

step_bench() {
    need_command valgrind valgrind
    cargo bench --locked -p kehai
}

step_demo() { cargo demo --headless --seconds 5; }

step_fuzz() {
    local cargo=(cargo) flags=(--sanitizer none)
    command -v cargo-fuzz >/dev/null || { say "installing cargo-fuzz"; cargo install --locked cargo-fuzz; }
    if cargo +nightly --version >/dev/null 2>&1; then
        cargo=(cargo +nightly) flags=()
    else
        export RUSTC_BOOTSTRAP=1
    fi
    need_command c++ g++
    local target
    for target in $("${cargo[@]}" fuzz list); do
        say "fuzzing $target for ${FUZZ_SECONDS:-60} s"
        "${cargo[@]}" fuzz run "${flags[@]}" "$target" -- -max_total_time="${FUZZ_SECONDS:-60}" -print_final_stats=1
    done
}

step_deny() {
    command -v cargo-deny >/dev/null || { say "installing cargo-deny"; cargo install --locked cargo-deny; }
    cargo deny check bans licenses sources
}

step_fallback() {
    EMBEDDED_RUST='' KEHAI_EMBEDDED_RUST=distribution
    step_embedded
    step_no_panic
}

case "${1:-}" in -h | --help) sed -n '2,/^set -/{/^#/s/^# \{0,1\}//p}' "$0"; exit 0 ;; esac

steps=("$@")
[ ${#steps[@]} -gt 0 ] || steps=("${USUAL[@]}")
for step in "${steps[@]}"; do
    printf '%s\n' "${USUAL[@]}" "${EXTRA[@]}" | grep -qxF -- "$step" \
        || fail "unknown step $step: one of ${USUAL[*]} ${EXTRA[*]}"
done
need_cargo
for step in "${steps[@]}"; do
    say "$step"
    "step_${step//-/_}"
done
say "passed: ${steps[*]}"
