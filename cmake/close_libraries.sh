#!/usr/bin/env bash
# Makes our static libraries fit to be linked into programs that are compiled otherwise. Inline functions and templates,
# the standard library's and Imath's among them, are compiled into every file that calls them, and the linker takes the first
# of each that it meets: a program's, compiled with the program's flags (fused multiply-add, -O0), in the place of ours. So all
# object files become one, in which such functions are its own. Data (vtables, static variables) stays shared.
# What is weak but is asked of another file is no such function: a template that one file instantiates for all. It stays.
# usage: cmake/close_libraries.sh LD OBJCOPY NM AR LIBRARY...
set -euo pipefail
export LC_ALL=C
ld=$1 objcopy=$2 nm=$3 ar=$4
shift 4

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$nm" --undefined-only --format=posix "$@" | awk 'NF >= 2 { print $1 }' | sort -u >"$folder/asked"
for library in "$@"; do
    object=$folder/$(basename "$library" .a).o
    "$ld" -r --force-group-allocation --whole-archive "$library" -o "$object"
    symbols() { # of a kind, sorted
        "$nm" --defined-only "$object" | awk -v kind="$1" '$2 == kind { print $3 }' | sort -u
    }
    # objcopy fails with an empty list.
    { echo "# inline"; symbols W | comm -23 - "$folder/asked"; } >"$folder/inline"
    # Without their groups only weak ones may be there several times.
    { echo "# unique"; symbols u; } >"$folder/unique"
    "$objcopy" --localize-symbols="$folder/inline" --weaken-symbols="$folder/unique" "$object"
    rm "$library"
    "$ar" rcsD "$library" "$object"
done
