#!/usr/bin/env bash
# Runs the shipped studies, which measure trade-offs, from descriptions for `lucerna study` and small programs. Every result is
# in out/studies/NAME with its tables (numbers.md), its picture and, for a description, its page.
# usage: bench/figures/studies.sh [--quick] [--docs] [NAME...]     default: all of them, some forty minutes on two cores
#   cornell       3 min  every integrator in the Cornell box
#   direct       10 min  direct light four ways, from wide beams to narrow ones: the time to equal error
#   photons       6 min  photons, k and gather rays
#   igi           4 min  sets and paths of virtual point lights
#   emission      2 min  modes of emission from measured lamps: constant, exact, weighted
#   table         2 min  resolution of a lamp's table: error, noise, memory, speed
#   halves        1 min  a lamp's coefficients as halves and as floats
#   tree          4 min  our tree and FLANN's: whole renders, and searches alone
#   near-far      2 min  a measured lamp and its far field, over the distance
#   progressive   6 min  how error falls with passes, by alpha
# --quick: runs everything at tiny sizes in seconds, without what has to be made first, into out/studies-quick, as a smoke test.
# --docs: copies the pictures to docs/images, too (studies-NAME.png).
# BUILD (default build/release) and OUT (the folder of all results) may be set before it. Run nothing else meanwhile.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

build=${BUILD:-build/release}
here=bench/figures/studies
quick=
docs=
names=()
for word in "$@"; do
    case $word in
        --quick) quick=yes ;;
        --docs) docs=yes ;;
        -h | --help)
            sed -n '2,/^set/{/^set/d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}"
            exit
            ;;
        -*)
            echo "studies.sh: $word is not accepted; --quick, --docs, --help and names of studies are" >&2
            exit 2
            ;;
        *) names+=("$word") ;;
    esac
done
[ ${#names[@]} -gt 0 ] || names=(cornell direct photons igi emission table halves tree near-far progressive)
out=${OUT:-out/studies${quick:+-quick}}
lucerna=$build/lucerna
[ -n "$quick" ] || cmake --build "$build" --target lucerna > /dev/null

# draw SCRIPT FROM: a picture of that name, its tables to the screen and beside it
draw() {
    local picture=$folder/$1.png
    /usr/bin/python3 "$here/$1.py" "$2" "$picture" | tee -a "$folder/numbers.md"
    # If there are two pictures, the study's own is drawn last.
    [ -z "$docs" ] || cp "$picture" "docs/images/studies-$name.png"
}

# describe: runs the study of this name
describe() {
    local file=$here/$name.toml
    if [ -n "$quick" ]; then
        /usr/bin/python3 "$here/quick.py" "$file" "$folder/$name.toml"
        file=$folder/$name.toml
    fi
    "$lucerna" study "$file" -o "$folder" > "$folder/log.txt"
}

# figure PROGRAM ARGUMENT...: to standard output
figure() {
    local program=$build/bench/figure_$1
    [ -n "$quick" ] || cmake --build "$build" --target "figure_$1" > /dev/null
    shift
    "$program" "$@"
}

# formula_lamp FILE ARGUMENT...: by `lucerna light acquire` if it is not there
formula_lamp() {
    local file=$1
    shift
    [ -f "$file" ] || "$lucerna" light acquire "$@" -o "$file" --quiet
}

# measured_lamps: into the array of that name, those of scenes/lamps; a tiny one by formula where things should be quick
measured_lamps() {
    lamps=()
    if [ -n "$quick" ]; then
        formula_lamp "$folder/disc.exr" --exponent 20 --views 5x5 --pixels 8x8
        lamps=("$folder/disc.exr")
        return
    fi
    local lamp rig
    for lamp in flashlight three-led bike-light projector; do
        rig=scenes/lamps/$lamp/rig.toml
        [ "$lamp" = flashlight ] && rig=scenes/lamps/flashlight/rig-screen.toml
        if [ -f "scenes/lamps/$lamp/make.py" ]; then python3 "scenes/lamps/$lamp/make.py" > /dev/null; fi
        formula_lamp "scenes/lamps/$lamp/$lamp.exr" "$rig"
        lamps+=("scenes/lamps/$lamp/$lamp.exr")
    done
}

# searches: the k nearest photons and the building of the two trees, alone, into searches.json
searches() {
    local filter='tree/(k_nearest|build)/(100000|1000000)/'
    [ -z "$quick" ] || filter='tree/k_nearest/100000/20$'
    [ -n "$quick" ] || cmake --build "$build" --target lucerna_bench > /dev/null
    "$build/bench/lucerna_bench" --benchmark_filter="$filter" --benchmark_out="$folder/searches.json" \
        ${quick:+--benchmark_min_time=0.01} > "$folder/searches.txt" 2>&1
}

study() {
    case $name in
        direct)
            if [ -z "$quick" ]; then
                [ -d scenes/cloister/mesh ] || bash scenes/make.sh cloister
                [ -f scenes/beams/lamp-1000.exr ] || bash scenes/make.sh beams
                measured_lamps
            fi
            describe
            draw trade "$folder/results.json"
            draw direct "$folder"
            ;;
        cornell | photons | igi)
            if [ -z "$quick" ] && [ "$name" = photons ] && [ ! -f scenes/cloister/lamp.exr ]; then bash scenes/make.sh cloister; fi
            describe
            draw trade "$folder/results.json"
            ;;
        progressive)
            describe
            draw slopes "$folder/results.json"
            ;;
        emission)
            measured_lamps
            figure emission_modes "${quick:+--quick}" "${lamps[@]}" > "$folder/emission.csv"
            draw emission "$folder/emission.csv"
            ;;
        table)
            figure table_resolution "${quick:+--quick}" > "$folder/table.csv"
            draw table "$folder/table.csv"
            ;;
        halves)
            figure stored_halves "${quick:+--quick}" "$folder" ../shared/data/osram-ostar-green-100k.tm25ray > "$folder/halves.csv"
            draw halves "$folder/halves.csv"
            ;;
        tree)
            describe
            searches
            draw tree "$folder"
            ;;
        near-far)
            measured_lamps
            [ -n "$quick" ] || formula_lamp "$folder/matt-disc.exr" --capture 90% --pixels 64x64
            [ -n "$quick" ] || lamps=("$folder/matt-disc.exr" "${lamps[@]}")
            figure near_far "${quick:+--quick}" "${lamps[@]}" > "$folder/near-far.csv"
            draw near_far "$folder/near-far.csv"
            ;;
        *)
            echo "studies.sh: there is no study $name; --help lists them" >&2
            exit 2
            ;;
    esac
}

for name in "${names[@]}"; do
    folder=$out/$name
    mkdir -p "$folder"
    : > "$folder/numbers.md"
    echo "== $name"
    study
done
