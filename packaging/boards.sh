# shellcheck shell=bash
# How the firmware is compiled. ./ci.sh and packaging/firmware.sh read this file in the folder of the repository: what is checked is
# compiled once, with the flags of what is handed out (by rustup's Rust).

CORTEX_M4=thumbv7em-none-eabihf
CORTEX_M33=thumbv8m.main-none-eabihf

# board_target IMAGE — the target of a board's image, or of another program for the same board.
board_target() {
    case $1 in
    mps2-an386*) echo "$CORTEX_M4" ;;
    *) echo "$CORTEX_M33" ;;
    esac
}

# firmware_cargo ARGUMENTS… — cargo, so that the same commit gives the same bytes wherever it is built. What would differ are the
# paths of the sources, which panics name: they are replaced. With a target named, the flags do not reach build scripts.
firmware_cargo() {
    local registry=${CARGO_HOME:-$HOME/.cargo}/registry/src flags="--remap-path-prefix=$PWD=/kehai" folder
    # Cargo splits RUSTFLAGS at blanks, which a path may have, and CARGO_ENCODED_RUSTFLAGS at this character.
    local separator=$'\x1f'
    # Which folders there are is known when the sources are there.
    [ -d "$registry" ] || cargo fetch --locked --quiet
    for folder in "$registry"/*; do flags+="$separator--remap-path-prefix=$folder=/crates"; done
    CARGO_ENCODED_RUSTFLAGS=$flags cargo "$@"
}

# built IMAGE [FOLDER] — where cargo has put an image, in this target folder.
built() { echo "${2:-${CARGO_TARGET_DIR:-target}}/$(board_target "$1")/release/$1"; }
