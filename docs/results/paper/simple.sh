#!/usr/bin/env bash
# Five complex objects among simple ones, which stay triangles in a BVH of fewer than 100,000. Writes
# docs/results/paper/simple.md. Takes about ten minutes on two cores.
#
#   docs/results/paper/simple.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."
mesh=build/paper/complex.glb model='Models: made by `nif mesh generate`.'
source docs/results/paper/common.sh

for seed in 1 2 3; do generated "statue_$seed" statue 500000 "$seed"; done
generated tori_1 tori 200000 1
generated ring_1 torus 200000 1
{
  placed statue_1 -2.6 3.01 0 1 25
  placed statue_2 0 3.01 -1 1 0
  placed statue_3 2.6 3.01 0 1 -25
  placed tori_1 -1.2 0.75 2.2 0.6 40
  placed ring_1 1.4 0.6 2.4 0.5 70
} | assembled complex
# Sixteen simple ones in front and at the sides.
generated simple_ring torus 4000 3
generated simple_tori tori 6000 4
simple_triangles=0
add() {
  local triangles=6000
  [[ $1 == simple_tori ]] || triangles=4000
  others+=$(placed "$@")$'\n\n'
  simple_triangles=$((simple_triangles + triangles))
}
for ((i = 0; i < 8; ++i)); do
  add simple_ring "$(awk -v i="$i" 'BEGIN { print (i - 3.5) * 1.1 }')" 0.24 3.6 0.2 $((i * 40))
  add simple_tori "$(awk -v i="$i" 'BEGIN { print i < 4 ? -4.2 : 4.2 }')" 0.31 "$(awk -v i="$i" 'BEGIN { print (i % 4) * 1.1 - 0.6 }')" 0.25 $((i * 70))
done

samples=64
view complex importance "$front"
bake complex complex $samples
bake complex_shared complex $samples --shared-network
bake complex_twice complex $((2 * samples))
bake_ours complex_ours --preset fast
judge complex "$out/complex.nif" "$front" none --sheet "$pages/simple-spherical.png" --thumbnail 320
judge complex_shared "$out/complex_shared.nif" "$front" none
judge complex_twice "$out/complex_twice.nif" "$front" none
judge complex_ours "$out/complex_ours.nif" "$front" none --sheet "$pages/simple-segment.png" --thumbnail 320
{
  heading 'Complex objects among simple ones'
  printf 'Fields answer for five complex objects: three busts of 500,000 triangles each, and rings of 200,000. Embree answers for the ground\n'
  printf 'and sixteen simple objects, at most %s triangles in all. Trained with %s samples a pixel from the view that is judged.\n\n' "$simple_triangles" $samples
  printf '| | file | bits | probability | the paper states, for its scene |\n| --- | ---: | ---: | ---: | ---: |\n'
  printf '| `spherical`, networks for each object | %s | %s dB | %s dB | 39.1 dB |\n' "$(size "$out/complex.nif")" "$(psnr complex bits)" "$(psnr complex probability)"
  printf '| `spherical`, one pair of networks for all | %s | %s dB | %s dB | 39.1 dB |\n' "$(size "$out/complex_shared.nif")" \
    "$(psnr complex_shared bits)" "$(psnr complex_shared probability)"
  printf '| `spherical`, networks for each object, %s samples | %s | %s dB | %s dB | |\n' $((2 * samples)) "$(size "$out/complex_twice.nif")" \
    "$(psnr complex_twice bits)" "$(psnr complex_twice probability)"
  printf '| `segment`, preset `fast`, any view and light | %s | %s dB | %s dB | |\n' "$(size "$out/complex_ours.nif")" \
    "$(psnr complex_ours bits)" "$(psnr complex_ours probability)"
  learned() { jq -r '[.objects[].training_rays / 1e6] | "\(min * 10 | round / 10) to \(max * 10 | round / 10)"' "$out/$1.json"; }
  printf '\nThe difference to the figure in the paper comes from the number of samples. Each object fills a small part of the picture, so with %s\n' $samples
  printf 'samples its fields learn from %s million rays. With twice as many samples they learn from %s million and come nearer to the\n' "$(learned complex)" "$(learned complex_twice)"
  printf 'figure. So do networks that learn from the rays of all objects.\n'
  printf '\nFrom left to right: Embree, `spherical` by probability, and their difference times 3:\n\n![By spherical fields](simple-spherical.png)\n'
  printf '\nThe same with `segment`:\n\n![By segment fields](simple-segment.png)\n'
} >"$pages/simple.md.new"
mv "$pages/simple.md.new" "$pages/simple.md"
