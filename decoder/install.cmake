# What an installation holds: the library, its headers, the shader headers, and how CMake and pkg-config find them.
# A project that takes btfc in by add_subdirectory installs nothing of it unless it asks.
add_library(btfc::shaders ALIAS btfc_shaders)

# Until 1.0 a minor version may break the interface, hence two numbers in the soname; from 1.0 on: the major one.
set_target_properties(btfc PROPERTIES VERSION ${PROJECT_VERSION}
  SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})

option(BTFC_INSTALL "Install the library" ${PROJECT_IS_TOP_LEVEL})
if(NOT BTFC_INSTALL)
  return()
endif()

set(BTFC_CMAKE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/btfc)
set(BTFC_SHADER_DIR ${CMAKE_INSTALL_DATADIR}/btfc/shaders)
get_target_property(BTFC_LIBRARY_TYPE btfc TYPE)
if(BTFC_LIBRARY_TYPE STREQUAL "SHARED_LIBRARY")
  set(BTFC_IS_SHARED TRUE)
else()
  set(BTFC_IS_SHARED FALSE)
endif()

set_target_properties(btfc_shaders PROPERTIES EXPORT_NAME shaders)
target_include_directories(btfc_shaders INTERFACE $<INSTALL_INTERFACE:${BTFC_SHADER_DIR}>)
install(TARGETS btfc btfc_shaders EXPORT btfcTargets)
install(DIRECTORY include/btfc DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/shaders/ DESTINATION ${BTFC_SHADER_DIR}
  FILES_MATCHING PATTERN "*.h" PATTERN "*.glsl" PATTERN "*.comp")
# Only there if glslang was found when btfc was built.
install(DIRECTORY ${PROJECT_BINARY_DIR}/shaders/ DESTINATION ${BTFC_SHADER_DIR} FILES_MATCHING PATTERN "*.spv"
  PATTERN CMakeFiles EXCLUDE)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})

install(EXPORT btfcTargets NAMESPACE btfc:: DESTINATION ${BTFC_CMAKE_DIR})
configure_package_config_file(btfcConfig.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/btfcConfig.cmake
  INSTALL_DESTINATION ${BTFC_CMAKE_DIR} NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/btfcConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/btfcConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/btfcConfigVersion.cmake
  DESTINATION ${BTFC_CMAKE_DIR})

file(RELATIVE_PATH BTFC_PC_UP ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
string(REGEX REPLACE "/$" "" BTFC_PC_UP "${BTFC_PC_UP}")
configure_file(btfc.pc.in ${CMAKE_CURRENT_BINARY_DIR}/btfc.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/btfc.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
