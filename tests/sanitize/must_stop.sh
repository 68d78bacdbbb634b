#!/usr/bin/env bash
# A program that commits a fault must end by it, and the fault be called by its name.
# Usage: must_stop.sh PATTERN COMMAND...
set -uo pipefail
pattern=$1
shift
output=$("$@" 2>&1)
code=$?
if [ $code -eq 0 ] || ! grep -qE -- "$pattern" <<<"$output"; then
    echo "ended with $code, and should have been stopped by '$pattern':"
    echo "$output"
    exit 1
fi
grep -m1 -E -- "$pattern" <<<"$output"
