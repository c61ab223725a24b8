# What is installed: components that others find with find_package(soda COMPONENTS ...), each the
# target soda::NAME, in the build tree, too. A component's headers are listed: what is not listed is
# internal and stays here.
include(CMakePackageConfigHelpers)
set(soda_package ${CMAKE_INSTALL_LIBDIR}/cmake/soda)

# soda_component(NAME HEADERS FILE...): of the target soda_NAME, headers below its folder.
function(soda_component name)
  cmake_parse_arguments(ARG "" "" "HEADERS" ${ARGN})
  add_library(soda::${name} ALIAS soda_${name})
  set_target_properties(soda_${name} PROPERTIES EXPORT_NAME ${name})
  target_compile_features(soda_${name} PUBLIC cxx_std_20)
  target_include_directories(soda_${name} PUBLIC
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/soda>)
  foreach(header ${ARG_HEADERS})
    get_filename_component(folder ${header} DIRECTORY)
    install(FILES ${header} COMPONENT ${name}
      DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/soda/${name}/${folder})
  endforeach()
  soda_export(${name} soda_${name})
endfunction()

# The target, its file and what finds it.
function(soda_export name target)
  install(TARGETS ${target} EXPORT soda_${name} COMPONENT ${name})
  install(EXPORT soda_${name} NAMESPACE soda:: FILE soda-${name}.cmake
    DESTINATION ${soda_package} COMPONENT ${name})
endfunction()

write_basic_package_version_file(${CMAKE_BINARY_DIR}/soda-config-version.cmake
  VERSION ${PROJECT_VERSION} COMPATIBILITY SameMinorVersion)
foreach(component kernel physics simulation)  # each may be installed alone
  install(FILES ${PROJECT_SOURCE_DIR}/cmake/soda-config.cmake
    ${CMAKE_BINARY_DIR}/soda-config-version.cmake
    DESTINATION ${soda_package} COMPONENT ${component})
endforeach()
foreach(component kernel physics simulation program python)
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE
    DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT ${component})
endforeach()
