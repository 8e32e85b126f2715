#!/usr/bin/env bash
# Objects whose boxes overlap: a bust within two rings. Writes docs/results/paper/overlapping.md. Takes about five minutes
# on two cores.
#
#   docs/results/paper/overlapping.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."
mesh=build/paper/overlapping.glb model='Models: made by `nif mesh generate`.'
source docs/results/paper/common.sh

generated statue_1 statue 500000 1
generated ring_1 torus 200000 1
generated ring_2 torus 200000 2
{
  placed statue_1 0 3.01 0 1 20
  placed ring_1 0 1.6 0 1.7 30
  placed ring_2 0.2 2.6 0 1.5 120
} | assembled overlapping

samples=64
view overlapping importance "$front"
bake overlapping overlapping $samples
bake_ours overlapping_ours --preset fast
judge overlapping "$out/overlapping.nif" "$front" none --sheet "$pages/overlapping-spherical.png" --thumbnail 320
judge overlapping_ours "$out/overlapping_ours.nif" "$front" none --sheet "$pages/overlapping-segment.png" --thumbnail 320
{
  heading 'Overlapping objects'
  printf 'A bust of 500,000 triangles within two rings of 200,000 each. Their boxes overlap, and a ray is used for training once for each box\n'
  printf 'that it meets. Trained with %s samples a pixel from the view that is judged.\n\n' $samples
  printf '| | file | bits | probability | the paper states, for its scene |\n| --- | ---: | ---: | ---: | ---: |\n'
  printf '| `spherical` | %s | %s dB | %s dB | 40.5 dB |\n' "$(size "$out/overlapping.nif")" "$(psnr overlapping bits)" "$(psnr overlapping probability)"
  printf '| `segment`, preset `fast`, any view and light | %s | %s dB | %s dB | |\n' "$(size "$out/overlapping_ours.nif")" \
    "$(psnr overlapping_ours bits)" "$(psnr overlapping_ours probability)"
  printf '\nFrom left to right: Embree, `spherical` by probability, and their difference times 3:\n\n![By spherical fields](overlapping-spherical.png)\n'
  printf '\nThe same with `segment`:\n\n![By segment fields](overlapping-segment.png)\n'
} >"$pages/overlapping.md.new"
mv "$pages/overlapping.md.new" "$pages/overlapping.md"
