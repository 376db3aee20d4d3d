// SPDX-License-Identifier: Apache-2.0
#include "app/check/cycle_budget.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "app/check/private_bus.h"
#include "app/config/master_config.h"
#include "app/plant/plant.h"
#include "app/robot/control_stack.h"
#include "app/robot/cpu_time.h"
#include "app/robot/model_refresher.h"
#include "hal/bus/open_bus.h"
#include "hal/drive/drive_protocol.h"

namespace tendril::app {
namespace {

constexpr int kSamples = 500;
constexpr double kQuantile = 0.99;
constexpr int64_t kStart_ns = 10'000'000'000;  // of virtual time, for the drives to follow
constexpr int kStartCycles = 1000;             // and as many at least
// With less the wake-up, which takes 100 us and more on a machine that is not tuned, makes cycles late.
constexpr double kMarginAdvised = 0.5;

rt::ControllerConfig undisturbed(const Config& config) {
  rt::ControllerConfig limits = controller_config(config);
  limits.snapshot_age_limit_ns = std::numeric_limits<int64_t>::max();
  return limits;
}

/// A local bus whose frames arrive in the time of the loop, and not in that of the machine's clock.
class RestampingBus final : public hal::Bus {
 public:
  RestampingBus(const std::string& name, const int64_t& now_ns)
      : bus_(hal::open_bus(name, hal::BusRole::kJoin)), now_ns_(now_ns) {}

  hal::SendResult send(std::span<const hal::Frame> frames) noexcept override { return bus_->send(frames); }
  int receive(std::span<hal::Frame> frames) noexcept override {
    const int count = bus_->receive(frames);
    for (hal::Frame& frame : frames.first(count)) frame.stamp_ns = now_ns_;
    return count;
  }
  hal::BusHealth health() const noexcept override { return bus_->health(); }
  uint64_t dropped() const noexcept override { return bus_->dropped(); }
  std::string describe() const override { return bus_->describe(); }

 private:
  std::unique_ptr<hal::Bus> bus_;
  const int64_t& now_ns_;
};

/// The control loop and its drives, taking turns in one thread under a clock of their own.
class LoopWithDrives {
 public:
  LoopWithDrives(const Robot& robot, const Config& config)
      : period_ns_(static_cast<int64_t>(1e9 / config.control.rate_hz)),
        drives_bus_(hal::open_bus(medium_.name(), hal::BusRole::kHost)),
        bus_(medium_.name(), now_ns_),
        drives_(with_drives_only(config)),
        stack_(undisturbed(config), hal::make_master(master_config(with_drives_only(config))), bus_) {
    linearise_at_rest(robot, config, now_ns_, stack_.channels->snapshots.back());
    stack_.channels->snapshots.publish();
  }

  /// One cycle; the CPU's time in reading, solving and writing, s.
  std::array<double, 3> cycle() {
    now_ns_ += period_ns_;
    const PlantMeasurement nothing{.stamp_ns = now_ns_ - period_ns_ / 2};  // but sensors tell even that
    drives_.serve(*drives_bus_, nothing, nothing.stamp_ns);
    const double begin = cpu_seconds();
    const rt::CycleStart start{now_ns_, now_ns_};
    const hal::Measurement& measurement = stack_.loop.read(start);
    const double read = cpu_seconds();
    const rt::Decision& decision = stack_.loop.solve(measurement, start);
    const double solved = cpu_seconds();
    phase_ = stack_.loop.write(measurement, decision, start).phase;
    const double written = cpu_seconds();
    return {read - begin, solved - read, written - solved};
  }

  /// @return  whether the drives follow
  bool start() {
    const int64_t limit_ns = now_ns_ + std::max(kStart_ns, kStartCycles * period_ns_);
    while (phase_ < rt::Phase::kRunning && now_ns_ < limit_ns) cycle();
    return phase_ == rt::Phase::kRunning;
  }

  std::string fault() const { return stack_.master->describe(stack_.controller.latched().drive); }

 private:
  int64_t now_ns_ = 1'000'000'000, period_ns_;  // stamps of zero mean "never"
  PrivateBus medium_;
  std::unique_ptr<hal::Bus> drives_bus_;
  RestampingBus bus_;
  PlantDrives drives_;
  ControlStack stack_;
  rt::Phase phase_ = rt::Phase::kConnecting;
};

double quantile(std::vector<double>& values) {
  const auto at = values.begin() + static_cast<long>(kQuantile * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

CycleCost time_cycle(const Robot& robot, const Config& config) {
  const auto loop = std::make_unique<LoopWithDrives>(robot, config);
  if (!loop->start())
    throw ConfigError(
        fmt::format("{}: simulated drives cannot be brought to follow at control.rate {:g} Hz: {}",
                    config.file.string(), config.control.rate_hz, loop->fault()));
  std::array<std::vector<double>, 3> stages;
  for (int k = 0; k < kSamples; ++k) {
    const auto times = loop->cycle();
    for (std::size_t s = 0; s < stages.size(); ++s) stages[s].push_back(times[s]);
  }
  return {quantile(stages[0]), quantile(stages[1]), quantile(stages[2])};
}

CycleBudget judge_cycle(const Config& config, const CycleCost& cost, const QpBudget& qp) {
  const double period_s = 1 / config.control.rate_hz, at_cap_s = qp.cap * qp.iteration_s;
  CycleBudget budget;
  budget.whole_s = cost.read_s + cost.solve_s + at_cap_s + cost.write_s;
  budget.margin = 1 - budget.whole_s / period_s;
  const std::string sum = fmt::format(
      "read {:.3g} us, decide {:.3g} us and {:.3g} us more with the QP at its cap, write {:.3g} us: {:.3g} "
      "of "
      "{:.4g} us",
      1e6 * cost.read_s, 1e6 * cost.solve_s, 1e6 * at_cap_s, 1e6 * cost.write_s, 1e6 * budget.whole_s,
      1e6 * period_s);
  if (budget.margin < 0)
    throw ConfigError(
        fmt::format("{}: control.rate: found {:g} Hz, expected at most {:.3g} Hz: a cycle does not fit, it "
                    "takes {} here; lower the rate, the number of actuators or control.iteration_cap",
                    config.file.string(), config.control.rate_hz, 1 / budget.whole_s, sum));
  budget.text =
      fmt::format("{} here on a local bus, {:.0f} % left for the wake-up", sum, 100 * budget.margin);
  if (budget.margin < kMarginAdvised)
    budget.text += ": little; measure it with tendril-latency, or lower control.rate";
  return budget;
}

}  // namespace tendril::app
