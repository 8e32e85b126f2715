#!/usr/bin/env bash
# Renders the Stanford dragon, baked with `balanced`, from 16 sides under a sun, a sky and an area light, by Embree and by
# the asset, and writes docs/results/pictures.md with a sheet for each light. Nothing of these views or lights was known to
# the bake. Takes some ten minutes on two cores.
#
#   docs/results/pictures.sh [WIDTH HEIGHT]     of a picture in pixels: 960 540
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

width=${1:-960} height=${2:-540}
nif=build/release/bin/nif mesh=build/sample/stanford_dragon.ply.gz asset=build/sample/stanford_dragon.nif
[[ -f $asset ]] || samples/run.sh >/dev/null
[[ -f $mesh ]] || { echo 'docs/results/pictures.sh: the dragon is not to be had' >&2 && exit 1; }
cmake --build build/release --target nif >&2
out=build/pictures
mkdir -p "$out"

# scene NAME SAMPLES: a scene with the light that standard input describes.
scene() {
  {
    printf '[picture]\nwidth = %s\nheight = %s\nsamples = %s\n\n' "$width" "$height" "$2"
    printf '[[object]]\nmesh = "../sample/stanford_dragon.ply.gz"\nnif = "../sample/stanford_dragon.nif"\n\n[ground]\n\n'
    printf '[[light]]\n'
    cat
    for ((i = 0; i < 16; ++i)); do
      printf '\n[[camera]]\nname = "%02d"\nazimuth = %s\nelevation = %s\nfill = 0.9\n' \
        $((i + 1)) "$((i * 45 / 2 - 180))" "$((5 + i * 37 % 64))"
    done
  } >"$out/$1.toml"
}
scene sun 16 <<<'type = "sun"
direction = [0.5, 0.8, 0.6]'
scene sky 64 <<<'type = "sky"'
scene area 64 <<<'type = "area"
corner = [0.05, 0.4, 0.05]
edge_u = [0.2, 0, 0]
edge_v = [0, 0, 0.2]
radiance = 1'

for light in sun sky area; do
  "$nif" render "$out/$light.toml" -o "$out/$light" --sheet "docs/results/pictures-$light.png" --thumbnail 160 --json \
    >"$out/$light.json"
done

{
  printf '# Pictures\n\n'
  printf 'Written by `docs/results/pictures.sh`: change nothing here by hand. %s x %s pixels; 16 samples a pixel under the\n' "$width" "$height"
  printf 'sun, 64 under sky and area light. The asset (%s bytes; preset `balanced`) was baked once, from rays of all\n' "$(stat -c %s "$asset")"
  printf 'directions: none of these views and lights were known to it. Model: the Stanford dragon, Stanford University\n'
  printf 'Computer Graphics Laboratory. How pictures are compared stands in [rendering.md](../rendering.md).\n\n'
  printf '| light | PSNR, bits: lowest (mean) | probability: lowest (mean) | hybrid: lowest (mean) | SSIM, probability: lowest | shadow rays wrong |\n'
  printf '| --- | ---: | ---: | ---: | ---: | ---: |\n'
  for light in sun sky area; do
    jq -r --arg light "$light" '
      def two: . * 100 | round / 100;
      def of($m): [.cameras[].pictures[$m].psnr] | "\(min | two) dB (\(add / length | two))";
      "| \($light) | \(of("bits")) | \(of("probability")) | \(of("hybrid")) | " +
      "\([.cameras[].pictures.probability.ssim] | min * 10000 | round / 10000) | " +
      "\([.cameras[].error] | add / length * 100000 | round / 1000) % |"' "$out/$light.json"
  done
  for light in sun sky area; do
    printf '\n## %s\n\n' "$light"
    printf 'For each camera: Embree, the asset by probabilities, the difference times 3.\n\n'
    printf '![Pictures under the %s](pictures-%s.png)\n\n' "$light" "$light"
    printf '| camera | bits | probability | hybrid | shadow rays wrong | certain |\n| --- | ---: | ---: | ---: | ---: | ---: |\n'
    jq -r '
      def two: . * 100 | round / 100;
      .cameras | to_entries[] | "| \(.key) | \(.value.pictures.bits.psnr | two) dB | \(.value.pictures.probability.psnr | two) dB | " +
      "\(.value.pictures.hybrid.psnr | two) dB | \(.value.error * 100000 | round / 1000) % | \(.value.certain * 1000 | round / 10) % |"' \
      "$out/$light.json"
  done
} >docs/results/pictures.md.new
mv docs/results/pictures.md.new docs/results/pictures.md
