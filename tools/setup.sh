#!/usr/bin/env bash
# Installs the packages that nifkit needs and this machine lacks, from Debian 12 (bookworm), as root or through sudo.
#
#   tools/setup.sh [GROUP]...    groups: build, sample, check, fuzz, gpu, arm; all of these if none is named
#                                only if named: audio, bits32, blender, love, pages, python, shader, web, windows
#
# If nothing is missing, it does nothing, prints nothing and needs no network. If it may not install packages, it names the
# missing ones in one line and exits with 1.
set -euo pipefail

# Group, package, reason. Everything else is a dependency of these.
packages='
build   g++                   C++20 compiler
build   cmake                 configures; 3.25 or newer
build   ninja-build           builds; the generator of every preset
build   python3               makes the bill of materials; tests: the independent reader of assets
build   libembree-dev         ground truth of the baker, and the BVH that assets are compared with
build   libtbb-dev            threads of the baker
build   libhwy-dev            SIMD in the trainer
build   libdraco-dev          .drc files and KHR_draco_mesh_compression
build   libtinygltf-dev       .gltf and .glb files
build   nlohmann-json3-dev    JSON in and out, also for tinygltf
build   zlib1g-dev            meshes compressed as .gz
build   libzstd-dev           meshes compressed as .zst
build   libxxhash-dev         hash of the source mesh, kept in the asset
build   libfmt-dev            text output
build   libcli11-dev          command line of the nif program
build   libtomlplusplus-dev   scene files of nif render
build   libpng-dev            pictures, textures
build   libjpeg62-turbo-dev   textures
build   libwebp-dev           textures
build   libopenexr-dev        pictures and environment maps
build   libstb-dev            environment maps (.hdr)
build   libopenmesh-dev       nif mesh: decimation, subdivision; tests: a second reader of meshes
build   libmeshoptimizer-dev  nif mesh: fast decimation; .glb files with EXT_meshopt_compression
build   libopenvdb-dev        nif mesh: level sets
build   libboost-iostreams-dev  OpenVDB links it, but its package does not depend on it
build   libcgal-dev           nif mesh: self-intersections, holes, remeshing; tests: a second ground truth of rays (NIF_WITH_CGAL)
sample  jq                    samples/run.sh reads the JSON that nif prints
check   abigail-tools         compares the binary interface with the one that is kept
check   libgtest-dev          tests
check   libgmp-dev            tests: the judge in exact arithmetic
check   pkgconf               tests: the installed package through its .pc file
check   slurm-wlm             tests: manifests on a cluster of one node
check   munge                 tests: the key of that cluster
check   jq                    tests: reads the reports of that cluster
check   clang-format          style of C++
check   lintian               tests: the Debian packages
check   shellcheck            style of scripts
check   git                   the list of files whose style is checked
fuzz    clang                 preset fuzz: libFuzzer
fuzz    libclang-rt-14-dev    preset fuzz: libFuzzer and the sanitizers of clang
fuzz    llvm                  tests/fuzz/coverage.sh: llvm-cov and llvm-profdata
fuzz    python3               tests/corpus/make.sh
gpu     clang-15              GPU kernels for gfx1030 and gfx90a (NIF_WITH_GPU)
gpu     lld-15                links them
gpu     clang-19              GPU kernels for gfx1100, which clang 15 gets wrong, and gfx942, which it does not know
gpu     lld-19                links them
arm     g++-aarch64-linux-gnu the runtime for 64-bit ARM (tests/neon/run.sh)
arm     qemu-user-static      runs it here
windows g++-mingw-w64-x86-64-posix  the runtime for Windows (tests/windows/run.sh)
windows wine64                runs it here
windows googletest            its tests, to be compiled for Windows
audio   libopenal-dev         samples/audio: sound for headphones
bits32  lib32stdc++-12-dev    tests/fuzz/bits32: the runtime for 32-bit x86
bits32  libc6-dev-i386        the same
love    love                  samples/love: the engine of the game
love    luajit                samples/love: tests of its declarations of nif.h
love    xvfb                  samples/love: tests, on a virtual screen
love    xauth                 samples/love: xvfb-run needs it
pages   chromium              tests/pages: shows the pages that nif writes; samples/web, webgpu and playcanvas: tests; tests/shader/wgsl: its SwiftShader
pages   chromium-driver       tests/pages: drives it; samples/web, webgpu and playcanvas: the same
python  python3-numpy         bindings/python: arrays
python  python3-pip           bindings/python: builds and installs the wheel
python  python3-setuptools    bindings/python: builds the wheel
python  python3-wheel         bindings/python: builds the wheel
python  python3-venv          bindings/python: tests, in their own environment
python  python3-pytest        bindings/python: tests
python  python3-mypy          bindings/python: tests of its types
shader  glslang-tools         tests/shader: compiles kernels/shader; samples/vulkan: the same
shader  spirv-cross           tests/shader: makes OpenGL ES of it
shader  spirv-tools           tests/shader: validates what it compiles to
shader  libvulkan-dev         tests/shader: runs it; samples/vulkan: the same
shader  mesa-vulkan-drivers   tests/shader: a Vulkan device that is the CPU (lavapipe)
shader  vulkan-validationlayers  tests/shader: watch these runs
web     emscripten            bindings/web: the runtime as WebAssembly; brings node
web     node-typescript       bindings/web: tests of its types
blender blender               bindings/blender; samples/cycles: the renderer whose shadow rays an asset answers
blender libembree-dev         samples/cycles: headers of the Embree that the renderer links
blender python3-numpy         bindings/blender: shows the answers of an asset
blender xvfb                  bindings/blender: tests, on a virtual screen
blender xauth                 bindings/blender: xvfb-run needs it
blender libgl1-mesa-dri       bindings/blender: draws on that screen
'

if [[ ${1-} == -h || ${1-} == --help ]]; then
  sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "$0"
  exit 0
fi

groups=("$@")
((${#groups[@]})) || groups=(build sample check fuzz gpu arm)
wanted=()
for group in "${groups[@]}"; do
  found=$(awk -v group="$group" '$1 == group { print $2 }' <<<"$packages")
  if [[ -z $found ]]; then
    known=$(awk 'NF && !seen[$1]++ { printf "%s%s", sep, $1; sep = ", " }' <<<"$packages")
    echo "tools/setup.sh: there is no group '$group'; the groups are $known" >&2
    exit 2
  fi
  mapfile -t -O "${#wanted[@]}" wanted <<<"$found"
done

if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
  echo "tools/setup.sh: not a Debian system; install the equivalents of: ${wanted[*]}" >&2
  exit 1
fi

installed=$(dpkg-query -W -f='${Package} ${db:Status-Status}\n' "${wanted[@]}" 2>/dev/null || true)
missing=()
for package in "${wanted[@]}"; do
  grep -qxF "$package installed" <<<"$installed" || missing+=("$package")
done
((${#missing[@]})) || exit 0

as_root=()
if ((EUID != 0)); then
  # sudo may ask for a password only if somebody is there to answer.
  if command -v sudo >/dev/null && { sudo -n true 2>/dev/null || [[ -t 0 ]]; }; then
    as_root=(sudo)
  else
    echo "tools/setup.sh: neither root nor sudo; missing packages: ${missing[*]}" >&2
    exit 1
  fi
fi

apt() {
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -o DPkg::Lock::Timeout=300 -o Dpkg::Use-Pty=0 "$@"
}

echo "tools/setup.sh: installing ${missing[*]}" >&2
log=$(mktemp)
trap 'rm -f "$log"' EXIT
if ! { apt update && apt install --yes --no-install-recommends "${missing[@]}"; } >"$log" 2>&1; then
  tail -n 20 "$log" >&2
  echo "tools/setup.sh: apt-get failed, as shown above; missing packages: ${missing[*]}" >&2
  exit 1
fi
