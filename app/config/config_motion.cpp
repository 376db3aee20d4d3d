// SPDX-License-Identifier: Apache-2.0
#include "app/config/config_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <utility>

#include "app/config/shape.h"

namespace tendril::app {
namespace {

constexpr int kMostTurns = 10'000;
// A path within limits keeps all corners of all turns.
constexpr std::size_t kMostCorners = 10'000;

/// The place of the effector that has that name; one that has positions.
void read_effector_name(const Value& v, const std::vector<EffectorConfig>& effectors, int& index) {
  const std::string name = v.text("the name of an effector");
  const auto found = std::ranges::find(effectors, name, &EffectorConfig::name);
  if (found == effectors.end()) v.fail("the name of an effector");
  if (found->cavity) v.fail("an effector of points, as waypoints are positions");
  index = static_cast<int>(found - effectors.begin());
}

void read_pair(const Value& v, std::array<double, 2>& pair) {
  constexpr std::string_view kExpected = "two whole numbers from 1 to 20, as in [3, 2]";
  if (!v.is_list() || v.items().size() != 2) v.fail(kExpected);
  for (std::size_t k = 0; k < 2; ++k) {
    int number = 0;
    v.at(k).read(number, Range{.at_least = 1, .at_most = 20});
    pair[k] = number;
  }
}

void read_size(const Value& v, Shape shape, std::array<double, 2>& size) {
  constexpr std::string_view kExpected =
      "two lengths, width and height along the plane's axes, as in '20 20 mm'";
  if (!parse_quantity(v.text(kExpected), Dimension::kLength, size)) v.fail(kExpected);
  const bool flat = size[0] == 0 || size[1] == 0;
  const bool good = std::ranges::all_of(size, [](double side) { return side >= 0; });
  if (!good || (size[0] == 0 && size[1] == 0)) v.fail("lengths of at least 0, not both 0");
  if (flat && shape != Shape::kLine) v.fail("lengths above 0; only a line may be 0 wide or high");
}

void read_shape(Reader& r, MotionConfig& motion) {
  std::optional<Shape> shape;
  Layout layout;
  r.may("shape", shape, Words<Shape>(kShapes.begin(), kShapes.end()));
  r.may("size", layout.size, [&](const Value& v, std::array<double, 2>& size) {
    read_size(v, shape.value_or(Shape::kLine), size);
  });
  r.may("plane", layout.plane, Words<std::pair<int, int>>(kPlanes.begin(), kPlanes.end()));
  r.may("frequencies", layout.frequencies, read_pair);
  if (!shape) {
    for (const char* key : {"size", "plane", "frequencies"})
      if (r.has(key)) r.at(key).fail("no such key without a shape");
    return;
  }
  if (!r.has("size")) r.at("size").fail("the size of the shape, two lengths");
  if (r.has("frequencies") && shape != Shape::kLissajous)
    r.at("frequencies").fail("no such key: only a shape lissajous has it");
  if (r.has("closed"))
    r.at("closed").fail("no such key: a shape is closed; turns says how often it is passed");
  motion.curve = curve_of(*shape, layout);
  motion.waypoints = waypoints_of(*shape, layout);
}

}  // namespace

void read_motion(Reader& r, MotionConfig& motion, const std::vector<EffectorConfig>& effectors) {
  r.need("origin", motion.origin, Dimension::kLength);
  if (r.one_of({"waypoints", "shape"}) == "waypoints")
    r.may("waypoints", motion.waypoints, Dimension::kLength);
  r.need("speed", motion.speed, Dimension::kSpeed, kPositive);
  r.may("acceleration", motion.acceleration, Dimension::kAcceleration, kPositive);
  r.may("jerk", motion.jerk, Dimension::kJerk, kPositive);
  r.may("corners", motion.corners, Dimension::kLength, kNotNegative);
  r.may("closed", motion.closed);
  r.may("turns", motion.turns, Range{.at_least = 1, .at_most = kMostTurns});
  r.may("effector", motion.effector,
        [&](const Value& v, int& index) { read_effector_name(v, effectors, index); });
  for (const char* key : {"jerk", "corners"})
    if (r.has(key) && !motion.acceleration) r.at(key).fail("an acceleration beside it");
  if (r.has("turns") && !motion.closed) r.at("turns").fail("a closed path");
  read_shape(r, motion);
  if (motion.turns && !motion.curve &&
      motion.waypoints.size() * static_cast<std::size_t>(*motion.turns) > kMostCorners)
    r.at("turns").fail(fmt::format("at most {} waypoints in all turns", kMostCorners));
}

}  // namespace tendril::app
