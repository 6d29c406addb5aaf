# gbt_bytes_of(FILE OUT_VARIABLE): its bytes as the inside of a C initializer; what depends on it is made again when it changes.
function(gbt_bytes_of file out)
  get_filename_component(file ${file} ABSOLUTE)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  file(READ ${file} bytes HEX)
  string(REGEX REPLACE "(................................)" "\\1\n" bytes "${bytes}") # lines of 16 bytes
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
  set(${out} "${bytes}" PARENT_SCOPE)
endfunction()

# gbt_embed(OUT.c NAME FILE [NAME FILE]...): files as C, so that the program needs none of them beside it.
# Each becomes `const char NAME[]` with a zero at its end, and `const size_t NAME_size` without it. The header that declares them is written by hand.
function(gbt_embed out)
  set(source "/* made by tools/embed.cmake */\n#include <stddef.h>\n\n")
  list(LENGTH ARGN count)
  math(EXPR last "${count} - 2")
  foreach(i RANGE 0 ${last} 2)
    math(EXPR next "${i} + 1")
    list(GET ARGN ${i} name)
    list(GET ARGN ${next} file)
    gbt_bytes_of(${file} bytes)
    string(APPEND source "extern const char ${name}[];\nextern const size_t ${name}_size;\nconst char ${name}[] = {\n${bytes}0};\n"
      "const size_t ${name}_size = sizeof ${name} - 1;\n\n")
  endforeach()
  file(CONFIGURE OUTPUT ${out} CONTENT "${source}" @ONLY)
endfunction()
