# Warnings, sanitizers and language level shared by every target of this project.
add_library(resonid_options INTERFACE)
target_compile_features(resonid_options INTERFACE cxx_std_20)
target_compile_options(resonid_options INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Wnon-virtual-dtor -Wold-style-cast
  $<$<BOOL:${RESONID_WERROR}>:-Werror>
  $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>>:-Wno-restrict>)  # its bug 105651: "a" + string
if(RESONID_EMBEDDED)
  target_compile_options(resonid_options INTERFACE -fno-exceptions -fno-rtti -fno-threadsafe-statics)
  target_compile_definitions(resonid_options INTERFACE EIGEN_NO_MALLOC EIGEN_NO_IO)
endif()
if(RESONID_SANITIZE)
  target_compile_options(resonid_options INTERFACE -fsanitize=${RESONID_SANITIZE} -fno-omit-frame-pointer
                         -fno-sanitize-recover=all)
  target_link_options(resonid_options INTERFACE -fsanitize=${RESONID_SANITIZE})
endif()
if(RESONID_FUZZ)  # tells the fuzzer which code an input reaches; programs without a fuzzer ignore it
  target_compile_options(resonid_options INTERFACE -fsanitize=fuzzer-no-link)
endif()
if(RESONID_COVERAGE)
  target_compile_options(resonid_options INTERFACE --coverage)
  target_link_options(resonid_options INTERFACE --coverage)
endif()

# The headers of other libraries that most sources read cost more than most sources do: they are compiled once, for the
# stages (position-independent), and once, with gtest, for the tests. What is compiled with other flags than these goes
# without: resonid_without_headers(SOURCE ...).
if(RESONID_PCH AND NOT RESONID_EMBEDDED AND NOT CMAKE_CROSSCOMPILING)
  set(RESONID_HEADERS <algorithm> <array> <cmath> <complex> <cstddef> <cstdint> <functional> <limits> <map> <memory> <numeric>
      <optional> <random> <span> <sstream> <string> <string_view> <tuple> <utility> <variant> <vector>
      <Eigen/Cholesky> <Eigen/Core> <Eigen/LU> <Eigen/QR> <fmt/format.h> <tl/expected.hpp>)
endif()
# resonid_headers_of(NAME LIBRARIES ... HEADERS ...): what the targets that are given to resonid_headers(TARGET NAME) share.
function(resonid_headers_of name)
  cmake_parse_arguments(OF "" "" "LIBRARIES;HEADERS" ${ARGN})
  if(RESONID_HEADERS)
    file(CONFIGURE OUTPUT "${PROJECT_BINARY_DIR}/${name}.cpp" CONTENT "")
    add_library(${name} OBJECT EXCLUDE_FROM_ALL "${PROJECT_BINARY_DIR}/${name}.cpp")
    target_link_libraries(${name} PRIVATE resonid_options Eigen3::Eigen tl::expected fmt::fmt ${OF_LIBRARIES})
    target_precompile_headers(${name} PRIVATE ${RESONID_HEADERS} ${OF_HEADERS})
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
      target_compile_options(${name} PRIVATE -fpch-preprocess)  # for ccache
    endif()
  endif()
endfunction()
function(resonid_headers target name)
  if(RESONID_HEADERS)
    target_precompile_headers(${target} REUSE_FROM ${name})
    get_target_property(definitions fmt::fmt INTERFACE_COMPILE_DEFINITIONS)
    if(definitions)  # as they were when the headers were compiled
      target_compile_definitions(${target} PRIVATE ${definitions})
    endif()
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
      # It takes precompiled headers of the system for the project's own, and warns of moved strings in them.
      target_compile_options(${target} PRIVATE -fpch-preprocess -Wno-array-bounds -Wno-restrict -Wno-stringop-overflow
                             -Wno-stringop-overread)
    endif()
  endif()
endfunction()
function(resonid_without_headers)
  set_source_files_properties(${ARGN} PROPERTIES SKIP_PRECOMPILE_HEADERS ON)
endfunction()

# resonid_unity(TARGET [COUNT]): with RESONID_UNITY, COUNT (5) sources of the target at a time make one translation unit. For targets
# whose headers cost more than their code.
function(resonid_unity target)
  if(RESONID_UNITY)
    set(count 5)
    if(ARGC GREATER 1)
      set(count ${ARGV1})
    endif()
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${count})
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")  # collects garbage more often: 700 MB of memory must do
      target_compile_options(${target} PRIVATE --param=ggc-min-expand=40)
    endif()
  endif()
endfunction()

# resonid_stage(NAME [SOURCES ...] [DEPENDS ...] [PRIVATE ...])
# One pipeline stage: a static library (or a header-only target) called resonid::NAME whose public headers are
# include/resonid/NAME. DEPENDS are public link targets, PRIVATE ones stay out of the interface.
function(resonid_stage name)
  cmake_parse_arguments(STAGE "" "" "SOURCES;DEPENDS;PRIVATE" ${ARGN})
  set(target resonid_${name})
  if(STAGE_SOURCES)
    add_library(${target} STATIC ${STAGE_SOURCES})
    set(scope PUBLIC)
    if(NOT CMAKE_CROSSCOMPILING)  # firmware is not loaded anywhere
      set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
    endif()
    target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:resonid_options> ${STAGE_PRIVATE})
    target_include_directories(${target} PRIVATE "${PROJECT_SOURCE_DIR}/src")
    if(NOT RESONID_EMBEDDED)
      if(RESONID_HEADERS AND NOT TARGET resonid_stage_headers)
        resonid_headers_of(resonid_stage_headers)
        set_target_properties(resonid_stage_headers PROPERTIES POSITION_INDEPENDENT_CODE ON)
      endif()
      resonid_headers(${target} resonid_stage_headers)
    endif()
  else()
    add_library(${target} INTERFACE)
    set(scope INTERFACE)
  endif()
  if(RESONID_SANITIZE AND STAGE_SOURCES AND name IN_LIST RESONID_UNSANITIZED)
    target_compile_options(${target} PRIVATE -fno-sanitize=all)
  endif()
  add_library(resonid::${name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  target_compile_features(${target} ${scope} cxx_std_20)
  if(RESONID_EMBEDDED)  # changes a layout (base/error.hpp): whoever links the stages must know
    target_compile_definitions(${target} ${scope} RESONID_EMBEDDED)
  endif()
  target_include_directories(${target} ${scope}
    "$<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>" "$<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>")
  target_link_libraries(${target} ${scope} ${STAGE_DEPENDS})
  set_property(GLOBAL APPEND PROPERTY RESONID_STAGE_TARGETS ${target})
endfunction()

# resonid_test(NAME SOURCES ... [INCLUDES ...] [DEPENDS ...] [LABELS ...] [TIMEOUT SECONDS] [LONG] [TOGETHER]): one test
# executable per stage, which sees the project's directories INCLUDES, found by ctest test by test, or, where tests share
# what takes long to make, all TOGETHER. Tests labelled `statistics` run in `make statistics` only. LONG ones are those that
# take tens of seconds; sanitizers leave them out, and CI too those that have no other label. LONG_ONES are the names of the
# single tests of which this is true.
function(resonid_test name)
  if(RESONID_UNITY AND NOT RESONID_SANITIZE)  # compiled once and run once: a quarter less to compile
    set(RESONID_TEST_OPTIONS -O1)
  endif()
  cmake_parse_arguments(TEST "LONG;TOGETHER" "TIMEOUT" "SOURCES;DEPENDS;INCLUDES;LABELS;LONG_ONES" ${ARGN})
  if(TEST_LONG AND NOT RESONID_LONG_TESTS STREQUAL "ON" AND NOT RESONID_LONG_TESTS IN_LIST TEST_LABELS)
    return()
  endif()
  if(NOT TEST_TIMEOUT)
    set(TEST_TIMEOUT 600)
  endif()
  set(properties TIMEOUT ${TEST_TIMEOUT})
  if(TEST_LONG AND NOT TEST_LABELS)
    set(TEST_LABELS long)
  endif()
  if(TEST_LABELS)
    list(APPEND properties LABELS ${TEST_LABELS})
  endif()
  if(TEST_LONG)  # first, so that none of them runs alone at the end
    list(APPEND properties COST 100)
  endif()
  add_executable(test_${name} ${TEST_SOURCES})
  target_link_libraries(test_${name} PRIVATE resonid_options ${TEST_DEPENDS} GTest::gtest_main)
  if(RESONID_HEADERS AND NOT TARGET resonid_test_headers)
    resonid_headers_of(resonid_test_headers LIBRARIES GTest::gtest HEADERS <gtest/gtest.h>)
    target_compile_options(resonid_test_headers PRIVATE ${RESONID_TEST_OPTIONS})
  endif()
  target_compile_options(test_${name} PRIVATE ${RESONID_TEST_OPTIONS})
  resonid_headers(test_${name} resonid_test_headers)
  list(TRANSFORM TEST_INCLUDES PREPEND "${PROJECT_SOURCE_DIR}/")
  target_include_directories(test_${name} PRIVATE "${PROJECT_SOURCE_DIR}/tests/support" ${TEST_INCLUDES})
  target_compile_definitions(test_${name} PRIVATE
    RESONID_GOLDEN_DIR="${PROJECT_SOURCE_DIR}/tests/golden"
    RESONID_RECORDINGS_DIR="${PROJECT_SOURCE_DIR}/../shared/recordings")
  if(TEST_TOGETHER)
    add_test(NAME ${name} COMMAND test_${name})
    set_tests_properties(${name} PROPERTIES ${properties})
    return()
  endif()
  if(TEST_LONG_ONES)
    list(JOIN TEST_LONG_ONES ":" long_ones)
    set(others TEST_FILTER "-${long_ones}")
    if(RESONID_LONG_TESTS STREQUAL "ON")
      gtest_discover_tests(test_${name} TEST_PREFIX "${name}." TEST_FILTER "${long_ones}" TEST_LIST test_${name}_long_ones
                           DISCOVERY_TIMEOUT 60 PROPERTIES ${properties} LABELS long COST 100)
    endif()
  endif()
  gtest_discover_tests(test_${name} TEST_PREFIX "${name}." ${others} DISCOVERY_TIMEOUT 60 PROPERTIES ${properties})
endfunction()
