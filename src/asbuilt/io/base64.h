// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace asbuilt::io {

/// Base64 with padding, without line breaks (RFC 4648, section 4).
[[nodiscard]] std::string base64(std::span<const std::byte> bytes);

/// An array as the JSON object {"type": "u16|u32|f32", "count": N, "data": BASE64 of the little-endian values}, ready
/// to be put into a JSON text.
[[nodiscard]] std::string packed_json(std::span<const std::uint16_t> values);
[[nodiscard]] std::string packed_json(std::span<const std::uint32_t> values);
[[nodiscard]] std::string packed_json(std::span<const float> values);

/// Positions quantised to 16 bits an axis between the corners of their box, x y z in turn: "count" is three a position,
/// and "min" and "max" say where 0 and 65535 lie.
[[nodiscard]] std::string packed_positions_json(std::span<const Eigen::Vector3d> positions);

}  // namespace asbuilt::io
