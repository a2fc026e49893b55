# The .deb files, one per component of ResonidInstall.cmake: resonid, libresonid0, libresonid-dev. Written by `cpack` of this build
# folder (tools/package). What they depend on is read from the binaries by dpkg-shlibdeps; only what is found at compile time,
# headers and archives, is named here.
set(library_package "libresonid${PROJECT_VERSION_MAJOR}")
set(documents "${PROJECT_BINARY_DIR}/package")
find_package(Python3 REQUIRED COMPONENTS Interpreter)
find_program(RESONID_GZIP gzip REQUIRED)

# Debian's description of Ceres for CMake links its archive and, with it, SuiteSparse and BLAS themselves; the programs of a package
# use the shared library, as everything else in Debian does.
get_target_property(archive Ceres::ceres IMPORTED_LOCATION_RELEASE)
cmake_path(GET archive PARENT_PATH folder)
find_library(RESONID_SHARED_CERES NAMES libceres.so HINTS "${folder}" REQUIRED)
set_target_properties(Ceres::ceres PROPERTIES IMPORTED_LOCATION_RELEASE "${RESONID_SHARED_CERES}"
                      INTERFACE_LINK_LIBRARIES "Threads::Threads;glog::glog")

# What Debian wants beside every package: licences, and a changelog in its format.
set(changelog "resonid (${PROJECT_VERSION}-1) unstable; urgency=medium\n\n  * See changelog.gz.\n\n")
execute_process(COMMAND git log -1 --format=%cd --date=rfc WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}"
                OUTPUT_VARIABLE date OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(NOT date)
  string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)
endif()
# The project has no mailbox; .invalid says so (RFC 2606). Whoever hands packages on gives theirs.
set(RESONID_MAINTAINER "The resonid developers <resonid@resonid.invalid>" CACHE STRING "Maintainer of the packages, Name <address>")
file(CONFIGURE OUTPUT "${documents}/changelog.Debian" CONTENT "${changelog} -- ${RESONID_MAINTAINER}  ${date}\n")
add_custom_command(OUTPUT "${documents}/changelog.Debian.gz" "${documents}/changelog.gz" "${documents}/copyright"
  COMMAND "${RESONID_GZIP}" -9nc "${documents}/changelog.Debian" > "${documents}/changelog.Debian.gz"
  COMMAND "${RESONID_GZIP}" -9nc "${PROJECT_SOURCE_DIR}/CHANGELOG.md" > "${documents}/changelog.gz"
  COMMAND "${Python3_EXECUTABLE}" "${PROJECT_SOURCE_DIR}/tools/licences" debian "${PROJECT_BINARY_DIR}" > "${documents}/copyright"
  DEPENDS resonid_report "${documents}/changelog.Debian" "${PROJECT_SOURCE_DIR}/CHANGELOG.md" "${PROJECT_SOURCE_DIR}/tools/licences"
  COMMENT "Collecting the licences" VERBATIM)
add_custom_target(resonid_package_documents ALL DEPENDS "${documents}/copyright")
set(names_program resonid)
set(names_library ${library_package})
set(names_development libresonid-dev)
foreach(component IN ITEMS program library development)
  install(FILES "${documents}/copyright" "${documents}/changelog.Debian.gz" "${documents}/changelog.gz"
          DESTINATION "${CMAKE_INSTALL_DATADIR}/doc/${names_${component}}" COMPONENT ${component})
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${names_${component}})
endforeach()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME resonid)
set(CPACK_PACKAGE_VENDOR "resonid")
set(CPACK_PACKAGE_DIRECTORY "${PROJECT_SOURCE_DIR}/build/packages")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_PRE_BUILD_SCRIPTS "${PROJECT_SOURCE_DIR}/cmake/package_manuals.cmake")
set(CPACK_COMPONENTS_ALL program library development)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_MAINTAINER "${RESONID_MAINTAINER}")
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)

set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # each has its own
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_DESCRIPTION "identification of resonating mechanical systems in electric drives
Takes a recording of torque and speed and gives the frequency response,
resonances, inertias, stiffness and damping, each with its uncertainty, and
the margins of the loop, as text, JSON and one self-contained HTML page.")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_LIBRARY_DESCRIPTION "on-line identification of electric drives, C interface
What runs sample by sample in a drive's servo loop: excitation within limits,
estimators, margins and verdict, in memory that the program gives.")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_DESCRIPTION "on-line identification of electric drives, development files
Headers, archives and descriptions for CMake and pkg-config of resonid's
libraries for C and C++, and the schemas of its result files.")
file(CONFIGURE OUTPUT "${documents}/triggers" CONTENT "activate-noawait ldconfig\n")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA "${documents}/triggers")
# What the headers include and find_package(resonid) looks for.
string(JOIN ", " CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "${library_package} (= ${PROJECT_VERSION}-1)" libceres-dev libeigen3-dev libexpected-dev
       libfmt-dev libhwy-dev libmatio-dev libtomlplusplus-dev "nlohmann-json3-dev (>= 3.11)" "pkgconf | pkg-config" zlib1g-dev)
include(CPack)

# What `make package` made, compared with what it should be and used: `make package-test`. Not part of other test runs: it takes minutes.
enable_testing()
add_test(NAME package.contents COMMAND "${PROJECT_SOURCE_DIR}/tests/package/contents" "${CPACK_PACKAGE_DIRECTORY}")
add_test(NAME package.bare_root COMMAND "${PROJECT_SOURCE_DIR}/tests/package/bare_root" "${CPACK_PACKAGE_DIRECTORY}" "${PROJECT_SOURCE_DIR}")
set_tests_properties(package.contents package.bare_root PROPERTIES LABELS package SKIP_RETURN_CODE 77 TIMEOUT 1800)
