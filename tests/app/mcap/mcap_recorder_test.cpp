// SPDX-License-Identifier: Apache-2.0
#include "app/mcap/mcap_recorder.h"

#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <condition_variable>
#include <mutex>
#include <random>
#include <string>
#include <utility>

#include "tests/app/mcap/mcap_bytes.h"
#include "tests/patience.h"

namespace tendril::app::mcap_recorder_test {

using testing::comes_true;

/// A disk that a test holds up, fills and looks at.
struct Disk {
  std::mutex mutex;
  std::condition_variable changed;
  bool hangs = false, full = false;
  std::vector<std::string> files;

  void set(bool& what, bool value) {
    const std::lock_guard lock(mutex);
    what = value;
    changed.notify_all();
  }
  std::string messages() {
    const std::lock_guard lock(mutex);
    std::string all;
    for (const std::string& file : files) all += text_of_messages(file);
    return all;
  }
};

class Files : public LogTarget {
 public:
  explicit Files(std::shared_ptr<Disk> disk) : disk_(std::move(disk)) { disk_->files.emplace_back(); }
  bool next() override {
    const std::lock_guard lock(disk_->mutex);
    disk_->files.emplace_back();
    return true;
  }
  bool append(std::string_view bytes) override {
    std::unique_lock lock(disk_->mutex);
    disk_->changed.wait(lock, [this] { return !disk_->hangs; });
    if (!disk_->full) disk_->files.back() += bytes;
    return !disk_->full;
  }
  std::string error() const override { return "no space"; }

 private:
  std::shared_ptr<Disk> disk_;
};

const McapContent kContent{"a program", {}, {{"/numbers", "json", 0}}, {}};
constexpr auto kSoon = std::chrono::milliseconds(10);

struct Bench {
  explicit Bench(const McapRecorder::Limits& limits)
      : recorder(std::make_unique<Files>(disk), kContent, limits) {}
  bool record(const std::string& data) {
    ++time;
    return recorder.record(0, time, time, data);
  }
  bool written(uint64_t messages) {
    return comes_true([&] { return recorder.counts().written == messages; });
  }

  std::shared_ptr<Disk> disk = std::make_shared<Disk>();
  int64_t time = 0;
  McapRecorder recorder;
};

TEST_CASE("What is recorded is written soon, without waiting for the end", "[unit]") {
  Bench bench({.file_bytes = 1'000'000, .interval = kSoon});
  CHECK(bench.record("first"));
  CHECK(bench.written(1));
  CHECK(bench.disk->messages().find("first") != std::string::npos);
  CHECK(bench.record("second"));
  CHECK(bench.recorder.close());
  CHECK(bench.disk->messages().find("second") != std::string::npos);
  CHECK(bench.disk->files.back().ends_with(kMcapMagic));
  CHECK_FALSE(bench.record("after the end"));
}

TEST_CASE("A disk that hangs holds up nobody: the queue fills, and what it cannot take is counted",
          "[unit]") {
  Bench bench({.file_bytes = 1'000'000, .queue_bytes = 10'000, .interval = kSoon});
  REQUIRE(bench.record("one"));
  REQUIRE(bench.written(1));
  bench.disk->set(bench.disk->hangs, true);
  const std::string data(1'000, 'x');
  uint64_t taken = 0, refused = 0;
  for (int k = 0; k < 100; ++k) ++(bench.record(data) ? taken : refused);
  CHECK(taken >= 9);
  CHECK(refused >= 70);
  CHECK(bench.recorder.counts().dropped == refused);
  bench.disk->set(bench.disk->hangs, false);
  CHECK(bench.written(1 + taken));
  CHECK(bench.record("again"));
  CHECK_FALSE(bench.recorder.close());  // since something is missing
  CHECK(bench.recorder.counts().dropped == refused);
  CHECK(bench.disk->messages().find("again") != std::string::npos);
}

TEST_CASE("A disk that hangs for ever does not hold up the end", "[unit]") {
  const auto disk = std::make_shared<Disk>();
  disk->hangs = true;
  {
    McapRecorder recorder(std::make_unique<Files>(disk), kContent,
                          {.file_bytes = 1'000'000, .interval = kSoon});
    recorder.record(0, 1, 1, "lost");
    CHECK_FALSE(recorder.close(std::chrono::milliseconds(50)));
  }
  disk->set(disk->hangs, false);  // the thread, left alone, ends
  CHECK(comes_true([&] { return disk.use_count() == 1; }));
}

TEST_CASE("A full disk loses what it cannot take, and the log goes on once there is room", "[unit]") {
  Bench bench({.file_bytes = 1'000'000, .interval = kSoon});
  REQUIRE(bench.record("one"));
  REQUIRE(bench.written(1));
  bench.disk->set(bench.disk->full, true);
  REQUIRE(bench.record("lost"));
  REQUIRE(comes_true([&] { return bench.recorder.counts().dropped == 1; }));
  CHECK(bench.recorder.counts().error == "no space");
  bench.disk->set(bench.disk->full, false);
  REQUIRE(bench.record("three"));
  REQUIRE(bench.written(2));
  CHECK(bench.recorder.counts().error.empty());
  bench.recorder.close();
  CHECK(bench.disk->messages().find("lost") == std::string::npos);
  CHECK(bench.disk->messages().find("three") != std::string::npos);
}

TEST_CASE("A file that is full is ended, and the next one begins with all that a file begins with",
          "[unit]") {
  Bench bench({.file_bytes = 20'000, .interval = kSoon});
  std::mt19937 chance;  // from its usual seed
  for (uint64_t k = 0; k < 40; ++k) {
    std::string noise(1'000, ' ');  // that compresses to no less
    for (char& byte : noise) byte = static_cast<char>(chance());
    REQUIRE(bench.record(noise));
    REQUIRE(bench.written(k + 1));
  }
  CHECK(bench.recorder.close());
  REQUIRE(bench.disk->files.size() >= 3);
  uint64_t bytes = 0;
  for (const std::string& file : bench.disk->files) {
    CHECK(file.size() <= 20'000);
    CHECK(file.starts_with(kMcapMagic));
    CHECK(file.ends_with(kMcapMagic));
    CHECK(file.find("/numbers") != std::string::npos);
    bytes += file.size();
  }
  CHECK(bench.recorder.counts().bytes == bytes);
}

}  // namespace tendril::app::mcap_recorder_test
