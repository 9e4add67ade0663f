# cpack --config build/CPackConfig.cmake makes a Debian package of what `cmake --install` installs.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "the Vogmap authors <vogmap@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY ${PROJECT_DESCRIPTION})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
# What the programs are linked with, with versions; what they call or the headers include, by name.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "gnuplot-nox, iproute2")
set(CPACK_DEBIAN_PACKAGE_SUGGESTS
    "liblcm-bin, can-utils, libeigen3-dev, liboctomap-dev, libtomlplusplus-dev, zlib1g-dev")
include(CPack)
