#!/usr/bin/env bash
# Tests that an installation by `cmake --install` works in its folder and after it is moved; without its library of
# picture formats it does everything that needs neither to read a picture nor to draw one, and otherwise names it.
# usage: tests/startup/installed.sh CMAKE BUILD_FOLDER SCENE
set -euo pipefail
export LC_ALL=C
cmake=$1 build=$2 scene=$3

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
fail() {
    echo "$*"
    cat "$folder/said" 2>/dev/null || true
    exit 1
}
render() { # TREE OPTION...
    local tree=$1
    shift
    "$folder/$tree/bin/lucerna" render "$scene" --resolution 8x8 --spp 1 -o "$folder/a.exr" "$@" >"$folder/said" 2>&1
}

"$cmake" --install "$build" --prefix "$folder/first" >/dev/null
library=$(find "$folder/first" -name liblucerna_pictures.so)
[ -n "$library" ] || fail "liblucerna_pictures.so is not installed"
case $(readelf -d "$folder/first/bin/lucerna" | grep -E 'RPATH|RUNPATH') in
    *"$build"*) fail "the installed program looks for libraries in the build" ;;
esac

render first --png || fail "the installed program renders no picture"
[ -s "$folder/a.png" ] || fail "no picture was written"

mv "$folder/first" "$folder/second"
rm "$folder/a.png"
render second --png || fail "moved, the program renders no picture"
[ -s "$folder/a.png" ] || fail "no picture was written after the move"

rm "$folder/second/${library#"$folder/first/"}" "$folder/a.png" "$folder/a.exr"
render second --png || fail "without the library a render should have its picture"
[ -s "$folder/a.png" ] || fail "no picture was written without the library"
draw() {
    "$folder/second/bin/lucerna" falsecolour "$folder/a.exr" -o "$folder/drawn.png" >"$folder/said" 2>&1
}
if draw; then fail "a drawing without its library"; fi
[ "$(wc -l <"$folder/said")" -eq 1 ] || fail "the error is not one line"
grep -q "drawn.png: pictures need liblucerna_pictures.so, which was not found in " "$folder/said" ||
    fail "the error does not say what is missing"
