// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>

#include "fem/body/imposed_displacement.h"
#include "rt/heap_guard.h"
#include "tests/fem/body/chamber.h"

namespace tendril::fem::heap_test {

using testing::Chamber;

TEST_CASE("Constraints and the efforts that impose displacements allocate nothing once they have run",
          "[rt]") {
  if (!rt::HeapGuard::available()) {
    WARN("skipped: heap calls are not counted in this build");
    return;
  }
  const Chamber chamber;
  const Constraints& c = chamber.constraints;
  const Eigen::VectorXd x = 1.01 * chamber.model.rest();
  const Eigen::VectorXd efforts = Eigen::VectorXd::Ones(c.actuators());
  StiffnessMatrix K = chamber.model.make_stiffness(c.cliques());
  Eigen::MatrixXd J_aT(chamber.model.unknowns(), c.actuators());
  Eigen::MatrixXd J_eT(chamber.model.unknowns(), c.effector_coordinates());
  Eigen::VectorXd delta_a, p_e, lambda = Eigen::VectorXd::Zero(c.actuators());
  c.displacement(x, delta_a);
  c.effector_position(x, p_e);
  c.actuator_directions(x, J_aT);
  const Eigen::MatrixXd W_aa = J_aT.transpose() * J_aT;
  const Eigen::VectorXd imposed = -delta_a;

  const rt::HeapGuard heap;
  c.displacement(x, delta_a);
  c.effector_position(x, p_e);
  c.actuator_directions(x, J_aT);
  c.effector_directions(x, J_eT);
  c.add_stiffness(x, efforts, Tangent::kExact, K);
  c.add_stiffness(x, efforts, Tangent::kSemidefinite, K);
  const bool found = solve_efforts(W_aa, delta_a, imposed, c.pull_only(), lambda);
  const auto calls = heap.calls();
  CHECK(found);
  CHECK(calls == 0);
}

}  // namespace tendril::fem::heap_test
