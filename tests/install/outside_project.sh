#!/usr/bin/env bash
# Tests that an external project finds an installed Lucerna, compiles examples/render.cpp with nothing but its package, and renders
# the command's image bit for bit; also with compiler flags of its own, which must not affect the libraries.
# usage: tests/install/outside_project.sh CMAKE BUILD_FOLDER SOURCE_FOLDER C++_COMPILER PYTHON
set -euo pipefail
export LC_ALL=C
cmake=$1 build=$2 source=$3 compiler=$4 python=$5

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
fail() {
    echo "$*"
    cat "$folder/said" 2>/dev/null || true
    exit 1
}

"$cmake" --install "$build" --prefix "$folder/installed" >"$folder/said" 2>&1 || fail "not installed"
mv "$folder/installed" "$folder/prefix" # the package can be moved
targets=$(find "$folder/prefix" -path '*/cmake/lucerna/*' -name '*.cmake')
[ -n "$targets" ] || fail "no CMake package is installed"
# The package must not export private compiler flags and paths.
for private in ' -W' -Werror -march -ffp "$source" "$build"; do
    if grep -F -e "$private" $targets >"$folder/said"; then fail "the package names $private"; fi
done

# All installed headers compile in C++20 with one include directory.
include=$folder/prefix/include/lucerna
(cd "$include" && find . -name '*.h' | sort | sed 's|^\./\(.*\)|#include "\1"|') >"$folder/all_headers.cpp"
[ "$(wc -l <"$folder/all_headers.cpp")" -gt 150 ] || fail "headers are missing"
"$compiler" -std=c++20 -fsyntax-only -isystem "$include" "$folder/all_headers.cpp" \
    >"$folder/said" 2>&1 || fail "installed headers do not compile"

# Makes a small scene, and the same scene with twice the light.
sed -e 's/"integer xresolution" 256 "integer yresolution" 256/"integer xresolution" 32 "integer yresolution" 32/' \
    -e 's/"integer pixelsamples" 64/"integer pixelsamples" 4/' "$source/scenes/cornell/cornell.pbrt" >"$folder/scene.pbrt"
sed 's/"rgb L" \[ 17 12 4 \]/"rgb L" [ 34 24 8 ]/' "$folder/scene.pbrt" >"$folder/brighter.pbrt"
! cmp -s "$folder/scene.pbrt" "$folder/brighter.pbrt" || fail "the scene's lamp is not what this test takes it for"
"$folder/prefix/bin/lucerna" render "$folder/brighter.pbrt" -o "$folder/command.exr" >"$folder/said" 2>&1 ||
    fail "the command renders no image"
pixels() {
    "$python" -c 'import sys, pathlib
sys.path.insert(0, sys.argv[1])
from image_hashes import pixels_of
print(pixels_of(pathlib.Path(sys.argv[2])).hex())' "$source/bench/figures" "$1"
}
pixels "$folder/command.exr" >"$folder/command"

# Builds without flags, and with flags under which the project's copies of inline functions differ most from the libraries'.
n=0
for flags in "" "-O1 -fno-inline -march=x86-64-v3"; do
    n=$((n + 1))
    "$cmake" -S "$source/examples" -B "$folder/build$n" -DCMAKE_PREFIX_PATH="$folder/prefix" \
        -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_CXX_FLAGS="$flags" >"$folder/said" 2>&1 || fail "\"$flags\": not configured"
    "$cmake" --build "$folder/build$n" >"$folder/said" 2>&1 || fail "\"$flags\": not built"
    "$folder/build$n/render" "$folder/scene.pbrt" 2 "$folder/outside.exr" >"$folder/said" 2>&1 ||
        fail "\"$flags\": the example renders no image"
    pixels "$folder/outside.exr" | cmp -s "$folder/command" - || fail "\"$flags\": not the command's image"
    for wrong in -1 abc 2x; do
        ! "$folder/build$n/render" "$folder/scene.pbrt" "$wrong" "$folder/wrong.exr" >"$folder/said" 2>&1 ||
            fail "a factor of $wrong is accepted"
    done
    "$folder/build$n/render" "$folder/scene.pbrt" 1 "$folder/outside.exr" >"$folder/said" 2>&1
    ! pixels "$folder/outside.exr" | cmp -s "$folder/command" - || fail "\"$flags\": the lamp's flux makes no difference"
done
