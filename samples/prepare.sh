# shellcheck shell=bash disable=SC2034
# Shared by the run.sh of the samples: builds and installs nifkit for them, and bakes a mesh. To be sourced from nifkit's root.
#
# If NIFKIT names a folder in which nifkit is installed, nothing is built.

say() { printf '%s\n' "$*" >&2; }

# prepare_nifkit: sets nif, the program, and prefix, where the runtime is installed.
prepare_nifkit() {
  if [[ -n ${NIFKIT-} ]]; then
    nif=$NIFKIT/bin/nif prefix=$NIFKIT
    [[ -x $nif ]] || { say "NIFKIT is $NIFKIT, but there is no $nif" && return 2; }
    return
  fi
  tools/setup.sh build
  nif=build/release/bin/nif prefix=build/samples/nifkit
  # Uses a build folder that is already configured. A new one leaves out the tests and their dependencies.
  if [[ ! -f build/release/build.ninja ]]; then
    cmake --preset release -DNIF_BUILD_TESTS=OFF -DNIF_UNITY=ON >/dev/null
  fi
  cmake --build build/release --target nif nif_runtime nif_shared >&2
  local component
  for component in lib dev; do
    cmake --install build/release/runtime --prefix "$prefix" --component "$component" >/dev/null
  done
}

# prepare_asset MESH [ENCODING]: sets asset; model, the mesh that it is baked from ('' if MESH is an asset); and origin, where that
# mesh comes from, if it was chosen here. MESH is a mesh, an asset that is used as it is, or '': then the Stanford dragon if
# samples/run.sh has fetched it or NIF_TEST_MESHES has it, otherwise a generated torus knot. With an ENCODING, meshes are baked
# to that.
prepare_asset() {
  local mesh=$1 encoding=${2-} name dragon baked
  model='' origin=''
  if [[ -z $mesh ]]; then
    mkdir -p build/samples
    for dragon in build/sample/stanford_dragon.ply.gz "${NIF_TEST_MESHES:+$NIF_TEST_MESHES/stanford_dragon_871k.ply.gz}"; do
      [[ -r $dragon ]] || continue
      mesh=$dragon
      origin='Model: the Stanford dragon, Stanford University Computer Graphics Laboratory; free for research, no commercial use.'
      break
    done
  fi
  if [[ -z $mesh ]]; then
    mesh=build/samples/torus_knot.obj
    origin='Model: a torus knot, made by samples/torus_knot.awk.'
    LC_ALL=C awk -f samples/torus_knot.awk >"$mesh.new"
    # Baked again only if it changes.
    if cmp -s "$mesh.new" "$mesh"; then rm "$mesh.new"; else mv "$mesh.new" "$mesh"; fi
  fi
  if [[ $mesh == *.nif ]]; then
    asset=$mesh
    return
  fi
  model=$mesh
  name=$(basename "$mesh")
  name=${name%.gz} name=${name%.zst} name=${name%.*}
  asset=build/samples/$name${encoding:+.$encoding}.nif
  # Identifies the mesh of the asset, because a mesh elsewhere may have the same name.
  baked=$(stat -c '%n %s %y' -- "$(realpath -- "$mesh")")
  if [[ ! $asset -nt $nif || $baked != "$(cat "$asset.source" 2>/dev/null)" ]]; then
    mkdir -p build/samples
    say "Baking $mesh"
    rm -f "$asset.source"
    "$nif" bake "$mesh" -o "$asset" --preset fast ${encoding:+--encoding "$encoding"} --rays 0 --quiet
    printf '%s\n' "$baked" >"$asset.source"
  fi
}
