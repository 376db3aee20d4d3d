// SPDX-License-Identifier: Apache-2.0
#include "fem/mesh/mesh_formats.h"
#include "tests/fuzz/inputs.h"

namespace tendril::fuzz {
namespace {

template <class Reader>
bool read_or_refuse(Reader reader, const std::string& text) {
  try {
    check(reader(text, "fuzzed"));
    return true;
  } catch (const fem::MeshError&) {
    return false;
  }
}

}  // namespace

bool feed_msh(const std::string& bytes) { return read_or_refuse(fem::read_gmsh, bytes); }
bool feed_vtu(const std::string& bytes) { return read_or_refuse(fem::read_vtu, bytes); }
bool feed_vtk(const std::string& bytes) { return read_or_refuse(fem::read_vtk_legacy, bytes); }

}  // namespace tendril::fuzz
