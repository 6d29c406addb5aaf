# What is installed, by cmake --install, into a Debian package (cpack -G DEB) and into a Python wheel.
include(CMakePackageConfigHelpers)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/gbtrace)

install(TARGETS gbtrace RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(TARGETS gbtrace_shared EXPORT gbtrace LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY include/gbtrace DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(FILES README.md CHANGELOG.md CONTRIBUTING.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY docs examples DESTINATION ${CMAKE_INSTALL_DOCDIR} PATTERN "*.html" EXCLUDE)

# find_package(gbtrace), target gbtrace::gbtrace: the shared library.
install(EXPORT gbtrace NAMESPACE gbtrace:: FILE gbtraceConfig.cmake DESTINATION ${package_folder})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/gbtraceConfigVersion.cmake COMPATIBILITY SameMajorVersion)
install(FILES ${CMAKE_BINARY_DIR}/gbtraceConfigVersion.cmake DESTINATION ${package_folder})

# pkg-config gbtrace. Paths are found from the file's own place, so the tree can be moved.
file(RELATIVE_PATH GBT_PC_PREFIX ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
cmake_path(APPEND GBT_PC_LIBDIR "\${prefix}" "${CMAKE_INSTALL_LIBDIR}") # an absolute one stands alone
cmake_path(APPEND GBT_PC_INCLUDEDIR "\${prefix}" "${CMAKE_INSTALL_INCLUDEDIR}")
configure_file(cmake/gbtrace.pc.in ${CMAKE_BINARY_DIR}/gbtrace.pc @ONLY)
install(FILES ${CMAKE_BINARY_DIR}/gbtrace.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)

if(SKBUILD)
  install(FILES $<TARGET_FILE:gbtrace_shared> DESTINATION gbtrace RENAME libgbtrace.so COMPONENT python)
endif()

# One package: program, library, headers, documents. What it depends on is read from the binaries.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME gbtrace)
set(CPACK_PACKAGE_CONTACT "gbtrace developers <developers@gbtrace.invalid>") # who answers for the package: Name <mail>
set(CPACK_PACKAGE_DESCRIPTION "gbtrace turns posed photos into scenes that can be seen from anywhere:
granular balls become anchors, anchors decode into Gaussians, rays through
a tree of their ellipsoids make the picture and carry gradients back.
No GPU is needed. Program, library and headers.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
# A package is for the Debian that it was built on, whose libraries it needs, and says so in its version: 1.0.0+deb12.
set(debian_version ${PROJECT_VERSION})
if(EXISTS ${CMAKE_SYSROOT}/etc/os-release)
  file(STRINGS ${CMAKE_SYSROOT}/etc/os-release debian REGEX "^(ID=debian|VERSION_ID=)")
  if(debian MATCHES "ID=debian" AND debian MATCHES "VERSION_ID=\"([0-9]+)\"")
    string(APPEND debian_version "+deb${CMAKE_MATCH_1}")
  endif()
endif()
set(CPACK_DEBIAN_PACKAGE_VERSION ${debian_version})
if(CMAKE_CROSSCOMPILING)
  set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE arm64)
endif()
# The same bytes from the same sources: all files have one time, that of the release, and permissions do not depend on the umask.
set(CPACK_PRE_BUILD_SCRIPTS ${CMAKE_SOURCE_DIR}/cmake/debian/one_time.cmake)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "colmap, ffmpeg")
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
# Change log with the release's day, copyright, and the place of zsh's completion, for a tree that goes into /usr.
file(STRINGS CHANGELOG.md release_day REGEX "^## \\[${PROJECT_VERSION}\\] - ")
string(REGEX MATCH "[0-9]+-[0-9]+-[0-9]+$" release_day "${release_day}")
execute_process(COMMAND date -u -R -d "${release_day}" OUTPUT_VARIABLE release_day OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
foreach(file changelog copyright install.cmake)
  configure_file(cmake/debian/${file}.in ${CMAKE_BINARY_DIR}/debian/${file} @ONLY)
endforeach()
execute_process(COMMAND gzip -9 -n -k -f ${CMAKE_BINARY_DIR}/debian/changelog COMMAND_ERROR_IS_FATAL ANY)
install(SCRIPT ${CMAKE_BINARY_DIR}/debian/install.cmake)
file(WRITE ${CMAKE_BINARY_DIR}/debian/triggers "activate-noawait ldconfig\n")
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA ${CMAKE_BINARY_DIR}/debian/triggers)
include(CPack)
