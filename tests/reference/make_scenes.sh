#!/usr/bin/env bash
# Copies the shipped scenes and makes what git does not hold: the cloister's meshes, and its lamps, measured like the
# shipped ones but more coarsely, in seconds. Files that are newer than their sources are not made again.
# usage: make_scenes.sh LUCERNA SCENES OUT
set -euo pipefail
lucerna=$(realpath "$1") scenes=$2 out=$3

mkdir -p "$out"
cp -ru "$scenes"/. "$out"
cd "$out"
rm -f lamps/*/*.part

# made FILE FROM...: tells whether FILE is newer than the program and all FROM
made() {
    local file=$1
    shift
    [ -f "$file" ] || return 1
    for from in "$lucerna" "$@"; do [ "$file" -nt "$from" ] || return 1; done
}
# coarse NAME RIG CHANGE...: makes lamps/NAME/NAME.exr by its rig file with changes
coarse() {
    local folder=lamps/$1 name=$1 rig=$2
    shift 2
    ! made "$folder/$name.exr" "$folder/$rig" "$folder"/*.pbrt "$folder"/*.png || return 0
    local changes=()
    for change in "$@"; do changes+=(-e "s/^${change%% *} = .*/${change%% *} = ${change#* }/"); done
    sed "${changes[@]}" "$folder/$rig" > "$folder/coarse.toml"
    "$lucerna" light acquire "$folder/coarse.toml" -o "$folder/$name.exr" --quiet
}

shopt -s nullglob
for folder in cloister lamps/projector lamps/bike-light; do
    [ -d "$folder/mesh" ] || [ -f "$folder/slide.png" ] || python3 "$folder/make.py" > /dev/null
done
coarse flashlight rig-screen.toml 'rays 2_000_000' 'pixels [60, 60]'
coarse three-led rig.toml 'rays 500_000' 'pixels [60, 60]'
coarse bike-light rig.toml 'rays 500_000' 'pixels [60, 60]'
# The spacing must be a whole number of the sensor's pixels, the filter four times that.
coarse projector rig.toml 'views [11, 11]' 'pixels [30, 20]' 'filter "21.72mm"'
made cloister/lamp.exr ||
    "$lucerna" light acquire --radius 35mm --exponent 16 --flux 1200 --unit lm --colour 1.17,0.97,0.72 --views 15x15 \
        --pixels 32x32 -o cloister/lamp.exr --quiet
