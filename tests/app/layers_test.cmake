# A forbidden include does not compile. The compiler is asked with the very include directories of each folder's
# library: for a header of a folder that it must not know, the test passes only where the compiler says that this
# header was not found; for headers that it may include, only where all that it includes is found.

# NAME is the folder whose library asks; KNOWS and MUST_NOT_KNOW are headers from the root of the tree.
function(tendril_layer_test name)
  cmake_parse_arguments(ARG "" "" "KNOWS;MUST_NOT_KNOW" ${ARGN})
  set(source_folder ${CMAKE_CURRENT_BINARY_DIR}/layers)
  set(directories $<TARGET_PROPERTY:tendril_${name},INCLUDE_DIRECTORIES>)
  foreach(header ${ARG_KNOWS} ${ARG_MUST_NOT_KNOW})
    if(NOT EXISTS ${CMAKE_SOURCE_DIR}/${header})
      message(FATAL_ERROR "the layer test of ${name} asks for ${header}, which is no longer there")
    endif()
    string(MAKE_C_IDENTIFIER ${header} identifier)
    set(source ${source_folder}/${name}_includes_${identifier}.cpp)
    file(CONFIGURE OUTPUT ${source} CONTENT "#include \"${header}\"\n")
    if(header IN_LIST ARG_KNOWS)
      set(test "layers: ${name} may include ${header}")
    else()
      set(test "layers: ${name} cannot include ${header}")
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
                   MUST_NOT_KNOW fem/model.h hal/bus.h rt/controller.h app/config.h)
tendril_layer_test(fem KNOWS fem/model.h
                   MUST_NOT_KNOW qp/solver.h hal/bus.h rt/controller.h app/config.h)
tendril_layer_test(hal KNOWS hal/bus.h
                   MUST_NOT_KNOW fem/model.h qp/solver.h rt/controller.h app/config.h)
tendril_layer_test(rt KNOWS rt/controller.h qp/solver.h hal/bus.h
                   MUST_NOT_KNOW fem/model.h app/config.h)
# Every header that is refused above can be compiled where it is allowed.
tendril_layer_test(app KNOWS fem/model.h qp/solver.h hal/bus.h rt/controller.h app/config.h)
