#!/usr/bin/env bash
# ./ci.sh as a stranger runs it: a bare Debian 12 with git, a C compiler and cargo, and a fresh clone.
#
#   tests/fresh-machine.sh [--root FOLDER] [--cores LIST] [--busy N] [STEP…]
#
#   --root FOLDER  where the machine is, made with debootstrap if it is not there; /var/tmp/kehai-fresh
#   --cores LIST   the processors it has, as taskset names them; 0,1
#   --busy N       keep N of them busy with something else all the time; 0
#   STEP…          steps of ./ci.sh; the usual ones
#
# What is committed is cloned to /work/kehai, and ../shared, if there is one, is beside it, read-only. ~/.cargo/bin and
# the stable toolchain of ~/.rustup are copied; crates and packages are fetched anew, by the ways of this machine: its
# apt sources, certificates, proxies and settings of pip, npm and cargo. Its fonts are DejaVu and nothing else.
#
# Only for root, as it mounts; the mounts are in a namespace of their own and end with it. The machine stays, with
# what ./ci.sh has installed: remove the folder for a bare one.
set -euo pipefail

fail() { printf 'fresh-machine.sh: %s\n' "$*" >&2; exit 2; }

repository=$(cd "$(dirname "$0")/.." && pwd)
root=/var/tmp/kehai-fresh cores=0,1 busy=0
while [ $# -gt 0 ]; do
    case $1 in
    -h | --help) sed -n '2,/^set -/{/^#/s/^# \{0,1\}//p}' "$0"; exit 0 ;;
    --root | --cores | --busy) [ $# -ge 2 ] || fail "$1 wants a value"; declare "${1#--}=$2"; shift 2 ;;
    -*) fail "unknown option $1: see --help" ;;
    *) break ;;
    esac
done
[ "$(id -u)" = 0 ] || fail "run it as root: it mounts and changes its root"
[ -d "$HOME/.rustup/toolchains" ] && [ -d "$HOME/.cargo/bin" ] || fail "no ~/.rustup and ~/.cargo/bin to copy"

if [ ! -e "$root/etc/debian_version" ]; then
    command -v debootstrap >/dev/null || fail "no debootstrap (Debian: apt-get install debootstrap)"
    mkdir -p "$root"
    debootstrap --variant=minbase --include=git,gcc,libc6-dev,ca-certificates,fonts-dejavu-core \
        bookworm "$root" http://deb.debian.org/debian
fi

# copy PATH… — from this machine to the same place there, if it is here.
copy() {
    local path
    for path in "$@"; do
        [ -e "$path" ] || continue
        mkdir -p "$root$(dirname "$path")"
        cp -aLT "$path" "$root$path"
    done
}
copy /etc/resolv.conf /etc/hosts /etc/ssl/certs/ca-certificates.crt /usr/local/share/ca-certificates
copy /etc/apt/sources.list /etc/apt/sources.list.d/debian.sources /etc/apt/auth.conf.d /etc/apt/keyrings
[ ! -e "$root/etc/apt/sources.list.d/debian.sources" ] || rm -f "$root/etc/apt/sources.list"
for path in /etc/apt/apt.conf.d/*artifact* /etc/apt/apt.conf.d/*proxy*; do copy "$path"; done
copy /etc/pip.conf /root/.config/pip /root/.npmrc /root/.cargo/config.toml /root/.gitconfig
for path in bin env; do copy "$HOME/.cargo/$path"; done
# The toolchain alone: rustup under its names, no program that cargo has installed here.
for path in "$root$HOME"/.cargo/bin/*; do
    cmp -s "$path" "$root$HOME/.cargo/bin/rustup" || rm "$path"
done
for path in "$HOME"/.rustup/settings.toml "$HOME"/.rustup/update-hashes "$HOME"/.rustup/toolchains/stable-*; do
    [ -e "$root$path" ] || copy "$path"
done
rm -rf "$root/work/kehai"
mkdir -p "$root/work/shared" "$root/.outside"
git clone --quiet "$repository" "$root/work/kehai"
git -C "$root/work/kehai" log -1 --format='cloned %h %s'

# The ways to the world outside, by name; and what is named there.
environment=(HOME="$HOME" TERM="${TERM:-dumb}" LANG=C.UTF-8 CI=true
    PATH="$HOME/.cargo/bin:/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin")
while IFS= read -r -d '' pair; do
    case ${pair%%=*} in
    *_proxy | *_PROXY | *_CA_* | *_CAINFO | SSL_* | PIP_* | RUSTUP_* | REQUESTS_* | CARGO_HTTP_* | CARGO_NET_*)
        environment+=("$pair")
        ;;
    esac
done < <(env -0)

export root cores busy repository
# shellcheck disable=SC2016 # Expanded inside.
exec unshare --mount --propagation private bash -euc '
    mount --bind "$root" "$root"
    for special in proc sys dev; do mkdir -p "$root/$special"; mount --rbind "/$special" "$root/$special"; done
    if [ -d "$repository/../shared" ]; then
        mount --bind "$repository/../shared" "$root/work/shared"
        mount -o remount,bind,ro "$root/work/shared"
    else
        rmdir "$root/work/shared"
    fi
    if [ -d /opt/wheels ]; then
        mkdir -p "$root/opt/wheels"
        mount --bind /opt/wheels "$root/opt/wheels"
    fi
    cd "$root"
    pivot_root . .outside
    umount --lazy /.outside
    cd /work/kehai
    taskset --cpu-list --pid "$cores" $$ >/dev/null
    for ((one = 0; one < busy; one++)); do
        while :; do :; done &
    done
    trap "kill \$(jobs -p) 2>/dev/null || true" EXIT
    echo "$(cat /etc/debian_version), $(nproc) processors, $busy of them kept busy"
    env -i "$@"
' fresh-machine "${environment[@]}" ./ci.sh "$@"
