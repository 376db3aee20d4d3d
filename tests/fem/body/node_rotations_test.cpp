// SPDX-License-Identifier: Apache-2.0
#include "fem/body/node_rotations.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include "tests/fem/body/bodies.h"

namespace tendril::fem::node_rotations_test {

TEST_CASE("A body that turns as a whole turns around each node, however little else is near it", "[law]") {
  const unsigned seed = 1;
  std::mt19937 random(seed);
  CAPTURE(seed);
  const auto [nx, ny, nz] = GENERATE(std::array{6, 2, 2}, std::array{1, 1, 1});
  const Model model = testing::beam_model(testing::beam(nx, ny, nz, 0.01));
  const StiffnessMatrix pattern = model.make_stiffness({});
  NodeRotations rotations(model.free_nodes());
  for (const double angle : {0.0, 0.1, 2.0}) {
    CAPTURE(angle, nx);
    const Eigen::Matrix3d Q =
        Eigen::AngleAxisd(angle, testing::random_vector(random, 3, 1.0).head<3>().normalized())
            .toRotationMatrix();
    const Eigen::VectorXd& from = model.rest();
    const Eigen::VectorXd to =
        ((Q * from.reshaped(3, model.free_nodes())).colwise() + Eigen::Vector3d(0.1, 0, 0)).reshaped();
    rotations.compute(pattern, from, to);
    for (int i = 0; i < model.free_nodes(); ++i) CHECK((rotations[i] - Q).norm() < 1e-10);

    const EightVectors V =
        testing::random_vector(random, 8 * pattern.size(), 1.0).reshaped(8, pattern.size());
    EightVectors turned = V;
    rotations.rotate(turned);
    CHECK((turned.row(5).reshaped(3, pattern.nodes()) - Q * V.row(5).reshaped(3, pattern.nodes())).norm() <
          1e-9);
    rotations.rotate_back(turned);
    CHECK((turned - V).norm() < 1e-9);
  }
}

}  // namespace tendril::fem::node_rotations_test
