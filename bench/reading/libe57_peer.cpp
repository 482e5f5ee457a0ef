// SPDX-License-Identifier: Apache-2.0
#include <E57SimpleReader.h>
#include <E57SimpleWriter.h>

#include "peers.h"

namespace asbuilt::bench {

std::optional<PeerPoints> read_with_libe57(const std::string& path) {
  if (!path.ends_with(".e57")) return std::nullopt;
  e57::Reader reader(path, {});
  e57::Data3D header;
  if (!reader.ReadData3D(0, header)) return std::nullopt;
  // Coordinates alone, in one piece: the least that it can be asked for.
  PeerPoints points;
  const auto count = static_cast<std::size_t>(header.pointCount);
  points.x.resize(count), points.y.resize(count), points.z.resize(count);
  e57::Data3DPointsFloat buffers;
  buffers.cartesianX = points.x.data(), buffers.cartesianY = points.y.data(), buffers.cartesianZ = points.z.data();
  auto vector = reader.SetUpData3DPointsData(0, count, buffers);
  const bool is_whole = vector.read() == count;
  vector.close();
  return is_whole ? std::optional(std::move(points)) : std::nullopt;
}

bool write_integers_with_libe57(const std::string& path, const std::vector<Eigen::Vector3f>& points_mm) {
  std::vector<double> x, y, z;
  for (const Eigen::Vector3f& point : points_mm) {
    x.push_back(1e-3 * static_cast<double>(point.x()));
    y.push_back(1e-3 * static_cast<double>(point.y()));
    z.push_back(1e-3 * static_cast<double>(point.z()));
  }
  e57::Writer writer(path, e57::WriterOptions{});
  e57::Data3D header;
  header.guid = "{bench}";
  header.pointCount = points_mm.size();
  auto& fields = header.pointFields;
  fields.cartesianXField = fields.cartesianYField = fields.cartesianZField = true;
  fields.pointRangeNodeType = e57::NumericalNodeType::ScaledInteger;
  fields.pointRangeScale = 1e-5;
  fields.pointRangeMinimum = -10.0, fields.pointRangeMaximum = 10.0;  // 21 bits
  e57::Data3DPointsDouble buffers;
  buffers.cartesianX = x.data(), buffers.cartesianY = y.data(), buffers.cartesianZ = z.data();
  writer.WriteData3DData(header, buffers);
  return writer.Close();
}

}  // namespace asbuilt::bench
