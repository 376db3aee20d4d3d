#include "rig.h"

namespace tendril::hal::test {

MasterConfig config_of(int axes) {
  MasterConfig config;
  config.period_ns = kPeriod_ns;
  for (int i = 0; i < axes; ++i)
    config.axes.push_back(
        {.name = "cable " + std::to_string(i),
         .node = i + 1,
         .scale = {.counts_per_turn = 65536, .displacement_per_turn = 0.0628, .reversed = i % 2 == 1}});
  return config;
}

Rig::Rig(MasterConfig config, int64_t delay_ns)
    : bus(delay_ns), controller(bus.attach("controller")), recorder(bus.attach("recorder")), master(config) {
  for (size_t i = 0; i < config.axes.size(); ++i) {
    plugs.push_back(&bus.attach("drive"));
    drives.emplace_back(
        DriveSpec{.node = config.axes[i].node, .position_counts = 1000.0 * static_cast<double>(i + 1)});
  }
  command.axes = static_cast<int>(config.axes.size());
  traffic.reserve(100'000);
}

void Rig::cycle() {
  const int64_t now_ns = bus.time_ns();
  Frame frame;
  while (controller.receive(frame))
    if (master_alive) master.receive(frame, frame.stamp_ns);
  if (master_alive) {
    measured = master.measure(controller.health(), now_ns);
    if (follow_measured) command.position = measured.position;
    batch.clear();
    master.command(command, now_ns, batch);
    for (const Frame& out : batch) controller.send(out);
  }
  bus.set_time(now_ns + kPeriod_ns / 2);
  for (size_t i = 0; i < drives.size(); ++i) {
    FrameBatch answers;
    while (plugs[i]->receive(frame)) drives[i].receive(frame, bus.time_ns(), answers);
    drives[i].advance(bus.time_ns(), answers);
    for (Frame answer : answers)
      if (!tamper || tamper(static_cast<int>(i), answer)) plugs[i]->send(answer);
  }
  while (recorder.receive(frame))
    if (traffic.size() < traffic.capacity()) traffic.push_back(frame);
  bus.set_time(now_ns + kPeriod_ns);
}

bool Rig::run_until(const std::function<bool()>& done, int64_t limit_ns) {
  for (const int64_t end_ns = bus.time_ns() + limit_ns; bus.time_ns() < end_ns;) {
    cycle();
    if (done()) return true;
  }
  return false;
}

void Rig::run_for(int64_t duration_ns) {
  run_until([] { return false; }, duration_ns);
}

bool Rig::enable() {
  if (!run_until([this] { return measured.all_known || measured.fault.kind != FaultKind::kNone; }))
    return false;
  command.enable = true;
  return run_until([this] { return measured.all_enabled; });
}

int Rig::find(const std::string& text, int from) const {
  for (int i = from; i < static_cast<int>(traffic.size()); ++i)
    if (to_text(traffic[i]) == text) return i;
  return -1;
}

}  // namespace tendril::hal::test
