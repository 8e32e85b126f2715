#!/usr/bin/env bash
# One shape with few triangles and with many: a bust of 2,000, 200,000 and 5,000,000 triangles side by side in one scene, and
# the bust with up to 50 million triangles, baked alone. Writes docs/results/paper/polygons.md. Takes about ten minutes on two
# cores, 16 GiB of memory and 1.2 GB of disk. NIF_MOST_TRIANGLES lowers the largest number of triangles.
#
#   [NIF_MOST_TRIANGLES=10000000] docs/results/paper/polygons.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."
mesh=build/paper/versions.glb model='Models: made by `nif mesh generate`.'
source docs/results/paper/common.sh

most=${NIF_MOST_TRIANGLES-50000000}
versions=(2000 200000 5000000)
x=-2.4
for triangles in "${versions[@]}"; do
  generated "bust_$triangles" statue "$triangles" 1
  placed "bust_$triangles" "$x" 3.01 0 1 25
  x=$(awk -v x="$x" 'BEGIN { print x + 2.4 }')
done | assembled versions

samples=64
view versions importance "$front"
bake versions versions $samples
bake_ours versions_ours --preset fast
judge versions "$out/versions.nif" "$front" none --sheet "$pages/polygons-spherical.png" --thumbnail 320
judge versions_ours "$out/versions_ours.nif" "$front" none --sheet "$pages/polygons-segment.png" --thumbnail 320

# Alone, with this project's encoding only: cost and quality of a bake.
counts=()
for triangles in 500000 5000000 50000000; do
  ((triangles <= most)) || continue
  counts+=("$triangles")
  generated "bust_$triangles" statue "$triangles" 1
  mesh=$out/bust_$triangles.ply
  if [[ ! -f $out/alone_$triangles.json ]]; then
    "$nif" bake "$mesh" -o "$out/alone_$triangles.nif" --encoding segment --preset fast --json >"$out/alone_$triangles.json.new"
    mv "$out/alone_$triangles.json.new" "$out/alone_$triangles.json"
  fi
  judge "alone_$triangles" "$out/alone_$triangles.nif" "$front" none
done

{
  heading 'One shape with few triangles and with many'
  printf 'Three versions of one bust in one scene, of %s, %s and %s triangles. To the network, an object is a box and a field,\n' "${versions[@]}"
  printf 'whatever the number of triangles that it was trained on. Trained with %s samples a pixel from the view that is judged.\n\n' $samples
  printf '| | file | bits | probability |\n| --- | ---: | ---: | ---: |\n'
  printf '| `spherical`, networks for each object | %s | %s dB | %s dB |\n' "$(size "$out/versions.nif")" \
    "$(psnr versions bits)" "$(psnr versions probability)"
  printf '| `segment`, preset `fast`, any view and light | %s | %s dB | %s dB |\n' "$(size "$out/versions_ours.nif")" \
    "$(psnr versions_ours bits)" "$(psnr versions_ours probability)"
  printf '\nFrom left to right: Embree, `spherical` by probability, and their difference times 3:\n\n![By spherical fields](polygons-spherical.png)\n'
  printf '\nThe same with `segment`:\n\n![By segment fields](polygons-segment.png)\n'
  printf '\n## The bust alone\n\n'
  printf '`nif bake bust.ply --encoding segment --preset fast`, all threads. Errors are measured on 10^6 rays of each set, with the picture as\n'
  printf 'above. The times are from one run on a shared machine.\n\n'
  printf '| triangles | mesh file | bake | peak memory | asset | wrong, `outer-lines` | wrong, `inner-surface` | bits |\n'
  printf '| ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n'
  for triangles in "${counts[@]}"; do
    printf '| %s | %.1f MB | %s | %s | %s dB |\n' "$(of "alone_$triangles" .triangles)" \
      "$(stat -c %s "$out/bust_$triangles.ply" | awk '{ print $1 / 1e6 }')" \
      "$(of "alone_$triangles" '"\(.seconds | round) s | \(.peak_memory / 1e6 | round) MB"')" \
      "$(size "$out/alone_$triangles.nif") | $(of "alone_$triangles" '.sets | "\(."outer-lines".error * 1e4 | round / 100) % | \(."inner-surface".error * 1e4 | round / 100) %"')" \
      "$(psnr "alone_$triangles" bits)"
  done
} >"$pages/polygons.md.new"
mv "$pages/polygons.md.new" "$pages/polygons.md"
