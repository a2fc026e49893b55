# Install rules and the exported package: find_package(resonid) gives resonid::<stage>.
include(CMakePackageConfigHelpers)
get_property(stage_targets GLOBAL PROPERTY RESONID_STAGE_TARGETS)
install(TARGETS ${stage_targets} EXPORT resonid-targets
        ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}")
install(DIRECTORY "${PROJECT_SOURCE_DIR}/include/resonid" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
install(EXPORT resonid-targets NAMESPACE resonid::
        DESTINATION "${CMAKE_INSTALL_LIBDIR}/cmake/resonid")
configure_package_config_file("${PROJECT_SOURCE_DIR}/cmake/resonid-config.cmake.in"
  "${PROJECT_BINARY_DIR}/resonid-config.cmake"
  INSTALL_DESTINATION "${CMAKE_INSTALL_LIBDIR}/cmake/resonid")
write_basic_package_version_file("${PROJECT_BINARY_DIR}/resonid-config-version.cmake"
  VERSION ${PROJECT_VERSION} COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/resonid-config.cmake" "${PROJECT_BINARY_DIR}/resonid-config-version.cmake"
        DESTINATION "${CMAKE_INSTALL_LIBDIR}/cmake/resonid")
if(TARGET resonid_cli)
  install(TARGETS resonid_cli RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}")
endif()
