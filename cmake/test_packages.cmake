# What tests need from npm.

# vog_test_packages(NAME): what test/NAME/package-lock.json names, fetched into NAME/node_modules of the
# build.
function(vog_test_packages name)
  set(source ${PROJECT_SOURCE_DIR}/test/${name})
  set(out ${PROJECT_BINARY_DIR}/${name})
  set(manifests ${source}/package.json ${source}/package-lock.json ${source}/.npmrc)
  vog_wants_test(OFF wanted)
  if(wanted AND NOT VOG_SANITIZE)
    add_custom_command(OUTPUT ${out}/installed DEPENDS ${manifests}
      COMMAND ${CMAKE_COMMAND} -E make_directory ${out}
      COMMAND ${CMAKE_COMMAND} -E copy ${manifests} ${out}
      COMMAND ${NPM} ci --loglevel=error --prefix ${out}
      COMMAND ${CMAKE_COMMAND} -E touch ${out}/installed
      COMMENT "npm ci: packages of test ${name}" VERBATIM)
    add_custom_target(${name}_packages ALL DEPENDS ${out}/installed)
  endif()
endfunction()
