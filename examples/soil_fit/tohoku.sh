#!/bin/bash
# A wheel with fins (r 90 mm, b 100 mm, 10 mm fins) in dry sand at 24.5, 34.3 and 53.9 N, Tohoku University: friction angle and shear
# modulus from two loads, tested on the one between. The soil that it writes is the one of examples/slope_climb.
# Usage: examples/soil_fit/tohoku.sh [FOLDER]     needs the real data (RILLE_DATA)
set -e
out=${1:-out/soil_fit}; mkdir -p "$out"
"${RILLE:-.venv/bin/rille}" soil fit "${RILLE_DATA:-../shared}/data/wheel_bench/tohoku_yoshida2003_drawbar_pull.csv" \
  --soil fjs1_simulant --radius "90 mm" --width "100 mm" --fit friction_angle --fit shear_modulus \
  --hold-out "load>30" --hold-out "load<40" --figure "$out/tohoku.png" -o "$out/tohoku_sand.toml"
