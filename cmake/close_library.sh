#!/usr/bin/env bash
# Makes a static library of ours fit to be linked into programs that are compiled otherwise. Inline functions and templates,
# the standard library's and Imath's among them, are compiled into every file that calls them, and the linker takes the first
# of each that it meets: a program's, compiled with the program's flags (fused multiply-add, -O0), in the place of ours. So all
# object files become one, in which such functions are its own. Data (vtables, static variables) stays shared.
# usage: cmake/close_library.sh LD OBJCOPY NM AR LIBRARY
set -euo pipefail
export LC_ALL=C
ld=$1 objcopy=$2 nm=$3 ar=$4 library=$5

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
object=$folder/$(basename "$library" .a).o
"$ld" -r --force-group-allocation --whole-archive "$library" -o "$object"
symbols() { # of a kind, as objcopy reads them; it fails with an empty file
    echo "# $1"
    "$nm" --defined-only "$object" | awk -v kind="$1" '$2 == kind { print $3 }'
}
symbols W >"$folder/inline"
symbols u >"$folder/unique" # without their groups only weak ones may be there several times
"$objcopy" --localize-symbols="$folder/inline" --weaken-symbols="$folder/unique" "$object"
rm "$library"
"$ar" rcsD "$library" "$object"
