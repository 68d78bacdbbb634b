#!/usr/bin/env bash
# Builds what the tests need and runs them. Usage: scripts/test.sh [ci|nightly] [ARGUMENT...]
#   (nothing)  what must hold before a change is kept, in minutes: every module, and whole scenes with measured lamps
#   ci         what CI checks beside that: large references, extremes, kills, pages, AddressSanitizer, UBSan, fuzzers
#   nightly    ThreadSanitizer, fuzzers for long, gigabytes: hours
# Further arguments go to ctest: scripts/test.sh -R Compare. Times of all tests: build/release/tests-SUITE.xml.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

suite=quick
case ${1:-} in
    ci | nightly) suite=$1 && shift ;;
    -h | --help) sed -n '2,/^set/{/^set/d;s/^# \{0,1\}//;p}' "$0" && exit ;;
esac

bash scripts/deps.sh
[ "$suite" != ci ] || bash scripts/deps.sh blender || echo "no Blender: the test of its add-on is skipped"
cmake --preset release -DLUCERNA_TESTS=ON ${CI:+-DLUCERNA_WERROR=ON} --log-level=NOTICE >/dev/null
# The quick tests need neither the benchmarks nor the programs of the other runs.
target=all
[ "$suite" != quick ] || target=quick_tests
cmake --build --preset release --target "$target" --parallel "$(nproc)"
# Two tests at a time, of two threads each: who waits for work must not spin.
export OMP_WAIT_POLICY=passive
exec ctest --test-dir build/release -L "^$suite\$" --output-on-failure -j2 --output-junit "tests-$suite.xml" "$@"
