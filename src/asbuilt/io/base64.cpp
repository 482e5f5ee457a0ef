// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/base64.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <string_view>
#include <vector>

namespace asbuilt::io {
namespace {

constexpr std::string_view kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

template <class Value>
std::string little_endian_base64(std::span<const Value> values) {
  static_assert(std::endian::native == std::endian::little, "values would have to be turned round");
  return base64(std::as_bytes(values));
}

template <class Value>
std::string packed(std::string_view type, std::span<const Value> values) {
  return fmt::format(R"({{"type": "{}", "count": {}, "data": "{}"}})", type, values.size(),
                     little_endian_base64(values));
}

std::string triple(const Eigen::Vector3d& v) { return fmt::format("[{}, {}, {}]", v.x(), v.y(), v.z()); }

}  // namespace

std::string base64(std::span<const std::byte> bytes) {
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t present = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      word = (word << 8) | (k < present ? std::to_integer<std::uint32_t>(bytes[i + k]) : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      text += k <= present ? kAlphabet[(word >> (18 - 6 * k)) & 63U] : '=';
    }
  }
  return text;
}

std::string packed_json(std::span<const std::uint16_t> values) { return packed("u16", values); }
std::string packed_json(std::span<const std::uint32_t> values) { return packed("u32", values); }
std::string packed_json(std::span<const float> values) { return packed("f32", values); }

std::string packed_positions_json(std::span<const Eigen::Vector3d> positions) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& position : positions) box.extend(position);
  if (box.isEmpty()) box.extend(Eigen::Vector3d::Zero());
  std::vector<std::uint16_t> quantised;
  quantised.reserve(3 * positions.size());
  for (const Eigen::Vector3d& position : positions) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const double extent = box.sizes()[axis];
      const double share = extent > 0.0 ? (position[axis] - box.min()[axis]) / extent : 0.0;
      quantised.push_back(static_cast<std::uint16_t>(std::lround(65535.0 * share)));
    }
  }
  return fmt::format(R"({{"type": "u16", "count": {}, "min": {}, "max": {}, "data": "{}"}})", quantised.size(),
                     triple(box.min()), triple(box.max()),
                     little_endian_base64(std::span<const std::uint16_t>(quantised)));
}

}  // namespace asbuilt::io
