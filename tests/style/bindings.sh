#!/usr/bin/env bash
# Compares docs/bindings.md with nif.h and the bindings (bindings.py), and checks that changes of either are found.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
check=$root/tests/style/bindings.py
python3 "$check" "$root"

copy=$(mktemp -d)
trap 'rm -rf "$copy"' EXIT
# changed FILE SED: a tree with this change of a file must be refused.
changed() {
  rm -rf "${copy:?}"/*
  mkdir -p "$copy/docs" "$copy/runtime/include/nif" "$copy/samples/love" "$copy/bindings/python/nifkit"
  cp "$root/docs/bindings.md" "$copy/docs"
  cp "$root"/runtime/include/nif/nif.h* "$copy/runtime/include/nif"
  cp "$root/samples/love/nif.lua" "$copy/samples/love"
  cp "$root"/bindings/python/nifkit/*.py "$copy/bindings/python/nifkit"
  sed -i "$2" "$copy/$1"
  ! cmp -s "$copy/$1" "$root/$1" || { echo "bindings.sh: '$2' changes nothing in $1" >&2 && exit 1; }
  if python3 "$check" "$copy" >/dev/null 2>&1; then
    echo "bindings.sh: bindings.py does not find '$2' in $1" >&2
    exit 1
  fi
}
changed runtime/include/nif/nif.h 's/^NIF_API NifError nifCommitScene/NIF_API NifError nifNewCall(NifScene scene);\n&/'
changed runtime/include/nif/nif.h '/^NIF_API uint32_t nifGetVersion/d'
changed runtime/include/nif/nif.hpp 's/add_instance(/add_object(/'
changed runtime/include/nif/nif.hpp 's/nifIntersectRay(/nifIntersect(/'
changed runtime/include/nif/nif.hpp 's/^class Job {/class Task {/'
changed docs/bindings.md 's/`Scene::intersect()`/`Asset::intersect()`/'
changed docs/bindings.md 's/`Scene::intersect()`/`Scene::intersects()`/'
changed docs/bindings.md 's/`backend()`/`Device::backend()`/'
changed docs/bindings.md 's/`Scene::intersect()`/intersect/'
changed docs/bindings.md 's/nothing calls `nifRetainJob`/nothing calls it/'
changed docs/bindings.md '/^| `nifIntersect` /d'
changed docs/bindings.md 's/^| `nifIntersect` .*/&\n&/'
changed docs/bindings.md 's/`Scene:intersect()`/-/'
changed docs/bindings.md 's/`Scene:intersect()`//'
changed docs/bindings.md 's/^| nif.h /| nif.hpp /'
changed samples/love/nif.lua 's/C\.nifIntersect/C.nifQuery/'
changed bindings/python/nifkit/_scene.py 's/lib\.nifIntersect(/lib.nifQuery(/'
changed docs/bindings.md 's/`intersect()`/-/'
