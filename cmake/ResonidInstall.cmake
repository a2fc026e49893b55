# Install rules and the exported package: find_package(resonid) gives resonid::<stage>. Components are packages: program, library
# (what a program linked with it needs to run), development.
include(CMakePackageConfigHelpers)
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME development)
get_property(stage_targets GLOBAL PROPERTY RESONID_STAGE_TARGETS)
install(TARGETS ${stage_targets} EXPORT resonid-targets
        LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT library NAMELINK_COMPONENT development
        ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT development)
foreach(target IN LISTS stage_targets)  # headers of the stages that are built: the embedded preset installs three
  get_target_property(stage ${target} EXPORT_NAME)
  if(stage STREQUAL "c_static")  # has the headers of c
    continue()
  endif()
  if(stage STREQUAL "resonid")
    install(FILES "${PROJECT_SOURCE_DIR}/include/resonid/resonid.hpp" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/resonid")
    continue()
  endif()
  if(EXISTS "${PROJECT_SOURCE_DIR}/include/resonid/${stage}")  # not of those that are private
    install(DIRECTORY "${PROJECT_SOURCE_DIR}/include/resonid/${stage}" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/resonid")
  endif()
endforeach()
if(TARGET resonid_report)
  install(DIRECTORY "${PROJECT_SOURCE_DIR}/docs/schema" DESTINATION "${CMAKE_INSTALL_DATADIR}/resonid")
endif()
if(NOT RESONID_PACKAGE)  # whose file `copyright` has it
  install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" DESTINATION "${CMAKE_INSTALL_DOCDIR}")
endif()
install(EXPORT resonid-targets NAMESPACE resonid::
        DESTINATION "${CMAKE_INSTALL_LIBDIR}/cmake/resonid")
configure_package_config_file("${PROJECT_SOURCE_DIR}/cmake/resonid-config.cmake.in"
  "${PROJECT_BINARY_DIR}/resonid-config.cmake"
  INSTALL_DESTINATION "${CMAKE_INSTALL_LIBDIR}/cmake/resonid")
write_basic_package_version_file("${PROJECT_BINARY_DIR}/resonid-config-version.cmake"
  VERSION ${PROJECT_VERSION} COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/resonid-config.cmake" "${PROJECT_BINARY_DIR}/resonid-config-version.cmake"
        DESTINATION "${CMAKE_INSTALL_LIBDIR}/cmake/resonid")
if(TARGET resonid_c)
  set(RESONID_PC_PRIVATE "")
  file(RELATIVE_PATH RESONID_PC_UP "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
  if(hwy_FOUND)
    set(RESONID_PC_PRIVATE "-lhwy")
  endif()
  configure_file("${PROJECT_SOURCE_DIR}/cmake/resonid.pc.in" "${PROJECT_BINARY_DIR}/resonid.pc" @ONLY)
  install(FILES "${PROJECT_BINARY_DIR}/resonid.pc" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig")
endif()
if(TARGET resonid_cli)
  install(DIRECTORY "${RESONID_HELP_FILES}/share/" DESTINATION "${CMAKE_INSTALL_DATADIR}" COMPONENT program)  # completions and man pages
  install(FILES "${PROJECT_SOURCE_DIR}/apps/monitor/systemd/resonid-monitor.service" DESTINATION lib/systemd/system COMPONENT program)
  install(TARGETS resonid_cli resonid_reproduce RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}" COMPONENT program)
endif()
