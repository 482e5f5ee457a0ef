# SPDX-License-Identifier: Apache-2.0
# `find_package(asbuilt)` after install.
include(CMakePackageConfigHelpers)

get_property(modules GLOBAL PROPERTY ASBUILT_MODULES)
install(TARGETS ${modules} asbuilt_asbuilt EXPORT asbuiltTargets FILE_SET HEADERS FILE_SET other_headers)
install(EXPORT asbuiltTargets NAMESPACE asbuilt:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/asbuilt)
install(TARGETS asbuilt_cli RUNTIME)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/asbuiltConfig.cmake.in ${PROJECT_BINARY_DIR}/asbuiltConfig.cmake
                              INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/asbuilt)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/asbuiltConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/asbuiltConfig.cmake ${PROJECT_BINARY_DIR}/asbuiltConfigVersion.cmake
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/asbuilt)
