#!/usr/bin/env bash
# The container as its user builds and runs it: packaging/container/Containerfile on a bare Debian 12, started as the image
# says, as its user, asked for its health as the image asks, and ended.
#
#   tests/container.sh PACKAGE.deb [FOLDER]
#
#   FOLDER  the bare Debian, made by tests/package.sh; /var/tmp/kehai-bookworm
#
# Only for root: buildah changes its root. It exits with 77 where buildah can run nothing at all. No registry is asked: the
# base image is made from the folder. The image installs what it needs from Debian's mirrors.
set -euo pipefail

fail() { printf 'container.sh: %s\n' "$*" >&2; exit 1; }
say() { printf '   %s\n' "$*"; }

[ "$(id -u)" = 0 ] || fail "run it as root: buildah changes its root"
package=$(realpath "$1") bare=${2:-/var/tmp/kehai-bookworm}
[ -x "$bare/usr/bin/dpkg" ] || fail "no bare Debian in $bare: tests/package.sh makes it"
project=$(cd "$(dirname "$0")/.." && pwd)
containerfile=$project/packaging/container/Containerfile
# What users are told to build it with: an image of another format has no health check.
documented=$(sed -n 's/^# *\(podman build .*\)/\1/p' "$containerfile")
grep -qF -- "$documented" "$project/docs/install.md" || fail "docs/install.md builds it in another way than the Containerfile says"
read -ra format <<<"$(grep -o -- '--format [a-z]*' <<<"$documented" || true)"

work=$(mktemp -d /var/tmp/kehai-container.XXXXXX)
# Another port than that of a tracker on this machine.
address=127.0.0.1:18421
tracker="kehai-tracker run .*--http $address"
end() {
    pkill -KILL -f -- "$tracker" || true
    wait
    in_it rm --all >/dev/null 2>&1 || true
    rm -rf "$work"
}
trap end EXIT
export BUILDAH_ISOLATION=chroot
# Images and layers of its own, nothing of this machine's.
in_it() { buildah --root "$work/images" --runroot "$work/run" --storage-driver vfs "$@"; }

base=$(in_it from scratch)
in_it add --quiet "$base" "$bare" / >/dev/null
in_it config --cmd bash --env PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin "$base"
in_it run "$base" -- true || { say "not judged: buildah can run nothing on this machine"; exit 77; }
in_it commit --quiet --rm "$base" kehai-bare >/dev/null

mkdir "$work/context"
cp "$package" "$work/context"
in_it build --quiet "${format[@]}" --pull-never --build-arg BASE=localhost/kehai-bare --tag kehai-tracker \
    --file "$containerfile" "$work/context" >"$work/built" 2>&1 || fail "it does not build: $(cat "$work/built")"
# What the image says of how it runs: a word a line.
of_image() {
    in_it inspect --type image kehai-tracker | python3 -c 'import json, sys
said = json.load(sys.stdin)["Docker"]["config"][sys.argv[1]]
print("\n".join(said) if isinstance(said, list) else said)' "$1"
}
mapfile -t entry < <(of_image Entrypoint)
of_image Healthcheck | grep -q /healthz || fail "its health is not asked for"
say "built: as $(of_image User), ${entry[*]}"
[ "$(of_image User)" = kehai ] || fail "it does not run as the user kehai"

# What stands behind the image's name takes the place of its own options.
container=$(in_it from --pull-never kehai-tracker)
in_it run "$container" -- test -s /etc/ssl/certs/ca-certificates.crt || fail "it trusts no authority: no mqtts://, no webhook over TLS"
in_it run "$container" -- "${entry[@]}" --http "$address" >"$work/log" 2>&1 &
running=$!
for _ in $(seq 60); do
    curl --noproxy '*' --silent --fail "http://$address/healthz" >"$work/health" && break
    kill -0 "$running" 2>/dev/null || fail "it ended: $(cat "$work/log")"
    sleep 1
done
[ -s "$work/health" ] || fail "it does not answer: $(cat "$work/log")"
[ "$(grep -c 'the first user is admin, with the password' "$work/log")" = 1 ] || fail "no first password: $(cat "$work/log")"
curl --noproxy '*' --silent --location "http://$address/" >"$work/page"
grep -q '<title' "$work/page" || fail "it serves no map: $(head -c 200 "$work/page")"
owner=$(ps -o user= -p "$(pgrep -n -f -- "$tracker")")
[ "$owner" != root ] || fail "it runs as root"
say "run: healthy, the map answers, the first password is said once, not as root"
pkill -TERM -n -f -- "$tracker"
wait "$running" && ended=0 || ended=$?
[ "$ended" = 0 ] || fail "it ended with $ended: $(cat "$work/log")"
say "ended by SIGTERM with 0"
