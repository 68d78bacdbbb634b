#!/usr/bin/env bash
# Measures `igi` with and without an importance pre-pass in sixteen rooms of which one is visible: the image's error against two
# references by `path` over the total time, for docs/images/igi-pre-pass.png and the table of docs/results/results.md. It runs
# steered_emission.sh, which describes the measurement and its settings. It takes about ten minutes on two cores, mostly for the
# references.
# usage: bench/figures/igi_pre_pass.sh [SCENE...]     default: rooms; into out/steered
set -euo pipefail

METHODS=igi PREPASS=${PREPASS:-16384} RESOLUTION=${RESOLUTION:-384x256} SETS=${SETS:-4 8 16 32} IGI=${IGI:-nlights=16} PICTURE=${PICTURE:-docs/images/igi-pre-pass.png} \
    SPP=${SPP:-512} bash "$(dirname "${BASH_SOURCE[0]}")/steered_emission.sh" "${@:-rooms}"
