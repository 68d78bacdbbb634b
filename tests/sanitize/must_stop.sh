#!/usr/bin/env bash
# Checks that a program which commits a fault is stopped by it, with a message that names the fault.
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
