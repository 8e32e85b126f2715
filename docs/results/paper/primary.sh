#!/usr/bin/env bash
# A network that answers primary rays: hit or miss, depth and normal of the dragon, with grids of R = 256 and R = 32, as the
# paper shows. Writes docs/results/paper/primary.md; takes about five minutes on two cores.
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

# seen NAME FIELD FORMAT: of how the camera's rays are answered.
seen() { jq -r ".cameras.front.primary.$2" "$out/$1.judged.json" | awk -v format="$3" '{ printf format, $1 * scale }' scale="${4-1}"; }
{
  heading 'A network that answers primary rays'
  printf 'Learned from 64 samples a pixel of the very view that is judged (`nif bake --primary`; `docs/encodings/spherical.md` has what it learns).\n'
  printf 'In the pictures camera rays are answered by the network where they come to the dragon, all shadow rays by Embree. **Differ**\n'
  printf 'are camera rays that hit the dragon by one and not by the other, of all, %s of which hit it; depth, over the diagonal of the\n' \
    "$(seen primary_256 hits '%.1f %%' 100)"
  printf 'AABB, and normal are mean errors where both hit it.\n\n'
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
  printf '\nEmbree, the network with R = 256, and the difference times 3:\n\n![R = 256](primary-256.png)\n'
  printf '\nThe same with R = 32:\n\n![R = 32](primary-32.png)\n'
} >"$pages/primary.md.new"
mv "$pages/primary.md.new" "$pages/primary.md"
