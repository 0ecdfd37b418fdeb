#!/usr/bin/env bash
# Every check of the project. `./ci.sh` runs the usual ones, `./ci.sh STEP…` just those named.
#
#   fmt       formatting
#   clippy    lints on the PC, warnings denied
#   lint      formatting and lints of the web page's JavaScript, CSS and HTML, of TypeScript and of Python
#   structure no circle of imports between the files or the folders of a crate, no crate that depends upward; patches of
#             tests/mutations and tests/planted apply
#   test      all tests on the PC, overflow checks on
#   doc       documentation, warnings denied
#   embedded  the library for a Cortex-M4 without std, with lints
#   no-panic  a program that links only if the core cannot panic
#   boards    the image and the boot loader of each board, with lints
#   budget    flash, static memory and calls of panicking functions of each image, instructions a scan on a
#             Cortex-M4 and the stack in QEMU, against their budgets
#   qemu      the real image in QEMU, through its tests
#   bench     instructions a scan, a report and a depth frame, and static memory, against their budgets
#   demo      the demo and the commands of the README, headless
#   figures   some seeds of every table in docs/, run by run as they were printed
#   deny      licences and sources of the dependencies
#   fuzz      every fuzz target, 10 s each (FUZZ_SECONDS=n for another time)
#   package   the tracker's Debian package, installed in a bare Debian 12, its service run, purged; its container built and
#             run; bills of materials
#   reproducible  the firmware of one board, built in two places: the same bytes; its HEX, BIN and UF2 files, read back
# and, slower, only when named:
#   release   the files of a release, in target/release-files: firmware of each board, read back and started in QEMU, the package,
#             bills of materials, notes. It builds little after `package` and `reproducible`
#   targets   the same datagrams give the same tracks, bit by bit, on x86-64 and on i686: 32 bits, another library of mathematics
#   fallback  `embedded` and `no-panic` with the distribution's own Rust instead of rustup's
#   advisories  known weaknesses of the dependencies, by cargo-deny and its database (github.com)
#
# What is missing on a fresh Debian or Ubuntu machine is installed, and said. After each step it says how long that
# took. A check that could not judge is named last, and fails the run; with CI set it fails at once.
set -euo pipefail
cd "$(dirname "$0")"

# A machine that builds once gains nothing from compiling in increments, nor from debug information of what it runs itself (panics name
# their line without it), and both take gigabytes of its disk.
[ -z "${CI:-}" ] || export CARGO_INCREMENTAL=0 CARGO_PROFILE_DEV_DEBUG=0 CARGO_PROFILE_BENCH_DEBUG=0

. packaging/boards.sh
# The images; `mps2-an386-floor` is that board beside a SensFloor.
BOARDS=(mps2-an386 mps2-an386-floor nucleo-h563zi w5500-evb-pico2)
# Those with a boot loader of their own.
LOADERS=(mps2-an386 nucleo-h563zi w5500-evb-pico2)
# What there is in front of the slots.
LOADER_BUDGET=$((48 * 1024))
# The slot of an image, 256 KiB, less an eighth: a slot cannot grow in the field, images do.
FLASH_BUDGET=$((224 * 1024))
MEMORY_BUDGET=$((112 * 1024)) # without the stack
# Instructions of the dearest scan with two people walking, of 682 and 1081 steps.
INSTRUCTIONS_BUDGET_682=60000
INSTRUCTIONS_BUDGET_1081=95000
# Instructions to seal a report with two people, 220 bytes, and to refuse a forged datagram as long as a subscribe.
SEAL_BUDGET=15000
REFUSE_BUDGET=4000
# Calls of panicking functions in each image: what the proof of the core does not cover. Only ever lowered.
declare -A PANICS_BUDGET=([mps2-an386]=229 [mps2-an386-floor]=225 [nucleo-h563zi]=273 [w5500-evb-pico2]=313)
# Both come from PyPI as one binary in a wheel: a bare Debian has Python, but no Node.js.
LINTERS=(deno==2.9.8 ruff==0.17.6)
# What the example of the sealed wire in Python needs, the client, and the tests of the OpenAPI document, of HEX files, of what a
# recording shows in Foxglove, of the queries of docs/analytics.md, and of what is published to ROS 2.
PYTHON_TESTS=(cryptography==48.0.0 websockets==17.4 openapi-spec-validator==0.9.0 intelhex==2.3.0
    mcap==1.6.0 mcap-protobuf-support==0.6.0 foxglove-schemas-protobuf==0.4.0 jsonschema==4.26.0 duckdb==2.0.1
    zenoh-ros2-sdk==0.1.8 rosbags==0.11.9)
USUAL=(fmt clippy lint structure test doc embedded no-panic boards budget qemu bench demo figures deny fuzz package reproducible)
EXTRA=(release targets fallback advisories)

say() { printf '\n== %s\n' "$*"; }
fail() { printf 'ci.sh: %s\n' "$*" >&2; exit 1; }

# What could not be judged, a line each: from here, and from tests (crate test-support).
KEHAI_NOT_JUDGED=$(mktemp)
export KEHAI_NOT_JUDGED
not_judged() {
    [ -z "${CI:-}" ] || fail "NOT JUDGED: $*"
    printf 'NOT JUDGED: %s\n' "$*" | tee -a "$KEHAI_NOT_JUDGED"
}

# The last lines of every run that has not passed.
at_exit() {
    local status=$?
    if [ -s "$KEHAI_NOT_JUDGED" ]; then
        printf '\nci.sh: failed, as these could not be judged:\n' >&2
        sort -u "$KEHAI_NOT_JUDGED" >&2
        [ "$status" -ne 0 ] || status=1
    fi
    rm -f "$KEHAI_NOT_JUDGED"
    exit "$status"
}
trap at_exit EXIT

# Gigabytes that the build takes, and those that are left on its disk.
disk() {
    mkdir -p target
    echo "target/ has $(du -s --block-size=GB target | cut -f 1), $(df --block-size=GB --output=avail target | tail -1 | tr -d ' ') are free"
}

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
            && command -v rustup >/dev/null && rustup target add "$CORTEX_M4" "$CORTEX_M33" 2>/dev/null; then
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

# embedded_cargo TARGET COMMAND ARGUMENTS… — cargo for a microcontroller, whichever Rust there is.
embedded_cargo() {
    need_target
    if [ "$EMBEDDED_RUST" = rustup ]; then
        firmware_cargo "$2" --target "$1" "${@:3}"
    else
        RUSTC=/usr/bin/rustc RUSTC_BOOTSTRAP=1 CARGO_TARGET_DIR=target/distribution \
            /usr/bin/cargo "$2" --target "$1" \
            -Z build-std=core -Z build-std-features=compiler-builtins-mem \
            --config "target.$1.linker='ld.lld'" "${@:3}"
    fi
}

# image_cargo COMMAND IMAGE FEATURES ARGUMENTS… — the same for a program of a board.
image_cargo() {
    embedded_cargo "$(board_target "$2")" "$1" --locked --release -p kehai --bin "$2" --features "$3" "${@:4}"
}

# board_cargo COMMAND BOARD ARGUMENTS… — for a board's image.
board_cargo() { image_cargo "$1" "$2" "board-${2%-floor}" "${@:3}"; }

# loader_cargo COMMAND BOARD ARGUMENTS… — for a board's boot loader.
loader_cargo() { image_cargo "$1" "$2-boot" "board-$2,boot" "${@:3}"; }

# bench_cargo COMMAND ARGUMENTS… — for the program that counts a scan's instructions in QEMU.
bench_cargo() { image_cargo "$1" mps2-an386-bench board-mps2-an386 "${@:2}"; }

# image IMAGE — where it is once it is built.
image() {
    local folder=${CARGO_TARGET_DIR:-target}
    [ "$EMBEDDED_RUST" = rustup ] || folder=target/distribution
    realpath -m "$(built "$1" "$folder")"
}

need_qemu() {
    need_command qemu-system-arm qemu-system-arm
    # The image in the active slot has the name of the one that QEMU loads at 0: it is built first, and copied.
    KEHAI_QEMU_SLOT_IMAGE=$PWD/target/mps2-an386-in-slot
    image_cargo build mps2-an386 board-mps2-an386,in-slot
    mkdir -p target
    cp "$(image mps2-an386)" "$KEHAI_QEMU_SLOT_IMAGE"
    board_cargo build mps2-an386
    board_cargo build mps2-an386-floor
    loader_cargo build mps2-an386
    KEHAI_QEMU_IMAGE=$(image mps2-an386)
    KEHAI_QEMU_FLOOR_IMAGE=$(image mps2-an386-floor)
    KEHAI_QEMU_BOOT=$(image mps2-an386-boot)
    export KEHAI_QEMU_IMAGE KEHAI_QEMU_FLOOR_IMAGE KEHAI_QEMU_BOOT KEHAI_QEMU_SLOT_IMAGE
}

# qemu_test ARGUMENTS… — the tests of the image. Of the workspace, as step `test` builds them: its packages together ask for other
# features of their dependencies than the core alone, which would be compiled once more.
qemu_test() { CI=true cargo test --locked --workspace --test qemu "$@"; }

# The live map is clicked through in a real browser.
need_chromium() { need_command chromium chromium; }

# The scores are compared with those of Python packages, kept in an environment under target/.
need_python() {
    python3 -c 'import venv, ensurepip' 2>/dev/null || apt_install python3-venv
}

# need_packages FOLDER PACKAGE… — an environment of Python with these packages, made anew when a version changes.
need_packages() {
    local home=$1
    shift
    [ "$(cat "$home/versions" 2>/dev/null)" != "$*" ] || return 0
    need_python
    say "installing $*"
    python3 -m venv --clear "$home"
    "$home/bin/pip" install --quiet --disable-pip-version-check "$@"
    echo "$*" >"$home/versions"
}

need_linters() { need_packages target/lint "${LINTERS[@]}"; }

need_python_tests() {
    need_packages target/python-tests "${PYTHON_TESTS[@]}"
    export KEHAI_PYTHON=$PWD/target/python-tests/bin/python3
}

# run_deno ARGUMENTS… — Deno of the linters, with a cache under target/.
run_deno() { DENO_DIR=$PWD/target/lint/cache DENO_NO_UPDATE_CHECK=1 target/lint/bin/deno "$@"; }

# need_script FILE OUT — what a script of tests/ takes from npm, as deno.lock pins it.
need_script() {
    need_linters
    run_deno run --quiet --frozen "tests/$1" >"$2"
}

# Foxglove's own JSON Schemas.
need_foxglove() {
    export KEHAI_FOXGLOVE_SCHEMAS=$PWD/target/foxglove.json
    need_script foxglove.ts "$KEHAI_FOXGLOVE_SCHEMAS"
}

# The script by which pages are judged.
need_axe() {
    export KEHAI_AXE=$PWD/target/axe.js
    need_script axe.ts "$KEHAI_AXE"
}

# Debian puts the broker where only root looks.
need_mosquitto() {
    [ -x /usr/sbin/mosquitto ] || need_command mosquitto mosquitto
}

step_fmt() { cargo fmt --all --check; }

step_clippy() {
    cargo clippy --locked --workspace --all-targets --all-features -- -D warnings
    # A tracker for one site, without Zenoh and Foxglove.
    cargo clippy --locked -p host-tracker --no-default-features -- -D warnings
    # The fuzz targets are a package of their own, and share files with tests of the workspace.
    cargo clippy --locked --manifest-path fuzz/Cargo.toml --target-dir target -- -D warnings
}

step_lint() {
    need_linters
    target/lint/bin/ruff format --check
    target/lint/bin/ruff check
    run_deno fmt --check
    run_deno lint
    run_deno check clients/typescript/*.ts tests/*.ts
    run_deno run --allow-read tests/asyncapi.ts
    run_deno test --quiet --allow-read=host-tracker,docs host-tracker/
    run_deno test --quiet --allow-net=127.0.0.1 --allow-run tests/people.ts
}

step_structure() {
    cargo run --locked --quiet -p structure
    tests/mutations.sh --check
    tests/planted.sh --check
}

QEMU_TESTED=
step_test() {
    # Without QEMU, Python, a broker, Chromium or a network of its own, their tests are skipped on a developer's machine, but fail here.
    [ -z "${CI:-}" ] || { need_qemu; need_python; need_python_tests; need_foxglove; need_axe; need_mosquitto; need_chromium; need_command ip iproute2; need_command jq jq; }
    need_command python3 python3
    # What comes after the tests is built with what they leave of the processor.
    local meanwhile=()
    if [ -n "${CI:-}" ]; then
        meanwhile=(
            --meanwhile "cargo bench --locked --no-run -p kehai"
            --meanwhile "cargo bench --locked --no-run -p host-sim"
            --meanwhile "cargo build --locked --profile bench -p host-tracker --bin kehai-tracker"
        )
        has_deb || meanwhile+=(--meanwhile "$INSTALL_DEB")
        has_cyclonedx || meanwhile+=(--meanwhile "$INSTALL_CYCLONEDX")
    fi
    python3 tests/side_by_side.py "${meanwhile[@]}"
    QEMU_TESTED=${CI:-}
}

# On another architecture sine and logarithm come from another library: what decides uses libm's alone.
step_targets() {
    local other=i686-unknown-linux-gnu own others
    if ! command -v rustup >/dev/null || ! rustup target add "$other" 2>/dev/null; then
        not_judged "tracks on another architecture: rustup has no $other here"
        return
    fi
    # What links and runs programs of 32 bits.
    [ -n "$(find /usr/lib/gcc -path '*/32/crtbegin.o' -print -quit)" ] || apt_install gcc-multilib
    digests() { cargo test --locked -p kehai-tracking --test everywhere "$@" -- --nocapture | grep '^digest'; }
    own=$(digests)
    others=$(digests --target "$other")
    printf '%s\n' "$own"
    [ "$own" = "$others" ] || fail "on $other: $others"
}

step_doc() { RUSTDOCFLAGS="-D warnings" cargo doc --locked --workspace --no-deps; }

step_embedded() {
    embedded_cargo "$CORTEX_M4" build --locked -p kehai --lib
    embedded_cargo "$CORTEX_M4" build --locked -p kehai --lib --features defmt
    if [ "$EMBEDDED_RUST" = rustup ]; then
        embedded_cargo "$CORTEX_M4" clippy --locked -p kehai --lib --features defmt -- -D warnings
    elif [ "${KEHAI_EMBEDDED_RUST:-}" != distribution ]; then
        not_judged "lints for $CORTEX_M4: no rustup target"
    fi
}

step_no_panic() {
    embedded_cargo "$CORTEX_M4" build --locked --release -p kehai --bin no-panic --features proof
    say "no panic is reachable in the release build for $CORTEX_M4"
}

step_boards() {
    local board
    for board in "${BOARDS[@]}"; do
        say "$board"
        board_cargo build "$board"
        if [ "$EMBEDDED_RUST" = rustup ]; then
            board_cargo clippy "$board" -- -D warnings
        fi
    done
    for board in "${LOADERS[@]}"; do
        say "$board, boot loader"
        loader_cargo build "$board"
        [ "$EMBEDDED_RUST" != rustup ] || loader_cargo clippy "$board" -- -D warnings
    done
    if [ "$EMBEDDED_RUST" = rustup ]; then
        bench_cargo clippy -- -D warnings
    elif [ "${KEHAI_EMBEDDED_RUST:-}" != distribution ]; then
        not_judged "lints of the boards: no rustup target"
    fi
}

step_budget() {
    local board over=0
    printf '%-18s %9s %9s\n' 'bytes' flash memory
    for board in "${BOARDS[@]}"; do
        board_cargo build "$board" 2>/dev/null || board_cargo build "$board"
        size -A "$(image "$board")" | awk -v board="$board" -v flash="$FLASH_BUDGET" -v memory="$MEMORY_BUDGET" '
            $1 ~ /^\.(vector_table|start_block|text|rodata|data|gnu\.sgstubs)$/ { in_flash += $2 }
            $1 ~ /^\.(data|bss|uninit)$/ { in_memory += $2 }
            END { printf "%-18s %9d %9d\n", board, in_flash, in_memory; exit in_flash > flash || in_memory > memory }
        ' || over=1
    done
    printf '%-18s %9d %9d\n' 'at most' "$FLASH_BUDGET" "$MEMORY_BUDGET"
    for board in "${LOADERS[@]}"; do
        loader_cargo build "$board" 2>/dev/null || loader_cargo build "$board"
        size -A "$(image "$board-boot")" | awk -v board="$board-boot" -v flash="$LOADER_BUDGET" '
            $1 ~ /^\.(vector_table|start_block|text|rodata|data|gnu\.sgstubs)$/ { in_flash += $2 }
            END { printf "%-18s %9d   of %d\n", board, in_flash, flash; exit in_flash > flash }
        ' || over=1
    done
    [ "$over" = 0 ] || fail "an image is over its budget"
    for board in "${BOARDS[@]}"; do
        budget_panics "$board" || over=1
    done
    [ "$over" = 0 ] || fail "an image has more calls of panicking functions than its budget"
    budget_instructions
    budget_stack
}

# budget_panics BOARD — the calls of panicking functions in its image, by the crate that makes them. Calls from one
# panicking function to another are not counted. Inlined functions count where they are inlined.
budget_panics() {
    need_command arm-none-eabi-objdump binutils-arm-none-eabi
    printf '\n%s: calls of panicking functions, by crate\n' "$1"
    arm-none-eabi-objdump --disassemble --demangle --no-show-raw-insn "$(image "$1")" \
        | awk -v budget="${PANICS_BUDGET[$1]}" '
        function panics(name) {
            return name ~ /core::(panicking|option::(unwrap|expect)_failed|result::unwrap_failed|cell::panic_|str::slice_error_fail|slice::(index::|copy_from_slice|.*_fail))/
        }
        /^[0-9a-f]+ <.*>:$/ {
            caller = $0; sub(/^[0-9a-f]+ </, "", caller); sub(/>:$/, "", caller)
            crate = caller
            # The first path in a name such as <smoltcp::socket::Socket as core::fmt::Debug>::fmt.
            sub(/^[^a-zA-Z_]*/, "", crate); sub(/[^a-zA-Z0-9_].*/, "", crate)
            counts = !panics(caller)
        }
        counts && $2 ~ /^(b|bl)(\.[nw])?$/ {
            callee = $0; sub(/^[^<]*</, "", callee); sub(/>[^>]*$/, "", callee)
            if (panics(callee) && callee !~ /\+0x[0-9a-f]+$/) { calls[crate]++; sum++ }
        }
        END {
            for (crate in calls) printf "%6d %s\n", calls[crate], crate | "sort -rn"
            close("sort -rn")
            printf "%6d of at most %d\n", sum, budget
            exit sum > budget
        }
    '
}

budget_instructions() {
    local table
    need_command qemu-system-arm qemu-system-arm
    bench_cargo build 2>/dev/null || bench_cargo build
    table=$(timeout 300 qemu-system-arm -M mps2-an386 -icount shift=10 -display none -monitor none \
        -serial stdio -no-reboot -kernel "$(image mps2-an386)-bench" </dev/null) || fail "the bench image hangs"
    printf '\n%s\n' "$table"
    awk -v budget_682="$INSTRUCTIONS_BUDGET_682" -v budget_1081="$INSTRUCTIONS_BUDGET_1081" '
        $1 == 682 && $2 == 2 { seen++; over += $8 > budget_682 }
        $1 == 1081 && $2 == 2 { seen++; over += $8 > budget_1081 }
        END { printf "at most, the dearest scan with 2 people: %d of 682 steps, %d of 1081\n", budget_682, budget_1081
              exit seen != 2 || over > 0 }
    ' <<<"$table" || fail "a scan with two people takes more instructions than its budget, or none was counted"
    awk -v seal="$SEAL_BUDGET" -v refuse="$REFUSE_BUDGET" '
        sealed && $1 == 220 { seen++; over += $2 > seal }
        sealed && $1 == 68 { seen++; over += $4 > refuse }
        /instructions a sealed datagram/ { sealed = 1 }
        END { printf "at most: %d to seal 220 bytes, %d to refuse 68\n", seal, refuse; exit seen != 2 || over > 0 }
    ' <<<"$table" || fail "a sealed datagram takes more instructions than its budget, or none was counted"
}

budget_stack() {
    local said
    need_qemu
    said=$(qemu_test -- --nocapture the_stack_stays_within_its_budget 2>&1) \
        || { printf '%s\n' "$said" >&2; fail "the stack is over its budget"; }
    [ "$(grep -c '^stack of ' <<<"$said")" = 2 ] || fail "the stack of an image was not measured"
    printf '\n%s\n' "$(grep '^stack of ' <<<"$said")"
}

step_qemu() {
    [ -z "$QEMU_TESTED" ] || { say "ran with the tests above"; return; }
    need_qemu
    qemu_test
}

# The simulator as the benchmarks have built it: what follows needs no second build, which would differ in nothing but the features
# that test libraries switch on in shared dependencies, and take minutes.
BENCHED=
step_bench() {
    need_command valgrind valgrind
    cargo bench --locked -p kehai
    cargo bench --locked -p host-sim
    [ -n "${CARGO_TARGET_DIR:-}" ] || BENCHED=$PWD/target/release/kehai-sim
}

# A twenty-fifth of the seeds of every table: a run that comes out otherwise than on its page fails it.
step_figures() { if [ -x "$BENCHED" ]; then "$BENCHED" experiment check; else cargo figures check; fi; }

step_demo() { if [ -x "$BENCHED" ]; then "$BENCHED" demo --headless --seconds 20; else cargo demo --headless --seconds 20; fi; }

# What cargo-fuzz does without a sanitizer, which needs no other compiler; installing it would take minutes.
FUZZ_FLAGS=(-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4
    -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table
    -Cllvm-args=-sanitizer-coverage-trace-compares -Ccodegen-units=1 --cfg fuzzing)
step_fuzz() {
    local host target folder
    need_command c++ g++
    host=$(rustc -vV | sed -n 's/^host: //p')
    # With a target named, the flags do not reach build scripts.
    RUSTFLAGS="${FUZZ_FLAGS[*]}" cargo build --locked --release --manifest-path fuzz/Cargo.toml \
        --target "$host" --target-dir target/fuzz
    for target in fuzz/fuzz_targets/*.rs; do
        target=$(basename "$target" .rs)
        folder=target/fuzz/found/$target
        mkdir -p "$folder"
        say "fuzzing $target for ${FUZZ_SECONDS:-10} s"
        "target/fuzz/$host/release/$target" -max_total_time="${FUZZ_SECONDS:-10}" -print_final_stats=1 \
            -verbosity=0 -artifact_prefix="$folder/crash-" "$folder"
    done
}

step_deny() {
    need_command python3 python3
    python3 tests/dependencies.py
}

# What makes the package and the bills of materials; other versions may lay them out otherwise. They run for seconds, and optimizing them
# takes minutes.
CARGO_DEB=3.8.0
CARGO_CYCLONEDX=0.5.9
INSTALL_DEB="cargo install --quiet --locked --force --debug cargo-deb --version $CARGO_DEB"
INSTALL_CYCLONEDX="cargo install --quiet --locked --force --debug cargo-cyclonedx --version $CARGO_CYCLONEDX"
# One that is there and does not run, such as another machine's, is replaced.
has_deb() { [[ " $(cargo deb --version 2>/dev/null)" == *" $CARGO_DEB" ]]; }
has_cyclonedx() { [[ "$(cargo cyclonedx --version 2>/dev/null)" == *" $CARGO_CYCLONEDX" ]]; }
need_cyclonedx() { has_cyclonedx || $INSTALL_CYCLONEDX; }
# The package, and the bills of materials of both programs.
make_package() {
    need_command dpkg-shlibdeps dpkg-dev
    need_command python3 python3
    has_deb || $INSTALL_DEB
    need_cyclonedx
    need_target
    if [ "$EMBEDDED_RUST" = rustup ]; then
        need_command arm-none-eabi-objcopy binutils-arm-none-eabi
        packaging/package.sh
    else
        not_judged "the firmware in the package: no rustup target"
        KEHAI_WITHOUT_FIRMWARE=1 packaging/package.sh
    fi
    packaging/sbom.sh Cargo.toml "$(board_target "${BOARDS[-1]}")" "board-${BOARDS[-1]}" target/package/firmware.cdx.json
}
step_package() {
    need_command debootstrap debootstrap
    make_package
    python3 tests/sbom.py target/package/kehai-tracker.cdx.json host-tracker normal,build
    python3 tests/sbom.py target/package/firmware.cdx.json kehai normal \
        --target "$(board_target "${BOARDS[-1]}")" --features "board-${BOARDS[-1]}"
    if [ "$(id -u)" -ne 0 ]; then
        not_judged "the package in a bare Debian: it needs root"
        return
    fi
    tests/package.sh target/package/*.deb
    need_command buildah buildah
    need_command curl curl
    need_command pgrep procps
    local ended=0
    tests/container.sh target/package/*.deb || ended=$?
    [ "$ended" = 77 ] || return "$ended"
    not_judged "the container: buildah can run nothing here"
}

# make_firmware BOARD… — their files, read back.
make_firmware() {
    need_command arm-none-eabi-objcopy binutils-arm-none-eabi
    need_python_tests
    packaging/firmware.sh "$@"
    "$KEHAI_PYTHON" tests/firmware.py target/firmware
}

# The same commit gives the same bytes: in this folder, and in a clone at another path.
step_reproducible() {
    local board=${BOARDS[-1]} elsewhere here
    need_target
    if [ "$EMBEDDED_RUST" != rustup ]; then
        not_judged "the firmware's bytes: no rustup target"
        return
    fi
    # Files that git does not know are in no image.
    if [ -n "$(git status --porcelain --untracked-files=no)" ]; then
        not_judged "the firmware's bytes: this folder has changes that are not committed"
        return
    fi
    make_firmware "$board"
    here=$(cat target/firmware/SHA256SUMS)
    elsewhere=$(mktemp -d)
    git clone --quiet . "$elsewhere/another/place"
    env -u CARGO_TARGET_DIR "$elsewhere/another/place/packaging/firmware.sh" "$board"
    cmp target/firmware/SHA256SUMS "$elsewhere/another/place/target/firmware/SHA256SUMS" \
        || fail "the same commit gives other bytes at another path"
    rm -rf "$elsewhere"
    say "the same bytes in two places: $here"
}

step_release() {
    need_target
    [ "$EMBEDDED_RUST" = rustup ] || fail "the firmware of a release is built with rustup's Rust, and there is no target of it"
    [ -z "$(git status --porcelain --untracked-files=no)" ] \
        || fail "the files of a release are of a commit: this folder has changes that are not committed"
    need_command qemu-system-arm qemu-system-arm
    make_firmware "${LOADERS[@]}"
    KEHAI_QEMU_IMAGE=$PWD/target/firmware/mps2-an386.elf qemu_test the_image_boots_names_itself
    make_package
    packaging/release.sh
}

step_advisories() {
    command -v cargo-deny >/dev/null || cargo install --quiet --locked cargo-deny
    cargo deny check advisories
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
    [[ " ${USUAL[*]} ${EXTRA[*]} " == *" $step "* ]] \
        || fail "unknown step $step: one of ${USUAL[*]} ${EXTRA[*]}"
done
need_cargo
for step in "${steps[@]}"; do
    say "$step"
    begin_s=$SECONDS
    "step_${step//-/_}"
    say "$step took $((SECONDS - begin_s)) s; $(disk)"
done
[ -s "$KEHAI_NOT_JUDGED" ] || say "passed in $SECONDS s: ${steps[*]}"
