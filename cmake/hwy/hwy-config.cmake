# Highway for cross compilation: only its headers, which is all that the runtime uses. They come from this machine, through a
# link in a folder that contains nothing else of this machine.
find_path(NIF_HIGHWAY hwy/highway.h PATHS /usr/include /usr/local/include REQUIRED NO_DEFAULT_PATH NO_CMAKE_FIND_ROOT_PATH)
file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/highway)
file(CREATE_LINK ${NIF_HIGHWAY}/hwy ${CMAKE_BINARY_DIR}/highway/hwy SYMBOLIC)
if(NOT TARGET hwy::hwy)
  add_library(hwy::hwy INTERFACE IMPORTED)
  target_include_directories(hwy::hwy INTERFACE ${CMAKE_BINARY_DIR}/highway)
endif()
