# SPDX-License-Identifier: Apache-2.0
# Installs the build into a prefix, moves that prefix (nothing may remember where it was), and then configures, builds
# and runs the project in consumer/ against it. Any failing step fails the script.
function(step name)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${name} failed (${result}):\n${output}")
  endif()
  message(STATUS "${name}: done")
  set(step_output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${WORK_DIR})
file(MAKE_DIRECTORY ${WORK_DIR})
step(install ${CMAKE_COMMAND} --install ${BUILD_DIR} --config ${CONFIG} --prefix ${WORK_DIR}/staged)
file(RENAME ${WORK_DIR}/staged ${WORK_DIR}/moved)

step(configure ${CMAKE_COMMAND} -S ${CONSUMER_DIR} -B ${WORK_DIR}/build -G ${GENERATOR} -DCMAKE_BUILD_TYPE=${CONFIG}
     -DCMAKE_CXX_COMPILER=${CXX} -DCMAKE_CXX_FLAGS=${CXX_FLAGS} -DCMAKE_PREFIX_PATH=${WORK_DIR}/moved
     -DCMAKE_FIND_PACKAGE_NO_PACKAGE_REGISTRY=ON)
step(build ${CMAKE_COMMAND} --build ${WORK_DIR}/build)
step(run ${WORK_DIR}/build/consumer ${WORK_DIR}/block.ply)
if(NOT step_output MATCHES "a block of diameter 70\\.000 mm")
  message(FATAL_ERROR "the consumer printed something else than expected:\n${step_output}")
endif()

step("installed command" ${WORK_DIR}/moved/bin/asbuilt --version)
if(NOT step_output MATCHES "${VERSION}")
  message(FATAL_ERROR "asbuilt --version says '${step_output}', expected ${VERSION}")
endif()

# A consumer must not be handed the folders of this machine.
file(GLOB_RECURSE package_files ${WORK_DIR}/moved/lib*/cmake/asbuilt/*.cmake)
foreach(file IN LISTS package_files)
  file(READ ${file} content)
  if(content MATCHES "${WORK_DIR}" OR content MATCHES "-Werror")
    message(FATAL_ERROR "${file} holds a path of this build, or our warnings as errors")
  endif()
endforeach()
