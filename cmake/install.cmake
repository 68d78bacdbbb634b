# What `cmake --install` puts where: the component `program` (the command, its modules) and `development` (headers,
# static libraries, and the package `lucerna` for other projects' find_package(); docs/howto/cpp.md).
include(CMakePackageConfigHelpers)

install(TARGETS lucerna RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
if(loaded_modules)
    install(TARGETS ${loaded_modules} LIBRARY DESTINATION ${LUCERNA_MODULES} COMPONENT program)
endif()

# The program makes this from its own tables of options.
set(manual ${PROJECT_BINARY_DIR}/lucerna.1)
set(completion ${PROJECT_BINARY_DIR}/lucerna.bash)
add_custom_command(TARGET lucerna POST_BUILD
    COMMAND lucerna --manual > ${manual}
    COMMAND lucerna --bash-completion > ${completion})
install(FILES ${manual} DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program)
install(FILES ${completion} DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME lucerna COMPONENT program)

# All modules at once.
get_property(modules GLOBAL PROPERTY LUCERNA_LIBRARIES)
list(TRANSFORM modules PREPEND lucerna_)
add_library(lucerna_all INTERFACE)
add_library(lucerna::lucerna ALIAS lucerna_all)
set_target_properties(lucerna_all PROPERTIES EXPORT_NAME lucerna)
target_link_libraries(lucerna_all INTERFACE ${modules})

# Outside programs find the loaded modules as the project's programs do: by their RUNPATH.
target_link_options(lucerna_base INTERFACE
    "$<INSTALL_INTERFACE:LINKER:-rpath,$<INSTALL_PREFIX>/${LUCERNA_MODULES}>")

install(TARGETS lucerna_all ${modules} EXPORT lucernaTargets
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
    FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/lucerna COMPONENT development)
if(NOT LUCERNA_SANITIZE)  # which keeps books of the data of each file
    set(archives "")
    foreach(module ${modules})
        string(APPEND archives " \$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_LIBDIR}/lib${module}.a")
    endforeach()
    install(CODE "execute_process(COMMAND_ERROR_IS_FATAL ANY COMMAND bash ${CMAKE_CURRENT_LIST_DIR}/close_libraries.sh
        ${CMAKE_LINKER} ${CMAKE_OBJCOPY} ${CMAKE_NM} ${CMAKE_AR}${archives})" COMPONENT development)
endif()
set(package ${CMAKE_INSTALL_LIBDIR}/cmake/lucerna)
install(EXPORT lucernaTargets NAMESPACE lucerna:: DESTINATION ${package} COMPONENT development)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/lucernaConfig.cmake.in
    ${PROJECT_BINARY_DIR}/package/lucernaConfig.cmake INSTALL_DESTINATION ${package})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/package/lucernaConfigVersion.cmake
    COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/package/lucernaConfig.cmake ${PROJECT_BINARY_DIR}/package/lucernaConfigVersion.cmake
    DESTINATION ${package} COMPONENT development)
