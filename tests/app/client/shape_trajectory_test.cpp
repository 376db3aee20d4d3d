// SPDX-License-Identifier: Apache-2.0
#include "app/client/shape_trajectory.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "app/config/config_error.h"

namespace tendril::app::shape_trajectory_test {

const std::vector<std::string> kCoordinates{"tip.x", "tip.y", "chamber.volume"};

ShapeRequest request(Shape shape) {
  ShapeRequest result;
  result.shape = shape;
  result.layout.size = {0.02, 0.02};
  result.centre = {0.1, 0.2};
  result.speed = 0.025;
  result.turns = 2;
  return result;
}

TEST_CASE("A shape is passed at its speed, from rest to rest, and ends where it began", "[unit]") {
  const Shape shape =
      GENERATE(Shape::kCircle, Shape::kSquare, Shape::kLine, Shape::kEight, Shape::kLissajous);
  CAPTURE(static_cast<int>(shape));
  const Trajectory way = shape_trajectory(request(shape), "tip", kCoordinates);
  CHECK(way.names() == std::vector<std::string>{"tip.x", "tip.y"});
  const auto distance = [&](double from_s, double to_s) {
    return std::hypot(way.at(to_s)[0] - way.at(from_s)[0], way.at(to_s)[1] - way.at(from_s)[1]);
  };
  CHECK(distance(0, way.duration_s()) < 1e-12);
  constexpr double h = 1e-3;
  double fastest = 0, widest = 0;
  for (double t = 0; t < way.duration_s(); t += h) {
    fastest = std::max(fastest, distance(t, t + h) / h);
    widest = std::max(widest, std::abs(way.at(t)[0] - 0.1));
  }
  CHECK(fastest == Approx(0.025).epsilon(1e-3));
  CHECK(widest == Approx(0.01).epsilon(1e-3));
  CHECK(distance(0, 0.05) < 0.025 * 0.05 / 4);  // 0.5 s to the speed
}

TEST_CASE("A circle has its radius and its time", "[unit]") {
  const Trajectory way = shape_trajectory(request(Shape::kCircle), "tip", kCoordinates);
  CHECK(way.duration_s() == Approx(2 * 2 * M_PI * 0.01 / 0.025 + 0.5).epsilon(1e-4));
  for (double t = 0; t < way.duration_s(); t += 0.01)
    REQUIRE(std::hypot(way.at(t)[0] - 0.1, way.at(t)[1] - 0.2) == Approx(0.01).epsilon(1e-4));
  CHECK(way.at(0)[0] == Approx(0.11));
}

TEST_CASE("A shape in a plane that the robot does not control is refused", "[unit]") {
  ShapeRequest wrong = request(Shape::kCircle);
  wrong.layout.plane = {0, 2};
  CHECK_THROWS_WITH(shape_trajectory(wrong, "tip", kCoordinates), Catch::Contains("tip.z"));
}

}  // namespace tendril::app::shape_trajectory_test
