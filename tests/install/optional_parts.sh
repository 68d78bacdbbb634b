#!/usr/bin/env bash
# Configures builds without the optional packages. Each must be left out with one line that says what is missing, and must stop
# a build of the tests, which would otherwise be fewer without a word.
# usage: optional_parts.sh CMAKE SOURCE
set -euo pipefail
cmake=$1 source=$2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

configured() { # ARGUMENT...
    "$cmake" -S "$source" -B "$folder/build" -G Ninja --fresh --log-level=NOTICE "$@" 2>&1 || echo "did not configure"
}
failed=0
expect() { # TEXT OUTPUT
    grep -qF "$1" <<<"$2" || { echo "missing: $1"; echo "$2"; failed=1; }
}

without=$(configured -DLUCERNA_TESTS=OFF -DCMAKE_DISABLE_FIND_PACKAGE_MPI=ON -DOIIO_LIBRARY=OFF)
expect "MPI was not found: this build has no renders by several processes" "$without"
expect "OpenImageIO was not found: this build has no pictures to read" "$without"
expect "Build files have been written" "$without"

without=$(configured -DLUCERNA_TESTS=OFF -DCMAKE_DISABLE_FIND_PACKAGE_PkgConfig=ON)
expect "was not found: this build has no drawings with text" "$without"
expect "Build files have been written" "$without"

without=$(configured -DLUCERNA_TESTS=OFF -DLUCERNA_PYTHON=ON -DCMAKE_DISABLE_FIND_PACKAGE_pybind11=ON)
expect "was not found: this build has no Python module" "$without"
expect "did not configure" "$without" # the module was asked for

expect "did not configure" "$(configured -DLUCERNA_TESTS=ON -DCMAKE_DISABLE_FIND_PACKAGE_MPI=ON)"
exit $failed
