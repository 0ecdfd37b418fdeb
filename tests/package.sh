#!/usr/bin/env bash
# The Debian package as its user meets it: installed in a bare Debian 12, its service run as the unit says, the map asked,
# installed anew, removed, purged. Nothing may be left.
#
#   tests/package.sh PACKAGE.deb [FOLDER]
#
#   FOLDER  where the bare Debian is kept, made with debootstrap if it is not there; /var/tmp/kehai-bookworm
#
# Only for root, as it changes its root. The service runs in a chroot, without systemd: started and watched by
# tests/supervise.py, which does of systemd what the unit asks for.
set -euo pipefail

fail() { printf 'package.sh: %s\n' "$*" >&2; exit 1; }
say() { printf '   %s\n' "$*"; }

[ "$(id -u)" = 0 ] || fail "run it as root: it changes its root"
package=$(realpath "$1") bare=${2:-/var/tmp/kehai-bookworm}
here=$(cd "$(dirname "$0")" && pwd)
# Made under another name, so that a folder of this name is whole.
if [ ! -x "$bare/usr/bin/dpkg" ]; then
    rm -rf "$bare" "$bare.begun"
    mkdir -p "$bare.begun"
    debootstrap --variant=minbase --include=adduser bookworm "$bare.begun" http://deb.debian.org/debian
    mv "$bare.begun" "$bare"
fi

root=$(mktemp -d /var/tmp/kehai-package.XXXXXX)
trap 'rm -rf "$root"' EXIT
cp -a "$bare/." "$root"
inside() { env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive chroot "$root" "$@"; }
# What there is, but for what the package manager and adduser keep for themselves.
files() {
    (cd "$root" && find . -xdev \( -path ./var/lib/dpkg -o -path ./var/lib/apt -o -path ./var/cache \
        -o -path ./var/log -o -path ./proc -o -path ./tmp -o -path ./run -o -path "./etc/*-" \) -prune -o -print) | LC_ALL=C sort
}
passwords() { sort "$root/etc/passwd" "$root/etc/group"; }

files >"$root.before"
passwords >"$root.users"
trap 'rm -rf "$root" "$root".*' EXIT

# dpkg installs what is named here alone: apt brings what the package recommends.
dpkg-deb --field "$package" Recommends | grep -qw ca-certificates || fail "it brings no authorities for certificates of brokers"
cp "$package" "$root/tmp/kehai.deb"
inside dpkg --install /tmp/kehai.deb >/dev/null || fail "it cannot be installed, or depends on what a bare Debian lacks"
say "installed: $(inside dpkg-query --show --showformat '${Package} ${Version}, ${Installed-Size} kB' kehai-tracker)"
[ "$(stat -c '%U %a' "$root/etc/kehai" 2>/dev/null || true)" != '' ] || fail "no /etc/kehai"
[ "$(stat -c '%u %g %a' "$root/etc/default/kehai-tracker")" = '0 0 640' ] \
    || fail "others than root may read the service's options, in which a broker's password may be"
inside kehai-tracker --version >/dev/null
inside kehai-tracker check /etc/kehai/site.toml
for file in usr/share/man/man1/kehai-tracker-run.1.gz usr/share/bash-completion/completions/kehai-tracker \
    lib/systemd/system/kehai-tracker.service etc/default/kehai-tracker \
    usr/share/doc/kehai-tracker/kehai-tracker.cdx.json; do
    [ -s "$root/$file" ] || fail "no /$file"
done

if [ -e "$root/usr/share/kehai/firmware/MAKERS" ]; then
    inside sh -c 'cd /usr/share/kehai/firmware && sha256sum --check --quiet SHA256SUMS'
    for file in w5500-evb-pico2-complete.uf2 nucleo-h563zi-complete.hex 69-kehai-probes.rules; do
        [ -s "$root/usr/share/kehai/firmware/$file" ] || fail "no firmware file $file"
    done
fi

# As an administrator would: the map at another port.
port=18420
sed -i "s/^KEHAI_OPTIONS=.*/KEHAI_OPTIONS=\"--http=127.0.0.1:$port\"/" "$root/etc/default/kehai-tracker"
said=$(python3 "$here/supervise.py" "$root" kehai-tracker "http://127.0.0.1:$port")
printf '%s\n' "$said"
if [ -e "$root/usr/share/kehai/firmware/MAKERS" ]; then
    [[ $said == *"['nucleo-h563zi', 'w5500-evb-pico2']"* ]] || fail "the map does not hand out the firmware of both boards"
fi
[ -s "$root/var/lib/kehai/site.db" ] || fail "the service has made no database in /var/lib/kehai"

echo '# mine' >>"$root/etc/kehai/site.toml"
inside dpkg --install /tmp/kehai.deb >/dev/null
grep -q '^# mine' "$root/etc/kehai/site.toml" || fail "an upgrade has lost the site"
grep -q "$port" "$root/etc/default/kehai-tracker" || fail "an upgrade has lost the service's options"
inside dpkg --remove kehai-tracker >/dev/null
grep -q '^# mine' "$root/etc/kehai/site.toml" || fail "its removal has lost the site"
say "kept by an upgrade and a removal: the site, the service's options"
inside dpkg --purge kehai-tracker >/dev/null
diff "$root.before" <(files) || fail "the purge has left files"
diff "$root.users" <(passwords) || fail "the purge has left a user"
say "purged: nothing is left"
