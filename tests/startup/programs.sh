#!/usr/bin/env bash
# Tests that no program loads OpenImageIO and its 260 libraries before it opens a picture, neither directly nor indirectly.
# usage: tests/startup/programs.sh liblucerna_pictures.so PROGRAM...
set -euo pipefail
export LC_ALL=C

# grep -q would end at the first match, and ldd, which is still writing, would fail by a signal.
loads() { ldd "$1" | grep libOpenImageIO >/dev/null; }

# The check must find the dependency in a library that has it.
if ! loads "$1"; then
    echo "$1 is not linked with OpenImageIO: this test sees nothing"
    exit 1
fi
shift
found=0 seen=0
for program in "$@"; do
    [ -e "$program" ] || continue # not built yet
    seen=$((seen + 1))
    if loads "$program"; then
        echo "$program loads OpenImageIO before main()"
        found=$((found + 1))
    fi
done
echo "$seen programs looked at, $found of them load OpenImageIO"
[ "$seen" -gt 0 ] && [ "$found" -eq 0 ]
