# Tests of the project itself: layers, public headers, the tools that say so. Included by the top CMakeLists.txt.
find_program(SH_PROGRAM sh REQUIRED)
add_test(NAME layers COMMAND ${SH_PROGRAM} ${CMAKE_SOURCE_DIR}/tools/check_layers.sh ${CMAKE_SOURCE_DIR})
add_test(NAME tools COMMAND ${SH_PROGRAM} ${CMAKE_SOURCE_DIR}/tests/project/test_tools.sh ${CMAKE_SOURCE_DIR})
set_tests_properties(layers tools PROPERTIES TIMEOUT 60)

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
add_library(public_headers OBJECT ${header_sources})
target_include_directories(public_headers PRIVATE ${CMAKE_SOURCE_DIR}/include)
target_compile_options(public_headers PRIVATE -Wall -Wextra -Wpedantic -Werror)
set_target_properties(public_headers PROPERTIES C_EXTENSIONS OFF CXX_EXTENSIONS OFF)
add_test(NAME public_headers COMMAND ${CMAKE_COMMAND} -E echo "compiled with the build: ${public_headers}")

# Exported files read by other programs.
add_test(NAME readers COMMAND ${SH_PROGRAM} ${CMAKE_SOURCE_DIR}/tests/project/test_readers.sh $<TARGET_FILE:gbtrace> ${CMAKE_SOURCE_DIR})
set_tests_properties(readers PROPERTIES SKIP_RETURN_CODE 77)
