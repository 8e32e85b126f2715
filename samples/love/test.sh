#!/usr/bin/env bash
# Tests samples/love: its declarations against nif.h, its rules without a window, and the game in LÖVE, played by scripts on a
# virtual screen. With NIF_TEST_MESHES also in a hall of Stanford dragons. Prints "Skipped: ..." and exits with 0 if LÖVE, LuaJIT
# or Xvfb is not installed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=samples/prepare.sh
source samples/prepare.sh

for program in love luajit xvfb-run Xvfb; do
  command -v "$program" >/dev/null || { echo "Skipped: $program is not installed (tools/setup.sh love)" && exit 0; }
done
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
failures=0
fail() {
  echo "samples/love/test.sh: $*" >&2
  failures=$((failures + 1))
}

prepare_nifkit
game=samples/love
library=$(realpath "$prefix"/lib*/libnif.so | head -n 1)
mkdir -p build/samples
LC_ALL=C awk -f samples/torus_knot.awk >build/samples/knot.obj.new
cmp -s build/samples/knot.obj.new build/samples/knot.obj || cp build/samples/knot.obj.new build/samples/knot.obj
prepare_asset build/samples/knot.obj
knot=$PWD/$asset

# Declarations. Each change must be found.
luajit $game/test_cdef.lua "$prefix/include" "$scratch" || fail 'nif_cdef.lua is not nif.h'
mkdir "$scratch/changed"
change() {
  sed "$1" $game/nif_cdef.lua >"$scratch/changed/nif_cdef.lua"
  ! cmp -s "$scratch/changed/nif_cdef.lua" $game/nif_cdef.lua || fail "'$1' changes nothing"
  if LUA_PATH="$scratch/changed/?.lua;;" luajit $game/test_cdef.lua "$prefix/include" "$scratch" >"$scratch/said" 2>&1; then
    fail "test_cdef.lua does not find '$1'"
  fi
}
change '/int32_t\* logit;/d'
change 's/uint32_t instance_count;/uint64_t instance_count;/'
change 's/uint8_t\* certain;/int8_t* certain;/'
change '/float\* u;/{h;d};/float\* v;/{p;x}'
change 's/NIF_LOAD_IN_PLACE = 1/NIF_LOAD_IN_PLACE = 2/'
change 's/nifLoadAssetFile(NifDevice device, const char\* path/nifLoadAssetFile(NifDevice device, char* path/'
change 's/void nifReleaseScene(NifScene scene)/void nifReleaseScene(NifAsset scene)/'

# Rules. Two wrong libraries are made for this.
printf 'int nothing;\n' | cc -shared -fPIC -x c - -o "$scratch/libplain.so"
printf 'unsigned nifGetVersion(void) { return 200; }\n' | cc -shared -fPIC -x c - -o "$scratch/libother.so"
golden=tests/golden/v2-shapes.nif
luajit $game/test_game.lua "$library" "$knot" $golden "$scratch" || fail 'the game in a hall of knots'

# The README's example. The ray goes through the centre of the statue.
sed -n '/^```lua/,/^```$/p' $game/README.md | sed '/^```/d' \
  | sed "s,/opt/nifkit/lib/libnif.so,$library,; s,statue.nif,$knot," >"$scratch/example.lua"
said=$(LUA_PATH="$game/?.lua" luajit "$scratch/example.lua") || fail "the README's example"
[[ $said == hidden ]] || fail "the README's example said '$said'"

# love_plays NAME [options of the game]: plays the script $scratch/NAME.txt. Sets code, and writes $scratch/said.
love_plays() {
  code=0
  ALSOFT_DRIVERS=null XDG_DATA_HOME=$scratch/home timeout 240 xvfb-run -a -s '-screen 0 1400x900x24' \
    love $game --script "$scratch/$1.txt" "${@:2}" >"$scratch/said" 2>&1 || code=$?
}
expect_played() {
  love_plays "$@"
  ((code == 0)) || fail "script $1 ended with $code: $(cat "$scratch/said")"
}
# expect_refused NAME TEXT [options of the game]
expect_refused() {
  love_plays "$1" "${@:3}"
  if ((code != 1)) || ! grep -q "^statues: .*$2" "$scratch/said"; then
    fail "script $1, $2: ended with $code: $(cat "$scratch/said")"
  fi
}
# is_picture FILE: a PNG of the window's size with more than one colour.
is_picture() {
  python3 - "$1" <<'EOF' || fail "$1 is no picture of the game"
import struct, sys, zlib
data = open(sys.argv[1], "rb").read()
assert data[:8] == b"\x89PNG\r\n\x1a\n", "not a PNG"
width, height = struct.unpack(">II", data[16:24])
assert (width, height) == (1280, 748), (width, height)
at, packed = 8, b""
while at < len(data):
    size, kind = struct.unpack(">I4s", data[at : at + 8])
    packed += data[at + 8 : at + 8 + size] if kind == b"IDAT" else b""
    at += 12 + size
assert len(set(zlib.decompress(packed))) > 50, "hardly anything is in it"
EOF
}

# Keys move the player: right along the wall, and back, with arrows and letters, between cells 1 and 4 of the bottom row.
keys=$(printf 'near 1 11\nhold right 1.4\nnear 3 11\nhold a 2\nnear 1 11\nhold w 0.75\nnear 1 10\nhold down 1\nnear 1 11')

# play ASSET: wins with the plan that test_game.lua wrote, starts again, and is caught.
play() {
  local name
  name=$(basename "$1" .nif)
  {
    head -n 60 "$scratch/win.txt"
    echo "shot $scratch/$name.middle.png"
    tail -n +61 "$scratch/win.txt"
    printf 'expect won\ngems 0\nshot %s\n' "$scratch/$name.won.png"
    printf 'press r\nexpect playing\ngems 3\n%s\nwalk 1 7\nuntil seen 40\nshot %s\nuntil caught 10\nshot %s\n' \
      "$keys" "$scratch/$name.seen.png" "$scratch/$name.caught.png"
  } >"$scratch/play.txt"
  expect_played play --asset "$1" --library "$library"
  local picture
  for picture in middle won seen caught; do is_picture "$scratch/$name.$picture.png"; done
}
play "$knot"
# The same script draws the same picture.
mv "$scratch/knot.caught.png" "$scratch/first.png"
play "$knot"
cmp "$scratch/first.png" "$scratch/knot.caught.png" || fail 'the same script drew another picture'

# Missing or wrong things are reported.
echo 'wait 0.1' >"$scratch/short.txt"
printf 'wait 0.1\nexpect won\n' >"$scratch/hasty.txt"
printf 'jump\n' >"$scratch/unknown.txt"
printf 'shot %s/no_such/a.png\nwait 1\n' "$scratch" >"$scratch/nowhere.txt"
expect_played short --asset "$knot" --library "$library"
expect_refused short "cannot load nifkit's runtime, $scratch/no_such.so" --asset "$knot" --library "$scratch/no_such.so"
expect_refused short 'it has no nifGetVersion.*--library' --asset "$knot" --library "$scratch/libplain.so"
expect_refused short "no_such.nif" --asset "$scratch/no_such.nif" --library "$library"
expect_refused short 'README.md' --asset README.md --library "$library"
expect_refused short 'v2-proof.nif: an asset of the encoding proof' --asset tests/golden/v2-proof.nif --library "$library"
expect_refused short 'there is no asset; usage: love' --library "$library"
expect_refused short "unknown option '--what'" --what
expect_refused short 'up takes y or z' --asset "$knot" --up w
expect_refused hasty 'hasty.txt, line 2: expected won' --asset "$knot" --library "$library"
expect_refused unknown 'unknown.txt, line 1: cannot read' --asset "$knot" --library "$library"
expect_refused no_such 'cannot read .*no_such.txt' --asset "$knot" --library "$library"
expect_refused nowhere 'cannot write .*/no_such/a.png' --asset "$knot" --library "$library"

# The one command, as users run it.
samples/love/run.sh build/samples/knot.obj --screenshot "$scratch/run.png" || fail 'run.sh'
is_picture "$scratch/run.png"
for wrong in 'no_such.obj' '--what' '--up'; do
  code=0
  samples/love/run.sh "$wrong" >"$scratch/said" 2>&1 || code=$?
  if ((code != 2)) || ! grep -q '^samples/love/run.sh: ' "$scratch/said"; then
    fail "run.sh $wrong ended with $code: $(cat "$scratch/said")"
  fi
done

if [[ -r ${NIF_TEST_MESHES-}/stanford_dragon_871k.ply.gz ]]; then
  prepare_asset "$NIF_TEST_MESHES/stanford_dragon_871k.ply.gz"
  luajit $game/test_game.lua "$library" "$PWD/$asset" $golden "$scratch" || fail 'the game in a hall of dragons'
  play "$PWD/$asset"
else
  echo 'Skipped: a hall of dragons, because NIF_TEST_MESHES does not name a folder that has them'
fi

((failures == 0)) || exit 1
echo 'samples/love: all is well'
