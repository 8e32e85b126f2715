# What the paper's experiments share; sourced by the scripts beside it, from the project's root.
#
# The scene of all of them: the Stanford dragon on a ground under a sky with a bright glow, seen by one camera. Training
# is the paper's, done offline from that camera: each round learns from one shadow ray of each pixel, its direction drawn
# by the sky's light unless told otherwise. Pictures to judge by are drawn with other random numbers than training.

nif=build/release/bin/nif mesh=build/sample/stanford_dragon.ply.gz ours=build/sample/stanford_dragon.nif
[[ -f $ours ]] || samples/run.sh >/dev/null
[[ -f $mesh ]] || { echo "$0: the dragon is not to be had" >&2 && exit 1; }
cmake --build build/release --target nif >&2
out=build/paper pages=docs/results/paper
mkdir -p "$out"

# Cameras of training and judging, as TOML.
front='[[camera]]
name = "front"
azimuth = 30
elevation = 20
fill = 0.9'

# view NAME SAMPLING CAMERAS: the scene without assets, to learn from.
view() {
  printf '[picture]\nwidth = 960\nheight = 540\n\n[[object]]\nmesh = "../sample/stanford_dragon.ply.gz"\n%s\n[ground]\n\n' "${4-}"
  printf '[[light]]\ntype = "sky"\nradiance = 0.3\nsampling = "%s"\n' "$2"
  printf '[light.glow]\ndirection = [0.5, 0.7, 0.4]\nradiance = 30\nangle = 8\n\n%s\n' "$3"
} >"$out/$1.toml"

# bake NAME VIEW SAMPLES [options of nif bake]: learns from a view; an asset that is there already is not baked again.
bake() {
  local name=$1 from=$2 samples=$3
  shift 3
  [[ -f $out/$name.json ]] && return
  "$nif" bake "$mesh" -o "$out/$name.nif" --preset paper --view "$out/$from.toml" --view-samples "$samples" --rays 0 \
    --json "$@" >"$out/$name.json.new"
  mv "$out/$name.json.new" "$out/$name.json"
}

# judge NAME ASSET CAMERAS EXACT [options of nif render]: leaves NAME.judged.json, and its pictures in a folder. `fields`
# may hold more lines for the scene's object.
fields=
judge() {
  local name=$1 asset=$2 cameras=$3 exact=$4
  shift 4
  view "$name.judged" importance "$cameras" "nif = \"../../$asset\"$fields"
  "$nif" render "$out/$name.judged.toml" -o "$out/$name" --samples 64 --seed 2 --exact "$exact" --json "$@" \
    >"$out/$name.judged.json"
}

# psnr NAME MODE: lowest over the cameras, in dB.
psnr() { jq -r --arg mode "$2" '[.cameras[].pictures[$mode].psnr] | min * 100 | round / 100' "$out/$1.judged.json"; }
# of NAME FIELD: of a bake's JSON.
of() { jq -r "$2" "$out/$1.json"; }
kilobytes() { awk -v bytes="$1" 'BEGIN { printf "%.1f kB", bytes / 1000 }'; }
size() { kilobytes "$(stat -c %s "$1")"; }

heading() {
  printf '# %s\n\nWritten by `%s`: change nothing here by hand.\n' "$1" "$0"
  printf 'Settings, but for what the table says: `nif bake --preset paper --view`, whose values are the paper'"'"'s, one camera of\n'
  printf '960 x 540 pixels, a sky with a glow (`docs/results/paper/common.sh`), judged by 64 samples a pixel that were not\n'
  printf 'learned from. Model: the Stanford dragon, Stanford University Computer Graphics Laboratory.\n\n'
}
