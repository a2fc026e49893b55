# Warnings, sanitizers and language level shared by every target of this project.
add_library(resonid_options INTERFACE)
target_compile_features(resonid_options INTERFACE cxx_std_20)
target_compile_options(resonid_options INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Wnon-virtual-dtor -Wold-style-cast
  $<$<BOOL:${RESONID_WERROR}>:-Werror>)
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

# resonid_unity(TARGET): with RESONID_UNITY, a few sources of the target at a time make one translation unit. For targets
# whose headers cost more than their code.
function(resonid_unity target)
  if(RESONID_UNITY)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 6)
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
  target_include_directories(${target} ${scope}
    "$<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>" "$<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>")
  target_link_libraries(${target} ${scope} ${STAGE_DEPENDS})
  set_property(GLOBAL APPEND PROPERTY RESONID_STAGE_TARGETS ${target})
endfunction()

# resonid_test(NAME SOURCES ... [DEPENDS ...] [LABELS ...] [TIMEOUT SECONDS] [LONG]): one test executable per stage, found
# by ctest test by test. Tests labelled `statistics` run in `make statistics` only. LONG ones are those that take tens of
# seconds; sanitizers leave them out.
function(resonid_test name)
  cmake_parse_arguments(TEST "LONG" "TIMEOUT" "SOURCES;DEPENDS;LABELS" ${ARGN})
  if(TEST_LONG AND NOT RESONID_LONG_TESTS)
    return()
  endif()
  if(NOT TEST_TIMEOUT)
    set(TEST_TIMEOUT 600)
  endif()
  set(properties TIMEOUT ${TEST_TIMEOUT})
  if(TEST_LABELS)
    list(APPEND properties LABELS ${TEST_LABELS})
  endif()
  add_executable(test_${name} ${TEST_SOURCES})
  target_link_libraries(test_${name} PRIVATE resonid_options ${TEST_DEPENDS} GTest::gtest_main)
  target_include_directories(test_${name} PRIVATE "${PROJECT_SOURCE_DIR}/tests/support")
  target_compile_definitions(test_${name} PRIVATE
    RESONID_GOLDEN_DIR="${PROJECT_SOURCE_DIR}/tests/golden"
    RESONID_RECORDINGS_DIR="${PROJECT_SOURCE_DIR}/../shared/recordings")
  gtest_discover_tests(test_${name} TEST_PREFIX "${name}." DISCOVERY_TIMEOUT 60 PROPERTIES ${properties})
endfunction()
