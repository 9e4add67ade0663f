# How Protobuf messages become a library.

# vog_protos(NAME FOLDER): all FOLDER/PACKAGE/FILE.proto become headers PACKAGE/FILE.pb.h of library
# NAME. So do the LCM types of package vog, as vogmap/messages.pb.h, with vogmap/to_proto.h, which
# turns the ones into the others.
function(vog_protos name folder)
  set(root ${PROJECT_SOURCE_DIR}/${folder})
  set(out ${PROJECT_BINARY_DIR}/proto)
  set(generator ${PROJECT_SOURCE_DIR}/cmake/lcm_to_proto.py)
  file(GLOB types CONFIGURE_DEPENDS lcmtypes/*.lcm)
  add_custom_command(OUTPUT ${out}/vogmap/messages.proto ${out}/vogmap/to_proto.h
    DEPENDS ${types} ${generator}
    COMMAND ${Python3_EXECUTABLE} ${generator} ${types} ${out})
  file(GLOB protos RELATIVE ${root} CONFIGURE_DEPENDS ${root}/*/*.proto)
  set(sources ${out}/vogmap/to_proto.h)
  list(TRANSFORM protos PREPEND ${root}/ OUTPUT_VARIABLE inputs)
  foreach(proto ${protos} vogmap/messages.proto)
    if(proto STREQUAL vogmap/messages.proto)
      set(inputs ${out}/${proto})  # Imports none.
    endif()
    string(REPLACE .proto .pb made ${out}/${proto})
    add_custom_command(OUTPUT ${made}.cc ${made}.h DEPENDS ${inputs}
      COMMAND protobuf::protoc -I ${root} -I ${out} --cpp_out=${out} ${proto})
    list(APPEND sources ${made}.cc ${made}.h)
  endforeach()
  add_library(${name} STATIC ${sources})
  # protoc's code is protoc's affair: no warnings, no sanitizers.
  target_link_libraries(${name} PUBLIC protobuf::libprotobuf)
  target_compile_options(${name} PRIVATE -w)
  target_include_directories(${name} SYSTEM PUBLIC ${out})
endfunction()
