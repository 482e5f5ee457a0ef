# SPDX-License-Identifier: Apache-2.0

# Flags of every target of ours, set per target so that consumers never inherit them.
function(asbuilt_flags target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  # No contraction: the same source must give the same bits whatever the optimiser fuses.
  target_compile_options(${target} PRIVATE -ffp-contract=off -Wall -Wextra -Wpedantic -Wshadow -Wconversion)
  if(ASBUILT_WARNINGS_AS_ERRORS)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF POSITION_INDEPENDENT_CODE ON)
endfunction()

# asbuilt_module(name SOURCES ... HEADERS ... DEPENDS ... [PRIVATE_DEPENDS ...])
# Makes the static library asbuilt::<name> of one stage. DEPENDS is the module order of docs/architecture.md:
# a stage links, and so includes, only what stands before it.
function(asbuilt_module name)
  cmake_parse_arguments(MODULE "" "" "SOURCES;HEADERS;DEPENDS;PRIVATE_DEPENDS" ${ARGN})
  set(target asbuilt_${name})
  add_library(${target} STATIC ${MODULE_SOURCES})
  add_library(asbuilt::${name} ALIAS ${target})
  asbuilt_flags(${target})
  target_sources(${target} PUBLIC FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR}/src FILES ${MODULE_HEADERS})
  target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src>
                                              $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_link_libraries(${target} PUBLIC ${MODULE_DEPENDS})
  foreach(dependency IN LISTS MODULE_PRIVATE_DEPENDS)
    target_link_libraries(${target} PRIVATE ${dependency})
  endforeach()
  set_target_properties(${target} PROPERTIES VERIFY_INTERFACE_HEADER_SETS ON EXPORT_NAME ${name})
  set_property(GLOBAL APPEND PROPERTY ASBUILT_MODULES ${target})
endfunction()
