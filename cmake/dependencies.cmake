# Libraries that a build may carry: each is an imported target, asked for by its option, and a
# missing one is named with its Debian package and the option that goes without it.
find_package(PkgConfig QUIET)

# gbg_find(option module package [target]): the target carries the name of the option, unless it is
# given one of its own.
function(gbg_find option module package)
  if(NOT ${option})
    return()
  endif()
  set(target ${option})
  if(ARGC GREATER 3)
    set(target ${ARGV3})
  endif()
  if(PKG_CONFIG_FOUND)
    pkg_check_modules(${target}_PC QUIET IMPORTED_TARGET GLOBAL ${module})
  endif()
  if(NOT ${target}_PC_FOUND)
    message(FATAL_ERROR "${module} was not found: install ${package}, or configure with -D${option}=OFF")
  endif()
  add_library(${target} INTERFACE IMPORTED GLOBAL)
  target_link_libraries(${target} INTERFACE PkgConfig::${target}_PC)
  target_compile_definitions(${target} INTERFACE ${option}=1)
endfunction()

gbg_find(GBG_WITH_FFTW fftw3 libfftw3-dev)
gbg_find(GBG_WITH_FFTW "fftw3;fftw3f" libfftw3-dev GBG_FFTW_BOTH)
set(GBG_FFTW_BOTH ${GBG_WITH_FFTW}) # for those who ask for targets by their options
gbg_find(GBG_WITH_NETCDF netcdf libnetcdf-dev)
gbg_find(GBG_WITH_CYAML "libcyaml;yaml-0.1" "libcyaml-dev libyaml-dev")
if(GBG_BUILD_COMMAND)
  gbg_find(GBG_WITH_CAIRO cairo libcairo2-dev)
endif()
if(GBG_WITH_OPENMP)
  find_package(OpenMP COMPONENTS C)
  if(NOT OpenMP_C_FOUND)
    message(FATAL_ERROR "OpenMP was not found: configure with -DGBG_WITH_OPENMP=OFF")
  endif()
  target_link_libraries(gamboge_flags INTERFACE OpenMP::OpenMP_C)
  if(GBG_SANITIZE MATCHES thread AND OpenMP_omp_LIBRARY)
    # Where clang's OpenMP finds Archer, which tells the thread sanitizer of barriers and locks.
    cmake_path(GET OpenMP_omp_LIBRARY PARENT_PATH GBG_ARCHER_DIR)
    list(APPEND CMAKE_BUILD_RPATH ${GBG_ARCHER_DIR})
  endif()
else()
  # Only simd pragmas are read, so that what num_threads() names may be used nowhere.
  target_compile_options(gamboge_flags INTERFACE
    $<$<COMPILE_LANGUAGE:C>:-fopenmp-simd -Wno-unused-parameter -Wno-unused-variable -Wno-unknown-pragmas>)
endif()
if(GBG_WITH_CUDA)
  include(CheckLanguage)
  check_language(CUDA)
  if(NOT CMAKE_CUDA_COMPILER)
    message(FATAL_ERROR "nvcc was not found: install the CUDA toolkit, or configure with "
                        "-DGBG_WITH_CUDA=OFF")
  endif()
  # Machine code for A100 and H100 or H200, and what later cards compile for themselves.
  if(NOT CMAKE_CUDA_ARCHITECTURES AND NOT DEFINED ENV{CUDAARCHS})
    set(CMAKE_CUDA_ARCHITECTURES 80-real 90 CACHE STRING "Compute capabilities of the GPUs")
  endif()
  enable_language(CUDA)
  find_package(CUDAToolkit 12 REQUIRED)
  set(CMAKE_CUDA_STANDARD 20)
endif()
