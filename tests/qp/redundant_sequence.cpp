// SPDX-License-Identifier: Apache-2.0
#include "tests/qp/redundant_sequence.h"

#include <array>
#include <memory>
#include <stdexcept>

#include "tests/qp/redundant_robot.h"

namespace tendril::qp {
namespace {

constexpr int kTicks = 600;
constexpr double kReach = 1;      // of the path: at times out of reach
constexpr double kTopRate = 0.2;  // a tick
constexpr int kCap = 10000;

struct Named {
  const char* name;
  RedundantRobot robot;
};

const std::array kNamed = {
    Named{"redundant_same_m05e03", {4, 3, Added::kDuplicate, 1, 0, 0, 1}},
    Named{"redundant_near_m05e03", {4, 3, Added::kNear, 1, 1e-2, 0, 1}},
    Named{"redundant_near_m08e03", {4, 3, Added::kNear, 4, 1e-3, 0, 2}},
    Named{"redundant_near_m16e06", {8, 6, Added::kNear, 8, 1e-4, 0, 3}},
    Named{"redundant_more_m16e06", {8, 6, Added::kOther, 8, 0, 0, 4}},
};

}  // namespace

const std::vector<std::string>& redundant_sequences() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> result;
    for (const Named& each : kNamed) result.emplace_back(each.name);
    return result;
  }();
  return names;
}

Sequence redundant_sequence(const std::string& name) {
  for (const Named& each : kNamed) {
    if (name != each.name) continue;
    Sequence result{name, each.robot.coordinates, TieBreak::kLeastEnergy, {}, {}};
    auto problem = std::make_unique<Problem>();
    auto solver = std::make_unique<Solver>();
    Vector x = Vector::Zero(each.robot.n()), displacement = x;
    for (int i = 0; i < kTicks; ++i) {
      RedundantRobot::Cycle cycle = each.robot.cycle(i, kReach);
      if (cycle.new_snapshot) {
        result.snapshots.push_back({cycle.H, cycle.A});
        if (problem->prepare(cycle.H, cycle.A) != Preparation::kReady)
          throw std::runtime_error(name + ": a snapshot is refused");
      }
      limit_rate(displacement, kTopRate, cycle.bounds);
      solver->reset();
      const Solution& solution = solver->solve(*problem, cycle.g, cycle.bounds, x, kCap);
      x = solution.x;
      displacement = cycle.A * x;
      result.ticks.push_back({static_cast<int>(result.snapshots.size()) - 1,
                              solution.status == Status::kSoftened, cycle.g, cycle.bounds,
                              0.5 * x.dot(cycle.H * x) + cycle.g.dot(x), 0.5 * cycle.delta_e.squaredNorm()});
    }
    return result;
  }
  throw std::runtime_error(name + ": there is no such sequence");
}

}  // namespace tendril::qp
