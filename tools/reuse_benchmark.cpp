// SPDX-License-Identifier: Apache-2.0
// Where a factor that is reused from pose to pose beats a factorisation at each: the response to the
// actuators alone, found both ways along one path, for several distances between poses. tools/bench runs it.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <nlohmann/json.hpp>
#include <vector>

#include "app/config/load_config.h"
#include "app/robot/robot.h"
#include "fem/body/equilibrium.h"
#include "tools/times.h"

namespace tendril {
namespace {

using Json = nlohmann::json;

[[noreturn]] void fail(const std::string& what) {
  fmt::print(stderr, "reuse_benchmark: {}\n", what);
  std::exit(1);
}

/// Time that this thread has had a processor, ns: what is to be compared takes long enough for others to cut
/// in.
int64_t thread_time_ns() noexcept {
  timespec time;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return time.tv_sec * int64_t{1'000'000'000} + time.tv_nsec;
}

/// A closed path of the efforts, on which the first effector's point goes round.
class Path {
 public:
  /// @param radius  about how far the point is from the middle of its path, m
  Path(const app::Robot& robot, double radius) {
    amplitude_ = 1;
    fem::Equilibrium body(robot.model, robot.constraints);
    if (body.linearise(Eigen::VectorXd::Zero(robot.constraints.actuators())) !=
        fem::LinearisationStatus::kUsable)
      fail("the body cannot be linearised at rest");
    amplitude_ = radius / (body.compliance().W_ea * swing(0, robot.constraints.actuators())).norm();
  }
  Eigen::VectorXd efforts(double phase, Eigen::Index m) const {
    return Eigen::VectorXd::Constant(m, 2 * amplitude_) + swing(phase, m);
  }
  /// Their derivative.
  Eigen::VectorXd rate(double phase, Eigen::Index m) const { return swing(phase + M_PI / 2, m); }

 private:
  Eigen::VectorXd swing(double phase, Eigen::Index m) const {
    return Eigen::VectorXd::NullaryExpr(m, [&](Eigen::Index a) {
      return amplitude_ * std::sin(phase + 2 * M_PI * static_cast<double>(a) / static_cast<double>(m));
    });
  }
  double amplitude_;
};

/// The body on its way, and both responses.
class Comparison {
 public:
  Comparison(const app::Robot& robot, const Path& path)
      : robot_(robot),
        path_(path),
        K_(robot.model.make_stiffness(robot.constraints.cliques())),
        assembler_(robot.model, K_),
        direct_(robot.constraints, K_, fem::Border::Rows::kActuatorsAndEffectors),
        reused_(robot.constraints, K_) {
    fem::Equilibrium body(robot.model, robot.constraints);
    if (!body.settle_under_efforts(path.efforts(0, m()), 1e-7).converged)
      fail("the body does not come to rest on its path; try a smaller --radius");
    x_ = body.x();
  }

  /// Follows the path by the reused response.
  /// @param distance  of the effectors from pose to pose, m
  /// @param every     of so many poses one is factored for comparison as well
  Json measure(double distance, int poses, int every) {
    Times direct(thread_time_ns), reused(thread_time_ns), move(thread_time_ns);
    double phase = 0, error = 0;
    int factorisations = 0, sweeps = 0, solved = 0;
    reused_.discard_factor();
    for (int k = 0; k < poses; ++k) {
      const Eigen::VectorXd lambda = path_.efforts(phase, m());
      linearise(lambda);
      reused.measure([&] {
        if (!reused_.compute(K_, x_, r_, lambda)) fail("the stiffness is not positive definite");
        reused_.compliance(x_, found_);
      });
      factorisations += reused_.factored();
      sweeps += reused_.sweeps();
      solved += !reused_.factored();
      if (!reused_.factored() && solved % every == 0) {
        direct.measure([&] {
          if (!direct_.compute(K_, x_, r_)) fail("the stiffness is not positive definite");
          direct_.compliance(x_, exact_);
          direct_.solve_step(lambda, dx_);
        });
        error = std::max(error, largest_error());
      }
      phase += distance / (found_.W_ea * path_.rate(phase, m())).norm();
      move.measure([&] { reused_.solve_step(path_.efforts(phase, m()), dx_); });
      x_ += dx_;
    }
    return {{"distance_mm", 1e3 * distance},
            {"direct_ms", direct.mean()},
            {"reused_ms", reused.mean() + move.mean()},
            {"ratio", direct.mean() / (reused.mean() + move.mean())},
            {"sweeps", static_cast<double>(sweeps) / poses},
            {"poses_per_factorisation", static_cast<double>(poses) / factorisations},
            {"error_of_W", error}};
  }

 private:
  Eigen::Index m() const { return robot_.constraints.actuators(); }

  void linearise(const Eigen::VectorXd& lambda) {
    if (assembler_.assemble(x_, fem::Tangent::kExact, r_, K_) > 0)
      fail("an element is inside out; try a smaller --radius");
    r_ += robot_.model.external_forces();
    robot_.constraints.add_stiffness(x_, lambda, fem::Tangent::kExact, K_);
  }

  double largest_error() const {
    return std::max((found_.W_aa - exact_.W_aa).norm() / exact_.W_aa.norm(),
                    (found_.W_ea - exact_.W_ea).norm() / exact_.W_ea.norm());
  }

  const app::Robot& robot_;
  const Path& path_;
  fem::StiffnessMatrix K_;
  fem::Assembler assembler_;
  fem::Response direct_;
  fem::ReusedResponse reused_;
  fem::Compliance found_, exact_;
  Eigen::VectorXd x_, r_, dx_;
};

}  // namespace
}  // namespace tendril

int main(int argc, char** argv) {
  CLI::App app(
      "Times the response of a robot's model with a factor that is reused, and with one for each pose.");
  std::string file, mesh;
  int poses = 40, every = 3;
  double radius = 2;
  std::vector<double> distances = {0.1, 0.25, 0.5, 1, 2};
  app.add_option("ROBOT", file, "robot file")->required();
  app.add_option("--mesh", mesh, "another mesh of the same robot");
  app.add_option("--poses", poses, "for each distance")->check(CLI::PositiveNumber);
  app.add_option("--every", every, "of so many poses one is factored for comparison")
      ->check(CLI::PositiveNumber);
  app.add_option("--radius", radius, "of the effectors' path, mm")->check(CLI::PositiveNumber);
  app.add_option("--distances", distances, "of the effectors from pose to pose, mm")
      ->delimiter(',')
      ->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);
  try {
    auto config = tendril::app::load_config(file);
    if (!mesh.empty()) config.mesh.file = mesh;
    const auto robot = tendril::app::build_model(config);
    const tendril::Path path(*robot, 1e-3 * radius);
    tendril::Comparison comparison(*robot, path);
    for (const double distance : distances) {
      auto j = comparison.measure(1e-3 * distance, poses, every);
      j["nodes"] = robot->model.mesh().node_count();
      fmt::print("{}\n", j.dump());
      std::fflush(stdout);
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
}
