#!/usr/bin/env bash
# A network that answers primary rays: hit or miss, depth and normal of the dragon, with grids of R = 256 and R = 32, as in the
# paper. Writes docs/results/paper/primary.md. Takes about five minutes on two cores.
#
#   docs/results/paper/primary.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."
source docs/results/paper/common.sh

view view importance "$front"
fields=$'\nprimary = true'
for r in 256 32; do
  bake "primary_$r" view 64 --primary --primary-resolution "$r"
  judge "primary_$r" "$out/primary_$r.nif" "$front" none --sheet "$pages/primary-$r.png" --thumbnail 320
done
"$nif" bench "$ours" --mesh "$mesh" --set outer-lines --rays 1000 --rounds 1 --embree all --json >"$out/primary.bench.json"

# seen NAME FIELD FORMAT: a figure about the answers to the camera's rays.
seen() { jq -r ".cameras.front.primary.$2" "$out/$1.judged.json" | awk -v format="$3" '{ printf format, $1 * scale }' scale="${4-1}"; }
{
  heading 'A network that answers primary rays'
  printf 'Trained with 64 samples a pixel from the view that is judged (`nif bake --primary`; [spherical.md](../../encodings/spherical.md#primary-rays)\n'
  printf 'describes the field). In the pictures the network answers camera rays that come to the dragon, and Embree answers all shadow rays.\n\n'
  printf '**Differ** is the share of all camera rays that hit the dragon by one and not by the other. %s of all camera rays hit it. **Depth**\n' \
    "$(seen primary_256 hits '%.1f %%' 100)"
  printf '(over the diagonal of the AABB) and **normal** are mean errors of the rays that hit it by both.\n\n'
  printf '| R | grids | network | picture | SSIM | differ | depth | normal | training |\n'
  printf '| ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n'
  for r in 256 32; do
    name=primary_$r
    "$nif" info "$out/$name.nif" --json >"$out/$name.info.json"
    printf '| %s | %s | %s | %s dB | %s | %s | %s | %s | %.1f M rays |\n' "$r" \
      "$(kilobytes "$(jq '.objects[0].primary.bytes.grids' "$out/$name.info.json")")" \
      "$(kilobytes "$(jq '.objects[0].primary.bytes.network' "$out/$name.info.json")")" "$(psnr "$name" primary)" \
      "$(jq -r '.cameras.front.pictures.primary.ssim * 1e4 | round / 1e4' "$out/$name.judged.json")" \
      "$(seen "$name" differ '%.3f %%' 100)" "$(seen "$name" depth_error '%.2f %%' 100)" \
      "$(seen "$name" normal_error '%.1f degrees')" "$(of "$name" '.objects[0].primary_rays / 1e6')"
  done
  bvh() { jq "[.sets[\"outer-lines\"].variants[].bytes] | $1 / 1e5 | round / 10" "$out/primary.bench.json"; }
  printf '\nEmbree'"'"'s BVH of the mesh takes %s to %s MB (`nif bench --embree all`).\n' "$(bvh min)" "$(bvh max)"
  printf '\nFrom left to right: Embree, the network with R = 256, and their difference times 3:\n\n![R = 256](primary-256.png)\n'
  printf '\nThe same with R = 32:\n\n![R = 32](primary-32.png)\n'
} >"$pages/primary.md.new"
mv "$pages/primary.md.new" "$pages/primary.md"
