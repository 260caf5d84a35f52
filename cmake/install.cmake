# What `cmake --install` puts where: libraries, headers, program, Fortran module and its source,
# CMake package (components core, analysis, fortran), pkg-config files.
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/gamboge)

install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/gamboge DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
  FILES_MATCHING PATTERN "*.h")
install(FILES ${PROJECT_BINARY_DIR}/include/gamboge/version.h
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/gamboge)

# gbg_install_library(target component export_name option...): the target as gamboge::export_name.
# Clients of a static library link the libraries of the options themselves, by name.
function(gbg_install_library target component export_name)
  get_target_property(type ${target} TYPE)
  if(type STREQUAL STATIC_LIBRARY AND ARGN)
    foreach(option ${ARGN})
      if(${option})
        list(APPEND needed ${${option}_PC_LIBRARIES})
      endif()
    endforeach()
    if(GBG_WITH_OPENMP)
      list(APPEND needed ${OpenMP_C_LIB_NAMES})
    endif()
    if(GBG_WITH_CUDA AND component STREQUAL core)
      list(APPEND needed gamboge::cuda_runtime) # made in gamboge-config.cmake
    endif()
    foreach(name ${needed} m)
      target_link_libraries(${target} INTERFACE $<INSTALL_INTERFACE:${name}>)
    endforeach()
  endif()
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${export_name})
  install(TARGETS ${target} EXPORT gamboge-${component}
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  install(EXPORT gamboge-${component} NAMESPACE gamboge:: DESTINATION ${package_dir})
endfunction()

# gbg_install_pc(name): cmake/name.pc.in. The prefix is found from the file's own place.
function(gbg_install_pc name)
  cmake_path(ABSOLUTE_PATH CMAKE_INSTALL_LIBDIR BASE_DIRECTORY ${CMAKE_INSTALL_PREFIX}
    OUTPUT_VARIABLE libdir)
  cmake_path(RELATIVE_PATH CMAKE_INSTALL_PREFIX BASE_DIRECTORY ${libdir}/pkgconfig
    OUTPUT_VARIABLE up)
  set(GBG_PC_PREFIX "\${pcfiledir}/${up}")
  configure_file(${PROJECT_SOURCE_DIR}/cmake/${name}.pc.in ${PROJECT_BINARY_DIR}/${name}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endfunction()

# What a client of static libraries needs besides; a shared library brings its own.
set(GBG_PC_CORE "")
set(GBG_PC_ANALYSIS "")
set(GBG_PC_FFT "")
set(GBG_PC_FFT_LIBS "")
set(GBG_PC_LIBS "")
set(GBG_PC_CUDA "")
set(GBG_STATIC_CUDA OFF)
if(NOT BUILD_SHARED_LIBS)
  set(GBG_PC_LIBS -lm)
  if(GBG_WITH_OPENMP)
    string(APPEND GBG_PC_LIBS " ${OpenMP_C_FLAGS}")
  endif()
  if(GBG_WITH_CUDA)
    set(GBG_STATIC_CUDA ON)
    set(GBG_PC_CUDA " -L${CUDAToolkit_LIBRARY_DIR} -lcudart_static -lstdc++ -lpthread -ldl -lrt")
  endif()
  if(GBG_WITH_CYAML)
    string(APPEND GBG_PC_CORE " libcyaml yaml-0.1")
  endif()
  if(GBG_WITH_NETCDF)
    string(APPEND GBG_PC_CORE " netcdf")
  endif()
  if(GBG_WITH_FFTW)
    string(APPEND GBG_PC_ANALYSIS " fftw3")
    string(APPEND GBG_PC_FFT " fftw3 fftw3f")
    set(GBG_PC_FFT_LIBS -Wl,--undefined=gbg_fft_fftw)
  endif()
endif()

set_target_properties(gamboge PROPERTIES INSTALL_RPATH "$ORIGIN")
gbg_install_library(gamboge core gamboge GBG_WITH_CYAML GBG_WITH_NETCDF)
gbg_install_pc(gamboge)

if(TARGET gamboge_analysis)
  set_target_properties(gamboge_analysis PROPERTIES INSTALL_RPATH "$ORIGIN")
  gbg_install_library(gamboge_analysis analysis analysis GBG_WITH_FFTW GBG_WITH_NETCDF)
  gbg_install_pc(gamboge-analysis)
endif()

# What libgamboge opens; clients of static libraries link it by name.
if(TARGET gamboge_fft)
  set_target_properties(gamboge_fft PROPERTIES INSTALL_RPATH "$ORIGIN")
  gbg_install_library(gamboge_fft fft fft GBG_FFTW_BOTH)
  gbg_install_pc(gamboge-fft)
endif()

if(TARGET gamboge_program)
  file(RELATIVE_PATH back ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR})
  set_target_properties(gamboge_program PROPERTIES INSTALL_RPATH "$ORIGIN/${back}")
  install(TARGETS gamboge_program RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()

# The module for clients of the same compiler and version, and its source for all others.
if(TARGET gamboge_fortran)
  set(GBG_MODULE_DIR ${CMAKE_INSTALL_INCLUDEDIR}/gamboge/fortran/${CMAKE_Fortran_COMPILER_ID}-${CMAKE_Fortran_COMPILER_VERSION})
  get_target_property(sources gamboge_fortran SOURCES)
  get_target_property(folder gamboge_fortran SOURCE_DIR)
  get_target_property(modules gamboge_fortran Fortran_MODULE_DIRECTORY)
  list(TRANSFORM sources PREPEND ${folder}/ REGEX "^[^/]")
  install(FILES ${sources} DESTINATION ${CMAKE_INSTALL_DATADIR}/gamboge/fortran)
  install(DIRECTORY ${modules}/ DESTINATION ${GBG_MODULE_DIR} FILES_MATCHING PATTERN "*.mod")
  target_include_directories(gamboge_fortran INTERFACE $<INSTALL_INTERFACE:${GBG_MODULE_DIR}>)
  gbg_install_library(gamboge_fortran fortran fortran_compiled)
  set(GBG_PC_FORTRAN gamboge)
  if(TARGET gamboge_analysis)
    set(GBG_PC_FORTRAN "gamboge-analysis gamboge")
  endif()
  gbg_install_pc(gamboge-fortran)
endif()

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/gamboge-config.cmake.in
  ${PROJECT_BINARY_DIR}/gamboge-config.cmake INSTALL_DESTINATION ${package_dir}
  PATH_VARS CMAKE_INSTALL_INCLUDEDIR CMAKE_INSTALL_DATADIR)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/gamboge-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/gamboge-config.cmake
  ${PROJECT_BINARY_DIR}/gamboge-config-version.cmake ${PROJECT_SOURCE_DIR}/cmake/gamboge-fortran-face.cmake
  DESTINATION ${package_dir})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
