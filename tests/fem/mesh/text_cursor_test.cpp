// SPDX-License-Identifier: Apache-2.0
#include "fem/mesh/text_cursor.h"

#include <catch2/catch.hpp>
#include <limits>

#include "fem/mesh/mesh_formats.h"
#include "tests/fem/mesh/mesh_files.h"

namespace tendril::fem::text_cursor_test {

using Catch::Matchers::Contains;
using testing::edited;
using testing::kMsh;

TEST_CASE("Numbers may be written with a plus sign, as Fortran writes them, or smaller than a double",
          "[unit]") {
  const auto number = [](const char* word) {
    double value = -1;
    CAPTURE(word);
    CHECK(parse_number(word, value));
    return value;
  };
  CHECK(number("+10.0") == 10);
  CHECK(number("1.0D+01") == 10);
  CHECK(number("-2.5d-3") == -0.0025);
  CHECK(number("+1e+2") == 100);
  CHECK(number("1e-310") == 1e-310);
  CHECK(number("4.9e-324") == std::numeric_limits<double>::denorm_min());
  CHECK(number("-1e-400") == 0);
  int whole = 0;
  CHECK((parse_number("+7", whole) && whole == 7));
  CHECK((parse_number("-7", whole) && whole == -7));

  double value = 0;
  for (const char* wrong :
       {"", "+", "+-1", "++1", "1e400", "1e", "1.0D+0.3", "1D2D", "0x10", "1,5", "1.5mm"}) {
    CAPTURE(wrong);
    CHECK_FALSE(parse_number(wrong, value));
  }
  for (const char* wrong : {"1.5", "99999999999", "1D2", "+"}) CHECK_FALSE(parse_number(wrong, whole));
}

TEST_CASE("A mesh file may hold such numbers", "[unit]") {
  const Mesh mesh = read_gmsh(edited(kMsh, "1000 0 0", "+1.0D+03 1e-310 -2.5d-400"), "a.msh");
  CHECK(mesh.nodes.col(1) == Eigen::Vector3d(1000, 1e-310, 0));
  CHECK_THAT(testing::refusal([] { read_gmsh(edited(kMsh, "1000 0 0", "1e400 0 0"), "a.msh"); }),
             Contains("a.msh:21: found '1e400', expected a coordinate"));
}

}  // namespace tendril::fem::text_cursor_test
