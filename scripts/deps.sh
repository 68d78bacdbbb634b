#!/usr/bin/env bash
# The one list of what Lucerna needs from Debian 12, 13 or Ubuntu 24.04. Installs what is missing; says nothing when all is there.
# usage: scripts/deps.sh [product|package|slurm|blender|all [--list]]     --list: print the packages and install none; product: what building and using the `lucerna` command needs; package: what scripts/package.sh runs; slurm: what scripts/slurm.sh starts; blender: what the add-on for Blender is tested with, a gigabyte; default: product and tests
set -euo pipefail

packages=(
    # build
    g++ cmake ninja-build pkgconf
    # libraries the engine stands on
    libembree-dev libflann-dev libhwy-dev liblz4-dev libopenexr-dev libimath-dev libopenimageio-dev libtbb-dev libosd-dev libpng-dev libpugixml-dev zlib1g-dev libzip-dev
    librandom123-dev libcli11-dev libfmt-dev nlohmann-json3-dev libtinygltf-dev libtinyobjloader-dev libtomlplusplus-dev
    # drawings with text, as pictures
    librsvg2-dev fonts-dejavu-core
    # a render by many machines
    libopenmpi-dev openmpi-bin
    # the plots of a study's page (d3.min.js, put into the program)
    node-d3
)
case ${1:-all} in
    product) ;;
    package) packages=(dpkg-dev debhelper fakeroot lintian patchelf zstd) ;;
    slurm) packages=(slurmctld slurmd slurm-client munge) ;;
    blender) packages=(blender python3-openimageio) ;;
    all)
        packages+=(
            # other builds: clang++, sanitizers, fuzzers
            clang clang-format ccache libomp-dev libclang-rt-dev
            # the scenes' generators and the plots of docs
            python3 python3-matplotlib
            # tests and benchmarks
            libgtest-dev libgmock-dev libmpfr-dev libbenchmark-dev librapidcheck-dev libboost-dev
            # the Python module, and its tests
            pybind11-dev python3-dev python3-numpy python3-mypy
            # tests of pages, in a browser
            chromium
            # tests of layers, in another program
            openimageio-tools
            # tests of the manual page
            groff-base
        )
        ;;
    *)
        sed -n '3s/^# //p' "$0" >&2
        exit 2
        ;;
esac

if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
    cat >&2 <<'END'
deps.sh: this system has no apt-get; install these with its package manager, headers included:
  g++ 12 or clang 16, CMake 3.23, Ninja, pkgconf
  Embree 3.13 or 4, FLANN 1.9 with lz4, Highway 1.0, OpenEXR 3.1 with Imath, OpenImageIO 2.4, oneTBB 2021, OpenSubdiv 3.5, libpng 1.6, pugixml 1.13, zlib, libzip 1.7
  Random123 1.14, CLI11 2.3, fmt 9, nlohmann-json 3.11, tinygltf 2.5, tinyobjloader 2.0, toml++ 3.3, librsvg 2.54 with fontconfig, Open MPI 4.1
  d3.min.js 5 or newer (node-d3)
then build: cmake --preset release -DLUCERNA_TESTS=OFF && cmake --build --preset release --target lucerna
END
    exit 1
fi
if [ "${2:-}" = --list ]; then
    printf '%s\n' "${packages[@]}"
    exit
fi
missing=()
for package in "${packages[@]}"; do
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep 'ok installed' >/dev/null || missing+=("$package")
done
if [ ${#missing[@]} -gt 0 ]; then
    echo "installing: ${missing[*]}"
    sudo=""
    [ "$(id -u)" -eq 0 ] || sudo="sudo"
    $sudo apt-get update -qq
    DEBIAN_FRONTEND=noninteractive $sudo apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
fi
