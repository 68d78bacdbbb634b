#!/usr/bin/env bash
# Installs the Debian packages of a folder (scripts/package.sh), renders a scene with the program and with
# examples/render.cpp, compares the two images, removes the packages, and checks that no file of them is left. Run it as root,
# by hand or in a container: it changes the machine.
# usage: tests/install/package_test.sh [FOLDER]     default: build/debian
set -euo pipefail
export LC_ALL=C
cd "$(dirname "$0")/../.."
debs=$(cd "${1:-build/debian}" && pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
fail() {
    echo "$*"
    exit 1
}
[ "$(id -u)" -eq 0 ] || fail "packages are installed by root"
! dpkg-query -W lucerna >/dev/null 2>&1 || fail "lucerna is installed already"

packages=("$debs"/lucerna_*.deb "$debs"/liblucerna-dev_*.deb)
for package in "${packages[@]}"; do dpkg-deb -c "$package"; done >"$folder/contents"
DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${packages[@]}" >"$folder/said" 2>&1 ||
    { cat "$folder/said"; fail "not installed"; }
[ "$(command -v lucerna)" = /usr/bin/lucerna ] || fail "the program is not in /usr/bin"
! ldd /usr/bin/lucerna /usr/lib/*/lucerna/*.so | grep 'not found' || fail "a library is missing"
lucerna render scenes/furnace/furnace.pbrt --resolution 16x16 --spp 2 -o "$folder/image.exr" --png --no-denoise
[ -s "$folder/image.png" ] || fail "no picture"
bash -uc 'source /usr/share/bash-completion/completions/lucerna; COMP_WORDS=(lucerna rend); COMP_CWORD=1; _lucerna
    [ "${COMPREPLY[*]}" = render ]' || fail "no completion"
[ -s /usr/share/man/man1/lucerna.1.gz ] || fail "no manual page"

cmake -S /usr/share/doc/liblucerna-dev/examples -B "$folder/build" >/dev/null
cmake --build "$folder/build" >/dev/null
cp scenes/furnace/*.pbrt "$folder"
lucerna render "$folder/furnace.pbrt" -o "$folder/command.exr" --quiet
"$folder/build/render" "$folder/furnace.pbrt" 1 "$folder/outside.exr"
python3 - bench/figures "$folder/command.exr" "$folder/outside.exr" <<'PYTHON'
import pathlib, sys
sys.path.insert(0, sys.argv[1])
from image_hashes import pixels_of
first, second = (pixels_of(pathlib.Path(name)) for name in sys.argv[2:])
sys.exit(first != second)
PYTHON

DEBIAN_FRONTEND=noninteractive dpkg --purge liblucerna-dev lucerna >/dev/null
left=$(awk '$1 ~ /^-/ { sub(/^\./, "", $6); print $6 }' "$folder/contents" | while read -r file; do [ ! -e "$file" ] || echo "$file"; done)
[ -z "$left" ] || fail "left behind: $left"
echo "installed, used, removed"
