# SPDX-License-Identifier: GPL-3.0-or-later
# What every target of this project shares: the language, the warnings, and reproducible arithmetic.

set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(HYBRID_SANITIZE "" CACHE STRING "Sanitizers for every target, e.g. address,undefined")

# hybrid_target(NAME): C++20, warnings as errors, folder path is include path.
# -ffp-contract=off: a product and a sum stay two roundings, so release and debug, and every
# processor, compute the same bits. -ffast-math is never used for the same reason.
function(hybrid_target name)
  target_compile_features(${name} PUBLIC cxx_std_20)
  set_target_properties(${name} PROPERTIES CXX_EXTENSIONS OFF)
  target_include_directories(${name} PUBLIC "$<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>")
  # -Wno-restrict: g++ 12 sees overlap in `"literal" + std::string` (GCC bug 105651) where there is none.
  target_compile_options(${name} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wno-restrict -Werror -ffp-contract=off)
  if(HYBRID_SANITIZE)
    target_compile_options(${name} PUBLIC -fsanitize=${HYBRID_SANITIZE} -fno-omit-frame-pointer
                                          -fno-sanitize-recover=all)
    target_link_options(${name} PUBLIC -fsanitize=${HYBRID_SANITIZE})
  endif()
endfunction()

# hybrid_room(PART/ROOM SOURCES … LINKS … PRIVATE_LINKS …): the library of one folder, called hybrid::PART_ROOM, or hybrid::ROOM
# where the part is hybrid itself. LINKS are rooms that its headers include; PRIVATE_LINKS are libraries of its sources alone.
function(hybrid_room path)
  cmake_parse_arguments(arg "" "" "SOURCES;LINKS;PRIVATE_LINKS" ${ARGN})
  string(REGEX REPLACE "^[a-z]+/" "" folder "${path}")
  string(REGEX REPLACE "^hybrid/" "" name "${path}")
  string(REPLACE "/" "_" name "${name}")
  list(TRANSFORM arg_SOURCES PREPEND "${folder}/" REGEX "^[^$]")
  add_library(hybrid_${name} STATIC ${arg_SOURCES})
  add_library(hybrid::${name} ALIAS hybrid_${name})
  hybrid_target(hybrid_${name})
  target_link_libraries(hybrid_${name} PUBLIC ${arg_LINKS} PRIVATE ${arg_PRIVATE_LINKS})
endfunction()
