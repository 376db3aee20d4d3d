// SPDX-License-Identifier: Apache-2.0
#include "fem/body/attachment.h"

#include <catch2/catch.hpp>

#include "tests/fem/body/bodies.h"

namespace tendril::fem::attachment_test {

using Catch::Matchers::Contains;

Eigen::Vector3d place(const Mesh& mesh, const Attachment& at) {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  for (int k = 0; k < 4; ++k) p += at.weights[k] * mesh.nodes.col(at.nodes[k]);
  return p;
}

TEST_CASE("A point inside the mesh is the weighted mean of the corners around it", "[law]") {
  const Mesh mesh = testing::beam(4, 2, 2, 0.01);
  std::mt19937 random(7);
  for (int k = 0; k < 100; ++k) {
    const Eigen::Vector3d inside =
        Eigen::Vector3d(0.02, 0.01, 0.01) +
        testing::random_vector(random, 3, 1).cwiseProduct(Eigen::Vector3d(0.02, 0.01, 0.01));
    const Attachment at = attach(mesh, inside, 0);
    CHECK((place(mesh, at) - inside).norm() < 1e-15);
    for (double weight : at.weights) CHECK(weight > -1e-9);
  }
}

TEST_CASE("A point on the surface, an edge or a node is inside", "[law]") {
  const Mesh mesh = testing::beam(2, 1, 1, 0.01);
  for (const Eigen::Vector3d& p : {Eigen::Vector3d(0.004, 0.003, 0.01), {0.02, 0.01, 0.004}, {0.01, 0, 0}})
    CHECK((place(mesh, attach(mesh, p, 0)) - p).norm() < 1e-15);
}

TEST_CASE("A point outside is refused with its distance, or attached within the snap distance", "[law]") {
  const Mesh mesh = testing::beam(2, 1, 1, 0.01);
  const Eigen::Vector3d above(0.005, 0.005, 0.013);
  CHECK_THROWS_WITH(attach(mesh, above, 0), Contains("(5, 5, 13) mm lies 3 mm outside the mesh") &&
                                                Contains("nearest point of the body is (5, 5, 10) mm"));
  CHECK_THROWS_WITH(attach(mesh, above, 0.0029), Contains("3 mm outside"));
  const Eigen::Vector3d off_corner(0.023, 0.014, 0.005);
  CHECK_THROWS_WITH(attach(mesh, off_corner, 0.0049), Contains("5 mm outside"));
  CHECK((place(mesh, attach(mesh, off_corner, 0.0051)) - off_corner).norm() < 1e-15);
}

TEST_CASE("A point farther outside than elements are high moves to the nearest place of the body", "[law]") {
  const Mesh mesh = testing::beam(2, 1, 1, 0.01);
  const Eigen::Vector3d near(0.005, 0.004, 0.019), far(0.005, 0.004, 0.031);
  CHECK((place(mesh, attach(mesh, near, 0.01)) - near).norm() < 1e-15);
  const Attachment at = attach(mesh, far, 0.03);
  CHECK((place(mesh, at) - Eigen::Vector3d(0.005, 0.004, 0.010)).norm() < 1e-15);
  for (double weight : at.weights) CHECK((weight > -1e-9 && weight < 1 + 1e-9));
}

}  // namespace tendril::fem::attachment_test
