#!/usr/bin/env bash
# Only the lights that matter: `igi` with and without an importance pre-pass in sixteen rooms of which one is seen, the picture's error against
# two references by `path` at growing time, everything in it: docs/images/igi-pre-pass.png and the table of docs/results/results.md.
# steered_emission.sh does the work, and says what is measured and what may be set before it. On two cores some ten minutes,
# most of them the references.
# usage: bench/figures/igi_pre_pass.sh [SCENE...]     default: rooms; into out/steered
set -euo pipefail

METHODS=igi PREPASS=${PREPASS:-16384} RESOLUTION=${RESOLUTION:-384x256} SETS=${SETS:-4 8 16 32} IGI=${IGI:-nlights=16} PICTURE=${PICTURE:-docs/images/igi-pre-pass.png} \
    SPP=${SPP:-512} bash "$(dirname "${BASH_SOURCE[0]}")/steered_emission.sh" "${@:-rooms}"
