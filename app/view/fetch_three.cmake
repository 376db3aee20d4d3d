# SPDX-License-Identifier: Apache-2.0
# Fetches three.js with npm and lays the modules that the page imports into a folder, as a browser can load them.
# cmake -DNPM=... -DPACKAGE=FOLDER -DOUT=FOLDER -P fetch_three.cmake
# Where there is no network it says so, and fails nothing: the page then has no 3D view, and the next build tries again.
file(COPY ${PACKAGE}/package.json ${PACKAGE}/package-lock.json DESTINATION ${OUT})
execute_process(COMMAND ${NPM} ci --ignore-scripts --no-audit --no-fund --fetch-retries=1
                WORKING_DIRECTORY ${OUT} RESULT_VARIABLE failed OUTPUT_FILE ${OUT}/npm.log ERROR_FILE ${OUT}/npm.log)
if(failed)
  message("tendril-view: npm could not fetch three.js (is there a network?), so the page has no 3D view; log: ${OUT}/npm.log")
  return()
endif()
set(package ${OUT}/node_modules/three)
foreach(file build/three.core.js build/three.module.js examples/jsm/controls/OrbitControls.js)
  get_filename_component(name ${file} NAME)
  configure_file(${package}/${file} ${OUT}/${name} COPYONLY)
endforeach()
# The bare name of a package means nothing to a browser.
file(READ ${OUT}/OrbitControls.js text)
string(REPLACE "from 'three'" "from './three.module.js'" text "${text}")
file(WRITE ${OUT}/OrbitControls.js "${text}")
file(COPY ${package}/LICENSE DESTINATION ${OUT})
file(REMOVE_RECURSE ${OUT}/node_modules)
file(TOUCH ${OUT}/stamp)
