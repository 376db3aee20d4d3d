# SPDX-License-Identifier: Apache-2.0
# Debian packages of what `cmake --install` installs, by cpack; tools/package makes them. One component a package.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME tendril)
set(CPACK_PACKAGE_VENDOR "Tendril")
set(CPACK_PACKAGE_CONTACT "The Tendril authors <maintainers@tendril.invalid>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL tendril python doc)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)

# tools/package fills in the date.
configure_file(${CMAKE_SOURCE_DIR}/config/packages/changelog.Debian.in ${CMAKE_BINARY_DIR}/packages/changelog.Debian @ONLY)

macro(tendril_package component name section)
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${name})
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section})
  install(FILES ${CMAKE_SOURCE_DIR}/config/packages/copyright DESTINATION share/doc/${name} COMPONENT ${component})
  install(FILES ${CMAKE_BINARY_DIR}/packages/changelog.gz ${CMAKE_BINARY_DIR}/packages/changelog.Debian.gz
          DESTINATION share/doc/${name} COMPONENT ${component} OPTIONAL)
endmacro()

tendril_package(tendril tendril science)
set(CPACK_COMPONENT_TENDRIL_DESCRIPTION
"A daemon that controls soft robots, pulled by cables or pushed by air. It
sends set-points to servo drives over CAN. With a simulated robot, the
operator's tool, a page in the browser, and robots to start from:
tendril-demo shows it at work.")
set(CPACK_DEBIAN_TENDRIL_PACKAGE_DEPENDS "systemd | systemd-standalone-sysusers | opensysusers")
set(CPACK_DEBIAN_TENDRIL_PACKAGE_RECOMMENDS "python3, python3-numpy, python3-matplotlib, iproute2")
set(CPACK_DEBIAN_TENDRIL_PACKAGE_SUGGESTS "python3-tendril, tendril-doc, can-utils, stress-ng")
set(CPACK_DEBIAN_TENDRIL_PACKAGE_CONTROL_EXTRA
    ${CMAKE_SOURCE_DIR}/config/packages/postinst ${CMAKE_SOURCE_DIR}/config/packages/postrm)

tendril_package(python python3-tendril python)
set(CPACK_COMPONENT_PYTHON_DESCRIPTION
"The Python client. It watches and moves a robot that tendrild runs, over its
control socket. With examples: a circle, the keyboard, a joystick, a live
plot, a bridge to ROS 2.")
set(CPACK_DEBIAN_PYTHON_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3")
set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "python3-matplotlib")
set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS OFF)

tendril_package(doc tendril-doc doc)
set(CPACK_COMPONENT_DOC_DESCRIPTION
"The documentation, from the first run without hardware to a robot of your
own: robot files, drives, CAN, real time, feedback, and how model and solver
work.")
set(CPACK_DEBIAN_DOC_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_DOC_PACKAGE_SHLIBDEPS OFF)
install(FILES ${CMAKE_SOURCE_DIR}/README.md ${CMAKE_SOURCE_DIR}/CONTRIBUTING.md DESTINATION share/doc/tendril-doc COMPONENT doc)
install(DIRECTORY ${CMAKE_SOURCE_DIR}/docs DESTINATION share/doc/tendril-doc COMPONENT doc)

include(CPack)
