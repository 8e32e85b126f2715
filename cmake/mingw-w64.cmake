# Compilers for 64-bit Windows, and Wine to run their programs here: the Debian packages g++-mingw-w64-x86-64-posix and wine64.
#   cmake -S runtime -B build/windows -DCMAKE_TOOLCHAIN_FILE=cmake/mingw-w64.cmake
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
# "posix": supports C++11 threads.
set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc-posix)
set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)
find_program(NIF_WINE NAMES wine64 wine PATHS /usr/lib/wine)
if(NIF_WINE)
  set(CMAKE_CROSSCOMPILING_EMULATOR ${NIF_WINE})
endif()
# Programs then run without the compiler's libraries.
set(CMAKE_EXE_LINKER_FLAGS_INIT -static)
set(hwy_DIR ${CMAKE_CURRENT_LIST_DIR}/hwy CACHE PATH "Highway's headers")
set(CMAKE_FIND_ROOT_PATH /usr/x86_64-w64-mingw32)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
