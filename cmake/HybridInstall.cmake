# SPDX-License-Identifier: GPL-3.0-or-later
# What `cmake --install` installs, in four components, and the Debian packages that `cpack` makes of them.
include(CMakePackageConfigHelpers)

set(HYBRID_PYTHON_DIR "lib/python3/dist-packages" CACHE STRING "Where the Python module is installed, below the prefix")

set(in_library LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT development)
install(TARGETS hybrid_program RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
install(DIRECTORY scenes/ DESTINATION ${CMAKE_INSTALL_DATADIR}/hybrid/scenes COMPONENT program PATTERN demo.sh EXCLUDE)
install(TARGETS hybrid_c EXPORT hybrid-targets ${in_library})
install(FILES interface/hybrid.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)
install(DIRECTORY interface/examples DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT development)
install(FILES interface/hybrid.py DESTINATION ${HYBRID_PYTHON_DIR} COMPONENT python)

# find_package(hybrid CONFIG) gives hybrid::c.
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/hybrid)
install(EXPORT hybrid-targets FILE hybrid-config.cmake NAMESPACE hybrid:: DESTINATION ${package_dir} COMPONENT development)
write_basic_package_version_file(hybrid-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/hybrid-config-version.cmake DESTINATION ${package_dir} COMPONENT development)

# pkg-config hybrid. The prefix is told from the place of the file, so that an installed tree may be moved.
set(pkgconfig_dir ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
file(RELATIVE_PATH to_prefix /prefix/${pkgconfig_dir} /prefix)
string(REGEX REPLACE "/$" "" to_prefix "${to_prefix}")
configure_file(cmake/hybrid.pc.in hybrid.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/hybrid.pc DESTINATION ${pkgconfig_dir} COMPONENT development)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VENDOR "hybrid")
set(CPACK_PACKAGE_CONTACT "hybrid maintainers <maintainers@users.noreply.h-seed-f46bce07.example>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Haptic renderer for scenes of rigid and soft objects")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_COMPONENTS_ALL program library development python)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME hybrid)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME libhybrid${HYBRID_ABI_VERSION})
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libhybrid-dev)
set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-hybrid)
set(of_this_build "libhybrid${HYBRID_ABI_VERSION} (= ${PROJECT_VERSION})")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "${of_this_build}")
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "${of_this_build}, python3-numpy")
include(CPack)
