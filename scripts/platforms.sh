#!/usr/bin/env bash
# Builds and tests Lucerna in a root folder of another release of Debian, from nothing.
# usage: scripts/platforms.sh RELEASE [FOLDER] [COMMAND...]
#   RELEASE  bookworm (12), trixie (13), or any that debootstrap knows
#   FOLDER   the root folder; default: build/platforms/RELEASE. If it exists, it is used as it is.
#   COMMAND  runs in a clone of the last commit there; default: scripts/demo.sh and scripts/test.sh
# It needs to be run as root (debootstrap and chroot), 6 GB and about an hour. docs/results/platforms.md has what it printed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
case ${1:-} in
    "" | -h | --help) sed -n '2,/^set/{/^set/d;s/^# \{0,1\}//;p}' "$0" && exit ;;
esac
release=$1
root=$(realpath -m "${2:-build/platforms/$release}")
shift "$(($# < 2 ? $# : 2))"

if [ ! -e "$root/etc/debian_version" ]; then
    command -v debootstrap >/dev/null || { echo "debootstrap is missing: apt-get install debootstrap" && exit 1; }
    debootstrap --variant=minbase "$release" "$root"
fi
rm -rf "$root/lucerna"
git clone -q . "$root/lucerna"
# Test data, where this checkout has them beside it.
[ ! -d ../shared ] || { mkdir -p "$root/shared" && shared=$(realpath ../shared); }
command=("$@")
[ ${#command[@]} -gt 0 ] || command=(bash -c 'time bash scripts/demo.sh && time bash scripts/test.sh')
# The mounts end with the process.
exec unshare --mount bash -c '
    root=$1 shared=$2
    shift 2
    mount --rbind /proc "$root/proc" && mount --rbind /dev "$root/dev" && mount -t tmpfs tmpfs "$root/tmp"
    [ -z "$shared" ] || mount --bind -o ro "$shared" "$root/shared"
    exec chroot "$root" env HOME=/root LC_ALL=C.UTF-8 bash -c "cd /lucerna && exec \"\$@\"" lucerna "$@"
' platforms "$root" "${shared:-}" "${command[@]}"
