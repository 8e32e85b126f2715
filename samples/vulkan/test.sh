#!/usr/bin/env bash
# Tests samples/vulkan: every pixel's light is that of nifQuery on the CPU, the picture looks like that of `nif render`, Vulkan's
# validation layer has nothing to say, and errors are reported with an exit code and leave no file. With NIF_TEST_MESHES also with
# the Stanford dragon. Prints "Skipped: ..." and exits with 0 if Vulkan, a device of it or glslangValidator is not installed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=samples/prepare.sh
source samples/prepare.sh

if ! printf '#include <vulkan/vulkan.h>\n' | cc -E - >/dev/null 2>&1 || ! command -v glslangValidator >/dev/null; then
  echo 'Skipped: Vulkan or glslangValidator is not installed (tools/setup.sh shader)'
  exit 0
fi
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
failures=0
fail() {
  echo "samples/vulkan/test.sh: $*" >&2
  failures=$((failures + 1))
}

# The tests must not depend on the machine: on the CPU, if Mesa's lavapipe is there.
device=(--device llvmpipe)

# The one command, as users run it, always with the knot.
mkdir -p build/samples
LC_ALL=C awk -f samples/torus_knot.awk >build/samples/knot.obj.new
cmp -s build/samples/knot.obj.new build/samples/knot.obj || cp build/samples/knot.obj.new build/samples/knot.obj
code=0
samples/vulkan/run.sh build/samples/knot.obj --width 64 --height 40 --check >"$scratch/said" 2>"$scratch/complaints" || code=$?
if ((code)) && grep -qE 'no driver for Vulkan|Vulkan has no device' "$scratch/complaints"; then
  echo 'Skipped: Vulkan has no device (tools/setup.sh shader installs one that is the CPU)'
  exit 0
fi
((code == 0)) || fail "run.sh ended with $code: $(cat "$scratch/complaints")"
[[ -s build/vulkan/knot.segment.png ]] || fail 'run.sh made no picture'
code=0
samples/vulkan/run.sh no_such_mesh.obj >"$scratch/said" 2>&1 || code=$?
if ((code != 2)) || ! grep -qF no_such_mesh.obj "$scratch/said"; then
  fail "run.sh no_such_mesh.obj ended with $code: $(cat "$scratch/said")"
fi

prepare_nifkit
# With sanitizers; drivers leak.
cmake -S samples/vulkan -B "$scratch/build" -G Ninja -DCMAKE_PREFIX_PATH="$(realpath "$prefix")" -DCMAKE_BUILD_TYPE=Debug \
  '-DCMAKE_CXX_FLAGS=-O1 -Werror -fsanitize=address,undefined -fno-sanitize-recover=all' >/dev/null
ASAN_OPTIONS=detect_leaks=0 cmake --build "$scratch/build" >/dev/null
picture=$scratch/build/picture
export ASAN_OPTIONS=detect_leaks=0
[[ -n $("$picture" build/samples/knot.segment.nif -o "$scratch/any.png" "${device[@]}" --width 16 --height 16 2>/dev/null) ]] \
  || device=()

# passes MESH DECIBELS [options]: no pixel differs from the CPU's, and the picture is like that of `nif render`.
passes() {
  local mesh=$1 least=$2 name same other
  shift 2
  prepare_asset "$mesh" segment
  name=$scratch/$(basename "$asset" .nif)
  "$picture" "$asset" -o "$name.png" "${device[@]}" --width 240 --height 150 --samples 4 --check "$@" >"$scratch/said" \
    || { fail "no picture of $mesh" && return; }
  cat "$scratch/said"
  grep -q '^0 of 144000 pixels differ from the CPU.s$' "$scratch/said" || fail "$mesh: the check says nothing"
  # 'camera 1 2 3, target 1 2 3, sun 1 2 3' as lists of TOML
  local camera target sun
  IFS=';' read -r camera target sun < <(sed -nE 's/^camera (.*), target (.*), sun (.*)$/\1;\2;\3/p' "$scratch/said" | tr ' ' ',')
  local sun_is
  for sun_is in same other; do
    local object=("[[object]]" "mesh = \"$(realpath "$mesh")\"" "nif = \"$(realpath "$asset")\"" 'albedo = 0.6')
    {
      printf '%s\n' '[picture]' 'width = 240' 'height = 150' 'samples = 32' 'exposure = 0.95' '[ground]' 'albedo = 0.8' \
        'size = 400' "${object[@]}" '[[light]]' 'type = "sun"' 'irradiance = [2.9, 2.6, 2.15]' 'angle = 4'
      # For the other picture the sun stands elsewhere, which the comparison must see.
      [[ $sun_is == same ]] && echo "direction = [$sun]" || echo 'direction = [0.5, 0.5, -0.5]'
      printf '%s\n' '[[light]]' 'type = "sky"' 'radiance = [0.36, 0.45, 0.58]' '[[camera]]' 'name = "view"' \
        "position = [$camera]" "target = [$target]" 'fov = 40'
    } >"$scratch/scene.toml"
    "$nif" render "$scratch/scene.toml" -o "$scratch/render" --primary asset --quiet || fail "$mesh: nif render"
    if [[ $sun_is == same ]]; then
      same=$(python3 samples/vulkan/compare.py "$name.png" "$scratch/render/view-asset.png")
    else
      other=$(python3 samples/vulkan/compare.py "$name.png" "$scratch/render/view-asset.png")
    fi
  done
  echo "$mesh: $same dB from nif render's picture, $other dB with another sun"
  awk -v same="$same" -v least="$least" 'BEGIN { exit !(same >= least) }' || fail "$mesh: $same dB, below $least"
  awk -v other="$other" -v least="$least" 'BEGIN { exit !(other < least - 10) }' \
    || fail "$mesh: $other dB with another sun, so the comparison sees nothing"
}
passes build/samples/knot.obj 36
passes build/samples/knot.obj 36 --sun 100,20 --camera 10,40
if [[ -r ${NIF_TEST_MESHES-}/stanford_dragon_871k.ply.gz ]]; then
  passes "$NIF_TEST_MESHES/stanford_dragon_871k.ply.gz" 36
else
  echo 'Skipped: the dragon, because NIF_TEST_MESHES does not name a folder that has it'
fi

knot=build/samples/knot.segment.nif
# Vulkan's validation layer writes what it finds to standard output.
if [[ -e /usr/share/vulkan/explicit_layer.d/VkLayer_khronos_validation.json ]]; then
  VK_INSTANCE_LAYERS=VK_LAYER_KHRONOS_validation "$picture" "$knot" -o "$scratch/layer.png" "${device[@]}" --width 64 --height 40 \
    >"$scratch/said" 2>&1 || fail 'no picture under the validation layer'
  ! grep -iE 'validation|VUID' "$scratch/said" || fail 'the validation layer complains'
else
  echo "Skipped: Vulkan's validation layer is not installed (tools/setup.sh shader)"
fi
# The same picture again.
"$picture" "$knot" -o "$scratch/again.png" "${device[@]}" --width 64 --height 40 >/dev/null || fail 'no picture again'
cmp "$scratch/layer.png" "$scratch/again.png" || fail 'another picture, again'

# refuses CODE TEXT ARGUMENT...: expects one line with the text, this exit code, and no file in the folder "made".
mkdir "$scratch/made" "$scratch/folder"
refuses() {
  local code=0 wanted=$1 text=$2
  shift 2
  "$picture" "$@" >"$scratch/said" 2>&1 || code=$?
  ((code == wanted)) || fail "'$*' ended with $code, not $wanted"
  if [[ $(wc -l <"$scratch/said") != 1 ]] || ! grep -qF -- "$text" "$scratch/said"; then
    fail "'$*' did not say '$text', but: $(cat "$scratch/said")"
  fi
  [[ -z $(ls -A "$scratch/made") ]] || fail "'$*' left a file: $(ls -A "$scratch/made")"
}
png=$scratch/made/picture.png
head -c 1000 "$knot" >"$scratch/short.nif"
: >"$scratch/empty.nif"
refuses 2 'give an asset' -o "$png"
refuses 2 'give an asset' "$knot"
refuses 2 "'other.nif'" "$knot" other.nif -o "$png"
refuses 2 "unknown option '--what'" "$knot" --what
refuses 2 '-o takes a value' "$knot" -o
refuses 2 '--width takes a number, 16 to 4096' "$knot" -o "$png" --width 1e3
refuses 2 '--samples takes a number, 1 to 1024' "$knot" -o "$png" --samples 0
refuses 2 '--sun takes AZIMUTH,ELEVATION' "$knot" -o "$png" --sun nan,nan
refuses 2 '--sun takes AZIMUTH,ELEVATION' "$knot" -o "$png" --sun 10
refuses 2 '--up takes x, y or z' "$knot" -o "$png" --up w
refuses 1 "$scratch/no_such.nif" "$scratch/no_such.nif" -o "$png"
refuses 1 "$scratch/folder" "$scratch/folder" -o "$png"
refuses 1 "$scratch/empty.nif" "$scratch/empty.nif" -o "$png"
refuses 1 "$scratch/short.nif" "$scratch/short.nif" -o "$png"
refuses 1 README.md README.md -o "$png"
refuses 1 'object' "$knot" -o "$png" --object 7
refuses 1 'spherical' tests/golden/v2-spherical.nif -o "$png"
refuses 1 "$scratch/no_such/picture.png" "$knot" -o "$scratch/no_such/picture.png" --width 16 --height 16
refuses 1 "$scratch/folder" "$knot" -o "$scratch/folder" --width 16 --height 16
refuses 1 "contains 'no such'" "$knot" -o "$png" --device 'no such'
VK_ICD_FILENAMES=$scratch/no_such.json refuses 1 'Vulkan' "$knot" -o "$png"
# A device that allows little.
cat >"$scratch/limits.c" <<'END'
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdlib.h>
#include <vulkan/vulkan.h>
void vkGetPhysicalDeviceProperties(VkPhysicalDevice device, VkPhysicalDeviceProperties* properties) {
  ((PFN_vkGetPhysicalDeviceProperties)dlsym(RTLD_NEXT, "vkGetPhysicalDeviceProperties"))(device, properties);
  if (getenv("SMALL_BUFFER")) properties->limits.maxStorageBufferRange = 65536;
  if (getenv("FEW_GROUPS")) properties->limits.maxComputeWorkGroupCount[0] = 100;
}
END
cc -shared -fPIC "$scratch/limits.c" -o "$scratch/limits.so" -ldl
plain=$picture
picture=build/vulkan/build/picture
SMALL_BUFFER=1 LD_PRELOAD=$scratch/limits.so refuses 1 'allows 65536 bytes in a storage buffer' "$knot" -o "$png"
FEW_GROUPS=1 LD_PRELOAD=$scratch/limits.so refuses 1 'allows 100 work groups' "$knot" -o "$png"
picture=$plain
# A file system without room.
(
  ulimit -f 1
  trap '' XFSZ
  refuses 1 "$png: File too large" "$knot" -o "$png" --width 64 --height 64
  exit "$failures"
) || fail 'see above'
"$picture" --help | grep -q -- '--check' || fail 'no help'

# The comparison on the CPU must see a wrong shader: one that forgets what the network says.
mkdir "$scratch/wrong"
cp samples/vulkan/* "$scratch/wrong"
sed -i 's/nif_query(/nif_prove(/' "$scratch/wrong/light.comp"
cmake -S "$scratch/wrong" -B "$scratch/wrong/build" -G Ninja -DCMAKE_PREFIX_PATH="$(realpath "$prefix")" >/dev/null
cmake --build "$scratch/wrong/build" >/dev/null
picture=$scratch/wrong/build/picture
code=0
"$picture" "$knot" -o "$png" "${device[@]}" --width 64 --height 40 --check >"$scratch/said" 2>&1 || code=$?
if ((code != 1)) || ! grep -q 'is not what nifQuery says' "$scratch/said"; then
  fail "a wrong shader passes: $(cat "$scratch/said")"
fi
[[ ! -e $png ]] || fail 'a wrong shader leaves a picture'

((failures == 0)) || exit 1
echo 'samples/vulkan: all is well'
