#!/usr/bin/env bash
# Builds Lucerna for arm64 by Debian's cross compiler, and runs tests of its core and 48 small renders by qemu-user.
# usage: scripts/arm64.sh [FOLDER]     FOLDER: where packages, build and results go; default: build/arm64
# The packages of arm64 are unpacked into FOLDER/root, not installed: 280 MB to fetch, 1.3 GB on disk. With build/release/lucerna
# there, the hashes of the images are compared with its own. docs/results/platforms.md has what it printed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
case ${1:-} in
    -h | --help) sed -n '2,/^set/{/^set/d;s/^# \{0,1\}//;p}' "$0" && exit ;;
esac
folder=$(realpath -m "${1:-build/arm64}")
root=$folder/root

# Headers and libraries of the product and its tests, but not those of other compilers and of Python.
mapfile -t packages < <(scripts/deps.sh all --list | grep -E -- '-dev$' | grep -vE '^(libclang-rt|libomp|python3)-dev$')
packages+=(libc6-dev libgomp1 node-d3)

if [ ! -e "$root/complete" ]; then
    apt-get install -y -qq --no-install-recommends g++-aarch64-linux-gnu qemu-user >/dev/null
    # An apt of its own, for another architecture and an empty system.
    apt=$folder/apt
    mkdir -p "$apt"/{state/lists/partial,cache/archives/partial,etc/apt.conf.d,etc/preferences.d}
    cp -r /etc/apt/sources.list* "$apt/etc/"
    touch "$apt/state/status"
    printf '%s\n' 'APT::Architecture "arm64";' 'APT::Architectures { "arm64"; };' "Dir::State \"$apt/state\";" \
        "Dir::State::status \"$apt/state/status\";" "Dir::Cache \"$apt/cache\";" "Dir::Etc \"$apt/etc\";" >"$apt/conf"
    export APT_CONFIG=$apt/conf
    apt-get update -qq
    apt-get install -y -qq --no-install-recommends --download-only "${packages[@]}" >/dev/null
    unset APT_CONFIG
    mkdir -p "$root"/usr/{lib,bin,sbin}
    for name in lib bin sbin; do ln -sfn usr/$name "$root/$name"; done
    for package in "$apt"/cache/archives/*.deb; do
        dpkg-deb --fsys-tarfile "$package" | tar -x --keep-directory-symlink -C "$root" --exclude=./usr/share/{doc,locale,man}
    done
    touch "$root/complete"
fi

export LUCERNA_ARM64_ROOT=$root
cmake --preset release -B "$folder/build" --toolchain cmake/aarch64.cmake -DLUCERNA_TESTS=ON -DLUCERNA_PYTHON=OFF --log-level=NOTICE >/dev/null
tests=(base kdtree photon lights)
cmake --build "$folder/build" --target lucerna "${tests[@]/#/test_}"

# Alternatives, which packages select when they are installed.
libraries=$root/usr/lib/aarch64-linux-gnu
export QEMU_LD_PREFIX=$root QEMU_SET_ENV="LD_LIBRARY_PATH=$libraries/blas:$libraries/lapack" OMP_WAIT_POLICY=passive
failed=0
for name in "${tests[@]}"; do
    RC_PARAMS=seed=2003 qemu-aarch64 "$folder/build/tests/test_$name" --gtest_brief=1 --gtest_filter='-*Long_*:*Nightly_*' || failed=1
done

# 48 small images beside those of this machine's own build.
printf '#!/bin/sh\nexec qemu-aarch64 "%s" "$@"\n' "$folder/build/lucerna" >"$folder/lucerna"
chmod +x "$folder/lucerna"
bench/figures/image_hashes.py "$folder/lucerna" "$folder/images" | tee "$folder/hashes"
if [ -x build/release/lucerna ]; then
    bench/figures/image_hashes.py build/release/lucerna "$folder/images-$(uname -m)" >"$folder/hashes-$(uname -m)"
    diff "$folder/hashes" "$folder/hashes-$(uname -m)" && echo "all images have the bits of this machine's build"
fi
exit $failed
