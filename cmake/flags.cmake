# Flags that every C file gets, as one interface target, and what makes a library public.
add_library(gamboge_flags INTERFACE)
target_compile_features(gamboge_flags INTERFACE c_std_11)
target_include_directories(gamboge_flags INTERFACE
  ${PROJECT_SOURCE_DIR}/c ${PROJECT_SOURCE_DIR}/include ${PROJECT_BINARY_DIR}/include
  ${PROJECT_BINARY_DIR}/include/gamboge)
# -ffp-contract=off: a multiply-add is fused only where the code says fma, so that every build of a
# kernel makes the same bits. Signed overflow wraps: fixed-point differences rely on it.
target_compile_options(gamboge_flags INTERFACE
  $<$<COMPILE_LANGUAGE:C>:-ffp-contract=off -fno-math-errno -fwrapv -fvisibility=hidden -Wall -Wextra
  -Wshadow -Wvla $<$<BOOL:${GBG_WERROR}>:-Werror> $<$<BOOL:${GBG_NATIVE}>:-march=native>>
  $<$<COMPILE_LANGUAGE:CUDA>:-fmad=false -Xcompiler=-ffp-contract=off,-fwrapv,-fvisibility=hidden,-Wall
  $<$<BOOL:${GBG_WERROR}>:-Werror=all-warnings>>)
target_compile_definitions(gamboge_flags INTERFACE _POSIX_C_SOURCE=200809L)
target_link_libraries(gamboge_flags INTERFACE m)
# Programs that only use the libraries need the sanitizer's runtime too, hence not in gamboge_flags.
# Instrumented code makes gcc see uninitialized variables where there are none.
if(GBG_SANITIZE)
  add_compile_options($<$<COMPILE_LANGUAGE:C>:-fsanitize=${GBG_SANITIZE}>
    $<$<COMPILE_LANGUAGE:C>:-fno-sanitize-recover=all>
    $<$<C_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>
    $<$<NOT:$<COMPILE_LANGUAGE:CUDA>>:-fno-omit-frame-pointer>)
  add_link_options(-fsanitize=${GBG_SANITIZE})
endif()
if(GBG_COVERAGE)
  target_compile_options(gamboge_flags INTERFACE $<$<COMPILE_LANGUAGE:C,Fortran>:--coverage>)
  target_link_options(gamboge_flags INTERFACE --coverage)
endif()
set(CMAKE_POSITION_INDEPENDENT_CODE ON)

function(gbg_public_library target)
  set_target_properties(${target} PROPERTIES
    VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
  target_include_directories(${target} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
    $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/include>
    $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/include/gamboge>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
endfunction()
