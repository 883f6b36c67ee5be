# SPDX-License-Identifier: GPL-3.0-or-later
# Settings that all targets share: the language, the warnings, and reproducible arithmetic.

set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(HYBRID_SANITIZE "" CACHE STRING "Sanitizers for every target, e.g. address,undefined")

# Finds the widest vectors of this machine for sanitized builds, which cannot choose a width at start-up (simd_dispatch.h).
if(HYBRID_SANITIZE)
  include(CheckCXXSourceRuns)
  check_cxx_source_runs("int main() { return __builtin_cpu_supports(\"avx2\") ? 0 : 1; }" HYBRID_HAS_AVX2)
  check_cxx_source_runs("int main() { return __builtin_cpu_supports(\"x86-64-v4\") ? 0 : 1; }" HYBRID_HAS_512)
endif()

# hybrid_target(NAME): C++20, warnings as errors, folder path is include path.
# -ffp-contract=off: a product and a sum stay two roundings, so release and debug, and every
# processor, compute the same bits. -ffast-math is never used for the same reason.
function(hybrid_target name)
  target_compile_features(${name} PUBLIC cxx_std_20)
  set_target_properties(${name} PROPERTIES CXX_EXTENSIONS OFF)
  target_include_directories(${name} PUBLIC "$<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>")
  # -Wno-restrict, -Wno-array-bounds, -Wno-stringop-overflow: g++ 12 wrongly reports overlap and overflow in
  # `"literal" + std::string` (GCC bug 105651). With precompiled headers it also reports them inside the standard library.
  target_compile_options(${name} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wno-restrict
                                         -Wno-array-bounds -Wno-stringop-overflow -Werror -ffp-contract=off)
  # In a batch, g++ takes each source for a header, and warns about types with members from an anonymous namespace.
  target_compile_options(${name} PRIVATE $<$<BOOL:${CMAKE_UNITY_BUILD}>:-Wno-subobject-linkage>)
  if(HYBRID_SANITIZE)
    # With sanitizers, g++ 12 wrongly reports uninitialised members of std::regex.
    target_compile_options(${name} PRIVATE -Wno-maybe-uninitialized)
    target_compile_options(${name} PUBLIC -fsanitize=${HYBRID_SANITIZE} -fno-omit-frame-pointer
                                          -fno-sanitize-recover=all)
    target_link_options(${name} PUBLIC -fsanitize=${HYBRID_SANITIZE})
    target_compile_definitions(${name} PRIVATE $<$<BOOL:${HYBRID_HAS_AVX2}>:HYBRID_SANITIZED_AVX2>
                                               $<$<BOOL:${HYBRID_HAS_512}>:HYBRID_SANITIZED_512>)
  endif()
endfunction()

# hybrid_shareable(NAME): code that a shared library may hold. No other library replaces its functions, and
# -fno-semantic-interposition tells g++ so. Otherwise g++ would not inline them.
function(hybrid_shareable name)
  target_compile_options(${name} PRIVATE -fPIC -fno-semantic-interposition)
endfunction()

# hybrid_headers(NAME HEADERS… LINKS …): precompiles headers that many rooms include. Rooms reuse them by NAME. A source still
# includes each header that it uses, because CMAKE_DISABLE_PRECOMPILE_HEADERS builds without them.
function(hybrid_headers name)
  cmake_parse_arguments(arg "" "" "HEADERS;LINKS" ${ARGN})
  file(GENERATE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp CONTENT "// Holds the precompiled headers ${name}.\n")
  add_library(${name} OBJECT ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp)
  hybrid_target(${name})
  hybrid_shareable(${name})
  target_link_libraries(${name} PRIVATE ${arg_LINKS})
  target_precompile_headers(${name} PRIVATE ${arg_HEADERS})
endfunction()

# The release preset compiles the sources of a room in batches (CMAKE_UNITY_BUILD), which halves the time to build. So a name in
# an anonymous namespace must be unique within its room. The other presets compile each source by itself.
#
# hybrid_room(PART/ROOM SOURCES … LINKS … PRIVATE_LINKS … HEADERS NAME): the library of one folder, called hybrid::PART_ROOM, or
# hybrid::ROOM where the part is hybrid itself. LINKS: rooms that its headers include. PRIVATE_LINKS: libraries that only its
# sources use. HEADERS: precompiled headers. COLD: none of its code runs in a tick or is timed, so -O1 is enough.
function(hybrid_room path)
  cmake_parse_arguments(arg "COLD" "HEADERS" "SOURCES;LINKS;PRIVATE_LINKS" ${ARGN})
  string(REGEX REPLACE "^[a-z]+/(.*)$" "\\1" folder "${path}")
  string(REGEX REPLACE "^hybrid/(.*)$" "\\1" name "${path}")
  string(REPLACE "/" "_" name "${name}")
  list(TRANSFORM arg_SOURCES PREPEND "${folder}/" REGEX "^[^$]")
  add_library(hybrid_${name} STATIC ${arg_SOURCES})
  add_library(hybrid::${name} ALIAS hybrid_${name})
  hybrid_target(hybrid_${name})
  hybrid_shareable(hybrid_${name})
  target_link_libraries(hybrid_${name} PUBLIC ${arg_LINKS} PRIVATE ${arg_PRIVATE_LINKS})
  if(arg_COLD)
    target_compile_options(hybrid_${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  endif()
  if(arg_HEADERS)
    target_precompile_headers(hybrid_${name} REUSE_FROM ${arg_HEADERS})
  endif()
endfunction()
