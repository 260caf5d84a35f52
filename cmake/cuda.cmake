# Whether the CUDA backend is part of a build that does not say so: GBG_CUDA_USABLE is ON where a
# working nvcc 12 or later and the static CUDA runtime are found. Sanitizers, counters and other C
# compilers than gcc do without, because nvcc's objects know nothing of them.
set(GBG_CUDA_USABLE OFF)
if(NOT DEFINED GBG_WITH_CUDA AND NOT GBG_SANITIZE AND NOT GBG_COVERAGE
    AND CMAKE_C_COMPILER_ID STREQUAL GNU)
  include(CheckLanguage)
  check_language(CUDA)
  if(CMAKE_CUDA_COMPILER)
    find_package(CUDAToolkit 12 QUIET)
    if(CUDAToolkit_FOUND AND TARGET CUDA::cudart_static)
      set(GBG_CUDA_USABLE ON)
    endif()
  endif()
endif()
