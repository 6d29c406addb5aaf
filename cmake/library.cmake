# libgbtrace: all rooms in one file. Static for the program and tests of this build; shared for programs that include gbtrace/*.h, the one that is installed.
get_property(rooms GLOBAL PROPERTY GBT_ROOMS)
set(library_objects "")
set(library_links "")
foreach(room ${rooms})
  list(APPEND library_objects $<TARGET_OBJECTS:gbt_${room}>)
  get_target_property(links gbt_${room} LINK_LIBRARIES)
  list(FILTER links EXCLUDE REGEX "^gbt_(warnings|flags)$")
  foreach(link ${links})
    string(REGEX REPLACE "^gbt_" "" name ${link})
    if(NOT name IN_LIST rooms)
      list(APPEND library_links ${link})
    endif()
  endforeach()
endforeach()
list(REMOVE_DUPLICATES library_links)

add_library(gbtrace_library STATIC ${library_objects})
target_link_libraries(gbtrace_library PUBLIC ${library_links})
add_library(gbtrace_shared SHARED ${library_objects})
target_link_libraries(gbtrace_shared PRIVATE ${library_links} gbt_flags)
foreach(library gbtrace_library gbtrace_shared)
  set_target_properties(${library} PROPERTIES OUTPUT_NAME gbtrace LINKER_LANGUAGE CXX)
  target_include_directories(${library} PUBLIC $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
endforeach()

# The soname says which programs can run with which library: include/gbtrace/version.h.
set_target_properties(gbtrace_shared PROPERTIES VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR} EXPORT_NAME gbtrace
  LINK_DEPENDS ${CMAKE_SOURCE_DIR}/cmake/gbtrace.map)
# The map hides what C++ headers export; calls among our own functions stay inside the library.
target_link_options(gbtrace_shared PRIVATE -Wl,--version-script=${CMAKE_SOURCE_DIR}/cmake/gbtrace.map -Wl,-Bsymbolic-functions)
if(NOT GBT_SANITIZE)
  target_link_options(gbtrace_shared PRIVATE -Wl,--no-undefined)
endif()
