#!/usr/bin/env bash
# Offline training from 1, 4, 16 and 64 viewpoints with networks of width 64, 128 and 256, judged from viewpoints that were not
# used for training. The paper proposes this and does not show it. Every training has the same number of rays: 64 viewpoints
# learn from one sample of each pixel, one viewpoint from 64. Writes docs/results/paper/viewpoints.md. Wide networks take long:
# about half an hour in all, on two cores.
#
#   docs/results/paper/viewpoints.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."
source docs/results/paper/common.sh

# cameras COUNT SHIFT: evenly about the object, from low to high.
cameras() {
  for ((i = 0; i < $1; ++i)); do
    awk -v i="$i" -v n="$1" -v shift="$2" 'BEGIN {
      printf "[[camera]]\nname = \"%02d\"\nazimuth = %.3f\nelevation = %.3f\nfill = 0.9\n\n", i + 1,
        (i * 137.508 + shift) % 360 - 180, 5 + 60 * ((i + 0.5) / n) }'
  done
}

unseen=$(cameras 4 77)
widths=(64 128 256)
for views in 1 4 16 64; do
  view "views_$views" importance "$(cameras "$views" 0)"
  for width in "${widths[@]}"; do
    name=views_${views}_$width
    bake "$name" "views_$views" $((64 / views)) --outer-width "$width" --inner-width "$width"
    sheet=()
    [[ $name != views_64_64 ]] || sheet=(--sheet "$pages/viewpoints-spherical.png" --thumbnail 112)
    judge "$name" "$out/$name.nif" "$unseen" none --width 480 --height 270 "${sheet[@]}"
  done
done
judge ours_unseen "$ours" "$unseen" none --width 480 --height 270 --sheet "$pages/viewpoints-segment.png" --thumbnail 112
{
  heading 'Offline training from several viewpoints'
  printf 'Judged from four viewpoints that were not used for training, on pictures of 480 x 270 pixels. The figure is the lowest PSNR of the\n'
  printf 'four, by probability (and by bits). `segment` was baked once with `--preset balanced` and knows no viewpoint.\n\n'
  printf '| viewpoints |'
  for width in "${widths[@]}"; do printf ' width %s |' "$width"; done
  printf '\n| ---: |'
  for width in "${widths[@]}"; do printf ' ---: |'; done
  printf '\n'
  for views in 1 4 16 64; do
    printf '| %s |' "$views"
    for width in "${widths[@]}"; do printf ' %s dB (%s) |' "$(psnr "views_${views}_$width" probability)" "$(psnr "views_${views}_$width" bits)"; done
    printf '\n'
  done
  printf '\nFiles:'
  for width in "${widths[@]}"; do printf ' %s with width %s,' "$(size "$out/views_1_$width.nif")" "$width"; done
  printf ' and %s of `segment`, which reaches **%s dB** (%s).\n' "$(size "$ours")" "$(psnr ours_unseen probability)" "$(psnr ours_unseen bits)"
  printf '\nFrom left to right: the four views by Embree, by `spherical` of width 64 from 64 viewpoints (probability), and their difference times 3:\n\n'
  printf '![By spherical fields](viewpoints-spherical.png)\n\nThe same with `segment`:\n\n![By segment](viewpoints-segment.png)\n'
} >"$pages/viewpoints.md.new"
mv "$pages/viewpoints.md.new" "$pages/viewpoints.md"
