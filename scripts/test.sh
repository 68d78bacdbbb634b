#!/usr/bin/env bash
# Everything that must hold before a change is kept: builds all, runs the quick and the full tests.
# Arguments go to ctest: scripts/test.sh -R Compare
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

bash scripts/deps.sh
cmake --preset release -DLUCERNA_TESTS=ON --log-level=WARNING >/dev/null
cmake --build --preset release --parallel "$(nproc)"
exec ctest --test-dir build/release -L 'quick|full' --output-on-failure -j2 "$@"
