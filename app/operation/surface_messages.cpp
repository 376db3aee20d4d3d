// SPDX-License-Identifier: Apache-2.0
#include "app/operation/surface_messages.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace tendril::app {
namespace {

constexpr float kSteps = 65'535;  // of 16 bits

}  // namespace

std::string base64(std::string_view bytes) {
  static constexpr char kLetters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - k);
    uint32_t three = 0;
    for (std::size_t b = 0; b < 3; ++b)
      three = three << 8 | (b < count ? static_cast<uint8_t>(bytes[k + b]) : 0U);
    for (std::size_t letter = 0; letter < 4; ++letter)
      text += letter <= count ? kLetters[three >> (18 - 6 * letter) & 63] : '=';
  }
  return text;
}

std::string surface_message(const rt::Surface& surface) {
  Eigen::Vector3f origin = Eigen::Vector3f::Zero();
  float step = 1;
  if (surface.positions.cols() > 0) {
    origin = surface.positions.rowwise().minCoeff();
    const float size = (surface.positions.rowwise().maxCoeff() - origin).maxCoeff();
    if (size > 0) step = size / kSteps;
  }
  std::string bytes;
  bytes.reserve(static_cast<std::size_t>(2 * surface.positions.size()));
  for (Eigen::Index point = 0; point < surface.positions.cols(); ++point)
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const float steps = std::round((surface.positions(axis, point) - origin[axis]) / step);
      const auto number = static_cast<uint16_t>(std::clamp(steps, 0.0F, kSteps));
      bytes += static_cast<char>(number & 0xFF);
      bytes += static_cast<char>(number >> 8);
    }
  return fmt::format(
      R"({{"surface":{{"time":{:.6f},"origin":[{:.9g},{:.9g},{:.9g}],"step":{:.9g},"positions":"{}"}}}})",
      1e-9 * static_cast<double>(surface.stamp_ns), origin.x(), origin.y(), origin.z(), step, base64(bytes));
}

}  // namespace tendril::app
