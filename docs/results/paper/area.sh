#!/usr/bin/env bash
# Three area lights at once. Writes docs/results/paper/area.md. Takes about five minutes on two cores.
#
#   docs/results/paper/area.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."
source docs/results/paper/common.sh

lit='three area lights'
# Each training ray goes to one of the lights; a corner and two edges each, in the dragon's metres.
of_light() {
  printf '[[light]]\ntype = "area"\ncorner = [-0.3, 0.45, 0.1]\nedge_u = [0.2, 0, 0]\nedge_v = [0, 0, 0.2]\nradiance = 4\n\n'
  printf '[[light]]\ntype = "area"\ncorner = [0.2, 0.4, 0.1]\nedge_u = [0.1, 0.05, 0]\nedge_v = [0, 0, 0.2]\nradiance = 4\n\n'
  printf '[[light]]\ntype = "area"\ncorner = [-0.1, 0.5, -0.3]\nedge_u = [0.2, 0, 0]\nedge_v = [0, 0.1, 0.1]\nradiance = 4\n'
}
samples=128
view area importance "$front"
bake area area $samples
judge area "$out/area.nif" "$front" none --sheet "$pages/area-spherical.png" --thumbnail 280
judge area_ours "$ours" "$front" none --sheet "$pages/area-segment.png" --thumbnail 280
{
  heading 'Area lights'
  printf 'Trained with %s samples a pixel from the view and lights that are judged.\n\n' $samples
  printf '| | file | bits | probability | the paper states, for its scene |\n| --- | ---: | ---: | ---: | ---: |\n'
  printf '| `spherical` | %s | %s dB | %s dB | 43.6 dB |\n' "$(size "$out/area.nif")" "$(psnr area bits)" "$(psnr area probability)"
  printf '| `segment`, preset `balanced`, any view and light | %s | %s dB | %s dB | |\n' "$(size "$ours")" \
    "$(psnr area_ours bits)" "$(psnr area_ours probability)"
  printf '\nFrom left to right: Embree, `spherical` by probability, and their difference times 3:\n\n![By spherical fields](area-spherical.png)\n'
  printf '\nThe same with `segment`:\n\n![By segment fields](area-segment.png)\n'
} >"$pages/area.md.new"
mv "$pages/area.md.new" "$pages/area.md"
