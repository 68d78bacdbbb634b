#!/usr/bin/env bash
# Builds the fuzzers with clang, ASan and UBSan, and runs each for a while from its corpus.
# Usage: scripts/fuzz.sh [SECONDS each, 60] [FUZZER...]        scripts/fuzz.sh 3600 ply
# A finding stops it; the input that makes it lies in build/fuzz/findings.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

seconds=${1:-60}
shift || true
fuzzers=("$@")
if [ ${#fuzzers[@]} -eq 0 ]; then
    for source in tests/fuzz/*_fuzz.cpp; do fuzzers+=("$(basename "$source" _fuzz.cpp)"); done
fi

cmake --preset fuzz --log-level=WARNING >/dev/null
cmake --build --preset fuzz --parallel "$(nproc)" --target fuzzers
mkdir -p build/fuzz/findings

run() {
    local fuzzer=$1
    # New corpus files go beside the build, not into the source tree.
    local learned=build/fuzz/corpus/$fuzzer log=build/fuzz/$fuzzer.log
    mkdir -p "$learned"
    # libpng leaves a damaged file by longjmp, past the strings of OpenImageIO's reader: leaks that are not ours, and of
    # which no stack is left to tell them by.
    local leaks=1
    [ "$fuzzer" != picture ] || leaks=0
    # 10 s for one input counts as a hang, 1 GiB at once as a lying header.
    if ! ASAN_OPTIONS=${ASAN_OPTIONS:+$ASAN_OPTIONS:}detect_leaks=$leaks "build/fuzz/tests/fuzz/fuzz_$fuzzer" \
        -max_total_time="$seconds" -timeout=10 -malloc_limit_mb=1024 -rss_limit_mb=3000 \
        -max_len=65536 -print_final_stats=1 -artifact_prefix=build/fuzz/findings/ \
        "$learned" "tests/fuzz/corpus/$fuzzer" >"$log" 2>&1; then
        echo "--- $fuzzer: a finding"
        cat "$log"
        return 1
    fi
    echo "--- $fuzzer, $seconds s: $(grep -o 'number_of_executed_units: *[0-9]*' "$log" | grep -o '[0-9]*') inputs"
}
export -f run
export seconds
# Runs as many at a time as there are processors; fails if any of them finds something.
printf '%s\n' "${fuzzers[@]}" | xargs -P "$(nproc)" -I{} bash -c 'run "$1"' _ {}
