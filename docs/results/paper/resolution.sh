#!/usr/bin/env bash
# The resolution R of the outer grids, the inner rays being answered by Embree (as in the paper's section on resolution),
# and the inner field alone. Writes docs/results/paper/resolution.md; takes about ten minutes on two cores.
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
  printf 'Trained with 128 samples a pixel from the very view that is judged; `segment` is this project'"'"'s own encoding, baked once with\n'
  printf '`--preset balanced`, from rays of all directions. Rays that the field in question does not answer are answered by Embree.\n\n'
  printf '| field | R | file | bits | probability | the paper states, for its scenes |\n| --- | ---: | ---: | ---: | ---: | ---: |\n'
  for r in 64 256 1024; do row 'outer alone' "$r" "$(size "$out/outer_$r.nif")" "outer_$r" "${stated[$r]} dB"; done
  row 'inner alone' 128 "$(size "$out/outer_256.nif")" inner 'about 41 dB'
  row 'both' '256, 128' "$(size "$out/outer_256.nif")" both
  row '`segment`, rays from outside alone' '' "$(size "$ours")" ours_outer
  row '`segment`, rays from inside alone' '' "$(size "$ours")" ours_inner
  row '`segment`, all' '' "$(size "$ours")" ours_both
  printf '\n![Embree, the paper'"'"'s fields by probability, and the difference times 3](resolution-spherical.png)\n'
  printf '\nEmbree, `spherical` (both fields, R = 256 and 128) by probability, and the difference times 3; the same with `segment`:\n'
  printf '\n![Embree, segment by probability, and the difference times 3](resolution-segment.png)\n'
  printf '\nTraining took %s, %s and %s seconds.\n' "$(of outer_64 '.seconds | round')" "$(of outer_256 '.seconds | round')" \
    "$(of outer_1024 '.seconds | round')"
} >"$pages/resolution.md.new"
mv "$pages/resolution.md.new" "$pages/resolution.md"
