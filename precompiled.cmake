# Headers of libraries are two thirds of what a first build compiles. They are compiled once a target,
# unless a compiler cache is there, which cannot look into them. No line of a source relies on it:
# tests/determinism compiles every layer without.
if(CCACHE)
  set(precompiles OFF)
else()
  set(precompiles ON)
endif()
option(SODA_PRECOMPILED_HEADERS "Compile the headers of libraries once a target" ${precompiles})

set(standard_headers algorithm array atomic chrono cmath cstdint deque filesystem fstream functional
  limits map memory mutex numeric optional ostream set span sstream stdexcept string string_view
  thread tuple utility variant vector)
list(TRANSFORM standard_headers REPLACE "(.+)" "<\\1>")

# precompile_headers(TARGET [HEADER...]): the standard library, Eigen above the kernel, and HEADERs.
function(precompile_headers target)
  if(NOT SODA_PRECOMPILED_HEADERS)
    return()
  endif()
  set(headers ${standard_headers} ${ARGN})
  if(target MATCHES "^soda_(physics|models|scenarios|analysis)$")
    list(APPEND headers <Eigen/Core> <Eigen/Geometry>)
  endif()
  if(target STREQUAL soda_physics)
    list(APPEND headers <boost/container/small_vector.hpp>)
  endif()
  target_precompile_headers(${target} PRIVATE ${headers})
endfunction()
