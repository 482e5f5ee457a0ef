// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/viewpoint_file.h"

#include "asbuilt/io/file.h"
#include "asbuilt/io/named_rows.h"
#include "asbuilt/io/readers.h"

namespace asbuilt::io {

Result<std::vector<NamedViewpoint>> viewpoints_from(const Input& input, Unit unit) {
  ASBUILT_TRY(rows, read_named_rows(input, 3, "name,x,y,z"));
  std::vector<NamedViewpoint> viewpoints;
  for (const NamedRow& row : rows) {
    viewpoints.push_back(
        {row.name, Eigen::Vector3d(row.values[0], row.values[1], row.values[2]) * millimetres_per(unit)});
  }
  return viewpoints;
}

Result<std::vector<NamedViewpoint>> read_viewpoints(const std::filesystem::path& path, Unit unit) {
  ASBUILT_TRY(content, read_file(path));
  return viewpoints_from({path.string(), content}, unit);
}

}  // namespace asbuilt::io
