# The portable program links in every library but the C library, so that it runs on any Linux for x86-64 of that age: archives of
# Debian's packages, and those that tools/portable_libraries builds (Ceres without SuiteSparse, fmt, Highway).
if(CERES_COMPILED_COMPONENTS MATCHES "SuiteSparse|CXSparse" OR NOT CERES_USES_MINIGLOG)
  message(FATAL_ERROR "RESONID_PORTABLE needs the Ceres of tools/portable_libraries, found that of ${Ceres_DIR}")
endif()
set(ZLIB_USE_STATIC_LIBS ON)

add_library(PkgConfig::matio INTERFACE IMPORTED)
find_path(RESONID_MATIO_INCLUDE matio.h REQUIRED)
target_include_directories(PkgConfig::matio INTERFACE "${RESONID_MATIO_INCLUDE}")
foreach(library IN ITEMS matio hdf5_serial sz aec z)  # in the order in which they need one another
  find_library(RESONID_${library}_ARCHIVE NAMES lib${library}.a REQUIRED)
  target_link_libraries(PkgConfig::matio INTERFACE "${RESONID_${library}_ARCHIVE}")
endforeach()
target_link_libraries(PkgConfig::matio INTERFACE ${CMAKE_DL_LIBS} m)

# Debian has toml++ as a shared library or as headers.
add_library(tomlplusplus::tomlplusplus INTERFACE IMPORTED)
target_compile_definitions(tomlplusplus::tomlplusplus INTERFACE TOML_HEADER_ONLY=1)

add_compile_definitions(EIGEN_MPL2_ONLY)
add_link_options(-static-libstdc++ -static-libgcc)

function(resonid_without_arc4random)
  set(source "${PROJECT_SOURCE_DIR}/cmake/portable_arc4random.cpp")
  set_source_files_properties("${source}" TARGET_DIRECTORY ${ARGN} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  foreach(program IN LISTS ARGN)
    target_sources(${program} PRIVATE "${source}")
  endforeach()
endfunction()
