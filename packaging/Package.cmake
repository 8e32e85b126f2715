# Configures `cpack`: it makes Debian packages, and one .tar.gz of everything that is installed. Their times are
# SOURCE_DATE_EPOCH, so that the same build gives the same bytes (tools/release.sh sets it).
#   nifkit      the nif program       libnif0.1   the runtime's shared library, by the version of its ABI
#   nifkit-gpu  the GPU module,       nifkit-dev  the runtime's static library, headers and CMake package
#               if it was built
# For Windows: one .zip of the runtime.
set(CPACK_PACKAGE_NAME nifkit)
set(CPACK_PACKAGE_VENDOR "the nifkit authors")
set(CPACK_PACKAGE_CONTACT "the nifkit authors <nifkit@example.org>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "visibility queries from small neural assets")
if(WIN32)  # one archive of everything that is installed
  set(CPACK_GENERATOR ZIP)
  set(CPACK_STRIP_FILES ON)
  set(CPACK_SYSTEM_NAME windows-${CMAKE_SYSTEM_PROCESSOR})
  include(CPack)
  return()
endif()
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_GENERATOR DEB TGZ)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ
    WORLD_EXECUTE)
set(CPACK_THREADS 0)

set(nif_components lib dev)
set(nif_lib_package libnif${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
set(CPACK_DEBIAN_LIB_PACKAGE_NAME ${nif_lib_package})
set(CPACK_DEBIAN_LIB_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_LIB_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_LIB_PACKAGE_CONTROL_EXTRA ${CMAKE_CURRENT_BINARY_DIR}/packaging/shlibs
                                           ${CMAKE_CURRENT_BINARY_DIR}/packaging/triggers)
file(CONFIGURE OUTPUT packaging/triggers CONTENT "activate-noawait ldconfig\n")
file(CONFIGURE OUTPUT packaging/shlibs
     CONTENT "libnif ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR} ${nif_lib_package} (>= ${PROJECT_VERSION})\n")
# cpack makes packages of shared libraries call ldconfig themselves, while Debian's own tools leave that to dpkg.
file(CONFIGURE OUTPUT packaging/lintian-overrides CONTENT "${nif_lib_package}: maintscript-calls-ldconfig\n")
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/packaging/lintian-overrides DESTINATION share/lintian/overrides
        RENAME ${nif_lib_package} COMPONENT lib)
set(CPACK_DEBIAN_LIB_PACKAGE_SUGGESTS nifkit-gpu)
set(CPACK_COMPONENT_LIB_DESCRIPTION "runtime library of nifkit, for programs linked with it
 Loads .nif assets and answers whether rays are blocked, and where they first
 hit something, on the CPU or a GPU. Programs and bindings load it.")
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "${nif_lib_package} (= ${PROJECT_VERSION})")
set(CPACK_DEBIAN_DEV_PACKAGE_NAME nifkit-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_COMPONENT_DEV_DESCRIPTION "static library and headers of nifkit's runtime
 Loads .nif assets and answers whether rays are blocked, and where they first
 hit something, on the CPU or a GPU. Has a C interface, a C++ wrapper, and
 packages for CMake and pkg-config.")
if(NIF_BUILD_TOOLS)
  list(APPEND nif_components tools)
  set(CPACK_DEBIAN_TOOLS_PACKAGE_NAME nifkit)
  set(CPACK_DEBIAN_TOOLS_PACKAGE_SECTION graphics)
  set(CPACK_DEBIAN_TOOLS_PACKAGE_SHLIBDEPS ON)
  set(CPACK_COMPONENT_TOOLS_DESCRIPTION "bakes triangle meshes into small visibility assets
 The program nif bakes meshes into .nif assets that answer whether a ray is
 blocked, measures and validates them, renders with them, and repairs and
 converts meshes.")
endif()
if(TARGET nif_gpu)
  list(APPEND nif_components gpu)
  # The runtime loads it by name; nothing links it, so it has no version of its own.
  file(CONFIGURE OUTPUT packaging/lintian-overrides-gpu
       CONTENT "nifkit-gpu: maintscript-calls-ldconfig\nnifkit-gpu: sharedobject-in-library-directory-missing-soname\n")
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/packaging/lintian-overrides-gpu DESTINATION share/lintian/overrides
          RENAME nifkit-gpu COMPONENT gpu)
  set(CPACK_DEBIAN_GPU_PACKAGE_NAME nifkit-gpu)
  set(CPACK_DEBIAN_GPU_PACKAGE_SECTION libs)
  set(CPACK_DEBIAN_GPU_PACKAGE_SHLIBDEPS ON)
  set(CPACK_COMPONENT_GPU_DESCRIPTION "GPU module of nifkit, for AMD and NVIDIA
 The runtime of nifkit loads this module if there is a GPU. The module loads
 the GPU's driver itself and needs no toolkit.")
endif()
set(CPACK_COMPONENTS_ALL ${nif_components})
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

# The documents that Debian requires in each package.
string(TIMESTAMP nif_changelog_date "%a, %d %b %Y %H:%M:%S +0000" UTC)  # from SOURCE_DATE_EPOCH, if it is set
configure_file(${CMAKE_CURRENT_LIST_DIR}/changelog.in ${CMAKE_CURRENT_BINARY_DIR}/packaging/changelog.in.txt @ONLY)
set(nif_changelog ${CMAKE_CURRENT_BINARY_DIR}/packaging/changelog.gz)
set(nif_manual ${CMAKE_CURRENT_BINARY_DIR}/packaging/nif.1.gz)
set(nif_news ${CMAKE_CURRENT_BINARY_DIR}/packaging/CHANGELOG.md.gz)
set(nif_sbom ${CMAKE_CURRENT_BINARY_DIR}/packaging/nifkit.spdx.json)
find_package(Python3 REQUIRED COMPONENTS Interpreter)
# compressed(FROM TO): compresses a file, without its name and time.
function(compressed from to)
  string(REGEX REPLACE "\\.gz$" "" plain ${to})
  add_custom_command(OUTPUT ${to} COMMAND ${CMAKE_COMMAND} -E copy ${from} ${plain} COMMAND gzip -9nf ${plain}
                     DEPENDS ${from} VERBATIM)
endfunction()
compressed(${CMAKE_CURRENT_BINARY_DIR}/packaging/changelog.in.txt ${nif_changelog})
compressed(${CMAKE_CURRENT_LIST_DIR}/nif.1 ${nif_manual})
compressed(${PROJECT_SOURCE_DIR}/CHANGELOG.md ${nif_news})
# A software bill of materials: the libraries of the programs, as they are installed here.
add_custom_command(
  OUTPUT ${nif_sbom}
  COMMAND Python3::Interpreter ${CMAKE_CURRENT_LIST_DIR}/sbom.py --version ${PROJECT_VERSION} --cgal ${NIF_WITH_CGAL}
          --tools ${NIF_BUILD_TOOLS} --output ${nif_sbom}
  DEPENDS ${CMAKE_CURRENT_LIST_DIR}/sbom.py ${PROJECT_SOURCE_DIR}/NOTICE ${PROJECT_SOURCE_DIR}/tools/setup.sh
  VERBATIM)
add_custom_target(nif_packaging ALL DEPENDS ${nif_changelog} ${nif_manual} ${nif_news} ${nif_sbom})
foreach(component IN LISTS nif_components)
  string(TOUPPER ${component} upper)
  set(documents share/doc/${CPACK_DEBIAN_${upper}_PACKAGE_NAME})
  install(FILES ${nif_changelog} ${nif_news} ${CMAKE_CURRENT_LIST_DIR}/copyright DESTINATION ${documents}
          COMPONENT ${component})
  install(FILES ${nif_sbom} DESTINATION ${documents} COMPONENT ${component})
endforeach()
if(NIF_BUILD_TOOLS)
  install(FILES ${nif_manual} DESTINATION share/man/man1 COMPONENT tools)
  install(FILES ${nif_manual} DESTINATION share/man/man1 RENAME nif-bake.1.gz COMPONENT tools)
endif()
include(CPack)
