// SPDX-License-Identifier: Apache-2.0
#include "tests/validation/cases.h"

namespace tendril::validation {

const std::vector<Case>& cases() {
  static const std::vector<Case> kCases = {
      {"patch", "Patch test, free modes, rigid turns", patch},
      {"cantilever", "Cantilever under a small end load", cantilever},
      {"lame", "Hollow sphere under inner pressure", lame},
      {"locking", "Rubber that hardly changes its volume", locking},
      {"elastica", "Large deflection of a slender cantilever", elastica},
      {"vibration", "Free vibration of a cantilever", vibration},
      {"references", "The paper's robot, computed elsewhere", references},
      {"calculix", "Node by node against CalculiX", calculix},
  };
  return kCases;
}

}  // namespace tendril::validation
