# nif_bake(): a game's own build bakes its assets.
#
#   nif_bake(<target> MESHES <mesh>... [OUTPUT_DIRECTORY <folder>] [PRESET <name>] [OPTIONS <option>...])
#
# Adds a target, part of the default build, that bakes each mesh into <folder>/<name without extensions>.nif, by default in
# the current binary folder. An asset is baked again where its mesh, a file that the mesh names, the options or the program
# nif have changed. OPTIONS are further ones of `nif bake`. The list of the assets is the target's property NIF_ASSETS.
#
# The program is the nif of this package, or of the PATH; NIFKIT_NIF names another, such as one for the machine that
# builds where that is not the one that plays. Generators: Ninja and Makefiles.
include_guard()

function(nif_bake target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "OUTPUT_DIRECTORY;PRESET" "MESHES;OPTIONS")
  if(DEFINED arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "nif_bake(${target}): '${arg_UNPARSED_ARGUMENTS}' is not one of MESHES, OUTPUT_DIRECTORY, PRESET, OPTIONS")
  endif()
  if(NOT arg_MESHES)
    message(FATAL_ERROR "nif_bake(${target}): no MESHES")
  endif()
  if(CMAKE_VERSION VERSION_LESS 3.20)
    message(FATAL_ERROR "nif_bake(${target}): needs CMake 3.20 or newer, which knows of DEPFILE for all generators")
  endif()
  cmake_policy(SET CMP0116 NEW)
  find_program(NIFKIT_NIF nif HINTS "${nifkit_BINARY_DIRECTORY}" DOC "The program that bakes assets")
  if(NOT NIFKIT_NIF)
    message(FATAL_ERROR "nif_bake(${target}): there is no program nif; install nifkit with its tools, or set NIFKIT_NIF")
  endif()

  set(folder "${CMAKE_CURRENT_BINARY_DIR}")
  if(arg_OUTPUT_DIRECTORY)
    get_filename_component(folder "${arg_OUTPUT_DIRECTORY}" ABSOLUTE BASE_DIR "${CMAKE_CURRENT_BINARY_DIR}")
  endif()
  file(MAKE_DIRECTORY "${folder}")
  set(options ${arg_OPTIONS})
  if(arg_PRESET)
    list(PREPEND options --preset ${arg_PRESET})
  endif()
  set(assets "")
  foreach(mesh IN LISTS arg_MESHES)
    get_filename_component(mesh "${mesh}" ABSOLUTE)
    get_filename_component(name "${mesh}" NAME)
    string(REGEX REPLACE "\\.(gz|zst)$" "" name "${name}")
    string(REGEX REPLACE "\\.[^.]*$" "" name "${name}")
    set(asset "${folder}/${name}.nif")
    if(asset IN_LIST assets)
      message(FATAL_ERROR "nif_bake(${target}): two meshes would become ${asset}; the second is ${mesh}")
    endif()
    add_custom_command(
      OUTPUT "${asset}"
      COMMAND "${NIFKIT_NIF}" bake "${mesh}" -o "${asset}" --depfile "${asset}.d" --quiet ${options}
      DEPENDS "${mesh}" "${NIFKIT_NIF}"
      DEPFILE "${asset}.d"
      COMMENT "Baking ${name}.nif"
      VERBATIM)
    list(APPEND assets "${asset}")
  endforeach()
  add_custom_target(${target} ALL DEPENDS ${assets})
  set_property(TARGET ${target} PROPERTY NIF_ASSETS "${assets}")
endfunction()
