#!/usr/bin/env bash
# A fault must end the program that commits it, and be called by its name.
# Usage: must_stop.sh PROGRAM FAULT PATTERN
set -uo pipefail
output=$("$1" "$2" 2>&1)
code=$?
if [ $code -eq 0 ] || ! grep -qE -- "$3" <<<"$output"; then
    echo "$2: ended with $code, and should have been stopped as '$3':"
    echo "$output"
    exit 1
fi
grep -m1 -E -- "$3" <<<"$output"
