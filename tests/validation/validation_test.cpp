// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>

#include "tests/validation/cases.h"

// The validation cases in their short form. tools/validate runs them in full and draws them.

namespace tendril::validation::validation_test {

void hold(void (*run)(Report&, Extent)) {
  Report report;
  run(report, Extent::kShort);
  for (const std::string& why : report.reasons_skipped()) WARN("skipped: " << why);
  for (const Row& row : report.rows()) {
    INFO(row.what << ": " << row.value << ' ' << row.unit << ", expected " << row.at_least.value_or(-INFINITY)
                  << " to " << row.at_most.value_or(INFINITY));
    CHECK(row.passed());
  }
}

TEST_CASE("Every law carries uniform deformation, and resists no rigid motion", "[law]") { hold(patch); }
TEST_CASE("A cantilever's small deflection converges to Timoshenko's", "[law]") { hold(cantilever); }
TEST_CASE("A hollow sphere under pressure converges to Lamé's solution", "[law]") { hold(lame); }
TEST_CASE("Patches keep rubber that hardly changes its volume from locking", "[law]") { hold(locking); }
TEST_CASE("A slender cantilever bends far as the elastica does", "[law]") { hold(elastica); }
TEST_CASE("The paper's robot rests, and reaches its goals, as in computations of others", "[law]") {
  hold(references);
}
TEST_CASE("A cantilever swings at the beam theory's frequency and loses what backward Euler takes", "[law]") {
  hold(vibration);
}

}  // namespace tendril::validation::validation_test
