# SPDX-License-Identifier: GPL-3.0-or-later
# Rules of `cmake --install`, in four components. HybridDebian.cmake makes a Debian package of each component.
include(CMakePackageConfigHelpers)

set(HYBRID_PYTHON_DIR "lib/python3/dist-packages" CACHE STRING "Where the Python module is installed, below the prefix")

set(in_library LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT development)
install(TARGETS hybrid_program RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
install(DIRECTORY scenes/ DESTINATION ${CMAKE_INSTALL_DATADIR}/hybrid/scenes COMPONENT program PATTERN demo.sh EXCLUDE)
install(TARGETS hybrid_c EXPORT hybrid-targets ${in_library})
install(FILES interface/hybrid.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)
install(FILES interface/README.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT development)
install(DIRECTORY interface/examples DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT development)
install(FILES interface/hybrid.py DESTINATION ${HYBRID_PYTHON_DIR} COMPONENT python)

# find_package(hybrid CONFIG) gives hybrid::c.
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/hybrid)
install(EXPORT hybrid-targets FILE hybrid-config.cmake NAMESPACE hybrid:: DESTINATION ${package_dir} COMPONENT development)
write_basic_package_version_file(hybrid-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/hybrid-config-version.cmake DESTINATION ${package_dir} COMPONENT development)

# The file for `pkg-config hybrid`. Its prefix is relative to its own place, so an installed tree may be moved.
set(pkgconfig_dir ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
file(RELATIVE_PATH to_prefix /prefix/${pkgconfig_dir} /prefix)
string(REGEX REPLACE "/$" "" to_prefix "${to_prefix}")
configure_file(cmake/hybrid.pc.in hybrid.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/hybrid.pc DESTINATION ${pkgconfig_dir} COMPONENT development)

# hybrid_gzip(FILE NAME): compresses the file in every build. -n stores no time, so equal builds give equal bytes.
function(hybrid_gzip file name)
  add_custom_command(OUTPUT ${name} COMMAND gzip -9nc "${file}" > ${name} DEPENDS "${file}" VERBATIM)
  string(REPLACE "." "_" target compressed_${name})
  add_custom_target(${target} ALL DEPENDS ${name})
endfunction()

# The manual page and the completions, as the program prints them.
add_custom_command(OUTPUT hybrid.1 hybrid.bash COMMAND hybrid_program --man-page > hybrid.1
                   COMMAND hybrid_program --bash-completion > hybrid.bash DEPENDS hybrid_program VERBATIM)
hybrid_gzip(${CMAKE_CURRENT_BINARY_DIR}/hybrid.1 hybrid.1.gz)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/hybrid.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/hybrid.bash RENAME hybrid COMPONENT program
        DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)

include(HybridDebian)
