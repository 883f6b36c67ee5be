# SPDX-License-Identifier: GPL-3.0-or-later
# `cpack` makes one Debian package of each of the four components of HybridInstall.cmake.

set(packages "hybrid;libhybrid${HYBRID_ABI_VERSION};libhybrid-dev;python3-hybrid")
set(components "program;library;development;python")
set(debian ${CMAKE_CURRENT_LIST_DIR}/debian)

file(STRINGS ${debian}/changelog newest LIMIT_COUNT 1)
if(NOT newest MATCHES "^hybrid \\(${PROJECT_VERSION}\\)")
  message(FATAL_ERROR "cmake/debian/changelog begins with '${newest}'; add an entry for version ${PROJECT_VERSION}")
endif()

# Every package has a copyright file and a changelog. EXCLUDE_FROM_ALL: `cmake --install` leaves them out.
hybrid_gzip(${debian}/changelog changelog.gz)
foreach(component package IN ZIP_LISTS components packages)
  install(FILES ${debian}/copyright ${CMAKE_CURRENT_BINARY_DIR}/changelog.gz COMPONENT ${component} EXCLUDE_FROM_ALL
          DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package})
  string(TOUPPER ${component} name)
  set(CPACK_DEBIAN_${name}_PACKAGE_NAME ${package})
endforeach()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VENDOR "hybrid")
set(CPACK_PACKAGE_CONTACT "hybrid maintainers <maintainers@users.noreply.h-seed-f46bce07.example>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "haptic renderer for scenes of rigid and soft objects")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_COMPONENTS_ALL ${components})
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)

# Lines of a description have at most 80 characters.
set(about "A scene mixes rigid meshes and soft voxel volumes (ChainMail). They are felt
with a PHANToM, or with a simulated device in a simulated hand.")
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "${about}\nThis package has the program, and scenes to begin from.")
set(CPACK_COMPONENT_LIBRARY_DESCRIPTION "${about}\nThis package has the shared library.")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "${about}\nThis package has the C header, examples, and files of CMake and pkg-config.")
set(CPACK_COMPONENT_PYTHON_DESCRIPTION "${about}\nThis package has the Python module.")

set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_ARCHITECTURE all)

# Pictures need OpenGL, which is loaded at run time, and a font. scenes/head.toml needs the head of mricron-data.
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS "libegl1, libgl1-mesa-dri, fonts-dejavu-core, mricron-data")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS "python3-hybrid")
set(of_this_build "libhybrid${HYBRID_ABI_VERSION} (= ${PROJECT_VERSION})")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "${of_this_build}")
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "${of_this_build}, python3, python3-numpy")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA ${debian}/triggers)
include(CPack)
