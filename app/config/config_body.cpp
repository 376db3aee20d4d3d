// SPDX-License-Identifier: Apache-2.0
#include "app/config/config_body.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>
#include <system_error>

namespace tendril::app {
namespace {

constexpr double kVolumeWeight = 1000;  // 1/m²: an error of 1 ml counts as much as one of 1 mm

void read_mesh_file(const Value& v, MeshConfig& mesh) {
  mesh.line = v.line();
  mesh.file = v.folder() / v.text("the path of a mesh file");
  std::error_code absent;
  if (!std::filesystem::is_regular_file(mesh.file, absent)) {
    v.fail("a mesh file, but there is no " + mesh.file.string());
  }
}

void read_length_unit(const Value& v, double& metres) {
  const std::string expected = "a unit of length (" + units_of(Dimension::kLength) + ")";
  if (!parse_quantity("1 " + v.text(expected), Dimension::kLength, {&metres, 1})) v.fail(expected);
}

/// "90 deg about x": a turn about an axis of the robot's frame, by the right hand.
void read_turn(const Value& v, Eigen::Matrix3d& R) {
  constexpr std::string_view kAbout = " about ";
  constexpr std::string_view kAxes = "xyz";
  const std::string expected =
      "an angle (" + units_of(Dimension::kAngle) + ") about x, y or z, as in '90 deg about x'";
  const std::string text = v.text(expected);
  const std::size_t about = text.find(kAbout);
  const std::string axis = about == std::string::npos ? "" : text.substr(about + kAbout.size());
  double angle = 0;
  if (axis.size() != 1 || kAxes.find(axis) == std::string::npos ||
      !parse_quantity(text.substr(0, about), Dimension::kAngle, {&angle, 1})) {
    v.fail(expected);
  }
  R = Eigen::AngleAxisd(angle, Eigen::Vector3d::Unit(Eigen::Index(kAxes.find(axis)))).toRotationMatrix();
}

/// Young's modulus and Poisson's ratio, the law and the dilatation where they are given.
void read_elasticity(Reader& r, fem::Material& material) {
  r.need("young_modulus", material.young_modulus, Dimension::kPressure, kPositive);
  r.need("poisson_ratio", material.poisson_ratio, Dimension::kNumber, kPoissonRatio);
  Words<fem::Law> laws;
  for (const fem::Law law : fem::kLaws) laws.emplace_back(name(law), law);
  r.may("law", material.law, laws);
  r.may("dilatation", material.dilatation,
        Words<fem::Dilatation>{{"element", fem::Dilatation::kElement}, {"patches", fem::Dilatation::kPatch}});
}

void read_sphere(const Value& v, fem::Sphere& sphere) {
  const std::string expected =
      "x, y, z of the centre and the radius above 0, " + describe_quantity(4, Dimension::kLength);
  std::array<double, 4> numbers = {};
  if (!parse_quantity(v.text(expected), Dimension::kLength, numbers) || !(numbers[3] > 0)) v.fail(expected);
  sphere = {{numbers[0], numbers[1], numbers[2]}, numbers[3]};
}

void read_space(Reader& r, RegionConfig& region) {
  if (r.one_of({"box", "sphere"}) == "box") {
    fem::Box box{};
    r.may("box", box.lower, box.upper, Dimension::kLength);
    region.where = box;
  } else {
    fem::Sphere sphere{};
    r.may("sphere", sphere, read_sphere);
    region.where = sphere;
  }
}

void read_body_point(const Value& v, PointConfig& point) {
  point.line = v.line();
  v.read(point.at, Dimension::kLength);
}

/// "body 0 97 45 mm" or "guide 0 10 30 mm".
void read_end(const Value& v, PointConfig& point) {
  const std::string expected = "body or guide, then " + describe_quantity(3, Dimension::kLength);
  const std::string text = v.text(expected);
  const std::size_t blank = std::min(text.find(' '), text.size());
  const std::string kind = text.substr(0, blank);
  point.line = v.line();
  point.on_body = kind == "body";
  if ((kind != "body" && kind != "guide") ||
      !parse_quantity(text.substr(blank), Dimension::kLength, {point.at.data(), 3})) {
    v.fail(expected);
  }
}

void read_rod(const Value& v, RodConfig& rod) {
  std::vector<PointConfig> ends;
  v.read(ends, read_end);
  if (ends.size() != 2) v.fail("two points, the rod's ends");
  rod = {ends[0], ends[1]};
}

void read_direction(const Value& v, Eigen::Vector3d& direction) {
  v.read(direction, Dimension::kNumber);
  if (!(direction.norm() > 0)) v.fail("three numbers that are not all 0");
  direction.normalize();
}

/// Some of the letters x, y and z, each at most once.
void read_coordinates(const Value& v, std::array<bool, 3>& controlled) {
  constexpr std::string_view kExpected = "the controlled coordinates, as in xyz, xy or z";
  controlled = {};
  for (const char letter : v.text(kExpected)) {
    const std::size_t axis = std::string_view("xyz").find(letter);
    if (axis == std::string_view::npos || controlled[axis]) v.fail(kExpected);
    controlled[axis] = true;
  }
}

/// One number for all controlled coordinates, or one for each.
void read_weights(const Value& v, EffectorConfig& effector) {
  double weight = 0;
  if (v.is_list()) {
    effector.weights.clear();
    v.read(effector.weights, Dimension::kNumber, kNotNegative);
  } else {
    v.read(weight, Dimension::kNumber, kNotNegative);
    effector.weights.assign(effector.weights.size(), weight);
  }
  if (static_cast<int>(effector.weights.size()) != effector.coordinates())
    v.fail(fmt::format("a number, or one for each of the {} controlled coordinates", effector.coordinates()));
}

void read_cavity(Reader& r, ActuatorConfig& actuator, const SpokenProtocol& protocol) {
  r.may("cavity", actuator.kind.emplace<CavityConfig>().region, read_region);
  r.need("pressure", actuator.effort_min, actuator.effort_max, Dimension::kPressure);
  r.need("growth", actuator, [](const Value& v, ActuatorConfig& filled) {
    std::get<CavityConfig>(filled.kind).growth_line = v.line();
    v.read(filled.displacement_min, filled.displacement_max, Dimension::kVolume);
  });
  r.need("top_flow", actuator.top_rate, Dimension::kFlow, kPositive);
  r.need("drive", actuator.drive, drive_of(protocol, "volume_per_turn", Dimension::kVolume));
}

void read_travel(Reader& r, ActuatorConfig& actuator) {
  r.need("stroke", actuator.displacement_min, actuator.displacement_max, Dimension::kLength);
  r.need("top_speed", actuator.top_rate, Dimension::kSpeed, kPositive);
}

void read_cable(Reader& r, ActuatorConfig& actuator, const SpokenProtocol& protocol) {
  r.may("cable", actuator.kind.emplace<CableConfig>().points, read_end);
  r.need("tension", actuator.effort_min, actuator.effort_max, Dimension::kForce, kNotNegative);
  read_travel(r, actuator);
  r.need("drive", actuator.drive,
         drive_of(protocol, "pulley_radius", Dimension::kLength, 2 * std::numbers::pi));
}

/// A rod or a force, which push as well as they pull.
void read_thrust(Reader& r, ActuatorConfig& actuator, const SpokenProtocol& protocol, bool is_rod) {
  if (is_rod) {
    r.may("rod", actuator.kind.emplace<RodConfig>(), read_rod);
  } else {
    ForceConfig& force = actuator.kind.emplace<ForceConfig>();
    r.may("push", force.at, read_body_point);
    r.need("direction", force.direction, read_direction);
  }
  r.need("force", actuator.effort_min, actuator.effort_max, Dimension::kForce);
  read_travel(r, actuator);
  r.need("drive", actuator.drive, drive_of(protocol, "lead", Dimension::kLength));
}

}  // namespace

void read_name(const Value& v, std::string& name) {
  constexpr std::string_view kAllowed = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-";
  name = v.text("a name");
  if (name.find_first_not_of(kAllowed) != std::string::npos) {
    v.fail("a name of letters, digits, _ and - only");
  }
}

void read_mesh(Reader& r, MeshConfig& mesh) {
  r.need("file", mesh, read_mesh_file);
  r.may("unit", mesh.unit, read_length_unit);
  r.may("rotate", mesh.rotation, read_turn);
  r.may("translate", mesh.translation, Dimension::kLength);
}

void read_material(Reader& r, MaterialConfig& material) {
  read_elasticity(r, material.material);
  r.need("mass", material.mass, Dimension::kMass, kPositive);
  r.may("mass_distribution", material.mass_per_node, Words<bool>{{"volume", false}, {"nodes", true}});
  r.may("regions", material.regions, [&](Reader& section, MaterialRegionConfig& region) {
    region.material = material.material;
    section.need("where", region.where, read_region);
    read_elasticity(section, region.material);
    section.may("mass", region.mass, Dimension::kMass, kPositive);
  });
}

void read_load(Reader& r, LoadConfig& load) {
  r.need("at", load.at, read_body_point);
  r.need("force", load.force, Dimension::kForce);
}

void read_region(const Value& v, RegionConfig& region) {
  region.line = v.line();
  if (v.is_mapping()) {
    v.read(region, read_space);
  } else {
    region.where = v.text("the name of a region of the mesh, or a mapping with a box or a sphere");
  }
}

void read_effector(Reader& r, EffectorConfig& effector) {
  r.need("name", effector.name, read_name);
  const std::string_view kind = r.one_of({"point", "points", "cavity"});
  if (kind == "cavity") {
    r.may("cavity", effector.cavity, read_region);
  } else {
    if (kind == "point") r.may("point", effector.points.emplace_back(), read_body_point);
    if (kind == "points") r.may("points", effector.points, read_body_point);
    r.may("coordinates", effector.controlled, read_coordinates);
  }
  effector.weights.assign(static_cast<std::size_t>(effector.coordinates()),
                          effector.cavity ? kVolumeWeight : 1.0);
  r.may("weight", effector, read_weights);
}

void read_actuator(Reader& r, ActuatorConfig& actuator, const SpokenProtocol& protocol) {
  r.need("name", actuator.name, read_name);
  const std::string_view kind = r.one_of({"cable", "rod", "push", "cavity"});
  if (kind == "cable") {
    read_cable(r, actuator, protocol);
  } else if (kind == "cavity") {
    read_cavity(r, actuator, protocol);
  } else {
    read_thrust(r, actuator, protocol, kind == "rod");
  }
}

}  // namespace tendril::app
