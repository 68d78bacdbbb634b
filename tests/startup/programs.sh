#!/usr/bin/env bash
# No program loads OpenImageIO, and its 260 libraries, before it touches a picture: neither itself nor by another.
# usage: tests/startup/programs.sh liblucerna_pictures.so PROGRAM...
set -euo pipefail
export LC_ALL=C

# Not grep -q: it ends at the first line that it finds, and ldd, still writing, would fail by a signal.
loads() { ldd "$1" | grep libOpenImageIO >/dev/null; }

# The check must find what it looks for where it is.
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
