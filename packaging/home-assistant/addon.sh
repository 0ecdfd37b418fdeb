#!/usr/bin/env bash
# The add-on with the tracker's package in it: packaging/home-assistant/addon.sh makes target/home-assistant/, to be copied into the folder
# addons/ of Home Assistant. packaging/package.sh has made the package before, on a machine with the processor of Home Assistant's.
set -euo pipefail
cd "$(dirname "$0")/../.."

out=target/home-assistant
rm -rf "$out" && mkdir -p "$out"
cp -r packaging/home-assistant/kehai packaging/home-assistant/repository.yaml "$out/"
# Always under one name: a package of before in addons/ is replaced, and Docker finds one.
package=$out/kehai/kehai-tracker.deb
cp target/package/kehai-tracker_*.deb "$package"
echo "the package is for $(dpkg-deb -f "$package" Architecture): the machine of Home Assistant must have that processor"
echo "$out/kehai: copy it to addons/ (by the add-on Samba share or SSH), then Settings, Add-ons, Add-on store, Check for updates"
