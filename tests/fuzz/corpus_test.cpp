#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/fuzz/fuzzed.h"

namespace tendril::fem::fuzz {

namespace fs = std::filesystem;

TEST_CASE("Every file of the fuzzers' corpora is read or refused", "[unit]") {
  // Those that end in their format hold a sound mesh, but for this one.
  const std::string damaged = "no_cells.vtu";
  for (const std::string format : {"msh", "vtu", "vtk"}) {
    int files = 0;
    for (const auto& entry :
         fs::directory_iterator(fs::path(TENDRIL_SOURCE_DIR) / "tests/fuzz/corpus" / format)) {
      CAPTURE(entry.path().string());
      std::ostringstream text;
      text << std::ifstream(entry.path(), std::ios::binary).rdbuf();
      const bool is_sound = entry.path().extension() == "." + format && entry.path().filename() != damaged;
      bool taken = false;
      REQUIRE_NOTHROW(taken = read_or_refuse(format, text.str()));
      if (is_sound) CHECK(taken);
      ++files;
    }
    CHECK(files >= 4);
  }
}

}  // namespace tendril::fem::fuzz
