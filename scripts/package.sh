#!/usr/bin/env bash
# Builds the Debian packages lucerna and liblucerna-dev of what git has of this tree (committed or not), in a folder of its
# own, and has lintian look at them. Needs debhelper (scripts/deps.sh package).
# usage: scripts/package.sh [FOLDER]     where the packages go; default: build/debian
set -euo pipefail
cd "$(dirname "$0")/.."
[ $# -le 1 ] || { sed -n '4s/^# //p' "$0" >&2; exit 2; }
folder=${1:-build/debian}
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)

bash scripts/deps.sh product
bash scripts/deps.sh package
rm -rf "$folder/source"
mkdir "$folder/source"
git ls-files -z | tar --null -T - -cf - | tar -C "$folder/source" -xf -
(cd "$folder/source" && dpkg-buildpackage -us -uc -b)
rm -rf "$folder/source"
lintian --fail-on error,warning "$folder"/lucerna_*.changes
ls "$folder"/*.deb
