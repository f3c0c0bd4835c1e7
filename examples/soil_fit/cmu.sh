#!/bin/bash
# A smooth wheel (r 58 mm, b 50 mm, about 24 N) in dry sand, Carnegie Mellon University: friction angle and stiffness of the sand.
# Slip 0.5 is kept for the test. The repeatability (0.56 N, 0.66 mm) is the published one.
# Usage: examples/soil_fit/cmu.sh [FOLDER]     needs the real data (RILLE_DATA)
set -e
out=${1:-out/soil_fit}; mkdir -p "$out"
"${RILLE:-.venv/bin/rille}" soil fit "${RILLE_DATA:-../shared}/data/wheel_bench/cmu_smooth_wheel_steady.csv" \
  --column load=-Fz_N --column drawbar_pull=-Fy_N --column side_force=Fx_N --column sinkage=-Z_mm --where slip_angle_deg=0 --only "slip_ratio>=0" \
  --soil dry_sand_lll --radius "58 mm" --width "50 mm" --fit friction_angle --fit frictional_modulus \
  --response drawbar_pull --response sinkage --noise drawbar_pull=0.56 --noise sinkage=0.00066 \
  --hold-out "slip_ratio>0.45" --hold-out "slip_ratio<0.55" --figure "$out/cmu.png" -o "$out/cmu_sand.toml"
