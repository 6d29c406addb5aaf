# gbt_page_files(FILE.c): the files of src/view/page/ as C arrays. Byte by byte: string literals have a limit that compilers warn about.
include(${CMAKE_SOURCE_DIR}/tools/embed.cmake)

function(gbt_page_files out)
  file(GLOB files CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/page/*)
  set(arrays "")
  set(rows "")
  foreach(path ${files})
    get_filename_component(name ${path} NAME)
    string(MAKE_C_IDENTIFIER ${name} id)
    gbt_bytes_of(${path} bytes)
    string(APPEND arrays "static const unsigned char ${id}[] = {${bytes}};\n")
    string(APPEND rows "    {\"${name}\", ${id}, sizeof ${id}},\n")
  endforeach()
  file(CONFIGURE OUTPUT ${out} CONTENT "/* made by src/view/page_files.cmake from src/view/page/ */
#include <string.h>

#include \"view/page_files.h\"

${arrays}
static const page_file files[] = {
${rows}};

const page_file *page_file_find(const char *name)
{
    for (size_t i = 0; i < sizeof files / sizeof *files; i++)
        if (strcmp(name, files[i].name) == 0)
            return &files[i];
    return NULL;
}
" @ONLY)
endfunction()
