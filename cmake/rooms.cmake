# How a folder becomes a library, its tests, its benchmarks and its program.

add_library(vog_flags INTERFACE)
target_include_directories(vog_flags INTERFACE
  $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/vogmap>)
target_compile_features(vog_flags INTERFACE cxx_std_20)
# Contracted multiply-adds would make results depend on the instructions a compiler picks.
target_compile_options(vog_flags INTERFACE
  "$<BUILD_INTERFACE:-Wall;-Wextra;-Wpedantic>" -ffp-contract=off
  "$<BUILD_INTERFACE:$<$<BOOL:${VOG_WERROR}>:-Werror>>")
target_compile_definitions(vog_flags INTERFACE $<BUILD_INTERFACE:VOG_VERSION="${PROJECT_VERSION}">)
if(VOG_SANITIZE)
  target_compile_options(vog_flags INTERFACE -fsanitize=${VOG_SANITIZE} -fno-omit-frame-pointer
                         -fno-sanitize-recover=all)
  target_link_options(vog_flags INTERFACE -fsanitize=${VOG_SANITIZE})
  # These four checks double the time to compile Eigen; AddressSanitizer finds what null finds.
  if(VOG_SANITIZE MATCHES undefined)
    target_compile_options(vog_flags INTERFACE -fno-sanitize=null,object-size,vptr,alignment)
  endif()
  # Debian's Ceres gets memory from malloc; under AddressSanitizer Eigen would free it its own way.
  target_compile_definitions(vog_flags INTERFACE EIGEN_MALLOC_ALREADY_ALIGNED=1)
endif()

# Sanitized builds read the large headers once. Release builds do not, so that each file shows that it
# includes what it uses.
if(VOG_SANITIZE)
  file(WRITE ${PROJECT_BINARY_DIR}/pch.cc "")
  add_library(vog_pch STATIC ${PROJECT_BINARY_DIR}/pch.cc)
  target_link_libraries(vog_pch vog_flags Eigen3::Eigen)
  target_precompile_headers(vog_pch PRIVATE <Eigen/Dense> <functional> <map>
                            <memory> <optional> <random> <string> <vector>)
endif()
function(vog_use_pch target)
  if(VOG_SANITIZE)
    target_precompile_headers(${target} REUSE_FROM vog_pch)
  endif()
endfunction()

set(vog_tsan_options "TSAN_OPTIONS=suppressions=${PROJECT_SOURCE_DIR}/cmake/tsan_suppressions.txt")

# All programs, without tests.
add_custom_target(programs)

# vog_lcmtypes(NAME): every FILE.lcm of lcmtypes/ becomes a header vog/FILE.hpp of library NAME, every
# PACKAGE/FILE.lcm, which is others', a header PACKAGE/FILE.hpp.
function(vog_lcmtypes name)
  file(GLOB sources CONFIGURE_DEPENDS lcmtypes/*.lcm lcmtypes/*/*.lcm)
  foreach(source ${sources})
    get_filename_component(type ${source} NAME_WE)
    get_filename_component(folder ${source} DIRECTORY)
    get_filename_component(package ${folder} NAME)
    string(REPLACE lcmtypes vog package ${package})
    set(header ${PROJECT_BINARY_DIR}/lcmtypes/${package}/${type}.hpp)
    set(check_lengths ${PROJECT_SOURCE_DIR}/cmake/check_lengths.sed)
    add_custom_command(OUTPUT ${header} DEPENDS ${source} ${check_lengths}
      COMMAND lcm-gen --cpp --cpp-hpath ${PROJECT_BINARY_DIR}/lcmtypes ${source}
      COMMAND sed -E -i -f ${check_lengths} ${header})
    list(APPEND headers ${header})
  endforeach()
  add_custom_target(${name}_headers DEPENDS ${headers})
  add_library(${name} INTERFACE)
  add_dependencies(${name} ${name}_headers)
  target_include_directories(${name} SYSTEM INTERFACE ${PROJECT_BINARY_DIR}/lcmtypes)
  # The same for scripts.
  add_custom_command(OUTPUT ${PROJECT_BINARY_DIR}/python/vog/__init__.py DEPENDS ${sources}
    COMMAND ${CMAKE_COMMAND} -E rm -rf ${PROJECT_BINARY_DIR}/python
    COMMAND lcm-gen --python --ppath ${PROJECT_BINARY_DIR}/python ${sources})
  add_custom_target(${name}_python ALL DEPENDS ${PROJECT_BINARY_DIR}/python/vog/__init__.py)
  install(DIRECTORY ${PROJECT_BINARY_DIR}/python DESTINATION ${CMAKE_INSTALL_DATADIR}/vogmap
          FILES_MATCHING PATTERN "*.py")
  # LCM encodes doubles through pointers to integers: an optimiser may drop what was stored in them.
  target_compile_options(${name} INTERFACE -fno-strict-aliasing)
endfunction()

# vog_dbc(NAME FILE): the messages of a CAN database become a header dbc/NAME.h of library NAME.
function(vog_dbc name source)
  set(header ${PROJECT_BINARY_DIR}/dbc/${name}.h)
  set(generator ${PROJECT_SOURCE_DIR}/cmake/dbc_to_cpp.py)
  add_custom_command(OUTPUT ${header} DEPENDS ${source} ${generator}
    COMMAND ${Python3_EXECUTABLE} ${generator} ${PROJECT_SOURCE_DIR}/${source} ${header})
  add_custom_target(${name}_header DEPENDS ${header})
  add_library(${name} INTERFACE)
  add_dependencies(${name} ${name}_header)
  target_include_directories(${name} INTERFACE ${PROJECT_BINARY_DIR})
endfunction()

# vog_npm_ci(SOURCE OUT WHAT): what SOURCE/package-lock.json names, fetched into OUT/node_modules; OUT/installed
# is its file.
function(vog_npm_ci source out what)
  set(manifests ${source}/package.json ${source}/package-lock.json ${source}/.npmrc)
  add_custom_command(OUTPUT ${out}/installed DEPENDS ${manifests}
    COMMAND ${CMAKE_COMMAND} -E make_directory ${out}
    COMMAND ${CMAKE_COMMAND} -E copy ${manifests} ${out}
    COMMAND ${NPM} ci --loglevel=error --prefix ${out}
    COMMAND ${CMAKE_COMMAND} -E touch ${out}/installed
    COMMENT "npm ci: ${what}" VERBATIM)
endfunction()

# vog_web_page(NAME FOLDER): the page whose sources lie in FOLDER, bundled by esbuild with what npm has
# for it (package-lock.json), becomes the function EmbeddedPages() of library NAME.
function(vog_web_page name folder)
  set(source ${PROJECT_SOURCE_DIR}/${folder})
  set(out ${PROJECT_BINARY_DIR}/web)
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${source}/src/*)
  vog_npm_ci(${source} ${out} "three.js, uPlot, esbuild")
  add_custom_command(OUTPUT ${out}/page/app.js ${out}/page/app.css DEPENDS ${out}/installed ${sources}
    COMMAND ${CMAKE_COMMAND} -E env NODE_PATH=${out}/node_modules
            ${out}/node_modules/.bin/esbuild ${source}/src/app.js --bundle --minify --format=esm
            --target=es2022 --legal-comments=eof --log-level=warning --outdir=${out}/page
    COMMENT "Bundling the page" VERBATIM)
  set(generator ${PROJECT_SOURCE_DIR}/cmake/embed_files.py)
  set(pages ${source}/src/index.html ${source}/src/icon.svg ${out}/page/app.js ${out}/page/app.css)
  add_custom_command(OUTPUT ${out}/pages.cc DEPENDS ${pages} ${generator}
    COMMAND ${Python3_EXECUTABLE} ${generator} ${out}/pages.cc ${pages})
  add_library(${name} STATIC ${out}/pages.cc)
  target_link_libraries(${name} PRIVATE vog_flags)
  target_compile_options(${name} PRIVATE -Wno-overlength-strings)
endfunction()

# Whether a test is built: ThreadSanitizer, which slows everything ten times, finds nothing where one
# thread runs, so it has the tests marked THREADS alone.
function(vog_wants_test has_threads result)
  set(wanted ${BUILD_TESTING})
  if(VOG_SANITIZE STREQUAL thread AND NOT ${has_threads})
    set(wanted OFF)
  endif()
  set(${result} ${wanted} PARENT_SCOPE)
endfunction()

# vog_room(FOLDER [THREADS] DEPS ... [TEST_DEPS ...] [PROGRAM NAME]): the sources of FOLDER become a library
# named after the last part of its path, its *_test.cc one test program, each *_benchmark.cc a
# benchmark, and main.cc the program NAME.
function(vog_room folder)
  cmake_parse_arguments(ARG "THREADS" "PROGRAM" "DEPS;TEST_DEPS" ${ARGN})
  vog_wants_test(ARG_THREADS wanted)
  get_filename_component(name ${folder} NAME)
  if(folder MATCHES "^procs/")
    set(name ${name}_node)
  elseif(folder MATCHES "^tools/")
    set(name ${name}_tool)
  endif()
  file(GLOB sources CONFIGURE_DEPENDS ${folder}/*.cc)
  set(tests ${sources})
  set(benchmarks ${sources})
  list(FILTER tests INCLUDE REGEX "_test\\.cc$")
  list(FILTER benchmarks INCLUDE REGEX "_benchmark\\.cc$")
  list(FILTER sources EXCLUDE REGEX "(_test|_benchmark|/main)\\.cc$")
  if(sources)
    add_library(${name} STATIC ${sources})
    target_link_libraries(${name} PUBLIC ${ARG_DEPS} vog_flags)
    vog_use_pch(${name})
  else()
    add_library(${name} INTERFACE)
    target_link_libraries(${name} INTERFACE ${ARG_DEPS} vog_flags)
  endif()
  if(tests AND wanted)
    add_executable(${name}_test ${tests})
    target_link_libraries(${name}_test ${name} ${ARG_TEST_DEPS} GTest::gtest_main)
    vog_use_pch(${name}_test)
    target_compile_definitions(${name}_test PRIVATE VOG_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
    add_test(NAME ${name} COMMAND ${name}_test)
    set_tests_properties(${name} PROPERTIES ENVIRONMENT "${vog_tsan_options}")
  endif()
  foreach(benchmark ${benchmarks})
    get_filename_component(program ${benchmark} NAME_WE)
    add_executable(${program} EXCLUDE_FROM_ALL ${benchmark})
    target_link_libraries(${program} ${name} benchmark::benchmark_main)
  endforeach()
  if(ARG_PROGRAM)
    add_executable(${ARG_PROGRAM} ${folder}/main.cc)
    target_link_libraries(${ARG_PROGRAM} ${name})
    add_dependencies(programs ${ARG_PROGRAM})
    install(TARGETS ${ARG_PROGRAM} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  endif()
endfunction()

# vog_system_test(NAME [THREADS] [RELEASE]): test/NAME_test.py, which runs the programs. RELEASE: in
# release builds alone, because sanitizers would find nothing there that they do not find elsewhere.
function(vog_system_test name)
  cmake_parse_arguments(ARG "THREADS;RELEASE" "" "" ${ARGN})
  vog_wants_test(ARG_THREADS wanted)
  if(ARG_RELEASE AND VOG_SANITIZE)
    set(wanted OFF)
  endif()
  if(wanted)
    add_test(NAME ${name} COMMAND python3 ${PROJECT_SOURCE_DIR}/test/${name}_test.py)
    set_tests_properties(${name} PROPERTIES TIMEOUT 2400 ENVIRONMENT
      "VOG_BIN=${CMAKE_RUNTIME_OUTPUT_DIRECTORY};VOG_BUILD=${CMAKE_BINARY_DIR};VOG_SANITIZE=${VOG_SANITIZE};${vog_tsan_options}")
  endif()
endfunction()

# vog_test_packages(NAME): what test/NAME/package-lock.json names, fetched into NAME/node_modules of the
# build.
function(vog_test_packages name)
  vog_wants_test(OFF wanted)
  if(wanted AND NOT VOG_SANITIZE)
    vog_npm_ci(${PROJECT_SOURCE_DIR}/test/${name} ${PROJECT_BINARY_DIR}/${name} "packages of test ${name}")
    add_custom_target(${name}_packages ALL DEPENDS ${PROJECT_BINARY_DIR}/${name}/installed)
  endif()
endfunction()
