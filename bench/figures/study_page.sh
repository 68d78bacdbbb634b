#!/usr/bin/env bash
# Makes the picture of docs/tutorial/reproduce-a-study.md: the study of the Cornell box, and its page in a browser. It takes
# three minutes on two cores.
# usage: bench/figures/study_page.sh [FOLDER]     default out/studies/cornell
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

out=${1:-out/studies/cornell}
build/release/lucerna study bench/figures/studies/cornell.toml -o "$out"
/usr/bin/python3 bench/figures/study_page.py "$out/study.html" docs/images/study-page.png
