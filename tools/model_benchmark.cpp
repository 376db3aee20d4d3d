// SPDX-License-Identifier: Apache-2.0
// What a refresh of the model costs, next to what others need for a part of it on the same matrix.
// tools/bench runs it.

#include <dlfcn.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <vector>

#include "app/config/load_config.h"
#include "app/robot/model_refresher.h"
#include "app/robot/robot.h"
#include "fem/body/assembler.h"
#include "fem/body/compliance.h"
#include "fem/body/dynamics.h"
#include "rt/heap_guard.h"
#include "tests/fem/sparse/cholmod_factor.h"
#include "tools/times.h"

namespace tendril {
namespace {

using Json = nlohmann::json;

[[noreturn]] void fail(const std::string& what) {
  fmt::print(stderr, "model_benchmark: {}\n", what);
  std::exit(1);
}

/// Gflop/s that the machine's BLAS reaches on one core with a large product, or 0 where there is no BLAS.
double dgemm_gflops() {
  using Dgemm =
      void(const char*, const char*, const int*, const int*, const int*, const double*, const double*,
           const int*, const double*, const int*, const double*, double*, const int*);
  void* library = dlopen("libblas.so.3", RTLD_NOW);
  auto* dgemm = library ? reinterpret_cast<Dgemm*>(dlsym(library, "dgemm_")) : nullptr;
  if (!dgemm) return 0;
  const int n = 1024;
  const double one = 1;
  const std::vector<double> A(n * n, 1.0), B(n * n, 0.5);
  std::vector<double> C(n * n, 0.0);
  Times times;
  for (int k = 0; k < 5; ++k)
    times.measure([&] { dgemm("N", "N", &n, &n, &n, &one, A.data(), &n, B.data(), &n, &one, C.data(), &n); });
  return 2e-6 * n * n * n / times.min();
}

/// Efforts that wander about a share of their ranges, as under a moving target.
rt::Feedback feedback_at(int step, double share, const rt::ControllerConfig& limits) {
  rt::Feedback feedback;
  feedback.efforts_known = true;
  feedback.lambda = limits.a_min;
  for (Eigen::Index a = 0; a < feedback.lambda.size(); ++a) {
    const double wander = 1 + 0.5 * std::sin(0.05 * step + static_cast<double>(a));
    feedback.lambda[a] += share * wander * (limits.a_max[a] - limits.a_min[a]);
  }
  return feedback;
}

/// The pieces of a refresh one by one, on the pose that it came to.
struct Split {
  Times move, assemble, factor, compliance, problem;

  void measure(const app::Robot& robot, const Eigen::VectorXd& x, const rt::Snapshot& snapshot,
               int repetitions) {
    fem::StiffnessMatrix K = robot.model.make_stiffness(robot.constraints.cliques());
    fem::Assembler assembler(robot.model, K);
    fem::Response response(robot.constraints, K, fem::Border::Rows::kActuatorsAndEffectors);
    fem::Compliance W;
    qp::Problem qp;
    Eigen::VectorXd r, dx;
    const Eigen::VectorXd lambda = snapshot.lambda;
    const qp::Matrix H = snapshot.W_aa;  // what it holds does not matter to the time
    for (int k = 0; k < repetitions; ++k) {
      assemble.measure([&] { assembler.assemble(x, fem::Tangent::kExact, r, K); });
      r += robot.model.external_forces();
      robot.constraints.add_stiffness(x, lambda, fem::Tangent::kExact, K);
      factor.measure([&] {
        if (!response.compute(K, x, r)) fail("the stiffness is not positive definite");
      });
      compliance.measure([&] { response.compliance(x, W); });
      problem.measure([&] { (void)qp.prepare(H, H); });
      move.measure([&] { response.solve_step(lambda, dx); });
    }
  }
  Json json() const {
    return {{"move", move.median()},
            {"assemble", assemble.median()},
            {"factor_and_compliance", factor.median() + compliance.median()},
            {"qp_problem", problem.median()}};
  }
};

/// Since this program began: getrusage() would count what ran before it in the same process.
double peak_memory_mib() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmHWM:")) return std::stod(line.substr(6)) / 1024;
  return 0;
}

void print(const Json& j) {
  const auto& split = j["split_ms"];
  fmt::print("{}: {} nodes, {} tetrahedra, {} actuators, {} effector coordinates\n", std::string(j["mesh"]),
             int(j["nodes"]), int(j["tetrahedra"]), int(j["actuators"]), int(j["effector_coordinates"]));
  const auto line = [](const char* what, double median, double least) {
    fmt::print("  {:<52} {:9.3f} ms  (least {:.3f})\n", what, median, least);
  };
  if (j.contains("ratio"))
    line("a whole refresh, after CHOLMOD has used the caches", j["refresh_ms"]["median"],
         j["refresh_ms"]["min"]);
  line("a whole refresh after another", j["refresh_warm_ms"]["median"], j["refresh_warm_ms"]["min"]);
  fmt::print("    move {:.3f}, assemble {:.3f}, factor and compliance {:.3f}, QP {:.3f}\n",
             double(split["move"]), double(split["assemble"]), double(split["factor_and_compliance"]),
             double(split["qp_problem"]));
  if (j.contains("plant_step_ms"))
    line("a step of the simulated robot", j["plant_step_ms"]["median"], j["plant_step_ms"]["min"]);
  if (j.contains("ratio")) {
    line("CHOLMOD, simplicial LDL' with AMD, factorisation alone", j["cholmod_simplicial_ms"]["median"],
         j["cholmod_simplicial_ms"]["min"]);
    line("CHOLMOD, supernodal, factorisation alone", j["cholmod_supernodal_ms"]["median"],
         j["cholmod_supernodal_ms"]["min"]);
    const double gflops = j["dgemm_gflops"], mflop = j["factor_mflop"];
    if (gflops > 0)
      fmt::print("  {:<52} {:9.3f} ms  ({:.1f} Mflop at the {:.0f} Gflop/s of this BLAS)\n",
                 "the factor's operations as one large dgemm", mflop / gflops, mflop, gflops);
    fmt::print("  refresh / CHOLMOD simplicial: {:.3f}\n", double(j["ratio"]));
  }
  fmt::print("  heap calls in {} refreshes: {}; peak memory {:.0f} MiB\n", int(j["refreshes"]),
             int(j["heap_calls"]), double(j["peak_memory_mib"]));
}

Json benchmark(const app::Config& config, int repetitions, double share, bool yardsticks) {
  const auto robot = app::build_model(config);
  const auto limits = app::controller_config(config);
  app::ModelRefresher refresher(*robot, config);
  auto snapshot = std::make_unique<rt::Snapshot>();
  int step = 0;
  const auto refresh = [&] {
    if (!refresher.refresh(feedback_at(step++, share, limits), 1, *snapshot)) fail("a refresh failed");
  };
  if (!refresher.refresh({}, 1, *snapshot)) fail("the body cannot be linearised at rest");
  for (int k = 0; k < 10; ++k) refresh();

  const double memory = peak_memory_mib();
  std::unique_ptr<fem::CholmodFactor> simplicial, supernodal;
  if (yardsticks) {
    fem::StiffnessMatrix K = robot->model.make_stiffness(robot->constraints.cliques());
    fem::Assembler assembler(robot->model, K);
    Eigen::VectorXd f;
    assembler.assemble(refresher.x(), fem::Tangent::kExact, f, K);
    robot->constraints.add_stiffness(refresher.x(), snapshot->lambda, fem::Tangent::kExact, K);
    using Method = fem::CholmodFactor::Method;
    simplicial = std::make_unique<fem::CholmodFactor>(K, Method::kSimplicial);
    supernodal = std::make_unique<fem::CholmodFactor>(K, Method::kSupernodal);
    if (!simplicial->factorize(K) || !supernodal->factorize(K))
      fail("CHOLMOD finds the stiffness indefinite");
  }
  Times refreshes, simplicials, supernodals;
  int64_t heap_calls = 0;
  for (int k = 0; k < repetitions; ++k) {
    refreshes.measure([&] {
      const rt::HeapGuard heap;
      refresh();
      heap_calls += heap.calls();
    });
    if (!yardsticks) continue;
    simplicials.measure([&] { (void)simplicial->factorize_again(); });
    supernodals.measure([&] { (void)supernodal->factorize_again(); });
  }
  Split split;
  split.measure(*robot, refresher.x(), *snapshot, repetitions);
  Times warm;
  for (int k = 0; k < repetitions; ++k) warm.measure(refresh);

  Json j = {{"mesh", config.mesh.file.filename().string()},
            {"nodes", robot->model.mesh().node_count()},
            {"tetrahedra", robot->model.mesh().tet_count()},
            {"actuators", robot->constraints.actuators()},
            {"effector_coordinates", robot->constraints.effector_coordinates()},
            {"refreshes", repetitions},
            {"refresh_ms", refreshes.json()},
            {"refresh_warm_ms", warm.json()},
            {"split_ms", split.json()},
            {"heap_calls", heap_calls},
            {"peak_memory_mib", memory}};
  if (yardsticks) {
    j["cholmod_simplicial_ms"] = simplicials.json();
    j["cholmod_supernodal_ms"] = supernodals.json();
    j["dgemm_gflops"] = dgemm_gflops();
    j["factor_mflop"] = 1e-6 * simplicial->operations();
    j["ratio"] = refreshes.median() / simplicials.median();
  }
  return j;
}

/// Steps of the simulated robot as it is pulled about.
void benchmark_plant(const app::Config& config, int repetitions, Json& j) {
  const auto robot = app::build_plant(config);
  fem::Dynamics dynamics(robot->model, robot->constraints,
                         {config.plant->damping_mass, config.plant->damping_stiffness});
  Eigen::VectorXd delta_a = Eigen::VectorXd::Zero(robot->constraints.actuators());
  Times times;
  for (int k = 0; k < repetitions; ++k) {
    for (Eigen::Index a = 0; a < delta_a.size(); ++a)
      delta_a[a] =
          0.1 * config.actuators[a].displacement_max * (1 + std::sin(0.05 * k + static_cast<double>(a)));
    times.measure([&] {
      if (!dynamics.step(delta_a, config.plant->time_step)) fail("the simulated robot could not be advanced");
    });
  }
  j["plant_step_ms"] = times.json();
  j["plant_time_step_ms"] = 1e3 * config.plant->time_step;
}

}  // namespace
}  // namespace tendril

int main(int argc, char** argv) {
  CLI::App app("Times a refresh of a robot's model on one core, next to CHOLMOD's factorisations and dgemm.");
  std::string file, mesh;
  int repetitions = 200;
  double share = 0.02;
  bool json = false, no_yardsticks = false;
  app.add_option("ROBOT", file, "robot file")->required();
  app.add_option("--mesh", mesh, "another mesh of the same robot");
  app.add_option("--repetitions", repetitions, "refreshes to time")->check(CLI::PositiveNumber);
  app.add_option("--share", share, "of their ranges that the efforts wander about")
      ->check(CLI::Range(0.0, 1.0));
  app.add_flag("--no-yardsticks", no_yardsticks, "the refresh alone");
  app.add_flag("--json", json, "the last line is JSON");
  CLI11_PARSE(app, argc, argv);
  try {
    auto config = tendril::app::load_config(file);
    if (!mesh.empty()) config.mesh.file = mesh;
    auto figures = tendril::benchmark(config, repetitions, share, !no_yardsticks);
    if (config.plant && mesh.empty()) tendril::benchmark_plant(config, repetitions, figures);
    tendril::print(figures);
    if (json) fmt::print("{}\n", figures.dump());
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
}
