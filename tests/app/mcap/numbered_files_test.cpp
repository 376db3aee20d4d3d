// SPDX-License-Identifier: Apache-2.0
#include "app/mcap/numbered_files.h"

#include <catch2/catch.hpp>
#include <fstream>
#include <sstream>

#include "tests/own_folder.h"

namespace tendril::app::numbered_files_test {

namespace fs = std::filesystem;

std::string text_of(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

struct Folder {
  testing::OwnFolder folder;
  fs::path file = folder / "robot.mcap";
  std::string older(int number) const {
    return text_of(folder / ("robot." + std::to_string(number) + ".mcap"));
  }
};

TEST_CASE("The present file keeps its name, older ones get higher numbers, those of earlier runs too",
          "[unit]") {
  Folder bench;
  for (const char* text : {"first", "second", "third"}) {
    NumberedFiles files(bench.file, 1'000'000);
    REQUIRE(files.append(text));
  }
  CHECK(text_of(bench.file) == "third");
  CHECK(bench.older(1) == "second");
  CHECK(bench.older(2) == "first");
}

TEST_CASE("All files together keep within the total: the oldest go first", "[unit]") {
  Folder bench;
  constexpr uint64_t kTotal = 80'000, kFile = kTotal / NumberedFiles::kFiles;
  NumberedFiles files(bench.file, kTotal);
  for (int k = 0; k < 30; ++k) {
    if (k > 0) REQUIRE(files.next());
    REQUIRE(files.append(std::string(kFile, static_cast<char>('a' + k))));
    uint64_t sum = 0;
    for (const auto& entry : fs::directory_iterator(bench.file.parent_path())) sum += entry.file_size();
    CHECK(sum <= kTotal);
  }
  CHECK(bench.older(7) == std::string(kFile, 'a' + 29 - 7));
  CHECK(bench.older(8).empty());
}

TEST_CASE("Short files are kept as long as they have room together", "[unit]") {
  Folder bench;
  for (int k = 0; k < 20; ++k) REQUIRE(NumberedFiles(bench.file, 1'000'000).append("short"));
  CHECK(bench.older(19) == "short");
}

TEST_CASE("A file in which nothing was written makes no older one go", "[unit]") {
  Folder bench;
  REQUIRE(NumberedFiles(bench.file, 1'000'000).append("kept"));
  for (int k = 0; k < 3; ++k) NumberedFiles(bench.file, 1'000'000).next();
  CHECK(bench.older(1) == "kept");
  CHECK(bench.older(2).empty());
}

TEST_CASE("Where no log can be written it is refused with what to do", "[unit]") {
  Folder bench;
  const auto refusal = [](const fs::path& file) -> std::string {
    try {
      const NumberedFiles files(file, 1'000'000);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  CHECK_THAT(refusal(bench.folder / "nowhere" / "x.mcap"),
             Catch::Contains("nowhere/x.mcap: No such file") && Catch::Contains("--log"));
  CHECK_THAT(refusal(bench.file.parent_path()), Catch::Contains("is no file"));
  CHECK_THAT(refusal("/dev/full"), Catch::Contains("is no file"));
}

}  // namespace tendril::app::numbered_files_test
