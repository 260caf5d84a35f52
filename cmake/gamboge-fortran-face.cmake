# The target gamboge::fortran in a client's build: the installed module when the client's compiler
# reads it, else (or with GAMBOGE_IGNORE_MODULE) the module compiled from its installed source.
get_property(gamboge_languages GLOBAL PROPERTY ENABLED_LANGUAGES)
file(GLOB gamboge_fortran_sources ${gamboge_data_dir}/gamboge/fortran/*.f90)
if(NOT gamboge_fortran_sources)
  set(gamboge_NOT_FOUND_MESSAGE "this installation of gamboge was built with GBG_WITH_FORTRAN=OFF")
  return()
endif()
if(NOT "Fortran" IN_LIST gamboge_languages)
  set(gamboge_NOT_FOUND_MESSAGE "its component fortran needs the language Fortran in the project")
  return()
endif()
set(gamboge_fortran_FOUND TRUE)
if(TARGET gamboge::fortran)
  return()
endif()

set(gamboge_module_dir ${gamboge_include_dir}/gamboge/fortran/${CMAKE_Fortran_COMPILER_ID}-${CMAKE_Fortran_COMPILER_VERSION})
set(gamboge_module_fits FALSE)
if(NOT GAMBOGE_IGNORE_MODULE AND EXISTS ${gamboge_module_dir}/gamboge.mod)
  set(gamboge_trial ${CMAKE_CURRENT_BINARY_DIR}/gamboge_module_trial)
  file(WRITE ${gamboge_trial}/trial.f90 "program trial\n   use gamboge\n   implicit none\nend program trial\n")
  set(CMAKE_TRY_COMPILE_TARGET_TYPE_BEFORE ${CMAKE_TRY_COMPILE_TARGET_TYPE})
  set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
  try_compile(gamboge_module_fits ${gamboge_trial} SOURCES ${gamboge_trial}/trial.f90
    CMAKE_FLAGS -DINCLUDE_DIRECTORIES=${gamboge_module_dir})
  set(CMAKE_TRY_COMPILE_TARGET_TYPE ${CMAKE_TRY_COMPILE_TARGET_TYPE_BEFORE})
endif()

add_library(gamboge::fortran INTERFACE IMPORTED)
if(gamboge_module_fits)
  include(${CMAKE_CURRENT_LIST_DIR}/gamboge-fortran.cmake)
  target_link_libraries(gamboge::fortran INTERFACE gamboge::fortran_compiled)
else()
  message(STATUS "gamboge: the Fortran module is compiled from its source for this compiler")
  add_library(gamboge_fortran_from_source STATIC ${gamboge_fortran_sources})
  set_target_properties(gamboge_fortran_from_source PROPERTIES
    Fortran_MODULE_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/gamboge_modules)
  target_include_directories(gamboge_fortran_from_source
    PUBLIC ${CMAKE_CURRENT_BINARY_DIR}/gamboge_modules)
  target_link_libraries(gamboge_fortran_from_source PUBLIC
    $<TARGET_NAME_IF_EXISTS:gamboge::analysis> gamboge::gamboge)
  target_link_libraries(gamboge::fortran INTERFACE gamboge_fortran_from_source)
endif()
