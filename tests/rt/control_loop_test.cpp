// SPDX-License-Identifier: Apache-2.0
#include "rt/control_loop.h"

#include <sys/mman.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <limits>
#include <memory>
#include <thread>
#include <vector>

#include "hal/bus/virtual_bus.h"
#include "rt/heap_guard.h"
#include "tests/rt/one_cable.h"

namespace tendril::rt::control_loop_test {

using testing::kMillisecond;

constexpr int kWastedPages = 1000;

/// Drives that are known and enabled as soon as they are asked, and that answer with what they were told.
class ObedientDrives final : public hal::DriveMaster {
 public:
  std::vector<uint32_t> identifiers() const override { return {0x181}; }
  void receive(const hal::Frame&, int64_t arrival_ns) noexcept override {
    ++received;
    last_arrival_ns = arrival_ns;
  }
  const hal::Measurement& measure(hal::BusHealth, int64_t now_ns) noexcept override {
    measurement_.stamp_ns = now_ns;
    measured_ns = rt::now_ns();
    measurement_.axes = 1;
    measurement_.all_known = true;
    return measurement_;
  }
  void command(const hal::Command& command, int64_t, hal::FrameBatch& out) noexcept override {
    const int64_t began_ns = rt::now_ns();
    out.push({.id = 0x201, .length = 6});
    out.push({.id = 0x080});
    measurement_.all_enabled = command.enable;
    measurement_.all_disabled = measurement_.finished = !command.enable;
    if (command.enable) measurement_.displacement = command.displacement;
    if (++commands_ == 100) std::this_thread::sleep_for(stall);
    if (commands_ == waste_at) waste();
    if (stages != nullptr && stages->size() < stages->capacity())
      stages->push_back({measured_ns, began_ns, rt::now_ns()});
  }
  std::string describe(const hal::DriveFault&) const override { return {}; }

  /// Instants of a cycle that lie in its reading, and in its writing.
  struct Stages {
    int64_t read_ns, write_ns, written_ns;
  };
  std::vector<Stages>* stages =
      nullptr;  ///< receives those of the first cycles, as many as there is room for
  int64_t measured_ns = 0;
  int received = 0;
  int64_t last_arrival_ns = 0;
  std::chrono::milliseconds stall{0};  ///< how long the hundredth command takes
  int waste_at = 0;                    ///< the command that makes heap calls and page faults; 0: none

 private:
  /// A heap call, and the first touch of small pages, also where the kernel would give huge ones.
  void waste() {
    wasted_.assign(4096, 'x');
    const std::size_t bytes = kWastedPages * 4096;
    void* const pages = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (pages == MAP_FAILED) return;
    madvise(pages, bytes, MADV_NOHUGEPAGE);
    for (std::size_t at = 0; at < bytes; at += 4096) static_cast<volatile char*>(pages)[at] = 'x';
    munmap(pages, bytes);
  }

  int commands_ = 0;
  std::vector<char> wasted_;
  hal::Measurement measurement_;
};

/// On a loaded machine many cycles in a row may be late; here that is no reason to stop.
ControllerConfig patient() {
  ControllerConfig config = testing::one_cable();
  config.late_cycles_limit = std::numeric_limits<int>::max();
  config.snapshot_age_limit_ns = config.target_age_limit_ns = 3600 * 1000 * kMillisecond;
  return config;
}

struct Loop {
  Channels channels;
  hal::VirtualBus medium;
  hal::VirtualEndpoint& bus = medium.attach("controller");
  hal::VirtualEndpoint& peer = medium.attach("peer");
  ObedientDrives drives;
  Controller controller{patient()};
  ControlLoop loop{bus, drives, controller, channels};

  void publish(int64_t now_ns, double goal) {
    testing::fill_snapshot(channels.snapshots.back(), now_ns);
    channels.snapshots.publish();
    channels.targets.back() = testing::still(goal, now_ns);
    channels.targets.publish();
  }
};

TEST_CASE("A cycle reads what has arrived, writes its frames in order, feeds back and records", "[unit]") {
  const auto rig = std::make_unique<Loop>();
  int64_t now_ns = 1000 * kMillisecond;
  rig->medium.set_time(now_ns);
  rig->peer.send({.id = 0x181, .length = 6});
  rig->peer.send({.id = 0x181, .length = 6});
  for (int k = 0; k < 20; ++k) {
    now_ns += kMillisecond;
    rig->publish(now_ns, 0.005);
    rig->loop.cycle({now_ns, now_ns});
  }
  CHECK(rig->drives.received == 2);
  CHECK(rig->drives.last_arrival_ns == 1000 * kMillisecond);
  hal::Frame frame;
  REQUIRE(rig->peer.receive(frame));
  CHECK(frame.id == 0x201);
  REQUIRE(rig->peer.receive(frame));
  CHECK(frame.id == 0x080);

  rig->medium.set_time(now_ns);
  rig->peer.send({.id = 0x701, .length = 1});
  const TraceRecord& record = rig->loop.cycle({now_ns + kMillisecond, now_ns + kMillisecond});
  CHECK(record.bus_bits == 65 + 115 + 55);  // the heartbeat, a frame with 6 bytes, SYNC
  CHECK(record.phase == Phase::kRunning);
  CHECK(record.intended_ns == now_ns + kMillisecond);
  CHECK(record.snapshot_sequence > 0);
  CHECK(record.snapshot_age_ns == kMillisecond);
  CHECK(record.desired[0] == 0.005);
  CHECK(record.p_e[0] == Approx(0.005).margin(1e-9));
  const Feedback& feedback = rig->channels.feedback.latest();
  CHECK(feedback.efforts_known);
  CHECK(feedback.lambda[0] == Approx(0.005 / testing::kCoupling));
  CHECK(feedback.delta_a[0] == Approx(record.measured[0]));
}

TEST_CASE("Reading, solving and the cycle end after the work that they count, and before the next",
          "[unit]") {
  const auto rig = std::make_unique<Loop>();
  const auto counts = std::make_unique<LoopCounts>();
  constexpr std::size_t kCycles = 50;
  std::vector<ObedientDrives::Stages> stages;
  stages.reserve(kCycles);
  rig->drives.stages = &stages;
  PeriodicClock clock(500);
  std::thread control([&] { rig->loop.run(clock, *counts); });
  std::vector<TraceRecord> records;
  TraceRecord record;
  while (records.size() < kCycles + 1) {
    while (rig->channels.trace.pop(record)) records.push_back(record);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  rig->channels.requests.stop = true;
  control.join();
  REQUIRE(stages.size() == kCycles);
  for (std::size_t k = 0; k < kCycles; ++k) {
    CAPTURE(k);
    const TraceRecord& r = records[k];
    const int64_t woken_ns = r.intended_ns + r.wakeup_ns;
    const int64_t read_ns = woken_ns + r.read_ns, solved_ns = read_ns + r.solve_ns;
    CHECK(woken_ns >= r.intended_ns);
    CHECK(woken_ns <= stages[k].read_ns);
    CHECK(read_ns >= stages[k].read_ns);
    CHECK(solved_ns >= read_ns);
    CHECK(solved_ns <= stages[k].write_ns);
    CHECK(woken_ns + r.cycle_ns >= stages[k].written_ns);
    CHECK(woken_ns + r.cycle_ns <= records[k + 1].intended_ns + records[k + 1].wakeup_ns);
  }
}

TEST_CASE("The loop on the clock counts every deadline, traces every cycle and makes no heap call", "[rt]") {
  const auto rig = std::make_unique<Loop>();
  const auto counts = std::make_unique<LoopCounts>();
  rig->drives.stall = std::chrono::milliseconds(9);  // four periods and a half
  rig->publish(now_ns(), 0.005);
  PeriodicClock clock(500);
  std::thread control([&] { rig->loop.run(clock, *counts); });
  TraceRecord record;
  std::vector<TraceRecord> records;
  while (records.size() < 300) {
    rig->publish(now_ns(), 0.005 + 1e-5 * static_cast<double>(records.size() % 100));
    while (rig->channels.trace.pop(record)) records.push_back(record);
    std::this_thread::yield();
  }
  rig->channels.requests.stop = true;
  control.join();
  while (rig->channels.trace.pop(record)) records.push_back(record);

  CHECK(rig->channels.progress.ended);
  CHECK(records.back().phase == Phase::kStopped);
  int64_t missed = 0;
  bool stalled_writing = false;
  for (size_t k = 0; k < records.size(); ++k) {
    if (k > 0) {
      // On the grid, whatever the machine did meanwhile.
      const auto periods = static_cast<double>(records[k].intended_ns - records[k - 1].intended_ns) / 2e6;
      CHECK(periods == Approx(static_cast<double>(1 + records[k - 1].missed)).margin(1e-6));
    }
    missed += records[k].missed;
    CHECK(records[k].read_ns >= 0);
    CHECK(records[k].solve_ns > 0);  // no two readings of a clock around a QP are the same
    CHECK(records[k].read_ns + records[k].solve_ns <= records[k].cycle_ns);
    // The stall is in a command: it is the writing that has taken so long.
    stalled_writing |= records[k].cycle_ns - records[k].read_ns - records[k].solve_ns >= 9 * kMillisecond;
  }
  CHECK(stalled_writing);
  CHECK(rig->channels.trace.dropped() == 0);
  CHECK(missed >= 4);
  CHECK(counts->late_cycles == missed);
  CHECK(records.back().cycles == counts->cycles);
  CHECK(records.back().late_cycles == counts->late_cycles);
  CHECK(records.front().cycles == 1 + records.front().missed);
  CHECK(counts->cycles == static_cast<int64_t>(records.size()) + missed);
  CHECK(counts->success_rate() ==
        Approx(1 - static_cast<double>(missed) / static_cast<double>(counts->cycles)));
  CHECK(counts->wakeup.count() >= counts->cycles);
  if (HeapGuard::available())
    CHECK(counts->heap_calls == 0);
  else
    CHECK(counts->heap_calls == -1);
}

TEST_CASE("Heap calls and page faults of the loop show in the cycle that made them", "[rt]") {
  const auto rig = std::make_unique<Loop>();
  const auto counts = std::make_unique<LoopCounts>();
  rig->drives.waste_at = 50;
  rig->publish(now_ns(), 0.005);
  PeriodicClock clock(1000);
  std::thread control([&] { rig->loop.run(clock, *counts); });
  TraceRecord record;
  std::vector<TraceRecord> records;
  while (records.size() < 100) {
    while (rig->channels.trace.pop(record)) records.push_back(record);
    std::this_thread::yield();
  }
  rig->channels.requests.stop = true;
  control.join();
  REQUIRE(rig->channels.trace.dropped() == 0);
  if (HeapGuard::available()) {
    CHECK(records[48].heap_calls == 0);
    CHECK(records[49].heap_calls >= 1);
    CHECK(records[99].heap_calls == records[49].heap_calls);
  }
  CHECK(records[49].page_faults - records[48].page_faults >= kWastedPages);
  CHECK(counts->page_faults.total() >= records.back().page_faults);
}

TEST_CASE("The loop ends when asked, even where nobody reads the trace", "[rt]") {
  const auto rig = std::make_unique<Loop>();
  const auto counts = std::make_unique<LoopCounts>();
  TraceRecord record;
  while (rig->channels.trace.push(record)) {
  }
  rig->publish(now_ns(), 0.005);
  rig->channels.requests.stop = true;
  PeriodicClock clock(1000);
  std::thread control([&] { rig->loop.run(clock, *counts); });
  control.join();
  CHECK(rig->channels.progress.ended);
  CHECK(rig->channels.trace.dropped() > 1);
}

}  // namespace tendril::rt::control_loop_test
