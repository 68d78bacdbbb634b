#!/usr/bin/env bash
# Measures imports of ray files of up to millions of rays, for docs/results/lamps.md: time, memory, size, and the largest error
# on a plane beside that of counting the rays. The rays are those of a light field, so that any number can be had. It takes
# about three minutes, 2 GB of memory and 1.3 GB of disk.
# usage: bench/figures/ray_import.sh LAMP.tm25ray [MILLIONS...]     default: 1 5 25
set -euo pipefail
lucerna=$(dirname "${BASH_SOURCE[0]}")/../../build/release/lucerna

rays=$1
shift
[ $# -gt 0 ] || set -- 1 5 25
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

measure() {
    local begin end
    begin=$(date +%s.%N)
    /usr/bin/time -f '%M' -o "$folder/memory" "$lucerna" light import "$1" -o "$folder/made.exr" >"$folder/text"
    end=$(date +%s.%N)
    awk -v seconds="$(echo "$end $begin" | awk '{ print $1 - $2 }')" -v kilobytes="$(cat "$folder/memory")" \
        -v bytes="$(stat -c %s "$folder/made.exr")" -v rays="$2" '
        /^error of irradiance/ { planes = 1; next }
        /^[^ ]/ { planes = 0 }
        planes {
            counts = $(NF - 1)
            field = / small / ? "small" : $(NF - 3)
            errors = errors (errors == "" ? "" : ", ") field " / " counts
        }
        END { printf "| %s | %.1f s | %.0f MB | %.1f MB | %s |\n", rays, seconds, kilobytes / 1024, bytes / 1e6, errors }' \
        "$folder/text"
}

"$lucerna" light import "$rays" -o "$folder/lamp.exr" --quiet
measure "$rays" "the file itself"
for millions; do
    "$lucerna" light emit "$folder/lamp.exr" --rays "${millions}000000" -o "$folder/rays.tm25ray" --quiet
    measure "$folder/rays.tm25ray" "$millions million"
done
