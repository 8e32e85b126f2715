# shellcheck shell=bash disable=SC2034 # what only the scripts use that source this
# What the paper's experiments share; sourced by the scripts beside it, from the project's root.
#
# The scene of those that say nothing else: the Stanford dragon on a ground under a sky with a bright glow, seen by one
# camera. Training is the paper's, done offline from that camera: each round learns from one shadow ray of each pixel, its
# direction drawn by the light unless told otherwise. Pictures to judge by are drawn with other random numbers than
# training. A script may set `mesh` and `model` before it sources this, and `others` and of_light() after it.

nif=build/release/bin/nif out=build/paper pages=docs/results/paper
cmake --build build/release --target nif >&2
mkdir -p "$out"
if [[ -z ${mesh-} ]]; then
  mesh=build/sample/stanford_dragon.ply.gz ours=build/sample/stanford_dragon.nif
  [[ -f $ours ]] || samples/run.sh >/dev/null
  [[ -f $mesh ]] || { echo "$0: the dragon is not to be had" >&2 && exit 1; }
fi

# Cameras of training and judging, as TOML.
front='[[camera]]
name = "front"
azimuth = 30
elevation = 20
fill = 0.9'

# The light of all scenes whose script says nothing else: of_light SAMPLING, as TOML.
of_light() {
  printf '[[light]]\ntype = "sky"\nradiance = 0.3\nsampling = "%s"\n' "$1"
  printf '[light.glow]\ndirection = [0.5, 0.7, 0.4]\nradiance = 30\nangle = 8\n'
}
# Objects beside the mesh that is baked, as TOML, answered by Embree.
others=''

# generated NAME SHAPE TRIANGLES SEED: a mesh of `nif mesh generate`, build/paper/NAME.ply.
generated() {
  [[ -f $out/$1.ply ]] || "$nif" mesh generate "$2" -o "$out/$1.ply" --triangles "$3" --seed "$4" --quiet
}
# placed NAME X Y Z SCALE [TURN]: such a mesh as an object of a scene in build/paper/, as TOML; turned about y, in degrees.
placed() {
  printf '[[object]]\nmesh = "%s.ply"\ntranslate = [%s, %s, %s]\nscale = %s\nrotate = [0, %s, 0]\n\n' "$1" "$2" "$3" "$4" \
    "$5" "${6-0}"
}
# assembled NAME: the objects that standard input describes as one mesh file, build/paper/NAME.glb.
assembled() {
  cat >"$out/$1.objects.toml"
  "$nif" mesh convert "$out/$1.objects.toml" -o "$out/$1.glb" --quiet
}

# view NAME SAMPLING CAMERAS [NIF]: the scene, without an asset to learn from.
view() {
  printf '[picture]\nwidth = 960\nheight = 540\n\n[[object]]\nmesh = "../../%s"\n%s\n%s\n[ground]\n\n%s\n\n%s\n' \
    "$mesh" "${4-}" "$others" "$(of_light "$2")" "$3" >"$out/$1.toml"
}

# bake NAME VIEW SAMPLES [options of nif bake]: learns from a view; an asset that is there already is not baked again.
bake() {
  local name=$1 from=$2 samples=$3
  shift 3
  [[ -f $out/$name.json ]] && return
  "$nif" bake "$mesh" -o "$out/$name.nif" --preset paper --view "$out/$from.toml" --view-samples "$samples" --rays 0 \
    --json "$@" >"$out/$name.json.new"
  mv "$out/$name.json.new" "$out/$name.json"
}

# bake_ours NAME [options of nif bake]: this project's own encoding, from rays of all directions.
bake_ours() {
  local name=$1
  shift
  [[ -f $out/$name.json ]] && return
  "$nif" bake "$mesh" -o "$out/$name.nif" --encoding segment --rays 0 --json "$@" >"$out/$name.json.new"
  mv "$out/$name.json.new" "$out/$name.json"
}

# judge NAME ASSET CAMERAS EXACT [options of nif render]: leaves NAME.judged.json, and its pictures in a folder. As with
# bake, what is there already is not made again: the same options give the same bytes. `fields` may hold more lines for the
# scene's object.
fields=
judge() {
  local name=$1 asset=$2 cameras=$3 exact=$4
  shift 4
  [[ -f $out/$name.judged.json ]] && return
  view "$name.judged" importance "$cameras" "nif = \"../../$asset\"$fields"
  "$nif" render "$out/$name.judged.toml" -o "$out/$name" --samples 64 --seed 2 --exact "$exact" --json "$@" \
    >"$out/$name.judged.json.new"
  mv "$out/$name.judged.json.new" "$out/$name.judged.json"
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
  printf '960 x 540 pixels, %s (`docs/results/paper/common.sh`), judged by 64 samples a pixel that were not\n' "${lit:-a sky with a glow}"
  printf 'learned from. %s\n\n' "${model-Model: the Stanford dragon, Stanford University Computer Graphics Laboratory.}"
}
