# What `cmake --install` puts where: libraries, headers, CMake package, pkg-config files.
install(TARGETS gamboge RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
