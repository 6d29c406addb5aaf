# Tests of the project itself: layers, public headers, lines of at most 110 columns, the tools that say so. Included by the top CMakeLists.txt.
find_program(SH_PROGRAM sh REQUIRED)
add_test(NAME layers COMMAND ${SH_PROGRAM} ${CMAKE_SOURCE_DIR}/tools/check_layers.sh ${CMAKE_SOURCE_DIR})
add_test(NAME tools COMMAND ${SH_PROGRAM} ${CMAKE_SOURCE_DIR}/tests/project/test_tools.sh ${CMAKE_SOURCE_DIR})
add_test(NAME figures COMMAND ${SH_PROGRAM} ${CMAKE_SOURCE_DIR}/tests/project/test_figures.sh ${CMAKE_SOURCE_DIR})
add_test(NAME names COMMAND ${SH_PROGRAM} ${CMAKE_SOURCE_DIR}/tests/project/test_names.sh ${CMAKE_SOURCE_DIR} $<TARGET_FILE:gbtrace>)
add_test(NAME circles COMMAND ${SH_PROGRAM} ${CMAKE_SOURCE_DIR}/tests/project/test_circles.sh ${CMAKE_SOURCE_DIR} ${CMAKE_BINARY_DIR} ${CMAKE_C_COMPILER})
add_test(NAME lines COMMAND ${SH_PROGRAM} -c "! grep -rnE '^.{111}' --include=*.[ch] --include=*.cpp src lab include examples scenes" WORKING_DIRECTORY ${CMAKE_SOURCE_DIR})
# The library names fields; dashes are the program's. A page of a run (report) has style sheets, and the command that made it.
add_test(NAME messages COMMAND ${SH_PROGRAM} -c "! grep -rnE '\"([^\"]*[^-\"a-z])?--[a-z]' --include=*.c --include=*.h --include=*.cpp --exclude-dir=cli --exclude-dir=report src"
  WORKING_DIRECTORY ${CMAKE_SOURCE_DIR})
# Functions of the C library whose last bits differ between x86-64 and ARM, or between its versions (docs/reliability.md).
add_test(NAME functions COMMAND ${SH_PROGRAM} -c "! grep -rnE '(^|[^a-z_0-9])(hypot|cbrtf?|exp2f?|exp10f?|a?(sin|cos|tan)hf|a(sin|cos|tan|tan2)f|tanf|erfc?f?|[lt]gammaf?)\\(' --include=*.c --include=*.h src lab scenes"
  WORKING_DIRECTORY ${CMAKE_SOURCE_DIR})
find_program(PYTHON_PROGRAM python3)
if(PYTHON_PROGRAM)
  add_test(NAME mutants COMMAND ${PYTHON_PROGRAM} ${CMAKE_SOURCE_DIR}/tests/mutate/mutate.py --check)
endif()
foreach(test site commands)
  add_test(NAME ${test} COMMAND ${SH_PROGRAM} ${CMAKE_SOURCE_DIR}/tests/project/test_${test}.sh ${CMAKE_SOURCE_DIR} $<TARGET_FILE:gbtrace>)
endforeach()

# Every public header alone, twice, as C11 and as C++17: it compiles or the build fails.
file(GLOB public_headers CONFIGURE_DEPENDS RELATIVE ${CMAKE_SOURCE_DIR}/include ${CMAKE_SOURCE_DIR}/include/gbtrace/*.h)
set(header_sources "")
foreach(header ${public_headers})
  string(MAKE_C_IDENTIFIER ${header} stem)
  foreach(language c cpp)
    set(source ${CMAKE_BINARY_DIR}/headers/${stem}.${language})
    file(CONFIGURE OUTPUT ${source} CONTENT "#include \"${header}\"\n#include \"${header}\"\nextern int ${stem}_${language};\nint ${stem}_${language};\n")
    list(APPEND header_sources ${source})
  endforeach()
endforeach()
add_library(public_headers OBJECT EXCLUDE_FROM_ALL ${header_sources})
add_dependencies(tests public_headers)
target_include_directories(public_headers PRIVATE ${CMAKE_SOURCE_DIR}/include)
target_compile_options(public_headers PRIVATE -Wall -Wextra -Wpedantic -Werror)
set_target_properties(public_headers PROPERTIES C_EXTENSIONS OFF CXX_EXTENSIONS OFF)
