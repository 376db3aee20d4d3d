// SPDX-License-Identifier: Apache-2.0
#include "tests/validation/calculix_job.h"

#include <fmt/format.h>
#include <fmt/ostream.h>
#include <stdlib.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace tendril::validation {
namespace {

// CalculiX knows no units: with mm, N and MPa its numbers are of a size that its output tells well.
constexpr double kMillimetres = 1e3, kMegapascals = 1e-6;

/// The material in CalculiX's terms. *ELASTIC under NLGEOM is linear between Green-Lagrange strain and second
/// Piola-Kirchhoff stress, the material of St Venant and Kirchhoff; NEO HOOKE is
/// U = C10 (J^(-2/3) tr C − 3) + (J − 1)²/D1, which agrees with μ and the bulk modulus K for C10 = μ/2, D1 =
/// 2/K.
std::string material_lines(const fem::Material& material) {
  const double E = kMegapascals * material.young_modulus;
  if (material.law == fem::Law::of<fem::CorotationalElement>())
    return fmt::format("*ELASTIC\n{},{}\n", E, material.poisson_ratio);
  if (material.law != fem::Law::of<fem::NeoHookeanElement>())
    throw std::invalid_argument(fmt::format("CalculiX has no law like {}", name(material.law)));
  const double mu = kMegapascals * material.lame_mu();
  const double bulk = kMegapascals * material.lame_lambda() + 2 * mu / 3;
  return fmt::format("*HYPERELASTIC,NEO HOOKE\n{},{}\n", mu / 2, 2 / bulk);
}

void write_input(const CalculixJob& job, const std::filesystem::path& file) {
  const fem::Mesh& mesh = job.model.mesh();
  std::ofstream out(file);
  out << "*NODE,NSET=ALL\n";
  for (int i = 0; i < mesh.node_count(); ++i) {
    const Eigen::Vector3d p = kMillimetres * mesh.nodes.col(i);
    fmt::print(out, "{},{:.12e},{:.12e},{:.12e}\n", i + 1, p.x(), p.y(), p.z());
  }
  out << "*ELEMENT,TYPE=C3D4,ELSET=BODY\n";
  for (int t = 0; t < mesh.tet_count(); ++t)
    fmt::print(out, "{},{},{},{},{}\n", t + 1, mesh.tets[t][0] + 1, mesh.tets[t][1] + 1, mesh.tets[t][2] + 1,
               mesh.tets[t][3] + 1);
  out << "*BOUNDARY\n";
  for (int i = job.model.free_nodes(); i < mesh.node_count(); ++i) fmt::print(out, "{},1,3\n", i + 1);
  out << "*MATERIAL,NAME=RUBBER\n" << material_lines(job.material);
  out << "*SOLID SECTION,ELSET=BODY,MATERIAL=RUBBER\n";
  for (const auto& load : job.loads) {
    // The defaults end an iteration at a residual of half a percent; these at a millionth.
    out << "*STEP,NLGEOM,INC=1000\n*CONTROLS,PARAMETERS=FIELD\n1e-6,1e-6\n*STATIC\n0.25,1\n*CLOAD\n";
    for (int i = 0; i < job.model.free_nodes(); ++i)
      for (int c = 0; c < 3; ++c) fmt::print(out, "{},{},{:.12e}\n", i + 1, c + 1, load[3 * i + c]);
    out << "*NODE PRINT,NSET=ALL,FREQUENCY=1000\nU\n*END STEP\n";
  }
}

/// Blocks of lines "node ux uy uz" under a heading that begins with "displacements".
std::vector<Eigen::VectorXd> read_displacements(const CalculixJob& job, const std::filesystem::path& file) {
  std::ifstream in(file);
  std::vector<Eigen::VectorXd> steps;
  std::string line;
  while (std::getline(in, line)) {
    if (line.find("displacements") != std::string::npos)
      steps.emplace_back(Eigen::VectorXd::Constant(job.model.unknowns(), NAN));
    std::istringstream cells(line);
    int node = 0;
    Eigen::Vector3d u;
    if (!steps.empty() && cells >> node >> u[0] >> u[1] >> u[2] && node <= job.model.free_nodes())
      steps.back().segment<3>(3 * (node - 1)) = u / kMillimetres;
  }
  return steps;
}

}  // namespace

bool calculix_is_here() { return std::system("command -v ccx >/dev/null 2>&1") == 0; }

std::vector<Eigen::VectorXd> CalculixJob::run() const {
  std::string name = std::filesystem::temp_directory_path() / "tendril-calculix-XXXXXX";
  if (!::mkdtemp(name.data())) throw std::runtime_error("cannot make a folder like " + name);
  const std::filesystem::path folder = name;
  write_input(*this, folder / "job.inp");
  const int status = std::system(fmt::format("cd '{}' && ccx -i job >job.log 2>&1", folder.string()).c_str());
  const auto steps = read_displacements(*this, folder / "job.dat");
  if (status != 0 || steps.size() != loads.size())
    throw std::runtime_error(fmt::format("ccx solved {} of {} load steps; see {}", steps.size(), loads.size(),
                                         (folder / "job.log").string()));
  std::filesystem::remove_all(folder);
  return steps;
}

}  // namespace tendril::validation
