// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "tests/fuzz/inputs.h"

namespace tendril::fuzz {

namespace fs = std::filesystem;

/// One kind of input.
struct Input {
  const char* name;       // of its folder in corpus
  const char* extension;  // of those files in it that are sound
  bool (*feed)(const std::string& bytes);
};

const Input kInputs[] = {{"msh", ".msh", feed_msh},
                         {"vtu", ".vtu", feed_vtu},
                         {"vtk", ".vtk", feed_vtk},
                         {"robot_file", ".yaml", feed_robot_file},
                         {"plant_fault", ".txt", feed_plant_fault},
                         {"trajectory", ".csv", feed_trajectory},
                         {"jog_options", ".txt", feed_jog_options},
                         {"request", ".json", feed_request},
                         {"lines", ".steps", feed_lines},
                         {"local_bus", ".steps", feed_local_bus},
                         {"canopen_frame", ".steps", feed_canopen_frame},
                         {"sdo", ".steps", feed_sdo},
                         {"cia402_bus", ".steps", feed_cia402_bus},
                         {"odrive_bus", ".steps", feed_odrive_bus}};

const fs::path kCorpora = fs::path(TENDRIL_SOURCE_DIR) / "tests/fuzz/corpus";

TEST_CASE("Every file of the fuzzers' corpora is taken or refused", "[unit]") {
  for (const Input& input : kInputs) {
    int files = 0, sound = 0;
    for (const auto& entry : fs::directory_iterator(kCorpora / input.name)) {
      CAPTURE(entry.path().string());
      std::ostringstream bytes;
      bytes << std::ifstream(entry.path(), std::ios::binary).rdbuf();
      bool taken = false;
      REQUIRE_NOTHROW(taken = input.feed(bytes.str()));
      const bool is_sound = entry.path().extension() == input.extension;
      if (is_sound) CHECK(taken);
      sound += is_sound;
      ++files;
    }
    CAPTURE(input.name);
    CHECK(sound >= 1);
  }
}

TEST_CASE("Every corpus is that of an input", "[unit]") {
  std::set<std::string> names, folders;
  for (const Input& input : kInputs) names.insert(input.name);
  for (const auto& entry : fs::directory_iterator(kCorpora)) folders.insert(entry.path().filename());
  CHECK(folders == names);
}

}  // namespace tendril::fuzz
