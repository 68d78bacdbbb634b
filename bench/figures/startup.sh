#!/usr/bin/env bash
# Measures the cost of a process that does almost nothing, as it is and with the library of picture formats preloaded as if it
# were linked, for the figures of docs/development/architecture.md. It takes about two minutes on a quiet machine.
# usage: bench/figures/startup.sh [PROCESSES]       default: 200
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
processes=${1:-200}

cmake --build build/release --target lucerna test_kdtree >/dev/null
library=$PWD/build/release/liblucerna_pictures.so

repeat() {  # arguments: a library to preload, or nothing; a command
    local first=$1
    shift
    for ((i = 0; i < processes; ++i)); do LD_PRELOAD=$first "$@" >/dev/null; done
}

measure() {
    local name=$1
    shift
    for first in "" "$library"; do
        LD_PRELOAD=$first "$@" >/dev/null  # one unmeasured run brings the files into memory
        local TIMEFORMAT="%R %U %S"
        read -r real user sys < <({ time repeat "$first" "$@"; } 2>&1)
        awk -v name="$name" -v how="${first:+pictures first}" -v n="$processes" -v r="$real" -v c="$user $sys" 'BEGIN {
            split(c, of)
            printf "%-12s %-14s %7.2f ms each, %7.2f ms of the processor\n", name, how, 1e3 * r / n,
                   1e3 * (of[1] + of[2]) / n }'
    done
}

echo "$processes processes each, $(date -I)"
measure lucerna build/release/lucerna --version
measure test_kdtree build/release/tests/test_kdtree --gtest_list_tests
