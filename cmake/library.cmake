# The map engine for other programs: find_package(vogmap), target vogmap::vogmap.
include(CMakePackageConfigHelpers)

# vog_install_library(ROOM ...): the rooms' archives and headers, with what CMake needs to find them.
# A header is included as in this tree: "lib/vogmap/vog_map.h".
function(vog_install_library)
  set(library_dir ${CMAKE_INSTALL_LIBDIR}/vogmap)
  set(cmake_dir ${CMAKE_INSTALL_LIBDIR}/cmake/vogmap)
  foreach(folder ${ARGN})
    get_filename_component(name ${folder} NAME)
    list(APPEND targets ${name})
    install(DIRECTORY ${folder} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/vogmap/lib
            FILES_MATCHING PATTERN "*.h" PATTERN "*_testing.h" EXCLUDE)
  endforeach()
  install(TARGETS vog_flags ${targets} EXPORT vogmap_targets ARCHIVE DESTINATION ${library_dir})
  install(EXPORT vogmap_targets NAMESPACE vogmap:: DESTINATION ${cmake_dir})
  configure_package_config_file(cmake/vogmap-config.cmake.in ${PROJECT_BINARY_DIR}/vogmap-config.cmake
                                INSTALL_DESTINATION ${cmake_dir})
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/vogmap-config-version.cmake
                                   COMPATIBILITY SameMinorVersion)
  install(FILES ${PROJECT_BINARY_DIR}/vogmap-config.cmake
          ${PROJECT_BINARY_DIR}/vogmap-config-version.cmake DESTINATION ${cmake_dir})
endfunction()
