# Compiler settings that every nifkit target shares, as one function: nif_compile(target).

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_C_STANDARD 99)
set(CMAKE_C_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_CXX_VISIBILITY_PRESET hidden)
set(CMAKE_C_VISIBILITY_PRESET hidden)
set(CMAKE_VISIBILITY_INLINES_HIDDEN ON)
if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release)
endif()
# All programs go to one folder, whichever target builds them.
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)

# Most of the compile time of a source is spent on headers that its neighbours include, too.
option(NIF_UNITY "Compile the sources of a target together: a clean build takes half the time, a change takes more" OFF)
# Each subcommand of nif defines its own. If sources are compiled together, the source's id becomes part of these names.
set(nif_own_names "#define NIF_PASTE(a, b) a##b\n#define NIF_OWN(a, b) NIF_PASTE(a, b)\n")
foreach(name Arguments kSchema)
  string(APPEND nif_own_names "#undef ${name}\n#define ${name} NIF_OWN(${name}_, NIF_SOURCE)\n")
endforeach()
set_property(GLOBAL PROPERTY NIF_OWN_NAMES "${nif_own_names}")

function(nif_compile target)
  # No contraction anywhere: the answer of a query is defined without fused multiply-add, and a compiler that fuses silently
  # would change bits from one machine to the next.
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wshadow -Wconversion -Wno-sign-conversion
                                           -ffp-contract=off)
  if(MINGW)
    # GCC's code for Windows assumes that vectors on the stack are aligned, but they are not (GCC bug 54412).
    target_compile_options(${target} PRIVATE -Wa,-muse-unaligned-vector-move)
  endif()
  if(NIF_UNITY)
    get_property(own_names GLOBAL PROPERTY NIF_OWN_NAMES)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 15
      UNITY_BUILD_UNIQUE_ID NIF_SOURCE UNITY_BUILD_CODE_BEFORE_INCLUDE "${own_names}")
    # A source's local names may equal another's global names.
    target_compile_options(${target} PRIVATE -Wno-shadow)
  endif()
  if(NIF_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  if(NIF_SANITIZE)
    # Reports only need lines and frames; with less debug information, everything builds in two thirds of the time.
    target_compile_options(${target} PRIVATE -fsanitize=${NIF_SANITIZE} -fno-sanitize-recover=all
                                             -fno-omit-frame-pointer -O1 -g1)
    if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
      # GCC loses track of what is initialised in code with added checks.
      target_compile_options(${target} PRIVATE -Wno-maybe-uninitialized)
    endif()
    target_compile_definitions(${target} PRIVATE NIF_SANITIZED)
    target_link_options(${target} PRIVATE -fsanitize=${NIF_SANITIZE})
  endif()
endfunction()

# nif_measurement(name sources... LINK libraries...): a program that only measures. "all" does not build it.
function(nif_measurement name)
  cmake_parse_arguments(arg "" "" "LINK" ${ARGN})
  add_executable(${name} EXCLUDE_FROM_ALL ${arg_UNPARSED_ARGUMENTS})
  nif_compile(${name})
  set_target_properties(${name} PROPERTIES UNITY_BUILD OFF)
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE ${arg_LINK})
endfunction()
