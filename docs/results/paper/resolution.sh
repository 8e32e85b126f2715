#!/usr/bin/env bash
# Varies the resolution R of the outer grids, while Embree answers the inner rays (as in the paper's section on resolution), and
# measures the inner field alone. Writes docs/results/paper/resolution.md. Takes about ten minutes on two cores.
#
#   docs/results/paper/resolution.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."
source docs/results/paper/common.sh

view view importance "$front"
for r in 64 256 1024; do
  bake "outer_$r" view 128 --outer-resolution "$r"
  judge "outer_$r" "$out/outer_$r.nif" "$front" inside
done
judge inner "$out/outer_256.nif" "$front" outside
judge both "$out/outer_256.nif" "$front" none --sheet "$pages/resolution-spherical.png" --thumbnail 280
judge ours_outer "$ours" "$front" inside
judge ours_inner "$ours" "$front" outside
judge ours_both "$ours" "$front" none --sheet "$pages/resolution-segment.png" --thumbnail 280

declare -A stated=([64]=48.4 [256]=49.8 [1024]=45.7)
row() { printf '| %s | %s | %s | %s dB | %s dB | %s |\n' "$1" "$2" "$3" "$(psnr "$4" bits)" "$(psnr "$4" probability)" "${5-}"; }
{
  heading 'Resolution of the grids'
  printf 'Trained with 128 samples a pixel from the view that is judged. `segment` is this project'"'"'s own encoding, baked once with\n'
  printf '`--preset balanced`, from rays of all directions. In a row for one field, Embree answers the rays of the other field.\n\n'
  printf '| field | R | file | bits | probability | the paper states, for its scenes |\n| --- | ---: | ---: | ---: | ---: | ---: |\n'
  for r in 64 256 1024; do row 'outer only' "$r" "$(size "$out/outer_$r.nif")" "outer_$r" "${stated[$r]} dB"; done
  row 'inner only' 128 "$(size "$out/outer_256.nif")" inner 'about 41 dB'
  row 'both' '256, 128' "$(size "$out/outer_256.nif")" both
  row '`segment`, rays from outside only' '' "$(size "$ours")" ours_outer
  row '`segment`, rays from inside only' '' "$(size "$ours")" ours_inner
  row '`segment`, all' '' "$(size "$ours")" ours_both
  printf '\n![Embree, the paper'"'"'s fields by probability, and their difference times 3](resolution-spherical.png)\n'
  printf '\nAbove, from left to right: Embree, `spherical` (both fields, R = 256 and 128) by probability, and their difference times 3. Below, the\n'
  printf 'same with `segment`:\n'
  printf '\n![Embree, segment by probability, and their difference times 3](resolution-segment.png)\n'
  printf '\nTraining took %s, %s and %s seconds.\n' "$(of outer_64 '.seconds | round')" "$(of outer_256 '.seconds | round')" \
    "$(of outer_1024 '.seconds | round')"
} >"$pages/resolution.md.new"
mv "$pages/resolution.md.new" "$pages/resolution.md"
