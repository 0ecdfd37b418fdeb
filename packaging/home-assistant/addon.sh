#!/usr/bin/env bash
# The add-on with the tracker's package in it: packaging/home-assistant/addon.sh makes target/home-assistant/, to be copied into the folder
# addons/ of Home Assistant. packaging/package.sh has made the package before.
set -euo pipefail
cd "$(dirname "$0")/../.."

out=target/home-assistant
rm -rf "$out" && mkdir -p "$out"
cp -r packaging/home-assistant/kehai packaging/home-assistant/repository.yaml "$out/"
cp target/package/kehai-tracker_*.deb "$out/kehai/"
echo "$out/kehai: copy it to addons/ (by the add-on Samba share or SSH), then Settings, Add-ons, Add-on store, Check for updates"
