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
for fuzzer in "${fuzzers[@]}"; do
    # What it learns goes beside the build, not into the source tree.
    learned=build/fuzz/corpus/$fuzzer
    mkdir -p "$learned"
    echo "--- $fuzzer, $seconds s"
    # 10 s for one input is a hang, 1 GiB at once a lying header.
    "build/fuzz/tests/fuzz/fuzz_$fuzzer" -max_total_time="$seconds" -timeout=10 -malloc_limit_mb=1024 \
        -rss_limit_mb=3000 -max_len=8192 -print_final_stats=1 -artifact_prefix=build/fuzz/findings/ \
        "$learned" "tests/fuzz/corpus/$fuzzer"
done
