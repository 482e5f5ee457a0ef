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

# asbuilt_included_first(result name SOURCES ... HEADERS ...): the headers of a module that a source includes before
# anything else, so that the build shows already that they compile on their own.
function(asbuilt_included_first result name)
  cmake_parse_arguments(ARG "" "" "SOURCES;HEADERS" ${ARGN})
  set(found)
  foreach(source IN LISTS ARG_SOURCES)
    file(STRINGS ${source} first REGEX "^#include" LIMIT_COUNT 1)
    if(first MATCHES "\"asbuilt/${name}/([^/]+\\.h)\"$" AND CMAKE_MATCH_1 IN_LIST ARG_HEADERS)
      list(APPEND found ${CMAKE_MATCH_1})
    endif()
  endforeach()
  set(${result} ${found} PARENT_SCOPE)
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
  asbuilt_included_first(included_first ${name} SOURCES ${MODULE_SOURCES} HEADERS ${MODULE_HEADERS})
  set(others ${MODULE_HEADERS})
  list(REMOVE_ITEM others ${included_first})
  target_sources(${target} PUBLIC FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR}/src FILES ${included_first}
                                  FILE_SET other_headers TYPE HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR}/src FILES ${others})
  target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src>
                                              $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_link_libraries(${target} PUBLIC ${MODULE_DEPENDS})
  foreach(dependency IN LISTS MODULE_PRIVATE_DEPENDS)
    target_link_libraries(${target} PRIVATE ${dependency})
  endforeach()
  set_target_properties(${target} PROPERTIES VERIFY_INTERFACE_HEADER_SETS ON
                        INTERFACE_HEADER_SETS_TO_VERIFY other_headers EXPORT_NAME ${name})
  set_property(GLOBAL APPEND PROPERTY ASBUILT_MODULES ${target})
endfunction()
