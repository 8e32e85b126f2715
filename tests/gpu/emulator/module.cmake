# nif_emulator: runs GPU kernels on the host. nif_gpu_emulated: the GPU module with emulated GPUs in place of a driver.
# After runtime/, whose CMakeLists.txt has nif_gpu_module().
set(nif_here ${CMAKE_CURRENT_LIST_DIR})
add_library(nif_emulator STATIC ${nif_here}/emulator.cpp ${nif_here}/kernels.cpp $<TARGET_OBJECTS:nif_packed_grids>)
set_target_properties(nif_emulator PROPERTIES POSITION_INDEPENDENT_CODE ON)
nif_compile(nif_emulator)
set_target_properties(nif_emulator PROPERTIES UNITY_BUILD OFF)
target_compile_features(nif_emulator PUBLIC cxx_std_20)
target_include_directories(nif_emulator PUBLIC ${nif_here}/../../..)

nif_gpu_module(nif_gpu_emulated ${nif_here}/driver.cpp)
target_link_libraries(nif_gpu_emulated PRIVATE nif_emulator)
