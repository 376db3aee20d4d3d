# SPDX-License-Identifier: Apache-2.0
# A forbidden include does not compile. The compiler is asked with the very include directories of each folder's
# library: for a header of a folder that it must not know, the test passes only where the compiler says that this
# header was not found; for headers that it may include, only where all that it includes is found.

# ROOM is the folder whose library asks; KNOWS and MUST_NOT_KNOW are headers from the root of the tree.
function(tendril_layer_test room)
  cmake_parse_arguments(ARG "" "" "KNOWS;MUST_NOT_KNOW" ${ARGN})
  string(REPLACE / _ name ${room})
  set(source_folder ${CMAKE_CURRENT_BINARY_DIR}/layers)
  set(directories $<TARGET_PROPERTY:tendril_${name},INCLUDE_DIRECTORIES>)
  foreach(header ${ARG_KNOWS} ${ARG_MUST_NOT_KNOW})
    if(NOT EXISTS ${CMAKE_SOURCE_DIR}/${header})
      message(FATAL_ERROR "the layer test of ${room} asks for ${header}, which is no longer there")
    endif()
    string(MAKE_C_IDENTIFIER ${header} identifier)
    set(source ${source_folder}/${name}_includes_${identifier}.cpp)
    file(CONFIGURE OUTPUT ${source} CONTENT "#include \"${header}\"\n")
    if(header IN_LIST ARG_KNOWS)
      set(test "layers: ${room} may include ${header}")
    else()
      set(test "layers: ${room} cannot include ${header}")
    endif()
    add_test(NAME ${test} COMMAND_EXPAND_LISTS
             COMMAND ${CMAKE_CXX_COMPILER} -std=c++20 -E -o ${source}.i "-I$<JOIN:${directories},;-I>" ${source})
    set_tests_properties(${test} PROPERTIES LABELS source ENVIRONMENT LC_ALL=C)
    if(header IN_LIST ARG_MUST_NOT_KNOW)
      string(REPLACE "." "\\." pattern ${header})
      set_tests_properties(${test} PROPERTIES
          PASS_REGULAR_EXPRESSION "fatal error: '?${pattern}'?:? (No such file|file not found)")
    endif()
  endforeach()
endfunction()

tendril_layer_test(qp KNOWS qp/solver.h
                   MUST_NOT_KNOW fem/body/model.h hal/bus/bus.h rt/controller.h app/config/config.h)
tendril_layer_test(fem/mesh KNOWS fem/mesh/mesh.h
                   MUST_NOT_KNOW fem/element/corotational.h fem/sparse/factor.h fem/body/model.h)
tendril_layer_test(fem/element KNOWS fem/element/corotational.h fem/mesh/mesh.h
                   MUST_NOT_KNOW fem/sparse/factor.h fem/body/model.h)
tendril_layer_test(fem/sparse KNOWS fem/sparse/factor.h
                   MUST_NOT_KNOW fem/mesh/mesh.h fem/element/corotational.h fem/body/model.h)
tendril_layer_test(fem/body KNOWS fem/body/model.h
                   MUST_NOT_KNOW qp/solver.h hal/bus/bus.h rt/controller.h app/config/config.h)
tendril_layer_test(hal/bus KNOWS hal/bus/bus.h
                   MUST_NOT_KNOW hal/sensor/sensor.h hal/drive/drives.h hal/canopen/canopen.h rt/controller.h)
tendril_layer_test(hal/drive KNOWS hal/drive/drives.h
                   MUST_NOT_KNOW hal/canopen/canopen.h hal/cia402/cia402.h hal/odrive/odrive.h hal/sim/simulated_servo.h)
tendril_layer_test(hal/sim KNOWS hal/sim/simulated_servo.h
                   MUST_NOT_KNOW hal/canopen/canopen.h hal/cia402/cia402.h hal/odrive/odrive.h)
tendril_layer_test(hal/canopen KNOWS hal/canopen/canopen.h
                   MUST_NOT_KNOW hal/drive/drives.h hal/cia402/cia402.h hal/sim/simulated_servo.h)
tendril_layer_test(hal/cia402 KNOWS hal/cia402/cia402.h
                   MUST_NOT_KNOW hal/odrive/odrive.h)
tendril_layer_test(hal/odrive KNOWS hal/odrive/odrive.h
                   MUST_NOT_KNOW hal/canopen/canopen.h hal/cia402/cia402.h)
tendril_layer_test(hal/protocols KNOWS hal/protocols/drive_protocols.h
                   MUST_NOT_KNOW fem/body/model.h qp/solver.h rt/controller.h app/config/config.h)
tendril_layer_test(rt KNOWS rt/controller.h qp/solver.h hal/drive/drives.h
                   MUST_NOT_KNOW fem/body/model.h hal/sim/simulated_servo.h hal/cia402/cia402.h app/config/config.h)
tendril_layer_test(app/config KNOWS app/config/config.h
                   MUST_NOT_KNOW app/robot/robot.h app/plant/plant.h app/daemon/daemon.h hal/cia402/cia402.h)
tendril_layer_test(app/robot KNOWS app/robot/robot.h
                   MUST_NOT_KNOW app/plant/plant.h app/check/check_report.h app/daemon/daemon.h)
tendril_layer_test(app/plant KNOWS app/plant/plant.h hal/sim/simulated_servo.h
                   MUST_NOT_KNOW app/check/check_report.h app/daemon/daemon.h)
tendril_layer_test(app/operation KNOWS app/operation/control_server.h
                   MUST_NOT_KNOW app/plant/plant.h app/daemon/daemon.h app/client/control_client.h)
tendril_layer_test(app/mcap KNOWS app/mcap/mcap_recorder.h
                   MUST_NOT_KNOW app/config/config.h rt/controller.h app/daemon/daemon.h)
tendril_layer_test(app/metrics KNOWS app/metrics/metrics_server.h
                   MUST_NOT_KNOW app/config/config.h rt/controller.h app/daemon/daemon.h)
tendril_layer_test(app/simulation KNOWS app/simulation/simulation.h app/plant/plant.h app/daemon/run_recorder.h
                   MUST_NOT_KNOW app/check/check_report.h app/client/control_client.h)
tendril_layer_test(app/client KNOWS app/client/control_client.h
                   MUST_NOT_KNOW app/operation/control_server.h app/robot/robot.h app/daemon/daemon.h)
tendril_layer_test(app/daemon KNOWS app/daemon/daemon.h
                   MUST_NOT_KNOW app/plant/plant.h app/check/check_report.h app/jog/jog.h hal/cia402/cia402.h
                                 hal/sim/simulated_servo.h)
# Every header that is refused above can be compiled where it is allowed.
tendril_layer_test(app/check KNOWS app/check/check_report.h app/plant/plant.h qp/solver.h rt/controller.h fem/body/model.h
                                   hal/bus/bus.h)
tendril_layer_test(app/jog KNOWS app/jog/jog.h)
