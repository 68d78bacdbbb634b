#!/usr/bin/env bash
# Tests in builds that look at every access and operation (fuzz, asan-ubsan: AddressSanitizer, UBSan and traps of
# floating point), at every order of threads (tsan), or only at floating point (traps).
# Usage: scripts/sanitize.sh build BUILD            the small suite's programs: fuzz or tsan
#        scripts/sanitize.sh suite BUILD            runs the small suite
#        scripts/sanitize.sh fault BUILD FAULT      commits a fault, which the build must stop
#        scripts/sanitize.sh soak BUILD MODULE...     whole test programs by hand, hours for all:
#                                                   scripts/sanitize.sh soak tsan photon render extremes
# What follows -- goes to the tests: scripts/sanitize.sh soak traps extremes -- --gtest_filter='*path'
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

usage() {
    sed -n '2,/^set/{/^set/d;s/^# \{0,1\}//;p}' "$0" >&2
    exit 2
}
[ $# -ge 2 ] || usage
action=$1 build=$2
shift 2

# The first finding ends the run; leaks count; libraries of others are excused in tests/sanitize/*.supp, each with why.
export ASAN_OPTIONS=strict_string_checks=1:detect_stack_use_after_return=1
export LSAN_OPTIONS=suppressions=$PWD/tests/sanitize/leaks.supp:print_suppressions=0
export UBSAN_OPTIONS=print_stacktrace=1
# Synchronisation inside foreign libraries, above all OpenMP and TBB, is not visible to the sanitizer.
export TSAN_OPTIONS=halt_on_error=1:ignore_noninstrumented_modules=1:history_size=4:suppressions=$PWD/tests/sanitize/races.supp

make() {
    cmake --preset "$build" --log-level=WARNING >/dev/null
    cmake --build --preset "$build" --parallel "$(nproc)" --target "$@"
}

case $action in
    build)
        targets=(small_suite)
        [ "$build" != fuzz ] || targets+=(fuzzers)
        make "${targets[@]}"
        ;;
    suite) exec "build/$build/tests/sanitize/sanitized_suite" --gtest_brief=1 "$@" ;;
    fault) exec "build/$build/tests/sanitize/sanitized_fault" "$@" ;;
    soak)
        modules=()
        while [ $# -gt 0 ] && [ "$1" != -- ]; do modules+=("test_$1") && shift; done
        [ ${#modules[@]} -gt 0 ] || usage
        [ "${1:-}" != -- ] || shift
        make "${modules[@]}"
        for module in "${modules[@]}"; do
            echo "--- $build: $module"
            RC_PARAMS=seed=2003 "build/$build/tests/$module" --gtest_brief=1 "$@"
        done
        ;;
    *) usage ;;
esac
