// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <memory>
#include <string>

#include "tests/qp/redundant_robot.h"

// Law: an actuator whose effort may be 0 never makes a target unreachable, never raises the residual, and
// costs iterations in the order of the active-set changes.
namespace tendril::qp::redundancy_test {

constexpr unsigned kSeeds = 12;

/// As many iterations as the daemon grants.
int cap(int n) { return 16 * n; }

RedundantRobot robot_of(unsigned seed) {
  RedundantRobot robot;
  robot.seed = seed;
  robot.actuators = 3 + static_cast<int>(seed % 3);
  robot.coordinates = 2 + static_cast<int>(seed % 4);
  return robot;
}

RedundantRobot with_more(RedundantRobot robot, Added added, double distance) {
  robot.added = added;
  robot.distance = distance;
  robot.more = 1 + static_cast<int>(robot.seed % 4);
  return robot;
}

struct Kind {
  Added added;
  double distance;
};
const Kind kKinds[] = {{Added::kNone, 0},    {Added::kDuplicate, 0}, {Added::kNear, 1e-1},
                       {Added::kNear, 1e-2}, {Added::kNear, 1e-3},   {Added::kNear, 1e-4},
                       {Added::kNear, 1e-6}, {Added::kNear, 1e-8},   {Added::kOpposite, 0},
                       {Added::kOther, 0}};

void prepare(const RedundantRobot::Cycle& cycle, TieBreak tie_break, Problem& problem) {
  if (cycle.new_snapshot) REQUIRE(problem.prepare(cycle.H, cycle.A, tie_break) == Preparation::kReady);
}

TEST_CASE("An added actuator never takes the effector farther from its target", "[law]") {
  for (const auto& [added, distance] : kKinds) {
    for (unsigned seed = 1; seed <= kSeeds; ++seed) {
      const double reach = seed % 2 == 0 ? 0.3 : 3;
      const RedundantRobot robot = robot_of(seed), more = with_more(robot, added, distance);
      auto problem = std::make_unique<Problem>(), problem_of_more = std::make_unique<Problem>();
      Solver solver, solver_of_more;
      Vector x = Vector::Zero(robot.n()), y = Vector::Zero(more.n());
      for (int i = 0; i < 12; ++i) {
        CAPTURE(static_cast<int>(added), distance, seed, i);
        const auto cycle = robot.cycle(i, reach), cycle_of_more = more.cycle(i, reach);
        prepare(cycle, TieBreak::kLeastEnergy, *problem);
        prepare(cycle_of_more, TieBreak::kLeastEnergy, *problem_of_more);
        x = solver.solve(*problem, cycle.g, cycle.bounds, x, cap(robot.n())).x;
        const Solution& solution =
            solver_of_more.solve(*problem_of_more, cycle_of_more.g, cycle_of_more.bounds, y, cap(more.n()));
        y = solution.x;
        REQUIRE(solution.status == Status::kOptimal);
        REQUIRE(cycle_of_more.residual(y) <= cycle.residual(x) + 1e-7 * cycle.delta_e.norm());
      }
    }
  }
}

TEST_CASE("A redundant robot is controlled in a few iterations, under top rates, too", "[law]") {
  for (const TieBreak tie_break : {TieBreak::kLeastEnergy, TieBreak::kAny}) {
    for (const double epsilon : {0.0, 1e-3}) {
      if (tie_break == TieBreak::kLeastEnergy && epsilon > 0) continue;
      for (const auto& [added, distance] : kKinds) {
        double sum = 0;
        int cycles = 0;
        for (unsigned seed = 1; seed <= kSeeds; ++seed) {
          RedundantRobot robot = with_more(robot_of(seed), added, distance);
          robot.epsilon = epsilon;
          const int n = robot.n();
          auto problem = std::make_unique<Problem>();
          Solver solver;
          Vector x = Vector::Zero(n), displacement = Vector::Zero(n);
          for (int i = 0; i < 20; ++i) {
            CAPTURE(static_cast<int>(tie_break), epsilon, static_cast<int>(added), distance, seed, i);
            auto cycle = robot.cycle(i, seed % 2 == 0 ? 0.3 : 3);
            prepare(cycle, tie_break, *problem);
            limit_rate(displacement, 0.1, cycle.bounds);
            const Solution& solution = solver.solve(*problem, cycle.g, cycle.bounds, x, cap(n));
            CAPTURE(name(solution.status), solution.iterations, solution.row_violation);
            // Rows that are met by a hair's breadth may be called impossible: then the violation is as small.
            if (solution.status != Status::kSoftened)
              REQUIRE(solution.status == Status::kOptimal);
            else
              REQUIRE(solution.row_violation <= 1e-7);
            REQUIRE(solution.iterations <= 10 * n);
            sum += solution.iterations;
            ++cycles;
            x = solution.x;
            displacement = cycle.A * x;
          }
        }
        CAPTURE(static_cast<int>(tie_break), epsilon, static_cast<int>(added), distance, sum / cycles);
        CHECK(sum / cycles <= 12);
      }
    }
  }
}

TEST_CASE("Two actuators that are alike share the effort", "[law]") {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    CAPTURE(seed);
    const RedundantRobot robot = with_more(robot_of(seed), Added::kDuplicate, 0);
    const auto cycle = robot.cycle(0, 0.3);
    Problem problem;
    prepare(cycle, TieBreak::kLeastEnergy, problem);
    Solver solver;
    const Vector x = solver.solve(problem, cycle.g, cycle.bounds, Vector::Zero(robot.n()), 1000).x;
    for (int k = robot.actuators; k < std::min(robot.n(), 2 * robot.actuators); ++k)
      CHECK(x[k] == Approx(x[k - robot.actuators]).margin(1e-5));
  }
}

TEST_CASE("Without any energy the least energy is that of any solution", "[unit]") {
  const Matrix H = Matrix::Identity(2, 2);
  Problem problem;
  REQUIRE(problem.prepare(H, Matrix::Zero(2, 2), TieBreak::kLeastEnergy) == Preparation::kReady);
  CHECK_FALSE(problem.two_levels());
  Solver solver;
  const Vector one = Vector::Ones(2);
  const Solution& solution = solver.solve(problem, -one, {-2 * one, 2 * one, -one, one}, 0 * one, 10);
  CHECK(solution.status == Status::kOptimal);
  CHECK(solution.x.isApprox(one));
}

// Recorded: four knees of a robot under one cable each, and a fifth cable beside the first.
TEST_CASE("A second cable at one knee of a robot costs a few iterations", "[law]") {
  Matrix H(5, 5), A(5, 5);
  H << 0.00050284913404500717, 1.3948287752423432e-05, -0.00048993328176292388, 1.6976668743542118e-05,
      0.00050608542925226967, 1.3948287752423432e-05, 0.00050397767900760553, -2.0464355354258632e-05,
      -0.00048519563530363994, 5.8732217315111835e-05, -0.00048993328176292388, -2.0464355354258632e-05,
      0.00050794277911829131, 1.8976969640807804e-05, -0.00049504004521448936, 1.6976668743542118e-05,
      -0.00048519563530363994, 1.8976969640807804e-05, 0.00049631471289469529, -2.7289927794065339e-05,
      0.00050608542925226967, 5.8732217315111835e-05, -0.00049504004521448936, -2.7289927794065339e-05,
      0.00051336838174361886;
  A << 0.014174293128631353, 0.00094649756809059163, -0.0098376246152813152, 0.001288530089351939,
      0.014046837892353475, 0.00094649756809059163, 0.014915577913445888, 0.00064716453471751981,
      -0.0097639001955676756, 0.0019635200948206213, -0.0098376246152813152, 0.00064716453471751981,
      0.015086062630622576, 0.0010773818630298011, -0.0098839758051948289, 0.001288530089351939,
      -0.0097639001955676756, 0.0010773818630298011, 0.014044802998648596, 0.00032942143989817923,
      0.014046837892353475, 0.0019635200948206213, -0.0098839758051948289, 0.00032942143989817923,
      0.014811243933472037;
  Vector g(5), hold(5);
  g << 0.00015386635025662522, -0.00023197391818134328, -0.0002391282327822972, 0.00014547439943146475,
      0.00013796178102010498;
  hold << 0.72872409339600186, 1.6862910851598705, 1.8315888790857984, 1.296430665843018, 0.65500277161380105;
  const Bounds bounds{Vector::Zero(5), Vector::Constant(5, 8), Vector::Constant(5, -0.0185),
                      Vector::Constant(5, 0.0407)};
  Problem problem;
  REQUIRE(problem.prepare(H, A, TieBreak::kLeastEnergy) == Preparation::kReady);
  Solver solver;
  for (int cycle = 0; cycle < 3; ++cycle) {
    const Solution& solution = solver.solve(problem, g, bounds, hold, 80);
    CAPTURE(cycle, solution.iterations, solution.x.transpose());
    CHECK(solution.status == Status::kOptimal);
    CHECK(solution.iterations <= (cycle == 0 ? 20 : 5));
    CHECK((H * solution.x + g).norm() <= 1e-9 * g.norm());  // the target is reached
  }
}

// Recorded: the start of a trunk under gravity, whose cables are slack. Their displacements without tension
// are outside the window of the top rate, so that the rows conflict, and x = 0 is the only solution.
TEST_CASE("Rows that conflict at a corner of the bounds are solved, not capped", "[law]") {
  Matrix H(3, 3), A(3, 3);
  H << 0.0010587472448533783, -0.00053804870713090132, -0.00051523510394560663, -0.00053804870713090132,
      0.0010728494631199092, -0.00053437279795192814, -0.00051523510394560663, -0.00053437279795192814,
      0.0010437575478596777;
  A << 0.0078884372787614426, -2.3505452177276453e-05, 0.00014135894090293904, -2.3505452177276453e-05,
      0.0078574631741059938, 6.0979099079763294e-05, 0.00014135894090293904, 6.0979099079763294e-05,
      0.0077405442670986091;
  Vector g(3), upper(3);
  g << -1.9522760404407877e-06, 9.830896610045918e-07, 9.5907582983478479e-07;
  upper << -0.00022024856429554322, -0.00021956818394623792, -0.00021821033498514183;
  Problem problem;
  REQUIRE(problem.prepare(H, A, TieBreak::kLeastEnergy) == Preparation::kReady);
  Solver solver;
  for (int cycle = 0; cycle < 3; ++cycle) {
    const Vector row_upper = upper + Vector::Constant(3, 1e-4 * cycle),
                 row_lower = row_upper - Vector::Constant(3, 2e-4);
    const Solution& solution = solver.solve(problem, (cycle + 1) * g,
                                            {Vector::Zero(3), Vector::Constant(3, 5), row_lower, row_upper},
                                            Vector::Zero(3), cap(3));
    CAPTURE(cycle, name(solution.status), solution.iterations);
    CHECK(solution.status == Status::kSoftened);
    CHECK(solution.x.cwiseAbs().maxCoeff() <= 1e-9);
    CHECK(solution.row_violation == Approx(-row_upper.minCoeff()).epsilon(1e-6));
    CHECK(solution.iterations <= 36);
  }
}

}  // namespace tendril::qp::redundancy_test
