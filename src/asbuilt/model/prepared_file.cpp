// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/prepared_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <string>
#include <string_view>
#include <utility>

#include "asbuilt/io/file.h"
#include "asbuilt/model/byte_stream.h"
#include "asbuilt/model/search_structures.h"

namespace asbuilt::model {
namespace {

// A letter that no text begins with, then line ends that a transfer in text mode would spoil.
constexpr std::string_view kMagic(
    "\x89"
    "ASBUILT-MODEL\r\n",
    16);
constexpr std::uint32_t kVersion = 4, kVersionWithoutNames = 3;
constexpr std::size_t kDigestSize = 64;                                                  // hexadecimal digits
constexpr std::size_t kHeaderSize = 16 + sizeof(std::uint32_t) + sizeof(std::uint64_t);  // magic, version, body's size

// The numbers of the report, in the order of the file; new ones go to the end, with a new version.
std::array<std::size_t*, 7> counts_of(PreparationReport& report) {
  return {&report.triangles_in,  &report.vertices_welded, &report.degenerate_dropped, &report.duplicates_dropped,
          &report.inner_dropped, &report.flipped,         &report.open_edges};
}

// One list of members for writing and reading.
template <class Stream>
void transfer(PreparedModel& model, const Stream& stream) {
  stream(model.diameter);
  stream(model.sampling_distance);
  stream(model.skin.vertices);
  stream(model.skin.triangles);
  stream(model.skin.cad_faces);
  stream(model.samples.positions);
  stream(model.samples.normals);
  stream(model.dense_samples.positions);
  stream(model.dense_samples.normals);
  stream(model.source_path);
  stream(model.source_sha256);
}

// Four columns a motion: those of the rotation, then the translation.
using Columns = std::vector<Eigen::Vector3d>;

void append(Columns& columns, const Pose& motion) {
  for (int i = 0; i < 3; ++i) columns.emplace_back(motion.linear().col(i));
  columns.emplace_back(motion.translation());
}

Pose motion_at(const Columns& columns, std::size_t index) {
  Pose motion = Pose::Identity();
  for (std::size_t i = 0; i < 3; ++i) motion.linear().col(static_cast<Eigen::Index>(i)) = columns[4 * index + i];
  motion.translation() = columns[4 * index + 3];
  return motion;
}

// Shares stand in a column of their own; a vector has three numbers.
Eigen::Vector3d share_column(double share) { return {share, 0.0, 0.0}; }

void write_symmetry(const SymmetryGroup& group, ByteWriter& writer) {
  Columns columns{group.centre, group.axis}, near, axes;
  for (const Pose& element : group.elements) append(columns, element);
  for (const NearSymmetry& n : group.near) {
    append(near, n.motion);
    near.insert(near.end(), {n.breaks_at, share_column(n.share)});
  }
  for (const NearAxis& a : group.near_axes) axes.insert(axes.end(), {a.axis, a.point, share_column(a.share)});
  writer.put(static_cast<std::uint64_t>(group.kind));
  writer.put(static_cast<std::uint64_t>(group.order));
  for (const Columns& list : {columns, near, axes}) writer.put(list);
}

bool read_symmetry(ByteReader& reader, SymmetryGroup& group) {
  std::uint64_t kind = 0, order = 0;
  Columns columns, near, axes;
  reader.get(kind);
  reader.get(order);
  for (Columns* list : {&columns, &near, &axes}) reader.get(*list);
  constexpr auto kLastKind = static_cast<std::uint64_t>(SymmetryGroup::Kind::sphere);
  const bool has_shape = columns.size() >= 6 && columns.size() % 4 == 2 && near.size() % 6 == 0 && axes.size() % 3 == 0;
  if (!reader.ok() || kind > kLastKind || order > 1000000 || !has_shape) return false;
  group.kind = static_cast<SymmetryGroup::Kind>(kind);
  group.order = static_cast<int>(order);
  group.centre = columns[0];
  group.axis = columns[1];
  group.elements.clear();
  const Columns motions(columns.begin() + 2, columns.end());
  for (std::size_t i = 0; 4 * i < motions.size(); ++i) group.elements.push_back(motion_at(motions, i));
  for (std::size_t i = 0; i < near.size(); i += 6) {
    const Columns entry(near.begin() + static_cast<std::ptrdiff_t>(i),
                        near.begin() + static_cast<std::ptrdiff_t>(i + 6));
    group.near.push_back({motion_at(entry, 0), entry[5].x(), entry[4]});
  }
  for (std::size_t i = 0; i < axes.size(); i += 3) group.near_axes.push_back({axes[i], axes[i + 1], axes[i + 2].x()});
  return true;
}

std::string body_of(PreparedModel model) {
  ByteWriter writer;
  transfer(model, [&](const auto& member) { writer.put(member); });
  for (const std::size_t* count : counts_of(model.report)) writer.put(static_cast<std::uint64_t>(*count));
  writer.put(static_cast<std::uint64_t>(model.report.notes.size()));
  for (const std::string& note : model.report.notes) writer.put(note);
  write_symmetry(model.symmetry, writer);
  writer.put(static_cast<std::uint64_t>(model.face_names.size()));
  for (const io::CadFaceName& face : model.face_names) {
    writer.put(face.name);
    writer.put(face.part);
  }
  return writer.bytes();
}

void read_names(ByteReader& reader, io::CadFaceNames& names) {
  std::uint64_t count = 0;
  reader.get(count);
  for (std::uint64_t i = 0; i < count && reader.ok(); ++i) {
    io::CadFaceName& face = names.emplace_back();
    reader.get(face.name);
    reader.get(face.part);
  }
}

bool read_body(std::string_view body, std::uint32_t version, PreparedModel& model) {
  ByteReader reader(body);
  transfer(model, [&](auto& member) { reader.get(member); });
  for (std::size_t* count : counts_of(model.report)) {
    std::uint64_t value = 0;
    reader.get(value);
    *count = static_cast<std::size_t>(value);
  }
  std::uint64_t notes = 0;
  reader.get(notes);
  for (std::uint64_t i = 0; i < notes && reader.ok(); ++i) reader.get(model.report.notes.emplace_back());
  if (!read_symmetry(reader, model.symmetry)) return false;
  if (version > kVersionWithoutNames) read_names(reader, model.face_names);
  return reader.at_end();
}

template <class Points>
bool all_finite(const Points& points) {
  return std::ranges::all_of(points, [](const auto& point) { return point.allFinite(); });
}

// The digest tells damage; this tells a file that was written wrongly, before it can hurt.
bool is_consistent(const SymmetryGroup& group) {
  const auto is_motion = [](const Pose& motion) { return is_rigid(motion.matrix()); };
  const auto is_axis = [](const Eigen::Vector3d& axis, const Eigen::Vector3d& point) {
    return std::abs(axis.norm() - 1.0) < 1e-6 && point.allFinite();
  };
  return is_axis(group.axis, group.centre) && std::ranges::all_of(group.elements, is_motion) &&
         group.elements.front().matrix() == Eigen::Matrix4d::Identity() &&
         std::ranges::all_of(group.near, [&](const NearSymmetry& near) { return is_motion(near.motion); }) &&
         std::ranges::all_of(group.near_axes, [&](const NearAxis& near) { return is_axis(near.axis, near.point); });
}

bool is_consistent(const PreparedModel& model) {
  const auto in_range = [&](const Eigen::Vector3i& t) {
    return t.minCoeff() >= 0 && static_cast<std::size_t>(t.maxCoeff()) < model.skin.vertices.size();
  };
  const auto is_oriented = [](const PointCloud& cloud) {
    return !cloud.empty() && cloud.normals.size() == cloud.size() && all_finite(cloud.positions) &&
           all_finite(cloud.normals);
  };
  const bool has_size = model.diameter > 0.0 && std::isfinite(model.diameter) && model.sampling_distance > 0.0 &&
                        model.sampling_distance <= model.diameter;
  const bool has_faces = model.skin.cad_faces.empty() || model.skin.cad_faces.size() == model.skin.triangles.size();
  return has_size && has_faces && !model.skin.empty() && all_finite(model.skin.vertices) &&
         std::ranges::all_of(model.skin.triangles, in_range) && is_oriented(model.samples) &&
         is_oriented(model.dense_samples) && is_consistent(model.symmetry);
}

}  // namespace

Result<void> save_prepared(const std::filesystem::path& path, const PreparedModel& model) {
  const std::string body = body_of(model);
  ByteWriter header;
  header.put(kVersion);
  header.put(static_cast<std::uint64_t>(body.size()));
  return io::write_file(path, std::string(kMagic) + header.bytes() + body + io::sha256(body));
}

Result<PreparedModel> load_prepared(const std::filesystem::path& path, const Context& context, PreparedFor use) {
  ASBUILT_TRY(content, io::read_file(path));
  const auto refuse = [&](std::string_view what) {
    return fail(ErrorCode::unreadable_input, fmt::format("{}: {}", path.string(), what));
  };
  if (!content.starts_with(kMagic)) return refuse("this is not a prepared model, as `asbuilt prepare` writes it");
  if (content.size() < kHeaderSize) return refuse("the prepared model is cut off in its header; prepare it again");
  ByteReader header(std::string_view(content).substr(kMagic.size(), kHeaderSize - kMagic.size()));
  std::uint32_t version = 0;
  std::uint64_t size = 0;
  header.get(version);
  header.get(size);
  if (version != kVersion && version != kVersionWithoutNames) {
    return refuse(
        fmt::format("the prepared model has format version {}, this program reads versions {} and {}; prepare "
                    "it again with this program{}",
                    version, kVersionWithoutNames, kVersion, version > kVersion ? ", or use a newer one" : ""));
  }
  const std::size_t rest = content.size() - kHeaderSize;
  if (size > rest || rest - size != kDigestSize) {
    return refuse(
        fmt::format("the prepared model has {} bytes after its header, {} + {} were announced; prepare it again", rest,
                    size, kDigestSize));
  }
  const std::string_view body = std::string_view(content).substr(kHeaderSize, static_cast<std::size_t>(size));
  if (io::sha256(body) != std::string_view(content).substr(content.size() - kDigestSize)) {
    return refuse("the prepared model is damaged (its checksum does not match); prepare it again");
  }
  PreparedModel model;
  if (!read_body(body, version, model) || !is_consistent(model)) {
    return refuse("the prepared model contradicts itself; prepare it again");
  }
  if (use == PreparedFor::inspection) {
    build_inspection_structures(model);
  } else {
    build_search_structures(model, context);
  }
  if (context.cancelled()) return fail(ErrorCode::cancelled, "the loading of the model was stopped");
  return model;
}

bool is_prepared_file(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return false;  // also keeps off pipes
  std::ifstream file(path, std::ios::binary);
  std::array<char, kMagic.size()> beginning{};
  file.read(beginning.data(), beginning.size());
  return file.gcount() == static_cast<std::streamsize>(kMagic.size()) &&
         std::string_view(beginning.data(), beginning.size()) == kMagic;
}

}  // namespace asbuilt::model
